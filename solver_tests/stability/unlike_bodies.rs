//! A block on three balls a fiftieth of its size, a million times softer or stiffer.
//!
//! Badly conditioned systems lose the balls' forces. Statics: each ball carries W / 3 (they stand at the corners of an equilateral
//! triangle about the centre). Tolerance 2e-3: the force tolerance, 1e-3 of the mean contact force, on two contacts of a ball.

use riprap::verification::standing::{UNLIKE, block_on_balls};

use crate::audited::{audited, last, tell};

#[test]
fn three_balls_carry_a_third_each() {
    for (ratio, size) in UNLIKE {
        let (parameters, weight) = block_on_balls(ratio, size);
        let run = audited(&parameters);
        assert!(run.finished(), "ratio {ratio}: {:?}", run.end);
        let shares: Vec<f64> = (0..3)
            .map(|k| {
                let ball = &last(&run).bodies[2 + k];
                // What the ball passes to the ground is what the block puts on it and its own weight.
                let own = run.scene.model.bodies[2 + k].mass * last(&run).gravity.norm();
                assert!((ball.contact_force.z - own).abs() < 1e-3 * weight, "{}", ball.contact_force);
                ball.contact_force.z
            })
            .collect();
        let block = last(&run).bodies[1].contact_force.z;
        tell(&run, &format!("block on balls of size {size}, E ratio {ratio:e}"), block, weight);
        assert!((block / weight - 1.0).abs() < 2e-3, "{block} of {weight} {shares:?}");
        assert!(last(&run).bodies[1].rotation.norm() < 1e-3, "{}", last(&run).bodies[1].rotation);
    }
}
