//! The plan of a batch: a JSON file that names cases and what to change in them.
//!
//! ```jsonc
//! {
//!   "case": "../quick_start.json",                  // relative to the plan; or "cases": ["a.json", {"name": …, "case": …, "set": {…}}]
//!   "set": {"/stages/1/axial_strain": 0.02},        // of every member, as --set of riprap run
//!   "grid": {"/stages/0/pressure": ["0.4 MPa", "0.8 MPa"], "/contact/friction": [0.5, 0.65]},   // every combination
//!   "seeds": [1, 2, 3],                             // or {"from": 1, "count": 20}: each member with each seed
//!   "out": "results/friction",                      // results files go there; default: results/<plan> beside the plan
//!   "jobs": 2, "threads": 1,                        // processes at a time; threads of each
//!   "slurm": {"time": "24:00:00", "memory": "8G", "partition": "cpu", "options": ["--account=rock"],
//!             "members_per_task": 10, "setup": ["module load gcc"], "program": "apptainer exec riprap.sif riprap"}
//! }
//! ```
//!
//! Members are all combinations of cases, grid points and seeds. Every fault is listed at once with its JSON path, those of
//! the plan and those of the members that what is sound of it makes.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use crate::case::{
    RawCase, fault_of_pointer, meant, nearest, path_of_key, read, read_named, shortened, shown,
};
use crate::error::{Error, Fault, Faults, Result};

use super::cluster::{self, SLURM_KEYS, Slurm};
use super::{Member, Refusal, safe};

/// More members than this are taken for a slip.
const MOST_MEMBERS: usize = 100_000;

/// Bytes of a member's name at most: file systems take names of 255, and endings come behind it.
const LONGEST_NAME: usize = 200;

/// A checked plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    pub file: PathBuf,
    pub members: Vec<Member>,
    /// Folder of the results files.
    pub out: PathBuf,
    pub jobs: Option<usize>,
    pub threads: usize,
    pub slurm: Slurm,
}

/// Of a plan; `cases/plan.schema.json` says more of each.
pub const KEYS: [&str; 9] = ["case", "cases", "set", "grid", "seeds", "out", "jobs", "threads", "slurm"];

/// One entry of `cases`.
struct Entry {
    name: String,
    case: PathBuf,
    set: Vec<(String, Value)>,
    /// Where it stands in the plan.
    path: String,
}

/// Reads and checks a plan; `out` replaces its own folder.
///
/// # Errors
/// `Error::Io` and `Error::Json` for the plan itself, `Error::Case` with all of its faults and those of its cases.
pub fn read_plan(file: &Path, out: Option<&Path>) -> Result<Plan> {
    let raw = read(file)?;
    let mut faults = raw.faults.clone();
    let folder = file.parent().unwrap_or(Path::new(""));
    let plan = check(&raw, folder, out, &mut faults);
    match plan {
        Some(plan) if faults.is_empty() => Ok(plan),
        _ => Err(Error::Case { file: file.to_path_buf(), faults }),
    }
}

