//! The main job, the whole program on one page: a checked case becomes a specimen, a rig, stages,
//! increments, and a results file.
//!
//! The library never prints: whoever runs a case hears of it through an [`Observer`], and every
//! accepted increment is in the file before the next one begins. SI units; the history counts
//! compression positive.

mod contact_table;
mod fields;
mod grain_stress;
mod observer;
mod plan;
mod profile;
mod recorder;
mod rock;
pub mod scene;
mod seating;
mod specimen_table;

pub use observer::{Observer, SpecimenReport, StageReport, Step};
pub use plan::{PlannedStage, planned_stages};
pub use profile::Profile;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::assembly::Timings;
use crate::case::{Case, Fidelity, Geometry, RawCase, SpecimenCase, unsupported};
use crate::error::{Error, Result};
use crate::mesh::{Mesh, grain_mesh};
use crate::results::{Existing, Outcome as FileOutcome};
use crate::scene::Scene;
use crate::specimen::{Phase, Specimen, generate};
use crate::triaxial::{Rig, Stage, StageEnd, Test};
use recorder::Recorder;
use seating::seat;

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
}

/// Runs a case from its specimen to its last stage. `source` is where the case came from.
///
/// # Errors
/// `Error::Case` for what riprap cannot run yet, `Error::Specimen` where the specimen cannot be
/// generated, `Error::Results` and `Error::Io` for trouble with the results file. A run that does
/// not converge is no error but an [`End`].
pub fn run(case: &Case, source: &RawCase, options: &Options, observer: &mut dyn Observer) -> Result<Outcome> {
    let faults = unsupported(case);
    if !faults.is_empty() {
        return Err(Error::Case { file: source.file.clone(), faults });
    }
    recorder::check_target(&options.out, options.existing)?;
    match &case.geometry {
        Geometry::Specimen(specimen) => triaxial_test(case, specimen, source, options, observer),
        Geometry::Scene(_) => scene_run(case, source, options, observer),
    }
}

/// Generates a case's specimen, with its meshes and statistics, and writes nothing else.
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
    recorder::check_target(&options.out, options.existing)?;
    let (specimen, meshes) = specimen_of(case, wanted, observer)?;
    let mut recorder = Recorder::create(case, source, options, clock)?;
    recorder.write_specimen(case, &specimen, &meshes)?;
    let rig = Rig::new(&specimen, &plan::rig_parameters(case), plan::settings(&case.solver))?;
    recorder.begin(case, &rig, &specimen, &meshes)?;
    recorder.finish(FileOutcome::Finished, "specimen only")?;
    let (wall_time, profile) = (clock.elapsed(), Profile::default());
    Ok(Outcome { end: End::Finished, increments: 0, wall_time, profile })
}

