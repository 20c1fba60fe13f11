//! `/grains` per saved state: where each grain is and how damaged it is.

use crate::tensor::Vec3;

use super::history::Quantity;

/// One grain in one saved state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrainRow {
    /// Position of the reference point [m].
    pub position: Vec3,
    /// Rotation vector from body axes to space axes [rad].
    pub rotation: Vec3,
    /// Mean Cauchy stress [Pa] from the forces on its surface, xx yy zz xy yz xz, tension positive.
    pub stress: [f64; 6],
    /// Volume-weighted mean of the damage variable, 0 intact to 1.
    pub damage_mean: f64,
    /// Largest damage variable in the grain.
    pub damage_max: f64,
    /// Failed share of the integration points.
    pub failed_fraction: f64,
    /// Connected parts; 1 for a whole grain.
    pub fragments: i64,
    /// Shear strain around the grain; not a number before strains count.
    pub local_shear_strain: f64,
    /// Volumetric strain around the grain, compression positive.
    pub local_volumetric_strain: f64,
    /// Angle by which the grain has turned since strains count [rad].
    pub turn: f64,
    /// How it deforms: 0 rigid, 1 condensed, 2 full.
    pub level: i64,
}

/// The per-state datasets of `/grains`, each of shape (states, grains) or (states, grains, width).
pub const GRAIN_QUANTITIES: [Quantity; 11] = [
    Quantity::measured("position", "m", "position of the reference point", 3),
    Quantity::measured("rotation", "rad", "rotation vector from body axes to space axes", 3),
    Quantity::measured(
        "stress",
        "Pa",
        "mean Cauchy stress xx yy zz xy yz xz from the forces on the surface, tension positive; of a grain that came apart its first part's",
        6,
    ),
    Quantity::measured("damage_mean", "1", "volume-weighted mean of the damage variable", 1),
    Quantity::measured("damage_max", "1", "largest damage variable in the grain", 1),
    Quantity::measured("failed_fraction", "1", "failed share of the integration points", 1),
    Quantity::count("fragments", "connected parts of the grain, 1 for a whole one"),
    Quantity::measured(
        "local_shear_strain",
        "1",
        "sqrt(2/3 e:e) of the deviatoric strain since strains count, from how the grain's neighbours moved",
        1,
    ),
    Quantity::measured(
        "local_volumetric_strain",
        "1",
        "volumetric strain since strains count, from how the grain's neighbours moved, compression positive",
        1,
    ),
    Quantity::measured("turn", "rad", "angle by which the grain has turned since strains count", 1),
    Quantity::count("level", "how the grain deforms: 0 rigid with local compliance, 1 condensed, 2 full"),
];
