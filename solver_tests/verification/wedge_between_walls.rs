//! A wedge of half-angle a pressed between two walls by P, friction fully mobilised.
//!
//! Vertical balance: `P = 2 (N sin a + mu N cos a)`, so `N = P / [2 (sin a + mu cos a)]` on each wall. Friction lagged on the
//! last normal force diverges where mu > tan a (its error grows by mu / tan a). The walls draw back under the
//! load, so that the wedge slides at every mu: without that it would stick where mu is above the ratio of tangential to
//! normal stiffness times cot a. Tolerance: the force tolerance, 1e-3 of a point's force, on each
//! of some ten points: 2e-3.

use crate::scene_builder::{HELD, Run, body, cuboid, drive, hull, load, push, scene};

const PRESS: f64 = 1000.0;
const DRAW: f64 = 0.1e-3;

fn pressed(angle: f64, friction: f64) -> Run {
    let (bottom, h) = (0.02, 0.02);
    let top = bottom + 2.0 * h * angle.tan();
    let mut corners = Vec::new();
    for y in [-0.02, 0.02] {
        for (z, half) in [(-h, bottom), (h, top)] {
            corners.extend([[-half, y, z], [half, y, z]]);
        }
    }
    let wedge = body("wedge", hull(&corners, 0.4e-3), [0.0; 3], [0.0; 3]);
    let middle = 0.5 * (bottom + top);
    let (sin, cos) = angle.sin_cos();
    let size = [0.02, 0.08, 2.0 * h / cos + 0.01];
    let wall = |name: &str, side: f64| {
        let position = [side * (middle + 0.01 * cos), 0.0, -0.01 * sin];
        body(name, cuboid(size), position, [0.0, side * angle, 0.0])
    };
    let mut hold = load(5, "wedge", push([0.0, 0.0, -PRESS]));
    let mut part = load(10, "left", drive([Some(-DRAW), Some(0.0), Some(0.0)], HELD));
    for name in ["left", "right"] {
        hold.bodies.push((name.into(), drive(HELD, HELD)));
    }
    part.bodies.push(("right".into(), drive([Some(DRAW), Some(0.0), Some(0.0)], HELD)));
    Run::of(&scene(vec![wedge, wall("left", -1.0), wall("right", 1.0)], friction, vec![hold, part]))
}

#[test]
fn normal_force_is_the_closed_form() {
    for degrees in [15.0f64, 20.0, 30.0, 45.0, 60.0] {
        for friction in [0.0, 0.2, 0.4, 0.65, 0.8] {
            let angle = degrees.to_radians();
            let (sin, cos) = angle.sin_cos();
            let expected = PRESS / (2.0 * (sin + friction * cos));
            let run = pressed(angle, friction);
            assert!(run.finished(), "a {degrees} mu {friction}: {:?}", run.end);
            for (name, side) in [("left", -1.0), ("right", 1.0)] {
                let force = run.last().bodies[run.index(name)].contact_force;
                let normal = side * force.x * cos - force.z * sin;
                let along = side * force.x * sin + force.z * cos;
                if side > 0.0 {
                    run.tell(&format!("wedge a {degrees} mu {friction}"), normal, expected);
                }
                assert!((normal / expected - 1.0).abs() < 2e-3, "a {degrees} mu {friction} {name}: {normal}");
                assert!((along.abs() - friction * normal).abs() < 2e-3 * expected, "friction {along}");
            }
            let worst = run.rows.iter().map(|r| r.counters.factorisations).max().unwrap_or(0);
            assert!(worst < 150, "{worst} factorisations in an increment");
        }
    }
}
