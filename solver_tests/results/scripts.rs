//! The Python of `scripts/` on a results file.

use std::path::Path;
use std::process::Command;

use riprap::results::journal;

use crate::two_grains::*;

#[test]
fn python_reader_rolls_back_as_riprap_does() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("two.h5");
    write_small_file(&path);
    let good = std::fs::read(&path).expect("file");
    let program = "import sys, riprap_results\n\
        with riprap_results.Results(sys.argv[1]) as results: print(len(results.history), len(results.states))";
    let number = |at: usize| u64::from_le_bytes(good[at..at + 8].try_into().expect("eight bytes"));
    let commit = number(48);
    // By its layout: magic, identity, commit, old length, blocks with offset and length, CRC-32.
    let journal = |identity: &[u8], commit: u64| {
        let mut bytes = b"RIPRAPJ2".to_vec();
        bytes.extend_from_slice(identity);
        let (from, to) = (4096, good.len() - 5000);
        for number in [commit, good.len() as u64, 1, from as u64, (to - from) as u64] {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
        bytes.extend_from_slice(&good[from..to]);
        bytes.extend_from_slice(&crc32fast::hash(&bytes).to_le_bytes());
        bytes
    };
    let own = journal(&good[24..40], commit);
    let mut torn = good.clone();
    torn[4096..6000].fill(0);
    torn[56..64].copy_from_slice(&(commit + 1).to_le_bytes());
    torn.extend_from_slice(b"half of a chunk");
    let beside = journal::path_of(&path);
    // Its own: rolled back. Half of one, one of another file or commit: left alone, and so is the file.
    for (file, kept, rolled_back) in [
        (&torn, own.clone(), true),
        (&good, own[..own.len() / 2].to_vec(), false),
        (&good, journal(&[7; 16], commit), false),
        (&good, journal(&good[24..40], commit - 1), false),
    ] {
        std::fs::write(&path, file).expect("file");
        std::fs::write(&beside, &kept).expect("journal");
        let printed = run_python(&python, program, &[path.to_str().expect("path")]);
        assert_eq!(printed.trim(), "12 3");
        // Rolled back, no commit is under way, and it is no longer known to be as its run closed it.
        let mut expected = good.clone();
        if rolled_back {
            expected[56..72].fill(0);
        }
        assert!(std::fs::read(&path).expect("file") == expected);
        assert_eq!(beside.exists(), !rolled_back);
    }
}

#[test]
fn what_cannot_be_compared_is_said() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("two.h5");
    write_small_file(&path);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/compare_runs.py");
    // Two rows of one stage are nothing to compare.
    let output = Command::new(&python)
        .args([&script, &path])
        .args(["--out", "x.png"])
        .current_dir(dir.path())
        .output()
        .expect("python runs");
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && message.contains("has no consolidation"), "{message}");
    assert!(!message.contains("Traceback"), "{message}");
    let missing = Command::new(&python)
        .arg(&script)
        .args(["nowhere.h5", "--out", "x.png"])
        .output()
        .expect("python runs");
    let message = String::from_utf8_lossy(&missing.stderr);
    assert!(!missing.status.success() && message.contains("nowhere.h5: no such file"), "{message}");
    assert!(!message.contains("Traceback"), "{message}");
}

/// Strains of a run from a consolidated specimen begin with its first row; the report has a point in front of it too.
#[test]
fn runs_from_a_consolidated_specimen_begin_at_zero_strain() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let program = r#"
import sys, h5py, json, numpy
import matplotlib
matplotlib.use("Agg")
import compare_runs, plot_survival
from riprap_results import Results, ResultsError
def run(path, start_from):
    columns = {
        "stage": [0, 0], "axial_strain": [0.001, 0.002], "volumetric_strain": [0.0005, 0.001],
        "deviatoric_stress": [1.5e5, 2e5], "secant_modulus": [1e8, 1e8], "factorisations": [3, 4], "wall_time": [1.0, 2.0],
        "void_ratio": [0.4, 0.39], "energy_external": [10.0, 12.0], "energy_error": [0.1, 0.2],
    }
    with h5py.File(path, "w") as file:
        for name, values in columns.items():
            file[f"history/{name}"] = numpy.array(values)
        file["case/stages"], file["case/completed"] = "shear", json.dumps({"start_from": start_from})
    return Results(path)
with run(sys.argv[1] + "/one.h5", "other.vtkhdf") as results:
    strain, q, volume, e = results.shear("axial_strain", "deviatoric_stress", "volumetric_strain", "void_ratio")
    assert list(strain) == [0, 0.001, 0.002] and list(volume) == [0, 0.0005, 0.001]
    assert numpy.allclose(q, [5e4, 1.5e5, 2e5]) and numpy.isnan(e[0]) and len(e) == 3
    one = compare_runs.Run("one.h5", results)
assert list(one.factorisations) == [0, 3, 7] and one.consolidation == 0 and abs(one.error - 0.05) < 1e-12
compare_runs.draw([one])
with run(sys.argv[1] + "/two.h5", None) as results:
    try:
        compare_runs.Run("two.h5", results)
    except ResultsError as error:
        assert "has no consolidation" in str(error)
    else:
        raise AssertionError("a run without a consolidation was compared")
names = {"small_seed3": "small", "small_seed=3": "small", "small_3": "small", "d=20_seed=3": "d=20", "d=20": "d=20"}
assert {name: plot_survival.group_of(name) for name in names} == names
print("read")
"#;
    let folder = dir.path().to_str().expect("path");
    assert_eq!(run_python(&python, program, &[folder]).trim(), "read");
}

#[test]
fn parameters_are_compared_packing_by_packing() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let compare = |files: &[&Path], options: &[&str]| {
        let output = Command::new(&python)
            .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/compare_parameters.py"))
            .args(files)
            .args(options)
            .current_dir(dir.path())
            .output()
            .expect("python runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("text")
    };
    // By hand: -0.5 and -1.0 MPa off a default of 2.5 MPa in the mean, +5 and +15 % of the axial strain.
    let runs = dir.path().join("runs.csv");
    let head = "name,seed,status,axial_strain,mean_q_Pa,peak_q_Pa,volume_over_axial_strain,stabilisation_share,crushed_share";
    let rows = [
        "default,1,finished,0.1,2e6,4e6,-0.2,0.01,0",
        "default,2,finished,0.1,3e6,4e6,-0.2,0.01,0",
        "soft_rock,1,finished,0.1,1.5e6,3e6,-0.15,0.01,0",
        "soft_rock,2,stopped,0.1,2e6,3e6,-0.05,0.01,0",
    ];
    std::fs::write(&runs, format!("{head}\n{}\n", rows.join("\n"))).expect("a table");
    let table = compare(&[&runs], &["--out", "effects.png"]);
    let line = table.lines().find(|line| line.contains("soft rock")).expect("a row");
    assert!(line.contains("| -30 ± 10 % | +10 ± 5 % | 2, 1 not finished |"), "{line}");
    assert!(std::fs::read(dir.path().join("effects.png")).expect("a picture").starts_with(b"\x89PNG"));
    // Out of results files: two that are the same.
    let files = ["default_seed=1.h5", "same_seed=1.h5"].map(|name| dir.path().join(name));
    files.iter().for_each(|path| {
        write_small_file(path);
    });
    let table = compare(&[&files[0], &files[1]], &["--csv", "found.csv"]);
    assert!(
        table.lines().any(|line| line.contains("| same |") && line.contains("| +0 % | +0 % |")),
        "{table}"
    );
    assert_eq!(compare(&[&dir.path().join("found.csv")], &[]), table);
}
