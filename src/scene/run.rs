//! Builds the model of a scene and takes it through its stages.

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::assembly::{Contacts, Failing, TooClose};
use crate::contact::{ContactLaw, ContactShape};
use crate::error::{Error, Result};
use crate::geometry::Polyhedron;
use crate::model::{BodyKind, Committed, Counters, Loads, Model, StoredBodies};
use crate::scene::drive::Drive;
use crate::scene::parameters::{LoadStage, SceneParameters};
use crate::scene::placed::placed;
use crate::scene::press::{Pressing, StoredPressing};
use crate::scene::row::{BodyState, Row};
use crate::solver::fidelity::{change, judge};
use crate::solver::{
    Dossier, Increment, IncrementReport, Pace, Settings, StepStatus, Transition, Verdict, advance,
    continued_poses, motion_between, sweep,
};
use crate::tensor::{Pose, Vec3, Vector6};
use crate::triaxial::{FidelityCounts, Ledger, StageEnd, fell};

/// Times that an increment is repeated since a body ought to have been condensed in it.
const MOST_REPEATS: usize = 3;

/// A scene in progress.
#[derive(Debug, Clone)]
pub struct Scene {
    pub model: Model,
    pub committed: Committed,
    pub settings: Settings,
    /// Since the start.
    pub ledger: Ledger,
    pub(super) stages: Vec<LoadStage>,
    increment_range: [f64; 2],
    names: BTreeMap<String, usize>,
    /// The contacts of the configuration that was evaluated last; in an observer, the accepted one.
    pub contacts: Contacts,
    pub(super) start: Vec<Pose>,
    pub(super) increments: usize,
    /// Loads in force, prescribed components and what holds them included.
    pub(super) loads: Loads,
    pub(super) reaction: Vec<Vector6<f64>>,
    /// What changes of fidelity have added to the elastic energy that bodies and contacts are said to hold [J].
    elastic_shift: f64,
    /// Of the increment that stopped the last run; not stored.
    pub dossier: Option<Dossier>,
    /// Stages that are done.
    stages_done: usize,
    /// The stage at hand, once an increment of it is accepted.
    pub(super) progress: Option<StageProgress>,
    /// The shapes before anything broke.
    first_shapes: Vec<Polyhedron>,
    /// What the last increment leaves to break up.
    failing: Failing,
    /// The press, where the scene is one, the force of its upper plate in the last accepted state [N], and the stabilisation before the last
    /// increment that was no dwell [J].
    pub pressing: Option<Pressing>,
    pub(super) last_push: f64,
    pub(super) stabilised: f64,
}

/// A stage after its last accepted increment.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct StageProgress {
    pub(super) drive: Drive,
    pub(super) pace: Pace,
    pub(super) last: Option<Last>,
    /// Whether bodies broke and are not in balance yet.
    pub(super) dwells: bool,
    /// What failed attempts at the increment at hand took.
    pub(super) lost: Counters,
}

/// What the last increment came from.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Last {
    poses: Vec<Pose>,
    share: f64,
}

/// What changes of a scene as it runs. The rest follows from its parameters.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SceneState<'a> {
    /// To tell whether it is the same scene: shapes and places at the start.
    shapes: Vec<Cow<'a, Polyhedron>>,
    start: Cow<'a, [Pose]>,
    committed: Cow<'a, Committed>,
    contacts: Cow<'a, Contacts>,
    ledger: Ledger,
    increments: usize,
    loads: Cow<'a, Loads>,
    #[serde(with = "crate::tensor::stored")]
    reaction: Vec<Vector6<f64>>,
    elastic_shift: f64,
    stages_done: usize,
    progress: Cow<'a, Option<StageProgress>>,
    bodies: StoredBodies<'a>,
    failing: Cow<'a, Failing>,
    pressing: Option<StoredPressing>,
    last_push: f64,
    stabilised: f64,
}

