//! Failed writes, kills and losses of power at chosen file operations, by a library that stands between the program and the system.
//!
//! `RIPRAP_TEST_FAULTS` sets which of each are tried, spread over all file operations of a run: `1000` is the first thousand, `1000..2000`
//! the second. Without it the first 24 are.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

use riprap::results::{Outcome, Reader, journal};

use crate::place::{Place, assert_same_bits, faults};

/// The library, built once.
static LIBRARY: LazyLock<(tempfile::TempDir, PathBuf)> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a temporary directory");
    let library = folder.path().join("inject.so");
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/solver_tests/faults/inject.c");
    let cc = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    let mut compiler = Command::new(cc);
    compiler.args(["-O1", "-fPIC", "-shared", "-w", "-o"]).arg(&library).arg(source).arg("-ldl");
    assert!(compiler.status().expect("a C compiler, which HDF5 needs too").success());
    (folder, library)
});

/// A run of the scene into `x.h5` with something done to it.
fn run(place: &Place, settings: &[(&str, &str)]) -> Output {
    run_case(place, &["scene.json"], settings)
}

/// As [`run`], of a case with options behind it.
fn run_case(place: &Place, case: &[&str], settings: &[(&str, &str)]) -> Output {
    let mut command = place.command(&["run", "--out", "x.h5", "--quiet", "--threads", "1"]);
    command.args(case);
    command.env("LD_PRELOAD", &LIBRARY.1).env("FAULT_MATCH", "x.h5");
    command.envs(settings.iter().copied());
    command.output().expect("riprap starts")
}

/// A file operation of a run: what, on which file, from which byte, and what was written.
struct Operation {
    what: String,
    on_journal: bool,
    offset: usize,
    bytes: Vec<u8>,
}

/// All file operations of an undisturbed run of the scene.
fn operations(place: &Place) -> Vec<Operation> {
    operations_of(place, &["scene.json"])
}

fn operations_of(place: &Place, case: &[&str]) -> Vec<Operation> {
    let log = place.path("log");
    let ended = run_case(place, case, &[("FAULT_LOG", &log.to_string_lossy()), ("FAULT_DATA", "1")]);
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    let logged = std::fs::read(&log).expect("the log");
    let (mut rest, mut operations) = (&logged[..], Vec::new());
    while let Some(end) = rest.iter().position(|&byte| byte == b'\n') {
        let line = String::from_utf8_lossy(&rest[..end]).into_owned();
        rest = &rest[end + 1..];
        let [_, what, path, offset, length] = line.split(' ').collect::<Vec<_>>()[..] else {
            panic!("{line}")
        };
        let written = ["write", "pwrite"].contains(&what);
        let length = if written { length.parse().expect("a length") } else { 0 };
        operations.push(Operation {
            what: what.into(),
            on_journal: path.ends_with(".journal"),
            offset: offset.parse().expect("an offset"),
            bytes: rest[..length].to_vec(),
        });
        rest = &rest[length..];
    }
    assert!(operations.len() > 60, "only {} operations", operations.len());
    operations
}

/// The operation that fault `t` hits: multiples of the golden ratio leave no gap, wherever a range of faults begins and ends.
fn spread(t: usize, operations: usize) -> usize {
    let share = (t as f64 * 0.618_033_988_749_894_8).fract();
    1 + (share * (operations - 1) as f64) as usize
}

fn clear(place: &Place) {
    for entry in std::fs::read_dir(place.path("")).expect("the folder") {
        let entry = entry.expect("an entry");
        if entry.file_name().to_string_lossy().starts_with("x.h5") {
            std::fs::remove_file(entry.path()).expect("removed");
        }
    }
}

