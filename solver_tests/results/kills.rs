//! A writer that is killed, locked out or out of disk: what was committed stays.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use riprap::results::{Column, Existing, Outcome, Reader, Summary, Writer, journal};

use crate::two_grains::*;

/// Not a test: the process that the tests below kill. Writes `RIPRAP_TEST_FILE` without end.
#[test]
#[ignore = "run by other tests as a child process"]
fn child_writes_without_end() {
    let Ok(path) = std::env::var("RIPRAP_TEST_FILE") else { return };
    let limit: usize =
        std::env::var("RIPRAP_TEST_ROWS").ok().and_then(|rows| rows.parse().ok()).unwrap_or(1_000_000);
    let mesh = block_of_grains([6, 6, 6]);
    let path = PathBuf::from(path);
    let write = || -> riprap::error::Result<()> {
        let (mut writer, done) = match path.exists() && std::env::var("RIPRAP_TEST_RESUME").is_ok() {
            true => {
                let (writer, restart) = Writer::resume(&path)?;
                (writer, restart.rows)
            }
            false => {
                let mut writer = Writer::create(&path, &case_record(), Existing::Replace)?;
                writer.set_bodies(&["left"])?;
                writer.save_restart(0, &[])?;
                writer.commit()?;
                (writer, 0)
            }
        };
        writer.set_mesh(mesh.clone())?;
        for increment in done + 1..=limit {
            writer.append(&history_row(increment), &[body_row(increment)])?;
            if increment % 10 == 0 {
                let state = writer.save_state(&Fields::new(&mesh, increment / 10).at(increment))?;
                let table =
                    [Column::integers("first", "first grain", (0..1000).map(|n| n * increment as i64))];
                writer.write_table(&format!("contacts/{state}"), &table)?;
                writer.save_restart(increment as u64, &vec![(increment % 251) as u8; 200_000 + increment])?;
            }
            // As a run does, or all the time, so that kills hit commits.
            let committed = match std::env::var("RIPRAP_TEST_IN_TIME").is_ok() {
                true => writer.commit_in_time(),
                false => writer.commit(),
            };
            if let Err(error) = committed {
                assert!(
                    writer.finish(Outcome::Stopped, "as a run would", 0).is_err(),
                    "no commit after a failed one"
                );
                return Err(error);
            }
        }
        writer.finish(Outcome::Finished, "", limit as u64)
    };
    if let Err(error) = write() {
        eprintln!("ERROR {error}");
        std::process::exit(4);
    }
}

fn child(path: &Path) -> Command {
    let mut command = Command::new(std::env::current_exe().expect("this test"));
    command
        .args(["kills::child_writes_without_end", "--exact", "--ignored", "--nocapture"])
        .env("RIPRAP_TEST_FILE", path)
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command
}

fn spawn_child(path: &Path) -> Child {
    child(path).spawn().expect("a child process")
}

