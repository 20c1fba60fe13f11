//! A triaxial test in progress: stages, increments, landings, and the books kept over them.

mod breaking;
mod trial;

use serde::{Deserialize, Serialize};

use crate::assembly::Contacts;
use crate::model::{BodyKind, Counters, DamageCounts};
use crate::solver::{
    DamageSettings, Dossier, Energies, Increment, IncrementReport, Pace, Settings, Stabilisation, StepStatus,
    advance,
};
use crate::tensor::Pose;
use crate::triaxial::deformation::LocalStrain;
use crate::triaxial::drive::{Drive, Guess, Origin};
use crate::triaxial::fidelity::FidelityCounts;
use crate::triaxial::ledger::{EnergyGate, Ledger};
use crate::triaxial::measures::{Measures, Picture, Zero};
use crate::triaxial::response::{Curve, Response};
use crate::triaxial::rig::Rig;
use crate::triaxial::stage::{Path, Stage, StageEnd};
use crate::triaxial::starts::{Last, describe, starts};
use crate::triaxial::watch::Watch;

/// What is known after each accepted increment.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub measures: Measures,
    pub picture: Picture,
    pub response: Response,
    pub ledger: Ledger,
    pub damage: DamageCounts,
    pub fidelity: FidelityCounts,
    /// Energy of the increment that no row of the ledger accounts for, over the larger of the work that
    /// ram and pressure exchanged in it and what it lost.
    pub energy_gap: f64,
    /// Whether that is beyond the gate.
    pub poorly_closed: bool,
    /// Whether more was still moving at its end than was asked for.
    pub restless: bool,
    /// By how much what the stage prescribes is missed: stresses relative to the larger of their value and the
    /// pressure, the volume to what an increment sweeps, the top plate to its travel in it.
    pub control_error: f64,
    pub counters: Counters,
    pub out_of_balance: f64,
    /// Mean force out of balance on a body over the mean contact force.
    pub unrest: f64,
    pub sliding_fraction: f64,
    pub max_penetration: f64,
    pub mean_contact_force: f64,
    /// Progress of the stage, 0 to 1.
    pub progress: f64,
    /// Share of its path, which may be longer than the stage.
    pub path: f64,
}

/// What the observer sees of an accepted increment.
pub struct StepReport<'a> {
    pub row: Row,
    pub increment: &'a IncrementReport,
    /// What happened around each grain since strains count.
    pub local_strains: &'a [LocalStrain],
    /// The test as the increment left it.
    pub test: &'a Test,
}

/// Mean force out of balance over the mean contact force beyond which contacts bear nothing any more: no state of a quasi-static test.
const MOST_UNREST: f64 = 1.0;

/// Share of the consolidation pressure under which grains are seated. Under a small share the
/// forces are too weak to bring loose grains into touch within the solver's limits.
const SEATING_SHARE: f64 = 0.5;
/// Where a stage is over and grains broke in its last increment, the tolerances of the one that follows are those of an increment of this share.
const REST_SHARE: f64 = 1e-3;
/// Increments under constant loads that follow the last one of a stage where grains went on breaking.
const MOST_AFTERMATHS: usize = 20;
/// Times that an increment is repeated since a grain ought to have been condensed in it.
const MOST_REPEATS: usize = 3;
/// A pressure that follows from something else may not fall below this share of that at the start of the stage.
const LEAST_PRESSURE: f64 = 1e-3;

/// References and running sums of a test.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Test {
    /// Where strains count from.
    pub zero: Zero,
    pub ledger: Ledger,
    /// Whether increments whose energy does not close are cut.
    pub energy_gate: EnergyGate,
    /// Elastic energy at the start of the ledger [J].
    start_elastic: f64,
    /// Energy of the membrane's sheet there [J].
    start_membrane: f64,
    /// Force of the ram on the top plate, upwards [N].
    ram: f64,
    /// Whether the top plate is under a load, not driven.
    loaded: bool,
    /// Height at which the last drive upwards began [m].
    turning: Option<f64>,
    /// Largest friction angle since strains count [rad].
    peak_friction_angle: f64,
    progress: Option<StageProgress>,
}

