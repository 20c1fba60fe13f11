//! Local contact stiffness: how much force a small patch of a body's surface takes per displacement.
//!
//! A contact between two bodies has the two in series. Used where a body is rigid, and to scale
//! penalties.

use crate::material::Elastic;
use crate::tensor::{Mat3, Vec3};

/// Radius of the patch that stands for a contact of a rigid grain, over the grain's equivalent diameter.
///
/// A meshed grain of 38 cells has the self-flexibility of a patch of 0.106 (median over the surface; 0.03
/// to 0.23 in 90 % of it, 0.05 at vertices), so that a rigid grain is about as soft at its contacts as
/// the condensed one that it replaces.
pub const PATCH_OF_SIZE: f64 = 0.1;

/// Stiffness of one body at a small patch [N/m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalStiffness {
    pub normal: f64,
    pub tangential: f64,
}

impl LocalStiffness {
    /// A round patch of radius `a` [m] on a half-space, moved as a whole: `k_n = 2 a E / (1 - nu^2)`
    /// and `k_t = 8 a G / (2 - nu)`.
    ///
    /// Source: Johnson (1985), "Contact Mechanics": section 3.4 (rigid punch) and section 7.2
    /// (tangential displacement of a circle, Mindlin). Their ratio is Mindlin's `2 (1 - nu) / (2 - nu)`.
    pub fn of_patch(rock: &Elastic, radius: f64) -> Self {
        LocalStiffness {
            normal: 2.0 * radius * rock.contact_modulus(),
            tangential: 8.0 * radius * rock.shear_modulus() / (2.0 - rock.poissons_ratio()),
        }
    }

    /// Of a rigid grain without a mesh, `size` [m] its equivalent diameter: a patch of [`PATCH_OF_SIZE`]
    /// times that.
    pub fn of_size(rock: &Elastic, size: f64) -> Self {
        Self::of_patch(rock, PATCH_OF_SIZE * size)
    }

    /// From the self-flexibility [m/N] of a surface point with outward unit `normal`: normal, and
    /// the mean over the tangential directions.
    pub fn of_flexibility(flexibility: &Mat3, normal: &Vec3) -> Self {
        let along = normal.dot(&(flexibility * normal));
        LocalStiffness { normal: 1.0 / along, tangential: 2.0 / (flexibility.trace() - along) }
    }

    /// Two bodies pressed together, one after the other.
    pub fn in_series(&self, other: &Self) -> Self {
        let series = |a: f64, b: f64| a * b / (a + b);
        LocalStiffness {
            normal: series(self.normal, other.normal),
            tangential: series(self.tangential, other.tangential),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patch_ratio_is_mindlins() {
        let rock = Elastic::new(30e9, 0.2).expect("allowed");
        let k = LocalStiffness::of_patch(&rock, 1e-3);
        assert!((k.normal - 2e-3 * 30e9 / 0.96).abs() < 1e-3);
        assert!((k.tangential / k.normal - 2.0 * 0.8 / 1.8).abs() < 1e-14);
        assert!((k.in_series(&k).normal - 0.5 * k.normal).abs() < 1e-6);
    }

    #[test]
    fn flexibility_splits_into_normal_and_tangential() {
        let flexibility = Mat3::from_diagonal(&Vec3::new(2.0, 4.0, 0.5));
        let k = LocalStiffness::of_flexibility(&flexibility, &Vec3::z());
        assert!((k.normal - 2.0).abs() < 1e-15 && (k.tangential - 2.0 / 6.0).abs() < 1e-15);
    }
}
