//! The main job, the whole program on one page: a checked case becomes a specimen, a rig, stages,
//! increments, and a results file.
//!
//! The library never prints: whoever runs a case hears of it through an [`Observer`], and every
//! accepted increment is in the file before the next one begins. SI units; the history counts
//! compression positive.

mod breaking;
mod contact_table;
mod draws;
mod fields;
mod grain_stress;
mod inside;
mod kept;
mod meter;
mod observer;
mod plan;
mod profile;
mod recorder;
mod restart;
mod resume;
mod rock;
pub mod scene;
mod seating;
mod shapes;
mod specimen_table;
mod start;

pub use draws::{Drawn, expected as expected_draws};
pub use observer::{Observer, Resumption, SpecimenReport, StageReport, Step};
pub use plan::{PlannedStage, planned_stages};
pub use profile::Profile;
pub use seating::Seating;
pub use start::missing as missing_start;

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::case::{Case, Fidelity, Geometry, RawCase, SpecimenCase, unsupported};
use crate::error::{Error, Result};
use crate::mesh::{Mesh, grain_mesh};
use crate::results::{Existing, Outcome as FileOutcome, Reader};
use crate::scene::{Scene, other_equilibrium};
use crate::solver::{Dossier, audit};
use crate::specimen::{GrainShape, Phase, Specimen, generate};
use crate::triaxial::{Path as StagePath, Rig, StageCurve, StageEnd, Test};
use kept::{Origin, ScenePoint, State, TestPoint};
use recorder::Recorder;
use resume::Found;
use seating::seat;
use start::{Consolidation, Start};

/// What a run takes besides its case.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The results file to write.
    pub out: PathBuf,
    /// What to do where it exists already.
    pub existing: Existing,
    /// Threads at work, for the record.
    pub threads: usize,
    /// Whether `/profile` is written.
    pub profile: bool,
    /// Whether every accepted state is checked for overlap, apart from the contact search; a fault stops the run.
    pub audit: bool,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum End {
    /// The case's last stage is done.
    Finished,
    /// The observer asked to stop.
    Interrupted,
    /// The run could not go on.
    Stopped { reason: String },
}

/// What a run came to. The results file holds everything up to there.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    pub end: End,
    /// Accepted increments over all stages.
    pub increments: u64,
    pub wall_time: Duration,
    pub profile: Profile,
    /// What is known of the increment that stopped it, where one did.
    pub dossier: Option<Box<Dossier>>,
}

/// Runs a case from its specimen to its last stage, or from the last restart point of its results file where
/// the options say so: to the same bits. `source` is where the case came from.
///
/// # Errors
/// `Error::Case` for what riprap cannot run yet and for a results file of another case, `Error::Specimen`
/// where the specimen cannot be generated, `Error::Results` and `Error::Io` for trouble with the results
/// file. A run that does not converge is no error but an [`End`].
pub fn run(case: &Case, source: &RawCase, options: &Options, observer: &mut dyn Observer) -> Result<Outcome> {
    let faults = unsupported(case);
    if !faults.is_empty() {
        return Err(Error::Case { file: source.file.clone(), faults });
    }
    let mut options = aimed(case, source, options)?;
    let mut found = None;
    if options.existing == Existing::Continue {
        let there = resume::look(case, source, &options.out)?;
        if let Some(how) = there.resumption() {
            observer.resumed(&how);
        }
        match there {
            Found::Finished { increments } => {
                return Ok(Outcome {
                    end: End::Finished,
                    increments,
                    wall_time: Duration::ZERO,
                    profile: Profile::default(),
                    dossier: None,
                });
            }
            Found::NoFile => options.existing = Existing::Refuse,
            Found::NoRestart => options.existing = Existing::Replace,
            Found::Restart { .. } => found = Some(there),
        }
    }
    match &case.geometry {
        Geometry::Specimen(specimen) => triaxial_test(case, specimen, source, &options, found, observer),
        Geometry::Scene(_) => scene_run(case, source, &options, found, observer),
    }
}

