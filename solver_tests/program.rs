//! The program from outside: the binary on a tiny case, its exit codes, its messages, its results file.
//!
//! The case has sixteen grains and takes about two seconds. Numbers are checked against each other
//! (energies, stresses, strains of the same file), never against stored ones.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use riprap::results::{Outcome, Reader};

const CASE: &str = r#"{
  "title": "Sixteen grains", "seed": 4,
  "specimen": {"grains": 16, "aspect": 1.5, "grading": [["60 mm", 1.0], ["40 mm", 0.0]],
               "void_ratio": 0.9, "unreachable": "nearest", "cells_per_grain": 24},
  "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2, "damage": null},
  "contact": {"friction": 0.5},   // no weakening
  "membrane": {"kind": "pressure"},
  "stages": [{"kind": "consolidate", "pressure": "0.4 MPa"},
             {"kind": "shear", "axial_strain": 0.001, "increment": 1e-4}],
  "output": {"fields_every": 0.0005}
}"#;

struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary directory");
        std::fs::write(folder.path().join("tiny.json"), CASE).expect("a case file");
        Place { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_riprap"));
        command.current_dir(self.folder.path()).args(arguments);
        command
    }

    fn riprap(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("riprap starts")
    }

    #[track_caller]
    fn ends_with(&self, code: i32, arguments: &[&str]) -> (String, String) {
        let output = self.riprap(arguments);
        let texts = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
        let [stdout, stderr] = texts;
        assert_eq!(output.status.code(), Some(code), "riprap {arguments:?}\n{stdout}\n{stderr}");
        (stdout, stderr)
    }
}

fn column(reader: &Reader, name: &str) -> Vec<f64> {
    reader.history(name).unwrap_or_else(|e| panic!("{e}"))
}

fn mean_of(reader: &Reader, name: &str) -> f64 {
    let values = reader.integers(name).unwrap_or_else(|e| panic!("{e}"));
    values.iter().sum::<i64>() as f64 / values.len() as f64
}

fn open(path: &Path) -> Reader {
    Reader::open(path).unwrap_or_else(|e| panic!("{e}"))
}

