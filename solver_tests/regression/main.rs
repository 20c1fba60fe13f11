//! Small cases whose results are stored as named numbers, so that a change of behaviour is seen as one. Whether the numbers are right is the
//! business of `verification`; what is meant to change them is committed with new ones:
//!
//! ```text
//! RIPRAP_REWRITE=1 cargo test --release --test regression
//! ```
//!
//! `scalars.json` holds the last row of each run. Two kinds of processors may round differently, and grains that are seated magnify that: a friction
//! coefficient changed by 1e-12 moves the specimens' numbers by a tenth. So they hold for one kind of processor; tolerance of values: 1e-6. Counts of factorisations tell of lost speed: a tenth more or less (and two) is let pass.

use std::path::{Path, PathBuf};
use std::process::Command;

use riprap::results::Reader;
use serde_json::{Map, Value, json};

struct Member {
    name: &'static str,
    case: &'static str,
    arguments: &'static [&'static str],
    /// Datasets; of each the last number is kept.
    values: &'static [&'static str],
}

const STRESSES: &[&str] = &[
    "history/deviatoric_stress",
    "history/volumetric_strain",
    "history/void_ratio",
    "history/axial_stress_contacts",
    "history/coordination_number",
    "history/fabric_anisotropy",
    "history/energy_external",
    "history/energy_elastic",
    "history/energy_friction",
];

const MEMBERS: [Member; 4] = [
    Member {
        name: "rigid grains under a pressure cover",
        case: "cases/stages/shear.json",
        arguments: &["--fidelity", "rigid", "--set", "/stages/1/axial_strain=0.0006"],
        values: STRESSES,
    },
    Member {
        name: "condensed grains under a pressure cover",
        case: "cases/stages/shear.json",
        arguments: &["--fidelity", "condensed", "--set", "/stages/1/axial_strain=0.0006"],
        values: STRESSES,
    },
    Member {
        name: "a grain pressed until it breaks",
        case: "cases/crushing/grain_between_plates.json",
        arguments: &[],
        values: &["history/energy_external", "history/energy_damage"],
    },
    Member {
        name: "a block that rolls over an edge",
        case: "cases/scenes/rolling.json",
        arguments: &[],
        values: &["history/energy_external", "history/energy_elastic", "history/energy_friction"],
    },
];

/// The last row of a member's run.
fn row(member: &Member, folder: &Path) -> Map<String, Value> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let out = folder.join("out.h5");
    let output = Command::new(env!("CARGO_BIN_EXE_riprap"))
        .arg("run")
        .arg(root.join(member.case))
        .args(["--quiet", "--force", "--threads", "1", "--out"])
        .arg(&out)
        .args(member.arguments)
        .output()
        .expect("riprap starts");
    assert!(output.status.success(), "{}: {}", member.name, String::from_utf8_lossy(&output.stderr));
    let reader = Reader::open(&out).unwrap_or_else(|e| panic!("{e}"));
    let numbers = |name: &str| reader.floats(name).unwrap_or_else(|e| panic!("{}: {e}", member.name));
    let mut row = Map::new();
    for name in member.values {
        let last = numbers(name).last().copied().unwrap_or(f64::NAN);
        row.insert((*name).into(), json!(last));
    }
    row.insert("increments".into(), json!(reader.increments().unwrap_or_else(|e| panic!("{e}"))));
    row.insert("factorisations".into(), json!(numbers("history/factorisations").iter().sum::<f64>()));
    row
}

/// What differs between a stored and a computed row.
fn differences(stored: &Map<String, Value>, computed: &Map<String, Value>) -> Vec<String> {
    let mut found = vec![];
    for name in stored.keys().chain(computed.keys().filter(|name| !stored.contains_key(*name))) {
        let number = |row: &Map<String, Value>| row.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN);
        let (then, now) = (number(stored), number(computed));
        let allowed = match name.as_str() {
            "increments" => 0.0,
            "factorisations" => 0.1 * then + 2.0,
            _ => 1e-6 * then.abs(),
        };
        // Not a number is never within what is allowed.
        if !((now - then).abs() <= allowed) {
            found.push(format!("{name}: {now:e}, stored {then:e}"));
        }
    }
    found
}

#[test]
fn small_cases_come_to_what_they_came_to() {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("solver_tests/regression/scalars.json");
    let folder = tempfile::tempdir().expect("temporary directory");
    let computed: Map<String, Value> = MEMBERS
        .iter()
        .map(|member| (member.name.to_string(), Value::Object(row(member, folder.path()))))
        .collect();
    if std::env::var_os("RIPRAP_REWRITE").is_some() {
        let text = serde_json::to_string_pretty(&computed).expect("JSON") + "\n";
        std::fs::write(&file, text).expect("written");
        return;
    }
    let text = std::fs::read_to_string(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let stored: Map<String, Value> =
        serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let mut found = vec![];
    for (name, row) in &computed {
        let Some(then) = stored.get(name).and_then(Value::as_object) else {
            found.push(format!("{name}: not stored yet"));
            continue;
        };
        found.extend(
            differences(then, row.as_object().expect("a row")).iter().map(|what| format!("{name}: {what}")),
        );
    }
    assert!(
        found.is_empty(),
        "changed; if that is meant, run with RIPRAP_REWRITE=1:\n  {}",
        found.join("\n  ")
    );
}

#[test]
fn a_changed_number_is_seen() {
    let stored = json!({"history/void_ratio": 0.5, "increments": 10, "factorisations": 100.0});
    let same = |changed: Value| {
        differences(stored.as_object().expect("a row"), changed.as_object().expect("a row")).is_empty()
    };
    assert!(same(json!({"history/void_ratio": 0.5 + 4e-7, "increments": 10, "factorisations": 110.0})));
    assert!(!same(json!({"history/void_ratio": 0.5 + 6e-7, "increments": 10, "factorisations": 100.0})));
    assert!(!same(json!({"history/void_ratio": null, "increments": 10, "factorisations": 100.0})));
    assert!(!same(json!({"history/void_ratio": 0.5, "increments": 11, "factorisations": 100.0})));
    assert!(!same(json!({"history/void_ratio": 0.5, "increments": 10, "factorisations": 120.0})));
    assert!(!same(json!({"history/void_ratio": 0.5, "increments": 10})));
}