/// Checks what a case starts from (`"start_from"`), where it does.
///
/// # Errors
/// As [`run`].
pub fn check_start(case: &Case, source: &RawCase) -> Result<()> {
    start::look(case, source).map(drop)
}

/// The options with links to the results file followed, where that can be written and is nothing that the run reads.
fn aimed(case: &Case, source: &RawCase, options: &Options) -> Result<Options> {
    let options = Options { out: recorder::followed(&options.out), ..options.clone() };
    let start = start::file_of(case, source);
    let folder = source.file.parent().unwrap_or(Path::new(""));
    let files = case.files().into_iter().map(|name| folder.join(name));
    let inputs: Vec<PathBuf> = std::iter::once(source.file.clone()).chain(start).chain(files).collect();
    recorder::check_target(&options.out, options.existing, &inputs)?;
    Ok(options)
}

/// Generates a case's specimen, with its meshes and statistics, and writes nothing else. Runs can start from it (`"start_from"`).
///
/// # Errors
/// As [`run`]; `Error::Usage` for a scene.
pub fn generate_specimen(
    case: &Case,
    source: &RawCase,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let Geometry::Specimen(wanted) = &case.geometry else {
        return Err(Error::Usage("this case is a scene: it has bodies set by hand and no specimen".into()));
    };
    let clock = Instant::now();
    let options = aimed(case, source, options)?;
    let (specimen, meshes) = specimen_of(case, wanted, observer)?;
    let mut recorder = Recorder::create(case, source, &options, clock)?;
    recorder.write_specimen(case, &specimen, &meshes)?;
    // A run can start from it.
    let membrane_pressure = plan::largest_pressure(case);
    let origin = Origin { specimen: Cow::Owned(specimen), membrane_pressure };
    recorder.save_origin(&origin)?;
    let parameters = plan::rig_parameters(case, membrane_pressure)?;
    let rig = Rig::new(&origin.specimen, &parameters, plan::settings(case))?;
    recorder.begin(case, &rig, &origin.specimen, &meshes)?;
    recorder.finish(FileOutcome::Finished, "specimen only")?;
    let (wall_time, profile) = (clock.elapsed(), Profile::default());
    Ok(Outcome { end: End::Finished, increments: 0, wall_time, profile, dossier: None })
}

