//! Two cubes standing on edge, the edges crossing at an angle, driven into each other by d.
//!
//! Node-to-surface contact lets them pass. One edge-edge contact carries `F = k (d - d_0 / 2)`, d_0 the onset, k
//! half a cube's local stiffness (two in series), normal to both edges, at any crossing angle that is not nearly parallel.
//! Tolerance 1e-9: everything is prescribed, so this is the force law alone.

use crate::scene_builder::{HELD, ROUNDING, Run, body, cuboid, drive, fixed, load, scene};

#[test]
fn edges_carry_the_load() {
    let rounding = ROUNDING * 0.1;
    // From a centre to the crest of the rounded edge.
    let crest = (0.05 - rounding) * 2.0f64.sqrt() + rounding;
    for degrees in [15.0f64, 30.0, 45.0, 90.0, 120.0] {
        let turn = riprap::tensor::Rotation::from_scaled_axis([0.0, 0.0, degrees.to_radians()].into())
            * riprap::tensor::Rotation::from_scaled_axis([std::f64::consts::FRAC_PI_4, 0.0, 0.0].into());
        let lower = fixed(body(
            "lower",
            cuboid([0.1; 3]),
            [0.0, 0.0, -crest],
            [std::f64::consts::FRAC_PI_4, 0.0, 0.0],
        ));
        let upper = body("upper", cuboid([0.1; 3]), [0.0, 0.0, crest], turn.scaled_axis().into());
        let depth = 20e-6;
        let stages = vec![load(10, "upper", drive([Some(0.0), Some(0.0), Some(-depth)], HELD))];
        let run = Run::of(&scene(vec![lower, upper], 0.65, stages));
        assert!(run.finished(), "{:?}", run.end);
        let model = &run.scene.model;
        let expected = model.contact_stiffness(0, 1) * (depth - 0.5 * model.law.onset);
        let state = run.last().bodies[1];
        run.tell(&format!("edges crossing at {degrees} deg"), state.contact_force.z, expected);
        assert_eq!(run.last().measures.points, 1);
        assert!((state.contact_force.z / expected - 1.0).abs() < 1e-9);
        assert!(state.contact_force.xy().norm() < 1e-9 * expected);
        assert!(state.contact_moment.norm() < 1e-9 * expected);
        assert!((state.reaction_force + state.contact_force).norm() < 1e-9 * expected);
    }
}
