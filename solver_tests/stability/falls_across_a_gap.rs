//! A loose ball above stiff ground, beside a block that rests there, under gravity: it is to fall onto the ground.
//!
//! Naive methods meet a singular matrix, or hold the ball for ever. Here a body that nothing bears moves by its weight over the least drag, 1e-5 of
//! the typical stiffness, which is the median of the bodies': 0.4 um in a step. Across 10 um that takes 25 steps, beside those that the drag
//! takes to fall so low; across 0.5 mm more than there are, and the increment is given up. It then falls as a rigid body (docs/decisions/0204-scenes-fall-by-rigid-body-dynamics.md).

use riprap::scene::{SceneBody, SceneShape};
use riprap::verification::bodies::{DENSITY, body, cuboid, fixed, gravity, scene};

use crate::audited::{audited, last, tell};

fn fallen(gap: f64, max_dwell: usize) -> bool {
    let stiff = |made: SceneBody| SceneBody { youngs_modulus: 1e13, ..made };
    let ground = fixed(stiff(body("ground", cuboid([0.1, 0.1, 0.02]), [0.0, 0.0, -0.01], [0.0; 3])));
    let block = stiff(body("block", cuboid([0.02; 3]), [0.03, 0.0, 0.01], [0.0; 3]));
    let ball = body("ball", SceneShape::Sphere(0.01), [0.0, 0.0, 0.01 + gap], [0.0; 3]);
    let mut parameters = scene(vec![ground, block, ball], 0.5, vec![gravity(2, [0.0, 0.0, -9.81])]);
    parameters.settings.max_dwell = max_dwell;
    let run = audited(&parameters);
    if run.finished() {
        tell(&run, &format!("ball across {gap:e} m"), last(&run).bodies[2].displacement.z, -gap);
        let ledger = last(&run).ledger;
        tell(&run, "energy set free over work", ledger.stabilisation / ledger.external, 1.0);
        assert!(ledger.error().abs() < 1e-2 * ledger.external, "{gap:e} m: {ledger:?}");
        // It falls as soon as some of its weight acts, whichever share of an increment that is: the work is at most the whole weight's.
        let weight = 9.81 * DENSITY * 4.0 / 3.0 * std::f64::consts::PI * 1e-6;
        let set_free = ledger.stabilisation;
        assert!(set_free > 0.95 * ledger.external && set_free < 1.01 * weight * gap, "{gap:e} m: {ledger:?}");
    }
    run.finished() && (last(&run).bodies[2].displacement.z + gap).abs() < 1e-6
}

#[test]
fn a_short_way() {
    assert!(fallen(1e-5, 0));
}

#[test]
fn a_long_way() {
    assert!(!fallen(5e-4, 0), "without a fall it has no time to get there");
    for gap in [5e-4, 1e-2, 0.1] {
        assert!(fallen(gap, 300), "{gap}");
    }
}

/// It is found in a handful of augmentations, so that no snap is to be seen by their number.
#[test]
fn what_a_short_fall_sets_free_is_no_error() {
    for gap in [0.0, 1e-4, 2e-3] {
        let table = fixed(body("table", cuboid([0.5, 0.5, 0.1]), [0.0, 0.0, -0.05], [0.0; 3]));
        let block = body("block", cuboid([0.1; 3]), [0.0, 0.0, 0.05 + gap], [0.0; 3]);
        let run = audited(&scene(vec![table, block], 0.5, vec![gravity(1, [0.0, 0.0, -9.81])]));
        assert!(run.finished(), "{gap:e} m: {:?}", run.end);
        let row = last(&run);
        // The load grows from nothing in the one increment there is: its mean over the way, and at most over the micrometre that the block sinks in.
        let mean_force = 0.5 * 9.81 * DENSITY * 1e-3;
        tell(&run, &format!("block across {gap:e} m, set free"), row.ledger.stabilisation, mean_force * gap);
        assert_eq!(row.snapped, gap > 0.0, "{gap:e} m");
        // Where it rests already, a force that sets in with the square of the overlap leaves a third over: an error of the one increment.
        let share = if gap > 0.0 { 1e-2 } else { 0.34 };
        assert!(row.ledger.error().abs() < share * row.ledger.external, "{gap:e} m: {:?}", row.ledger);
        assert!((row.ledger.stabilisation - mean_force * gap).abs() < mean_force * 1e-6, "{:?}", row.ledger);
    }
}
