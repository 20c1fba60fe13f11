//! First guesses that must not matter: penalties of condensed contacts, drag of rigid bodies.
//!
//! A cube between a fixed plate and a driven one, turned a little so that edges and corners touch.
//! Penalties start between 1e-3 and 1e3 times the default and adapt. A state is accepted when gaps and
//! forces agree to the gap tolerance, here 1e-6 of the cube's size, 0.03 um; the cube gives way by
//! about 10 um at either plate, so forces may differ by 0.3 % there, and 1 % is allowed for both and
//! for friction, which remembers the way. With gaps to 1e-8, 0.3 nm, these are 3e-5 an increment and plate, 3e-4 in all.
//!
//! The contacts of rigid bodies are springs, without multipliers; what is guessed there is the drag of the first step, 1e-3 to 1e3
//! times the default. A wedge pressed between walls, forces balanced to 1e-5.
//!
//! Independent of the coupling: the work of the driven plate is the energy of springs and grain, up to the
//! trapezoidal rule's error, which falls with the square of the increment, and to what the gap tolerance
//! leaves of each force (1 % of what a contact yields).

use std::sync::Arc;

use riprap::grain::CondensedGrain;
use riprap::loading::StageEnd;
use riprap::material::Elastic;
use riprap::mesh::cuboid_mesh;
use riprap::scene::{Scene, SceneBody, SceneParameters};
use riprap::verification::bodies::{DENSITY, HELD, body, cuboid, drive, fixed, load, scene, sharp};
use riprap::verification::wedges::{on_wall, pressed};

use crate::audited::{audited, last};

const EDGE: f64 = 0.03;

/// The cube, squeezed by 30 um.
fn cube(increments: usize, friction: f64) -> SceneParameters {
    let mesh = cuboid_mesh([EDGE; 3], 0.5 * EDGE).expect("a mesh");
    let rock = vec![Elastic::new(30e9, 0.2).expect("allowed"); mesh.cells.len()];
    let grain = CondensedGrain::new(mesh, &rock, DENSITY).expect("a grain");
    let cube = body("cube", cuboid([EDGE; 3]), [0.0, 0.0, 0.5 * EDGE], [0.0; 3]);
    let cube = SceneBody { grain: Some(Arc::new(grain)), ..cube };
    let plate = |name: &str, z: f64| body(name, cuboid([0.1, 0.1, 0.02]), [0.0, 0.0, z], [0.0, 0.0, 0.4]);
    let bodies = vec![fixed(plate("bottom", -0.01)), cube, plate("top", EDGE + 0.01)];
    let push = drive([Some(0.0), Some(0.0), Some(-30e-6)], HELD);
    scene(bodies, friction, vec![load(increments, "top", push)])
}

fn squeezed(first_penalty: f64, increments: usize, friction: f64, sharp: bool) -> (f64, f64, f64, usize) {
    let mut parameters = cube(increments, friction);
    parameters.settings.first_penalty = first_penalty;
    parameters.settings.gap_tolerance = if sharp { 1e-8 } else { 1e-6 };
    parameters.settings.force_tolerance = if sharp { 1e-5 } else { 1e-3 };
    let mut scene = Scene::new(&parameters).expect("a sound scene");
    let (mut force, mut augmentations) = (0.0, 0);
    let end = scene.run(|_, row| {
        force = row.bodies[2].contact_force.z;
        augmentations += row.counters.augmentations;
        true
    });
    assert_eq!(end, StageEnd::Finished, "first penalty {first_penalty}");
    (force, scene.ledger.external, scene.ledger.elastic + scene.ledger.friction, augmentations)
}

#[test]
fn penalties_change_the_pace_only() {
    for (sharp, tolerance) in [(false, 0.01), (true, 3e-4)] {
        let (reference, ..) = squeezed(1.0, 4, 0.3, sharp);
        assert!(reference > 0.0);
        for first_penalty in [1e-3, 1e-1, 10.0, 1e3] {
            let (force, _, _, augmentations) = squeezed(first_penalty, 4, 0.3, sharp);
            let what = format!("first penalty {first_penalty:.0e}: {force:.3} N of {reference:.3} N");
            println!("{what}, {augmentations} augmentations");
            assert!((force / reference - 1.0).abs() < tolerance, "{what}");
        }
    }
}

#[test]
fn drag_changes_the_pace_only() {
    let angle = 20f64.to_radians();
    let force = |first_drag: f64| {
        let mut parameters = sharp(pressed(angle, 0.65));
        parameters.settings.drag_to_rest[0] *= first_drag;
        let run = audited(&parameters);
        assert!(run.finished(), "first drag {first_drag}: {:?}", run.end);
        on_wall(last(&run), 2, angle)[0]
    };
    let reference = force(1.0);
    for first_drag in [1e-3, 1e-1, 10.0, 1e3] {
        let force = force(first_drag);
        assert!((force / reference - 1.0).abs() <= 1e-4, "first drag {first_drag}: {force} N, {reference} N");
    }
}

/// All stick at a coefficient of 5; at 0.3 some slip.
#[test]
fn work_is_energy_to_second_order() {
    for friction in [0.0, 5.0] {
        let error = |increments: usize| {
            let (_, work, stored, _) = squeezed(1.0, increments, friction, true);
            (work / stored - 1.0).abs()
        };
        let errors = [4, 8, 16].map(error);
        println!("friction {friction}: work against energy {errors:?} in 4, 8, 16 increments");
        // A quarter each, and some room for where in an increment the contacts first touch.
        assert!(errors[1] < 0.4 * errors[0] && errors[2] < 0.4 * errors[1], "{errors:?}");
    }
    let (_, work, stored, _) = squeezed(1.0, 16, 0.3, false);
    assert!((work / stored - 1.0).abs() < 1e-2, "{}", work / stored - 1.0);
}

/// What the tolerance leaves of the stretch of contacts that stick is made up for, not lost: cut into 32
/// increments the force is that of 4, to the 0.3 % that a single one may miss.
#[test]
fn tolerances_do_not_add_up() {
    let force = |increments: usize| squeezed(1.0, increments, 0.3, false).0;
    let (few, many) = (force(4), force(32));
    println!("{few:.2} N in 4 increments, {many:.2} N in 32");
    assert!((many / few - 1.0).abs() < 3e-3, "{few} {many}");
}
