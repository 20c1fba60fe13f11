//! Every case file in `cases/` is sound, conforms to the JSON Schema and survives completion.

use std::path::{Path, PathBuf};

use serde_json::Value;

/// Case files have stages; what has none is the plan of a batch.
fn case_files() -> Vec<PathBuf> {
    let (cases, _) = files();
    cases
}

/// Cases, and plans of batches.
fn files() -> (Vec<PathBuf>, Vec<PathBuf>) {
    let mut found = vec![];
    let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("cases")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            if path.is_dir() {
                folders.push(path);
            } else if name.ends_with(".json") && !name.ends_with(".schema.json") {
                found.push(path);
            }
        }
    }
    found.sort();
    found.into_iter().partition(|file| std::fs::read_to_string(file).expect("a text").contains("\"stages\""))
}

#[test]
fn every_plan_is_sound() {
    let (_, plans) = files();
    assert!(!plans.is_empty());
    for plan in plans {
        let out = tempfile::tempdir().expect("a folder");
        riprap::study::plan::read_plan(&plan, Some(out.path())).unwrap_or_else(|e| panic!("{e}"));
        let raw = riprap::case::read(&plan).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(conforms(&riprap::study::plan::schema(), &raw.value, "$"), Ok(()));
    }
}

#[test]
fn every_case_is_sound() {
    let files = case_files();
    assert!(files.len() >= 19, "only {} case files", files.len());
    for file in files {
        let raw = riprap::case::read(&file).unwrap_or_else(|e| panic!("{e}"));
        let case = raw.check().unwrap_or_else(|e| panic!("{e}"));
        assert!(!case.title.is_empty(), "{}: no title", file.display());
        let unsupported = riprap::case::unsupported(&case);
        assert!(unsupported.is_empty(), "{}: cannot be run: {unsupported:?}", file.display());
    }
}

#[test]
fn every_case_reads_back_from_its_completion() {
    for file in case_files() {
        let case = riprap::case::read(&file).and_then(|raw| raw.check()).unwrap_or_else(|e| panic!("{e}"));
        let text = case.completed().to_string();
        let again = riprap::case::RawCase::parse(&file, &text).and_then(|raw| raw.check());
        let again = again.unwrap_or_else(|e| panic!("{e}"));
        // What was brought in, and told of it, is not part of the completed case.
        let again = riprap::case::Case { notes: case.notes.clone(), brought: case.brought.clone(), ..again };
        assert_eq!(again, case, "{}", file.display());
    }
}

#[test]
fn every_case_conforms_to_the_schema() {
    let schema = riprap::case::schema();
    for file in case_files() {
        let raw = riprap::case::read(&file).unwrap_or_else(|e| panic!("{e}"));
        if let Err(problem) = conforms(&schema, &raw.value, "$") {
            panic!("{}: {problem}", file.display());
        }
        let completed = raw.check().unwrap_or_else(|e| panic!("{e}")).completed();
        if let Err(problem) = conforms(&schema, &completed, "$") {
            panic!("{} (completed): {problem}", file.display());
        }
    }
}

#[test]
fn the_schema_refuses_what_the_check_refuses() {
    let schema = riprap::case::schema();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/quick_start.json");
    let changes = [
        ("/rock/density", serde_json::json!(-1)),
        ("/rock/densty", serde_json::json!(2180)),
        ("/stages/0/kind", serde_json::json!("shake")),
        ("/stages", serde_json::json!([])),
        ("/specimen/vertices", serde_json::json!([8])),
        ("/scene", serde_json::json!({"bodies": []})),
        ("/output/contacts", serde_json::json!("yes")),
    ];
    for (pointer, value) in changes {
        let mut raw = riprap::case::read(&file).unwrap_or_else(|e| panic!("{e}"));
        raw.set(&[(pointer.to_string(), value)]);
        assert!(raw.check().is_err(), "{pointer} is accepted by the check");
        assert!(conforms(&schema, &raw.value, "$").is_err(), "{pointer} is accepted by the schema");
    }
}

#[test]
fn a_kind_that_needs_no_other_key_may_be_a_word() {
    let schema = riprap::case::schema();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/quick_start.json");
    for kind in ["rubber", "pressure", "rigid_wall"] {
        let [word, object] = [serde_json::json!(kind), serde_json::json!({ "kind": kind })].map(|membrane| {
            let mut raw = riprap::case::read(&file).unwrap_or_else(|e| panic!("{e}"));
            raw.set(&[("/membrane".to_string(), membrane)]);
            assert_eq!(conforms(&schema, &raw.value, "$"), Ok(()));
            raw.check().unwrap_or_else(|e| panic!("{e}"))
        });
        assert_eq!(word, object);
    }
}

