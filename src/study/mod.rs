//! Series of runs: studies of what a result depends on, and batches of many cases.
//!
//! Every member of a series is a process of its own (`riprap run …`) with a results file of its own, so that none takes
//! another down and what is finished is never run again. [`launch`] starts them and says how each stands; [`vary`] makes the
//! members of a study and [`plan`] those of a batch; [`outcome`] sums up their files, [`order`] has the order of
//! convergence, [`table`] and [`chart`] show them, [`slurm`] hands them to a cluster as [`cluster`]
//! read from the plan.

pub mod chart;
pub mod cluster;
pub mod launch;
pub mod order;
pub mod outcome;
pub mod plan;
pub mod slurm;
pub mod table;
pub mod vary;

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::case::{RawCase, unsupported};
use crate::error::{Error, Fault};
use crate::report;
use crate::results::results_file;

/// One run of a series.
#[derive(Debug, Clone, PartialEq)]
pub struct Member {
    /// Its own in the series; also the stem of its results file.
    pub name: String,
    pub case: PathBuf,
    /// What differs from the case file: JSON pointers and values, as for `--set`.
    pub overrides: Vec<(String, Value)>,
    /// The checked case with every value in force, to recognise its results file by.
    pub completed: Value,
    pub results: PathBuf,
}

#[cfg(test)]
impl Member {
    /// One whose results file is in a folder.
    fn sample(name: &str, folder: &std::path::Path) -> Self {
        Member {
            name: name.into(),
            case: "a.json".into(),
            overrides: Vec::new(),
            completed: Value::Null,
            results: folder.join(format!("{name}.vtkhdf")),
        }
    }
}

/// Why a member cannot be run.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// Its case is at fault.
    Faulty(Vec<Fault>),
    /// It is sound and asks for what riprap cannot do yet.
    Unsupported(Vec<Fault>),
}

impl Refusal {
    pub fn faults(&self) -> &[Fault] {
        match self {
            Refusal::Faulty(faults) | Refusal::Unsupported(faults) => faults,
        }
    }
}

impl Member {
    /// A member of `source` with `overrides`, its file in `folder`.
    pub fn new(
        name: &str,
        source: &RawCase,
        overrides: Vec<(String, Value)>,
        folder: &Path,
    ) -> Result<Member, Refusal> {
        let mut raw = source.clone();
        raw.set(&overrides);
        let case = raw.check().map_err(|error| match error {
            Error::Case { faults, .. } => Refusal::Faulty(faults),
            other => Refusal::Faulty(vec![Fault::new("$", "this case", other.to_string(), "a sound case")]),
        })?;
        let faults = unsupported(&case);
        if !faults.is_empty() {
            return Err(Refusal::Unsupported(faults));
        }
        let name = safe(name);
        let results = results_file(folder, name.as_ref());
        Ok(Member { name, case: source.file.clone(), overrides, completed: case.completed(), results })
    }

    /// The arguments of the `riprap` process that runs it.
    pub fn arguments(&self, threads: usize) -> Vec<String> {
        let text = |path: &Path| path.to_string_lossy().into_owned();
        let mut arguments = vec!["run".into(), text(&self.case), "--out".into(), text(&self.results)];
        arguments.extend(["--threads".into(), threads.to_string(), "--quiet".into()]);
        for (pointer, value) in &self.overrides {
            arguments.extend(["--set".into(), format!("{pointer}={value}")]);
        }
        arguments
    }
}

/// A name that is good for a file on any system: letters and digits of any script are kept.
pub fn safe(name: &str) -> String {
    report::safe(name, "-_.=").trim_matches('.').to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_any_script_stay_apart() {
        assert_eq!(safe("试验一"), "试验一");
        assert_eq!(safe("Dichte Schüttung/0,8 MPa"), "Dichte_Schüttung_0_8_MPa");
        assert_eq!(safe("../a b=0.5"), "_a_b=0.5");
    }
}
