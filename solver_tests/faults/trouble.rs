//! Full disks, folders that cannot be written, a second run on the same file, another case.

use riprap::results::Writer;

use crate::place::{Place, assert_same_bits};

#[test]
fn a_full_disk_ends_the_run_and_loses_nothing() {
    let place = Place::new();
    let reference = place.reference("specimen");
    place.lay_begun("specimen", "x.h5");
    let [begun, whole] = [&place.path("x.h5"), reference.path()]
        .map(|file| std::fs::metadata(file).expect("a file").len() / 512);
    let run = ["run", "specimen.json", "--out", "x.h5", "--resume", "--quiet"];
    // From hardly more than what is there to nearly enough.
    for share in [0.05, 0.5, 0.9] {
        let limit = begun + (share * (whole - begun) as f64) as u64;
        let told = place.ends_on_full_disk(4, limit, &run);
        assert!(told.contains("x.h5") && told.contains("may not grow"), "{told}");
        let left: Vec<String> = std::fs::read_dir(place.path(""))
            .expect("the folder")
            .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
            .filter(|name| name.starts_with("x.h5"))
            .collect();
        assert!(left.iter().all(|name| name == "x.h5"), "litter: {left:?}");
        assert!(place.open("x.h5").increments().expect("a file that can be read") >= 3);
    }
    place.ends_with(0, &run);
    assert_same_bits(&reference, &place.open("x.h5"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_cannot_be_written_is_said_at_once() {
    let place = Place::new();
    // Nobody can make files there, root neither.
    let told = place.ends_with(4, &["run", "specimen.json", "--out", "/proc/riprap.h5"]);
    assert!(told.contains("/proc/riprap.h5"), "{told}");
    assert!(!told.contains("grains,"), "a specimen was generated first: {told}");
}

#[test]
fn a_second_run_on_the_same_file_is_refused() {
    let place = Place::new();
    place.lay_begun("scene", "x.h5");
    let (writer, _) = Writer::resume(&place.path("x.h5")).unwrap_or_else(|e| panic!("{e}"));
    for how in ["--resume", "--force"] {
        let told = place.ends_with(4, &["run", "scene.json", "--out", "x.h5", how]);
        assert!(told.contains("in use by another process"), "{told}");
    }
    place.ends_with(2, &["run", "scene.json", "--out", "x.h5"]);
    drop(writer);
    place.ends_with(0, &["run", "scene.json", "--out", "x.h5", "--resume"]);
    assert_same_bits(&place.reference("scene"), &place.open("x.h5"));
}

#[test]
fn another_case_is_refused_with_what_differs() {
    let place = Place::new();
    place.lay_begun("specimen", "x.h5");
    let before = std::fs::read(place.path("x.h5")).expect("the file");
    let changed = ["--set", "/contact/friction=0.4", "--set", "/stages/1/axial_strain=0.002"];
    let told =
        place.ends_with(2, &[&["run", "specimen.json", "--out", "x.h5", "--resume"], &changed[..]].concat());
    for part in ["$.contact.friction", "0.4", "0.5", "$.stages[1].axial_strain", "0.002", "0.001"] {
        assert!(told.contains(part), "{part} is missing: {told}");
    }
    assert!(!told.contains("$.seed"), "{told}");
    assert!(before == std::fs::read(place.path("x.h5")).expect("the file"), "it was touched");
}

#[test]
fn a_run_is_begun_where_there_is_nothing_to_continue() {
    let place = Place::new();
    let told = place.ends_with(0, &["run", "scene.json", "--out", "x.h5", "--resume"]);
    assert!(told.contains("from the start") && told.contains("no results file yet"), "{told}");
    assert_same_bits(&place.reference("scene"), &place.open("x.h5"));
}
