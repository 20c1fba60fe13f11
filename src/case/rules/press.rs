//! Rules of a press: one breakable body between a fixed plate and a driven one, and nothing else.

use serde_json::Value;

use crate::error::Faults;

use super::super::path::child;
use super::super::walk::{Walker, shown};

pub fn check(case: &Value, walker: &mut Walker) {
    let press = &case["scene"]["press"];
    let Some(bodies) = case["scene"]["bodies"].as_array() else { return };
    if press.is_null() {
        return;
    }
    let mut fault = |path: String, value: &Value, problem: String, accepted: &str| {
        walker.fault(path, shown(value), problem, accepted);
    };
    let mut found = [None; 3];
    for (slot, role) in found.iter_mut().zip(["body", "bottom", "top"]) {
        let Some(name) = press[role].as_str() else { continue };
        *slot = bodies.iter().position(|body| body["name"] == name);
        if slot.is_none() {
            let problem = "is the name of no body".to_string();
            fault(format!("$.scene.press.{role}"), &press[role], problem, "the name of a body of the scene");
        }
    }
    let [Some(body), Some(bottom), Some(top)] = found else { return };
    if body == bottom || body == top || bottom == top {
        let problem = "needs three different bodies".to_string();
        fault("$.scene.press".into(), &press["body"], problem, "a body, a plate below and a plate above");
        return;
    }
    for (index, other) in bodies.iter().enumerate().filter(|(k, _)| ![body, bottom, top].contains(k)) {
        let problem = "stands in a press, which has room for one body and two plates".to_string();
        fault(format!("$.scene.bodies[{index}]"), &other["name"], problem, "no other body");
    }
    check_pressed(case, body, &mut fault);
    for (plate, fixed) in [(bottom, true), (top, false)] {
        let (path, plate) = (format!("$.scene.bodies[{plate}]"), &bodies[plate]);
        if plate["shape"]["box"].is_null() {
            fault(format!("{path}.shape"), &plate["shape"], "is no plate of a press".into(), "a box");
        }
        if nonzero(&plate["rotation"]) {
            let problem = "turns a plate of a press".to_string();
            fault(format!("{path}.rotation"), &plate["rotation"], problem, "[0, 0, 0]");
        }
        if plate["fixed"].as_bool() != Some(fixed) {
            let problem =
                "does not go with a press: the plate below is fixed, the one above is driven".to_string();
            fault(format!("{path}.fixed"), &plate["fixed"], problem, if fixed { "true" } else { "false" });
        }
    }
    if nonzero(&case["scene"]["gravity"]) {
        let problem = "acts in a press, where bodies have no weight".to_string();
        fault("$.scene.gravity".into(), &case["scene"]["gravity"], problem, "[0, 0, 0]");
    }
    check_stages(&case["stages"], bodies[top]["name"].as_str().unwrap_or_default(), &mut fault);
}

fn check_pressed(case: &Value, index: usize, fault: &mut dyn FnMut(String, &Value, String, &str)) {
    let body = &case["scene"]["bodies"][index];
    let path = format!("$.scene.bodies[{index}]");
    let own = &body["fidelity"];
    let fidelity = if own.is_null() { &case["solver"]["fidelity"] } else { own };
    if fidelity.as_str().is_some_and(|fidelity| fidelity != "condensed") {
        fault(format!("{path}.fidelity"), fidelity, "cannot be pressed".into(), "\"condensed\"");
    }
    let (rock, place) = match &body["rock"] {
        Value::Null => (&case["rock"], "$.rock.damage".to_string()),
        own => (own, format!("{path}.rock.damage")),
    };
    if rock["damage"].is_null() && !rock.is_null() {
        let problem = "leaves the body in the press elastic".to_string();
        fault(place, &rock["damage"], problem, "damage parameters");
    }
    if body["fixed"] == true {
        fault(format!("{path}.fixed"), &body["fixed"], "holds the body in the press".into(), "false");
    }
}

fn check_stages(stages: &Value, top: &str, fault: &mut dyn FnMut(String, &Value, String, &str)) {
    for (index, stage) in stages.as_array().into_iter().flatten().enumerate() {
        let path = format!("$.stages[{index}]");
        if nonzero(&stage["gravity"]) {
            let problem = "acts in a press, where bodies have no weight".to_string();
            fault(format!("{path}.gravity"), &stage["gravity"], problem, "no gravity");
        }
        for (name, load) in stage["bodies"].as_object().into_iter().flatten() {
            let path = child(&format!("{path}.bodies"), name);
            if name != top {
                let problem = "is loaded, but a press drives its upper plate only".to_string();
                fault(path.clone(), &Value::from(name.as_str()), problem, "the plate above");
            }
            for key in ["force", "moment", "rotation"] {
                if nonzero(&load[key]) {
                    let problem = "does not go with a press".to_string();
                    fault(format!("{path}.{key}"), &load[key], problem, "a displacement along z");
                }
            }
            let way = &load["displacement"];
            let along = |k: usize| way[k].as_f64();
            if !way.is_null()
                && (along(2).is_none() || [0, 1].iter().any(|&k| along(k).unwrap_or(0.0) != 0.0))
            {
                let problem = "does not go with a press".to_string();
                fault(format!("{path}.displacement"), way, problem, "[0, 0, dz]: negative closes the plates");
            }
        }
    }
}

/// Whether a list has a number that is not zero.
fn nonzero(list: &Value) -> bool {
    list.as_array().into_iter().flatten().any(|value| value.as_f64().is_some_and(|x| x != 0.0))
}

#[cfg(test)]
mod tests {
    use crate::case::checked;
    use crate::error::Error;

    const PRESSED: &str = r#"{"rock": {"density": 2600, "youngs_modulus": "20 GPa", "poissons_ratio": 0.2}, "contact": {"friction": 0.4},
        "scene": {"press": {"body": "core.1", "bottom": "low", "top": "high"}, "bodies": [
            {"name": "low", "shape": {"box": [0.06, 0.04, 0.01]}, "position": [0, 0, -0.005], "fixed": true, "fidelity": "rigid"},
            {"name": "core.1", "shape": {"box": [0.05, 0.03, 0.08]}, "position": [0, 0, 0.04], "fidelity": "condensed"},
            {"name": "high", "shape": {"box": [0.06, 0.04, 0.01]}, "position": [0, 0, 0.085], "fidelity": "rigid"}]},
        "stages": [{"kind": "load", "bodies": {"high": {"displacement": [0, 0, -1e-5]}}}]}"#;

    #[test]
    fn faults_stand_at_the_rock_and_the_body_that_they_are_of() {
        let paths = |text: &str| -> Vec<String> {
            match checked(text, &[]) {
                Err(Error::Case { faults, .. }) => faults.into_iter().map(|fault| fault.path).collect(),
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(paths(PRESSED), ["$.rock.damage"]);
        let own = PRESSED.replace(r#""condensed"}"#, r#""condensed", "rock": {"density": 2700}}"#);
        assert_eq!(paths(&own), ["$.scene.bodies[1].rock.damage"]);
        let loaded = PRESSED.replace(r#"{"high":"#, r#"{"core.1": {}, "high":"#);
        assert_eq!(paths(&loaded), ["$.rock.damage", "$.stages[0].bodies[\"core.1\"]"]);
    }
}
