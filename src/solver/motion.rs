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

/// Work of a force and moment about a body's reference point [N, N m] from one pose to another [J].
pub fn work_between(from: &Pose, to: &Pose, wrench: &Vector6<f64>) -> f64 {
    let (shift, turn) = motion_between(from, to);
    shift.dot(&wrench.fixed_rows::<3>(0)) + turn.dot(&wrench.fixed_rows::<3>(3))
}