fn triaxial_test(
    case: &Case,
    wanted: &SpecimenCase,
    source: &RawCase,
    options: &Options,
    found: Option<Found>,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let clock = Instant::now();
    let stages = planned_stages(case);
    let mut profile = Profile::default();
    let (mut recorder, mut rig, mut test) = match found {
        Some(found) => continued_test(case, wanted, options, &found, clock, observer)?,
        None => match start::look(case, source)? {
            Some(Start::Consolidated(start)) => {
                started_test(case, wanted, source, options, *start, clock, observer)?
            }
            Some(Start::Generated { specimen, how }) => {
                observer.resumed(&how);
                let (specimen, meshes) = meshed(case, wanted, *specimen, clock, observer)?;
                begun_test(case, source, options, (specimen, meshes), clock, observer, &mut profile)?
            }
            None => {
                let generated = specimen_of(case, wanted, observer)?;
                begun_test(case, source, options, generated, clock, observer, &mut profile)?
            }
        },
    };
    test.energy_gate = plan::energy_gate(&case.solver);
    let mut end = match observer.stop_requested() {
        true => StageEnd::Interrupted,
        false => StageEnd::Finished,
    };
    if !recorder.at.seated && end == StageEnd::Finished {
        let path = stages.first().and_then(|planned| planned.stage).map(|stage| stage.path);
        if let Some(StagePath::Stress { axial, radial }) = path {
            let pressure = axial.min(radial);
            let start = Instant::now();
            match test.lay_membrane(&mut rig, pressure) {
                Ok(()) => {
                    let seating = seat(&mut test, &mut rig, pressure, &|| observer.stop_requested());
                    profile.book_since("seating", start);
                    observer.seated(&seating);
                    if let Some(reason) = seating.fault().filter(|_| !observer.stop_requested()) {
                        end = StageEnd::Stopped { reason };
                    }
                }
                // It was broken off.
                Err(_) if observer.stop_requested() => end = StageEnd::Interrupted,
                Err(reason) => end = StageEnd::Stopped { reason },
            }
        }
        if end != StageEnd::Finished {
            // The membrane gave way, or the grains did: nothing was seated.
        } else if observer.stop_requested() {
            // The seating may have been cut short: a continued run seats anew.
            end = StageEnd::Interrupted;
        } else {
            recorder.at.seated = true;
            recorder.hold(&test, &rig)?;
            recorder.keep()?;
        }
    }
    let reached = recorder.at.stage;
    for planned in stages.iter().filter(|planned| planned.index >= reached) {
        let Some(stage) = &planned.stage else { continue };
        if end != StageEnd::Finished {
            break;
        }
        if !recorder.at.strains_restarted && !planned.consolidates() {
            // Strains count from the end of the consolidation; the energies go on.
            test.zero_strains(&rig);
            recorder.at.strains_restarted = true;
        }
        observer.stage_begun(planned);
        if !test.is_under_way() {
            recorder.begin_stage(planned, Some(&test.measures(&rig)));
        }
        let (mut trouble, mut fault) = (None, None);
        let (start, mut output) = (Instant::now(), Duration::ZERO);
        recorder.begin_solving();
        end = test.run(&mut rig, stage, &mut |rig, report| {
            let begun = Instant::now();
            let recorded = recorder.accept(planned, rig, report);
            output += begun.elapsed();
            profile.book("output", begun.elapsed());
            match recorded {
                Ok(row) => observer.step_accepted(&Step::new(planned, &stages, report.row.progress, &row)),
                Err(error) => trouble = Some(error),
            }
            if options.audit {
                fault = audit::fault(&rig.model, &rig.contacts, &rig.committed.poses);
            }
            recorder.begin_solving();
            trouble.is_none() && fault.is_none() && !observer.stop_requested()
        });
        if let Some(fault) = fault {
            rig.dossier = None;
            end = StageEnd::Stopped { reason: format!("the audit failed: {fault}") };
        }
        profile.book(planned.kind, start.elapsed().saturating_sub(output));
        if let Some(error) = trouble {
            return Err(error);
        }
        recorder.end_stage(&rig.model, &rig.committed.poses, || inside::of_rig(&rig))?;
        recorder.sum_up(planned)?;
        let next = stages.get(planned.index + 1);
        if end == StageEnd::Finished
            && !recorder.at.strains_restarted
            && next.is_none_or(|next| !next.consolidates())
        {
            recorder.keep_consolidated(&test, &rig)?;
        }
        observer.stage_ended(&recorder.stage_report(planned, &end));
        if end == StageEnd::Finished && observer.stop_requested() && planned.index + 1 < stages.len() {
            end = StageEnd::Interrupted;
        }
    }
    if !matches!(end, StageEnd::Interrupted) {
        recorder.write_breakage(&rig)?;
        recorder.write_pieces(&rig.model)?;
    }
    let (end, outcome, reason) = ending(explained(end, case, rig.dossier.as_ref()));
    let dossier = rig.dossier.take().filter(|_| matches!(end, End::Stopped { .. })).map(Box::new);
    profile.finish(rig.contacts.timings);
    // A continued run would have to add to what it finds: it is told, not kept.
    if options.profile && options.existing != Existing::Continue {
        recorder.write_profile(&profile)?;
    }
    if let Some(dossier) = &dossier {
        recorder.write_dossier(dossier)?;
    }
    recorder.finish(outcome, &reason)?;
    Ok(Outcome { end, increments: recorder.increments(), wall_time: recorder.wall_time(), profile, dossier })
}

/// A stop told with its cause first, where that is known: what the solver saw, or a pressure that uses up the roundings.
fn explained(end: StageEnd, case: &Case, dossier: Option<&Dossier>) -> StageEnd {
    let StageEnd::Stopped { reason } = end else { return end };
    let seen = dossier.and_then(|dossier| dossier.cause.clone());
    let causes = case.squeeze().map(|squeeze| squeeze.to_string()).into_iter().chain(seen);
    StageEnd::Stopped { reason: causes.chain([reason]).collect::<Vec<_>>().join("; ") }
}

