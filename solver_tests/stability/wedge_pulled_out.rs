//! A wedge pressed in, let go, and pulled out.
//!
//! Naive methods diverge or let it pop out. Statics: with the load gone it stays jammed iff mu > tan a (its friction turns round, and holds
//! any normal force up to `N (mu cos a - sin a) >= 0`); otherwise no force is left. Then it is lifted by a
//! prescribed displacement: it comes free, without force.

use crate::scene_builder::{HELD, Run, body, cuboid, drive, fixed, hull, load, push, scene};

fn cycle(angle: f64, friction: f64) -> Run {
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
        fixed(body(name, cuboid(size), position, [0.0, side * angle, 0.0]))
    };
    let stages = vec![
        load(10, "wedge", push([0.0, 0.0, -1000.0])),
        load(20, "wedge", push([0.0; 3])),
        load(20, "wedge", drive([None, None, Some(1e-4)], HELD)),
    ];
    Run::of(&scene(vec![wedge, wall("left", -1.0), wall("right", 1.0)], friction, stages))
}

#[test]
fn jams_or_lets_go() {
    for (degrees, friction) in
        [(20.0f64, 0.65), (20.0, 0.2), (10.0, 0.4), (10.0, 0.1), (30.0, 0.3), (30.0, 0.8)]
    {
        let angle = degrees.to_radians();
        let run = cycle(angle, friction);
        assert!(run.finished(), "a {degrees} mu {friction}: {:?}", run.end);
        let normal = |stage: usize| {
            let row = run.rows.iter().rfind(|row| row.stage == stage);
            let force = row.map_or_else(Default::default, |row| row.bodies[2].contact_force);
            force.x * angle.cos() - force.z * angle.sin()
        };
        run.tell(
            &format!("wedge a {degrees} mu {friction} let go, N left"),
            normal(1) / normal(0),
            f64::from(friction > angle.tan()),
        );
        let jams = friction > angle.tan();
        // Jammed it keeps a good part of its force; else none but what the force tolerance leaves.
        assert!(
            if jams { normal(1) > 0.05 * normal(0) } else { normal(1) < 0.01 * normal(0) },
            "a {degrees} mu {friction}"
        );
        assert_eq!(normal(2), 0.0);
        assert_eq!(run.last().measures.points, 0);
    }
}