/// That nothing is lost: what is there can be read, and the run goes on from it to its end, to the same bits.
#[track_caller]
fn goes_on(place: &Place, case: &str, reference: &Reader, what: &str) {
    if place.path("x.h5").exists() {
        let reader = Reader::open(&place.path("x.h5")).unwrap_or_else(|e| panic!("{what}: {e}"));
        reader.verify().unwrap_or_else(|e| panic!("{what}: {e}"));
        assert_ne!(reader.status().expect("a status").outcome, Outcome::Stopped, "{what}");
    }
    place.ends_with(0, &["run", case, "--out", "x.h5", "--resume", "--quiet"]);
    let finished = place.open("x.h5");
    assert!(finished.verify().unwrap_or_else(|e| panic!("{what}: {e}")).whole, "{what}");
    assert_same_bits(reference, &finished);
}

/// What stands under a run's name when it begins.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Before {
    Nothing,
    /// The same run, killed half way, with its journal if there is one: it is resumed.
    Begun,
    /// Another run's whole file: it is written over (`--force`).
    Another,
}

/// A run that faults are injected into.
struct Target {
    case: &'static str,
    arguments: Vec<&'static str>,
    before: Before,
    /// The files that stand there, by name.
    files: Vec<(PathBuf, Vec<u8>)>,
    /// Fewest of three runs: one that takes longer commits more often.
    operations: usize,
}

impl Target {
    fn new(place: &Place, case: &'static str, before: Before) -> Self {
        let path = place.path("x.h5");
        clear(place);
        let (mut arguments, mut files) = (vec![case], vec![]);
        match before {
            Before::Nothing => {}
            Before::Begun => {
                arguments.push("--resume");
                let half = operations_of(place, &[case]).len() / 2;
                clear(place);
                run_case(place, &[case], &[("FAULT_AT", &half.to_string()), ("FAULT_KIND", "kill_half")]);
                files = [path.clone(), journal::path_of(&path)].into_iter().filter(|f| f.exists()).collect();
            }
            Before::Another => {
                arguments.push("--force");
                std::fs::copy(place.path("scene.h5"), &path).expect("a copy");
                files = vec![path];
            }
        }
        let files = files.into_iter().map(|file| (file.clone(), bytes(&file))).collect();
        let mut target = Target { case, arguments, before, files, operations: 0 };
        let counts = (0..3).map(|_| {
            target.lay(place);
            operations_of(place, &target.arguments).len()
        });
        target.operations = counts.min().unwrap_or(0);
        target
    }

    fn lay(&self, place: &Place) {
        clear(place);
        for (file, bytes) in &self.files {
            std::fs::write(file, bytes).expect("a copy");
        }
    }

    /// Whether another run's file still stands there, untouched: the run failed before it took the name.
    fn is_untouched(&self) -> bool {
        let [(file, bytes_before)] = &self.files[..] else { return false };
        self.before == Before::Another && file.exists() && bytes(file) == *bytes_before
    }
}

