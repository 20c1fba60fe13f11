//! The problems of `riprap verify` pass, and every case file in `cases/scenes/` is one of them.

use std::path::Path;

use riprap::verification::PROBLEMS;
use riprap::verification::scenes::SCENE_CASES;

#[test]
fn every_problem_passes() {
    let mut failed = vec![];
    for problem in PROBLEMS {
        let findings = problem.solve();
        assert!(!findings.is_empty(), "{} finds nothing", problem.name);
        for finding in findings {
            if !finding.passed() {
                failed.push(finding.to_string());
            }
        }
    }
    assert!(failed.is_empty(), "{} findings fail:\n{}", failed.len(), failed.join("\n"));
}

#[test]
fn names_are_unique() {
    for (k, problem) in PROBLEMS.iter().enumerate() {
        assert!(PROBLEMS[..k].iter().all(|other| other.name != problem.name), "{}", problem.name);
    }
}

#[test]
fn every_case_file_is_a_problem() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/scenes");
    let mut files: Vec<String> = std::fs::read_dir(folder)
        .expect("a folder")
        .filter_map(|entry| entry.expect("an entry").file_name().into_string().ok())
        .filter_map(|name| name.strip_suffix(".json").map(String::from))
        .collect();
    files.sort();
    let mut known: Vec<&str> = SCENE_CASES.iter().map(|case| case.name).collect();
    known.sort();
    assert_eq!(files, known);
}
