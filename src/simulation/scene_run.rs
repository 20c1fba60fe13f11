//! The run of a scene of bodies set by hand, from its parameters to the end of its last stage.

use std::path::Path;
use std::time::Instant;

use crate::case::{Case, RawCase};
use crate::error::Result;
use crate::loading::StageEnd;
use crate::recording::{Profile, Recorder, ScenePoint, restart};
use crate::results::Reader;
use crate::scene::{Scene, SceneParameters, other_equilibrium};
use crate::setup::{PlannedStage, body_meshes, planned_stages, rock_samples, scene_parameters};
use crate::solver::audit;
use crate::triaxial::StageCurve;

use super::ending::{Outcome, close};
use super::observer::{Observer, Step};
use super::options::Options;
use super::resume::{Found, reopen};

/// Runs a scene, from what was `found` in its results file or from its start.
///
/// # Errors
/// As [`super::run`].
pub fn run(
    case: &Case,
    source: &RawCase,
    options: &Options,
    found: Option<Found>,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let clock = Instant::now();
    let folder = source.file.parent().unwrap_or(Path::new(""));
    // What cannot be built is said before a file is made.
    observer.building(true);
    let mut parameters = scene_parameters(case, folder)?;
    parameters.settings.stop = observer.stop_signal();
    let mut scene = Scene::new(&parameters)?;
    observer.building(false);
    let beginning = Beginning { case, source, options, parameters: &parameters, folder, clock };
    let mut recorder = match found {
        Some(found) => beginning.continued(&mut scene, &found, observer)?,
        None => beginning.anew(&scene, observer)?,
    };
    let mut end = StageEnd::Interrupted;
    if !observer.stop_requested() {
        let stages = planned_stages(case);
        end = run_increments(&mut scene, &mut recorder, &parameters, &stages, options.audit, observer)?;
    }
    recorder.end_scene(&scene)?;
    if end != StageEnd::Interrupted {
        recorder.write_pieces(&scene.model)?;
    }
    let mut profile = Profile::default();
    profile.book_since("scene", clock);
    profile.finish(scene.contacts.timings);
    close(recorder, case, options, end, scene.dossier.take(), profile)
}

/// What a scene needs to begin.
struct Beginning<'a> {
    case: &'a Case,
    source: &'a RawCase,
    options: &'a Options,
    parameters: &'a SceneParameters,
    /// Where mesh files are relative to.
    folder: &'a Path,
    /// When the run was begun.
    clock: Instant,
}

impl Beginning<'_> {
    fn anew(&self, scene: &Scene, observer: &mut dyn Observer) -> Result<Recorder> {
        let mut recorder = Recorder::create(self.case, self.source, &self.options.target(), self.clock)?;
        let drawn = rock_samples::of_scene(self.case, self.parameters)?;
        observer.rock_drawn(&drawn);
        recorder.write_rock(&drawn)?;
        self.show(&mut recorder, scene)?;
        recorder.hold_scene(scene)?;
        recorder.keep()?;
        Ok(recorder)
    }

    /// Takes the scene to the last restart point of the results file.
    fn continued(&self, scene: &mut Scene, found: &Found, observer: &mut dyn Observer) -> Result<Recorder> {
        let out = &self.options.out;
        let kept = Reader::open(out)?.restart()?;
        let kept = kept.ok_or_else(|| restart::fault(out, "holds no restart point"))?;
        let (point, version) = restart::decode::<ScenePoint<'_>>(&kept.bytes, out)?;
        // Before it moves: its first configuration is the reference of what the file shows.
        let first = scene.clone();
        if !scene.restore(point.scene)? {
            return Err(restart::fault(out, "belongs to a scene of other bodies; has a mesh file changed?"));
        }
        let mut writer = reopen(out, &kept)?;
        writer.drop_summaries(point.at.stage)?;
        let mut recorder = Recorder::over(writer, self.case, self.clock);
        observer.resumed(&found.continuation(&kept, version));
        self.show(&mut recorder, &first)?;
        let unsaved = point.unsaved.map(|state| state.into_owned());
        recorder.restore(point.at, point.sums, StageCurve::default(), kept.states, unsaved);
        Ok(recorder)
    }

    /// Writes the bodies' meshes and the first state, or compares them with those of a continued run.
    fn show(&self, recorder: &mut Recorder, scene: &Scene) -> Result<()> {
        let meshes = body_meshes(self.case, self.parameters, self.folder)?;
        let moduli = rock_samples::moduli_of_scene(self.case, self.parameters, &meshes)?;
        recorder.begin_scene(scene, self.parameters, &meshes, &moduli)
    }
}

/// The increments of all stages, each in the file and told of before the next one begins.
fn run_increments(
    scene: &mut Scene,
    recorder: &mut Recorder,
    parameters: &SceneParameters,
    stages: &[PlannedStage],
    audit: bool,
    observer: &mut dyn Observer,
) -> Result<StageEnd> {
    let (mut trouble, mut begun, mut fault) = (None, None, None);
    recorder.begin_solving();
    let end = scene.run(|scene, row| {
        let Some(planned) = stages.get(row.stage) else { return true };
        if begun != Some(row.stage) {
            begun = Some(row.stage);
            observer.stage_begun(planned);
        }
        match recorder.accept_scene(parameters, scene, row) {
            Ok(recorded) => observer.step_accepted(&Step::new(planned, stages, row.progress, &recorded)),
            Err(error) => trouble = Some(error),
        }
        if audit {
            fault = audit::fault(&scene.model, &scene.contacts, &scene.committed.poses);
            warn_of_other_equilibrium(scene, row.increment);
        }
        recorder.begin_solving();
        trouble.is_none() && fault.is_none() && !observer.stop_requested()
    });
    match (trouble, fault) {
        (Some(error), _) => Err(error),
        (None, Some(fault)) => Ok(StageEnd::Stopped { reason: format!("the audit failed: {fault}") }),
        (None, None) => Ok(end),
    }
}

/// Says where the loads of an increment have another equilibrium, and how far from this one.
fn warn_of_other_equilibrium(scene: &Scene, increment: usize) {
    if let Some(other) = other_equilibrium(scene) {
        let travel = other.poses.iter().zip(&scene.committed.poses);
        let moved = travel.map(|(a, b)| (a.position - b.position).norm()).fold(0.0, f64::max);
        tracing::warn!(increment, moved, "not unique: there is another equilibrium under these loads");
    }
}
