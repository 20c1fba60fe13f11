//! The increments of a test: how each begins, what is tried after a miss, what its commit does.

use crate::assembly::Contacts;
use crate::error::Result;
use crate::loading::{Attempt, FidelityCounts, Loaded, Portion, StageEnd, run_stage};
use crate::model::{BodyKind, Counters, DamageCounts};
use crate::solver::{
    Dossier, Increment, IncrementReport, Settings, Stabilisation, StepStatus, Verdict, advance,
};
use crate::triaxial::deformation::LocalStrain;
use crate::triaxial::drive::{Drive, Guess};
use crate::triaxial::measures::Picture;
use crate::triaxial::rig::Rig;
use crate::triaxial::stage::Stage;
use crate::triaxial::starts::{Last, describe, starts};
use crate::triaxial::test::balance::IncrementBalance;
use crate::triaxial::test::progress::{Progress, StageState, next_on_path};
use crate::triaxial::test::{Row, StepReport, Test};

/// Mean force out of balance over the mean contact force beyond which contacts bear nothing any more: no state of a quasi-static test.
const MOST_UNREST: f64 = 1.0;
/// Where a stage is over and grains broke in its last increment, the tolerances of the one that follows are those of an increment of this share.
pub(super) const REST_SHARE: f64 = 1e-3;
/// Increments under constant loads that follow the last one of a stage where grains went on breaking.
const MOST_AFTERMATHS: usize = 20;

impl Test {
    /// Runs a stage, or the rest of the one that was interrupted; `observe` is called after each accepted
    /// increment and says whether to go on. A wish to stop at the last increment interrupts nothing.
    pub fn run(
        &mut self,
        rig: &mut Rig,
        stage: &Stage,
        observe: &mut dyn FnMut(&Rig, &StepReport<'_>) -> bool,
    ) -> StageEnd {
        let Some(progress) = self.progress.take().or_else(|| self.begin(rig, stage)) else {
            return StageEnd::Finished;
        };
        if let Some(reason) = progress.own.watch.contradicts(progress.own.drive.axial_strain()) {
            return StageEnd::Stopped { reason };
        }
        let mut under_test = UnderTest { test: self, rig, stage };
        run_stage(&mut under_test, progress, &mut |now, done| {
            let step = StepReport { row: &done.row, local_strains: &done.local_strains, test: now.test };
            observe(now.rig, &step)
        })
    }
}

/// A test with its rig in a stage.
struct UnderTest<'a> {
    test: &'a mut Test,
    rig: &'a mut Rig,
    stage: &'a Stage,
}

/// An increment of a test in balance.
struct Balanced {
    report: IncrementReport,
    balance: IncrementBalance,
    verdict: Verdict,
}

/// An accepted increment of a test.
struct Accepted {
    row: Row,
    local_strains: Vec<LocalStrain>,
}

/// Why an increment found no balance, and what it took.
struct Miss {
    reason: String,
    counters: Counters,
}

