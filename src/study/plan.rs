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

use serde_json::{Value, json};

use crate::case::{
    self, FileKind, Form, Key, RawCase, Walker, fault_of_pointer, path_of_key, read, read_named, refuse_file,
    shortened, shown,
};
use crate::error::{Error, Fault, Faults, Result};

use super::cluster::{SLURM, Slurm};
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

static PLAN: Form = Form::Object(&[
    Key::optional("$schema", Form::Text, "Address of this schema, for editors; ignored."),
    Key::optional("case", Form::Text, "The case file, relative to the plan."),
    Key::optional(
        "cases",
        Form::List(&Form::Either(&[Form::Text, Form::Object(ENTRY)]), 1),
        "Several cases, or variants of `case`.",
    ),
    Key::optional("set", SET, "Values by JSON pointer, as for --set, of every member."),
    Key::optional(
        "grid",
        Form::ByPointer(&Form::List(&Form::Any, 1)),
        "Lists of values by JSON pointer: every combination is run.",
    ),
    Key::optional(
        "seeds",
        Form::Either(&[Form::List(&SEED, 1), Form::Object(SEEDS)]),
        "Each member with each seed.",
    ),
    Key::optional(
        "out",
        Form::Line,
        "Folder of the results files, relative to the plan; default: results/<name of the plan>.",
    ),
    Key::optional("jobs", Form::Count(1, 1024), "Processes at a time."),
    Key::default("threads", Form::Count(1, 1024), "1", "Threads of each."),
    Key::default("slurm", Form::Object(SLURM), "{}", "What a cluster is told."),
]);
static ENTRY: &[Key] = &[
    Key::optional("name", Form::Line, "Of the member's files."),
    Key::optional("case", Form::Text, "The case file, relative to the plan."),
    Key::optional("set", SET, "Values by JSON pointer, as for --set."),
];
static SEEDS: &[Key] = &[
    Key::default("from", SEED, "1", "The first."),
    Key::required("count", Form::Count(1, MOST_MEMBERS as u64), "How many, one after the other."),
];
const SET: Form = Form::ByPointer(&Form::Any);
const SEED: Form = Form::Count(0, u64::MAX);

/// JSON Schema of plans.
pub fn schema() -> Value {
    let mut schema =
        case::schema_of("riprap plan of a batch", "Cases of a batch and what to change in them.", &PLAN);
    schema["anyOf"] = json!([{"required": ["case"]}, {"required": ["cases"]}]);
    schema
}

/// That a file is a plan, said to whoever took it for a case.
///
/// # Errors
/// `Error::Usage`.
pub fn refuse_plan(raw: &RawCase) -> Result<()> {
    match FileKind::of_keys(&raw.value).filter(|kind| *kind == FileKind::Plan) {
        Some(plan) => Err(plan.in_place_of(FileKind::Case, &raw.file)),
        None => Ok(()),
    }
}

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
/// `Error::Io` and `Error::Json` for the plan itself, `Error::Usage` for a case in its place, `Error::Case` with all of its faults and those of its
/// cases.
pub fn read_plan(file: &Path, out: Option<&Path>) -> Result<Plan> {
    refuse_file(file, FileKind::Plan)?;
    let raw = read(file)?;
    if FileKind::of_keys(&raw.value) == Some(FileKind::Case) {
        return Err(FileKind::Case.in_place_of(FileKind::Plan, file));
    }
    let mut faults = raw.faults.clone();
    let folder = file.parent().unwrap_or(Path::new(""));
    let plan = check(&raw, folder, out, &mut faults);
    match plan {
        Some(plan) if faults.is_empty() => Ok(plan),
        _ => Err(Error::Case { file: file.to_path_buf(), faults }),
    }
}

