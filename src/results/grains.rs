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

/// The per-state datasets of `/grains`: the first two of shape (states, grains, 3), `stress` (states, grains, 6), the others (states, grains).
pub const GRAIN_QUANTITIES: [Quantity; 11] = [
    Quantity { name: "position", units: "m", long_name: "position of the reference point", integer: false },
    Quantity {
        name: "rotation",
        units: "rad",
        long_name: "rotation vector from body axes to space axes",
        integer: false,
    },
    Quantity {
        name: "stress",
        units: "Pa",
        long_name: "mean Cauchy stress xx yy zz xy yz xz from the forces on the surface, tension positive; of a grain that came apart its first part's",
        integer: false,
    },
    Quantity {
        name: "damage_mean",
        units: "1",
        long_name: "volume-weighted mean of the damage variable",
        integer: false,
    },
    Quantity {
        name: "damage_max",
        units: "1",
        long_name: "largest damage variable in the grain",
        integer: false,
    },
    Quantity {
        name: "failed_fraction",
        units: "1",
        long_name: "failed share of the integration points",
        integer: false,
    },
    Quantity {
        name: "fragments",
        units: "1",
        long_name: "connected parts of the grain, 1 for a whole one",
        integer: true,
    },
    Quantity {
        name: "local_shear_strain",
        units: "1",
        long_name: "sqrt(2/3 e:e) of the deviatoric strain since strains count, from how the grain's neighbours moved",
        integer: false,
    },
    Quantity {
        name: "local_volumetric_strain",
        units: "1",
        long_name: "volumetric strain since strains count, from how the grain's neighbours moved, compression positive",
        integer: false,
    },
    Quantity {
        name: "turn",
        units: "rad",
        long_name: "angle by which the grain has turned since strains count",
        integer: false,
    },
    Quantity {
        name: "level",
        units: "1",
        long_name: "how the grain deforms: 0 rigid with local compliance, 1 condensed, 2 full",
        integer: true,
    },
];
