//! Two cards leaning on each other, theta from the vertical, each of length L and thickness t.
//!
//! Thin cards stand iff `mu >= tan(theta) / 2`. With thickness and rounded edges (core half length l, half thickness d, rounding r)
//! the moment of a card about its foot gives the push at the top, `H = W (l sin(theta) - d cos(theta)) / (2 l cos(theta) + r)`,
//! and the foot holds iff `mu >= H / W`. Tolerance 2e-3: forces balance to 1e-5 of the mean
//! contact force, and contacts yield by less than a micron over 0.2 m.

use riprap::verification::standing::{stands, tent};

use crate::audited::{audited, tell};

#[test]
fn stands_or_falls_by_friction() {
    for degrees in [15.0f64, 25.0, 35.0, 45.0] {
        for (share, expected) in [(1.002, true), (0.998, false)] {
            let run = audited(&tent(degrees.to_radians(), share));
            let stands = stands(&run);
            tell(
                &run,
                &format!("card tent {degrees} deg, mu {share} of limit"),
                f64::from(stands),
                f64::from(expected),
            );
            assert_eq!(stands, expected, "{degrees} deg, {share} of the limit: {:?}", run.end);
        }
    }
}
