//! A block of width b and height h on a plane, gravity turning.
//!
//! It slides at `tan(angle) = mu`, or tips first, at `tan(angle) = (b - 2 r) / h` where that is less: its
//! edges are rounded with r, so that the face it stands on ends r before the block does
//! (without rounding b/h; Heyman & al.'s rigid block, any textbook of statics).
//! The angle found is the last with an equilibrium. Tolerance on its tangent: the smallest increment turns gravity by
//! 1/64 of a twentieth of the way, which is 1.2 times the limit: 1e-3; and forces balance to 1e-5.

use riprap::verification::blocks::{STEEPEST, steepest, tilted, tipping};

use crate::audited::{audited, tell};

#[test]
fn slides_at_the_friction_angle() {
    for friction in [0.1, 0.2, 0.4, 0.65, 0.8] {
        let run = audited(&tilted(0.1, 0.1, friction, friction));
        let tangent = steepest(&run);
        tell(&run, &format!("block slides, mu {friction}"), tangent, friction);
        assert!((tangent / friction - 1.0).abs() < STEEPEST, "{tangent} for {friction}");
    }
}

#[test]
fn tips_before_it_slides() {
    for slenderness in [0.1, 0.2, 0.3, 0.5] {
        let (height, friction) = (0.1, 0.8);
        let width: f64 = slenderness * height;
        let expected = tipping(width, height);
        let run = audited(&tilted(width, height, friction, expected));
        let tangent = steepest(&run);
        tell(&run, &format!("block tips, b/h {slenderness}"), tangent, expected);
        assert!((tangent / expected - 1.0).abs() < STEEPEST, "{tangent} for {expected}");
    }
}