/// Shortens a run to its consolidation.
const CONSOLIDATION_ONLY: [&str; 2] =
    ["--set", r#"/stages=[{"kind": "consolidate", "pressure": "0.4 MPa"}]"#];

#[test]
fn a_run_writes_a_consistent_file() {
    let place = Place::new();
    let (stdout, stderr) = place.ends_with(0, &["run", "tiny.json", "--progress", "plain", "--profile"]);
    // The default target lies beside the case.
    assert_eq!(stdout.trim(), "results/tiny.vtkhdf", "{stderr}");
    let words: Vec<&str> = stderr.split_whitespace().collect();
    for done in [["consolidate", "1/10"], ["shear", "10/10"]] {
        assert!(words.windows(2).any(|pair| pair == done), "{stderr}");
    }

    let reader = open(&place.path("results/tiny.vtkhdf"));
    let status = reader.status().expect("a status");
    assert_eq!(status.outcome, Outcome::Finished);

    // Where the time went: on the screen and in the file, with as many factorisations as the history
    // has, and those of the seating.
    assert!(stderr.contains("ms a call") && stderr.contains("\n  factor "), "{stderr}");
    let factored = reader.floats("profile/kernel_factor_seconds").expect("a profile")[0];
    let sheared = reader.floats("profile/shear_seconds").expect("a profile")[0];
    assert!(factored > 0.0 && sheared > 0.0);
    let calls = reader.integers("profile/kernel_factor_calls").expect("a profile")[0];
    assert!(calls as f64 >= column(&reader, "factorisations").iter().sum::<f64>());
    let increments = reader.increments().expect("rows");
    assert!(increments >= 20 && status.last_good_increment == increments as u64, "{increments}");

    let stage = column(&reader, "stage");
    let first_shear = stage.iter().position(|&s| s == 1.0).expect("a shear stage");
    let shear = first_shear..increments;
    let (strain, q) = (column(&reader, "axial_strain"), column(&reader, "deviatoric_stress"));
    assert!((strain[increments - 1] - 0.001).abs() < 1e-9, "strains count from the end of the consolidation");
    assert!(shear.clone().skip(1).all(|i| strain[i] > strain[i - 1]));
    assert!(q[increments - 1] > 5.0 * q[first_shear - 1].abs() + 1e5, "q rises: {q:?}");
    let pressure = column(&reader, "confining_pressure");
    assert!(shear.clone().all(|i| (pressure[i] - 4e5).abs() < 1e-3));
    let (axial, mean) = (column(&reader, "axial_stress"), column(&reader, "mean_stress"));
    let (radial, volumetric) = (column(&reader, "radial_strain"), column(&reader, "volumetric_strain"));
    for i in 0..increments {
        assert!((axial[i] - pressure[i] - q[i]).abs() < 1e-6 * pressure[i]);
        assert!((3.0 * mean[i] - axial[i] - 2.0 * pressure[i]).abs() < 1e-6 * pressure[i]);
        assert!((volumetric[i] - strain[i] - 2.0 * radial[i]).abs() < 1e-12);
    }
    assert!(column(&reader, "unrest").iter().all(|&unrest| unrest < 0.1));
    // The ends of stages are at rest.
    assert!(column(&reader, "out_of_balance").last().is_some_and(|&unbalanced| unbalanced < 1e-3));

    // The external work is the sum of the energies to 1e-2. The case ends before
    // a snap at 0.14 %, in which friction is booked 5 % of the work too high (slip times the mean force of both ends).
    let parts = ["elastic", "friction", "damage", "stabilisation", "membrane", "error"];
    let last = |name: &str| column(&reader, &format!("energy_{name}"))[increments - 1];
    let (external, sum) = (last("external"), parts.iter().map(|part| last(part)).sum::<f64>());
    assert!((external - sum).abs() < 1e-9 * external);
    assert!(last("error").abs() < 1e-2 * external, "{} of {external} J", last("error"));

    // The start, ten increments of the consolidation, every 0.05 % of the shearing.
    let states = reader.floats("VTKHDF/Steps/Values").expect("states");
    assert_eq!(states.len(), 1 + 10 + 2, "{states:?}");
    assert_eq!(reader.shape("grains/position").expect("positions"), [states.len(), 16, 3]);
    assert_eq!(reader.members("contacts").expect("contact tables").len(), states.len());
    assert!(reader.text("case/given").expect("the case").contains("// no weakening"));
    for name in
        ["grains/volume", "specimen/void_ratio", "specimen/grading/mass_fraction", "specimen/flatness/count"]
    {
        assert!(reader.has(name), "{name}");
    }
}

/// The volume mean of the grains' stresses is the stress of the specimen (Love). The rims of the
/// cover press on the plates instead of the grains, hence the loose bound across.
#[test]
fn grain_stresses_average_to_the_stress_of_the_specimen() {
    // On smooth plates the rims slide: what a rim's nodes bear across is a grain's, what they bear along the axis the plate's.
    for (friction, bound) in [(0.5, 0.2), (0.0, 0.1)] {
        stresses_average(friction, bound);
    }
}

fn stresses_average(plate_friction: f64, bound: f64) {
    let place = Place::new();
    let friction = format!("/plates/friction={plate_friction}");
    place.ends_with(0, &["run", "tiny.json", "--out", "x.h5", "--quiet", "--set", &friction]);
    let reader = open(&place.path("x.h5"));
    let last_row = reader.increments().expect("rows") - 1;
    let last = |name: &str| column(&reader, name)[last_row];
    let volumes = reader.floats("grains/volume").expect("volumes");
    let total = volumes.iter().sum::<f64>() * (1.0 + last("void_ratio"));
    let start =
        *reader.integers("VTKHDF/Steps/CellDataOffsets/stress").expect("offsets").last().expect("a state");
    let stress = reader.floats("VTKHDF/CellData/stress").expect("stresses");
    let of_cell = reader.integers("VTKHDF/CellData/grain").expect("grains");
    let mut mean = [0.0; 6];
    for (grain, volume) in volumes.iter().enumerate() {
        let cell = of_cell.iter().position(|&g| g == grain as i64).expect("a cell");
        let row = 6 * (start as usize + cell);
        (0..6).for_each(|k| mean[k] += stress[row + k] * volume / total);
    }
    let (axial, radial) = (-mean[2], -0.5 * (mean[0] + mean[1]));
    assert!((axial / last("axial_stress") - 1.0).abs() < 0.03, "{axial} against {}", last("axial_stress"));
    assert!(
        (radial / last("confining_pressure") - 1.0).abs() < bound,
        "{radial} against {}",
        last("confining_pressure")
    );
}

#[test]
fn one_and_two_threads_give_the_same_bits() {
    let place = Place::new();
    for threads in ["1", "2"] {
        let out = format!("{threads}.h5");
        place.ends_with(0, &["run", "tiny.json", "--quiet", "--threads", threads, "--out", &out]);
    }
    let [one, two] = ["1.h5", "2.h5"].map(|name| open(&place.path(name)));
    for quantity in riprap::results::HISTORY.iter().filter(|quantity| !quantity.name.ends_with("_time")) {
        let bits = |reader: &Reader| -> Vec<u64> {
            column(reader, quantity.name).into_iter().map(f64::to_bits).collect()
        };
        assert_eq!(bits(&one), bits(&two), "{}", quantity.name);
    }
    let states = one.floats("VTKHDF/Steps/Values").expect("states").len();
    let mut names: Vec<String> = ["displacement"].map(|name| format!("VTKHDF/PointData/{name}")).into();
    names.extend(["stress", "von_mises"].map(|name| format!("VTKHDF/CellData/{name}")));
    names.extend(["position", "rotation", "volume"].map(|name| format!("grains/{name}")));
    names.extend(["point", "normal", "force", "slip"].map(|name| format!("contacts/{}/{name}", states - 1)));
    for name in names {
        let bits = |reader: &Reader| -> Vec<u64> {
            let numbers = reader.floats(&name).unwrap_or_else(|e| panic!("{e}"));
            numbers.into_iter().map(f64::to_bits).collect()
        };
        assert!(!bits(&one).is_empty() && bits(&one) == bits(&two), "{name}");
    }
}

#[test]
fn time_of_the_increments_leaves_out_what_came_before_them() {
    let place = Place::new();
    place.ends_with(0, &["run", "tiny.json", "--quiet", "--out", "x.h5"]);
    let reader = open(&place.path("x.h5"));
    let [wall, solving] = ["wall_time", "solving_time"].map(|name| column(&reader, name));
    assert!(solving.len() > 2 && solving[0] > 0.0 && solving.is_sorted_by(|a, b| a < b), "{solving:?}");
    // The specimen, the rig, the seating; and then the file.
    assert!(wall.iter().zip(&solving).all(|(wall, solving)| solving < wall), "{wall:?} {solving:?}");
    assert!(wall.iter().zip(&solving).is_sorted_by_key(|(wall, solving)| *wall - *solving));
}

#[test]
fn a_results_file_is_not_overwritten_unless_forced() {
    let place = Place::new();
    std::fs::write(place.path("x.h5"), "precious").expect("a file");
    let run = ["run", "tiny.json", "--quiet", "--out", "x.h5", CONSOLIDATION_ONLY[0], CONSOLIDATION_ONLY[1]];
    let (_, stderr) = place.ends_with(2, &run);
    assert!(stderr.contains("x.h5 exists already") && stderr.contains("--force"), "{stderr}");
    assert_eq!(std::fs::read_to_string(place.path("x.h5")).expect("the file"), "precious");
    place.ends_with(0, &[&run[..], &["--force"]].concat());
    assert_eq!(open(&place.path("x.h5")).status().expect("a status").outcome, Outcome::Finished);
}

#[test]
fn what_a_run_reads_and_what_is_no_file_is_not_overwritten_even_if_forced() {
    let place = Place::new();
    let [set, stages] = CONSOLIDATION_ONLY;
    let run = |out: &'static str| ["run", "tiny.json", "--quiet", "--force", set, stages, "--out", out];
    let (_, stderr) = place.ends_with(2, &run("./tiny.json"));
    assert!(stderr.contains("what the run reads"), "{stderr}");
    assert_eq!(std::fs::read_to_string(place.path("tiny.json")).expect("the case"), CASE);
    assert!(Command::new("mkfifo").arg(place.path("pipe")).status().expect("mkfifo").success());
    let (_, stderr) = place.ends_with(2, &run("pipe"));
    assert!(stderr.contains("device or pipe"), "{stderr}");
}

#[cfg(unix)]
#[test]
fn a_link_is_followed() {
    let place = Place::new();
    let [set, stages] = CONSOLIDATION_ONLY;
    std::fs::create_dir(place.path("far")).expect("a folder");
    std::os::unix::fs::symlink("far/x.h5", place.path("link.h5")).expect("a link");
    place.ends_with(0, &["run", "tiny.json", "--quiet", set, stages, "--out", "link.h5"]);
    assert!(place.path("link.h5").is_symlink());
    assert_eq!(open(&place.path("far/x.h5")).status().expect("a status").outcome, Outcome::Finished);
}

#[test]
fn a_specimen_is_no_finished_run_and_overrides_are_in_the_file() {
    let place = Place::new();
    let [set, stages] = CONSOLIDATION_ONLY;
    place.ends_with(0, &["specimen", "tiny.json", "--quiet", set, stages, "--out", "x.h5"]);
    assert_eq!(open(&place.path("x.h5")).increments().expect("rows"), 0);
    place.ends_with(0, &["run", "tiny.json", "--quiet", set, stages, "--out", "x.h5", "--resume"]);
    let reader = open(&place.path("x.h5"));
    assert!(reader.increments().expect("rows") >= 10);
    let given = reader.text("case/given").expect("the case");
    assert!(given.starts_with(CASE) && given.contains("\n// --set /stages=["), "{given}");
}

#[test]
fn check_looks_at_what_a_case_starts_from() {
    let place = Place::new();
    let (_, stderr) = place.ends_with(1, &["check", "tiny.json", "--set", "/start_from=nothere.h5"]);
    assert!(stderr.contains("$.start_from") && stderr.contains("names no file"), "{stderr}");
    // Along with what else is wrong.
    let with = ["--set", "/start_from=nothere.h5", "--set", "/contact/friction=-1"];
    let (_, stderr) = place.ends_with(1, &[&["check", "tiny.json"][..], &with].concat());
    assert!(stderr.contains("$.start_from") && stderr.contains("$.contact.friction"), "{stderr}");
}

#[cfg(target_os = "linux")]
#[test]
fn output_that_cannot_be_written_is_told() {
    let place = Place::new();
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("a full device");
    let output = place.command(&["schema"]).stdout(full).output().expect("riprap starts");
    assert_eq!(output.status.code(), Some(4));
    assert!(String::from_utf8_lossy(&output.stderr).contains("standard output"));
}

#[test]
fn what_does_not_converge_stops_with_its_reason() {
    let place = Place::new();
    let strict = ["stabilisation=null", "force_tolerance=1e-9", "max_augmentations=1"];
    let strict = strict.map(|set| format!("/solver/{set}"));
    let strict: Vec<&str> = strict.iter().flat_map(|set| ["--set", set]).collect();
    let (_, stderr) = place.ends_with(3, &[&["run", "tiny.json", "--out", "x.h5"], &strict[..]].concat());
    assert!(stderr.contains("out of balance"), "{stderr}");
    let status = open(&place.path("x.h5")).status().expect("a status");
    assert_eq!(status.outcome, Outcome::Stopped);
    assert!(status.reason.contains("out of balance"), "{}", status.reason);
}

#[test]
fn the_solver_tells_what_it_does_when_asked() {
    let place = Place::new();
    let run = ["run", "tiny.json", "--quiet", "--out", "x.h5", CONSOLIDATION_ONLY[0], CONSOLIDATION_ONLY[1]];
    let output = place.command(&run).env("RIPRAP_LOG", "trace").output().expect("riprap starts");
    assert_eq!(output.status.code(), Some(0));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("step") && stderr.contains("out_of_balance"), "{stderr}");
    let output = place.command(&run).env("RIPRAP_LOG", "loud").output().expect("riprap starts");
    assert_eq!(output.status.code(), Some(2));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("`loud`") && stderr.contains("trace"), "{stderr}");
}