/// A new test: its specimen, its rig, and a results file with a first restart point.
fn begun_test(
    case: &Case,
    source: &RawCase,
    options: &Options,
    (specimen, meshes): (Specimen, Vec<Mesh>),
    clock: Instant,
    observer: &mut dyn Observer,
    profile: &mut Profile,
) -> Result<(Recorder, Rig, Test)> {
    profile.book_since("specimen", clock);
    let start = Instant::now();
    let mut recorder = Recorder::create(case, source, options, clock)?;
    recorder.write_specimen(case, &specimen, &meshes)?;
    let origin = Origin { specimen: Cow::Owned(specimen), membrane_pressure: plan::largest_pressure(case) };
    recorder.save_origin(&origin)?;
    profile.book_since("output", start);
    let start = Instant::now();
    let mut rig = rig_of(case, &origin, observer)?;
    let specimen = &origin.specimen;
    profile.book_since("rig", start);
    let start = Instant::now();
    condense(case, &mut rig, &meshes)?;
    profile.book_since("condensation", start);
    let start = Instant::now();
    recorder.begin(case, &rig, specimen, &meshes)?;
    profile.book_since("output", start);
    let test = Test::new(&rig);
    recorder.hold(&test, &rig)?;
    recorder.keep()?;
    Ok((recorder, rig, test))
}

/// A new test on the consolidated specimen of another file.
fn started_test(
    case: &Case,
    wanted: &SpecimenCase,
    source: &RawCase,
    options: &Options,
    start: Consolidation,
    clock: Instant,
    observer: &mut dyn Observer,
) -> Result<(Recorder, Rig, Test)> {
    let Consolidation { origin, state, how } = start;
    observer.resumed(&how);
    let specimen = &origin.specimen;
    let meshes = meshes_of(wanted, specimen)?;
    let first = rig_of(case, &origin, observer)?;
    let mut rig = first.clone();
    condense(case, &mut rig, &meshes)?;
    if !rig.restore(state.rig)? {
        return Err(restart::fault(&options.out, "cannot start from the state of another specimen"));
    }
    let test = state.test.into_owned();
    let mut recorder = Recorder::create(case, source, options, clock)?;
    recorder.write_specimen(case, specimen, &meshes)?;
    recorder.save_origin(&origin)?;
    let state = (State::of(&rig, specimen.grains.len()), &inside::of_rig(&rig)[..]);
    recorder.begin_with(state, case, &first, specimen, &meshes)?;
    recorder.start_from(&test);
    recorder.at.seated = true;
    if planned_stages(case).first().is_none_or(|planned| !planned.consolidates()) {
        recorder.keep_consolidated(&test, &rig)?;
    }
    recorder.hold(&test, &rig)?;
    recorder.keep()?;
    Ok((recorder, rig, test))
}

/// A test as its results file has it at the last restart point.
fn continued_test(
    case: &Case,
    wanted: &SpecimenCase,
    options: &Options,
    found: &Found,
    clock: Instant,
    observer: &mut dyn Observer,
) -> Result<(Recorder, Rig, Test)> {
    let out = &options.out;
    let reader = Reader::open(out)?;
    let origin = reader.origin()?.ok_or_else(|| restart::fault(out, "holds no specimen to go on with"))?;
    let kept = reader.restart()?.ok_or_else(|| restart::fault(out, "holds no restart point"))?;
    drop(reader);
    let (origin, _) = restart::decode::<Origin<'_>>(&origin, out)?;
    let specimen = &origin.specimen;
    let (point, version) = restart::decode::<TestPoint<'_>>(&kept.bytes, out)?;
    let meshes = meshes_of(wanted, specimen)?;
    let first = rig_of(case, &origin, observer)?;
    let mut rig = first.clone();
    condense(case, &mut rig, &meshes)?;
    if !rig.restore(point.rig)? {
        return Err(restart::fault(out, "belongs to another specimen"));
    }
    // The file drops what is behind its restart point only once that is known to be of use.
    let mut writer = resume::reopen(out, &kept)?;
    writer.drop_summaries(point.at.stage)?;
    let mut recorder = Recorder::over(writer, case, clock);
    observer.resumed(&found.continuation(&kept, version));
    recorder.begin(case, &first, specimen, &meshes)?;
    let unsaved = point.unsaved.map(Cow::into_owned);
    recorder.restore(point.sums, point.curve.into_owned(), kept.states, unsaved);
    recorder.at = point.at;
    Ok((recorder, rig, point.test.into_owned()))
}

