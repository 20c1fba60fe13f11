//! Killed, interrupted and stopped runs that are continued.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::time::Duration;

use riprap::results::{Existing, Outcome};
use riprap::simulation::{End, Observer, Options, Step, run};
use riprap::solver::StopSignal;

use crate::place::{Place, SPECIMEN, assert_same_bits};

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
    let file = format!("{case}.json");
    let mut hits = 0;
    for kill in 0..kills {
        let threads = if kill % 2 == 0 { "1" } else { "2" };
        let mut running = place.start(&["run", &file, "--out", out, "--resume", "--threads", threads]);
        if !running.reaches(scattered(seed + kill, stride)) {
            running.kill();
            break;
        }
        std::thread::sleep(std::time::Duration::from_micros(scattered(seed + 7 * kill, 30_000) as u64));
        running.kill();
        hits += 1;
        if place.path(out).exists() {
            place.open(out).increments().expect("a history that can be read");
        }
    }
    place.ends_with(0, &["run", &file, "--out", out, "--resume", "--quiet"]);
    assert_same_bits(&place.reference(case), &place.open(out));
    hits
}

#[test]
fn a_killed_specimen_goes_on_to_the_same_bits() {
    let place = Place::new();
    place.lay_begun("specimen", "killed.h5");
    let hits = killed_again_and_again(&place, "specimen", "killed.h5", 5, 30, 3);
    assert!(hits >= 2, "only {hits} kills hit");
}

#[test]
fn a_killed_scene_goes_on_to_the_same_bits() {
    let place = Place::new();
    let hits = killed_again_and_again(&place, "scene", "killed.h5", 5, 60, 5);
    assert!(hits >= 1, "only {hits} kills hit");
}

#[test]
fn a_killed_scene_of_full_bodies_goes_on_to_the_same_bits() {
    // Displacements of all nodes are part of the restart point.
    let place = Place::new();
    let command = |out: &'static str| {
        let sets = ["/scene/bodies/2/fidelity=full", "/stages/0/increments=6", "/stages/1/increments=4"];
        let run = ["run", "scene.json", "--out", out, "--resume"];
        run.into_iter().chain(sets.into_iter().flat_map(|set| ["--set", set])).collect::<Vec<_>>()
    };
    place.ends_with(0, &command("whole.h5"));
    let mut running = place.start(&command("killed.h5"));
    assert!(running.reaches(3), "ended before it was killed");
    running.kill();
    place.ends_with(0, &command("killed.h5"));
    assert_same_bits(&place.open("whole.h5"), &place.open("killed.h5"));
}

#[test]
fn a_choice_of_fidelities_goes_on_to_the_same_bits() {
    // Which grains rest, and what gaps are ahead of the geometry since one was woken, are part of the restart point.
    let place = Place::new();
    let command = |out: &'static str| {
        let sets = ["/solver/accuracy=0.05", "/stages/1/increment=5e-5"];
        let run = ["run", "specimen.json", "--out", out, "--resume"];
        run.into_iter().chain(sets.into_iter().flat_map(|set| ["--set", set])).collect::<Vec<_>>()
    };
    place.ends_with(0, &command("whole.h5"));
    let whole = place.open("whole.h5");
    let condensed = whole.history("condensed_bodies").expect("counts");
    assert!(condensed.iter().any(|&count| count > 0.0 && count < 16.0), "{condensed:?}");
    for after in [4, 17] {
        let mut running = place.start(&command("killed.h5"));
        assert!(running.reaches(after), "ended before it was killed");
        running.kill();
    }
    place.ends_with(0, &command("killed.h5"));
    assert_same_bits(&whole, &place.open("killed.h5"));
}

#[test]
#[ignore = "minutes: fifty kills; scripts/kill_test.sh runs it"]
fn fifty_kills_change_no_bit() {
    for (case, stride) in [("specimen", 45), ("scene", 70)] {
        let place = Place::new();
        let (mut hits, mut runs) = (0, 0);
        while hits < 25 {
            let out = format!("killed_{runs}.h5");
            hits += killed_again_and_again(&place, case, &out, 5, stride, 100 * runs + 1);
            runs += 1;
            assert!(runs < 60, "only {hits} kills hit");
        }
        println!("{case}: {hits} kills in {runs} runs, every bit as in the uninterrupted run");
    }
}