/// What stands for the pores of a specimen is one of two keys, not both and not none.
#[test]
fn void_ratio_or_porosity_conforms_to_the_schema() {
    let schema = riprap::case::schema();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/quick_start.json");
    let mut case = riprap::case::read(&file).unwrap_or_else(|e| panic!("{e}")).value;
    let conforms_with = |case: &Value| conforms(&schema, case, "$").is_ok();
    case["specimen"]["porosity"] = "40 %".into();
    assert!(!conforms_with(&case), "both");
    let specimen = case["specimen"].as_object_mut().expect("a specimen");
    specimen.shift_remove("void_ratio").expect("a void ratio");
    assert!(conforms_with(&case), "{:?}", conforms(&schema, &case, "$"));
    case["specimen"].as_object_mut().expect("a specimen").shift_remove("porosity");
    assert!(!conforms_with(&case), "none");
}

#[test]
fn the_committed_schemas_are_current() {
    for (name, schema) in [("riprap", riprap::case::schema()), ("plan", riprap::study::plan::schema())] {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("cases/{name}.schema.json"));
        let current = serde_json::to_string_pretty(&schema).expect("JSON") + "\n";
        let committed = std::fs::read_to_string(&file).unwrap_or_default();
        if committed != current && std::env::var_os("RIPRAP_REWRITE").is_some() {
            std::fs::write(&file, &current).expect("written");
            continue;
        }
        assert!(committed == current, "{} is stale: run this test with RIPRAP_REWRITE=1", file.display());
    }
}

/// The source's full-size specimen has 3783 grains; its grading is printed as a chart only, so that the
/// case's figures are ours. Tolerance: the 5 % within which a case's own size and number must agree.
#[test]
fn the_full_size_has_about_the_grains_of_the_source() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/shuibuya/p0800_3783.json");
    let case = riprap::case::read(&file).and_then(|raw| raw.check()).unwrap_or_else(|e| panic!("{e}"));
    let estimate = case.estimate();
    println!("{estimate}");
    assert!((estimate.grains as f64 / 3783.0 - 1.0).abs() < 0.05, "{} grains", estimate.grains);
    assert_eq!(estimate.cells, 38 * estimate.grains);
}

/// Those of the quick start do.
#[test]
fn grains_of_specimens_break_at_every_fidelity() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/quick_start.json");
    for fidelity in ["auto", "rigid", "condensed", "full"] {
        let mut raw = riprap::case::read(&file).unwrap_or_else(|e| panic!("{e}"));
        raw.set(&[("/solver/fidelity".into(), fidelity.into())]);
        let case = raw.check().unwrap_or_else(|e| panic!("{e}"));
        assert!(case.rock.damage.is_some());
        assert_eq!(riprap::case::unsupported(&case), []);
    }
}

