//! Where the search for an increment's equilibrium begins.

use crate::assembly::SurfaceField;
use crate::solver::pace::motion_between;
use crate::tensor::Pose;

/// A configuration to start from.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    pub poses: Vec<Pose>,
    /// Displacement of the nodes of full bodies [m], by body; where there is none, as committed.
    pub fields: Vec<SurfaceField>,
}

impl From<Vec<Pose>> for Start {
    fn from(poses: Vec<Pose>) -> Self {
        Start { poses, fields: Vec::new() }
    }
}

/// Carries a motion on: from `now`, by `ratio` times what came since `before`.
pub fn continued_poses(before: &[Pose], now: &[Pose], ratio: f64) -> Vec<Pose> {
    let carried = |(old, now): (&Pose, &Pose)| {
        let (shift, turn) = motion_between(old, now);
        now.moved(&(shift * ratio), &(turn * ratio))
    };
    before.iter().zip(now).map(carried).collect()
}

/// As [`continued_poses`], for displacements of nodes; of a body whose nodes are others than before, nothing.
pub fn continued_fields(before: &[SurfaceField], now: &[SurfaceField], ratio: f64) -> Vec<SurfaceField> {
    let carried = |(old, now): (&SurfaceField, &SurfaceField)| match old.len() == now.len() {
        true => old.iter().zip(now).map(|(old, now)| now + (now - old) * ratio).collect(),
        false => SurfaceField::new(),
    };
    before.iter().zip(now).map(carried).collect()
}
