//! Motions from one pose to another: a translation and a rotation vector.

use crate::tensor::{Pose, Vec3, Vector6};

/// Carries a motion on: from `now`, by `ratio` times what came since `before`.
pub fn continued_poses(before: &[Pose], now: &[Pose], ratio: f64) -> Vec<Pose> {
    let carried = |(old, now): (&Pose, &Pose)| {
        let (shift, turn) = motion_between(old, now);
        now.moved(&(shift * ratio), &(turn * ratio))
    };
    before.iter().zip(now).map(carried).collect()
}

/// Translation [m] and rotation vector [rad] from one pose to another.
pub fn motion_between(from: &Pose, to: &Pose) -> (Vec3, Vec3) {
    (to.position - from.position, (to.rotation * from.rotation.inverse()).scaled_axis())
}

/// The same in one vector [m, rad].
pub fn motion_vector(from: &Pose, to: &Pose) -> Vector6<f64> {
    let (shift, turn) = motion_between(from, to);
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}