#[test]
fn bad_input_names_every_fault() {
    let place = Place::new();
    let bad = ["--set", "/solver/force_tolerence=1", "--set", "/seed=-1", "--set", "/contact/friction=0.5 m"];
    for (code, command) in [(2, "run"), (1, "check")] {
        let (_, stderr) = place.ends_with(code, &[&[command, "tiny.json"], &bad[..]].concat());
        for part in ["$.solver.force_tolerence", "\"force_tolerance\"", "$.seed", "$.contact.friction"] {
            assert!(stderr.contains(part), "{command} does not say {part}:\n{stderr}");
        }
        assert!(!place.path("results").exists());
    }
    let (_, stderr) = place.ends_with(2, &["run", "none.json"]);
    assert!(stderr.contains("none.json"), "{stderr}");
    std::fs::write(place.path("broken.json"), "{\"title\": }").expect("a file");
    let (_, stderr) = place.ends_with(2, &["check", "broken.json"]);
    assert!(stderr.contains("broken.json:1:"), "{stderr}");
    place.ends_with(2, &["run"]);
    // An override that does not parse is listed with the rest.
    let (_, stderr) = place.ends_with(2, &["run", "tiny.json", "--set", "seed"]);
    assert!(stderr.contains("--set"), "{stderr}");
}

