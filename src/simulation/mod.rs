//! The main job, as the order of its events: a checked case becomes a specimen in its rig or a scene, then
//! stages of increments, then a finished results file.
//!
//! `setup` builds what is computed with, `triaxial` and `scene` take it from one accepted increment to the
//! next, `recording` takes those down. Here stands what comes when, and what a run that is continued or cut
//! short does instead.
//!
//! The library never prints: whoever runs a case hears of it through an [`Observer`], and every
//! accepted increment is in the file before the next one begins. SI units; the history counts
//! compression positive.

mod beginning;
mod ending;
mod observer;
mod options;
mod resume;
mod scene_run;
mod seating;
mod specimen;
mod start;
mod test_run;

pub use ending::{End, Outcome};
pub use observer::{Observer, Resumption, SpecimenReport, StageReport, Step};
pub use options::Options;
pub use seating::Seating;
pub use start::missing as missing_start;

use std::time::Instant;

use crate::case::{Case, Geometry, RawCase, unsupported};
use crate::error::{Error, Result};
use crate::recording::{Origin, Recorder};
use crate::results::{Existing, Outcome as FileOutcome};
use crate::setup::{self, largest_pressure};
use crate::solver::StopSignal;
use resume::Found;

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
    let mut options = options.aimed(case, source)?;
    let mut found = None;
    if options.existing == Existing::Continue {
        let there = resume::look(case, source, &options.out)?;
        if let Some(how) = there.resumption() {
            observer.resumed(&how);
        }
        match there {
            Found::Finished { increments } => return Ok(Outcome::finished(increments)),
            Found::NoFile => options.existing = Existing::Refuse,
            Found::NoRestart => options.existing = Existing::Replace,
            Found::Restart { .. } => found = Some(there),
        }
    }
    match &case.geometry {
        Geometry::Specimen(wanted) => test_run::run(case, wanted, source, &options, found, observer),
        Geometry::Scene(_) => scene_run::run(case, source, &options, found, observer),
    }
}

/// Checks what a case starts from (`"start_from"`), where it does.
///
/// # Errors
/// As [`run`].
pub fn check_start(case: &Case, source: &RawCase) -> Result<()> {
    start::look(case, source).map(drop)
}

/// Generates a case's specimen, with its meshes and statistics, and writes nothing else. Runs can start from
/// it (`"start_from"`).
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
    let options = options.aimed(case, source)?;
    let (specimen, meshes) = specimen::generated(case, wanted, observer)?;
    let mut recorder = Recorder::create(case, source, &options.target(), clock)?;
    specimen::write(&mut recorder, case, &specimen, &meshes)?;
    // A run can start from it.
    let origin = Origin::new(specimen, largest_pressure(case));
    recorder.save_origin(&origin)?;
    let rig = setup::rig(case, &origin.specimen, origin.membrane_pressure, StopSignal::default())?;
    specimen::begin(&mut recorder, case, &rig, &origin.specimen, &meshes)?;
    recorder.finish(FileOutcome::Finished, "specimen only")?;
    Ok(Outcome { wall_time: clock.elapsed(), ..Outcome::finished(0) })
}
