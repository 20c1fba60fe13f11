//! Rules between several values, and defaults that follow from other values.
//!
//! They run on the walked value, in which faulty parts are missing (`Value::Null` when looked up),
//! so that all faults are found in one go; a rule keeps quiet where a value that it needs is at fault.

mod material;
mod press;
mod scene;
mod specimen;
mod stages;

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::{Value, json};

use crate::error::{Fault, Faults};

use super::form::written;
use super::path::at;
use super::size::{MeanGrains, SCENE_WEAKENING, weakening_distance};
use super::walk::{Walker, number, shown};
use crate::quantity::{self, Dimension};

/// Fills in what follows from other values.
pub fn derive(case: &mut Value) {
    let friction = case["contact"]["friction"].clone();
    let normal = if case["specimen"].is_null() { "spring" } else { "asperity" };
    // Asperities are tips and edges.
    let is_sharp = case["scene"].is_null() || case["contact"]["normal"] == "asperity";
    let faces = if is_sharp { "corners" } else { "area" };
    if let Some(specimen) = case.get_mut("specimen") {
        specimen::derive(specimen);
    }
    let grading = case["specimen"]["grading"].clone();
    let weakening = match serde_json::from_value::<Vec<[f64; 2]>>(grading) {
        Ok(grading) => weakening_distance(&grading),
        Err(_) => SCENE_WEAKENING,
    };
    if let Some(contact) = object(case, "/contact") {
        contact.entry("normal").or_insert(normal.into());
        contact.entry("faces").or_insert(faces.into());
        contact.entry("weakening_distance").or_insert(weakening.into());
    }
    if let Some(contact) = object(case, "/contact")
        && !friction.is_null()
    {
        contact.entry("residual_friction").or_insert(friction.clone());
    }
    if let Some(case) = case.as_object_mut() {
        case.entry("membrane").or_insert(json!({"kind": "pressure"}));
        let plates = case.entry("plates").or_insert(json!({}));
        if let Some(plates) = plates.as_object_mut() {
            plates.entry("tilting").or_insert("locked".into());
            if !friction.is_null() {
                plates.entry("friction").or_insert(friction);
            }
        }
    }
    let rock = case["rock"].clone();
    if let Some(bodies) = case.pointer_mut("/scene/bodies").and_then(Value::as_array_mut) {
        for own in bodies.iter_mut().filter_map(|body| body.get_mut("rock")) {
            material::derive(own, &rock);
        }
    }
    // The older form of the energy gate: a tolerance to warn at.
    if let Some(tolerance) = case["solver"]["energy_gate"].as_f64()
        && let Some(solver) = object(case, "/solver")
    {
        solver.insert("energy_tolerance".into(), tolerance.into());
        solver.insert("energy_gate".into(), "warn".into());
    }
    let growth = number(&case["solver"], "increment_max");
    if let Some(list) = case.pointer_mut("/stages").and_then(Value::as_array_mut) {
        stages::derive(list, growth);
    }
    if let Some(case) = case.as_object_mut() {
        case.shift_remove("$schema");
    }
}

/// What the built case needs of what was checked.
#[derive(Default)]
pub struct Found {
    /// Of a sound specimen.
    pub grains: Option<MeanGrains>,
    /// Of the mesh files of a scene.
    pub cells_of_files: BTreeMap<String, usize>,
}