#[test]
fn a_write_that_fails_once_is_told_and_loses_nothing() {
    let place = Place::new();
    place.reference("scene");
    place.ends_with(0, &["run", "short.json", "--out", "short.h5", "--quiet"]);
    let (scene, short) = (place.open("scene.h5"), place.open("short.h5"));
    let targets = [
        Target::new(&place, "short.json", Before::Nothing),
        Target::new(&place, "short.json", Before::Begun),
        Target::new(&place, "short.json", Before::Another),
        Target::new(&place, "scene.json", Before::Nothing),
    ];
    // The last two are no failures to a program that goes on behind them.
    let kinds = ["enospc", "eio", "edquot", "erofs", "short", "eintr"];
    let mut counts = std::collections::BTreeMap::new();
    let mut tried = std::collections::BTreeSet::new();
    for t in faults() {
        let (target, kind) = (&targets[t % 4], kinds[t / 4 % 6]);
        let at = spread(t / 24, target.operations);
        let what = format!("fault {t}: {kind} at {at} of {} {:?}", target.operations, target.arguments);
        let reference = if target.case == "scene.json" { &scene } else { &short };
        target.lay(&place);
        let settings = [("FAULT_AT", &*at.to_string()), ("FAULT_KIND", kind)];
        let ended = run_case(&place, &target.arguments, &settings);
        let said = String::from_utf8_lossy(&ended.stderr).into_owned();
        let end = match ended.status.code() {
            Some(4) => {
                assert!(said.contains("x.h5"), "{what}: {said}");
                if target.is_untouched() {
                    "told, old file untouched"
                } else {
                    goes_on(&place, target.case, reference, &what);
                    "told, resumed to the same bits"
                }
            }
            // Not every run has as many operations; and best efforts, such as taking away what is not needed, may fail.
            Some(0) => {
                let reader = place.open("x.h5");
                assert!(reader.verify().unwrap_or_else(|e| panic!("{what}: {e}")).whole, "{what}");
                assert_same_bits(reference, &reader);
                "finished with the same bits"
            }
            code => panic!("{what}: {code:?}: {said}"),
        };
        *counts.entry((kind, end)).or_insert(0) += 1;
        tried.insert((t % 4, kind, at));
    }
    println!("failed writes {:?}, {} of them unlike: {counts:?}", faults(), tried.len());
    let of = |failure: bool, told: bool| -> usize {
        let is_failure = |kind: &str| !["short", "eintr"].contains(&kind);
        let counted = counts
            .iter()
            .filter(|((kind, end), _)| is_failure(kind) == failure && end.starts_with("told") == told);
        counted.map(|(_, count)| count).sum()
    };
    assert!(of(true, true) > 3 * of(true, false), "{counts:?}");
}

#[test]
fn a_kill_at_any_file_operation_loses_nothing() {
    let place = Place::new();
    let reference = place.reference("scene");
    let operations = operations(&place).len();
    let mut killed = 0;
    for t in faults() {
        clear(&place);
        let at = spread(t, operations);
        let kind = ["kill_half", "kill_before", "kill_after"][t % 3];
        let ended = run(&place, &[("FAULT_AT", &at.to_string()), ("FAULT_KIND", kind)]);
        killed += usize::from(ended.status.code().is_none());
        goes_on(&place, "scene.json", &reference, &format!("{kind} at {at} of {operations}"));
    }
    println!("kills {:?}: {killed} killed", faults());
    assert!(killed > faults().len() / 2, "{killed}");
}

/// Numbers that scatter well (Weyl).
fn scattered(seed: usize, below: usize) -> usize {
    (seed.wrapping_mul(2_654_435_769) >> 7) % below.max(1)
}

/// The disk as a loss of power may leave it: what was synced is there, and of what was written later any part, in any order.
fn after_power_loss(operations: &[Operation], seed: usize) -> (Vec<u8>, Option<Vec<u8>>) {
    let put = |to: &mut Vec<u8>, operation: &Operation| {
        let end = operation.offset + operation.bytes.len();
        if operation.what == "ftruncate" {
            to.resize(operation.offset, 0);
        } else {
            to.resize(to.len().max(end), 0);
            to[operation.offset..end].copy_from_slice(&operation.bytes);
        }
    };
    let (mut file, mut pending) = (Vec::new(), Vec::new());
    let (mut journal, mut journal_is_safe): (Option<Vec<u8>>, bool) = (None, false);
    for operation in operations {
        match (operation.on_journal, operation.what.as_str()) {
            (true, "creat" | "trunc") => (journal, journal_is_safe) = (Some(Vec::new()), false),
            (true, "write" | "pwrite") => journal.get_or_insert_default().extend(&operation.bytes),
            (true, "fsync") => journal_is_safe = true,
            (true, "unlink") => journal = None,
            (true, _) => {}
            (false, "fsync") => pending.drain(..).for_each(|operation| put(&mut file, operation)),
            (false, "write" | "pwrite" | "ftruncate") => pending.push(operation),
            (false, _) => {}
        }
    }
    // All, none, or some of it.
    for (k, operation) in pending.iter().enumerate() {
        if [true, false, scattered(seed + 31 * k, 2) == 0][seed % 3] {
            put(&mut file, operation);
        }
    }
    if !journal_is_safe && let Some(bytes) = &mut journal {
        bytes.truncate(scattered(seed, bytes.len() + 1));
    }
    (file, journal)
}

