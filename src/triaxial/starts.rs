//! Where an increment of a test starts from, and what is said of one that found no balance.

use crate::assembly::TooClose;
use crate::model::Fracture;
use crate::solver::{IncrementReport, StepStatus, continued_poses};
use crate::tensor::{Pose, Vec3};
use crate::triaxial::rig::Rig;
use serde::{Deserialize, Serialize};

/// A body whose motion goes on by more than this share of the smallest rounding beyond the affine squeeze is taken to go with that alone.
const MOST_CONTINUED: f64 = 0.1;

/// An accepted increment, for the next one to go on from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Last {
    pub(super) poses: Vec<Pose>,
    pub(super) share: f64,
    pub(super) area: f64,
    pub(super) pressure: f64,
    pub(super) deviatoric_stress: f64,
}

impl Last {
    /// The same where bodies broke: they and their parts begin at rest. `None` where nodes of a membrane have other numbers now.
    pub(super) fn behind(mut self, fractures: &[Fracture], now: &[Pose], has_nodes: bool) -> Option<Self> {
        if now.len() != self.poses.len() && has_nodes {
            return None;
        }
        self.poses.extend(now.iter().skip(self.poses.len()));
        let broken = fractures.iter().flat_map(|fracture| fracture.parts.iter().chain([&fracture.body]));
        broken.for_each(|body| self.poses[*body] = now[*body]);
        Some(self)
    }
}

/// Starting configurations in order of preference: the last motion continued, an affine
/// squeeze, the driven plate alone. `lift` [m] is the motion of a driven top plate.
pub(super) fn starts(
    rig: &Rig,
    last: Option<(&Last, f64)>,
    lift: Option<f64>,
    height: f64,
) -> Vec<Vec<Pose>> {
    let now = &rig.committed.poses;
    let mut plain: Vec<Pose> = now.clone();
    plain[rig.top].position.z += lift.unwrap_or(0.0);
    let mut squeezed = plain.clone();
    if let Some(lift) = lift.filter(|lift| *lift != 0.0) {
        let bottom = &rig.model.bodies[rig.bottom].nominal.vertices;
        let base = now[rig.bottom].position.z + bottom.iter().map(|v| v.z).fold(f64::NEG_INFINITY, f64::max);
        for (i, pose) in squeezed.iter_mut().enumerate() {
            let is_wall = i >= rig.model.bodies.len() && !rig.model.is_node(i);
            if i != rig.top && i != rig.bottom && !is_wall {
                pose.position += Vec3::new(0.0, 0.0, lift * (pose.position.z - base) / height);
            }
        }
    }
    let mut starts = Vec::new();
    if let Some((last, ratio)) = last {
        let mut poses = continued_poses(&last.poses, now, ratio);
        if lift.is_some() {
            poses[rig.top].position.z = plain[rig.top].position.z;
        }
        poses[rig.bottom] = plain[rig.bottom];
        // What fell in the last increment would go on into its neighbours.
        let most = MOST_CONTINUED * rig.model.smallest_rounding();
        for (pose, squeezed) in poses.iter_mut().zip(&squeezed) {
            if (pose.position - squeezed.position).norm() > most {
                *pose = *squeezed;
            }
        }
        starts.push(poses);
    }
    if squeezed != plain {
        starts.push(squeezed);
    }
    starts.push(plain);
    starts
}

pub(super) fn describe(rig: &Rig, report: &IncrementReport, pressure: f64) -> String {
    match &report.status {
        StepStatus::Converged => "converged".into(),
        StepStatus::Abandoned => "abandoned".into(),
        StepStatus::Unsolvable { problem } => format!("a body gave way: {problem}"),
        StepStatus::Overlapping { problem } => problem.clone(),
        StepStatus::TooClose(pair) => TooClose::described(*pair, &rig.model),
        StepStatus::OutOfBalance { body, out_of_balance } if rig.model.is_node(*body) => format!(
            "the membrane is out of balance by {out_of_balance:.2e} of the mean contact force after {} \
             augmentations; {}",
            report.history.len(),
            rig.membrane_trouble(pressure)
        ),
        StepStatus::OutOfBalance { body, out_of_balance } if *body >= rig.model.bodies.len() => format!(
            "the wall is out of balance by {out_of_balance:.2e} of the mean contact force after {} augmentations",
            report.history.len()
        ),
        StepStatus::OutOfBalance { body, out_of_balance } => format!(
            "{} is out of balance by {out_of_balance:.2e} of the mean contact force after {} augmentations",
            rig.model.bodies[*body].name,
            report.history.len()
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::Rotation;

    /// What broke and its parts do not go on; all else goes on as it did.
    #[test]
    fn the_last_motion_goes_on_but_for_what_broke() {
        let at = |x: f64| Pose::new(Vec3::new(x, 0.0, 0.0), Rotation::identity());
        let last = Last {
            poses: vec![at(0.0), at(1.0), at(2.0)],
            share: 0.1,
            area: 1.0,
            pressure: 1e6,
            deviatoric_stress: 0.0,
        };
        let now = [at(0.1), at(1.1), at(2.1), at(1.3)];
        let fracture = Fracture {
            body: 1,
            parts: vec![1, 3],
            deleted_cells: 1,
            crushed_volume: 0.0,
            lost_parts: 0,
            lost_energy: 0.0,
            former: Vec::new(),
        };
        let behind = |has_nodes: bool| last.clone().behind(std::slice::from_ref(&fracture), &now, has_nodes);
        let went_on = behind(false).expect("no nodes");
        let next: Vec<f64> =
            continued_poses(&went_on.poses, &now, 1.0).iter().map(|pose| pose.position.x).collect();
        let off = next.iter().zip([0.2, 1.1, 2.2, 1.3]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-15, "{next:?}");
        assert!(behind(true).is_none());
    }
}