/// Checks every rule. `raw` is the value as written, `folder` where mesh files are looked for.
/// What was found on the way.
pub fn check(case: &Value, raw: &Value, folder: Option<&Path>, walker: &mut Walker) -> Found {
    let known = walker.faults.len();
    let mut found = Found::default();
    let (specimen, scene) = (&raw["specimen"], &raw["scene"]);
    match (specimen.is_null(), scene.is_null()) {
        (true, true) => walker.fault(
            "$",
            "neither",
            "has neither a specimen nor a scene",
            "a \"specimen\" (generated rockfill) or a \"scene\" (bodies set by hand)",
        ),
        (false, false) => walker.fault(
            "$.scene",
            "both",
            "stands beside a specimen: a case has one of them",
            "a \"specimen\" or a \"scene\"",
        ),
        (false, true) => {
            found.grains = specimen::check(&case["specimen"], number(&case["contact"], "rounding"), walker);
            stages::check_specimen(&case["stages"], !case["start_from"].is_null(), walker);
        }
        (true, false) => {
            found.cells_of_files = scene::check(case, folder, walker);
            press::check(case, walker);
            stages::check_scene(&case["stages"], &case["scene"]["bodies"], walker);
            for key in ["plates", "membrane", "start_from"] {
                if let Some(value) = raw.get(key) {
                    let problem = "belongs to a specimen, not to a scene";
                    walker.fault(format!("$.{key}"), shown(value), problem, "no such key");
                }
            }
        }
    }
    material::check(&case["rock"], "$.rock", walker);
    let contact = &case["contact"];
    if let (Some(peak), Some(residual)) = (number(contact, "friction"), number(contact, "residual_friction"))
        && residual > peak
    {
        walker.fault(
            "$.contact.residual_friction",
            residual,
            format!("exceeds the peak friction {}", written(peak)),
            format!("at most {}", written(peak)),
        );
    }
    let solver = &raw["solver"];
    let [gate, tolerance] =
        ["energy_gate", "energy_tolerance"].map(|key| quantity::read(&solver[key], Dimension::None).ok());
    if let (Some(gate), Some(tolerance)) = (gate, tolerance)
        && gate != tolerance
    {
        let problem = format!("is another tolerance than energy_tolerance, {}", written(tolerance));
        let accepted = "\"warn\" or \"cut\", or no energy_tolerance";
        walker.fault("$.solver.energy_gate", shown(&solver["energy_gate"]), problem, accepted);
    }
    show_as_written(&mut walker.faults[known..], raw);
    found
}

/// Rules see SI numbers; messages show what the file says.
fn show_as_written(faults: &mut [Fault], raw: &Value) {
    for fault in faults.iter_mut().filter(|fault| fault.value.parse::<f64>().is_ok()) {
        match at(raw, &fault.path) {
            Some(written) => fault.value = shown(written),
            None => fault.value.push_str(", the default"),
        }
    }
}

fn object<'a>(value: &'a mut Value, pointer: &str) -> Option<&'a mut serde_json::Map<String, Value>> {
    value.pointer_mut(pointer).and_then(Value::as_object_mut)
}

#[cfg(test)]
mod tests {
    use crate::case::checked;

    #[test]
    fn messages_have_no_hundreds_of_zeros() {
        let text = include_str!("../../../cases/stages/shear.json");
        for set in ["/stages/1/axial_strain=1e-320", "/contact/friction=1e-320"] {
            let said = checked(text, &[set, "/contact/residual_friction=0.1"]).expect_err(set).to_string();
            assert!(said.contains("1e-320") && !said.contains("0000000000"), "{said}");
        }
    }

    #[test]
    fn an_energy_gate_is_no_second_tolerance() {
        let check = |solver: &str| {
            let text = format!(
                r#"{{"scene": {{"bodies": [{{"name": "a", "shape": {{"sphere": 0.1}}}}]}}, "solver": {{{solver}}},
                "rock": {{"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}}, "contact": {{"friction": 0.65}},
                "stages": [{{"kind": "load"}}]}}"#
            );
            checked(&text, &[])
        };
        for same in [
            r#""energy_gate": 0.02"#,
            r#""energy_gate": "2 %", "energy_tolerance": 0.02"#,
            r#""energy_gate": "cut", "energy_tolerance": 0.02"#,
        ] {
            assert_eq!(check(same).unwrap_or_else(|e| panic!("{e}")).solver.energy_tolerance, 0.02);
        }
        let said = check(r#""energy_gate": 0.02, "energy_tolerance": 1e-3"#).expect_err("two").to_string();
        assert!(said.contains("1 fault") && said.contains("$.solver.energy_gate: is another"), "{said}");
    }
}