fn check(raw: &RawCase, folder: &Path, out: Option<&Path>, faults: &mut Vec<Fault>) -> Option<Plan> {
    let mut walker = Walker::new(std::mem::take(faults));
    let walked = walker.walk(&PLAN, &raw.value, "$");
    let entries = walked.as_ref().map(|plan| entries_of(plan, &raw.value, folder, &mut walker));
    *faults = walker.faults;
    let (plan, entries) = walked.zip(entries)?;
    let common = set_of(&plan["set"]);
    let grid = grid_of(&raw.value["grid"], faults);
    let seeds = seeds_of(&plan["seeds"], faults);
    for (pointer, _) in &grid {
        let place = path_of_key("$.grid", pointer);
        if pointer == "/seed" && !seeds.is_empty() {
            let problem = "is overruled by $.seeds";
            faults.fault(&place, pointer, problem, "seeds in one of the two places");
        }
        if common.iter().any(|(set, _)| set == pointer) {
            faults.fault(place, pointer, "is in $.set too", "a pointer in one of the two places");
        }
    }
    let stem = raw.file.file_stem().unwrap_or(raw.file.as_os_str());
    let own_out = plan["out"].as_str().map_or(folder.join("results").join(stem), |own| folder.join(own));
    let (out, place) = out.map_or((own_out, "$.out"), |given| (given.to_path_buf(), "--out"));
    // It stands in a comment of a job array's script, which a line break would end.
    let whole = std::path::absolute(&out).unwrap_or_else(|_| out.clone());
    if whole.to_string_lossy().contains(|c: char| c.is_control()) {
        let accepted = "a path without line breaks and other control characters";
        faults.fault(place, format!("{:?}", whole), "is no line of text", accepted);
    }
    let points = points_of(&grid);
    let number = entries.len().saturating_mul(points).saturating_mul(seeds.len().max(1));
    if number > MOST_MEMBERS {
        let accepted = format!("at most {MOST_MEMBERS}");
        faults.fault("$", format!("{number} members"), "are too many", accepted);
        return None;
    }
    let count = |key: &str| plan[key].as_u64().map(|n| n as usize);
    Some(Plan {
        file: raw.file.clone(),
        members: members_of(&entries, &common, &grid, &seeds, &out, faults),
        out,
        jobs: count("jobs"),
        threads: count("threads").unwrap_or(1),
        slurm: serde_json::from_value(plan["slurm"].clone()).unwrap_or_default(),
    })
}

fn set_of(walked: &Value) -> Vec<(String, Value)> {
    let set = walked.as_object().into_iter().flatten();
    set.map(|(pointer, value)| (pointer.clone(), value.clone())).collect()
}

/// The sound entries of a plan that is `walked`; `given` is the plan as it stands.
fn entries_of(walked: &Value, given: &Value, folder: &Path, walker: &mut Walker) -> Vec<Entry> {
    let base = walked["case"].as_str().map(|case| folder.join(case));
    if given.get("cases").is_none() {
        if given.get("case").is_none() {
            walker.fault("$.case", "nothing", "is missing", "a case file, or a list \"cases\"");
        }
        let entry = |case: PathBuf| Entry { name: stem(&case), case, set: Vec::new(), path: "$.case".into() };
        return base.map(entry).into_iter().collect();
    }
    let mut entries: Vec<Entry> = Vec::new();
    for (at, item) in walked["cases"].as_array().into_iter().flatten().enumerate() {
        let path = format!("$.cases[{at}]");
        let Some(mut entry) = entry_of(item, path, base.as_ref(), folder, walker) else { continue };
        if let Some(first) = entries.iter().find(|other| safe(&other.name) == safe(&entry.name)) {
            let problem = format!("has the name of {}", first.path);
            walker.fault(&entry.path, &entry.name, problem, "a \"name\" of its own");
            // Its members are told apart by the place in the plan.
            entry.name = entry.path.clone();
        }
        entries.push(entry);
    }
    let brings_its_own = |item: &Value| !item.is_object() || item.get("case").is_some();
    if let (Some(unused), Some(items)) = (given.get("case"), given["cases"].as_array())
        && items.iter().all(brings_its_own)
    {
        let accepted = "an entry of \"cases\" without its own, or none here";
        walker.fault("$.case", shown(unused), "is used by none of \"cases\"", accepted);
    }
    entries
}

/// One of `cases`, unless it is at fault.
fn entry_of(
    item: &Value,
    path: String,
    base: Option<&PathBuf>,
    folder: &Path,
    walker: &mut Walker,
) -> Option<Entry> {
    let [case_path, name_path] = ["case", "name"].map(|key| path_of_key(&path, key));
    if item.is_null() || !walker.is_clean(&case_path) || !walker.is_clean(&name_path) {
        return None;
    }
    let own = item.as_str().or(item["case"].as_str()).map(|case| folder.join(case));
    let Some(case) = own.or(base.cloned()) else {
        walker.fault(case_path, "nothing", "is missing", "a case file, here or as $.case");
        return None;
    };
    let name = item["name"].as_str().map_or_else(|| stem(&case), str::to_string);
    if safe(&name).is_empty() {
        walker.fault(name_path, name, "is no name", "a text with letters or digits");
        return None;
    }
    Some(Entry { name, case, set: set_of(&item["set"]), path })
}

fn stem(case: &Path) -> String {
    case.file_stem().unwrap_or(case.as_os_str()).to_string_lossy().into_owned()
}

/// The grid as it stands in the plan, its unsound pointers apart.
fn grid_of(given: &Value, faults: &mut Vec<Fault>) -> Vec<(String, Vec<Value>)> {
    let mut grid = Vec::new();
    for (pointer, values) in given.as_object().into_iter().flatten() {
        let values = match values {
            Value::Array(values) => values.as_slice(),
            Value::Object(_) => &[],
            // A value without its brackets is a fault already: the members have it.
            plain => std::slice::from_ref(plain),
        };
        let own = each_once(values, &path_of_key("$.grid", pointer), faults);
        if fault_of_pointer(pointer).is_none() && !own.is_empty() {
            grid.push((pointer.clone(), own));
        }
    }
    grid
}

