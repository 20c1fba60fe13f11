//! Condensed bodies: the answer does not depend on the first penalty of the contacts.
//!
//! A cube between a fixed plate and a driven one, turned a little so that edges and corners touch.
//! Penalties start between 1e-3 and 1e3 times the default and adapt. A state is accepted when gaps and
//! forces agree to the gap tolerance, here 1e-6 of the cube's size, 0.03 um; the cube gives way by
//! about 10 um at either plate, so forces may differ by 0.3 % there, and 1 % is allowed for both and
//! for friction, which remembers the way.
//!
//! Independent of the coupling: the work of the driven plate is the energy of springs and grain, up to the
//! trapezoidal rule's error, which falls with the square of the increment, and to what the gap tolerance
//! leaves of each force (1 % of what a contact yields).

use riprap::loading::StageEnd;
use riprap::scene::Scene;
use riprap::verification::penalties;

fn squeezed(first_penalty: f64, increments: usize, friction: f64, sharp: bool) -> (f64, f64, f64, usize) {
    let mut parameters = penalties::squeezed(increments, friction);
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
    let (reference, ..) = squeezed(1.0, 4, 0.3, false);
    assert!(reference > 0.0);
    for first_penalty in [1e-3, 1e-1, 10.0, 1e3] {
        let (force, _, _, augmentations) = squeezed(first_penalty, 4, 0.3, false);
        println!(
            "first penalty {first_penalty:.0e}: {force:.3} N of {reference:.3} N, {augmentations} augmentations"
        );
        assert!(
            (force / reference - 1.0).abs() < 0.01,
            "first penalty {first_penalty}: {force} N, {reference} N"
        );
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
