//! What a case may ask for and riprap cannot run yet. Each room that fills strikes its line here.

use crate::error::Fault;

use super::types::*;

/// Nominal increments of every consolidation.
const CONSOLIDATION_INCREMENTS: usize = 10;

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
    let fidelity =
        |refuse: &mut dyn FnMut(&str, &str, &str, &str), path: &str, fidelity: Fidelity| match fidelity {
            Fidelity::Full => {
                refuse(path, "\"full\"", "full fidelity is not built yet", "\"rigid\", \"condensed\"")
            }
            Fidelity::Auto | Fidelity::Rigid | Fidelity::Condensed => {}
        };
    damage(&mut refuse, "$.rock", &case.rock);
    fidelity(&mut refuse, "$.solver.fidelity", case.solver.fidelity);
    match &case.geometry {
        Geometry::Specimen(_) => {
            let name = match case.membrane {
                MembraneCase::RigidWall => Some("rigid_wall"),
                MembraneCase::Pressure | MembraneCase::Rubber { .. } => None,
            };
            if let Some(name) = name {
                let problem = format!("a {name} membrane is not built yet");
                refuse("$.membrane.kind", &format!("\"{name}\""), &problem, "\"pressure\", \"rubber\"");
            }
        }
        Geometry::Scene(scene) => {
            for (i, body) in scene.bodies.iter().enumerate() {
                let path = format!("$.scene.bodies[{i}]");
                if let Some(rock) = &body.rock {
                    damage(&mut refuse, &format!("{path}.rock"), rock);
                }
                if let Some(own) = body.fidelity {
                    fidelity(&mut refuse, &format!("{path}.fidelity"), own);
                }
            }
        }
    }
    if case.solver.increment_max != 1.0 && matches!(case.geometry, Geometry::Specimen(_)) {
        let problem = "increments that grow beyond the stage's are not built yet";
        refuse("$.solver.increment_max", &case.solver.increment_max.to_string(), problem, "1");
    }
    for (i, stage) in case.stages.iter().enumerate() {
        let path = format!("$.stages[{i}]");
        match stage {
            StageCase::Consolidate { axial_pressure, radial_pressure, .. }
                if axial_pressure != radial_pressure =>
            {
                let problem = "anisotropic consolidation is not built yet";
                let accepted = format!("the radial_pressure, {radial_pressure}");
                refuse(&format!("{path}.axial_pressure"), &axial_pressure.to_string(), problem, &accepted);
            }
            StageCase::Consolidate { increments, .. } if *increments != CONSOLIDATION_INCREMENTS => {
                let problem = "a choice of increments is not built yet";
                let accepted = CONSOLIDATION_INCREMENTS.to_string();
                refuse(&format!("{path}.increments"), &increments.to_string(), problem, &accepted);
            }
            StageCase::Consolidate { .. } | StageCase::Shear { .. } | StageCase::Load { .. } => {}
            StageCase::Hold { .. } if matches!(case.geometry, Geometry::Scene(_)) => {}
            StageCase::Hold { .. }
            | StageCase::Unload { .. }
            | StageCase::Reload { .. }
            | StageCase::Oedometer { .. }
            | StageCase::ConstantVolume { .. }
            | StageCase::ConstantP { .. } => {
                let kind = stage.kind();
                let problem = format!("a stage \"{kind}\" is not built yet");
                let accepted = "\"consolidate\", \"shear\", \"load\"";
                refuse(&format!("{path}.kind"), &format!("\"{kind}\""), &problem, accepted);
            }
        }
    }
    faults
}
