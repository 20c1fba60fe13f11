//! 3-vectors, rotations, poses and small tensors.
//!
//! Vectors and matrices are nalgebra's. A [`Pose`] maps body coordinates to space:
//! `x = position + rotation * xi`. Rotation vectors are in radians, right-handed.

pub mod dual;
pub mod stored;

pub use nalgebra::Vector6;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// A position, displacement or force in space [m or N].
pub type Vec3 = Vector3<f64>;
/// A 3x3 matrix in space.
pub type Mat3 = Matrix3<f64>;
/// A rotation, kept normalised.
pub type Rotation = UnitQuaternion<f64>;

/// Placement of a body: `x = position + rotation * xi`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Position of the body's reference point [m].
    pub position: Vec3,
    pub rotation: Rotation,
}

impl Pose {
    pub const fn new(position: Vec3, rotation: Rotation) -> Self {
        Pose { position, rotation }
    }

    pub fn identity() -> Self {
        Pose { position: Vec3::zeros(), rotation: Rotation::identity() }
    }

    /// Where the body point `xi` [m] is in space.
    pub fn to_space(&self, xi: &Vec3) -> Vec3 {
        self.position + self.rotation * xi
    }

    /// Body coordinates [m] of the point `x` in space.
    pub fn to_body(&self, x: &Vec3) -> Vec3 {
        self.rotation.inverse() * (x - self.position)
    }

    /// The pose after a translation [m] and a rotation vector [rad], both in space axes,
    /// the rotation about the body's own reference point.
    pub fn moved(&self, translation: &Vec3, rotation: &Vec3) -> Pose {
        let mut turned = Rotation::from_scaled_axis(*rotation) * self.rotation;
        turned.renormalize();
        Pose { position: self.position + translation, rotation: turned }
    }
}

/// The symmetric tensor with the components xx yy zz xy yz xz.
pub fn symmetric([xx, yy, zz, xy, yz, xz]: [f64; 6]) -> Mat3 {
    Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// The components of a symmetric tensor as xx yy zz xy yz xz.
pub fn components(tensor: &Mat3) -> [f64; 6] {
    [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(|(i, j)| tensor[(i, j)])
}

/// The middle one of `values`, the upper of the two where their number is even; `None` of none.
pub fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}

/// Numbers of a seed, evenly from -0.5 to 0.5: for tests.
#[cfg(test)]
pub(crate) fn draws(seed: u64) -> impl FnMut() -> f64 {
    let mut random = rand_mt::Mt64::new(seed);
    move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_are_those_of_the_symmetric_tensor() {
        let six = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let tensor = symmetric(six);
        assert_eq!(components(&tensor), six);
        assert_eq!(tensor, tensor.transpose());
        // Shear along y on a face whose normal is x.
        assert_eq!((tensor * Vec3::x()).y, 4.0);
    }

    #[test]
    fn median_is_the_upper_middle_in_any_order() {
        assert_eq!(median([3.0, 1.0, 2.0].into_iter()), Some(2.0));
        assert_eq!(median([4.0, 1.0, 3.0, 2.0].into_iter()), Some(3.0));
        assert_eq!(median(std::iter::empty()), None);
    }
}
