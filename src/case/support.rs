//! What a case may ask for and riprap cannot run yet. Each room that fills strikes its line here.

use crate::contact::face::FaceContact;
use crate::error::{Fault, Faults};
use crate::mesh::MOST_CELLS;

use super::types::*;

/// Parts of a sound case that cannot be run yet, each with its path and what can.
pub fn unsupported(case: &Case) -> Vec<Fault> {
    let mut faults = vec![];
    let mut refuse = |path: &str, value: &str, problem: &str, accepted: &str| {
        faults.fault(path, value, problem, accepted);
    };
    match &case.geometry {
        Geometry::Specimen(_) => {
            if case.rock.damage.is_some() {
                breaking(&mut refuse, case);
            }
            if case.contact.faces == FaceContact::Area {
                patches(&mut refuse, case);
            }
            match case.membrane {
                MembraneCase::Pressure { .. } | MembraneCase::Rubber { .. } => {}
                MembraneCase::RigidWall => wall(&mut refuse, case),
            }
        }
        Geometry::Scene(scene) => {
            let problem = "rubble is kept in specimens only";
            let mut refuse_rubble = |path: &str| refuse(path, "\"kept\"", problem, "\"removed\"");
            if keeps_rubble(&case.rock) {
                refuse_rubble("$.rock.damage.rubble");
            } else {
                // What a body's rock does not say is the case's.
                let keeps = |body: &BodyCase| body.rock.as_ref().is_some_and(keeps_rubble);
                for index in (0..scene.bodies.len()).filter(|index| keeps(&scene.bodies[*index])) {
                    refuse_rubble(&format!("$.scene.bodies[{index}].rock.damage.rubble"));
                }
            }
            let breaks = |body: &BodyCase| {
                let fidelity = body.fidelity.unwrap_or(case.solver.fidelity);
                let chosen = fidelity == Fidelity::Auto && case.solver.accuracy.is_some();
                case.rock_of(body).damage.is_some()
                    && (matches!(fidelity, Fidelity::Condensed | Fidelity::Full) || chosen)
            };
            for (index, body) in scene.bodies.iter().enumerate() {
                let path = format!("$.scene.bodies[{index}]");
                // What it does not say is the case's.
                let own = body.rock.as_ref().and_then(|rock| rock.damage);
                if own.is_some() && own != case.rock.damage && case.fidelity_of(body) == Fidelity::Rigid {
                    let problem = "damage needs a body that deforms, and this one is rigid";
                    let accepted = "fidelity \"condensed\", or null";
                    refuse(&format!("{path}.rock.damage"), "damage parameters", problem, accepted);
                }
                let cells = case.cells_of(body);
                if cells > MOST_CELLS as f64 && body.shape.file().is_none() {
                    let problem = format!("makes about {cells:.0e} cells (a plain number is in m)");
                    let found = body.mesh_size.map_or("the default".into(), |size| format!("{size} m"));
                    let accepted = format!("what makes at most {MOST_CELLS}");
                    refuse(&format!("{path}.mesh_size"), &found, &problem, &accepted);
                }
            }
            scene_solver(&mut refuse, &case.solver);
            if case.rock.damage.is_some() && !scene.bodies.iter().any(breaks) {
                let problem = "damage needs a body that deforms, and none does";
                refuse(
                    "$.rock.damage",
                    "damage parameters",
                    problem,
                    "a body of fidelity \"condensed\", or null",
                );
            }
        }
    }
    faults
}

/// Settings of specimens that a scene has no use for.
fn scene_solver(refuse: &mut dyn FnMut(&str, &str, &str, &str), solver: &SolverCase) {
    let problem = "scenes are not cut for their energy";
    if solver.energy_gate == Some(GateCase::Cut) {
        refuse("$.solver.energy_gate", "\"cut\"", problem, "\"warn\" or null");
    }
}

/// What does not go together with patches of grains' faces: shapes that change, or how grains deform, as they run.
fn patches(refuse: &mut dyn FnMut(&str, &str, &str, &str), case: &Case) {
    if case.rock.damage.is_some() {
        let problem = "faces of grains that break share no patches yet";
        refuse("$.contact.faces", "\"area\"", problem, "\"corners\", or \"damage\": null");
    }
    if case.solver.chosen_accuracy().is_some() {
        let problem = "faces share no patches yet where the fidelity of grains changes";
        refuse("$.contact.faces", "\"area\"", problem, "\"corners\"");
    }
}

fn keeps_rubble(rock: &RockCase) -> bool {
    rock.damage.is_some_and(|damage| damage.rubble == RubbleCase::Kept)
}

/// What does not go together with grains that break.
fn breaking(refuse: &mut dyn FnMut(&str, &str, &str, &str), case: &Case) {
    let deforming = matches!(case.fidelity_of_grains(), Fidelity::Condensed | Fidelity::Full)
        || case.solver.chosen_accuracy().is_some();
    if keeps_rubble(&case.rock) && deforming {
        let problem = "rubble is kept where grains are rigid in their contacts";
        let accepted = "\"removed\", or fidelity \"auto\" without an accuracy or \"rigid\"";
        refuse("$.rock.damage.rubble", "\"kept\"", problem, accepted);
    }
    if matches!(case.membrane, MembraneCase::RigidWall) {
        let problem = "grains that break are not built inside a rigid wall";
        let accepted = "\"pressure\", \"rubber\", or \"damage\": null";
        refuse("$.membrane.kind", "\"rigid_wall\"", problem, accepted);
    }
}

/// What does not go together with a rigid wall: it stands between plates that do not turn, and knows the grains by their
/// rigid corners.
fn wall(refuse: &mut dyn FnMut(&str, &str, &str, &str), case: &Case) {
    if case.plates.tilting == Tilting::Free {
        let problem = "a rigid wall needs plates that do not turn";
        let accepted = "\"locked\", or a membrane of kind \"pressure\" or \"rubber\"";
        refuse("$.plates.tilting", "\"free\"", problem, accepted);
    }
    let fidelity = match case.solver.fidelity {
        Fidelity::Auto if case.solver.accuracy.is_some() => Some("\"auto\" with an accuracy"),
        Fidelity::Auto | Fidelity::Rigid => None,
        Fidelity::Condensed => Some("\"condensed\""),
        Fidelity::Full => Some("\"full\""),
    };
    if let Some(fidelity) = fidelity {
        let problem = "a rigid wall is built for rigid grains only";
        refuse("$.solver.fidelity", fidelity, problem, "\"rigid\", or a membrane of kind \"pressure\"");
    }
}