fn check(raw: &RawCase, folder: &Path, out: Option<&Path>, faults: &mut Vec<Fault>) -> Option<Plan> {
    let Value::Object(map) = &raw.value else {
        faults.fault("$", shown(&raw.value), "is no object", format!("the keys {}", KEYS.join(", ")));
        return None;
    };
    unknown_keys(map, &KEYS, "$", faults);
    let common = set_of(map.get("set"), "$.set", faults);
    let entries = entries_of(map, folder, faults);
    let grid = grid_of(map.get("grid"), faults);
    let seeds = seeds_of(map.get("seeds"), faults);
    for (pointer, _) in &grid {
        if pointer == "/seed" && !seeds.is_empty() {
            let problem = "is overruled by $.seeds";
            faults.fault("$.grid", pointer, problem, "seeds in one of the two places");
        }
        if common.iter().any(|(set, _)| set == pointer) {
            faults.fault("$.grid", pointer, "is in $.set too", "a pointer in one of the two places");
        }
    }
    let stem = raw.file.file_stem().unwrap_or(raw.file.as_os_str());
    let own_out = match map.get("out") {
        None => folder.join("results").join(stem),
        Some(Value::String(text)) if !text.is_empty() => folder.join(text),
        Some(other) => {
            faults.fault("$.out", shown(other), "is no folder", "a text in quotes");
            folder.join("results")
        }
    };
    let (out, place) = out.map_or((own_out, "$.out"), |given| (given.to_path_buf(), "--out"));
    // It stands in a comment of a job array's script, which a line break would end.
    let whole = std::path::absolute(&out).unwrap_or_else(|_| out.clone());
    if whole.to_string_lossy().contains(|c: char| c.is_control()) {
        let accepted = "a path without line breaks and other control characters";
        faults.fault(place, format!("{:?}", whole), "is no line of text", accepted);
    }
    let count = |key: &str, faults: &mut Vec<Fault>| match map.get(key) {
        None => None,
        Some(value) => match value.as_u64() {
            Some(n) if (1..=1024).contains(&n) => Some(n as usize),
            _ => {
                let place = path_of_key("$", key);
                faults.fault(place, shown(value), "is out of range", "a whole number from 1 to 1024");
                None
            }
        },
    };
    let (jobs, threads) = (count("jobs", faults), count("threads", faults).unwrap_or(1));
    if let Some(Value::Object(own)) = map.get("slurm") {
        unknown_keys(own, &SLURM_KEYS, "$.slurm", faults);
    }
    let slurm = cluster::slurm_of(map.get("slurm"), faults);
    let points: usize = grid.iter().map(|(_, values)| values.len()).product();
    let number = entries.len().saturating_mul(points).saturating_mul(seeds.len().max(1));
    if number > MOST_MEMBERS {
        let accepted = format!("at most {MOST_MEMBERS}");
        faults.fault("$", format!("{number} members"), "are too many", accepted);
        return None;
    }
    let members = members_of(&entries, &common, &grid, &seeds, &out, faults);
    Some(Plan { file: raw.file.clone(), members, out, jobs, threads, slurm })
}

fn unknown_keys(map: &Map<String, Value>, known: &[&str], path: &str, faults: &mut Vec<Fault>) {
    for (key, value) in map.iter().filter(|(key, _)| !known.contains(&key.as_str()) && *key != "$schema") {
        let problem = meant("is an unknown key", nearest(key, known.iter().copied()));
        let accepted = format!("the keys {}", known.join(", "));
        faults.fault(path_of_key(path, key), shown(value), problem, accepted);
    }
}

fn set_of(value: Option<&Value>, path: &str, faults: &mut Vec<Fault>) -> Vec<(String, Value)> {
    match value {
        None => Vec::new(),
        Some(Value::Object(map)) => {
            for (pointer, value) in map {
                if let Some((problem, accepted)) = fault_of_pointer(pointer) {
                    let place = path_of_key(path, &shortened(pointer));
                    faults.fault(place, shown(value), problem, accepted);
                }
            }
            let sound = map.iter().filter(|(pointer, _)| fault_of_pointer(pointer).is_none());
            sound.map(|(pointer, value)| (pointer.clone(), value.clone())).collect()
        }
        Some(other) => {
            faults.fault(path, shown(other), "is no object", "JSON pointers with their values");
            Vec::new()
        }
    }
}

