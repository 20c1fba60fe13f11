//! When damage moves in the search for an equilibrium, and when it has settled.
//!
//! Damage only grows in an increment, so it must not answer to forces that the contacts do not mean: it moves between two augmentations
//! once the forces are nearly in balance and agree with the bodies' elastic displacements.

use crate::assembly::Contacts;
use crate::error::Result;
use crate::model::Model;
use crate::solver::settings::{DamageSettings, Settings};

/// A point keeps its damage where less than this share of the tolerance is asked for: its grain is as it was.
const UNMOVED: f64 = 0.5;

/// What gaps of damaged bodies may miss, over the typical size of the bodies.
const GAP_FLOOR: f64 = 1e-6;

/// Follows the damage of one increment.
pub struct DamageWatch {
    can_break: bool,
    gap_floor: f64,
    /// Whether cells of brittle bodies have failed. The force on them would go on to break what is behind: they are taken out first.
    ripe: bool,
}

impl DamageWatch {
    pub fn new(model: &Model, settings: &Settings) -> Self {
        let is_damaged = model.bodies.iter().any(|body| body.softens_with_damage() && !body.is_sound());
        DamageWatch {
            can_break: settings.damage.moves && model.can_break(),
            gap_floor: if is_damaged { GAP_FLOOR * model.typical_size() } else { 0.0 },
            ripe: false,
        }
    }

    /// Gaps of damaged bodies need not agree better than this [m]: where a body has given way next to no force is left to measure by. Zero
    /// while nothing is damaged.
    pub fn gap_floor(&self) -> f64 {
        self.gap_floor
    }

    /// Whether there is any damage to follow.
    pub fn follows(&self) -> bool {
        self.can_break
    }

    /// Whether damage is to move under forces that miss their tolerances by the factor `off`.
    pub fn is_due(&self, off: f64, settings: &Settings) -> bool {
        self.can_break && !self.ripe && off <= settings.damage.readiness
    }

    /// Moves damage if the forces are worth it: `off` is by what factor they miss their tolerances. Says whether it has settled.
    ///
    /// # Errors
    /// Where a body cannot be factored any more.
    pub fn step(
        &mut self,
        contacts: &mut Contacts,
        model: &Model,
        settings: &Settings,
        off: f64,
    ) -> Result<bool> {
        let DamageSettings { max_change, tolerance, .. } = settings.damage;
        if !self.can_break || self.ripe {
            return Ok(true);
        }
        if !self.is_due(off, settings) {
            return Ok(false);
        }
        let step = contacts.move_damage(model, max_change, UNMOVED * tolerance)?;
        self.ripe = step.failed_cells > 0;
        let settled = step.applied <= tolerance && step.held_back <= tolerance;
        tracing::trace!(
            applied = step.applied,
            held_back = step.held_back,
            failed = step.newly_failed,
            flipping = step.flipping,
            moved = step.moved,
            "damage"
        );
        if !settled {
            contacts.forget_damaged_places(model);
        }
        Ok(settled)
    }
}
