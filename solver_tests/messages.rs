//! What riprap says to whoever slips, and how wide it writes: messages name what was given and the command that would do.

use std::path::Path;
use std::process::Command;

/// Two blocks, the upper pressed and pushed over the lower.
const SCENE: &str = r#"{"title": "Push", "scene": {"bodies": [
        {"name": "plane", "shape": {"box": [1.0, 1.0, 0.1]}, "position": [0, 0, -0.05], "fixed": true},
        {"name": "block", "shape": {"box": [0.1, 0.1, 0.1]}, "position": [0, 0, 0.05]}]},
    "rock": {"density": 2180, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}, "contact": {"friction": 0.65},
    "stages": [{"kind": "load", "increments": 2, "bodies": {"block": {"force": [0, 0, "-1 kN"]}}},
               {"kind": "load", "increments": 4, "bodies": {"block": {"displacement": ["0.5 mm", null, null], "rotation": [0, 0, 0]}}}],
    "solver": {"fidelity": "rigid"}}"#;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("push.json"), SCENE).expect("a case");
    let plan = r#"{"case": "push.json", "grid": {"/contact/friction": [0.65, 0.4]}}"#;
    std::fs::write(folder.path().join("plan.json"), plan).expect("a plan");
    folder
}

/// Standard output and standard error of a command that ends with this code.
#[track_caller]
fn ends_with(code: i32, folder: &Path, arguments: &[&str]) -> (String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_riprap"));
    let output = command.current_dir(folder).args(arguments).output().expect("riprap starts");
    let [stdout, stderr] =
        [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    assert_eq!(output.status.code(), Some(code), "riprap {arguments:?}\n{stdout}\n{stderr}");
    (stdout, stderr)
}

#[track_caller]
fn fits_a_terminal(text: &str) {
    let wide: Vec<&str> = text.lines().filter(|line| line.chars().count() > 80).collect();
    assert!(wide.is_empty(), "more than 80 columns:\n{}", wide.join("\n"));
}

#[test]
fn a_batch_that_has_not_run_is_told_so() {
    let folder = folder();
    let (stdout, stderr) = ends_with(3, folder.path(), &["batch", "plan.json", "--summary"]);
    assert!(stdout.is_empty() && !folder.path().join("results").exists(), "{stdout}");
    assert!(stderr.contains("none of its members has run yet; riprap batch plan.json runs them"), "{stderr}");
    let (_, stderr) = ends_with(3, folder.path(), &["batch", "plan.json", "--out", "x", "--summary"]);
    assert!(stderr.contains("riprap batch plan.json --out x runs them"), "{stderr}");
    // One of two: the table, and what is missing.
    ends_with(0, folder.path(), &["batch", "plan.json", "--only", "0"]);
    let (stdout, stderr) = ends_with(3, folder.path(), &["batch", "plan.json", "--summary"]);
    assert!(stdout.contains("finished") && stdout.contains("not run"), "{stdout}");
    assert!(stderr.contains("1 of 2 runs") && stderr.contains("1 of them not begun"), "{stderr}");
}

/// Every kind of file in place of every other: what it is, what is wanted, and the command that takes it.
#[test]
fn one_kind_of_file_for_another_is_named_with_its_command() {
    let folder = folder();
    ends_with(0, folder.path(), &["run", "push.json", "--out", "run.vtkhdf", "--quiet"]);
    let table = "axial_strain [%],deviatoric_stress [MPa]\n0,0\n1,2\n";
    std::fs::write(folder.path().join("lab.csv"), table).expect("a table");
    let commands: [(&[&str], &str); 9] = [
        (&["info"], "results file"),
        (&["report"], "results file"),
        (&["export", "--csv", "x"], "results file"),
        (&["report", "run.vtkhdf", "--lab"], "table"),
        (&["run"], "case"),
        (&["check"], "case"),
        (&["specimen", "--out", "x.vtkhdf"], "case"),
        (&["study", "--vary", "seed"], "case"),
        (&["batch"], "plan of a batch"),
    ];
    let files = [
        ("push.json", "case", "riprap run push.json"),
        ("plan.json", "plan of a batch", "riprap batch plan.json"),
        ("run.vtkhdf", "results file", "riprap info run.vtkhdf"),
        ("lab.csv", "table", "--lab lab.csv"),
    ];
    for (command, wanted) in commands {
        for (file, kind, instead) in files.iter().filter(|(_, kind, _)| *kind != wanted) {
            let (_, stderr) = ends_with(2, folder.path(), &[command, &[*file]].concat());
            let said = format!("{file} is a {kind}, and no {wanted}: ");
            assert!(stderr.contains(&said) && stderr.contains(instead), "{command:?} {file}: {stderr}");
        }
    }
    // What is of no kind is told of by whoever reads it.
    std::fs::write(folder.path().join("x.h5"), "no HDF5").expect("a file");
    let (_, stderr) = ends_with(4, folder.path(), &["info", "x.h5"]);
    assert!(stderr.contains("not an HDF5 file"), "{stderr}");
}

#[test]
fn what_is_printed_fits_a_terminal() {
    let folder = folder();
    let say = |arguments: &[&str]| ends_with(0, folder.path(), arguments).0;
    fits_a_terminal(&say(&["batch", "plan.json"]));
    let tolerances = ["--vary", "tolerance", "--values", "1e-2,3e-3,1e-3,3e-4,1e-4,3e-5", "--out", "s"];
    let study = say(&[&["study", "push.json"][..], &tolerances].concat());
    assert!(study.contains(" 1e-2 ") && study.contains(" 3e-5 "), "{study}");
    fits_a_terminal(&study);
    fits_a_terminal(&say(&["check", "push.json"]));
    let run = ["run", "push.json", "--out", "x.vtkhdf", "--progress", "plain"];
    fits_a_terminal(&ends_with(0, folder.path(), &run).1);
    fits_a_terminal(&say(&["verify", "--only", "crossed"]));
    let help = say(&["man", "--help"]);
    assert!(help.contains("<DIR>  Where riprap.1"), "{help}");
}

#[test]
fn one_thread_is_no_threads() {
    let folder = folder();
    let run = ["run", "push.json", "--threads", "1", "--out", "x.vtkhdf"];
    let (_, stderr) = ends_with(0, folder.path(), &run);
    assert!(stderr.contains("x.vtkhdf, 1 thread\n"), "{stderr}");
    let (stdout, _) = ends_with(0, folder.path(), &["info", "x.vtkhdf"]);
    assert!(stdout.contains(", 1 thread, seed 0"), "{stdout}");
}
