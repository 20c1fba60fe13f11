//! Isotropic linear elasticity. Stress [Pa], tension positive; Voigt order of [`crate::material`].

use nalgebra::{Matrix6, Vector6};

use crate::material::MaterialError;

/// Hooke's law for one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elastic {
    youngs_modulus: f64,
    poissons_ratio: f64,
}

impl Elastic {
    /// `youngs_modulus` [Pa] positive, `poissons_ratio` in -1..0.5 (ends excluded).
    pub fn new(youngs_modulus: f64, poissons_ratio: f64) -> Result<Self, MaterialError> {
        if !(youngs_modulus > 0.0 && youngs_modulus.is_finite()) {
            return Err(MaterialError::YoungsModulus(youngs_modulus));
        }
        if !(poissons_ratio > -1.0 && poissons_ratio < 0.5) {
            return Err(MaterialError::PoissonsRatio(poissons_ratio));
        }
        Ok(Elastic { youngs_modulus, poissons_ratio })
    }

    /// E [Pa].
    pub const fn youngs_modulus(&self) -> f64 {
        self.youngs_modulus
    }

    /// nu.
    pub const fn poissons_ratio(&self) -> f64 {
        self.poissons_ratio
    }

    /// Lame's constants lambda and mu [Pa].
    pub fn lame(&self) -> (f64, f64) {
        let (e, nu) = (self.youngs_modulus, self.poissons_ratio);
        (e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), self.shear_modulus())
    }

    /// G [Pa].
    pub fn shear_modulus(&self) -> f64 {
        self.youngs_modulus / (2.0 * (1.0 + self.poissons_ratio))
    }

    /// Plane-strain modulus `E / (1 - nu^2)` [Pa] of a half-space in contact.
    pub fn contact_modulus(&self) -> f64 {
        self.youngs_modulus / (1.0 - self.poissons_ratio * self.poissons_ratio)
    }

    /// Stress [Pa] at a strain.
    pub fn stress(&self, strain: &Vector6<f64>) -> Vector6<f64> {
        let (lambda, mu) = self.lame();
        let volumetric = lambda * (strain[0] + strain[1] + strain[2]);
        Vector6::new(
            volumetric + 2.0 * mu * strain[0],
            volumetric + 2.0 * mu * strain[1],
            volumetric + 2.0 * mu * strain[2],
            mu * strain[3],
            mu * strain[4],
            mu * strain[5],
        )
    }

    /// Stress [Pa] by strain.
    pub fn matrix(&self) -> Matrix6<f64> {
        Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(|j| self.stress(&Vector6::ith(j, 1.0))))
    }

    /// Strain energy per volume [J/m^3].
    pub fn energy_density(&self, strain: &Vector6<f64>) -> f64 {
        0.5 * strain.dot(&self.stress(strain))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniaxial_stress_gives_youngs_modulus_and_poissons_ratio() {
        for (e, nu) in [(30e9, 0.2), (1.0, -0.3), (5e6, 0.49)] {
            let rock = Elastic::new(e, nu).expect("allowed");
            let strain = Vector6::new(1e-3, -nu * 1e-3, -nu * 1e-3, 0.0, 0.0, 0.0);
            let stress = rock.stress(&strain);
            assert!((stress - Vector6::new(e * 1e-3, 0.0, 0.0, 0.0, 0.0, 0.0)).norm() < 1e-12 * e);
            let sheared = rock.stress(&Vector6::new(0.0, 0.0, 0.0, 0.3, 0.7, -0.2));
            let by_hand = Vector6::new(0.0, 0.0, 0.0, 0.3, 0.7, -0.2) * (e / (2.0 * (1.0 + nu)));
            assert!((sheared - by_hand).norm() < 1e-12 * e);
        }
    }

    #[test]
    fn stress_is_derivative_of_energy() {
        let rock = Elastic::new(30e9, 0.2).expect("allowed");
        let strain = Vector6::new(1.0, -2.0, 0.5, 0.3, 0.7, -0.2) * 1e-3;
        for k in 0..6 {
            let step = Vector6::ith(k, 1e-6);
            let difference =
                (rock.energy_density(&(strain + step)) - rock.energy_density(&(strain - step))) / 2e-6;
            // Quadratic energy: central differences are exact up to rounding.
            assert!((difference - rock.stress(&strain)[k]).abs() < 1e-7 * rock.stress(&strain).norm());
        }
    }

    #[test]
    fn impossible_constants_are_refused() {
        for (e, nu) in [(0.0, 0.2), (-1.0, 0.2), (f64::NAN, 0.2), (1.0, 0.5), (1.0, -1.0), (1.0, f64::NAN)] {
            assert!(Elastic::new(e, nu).is_err());
        }
    }
}
