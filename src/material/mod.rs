//! Rock: linear elasticity, damage softening and the statistical fields of its properties. Rubber: hyperelastic
//! sheets.
//!
//! Tension positive. Strains and stresses as 6-vectors in Voigt order xx, yy, zz, xy, yz, zx, with
//! engineering shear strains (`gamma = 2 epsilon`): the one order used everywhere.

pub mod damage;
pub mod drawn;
pub mod elastic;
pub mod field;
pub mod rubber;
pub mod secant;
pub mod softening;

pub use damage::{DamageLaw, DamageParameters, DamageState, Response};
pub use drawn::Drawn;
pub use elastic::Elastic;
pub use field::{Field, Law, Property, Quantity, sample_field};
pub use rubber::{Rubber, RubberLaw, SheetState, Wrinkling};
pub use secant::Secant;
pub use softening::{Softening, crack_band_size};

/// A material value that physics or a statistical law does not allow.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MaterialError {
    #[error("Young's modulus {0} Pa must be positive and finite")]
    YoungsModulus(f64),
    #[error("Poisson's ratio {0} must be above -1 and below 0.5")]
    PoissonsRatio(f64),
    #[error("the density {0} kg/m^3 must be positive and finite")]
    Density(f64),
    #[error("the {kind} strength {value} Pa must be positive and finite")]
    Strength { kind: &'static str, value: f64 },
    #[error("the damage exponent {0} must be above 1 and finite")]
    Exponent(f64),
    #[error("the fracture energy {0} J/m^2 must be positive and finite")]
    FractureEnergy(f64),
    #[error("the damage threshold {0} must be above 0 and at most 1")]
    Threshold(f64),
    #[error("a stiffness recovery of {0} is not between 0 and 1")]
    Recovery(f64),
    #[error("the cell size {0} m must be positive and finite")]
    CellSize(f64),
    #[error(
        "a cell of {size:.3e} m is too large for a fracture energy of {energy} J/m^2 at a {kind} strength of {strength:.4e} Pa: \
         it stores more at the peak than its crack takes; cells up to {largest:.3e} m, a larger energy or no fracture energy"
    )]
    CellTooLarge { kind: &'static str, size: f64, largest: f64, energy: f64, strength: f64 },
    #[error(
        "a cell of {size:.3e} m is too small for a fracture energy of {energy} J/m^2 at a {kind} strength of {strength:.4e} Pa: \
         the softening exponent would fall to 1; cells from {smallest:.3e} m, a smaller energy or no fracture energy"
    )]
    CellTooSmall { kind: &'static str, size: f64, smallest: f64, energy: f64, strength: f64 },
    #[error("{name} {value} of the {law} law must be positive and finite")]
    Parameter { law: &'static str, name: &'static str, value: f64 },
    #[error("the mean {mean} is outside {low}..{high}, the bounds of the {property}")]
    Mean { property: &'static str, mean: f64, low: f64, high: f64 },
    #[error(
        "the {law} law of the {property} falls outside {low}..{high} more than {attempts} times in a row"
    )]
    Bounds { law: &'static str, property: &'static str, low: f64, high: f64, attempts: u32 },
}
