//! The error type: bad input and file trouble, each naming the JSON path, file or dataset at fault.
//!
//! Non-convergence is not an error: it is a value (`solver::StepStatus`).

use std::borrow::Cow;
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

/// What faults are noted in.
pub trait Faults {
    fn note(&mut self, fault: Fault);

    fn fault(
        &mut self,
        path: impl Into<String>,
        value: impl std::fmt::Display,
        problem: impl Into<String>,
        accepted: impl Into<String>,
    ) {
        self.note(Fault::new(path, value, problem, accepted));
    }
}

impl Faults for Vec<Fault> {
    fn note(&mut self, fault: Fault) {
        self.push(fault);
    }
}

/// On one line, whatever the parts have in them: all of them may repeat a stranger's text.
impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [path, problem, value, accepted] =
            [&self.path, &self.problem, &self.value, &self.accepted].map(|part| on_one_line(part));
        write!(f, "{path}: {problem} (found {value}; accepted: {accepted})")
    }
}

/// Characters that a terminal obeys in place of showing them, and those that turn the direction of writing.
pub fn is_obeyed(c: char) -> bool {
    c.is_control() || matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// A text with characters that a terminal obeys shown by their numbers, as JSON writes them, and cut where it is endless.
fn on_one_line(text: &str) -> Cow<'_, str> {
    const LONGEST: usize = 1000;
    if text.len() <= LONGEST && !text.contains(is_obeyed) {
        return text.into();
    }
    let shown = |c: char| if is_obeyed(c) { by_number(c) } else { c.to_string() };
    let cut = if text.chars().nth(LONGEST).is_some() { "…" } else { "" };
    text.chars().take(LONGEST).map(shown).chain([cut.to_string()]).collect::<String>().into()
}

/// A character as JSON escapes it.
pub fn by_number(c: char) -> String {
    format!("\\u{:04x}", u32::from(c))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_one_plain_line() {
        let hostile = format!("$[\"a\u{1b}[2J\n  $.rock: sound\u{202e}\"]{}", "x".repeat(100_000));
        let said = Fault::new(&hostile, &hostile, &hostile, &hostile).to_string();
        assert!(!said.contains(is_obeyed) && said.chars().count() < 5000, "{said}");
        assert!(said.starts_with("$[\"a\\u001b[2J\\u000a  $.rock: sound\\u202e\"]xxx"), "{said}");
        let plain = Fault::new("$.rock", "\"é 试验\"", "is odd", "a text").to_string();
        assert_eq!(plain, "$.rock: is odd (found \"é 试验\"; accepted: a text)");
    }
}
