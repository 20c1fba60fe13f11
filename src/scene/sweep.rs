//! Whether bodies pass through each other on the way to where an increment wants to start.

use crate::geometry::separation::{GjkShape, gjk_closest_points};
use crate::model::{BodyKind, Model};
use crate::solver::motion_between;
use crate::tensor::Pose;

/// Cores stay further apart on the way than this share of the sum of their rounding radii.
const FLOOR: f64 = 0.1;
/// Steps of the advance along one pair's way before it is refused.
const MOST_STEPS: usize = 500;

/// Whether all bodies can go from `from` to `to` along their screw-like straight motions with
/// their cores apart all the way. Conservative advancement: each step is no longer than what the
/// distance then allows (Mirtich 1996).
pub fn is_clear(model: &Model, from: &[Pose], to: &[Pose]) -> bool {
    let motions: Vec<_> = from.iter().zip(to).map(|(from, to)| motion_between(from, to)).collect();
    let speeds: Vec<f64> = motions
        .iter()
        .zip(&model.shapes)
        .map(|((shift, turn), shape)| shift.norm() + turn.norm() * shape.bounding_radius)
        .collect();
    let still = |i: usize| matches!(model.bodies[i].kind, BodyKind::Fixed | BodyKind::Plate);
    let gone = |i: usize| model.bodies[i].kind == BodyKind::Gone;
    for b in 0..from.len() {
        for a in 0..b {
            if gone(a) || gone(b) {
                continue;
            }
            let closing = speeds[a] + speeds[b];
            if closing == 0.0 || (still(a) && still(b)) {
                continue;
            }
            let reach: f64 =
                [a, b].map(|i| model.shapes[i].bounding_radius + model.shapes[i].rounded.radius).iter().sum();
            if (from[a].position - from[b].position).norm() - reach > closing {
                continue;
            }
            if !pair_is_clear(model, from, &motions, [a, b], closing) {
                return false;
            }
        }
    }
    true
}

fn pair_is_clear(
    model: &Model,
    from: &[Pose],
    motions: &[(crate::tensor::Vec3, crate::tensor::Vec3)],
    pair: [usize; 2],
    closing: f64,
) -> bool {
    let shapes = pair.map(|i| &model.shapes[i].rounded);
    let floor = FLOOR * (shapes[0].radius + shapes[1].radius);
    let unit = shapes[0].bounding_radius().max(shapes[1].bounding_radius());
    let gjk = shapes.map(|shape| GjkShape::new(&shape.core, unit));
    let mut time = 0.0;
    for _ in 0..MOST_STEPS {
        let [pose_a, pose_b] = pair.map(|i| {
            let (shift, turn) = motions[i];
            from[i].moved(&(shift * time), &(turn * time))
        });
        let Some(closest) = gjk_closest_points(&gjk[0], &pose_a, &gjk[1], &pose_b, f64::MAX) else {
            return true;
        };
        let room = closest.distance - floor;
        if room.is_nan() || room <= 0.0 {
            return false;
        }
        if time >= 1.0 {
            return true;
        }
        time = (time + room / closing).min(1.0);
    }
    false
}
