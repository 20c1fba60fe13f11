//! What a stage of a scene drives and loads, from where it began to where it ends.

use serde::{Deserialize, Serialize};

use crate::loading::StageProgress;
use crate::model::Loads;
use crate::solver::motion_between;
use crate::tensor::{Pose, Rotation, Vec3, Vector6};

/// What a stage drives and where to.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Drive {
    pub(super) held: Vec<[bool; 6]>,
    /// Motion of the held components over the stage.
    #[serde(with = "crate::tensor::stored")]
    pub(super) travel: Vec<Vector6<f64>>,
    pub(super) from: Vec<Pose>,
    #[serde(with = "crate::tensor::stored")]
    pub(super) applied: [Vec<Vector6<f64>>; 2],
    #[serde(with = "crate::tensor::stored")]
    pub(super) gravity: [Vec3; 2],
}

/// A stage of a scene between two increments.
pub(super) type Progress = StageProgress<StageState>;

/// What a scene adds to the progress of a stage.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StageState {
    pub(super) drive: Drive,
    pub(super) last: Option<Last>,
    /// Whether bodies broke and are not in balance yet.
    pub(super) rebalances: bool,
}

/// What the last increment came from.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Last {
    pub(super) poses: Vec<Pose>,
    pub(super) share: f64,
}

impl StageState {
    pub(super) fn new(drive: Drive) -> Self {
        StageState { drive, last: None, rebalances: false }
    }
}

impl Drive {
    /// Takes in bodies behind those it knows, free, and frames that breaking moved from `before` to `poses`.
    pub(super) fn grow(&mut self, before: &[Pose], poses: &[Pose]) {
        let moved = self.from.iter_mut().zip(before).zip(poses).filter(|((_, old), new)| old != new);
        for ((from, old), new) in moved {
            from.position += new.position - old.position;
            // What a turn made of the old rotation it makes of the new one.
            from.rotation *= old.rotation.inverse() * new.rotation;
        }
        self.from.extend(&poses[self.from.len()..]);
        self.held.resize(poses.len(), [false; 6]);
        self.travel.resize(poses.len(), Vector6::zeros());
        self.applied.iter_mut().for_each(|applied| applied.resize(poses.len(), Vector6::zeros()));
    }

    /// Loads and supports at the share `to` of the stage.
    pub(super) fn loads_at(&self, to: f64) -> Loads {
        let [from, end] = &self.applied;
        Loads {
            prescribed: self.held.clone(),
            applied: from.iter().zip(end).map(|(from, end)| from + (end - from) * to).collect(),
            gravity: self.gravity[0] + (self.gravity[1] - self.gravity[0]) * to,
            pressure: 0.0,
            control: None,
        }
    }

    /// `poses` with every held component where it belongs at the share `to` of the stage, an
    /// increment of `share` after `committed`.
    pub(super) fn driven(&self, poses: &[Pose], committed: &[Pose], share: f64, to: f64) -> Vec<Pose> {
        (0..poses.len())
            .map(|i| {
                let (held, travel, from) = (&self.held[i], &self.travel[i], &self.from[i]);
                let mut position = poses[i].position;
                for k in (0..3).filter(|&k| held[k]) {
                    position[k] = from.position[k] + to * travel[k];
                }
                let turn = Vec3::new(travel[3], travel[4], travel[5]);
                let rotation = if held[3..] == [true; 3] {
                    Rotation::from_scaled_axis(turn * to) * from.rotation
                } else if held[3..] == [false; 3] {
                    poses[i].rotation
                } else {
                    let (_, mut spin) = motion_between(&committed[i], &poses[i]);
                    for k in (0..3).filter(|&k| held[3 + k]) {
                        spin[k] = share * turn[k];
                    }
                    Rotation::from_scaled_axis(spin) * committed[i].rotation
                };
                Pose::new(position, rotation)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Breaking shifts and turns the frame of a held body. Reference: it stays where breaking left it.
    #[test]
    fn a_frame_that_breaking_moved_stays_there() {
        let turn = |x: f64, y: f64, z: f64| Rotation::from_scaled_axis(Vec3::new(x, y, z));
        let start = vec![Pose::new(Vec3::new(0.1, 0.2, 0.3), turn(0.4, -0.2, 0.1))];
        let mut drive = Drive {
            held: vec![[true; 6]],
            travel: vec![Vector6::new(0.0, 0.0, 1e-3, 0.2, 0.1, 0.3)],
            from: start.clone(),
            applied: [vec![Vector6::zeros()], vec![Vector6::zeros()]],
            gravity: [Vec3::zeros(); 2],
        };
        let now = drive.driven(&start, &start, 0.5, 0.5);
        let shift = Vec3::new(1e-3, 2e-3, -1e-3);
        let broken = vec![Pose::new(now[0].position + shift, now[0].rotation * turn(1e-3, 0.0, -2e-3))];
        drive.grow(&now, &broken);
        let held = drive.driven(&broken, &broken, 0.0, 0.5);
        assert!((held[0].position - broken[0].position).norm() < 1e-15);
        assert!(held[0].rotation.angle_to(&broken[0].rotation) < 1e-7, "{:?}", held[0].rotation);
    }
}