impl Loaded for UnderTest<'_> {
    type Own = StageState;
    type Balanced = Balanced;
    type Row = Accepted;

    fn break_up(&mut self, stage: &mut Progress) -> Result<()> {
        if let Some(fractures) = self.test.break_up(self.rig, &stage.own.drive, stage.pace.done())? {
            stage.own.broke = true;
            let last = stage.own.last.take();
            let has_nodes = self.rig.model.membrane.is_some();
            stage.own.last =
                last.and_then(|last| last.behind(&fractures, &self.rig.committed.poses, has_nodes));
        }
        Ok(())
    }

    /// Behind the end of the path, where grains have just broken or something moves, one under constant loads.
    fn next(&self, stage: &Progress) -> Option<Portion> {
        let is_due = stage.own.broke || !stage.own.rested && stage.own.watch.done;
        let goes_on = is_due && stage.own.aftermaths < MOST_AFTERMATHS;
        let aftermath = || goes_on.then(|| Portion { share: REST_SHARE, to: stage.pace.done() });
        next_on_path(stage).or_else(aftermath)
    }

    fn attempt(&mut self, stage: &mut Progress, next: Portion) -> Attempt<Balanced> {
        // One behind the end of the path has nothing that a shorter one would have less of.
        let is_on_path = next_on_path(stage).is_some();
        let report = match self.balance(stage, next) {
            Ok(report) => report,
            Err(_) if self.rig.settings.stop.is_raised() => return Attempt::Interrupted,
            Err(miss) => {
                if is_on_path && (stage.own.watch.gives_up_landing() || stage.pace.cut(next.share)) {
                    return Attempt::Again(miss.counters);
                }
                return Attempt::Stopped(self.describe_limit(stage).unwrap_or_default() + &miss.reason);
            }
        };
        let verdict = self.rig.judge(&report, stage.own.drive.pressure(next.to, report.factor));
        let condense = || {
            let transition = self.rig.change_fidelity([&verdict.wake, &[]]);
            self.test.start_elastic += transition.energy;
            transition.woken
        };
        if stage.repeats(&verdict, condense) {
            return Attempt::Again(report.counters);
        }
        let mut balance = self.test.balance_energy(self.rig, &stage.own.drive, &report, next);
        let rests = self.comes_to_rest(stage, next);
        if is_on_path && stage.own.watch.overshoots(next.share, &balance.measures, rests) {
            return Attempt::Again(report.counters);
        }
        let refused = balance.creates_energy || (balance.poorly_closed && self.test.energy_gate.cuts);
        if is_on_path && refused && stage.pace.cut(next.share) {
            tracing::debug!(share = next.share, gap = balance.energy_gap, "refused for its energy");
            stage.own.watch.limit = None;
            return Attempt::Again(report.counters);
        }
        // One that cannot be cut any more is taken, and told of.
        balance.poorly_closed |= balance.creates_energy;
        Attempt::Balanced(Balanced { report, balance, verdict })
    }

    fn commit(&mut self, stage: &mut Progress, portion: Portion, balanced: Balanced) -> Result<Accepted> {
        let Balanced { mut report, balance, verdict } = balanced;
        stage.own.broke = false;
        stage.own.rested = self.comes_to_rest(stage, portion);
        if next_on_path(stage).is_none() {
            stage.own.aftermaths += 1;
        } else {
            report.counters.cuts = stage.pace.accept(portion.share, report.is_easy());
            stage.own.watch.accept(&balance.measures);
        }
        let (row, local_strains) = self.measure(stage, &report, &balance);
        stage.own.last = Some(self.take(&stage.own.drive, &report, &balance, portion.share));
        let early = stage.take_repeats();
        let transition = self.rig.change_fidelity([&verdict.wake, &verdict.rest]);
        self.test.start_elastic += transition.energy;
        let fidelity = FidelityCounts::of(&self.rig.model, &verdict, &transition, early);
        let row = Row { damage: self.rig.model.damage_counts(), fidelity, ..row };
        Ok(Accepted { row, local_strains })
    }

    fn progress(&mut self) -> &mut Option<Progress> {
        &mut self.test.progress
    }

    fn is_last(&self, stage: &Progress) -> bool {
        self.next(stage).is_none() && self.rig.failing.is_empty()
    }

    fn end(&self, stage: &Progress) -> StageEnd {
        stage.own.watch.end(self.stage)
    }
}