/// A stage after its last accepted increment: with the rig's state all that it takes to go on with it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct StageProgress {
    drive: Drive,
    pace: Pace,
    watch: Watch,
    curve: Curve,
    last: Option<Last>,
    /// Increments since the path ended, under constant loads, while grains went on breaking.
    aftermaths: usize,
    /// What attempts took that were not accepted.
    #[serde(skip)]
    spent: Counters,
    /// Times that the increment at hand has been repeated with more condensed grains.
    #[serde(skip)]
    repeats: usize,
    /// Grains that were made condensed for it.
    #[serde(skip)]
    woken: usize,
}

impl StageProgress {
    /// Share of the next increment; `None` where the stage is over.
    fn next(&self) -> Option<f64> {
        let next = self.pace.next().filter(|_| !self.watch.done)?;
        Some(self.watch.limit.map_or(next, |limit| limit.min(next)))
    }

    fn is_over(&self) -> bool {
        self.next().is_none()
    }

    /// The increment under constant loads that follows the end of the path where grains have just broken.
    fn aftermath(&self, broke: bool) -> Option<(f64, f64)> {
        (broke && self.aftermaths < MOST_AFTERMATHS).then(|| (REST_SHARE, self.pace.done()))
    }
}

/// An increment tried, not committed.
struct Trial {
    measures: Measures,
    ledger: Ledger,
    energy_gap: f64,
    poorly_closed: bool,
    /// Whether the solver has leapt to a state that bodies could not have reached.
    creates_energy: bool,
    control_error: f64,
    ram: f64,
    pressure: f64,
}

/// An increment that was not accepted: why, and what it took.
struct Miss {
    reason: String,
    counters: Counters,
}

impl Test {
    pub fn new(rig: &Rig) -> Self {
        Test {
            zero: Zero::of(rig),
            ledger: Ledger::default(),
            energy_gate: EnergyGate::default(),
            start_elastic: 0.0,
            start_membrane: 0.0,
            ram: 0.0,
            loaded: true,
            turning: None,
            peak_friction_angle: f64::NEG_INFINITY,
            progress: None,
        }
    }

    /// Counts strains from the present state on.
    pub fn zero_strains(&mut self, rig: &Rig) {
        self.zero = Zero::of(rig);
        self.peak_friction_angle = f64::NEG_INFINITY;
    }

    /// Starts strains and the ledger anew from the present state.
    pub fn restart(&mut self, rig: &Rig, energy: &Energies) {
        self.zero_strains(rig);
        self.ledger = Ledger::default();
        self.start_elastic = energy.elastic;
        self.start_membrane = energy.membrane;
    }

    /// Whether a stage was interrupted; the next [`Test::run`] goes on with it.
    pub fn is_under_way(&self) -> bool {
        self.progress.is_some()
    }

