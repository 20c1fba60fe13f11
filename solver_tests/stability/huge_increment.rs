//! Increments a hundred times too large.
//!
//! Naive codes accept an interpenetrated state, or a small body has passed through a thin one.

use riprap::contact::law::Friction;
use riprap::loading::StageEnd;
use riprap::scene::{SceneBody, SceneParameters, SceneShape};

use riprap::verification::bodies::{HELD, body, cuboid, drive, fixed, gravity, ground, load, scene};

use crate::audited::{audited, last, tell};

#[test]
fn a_driven_body_does_not_pass_through_a_thin_plate() {
    let plate = fixed(body("plate", cuboid([0.2, 0.2, 0.002]), [0.0; 3], [0.0; 3]));
    for shape in [SceneShape::Sphere(0.005), cuboid([0.01; 3])] {
        let bullet = body("bullet", shape, [0.01, 0.0, 0.05], [0.1, 0.2, 0.3]);
        let stages = vec![load(1, "bullet", drive([Some(0.0), Some(0.0), Some(-0.1)], HELD))];
        let run = audited(&scene(vec![plate.clone(), bullet], 0.5, stages));
        let StageEnd::Stopped { reason } = &run.end else { panic!("passed through: {:?}", run.end) };
        assert!(reason.contains("pass into"), "{reason}");
        let height = last(&run).bodies[1].position.z;
        tell(&run, "bullet stopped above plate, height", height, 0.006);
        assert!(height > 0.001, "{height}");
    }
}

/// A free block in front of a driven one is pushed along, not run over. Prescribed in one increment of 50 times its
/// edge's rounding; the final overlap is what the contact law gives for the push, no more (audited in each run). The push
/// is `mu W`, to 1 %: the tilt under the push, some microns over the block, moves no more weight than that.
#[test]
fn a_block_in_the_way_is_pushed_along() {
    // A smooth pusher: with friction of its own the push could be anything in mu W / (1 -+ mu^2).
    let smooth = Some(Friction::constant(0.0));
    let pusher = body("pusher", cuboid([0.1; 3]), [-0.101, 0.0, 0.0505], [0.0; 3]);
    let pusher = SceneBody { friction: smooth, ..pusher };
    let block = body("block", cuboid([0.1; 3]), [0.0, 0.0, 0.05], [0.0; 3]);
    let held = load(4, "pusher", drive(HELD, HELD));
    let mut down = gravity(4, [0.0, 0.0, -9.81]);
    down.bodies = held.bodies;
    let stages = vec![down, load(1, "pusher", drive([Some(0.101), Some(0.0), Some(0.0)], HELD))];
    let parameters =
        SceneParameters { increment_range: [1e-4, 1.0], ..scene(vec![ground(), pusher, block], 0.3, stages) };
    let run = audited(&parameters);
    assert!(run.finished(), "{:?}", run.end);
    let state = last(&run).bodies[2];
    tell(&run, "pushed block, displacement", state.displacement.x, 0.1);
    assert!(run.cuts() > 0);
    assert!((state.displacement.x - 0.1).abs() < 1e-5, "{}", state.displacement);
    let weight = run.scene.model.bodies[2].mass * 9.81;
    let push = last(&run).bodies[1].reaction_force.x;
    assert!((push / (0.3 * weight) - 1.0).abs() < 0.01, "{push} N of {}", 0.3 * weight);
}
