//! Five balls in a column, off line by a thousandth of their radius, squeezed between plates that grip.
//!
//! The straight column buckles: there is no equilibrium near by, and Newton's method diverges. What is to come out: the snap to the next
//! equilibrium (the balls pop out of line, the force drops), its energy booked as stabilisation, or a stop
//! with a reason; never a state out of balance or an overlap (each run is audited).

use riprap::loading::StageEnd;
use riprap::verification::standing::column;

use crate::audited::{audited, tell};

#[test]
fn snaps_or_says_why_not() {
    for friction in [0.3, 0.8] {
        let run = audited(&column(friction));
        let largest = run.rows.iter().map(|row| row.bodies[6].contact_force.z).fold(0.0, f64::max);
        println!("column, mu {friction}: {:?}, largest force {largest:.3e} N", run.end);
        if let Some(row) = run.rows.last() {
            let ledger = row.ledger;
            tell(&run, "column, force at the end", row.bodies[6].contact_force.z, 0.0);
            println!("    {ledger:?} error {:.2e}", ledger.error());
        }
        match &run.end {
            StageEnd::Finished => {}
            StageEnd::Stopped { reason } => assert!(reason.contains("out of balance"), "{reason}"),
            StageEnd::Interrupted => panic!("nobody interrupted"),
        }
    }
}
