//! Bodies with the damage that an increment tries; the committed ones are the model's.

use crate::assembly::place::SurfaceLoads;
use crate::error::Result;
use crate::grain::{DamageChange, DamagedGrain};
use crate::model::Model;
use crate::tensor::Vec3;

/// Most proposals of a brittle grain in one move.
const MOST_ALONE: usize = 200;
/// A brittle grain that settled keeps its damage while no nodal force has changed by more than this share of the largest since: damage
/// `1 - (e_0/e)^N` then changes by less than N times that.
pub(super) const UNCHANGED: f64 = 1e-4;

/// Grains with trial damage, by body; empty until damage is asked for.
#[derive(Debug, Clone, Default)]
pub struct Trial {
    pub(super) grains: Vec<Option<DamagedGrain>>,
    /// Of the brittle ones.
    pub(super) alone: Vec<Alone>,
    /// Whether the damage of a body moved when it was last to.
    pub(super) moved: Vec<bool>,
}

/// What a brittle grain has come to by itself, between two augmentations.
#[derive(Debug, Clone, Default)]
pub(super) struct Alone {
    /// The nodal forces that it last settled under [N].
    pub(super) settled: Option<Vec<Vec3>>,
    /// What is left of the rock's stiffness below each facet, the least so far: cracks that close in the
    /// trial make no contact stiffer again.
    pub(super) stiffness_left: Vec<f64>,
}

impl Trial {
    /// The grain of a body with its trial damage; the committed one where none has moved yet.
    pub fn grain<'a>(&'a self, model: &'a Model, body: usize) -> Option<&'a DamagedGrain> {
        let trial = self.grains.get(body).and_then(Option::as_ref);
        trial.or_else(|| Some(&**model.bodies.get(body)?.damaged()?))
    }

    /// What is left of the stiffness of a brittle body's rock below a facet.
    pub fn stiffness_left(&self, model: &Model, body: usize, facet: u32) -> f64 {
        let known = self.alone.get(body).and_then(|alone| alone.stiffness_left.get(facet as usize).copied());
        known.or_else(|| Some(self.grain(model, body)?.stiffness_left(facet))).unwrap_or(1.0)
    }
}

impl Alone {
    /// Lets the grain damage under `loads` until it has settled, a cell has failed, or rock under a force has softened by `max_change`, which the
    /// forces have to answer to first. Says what neighbours see of it, `applied` being by how much rock under a force has softened, and whether
    /// any damage has moved.
    pub(super) fn settle(
        &mut self,
        grain: &mut DamagedGrain,
        loads: &SurfaceLoads,
        max_change: f64,
        least_change: f64,
    ) -> Result<(DamageChange, bool)> {
        let forces = grain.condensed().surface_forces(loads);
        if self.settled.as_ref().is_some_and(|before| are_alike(before, &forces)) {
            return Ok((DamageChange::default(), false));
        }
        let facets = grain.mesh().surface.len() as u32;
        if self.stiffness_left.is_empty() {
            self.stiffness_left.extend((0..facets).map(|facet| grain.stiffness_left(facet)));
        }
        let mut loaded = vec![false; facets as usize];
        loads.iter().for_each(|(place, _)| loaded[place.facet as usize] = true);
        let mut total = DamageChange::default();
        let (mut moved, mut is_settled) = (false, false);
        for _ in 0..MOST_ALONE {
            let change = grain.propose_beyond(loads, max_change, least_change)?;
            moved |= change.applied > 0.0;
            let softened = |facet: u32| match loaded[facet as usize] {
                true => self.stiffness_left[facet as usize] - grain.stiffness_left(facet),
                false => 0.0,
            };
            let softened = (0..facets).map(softened).fold(0.0, f64::max);
            is_settled = change.applied.max(change.held_back) <= 2.0 * least_change;
            let is_over = is_settled || change.failed_cells > 0;
            total = DamageChange {
                applied: softened,
                held_back: if is_over { 0.0 } else { change.applied.max(change.held_back) },
                newly_failed: total.newly_failed + change.newly_failed,
                ..change
            };
            if is_over || softened >= max_change {
                break;
            }
        }
        for (facet, least) in (0..facets).zip(&mut self.stiffness_left) {
            *least = least.min(grain.stiffness_left(facet));
        }
        self.settled = is_settled.then_some(forces);
        Ok((total, moved))
    }
}

/// Whether no nodal force differs by more than [`UNCHANGED`] of the largest.
fn are_alike(before: &[Vec3], now: &[Vec3]) -> bool {
    let largest = before.iter().map(Vec3::amax).fold(0.0, f64::max);
    before.len() == now.len() && before.iter().zip(now).all(|(a, b)| (a - b).amax() <= UNCHANGED * largest)
}
