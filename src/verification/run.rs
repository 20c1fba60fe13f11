//! A run of one of the problems, every accepted state of it audited for overlap.

use std::time::{Duration, Instant};

use crate::contact::NormalLaw;
use crate::loading::StageEnd;
use crate::scene::{Row, Scene, SceneParameters};
use crate::solver::audit::{self, deepest_overlap};

/// A finished run.
#[derive(Debug, Clone)]
pub struct Run {
    pub scene: Scene,
    pub rows: Vec<Row>,
    pub end: StageEnd,
    /// Deepest overlap of any accepted state [m], by the independent check.
    pub deepest: f64,
    /// What is wrong with an accepted state, where the audit found one; the run ends there.
    pub fault: Option<String>,
    pub time: Duration,
}

impl Run {
    /// Runs a scene that is sound: those of the problems are.
    pub fn of(parameters: &SceneParameters) -> Run {
        let mut scene = Scene::new(parameters).expect("a sound scene");
        let mut rows = Vec::new();
        let mut deepest = f64::NEG_INFINITY;
        let mut fault = None;
        let start = Instant::now();
        let end = scene.run(|scene, row| {
            let overlap = deepest_overlap(&scene.model, &scene.committed.poses).map_or(0.0, |o| o.depth);
            deepest = deepest.max(overlap);
            fault = audited(scene, row, overlap);
            rows.push(row.clone());
            fault.is_none()
        });
        Run { scene, rows, end, deepest, fault, time: start.elapsed() }
    }

    /// Whether it came to its end, and nothing was wrong with any accepted state.
    pub fn finished(&self) -> bool {
        self.end == StageEnd::Finished && self.fault.is_none()
    }

    /// Whether it stopped short for lack of an equilibrium, its states sound up to there.
    pub fn stopped(&self) -> bool {
        matches!(self.end, StageEnd::Stopped { .. }) && self.fault.is_none()
    }

    /// How it ended, where that was not as asked; empty else.
    pub fn trouble(&self) -> String {
        match (&self.fault, &self.end) {
            (Some(fault), _) => fault.clone(),
            (None, StageEnd::Stopped { reason }) => format!("stopped {reason}"),
            (None, StageEnd::Interrupted) => "interrupted".into(),
            (None, StageEnd::Finished) => String::new(),
        }
    }

    /// The last accepted increment.
    pub fn last(&self) -> Option<&Row> {
        self.rows.last()
    }

    /// A quantity of the last accepted increment; not a number without one.
    pub fn at_end(&self, quantity: impl Fn(&Row) -> f64) -> f64 {
        self.last().map_or(f64::NAN, quantity)
    }

    /// Index of the body of that name, which is there.
    pub fn index(&self, name: &str) -> usize {
        self.scene.body(name).expect("a body of that name")
    }

    pub fn factorisations(&self) -> usize {
        let given_up = self.scene.dossier.as_ref().map_or(0, |dossier| dossier.factorisations);
        self.rows.iter().map(|r| r.counters.factorisations).sum::<usize>() + given_up
    }

    pub fn cuts(&self) -> usize {
        self.rows.iter().map(|r| r.counters.cuts).sum()
    }
}

/// What is wrong with an accepted state that has this overlap [m].
fn audited(scene: &Scene, row: &Row, overlap: f64) -> Option<String> {
    // A contact of fidelity rigid yields by its force over its stiffness, and by no more: the
    // softest pair's stiffness and the whole onset bound it.
    let softest = scene.model.bodies.iter().map(|b| b.stiffness).fold(f64::INFINITY, f64::min);
    let force = row.bodies.iter().map(|b| b.contact_force.norm()).fold(0.0, f64::max);
    let largest = force.max(row.measures.mean_force * row.measures.points as f64);
    let allowed = largest / (0.5 * softest) + 0.5 * scene.model.law.onset + 1e-12;
    let increment = row.increment;
    // Bodies that deform overlap undeformed by what they yield, asperities by what they are crushed; the rim of a patch is softer the less of it bears.
    let by_corners = scene.model.shapes.iter().all(|shape| shape.faces.is_empty());
    let by_springs = !scene.model.has_elastic() && scene.model.normal == NormalLaw::Spring && by_corners;
    if by_springs && !(overlap <= allowed) {
        return Some(format!("increment {increment}: overlap {overlap:.3e} of {allowed:.3e} m"));
    }
    audit::fault(&scene.model, &scene.contacts, &scene.committed.poses)
        .map(|fault| format!("increment {increment}: {fault}"))
}
