//! A block of width b and height h on a plane, gravity turning.
//!
//! It slides at `tan(angle) = mu`, or tips first, at `tan(angle) = (b - 2 r) / h` where that is less: its
//! edges are rounded with r, so that the face it stands on ends r before the block does
//! (without rounding b/h; Heyman & al.'s rigid block, any textbook of statics).
//! The angle found is the last with an equilibrium. Tolerance on its tangent: the smallest increment turns gravity by
//! 1/64 of a twentieth of the way, which is 1.2 times the limit: 1e-3; and forces balance to 1e-5.

use crate::scene_builder::{ROUNDING, Run, body, cuboid, gravity, ground, scene, sharp};

const TOLERANCE: f64 = 1.2e-3;

/// Tangent of the steepest incline on which a block of this width and height stands.
fn steepest(width: f64, height: f64, friction: f64, expected: f64) -> (f64, Run) {
    let block = body("block", cuboid([width, 0.1, height]), [0.0, 0.0, 0.5 * height], [0.0; 3]);
    let end = 1.2 * expected;
    let stages = vec![gravity(4, [0.0, 0.0, -9.81]), gravity(20, [9.81 * end, 0.0, -9.81])];
    let run = Run::of(&sharp(scene(vec![ground(), block], friction, stages)));
    let last = run.last();
    assert!(!run.finished(), "friction {friction}: stands at 1.2 of the limit");
    (last.gravity.x / -last.gravity.z, run)
}

#[test]
fn slides_at_the_friction_angle() {
    for friction in [0.1, 0.2, 0.4, 0.65, 0.8] {
        let (tangent, run) = steepest(0.1, 0.1, friction, friction);
        run.tell(&format!("block slides, mu {friction}"), tangent, friction);
        assert!((tangent / friction - 1.0).abs() < TOLERANCE, "{tangent} for {friction}");
    }
}

#[test]
fn tips_before_it_slides() {
    for slenderness in [0.1, 0.2, 0.3, 0.5] {
        let (height, friction) = (0.1, 0.8);
        let width: f64 = slenderness * height;
        let expected = (width - 2.0 * ROUNDING * width.min(0.1)) / height;
        let (tangent, run) = steepest(width, height, friction, expected);
        run.tell(&format!("block tips, b/h {slenderness}"), tangent, expected);
        assert!((tangent / expected - 1.0).abs() < TOLERANCE, "{tangent} for {expected}");
    }
}
