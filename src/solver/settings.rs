//! Tolerances and limits of the solver.

use crate::model::Model;
use crate::solver::balance::Balance;
use crate::solver::stop::StopSignal;

/// Most steps of a dynamic relaxation while grains are seated.
const SEATING_STEPS: usize = 5000;

/// When bodies relax dynamically (`solver::dynamic_relaxation`), and for how long. They also do where steps get nowhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relaxation {
    /// Steps before.
    pub after: usize,
    /// Where they are out of balance by more than the first, over the mean contact force, until they are by less than the second.
    pub bounds: [f64; 2],
    pub most_steps: usize,
}

/// How far an increment has to come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stabilisation {
    /// Until the mean force out of balance on a body is this over the mean contact force; after forty steps all the same.
    Unrest(f64),
    /// Until the largest is below [`Settings::force_tolerance`].
    Rest,
}

impl Stabilisation {
    /// Whether what a step leaves is made up for in the next: where all is to come to rest, or displacements wait for augmentations, it is not.
    pub(super) fn goes_on(self, model: &Model) -> bool {
        matches!(self, Stabilisation::Unrest(_)) && !model.waits_for_augmentations()
    }

    /// Whether no more moves than is asked for.
    pub(super) fn is_met(self, balance: &Balance, tolerance: f64) -> bool {
        match self {
            Stabilisation::Unrest(unrest) => balance.unrest < unrest,
            Stabilisation::Rest => balance.out_of_balance < tolerance,
        }
    }
}

/// How damage is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DamageSettings {
    /// Whether damage moves at all.
    pub moves: bool,
    /// Largest change of d at a point between two augmentations: keeps the path from depending on their order. In a brittle body it limits each of
    /// the steps that it takes by itself, and between two augmentations what rock under a force may soften by.
    pub max_change: f64,
    /// An increment is accepted when no d changes by more than this.
    pub tolerance: f64,
    /// Damage moves where forces and gaps miss their tolerances by no more than this factor.
    pub readiness: f64,
}

impl Default for DamageSettings {
    fn default() -> Self {
        DamageSettings { moves: true, max_change: 0.2, tolerance: 1e-3, readiness: 10.0 }
    }
}

/// Everything that can be set; docs/decisions/0001-implicit-steps-against-a-drag.md to 0009 have what the defaults were measured against.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Largest force out of balance on a body over the mean contact force.
    pub force_tolerance: f64,
    /// What gaps and contact forces of bodies that deform may disagree by at rest, over the typical size; less where a rigid contact hardly yields
    /// (`solver::equilibrium`).
    pub gap_tolerance: f64,
    /// First penalty of a contact of condensed bodies over the default; each adapts. Only the number
    /// of augmentations depends on it.
    pub first_penalty: f64,
    /// Augmentations before an increment is given up.
    pub max_augmentations: usize,
    /// Steps in which bodies come to balance that fell, where even the smallest increment was given up; zero: none fall. Scenes only.
    pub max_dwell: usize,
    /// When bodies relax dynamically; `None`: never.
    pub relaxation: Option<Relaxation>,
    /// How far an increment has to come.
    pub stabilisation: Stabilisation,
    /// Whether rigid bodies may go on by explicit steps where all is to come to rest. Where every increment does, collapses of weak rock then end out of
    /// balance, or lose hundredths of the work without an account (docs/decisions/0196-explicit-steps-to-rest.md).
    pub explicitly_to_rest: bool,
    /// Drag of the first step over the typical contact stiffness, and the least, where all is to come to rest.
    pub drag_to_rest: [f64; 2],
    /// Newton iterations in a step.
    pub max_newton: usize,
    /// Motion of a body in one Newton iteration over the smallest rounding.
    pub motion_cap: f64,
    /// Times an increment is halved before it stops.
    pub max_cuts: usize,
    /// For bodies that can break.
    pub damage: DamageSettings,
    /// Error of the contact forces, relative, that bodies whose fidelity is chosen may cause by resting (`solver::fidelity`); `None`: no
    /// fidelity is chosen.
    pub accuracy: Option<f64>,
    /// Has increments given up between augmentations.
    pub stop: StopSignal,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            force_tolerance: 1e-3,
            gap_tolerance: 1e-5,
            first_penalty: 1.0,
            max_augmentations: 600,
            max_dwell: 0,
            relaxation: None,
            stabilisation: Stabilisation::Rest,
            explicitly_to_rest: false,
            drag_to_rest: [3e-2, 1e-5],
            max_newton: 12,
            motion_cap: 0.6,
            max_cuts: 6,
            damage: DamageSettings::default(),
            accuracy: None,
            stop: StopSignal::default(),
        }
    }
}

impl Settings {
    /// For a first contact of loose bodies, which nothing yet holds: they relax dynamically at once, to a balance just good enough to load from.
    pub fn for_seating(&self) -> Self {
        Settings {
            force_tolerance: self.force_tolerance.max(0.1),
            drag_to_rest: [3e-2, 1e-3],
            relaxation: Some(Relaxation { after: 0, bounds: [0.1, 0.03], most_steps: SEATING_STEPS }),
            ..self.clone()
        }
    }

    /// For grains that are brought into touch, from a rough balance on: where steps do not soon lead to it, they relax dynamically again.
    pub fn relaxed_together(&self) -> Self {
        let tolerance = self.force_tolerance;
        let bounds = [3.0 * tolerance, tolerance];
        Settings {
            relaxation: Some(Relaxation { after: 8, bounds, most_steps: SEATING_STEPS }),
            ..self.clone()
        }
    }

    /// For bodies that have fallen ([`crate::scene`]) and lie nearly at rest; `None` where a stop is wanted instead.
    pub fn behind_a_fall(&self) -> Option<Self> {
        let [first, _] = self.drag_to_rest;
        (self.max_dwell > 0).then(|| Settings {
            max_augmentations: self.max_dwell,
            drag_to_rest: [first, 1e-9],
            ..self.clone()
        })
    }
}
