//! Where the seating of a compacted specimen starts: squeezed evenly until contacts carry the pressure.
//!
//! Compaction and the removal of overlaps leave gaps of tens of micrometres, more than contacts will
//! overlap under the pressure. From such a start the solver meets the contacts one by one, which
//! took ten times the factorisations. Squeezed by the strain at which an even spread would do
//! no work (contact forces against pressure), all contacts that matter bear from the first iteration on, and what is left
//! is to even them out.

use crate::assembly::{Dofs, residual_into};
use crate::model::{Committed, Loads};
use crate::tensor::Pose;
use crate::triaxial::rig::Rig;

/// First strain tried, and the largest: beyond, the grains do not hold together.
const SMALLEST: f64 = 1e-5;
const LARGEST: f64 = 2e-2;

/// Halvings of the interval once it is known.
const HALVINGS: usize = 8;

/// Squeezes the committed configuration, which must be without contact memory, until contacts carry
/// the pressure of `loads`. Returns the linear strain, zero where contacts carry it already or no
/// strain that leaves the cores apart brings them to; then nothing has changed.
pub fn squeeze(rig: &mut Rig, loads: &Loads) -> f64 {
    let dofs = Dofs::new(&rig.model, loads);
    let (mut low, mut high) = (0.0, 0.0);
    let mut strain = SMALLEST;
    if spreads(rig, &dofs, loads, &rig.committed.poses.clone()) != Some(false) {
        return 0.0;
    }
    while high == 0.0 {
        match spreads(rig, &dofs, loads, &squeezed(rig, strain)) {
            Some(true) => high = strain,
            Some(false) if strain < LARGEST => (low, strain) = (strain, 2.0 * strain),
            Some(false) | None => return 0.0,
        }
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        match spreads(rig, &dofs, loads, &squeezed(rig, middle)) {
            Some(false) => low = middle,
            Some(true) | None => high = middle,
        }
    }
    rig.committed = Committed::new(squeezed(rig, high));
    high
}

/// The committed poses shrunk towards the foot of the axis; the bottom plate stays, the top follows.
fn squeezed(rig: &Rig, strain: f64) -> Vec<Pose> {
    let mut poses = rig.committed.poses.clone();
    let lift = -strain * rig.height(&poses);
    for (body, pose) in poses.iter_mut().enumerate() {
        if body == rig.top {
            pose.position.z += lift;
        } else if body != rig.bottom {
            pose.position *= 1.0 - strain;
        }
    }
    poses
}

/// Whether the forces on the bodies would do work in an even spread, without friction; `None` where
/// cores are too close.
fn spreads(rig: &mut Rig, dofs: &Dofs, loads: &Loads, poses: &[Pose]) -> Option<bool> {
    // From where they stand, so that nothing has slid.
    let here = Committed::new(poses.to_vec());
    rig.contacts.start(&rig.model, &here);
    rig.contacts.evaluate(&rig.model, &here, poses).ok()?;
    let mut forces = Vec::new();
    residual_into(&mut forces, &rig.model, dofs, &rig.contacts, loads, poses);
    let height = rig.height(poses);
    let mut work = 0.0;
    for (body, pose) in poses.iter().enumerate() {
        for k in 0..3 {
            if let Some(unknown) = dofs.of(body)[k] {
                let arm = if body == rig.top { height } else { pose.position[k] };
                work += forces[unknown as usize] * arm;
            }
        }
    }
    Some(work > 0.0)
}
