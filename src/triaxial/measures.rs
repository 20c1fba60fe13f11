//! Stress, strain and energy of the specimen as a whole. Compression positive.

use crate::solver::IncrementReport;
use crate::triaxial::drive::Origin;
use crate::triaxial::rig::Rig;

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

impl Measures {
    /// `state` is that of the increment; strains count from the height [m] and volume [m^3] of `zero`.
    pub fn of(rig: &Rig, report: &IncrementReport, state: &Origin, zero: [f64; 2]) -> Self {
        let axial_strain = 1.0 - state.height / zero[0];
        let volumetric_strain = 1.0 - state.volume / zero[1];
        let grains = rig.model.bodies.len() - 2;
        let mut ends = 0;
        for (a, b) in report.memory.keys() {
            ends += usize::from((*a as usize) < grains) + usize::from((*b as usize) < grains);
        }
        let (p, q) = (state.pressure, state.deviatoric_stress);
        Measures {
            axial_strain,
            radial_strain: 0.5 * (volumetric_strain - axial_strain),
            volumetric_strain,
            axial_stress: p + q,
            confining_pressure: p,
            deviatoric_stress: q,
            mean_stress: p + q / 3.0,
            void_ratio: state.volume / rig.solid_volume - 1.0,
            coordination_number: ends as f64 / grains as f64,
        }
    }
}