/// Tolerance: a factor of two; "about" is what the estimate says of itself.
#[test]
fn cells_of_bodies_are_about_those_of_their_meshes() {
    let bodies = [
        ("box", r#"{"box": [0.1, 0.2, 0.3]}"#),
        ("sphere", r#"{"sphere": 0.1}"#),
        ("cylinder", r#"{"cylinder": {"radius": 0.1, "length": 0.3, "sides": 12}}"#),
        ("round", r#"{"cylinder": {"radius": 0.1, "length": 0.3, "sides": 96}}"#),
        (
            "wedge",
            r#"{"polyhedron": [[0, 0, 0], [0.2, 0, 0], [0, 0.2, 0], [0, 0, 0.3], [0.2, 0, 0.3], [0, 0.2, 0.3]]}"#,
        ),
        ("grain", r#"{"grain": [0.04, 0.06]}"#),
    ];
    for (name, shape) in bodies {
        let text = format!(
            r#"{{"scene": {{"bodies": [{{"name": "a", "shape": {shape}}}]}}, "contact": {{"friction": 0.5}},
                "rock": {{"density": 2180, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}},
                "stages": [{{"kind": "hold"}}], "solver": {{"fidelity": "condensed"}}}}"#
        );
        let raw = riprap::case::RawCase::parse(Path::new("scene.json"), &text);
        let case = raw.and_then(|raw| raw.check()).unwrap_or_else(|e| panic!("{e}"));
        let built = riprap::setup::scene_parameters(&case, Path::new("")).expect("bodies");
        let cells = built.bodies[0].grain.as_ref().expect("a condensed body").mesh().cells.len();
        println!("{name}: {} for {cells}", case.estimate().cells);
        let share = case.estimate().cells as f64 / cells as f64;
        assert!((0.5..=2.0).contains(&share), "{name}: {} for {cells}", case.estimate().cells);
    }
}

fn is_of_type(value: &Value, name: &str) -> Result<bool, String> {
    Ok(match name {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.as_f64().is_some_and(|x| x.fract() == 0.0),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        other => return Err(format!("the schema has the unknown type {other}")),
    })
}

/// The part of JSON Schema that the case's schema uses, `pattern` (an editor's business) apart.
fn conforms(schema: &Value, value: &Value, path: &str) -> Result<(), String> {
    let refuse = |what: &str| Err(format!("{path}: {what}: {value}"));
    let Some(schema) = schema.as_object() else {
        return if schema == &Value::Bool(false) { refuse("nothing goes here") } else { Ok(()) };
    };
    // The values of an object under some of its keys.
    let each = |is_meant: &dyn Fn(&str) -> bool, rule: &Value| {
        let mut values = value.as_object().into_iter().flatten().filter(|(key, _)| is_meant(key));
        values.try_for_each(|(key, value)| conforms(rule, value, &format!("{path}.{key}")))
    };
    for (word, rule) in schema {
        let number = || value.as_f64().zip(rule.as_f64());
        let list = rule.as_array().cloned().unwrap_or_default();
        let passing = || list.iter().filter(|option| conforms(option, value, path).is_ok()).count();
        let length = value.as_array().map(Vec::len).or(value.as_object().map(|map| map.len()));
        let limit = rule.as_u64().map(|n| n as usize);
        let sound = match word.as_str() {
            "type" => is_of_type(value, rule.as_str().unwrap_or_default())?,
            "const" => value == rule,
            "enum" => list.contains(value),
            "anyOf" => passing() > 0,
            "oneOf" => passing() == 1,
            "not" => conforms(rule, value, path).is_err(),
            "minimum" => number().is_none_or(|(x, bound)| x >= bound),
            "maximum" => number().is_none_or(|(x, bound)| x <= bound),
            "exclusiveMinimum" => number().is_none_or(|(x, bound)| x > bound),
            "exclusiveMaximum" => number().is_none_or(|(x, bound)| x < bound),
            "minItems" | "minProperties" => length >= limit,
            "maxProperties" => length <= limit,
            "required" => list.iter().all(|key| value.get(key.as_str().unwrap_or_default()).is_some()),
            "properties" => {
                for (key, rule) in rule.as_object().into_iter().flatten() {
                    if let Some(value) = value.get(key) {
                        conforms(rule, value, &format!("{path}.{key}"))?;
                    }
                }
                true
            }
            "additionalProperties" => {
                let known = |key: &str| {
                    schema.get("properties").is_some_and(|known| known.get(key).is_some())
                        || schema.contains_key("patternProperties") && key.starts_with('/')
                };
                each(&|key| !known(key), rule)?;
                true
            }
            "patternProperties" => {
                each(&|key| key.starts_with('/'), &rule["^/"])?;
                true
            }
            "prefixItems" => {
                let mut each = list.iter().zip(value.as_array().into_iter().flatten()).enumerate();
                each.try_for_each(|(i, (rule, value))| conforms(rule, value, &format!("{path}[{i}]")))?;
                true
            }
            "items" => {
                let prefix = schema.get("prefixItems").and_then(Value::as_array).map_or(0, Vec::len);
                let mut rest = value.as_array().into_iter().flatten().enumerate().skip(prefix);
                rest.try_for_each(|(i, value)| conforms(rule, value, &format!("{path}[{i}]")))?;
                true
            }
            "$schema" | "title" | "description" | "default" | "examples" | "pattern" => true,
            // Of editors.
            "allowComments" | "allowTrailingCommas" => true,
            other => return Err(format!("the schema uses the unknown word {other}")),
        };
        if !sound {
            return refuse(&format!("does not pass {word} {rule}").chars().take(200).collect::<String>());
        }
    }
    Ok(())
}
