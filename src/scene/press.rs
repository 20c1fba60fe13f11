//! A press: one body of the scene between two plates, nodes against planes, instead of the contact of hulls.
//!
//! Where a round face is pressed, contact of hulls is at corners and edges only, which crush first; here every surface node of the mesh carries
//! its share (`crushing`), whatever the face, so a block carries its strength over its whole face. The rest is a scene's: stages, increments that
//! are cut, rows, restart points. Parts of a body that came apart are bodies of their own and stand between the plates side by side.

use serde::{Deserialize, Serialize};

use crate::crushing::{Bench, Grip, Limits, Memory, Part, Plate, Push, Settled};
use crate::error::{Error, Result};
use crate::grain::DamagedGrain;
use crate::loading::Ledger;
use crate::model::Body;
use crate::tensor::{Mat3, Pose, Rotation, Vector6, symmetric};

/// Who is pressed by whom, by number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressParameters {
    pub body: usize,
    pub bottom: usize,
    pub top: usize,
    pub grip: Grip,
    /// Radius of the patch by which a node meets a plate [m]; `None`: the node alone.
    pub patch: Option<f64>,
}

/// Damage has settled when no point changes by more than this.
pub(super) const SETTLED: f64 = 1e-3;
/// Rounds of contact and damage before an increment is cut.
pub(super) const MOST_ROUNDS: usize = 400;
/// Energy that an increment may hold beyond what it had to spend, over its work or [`WORK_SHARE`] of all work so far, whichever is more:
/// else it is cut. The trapezoid of the work is second order in the increment.
const CREATED: f64 = 1e-3;
const WORK_SHARE: f64 = 0.2;
/// A press in progress.
#[derive(Debug, Clone)]
pub struct Pressing {
    pub(super) parameters: PressParameters,
    pub(super) bench: Bench,
    /// What is left of the body: the number of each part's body, and the part.
    pub(super) parts: Vec<(usize, Part)>,
    /// Forces of the plates on the parts in the last accepted state; not stored.
    pub(super) pushes: Vec<(usize, Push)>,
}

/// An increment of a press in balance, not committed.
pub struct Pressed {
    pub(super) settled: Vec<Settled>,
    /// With the plates where they were driven to.
    pub(super) poses: Vec<Pose>,
}

/// What of it is stored: the parts' bodies and memories.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct StoredPressing {
    parts: Vec<(u32, Memory)>,
}

/// The face of a plate: its highest or its lowest part, `pose` its place.
fn face(body: &Body, pose: &Pose, upper: bool) -> Plate {
    let extent = |k: usize| {
        let along = body.nominal.vertices.iter().map(|v| v[k]);
        [along.clone().fold(f64::INFINITY, f64::min), along.fold(f64::NEG_INFINITY, f64::max)]
    };
    let (x, y, z) = (extent(0), extent(1), extent(2));
    let middle = |along: [f64; 2], k: usize| pose.position[k] + 0.5 * (along[0] + along[1]);
    Plate {
        height: pose.position.z + if upper { z[0] } else { z[1] },
        centre: [middle(x, 0), middle(y, 1)],
        half: [0.5 * (x[1] - x[0]), 0.5 * (y[1] - y[0])],
    }
}

impl Pressing {
    /// Sets the body on the lower plate and the upper plate on the body.
    ///
    /// # Errors
    /// `Error::Usage` where the body cannot break, or a plate meets none of its nodes.
    pub(super) fn new(parameters: PressParameters, bodies: &mut [Body], poses: &mut [Pose]) -> Result<Self> {
        let PressParameters { body, bottom, top, grip, patch } = parameters;
        let Some(grain) = bodies[body].damaged() else {
            let name = &bodies[body].name;
            return Err(Error::Usage(format!("{name:?} is pressed, but its rock has no damage")));
        };
        let grain = (**grain).clone().failing_at_once();
        bodies[body].breakage = bodies[body].breakage.of(std::sync::Arc::new(grain.clone()));
        let mut plates =
            [face(&bodies[bottom], &poses[bottom], false), face(&bodies[top], &poses[top], true)];
        let heights = || grain.mesh().nodes.iter().map(|x| poses[body].to_space(x).z);
        let low = heights().fold(f64::INFINITY, f64::min);
        let high = heights().fold(f64::NEG_INFINITY, f64::max);
        let rise = plates[0].height - low;
        poses[body].position.z += rise;
        poses[top].position.z += high + rise - plates[1].height;
        plates[1].height = high + rise;
        for (plate, name) in plates.iter().zip([bottom, top].map(|plate| &bodies[plate].name)) {
            let mesh = grain.mesh();
            let nodes = mesh.surface_nodes().into_iter().map(|node| mesh.nodes[node.index()]);
            if grip != Grip::Tied && !nodes.map(|x| poses[body].to_space(&x)).any(|x| plate.covers(&x)) {
                return Err(Error::Usage(format!(
                    "the plate {name:?} meets no node of {:?}: it is beside the body, or smaller than its cells, which are then too large",
                    bodies[body].name
                )));
            }
        }
        let bench = Bench {
            grip,
            patch,
            frame: poses[body],
            plates,
            length: high - low,
            modulus: grain.law(crate::mesh::CellId(0)).elastic().youngs_modulus(),
        };
        Ok(Pressing { parameters, bench, parts: vec![(body, Part::new(grain))], pushes: Vec::new() })
    }

