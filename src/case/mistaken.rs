//! One kind of file in place of another: what was given, and the command that takes it.

use std::path::Path;

use serde_json::Value;

use crate::error::{Error, Result};
use crate::results::is_results;

/// The kinds of files that commands take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    Case,
    Plan,
    Results,
    /// A CSV, as of measured curves.
    Table,
}

/// Keys that tell a plan from a case.
const OF_PLANS: &[&str] = &["case", "cases"];
const OF_CASES: &[&str] = &["specimen", "scene", "rock", "stages"];

impl FileKind {
    /// What a file is by its beginning or its name; cases and plans are told by their keys.
    pub fn of_file(path: &Path) -> Option<FileKind> {
        let is_table =
            path.is_file() && path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
        match (is_results(path), is_table) {
            (true, _) => Some(FileKind::Results),
            (false, true) => Some(FileKind::Table),
            (false, false) => None,
        }
    }

    /// Whether the keys of a JSON file are those of a case or of a plan; nothing where they are of neither, or of both.
    pub fn of_keys(value: &Value) -> Option<FileKind> {
        let has = |keys: &[&str]| keys.iter().any(|key| value.get(*key).is_some());
        match (has(OF_CASES), has(OF_PLANS)) {
            (true, false) => Some(FileKind::Case),
            (false, true) => Some(FileKind::Plan),
            (true, true) | (false, false) => None,
        }
    }

    fn name(self) -> &'static str {
        match self {
            FileKind::Case => "case",
            FileKind::Plan => "plan of a batch",
            FileKind::Results => "results file",
            FileKind::Table => "table",
        }
    }

    /// The error of whoever gave a file of this kind where another one is wanted.
    pub fn in_place_of(self, wanted: FileKind, file: &Path) -> Error {
        let (own, wanted, file) = (self.name(), wanted.name(), file.display());
        let instead = match self {
            FileKind::Case => {
                format!("riprap run {file} runs it, riprap check {file} says what it would build")
            }
            FileKind::Plan => format!("riprap batch {file} runs its cases"),
            FileKind::Results => {
                format!("riprap info {file} says what is in it, riprap report {file} draws it")
            }
            FileKind::Table => format!("riprap report RESULTS.vtkhdf --lab {file} overlays its curves"),
        };
        Error::Usage(format!("{file} is a {own}, and no {wanted}: {instead}"))
    }
}

/// Refuses a file that its beginning or its name tells from what is wanted.
///
/// # Errors
/// `Error::Usage`.
pub fn refuse_file(file: &Path, wanted: FileKind) -> Result<()> {
    match FileKind::of_file(file).filter(|kind| *kind != wanted) {
        Some(kind) => Err(kind.in_place_of(wanted, file)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn keys_tell_cases_from_plans() {
        for (value, kind) in [
            (json!({"specimen": {}, "rock": {}}), Some(FileKind::Case)),
            (json!({"scene": {}}), Some(FileKind::Case)),
            (json!({"case": "a.json"}), Some(FileKind::Plan)),
            (json!({"cases": [], "grid": {}}), Some(FileKind::Plan)),
            // A case with a slip in it, and what is neither.
            (json!({"case": "a.json", "stages": []}), None),
            (json!({"title": "x"}), None),
            (json!([1]), None),
        ] {
            assert_eq!(FileKind::of_keys(&value), kind, "{value}");
        }
    }

    #[test]
    fn what_was_given_is_named_with_its_command() {
        let said = |given: FileKind, wanted: FileKind| given.in_place_of(wanted, Path::new("x")).to_string();
        assert_eq!(
            said(FileKind::Case, FileKind::Results),
            "x is a case, and no results file: riprap run x runs it, riprap check x says what it would build"
        );
        assert_eq!(
            said(FileKind::Plan, FileKind::Case),
            "x is a plan of a batch, and no case: riprap batch x runs its cases"
        );
        assert!(said(FileKind::Results, FileKind::Plan).contains("riprap info x"));
        assert!(said(FileKind::Table, FileKind::Results).contains("--lab x"));
    }
}
