//! What becomes of the fidelity of bodies in an increment.

use crate::model::Model;
use crate::solver::{Transition, Verdict};

/// Fidelities after an increment, and what became of them in it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FidelityCounts {
    /// Bodies that are condensed.
    pub condensed: usize,
    /// Made condensed behind the increment, or in it before it was repeated.
    pub promoted: usize,
    /// Let go back to rest behind it.
    pub demoted: usize,
    /// Times that the increment was repeated with more condensed grains.
    pub repeats: usize,
    /// Estimated relative error of the contact forces by bodies at rest in it, where fidelity is chosen.
    pub error: Option<f64>,
    /// Largest effective strain of a grain at rest over its damage threshold.
    pub utilisation: f64,
    /// Largest change of a contact force by the change of fidelities, over the mean contact force.
    pub jump: f64,
}

impl FidelityCounts {
    /// `early`: times that the increment was repeated, and grains that were made condensed for that.
    pub fn of(model: &Model, verdict: &Verdict, transition: &Transition, early: [usize; 2]) -> Self {
        let [repeats, condensed_early] = early;
        FidelityCounts {
            condensed: model.bodies.iter().filter(|body| body.is_elastic()).count(),
            promoted: condensed_early + transition.woken,
            demoted: transition.rested,
            repeats,
            error: Some(verdict.error).filter(|error| !error.is_nan()),
            utilisation: verdict.utilisation,
            jump: transition.jump,
        }
    }
}
