//! The same scene in numbers of the order of millimetres and of kilometres: the same scaled answer.
//!
//! Codes with absolute tolerances converge on the one and not on the other. Lengths times s at the same stresses: forces times
//! s^2. Tolerance 1e-6: what rounding may do to the last of some ten Newton steps.

use crate::scene_builder::{HELD, Run, body, cuboid, drive, fixed, hull, load, push, scene};

fn pressed(s: f64) -> Run {
    let angle = 20.0f64.to_radians();
    let (bottom, h) = (0.02 * s, 0.02 * s);
    let top = bottom + 2.0 * h * angle.tan();
    let mut corners = Vec::new();
    for y in [-0.02 * s, 0.02 * s] {
        for (z, half) in [(-h, bottom), (h, top)] {
            corners.extend([[-half, y, z], [half, y, z]]);
        }
    }
    let wedge = body("wedge", hull(&corners, 0.4e-3 * s), [0.0; 3], [0.0; 3]);
    let middle = 0.5 * (bottom + top);
    let (sin, cos) = angle.sin_cos();
    let size = [0.02 * s, 0.08 * s, 2.0 * h / cos + 0.01 * s];
    let wall = |name: &str, side: f64| {
        let position = [side * (middle + 0.01 * s * cos), 0.0, -0.01 * s * sin];
        fixed(body(name, cuboid(size), position, [0.0, side * angle, 0.0]))
    };
    let stages = vec![
        load(5, "wedge", push([0.0, 0.0, -1000.0 * s * s])),
        load(5, "wedge", drive([None, None, Some(-2e-6 * s)], HELD)),
    ];
    Run::of(&scene(vec![wedge, wall("left", -1.0), wall("right", 1.0)], 0.3, stages))
}

#[test]
fn millimetres_and_kilometres_agree() {
    let usual = pressed(1.0);
    assert!(usual.finished(), "{:?}", usual.end);
    for s in [1e-3, 1e-2, 1e3, 1e6] {
        let run = pressed(s);
        assert!(run.finished(), "{s}: {:?}", run.end);
        run.tell(
            &format!("wedge at scale {s:e}, force"),
            run.last().bodies[2].contact_force.x / (s * s),
            usual.last().bodies[2].contact_force.x,
        );
        assert_eq!(run.rows.len(), usual.rows.len());
        for (a, b) in run.rows.iter().zip(&usual.rows) {
            for (x, y) in a.bodies.iter().zip(&b.bodies) {
                assert!((x.contact_force / (s * s) - y.contact_force).norm() < 1e-6 * 1000.0, "scale {s}");
                assert!((x.displacement / s - y.displacement).norm() < 1e-6 * 1e-5, "scale {s}");
            }
        }
    }
}
