//! Size of a specimen and number of its grains: each follows from the other and the void ratio.

use crate::error::{Error, Result};
use crate::specimen::grading::{SizeClass, numbers_of_total, numbers_of_volume};
use crate::specimen::placement::cylinder_volume;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// How large a specimen is to be; what says both is of the first.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum SpecimenSize {
    /// Diameter and height [m]; the number of grains follows.
    Cylinder { diameter: f64, height: f64 },
    /// The number of grains and height over diameter; the size follows.
    Grains {
        #[serde(rename = "grains")]
        count: usize,
        aspect: f64,
    },
}

impl SpecimenSize {
    pub(crate) fn check(&self) -> Result<()> {
        let fail = |message: String| Err(Error::Specimen(message));
        let positive = |x: f64| x > 0.0 && x.is_finite();
        match *self {
            SpecimenSize::Cylinder { diameter, height } if !(positive(diameter) && positive(height)) => {
                fail(format!("diameter {diameter} m and height {height} m are not lengths"))
            }
            SpecimenSize::Grains { count, aspect } if !(count > 0 && positive(aspect)) => {
                fail(format!("{count} grains with height over diameter {aspect} are no specimen"))
            }
            SpecimenSize::Cylinder { .. } | SpecimenSize::Grains { .. } => Ok(()),
        }
    }
}

/// Numbers that a specimen is drawn from.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Grains per class.
    pub numbers: Vec<usize>,
    /// Volume of all grains [m^3].
    pub solid_volume: f64,
    /// Height over diameter.
    pub aspect: f64,
    /// Expected diameter and height [m].
    pub diameter: f64,
    pub height: f64,
}

/// The plan for a size and a void ratio; `mean_volumes` [m^3] per class.
pub fn plan(classes: &[SizeClass], mean_volumes: &[f64], size: &SpecimenSize, void_ratio: f64) -> Plan {
    match *size {
        SpecimenSize::Cylinder { diameter, height } => {
            let solid_volume = cylinder_volume(diameter, height) / (1.0 + void_ratio);
            let numbers = numbers_of_volume(classes, mean_volumes, solid_volume);
            Plan { numbers, solid_volume, aspect: height / diameter, diameter, height }
        }
        SpecimenSize::Grains { count, aspect } => {
            let numbers = numbers_of_total(classes, mean_volumes, count);
            let solid_volume: f64 = numbers.iter().zip(mean_volumes).map(|(&n, v)| n as f64 * v).sum();
            let diameter = (4.0 * solid_volume * (1.0 + void_ratio) / (PI * aspect)).cbrt();
            Plan { numbers, solid_volume, aspect, diameter, height: aspect * diameter }
        }
    }
}

/// Largest deviation that counts as agreement.
pub const CONSISTENCY: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::*;

    fn classes() -> (Vec<SizeClass>, Vec<f64>) {
        let class = |low: f64, high: f64, mass_fraction| SizeClass { sizes: [low, high], mass_fraction };
        (vec![class(0.04, 0.06, 0.38), class(0.02, 0.04, 0.62)], vec![3e-5, 7e-6])
    }

    #[test]
    fn size_and_number_follow_from_each_other() {
        let (classes, volumes) = classes();
        let by_size = plan(&classes, &volumes, &SpecimenSize::Cylinder { diameter: 0.3, height: 0.65 }, 0.47);
        let count = by_size.numbers.iter().sum();
        let by_count = plan(&classes, &volumes, &SpecimenSize::Grains { count, aspect: 0.65 / 0.3 }, 0.47);
        // One grain more or less in about three thousand.
        assert!((by_count.diameter / 0.3 - 1.0).abs() < 1e-3);
        assert!((by_count.solid_volume * 1.47 - 0.25 * PI * 0.09 * 0.65).abs() < 1e-4);
    }
}