fn wait_for(what: &str, mut ready: impl FnMut() -> bool) {
    let start = Instant::now();
    while !ready() {
        assert!(start.elapsed() < Duration::from_secs(60), "waited a minute for {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn killed_writer_leaves_its_last_commit() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("killed.h5");
    let kills: u64 = std::env::var("RIPRAP_TEST_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(12);
    let (mut torn, mut in_commit) = (0, 0);
    for kill in 0..kills {
        let _ = std::fs::remove_file(&path);
        let _ = std::fs::remove_file(journal::path_of(&path));
        let mut child = spawn_child(&path);
        wait_for("the child's file", || path.exists());
        // A different moment each time, spread over the first 600 ms.
        std::thread::sleep(Duration::from_micros(20_000 + (kill * 48_271) % 600_000));
        child.kill().expect("kill");
        child.wait().expect("end of the child");
        // As it lies there, without a repair: for the record.
        in_commit += u64::from(journal::path_of(&path).exists());
        let plain = dir.path().join("plain.h5");
        std::fs::copy(&path, &plain).expect("copy");
        torn += u64::from(Reader::open(&plain).and_then(|reader| Summary::of(&reader)).is_err());
        // As riprap opens it.
        let reader = Reader::open(&path).expect("opens after a kill");
        // A journal that was cut off while it was written is left: it says nothing, and goes when the run goes on.
        assert!(!reader.is_live());
        let summary = Summary::of(&reader).expect("everything can be read");
        assert_eq!(summary.status, "killed");
        assert_eq!(summary.last_good_increment as usize, summary.increments, "row and status are one commit");
        let expected: Vec<f64> = (1..=summary.increments).map(|i| history_row(i).axial_strain).collect();
        assert_eq!(reader.history("axial_strain").expect("column"), expected);
        if summary.increments > 0 {
            assert_eq!(reader.shape("bodies/left/force").expect("shape")[0], summary.increments);
        }
        if reader.has("VTKHDF") {
            assert_eq!(summary.states.len(), summary.increments / 10);
            let stress = reader.floats("VTKHDF/CellData/stress").expect("stress");
            assert!(stress.len() >= summary.states.len() * summary.cells * 6);
        }
        if summary.increments >= 10 {
            let restart = reader.restart().expect("restart").expect("a restart point");
            assert_eq!(restart.rows, summary.increments / 10 * 10);
            assert!(restart.bytes.iter().all(|&byte| byte == (restart.rows % 251) as u8));
        }
    }
    println!("{kills} kills, {in_commit} in a commit, {torn} files unreadable before the roll-back");
}

#[test]
fn run_killed_again_and_again_ends_as_an_uninterrupted_one() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let (killed, whole) = (dir.path().join("killed.h5"), dir.path().join("whole.h5"));
    let rows = "150";
    for kill in 0..5_u64 {
        let mut running = child(&killed)
            .env("RIPRAP_TEST_ROWS", rows)
            .env("RIPRAP_TEST_RESUME", "1")
            .spawn()
            .expect("a child process");
        // Killed before its first restart point, a run has nothing to be continued from.
        wait_for("the child's first restart point", || {
            Reader::open(&killed).is_ok_and(|reader| matches!(reader.restart(), Ok(Some(_))))
        });
        std::thread::sleep(Duration::from_micros(60_000 + (kill * 48_271) % 90_000));
        running.kill().expect("kill");
        running.wait().expect("end of the child");
    }
    for path in [&killed, &whole] {
        let mut running = child(path);
        let ended = running.env("RIPRAP_TEST_ROWS", rows).env("RIPRAP_TEST_RESUME", "1").status();
        assert!(ended.expect("runs").success());
    }
    let (a, b) = (Reader::open(&whole).expect("opens"), Reader::open(&killed).expect("opens"));
    assert_eq!(a.members("contacts").expect("names"), b.members("contacts").expect("names"));
    for name in [
        "history/increment",
        "history/axial_strain",
        "bodies/left/position",
        "contacts/0/first",
        "contacts/14/first",
        "VTKHDF/Points",
        "VTKHDF/Connectivity",
        "VTKHDF/PointData/displacement",
        "VTKHDF/CellData/damage",
        "VTKHDF/CellData/stress",
        "VTKHDF/Steps/Values",
        "VTKHDF/Steps/PointDataOffsets/displacement",
    ] {
        let (of_whole, of_killed) = (a.floats(name).expect("numbers"), b.floats(name).expect("numbers"));
        assert!(of_whole == of_killed && !of_whole.is_empty(), "{name} differs");
    }
    assert_eq!(
        a.restart().expect("restart").map(|r| r.bytes),
        b.restart().expect("restart").map(|r| r.bytes)
    );
    assert_eq!(a.status().expect("status"), b.status().expect("status"));
}

#[test]
fn locked_file_is_refused_to_writers_and_open_to_readers() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("locked.h5");
    let mut child = child(&path).env("RIPRAP_TEST_IN_TIME", "1").spawn().expect("a child process");
    wait_for("the child's file", || path.exists());
    let replaced = Writer::create(&path, &case_record(), Existing::Replace).err();
    let resumed = Writer::resume(&path).err();
    // The child does nothing but write, so a read may fall into a commit, the more the larger the file has grown.
    let (mut read, mut read_well) = (Vec::new(), 0);
    while read_well < 5 && read.len() < 20 {
        read.push(Reader::open(&path).and_then(|reader| Ok((reader.is_live(), reader.increments()?))));
        read_well += usize::from(matches!(read.last(), Some(Ok((true, _)))));
    }
    child.kill().expect("kill");
    child.wait().expect("end of the child");
    for error in [replaced, resumed] {
        let message = error.expect("a refusal").to_string();
        assert!(message.contains("in use"), "{message}");
    }
    assert!(read_well >= 5, "{read:?}");
}

#[test]
#[cfg(unix)]
fn full_disk_is_an_error_and_keeps_what_was_committed() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("full.h5");
    let output = Command::new("sh")
        .arg("-c")
        // A limit on the size of files acts like a full disk: writes fail from some moment on. 1,500 kB.
        .arg("trap '' XFSZ; ulimit -f 3000; exec \"$0\" kills::child_writes_without_end --exact --ignored --nocapture")
        .arg(std::env::current_exe().expect("this test"))
        .env("RIPRAP_TEST_FILE", &path)
        .output()
        .expect("sh runs");
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(4), "an error, not a panic or a signal: {errors}");
    assert!(!journal::path_of(&path).exists(), "put back by the writer itself");
    assert!(errors.contains("full.h5") && errors.contains("may not grow further"), "{errors}");
    let reader = Reader::open(&path).expect("opens");
    let summary = Summary::of(&reader).expect("everything can be read");
    assert!(summary.increments >= 1, "{summary}");
}