fn entries_of(map: &Map<String, Value>, folder: &Path, faults: &mut Vec<Fault>) -> Vec<Entry> {
    let stem = |case: &Path| case.file_stem().unwrap_or(case.as_os_str()).to_string_lossy().into_owned();
    let base = match map.get("case") {
        None => None,
        Some(Value::String(text)) => Some(folder.join(text)),
        Some(other) => {
            faults.fault("$.case", shown(other), "is no file", "a text in quotes");
            return Vec::new();
        }
    };
    let items = match map.get("cases") {
        None => match base {
            Some(case) => {
                return vec![Entry { name: stem(&case), case, set: Vec::new(), path: "$.case".into() }];
            }
            None => {
                faults.fault("$.case", "nothing", "is missing", "a case file, or a list \"cases\"");
                return Vec::new();
            }
        },
        Some(Value::Array(items)) if !items.is_empty() => items,
        Some(other) => {
            let accepted = "a list of case files, or of objects with the keys name, case, set";
            faults.fault("$.cases", shown(other), "is no list of cases", accepted);
            return Vec::new();
        }
    };
    let mut entries: Vec<Entry> = Vec::new();
    for (at, item) in items.iter().enumerate() {
        let path = format!("$.cases[{at}]");
        let mut entry = match item {
            Value::String(text) => {
                let case = folder.join(text);
                Entry { name: stem(&case), case, set: Vec::new(), path }
            }
            Value::Object(own) => {
                unknown_keys(own, &["name", "case", "set"], &path, faults);
                let case = match (own.get("case"), &base) {
                    (Some(Value::String(text)), _) => folder.join(text),
                    (None, Some(base)) => base.clone(),
                    (None, None) => {
                        let accepted = "a case file, here or as $.case";
                        faults.fault(format!("{path}.case"), "nothing", "is missing", accepted);
                        continue;
                    }
                    (Some(other), _) => {
                        let place = format!("{path}.case");
                        faults.fault(place, shown(other), "is no file", "a text in quotes");
                        continue;
                    }
                };
                let name = match own.get("name") {
                    None => stem(&case),
                    Some(Value::String(name)) if !safe(name).is_empty() => name.clone(),
                    Some(other) => {
                        let place = format!("{path}.name");
                        faults.fault(place, shown(other), "is no name", "a text in quotes");
                        continue;
                    }
                };
                Entry { name, case, set: set_of(own.get("set"), &format!("{path}.set"), faults), path }
            }
            other => {
                let accepted = "a case file, or an object with the keys name, case, set";
                faults.fault(path, shown(other), "is no case", accepted);
                continue;
            }
        };
        if let Some(first) = entries.iter().find(|other| safe(&other.name) == safe(&entry.name)) {
            let problem = format!("has the name of {}", first.path);
            faults.fault(&entry.path, &entry.name, problem, "a \"name\" of its own");
            // Its members are told apart by the place in the plan.
            entry.name = entry.path.clone();
        }
        entries.push(entry);
    }
    let brings_its_own = |item: &Value| item.as_object().is_none_or(|own| own.contains_key("case"));
    if let (Some(unused), true) = (map.get("case"), items.iter().all(brings_its_own)) {
        let accepted = "an entry of \"cases\" without its own, or none here";
        faults.fault("$.case", shown(unused), "is used by none of \"cases\"", accepted);
    }
    entries
}

fn grid_of(value: Option<&Value>, faults: &mut Vec<Fault>) -> Vec<(String, Vec<Value>)> {
    let map = match value {
        None => return Vec::new(),
        Some(Value::Object(map)) => map,
        Some(other) => {
            faults.fault("$.grid", shown(other), "is no object", "JSON pointers with lists of values");
            return Vec::new();
        }
    };
    let mut grid = Vec::new();
    for (pointer, values) in map {
        let place = path_of_key("$.grid", &shortened(pointer));
        let wrong = fault_of_pointer(pointer);
        let aims = wrong.is_none();
        if let Some((problem, accepted)) = wrong {
            faults.fault(&place, shortened(pointer), problem, accepted);
        }
        let mut own: Vec<Value> = Vec::new();
        match values {
            Value::Array(values) if !values.is_empty() => {
                for (at, value) in values.iter().enumerate() {
                    if own.contains(value) {
                        let place = format!("{place}[{at}]");
                        faults.fault(place, shown(value), "is there twice", "each value once");
                    } else {
                        own.push(value.clone());
                    }
                }
            }
            other => {
                faults.fault(place, shown(other), "is no list of values", "a list, not empty");
                // A value without its brackets: the members have it.
                own.extend(Some(other).filter(|value| !value.is_array() && !value.is_object()).cloned());
            }
        }
        if aims && !own.is_empty() {
            grid.push((pointer.clone(), own));
        }
    }
    grid
}

fn seeds_of(value: Option<&Value>, faults: &mut Vec<Fault>) -> Vec<u64> {
    let accepted = format!(
        "a list of whole numbers, or {{\"from\": 1, \"count\": 20}} with a count from 1 to {MOST_MEMBERS}"
    );
    match value {
        None => Vec::new(),
        Some(Value::Array(items)) if !items.is_empty() => {
            let mut seeds = Vec::new();
            for (at, item) in items.iter().enumerate() {
                match item.as_u64() {
                    Some(seed) if !seeds.contains(&seed) => seeds.push(seed),
                    Some(_) => {
                        let place = format!("$.seeds[{at}]");
                        faults.fault(place, shown(item), "is there twice", "each seed once");
                    }
                    None => {
                        let place = format!("$.seeds[{at}]");
                        let accepted = format!("a whole number up to {}", u64::MAX);
                        faults.fault(place, shown(item), "is no seed", accepted);
                    }
                }
            }
            seeds
        }
        Some(Value::Object(map)) => {
            unknown_keys(map, &["from", "count"], "$.seeds", faults);
            let from = map.get("from").map_or(Some(1), Value::as_u64);
            let count =
                map.get("count").and_then(Value::as_u64).filter(|n| *n >= 1 && *n <= MOST_MEMBERS as u64);
            match (from, count) {
                (Some(from), Some(count)) if from.checked_add(count).is_some() => {
                    (from..from + count).collect()
                }
                _ => {
                    faults.fault("$.seeds", shown(&Value::Object(map.clone())), "are no seeds", accepted);
                    Vec::new()
                }
            }
        }
        Some(other) => {
            faults.fault("$.seeds", shown(other), "are no seeds", accepted);
            Vec::new()
        }
    }
}

