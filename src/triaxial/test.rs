//! A triaxial test in progress: stages, increments, landings, and the books kept over them.

mod collapse;
mod sleep;
mod trial;

use serde::{Deserialize, Serialize};

use crate::model::{BodyKind, Counters, DamageCounts};
use crate::solver::{
    DamageSettings, Dossier, Energies, FALL_REBASE, Increment, IncrementReport, Pace, Settings, Verdict,
    advance,
};
use crate::tensor::{Pose, Vec3, Vector6};
use crate::triaxial::deformation::LocalStrain;
use crate::triaxial::drive::{AREA_TOLERANCE, Drive, Guess, Origin};
use crate::triaxial::fidelity::FidelityCounts;
use crate::triaxial::ledger::{EnergyGate, Ledger};
use crate::triaxial::measures::{Measures, Picture, Zero};
use crate::triaxial::remnants::Remnants;
use crate::triaxial::response::{Curve, Response};
use crate::triaxial::rig::Rig;
use crate::triaxial::stage::{Path, Stage, StageEnd};
use crate::triaxial::starts::{describe, starts};
use crate::triaxial::watch::Watch;
use sleep::{Claim, Sleep};
use trial::Trial;

/// What is known after each accepted increment.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub measures: Measures,
    pub picture: Picture,
    pub response: Response,
    pub ledger: Ledger,
    pub damage: DamageCounts,
    pub fidelity: FidelityCounts,
    /// Energy of the increment that no row of the ledger accounts for, over the work that ram and
    /// pressure exchanged in it.
    pub energy_gap: f64,
    /// Whether that is beyond the gate.
    pub poorly_closed: bool,
    /// Whether it snapped: what it leaves over is then booked as set free, its friction limited by what there was.
    pub snapped: bool,
    /// By how much what the stage prescribes is missed: stresses relative to the larger of their value and the
    /// pressure, the volume to what an increment sweeps, the top plate to its travel in it.
    pub control_error: f64,
    pub counters: Counters,
    pub out_of_balance: f64,
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

/// Share of the consolidation pressure under which grains are seated. Under a small share the
/// forces are too weak to bring loose grains into touch within the solver's limits.
const SEATING_SHARE: f64 = 0.5;
/// Trials of a load whose cross-section is not known before.
const AREA_TRIALS: usize = 5;
/// Where a stage is over and grains broke in its last increment, the tolerances of the dwell are those of an increment of this share.
const DWELL_SHARE: f64 = 1e-3;
/// Rough balances that a dwell gets where it does not find a fine one.
const MOST_SETTLINGS: usize = 10;
/// Augmentations of an increment of a specimen that has broken, before its grains fall, and of any before grains that bend rest and fall.
const LATE: usize = 60;
/// The same where no grain has broken.
const SOON: usize = 20;
/// How far bodies fall in a piece, over the smallest rounding.
const PIECE: f64 = 1.0;
/// Increments in a row that may be accepted in rough balance.
const MOST_ROUGH: usize = 50;
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
    /// Force and moment that the committed state leaves out of balance on each carrier [N, N m]; empty where that is not known.
    #[serde(with = "crate::tensor::stored")]
    left: Vec<Vector6<f64>>,
    /// Whether the top plate is under a load, not driven.
    loaded: bool,
    /// Height at which the last drive upwards began [m].
    turning: Option<f64>,
    /// Largest friction angle since strains count [rad].
    peak_friction_angle: f64,
    under_way: Option<UnderWay>,
}

/// A stage after its last accepted increment: with the rig's state all that it takes to go on with it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct UnderWay {
    drive: Drive,
    pace: Pace,
    watch: Watch,
    curve: Curve,
    last: Option<Last>,
    /// Whether grains broke and are not in balance yet.
    dwells: bool,
    /// Rough balances that the dwell has been given so far.
    settlings: usize,
    /// Pieces of the collapse that the dwell follows.
    pieces: usize,
    /// Increments accepted in rough balance, one after the other.
    rough: usize,
    /// What failed rock still holds.
    remnants: Remnants,
    /// What pieces and rough balances have taken.
    #[serde(skip)]
    spent: Counters,
    /// Whether the increment at hand was given up, at its smallest or for bodies that bend to rest, and is tried once more with bodies that may fall. Kept
    /// with the bodies that rest for it: a run that is interrupted there goes on with the same attempt.
    falls: bool,
    /// Bodies that are rigid until the collapse is over.
    sleep: Sleep,
    /// What bodies that woke have to find a balance without.
    claim: Option<Claim>,
    /// Times that the increment at hand has been repeated with more condensed grains.
    #[serde(skip)]
    repeats: usize,
    /// Grains that were made condensed for it.
    #[serde(skip)]
    woken: usize,
}

