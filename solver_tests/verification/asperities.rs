//! Corners of rock that are pressed in, let go, and meet others.
//!
//! A cube's corner (rounding R, cone of the area of a corner's section) is driven straight down onto a floor, whose force is the law's at that
//! indentation, `contact::asperity` (closed forms and their sources stand there). Lifted and set down elsewhere it is as it was left. Tolerances: prescribed
//! motion, so forces are the law's to rounding, 1e-9; work is that of the trapezoidal rule, second order in the increment.

use riprap::verification::asperities::{STEP, corner, force, law_of_corner as law};

use crate::audited::audited;

fn assert_near(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-9 * expected.abs(), "{found} {expected}");
}

#[test]
fn a_crushed_corner_stays_crushed_for_what_it_meets_next() {
    let [deep, back, lifted] = [0.3e-3, 0.02e-3, 1e-3];
    // Not quite as deep as it was crushed.
    let free = 0.999 * law().update(0.0, deep).depth;
    let run = audited(&corner(
        0.0,
        &[
            (60, [0.0, 0.0, -deep]),
            (10, [0.0, 0.0, back]),
            (5, [0.0, 0.0, deep - back + lifted]),
            (5, [STEP, 0.0, 0.0]),
            // Where nothing bears yet; then within what is elastic; then deeper than before.
            (20, [0.0, 0.0, -lifted - free]),
            (10, [0.0, 0.0, free - deep + back]),
            (40, [0.0, 0.0, -back - 0.05e-3]),
        ],
    ));
    assert!(run.finished(), "{}", run.trouble());
    let first = law().update(0.0, deep);
    assert_near(force(&run, 0), first.force);
    assert_near(force(&run, 1), law().update(first.depth, deep - back).force);
    assert_eq!(force(&run, 3), 0.0);
    assert_eq!(force(&run, 4), 0.0);
    assert_near(force(&run, 5), law().update(first.depth, deep - back).force);
    let last = law().update(first.depth, deep + 0.05e-3);
    assert_near(force(&run, 6), last.force);
    let ledger = run.at_end(|row| row.ledger.indentation);
    assert!((ledger / law().work_of_crushing(last.depth) - 1.0).abs() < 1e-9, "{ledger}");
}

/// What is put in is stored or crushes, the error of the books second order in the increment; with friction held on to and slid on, on patches that
/// grow and stay.
#[test]
fn work_is_stored_crushes_or_rubs() {
    for friction in [0.0, 0.4] {
        let off = |increments: usize| {
            let run = audited(&corner(
                friction,
                &[
                    (increments, [0.0, 0.0, -0.1e-3]),
                    (increments, [0.01e-3, 0.0, -0.1e-3]),
                    (increments, [0.05e-3, 0.02e-3, -0.02e-3]),
                    (increments, [-0.03e-3, 0.0, 0.01e-3]),
                ],
            ));
            assert!(run.finished(), "{}", run.trouble());
            let ledger = run.last().expect("rows").ledger;
            assert!(ledger.indentation > 0.0 && ledger.damage == ledger.indentation);
            assert_eq!(ledger.friction > 0.0, friction > 0.0);
            assert_eq!(ledger.stabilisation, 0.0, "no increment snaps");
            ledger.error().abs() / ledger.external
        };
        let [coarse, fine] = [off(20), off(40)];
        assert!(fine < 1e-3, "{friction}: {coarse:.1e} {fine:.1e}");
        assert!(fine < 0.5 * coarse, "{friction}: {coarse:.1e} {fine:.1e}");
    }
}