fn rig_of(case: &Case, origin: &Origin<'_>, observer: &dyn Observer) -> Result<Rig> {
    let mut settings = plan::settings(case);
    settings.stop = observer.stop_signal();
    Rig::new(&origin.specimen, &plan::rig_parameters(case, origin.membrane_pressure)?, settings)
}

fn condense(case: &Case, rig: &mut Rig, meshes: &[Mesh]) -> Result<()> {
    match case.fidelity_of_grains() {
        Fidelity::Rigid if case.rock.damage.is_some() => {
            rig.let_break(rock::condensed_grains(&case.rock, meshes, (case.seed, case.contact.normal))?);
        }
        Fidelity::Rigid => {}
        Fidelity::Auto => {
            rig.condense(rock::condensed_grains(&case.rock, meshes, (case.seed, case.contact.normal))?);
            rig.rest_all();
        }
        Fidelity::Condensed => {
            rig.condense(rock::condensed_grains(&case.rock, meshes, (case.seed, case.contact.normal))?)
        }
        Fidelity::Full => {
            rig.resolve(rock::full_grains(&case.rock, meshes, case.seed, case.solver.nodes())?);
        }
    }
    Ok(())
}

/// Runs a scene of bodies set by hand.
fn scene_run(
    case: &Case,
    source: &RawCase,
    options: &Options,
    found: Option<Found>,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let clock = Instant::now();
    let stages = planned_stages(case);
    let folder = source.file.parent().unwrap_or(Path::new(""));
    // What cannot be built is said before a file is made.
    let mut parameters = scene::parameters(case, folder)?;
    parameters.settings.stop = observer.stop_signal();
    let mut scene = Scene::new(&parameters)?;
    let mut recorder = match found {
        Some(found) => {
            let out = &options.out;
            let kept = Reader::open(out)?.restart()?;
            let kept = kept.ok_or_else(|| restart::fault(out, "holds no restart point"))?;
            let (point, version) = restart::decode::<ScenePoint<'_>>(&kept.bytes, out)?;
            // Before it moves: its first configuration is the reference of what the file shows.
            let first = scene.clone();
            if !scene.restore(point.scene)? {
                return Err(restart::fault(
                    out,
                    "belongs to a scene of other bodies; has a mesh file changed?",
                ));
            }
            let mut writer = resume::reopen(out, &kept)?;
            writer.drop_summaries(point.at.stage)?;
            let mut recorder = Recorder::over(writer, case, clock);
            observer.resumed(&found.continuation(&kept, version));
            recorder.begin_scene(case, &first, &parameters, folder)?;
            let unsaved = point.unsaved.map(Cow::into_owned);
            recorder.restore(point.sums, StageCurve::default(), kept.states, unsaved);
            recorder.at = point.at;
            recorder
        }
        None => {
            let mut recorder = Recorder::create(case, source, options, clock)?;
            let drawn = draws::of_scene(case, &parameters)?;
            observer.rock_drawn(&drawn);
            recorder.write_rock(&drawn)?;
            recorder.begin_scene(case, &scene, &parameters, folder)?;
            recorder.hold_scene(&scene)?;
            recorder.keep()?;
            recorder
        }
    };
    let (mut trouble, mut begun, mut fault) = (None, None, None);
    let mut end = StageEnd::Interrupted;
    if !observer.stop_requested() {
        recorder.begin_solving();
        end = scene.run(|scene, row| {
            let Some(planned) = stages.get(row.stage) else { return true };
            if begun != Some(row.stage) {
                begun = Some(row.stage);
                observer.stage_begun(planned);
            }
            match recorder.accept_scene(planned, &parameters, scene, row) {
                Ok(row_of_file) => {
                    observer.step_accepted(&Step::new(planned, &stages, row.progress, &row_of_file));
                }
                Err(error) => trouble = Some(error),
            }
            if options.audit {
                fault = audit::fault(&scene.model, &scene.contacts, &scene.committed.poses);
                if let Some(other) = other_equilibrium(scene) {
                    let increment = row.increment;
                    let travel = other.poses.iter().zip(&scene.committed.poses);
                    let moved = travel.map(|(a, b)| (a.position - b.position).norm()).fold(0.0, f64::max);
                    tracing::warn!(
                        increment,
                        moved,
                        "not unique: there is another equilibrium under these loads"
                    );
                }
            }
            recorder.begin_solving();
            trouble.is_none() && fault.is_none() && !observer.stop_requested()
        });
    }
    if let Some(fault) = fault {
        end = StageEnd::Stopped { reason: format!("the audit failed: {fault}") };
    }
    if let Some(error) = trouble {
        return Err(error);
    }
    recorder.end_stage(&scene.model, &scene.committed.poses, || {
        inside::of_committed(&scene.model, &scene.contacts, &scene.committed, scene.loads())
    })?;
    if !matches!(end, StageEnd::Interrupted) {
        recorder.write_pieces(&scene.model)?;
    }
    let (end, outcome, reason) = ending(explained(end, case, scene.dossier.as_ref()));
    let mut profile = Profile::default();
    profile.book_since("scene", clock);
    profile.finish(scene.contacts.timings);
    if options.profile && options.existing != Existing::Continue {
        recorder.write_profile(&profile)?;
    }
    let dossier = scene.dossier.take().filter(|_| matches!(end, End::Stopped { .. })).map(Box::new);
    if let Some(dossier) = &dossier {
        recorder.write_dossier(dossier)?;
    }
    recorder.finish(outcome, &reason)?;
    Ok(Outcome { end, increments: recorder.increments(), wall_time: recorder.wall_time(), profile, dossier })
}

