//! A scene: its model, its state, and its way through its stages.

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::assembly::{Contacts, Failing};
use crate::contact::{ContactLaw, ContactShape};
use crate::error::{Error, Result};
use crate::geometry::Polyhedron;
use crate::loading::{Ledger, Pace, StageEnd, StageProgress, run_stage};
use crate::model::{BodyKind, Committed, Loads, Model, StoredBodies};
use crate::scene::drive::{Drive, Progress, StageState};
use crate::scene::parameters::{LoadStage, SceneParameters};
use crate::scene::placed::placed;
use crate::scene::press::{Pressing, StoredPressing};
use crate::scene::row::Row;
use crate::solver::{Dossier, Settings};
use crate::tensor::{Pose, Vector6};

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
    pub(super) elastic_shift: f64,
    /// Of the increment that stopped the last run; not stored.
    pub dossier: Option<Dossier>,
    /// Stages that are done.
    pub(super) stages_done: usize,
    /// The stage at hand, once an increment of it is accepted.
    pub(super) progress: Option<Progress>,
    /// The shapes before anything broke.
    first_shapes: Vec<Polyhedron>,
    /// What the last increment leaves to break up.
    pub(super) failing: Failing,
    /// The press, where the scene is one, the force of its upper plate in the last accepted state [N], and the stabilisation before the last
    /// increment that did not rebalance [J].
    pub pressing: Option<Pressing>,
    pub(super) last_push: f64,
    pub(super) stabilised: f64,
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
    progress: Cow<'a, Option<Progress>>,
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
            let progress = self.progress.take().unwrap_or_else(|| self.begin(&stage));
            let end = run_stage(self, progress, &mut |scene, row| observe(scene, row));
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

    /// A stage before its first increment.
    fn begin(&self, stage: &LoadStage) -> Progress {
        let nominal = 1.0 / stage.increments as f64;
        let [smallest, largest] = self.increment_range;
        let pace = Pace::new(nominal, smallest * nominal, largest * nominal);
        StageProgress::new(pace, StageState::new(self.drive(stage)))
    }

    /// The bodies that stages drive or load.
    pub(super) fn named(&self) -> impl Iterator<Item = usize> + '_ {
        let bodies = self.stages.iter().flat_map(|stage| &stage.bodies);
        bodies.filter_map(|(name, _)| self.names.get(name).copied())
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
            if self.model.bodies[body].kind == BodyKind::Gone {
                continue;
            }
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
}
