//! What friction takes where contacts are lost within an increment.
//!
//! - A block under N, held upright, is pushed over the edge of a table. Its corners leave, the table's edge takes over, and nobody can tell from the
//!   push: friction takes `mu N` times the way, whatever the increment. Tolerance: forces balance to 1e-3.
//! - A block pressed in by d and drawn along by L while it is lifted by 2 d is in touch over the first half of the way, under a force that falls to
//!   nothing: friction takes `mu F L / 4`, F being the normal force at the start, and what the four corners' tangential springs k had stored,
//!   `(mu F)^2 / (8 k)`. Tolerance: forces set in smoothly, over 4e-3 of the rounding, which is 0.08 of d.

use riprap::verification::bodies::{HELD, body, cuboid, drive, fixed, ground, load, push, scene};

use crate::audited::{audited, tell};
use riprap::verification::Run;

const FRICTION: f64 = 0.4;

/// External work, friction and error of the ledger [J] over the last stage.
fn last_stage(run: &Run) -> [f64; 3] {
    let stage = run.rows.last().map_or(0, |row| row.stage);
    let end = |of: &dyn Fn(usize) -> bool| run.rows.iter().rfind(|row| of(row.stage)).map(|row| row.ledger);
    let (before, after) = (end(&|s| s < stage).unwrap_or_default(), end(&|s| s == stage).unwrap_or_default());
    [after.external - before.external, after.friction - before.friction, after.error() - before.error()]
}

#[test]
fn others_take_over_at_an_edge() {
    let (normal, travel) = (1000.0, 0.03);
    let table = || fixed(body("table", cuboid([0.2, 0.2, 0.1]), [0.0, 0.0, -0.05], [0.0; 3]));
    for increments in [4, 15, 60] {
        let block = body("block", cuboid([0.1; 3]), [0.045, 0.0, 0.05], [0.0; 3]);
        let along = |x: f64| drive([Some(x), None, None], HELD);
        let stages = vec![
            load(5, "block", push([0.0, 0.0, -normal])),
            load(20, "block", along(1e-4)),
            load(increments, "block", along(travel)),
        ];
        let run = audited(&scene(vec![table(), block], FRICTION, stages));
        assert!(run.finished(), "{:?}", run.end);
        let [external, friction, error] = last_stage(&run);
        let expected = FRICTION * normal * travel;
        tell(&run, &format!("friction over an edge in {increments} increments"), friction, expected);
        assert!((friction / expected - 1.0).abs() < 1e-3, "{increments}: {friction} of {expected} J");
        assert!(error.abs() < 1e-3 * external, "{increments}: {error} of {external} J");
    }
}

#[test]
fn bodies_come_apart() {
    let (depth, travel) = (1e-4, 1e-3);
    for increments in [1, 2, 5, 32] {
        let block = body("block", cuboid([0.1; 3]), [0.0, 0.0, 0.05], [0.0; 3]);
        let by = |x: f64, z: f64| drive([Some(x), Some(0.0), Some(z)], HELD);
        let stages = vec![
            load(20, "block", by(0.0, -depth)),
            load(20, "block", by(2e-4, 0.0)),
            load(increments, "block", by(travel, 2.0 * depth)),
        ];
        let run = audited(&scene(vec![ground(), block], FRICTION, stages));
        assert!(run.finished(), "{:?}", run.end);
        let start = run.rows.iter().rfind(|row| row.stage == 1).expect("a row").bodies[1].contact_force.z;
        let [_, friction, _] = last_stage(&run);
        let (model, force) = (&run.scene.model, FRICTION * start);
        let stored = force * force / (8.0 * model.contact_stiffness(0, 1) * model.law.tangential_ratio);
        let expected = 0.25 * force * travel + stored;
        tell(&run, &format!("friction of a block lifted in {increments} increments"), friction, expected);
        assert!((friction / expected - 1.0).abs() < 0.05, "{increments}: {friction} of {expected} J");
    }
}