/// How many combinations a grid has, or all that can be counted.
fn points_of(grid: &[(String, Vec<Value>)]) -> usize {
    grid.iter().fold(1_usize, |all, (_, values)| all.saturating_mul(values.len()))
}

/// The values of a list; a second one of the same is a fault.
fn each_once(values: &[Value], path: &str, faults: &mut Vec<Fault>) -> Vec<Value> {
    let mut own: Vec<Value> = Vec::new();
    for (at, value) in values.iter().enumerate() {
        match own.contains(value) {
            true => faults.fault(format!("{path}[{at}]"), shown(value), "is there twice", "each value once"),
            false => own.push(value.clone()),
        }
    }
    own
}

fn seeds_of(walked: &Value, faults: &mut Vec<Fault>) -> Vec<u64> {
    if let Some(seeds) = walked.as_array() {
        return each_once(seeds, "$.seeds", faults).iter().filter_map(Value::as_u64).collect();
    }
    let (Some(from), Some(count)) = (walked["from"].as_u64(), walked["count"].as_u64()) else {
        return Vec::new();
    };
    if from.checked_add(count).is_none() {
        faults.fault("$.seeds", shown(walked), "are too large", format!("seeds up to {}", u64::MAX));
        return Vec::new();
    }
    (from..from + count).collect()
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
        for point in 0..points_of(grid) {
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
        faulty("[]", &["$: is a list where an object is needed"]);
        faulty("{}", &["$.case: is missing"]);
        faulty(
            r#"{"case": "rock.json", "gird": {}}"#,
            &["$.gird: is an unknown key: did you mean \"grid\"?"],
        );
        faulty(r#"{"case": "none.json"}"#, &["$.case: cannot read"]);
        faulty(
            r#"{"case": 3, "jobs": 0}"#,
            &[
                "$.case: is a number where a text is needed",
                "$.jobs: must be at least 1",
                "found 0",
                "from 1 to 1024",
            ],
        );
        faulty(
            r#"{"case": "rock.json", "grid": {"/seed": 3}}"#,
            &["$.grid[\"/seed\"]: is a number where a list is needed"],
        );
        faulty(
            r#"{"case": "rock.json", "grid": {"seed": [3]}}"#,
            &["$.grid.seed: the pointer must begin with /"],
        );
        faulty(
            r#"{"case": "rock.json", "seeds": [1, 2, 1, "x"]}"#,
            &["$.seeds[2]: is there twice", "$.seeds[3]: is not a whole number"],
        );
        faulty(
            r#"{"case": "rock.json", "seeds": [99999999999999999999]}"#,
            &["at most 18446744073709551615"],
        );
        faulty(r#"{"case": "rock.json", "seeds": {"count": 0}}"#, &["$.seeds.count: must be at least 1"]);
        faulty(
            r#"{"case": "rock.json", "seeds": [3], "set": {"/contact/friction": 0.5}, "grid": {"/seed": [1], "/contact/friction": [0.6]}}"#,
            &["$.grid[\"/seed\"]: is overruled by $.seeds", "$.grid[\"/contact/friction\"]: is in $.set too"],
        );
        faulty(r#"{"cases": ["rock.json", "rock.json"]}"#, &["$.cases[1]: has the name of $.cases[0]"]);
        faulty(r#"{"cases": [{"set": {}}]}"#, &["$.cases[0].case: is missing"]);
        let unused = r#"{"case": "rock.json", "cases": ["rock.json", {"name": "b", "case": "rock.json"}]}"#;
        faulty(unused, &["$.case: is used by none of \"cases\""]);
        faulty(r#"{"case": "rock.json", "slurm": {"time": "1\n2"}}"#, &["$.slurm.time: is no line"]);
        faulty(
            r#"{"case": "rock.json", "slurm": {"setup": [1]}}"#,
            &["$.slurm.setup[0]: is a number where a line of text is needed"],
        );
        faulty(
            r#"{"case": "rock.json", "slurm": {"members_per_task": 0}}"#,
            &["$.slurm.members_per_task: must be at least 1"],
        );
        faulty(
            r#"{"case": "rock.json", "seeds": {"count": 99999}, "grid": {"/seed": [1, 2]}}"#,
            &["are too many"],
        );
        // 2^64 are none, counted in 64 bits.
        let pairs: Vec<String> = (0..64).map(|k| format!("\"/a{k}\": [1, 2]")).collect();
        faulty(&format!(r#"{{"case": "rock.json", "grid": {{{}}}}}"#, pairs.join(", ")), &["are too many"]);
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
                "$.jobs: must be at least 1",
                "$.set[\"contact/friction\"]: the pointer must begin",
                "$.grid[\"/contact/friction\"][1]: is there twice",
                "$.grid[\"/solver/fidelity\"]: is a text where a list is needed",
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