fn members_of(
    entries: &[Entry],
    common: &[(String, Value)],
    grid: &[(String, Vec<Value>)],
    seeds: &[u64],
    out: &Path,
    faults: &mut Vec<Fault>,
) -> Vec<Member> {
    let mut members: Vec<Member> = Vec::new();
    let words = short_names(grid);
    for entry in entries {
        let source = match read_named(&entry.case) {
            Ok(source) => source,
            Err(error) => {
                let shown = entry.case.display();
                faults.fault(&entry.path, shown, error.to_string(), "a case file");
                continue;
            }
        };
        let points: usize = grid.iter().map(|(_, values)| values.len()).product();
        for point in 0..points {
            let (mut name, mut overrides) = (entry.name.clone(), common.to_vec());
            overrides.extend(entry.set.iter().cloned());
            let mut rest = point;
            for ((pointer, values), word) in grid.iter().zip(&words) {
                let value = &values[rest % values.len()];
                rest /= values.len();
                overrides.push((pointer.clone(), value.clone()));
                let text = value.as_str().map_or_else(|| value.to_string(), str::to_string);
                name.push_str(&format!("_{word}={}", text.replace(' ', "")));
            }
            let with_seeds: Vec<(String, Vec<(String, Value)>)> = match seeds {
                [] => vec![(name, overrides)],
                seeds => seeds
                    .iter()
                    .map(|&seed| {
                        let mut own = overrides.clone();
                        own.push(("/seed".into(), Value::from(seed)));
                        (format!("{name}_seed={seed}"), own)
                    })
                    .collect(),
            };
            for (name, overrides) in with_seeds {
                if safe(&name).len() > LONGEST_NAME {
                    let problem = "makes a member whose name is too long for its files";
                    let accepted = format!("a \"name\" and values of at most {LONGEST_NAME} bytes together");
                    faults.fault(&entry.path, shortened(&safe(&name)), problem, accepted);
                    continue;
                }
                match Member::new(&name, &source, overrides, out) {
                    Ok(member) if members.iter().any(|other| other.name == member.name) => {
                        let problem = "is the name of two members";
                        faults.fault(&entry.path, &member.name, problem, "values that differ as file names");
                    }
                    Ok(member) => members.push(member),
                    Err(refusal) => list(&name, &refusal, faults),
                }
            }
        }
    }
    members
}

/// Adds the faults of a member's case, each led by the member's name; what a member before it had too is not repeated.
pub fn list(name: &str, refusal: &Refusal, faults: &mut Vec<Fault>) {
    for fault in refusal.faults() {
        let same = |known: &Fault| {
            known.path.ends_with(&format!(": {}", fault.path))
                && known.value == fault.value
                && known.problem == fault.problem
        };
        if !faults.iter().any(same) {
            faults.push(Fault { path: format!("{}: {}", safe(name), fault.path), ..fault.clone() });
        }
    }
}