impl UnderWay {
    /// Share of the next increment; `None` where the stage is over.
    fn next(&self) -> Option<f64> {
        let next = self.pace.next().filter(|_| !self.watch.done)?;
        Some(self.watch.limit.map_or(next, |limit| limit.min(next)))
    }

    fn is_over(&self) -> bool {
        self.next().is_none()
    }
}

/// An accepted increment, for the next one to go on from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Last {
    pub(super) poses: Vec<Pose>,
    /// Displacements of nodes [m]; empty where no grain is full.
    #[serde(with = "crate::tensor::stored")]
    pub(super) fields: Vec<Vec<Vec3>>,
    share: f64,
    pressure: f64,
    deviatoric_stress: f64,
}

/// Whether bodies may fall in an increment: a plate under a load, or one that grows where nothing has broken, would do so until nothing is left.
fn may_fall(rig: &Rig, way: &UnderWay) -> bool {
    if rig.model.is_broken() { !way.drive.is_loaded() } else { !way.drive.presses_on() }
}

/// How bodies may fall in an increment; `None` where they may not. Grains that have broken are followed in pieces, each of which begins anew, its
/// damage as well; friction works along the whole way, but under a load that grows.
fn falling(rig: &Rig, way: &UnderWay) -> Option<Settings> {
    if way.claim.is_some() {
        // Nothing falls: bodies that have woken find a balance soon, or are left with what they have.
        return Some(Settings { rests_after: Some(LATE), ..rig.settings.clone() });
    }
    let (broken, freely) = (rig.model.is_broken(), way.dwells || may_fall(rig, way));
    let usual = rig.settings.falling();
    // Nothing more breaks while failed rock still holds what it held.
    let moves = usual.damage.moves && way.remnants.is_over();
    let falling = Settings {
        damage: DamageSettings { moves, ..usual.damage },
        fall_travel: if way.dwells || broken && freely { PIECE } else { usual.fall_travel },
        fall_rebase: freely.then_some(FALL_REBASE),
        ..usual
    };
    if way.dwells && way.pieces > 0 {
        return Some(Settings { falls_after: Some(1), ..falling });
    }
    if way.dwells || way.falls {
        return Some(falling);
    }
    let falls_after = if broken { Some(LATE) } else { freely.then_some(SOON) };
    // An increment that gets stuck is cut first. Grains that bend where that matters to some accuracy need not to while they fall.
    let rests_after = falls_after.and(rig.settings.accuracy).map(|_| LATE);
    falls_after.map(|_| Settings { falls_after, rests_after, falls_when_stuck: false, ..falling })
}

/// An increment that found no balance.
struct Miss {
    reason: String,
    /// What it came to, where it came to anything; what it took is in `counters`.
    report: Option<Box<IncrementReport>>,
    counters: Counters,
}

