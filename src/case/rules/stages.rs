//! Rules of the stages: what may follow what, and which bodies a load stage may name.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::error::Faults;

use super::super::form::written;
use super::super::path::child;
use super::super::walk::{Walker, meant, nearest, number, shown};

/// Stages in which the confining pressure follows from something else.
const FLOATING: [&str; 3] = ["oedometer", "constant_volume", "constant_p"];
/// More increments in one stage are a slip of the pen.
const MOST_INCREMENTS: f64 = 1e7;

/// `pressure` of a consolidation means both pressures; later stages hold the one reached. The largest
/// increment is `growth` times the nominal one, where the stage does not say.
pub fn derive(stages: &mut [Value], growth: Option<f64>) {
    let mut held = Value::Null;
    for stage in stages.iter_mut().filter_map(Value::as_object_mut) {
        if let (Some(increment), Some(growth)) = (stage.get("increment").and_then(Value::as_f64), growth) {
            stage.entry("increment_max").or_insert((increment * growth).into());
        }
        match stage.get("kind").and_then(Value::as_str) {
            Some("consolidate") => {
                let both = |s: &serde_json::Map<String, Value>| {
                    s.contains_key("axial_pressure") || s.contains_key("radial_pressure")
                };
                if !both(stage)
                    && let Some(pressure) = stage.get("pressure").cloned()
                {
                    let increments = stage.shift_remove("increments");
                    stage.shift_remove("pressure");
                    stage.insert("axial_pressure".into(), pressure.clone());
                    stage.insert("radial_pressure".into(), pressure);
                    stage.extend(increments.map(|n| ("increments".into(), n)));
                }
                held = stage.get("radial_pressure").cloned().unwrap_or_default();
            }
            Some(kind) if FLOATING.contains(&kind) => held = Value::Null,
            Some("shear" | "stress_shear" | "unload" | "reload") if !held.is_null() => {
                stage.entry("pressure").or_insert(held.clone());
            }
            _ => {}
        }
    }
}

/// `started` says whether a results file gives the consolidated specimen.
pub fn check_specimen(stages: &Value, started: bool, walker: &mut Walker) {
    let Some(stages) = stages.as_array() else { return };
    // Pressure held so far; `Err` where a faulty stage or a file that is read later hides it.
    let mut held: Result<Option<f64>, ()> = if started { Err(()) } else { Ok(None) };
    let (mut sheared, mut unloaded, mut floating) = (false, false, false);
    for (i, stage) in stages.iter().enumerate() {
        let path = format!("$.stages[{i}]");
        let Some(kind) = stage["kind"].as_str() else {
            (held, sheared, unloaded) = (Err(()), true, true);
            continue;
        };
        let adrift = held == Ok(None);
        let lacks = match kind {
            "load" => {
                Some(("loads the bodies of a scene, and this case has a specimen", "a stage of specimens"))
            }
            "shear" | "stress_shear" | "unload" | "reload" | "oedometer" | "constant_volume"
            | "constant_p" | "hold"
                if adrift =>
            {
                // Said once: the stages after it lack the same.
                held = Err(());
                let accepted = "a first stage {\"kind\": \"consolidate\", \"pressure\": ...}";
                Some(("has no consolidate stage before it", accepted))
            }
            "unload" if !sheared => Some(("has nothing to unload", "a shear stage before it")),
            "reload" if !unloaded => Some(("has no unload stage before it", "an unload stage before it")),
            _ => None,
        };
        if let Some((problem, accepted)) = lacks {
            walker.fault(format!("{path}.kind"), format!("\"{kind}\""), problem, accepted);
        }
        match kind {
            "consolidate" => {
                check_pressures(stage, &path, walker);
                held = number(stage, "radial_pressure").map(Some).ok_or(());
                floating = false;
            }
            kind if FLOATING.contains(&kind) => floating = true,
            "shear" | "stress_shear" | "unload" | "reload" if floating => {
                if let Some(pressure) = number(stage, "pressure") {
                    let problem = "cannot be given: the pressure is what the stages before lead to";
                    let accepted = "no pressure, or a consolidate stage to it before";
                    walker.fault(format!("{path}.pressure"), pressure, problem, accepted);
                }
            }
            "shear" | "stress_shear" | "unload" | "reload" => {
                if let (Some(pressure), Ok(Some(reached))) = (number(stage, "pressure"), held)
                    && (pressure / reached - 1.0).abs() > 1e-9
                {
                    let problem =
                        format!("is not the pressure {} Pa that the stages before reach", written(reached));
                    let accepted = "that pressure, no pressure, or a consolidate stage to the new one before";
                    walker.fault(format!("{path}.pressure"), pressure, problem, accepted);
                }
            }
            _ => {}
        }
        sheared |= matches!(kind, "shear" | "stress_shear" | "reload") || FLOATING.contains(&kind);
        unloaded |= kind == "unload";
        check_increment(stage, &path, walker);
    }
}

