//! The stages of a checked case.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::scene::BodyLoad;

/// One stage. Pressures [Pa] and axial strains (shortening) are positive in compression.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum StageCase {
    Consolidate {
        axial_pressure: f64,
        radial_pressure: f64,
        increments: usize,
    },
    /// `axial_strain` is added in this stage; `pressure` is the confining pressure held, `None` what
    /// the stage before leaves.
    Shear {
        axial_strain: f64,
        increment: f64,
        increment_max: f64,
        until: UntilCase,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pressure: Option<f64>,
    },
    /// To `deviatoric_stress` [Pa], the top plate loaded.
    StressShear {
        deviatoric_stress: f64,
        increments: usize,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pressure: Option<f64>,
    },
    /// Back to `deviatoric_stress` [Pa].
    Unload {
        deviatoric_stress: f64,
        increment: f64,
        increment_max: f64,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pressure: Option<f64>,
    },
    /// `None`: to where the last unloading began.
    Reload {
        axial_strain: Option<f64>,
        increment: f64,
        increment_max: f64,
        until: UntilCase,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pressure: Option<f64>,
    },
    Oedometer {
        axial_strain: f64,
        increment: f64,
        increment_max: f64,
        until: UntilCase,
    },
    ConstantVolume {
        axial_strain: f64,
        increment: f64,
        increment_max: f64,
        until: UntilCase,
    },
    ConstantP {
        axial_strain: f64,
        increment: f64,
        increment_max: f64,
        until: UntilCase,
    },
    Hold {
        increments: usize,
    },
    /// Of a scene. Linear over the stage.
    Load {
        increments: usize,
        /// By body name, each name known.
        bodies: BTreeMap<String, BodyLoad>,
        /// Acceleration at the end of the stage [m/s2]; `None`: as before the stage.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        gravity: Option<[f64; 3]>,
    },
}

/// What ends a stage before its axial strain is reached.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UntilCase {
    /// [Pa]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deviatoric_stress: Option<f64>,
    /// Share of the stage's largest deviatoric stress that has to be lost.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drop_after_peak: Option<f64>,
}

/// How a stage that strains the specimen goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrainedCase {
    /// `None`: until a stress is reached.
    pub axial_strain: Option<f64>,
    /// Axial strain of an increment, and the most that it may grow to.
    pub increment: f64,
    pub increment_max: f64,
    pub until: UntilCase,
}

impl StageCase {
    /// Of a stage that drives the top plate.
    pub fn strained(&self) -> Option<StrainedCase> {
        match *self {
            StageCase::Shear { axial_strain, increment, increment_max, until, .. }
            | StageCase::Oedometer { axial_strain, increment, increment_max, until }
            | StageCase::ConstantVolume { axial_strain, increment, increment_max, until }
            | StageCase::ConstantP { axial_strain, increment, increment_max, until } => {
                Some(StrainedCase { axial_strain: Some(axial_strain), increment, increment_max, until })
            }
            StageCase::Reload { axial_strain, increment, increment_max, until, .. } => {
                Some(StrainedCase { axial_strain, increment, increment_max, until })
            }
            StageCase::Unload { increment, increment_max, .. } => {
                let until = UntilCase::default();
                Some(StrainedCase { axial_strain: None, increment, increment_max, until })
            }
            StageCase::Consolidate { .. }
            | StageCase::StressShear { .. }
            | StageCase::Hold { .. }
            | StageCase::Load { .. } => None,
        }
    }

    /// Confining pressure that the stage names [Pa].
    pub fn pressure(&self) -> Option<f64> {
        match *self {
            StageCase::Consolidate { radial_pressure, .. } => Some(radial_pressure),
            StageCase::Shear { pressure, .. }
            | StageCase::StressShear { pressure, .. }
            | StageCase::Unload { pressure, .. }
            | StageCase::Reload { pressure, .. } => pressure,
            StageCase::Oedometer { .. }
            | StageCase::ConstantVolume { .. }
            | StageCase::ConstantP { .. }
            | StageCase::Hold { .. }
            | StageCase::Load { .. } => None,
        }
    }

    /// The largest pressure that the stage names [Pa]; zero where it names none.
    pub fn largest_pressure(&self) -> f64 {
        let radial = self.pressure().unwrap_or(0.0);
        if let StageCase::Consolidate { axial_pressure, .. } = self {
            axial_pressure.max(radial)
        } else {
            radial
        }
    }

    /// The word for it in the case file.
    pub fn kind(&self) -> &'static str {
        match self {
            StageCase::Consolidate { .. } => "consolidate",
            StageCase::Shear { .. } => "shear",
            StageCase::StressShear { .. } => "stress_shear",
            StageCase::Unload { .. } => "unload",
            StageCase::Reload { .. } => "reload",
            StageCase::Oedometer { .. } => "oedometer",
            StageCase::ConstantVolume { .. } => "constant_volume",
            StageCase::ConstantP { .. } => "constant_p",
            StageCase::Hold { .. } => "hold",
            StageCase::Load { .. } => "load",
        }
    }
}
