//! Results files that were damaged.

use crate::place::{Place, assert_same_bits};

/// Where the riprap version stands at the head of a restart point of this format: format, length, version.
fn restart_points(bytes: &[u8], format: u8) -> Vec<usize> {
    let version = env!("CARGO_PKG_VERSION");
    let head = [&[format, version.len() as u8], version.as_bytes()].concat();
    (0..bytes.len() - head.len()).filter(|&at| bytes[at..].starts_with(&head)).collect()
}

/// An interrupted run in `x.h5` with two restart points, and where the older and the newer one lie.
fn interrupted(place: &Place) -> (Vec<u8>, [usize; 2]) {
    place.lay_begun("specimen", "x.h5");
    let mut running = place.start(&["run", "specimen.json", "--out", "x.h5", "--resume"]);
    assert!(running.reaches(20), "it ended before it was interrupted");
    assert_eq!(running.interrupt(), Some(130));
    let bytes = std::fs::read(place.path("x.h5")).expect("the file");
    let newest = place.open("x.h5").restart().expect("readable").expect("a restart point").bytes;
    let head = &newest[..newest.len().min(4096)];
    let consolidated = place.open("x.h5").consolidated().expect("readable").unwrap_or_default();
    // The specimen, which begins like them, is compressed; the state after the consolidation may not be.
    let mut slots = restart_points(&bytes, newest[0]);
    slots.retain(|&at| consolidated.is_empty() || !bytes[at..].starts_with(&consolidated));
    let newer = *slots.iter().find(|&&at| bytes[at..].starts_with(head)).expect("the newer one");
    let older = *slots.iter().find(|&&at| at != newer).expect("the older one");
    (bytes, [older, newer])
}

#[test]
fn a_damaged_restart_point_falls_back_to_the_older_one() {
    let place = Place::new();
    let reference = place.reference("specimen");
    let (mut bytes, [older, newer]) = interrupted(&place);
    bytes[newer + 600] ^= 0x10;
    std::fs::write(place.path("x.h5"), &bytes).expect("written");
    let last = place.open("x.h5").increments().expect("rows");
    let told = place.ends_with(0, &["run", "specimen.json", "--out", "x.h5", "--resume"]);
    assert!(told.contains("checksum is wrong") && told.contains("older restart point"), "{told}");
    assert!(!told.contains(&format!("after increment {last}")), "{told}");
    assert_same_bits(&reference, &place.open("x.h5"));

    // Both: nothing can go on, and nothing is lost.
    bytes[older + 600] ^= 0x10;
    std::fs::write(place.path("x.h5"), &bytes).expect("written");
    let told = place.ends_with(4, &["run", "specimen.json", "--out", "x.h5", "--resume"]);
    assert!(told.contains("x.h5") && told.contains("no restart point is whole"), "{told}");
    assert!(bytes == std::fs::read(place.path("x.h5")).expect("the file"), "it was touched");
    assert_eq!(place.open("x.h5").increments().expect("rows"), last);
}

#[test]
fn a_damaged_results_file_is_an_error_and_left_alone() {
    let place = Place::new();
    let (bytes, _) = interrupted(&place);
    let half = bytes[..bytes.len() / 2].to_vec();
    let mut headless = bytes.clone();
    headless[..64].fill(0xa5);
    for damaged in [half, headless, b"no results".to_vec(), Vec::new()] {
        std::fs::write(place.path("x.h5"), &damaged).expect("written");
        let told = place.ends_with(4, &["run", "specimen.json", "--out", "x.h5", "--resume"]);
        assert!(told.contains("x.h5"), "{told}");
        assert!(damaged == std::fs::read(place.path("x.h5")).expect("the file"), "it was touched");
    }
    // Anywhere inside: an error or the same bits, never a crash.
    let reference = place.reference("specimen");
    for at in (1..6).map(|part| part * bytes.len() / 6) {
        let mut damaged = bytes.clone();
        damaged[at..at + 32].fill(0xff);
        std::fs::write(place.path("x.h5"), &damaged).expect("written");
        let ended =
            place.command(&["run", "specimen.json", "--out", "x.h5", "--resume"]).output().expect("started");
        match ended.status.code() {
            // Data of states and tables carry no checksum of their own; the history that follows does not use them.
            Some(0) => {
                let rows = |reader: &riprap::results::Reader| reader.increments().expect("rows");
                assert_eq!(rows(&place.open("x.h5")), rows(&reference));
            }
            Some(4) => {}
            code => panic!("byte {at}: {code:?}: {}", String::from_utf8_lossy(&ended.stderr)),
        }
    }
}