impl Scene {
    /// Places the bodies.
    ///
    /// # Errors
    /// `Error::Mesh` where a body's rounding does not fit, `Error::Usage` where a stage names a body
    /// that is not there, two bodies share a name, or a stage has no increments.
    pub fn new(parameters: &SceneParameters) -> Result<Self> {
        let mut names = BTreeMap::new();
        let mut bodies = Vec::new();
        let mut shapes = Vec::new();
        for (index, body) in parameters.bodies.iter().enumerate() {
            if names.insert(body.name.clone(), index).is_some() {
                return Err(Error::Usage(format!("two bodies are named {:?}", body.name)));
            }
            let (model_body, shape) = placed(body, &parameters.friction)?;
            bodies.push(model_body);
            shapes.push(ContactShape::new(shape));
        }
        for stage in &parameters.stages {
            if stage.increments == 0 {
                return Err(Error::Usage("a load stage has no increments".into()));
            }
            if let Some((name, _)) = stage.bodies.iter().find(|(name, _)| !names.contains_key(name)) {
                return Err(Error::Usage(format!("a load stage names {name:?}, which is no body")));
            }
        }
        let smallest = shapes.iter().map(|s| s.rounded.radius).fold(f64::INFINITY, f64::min);
        let nu = parameters.bodies.iter().map(|b| b.poissons_ratio).fold(0.0, f64::max);
        let law = ContactLaw::of_rock(smallest, nu);
        let mut poses: Vec<Pose> = parameters.bodies.iter().map(|b| b.pose).collect();
        let pressing = match parameters.press {
            Some(press) => Some(Pressing::new(press, &mut bodies, &mut poses)?),
            None => None,
        };
        let mut loads = Loads::none(bodies.len());
        loads.gravity = parameters.gravity;
        for (prescribed, body) in loads.prescribed.iter_mut().zip(&parameters.bodies) {
            *prescribed = [body.fixed; 6];
        }
        let reaction = vec![Vector6::zeros(); bodies.len()];
        let first_shapes = bodies.iter().map(|body| body.nominal.clone()).collect();
        let mut model = Model::new(bodies, shapes, law, parameters.friction).with_faces(parameters.faces);
        model = model.with_normal(parameters.normal);
        model.begin_damage();
        Ok(Scene {
            model,
            committed: Committed::new(poses.clone()),
            settings: parameters.settings.clone(),
            ledger: Ledger::default(),
            stages: parameters.stages.clone(),
            increment_range: parameters.increment_range,
            names,
            contacts: Contacts::default(),
            start: poses,
            increments: 0,
            loads,
            reaction,
            elastic_shift: 0.0,
            dossier: None,
            stages_done: 0,
            progress: None,
            first_shapes,
            failing: Failing::default(),
            pressing,
            last_push: 0.0,
            stabilised: 0.0,
        })
    }

