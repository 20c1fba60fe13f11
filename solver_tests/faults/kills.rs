//! Killed and interrupted runs that are continued.

use riprap::results::Outcome;

use crate::place::{Place, Running, assert_same_bits};

/// Numbers that scatter well (Weyl), from `seed` on.
fn scattered(seed: usize, below: usize) -> usize {
    (seed.wrapping_mul(2_654_435_769) >> 7) % below
}

/// Runs a case to its end through SIGKILLs, each some increments and some milliseconds after the last; then
/// compares it with the uninterrupted one. Returns how many kills hit.
fn killed_again_and_again(
    place: &Place,
    case: &str,
    out: &str,
    kills: usize,
    stride: usize,
    seed: usize,
) -> usize {
    let mut hits = 0;
    for kill in 0..kills {
        let threads = if kill % 2 == 0 { "1" } else { "2" };
        let mut running = place.start(&["run", case, "--out", out, "--resume", "--threads", threads]);
        if !running.reaches(scattered(seed + kill, stride)) {
            let _ = running.child.wait();
            break;
        }
        std::thread::sleep(std::time::Duration::from_micros(scattered(seed + 7 * kill, 30_000) as u64));
        running.kill();
        hits += 1;
        if place.path(out).exists() {
            place.open(out).increments().expect("a history that can be read");
        }
    }
    place.ends_with(0, &["run", case, "--out", out, "--resume", "--quiet"]);
    hits
}

#[test]
fn a_killed_specimen_goes_on_to_the_same_bits() {
    let place = Place::new();
    let reference = place.reference("specimen.json");
    let hits = killed_again_and_again(&place, "specimen.json", "killed.h5", 4, 40, 3);
    assert!(hits >= 2, "only {hits} kills hit");
    assert_same_bits(&reference, &place.open("killed.h5"));
}

#[test]
fn a_killed_scene_goes_on_to_the_same_bits() {
    let place = Place::new();
    let reference = place.reference("scene.json");
    let hits = killed_again_and_again(&place, "scene.json", "killed.h5", 4, 80, 5);
    assert!(hits >= 1, "only {hits} kills hit");
    assert_same_bits(&reference, &place.open("killed.h5"));
}

#[test]
#[ignore = "minutes: fifty kills; scripts/kill_test.sh runs it"]
fn fifty_kills_change_no_bit() {
    let place = Place::new();
    for (case, stride) in [("specimen.json", 45), ("scene.json", 70)] {
        let reference = place.reference(case);
        let mut hits = 0;
        for round in 0.. {
            let out = format!("killed_{round}.h5");
            hits += killed_again_and_again(&place, case, &out, 5, stride, 100 * round + 1);
            assert_same_bits(&reference, &place.open(&out));
            if hits >= 25 {
                println!("{case}: {hits} kills in {} runs, every bit as in the uninterrupted run", round + 1);
                break;
            }
            assert!(round < 60, "only {hits} kills hit");
        }
        std::fs::remove_file(place.path("reference.h5")).expect("removed");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_goes_on_to_the_same_bits_on_other_threads() {
    let place = Place::new();
    for (case, after) in [("specimen.json", 17), ("scene.json", 30)] {
        let reference = place.reference(case);
        let mut running: Running = place.start(&["run", case, "--out", "x.h5", "--threads", "1"]);
        assert!(running.reaches(after), "{case} ended before it was interrupted");
        assert_eq!(running.interrupt(), Some(130), "{case}");
        let reader = place.open("x.h5");
        let status = reader.status().expect("a status");
        assert_eq!(status.outcome, Outcome::Interrupted);
        let restart = reader.restart().expect("readable").expect("a restart point");
        assert_eq!(
            restart.increment, status.last_good_increment,
            "nothing is computed twice after an interrupt"
        );
        assert!(reader.increments().expect("rows") < reference.increments().expect("rows"), "{case}");
        drop(reader);
        let told = place.ends_with(0, &["run", case, "--out", "x.h5", "--resume", "--threads", "2"]);
        assert!(told.contains(&format!("after increment {}", restart.increment)), "{told}");
        assert_same_bits(&reference, &place.open("x.h5"));
        // A finished run says so, and is left alone.
        drop(reference);
        let before = std::fs::read(place.path("x.h5")).expect("the file");
        let told = place.ends_with(0, &["run", case, "--out", "x.h5", "--resume"]);
        assert!(told.contains("nothing is left to do"), "{told}");
        assert!(before == std::fs::read(place.path("x.h5")).expect("the file"), "it was touched");
        for file in ["x.h5", "reference.h5"] {
            std::fs::remove_file(place.path(file)).expect("removed");
        }
    }
}

/// One that stops short stops at the same place with the same reason.
#[test]
fn a_stopped_run_stops_again() {
    let place = Place::new();
    // So few augmentations that some increment of the shearing misses, at so few cuts that it ends there.
    let hard = ["--set", "/stages/1/axial_strain=0.02", "--set", "/stages/1/increment=1e-3"];
    let hard =
        [&hard[..], &["--set", "/solver/max_augmentations=2", "--set", "/solver/increment_min=0.5"]].concat();
    place.ends_with(3, &[&["run", "specimen.json", "--out", "x.h5", "--quiet"], &hard[..]].concat());
    let first = place.open("x.h5");
    let (rows, status) = (first.increments().expect("rows"), first.status().expect("a status"));
    drop(first);
    assert!(rows > 0, "it stopped before its first increment");
    std::fs::copy(place.path("x.h5"), place.path("again.h5")).expect("a copy");
    let told =
        place.ends_with(3, &[&["run", "specimen.json", "--out", "again.h5", "--resume"], &hard[..]].concat());
    assert!(told.contains("continues"), "{told}");
    assert_same_bits(&place.open("x.h5"), &place.open("again.h5"));
    assert_eq!(place.open("again.h5").status().expect("a status"), status);
}
