//! A prism with n corners on a cube of the same width, pressed by a force and a moment: many redundant points.
//!
//! How the load spreads over the points depends on n; its resultant does not: force and moment of the contacts on the
//! prism are minus what is applied. Tolerance: the force tolerance, 1e-3 of a point's force; moments likewise
//! times the half width.

use riprap::scene::BodyLoad;

use crate::scene_builder::{Run, body, cuboid, fixed, hull, load, push, scene};

fn prism(corners: usize) -> riprap::scene::SceneShape {
    if corners == 4 {
        return cuboid([0.1; 3]);
    }
    let around = (0..corners).map(|k| std::f64::consts::TAU * (k as f64 + 0.5) / corners as f64);
    let points: Vec<[f64; 3]> =
        around.flat_map(|a| [-0.05, 0.05].map(|z| [0.05 * a.cos(), 0.05 * a.sin(), z])).collect();
    hull(&points, 2e-3)
}

#[test]
fn resultant_is_unique() {
    for corners in [4, 6, 24, 96] {
        let lower = fixed(body("lower", cuboid([0.1; 3]), [0.0, 0.0, -0.05], [0.0; 3]));
        let upper = body("upper", prism(corners), [0.0, 0.0, 0.05], [0.0; 3]);
        let moment = BodyLoad { moment: Some([Some(4.0), Some(10.0), Some(0.0)]), ..BodyLoad::default() };
        let stages = vec![load(5, "upper", push([100.0, 0.0, -1000.0])), load(5, "upper", moment)];
        let run = Run::of(&scene(vec![lower, upper], 0.65, stages));
        assert!(run.finished(), "{corners}: {:?}", run.end);
        let state = run.last().bodies[run.index("upper")];
        run.tell(
            &format!("prism of {corners} on cube, {} points", run.last().measures.points),
            state.contact_force.z,
            1000.0,
        );
        let expected_force = riprap::tensor::Vec3::new(-100.0, 0.0, 1000.0);
        let expected_moment = riprap::tensor::Vec3::new(-4.0, -10.0, 0.0);
        let tolerance = 1e-3 * run.last().balance.reference_force;
        assert!((state.contact_force - expected_force).norm() < tolerance, "{}", state.contact_force);
        assert!(
            (state.contact_moment - expected_moment).norm() < 0.07 * tolerance,
            "{}",
            state.contact_moment
        );
    }
}
