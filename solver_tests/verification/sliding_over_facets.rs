//! A cube pressed onto the face of a many-sided prism, cut into thin coplanar triangles, and slid across without friction.
//!
//! Contact that sees internal edges kicks there. Reference: no tangential force, no moment about the vertical, and the
//! normal force. Tolerance 1e-9 of the load: normals of a plane differ by rounding only.

use crate::scene_builder::{HELD, Run, body, cuboid, drive, fixed, hull, load, push, scene};

#[test]
fn no_tangential_force() {
    for (corners, heading) in [(8usize, 0.3f64), (32, 0.0), (64, 0.7)] {
        let around = (0..corners).map(|k| std::f64::consts::TAU * k as f64 / corners as f64);
        let points: Vec<[f64; 3]> =
            around.flat_map(|a| [-0.1, 0.0].map(|z| [0.5 * a.cos(), 0.5 * a.sin(), z])).collect();
        let ground = fixed(body("ground", hull(&points, 2e-3), [0.0; 3], [0.0; 3]));
        let cube = body(
            "cube",
            cuboid([0.05; 3]),
            [-0.2 * heading.cos(), -0.2 * heading.sin(), 0.025],
            [0.0, 0.0, 0.2],
        );
        let way = [Some(0.4 * heading.cos()), Some(0.4 * heading.sin()), None];
        let mut stages =
            vec![load(3, "cube", push([0.0, 0.0, -1000.0])), load(200, "cube", drive(way, HELD))];
        stages[0].bodies[0].1.rotation = Some(HELD);
        let run = Run::of(&scene(vec![ground, cube], 0.0, stages));
        assert!(run.finished(), "{:?}", run.end);
        let worst = run.rows.iter().map(|row| row.bodies[1].contact_force.xy().norm()).fold(0.0, f64::max);
        run.tell(&format!("slide over {} facets, tangential force", corners - 2), worst, 0.0);
        assert!(worst < 1e-6, "{worst} N");
        for row in run.rows.iter().filter(|row| row.stage == 1) {
            assert!((row.bodies[1].contact_force.z - 1000.0).abs() < 1.0);
        }
    }
}
