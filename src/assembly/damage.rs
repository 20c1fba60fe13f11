//! The trial damage of an increment: bodies that can break get more of it between augmentations.
//!
//! Everything here is of the increment at hand. The committed grains are the model's and are only copied, so a
//! rejected increment leaves no trace.

use std::sync::Arc;
use std::time::Instant;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::assembly::contacts::Contacts;
use crate::assembly::elastic::SurfaceLoads;
use crate::assembly::timings::Kernel;
use crate::error::Result;
use crate::grain::{DamageChange, DamagedGrain};
use crate::model::{Body, Model};
use crate::tensor::Vec3;

/// Grains with trial damage, by body; empty until damage is asked for.
#[derive(Debug, Clone, Default)]
pub struct Trial {
    grains: Vec<Option<DamagedGrain>>,
}

/// What one move of the damage did, over all bodies.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DamageStep {
    /// Largest change of `1 - d` at a point.
    pub applied: f64,
    /// Largest change that the limit held back.
    pub held_back: f64,
    /// Points whose cracks open and close in turn.
    pub flipping: usize,
    pub newly_failed: usize,
    /// Bodies that got a new factor.
    pub factored: usize,
}

/// What damage an accepted increment brings; nothing of it is in the model yet.
#[derive(Debug, Clone, Default)]
pub struct Damages {
    /// The committed grains, by body; `None` for those that cannot break.
    pub grains: Vec<Option<Arc<DamagedGrain>>>,
    /// Energy that damage set free in the increment [J].
    pub dissipated: f64,
    /// Elastic energy that left with points that failed [J]: part of `dissipated`.
    pub removed: f64,
    pub newly_failed: usize,
    /// Cells without a working point: to be deleted.
    pub failed_cells: usize,
}

/// What an increment leaves to be taken out: bodies with cells to be deleted, and how their nodes are displaced.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Failing {
    /// Whether any point failed, which carries nothing any more: forces have to find a new balance.
    any: bool,
    bodies: Vec<(u32, Displacements)>,
}

/// [m]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Displacements(#[serde(with = "crate::tensor::stored")] Vec<Vec3>);

impl Failing {
    pub fn is_empty(&self) -> bool {
        !self.any
    }

    /// By body, for [`Model::break_up`].
    pub fn displacements(&self, bodies: usize) -> Vec<Vec<Vec3>> {
        let mut all = vec![Vec::new(); bodies];
        for (body, displacements) in &self.bodies {
            if let Some(of_body) = all.get_mut(*body as usize) {
                of_body.clone_from(&displacements.0);
            }
        }
        all
    }
}

impl Damages {
    /// What is to be broken up; nothing where no point has failed.
    pub fn failing(&self) -> Failing {
        let failed = self.grains.iter().enumerate().filter_map(|(body, grain)| {
            let grain = grain.as_ref().filter(|grain| grain.failed_cells() > 0)?;
            Some((body as u32, Displacements(grain.displaced().to_vec())))
        });
        match self.newly_failed {
            0 => Failing::default(),
            _ => Failing { any: true, bodies: failed.collect() },
        }
    }
}

impl Contacts {
    /// Moves the trial damage towards what the forces of the last augmentation ask for, by at most `max_change` at a point, and
    /// displaces the surfaces of the bodies that got softer. Evaluate anew afterwards.
    ///
    /// # Errors
    /// Where a body cannot be factored any more: give the increment up.
    pub fn move_damage(&mut self, model: &Model, max_change: f64) -> Result<DamageStep> {
        let start = Instant::now();
        let grains = &mut self.trial.grains;
        if grains.is_empty() {
            // Resting bodies have no loads here.
            let breaks = |body: &Body| body.damaged.as_deref().filter(|_| body.grain.is_some()).cloned();
            grains.extend(model.bodies.iter().map(breaks));
        }
        let step = |(grain, loads): (&mut Option<DamagedGrain>, &SurfaceLoads)| -> Result<_> {
            let Some(grain) = grain else { return Ok(None) };
            let change = grain.propose(loads, max_change)?;
            Ok(Some((change, grain.refresh()?)))
        };
        let changes: Vec<Option<(DamageChange, bool)>> =
            grains.par_iter_mut().zip(&self.surface_loads).map(step).collect::<Result<_>>()?;
        let mut total = DamageStep::default();
        for (body, change) in changes.into_iter().enumerate() {
            let Some((change, fresh)) = change else { continue };
            total.applied = total.applied.max(change.applied);
            total.held_back = total.held_back.max(change.held_back);
            total.flipping += change.flipping;
            total.newly_failed += change.newly_failed;
            if let (true, Some(grain)) = (fresh, &self.trial.grains[body]) {
                total.factored += 1;
                grain.condensed().surface_field_into(&mut self.fields[body], &self.surface_loads[body]);
                self.grains[body] = Some(grain.condensed().clone());
            }
        }
        if total.factored > 0 {
            self.update_reach();
        }
        self.timings.book(Kernel::Damage, start);
        Ok(total)
    }

    /// The damage that goes with the accepted configuration; empty where nothing can break.
    ///
    /// # Errors
    /// As [`Contacts::move_damage`].
    pub fn damages(&self, model: &Model) -> Result<Damages> {
        if !model.can_break() || self.surface_loads.is_empty() {
            return Ok(Damages::default());
        }
        let commit = |(body, loads): (usize, &SurfaceLoads)| -> Result<_> {
            let trial = self.trial.grains.get(body).and_then(Option::as_ref);
            let own = model.bodies[body].damaged.as_deref().filter(|_| model.bodies[body].grain.is_some());
            let Some(mut grain) = trial.or(own).cloned() else { return Ok(None) };
            let mut kept = grain.commit(loads)?;
            if kept.newly_failed > 0 {
                let lost = grain.crumble();
                kept.dissipated += lost;
                kept.removed += lost;
                kept.failed_cells = grain.failed_cells();
            }
            Ok(Some((kept, Arc::new(grain))))
        };
        let kept: Vec<_> =
            self.surface_loads.par_iter().enumerate().map(commit).collect::<Result<Vec<_>>>()?;
        let mut damages = Damages::default();
        for grain in kept {
            damages.grains.push(grain.map(|(kept, grain)| {
                damages.dissipated += kept.dissipated;
                damages.removed += kept.removed;
                damages.newly_failed += kept.newly_failed;
                damages.failed_cells += kept.failed_cells;
                grain
            }));
        }
        Ok(damages)
    }
}
