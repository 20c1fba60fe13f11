//! What broke in an increment is broken up behind it: failed rock is taken out, and what it held is out of balance until grains have moved.

use crate::assembly::TooClose;
use crate::error::{Error, Result};
use crate::loading::Portion;
use crate::model::Fracture;
use crate::solver::{DamageSettings, Increment, IncrementReport, Settings, StepStatus, advance};
use crate::triaxial::drive::{Drive, Guess};
use crate::triaxial::rig::Rig;
use crate::triaxial::test::Test;
use crate::triaxial::test::increments::REST_SHARE;

impl Test {
    /// Breaks up what the last increment left to, `done` of the stage behind it; which bodies broke, `None` where no rock failed. Contacts on failed rock
    /// and on new shapes store other energy: what they lose is crushing, what they gain came from nowhere and is told as such.
    pub(super) fn break_up(
        &mut self,
        rig: &mut Rig,
        drive: &Drive,
        done: f64,
    ) -> Result<Option<Vec<Fracture>>> {
        if rig.failing.is_empty() {
            return Ok(None);
        }
        let fractures = rig.break_up()?;
        // The forces that are kept are of the cover that goes on.
        self.mend_cover(rig, drive);
        let after = self.forces_now(rig, drive, done);
        if let StepStatus::TooClose(pair) = after.status {
            return Err(Error::Specimen(TooClose::described(pair, &rig.model)));
        }
        // What contacts on failed rock lose is booked here: they go on from what they bear now, or the next increment would book it again.
        let change = after.energy.elastic - (self.start_elastic + self.ledger.elastic);
        rig.committed.memory = after.memory;
        rig.committed.forces = after.forces;
        let lost: f64 = fractures.iter().map(|fracture| fracture.lost_energy).sum();
        let (released, gained) = ((-change).max(0.0), change.max(0.0));
        tracing::info!(released, gained, lost, "shapes changed");
        // What parts that were given up had stored is part of the change.
        self.ledger.crushing += (released - lost).max(0.0);
        self.ledger.damage += released;
        self.ledger.reshaped += gained;
        self.ledger.elastic += change;
        Ok(Some(fractures))
    }

    /// Forces and elastic energy of the committed state, in balance or not.
    fn forces_now(&self, rig: &mut Rig, drive: &Drive, done: f64) -> IncrementReport {
        let now = self.state(rig, &rig.committed.poses, rig.pressure, self.ram);
        let (area, pressure) = (now.volume / now.height, now.pressure);
        let guess = Guess { area, pressure, deviatoric_stress: now.deviatoric_stress };
        let loads = drive.loads(rig, Portion { share: REST_SHARE, to: done }, &guess);
        let damage = DamageSettings { moves: false, ..rig.settings.damage };
        // Without a step: with one, what moves next would be counted as lost here.
        let settings = Settings { max_augmentations: 0, damage, ..rig.settings.clone() };
        let increment =
            Increment { model: &rig.model, committed: &rig.committed, loads: &loads, settings: &settings };
        advance(&increment, vec![rig.committed.poses.clone()], &mut rig.contacts)
    }

    /// Has a folded cover laid anew where that is free to change the volume.
    fn mend_cover(&mut self, rig: &mut Rig, drive: &Drive) {
        if !drive.prescribes_volume() {
            self.zero.mend(rig);
        }
    }
}