#[test]
fn what_cannot_be_run_yet_is_refused() {
    let place = Place::new();
    let wall = r#"/membrane={"kind": "rigid_wall"}"#;
    for (pointer, path) in [
        (r#"/plates={"tilting": "free"}"#, "$.plates.tilting"),
        ("/solver/fidelity=condensed", "$.solver.fidelity"),
        ("/solver/fidelity=full", "$.solver.fidelity"),
    ] {
        let (_, stderr) = place.ends_with(2, &["run", "tiny.json", "--set", pointer, "--set", wall]);
        assert!(stderr.contains(path) && stderr.contains("a rigid wall"), "{stderr}");
    }
    let rubber = r#"/membrane={"kind": "rubber"}"#;
    let tilting = r#"/plates={"tilting": "free"}"#;
    place.ends_with(0, &["check", "tiny.json", "--set", tilting]);
    place.ends_with(0, &["check", "tiny.json", "--set", tilting, "--set", rubber]);
}

#[test]
fn a_mesh_file_that_makes_no_body_is_a_fault_of_the_case() {
    let place = Place::new();
    std::fs::write(place.path("rubbish.vtu"), "garbage").expect("a file");
    let case = r#"{"scene": {"bodies": [{"name": "a", "shape": {"mesh": "rubbish.vtu"}}]},
        "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2},
        "contact": {"friction": 0.5}, "stages": [{"kind": "load"}], "colour": "red"}"#;
    std::fs::write(place.path("meshed.json"), case).expect("a file");
    let (_, stderr) = place.ends_with(1, &["check", "meshed.json"]);
    for part in ["$.scene.bodies[0].shape.mesh", "makes no body", "convex body", "$.colour"] {
        assert!(stderr.contains(part), "{stderr}");
    }
}

