//! The stages of a case as the rig runs them, each with the increments that it is expected to take.

use crate::case::{Case, Geometry, StageCase, UntilCase};
use crate::triaxial::{Lateral, Path, Stage, Steps, Until};

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
    /// Axial strain to be added (or taken back), where the stage says how much.
    pub fn axial_strain(&self) -> Option<f64> {
        self.stage.and_then(|stage| stage.axial_strain()).map(f64::abs)
    }

    /// Whether it brings the specimen to a pressure, before strains count.
    pub fn consolidates(&self) -> bool {
        self.kind == "consolidate"
    }
}

/// Axial strain that an unloading or reloading takes, about, for the estimate of increments.
const EXPECTED_UNLOADING: f64 = 1e-3;
/// An unloading that is not over after this much axial strain has failed.
const MOST_UNLOADING: f64 = 0.05;

/// The stages of a case that [`crate::case::unsupported`] lets through.
pub fn planned_stages(case: &Case) -> Vec<PlannedStage> {
    let growth = case.solver.increment_growth;
    let strained = |stage: &StageCase, path: Path, until: Until| {
        let taken = case.strained(stage)?;
        let steps = Steps::Strain { nominal: taken.increment, largest: taken.increment_max, growth };
        let stage = Stage { path, steps, until };
        let increments = taken.axial_strain.unwrap_or(EXPECTED_UNLOADING) / taken.increment;
        Some((stage, increments.max(1.0)))
    };
    let driven = |stage: &StageCase, lateral: Lateral| {
        let given = stage.strained()?;
        let path = match given.axial_strain {
            Some(axial_strain) => Path::Strain { axial_strain, lateral },
            None => Path::Return { lateral },
        };
        let UntilCase { deviatoric_stress, drop_after_peak } = given.until;
        strained(stage, path, Until { deviatoric_stress, drop_after_peak, must: false })
    };
    let counted = |path: Path, increments: usize| {
        let stage = Stage { path, steps: Steps::Count(increments), until: Until::default() };
        Some((stage, increments as f64))
    };
    let planned = |(index, stage): (usize, &StageCase)| {
        let run = match *stage {
            StageCase::Consolidate { axial_pressure, radial_pressure, increments } => {
                counted(Path::Stress { axial: axial_pressure, radial: radial_pressure }, increments)
            }
            StageCase::StressShear { deviatoric_stress, increments, .. } => {
                counted(Path::Shear { deviatoric_stress }, increments)
            }
            StageCase::Shear { .. } | StageCase::Reload { .. } => driven(stage, Lateral::Pressure),
            StageCase::Oedometer { .. } => driven(stage, Lateral::Area),
            StageCase::ConstantVolume { .. } => driven(stage, Lateral::Volume),
            StageCase::ConstantP { .. } => driven(stage, Lateral::MeanStress),
            StageCase::Unload { deviatoric_stress, .. } => {
                let path = Path::Strain { axial_strain: -MOST_UNLOADING, lateral: Lateral::Pressure };
                let until =
                    Until { deviatoric_stress: Some(deviatoric_stress), drop_after_peak: None, must: true };
                strained(stage, path, until)
            }
            StageCase::Hold { increments } if matches!(case.geometry, Geometry::Specimen(_)) => {
                counted(Path::Hold, increments)
            }
            StageCase::Hold { increments } | StageCase::Load { increments, .. } => {
                let increments = increments as f64;
                return PlannedStage { index, kind: stage.kind(), stage: None, increments };
            }
        };
        let (run, increments) = run.unzip();
        PlannedStage { index, kind: stage.kind(), stage: run, increments: increments.unwrap_or(0.0) }
    };
    case.stages.iter().enumerate().map(planned).collect()
}