#[test]
fn a_loss_of_power_leaves_the_last_commit() {
    let place = Place::new();
    let reference = place.reference("scene");
    let operations = operations(&place);
    let named = operations.iter().position(|operation| operation.what == "rename").expect("a rename");
    let journals = operations.iter().enumerate().filter(|(_, o)| o.on_journal && o.what == "unlink");
    // Behind the first restart point: the specimen's or scene's tables, the first state, the point.
    let first = journals.map(|(at, _)| at).filter(|&at| at > named).nth(1).expect("commits") + 1;
    let states = 20 * faults().start..20 * faults().end;
    for seed in states.clone() {
        let end = first + scattered(seed * 7 + 3, operations.len() - first);
        let (file, journal) = after_power_loss(&operations[..end], seed);
        clear(&place);
        let path = place.path("x.h5");
        std::fs::write(&path, &file).expect("written");
        if let Some(journal) = journal {
            std::fs::write(journal::path_of(&path), journal).expect("written");
        }
        let what = format!("after operation {end} of {}, seed {seed}", operations.len());
        let reader = Reader::open(&path).unwrap_or_else(|e| panic!("{what}: {e}"));
        reader.verify().unwrap_or_else(|e| panic!("{what}: {e}"));
        assert!(reader.restart().unwrap_or_else(|e| panic!("{what}: {e}")).is_some(), "{what}");
        drop(reader);
        if seed % (states.len() / 6).max(1) == 0 {
            goes_on(&place, "scene.json", &reference, &what);
        }
    }
}

/// A run killed within a commit, with its journal.
fn killed_in_commit(place: &Place) -> PathBuf {
    clear(place);
    let operations = operations(place);
    let synced = operations.iter().enumerate().filter(|(_, o)| o.on_journal && o.what == "fsync");
    for at in synced.map(|(at, _)| at).collect::<Vec<_>>().into_iter().rev() {
        clear(place);
        // Behind the mark, within the flush.
        run(place, &[("FAULT_AT", &(at + 4).to_string()), ("FAULT_KIND", "kill_half")]);
        let path = place.path("x.h5");
        // Its head says so: which operations a commit has hangs on the time.
        let is_under_way = |file: &[u8]| {
            let number = |at: usize| {
                file.get(at..at + 8)
                    .map(|bytes| bytes.iter().rev().fold(0, |n: u64, b| n << 8 | u64::from(*b)))
            };
            number(56) > number(48)
        };
        if journal::path_of(&path).exists() && path.exists() && is_under_way(&bytes(&path)) {
            return path;
        }
    }
    panic!("no kill hit a commit");
}

