//! Runs that start from the specimen of another one (`"start_from"`), consolidated or as generated.

use riprap::results::Reader;

use crate::place::{Place, SPECIMEN, assert_same_bits};

/// The case of [`SPECIMEN`] without its consolidation, from a file.
fn shear_from(file: &str) -> String {
    let begins = format!(r#"{{ "start_from": "{file}","#);
    let stages = r#""stages": [{"kind": "consolidate", "pressure": "0.4 MPa"},"#;
    assert!(SPECIMEN.contains(stages));
    SPECIMEN.replacen('{', &begins, 1).replace(stages, r#""stages": ["#)
}

fn lay(place: &Place, name: &str, text: &str) {
    std::fs::write(place.path(name), text).expect("a case file");
}

/// A column of the rows of the last stage.
fn of_last_stage(reader: &Reader, name: &str) -> Vec<u64> {
    let stages = reader.history("stage").expect("stages");
    let last = stages.last().copied().expect("rows");
    let values = reader.history(name).expect("a column");
    values.iter().zip(&stages).filter(|(_, stage)| **stage == last).map(|(x, _)| x.to_bits()).collect()
}

#[test]
fn a_shear_from_a_file_has_the_bits_of_one_in_one_go() {
    let place = Place::new();
    let whole = place.reference("specimen");
    lay(&place, "shear.json", &shear_from("specimen.h5"));
    let told = place.ends_with(0, &["run", "shear.json", "--out", "shear.h5"]);
    assert!(told.contains("from the consolidated specimen in specimen.h5"), "{told}");
    let started = place.open("shear.h5");
    let mut compared = 0;
    for name in whole.members("history").expect("columns") {
        if !["stage", "increment", "time", "wall_time", "solving_time"].contains(&name.as_str()) {
            assert!(of_last_stage(&whole, &name) == of_last_stage(&started, &name), "{name} differs");
            compared += 1;
        }
    }
    assert!(compared > 40 && of_last_stage(&started, "energy_friction").len() > 10);
    // The last state, grain by grain and contact by contact; the first is the consolidated specimen.
    let last = |reader: &Reader, name: &str, first: bool| {
        let shape = reader.shape(name).expect("a shape");
        let at = if first { 0 } else { shape[0] - 1 };
        reader.floats_in(name, at, 1).expect("a state")
    };
    for name in ["grains/position", "grains/rotation", "grains/local_shear_strain"] {
        assert_eq!(last(&whole, name, false), last(&started, name, false), "{name}");
    }
    let contacts = |reader: &Reader| {
        let states = reader.shape("grains/position").expect("a shape")[0];
        reader.floats(&format!("contacts/{}/normal_force", states - 1)).expect("contacts")
    };
    assert_eq!(contacts(&whole), contacts(&started));
    assert!(!started.floats("contacts/0/normal_force").expect("contacts").is_empty());
    assert_ne!(last(&whole, "grains/position", true), last(&started, "grains/position", true));
    assert!(!started.history("stage").expect("stages").contains(&1.0));

    // A file that started so is as good a start, and it is continued without the file that it started from.
    lay(&place, "again.json", &shear_from("shear.h5"));
    let mut running = place.start(&["run", "again.json", "--out", "again.h5"]);
    assert!(running.reaches(4), "it ended before it was interrupted");
    assert_eq!(running.interrupt(), Some(130));
    std::fs::rename(place.path("shear.h5"), place.path("moved.h5")).expect("moved");
    place.ends_with(0, &["run", "again.json", "--out", "again.h5", "--resume"]);
    assert_same_bits(&place.open("moved.h5"), &place.open("again.h5"));
}

/// Nothing is generated twice: a run that starts from a specimen that another command generated has the bits of one in one go,
/// whatever was asked of that command that a specimen does not depend on.
#[test]
fn a_run_from_a_generated_specimen_has_the_bits_of_one_in_one_go() {
    let place = Place::new();
    let whole = place.reference("specimen");
    let other = "/contact/friction=0.3";
    place.ends_with(0, &["specimen", "specimen.json", "--out", "only.h5", "--set", other]);
    let from = ["run", "specimen.json", "--out", "x.h5", "--set", "/start_from=only.h5"];
    let told = place.ends_with(0, &from);
    assert!(told.contains("from the specimen, as generated, in only.h5"), "{told}");
    assert_same_bits(&whole, &place.open("x.h5"));
    let changed = ["--set", "/seed=5", "--set", "/contact/rounding=0.03", "--force"];
    let told = place.ends_with(2, &[&from[..], &changed].concat());
    assert!(told.contains("$.seed") && told.contains("$.contact.rounding"), "{told}");
}

#[test]
fn what_does_not_fit_the_file_is_named_by_its_path() {
    let place = Place::new();
    place.reference("specimen");
    lay(&place, "shear.json", &shear_from("specimen.h5"));
    let changed =
        ["/seed=5", "/contact/friction=0.4", "/specimen/void_ratio=0.8", "/solver/fidelity=condensed"];
    let mut run = vec!["run", "shear.json", "--out", "x.h5"];
    changed.iter().for_each(|change| run.extend(["--set", change]));
    let told = place.ends_with(2, &run);
    for path in ["$.seed", "$.contact.friction", "$.specimen.void_ratio", "$.solver.fidelity"] {
        assert!(told.contains(path), "{path}: {told}");
    }
    assert!(told.contains("differs from the run in specimen.h5"), "{told}");
    let told = place.ends_with(2, &["run", "shear.json", "--out", "x.h5", "--set", "/stages/0/pressure=5e5"]);
    assert!(told.contains("$.stages[0].pressure") && told.contains("400000"), "{told}");
    let told = place.ends_with(2, &["run", "shear.json", "--out", "x.h5", "--set", "/start_from=none.h5"]);
    assert!(told.contains("$.start_from") && told.contains("names no file"), "{told}");
    std::fs::write(place.path("foreign.h5"), "no HDF5").expect("a file");
    let foreign = ["run", "shear.json", "--out", "x.h5", "--set", "/start_from=foreign.h5"];
    let told = place.ends_with(4, &foreign);
    assert!(told.contains("foreign.h5") && told.contains("$.start_from names it"), "{told}");
    // Interrupted in its consolidation: nothing to start from yet.
    // It has so many increments that it cannot get through before the signal comes.
    let slow = "/stages/0/increments=400";
    let mut running = place.start(&["run", "specimen.json", "--out", "begun.h5", "--set", slow]);
    assert!(running.reaches(1), "it ended before it was interrupted");
    assert_eq!(running.interrupt(), Some(130));
    let told = place.ends_with(4, &["run", "shear.json", "--out", "x.h5", "--set", "/start_from=begun.h5"]);
    assert!(told.contains("restart/consolidated") && told.contains("consolidate"), "{told}");
    assert!(!place.path("x.h5").exists());
}