impl UnderTest<'_> {
    /// Whether all increments have to come to rest.
    fn asks_for_rest(&self) -> bool {
        self.rig.settings.stabilisation == Stabilisation::Rest
    }

    /// Whether an increment has to come to rest: one that ends the stage, is to land on what ends it, or comes behind it, or whose stage or case asks for it.
    fn comes_to_rest(&self, stage: &Progress, next: Portion) -> bool {
        let ends = next.to >= 1.0 || stage.own.watch.limit.is_some() || next_on_path(stage).is_none();
        ends || self.asks_for_rest() || stage.own.drive.comes_to_rest()
    }

    /// Brings an increment into balance; one that ends a stage, or whose stage asks for it, comes to rest. Where none is found, says why.
    fn balance(&mut self, stage: &Progress, next: Portion) -> std::result::Result<IncrementReport, Miss> {
        let (comes_to_rest, asks_for_rest) = (self.comes_to_rest(stage, next), self.asks_for_rest());
        let (test, rig) = (&*self.test, &mut *self.rig);
        // That of an attempt before says nothing of how this one ends.
        rig.dossier = None;
        let (drive, last) = (&stage.own.drive, stage.own.last.as_ref());
        let now = test.state(rig, &rig.committed.poses, rig.pressure, test.ram);
        let continued = |now: f64, before: fn(&Last) -> f64| {
            last.map_or(now, |last| now + (now - before(last)) * (next.share / last.share))
        };
        let guess = Guess {
            area: continued(now.volume / now.height, |last| last.area),
            pressure: continued(now.pressure, |last| last.pressure),
            deviatoric_stress: continued(now.deviatoric_stress, |last| last.deviatoric_stress),
        };
        let lift = drive.lift(next.to).map(|lift| drive.origin.top + lift - now.top);
        let starts = starts(rig, last.map(|last| (last, next.share / last.share)), lift, now.height);
        let loads = drive.loads(rig, next, &guess);
        let rest = Settings {
            stabilisation: Stabilisation::Rest,
            explicitly_to_rest: !asks_for_rest,
            ..rig.settings.clone()
        };
        let advance_with = |settings: &Settings, contacts: &mut Contacts| {
            let increment =
                Increment { model: &rig.model, committed: &rig.committed, loads: &loads, settings };
            advance(&increment, starts.clone(), contacts)
        };
        let settings = if comes_to_rest { &rest } else { &rig.settings };
        let mut report = advance_with(settings, &mut rig.contacts);
        let may_move_on = comes_to_rest && !asks_for_rest && !drive.comes_to_rest();
        if may_move_on && matches!(report.status, StepStatus::OutOfBalance { .. }) {
            // Behind a collapse that goes on, the end of a stage is as restless as the way to it; its row says so.
            let spent = report.counters;
            report = advance_with(&rig.settings, &mut rig.contacts);
            report.counters.add(&spent);
        }
        let pressure = drive.pressure(next.to, report.factor);
        if !report.converged() {
            let mut dossier = Dossier::of(&rig.model, &rig.contacts, &report, &rig.settings);
            dossier.factorisations += stage.spent.factorisations;
            rig.dossier = Some(dossier);
            let reason = describe(rig, &report, pressure);
            return Err(Miss { reason, counters: report.counters });
        }
        match falls_apart(&report, pressure, drive.least_pressure()) {
            Some(reason) => Err(Miss { reason, counters: report.counters }),
            None => Ok(report),
        }
    }

    /// The row of an increment before its commit, and what happened around each grain.
    fn measure(
        &mut self,
        stage: &mut Progress,
        report: &IncrementReport,
        balance: &IncrementBalance,
    ) -> (Row, Vec<LocalStrain>) {
        let (test, rig, m) = (&mut *self.test, &*self.rig, &balance.measures);
        let response = stage.own.curve.push(
            m.axial_strain,
            m.volumetric_strain,
            m.deviatoric_stress,
            m.confining_pressure,
        );
        test.peak_friction_angle = stage.own.curve.peak();
        let is_there = |grain: usize| rig.model.bodies[grain].kind != BodyKind::Gone;
        let frames = rig.model.frames(&report.poses);
        let local_strains = test.zero.neighbourhood.local_strains(&frames, is_there);
        let row = Row {
            measures: *m,
            picture: Picture::of(rig, &rig.contacts, &report.poses, m, &test.zero, &local_strains),
            response,
            ledger: balance.ledger,
            damage: DamageCounts::default(),
            fidelity: FidelityCounts::default(),
            energy_gap: balance.energy_gap,
            poorly_closed: balance.poorly_closed,
            restless: report.restless || report.unsettled || report.is_snap(),
            control_error: balance.control_error,
            counters: stage.take_spent(&report.counters),
            out_of_balance: report.balance.out_of_balance,
            unrest: report.balance.unrest,
            sliding_fraction: report.measures.sliding_fraction,
            max_penetration: report.measures.max_penetration,
            mean_contact_force: report.measures.mean_force,
            progress: stage.own.watch.progress(stage.pace.done()),
            path: stage.pace.done(),
        };
        (row, local_strains)
    }

    /// Makes the increment the committed state; what it came from goes to the next one.
    fn take(
        &mut self,
        drive: &Drive,
        report: &IncrementReport,
        balance: &IncrementBalance,
        share: f64,
    ) -> Last {
        let (test, rig) = (&mut *self.test, &mut *self.rig);
        let area = rig.volume(&rig.committed.poses) / rig.height(&rig.committed.poses);
        let last = Last {
            share,
            area,
            pressure: rig.pressure,
            deviatoric_stress: -test.ram / area,
            poses: rig.committed.poses.clone(),
        };
        report.commit_to(&mut rig.committed);
        rig.model.take_damage(&report.damage.grains);
        rig.contacts.forget_trial();
        rig.failing = report.damage.failing(&rig.model);
        rig.pressure = balance.pressure;
        rig.committed.pressure = Some(balance.pressure);
        test.ledger = balance.ledger;
        test.ram = balance.ram;
        test.loaded = drive.is_loaded();
        last
    }

    /// Why a loaded plate may go no further, where more deviatoric stress is asked for.
    fn describe_limit(&self, stage: &Progress) -> Option<String> {
        let (test, rig, curve) = (&self.test, &self.rig, &stage.own.curve);
        let asked = stage.own.drive.asked_stress()?;
        let now = test.state(rig, &rig.committed.poses, rig.pressure, test.ram).deviatoric_stress;
        let (tangent, secant) = (curve.tangent_modulus(), curve.secant_modulus());
        let mut text = format!(
            "no balance was found beyond a deviatoric stress of {now:.4e} Pa, {asked:.4e} Pa are asked for"
        );
        if tangent.is_finite() && secant.is_finite() {
            text += &format!(" (modulus there {tangent:.2e} Pa, {secant:.2e} Pa over the stage)");
        }
        Some(text + "; a loaded plate cannot pass a peak: a stage that prescribes axial_strain can. Last: ")
    }
}

/// Why a balanced increment is none of a quasi-static test, if so: under its `pressure` [Pa], which may not follow to less than `least` [Pa].
fn falls_apart(report: &IncrementReport, pressure: f64, least: f64) -> Option<String> {
    let unrest = report.balance.unrest;
    if unrest > MOST_UNREST {
        return Some(format!(
            "grains fly apart: the mean force out of balance on one is {unrest:.1} times the mean contact force"
        ));
    }
    (pressure < least).then(|| {
        format!(
            "the confining pressure would have to fall to {pressure:.3e} Pa: nothing left holds the specimen"
        )
    })
}
