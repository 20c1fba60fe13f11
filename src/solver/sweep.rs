//! Whether bodies pass through each other on the way to where an increment wants to start.

use crate::contact::ContactShape;
use crate::geometry::separation::{GjkShape, gjk_closest_points};
use crate::model::Model;
use crate::solver::motion_between;
use crate::tensor::{Pose, Vec3};

/// Cores stay further apart on the way than this share of the sum of their rounding radii.
const FLOOR: f64 = 0.1;
/// Steps of the advance along one pair's way before it is refused.
const MOST_STEPS: usize = 500;

/// Whether all bodies can go from `from` to `to` along their screw-like straight motions with
/// their cores apart all the way. Conservative advancement: each step is no longer than what the
/// distance then allows (Mirtich 1996).
pub fn is_clear(model: &Model, from: &[Pose], to: &[Pose]) -> bool {
    Sweep::new(model, from, to).blocked().next().is_none()
}

/// All bodies on their ways.
struct Sweep<'a> {
    model: &'a Model,
    from: &'a [Pose],
    motions: Vec<(Vec3, Vec3)>,
    /// The furthest that a point of each body goes [m].
    speeds: Vec<f64>,
}

impl<'a> Sweep<'a> {
    fn new(model: &'a Model, from: &'a [Pose], to: &[Pose]) -> Self {
        let bodies = from.iter().zip(to).take(model.bodies.len());
        let motions: Vec<_> = bodies.map(|(from, to)| motion_between(from, to)).collect();
        let speed = |((shift, turn), shape): (&(Vec3, Vec3), &ContactShape)| {
            shift.norm() + turn.norm() * shape.bounding_radius
        };
        let speeds = motions.iter().zip(&model.shapes).map(speed).collect();
        Sweep { model, from, motions, speeds }
    }

    /// Pairs that would pass through each other.
    fn blocked(&self) -> impl Iterator<Item = [usize; 2]> {
        let (model, from) = (self.model, self.from);
        let pairs = (0..self.motions.len()).flat_map(|b| (0..b).map(move |a| [a, b]));
        pairs.filter(move |&[a, b]| {
            let closing = self.speeds[a] + self.speeds[b];
            closing > 0.0
                && model.can_meet(a, b)
                && model.between_spheres(from, a, b) <= closing
                && !pair_is_clear(model, from, &self.motions, [a, b], closing)
        })
    }
}

fn pair_is_clear(
    model: &Model,
    from: &[Pose],
    motions: &[(Vec3, Vec3)],
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
