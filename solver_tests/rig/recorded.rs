//! Cases run as the program runs them, to their end, for the rows of their history.

use std::path::Path;

use riprap::case::read;
use riprap::results::{Existing, HistoryRow};
use riprap::simulation::{End, Observer, Options, Step, run};
use serde_json::Value;

#[derive(Default)]
struct Rows(Vec<HistoryRow>);

impl Observer for Rows {
    fn step_accepted(&mut self, step: &Step<'_>) {
        self.0.push(*step.row);
    }
}

/// Rows of a case of `cases/` with these values set, run to its end on one thread.
pub fn rows_of(case: &str, set: &[(&str, Value)]) -> Vec<HistoryRow> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases").join(case);
    let mut raw = read(&file).unwrap_or_else(|e| panic!("{e}"));
    let values = set.iter().map(|(at, to)| (at.to_string(), to.clone()));
    raw.set(&values.collect::<Vec<(String, Value)>>());
    let checked = raw.check().unwrap_or_else(|e| panic!("{e}"));
    let folder = tempfile::tempdir().expect("a folder");
    let options = Options {
        out: folder.path().join("x.h5"),
        existing: Existing::Refuse,
        threads: 1,
        profile: false,
        audit: false,
    };
    let mut rows = Rows::default();
    let outcome = run(&checked, &raw, &options, &mut rows).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(outcome.end, End::Finished, "{case} with {set:?}");
    rows.0
}
