//! A block on three balls a fiftieth of its size, a million times softer or stiffer.
//!
//! Badly conditioned systems lose the balls' forces. Statics: each ball carries W / 3 (they stand at the corners of an equilateral
//! triangle about the centre). Tolerance 2e-3: the force tolerance, 1e-3 of the mean contact force, on two contacts of a ball.

use riprap::scene::{SceneBody, SceneShape};

use crate::scene_builder::{Run, body, cuboid, gravity, ground, scene};

#[test]
fn three_balls_carry_a_third_each() {
    for (ratio, size) in [(1.0, 0.05), (1e-3, 0.02), (1e-6, 0.05), (1e3, 0.02), (1e6, 0.05)] {
        let radius = 0.5 * size * 0.1;
        let height = 2.0 * radius + 0.05;
        let mut bodies = vec![ground(), body("block", cuboid([0.1; 3]), [0.0, 0.0, height], [0.0; 3])];
        for k in 0..3 {
            let angle = std::f64::consts::TAU * k as f64 / 3.0;
            let place = [0.03 * angle.cos(), 0.03 * angle.sin(), radius];
            let ball = body(&format!("ball {k}"), SceneShape::Sphere(radius), place, [0.0; 3]);
            bodies.push(SceneBody { youngs_modulus: 30e9 * ratio, ..ball });
        }
        // So little of gravity that the softest ball yields by a thousandth of its radius only.
        let share = if ratio < 1e-4 { 1e-3 } else { 1.0 };
        let run = Run::of(&scene(bodies, 0.5, vec![gravity(5, [0.0, 0.0, -9.81 * share])]));
        assert!(run.finished(), "ratio {ratio}: {:?}", run.end);
        let weight = run.scene.model.bodies[1].mass * 9.81 * share;
        let shares: Vec<f64> = (0..3)
            .map(|k| {
                let ball = &run.last().bodies[2 + k];
                // What the ball passes to the ground is what the block puts on it and its own weight.
                let own = run.scene.model.bodies[2 + k].mass * 9.81 * share;
                assert!((ball.contact_force.z - own).abs() < 1e-3 * weight, "{}", ball.contact_force);
                ball.contact_force.z
            })
            .collect();
        let block = run.last().bodies[1].contact_force.z;
        run.tell(&format!("block on balls of size {size}, E ratio {ratio:e}"), block, weight);
        assert!((block / weight - 1.0).abs() < 2e-3, "{block} of {weight} {shares:?}");
        assert!(run.last().bodies[1].rotation.norm() < 1e-3, "{}", run.last().bodies[1].rotation);
    }
}
