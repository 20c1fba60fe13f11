//! A cylinder on two equal ones that lie on the ground, side by side; weight W each.
//!
//! Statics: stands iff the mutual friction is at least `tan 15 deg = 0.2679` and the ground's at least a third of that, 0.0893 (each lower
//! cylinder turns freely, so both its tangential forces are equal, `W / 2 tan 15 deg`, and the ground carries 3 W / 2). The
//! cylinders are spheres that may only move and turn in the plane, which is the same statics.
//! Tolerance 2e-3: forces balance to 1e-5 of the mean contact force, contacts yield by 1e-5 of the radius, and friction takes
//! hold of the last per cent of its bound softly.

use riprap::contact::law::Friction;
use riprap::scene::{SceneBody, SceneShape};

use crate::scene_builder::{Run, body, drive, gravity, ground, scene, sharp};

fn stands(mutual: f64, floor: f64) -> (bool, Run) {
    let radius = 0.05;
    let ball = |name: &str, x: f64, z: f64| SceneBody {
        friction: Some(Friction::constant(mutual)),
        ..body(name, SceneShape::Sphere(radius), [x, 0.0, z], [0.0; 3])
    };
    let ground = SceneBody { friction: Some(Friction::constant(floor)), ..ground() };
    let top = radius * (1.0 + 3.0f64.sqrt());
    let bodies =
        vec![ground, ball("left", -radius, radius), ball("right", radius, radius), ball("top", 0.0, top)];
    let mut stage = gravity(8, [0.0, 0.0, -9.81]);
    for name in ["left", "right", "top"] {
        let plane = drive([None, Some(0.0), None], [Some(0.0), None, Some(0.0)]);
        stage.bodies.push((name.into(), plane));
    }
    let run = Run::of(&sharp(scene(bodies, 1.0, vec![stage])));
    let moved = run.rows.last().map_or(0.0, |row| row.bodies[3].displacement.norm());
    (run.finished() && moved < 1e-3, run)
}

#[test]
fn stands_or_falls_by_both_frictions() {
    let mutual = 15.0f64.to_radians().tan();
    let floor = mutual / 3.0;
    for (label, mutual, floor, expected) in [
        ("both just enough", 1.002 * mutual, 1.002 * floor, true),
        ("both ample", 0.6, 0.6, true),
        ("mutual short", 0.998 * mutual, 0.6, false),
        ("ground short", 0.6, 0.998 * floor, false),
    ] {
        let (stands, run) = stands(mutual, floor);
        run.tell(&format!("three cylinders, {label}"), f64::from(stands), f64::from(expected));
        assert_eq!(stands, expected, "{label}: {:?}", run.end);
    }
}