    pub(super) fn stored(&self) -> StoredPressing {
        let part = |(body, part): &(usize, Part)| (*body as u32, part.memory.clone());
        StoredPressing { parts: self.parts.iter().map(part).collect() }
    }

    /// Takes what was stored; `bodies` are those of that time. `false`, and nothing is changed, where they do not fit.
    pub(super) fn restore(&mut self, stored: StoredPressing, bodies: &[Body]) -> bool {
        let part = |(body, memory): (u32, Memory)| {
            let grain = DamagedGrain::clone(bodies.get(body as usize)?.damaged()?);
            Some((body as usize, Part::with_memory(grain, memory)))
        };
        let parts: Option<Vec<_>> = stored.parts.into_iter().map(part).collect();
        match parts {
            Some(parts) => self.parts = parts,
            None => return false,
        }
        true
    }

    /// Forces of the plates on the bodies in the last accepted state, by body; positions [m] and forces [N] in space.
    pub fn pushes(&self) -> &[(usize, Push)] {
        &self.pushes
    }

    /// Numbers of the plates, the lower one and the upper one.
    pub fn plates(&self) -> [usize; 2] {
        [self.parameters.bottom, self.parameters.top]
    }

    /// Mean stress of each of `count` bodies [Pa], from their cells; not a number for the plates.
    pub fn mean_stresses(&self, count: usize) -> Vec<Mat3> {
        let mut means = vec![Mat3::repeat(f64::NAN); count];
        for (body, part) in &self.parts {
            let mesh = part.grain.mesh();
            let mut mean = Vector6::zeros();
            for (cell, points) in mesh.cell_ids().zip(part.grain.stresses()) {
                let share = mesh.cell_volume(cell) / points.len() as f64;
                points.iter().for_each(|stress| mean += stress * share);
            }
            mean /= mesh.volume();
            let turn = self.bench.frame.rotation.to_rotation_matrix();
            means[*body] = turn.matrix() * symmetric(mean.into()) * turn.matrix().transpose();
        }
        means
    }

    /// Brings the plates to where `poses` have them.
    pub(super) fn move_plates(&mut self, bodies: &[Body], poses: &[Pose]) {
        let [bottom, top] = self.plates();
        self.bench.plates =
            [face(&bodies[bottom], &poses[bottom], false), face(&bodies[top], &poses[top], true)];
    }

    /// Forgets a settled state.
    pub(super) fn reject(&mut self) {
        self.parts.iter_mut().for_each(|(_, part)| part.grain.reject());
    }

    /// All parts at rest between the plates where these are now, or why one is not.
    pub(super) fn settle(
        &mut self,
        limits: &Limits,
        stopped: &dyn Fn() -> bool,
    ) -> std::result::Result<Vec<Settled>, String> {
        let mut all = Vec::with_capacity(self.parts.len());
        for (_, part) in &mut self.parts {
            let settled =
                part.settle(&self.bench, limits, stopped).unwrap_or_else(|error| Err(error.to_string()));
            match settled {
                Ok(settled) => all.push(settled),
                Err(reason) => {
                    self.reject();
                    return Err(reason);
                }
            }
        }
        Ok(all)
    }

    /// Whether this increment would hold more energy than it had to spend: the way of the upper plate [m, closing positive], its force before [N],
    /// the ledger before.
    pub(super) fn creates(&self, settled: &[Settled], way: f64, before: f64, ledger: &Ledger) -> bool {
        let after: f64 = settled.iter().map(|settled| settled.contact.force()).sum();
        let work = 0.5 * (before + after) * way;
        let (mut elastic, mut freed) = (0.0, 0.0);
        for ((_, part), settled) in self.parts.iter().zip(settled) {
            let Ok(kept) = part.would_keep(settled) else { return false };
            elastic += kept.elastic + settled.contact.patch_energy;
            freed += kept.dissipated;
        }
        let gap = work - (elastic - ledger.elastic) - freed;
        gap < -CREATED * work.abs().max(WORK_SHARE * ledger.external)
    }

    /// Where a body is whose part has moved like this.
    pub(super) fn pose_of(&self, settled: &Settled) -> Pose {
        let [translation, turn, centre] = settled.contact.motion;
        let turn = Rotation::from_scaled_axis(turn);
        let frame = &self.bench.frame;
        Pose::new(centre + translation + turn * (frame.position - centre), turn * frame.rotation)
    }
}
