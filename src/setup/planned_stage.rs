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

/// Largest axial strain of a driven increment over the accuracy asked for. Condensed grains were off by 0.8 %
/// of q at 1e-4 and 2.2 % at 2e-4, whatever else was set (docs/decisions/0118-default-fidelity-rigid.md).
const INCREMENT_OF_ACCURACY: f64 = 5e-3;

/// The stages of a case that [`crate::case::unsupported`] lets through.
pub fn planned_stages(case: &Case) -> Vec<PlannedStage> {
    let growth = case.solver.increment_growth;
    let steps = |nominal: f64, largest: f64| Steps::Strain { nominal, largest, growth };
    let until = |until: &UntilCase| Until {
        deviatoric_stress: until.deviatoric_stress,
        drop_after_peak: until.drop_after_peak,
        must: false,
    };
    let most =
        case.solver.chosen_accuracy().map_or(f64::INFINITY, |accuracy| INCREMENT_OF_ACCURACY * accuracy);
    let steps = |nominal: f64, largest: f64| steps(nominal.min(most), largest.min(most));
    let drive = |axial_strain: f64, lateral: Lateral, increment: f64, largest: f64, end: &UntilCase| {
        let increment = increment.min(most);
        let path = Path::Strain { axial_strain, lateral };
        let stage = Stage { path, steps: steps(increment, largest), until: until(end) };
        (Some(stage), (axial_strain / increment).max(1.0))
    };
    let counted = |path: Path, increments: usize| {
        let stage = Stage { path, steps: Steps::Count(increments), until: Until::default() };
        (Some(stage), increments as f64)
    };
    let planned = |(index, stage): (usize, &StageCase)| {
        let (run, increments) = match stage {
            StageCase::Consolidate { axial_pressure, radial_pressure, increments } => {
                let path = Path::Stress { axial: *axial_pressure, radial: *radial_pressure };
                counted(path, *increments)
            }
            StageCase::Shear { axial_strain, increment, increment_max, until, .. } => {
                drive(*axial_strain, Lateral::Pressure, *increment, *increment_max, until)
            }
            StageCase::Oedometer { axial_strain, increment, increment_max, until } => {
                drive(*axial_strain, Lateral::Area, *increment, *increment_max, until)
            }
            StageCase::ConstantVolume { axial_strain, increment, increment_max, until } => {
                drive(*axial_strain, Lateral::Volume, *increment, *increment_max, until)
            }
            StageCase::ConstantP { axial_strain, increment, increment_max, until } => {
                drive(*axial_strain, Lateral::MeanStress, *increment, *increment_max, until)
            }
            StageCase::StressShear { deviatoric_stress, increments, .. } => {
                counted(Path::Shear { deviatoric_stress: *deviatoric_stress }, *increments)
            }
            StageCase::Unload { deviatoric_stress, increment, increment_max, .. } => {
                let path = Path::Strain { axial_strain: -MOST_UNLOADING, lateral: Lateral::Pressure };
                let until =
                    Until { deviatoric_stress: Some(*deviatoric_stress), drop_after_peak: None, must: true };
                let stage = Stage { path, steps: steps(*increment, *increment_max), until };
                (Some(stage), (EXPECTED_UNLOADING / increment).max(1.0))
            }
            StageCase::Reload {
                axial_strain: Some(axial_strain), increment, increment_max, until, ..
            } => drive(*axial_strain, Lateral::Pressure, *increment, *increment_max, until),
            StageCase::Reload { axial_strain: None, increment, increment_max, until: end, .. } => {
                let path = Path::Return { lateral: Lateral::Pressure };
                let stage = Stage { path, steps: steps(*increment, *increment_max), until: until(end) };
                (Some(stage), (EXPECTED_UNLOADING / increment).max(1.0))
            }
            StageCase::Hold { increments } if matches!(case.geometry, Geometry::Specimen(_)) => {
                counted(Path::Hold, *increments)
            }
            StageCase::Hold { increments } | StageCase::Load { increments, .. } => (None, *increments as f64),
        };
        PlannedStage { index, kind: stage.kind(), stage: run, increments }
    };
    case.stages.iter().enumerate().map(planned).collect()
}
