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
    /// Takes in bodies behind those it knows, free, and reference points that moved from `before` to `poses`.
    pub(super) fn grow(&mut self, before: &[Pose], poses: &[Pose]) {
        for ((from, old), new) in self.from.iter_mut().zip(before).zip(poses) {
            from.position += new.position - old.position;
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
