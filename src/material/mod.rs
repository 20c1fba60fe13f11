//! Rock: linear elasticity and the statistical fields of its properties. Rubber: hyperelastic sheets.
//!
//! Tension positive. Strains and stresses as 6-vectors in Voigt order xx, yy, zz, xy, yz, zx, with
//! engineering shear strains (`gamma = 2 epsilon`): the one order used everywhere.

pub mod elastic;
pub mod field;
pub mod rubber;

pub use elastic::Elastic;
pub use field::{Field, Law, Property, Quantity, sample_field};
pub use rubber::{Rubber, RubberLaw, SheetState, Wrinkling};

/// A material value that physics or a statistical law does not allow.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MaterialError {
    #[error("Young's modulus {0} Pa must be positive and finite")]
    YoungsModulus(f64),
    #[error("Poisson's ratio {0} must be above -1 and below 0.5")]
    PoissonsRatio(f64),
    #[error("the density {0} kg/m^3 must be positive and finite")]
    Density(f64),
    #[error("{name} {value} of the {law} law must be positive and finite")]
    Parameter { law: &'static str, name: &'static str, value: f64 },
    #[error("the mean {mean} is outside {low}..{high}, the bounds of the {property}")]
    Mean { property: &'static str, mean: f64, low: f64, high: f64 },
    #[error(
        "the {law} law of the {property} falls outside {low}..{high} more than {attempts} times in a row"
    )]
    Bounds { law: &'static str, property: &'static str, low: f64, high: f64, attempts: u32 },
}
