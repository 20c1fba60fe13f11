//! Looks at a results file that a run is to continue: is it this case's, and is there anything to do?

use std::path::Path;

use serde_json::Value;

use crate::case::{Case, RawCase};
use crate::error::{Error, Fault, Faults, Result};
use crate::recording::restart::fault;
use crate::results::{self, Outcome, Reader, Restart, Writer, check_unused};

use super::observer::Resumption;

/// Most differences that are listed one by one.
const MOST_LISTED: usize = 20;

/// What there is to continue.
#[derive(Debug, Clone, PartialEq)]
pub enum Found {
    /// No file: the run begins.
    NoFile,
    /// A file from before the first restart point: the run begins again.
    NoRestart,
    /// Nothing is left to do after so many increments.
    Finished { increments: u64 },
    /// The run goes on.
    Restart {
        /// Rows behind the restart point.
        dropped: usize,
        /// Where the run was begun, if not on this computer.
        host: Option<String>,
    },
}

impl Found {
    /// For the observer; what is known of [`Found::Restart`] comes later.
    pub fn resumption(&self) -> Option<Resumption> {
        match self {
            Found::NoFile => Some(Resumption::Anew { reason: "there is no results file yet" }),
            Found::NoRestart => Some(Resumption::Anew { reason: "the file holds no restart point yet" }),
            Found::Finished { increments } => Some(Resumption::Finished { increments: *increments }),
            Found::Restart { .. } => None,
        }
    }

    /// For the observer, once the restart point is read.
    pub fn continuation(&self, restart: &Restart, version: Option<String>) -> Resumption {
        let (dropped, host) = match self {
            Found::Restart { dropped, host } => (*dropped, host.clone()),
            Found::NoFile | Found::NoRestart | Found::Finished { .. } => (0, None),
        };
        let (increment, damaged) = (restart.increment, restart.damaged.clone());
        Resumption::After { increment, dropped, damaged, host, version }
    }
}

/// Looks at `out`. The file stays as it is, but for a commit that a killed process left half done.
///
/// # Errors
/// `Error::Case` with every value that differs where the file is another case's; `Error::Results` and
/// `Error::Io` where it cannot be read.
pub fn look(case: &Case, source: &RawCase, out: &Path) -> Result<Found> {
    if !out.exists() {
        return Ok(Found::NoFile);
    }
    results::put_back(out)?;
    let reader = Reader::open(out)?;
    if reader.is_live() {
        return Err(fault(out, "in use by another process (it is locked); wait for that run to end"));
    }
    let kept = kept_case(&reader, out)?;
    let faults = differences(&kept, &case.completed(), "differs from the run to continue");
    if !faults.is_empty() {
        return Err(Error::Case { file: source.file.clone(), faults });
    }
    let status = reader.status()?;
    // One that holds a specimen only is finished, too, and nothing of it has been run.
    let Some(restart) = reader.restart()? else { return Ok(Found::NoRestart) };
    match status.outcome {
        Outcome::Finished => return Ok(Found::Finished { increments: status.last_good_increment }),
        Outcome::Running | Outcome::Interrupted | Outcome::Stopped => {}
    }
    let dropped = reader.increments()?.saturating_sub(restart.rows);
    let host = Some(reader.text("case/host")?).filter(|begun_on| *begun_on != results::host());
    Ok(Found::Restart { dropped, host })
}

/// The completed case of a results file, with the defaults of keys that are newer than the file.
///
/// # Errors
/// `Error::Results` where the file has none, or none that is JSON.
pub fn kept_case(reader: &Reader, file: &Path) -> Result<Value> {
    let text = reader.text("case/completed")?;
    let kept: Value = serde_json::from_str(&text).map_err(|e| Error::Results {
        file: file.to_path_buf(),
        dataset: "case/completed".into(),
        message: format!("is not JSON: {e}"),
    })?;
    Ok(completed_anew(kept, file))
}

/// A case completed by an older version, with this one's defaults for what that did not know. What this one
/// refuses stays as it is.
fn completed_anew(mut kept: Value, file: &Path) -> Value {
    if let Some(membrane) = kept.get_mut("membrane").and_then(Value::as_object_mut) {
        // What is gone, as it was by default.
        for (key, usual) in [("thickness_law", Value::from("constant")), ("refinement", Value::from(0))] {
            if membrane.get(key) == Some(&usual) {
                membrane.remove(key);
            }
        }
    }
    let raw =
        RawCase { file: file.to_path_buf(), text: String::new(), value: kept.clone(), faults: Vec::new() };
    raw.check().map_or(kept, |case| case.completed())
}

