//! Stages: what is prescribed, how fine, and when a stage is over. Compression positive.

use serde::{Deserialize, Serialize};

/// A stage of a triaxial test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stage {
    pub path: Path,
    pub steps: Steps,
    pub until: Until,
}

/// What a stage prescribes to the end plates and to the side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Path {
    /// Axial and radial stress go linearly to these [Pa]; the top plate is loaded.
    Stress { axial: f64, radial: f64 },
    /// The deviatoric stress goes linearly to this [Pa] at constant pressure; the top plate is loaded.
    Shear { deviatoric_stress: f64 },
    /// The top plate is driven by this axial strain (negative: away), of the height that strains count from.
    Strain { axial_strain: f64, lateral: Lateral },
    /// The top plate is driven back to where the last drive the other way began.
    Return { lateral: Lateral },
    /// The top plate stays where it is, or under the load that it has; so does the pressure.
    Hold,
}

/// What is kept at the side while the top plate is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Lateral {
    /// The confining pressure.
    Pressure,
    /// The enclosed volume; the pressure follows.
    Volume,
    /// The mean cross-section; the pressure follows.
    Area,
    /// The mean stress `(axial + 2 radial) / 3`; the pressure follows.
    MeanStress,
}

/// Step control of a stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Steps {
    /// So many increments, if none is cut.
    Count(usize),
    /// Axial strain of the nominal and of the largest increment, and the growth after an easy one.
    Strain { nominal: f64, largest: f64, growth: f64 },
}

/// What ends a stage before its path does.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Until {
    /// Deviatoric stress [Pa] to land on, from whichever side.
    pub deviatoric_stress: Option<f64>,
    /// Share of the largest deviatoric stress of the stage that it has to lose.
    pub drop_after_peak: Option<f64>,
    /// Whether it is a failure not to meet it.
    pub must: bool,
}

impl Stage {
    /// Axial strain to be added (negative: taken back), where the path says how much.
    pub fn axial_strain(&self) -> Option<f64> {
        match self.path {
            Path::Strain { axial_strain, .. } => Some(axial_strain),
            Path::Stress { .. } | Path::Shear { .. } | Path::Return { .. } | Path::Hold => None,
        }
    }
}