impl Miss {
    /// Whether bodies that bend are to rest, and to fall.
    fn collapses(&self) -> bool {
        self.report.as_ref().is_some_and(|report| report.collapses)
    }
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
            left: Vec::new(),
            loaded: true,
            turning: None,
            peak_friction_angle: f64::NEG_INFINITY,
            under_way: None,
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
        self.under_way.is_some()
    }

    /// Runs a stage, or the rest of the one that was interrupted; `observe` is called after each accepted
    /// increment and says whether to go on. A wish to stop at the last increment interrupts nothing.
    pub fn run(
        &mut self,
        rig: &mut Rig,
        stage: &Stage,
        observe: &mut dyn FnMut(&Rig, &StepReport<'_>) -> bool,
    ) -> StageEnd {
        let Some(mut way) = self.under_way.take().or_else(|| self.begin(rig, stage)) else {
            return StageEnd::Finished;
        };
        if let Some(reason) = way.watch.contradicts(way.drive.axial_strain()) {
            return StageEnd::Stopped { reason };
        }
        loop {
            match self.break_up(rig, &mut way) {
                Ok(true) => {
                    (way.dwells, way.last) = (true, None);
                    self.mend_cover(rig, &way.drive);
                }
                Ok(false) => {}
                Err(error) => return StageEnd::Stopped { reason: error.to_string() },
            }
            // Where grains broke, first a new balance under the loads as they are.
            let (share, to) = match (way.dwells, way.next()) {
                (true, next) => (next.unwrap_or(DWELL_SHARE), way.pace.done()),
                (false, Some(share)) => (share, way.pace.after(share)),
                (false, None) => break,
            };
            let attempt = self.attempt(rig, &way, share, to);
            if let Err(miss) = &attempt {
                way.spent.add(&miss.counters);
            }
            let mut report = match attempt {
                Ok(report) => {
                    way.rough = 0;
                    report
                }
                Err(_) if rig.settings.stop.is_raised() => {
                    self.under_way = Some(way);
                    return StageEnd::Interrupted;
                }
                Err(_) if self.waive(rig, &mut way) => continue,
                Err(miss) if self.follow(rig, &mut way, &miss, share, to) => continue,
                Err(_) if !way.remnants.is_over() => {
                    // What is left of them goes at once.
                    way.remnants = Remnants::default();
                    continue;
                }
                Err(miss) if miss.collapses() && !way.falls => {
                    self.lull(rig, &mut way);
                    way.falls = true;
                    continue;
                }
                Err(_) if !way.dwells && (way.watch.gives_up_landing() || way.pace.cut(share)) => continue,
                // A loaded plate would fall until nothing is left of the specimen.
                Err(_) if !way.dwells && !way.falls && may_fall(rig, &way) => {
                    self.lull(rig, &mut way);
                    way.falls = true;
                    continue;
                }
                Err(miss) => match miss.report.filter(|report| report.is_rough(&rig.settings)) {
                    Some(report) if way.rough < MOST_ROUGH => {
                        way.rough += 1;
                        *report
                    }
                    Some(_) | None
                        if way.dwells
                            && way.settlings < MOST_SETTLINGS
                            && self.settle(rig, &mut way, share, to) =>
                    {
                        continue;
                    }
                    Some(_) | None if way.dwells => return StageEnd::Stopped { reason: miss.reason },
                    Some(_) | None => {
                        let limit = way.drive.asked_stress();
                        let limit = limit.map(|asked| self.describe_limit(rig, &way, asked));
                        return StageEnd::Stopped { reason: limit.unwrap_or_default() + &miss.reason };
                    }
                },
            };
            if !way.remnants.is_over() {
                self.let_down(rig, &mut way, &report, share, to);
                continue;
            }
            let pressure = way.drive.pressure(to, report.factor);
            let settled = way.sleep.is_over() && way.claim.is_none();
            let verdict = if settled { rig.judge(&report, pressure) } else { Verdict::unknown() };
            if verdict.urgent && way.repeats < MOST_REPEATS {
                way.spent.add(&report.counters);
                way.repeats += 1;
                let transition = rig.change_fidelity([&verdict.wake, &[]]);
                self.start_elastic += transition.energy;
                way.woken += transition.woken;
                continue;
            }
            let mut trial = self.weigh(rig, &way, &report, share, to);
            if !way.dwells && way.watch.overshoots(share, &trial.measures) {
                way.spent.add(&report.counters);
                continue;
            }
            let unclosed = trial.poorly_closed || trial.overdraws;
            let refused = trial.creates_energy || (unclosed && self.energy_gate.cuts);
            if refused && !way.dwells && way.pace.cut(share) {
                tracing::debug!(share, gap = trial.energy_gap, "refused for its energy");
                way.spent.add(&report.counters);
                way.watch.limit = None;
                continue;
            }
            if trial.poorly_closed && self.energy_gate.cuts {
                // What does not close however short it is has jumped.
                trial = self.weigh_as(rig, &way, &report, [share, to], true);
            }
            if !way.dwells {
                report.counters.cuts =
                    way.pace.accept(share, rig.settings.beyond_start(report.augmentations));
            }
            let m = &trial.measures;
            way.watch.accept(m);
            let response = way.curve.push(
                m.axial_strain,
                m.volumetric_strain,
                m.deviatoric_stress,
                m.confining_pressure,
            );
            self.peak_friction_angle = way.curve.peak();
            let is_there = |grain: usize| rig.model.bodies[grain].kind != BodyKind::Gone;
            let frames = rig.model.frames(&report.poses);
            let local_strains = self.zero.neighbourhood.local_strains(&frames, is_there);
            let mut counters = report.counters;
            counters.add(&way.spent);
            let row = Row {
                measures: *m,
                picture: Picture::of(rig, &rig.contacts, &report.poses, m, &self.zero, &local_strains),
                response,
                ledger: trial.ledger,
                damage: DamageCounts::default(),
                fidelity: FidelityCounts::default(),
                energy_gap: trial.energy_gap,
                poorly_closed: trial.poorly_closed,
                snapped: trial.snapped,
                control_error: trial.control_error,
                counters,
                out_of_balance: report.balance.out_of_balance,
                sliding_fraction: report.measures.sliding_fraction,
                max_penetration: report.measures.max_penetration,
                mean_contact_force: report.measures.mean_force,
                progress: way.watch.progress(way.pace.done()),
                path: way.pace.done(),
            };
            let last = self.commit(rig, &way.drive, &report, &trial, share);
            way.last = Some(last).filter(|_| !way.dwells);
            (way.dwells, way.falls, way.settlings, way.pieces) = (false, false, 0, 0);
            way.remnants = Remnants::default();
            way.spent = Counters::default();
            let early = [std::mem::take(&mut way.repeats), std::mem::take(&mut way.woken)];
            let transition = rig.change_fidelity([&verdict.wake, &verdict.rest]);
            self.start_elastic += transition.energy;
            self.settle_claim(&mut way);
            self.wake(rig, &mut way);
            self.under_way = Some(way);
            let fidelity = FidelityCounts::of(&rig.model, &verdict, &transition, early);
            let row = Row { damage: rig.model.damage_counts(), fidelity, ledger: self.ledger, ..row };
            let step = StepReport { row, increment: &report, local_strains: &local_strains, test: self };
            let goes_on = observe(rig, &step);
            match self.under_way.take() {
                Some(left) if goes_on || (left.is_over() && rig.failing.is_empty()) => way = left,
                left => {
                    self.under_way = left;
                    return StageEnd::Interrupted;
                }
            }
        }
        way.watch.end(stage)
    }

    /// Why a loaded plate may go no further, where more deviatoric stress is `asked` for [Pa].
    fn describe_limit(&self, rig: &Rig, way: &UnderWay, asked: f64) -> String {
        let now = self.state(rig, &rig.committed.poses, rig.pressure, self.ram).deviatoric_stress;
        let (tangent, secant) = (way.curve.tangent_modulus(), way.curve.secant_modulus());
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
    fn begin(&mut self, rig: &Rig, stage: &Stage) -> Option<UnderWay> {
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
        Some(UnderWay {
            drive,
            pace,
            watch,
            curve,
            last: None,
            dwells: false,
            settlings: 0,
            pieces: 0,
            rough: 0,
            remnants: Remnants::default(),
            sleep: Sleep::default(),
            claim: None,
            spent: Counters::default(),
            falls: false,
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
            pressure: rig.pressure,
            deviatoric_stress: -self.ram / area(rig),
            poses: std::mem::replace(&mut rig.committed.poses, report.poses.clone()),
            fields: if rig.model.has_nodes() {
                std::mem::take(&mut rig.committed.fields)
            } else {
                Vec::new()
            },
        };
        rig.committed.memory.clone_from(&report.memory);
        rig.committed.fields.clone_from(&report.fields);
        rig.model.take_damage(&report.damage.grains);
        rig.failing = report.damage.failing(&rig.model);
        rig.pressure = trial.pressure;
        self.ledger = trial.ledger;
        self.ram = trial.ram;
        self.left.clone_from(&report.left);
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
            damage: DamageSettings { moves: false, ..rig.settings.damage },
            ..rig.settings.clone()
        };
        let rough = fine.for_seating().falling_together();
        let fine = fine.falling_together();
        let fall_bounds = rig.settings.fall_bounds;
        let mut settings = Settings { falls_after: Some(0), fall_bounds, ..rough };
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
            self.restart(rig, &report.energy);
            self.left.clone_from(&report.left);
            let rough = settings != fine;
            if report.converged() && rough {
                settings = fine.clone();
            } else {
                report.counters = counters;
                return report;
            }
        }
    }

    /// Tries the increment of `share` to the share `to` of a stage, under a cross-section that agrees with
    /// what comes of it. Where it fails, says why.
    fn attempt(
        &self,
        rig: &mut Rig,
        way: &UnderWay,
        share: f64,
        to: f64,
    ) -> std::result::Result<IncrementReport, Miss> {
        let (drive, last) = (&way.drive, way.last.as_ref());
        let now = self.state(rig, &rig.committed.poses, rig.pressure, self.ram);
        let continued = |now: f64, before: fn(&Last) -> f64| {
            last.map_or(now, |last| now + (now - before(last)) * (share / last.share))
        };
        let mut guess = Guess {
            area: now.volume / now.height,
            pressure: continued(now.pressure, |last| last.pressure),
            deviatoric_stress: continued(now.deviatoric_stress, |last| last.deviatoric_stress),
        };
        let lift = drive.lift(to).map(|lift| drive.origin.top + lift - now.top);
        let mut starts = starts(rig, last.map(|last| (last, share / last.share)), lift, now.height);
        let (mut counters, mut longest, mut augmentations) = (Counters::default(), Vec::new(), 0);
        let falling = falling(rig, way);
        let settings = falling.as_ref().unwrap_or(&rig.settings);
        for _ in 0..AREA_TRIALS {
            let mut loads = drive.loads(rig, share, to, &guess);
            // Whether they follow from the cross-section; what failed rock exerts does not.
            let depends = loads.applied[rig.top].z != 0.0
                || loads.control.as_ref().is_some_and(|control| !control.applied.is_empty());
            way.remnants.add_to(&mut loads);
            let increment =
                Increment { model: &rig.model, committed: &rig.committed, loads: &loads, settings };
            let mut report = advance(&increment, starts.clone(), &mut rig.contacts);
            counters.add(&report.counters);
            let falls = report.fell || report.collapses;
            if !report.converged() && !falls && !way.dwells && !way.falls {
                // Once more with care, from the plainest start, before the increment is cut.
                let settings = rig.settings.cautious();
                let careful = Increment { settings: &settings, ..increment };
                report = advance(&careful, starts.into_iter().rev().collect(), &mut rig.contacts);
                counters.add(&report.counters);
            }
            if !report.converged() {
                let mut dossier = Dossier::of(&rig.model, &rig.contacts, &report, &rig.settings);
                dossier.factorisations = way.spent.factorisations + counters.factorisations;
                rig.dossier = Some(dossier);
                let reason = describe(rig, &report, drive.pressure(to, report.factor));
                report.counters = Counters::default();
                return Err(Miss { reason, report: Some(Box::new(report)), counters });
            }
            let pressure = drive.pressure(to, report.factor);
            if pressure < LEAST_PRESSURE * drive.origin.pressure {
                let reason = format!(
                    "the confining pressure would have to fall to {pressure:.3e} Pa: nothing left holds the specimen"
                );
                return Err(Miss { reason, report: None, counters });
            }
            let area = rig.volume(&report.poses) / rig.height(&report.poses);
            // The trial that had the way to go says whether it was a snap.
            if report.augmentations >= augmentations {
                (longest, augmentations) = (std::mem::take(&mut report.history), report.augmentations);
            }
            if !depends || (area / guess.area - 1.0).abs() <= AREA_TOLERANCE {
                return Ok(IncrementReport { counters, history: longest, augmentations, ..report });
            }
            guess.area = area;
            guess.deviatoric_stress = report.factor;
            starts = vec![report.poses.into()];
        }
        let reason = format!("the cross-section did not settle in {AREA_TRIALS} trials");
        Err(Miss { reason, report: None, counters })
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
