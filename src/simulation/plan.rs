//! From the checked case to what the rig takes.

use crate::case::{Case, MembraneCase, RubberLawCase, SolverCase, StageCase};
use crate::contact::law::Friction;
use crate::error::{Error, Result};
use crate::material::{Rubber, RubberLaw};
use crate::solver::Settings;
use crate::triaxial::{RigParameters, RubberSheet, Stage};

/// A stage of the case as the rig runs it.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedStage {
    /// Counted from 0 as in the case file.
    pub index: usize,
    /// The case file's word for it.
    pub kind: &'static str,
    /// What the rig does; `None` for what is done to the bodies of a scene.
    pub stage: Option<Stage>,
    /// Nominal number of increments.
    pub increments: f64,
}

impl PlannedStage {
    /// Axial strain to be added, where the stage is driven by strain.
    pub fn axial_strain(&self) -> Option<f64> {
        match self.stage {
            Some(Stage::Shear { axial_strain, .. }) => Some(axial_strain),
            Some(Stage::Consolidate { .. }) | None => None,
        }
    }
}

/// The stages of a case that [`crate::case::unsupported`] lets through.
pub fn planned_stages(case: &Case) -> Vec<PlannedStage> {
    let planned = |(index, stage): (usize, &StageCase)| {
        let (run, increments) = match *stage {
            StageCase::Consolidate { radial_pressure, increments, .. } => {
                (Some(Stage::Consolidate { pressure: radial_pressure }), increments as f64)
            }
            StageCase::Shear { axial_strain, increment, .. } => {
                (Some(Stage::Shear { axial_strain, increment }), (axial_strain / increment).max(1.0))
            }
            StageCase::Hold { increments } | StageCase::Load { increments, .. } => (None, increments as f64),
            StageCase::Unload { .. }
            | StageCase::Reload { .. }
            | StageCase::Oedometer { .. }
            | StageCase::ConstantVolume { .. }
            | StageCase::ConstantP { .. } => return None,
        };
        Some(PlannedStage { index, kind: stage.kind(), stage: run, increments })
    };
    case.stages.iter().enumerate().filter_map(planned).collect()
}

/// What the rig is built of.
///
/// # Errors
/// `Error::Usage` for a rubber that the case's table lets through and the material does not allow.
pub fn rig_parameters(case: &Case) -> Result<RigParameters> {
    let contact = case.contact;
    Ok(RigParameters {
        density: case.rock.density,
        youngs_modulus: case.rock.youngs_modulus.mean,
        poissons_ratio: case.rock.poissons_ratio.mean,
        friction: Friction {
            peak: contact.friction,
            residual: contact.residual_friction,
            weakening_distance: contact.weakening_distance,
        },
        plate_friction: Friction::constant(case.plates.friction),
        membrane: rubber_sheet(case)?,
    })
}

fn rubber_sheet(case: &Case) -> Result<Option<RubberSheet>> {
    let MembraneCase::Rubber { thickness, shear_modulus, law, mooney_share, gent_limit, mesh_size } =
        case.membrane
    else {
        return Ok(None);
    };
    let law = match law {
        RubberLawCase::NeoHookean => RubberLaw::NeoHookean,
        RubberLawCase::MooneyRivlin => RubberLaw::MooneyRivlin { share: mooney_share },
        RubberLawCase::Gent => RubberLaw::Gent { limit: gent_limit },
    };
    let rubber =
        Rubber::new(shear_modulus, law).map_err(|problem| Error::Usage(format!("$.membrane: {problem}")))?;
    let pressures = case.stages.iter().map(|stage| match *stage {
        StageCase::Consolidate { radial_pressure, .. } => radial_pressure,
        StageCase::Shear { pressure, .. }
        | StageCase::Unload { pressure, .. }
        | StageCase::Reload { pressure, .. } => pressure,
        StageCase::Oedometer { .. }
        | StageCase::ConstantVolume { .. }
        | StageCase::ConstantP { .. }
        | StageCase::Hold { .. }
        | StageCase::Load { .. } => 0.0,
    });
    let pressure = pressures.fold(0.0, f64::max);
    Ok(Some(RubberSheet { rubber, thickness, mesh_size, pressure }))
}

pub fn settings(solver: &SolverCase) -> Settings {
    Settings {
        force_tolerance: solver.force_tolerance,
        gap_tolerance: solver.gap_tolerance,
        max_augmentations: solver.max_augmentations,
        max_newton: solver.max_newton_iterations,
        // Halvings that stay above the smallest increment.
        max_cuts: (-solver.increment_min.log2() + 1e-9).floor().max(0.0) as usize,
        ..Settings::default()
    }
}
