//! Runs of problems with known answers for the tests: no accepted state may fail its audit.

#![allow(dead_code, reason = "shared by several test programs, none of which uses all of it")]

use riprap::scene::{Row, SceneParameters};
use riprap::verification::Run;

/// Runs a scene; panics where an accepted state overlaps.
pub fn audited(parameters: &SceneParameters) -> Run {
    let run = Run::of(parameters);
    assert_eq!(run.fault, None);
    run
}

/// The last accepted increment, which has to be there.
pub fn last(run: &Run) -> &Row {
    run.last().unwrap_or_else(|| panic!("no increment was accepted: {:?}", run.end))
}

/// Prints one line of the table of problems.
pub fn tell(run: &Run, problem: &str, computed: f64, reference: f64) {
    println!(
        "{problem:<44} computed {computed:<13.6e} reference {reference:<13.6e} error {:<10.2e} rows {:<4} \
         factorisations {:<6} cuts {:<3} overlap {:.2e} m  {:.3} s",
        computed - reference,
        run.rows.len(),
        run.factorisations(),
        run.cuts(),
        run.deepest,
        run.time.as_secs_f64()
    );
}
