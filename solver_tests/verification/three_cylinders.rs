//! A cylinder on two equal ones that lie on the ground, side by side; weight W each.
//!
//! Statics: stands iff the mutual friction is at least `tan 15 deg = 0.2679` and the ground's at least a third of that, 0.0893 (each lower
//! cylinder turns freely, so both its tangential forces are equal, `W / 2 tan 15 deg`, and the ground carries 3 W / 2). The
//! cylinders are spheres that may only move and turn in the plane, which is the same statics.
//! Tolerance 2e-3: forces balance to 1e-5 of the mean contact force, contacts yield by 1e-5 of the radius, and friction takes
//! hold of the last per cent of its bound softly.

use riprap::verification::standing::{CYLINDERS, cylinders, cylinders_need, stands};

use crate::audited::{audited, tell};

#[test]
fn stands_or_falls_by_both_frictions() {
    let need = cylinders_need();
    for (share, expected) in CYLINDERS {
        let run = audited(&cylinders(share[0] * need[0], share[1] * need[1]));
        tell(
            &run,
            &format!("three cylinders, shares {share:?}"),
            f64::from(stands(&run)),
            f64::from(expected),
        );
        assert_eq!(stands(&run), expected, "{share:?}: {:?}", run.end);
    }
}