#[test]
fn an_interrupted_run_goes_on_to_the_same_bits_on_other_threads() {
    let place = Place::new();
    for (case, after) in [("specimen", 14), ("scene", 30)] {
        place.lay_begun(case, "x.h5");
        let run = ["run", &format!("{case}.json"), "--out", "x.h5", "--resume", "--threads"];
        let reference = place.reference(case);
        let mut running = place.start(&[&run[..], &["1"]].concat());
        assert!(running.reaches(after), "{case} ended before it was interrupted");
        assert_eq!(running.interrupt(), Some(130), "{case}");
        let reader = place.open("x.h5");
        let status = reader.status().expect("a status");
        assert_eq!(status.outcome, Outcome::Interrupted);
        let restart = reader.restart().expect("readable").expect("a restart point");
        assert_eq!(restart.increment, status.last_good_increment, "nothing is to be computed twice");
        assert!(reader.increments().expect("rows") < reference.increments().expect("rows"), "{case}");
        drop(reader);
        let told = place.ends_with(0, &[&run[..], &["2"]].concat());
        assert!(told.contains(&format!("after increment {}", restart.increment)), "{told}");
        assert_same_bits(&reference, &place.open("x.h5"));
        // A finished run says so, and is left alone.
        let before = std::fs::read(place.path("x.h5")).expect("the file");
        let told = place.ends_with(0, &[&run[..], &["2"]].concat());
        assert!(told.contains("nothing is left to do"), "{told}");
        assert!(before == std::fs::read(place.path("x.h5")).expect("the file"), "it was touched");
    }
}

/// Condensing 30,000 cells takes a quarter of a minute, in which no increment hears of a wish to stop.
#[test]
fn a_run_that_builds_its_bodies_is_interrupted_at_once() {
    let place = Place::new();
    let case = r#"{"title": "A fine block", "scene": {"bodies": [
        {"name": "plate", "shape": {"box": [4, 4, 0.5]}, "position": [0, 0, -1.25], "fixed": true, "fidelity": "rigid"},
        {"name": "block", "shape": {"box": [1, 1, 1]}, "position": [0, 0, -0.5], "mesh_size": 0.06}]},
      "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2, "damage": null},
      "contact": {"friction": 0.5}, "solver": {"fidelity": "condensed"},
      "stages": [{"kind": "load", "increments": 2, "bodies": {"block": {"force": [0, 0, -1000]}}}]}"#;
    std::fs::write(place.path("fine.json"), case).expect("a case file");
    let mut command = place.command(&["run", "fine.json", "--out", "fine.vtkhdf"]);
    let mut child = command.stderr(Stdio::piped()).spawn().expect("riprap starts");
    let mut lines = BufReader::new(child.stderr.take().expect("its messages")).lines();
    // Its title is the last that is said before bodies are built.
    assert!(lines.any(|line| line.expect("text").starts_with("into")));
    std::thread::sleep(Duration::from_secs(1));
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(sent.expect("kill").success());
    let said: Vec<String> = lines.map(|line| line.expect("text")).collect();
    assert_eq!(child.wait().expect("its end").code(), Some(130), "{said:?}");
    assert!(said.iter().any(|line| line.contains("while bodies were built")), "{said:?}");
    assert!(!place.path("fine.vtkhdf").exists());
}