/// The last key of each pointer, or as many as tell the pointers apart.
fn short_names(grid: &[(String, Vec<Value>)]) -> Vec<String> {
    let tail = |pointer: &str, keys: usize| -> String {
        let all: Vec<&str> = pointer.split('/').filter(|key| !key.is_empty()).collect();
        all[all.len().saturating_sub(keys)..].join(".")
    };
    let name = |(pointer, _): &(String, Vec<Value>)| {
        (1..=pointer.split('/').count())
            .map(|keys| (tail(pointer, keys), keys))
            .find(|(word, keys)| grid.iter().filter(|(other, _)| tail(other, *keys) == *word).count() == 1)
            .map_or_else(|| pointer.clone(), |(word, _)| word)
    };
    grid.iter().map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASE: &str = r#"{"specimen": {"grains": 80, "aspect": 2, "void_ratio": 0.7, "grading": [["60 mm", 1], ["40 mm", 0]]},
        "rock": {"density": 2180, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2, "damage": null},
        "contact": {"friction": 0.65}, "membrane": {"kind": "pressure"},
        "stages": [{"kind": "consolidate", "pressure": "0.8 MPa"}, {"kind": "shear", "axial_strain": 0.1}]}"#;

    fn plan(text: &str) -> Result<Plan> {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("rock.json"), CASE).expect("a case");
        std::fs::write(folder.path().join("plan.json"), text).expect("a plan");
        read_plan(&folder.path().join("plan.json"), None)
    }

    #[test]
    fn grids_lists_and_seeds_multiply() {
        let plan = plan(
            r#"{"cases": ["rock.json", {"name": "loose rock", "case": "rock.json", "set": {"/specimen/void_ratio": 0.8}}],
            "grid": {"/stages/0/pressure": ["0.4 MPa", "0.8 MPa"], "/contact/friction": [0.5, 0.6, 0.65]},
            "seeds": {"from": 3, "count": 2}, "jobs": 4}"#,
        )
        .unwrap_or_else(|e| panic!("{e}"));
        assert_eq!((plan.members.len(), plan.jobs, plan.threads), (2 * 2 * 3 * 2, Some(4), 1));
        assert_eq!(plan.members[0].name, "rock_pressure=0.4MPa_friction=0.5_seed=3");
        assert!(plan.out.ends_with("results/plan"), "{:?}", plan.out);
        let last = &plan.members[23];
        assert_eq!(last.name, "loose_rock_pressure=0.8MPa_friction=0.65_seed=4");
        assert_eq!(last.completed.pointer("/specimen/void_ratio"), Some(&Value::from(0.8)));
        assert_eq!(last.completed["seed"], 4);
        // The process is given what the check saw.
        let arguments = last.arguments(2);
        assert!(arguments.contains(&"/stages/0/pressure=\"0.8 MPa\"".to_string()), "{arguments:?}");
    }

    #[test]
    fn names_of_like_keys_differ() {
        let plan =
            plan(r#"{"case": "rock.json", "grid": {"/contact/friction": [0.5], "/plates/friction": [0.1]}}"#)
                .unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(plan.members[0].name, "rock_contact.friction=0.5_plates.friction=0.1");
    }

    #[track_caller]
    fn faulty(text: &str, says: &[&str]) {
        let message = plan(text).expect_err(text).to_string();
        for part in says {
            assert!(message.contains(part), "{text}\n{message}\nshould say {part:?}");
        }
    }

    #[test]
    fn faults_name_their_paths() {
        faulty("[]", &["$: is no object"]);
        faulty("{}", &["$.case: is missing"]);
        faulty(
            r#"{"case": "rock.json", "gird": {}}"#,
            &["$.gird: is an unknown key: did you mean \"grid\"?"],
        );
        faulty(r#"{"case": "none.json"}"#, &["$.case: cannot read"]);
        faulty(r#"{"case": 3, "jobs": 0}"#, &["$.case: is no file", "$.jobs: is out of range", "found 0"]);
        faulty(
            r#"{"case": "rock.json", "grid": {"/seed": 3}}"#,
            &["$.grid[\"/seed\"]: is no list of values"],
        );
        faulty(
            r#"{"case": "rock.json", "grid": {"seed": [3]}}"#,
            &["$.grid.seed: the pointer must begin with /"],
        );
        faulty(
            r#"{"case": "rock.json", "seeds": [1, 2, 1, "x"]}"#,
            &["$.seeds[2]: is there twice", "$.seeds[3]: is no seed"],
        );
        faulty(r#"{"case": "rock.json", "seeds": [99999999999999999999]}"#, &["up to 18446744073709551615"]);
        faulty(r#"{"case": "rock.json", "seeds": {"count": 0}}"#, &["$.seeds: are no seeds"]);
        faulty(
            r#"{"case": "rock.json", "seeds": [3], "set": {"/contact/friction": 0.5}, "grid": {"/seed": [1], "/contact/friction": [0.6]}}"#,
            &["$.grid: is overruled by $.seeds", "$.grid: is in $.set too"],
        );
        faulty(r#"{"cases": ["rock.json", "rock.json"]}"#, &["$.cases[1]: has the name of $.cases[0]"]);
        faulty(r#"{"cases": [{"set": {}}]}"#, &["$.cases[0].case: is missing"]);
        let unused = r#"{"case": "rock.json", "cases": ["rock.json", {"name": "b", "case": "rock.json"}]}"#;
        faulty(unused, &["$.case: is used by none of \"cases\""]);
        faulty(r#"{"case": "rock.json", "slurm": {"time": "1\n2"}}"#, &["$.slurm.time: is no line"]);
        faulty(r#"{"case": "rock.json", "slurm": {"setup": [1]}}"#, &["$.slurm.setup[0]: is no line"]);
        faulty(
            r#"{"case": "rock.json", "slurm": {"members_per_task": 0}}"#,
            &["$.slurm.members_per_task: is out of range"],
        );
        faulty(
            r#"{"case": "rock.json", "seeds": {"count": 99999}, "grid": {"/seed": [1, 2]}}"#,
            &["are too many"],
        );
    }

    /// What comes to a shell, a stack or a file system.
    #[test]
    fn hostile_plans_are_faults() {
        for (out, sound) in [("r\\ntouch PWNED\\n#", false), ("r\\u001b[31m", false), ("r'; $(x) `y`", true)]
        {
            let made = plan(&format!(r#"{{"case": "rock.json", "out": "{out}"}}"#));
            assert_eq!(made.is_ok(), sound, "{out}");
            if let Err(error) = made {
                assert!(error.to_string().contains("$.out: is no line of text"), "{error}");
            }
        }
        let deep = "/a".repeat(50_000);
        for key in ["set", "grid"] {
            let value = if key == "set" { "1" } else { "[1, 2]" };
            let text = format!(r#"{{"case": "rock.json", "{key}": {{"{deep}": {value}}}}}"#);
            let said = plan(&text).expect_err("too deep").to_string();
            assert!(said.contains(&format!("$.{key}")) && said.contains("too deep"), "{said}");
            assert!(said.len() < 1000, "{} characters", said.len());
        }
        let long = "n".repeat(LONGEST_NAME + 1);
        faulty(
            &format!(r#"{{"cases": [{{"name": "{long}", "case": "rock.json"}}]}}"#),
            &["$.cases[0]: makes a member whose name is too long", "at most 200 bytes"],
        );
        // By its values.
        faulty(
            &format!(r#"{{"case": "rock.json", "grid": {{"/title": ["a", "{long}"]}}}}"#),
            &["$.case: makes a member whose name is too long"],
        );
    }

    #[test]
    fn faults_of_the_plan_and_of_its_members_are_listed_together() {
        faulty(
            r#"{"cases": ["rock.json", {"name": "b", "case": "none.json"}, "rock.json"], "sets": 1, "jobs": 0,
                "set": {"contact/friction": 0.5}, "grid": {"/contact/friction": [-1, -1], "/solver/fidelity": "stiff"}}"#,
            &[
                "$.sets: is an unknown key",
                "$.jobs: is out of range",
                "$.set[\"contact/friction\"]: the pointer must begin",
                "$.grid[\"/contact/friction\"][1]: is there twice",
                "$.grid[\"/solver/fidelity\"]: is no list of values",
                "$.cases[2]: has the name of $.cases[0]",
                "$.cases[1]: cannot read",
                "rock_friction=-1_fidelity=stiff: $.contact.friction: must",
                "rock_friction=-1_fidelity=stiff: $.solver.fidelity",
                "9 faults",
            ],
        );
        // One slip, one fault.
        for text in [
            r#"{"cases": ["rock.json", "rock.json"]}"#,
            r#"{"case": "rock.json", "grid": {"/contact/friction": [0.5, 0.5]}}"#,
            r#"{"case": "rock.json", "set": {"seed": 3}}"#,
        ] {
            faulty(text, &[": 1 fault\n"]);
        }
    }

    #[test]
    fn faults_of_members_are_listed_with_their_names() {
        faulty(
            r#"{"case": "rock.json", "grid": {"/contact/friction": [0.5, -1], "/solver/fidelity": ["rigid", "stiff"]}}"#,
            &[
                "rock_friction=-1_fidelity=rigid: $.contact.friction: must",
                "rock_friction=0.5_fidelity=stiff: $.solver.fidelity",
            ],
        );
    }
}
