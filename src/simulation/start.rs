//! Starts a run from the consolidated specimen in another results file (`"start_from"`): its specimen,
//! committed state, contact search and ledger, so that several shears go on from one consolidation. Where the
//! file has none, and the case consolidates, the run starts from the specimen as it was generated, which
//! takes minutes where there are thousands of grains.
//!
//! The stages that follow come to the same bits as in a run that did all by itself. What the
//! state depends on must be the same in both cases; tolerances, stages and output may differ.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use crate::case::{Case, RawCase, StageCase};
use crate::error::{Error, Fault, Faults, Result};
use crate::recording::{Consolidated, Origin, restart};
use crate::results::{self, Reader};
use crate::specimen::Specimen;

use super::observer::Resumption;
use super::resume::{differences, kept_case};

/// Keys of a case on which a consolidated specimen depends.
const BINDING: [&str; 6] = ["seed", "specimen", "rock", "contact", "plates", "membrane"];

/// Keys and one nested value on which a generated specimen depends.
const GENERATING: [&str; 2] = ["seed", "specimen"];

/// What a run starts from.
pub enum Start {
    Consolidated(Box<Consolidation>),
    /// A specimen that nothing has been done to.
    Generated {
        specimen: Box<Specimen>,
        how: Resumption,
    },
}

/// A consolidated specimen and where it is from.
pub struct Consolidation {
    pub origin: Origin<'static>,
    pub state: Consolidated<'static>,
    pub how: Resumption,
}

/// The file that a case starts from.
pub fn file_of(case: &Case, source: &RawCase) -> Option<PathBuf> {
    case.start_from.as_ref().map(|name| beside(source, name))
}

fn beside(source: &RawCase, name: &str) -> PathBuf {
    source.file.parent().unwrap_or(Path::new("")).join(name)
}

/// The fault of a case, sound or not, that names a file to start from where there is none.
pub fn missing(source: &RawCase) -> Option<Fault> {
    let name = source.value["start_from"].as_str().filter(|name| !beside(source, name).is_file())?;
    let problem = "names no file";
    let accepted = "a results file, relative to the case file, of a run that has consolidated its specimen";
    Some(Fault::new("$.start_from", format!("\"{name}\""), problem, accepted))
}

/// Reads the start of a case; `None` where it has none.
///
/// # Errors
/// `Error::Case` with every value in which the case differs from that of the file and matters, or where the
/// file is missing; `Error::Results` and `Error::Io` where it cannot be read or holds no consolidated
/// specimen.
pub fn look(case: &Case, source: &RawCase) -> Result<Option<Start>> {
    let Some(name) = &case.start_from else { return Ok(None) };
    read(case, source, name).map(Some).map_err(|error| match error {
        Error::Results { file, dataset, message } => {
            Error::Results { file, dataset, message: format!("{message} ($.start_from names it)") }
        }
        other => other,
    })
}

/// Reads what the file `name` holds.
fn read(case: &Case, source: &RawCase, name: &str) -> Result<Start> {
    let refused = |faults: Vec<Fault>| Err(Error::Case { file: source.file.clone(), faults });
    if let Some(fault) = missing(source) {
        return refused(vec![fault]);
    }
    let file = beside(source, name);
    let reader = Reader::open(&file)?;
    let kept = kept_case(&reader, &file)?;
    let state = reader.consolidated()?;
    let consolidates = matches!(case.stages.first(), Some(StageCase::Consolidate { .. }));
    let consolidated = state.is_some() || !consolidates;
    let part: fn(&Value) -> Value = if consolidated { binding } else { generating };
    let problem = format!("differs from the run in {name}");
    let faults = differences(&part(&kept), &part(&case.completed()), &problem);
    if !faults.is_empty() {
        return refused(faults);
    }
    let lacks = |what: &str, why: &str| Error::Results {
        file: file.clone(),
        dataset: what.into(),
        message: format!("is not there: {why}"),
    };
    let unfinished = "the run has not come to the end of its first consolidate stages";
    let host = Some(reader.text("case/host")?).filter(|begun_on| *begun_on != results::host());
    let told = |version| Resumption::Started { file: PathBuf::from(name), consolidated, host, version };
    let origin = reader.origin()?.ok_or_else(|| lacks("restart/origin", "the file holds no specimen"))?;
    let (origin, version) = restart::decode::<Origin<'_>>(&origin, &file)?;
    if !consolidated {
        let specimen = Box::new(origin.specimen.into_owned());
        return Ok(Start::Generated { specimen, how: told(version) });
    }
    let state = state.ok_or_else(|| lacks("restart/consolidated", unfinished))?;
    let (state, version) = restart::decode::<Consolidated<'_>>(&state, &file)?;
    let faults = wrong_pressures(case, state.rig.pressure());
    if !faults.is_empty() {
        return refused(faults);
    }
    let how = told(version);
    Ok(Start::Consolidated(Box::new(Consolidation { origin, state, how })))
}

/// The part of a completed case on which a generated specimen depends.
fn generating(completed: &Value) -> Value {
    let kept = |key: &&str| completed.get(*key).map(|value| (key.to_string(), value.clone()));
    let mut keys: Map<String, Value> = GENERATING.iter().filter_map(kept).collect();
    keys.insert("contact".into(), serde_json::json!({ "rounding": completed["contact"]["rounding"] }));
    Value::Object(keys)
}

/// The part of a completed case on which a consolidated specimen depends.
fn binding(completed: &Value) -> Value {
    let kept = |key: &&str| completed.get(*key).map(|value| (key.to_string(), value.clone()));
    let mut keys: Map<String, Value> = BINDING.iter().filter_map(kept).collect();
    if let Some(fidelity) = completed["solver"].get("fidelity") {
        let accuracy = completed["solver"].get("accuracy");
        keys.insert("solver".into(), serde_json::json!({ "fidelity": fidelity, "accuracy": accuracy }));
    }
    Value::Object(keys)
}

/// Pressures that stages before any consolidation say they hold, where it is not the one that the file holds
/// [Pa].
fn wrong_pressures(case: &Case, held: f64) -> Vec<Fault> {
    let mut faults = Vec::new();
    for (i, stage) in case.stages.iter().enumerate() {
        if matches!(stage, StageCase::Consolidate { .. }) {
            break;
        }
        if let Some(pressure) = stage.pressure().filter(|pressure| (pressure / held - 1.0).abs() > 1e-9) {
            let problem = format!("is not the pressure {held} Pa that the specimen was consolidated under");
            let accepted = "that pressure, no pressure, or a consolidate stage to the new one before";
            faults.fault(format!("$.stages[{i}].pressure"), pressure, problem, accepted);
        }
    }
    faults
}
