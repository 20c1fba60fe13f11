//! The fidelity of the grains of a test: judged in every balanced state, changed in committed ones.

use crate::model::Body;
use crate::solver::fidelity::{change, judge};
use crate::solver::{IncrementReport, Transition, Verdict};
use crate::triaxial::rig::Rig;

impl Rig {
    /// Judges fidelities in the balanced state that `report` holds, under `pressure` [Pa] and with the plates where they are.
    pub(super) fn judge(&self, report: &IncrementReport, pressure: f64) -> Verdict {
        let loads = self.loads(false, pressure);
        judge(&self.model, &report.as_committed(), &loads, &self.settings, &self.contacts)
    }

    /// Makes grains condensed and rigid in the committed state.
    pub(super) fn change_fidelity(&mut self, changes: [&[usize]; 2]) -> Transition {
        change(&mut self.model, &mut self.committed, &mut self.contacts, self.pressure, changes)
    }

    /// Makes the grains condensed that the seated specimen needs so, as if they had been so from the start: it has to be seated again.
    /// How many that are.
    pub fn condense_seated(&mut self) -> usize {
        if self.settings.accuracy.is_none() {
            return 0;
        }
        let loads = self.loads(false, self.pressure);
        let verdict = judge(&self.model, &self.committed, &loads, &self.settings, &self.contacts);
        let condensed = verdict.wake.iter().filter(|&&body| self.model.bodies[body].wake()).count();
        tracing::info!(
            condensed,
            error = verdict.error,
            used = verdict.utilisation,
            "fidelity of the seated specimen"
        );
        if condensed > 0 {
            self.begin_contacts_anew();
        }
        condensed
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
