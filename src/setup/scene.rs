//! The parameters of a scene from its case: bodies, press, stages.

use std::path::Path;

use crate::case::{Case, Geometry, PressCase, SceneCase, StageCase};
use crate::error::{Error, Result};
use crate::scene::{LoadStage, PressParameters, SceneParameters};
use crate::tensor::Vec3;

use super::scene_body::{friction, scene_body};
use super::settings::scene_settings;

/// What a scene takes from its case. `folder` is where its mesh files are relative to.
///
/// # Errors
/// `Error::Usage` where the case is not a scene or asks for what a scene cannot do yet;
/// `Error::Mesh` and `Error::Io` where a mesh file cannot be used.
pub fn scene_parameters(case: &Case, folder: &Path) -> Result<SceneParameters> {
    let Geometry::Scene(scene) = &case.geometry else {
        return Err(Error::Usage("the case has a specimen, not a scene".into()));
    };
    let friction = friction(case, case.contact.friction);
    let bodies = scene
        .bodies
        .iter()
        .enumerate()
        .map(|(index, body)| scene_body(case, index, body, folder))
        .collect::<Result<_>>()?;
    let stages = case.stages.iter().enumerate().map(load_stage).collect::<Result<_>>()?;
    Ok(SceneParameters {
        bodies,
        gravity: Vec3::from(scene.gravity),
        friction,
        faces: case.contact.faces,
        normal: case.contact.normal,
        settings: scene_settings(case),
        increment_range: [case.solver.increment_min, case.solver.increment_max],
        stages,
        press: scene.press.as_ref().map(|press| press_of(scene, press)).transpose()?,
    })
}

fn press_of(scene: &SceneCase, press: &PressCase) -> Result<PressParameters> {
    let number = |name: &str| {
        let found = scene.bodies.iter().position(|body| body.name == name);
        found.ok_or_else(|| Error::Usage(format!("the press names {name:?}, which is no body")))
    };
    Ok(PressParameters {
        body: number(&press.body)?,
        bottom: number(&press.bottom)?,
        top: number(&press.top)?,
        grip: press.grip,
        patch: press.patch,
    })
}

fn load_stage((index, stage): (usize, &StageCase)) -> Result<LoadStage> {
    match stage {
        StageCase::Load { increments, bodies, gravity } => Ok(LoadStage {
            increments: *increments,
            bodies: bodies.iter().map(|(name, load)| (name.clone(), load.clone())).collect(),
            gravity: gravity.map(Vec3::from),
        }),
        StageCase::Hold { increments } => Ok(LoadStage { increments: *increments, ..LoadStage::default() }),
        StageCase::Consolidate { .. }
        | StageCase::Shear { .. }
        | StageCase::StressShear { .. }
        | StageCase::Unload { .. }
        | StageCase::Reload { .. }
        | StageCase::Oedometer { .. }
        | StageCase::ConstantVolume { .. }
        | StageCase::ConstantP { .. } => Err(Error::Usage(format!(
            "$.stages[{index}].kind: a scene has no stage {:?}; accepted: \"load\", \"hold\"",
            stage.kind()
        ))),
    }
}
