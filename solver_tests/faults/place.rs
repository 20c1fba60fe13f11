//! A folder with cases, the program run in it, and the comparison of results files bit by bit.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::ops::Range;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::sync::LazyLock;

use riprap::results::Reader;

/// Sixteen grains, thirty-odd increments, restart points as often as their cost allows.
pub const SPECIMEN: &str = r#"{
  "title": "Sixteen grains", "seed": 4,
  "specimen": {"grains": 16, "aspect": 1.5, "grading": [["60 mm", 1.0], ["40 mm", 0.0]],
               "void_ratio": 0.9, "unreachable": "nearest", "cells_per_grain": 24},
  "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2, "damage": null},
  "contact": {"friction": 0.5},
  "membrane": {"kind": "pressure"},
  "solver": {"stabilisation": 1e-4},
  "stages": [{"kind": "consolidate", "pressure": "0.4 MPa"},
             {"kind": "shear", "axial_strain": 0.001, "increment": 2e-5}],
  "output": {"fields_every": 0.0002, "restart_every": 1}
}"#;

/// A block pushed along a plate and turned, then let go: two stages, sliding, a component set free.
pub const SCENE: &str = r#"{
  "title": "A block pushed and let go",
  "scene": {"gravity": [0, 0, -9.81], "bodies": [
    {"name": "plate", "shape": {"box": [1, 1, 0.1]}, "position": [0, 0, -0.05], "fixed": true},
    {"name": "ball", "shape": {"sphere": 0.03}, "position": [0.2, 0.2, 0.03]},
    {"name": "block", "shape": {"box": [0.1, 0.1, 0.1]}, "position": [0, 0, 0.05]}]},
  "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2, "damage": null},
  "contact": {"friction": 0.5},
  "stages": [
    {"kind": "load", "increments": 60, "bodies": {"block": {"displacement": ["1 mm", 0, null]},
                                                  "ball": {"rotation": [0, 0, 0.1]}}},
    {"kind": "load", "increments": 40, "bodies": {"block": {"displacement": ["0.5 mm", null, null],
                                                            "force": [null, null, "-20 N"]}}}],
  "output": {"fields_every": 0.1, "restart_every": 1}
}"#;

/// Seven increments of two bodies: a run of twenty milliseconds, for thousands of faults.
pub const SHORT: &str = r#"{
  "title": "short", "scene": {"gravity": [0, 0, -9.81], "bodies": [
    {"name": "plate", "shape": {"box": [1, 1, 0.1]}, "position": [0, 0, -0.05], "fixed": true},
    {"name": "block", "shape": {"box": [0.1, 0.1, 0.1]}, "position": [0, 0, 0.05]}]},
  "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2, "damage": null},
  "contact": {"friction": 0.5},
  "stages": [{"kind": "load", "increments": 4, "bodies": {"block": {"displacement": ["1 mm", 0, null]}}},
             {"kind": "load", "increments": 3, "bodies": {"block": {"displacement": ["0.5 mm", null, null],
                                                                    "force": [null, null, "-20 N"]}}}],
  "output": {"fields_every": 0.3, "restart_every": 1}
}"#;

/// The program: the one built with the tests, unless `RIPRAP_TEST_PROGRAM` names another.
static PROGRAM: LazyLock<PathBuf> = LazyLock::new(|| match std::env::var_os("RIPRAP_TEST_PROGRAM") {
    Some(path) => path.into(),
    None => env!("CARGO_BIN_EXE_riprap").into(),
});

/// Numbers of the faults that a test tries: `RIPRAP_TEST_FAULTS`, as `1000` or `1000..2000`, or the first 24.
pub fn faults() -> Range<usize> {
    match std::env::var("RIPRAP_TEST_FAULTS") {
        Ok(asked) => range_of(&asked).unwrap_or_else(|| panic!("RIPRAP_TEST_FAULTS: {asked:?}")),
        Err(_) => 0..24,
    }
}

fn range_of(asked: &str) -> Option<Range<usize>> {
    let (from, to) = asked.split_once("..").unwrap_or(("0", asked));
    Some(from.parse().ok()?..to.parse().ok()?)
}

pub struct Place {
    folder: tempfile::TempDir,
}

/// Files by name, made once for all tests: generating the specimen takes most of a run.
static MADE: LazyLock<BTreeMap<String, Vec<u8>>> = LazyLock::new(|| {
    let place = Place::new();
    let mut made = BTreeMap::new();
    for case in ["specimen", "scene"] {
        let (file, whole, begun) = (format!("{case}.json"), format!("{case}.h5"), format!("{case}_begun.h5"));
        place.ends_with(0, &["run", &file, "--out", &whole, "--quiet"]);
        let mut running = place.start(&["run", &file, "--out", &begun]);
        assert!(running.reaches(3), "{case} ended before it was interrupted");
        assert_eq!(running.interrupt(), Some(130));
        for name in [whole, begun] {
            let bytes = std::fs::read(place.path(&name)).expect("a results file");
            made.insert(name, bytes);
        }
    }
    made
});