fn triaxial_test(
    case: &Case,
    wanted: &SpecimenCase,
    source: &RawCase,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let clock = Instant::now();
    let stages = planned_stages(case);
    let mut profile = Profile::default();
    let (specimen, meshes) = specimen_of(case, wanted, observer)?;
    profile.book_since("specimen", clock);
    let start = Instant::now();
    let mut recorder = Recorder::create(case, source, options, clock)?;
    recorder.write_specimen(case, &specimen, &meshes)?;
    profile.book_since("output", start);

    let start = Instant::now();
    let mut rig = Rig::new(&specimen, &plan::rig_parameters(case), plan::settings(&case.solver))?;
    profile.book_since("rig", start);
    let start = Instant::now();
    recorder.begin(case, &rig, &specimen, &meshes)?;
    profile.book_since("output", start);
    if case.solver.fidelity == Fidelity::Condensed {
        let start = Instant::now();
        rig.condense(rock::condensed_grains(&case.rock, &meshes, case.seed)?);
        profile.book_since("condensation", start);
    }
    drop((specimen, meshes));

    let mut test = Test::new(&rig);
    let mut end = match observer.stop_requested() {
        true => StageEnd::Interrupted,
        false => StageEnd::Finished,
    };
    let mut consolidated = true;
    for planned in &stages {
        let Some(stage) = &planned.stage else { continue };
        if end != StageEnd::Finished {
            break;
        }
        if planned.index == 0
            && let Stage::Consolidate { pressure, .. } = *stage
        {
            let start = Instant::now();
            let seating = seat(&mut test, &mut rig, pressure, &|| observer.stop_requested());
            profile.book_since("seating", start);
            observer.seated(seating.out_of_balance, seating.factorisations);
        }
        if consolidated && !matches!(stage, Stage::Consolidate { .. }) {
            // Strains count from the end of the consolidation; the energies go on.
            test.rig_height = rig.height(&rig.committed.poses);
            test.rig_volume = rig.volume(&rig.committed.poses);
            consolidated = false;
        }
        observer.stage_begun(planned);
        recorder.begin_stage(planned);
        let mut trouble = None;
        let (start, mut output) = (Instant::now(), Duration::ZERO);
        end = test.run(&mut rig, stage, &mut |rig, report| {
            let begun = Instant::now();
            let recorded = recorder.accept(planned, rig, report);
            output += begun.elapsed();
            profile.book("output", begun.elapsed());
            match recorded {
                Ok(row) => observer.step_accepted(&Step::new(planned, &stages, report.row.progress, &row)),
                Err(error) => trouble = Some(error),
            }
            trouble.is_none() && !observer.stop_requested()
        });
        profile.book(planned.kind, start.elapsed().saturating_sub(output));
        if let Some(error) = trouble {
            return Err(error);
        }
        // The observer's wish at the last increment of a stage is no interruption of that stage.
        recorder.end_stage()?;
        observer.stage_ended(&recorder.stage_report(planned, &end));
        if end == StageEnd::Finished && observer.stop_requested() && planned.index + 1 < stages.len() {
            end = StageEnd::Interrupted;
        }
    }
    let (end, outcome, reason) = ending(end);
    profile.finish(rig.contacts.timings);
    if options.profile {
        recorder.write_profile(&profile)?;
    }
    recorder.finish(outcome, &reason)?;
    Ok(Outcome { end, increments: recorder.increments(), wall_time: clock.elapsed(), profile })
}

/// Runs a scene of bodies set by hand.
fn scene_run(
    case: &Case,
    source: &RawCase,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let clock = Instant::now();
    let stages = planned_stages(case);
    let folder = source.file.parent().unwrap_or(Path::new(""));
    // What cannot be built is said before a file is made.
    Scene::new(&scene::parameters(case, folder)?)?;
    let mut writer = recorder::new_file(case, source, options)?;
    let (mut increments, mut begun) = (0, None);
    let end = scene::run(case, folder, Some(&mut writer), |_, row| {
        let Some(planned) = stages.get(row.stage) else { return true };
        if begun != Some(row.stage) {
            begun = Some(row.stage);
            observer.stage_begun(planned);
        }
        increments = row.increment as u64;
        let history = scene::history_row(row, clock.elapsed().as_secs_f64());
        observer.step_accepted(&Step::new(planned, &stages, row.progress, &history));
        !observer.stop_requested()
    })?;
    let (end, outcome, reason) = ending(end);
    let mut profile = Profile::default();
    profile.book_since("scene", clock);
    profile.finish(Timings::default());
    if options.profile {
        writer.write_table("profile", &profile.columns())?;
    }
    writer.finish(outcome, &reason, increments)?;
    Ok(Outcome { end, increments, wall_time: clock.elapsed(), profile })
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
    let meshes: Vec<Mesh> = specimen
        .grains
        .par_iter()
        .map(|grain| grain_mesh(&grain.nominal, wanted.cells_per_grain))
        .collect::<Result<_>>()?;
    observer.specimen_ready(&SpecimenReport::new(&specimen, &meshes, clock.elapsed()));
    Ok((specimen, meshes))
}
