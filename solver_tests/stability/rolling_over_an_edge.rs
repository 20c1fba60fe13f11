//! A hexagonal prism rolled from one face over an edge onto the next, pressed down by P.
//!
//! Contact moves from a face's corners to one edge and to the next face's corners; codes that key histories to other
//! places lose multipliers and slip there. Rolling on the core's corner at distance c from the axis, the driver's moment
//! is `P c sin(30 deg - angle)`: the corner is that far ahead of the axis. Tolerances: 2e-3 P c on the
//! moment, away from the first and last degree, where the face's other corner still carries; the ledger
//! closes to 1e-3 of the largest work, P times the rise of the axis. Where the moment jumps from nothing to `P c / 2` as a face
//! lifts, the trapezoidal rule of the ledger cannot follow: those increments are counted apart.

use riprap::verification::edges::{ROLLING_LOAD, prism_size, rolled, worst_moment};

use crate::audited::{audited, last, tell};

#[test]
fn moment_and_work_are_continuous() {
    for (increments, faces) in [(60, 1), (240, 1), (240, 2)] {
        let run = audited(&rolled(increments, faces));
        let [apothem, core] = prism_size();
        assert!(run.finished(), "{:?}", run.end);
        let worst = worst_moment(&run, faces);
        let mut error = 0.0;
        let mut before = None;
        for row in run.rows.iter().filter(|row| row.stage == 1) {
            let angle = row.progress * 60.0 * faces as f64;
            let on_face = angle % 60.0;
            let smooth = (0.99..=59.01).contains(&on_face);
            if let Some(before) = before.filter(|_| smooth) {
                error += row.ledger.error() - before;
            }
            before = smooth.then(|| row.ledger.error());
        }
        let rise = ROLLING_LOAD * (core - core * (30.0f64).to_radians().cos());
        let ledger = last(&run).ledger;
        tell(&run, &format!("rolling, {increments} increments, moment"), worst, 0.0);
        println!(
            "    error of the ledger {:.2e} of the work over a crest, with the jumps {:.2e}; friction {:.2e}, stabilisation {:.2e} of it; \
             height {:.3e} m off",
            error / rise,
            ledger.error() / rise,
            ledger.friction / rise,
            ledger.stabilisation / rise,
            last(&run).bodies[1].position.z - apothem
        );
        assert!(worst < 2e-3, "{worst}");
        assert!(error.abs() < 1e-3 * rise * faces as f64, "{error} of {rise}");
    }
}
