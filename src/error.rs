//! The error type: bad input and file trouble, each naming the JSON path, file or dataset at fault.
//!
//! Non-convergence is not an error: it is a value (`solver::StepStatus`).

use std::path::{Path, PathBuf};

/// One fault of a case file.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// JSON path of the value at fault, e.g. `$.rock.youngs_modulus.mean`.
    pub path: String,
    /// The value as written, or `nothing` where it is missing.
    pub value: String,
    /// What is wrong, as a clause: "must be positive", "unknown key".
    pub problem: String,
    /// What would be accepted.
    pub accepted: String,
}

impl Fault {
    pub fn new(
        path: impl Into<String>,
        value: impl std::fmt::Display,
        problem: impl Into<String>,
        accepted: impl Into<String>,
    ) -> Self {
        Fault {
            path: path.into(),
            value: value.to_string(),
            problem: problem.into(),
            accepted: accepted.into(),
        }
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {} (found {}; accepted: {})", self.path, self.problem, self.value, self.accepted)
    }
}

#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The case file cannot be built; every fault found is listed.
    #[error("{}", list_faults(.file, .faults))]
    Case { file: PathBuf, faults: Vec<Fault> },
    /// The case file is not JSON at all.
    #[error("{}:{line}:{column}: not JSON: {message}", .file.display())]
    Json { file: PathBuf, line: usize, column: usize, message: String },
    /// A file or directory could not be read or written.
    #[error("cannot {action} {}: {source}", .path.display())]
    Io { action: &'static str, path: PathBuf, source: std::io::Error },
    /// A results file is missing something, damaged, or in use.
    #[error("{}: {}{message}", .file.display(), inside(.dataset))]
    Results { file: PathBuf, dataset: String, message: String },
    /// A case would need far more memory than there is [B].
    #[error(
        "about {:.1} GB of memory are needed and {:.1} GB are there: fewer grains or fewer cells need less",
        .needed / 1e9,
        .there / 1e9
    )]
    Memory { needed: f64, there: f64 },
    /// A mesh file or generated mesh cannot be used.
    #[error("mesh {name}: {message}")]
    Mesh { name: String, message: String },
    /// A specimen cannot be generated as asked.
    #[error("specimen: {0}")]
    Specimen(String),
    /// Arguments that clap accepts and riprap cannot use.
    #[error("{0}")]
    Usage(String),
}

impl Error {
    pub fn io(action: &'static str, path: &Path, source: std::io::Error) -> Self {
        Error::Io { action, path: path.to_path_buf(), source }
    }
}

fn list_faults(file: &Path, faults: &[Fault]) -> String {
    let mut text =
        format!("{}: {} fault{}", file.display(), faults.len(), if faults.len() == 1 { "" } else { "s" });
    for fault in faults {
        text.push_str("\n  ");
        text.push_str(&fault.to_string());
    }
    text
}

pub type Result<T, E = Error> = std::result::Result<T, E>;

/// A place in a results file before a message; nothing where it is the file as a whole.
fn inside(dataset: &str) -> String {
    if dataset == "/" { String::new() } else { format!("{dataset}: ") }
}