    /// Runs a stage, or the rest of the one that was interrupted; `observe` is called after each accepted
    /// increment and says whether to go on. A wish to stop at the last increment interrupts nothing.
    pub fn run(
        &mut self,
        rig: &mut Rig,
        stage: &Stage,
        observe: &mut dyn FnMut(&Rig, &StepReport<'_>) -> bool,
    ) -> StageEnd {
        let Some(mut progress) = self.progress.take().or_else(|| self.begin(rig, stage)) else {
            return StageEnd::Finished;
        };
        if let Some(reason) = progress.watch.contradicts(progress.drive.axial_strain()) {
            return StageEnd::Stopped { reason };
        }
        loop {
            let broke = match self.break_up(rig, &progress) {
                Ok(broke) => broke,
                Err(error) => return StageEnd::Stopped { reason: error.to_string() },
            };
            if broke {
                progress.last = None;
                self.mend_cover(rig, &progress.drive);
            }
            let goes_on = progress.next().map(|share| (share, progress.pace.after(share)));
            let Some((share, to)) = goes_on.or_else(|| progress.aftermath(broke)) else { break };
            let attempt = self.attempt(rig, &progress, share, to);
            let mut report = match attempt {
                Ok(report) => report,
                Err(_) if rig.settings.stop.is_raised() => {
                    self.progress = Some(progress);
                    return StageEnd::Interrupted;
                }
                Err(miss) => {
                    progress.spent.add(&miss.counters);
                    if progress.watch.gives_up_landing() || progress.pace.cut(share) {
                        continue;
                    }
                    let limit = progress.drive.asked_stress();
                    let limit = limit.map(|asked| self.describe_limit(rig, &progress, asked));
                    return StageEnd::Stopped { reason: limit.unwrap_or_default() + &miss.reason };
                }
            };
            let pressure = progress.drive.pressure(to, report.factor);
            let verdict = rig.judge(&report, pressure);
            if verdict.urgent && progress.repeats < MOST_REPEATS {
                progress.spent.add(&report.counters);
                progress.repeats += 1;
                let transition = rig.change_fidelity([&verdict.wake, &[]]);
                self.start_elastic += transition.energy;
                progress.woken += transition.woken;
                continue;
            }
            let trial = self.weigh(rig, &progress, &report, share, to);
            if progress.watch.overshoots(share, &trial.measures) {
                progress.spent.add(&report.counters);
                continue;
            }
            let refused = trial.creates_energy || (trial.poorly_closed && self.energy_gate.cuts);
            if refused && progress.pace.cut(share) {
                tracing::debug!(share, gap = trial.energy_gap, "refused for its energy");
                progress.spent.add(&report.counters);
                progress.watch.limit = None;
                continue;
            }
            if progress.is_over() {
                progress.aftermaths += 1;
            } else {
                report.counters.cuts = progress.pace.accept(share, report.is_easy());
            }
            let m = &trial.measures;
            progress.watch.accept(m);
            let response = progress.curve.push(
                m.axial_strain,
                m.volumetric_strain,
                m.deviatoric_stress,
                m.confining_pressure,
            );
            self.peak_friction_angle = progress.curve.peak();
            let is_there = |grain: usize| rig.model.bodies[grain].kind != BodyKind::Gone;
            let frames = rig.model.frames(&report.poses);
            let local_strains = self.zero.neighbourhood.local_strains(&frames, is_there);
            let mut counters = report.counters;
            counters.add(&progress.spent);
            let row = Row {
                measures: *m,
                picture: Picture::of(rig, &rig.contacts, &report.poses, m, &self.zero, &local_strains),
                response,
                ledger: trial.ledger,
                damage: DamageCounts::default(),
                fidelity: FidelityCounts::default(),
                energy_gap: trial.energy_gap,
                poorly_closed: trial.poorly_closed,
                restless: report.restless || report.is_snap(),
                control_error: trial.control_error,
                counters,
                out_of_balance: report.balance.out_of_balance,
                unrest: report.balance.unrest,
                sliding_fraction: report.measures.sliding_fraction,
                max_penetration: report.measures.max_penetration,
                mean_contact_force: report.measures.mean_force,
                progress: progress.watch.progress(progress.pace.done()),
                path: progress.pace.done(),
            };
            progress.last = Some(self.commit(rig, &progress.drive, &report, &trial, share));
            progress.spent = Counters::default();
            let early = [std::mem::take(&mut progress.repeats), std::mem::take(&mut progress.woken)];
            let transition = rig.change_fidelity([&verdict.wake, &verdict.rest]);
            self.start_elastic += transition.energy;
            self.progress = Some(progress);
            let fidelity = FidelityCounts::of(&rig.model, &verdict, &transition, early);
            let row = Row { damage: rig.model.damage_counts(), fidelity, ledger: self.ledger, ..row };
            let step = StepReport { row, increment: &report, local_strains: &local_strains, test: self };
            let goes_on = observe(rig, &step);
            match self.progress.take() {
                Some(left) if goes_on || (left.is_over() && rig.failing.is_empty()) => progress = left,
                left => {
                    self.progress = left;
                    return StageEnd::Interrupted;
                }
            }
        }
        progress.watch.end(stage)
    }

    /// Why a loaded plate may go no further, where more deviatoric stress is `asked` for [Pa].
    fn describe_limit(&self, rig: &Rig, progress: &StageProgress, asked: f64) -> String {
        let now = self.state(rig, &rig.committed.poses, rig.pressure, self.ram).deviatoric_stress;
        let (tangent, secant) = (progress.curve.tangent_modulus(), progress.curve.secant_modulus());
        let mut text = format!(
            "no balance was found beyond a deviatoric stress of {now:.4e} Pa, {asked:.4e} Pa are asked for"
        );
        if tangent.is_finite() && secant.is_finite() {
            text += &format!(" (modulus there {tangent:.2e} Pa, {secant:.2e} Pa over the stage)");
        }
        text + "; a loaded plate cannot pass a peak: a stage that prescribes axial_strain can. Last: "
    }

    /// The measures of the committed state.
    pub fn measures(&self, rig: &Rig) -> Measures {
        Measures::of(rig, &self.state(rig, &rig.committed.poses, rig.pressure, self.ram), &self.zero)
    }

    /// Resolves a stage against the present state; `None` where there is nothing to do.
    fn begin(&mut self, rig: &Rig, stage: &Stage) -> Option<StageProgress> {
        let origin = self.state(rig, &rig.committed.poses, rig.pressure, self.ram);
        let drive = Drive::new(stage, origin, self.zero.height, self.turning);
        let watch = Watch::new(&stage.until, origin.deviatoric_stress, origin.pressure);
        if drive.axial_strain() < 0.0 && !watch.done {
            self.turning = Some(origin.height);
        }
        if matches!(stage.path, Path::Return { .. }) && drive.axial_strain() <= 0.0 {
            return None;
        }
        let mut curve = Curve::new(self.peak_friction_angle);
        let start = Measures::of(rig, &origin, &self.zero);
        curve.push(start.axial_strain, start.volumetric_strain, origin.deviatoric_stress, origin.pressure);
        let pace = drive.pace(&stage.steps, 0.5f64.powi(rig.settings.max_cuts as i32));
        Some(StageProgress {
            drive,
            pace,
            watch,
            curve,
            last: None,
            aftermaths: 0,
            spent: Counters::default(),
            repeats: 0,
            woken: 0,
        })
    }

    /// Makes the increment the committed state; what it came from goes to the next one.
    fn commit(
        &mut self,
        rig: &mut Rig,
        drive: &Drive,
        report: &IncrementReport,
        trial: &Trial,
        share: f64,
    ) -> Last {
        let area = |rig: &Rig| rig.volume(&rig.committed.poses) / rig.height(&rig.committed.poses);
        let last = Last {
            share,
            area: area(rig),
            pressure: rig.pressure,
            deviatoric_stress: -self.ram / area(rig),
            poses: std::mem::replace(&mut rig.committed.poses, report.poses.clone()),
        };
        rig.committed.memory.clone_from(&report.memory);
        rig.committed.fields.clone_from(&report.fields);
        rig.model.take_damage(&report.damage.grains);
        rig.failing = report.damage.failing(&rig.model);
        rig.pressure = trial.pressure;
        rig.committed.pressure = Some(trial.pressure);
        self.ledger = trial.ledger;
        self.ram = trial.ram;
        rig.committed.forces.clone_from(&report.forces);
        self.loaded = drive.is_loaded();
        last
    }

    /// Lays a rubber membrane against the grains under the pressure that they are then seated under.
    ///
    /// # Errors
    /// The reason, with numbers, where it does not come to lie.
    pub fn lay_membrane(&mut self, rig: &mut Rig, pressure: f64) -> std::result::Result<(), String> {
        if rig.model.membrane.is_none() {
            return Ok(());
        }
        let pressure = SEATING_SHARE * pressure;
        match rig.lay_membrane(pressure) {
            Some(laid) if laid.converged => Ok(()),
            Some(laid) => Err(format!(
                "the membrane did not come to lie against the grains under {:.3} MPa: a node is out of balance by \
                 {:.2e} of its load after {} steps; {}",
                1e-6 * pressure,
                laid.out_of_balance,
                laid.counters.newton_iterations,
                rig.membrane_trouble(pressure)
            )),
            None => Err("the membrane overlaps a grain before it is laid against them".into()),
        }
    }

    /// Brings the loose grains of a compacted specimen into touch under half the
    /// consolidation pressure, before the first row of the history: first to a rough balance, then,
    /// where that is reached, to the tolerance of an increment. Strains and the ledger start from
    /// there. Returns the last report; where it did not converge, the first increment has to.
    pub fn seat(&mut self, rig: &mut Rig, pressure: f64) -> IncrementReport {
        let loads = rig.loads(true, SEATING_SHARE * pressure);
        let mut counters = Counters::default();
        // Grains do not break by being put into touch.
        let fine = Settings {
            stabilisation: Stabilisation::Rest,
            damage: DamageSettings { moves: false, ..rig.settings.damage },
            ..rig.settings.clone()
        };
        let mut settings = fine.for_seating();
        let fine = fine.relaxed_together();
        loop {
            let increment = Increment {
                model: &rig.model,
                committed: &rig.committed,
                loads: &loads,
                settings: &settings,
            };
            let mut report = advance(&increment, vec![rig.committed.poses.clone()], &mut rig.contacts);
            counters.add(&report.counters);
            rig.committed.poses.clone_from(&report.poses);
            rig.committed.memory.clone_from(&report.memory);
            rig.committed.fields.clone_from(&report.fields);
            // What slipped before the test began weakens nothing.
            rig.committed.memory.values_mut().for_each(|pair| pair.slip = 0.0);
            rig.pressure = SEATING_SHARE * pressure;
            rig.committed.pressure = Some(rig.pressure);
            self.restart(rig, &report.energy);
            rig.committed.forces.clone_from(&report.forces);
            let rough = settings != fine;
            if report.converged() && rough {
                settings = fine.clone();
            } else {
                report.counters = counters;
                return report;
            }
        }
    }

    /// Tries the increment of `share` to the share `to` of a stage. Where it fails, says why.
    fn attempt(
        &self,
        rig: &mut Rig,
        progress: &StageProgress,
        share: f64,
        to: f64,
    ) -> std::result::Result<IncrementReport, Miss> {
        let (drive, last) = (&progress.drive, progress.last.as_ref());
        let now = self.state(rig, &rig.committed.poses, rig.pressure, self.ram);
        let continued = |now: f64, before: fn(&Last) -> f64| {
            last.map_or(now, |last| now + (now - before(last)) * (share / last.share))
        };
        let guess = Guess {
            area: continued(now.volume / now.height, |last| last.area),
            pressure: continued(now.pressure, |last| last.pressure),
            deviatoric_stress: continued(now.deviatoric_stress, |last| last.deviatoric_stress),
        };
        let lift = drive.lift(to).map(|lift| drive.origin.top + lift - now.top);
        let starts = starts(rig, last.map(|last| (last, share / last.share)), lift, now.height);
        let loads = drive.loads(rig, share, to, &guess);
        let comes_to_rest = to >= 1.0 || drive.comes_to_rest();
        let rest = Settings { stabilisation: Stabilisation::Rest, ..rig.settings.clone() };
        let advance_with = |settings: &Settings, contacts: &mut Contacts| {
            let increment =
                Increment { model: &rig.model, committed: &rig.committed, loads: &loads, settings };
            advance(&increment, starts.clone(), contacts)
        };
        let settings = if comes_to_rest { &rest } else { &rig.settings };
        let mut report = advance_with(settings, &mut rig.contacts);
        let asks_for_rest = rig.settings.stabilisation == Stabilisation::Rest;
        let may_move_on = comes_to_rest && !asks_for_rest && !drive.comes_to_rest();
        if may_move_on && matches!(report.status, StepStatus::OutOfBalance { .. }) {
            // Behind a collapse that goes on, the end of a stage is as restless as the way to it; its row says so.
            let spent = report.counters;
            report = advance_with(&rig.settings, &mut rig.contacts);
            report.counters.add(&spent);
        }
        if !report.converged() {
            let mut dossier = Dossier::of(&rig.model, &rig.contacts, &report, &rig.settings);
            dossier.factorisations += progress.spent.factorisations;
            rig.dossier = Some(dossier);
            let reason = describe(rig, &report, drive.pressure(to, report.factor));
            return Err(Miss { reason, counters: report.counters });
        }
        let (pressure, unrest) = (drive.pressure(to, report.factor), report.balance.unrest);
        let refused = if unrest > MOST_UNREST {
            Some(format!(
                "grains fly apart: the mean force out of balance on one is {unrest:.1} times the mean contact force"
            ))
        } else if pressure < LEAST_PRESSURE * drive.origin.pressure {
            Some(format!(
                "the confining pressure would have to fall to {pressure:.3e} Pa: nothing left holds the specimen"
            ))
        } else {
            None
        };
        if let Some(reason) = refused {
            return Err(Miss { reason, counters: report.counters });
        }
        Ok(report)
    }

    /// What a stage can depend on, in the configuration `poses`.
    fn state(&self, rig: &Rig, poses: &[Pose], pressure: f64, ram: f64) -> Origin {
        let (height, volume) = (rig.height(poses), rig.volume(poses));
        Origin {
            height,
            volume,
            pressure,
            deviatoric_stress: -ram * height / volume,
            top: poses[rig.top].position.z,
            loaded: self.loaded,
        }
    }
}