    /// The state to store, so that the scene can go on from here to the same bits.
    pub fn state(&self) -> SceneState<'_> {
        // Every field by name: a new one is either rebuilt by `new` or has to be stored.
        let Scene {
            model,
            committed,
            settings: _,
            ledger,
            stages: _,
            increment_range: _,
            names: _,
            contacts,
            start,
            increments,
            loads,
            reaction,
            elastic_shift,
            dossier: _,
            stages_done,
            progress,
            first_shapes,
            failing,
            pressing,
            last_push,
            stabilised,
        } = self;
        SceneState {
            shapes: first_shapes.iter().map(Cow::Borrowed).collect(),
            start: Cow::Borrowed(start),
            committed: Cow::Borrowed(committed),
            contacts: Cow::Borrowed(contacts),
            ledger: *ledger,
            increments: *increments,
            loads: Cow::Borrowed(loads),
            reaction: reaction.clone(),
            elastic_shift: *elastic_shift,
            stages_done: *stages_done,
            progress: Cow::Borrowed(progress),
            bodies: model.stored_bodies(),
            failing: Cow::Borrowed(failing),
            pressing: pressing.as_ref().map(Pressing::stored),
            last_push: *last_push,
            stabilised: *stabilised,
        }
    }

    /// Takes a stored state; `false`, and nothing is changed, where it belongs to another scene.
    ///
    /// # Errors
    /// `Error::Mesh` where a body that broke cannot be made anew.
    pub fn restore(&mut self, state: SceneState<'_>) -> Result<bool> {
        let same_shapes = state.shapes.len() == self.first_shapes.len()
            && state.shapes.iter().zip(&self.first_shapes).all(|(stored, own)| **stored == *own);
        if !same_shapes || *state.start != *self.start {
            return Ok(false);
        }
        let mut model = self.model.clone();
        if !model.restore_bodies(state.bodies)? {
            return Ok(false);
        }
        let bodies = model.bodies.len();
        let fits = state.committed.poses.len() == bodies
            && state.contacts.fit(bodies)
            && state.loads.applied.len() == bodies
            && state.reaction.len() == bodies
            && state.stages_done <= self.stages.len();
        let mut pressing = self.pressing.clone();
        let fits = fits
            && match (&mut pressing, state.pressing) {
                (Some(pressing), Some(stored)) => pressing.restore(stored, &model.bodies),
                (None, None) => true,
                (Some(_), None) | (None, Some(_)) => false,
            };
        if fits {
            self.pressing = pressing;
            self.last_push = state.last_push;
            self.stabilised = state.stabilised;
            self.model = model;
            self.failing = state.failing.into_owned();
            self.committed = state.committed.into_owned();
            self.contacts = state.contacts.into_owned();
            self.ledger = state.ledger;
            self.increments = state.increments;
            self.loads = state.loads.into_owned();
            self.reaction = state.reaction;
            self.elastic_shift = state.elastic_shift;
            self.stages_done = state.stages_done;
            self.progress = state.progress.into_owned();
        }
        Ok(fits)
    }

    /// Loads and prescriptions of the committed state.
    pub fn loads(&self) -> &Loads {
        &self.loads
    }

    /// Whether nothing holds, drives or pushes a body but contacts and gravity.
    pub fn is_free(&self, body: usize) -> bool {
        self.loads.prescribed[body] == [false; 6] && self.loads.applied[body] == Vector6::zeros()
    }

    /// Index of the body of that name.
    pub fn body(&self, name: &str) -> Option<usize> {
        self.names.get(name).copied()
    }

    /// Runs all stages, or what is left of them; `observe` sees each accepted increment and says whether to
    /// go on. A wish to stop at the very last increment interrupts nothing.
    pub fn run(&mut self, mut observe: impl FnMut(&Scene, &Row) -> bool) -> StageEnd {
        while let Some(stage) = self.stages.get(self.stages_done).cloned() {
            let end = match self.pressing.take() {
                Some(pressing) => self.run_press(pressing, self.stages_done, &stage, &mut observe),
                None => self.run_stage(self.stages_done, &stage, &mut observe),
            };
            match end {
                StageEnd::Finished => {
                    self.stages_done += 1;
                    self.progress = None;
                }
                end @ (StageEnd::Stopped { .. } | StageEnd::Interrupted) => return end,
            }
        }
        StageEnd::Finished
    }

    fn run_stage(
        &mut self,
        index: usize,
        stage: &LoadStage,
        observe: &mut impl FnMut(&Scene, &Row) -> bool,
    ) -> StageEnd {
        let StageProgress { mut drive, mut pace, mut last, mut dwells, mut lost } =
            self.progress.take().unwrap_or_else(|| self.begin(stage));
        let (mut repeats, mut woken) = (0, 0);
        loop {
            match self.break_up(&mut drive) {
                Ok(true) => (dwells, last) = (true, None),
                Ok(false) => {}
                Err(error) => return StageEnd::Stopped { reason: error.to_string() },
            }
            // Where bodies broke, first a new balance as it is.
            let Some(share) = (if dwells { Some(0.0) } else { pace.next() }) else { break };
            let to = if share < 1.0 - pace.done() { pace.done() + share } else { 1.0 };
            let loads = drive.loads_at(to);
            let driven = drive.driven(&self.committed.poses, &self.committed.poses, share, to);
            let mut starts = Vec::new();
            if let Some(last) = &last {
                let ratio = share / last.share;
                let continued = continued_poses(&last.poses, &self.committed.poses, ratio);
                starts.push(drive.driven(&continued, &self.committed.poses, share, to));
            }
            starts.push(driven);
            starts.retain(|start| sweep::is_clear(&self.model, &self.committed.poses, start));
            let increment = Increment {
                model: &self.model,
                committed: &self.committed,
                loads: &loads,
                settings: &self.settings,
            };
            let slow_start = starts.last().cloned();
            let mut report = advance(&increment, starts, &mut self.contacts);
            if !report.converged() {
                // An attempt that is broken off is made again.
                let before = lost;
                lost.add(&report.counters);
                if !self.settings.stop.is_raised() && !dwells && pace.cut(share) {
                    continue;
                }
                // Nothing is left to cut: perhaps the next equilibrium is far away.
                if let (Some(settings), Some(start)) = (self.settings.dwelling(), slow_start) {
                    let increment = Increment { settings: &settings, ..increment };
                    report = advance(&increment, vec![start], &mut self.contacts);
                    if !report.converged() {
                        lost.add(&report.counters);
                    }
                }
                if self.settings.stop.is_raised() {
                    self.progress = Some(StageProgress { drive, pace, last, dwells, lost: before });
                    return StageEnd::Interrupted;
                }
                if !report.converged() {
                    let mut dossier = Dossier::of(&self.model, &self.contacts, &report, &self.settings);
                    dossier.factorisations = lost.factorisations;
                    self.dossier = Some(dossier);
                    return StageEnd::Stopped { reason: self.describe(&report, pace.done()) };
                }
            }
            let verdict = self.judge(&report, &loads);
            if verdict.urgent && repeats < MOST_REPEATS {
                lost.add(&report.counters);
                repeats += 1;
                woken += self.change_fidelity([&verdict.wake, &[]]).woken;
                continue;
            }
            report.counters.add(&std::mem::take(&mut lost));
            if !dwells {
                report.counters.cuts = pace.accept(share, report.is_easy());
                last = Some(Last { poses: self.committed.poses.clone(), share });
            }
            let row = self.commit(index, pace.done(), &report, loads, dwells);
            let early = [std::mem::take(&mut repeats), std::mem::take(&mut woken)];
            let transition = self.change_fidelity([&verdict.wake, &verdict.rest]);
            let fidelity = FidelityCounts::of(&self.model, &verdict, &transition, early);
            let row = Row { fidelity, ..row };
            dwells = false;
            self.progress = Some(StageProgress {
                drive: drive.clone(),
                pace: pace.clone(),
                last: last.clone(),
                dwells,
                lost,
            });
            let all_done = pace.next().is_none() && self.failing.is_empty() && index + 1 == self.stages.len();
            if !observe(self, &row) && !all_done {
                return StageEnd::Interrupted;
            }
        }
        StageEnd::Finished
    }

    /// A stage before its first increment.
    pub(super) fn begin(&self, stage: &LoadStage) -> StageProgress {
        let nominal = 1.0 / stage.increments as f64;
        let [smallest, largest] = self.increment_range;
        let pace = Pace::new(nominal, smallest * nominal, largest * nominal);
        let drive = self.drive(stage);
        StageProgress { drive, pace, last: None, dwells: false, lost: Counters::default() }
    }

    /// Breaks up what the last increment left to; whether anything did.
    fn break_up(&mut self, drive: &mut Drive) -> Result<bool> {
        if self.failing.is_empty() {
            return Ok(false);
        }
        let failing = std::mem::take(&mut self.failing);
        let before = self.committed.poses.clone();
        let fractures = self.model.break_up(
            &mut self.committed,
            &failing.displacements(before.len()),
            self.settings.damage.least_share,
        )?;
        let lost: f64 = fractures.iter().map(|fracture| fracture.lost_energy).sum();
        self.ledger.damage += lost;
        self.ledger.elastic -= lost;
        let poses = &self.committed.poses;
        self.loads.applied.resize(poses.len(), Vector6::zeros());
        self.loads.prescribed.resize(poses.len(), [false; 6]);
        self.reaction.resize(poses.len(), Vector6::zeros());
        drive.grow(&before, poses);
        for fracture in fractures.iter().filter(|fracture| fracture.parts.is_empty()) {
            drive.held[fracture.body] = [true; 6];
        }
        if !fractures.is_empty() {
            self.contacts.forget_bodies();
        }
        self.contacts.inherit(&self.model, &mut self.committed, &fractures);
        Ok(true)
    }

    /// Judges fidelities in the balanced state that `report` holds, driven bodies held where they are.
    fn judge(&self, report: &IncrementReport, loads: &Loads) -> Verdict {
        let (poses, memory, fields) = (report.poses.clone(), report.memory.clone(), report.fields.clone());
        judge(
            &self.model,
            &Committed { memory, fields, ..Committed::new(poses) },
            loads,
            &self.settings,
            &self.contacts,
        )
    }

    /// Wakes and rests bodies in the committed state; elastic energy counts on from what it was.
    fn change_fidelity(&mut self, changes: [&[usize]; 2]) -> Transition {
        let transition = change(&mut self.model, &mut self.committed, &mut self.contacts, 0.0, changes);
        self.elastic_shift += transition.energy;
        transition
    }

    fn drive(&self, stage: &LoadStage) -> Drive {
        let mut drive = Drive {
            held: self.loads.prescribed.clone(),
            travel: vec![Vector6::zeros(); self.model.bodies.len()],
            from: self.committed.poses.clone(),
            applied: [self.loads.applied.clone(), self.loads.applied.clone()],
            gravity: [self.loads.gravity, stage.gravity.unwrap_or(self.loads.gravity)],
        };
        for (name, load) in &stage.bodies {
            let Some(&body) = self.names.get(name) else { continue };
            let fixed = self.model.bodies[body].kind == BodyKind::Fixed;
            for (first, motion) in [(0, load.displacement), (3, load.rotation)] {
                let Some(motion) = motion.filter(|_| !fixed) else { continue };
                for (k, component) in motion.iter().enumerate() {
                    drive.held[body][first + k] = component.is_some();
                    drive.travel[body][first + k] = component.unwrap_or(0.0);
                }
            }
            for (first, wrench) in [(0, load.force), (3, load.moment)] {
                let Some(wrench) = wrench else { continue };
                for (k, component) in wrench.iter().enumerate() {
                    drive.applied[1][body][first + k] = component.unwrap_or(0.0);
                }
            }
        }
        for body in 0..self.model.bodies.len() {
            for k in 0..6 {
                if self.loads.prescribed[body][k] && !drive.held[body][k] {
                    drive.applied[0][body][k] += self.reaction[body][k];
                }
            }
        }
        drive
    }

    /// Makes the increment the committed state, books its energies and tells what it did.
    fn commit(
        &mut self,
        stage: usize,
        progress: f64,
        report: &IncrementReport,
        loads: Loads,
        dwelt: bool,
    ) -> Row {
        let mut bodies = Vec::with_capacity(self.start.len());
        let vector = |w: &Vector6<f64>, first: usize| Vec3::new(w[first], w[first + 1], w[first + 2]);
        let (error_before, mut unborne) = (self.ledger.error(), 0.0);
        for (i, body) in self.model.bodies.iter().enumerate() {
            let [old, new] = [self.committed.poses[i], report.poses[i]];
            let weight = |gravity: &Vec3, pose: &Pose| {
                let force = gravity * body.mass;
                let moment = (pose.rotation * body.centre_of_mass).cross(&force);
                Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
            };
            let dead = loads.applied[i] + weight(&loads.gravity, &new);
            let mut reaction = Vector6::zeros();
            for k in 0..6 {
                if loads.prescribed[i][k] {
                    reaction[k] = -(report.contact_wrench[i][k] + dead[k]);
                }
            }
            let before = self.loads.applied[i] + weight(&self.loads.gravity, &old) + self.reaction[i];
            let (shift, turn) = motion_between(&old, &new);
            let motion = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
            let work = 0.5 * (before + dead + reaction).dot(&motion);
            self.ledger.external += work;
            if before == Vector6::zeros() && loads.prescribed[i] == [false; 6] {
                unborne += work;
            }
            self.reaction[i] = reaction;
            let Some(start) = self.start.get(i) else { continue };
            // Of the largest part of a body that broke, about the reference point that it was placed by.
            let arm = new.rotation * body.frame_offset();
            let placed = start.position - start.rotation * body.offset;
            let about = |w: &Vector6<f64>| vector(w, 3) + arm.cross(&vector(w, 0));
            bodies.push(BodyState {
                position: new.position - arm,
                rotation: new.rotation.scaled_axis(),
                displacement: new.position - arm - placed,
                contact_force: vector(&report.contact_wrench[i], 0),
                contact_moment: about(&report.contact_wrench[i]),
                reaction_force: vector(&reaction, 0),
                reaction_moment: about(&reaction),
            });
        }
        self.ledger.elastic = report.energy.elastic - self.elastic_shift;
        self.ledger.friction += report.energy.friction;
        self.ledger.damage += report.damage.dissipated;
        self.ledger.indentation += report.damage.crushing;
        let left_over = self.ledger.error() - error_before;
        let snapped = dwelt || report.is_snap() || fell(unborne, left_over);
        if snapped {
            self.ledger.stabilisation += left_over.max(0.0);
        }
        self.committed.poses.clone_from(&report.poses);
        self.committed.memory.clone_from(&report.memory);
        self.committed.fields.clone_from(&report.fields);
        self.model.take_damage(&report.damage.grains);
        self.failing = report.damage.failing(&self.model);
        self.increments += 1;
        let gravity = loads.gravity;
        self.loads = loads;
        Row {
            stage,
            increment: self.increments,
            progress,
            bodies,
            ledger: self.ledger,
            damage: self.model.damage_counts(),
            fidelity: FidelityCounts::default(),
            gravity,
            balance: report.balance,
            measures: report.measures,
            counters: report.counters,
            snapped,
        }
    }

    fn describe(&self, report: &IncrementReport, done: f64) -> String {
        let at = format!("after {:.4} of the stage: ", done);
        at + &match &report.status {
            StepStatus::Converged => "converged".into(),
            StepStatus::Abandoned => "the increment was given up as asked".into(),
            StepStatus::Unsolvable { problem } => format!("a body gave way: {problem}"),
            StepStatus::Overlapping { problem } => problem.clone(),
            StepStatus::TooClose(pair) => TooClose::described(*pair, &self.model),
            StepStatus::OutOfBalance { body, out_of_balance } => format!(
                "{} is out of balance by {out_of_balance:.2e} of the mean contact force after {} augmentations; \
                 it may have no equilibrium here",
                self.model.bodies[*body].name,
                report.history.len()
            ),
        }
    }
}
