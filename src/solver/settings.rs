//! Tolerances and limits of the solver.

use crate::model::StepLength;
use crate::solver::damage::DamageSettings;
use crate::solver::stabilised::Stabilisation;
use crate::solver::stop::StopSignal;

/// Steps of a dynamic relaxation after which friction is re-based where it is to work along the way.
pub const RELAXATION_REBASE: usize = 20;
/// Most steps of a dynamic relaxation while grains are seated.
const SEATING_STEPS: usize = 5000;

/// Everything that can be set; docs/decisions/0150-proximal-snaps.md and its neighbours have what the defaults were measured against.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Largest force out of balance on a body over the mean contact force.
    pub force_tolerance: f64,
    /// Largest change of a multiplier in an augmentation, as an overlap over the typical grain size.
    pub gap_tolerance: f64,
    /// First penalty of a contact of condensed bodies over the default; each adapts. Only the number
    /// of augmentations depends on it.
    pub first_penalty: f64,
    /// Augmentations before an increment is given up.
    pub max_augmentations: usize,
    /// Augmentations of a dwell, where even the smallest increment was given up; zero: none. Scenes only.
    pub max_dwell: usize,
    /// Whether this is a dwell: contacts begin soft, proximal weights fall as far as they have to, and
    /// augmentations that stop because bodies went as far as they may count a tenth.
    pub dwells: bool,
    /// Augmentations before bodies that are far from balance relax dynamically
    /// (`solver::dynamic_relaxation`); `None`: never.
    pub relaxes_after: Option<usize>,
    /// Whether bodies that may relax dynamically do so, however near to balance, where the largest proximal
    /// weight gets nowhere.
    pub relaxes_when_stuck: bool,
    /// Bodies relax dynamically where they are out of balance by more than the first, over the mean contact
    /// force, until they are by less than the second.
    pub relaxation_bounds: [f64; 2],
    /// Most steps of a dynamic relaxation.
    pub relaxation_steps: usize,
    /// Steps of a dynamic relaxation after which friction is re-based, so that it acts against the way from
    /// there on; `None`: not before a commit.
    pub relaxation_rebase: Option<usize>,
    /// How increments are stabilised; `None`: each balances to `force_tolerance`.
    pub stabilisation: Option<Stabilisation>,
    /// Newton iterations in an augmentation.
    pub max_newton: usize,
    /// Backtracking steps in a line search.
    pub max_backtracks: usize,
    /// Motion of a body in one Newton iteration over the length that `step_length` says.
    pub motion_cap: f64,
    pub step_length: StepLength,
    /// First proximal weight over the typical contact stiffness.
    pub proximal_start: f64,
    pub proximal_min: f64,
    pub proximal_max: f64,
    /// Factor on the proximal weight after a stalled augmentation, and after a good one.
    pub proximal_raise: f64,
    pub proximal_lower: f64,
    /// Share of the residual that an augmentation's Newton solve must remove.
    pub newton_reduction: f64,
    /// Merits of how many iterations back the line search may compare with.
    pub merit_memory: usize,
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
            dwells: false,
            relaxes_after: None,
            relaxes_when_stuck: false,
            relaxation_bounds: [0.1, 0.03],
            relaxation_steps: 3000,
            relaxation_rebase: None,
            stabilisation: None,
            max_newton: 12,
            max_backtracks: 5,
            motion_cap: 0.6,
            step_length: StepLength::default(),
            proximal_start: 1e-4,
            proximal_min: 1e-5,
            proximal_max: 30.0,
            proximal_raise: 6.0,
            proximal_lower: 0.3,
            newton_reduction: 0.05,
            merit_memory: 4,
            max_cuts: 6,
            damage: DamageSettings::default(),
            accuracy: None,
            stop: StopSignal::default(),
        }
    }
}

impl Settings {
    /// For a first contact of loose bodies, which nothing yet holds: stronger stabilisation, and a
    /// balance just good enough to load from.
    pub fn for_seating(&self) -> Self {
        Settings {
            force_tolerance: self.force_tolerance.max(0.1),
            proximal_start: 3e-2,
            proximal_min: 1e-3,
            ..self.clone()
        }
    }

    /// For grains that are brought into touch, from a rough balance on: where augmentations do not soon lead
    /// to it, they relax dynamically again.
    pub fn relaxed_together(&self) -> Self {
        let tolerance = self.force_tolerance;
        Settings {
            relaxes_after: Some(8),
            relaxes_when_stuck: true,
            relaxation_bounds: [3.0 * tolerance, tolerance],
            relaxation_rebase: Some(RELAXATION_REBASE),
            relaxation_steps: SEATING_STEPS,
            ..self.clone()
        }
    }

    /// For bodies that have a long way to fall; `None` where a stop is wanted instead.
    pub fn dwelling(&self) -> Option<Self> {
        (self.max_dwell > 0).then(|| Settings {
            dwells: true,
            max_augmentations: self.max_dwell,
            proximal_min: 1e-9,
            step_length: StepLength::PerBody,
            ..self.clone()
        })
    }
}