/// Opens a file to go on after the restart point that was read from it.
///
/// # Errors
/// `Error::Results` where another process has the file, or has written to it meanwhile.
pub fn reopen(out: &Path, kept: &Restart) -> Result<Writer> {
    check_unused(out)?;
    let now = Reader::open(out)?.restart()?;
    if now.as_ref() != Some(kept) {
        return Err(fault(out, "was changed by another process meanwhile"));
    }
    Writer::resume(out).map(|(writer, _)| writer)
}

/// Where the case `now` differs from the one in the file; `problem` says so.
pub fn differences(kept: &Value, now: &Value, problem: &str) -> Vec<Fault> {
    let mut faults = Vec::new();
    compare("$", kept, now, problem, &mut faults);
    if faults.len() > MOST_LISTED {
        let more = faults.len() - MOST_LISTED;
        faults.truncate(MOST_LISTED);
        faults.fault("$", format!("{more} more"), "differ too", "the case that the run began with");
    }
    faults
}

fn compare(path: &str, kept: &Value, now: &Value, problem: &str, faults: &mut Vec<Fault>) {
    let differs = |path: String, kept: Option<&Value>, now: Option<&Value>| {
        let shown = |value: Option<&Value>| value.map_or("nothing".to_string(), Value::to_string);
        Fault::new(path, shown(now), problem, shown(kept))
    };
    match (kept, now) {
        (Value::Object(old), Value::Object(new)) => {
            for (key, value) in old {
                let path = format!("{path}.{key}");
                match new.get(key) {
                    Some(now) => compare(&path, value, now, problem, faults),
                    None => faults.push(differs(path, Some(value), None)),
                }
            }
            for (key, value) in new.iter().filter(|(key, _)| !old.contains_key(*key)) {
                faults.push(differs(format!("{path}.{key}"), None, Some(value)));
            }
        }
        (Value::Array(old), Value::Array(new)) => {
            for i in 0..old.len().max(new.len()) {
                let path = format!("{path}[{i}]");
                match (old.get(i), new.get(i)) {
                    (Some(value), Some(now)) => compare(&path, value, now, problem, faults),
                    (value, now) => faults.push(differs(path, value, now)),
                }
            }
        }
        _ if kept == now => {}
        _ => faults.push(differs(path.to_string(), Some(kept), Some(now))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn every_difference_is_named_by_its_path() {
        let kept = json!({"seed": 1, "stages": [{"pressure": 4e5}, {"kind": "shear"}], "title": "a"});
        let now = json!({"seed": 1, "stages": [{"pressure": 5e5}], "contact": {}, "title": "a"});
        let found = differences(&kept, &now, "differs");
        let paths: Vec<&str> = found.iter().map(|fault| fault.path.as_str()).collect();
        assert_eq!(paths, ["$.stages[0].pressure", "$.stages[1]", "$.contact"]);
        assert_eq!((found[0].value.as_str(), found[0].accepted.as_str()), ("500000.0", "400000.0"));
        assert!(differences(&kept, &kept, "differs").is_empty());
    }

    #[test]
    fn a_case_of_an_older_version_has_the_defaults_of_newer_keys() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/quick_start.json");
        let now = crate::case::read(&file).and_then(|raw| raw.check()).expect("a case").completed();
        let mut kept = now.clone();
        let solver = kept["solver"].as_object_mut().expect("an object");
        assert!(solver.remove("stabilisation").is_some());
        assert_eq!(differences(&kept, &now, "differs").len(), 1);
        assert_eq!(completed_anew(kept, &file), now);
        // What is no case stays.
        assert_eq!(completed_anew(json!({"seed": "x"}), &file), json!({"seed": "x"}));
    }

    #[test]
    fn a_long_list_of_differences_is_cut_and_says_so() {
        let kept = json!(vec![0; 50]);
        let found = differences(&kept, &json!(vec![1; 50]), "differs");
        assert_eq!(found.len(), MOST_LISTED + 1);
        assert!(found[MOST_LISTED].value.contains("30 more"));
    }
}