#[test]
fn a_target_that_cannot_be_written_is_file_trouble() {
    let place = Place::new();
    let (_, stderr) = place.ends_with(4, &["run", "tiny.json", "--out", "tiny.json/x.h5"]);
    assert!(stderr.contains("tiny.json"), "{stderr}");
    std::fs::write(place.path("x.h5"), "no HDF5").expect("a file");
    place.ends_with(4, &["info", "x.h5"]);
}

#[test]
fn the_other_commands_answer() {
    let place = Place::new();
    let (stdout, _) = place.ends_with(0, &["check", "tiny.json"]);
    assert!(stdout.contains("sound") && stdout.contains("degrees of freedom"), "{stdout}");
    assert!(stdout.contains("diameter, height"), "{stdout}");
    let (stdout, _) = place.ends_with(0, &["check", "tiny.json", "--full"]);
    let full: serde_json::Value = serde_json::from_str(&stdout).expect("JSON");
    assert_eq!(full["stages"][0]["radial_pressure"], 4e5);
    let (stdout, _) = place.ends_with(0, &["schema"]);
    let schema: serde_json::Value = serde_json::from_str(&stdout).expect("JSON");
    assert!(schema["properties"]["specimen"].is_object());
    let (stdout, _) = place.ends_with(0, &["--help"]);
    assert!(stdout.contains("Exit codes"), "{stdout}");

    let (_, stderr) = place.ends_with(0, &["specimen", "tiny.json", "--out", "s.h5", "--progress", "plain"]);
    let classes = "40-60 mm 100.0 % of the mass (asked: 100.0) in 16 grains";
    assert!(stderr.contains(classes) && stderr.contains("shape in the mean: elongation 0."), "{stderr}");
    let reader = open(&place.path("s.h5"));
    let overlap = |name: &str| reader.floats(&format!("specimen/{name}")).expect("an overlap")[0];
    assert!(stderr.contains(&format!(", {:.1} vertices\n", mean_of(&reader, "grains/vertices"))), "{stderr}");
    assert!(overlap("worst_overlap_gjk") < 1e-4 && overlap("worst_overlap_separating_axis") < 1e-4);
    let (stdout, _) = place.ends_with(0, &["info", "s.h5"]);
    assert!(stdout.contains("Sixteen grains") && stdout.contains("finished"), "{stdout}");
    let (stdout, _) = place.ends_with(0, &["info", "s.h5", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&stdout).expect("JSON");
    assert_eq!(summary["grains"], 16);
    // Plates and cover have cells too.
    let cells = ["grain_cells", "cells"].map(|key| summary[key].as_u64().expect("a number"));
    assert!(cells[0] >= 16 && cells[0] < cells[1], "{cells:?}");
}

#[test]
fn lines_for_machines_and_the_exported_table_hold_the_history() {
    let place = Place::new();
    let run = ["run", "tiny.json", "--progress", "json", "--out", "x.h5"];
    let (stdout, stderr) = place.ends_with(0, &[&run[..], &CONSOLIDATION_ONLY[..]].concat());
    assert_eq!(stderr, "");
    let lines: Vec<serde_json::Value> =
        stdout.lines().map(|line| serde_json::from_str(line).expect("a JSON line")).collect();
    let told: Vec<f64> = lines
        .iter()
        .filter(|line| line["event"] == "increment")
        .map(|line| line["mean_stress"].as_f64().expect("a number"))
        .collect();
    let reader = open(&place.path("x.h5"));
    assert_eq!(told, column(&reader, "mean_stress"));
    let modulus = |name: &str| reader.floats(&format!("stages/0/{name}")).expect("a modulus")[0];
    assert!(modulus("initial_modulus").is_nan() && modulus("half_modulus").is_nan());
    let specimen = lines.iter().find(|line| line["event"] == "specimen").expect("a specimen");
    // The nearest that these grains can be packed to was taken.
    assert_eq!(specimen["void_ratio_asked"], 0.9);
    assert!(specimen["void_ratio"].as_f64().is_some_and(|e| e > 0.91), "{specimen}");
    assert_eq!(lines.last().expect("lines")["status"], "finished");

    let (stdout, _) = place.ends_with(0, &["export", "x.h5", "--csv", "tables"]);
    let first = stdout.lines().next().expect("a file");
    let table = std::fs::read_to_string(place.path(first)).expect("the table");
    assert!(table.starts_with("stage [1],increment [1],"), "{table}");
    assert_eq!(table.lines().count(), 1 + told.len());
}

/// One that is there already goes nowhere, and a reloading still goes to where the first began.
#[test]
fn a_second_unloading_to_the_same_stress_changes_nothing() {
    let place = Place::new();
    let case = concat!(env!("CARGO_MANIFEST_DIR"), "/cases/stages/unload_reload.json");
    let run = |out: &str, unloadings: &str| {
        let stages = format!(
            r#"/stages=[{{"kind": "consolidate", "pressure": "0.4 MPa"}},
               {{"kind": "shear", "axial_strain": 0.002, "increment": 2e-4}}, {unloadings}, {{"kind": "reload"}}]"#
        );
        place.ends_with(0, &["run", case, "--set", &stages, "--out", out, "--quiet"]);
        open(&place.path(out))
    };
    let once = run("once.h5", r#"{"kind": "unload"}"#);
    let twice = run("twice.h5", r#"{"kind": "unload"}, {"kind": "unload"}"#);
    for name in ["axial_strain", "deviatoric_stress", "energy_friction"] {
        assert_eq!(column(&once, name), column(&twice, name), "{name}");
    }
    let (stage, strain) = (column(&once, "stage"), column(&once, "axial_strain"));
    let last_of = |number: f64| stage.iter().rposition(|s| *s == number).map_or(f64::NAN, |row| strain[row]);
    assert!(last_of(2.0) < 0.00195, "unloaded");
    assert!((last_of(3.0) - 0.002).abs() < 1e-9, "reloaded to where the unloading began");
}

#[test]
fn what_bodies_of_a_scene_did_is_exported() {
    let place = Place::new();
    let case = concat!(env!("CARGO_MANIFEST_DIR"), "/cases/scenes/push.json");
    place.ends_with(0, &["run", case, "--out", "push.h5", "--quiet"]);
    let (stdout, _) = place.ends_with(0, &["export", "push.h5", "--csv", "."]);
    assert!(stdout.lines().any(|line| line.ends_with("push.csv")), "{stdout}");
    let table = std::fs::read_to_string(place.path("push_bodies.csv")).expect("the table");
    let reader = open(&place.path("push.h5"));
    let bodies = reader.members("bodies").expect("bodies");
    let rows = reader.increments().expect("rows");
    let lines: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(lines.len(), 1 + bodies.len() * rows);
    let x = lines[0].iter().position(|name| *name == "displacement_x [m]").expect("a column");
    for (number, body) in bodies.iter().enumerate() {
        let moved = reader.floats(&format!("bodies/{body}/displacement")).expect("numbers");
        for row in 0..rows {
            let line = &lines[1 + number * rows + row];
            assert_eq!((line.len(), line[0]), (lines[0].len(), body.as_str()));
            assert_eq!(line[x].parse::<f64>().expect("a number").to_bits(), moved[3 * row].to_bits());
        }
    }
}

/// The first interrupt finishes the increment at hand and leaves a whole file.
#[cfg(unix)]
#[test]
fn an_interrupt_leaves_a_whole_file() {
    use std::io::BufRead;
    let place = Place::new();
    let mut child = place
        .command(&["run", "tiny.json", "--progress", "json", "--out", "x.h5"])
        .args(["--set", "/stages/1/increment=1e-6"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("riprap starts");
    let mut lines = std::io::BufReader::new(child.stdout.take().expect("its output")).lines();
    let sheared =
        lines.by_ref().any(|line| line.is_ok_and(|line| line.contains(r#""kind":"shear","progress""#)));
    assert!(sheared, "the run ended before it sheared");
    // As `timeout` does, which signals the process and its group.
    let twice = format!("kill -INT {0} && kill -INT {0}", child.id());
    let sent = Command::new("sh").args(["-c", &twice]).status().expect("kill");
    assert!(sent.success());
    let told = lines.map_while(Result::ok).filter(|line| line.contains(r#""event":"increment""#)).count();
    assert!(told < 100, "{told} increments after the interrupt");
    assert_eq!(child.wait().expect("its end").code(), Some(130));
    let reader = open(&place.path("x.h5"));
    let status = reader.status().expect("a status");
    assert_eq!(status.outcome, Outcome::Interrupted);
    assert_eq!(status.last_good_increment, reader.increments().expect("rows") as u64);
    assert!(reader.floats("VTKHDF/Steps/Values").expect("states").len() > 11, "the last state is saved");
}

/// A block of height h that rests under its weight: its mean vertical stress is -rho g h / 2 (Love, with gravity
/// in the volume), to the force tolerance. What is held has no stress that could be known.
#[test]
fn a_resting_block_carries_half_its_weight_in_the_mean() {
    let place = Place::new();
    let case = r#"{"title": "A block at rest", "scene": {"bodies": [
      {"name": "ground", "shape": {"box": [1, 1, 0.1]}, "position": [0, 0, -0.05], "fixed": true},
      {"name": "block", "shape": {"box": [0.1, 0.1, 0.3]}, "position": [0, 0, 0.15]}]},
      "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2, "damage": null},
      "contact": {"friction": 0.5},
      "stages": [{"kind": "load", "increments": 4, "gravity": [0, 0, -9.81]}]}"#;
    std::fs::write(place.path("block.json"), case).expect("a case file");
    place.ends_with(0, &["run", "block.json", "--out", "x.h5", "--quiet"]);
    let reader = open(&place.path("x.h5"));
    let part = reader.integers("VTKHDF/CellData/part").expect("parts");
    let offsets = reader.integers("VTKHDF/Steps/CellDataOffsets/stress").expect("offsets");
    let stress = reader.floats("VTKHDF/CellData/stress").expect("stresses");
    let start = *offsets.last().expect("a state") as usize;
    let expected = -2700.0 * 9.81 * 0.3 / 2.0;
    for (cell, part) in part.iter().enumerate() {
        let stress = &stress[6 * (start + cell)..][..6];
        if *part == 0 {
            assert!(stress.iter().all(|component| component.is_nan()), "{stress:?}");
            continue;
        }
        assert!((stress[2] / expected - 1.0).abs() < 2e-3, "{stress:?} against {expected}");
        assert!((0..6).all(|k| k == 2 || stress[k].abs() < 2e-2 * expected.abs()), "{stress:?}");
    }
}

#[test]
fn a_scene_runs_into_its_bodies() {
    let place = Place::new();
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/scenes/push.json");
    let case = case.to_str().expect("a path");
    let (_, stderr) = place.ends_with(0, &["run", case, "--out", "push.h5", "--progress", "plain"]);
    assert!(stderr.contains("load"), "{stderr}");
    let reader = open(&place.path("push.h5"));
    assert_eq!(reader.status().expect("a status").outcome, Outcome::Finished);
    let rows = reader.increments().expect("rows");
    for body in reader.members("bodies").expect("bodies") {
        assert_eq!(reader.shape(&format!("bodies/{body}/force")).expect("forces"), [rows, 3]);
    }
}

#[test]
fn verify_prints_its_table_and_fails_by_its_exit_code_only() {
    let place = Place::new();
    let (list, _) = place.ends_with(0, &["verify", "--list"]);
    assert!(list.lines().count() > 20 && list.contains("card_tent"), "{list}");
    let (table, _) = place.ends_with(0, &["verify", "--only", "nafems", "--only", "crossed"]);
    assert!(table.lines().filter(|line| line.contains("pass")).count() >= 9, "{table}");
    assert!(!table.contains("card_tent"), "{table}");
    let (_, complaint) = place.ends_with(2, &["verify", "--only", "nothing like it"]);
    assert!(complaint.contains("no such problem"), "{complaint}");
}

#[test]
fn a_stopped_run_leaves_a_dossier() {
    let place = Place::new();
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/scenes/card_tent_falls.json");
    let case = case.to_string_lossy().into_owned();
    let (_, stderr) = place.ends_with(3, &["run", &case, "--out", "falls.h5", "--audit"]);
    for said in ["worst body", "worst contact", "contacts ", "out of balance", "to try"] {
        assert!(stderr.contains(said), "{said}: {stderr}");
    }
    let reader = open(&place.path("falls.h5"));
    let text = |name: &str| reader.text_attribute("status", name).unwrap_or_else(|e| panic!("{e}"));
    assert!(["left", "right"].contains(&text("worst_body").as_str()), "{}", text("worst_body"));
    assert!(text("out_of_balance").parse::<f64>().is_ok_and(|value| value > 1e-3));
    assert!(text("residual_history").split(' ').count() > 10);
    assert!(text("worst_contact").contains("ground") || text("worst_contact").contains("left"));
    assert!(!text("advice").is_empty() && text("contacts").contains("stick"));
}

/// Pushed through at once: bodies are too close for any balance to be looked at.
#[test]
fn a_dossier_without_a_balance_has_no_infinite_numbers() {
    let place = Place::new();
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/scenes/push.json");
    let through = r#"/stages=[{"kind": "load", "increments": 1,
                               "bodies": {"block": {"displacement": [null, null, -0.2], "rotation": [0, 0, 0]}}}]"#;
    let (_, stderr) =
        place.ends_with(3, &["run", &case.to_string_lossy(), "--out", "through.h5", "--set", through]);
    assert!(stderr.contains("pass into another one") && stderr.contains("smaller increments"), "{stderr}");
    assert!(!stderr.contains("inf of") && !stderr.contains("inf out"), "{stderr}");
    let reader = open(&place.path("through.h5"));
    assert!(reader.text_attribute("status", "worst_body").is_err());
    assert!(reader.text_attribute("status", "advice").is_ok_and(|advice| !advice.contains("inf ")));
}

/// Two blocks of rocks of their own: each cell shows the modulus that it drew, and `/rock` tells of all of them.
#[test]
fn youngs_moduli_are_those_that_cells_have() {
    let place = Place::new();
    let block = |name: &str, z: f64, modulus: &str| {
        format!(
            r#"{{"name": "{name}", "shape": {{"box": [0.1, 0.1, 0.1]}}, "position": [0, 0, {z}], "mesh_size": 0.05,
                "rock": {{"density": 2180, "youngs_modulus": {modulus}, "poissons_ratio": 0.2}}}}"#
        )
    };
    let stiff = block("stiff", 0.05, r#"{"mean": "30 GPa", "weibull_shape": 5}"#);
    let soft = block("soft", 0.15, r#""3 GPa""#);
    let case = format!(
        r#"{{"scene": {{"bodies": [{stiff}, {soft}]}}, "contact": {{"friction": 0.5}},
            "rock": {{"density": 2180, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}},
            "solver": {{"fidelity": "condensed"}},
            "stages": [{{"kind": "load", "increments": 1, "bodies": {{
                "stiff": {{"displacement": [0, 0, 0], "rotation": [0, 0, 0]}},
                "soft": {{"displacement": [0, 0, -1e-6], "rotation": [0, 0, 0]}}}}}}]}}"#
    );
    std::fs::write(place.path("rocks.json"), case).expect("written");
    place.ends_with(0, &["run", "rocks.json", "--out", "rocks.h5"]);
    let reader = open(&place.path("rocks.h5"));
    let floats = |name: &str| reader.floats(name).unwrap_or_else(|e| panic!("{e}"));
    let moduli = floats("VTKHDF/CellData/youngs_modulus");
    let bodies = reader.integers("VTKHDF/CellData/grain").expect("bodies");
    assert_eq!((moduli.len(), bodies.len()), (96, 96));
    let of =
        |body: i64| moduli.iter().zip(&bodies).filter(move |(_, b)| **b == body).map(|(modulus, _)| *modulus);
    assert!(of(1).count() == 48 && of(1).all(|modulus| (modulus / 3e9 - 1.0).abs() < 1e-6));
    // A Weibull law of shape 5 deviates by 0.229 of its mean; 48 cells tell that to a tenth or two.
    let mean = of(0).sum::<f64>() / 48.0;
    let deviation = (of(0).map(|modulus| (modulus - mean).powi(2)).sum::<f64>() / 48.0).sqrt();
    assert!(
        (mean / 30e9 - 1.0).abs() < 0.15 && (0.12..0.35).contains(&(deviation / mean)),
        "{mean} {deviation}"
    );
    let said = |column: &str| floats(&format!("rock/youngs_modulus/{column}"))[0];
    let all = moduli.iter().sum::<f64>() / 96.0;
    let spread = (moduli.iter().map(|modulus| (modulus - all).powi(2)).sum::<f64>() / 96.0).sqrt();
    assert!((said("mean") / all - 1.0).abs() < 1e-6 && (said("deviation") / spread - 1.0).abs() < 1e-6);
    assert!((said("mean_asked") / 16.5e9 - 1.0).abs() < 1e-12);
}

#[test]
fn an_audited_run_finds_nothing() {
    let place = Place::new();
    place.ends_with(0, &["run", "tiny.json", "--audit", CONSOLIDATION_ONLY[0], CONSOLIDATION_ONLY[1]]);
}

/// Rock so weak that the consolidation breaks some: `/breakage`, history and fields agree, and nothing is where no body is.
#[test]
fn breakage_agrees_with_history_and_fields() {
    let place = Place::new();
    let weak = r#"/rock={"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2, "damage": {},
                         "compressive_strength": "40 MPa", "tensile_strength": "2 MPa"}"#;
    let [set, stages] = CONSOLIDATION_ONLY;
    let run = ["run", "tiny.json", "--out", "weak.h5", "--audit", set, stages, set, weak];
    place.ends_with(0, &run);
    let reader = open(&place.path("weak.h5"));
    let floats = |name: &str| reader.floats(name).unwrap_or_else(|e| panic!("{e}"));
    let integers = |name: &str| reader.integers(name).unwrap_or_else(|e| panic!("{e}"));
    let deleted = *column(&reader, "deleted_cells").last().expect("rows");
    let failed_points = *column(&reader, "failed_points").last().expect("rows");
    assert!(failed_points >= 4.0 * deleted && failed_points > 0.0, "{failed_points} {deleted}");
    // The last saved state's cells.
    let cells = integers("VTKHDF/CellData/grain").len();
    let failed = integers("VTKHDF/CellData/failed");
    let fragment = integers("VTKHDF/CellData/fragment");
    let start =
        |field: &str| *integers(&format!("VTKHDF/Steps/CellDataOffsets/{field}")).last().expect("a state");
    let last = |values: &[i64], at: i64| values[at as usize..at as usize + cells].to_vec();
    assert_eq!(last(&failed, start("failed")).iter().sum::<i64>() as f64, deleted);
    let grain = integers("VTKHDF/CellData/grain");
    let fragment = last(&fragment, start("fragment"));
    assert!(grain.iter().zip(&fragment).all(|(grain, body)| (*grain < 0) == (*body < 0) && *body < 200));
    // Crushed volume, and gradings that only get finer.
    let crushed = floats("breakage/crushed_share")[0];
    assert_eq!(crushed > 0.0, deleted > 0.0, "{crushed} {deleted}");
    assert!(floats("breakage/damaged_share")[0] >= crushed && crushed < 1.0);
    let [before, after] = ["before", "after"].map(|when| floats(&format!("breakage/grading/passing_{when}")));
    assert!(
        before.iter().zip(&after).all(|(before, after)| after > &(before - 1e-12)),
        "{before:?} {after:?}"
    );
    assert_eq!(integers("breakage/classes/grains").iter().sum::<i64>(), 16);
}
