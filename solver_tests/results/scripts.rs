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
    for whole_journal in [true, false] {
        let snapshot = journal::snapshot(&path, good.len() as u64, &[(4096, 1000)]).expect("snapshot");
        journal::write(&path, &snapshot, false).expect("journal");
        if whole_journal {
            let mut torn = good.clone();
            torn[..2000].fill(0);
            torn.extend_from_slice(b"half of a chunk");
            std::fs::write(&path, &torn).expect("file");
        } else {
            let journal = std::fs::read(journal::path_of(&path)).expect("journal");
            std::fs::write(journal::path_of(&path), &journal[..journal.len() / 2]).expect("journal");
        }
        let printed = run_python(&python, program, &[path.to_str().expect("path")]);
        assert_eq!(printed.trim(), "12 3");
        assert_eq!(std::fs::read(&path).expect("file"), good);
        assert!(!journal::path_of(&path).exists());
    }
}

#[test]
fn scripts_draw_their_pictures() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("two.h5");
    write_small_file(&path);
    let draw = |script: &str, options: &[&str], picture: &str| {
        let picture = dir.path().join(picture);
        let output = Command::new(&python)
            .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts").join(script))
            .arg(&path)
            .args(options)
            .arg("--out")
            .arg(&picture)
            .output()
            .expect("python runs");
        assert!(output.status.success(), "{script}: {}", String::from_utf8_lossy(&output.stderr));
        let bytes = std::fs::read(&picture).expect("picture");
        assert!(bytes.starts_with(b"\x89PNG") && bytes.len() > 5000, "{script}: {} bytes", bytes.len());
    };
    draw("plot_history.py", &[], "curves.png");
    draw("plot_history.py", &["--energy"], "energies.png");
    draw("plot_specimen.py", &["--state", "0", "-1", "--colour", "damage", "--size", "200"], "specimen.png");
    let missing = Command::new(&python)
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/plot_history.py"))
        .args(["nowhere.h5", "--out", "x.png"])
        .output()
        .expect("python runs");
    let message = String::from_utf8_lossy(&missing.stderr);
    assert!(!missing.status.success() && message.contains("nowhere.h5: no such file"), "{message}");
    assert!(!message.contains("Traceback"), "{message}");
}
