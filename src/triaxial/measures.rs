//! Stress, strain and energy of the specimen as a whole. Compression positive.

use serde::{Deserialize, Serialize};

/// Stresses and strains of an accepted increment.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Measures {
    pub axial_strain: f64,
    pub radial_strain: f64,
    pub volumetric_strain: f64,
    /// [Pa]
    pub axial_stress: f64,
    /// [Pa]
    pub confining_pressure: f64,
    /// Axial stress less confining pressure, `q` [Pa]: the ram's force over the current area.
    pub deviatoric_stress: f64,
    /// `p = (axial + 2 confining) / 3` [Pa]
    pub mean_stress: f64,
    pub void_ratio: f64,
    /// Contacts per grain: touching pairs, plates included once.
    pub coordination_number: f64,
}

/// Energies since the start of the test [J].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// Work of the ram and of the pressure.
    pub external: f64,
    /// Stored in contacts (and grains), less what was stored at the start.
    pub elastic: f64,
    pub friction: f64,
    /// Set free in increments that snapped to another equilibrium, where the stabilising term
    /// stands in for motion and its damping. Known by balance only: what these increments leave over.
    pub stabilisation: f64,
}

impl Ledger {
    /// External work that no row accounts for [J].
    pub fn error(&self) -> f64 {
        self.external - self.elastic - self.friction - self.stabilisation
    }
}
