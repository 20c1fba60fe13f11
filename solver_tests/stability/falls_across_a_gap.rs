//! A loose ball above stiff ground, beside a block that rests there, under gravity: it is to fall onto the ground.
//!
//! Naive methods meet a singular matrix, or hold the ball for ever. Here the proximal term lets a body that nothing bears move by its weight over
//! `proximal_min` times the typical stiffness, the median of the bodies', in each augmentation: 0.4 um. Across 30 um that takes 75 augmentations;
//! across 0.5 mm more than there are, and the increment is given up. The dwell that follows lets go of it geometrically, and
//! augmentations that end because the ball went as far as it may count a tenth.

use riprap::ladder::bodies::{body, cuboid, fixed, gravity, scene};
use riprap::scene::{SceneBody, SceneShape};

use crate::audited::{audited, last, tell};

fn fallen(gap: f64, max_dwell: usize) -> bool {
    let stiff = |made: SceneBody| SceneBody { youngs_modulus: 1e13, ..made };
    let ground = fixed(stiff(body("ground", cuboid([0.1, 0.1, 0.02]), [0.0, 0.0, -0.01], [0.0; 3])));
    let block = stiff(body("block", cuboid([0.02; 3]), [0.03, 0.0, 0.01], [0.0; 3]));
    let ball = body("ball", SceneShape::Sphere(0.01), [0.0, 0.0, 0.01 + gap], [0.0; 3]);
    let mut parameters = scene(vec![ground, block, ball], 0.5, vec![gravity(2, [0.0, 0.0, -9.81])]);
    parameters.settings.max_dwell = max_dwell;
    let run = audited(&parameters);
    if run.finished() {
        tell(&run, &format!("ball across {gap:e} m"), last(&run).bodies[2].displacement.z, -gap);
    }
    run.finished() && (last(&run).bodies[2].displacement.z + gap).abs() < 1e-6
}

#[test]
fn a_short_way() {
    assert!(fallen(1e-5, 0));
}

#[test]
fn a_long_way() {
    assert!(!fallen(5e-4, 0), "without a dwell it has no time to fall");
    for gap in [5e-4, 1e-2, 0.1] {
        assert!(fallen(gap, 300), "{gap}");
    }
}