fn check_pressures(stage: &Value, path: &str, walker: &mut Walker) {
    let given = |key: &str| !stage[key].is_null();
    if !["pressure", "axial_pressure", "radial_pressure"].iter().all(|key| walker.is_clean(&child(path, key)))
    {
        return;
    }
    let accepted = "\"pressure\", or both \"axial_pressure\" and \"radial_pressure\"";
    let (found, problem) = match (given("pressure"), given("axial_pressure"), given("radial_pressure")) {
        (false, true, true) => return,
        (true, _, _) => ("pressure and more", "gives an isotropic pressure and an axial or radial one"),
        (false, true, false) => ("axial_pressure", "gives an axial pressure without a radial one"),
        (false, false, true) => ("radial_pressure", "gives a radial pressure without an axial one"),
        (false, false, false) => ("nothing", "gives no pressure"),
    };
    walker.fault(path, found, problem, accepted);
}

fn check_increment(stage: &Value, path: &str, walker: &mut Walker) {
    if let (Some(increment), Some(strain)) = (number(stage, "increment"), number(stage, "axial_strain")) {
        let all = written(strain);
        let mut fault = |problem: String, accepted: String| {
            walker.fault(format!("{path}.increment"), increment, problem, accepted);
        };
        if increment > strain {
            fault(format!("exceeds the stage's axial_strain {all}"), format!("at most {all}"));
        } else if increment > 0.0 && strain / increment > MOST_INCREMENTS {
            let problem =
                format!("makes more than {MOST_INCREMENTS:.0e} increments of the stage's axial_strain {all}");
            fault(problem, format!("at least {:e}", strain / MOST_INCREMENTS));
        }
    }
    if let (Some(increment), Some(largest)) = (number(stage, "increment"), number(stage, "increment_max"))
        && largest < increment
    {
        let (place, increment) = (format!("{path}.increment_max"), written(increment));
        let problem = format!("is below the stage's increment {increment}");
        walker.fault(place, largest, problem, format!("at least {increment}"));
    }
}

pub fn check_scene(stages: &Value, bodies: &Value, walker: &mut Walker) {
    let Some(stages) = stages.as_array() else { return };
    let list = || bodies.as_array().into_iter().flatten();
    let names: Vec<&str> = list().filter_map(|body| body["name"].as_str()).collect();
    let sound_name = |i: usize| walker.is_clean(&format!("$.scene.bodies[{i}].name"));
    let all_named = bodies.is_array() && (0..list().count()).all(sound_name) && names.len() == list().count();
    // The stage that prescribed each component last, by body: what is held stays so until a null frees it.
    let mut held: BTreeMap<&str, [Option<usize>; 6]> = BTreeMap::new();
    for (i, stage) in stages.iter().enumerate() {
        let path = format!("$.stages[{i}]");
        let Some(kind) = stage["kind"].as_str() else { continue };
        if !matches!(kind, "load" | "hold") {
            let problem = "is a stage of specimens, and this case has a scene";
            walker.fault(format!("{path}.kind"), format!("\"{kind}\""), problem, "\"load\", \"hold\"");
        }
        for (name, load) in stage["bodies"].as_object().into_iter().flatten() {
            let place = child(&format!("{path}.bodies"), name);
            match list().find(|body| body["name"] == **name) {
                None if all_named => {
                    let problem = meant("names an unknown body", nearest(name, names.iter().copied()));
                    let accepted = format!("the bodies {}", names.join(", "));
                    walker.fault(place, format!("\"{name}\""), problem, accepted);
                }
                Some(body) if body["fixed"] == true => {
                    if load.as_object().is_some_and(|load| !load.is_empty()) {
                        let problem = format!("moves or loads \"{name}\", which is fixed");
                        let accepted = "a body that is not \"fixed\": true";
                        walker.fault(place, shown(load), problem, accepted);
                    }
                }
                _ => {
                    check_components(load, &place, walker);
                    check_held(load, held.entry(name).or_default(), i, &place, walker);
                }
            }
        }
    }
}

/// What an earlier stage holds takes no load; notes what stage `at` holds and frees.
fn check_held(load: &Value, held: &mut [Option<usize>; 6], at: usize, path: &str, walker: &mut Walker) {
    for (first, driven, loaded) in [(0, "displacement", "force"), (3, "rotation", "moment")] {
        for k in 0..3 {
            let holder = &mut held[first + k];
            if load[driven].is_array() {
                *holder = load[driven][k].is_number().then_some(at);
            } else if let (Some(stage), Some(value)) = (*holder, load[loaded][k].as_f64())
                && value != 0.0
            {
                let problem = format!("loads a component that stage {stage} prescribed, which stays held");
                let accepted = format!("null, or a {driven} here with null in its place, which frees it");
                walker.fault(format!("{path}.{loaded}[{k}]"), value, problem, accepted);
            }
        }
    }
}

/// A component is driven or loaded, not both.
fn check_components(load: &Value, path: &str, walker: &mut Walker) {
    for (driven, loaded) in [("displacement", "force"), ("rotation", "moment")] {
        for k in 0..3 {
            if let (Some(_), Some(value)) = (load[driven][k].as_f64(), load[loaded][k].as_f64()) {
                let problem = format!("loads a component that {driven} prescribes");
                walker.fault(format!("{path}.{loaded}[{k}]"), value, problem, "null here or there");
            }
        }
    }
}
