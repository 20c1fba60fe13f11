//! What a case may ask for and riprap cannot run yet. Each room that fills strikes its line here.

use crate::error::Fault;

use super::types::*;

/// Parts of a sound case that cannot be run yet, each with its path and what can.
pub fn unsupported(case: &Case) -> Vec<Fault> {
    let mut faults = vec![];
    let mut refuse = |path: &str, value: &str, problem: &str, accepted: &str| {
        faults.push(Fault::new(path, value, problem, accepted));
    };
    let fidelity =
        |refuse: &mut dyn FnMut(&str, &str, &str, &str), path: &str, fidelity: Fidelity| match fidelity {
            Fidelity::Full => {
                refuse(path, "\"full\"", "full fidelity is not built yet", "\"rigid\", \"condensed\"")
            }
            Fidelity::Auto | Fidelity::Rigid | Fidelity::Condensed => {}
        };
    fidelity(&mut refuse, "$.solver.fidelity", case.solver.fidelity);
    match &case.geometry {
        Geometry::Specimen(_) => {
            if case.rock.damage.is_some() && case.fidelity_of_grains() != Fidelity::Condensed {
                let problem = "damage needs grains that deform";
                let accepted = "\"auto\", \"condensed\", or \"damage\": null";
                refuse("$.solver.fidelity", "\"rigid\"", problem, accepted);
            }
            if case.rock.damage.is_some() && matches!(case.membrane, MembraneCase::Rubber { .. }) {
                let problem = "grains that break are not built under a rubber membrane yet";
                refuse("$.membrane.kind", "\"rubber\"", problem, "\"pressure\", or \"damage\": null");
            }
            let name = match case.membrane {
                MembraneCase::RigidWall => Some("rigid_wall"),
                MembraneCase::Pressure | MembraneCase::Rubber { .. } => None,
            };
            if matches!(case.membrane, MembraneCase::Rubber { .. }) {
                rubber(&mut refuse, case);
            }
            if let Some(name) = name {
                let problem = format!("a {name} membrane is not built yet");
                refuse("$.membrane.kind", &format!("\"{name}\""), &problem, "\"pressure\", \"rubber\"");
            }
        }
        Geometry::Scene(scene) => {
            let breaks = |body: &BodyCase| {
                let rock = body.rock.as_ref().unwrap_or(&case.rock);
                let fidelity = body.fidelity.unwrap_or(case.solver.fidelity);
                rock.damage.is_some() && fidelity == Fidelity::Condensed
            };
            if case.rock.damage.is_some() && !scene.bodies.iter().any(breaks) {
                let problem = "damage needs a body that deforms, and none does";
                refuse(
                    "$.rock.damage",
                    "damage parameters",
                    problem,
                    "a body of fidelity \"condensed\", or null",
                );
            }
            for (i, body) in scene.bodies.iter().enumerate() {
                let path = format!("$.scene.bodies[{i}]");
                if let Some(own) = body.fidelity {
                    fidelity(&mut refuse, &format!("{path}.fidelity"), own);
                }
            }
        }
    }
    faults
}

/// What does not go together with a rubber membrane: it is glued to plates that do not turn, and the stiffness of
/// its contacts follows from pressures that the case names.
fn rubber(refuse: &mut dyn FnMut(&str, &str, &str, &str), case: &Case) {
    if case.plates.tilting == Tilting::Free {
        let problem = "a rubber membrane needs plates that do not turn";
        refuse("$.plates.tilting", "\"free\"", problem, "\"locked\", or a membrane of kind \"pressure\"");
    }
    for (i, stage) in case.stages.iter().enumerate() {
        let kind = match stage {
            StageCase::Oedometer { .. } => "oedometer",
            StageCase::ConstantVolume { .. } => "constant_volume",
            StageCase::ConstantP { .. } => "constant_p",
            StageCase::Consolidate { .. }
            | StageCase::Shear { .. }
            | StageCase::StressShear { .. }
            | StageCase::Unload { .. }
            | StageCase::Reload { .. }
            | StageCase::Hold { .. }
            | StageCase::Load { .. } => continue,
        };
        let problem =
            "a stage whose pressure follows from something else is not built for a rubber membrane yet";
        let accepted = "\"consolidate\", \"shear\", \"stress_shear\", \"unload\", \"reload\", \"hold\", or a membrane of kind \"pressure\"";
        refuse(&format!("$.stages[{i}].kind"), &format!("\"{kind}\""), problem, accepted);
    }
}
