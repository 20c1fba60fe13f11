//! What a case may ask for and riprap cannot run yet. Each room that fills strikes its line here.

use crate::error::Fault;

use super::types::*;

/// Parts of a sound case that cannot be run yet, each with its path and what can.
pub fn unsupported(case: &Case) -> Vec<Fault> {
    let mut faults = vec![];
    let mut refuse = |path: &str, value: &str, problem: &str, accepted: &str| {
        faults.push(Fault::new(path, value, problem, accepted));
    };
    let damage = |refuse: &mut dyn FnMut(&str, &str, &str, &str), path: &str, rock: &RockCase| {
        if rock.damage.is_some() {
            let problem = "damage is not built yet; set \"damage\": null";
            refuse(&format!("{path}.damage"), "damage parameters", problem, "null");
        }
    };
    damage(&mut refuse, "$.rock", &case.rock);
    match &case.geometry {
        Geometry::Specimen(_) => match case.membrane {
            MembraneCase::Pressure => {}
            MembraneCase::Rubber { .. } => rubber(&mut refuse, case),
            MembraneCase::RigidWall => wall(&mut refuse, case),
        },
        Geometry::Scene(scene) => {
            for (i, body) in scene.bodies.iter().enumerate() {
                let path = format!("$.scene.bodies[{i}]");
                if let Some(rock) = &body.rock {
                    damage(&mut refuse, &format!("{path}.rock"), rock);
                }
            }
        }
    }
    faults
}

/// What does not go together with a rigid wall: it stands between plates that do not turn, and knows the grains by their
/// rigid corners.
fn wall(refuse: &mut dyn FnMut(&str, &str, &str, &str), case: &Case) {
    if case.plates.tilting == Tilting::Free {
        let problem = "a rigid wall needs plates that do not turn";
        refuse("$.plates.tilting", "\"free\"", problem, "\"locked\", or a membrane of kind \"pressure\"");
    }
    if case.solver.fidelity == Fidelity::Condensed {
        let problem = "a rigid wall is built for rigid grains only";
        let accepted = "\"rigid\", or a membrane of kind \"pressure\"";
        refuse("$.solver.fidelity", "\"condensed\"", problem, accepted);
    }
}

/// What does not go together with a rubber membrane: it is glued to plates that do not turn.
fn rubber(refuse: &mut dyn FnMut(&str, &str, &str, &str), case: &Case) {
    if case.plates.tilting == Tilting::Free {
        let problem = "a rubber membrane needs plates that do not turn";
        refuse("$.plates.tilting", "\"free\"", problem, "\"locked\", or a membrane of kind \"pressure\"");
    }
}
