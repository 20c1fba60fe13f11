//! Stabilised increments: implicit steps, each from where the one before ended, until what still moves is slow enough, or all is at rest.
//!
//! The first step carries what is prescribed; loads stay as they are in the others. What is out of balance after a step is the drag on what
//! still moves, and goes on moving in the next increment. In increments of many steps friction acts along the way.
//! The work of all forces is summed along the way ([`crate::solver::path`]).

use crate::solver::balance::Balance;
use crate::solver::damage::DamageWatch;
use crate::solver::equilibrium::{Equilibrium, Following};
use crate::solver::newton::Newton;
use crate::solver::path::Path;
use crate::solver::settings::Settings;
use crate::solver::step::StepEnd;

/// Drag of an increment's first step over the typical contact stiffness; that of the next ones over the one before, and the least.
const FIRST_DRAG: f64 = 3e-2;
const DRAG_LOWER: f64 = 0.3;
const LEAST_DRAG: f64 = 3e-3;
/// The least drag where all is to come to rest.
const LEAST_DRAG_TO_REST: f64 = 1e-5;
/// Steps after which an increment is accepted whatever moves.
const MOST_STEPS: usize = 4;
/// Steps after which friction acts along the way from there on. Before, it is implicit in the whole way, so that what a step overshoots is not paid for.
const REBASE_EVERY: usize = 4;
/// The same where a body has come this share of the length that it may go in an iteration: what slides and opens on a longer way is not seen by its ends.
const REBASE_BEYOND: f64 = 0.25;
/// Newton's iterations leave this share of what a step may leave out of balance, and of what it began with.
const SHARE_OF_UNREST: f64 = 0.2;
const SHARE_OF_START: f64 = 0.05;
const SHARE_OF_TOLERANCE: f64 = 0.3;
/// Gaps of bodies that bend may miss their tolerance by this factor while something moves.
const LOOSE_GAPS: f64 = 10.0;

/// How far an increment has to come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stabilisation {
    /// Until the mean force out of balance on a body is this over the mean contact force; after a few steps all the same.
    Unrest(f64),
    /// Until the largest is below [`crate::solver::Settings::force_tolerance`].
    Rest,
}

impl Stabilisation {
    /// Whether no more moves than is asked for.
    pub(super) fn is_met(self, balance: &Balance, settings: &Settings) -> bool {
        match self {
            Stabilisation::Unrest(unrest) => balance.unrest < unrest,
            Stabilisation::Rest => balance.out_of_balance < settings.force_tolerance,
        }
    }
}

/// What bodies that deform or break have come to after a step.
struct Settled {
    /// Whether forces agree with displacements and damage, and whether they nearly do.
    fully: bool,
    nearly: bool,
    energy: f64,
}

impl Newton<'_> {
    /// Mean over the free carriers of the force out of balance [N].
    pub(super) fn mean_imbalance(&self) -> f64 {
        let free = (0..self.dofs.carriers()).filter(|carrier| self.dofs.is_free(*carrier));
        let (sum, count) = free.fold((0.0, 0), |(sum, count), carrier| {
            (sum + self.dofs.force_on(&self.residual, carrier), count + 1)
        });
        sum / f64::from(count.max(1))
    }

    /// Takes the steps of an increment.
    pub(super) fn march(&mut self, until: Stabilisation) -> Equilibrium {
        let settings = self.settings;
        let (least, most_steps) = match until {
            Stabilisation::Unrest(_) => (LEAST_DRAG, MOST_STEPS),
            Stabilisation::Rest => (LEAST_DRAG_TO_REST, settings.max_augmentations),
        };
        let mut damage = DamageWatch::new(self.model, settings);
        self.gather();
        let mut path = Path::from(self);
        let mut drag = self.uniform_drag(FIRST_DRAG);
        let mut found = Equilibrium::begun(self.balance());
        // Steps whose work is summed.
        let mut counted = 0;
        loop {
            self.counters.augmentations += 1;
            found.augmentations += 1;
            let end = self.implicit_step(&mut drag, self.step_target(until));
            let settled = match self.settle(&mut damage, until) {
                Ok(settled) => settled,
                Err(problem) => return Equilibrium { broke: Some(problem.to_string()), ..found },
            };
            found.balance = self.balance();
            found.surface_energy = settled.energy;
            found.history.push(found.balance.out_of_balance);
            tracing::trace!(
                ?end,
                unrest = found.balance.unrest,
                out_of_balance = found.balance.out_of_balance,
                "step"
            );
            found.converged =
                until.is_met(&found.balance, settings) && settled.fully && self.control_is_met();
            let tired = found.augmentations >= most_steps;
            if tired && matches!(until, Stabilisation::Unrest(_)) {
                found.converged |= end != StepEnd::Stalled && settled.nearly && self.control_is_met();
            }
            let ends = found.converged || tired || settings.stop.is_raised();
            let is_due = found.augmentations - counted == REBASE_EVERY || path.reach(self) > REBASE_BEYOND;
            let rebases = is_due && !self.model.has_elastic();
            if ends || rebases {
                path.go_on(self, found.augmentations - counted);
                counted = found.augmentations;
            }
            if ends {
                found.work = path.work;
                return found;
            }
            if rebases {
                self.rebase();
                self.evaluate();
            }
            match end {
                StepEnd::Solved => drag.lower(DRAG_LOWER, least, self),
                // Where nothing has to come to rest the next step is the next chance.
                StepEnd::Reduced | StepEnd::Stalled if until != Stabilisation::Rest => {
                    drag.lower(DRAG_LOWER, least, self);
                }
                StepEnd::Reduced | StepEnd::Stalled => {}
            }
        }
    }

    /// What Newton's iterations may leave of a step [N].
    fn step_target(&self, until: Stabilisation) -> f64 {
        let balance = self.balance();
        let share = match until {
            Stabilisation::Unrest(unrest) => SHARE_OF_UNREST * unrest,
            Stabilisation::Rest => (SHARE_OF_START * balance.out_of_balance)
                .max(SHARE_OF_TOLERANCE * self.settings.force_tolerance),
        };
        share * balance.reference_force
    }

    /// Has displacements and damage of bodies follow the forces of a step.
    fn settle(&mut self, damage: &mut DamageWatch, until: Stabilisation) -> crate::error::Result<Settled> {
        let (settings, balance) = (self.settings, self.balance());
        let mut settled = Settled { fully: true, nearly: true, energy: 0.0 };
        let mut off = match until {
            // What drives rock to fail is not at rest.
            Stabilisation::Unrest(_) => 1.0,
            Stabilisation::Rest => balance.out_of_balance / settings.force_tolerance,
        };
        if self.model.has_elastic() {
            let Following { gap, node, energy } = self.follow(&balance, damage, settings.force_tolerance);
            settled = Settled { fully: gap < 1.0 && node < 1.0, nearly: gap < LOOSE_GAPS, energy };
            if until == Stabilisation::Rest {
                off = off.max(gap).max(node);
            }
        } else if damage.is_due(off, settings) {
            self.contacts.note_loads(self.model, &self.loads, &self.poses);
        }
        settled.fully &= damage.step(&mut self.contacts, self.model, settings, off)?;
        if self.model.has_elastic() || damage.follows() {
            self.evaluate();
            self.gather();
        }
        Ok(settled)
    }
}