/// How a run ended, for the caller and for the file.
fn ending(end: StageEnd) -> (End, FileOutcome, String) {
    match end {
        StageEnd::Finished => (End::Finished, FileOutcome::Finished, String::new()),
        StageEnd::Interrupted => {
            (End::Interrupted, FileOutcome::Interrupted, "interrupted by the user".into())
        }
        StageEnd::Stopped { reason } => {
            (End::Stopped { reason: reason.clone() }, FileOutcome::Stopped, reason)
        }
    }
}

/// The specimen and a mesh of each of its grains.
fn specimen_of(
    case: &Case,
    wanted: &SpecimenCase,
    observer: &mut dyn Observer,
) -> Result<(Specimen, Vec<Mesh>)> {
    let clock = Instant::now();
    let parameters = wanted.parameters(case.seed, case.contact.rounding);
    let progress = &mut |phase: Phase, share: f64| observer.specimen_progress(phase, share);
    let specimen = generate(&parameters, progress)?;
    meshed(case, wanted, specimen, clock, observer)
}

/// A specimen, told of, and a mesh of each of its grains.
fn meshed(
    case: &Case,
    wanted: &SpecimenCase,
    specimen: Specimen,
    clock: Instant,
    observer: &mut dyn Observer,
) -> Result<(Specimen, Vec<Mesh>)> {
    let meshes = meshes_of(wanted, &specimen)?;
    observer.specimen_ready(&SpecimenReport::new(&specimen, wanted.void_ratio, &meshes, clock.elapsed()));
    observer.rock_drawn(&draws::of_specimen(case, &meshes)?);
    Ok((specimen, meshes))
}

fn meshes_of(wanted: &SpecimenCase, specimen: &Specimen) -> Result<Vec<Mesh>> {
    let mesh = |grain: &GrainShape| grain_mesh(&grain.nominal, wanted.cells_per_grain);
    specimen.grains.par_iter().map(mesh).collect()
}
