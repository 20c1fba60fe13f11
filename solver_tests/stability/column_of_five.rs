//! Five balls in a column, off line by a thousandth of their radius, squeezed between plates that grip.
//!
//! The straight column buckles: there is no equilibrium near by, and Newton's method diverges. What is to come out: the snap to the next
//! equilibrium (the balls pop out of line, the force drops), its energy booked as stabilisation, or a stop
//! with a reason; never a state out of balance or an overlap (each run is audited).

use riprap::scene::SceneShape;
use riprap::triaxial::StageEnd;

use crate::scene_builder::{HELD, Run, body, cuboid, drive, ground, load, scene};

#[test]
fn snaps_or_says_why_not() {
    for friction in [0.3, 0.8] {
        let radius = 0.01;
        let mut bodies = vec![ground()];
        let mut stage = load(20, "ram", drive([Some(0.0), Some(0.0), Some(-4e-4)], HELD));
        for k in 0..5 {
            let off = 1e-3 * radius * if k % 2 == 0 { 1.0 } else { -1.0 };
            let place = [off, 0.0, radius * (2.0 * k as f64 + 1.0)];
            bodies.push(body(&format!("ball {k}"), SceneShape::Sphere(radius), place, [0.0; 3]));
            let plane = drive([None, Some(0.0), None], [Some(0.0), None, Some(0.0)]);
            stage.bodies.push((format!("ball {k}"), plane));
        }
        bodies.push(body("ram", cuboid([0.1, 0.1, 0.02]), [0.0, 0.0, 10.0 * radius + 0.01], [0.0; 3]));
        let run = Run::of(&scene(bodies, friction, vec![stage]));
        let largest = run.rows.iter().map(|row| row.bodies[6].contact_force.z).fold(0.0, f64::max);
        println!("column, mu {friction}: {:?}, largest force {largest:.3e} N", run.end);
        if let Some(row) = run.rows.last() {
            let ledger = row.ledger;
            run.tell("column, force at the end", row.bodies[6].contact_force.z, 0.0);
            println!("    {ledger:?} error {:.2e}", ledger.error());
        }
        match &run.end {
            StageEnd::Finished => {}
            StageEnd::Stopped { reason } => assert!(reason.contains("out of balance"), "{reason}"),
            StageEnd::Interrupted => panic!("nobody interrupted"),
        }
    }
}
