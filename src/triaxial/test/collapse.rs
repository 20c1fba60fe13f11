//! Collapses of specimens whose grains break: rock is taken out and lets go of what it held, bodies fall, and states on the way are committed
//! without rows.

use crate::error::Result;
use crate::model::Loads;
use crate::solver::{DamageSettings, Increment, IncrementReport, Settings, StepStatus, advance};
use crate::triaxial::drive::{Drive, Guess};
use crate::triaxial::remnants::{Remnants, Touching};
use crate::triaxial::rig::Rig;
use crate::triaxial::test::trial::Trial;
use crate::triaxial::test::{DWELL_SHARE, Miss, Test, UnderWay};

/// Pieces in which a dwell may follow a collapse, each of about a rounding.
const MOST_PIECES: usize = 300;
/// The same where bodies do not fall, each of as many augmentations as an increment may take.
const MOST_TIRED_PIECES: usize = 10;

impl Test {
    /// Lets grains that broke fall to a rough balance under the loads as they are, and takes what comes of it as the state to go on from, as
    /// seating does: a collapse is followed in pieces. Nothing more breaks meanwhile; what is set free goes to the stabilisation with the dwell.
    /// `false`, and nothing is changed, where it comes to nothing better balanced than what it began with.
    pub(super) fn settle(&mut self, rig: &mut Rig, way: &mut UnderWay, share: f64, to: f64) -> bool {
        let loads = self.loads_now(rig, way, share, to);
        let mut settings = rig.settings.falling().for_seating();
        settings.damage.moves = false;
        // Whatever it comes to may be taken, and is looked at for overlaps.
        settings.rough_tolerance = f64::INFINITY;
        let increment =
            Increment { model: &rig.model, committed: &rig.committed, loads: &loads, settings: &settings };
        let report = advance(&increment, vec![rig.committed.poses.clone()], &mut rig.contacts);
        let before = report.history.first().copied().unwrap_or(0.0);
        way.settlings += 1;
        let overlaps = matches!(report.status, StepStatus::Overlapping { .. });
        let is_better = !overlaps && report.balance.out_of_balance < before;
        tracing::debug!(before, after = report.balance.out_of_balance, is_better, "settled");
        if is_better {
            // What pressure and ram do on the way, as for an increment.
            let trial = self.weigh(rig, way, &report, share, to);
            self.take_piece(rig, way, &report, &trial, share);
        } else {
            way.spent.add(&report.counters);
        }
        is_better
    }

    /// Commits a step in which failed rock lets go of some of what it held. A force whose bodies part is ended first, for the step to be repeated.
    pub(super) fn let_down(
        &mut self,
        rig: &mut Rig,
        way: &mut UnderWay,
        report: &IncrementReport,
        share: f64,
        to: f64,
    ) {
        if !Self::lets_go(rig, way, report) {
            let trial = self.weigh(rig, way, report, share, to);
            self.take_piece(rig, way, report, &trial, share);
        }
    }

    /// Ends the forces of failed rock whose bodies part; whether there were any, so that what was reported is to be repeated.
    fn lets_go(rig: &Rig, way: &mut UnderWay, report: &IncrementReport) -> bool {
        let lets_go = way.remnants.let_go(&rig.model, &rig.committed.poses, &report.poses);
        if lets_go {
            way.spent.add(&report.counters);
        }
        lets_go
    }

    /// Commits a state on the way of a dwell, of which no row is made.
    fn take_piece(
        &mut self,
        rig: &mut Rig,
        way: &mut UnderWay,
        report: &IncrementReport,
        trial: &Trial,
        share: f64,
    ) {
        way.spent.add(&report.counters);
        let last = self.commit(rig, &way.drive, report, trial, share);
        if report.converged() {
            way.remnants.release();
        } else {
            way.remnants.squeeze(&last.poses, &rig.committed.poses);
        }
    }

    /// The loads in force at the share `to`, at the cross-section as it is.
    fn loads_now(&self, rig: &Rig, way: &UnderWay, share: f64, to: f64) -> Loads {
        let now = self.state(rig, &rig.committed.poses, rig.pressure, self.ram);
        let (area, pressure) = (now.volume / now.height, now.pressure);
        let guess = Guess { area, pressure, deviatoric_stress: now.deviatoric_stress };
        let mut loads = way.drive.loads(rig, share, to, &guess);
        way.remnants.add_to(&mut loads);
        loads
    }