fn bytes(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// A finished file that was copied over a killed one: a reader rolled the old journal over it.
#[test]
fn a_journal_is_never_rolled_over_another_file() {
    let place = Place::new();
    place.reference("scene");
    let path = killed_in_commit(&place);
    let whole = bytes(&place.path("scene.h5"));
    std::fs::write(&path, &whole).expect("a copy");
    for look in [&["info", "x.h5"][..], &["info", "x.h5", "--verify"], &["export", "x.h5", "--csv", "csv"]] {
        place.ends_with(0, look);
        assert!(bytes(&path) == whole, "{look:?} changed it");
    }
    place.ends_with(0, &["run", "scene.json", "--out", "x.h5", "--resume"]);
    assert!(bytes(&path) == whole, "--resume changed it");
}

/// The same run by a second name: resumed to its end by the one, looked at by the other.
#[test]
fn a_second_name_of_a_file_finds_its_journal_and_no_old_one_harms_it() {
    let place = Place::new();
    let reference = place.reference("scene");
    let path = killed_in_commit(&place);
    let journal = bytes(&journal::path_of(&path));
    let second = place.path("second.h5");
    std::fs::hard_link(&path, &second).expect("a hard link");
    place.ends_with(0, &["run", "scene.json", "--out", "second.h5", "--resume"]);
    assert!(!journal::path_of(&path).exists(), "it was found by the name that the file remembers");
    std::fs::write(journal::path_of(&path), journal).expect("as from a backup");
    let whole = bytes(&path);
    place.ends_with(0, &["info", "x.h5"]);
    assert!(bytes(&path) == whole && bytes(&second) == whole);
    assert_same_bits(&reference, &place.open("x.h5"));
}

#[test]
fn a_journal_is_found_through_a_link_and_missed_where_it_is_gone() {
    let place = Place::new();
    let reference = place.reference("scene");
    let path = killed_in_commit(&place);
    std::fs::create_dir(place.path("links")).expect("a folder");
    std::os::unix::fs::symlink("../x.h5", place.path("links/l.h5")).expect("a link");
    place.ends_with(0, &["info", "links/l.h5", "--verify"]);
    assert!(!journal::path_of(&path).exists(), "put back");
    place.ends_with(0, &["run", "scene.json", "--out", "links/l.h5", "--resume", "--quiet"]);
    assert_same_bits(&reference, &place.open("x.h5"));

    let path = killed_in_commit(&place);
    let moved = place.path("moved.h5");
    std::fs::rename(&path, &moved).expect("moved");
    std::fs::rename(journal::path_of(&path), place.path("hidden")).expect("moved");
    let torn = bytes(&moved);
    for look in [&["info", "moved.h5"][..], &["run", "scene.json", "--out", "moved.h5", "--resume"]] {
        let told = place.ends_with(4, look);
        assert!(told.contains("killed within a commit") && told.contains("moved.h5.journal"), "{told}");
        assert!(bytes(&moved) == torn, "{look:?} changed it");
    }
    std::fs::rename(place.path("hidden"), journal::path_of(&moved)).expect("moved");
    place.ends_with(0, &["run", "scene.json", "--out", "moved.h5", "--resume", "--quiet"]);
    assert_same_bits(&reference, &place.open("moved.h5"));
}

/// Nothing tells a reader then whether the writer lives, who would go on with what was put back.
#[test]
fn without_locks_a_reader_puts_nothing_back() {
    let place = Place::new();
    place.reference("scene");
    let path = killed_in_commit(&place);
    let torn = bytes(&path);
    let look = place.command(&["info", "x.h5"]).env("HDF5_USE_FILE_LOCKING", "FALSE").output();
    let look = look.expect("riprap starts");
    let told = String::from_utf8_lossy(&look.stderr);
    assert!(look.status.code() == Some(4) && told.contains("within a commit"), "{told}");
    assert!(bytes(&path) == torn, "it was changed");
    let onwards = ["run", "scene.json", "--out", "x.h5", "--resume", "--quiet"];
    let ended = place.command(&onwards).env("HDF5_USE_FILE_LOCKING", "FALSE").output();
    assert_eq!(ended.expect("riprap starts").status.code(), Some(0));
    assert_same_bits(&place.reference("scene"), &place.open("x.h5"));
}

#[test]
fn planted_links_are_not_followed() {
    let place = Place::new();
    std::fs::write(place.path("victim"), "dear").expect("a file");
    for name in ["x.h5.new", "x.h5.journal"] {
        clear(&place);
        std::os::unix::fs::symlink(place.path("victim"), place.path(name)).expect("a link");
        let ended = run(&place, &[]);
        assert!([Some(0), Some(4)].contains(&ended.status.code()), "{ended:?}");
        assert_eq!(bytes(&place.path("victim")), b"dear", "{name}");
        assert!(!place.path("x.h5").is_symlink());
    }
    // What is no results file is not taken for one that a killed run left.
    clear(&place);
    std::fs::write(place.path("x.h5.new"), "a letter").expect("a file");
    let told = place.ends_with(4, &["run", "scene.json", "--out", "x.h5"]);
    assert!(told.contains("x.h5.new") && told.contains("in the way"), "{told}");
    assert_eq!(bytes(&place.path("x.h5.new")), b"a letter");
}