impl Place {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary directory");
        for (name, text) in [("specimen.json", SPECIMEN), ("scene.json", SCENE), ("short.json", SHORT)] {
            std::fs::write(folder.path().join(name), text).expect("a case file");
        }
        Place { folder }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(&*PROGRAM);
        command.current_dir(self.folder.path()).args(arguments);
        command
    }

    /// Runs to the end, which must have this exit code; returns what it wrote to standard error.
    #[track_caller]
    pub fn ends_with(&self, code: i32, arguments: &[&str]) -> String {
        self.judged(code, self.command(arguments).output().expect("riprap starts"))
    }

    /// As [`Place::ends_with`], with little memory and a minute at most; and the seconds that it took.
    #[track_caller]
    pub fn ends_soon(&self, code: i32, arguments: &[&str]) -> (String, f64) {
        let begun = std::time::Instant::now();
        let output = Command::new("sh")
            .current_dir(self.folder.path())
            .args(["-c", "ulimit -v 4000000; exec timeout 60 \"$0\" \"$@\""])
            .arg(&*PROGRAM)
            .args(arguments)
            .output()
            .expect("sh starts");
        (self.judged(code, output), begun.elapsed().as_secs_f64())
    }

    /// As [`Place::ends_with`], with files limited to so many blocks of 512 bytes: like a full disk.
    #[track_caller]
    pub fn ends_on_full_disk(&self, code: i32, blocks: u64, arguments: &[&str]) -> String {
        let output = Command::new("sh")
            .current_dir(self.folder.path())
            .arg("-c")
            .arg(format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\""))
            .arg(&*PROGRAM)
            .args(arguments)
            .output()
            .expect("sh starts");
        self.judged(code, output)
    }

    #[track_caller]
    fn judged(&self, code: i32, output: Output) -> String {
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{stderr}");
        stderr
    }

    /// Starts a run that tells of every increment on standard output.
    pub fn start(&self, arguments: &[&str]) -> Running {
        let mut child = self
            .command(arguments)
            .args(["--progress", "json"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("riprap starts");
        let lines = BufReader::new(child.stdout.take().expect("its output"));
        Running { child, lines }
    }

    /// The uninterrupted run of a case.
    pub fn reference(&self, case: &str) -> Reader {
        let name = format!("{case}.h5");
        std::fs::write(self.path(&name), &MADE[&name]).expect("a copy");
        self.open(&name)
    }

    /// Lays down the file of a run of a case that was interrupted after three increments or a few more.
    pub fn lay_begun(&self, case: &str, name: &str) {
        std::fs::write(self.path(name), &MADE[&format!("{case}_begun.h5")]).expect("a copy");
    }

    pub fn open(&self, name: &str) -> Reader {
        Reader::open(&self.path(name)).unwrap_or_else(|e| panic!("{e}"))
    }
}

pub struct Running {
    pub child: Child,
    lines: BufReader<std::process::ChildStdout>,
}

impl Running {
    /// Waits for so many increments; tells whether the run came so far.
    pub fn reaches(&mut self, increments: usize) -> bool {
        let (mut seen, mut line) = (0, String::new());
        while seen < increments {
            line.clear();
            if self.lines.read_line(&mut line).is_ok_and(|read| read == 0) {
                return false;
            }
            seen += usize::from(line.contains(r#""event":"increment""#));
        }
        true
    }

    /// SIGKILL; then the exit is awaited.
    pub fn kill(mut self) {
        self.child.kill().expect("a signal");
        self.child.wait().expect("its end");
    }

    /// Ctrl-C; returns the exit code.
    pub fn interrupt(mut self) -> Option<i32> {
        let sent = Command::new("kill").args(["-INT", &self.child.id().to_string()]).status();
        assert!(sent.expect("kill").success());
        // Its pipe must not fill up.
        while self.lines.read_line(&mut String::new()).is_ok_and(|read| read > 0) {}
        self.child.wait().expect("its end").code()
    }
}

/// What no resumption may change: all of `/history` but the wall time, `/bodies`, `/grains`, `/contacts` and every saved state.
#[track_caller]
pub fn assert_same_bits(expected: &Reader, found: &Reader) {
    let mut names = vec!["status".to_string()];
    for group in ["history", "bodies", "grains", "contacts", "VTKHDF"] {
        collect(expected, group, &mut names);
        let (mut there, mut here) = (vec![], vec![]);
        collect(found, group, &mut there);
        collect(expected, group, &mut here);
        assert_eq!(there, here, "{group}");
    }
    assert!(names.len() > 60, "{names:?}");
    for name in names
        .iter()
        .filter(|name| !["status", "history/wall_time", "history/solving_time"].contains(&name.as_str()))
    {
        let bits = |reader: &Reader| -> Vec<u64> {
            let numbers = reader.floats(name).unwrap_or_else(|e| panic!("{e}"));
            numbers.into_iter().map(f64::to_bits).collect()
        };
        assert_eq!(expected.shape(name).ok(), found.shape(name).ok(), "{name}");
        assert!(bits(expected) == bits(found), "{name} differs");
    }
    assert_eq!(expected.status().expect("a status"), found.status().expect("a status"));
}

fn collect(reader: &Reader, group: &str, names: &mut Vec<String>) {
    for member in reader.members(group).unwrap_or_else(|e| panic!("{e}")) {
        let name = format!("{group}/{member}");
        match reader.shape(&name).is_ok() {
            true => names.push(name),
            false => collect(reader, &name, names),
        }
    }
}