    /// Contact forces of the committed state, and the elastic energy in it [J].
    fn touching(&self, rig: &mut Rig, way: &UnderWay) -> (Touching, f64) {
        let loads = self.loads_now(rig, way, DWELL_SHARE, way.pace.done());
        let damage = DamageSettings { moves: false, ..rig.settings.damage };
        let settings = Settings { max_augmentations: 0, falls_after: None, damage, ..rig.settings.clone() };
        let increment =
            Increment { model: &rig.model, committed: &rig.committed, loads: &loads, settings: &settings };
        let report = advance(&increment, vec![rig.committed.poses.clone()], &mut rig.contacts);
        (Touching::of(&rig.contacts, &rig.committed.poses), report.energy.elastic)
    }

    /// Commits a piece of the collapse that a dwell follows, so that friction acts against the way from there on; an increment whose bodies fell
    /// becomes a dwell under the loads that it has come to. A dwell whose bodies did not fall (in rubber they cannot) and that came near a balance is
    /// such a piece, too. What is set free goes to the stabilisation. `false`, and nothing is changed, where there is none, where pieces would end up with
    /// more energy than they had, and after too many.
    pub(super) fn follow(
        &mut self,
        rig: &mut Rig,
        way: &mut UnderWay,
        miss: &Miss,
        share: f64,
        to: f64,
    ) -> bool {
        let is_piece = |report: &&IncrementReport| report.fell || Self::tired_piece(rig, way, report);
        let Some(report) = miss.report.as_deref().filter(is_piece) else { return false };
        if Self::lets_go(rig, way, report) {
            return true;
        }
        let trial = self.weigh_as(rig, way, report, [share, to], true);
        tracing::debug!(
            piece = way.pieces,
            out_of_balance = report.balance.out_of_balance,
            elastic = trial.ledger.elastic,
            creates_energy = trial.creates_energy,
            "followed"
        );
        if trial.creates_energy || way.pieces >= MOST_PIECES {
            return false;
        }
        if !way.dwells {
            (way.dwells, way.last) = (true, None);
            way.spent.cuts += way.pace.accept(share, rig.settings.beyond_start(report.augmentations));
        }
        way.pieces += 1;
        self.take_piece(rig, way, report, &trial, share);
        self.mend_cover(rig, &way.drive);
        true
    }

    /// Whether a dwell of bodies that did not fall came near a balance that it did not find, nearer than where they would fall, and not as near as the
    /// settings let pass.
    fn tired_piece(rig: &Rig, way: &UnderWay, report: &IncrementReport) -> bool {
        let is_near = matches!(report.status, StepStatus::OutOfBalance { .. })
            && report.balance.out_of_balance < rig.settings.fall_bounds[0]
            && !report.is_rough(&rig.settings);
        is_near && way.dwells && way.remnants.is_over() && way.pieces < MOST_TIRED_PIECES
    }

    /// Has a folded cover laid anew where that is free to change the volume.
    pub(super) fn mend_cover(&mut self, rig: &mut Rig, drive: &Drive) {
        if !drive.prescribes_volume() {
            self.zero.mend(rig);
        }
    }

    /// Breaks up what the last increment left to; whether anything did. What the rock that went had held is let down step by step.
    pub(super) fn break_up(&mut self, rig: &mut Rig, way: &mut UnderWay) -> Result<bool> {
        if rig.failing.is_empty() {
            return Ok(false);
        }
        self.lull(rig, way);
        let bodies = rig.model.bodies.len();
        let steps = rig.settings.damage.release_steps;
        let before = (steps > 1 && rig.model.is_of_rigid_bodies()).then(|| self.touching(rig, way));
        let (fractures, heirs) = rig.break_up()?;
        way.sleep.made_up.follow(&heirs);
        self.left.clear();
        // Parts of what slept sleep, too.
        let parts = fractures.iter().filter(|fracture| way.sleep.bodies.contains(&fracture.body));
        let fresh: Vec<usize> =
            parts.flat_map(|fracture| &fracture.parts).copied().filter(|part| *part >= bodies).collect();
        way.sleep.bodies.extend(fresh);
        let mut lost: f64 = fractures.iter().map(|fracture| fracture.lost_energy).sum();
        if let Some((before, stored)) = before {
            let (after, rest) = self.touching(rig, way);
            let touching = [&before, &after];
            way.remnants = Remnants::new(&rig.model, &rig.committed.poses, &fractures, touching, steps);
            let (released, gained) = ((stored - rest).max(0.0), (rest - stored).max(0.0));
            tracing::info!(released, gained, "shapes changed");
            self.ledger.crushing += released;
            lost += released;
            self.ledger.reshaped += gained;
            self.ledger.stabilisation -= gained;
            self.ledger.elastic += gained;
        }
        self.ledger.damage += lost;
        self.ledger.elastic -= lost;
        Ok(true)
    }
}
