//! Size of a specimen and number of its grains: each follows from the other and the void ratio.

use crate::error::{Error, Result};
use crate::specimen::grading::{SizeClass, numbers_of_total, numbers_of_volume};
use crate::specimen::placement::cylinder_volume;
use std::f64::consts::PI;

/// How large a specimen is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SpecimenSize {
    /// Diameter and height [m]; the number of grains follows.
    Cylinder { diameter: f64, height: f64 },
    /// The number of grains and height over diameter; the size follows.
    Grains { count: usize, aspect: f64 },
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

/// How a stated number of grains agrees with a stated diameter, height and void ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Consistency {
    /// The number of grains that size and void ratio give.
    pub grains: usize,
    /// Stated number over that number, minus one.
    pub deviation: f64,
    /// Diameter [m] that would fit the stated number, with height over diameter and void ratio kept.
    pub diameter: f64,
    /// Void ratio that would fit the stated number and size.
    pub void_ratio: f64,
}

/// Largest deviation that counts as agreement.
pub const CONSISTENCY: f64 = 0.05;

/// Compares a stated number of grains with a stated size and void ratio.
pub fn consistency(
    classes: &[SizeClass],
    mean_volumes: &[f64],
    (diameter, height): (f64, f64),
    void_ratio: f64,
    count: usize,
) -> Consistency {
    let by_size = plan(classes, mean_volumes, &SpecimenSize::Cylinder { diameter, height }, void_ratio);
    let by_count =
        plan(classes, mean_volumes, &SpecimenSize::Grains { count, aspect: height / diameter }, void_ratio);
    let grains: usize = by_size.numbers.iter().sum();
    Consistency {
        grains,
        deviation: count as f64 / grains as f64 - 1.0,
        diameter: by_count.diameter,
        void_ratio: cylinder_volume(diameter, height) / by_count.solid_volume - 1.0,
    }
}
