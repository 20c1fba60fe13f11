//! The fidelity of the grains of a test: judged in every balanced state, changed in committed ones.

use crate::model::{Body, Committed, Model};
use crate::solver::fidelity::{change, judge};
use crate::solver::{IncrementReport, Transition, Verdict};
use crate::triaxial::rig::Rig;

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
        let [repeats, woken] = early;
        FidelityCounts {
            condensed: model.bodies.iter().filter(|body| body.is_elastic()).count(),
            promoted: woken + transition.woken,
            demoted: transition.rested,
            repeats,
            error: Some(verdict.error).filter(|error| !error.is_nan()),
            utilisation: verdict.utilisation,
            jump: transition.jump,
        }
    }
}

impl Rig {
    /// Has all grains rest whose flexibility is known; before anything has moved.
    pub fn rest_all(&mut self) {
        self.model.bodies.iter_mut().for_each(|body| {
            body.rest();
        });
    }

    /// Judges fidelities in the balanced state that `report` holds, under `pressure` [Pa] and with the plates where they are.
    pub(super) fn judge(&self, report: &IncrementReport, pressure: f64) -> Verdict {
        let (poses, memory, fields) = (report.poses.clone(), report.memory.clone(), report.fields.clone());
        judge(
            &self.model,
            &Committed { memory, fields, ..Committed::new(poses) },
            &self.loads(false, pressure),
            &self.settings,
            &self.contacts,
        )
    }

    /// Wakes and rests grains in the committed state.
    pub(super) fn change_fidelity(&mut self, changes: [&[usize]; 2]) -> Transition {
        change(&mut self.model, &mut self.committed, &mut self.contacts, self.pressure, changes)
    }

    /// Wakes the grains that the seated specimen needs condensed, as if they had been so from the start: it has to be seated again.
    /// How many that are.
    pub fn wake_seated(&mut self) -> usize {
        if self.settings.accuracy.is_none() {
            return 0;
        }
        let loads = self.loads(false, self.pressure);
        let verdict = judge(&self.model, &self.committed, &loads, &self.settings, &self.contacts);
        let woken = verdict.wake.iter().filter(|&&body| self.model.bodies[body].wake()).count();
        tracing::info!(
            woken,
            error = verdict.error,
            used = verdict.utilisation,
            "fidelity of the seated specimen"
        );
        if woken > 0 {
            self.begin_contacts_anew();
        }
        woken
    }

    /// Contacts are as if they had just been made, with the stiffnesses that bodies have now.
    pub(super) fn begin_contacts_anew(&mut self) {
        self.committed.memory.clear();
        self.committed.fields.clear();
        let timings = std::mem::take(&mut self.contacts).timings;
        self.contacts.timings = timings;
    }

    /// How each body deforms, as results files number it.
    pub fn levels(&self) -> Vec<u8> {
        self.model.bodies.iter().map(Body::level).collect()
    }
}