/// A shear under a rubber membrane, interrupted in its midst: its nodes go on too.
#[test]
fn a_rubber_membrane_goes_on_to_the_same_bits() {
    let place = Place::new();
    let rubber = r#""membrane": {"kind": "rubber", "thickness": "5 mm", "shear_modulus": "2 MPa", "mesh_size": "15 mm"}"#;
    let case = SPECIMEN
        .replace(r#""membrane": {"kind": "pressure"}"#, rubber)
        .replace(r#""pressure": "0.4 MPa""#, r#""pressure": "0.2 MPa", "increments": 4"#)
        .replace(r#""axial_strain": 0.001"#, r#""axial_strain": 0.0003"#);
    assert!(case.contains("rubber") && case.contains("0.2 MPa") && case.contains("0.0003"));
    std::fs::write(place.path("rubber.json"), case).expect("a case file");
    place.ends_with(0, &["run", "rubber.json", "--out", "whole.h5", "--quiet"]);
    let mut running = place.start(&["run", "rubber.json", "--out", "x.h5", "--threads", "1"]);
    assert!(running.reaches(9), "it ended before it was interrupted");
    assert_eq!(running.interrupt(), Some(130));
    let told = place.ends_with(0, &["run", "rubber.json", "--out", "x.h5", "--resume", "--threads", "2"]);
    assert!(told.contains("continues"), "{told}");
    assert_same_bits(&place.open("whole.h5"), &place.open("x.h5"));
}

/// A stage that `until` ended has its last state in the file, also where the run was interrupted right there.
#[test]
fn a_stage_that_ended_early_keeps_its_last_state() {
    let place = Place::new();
    let stages = r#"{"kind": "shear", "axial_strain": 0.001, "increment": 2e-5, "until": {"deviatoric_stress": "0.2 MPa"}},
                    {"kind": "shear", "axial_strain": 0.0002, "increment": 1e-4}]"#;
    let (head, rest) = SPECIMEN.split_once(r#"{"kind": "shear""#).expect("a shear");
    let (_, tail) = rest.split_once(']').expect("the end of the stages");
    std::fs::write(place.path("until.json"), format!("{head}{stages}{tail}")).expect("a case file");
    place.ends_with(0, &["run", "until.json", "--out", "whole.h5", "--quiet"]);
    let whole = place.open("whole.h5");
    let stage = whole.history("stage").expect("stages");
    let ended = stage.iter().filter(|&&stage| stage < 2.0).count();
    assert!(stage.len() > ended && ended < 50, "{stage:?}");

    let raw = riprap::case::read(&place.path("until.json")).unwrap_or_else(|e| panic!("{e}"));
    let case = raw.check().unwrap_or_else(|e| panic!("{e}"));
    for (existing, increments, end) in
        [(Existing::Refuse, ended as i64, End::Interrupted), (Existing::Continue, -1, End::Finished)]
    {
        let options = Options { out: place.path("x.h5"), existing, threads: 1, profile: false, audit: false };
        let mut observer = Impatient { increments, signal: StopSignal::new() };
        let outcome = run(&case, &raw, &options, &mut observer).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!((outcome.end, outcome.increments.min(ended as u64)), (end, ended as u64));
    }
    assert_same_bits(&whole, &place.open("x.h5"));
}

/// One that stops short stops at the same place with the same reason.
#[test]
fn a_stopped_run_stops_again() {
    let place = Place::new();
    let case = format!("{}/cases/scenes/card_tent_falls.json", env!("CARGO_MANIFEST_DIR"));
    place.ends_with(3, &["run", &case, "--out", "x.h5", "--quiet"]);
    let first = place.open("x.h5");
    assert!(first.increments().expect("rows") > 0, "it stopped before its first increment");
    drop(first);
    std::fs::copy(place.path("x.h5"), place.path("again.h5")).expect("a copy");
    let told = place.ends_with(3, &["run", &case, "--out", "again.h5", "--resume"]);
    assert!(told.contains("continues"), "{told}");
    assert_same_bits(&place.open("x.h5"), &place.open("again.h5"));
}

/// Has the increment after so many given up in its midst.
struct Impatient {
    increments: i64,
    signal: StopSignal,
}

impl Observer for Impatient {
    fn step_accepted(&mut self, step: &Step<'_>) {
        if step.row.increment == self.increments {
            self.signal.raise();
        }
    }

    fn stop_signal(&self) -> StopSignal {
        self.signal.clone()
    }
}

#[test]
fn an_increment_that_is_given_up_leaves_no_trace() {
    let place = Place::new();
    for (name, increments) in [("specimen", 23), ("scene", 40)] {
        place.lay_begun(name, "x.h5");
        let raw = riprap::case::read(&place.path(&format!("{name}.json"))).unwrap_or_else(|e| panic!("{e}"));
        let case = raw.check().unwrap_or_else(|e| panic!("{e}"));
        let options = Options {
            out: place.path("x.h5"),
            existing: Existing::Continue,
            threads: 1,
            profile: false,
            audit: false,
        };
        let go_on = |increments: i64| {
            let mut observer = Impatient { increments, signal: StopSignal::new() };
            run(&case, &raw, &options, &mut observer).unwrap_or_else(|e| panic!("{e}"))
        };
        // An increment that balances at once is not given up, so the run may end a little later.
        let outcome = go_on(increments);
        assert_eq!(outcome.end, End::Interrupted, "{name}");
        assert!(outcome.increments >= increments as u64, "{name}: {outcome:?}");
        assert_eq!(go_on(-1).end, End::Finished, "{name}");
        assert_same_bits(&place.reference(name), &place.open("x.h5"));
    }
}
