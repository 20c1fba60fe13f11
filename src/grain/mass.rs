//! Mass, centre of mass and moment of inertia of homogeneous bodies.

use crate::geometry::Polyhedron;
use crate::material::MaterialError;
use crate::mesh::Mesh;
use crate::tensor::{Mat3, Vec3};

/// Mass properties in body coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    /// [kg]
    pub mass: f64,
    /// Centre of mass [m].
    pub centroid: Vec3,
    /// Moment of inertia about the centre of mass [kg m^2].
    pub inertia: Mat3,
}

impl MassProperties {
    /// Of a meshed body with uniform `density` [kg/m^3].
    pub fn of_mesh(mesh: &Mesh, density: f64) -> Result<Self, MaterialError> {
        Self::from_moments(mesh.volume(), mesh.centroid(), mesh.second_moment(), density)
    }

    /// Of a polyhedron with uniform `density` [kg/m^3].
    pub fn of_polyhedron(shape: &Polyhedron, density: f64) -> Result<Self, MaterialError> {
        Self::from_moments(shape.volume(), shape.centroid(), shape.second_moment(), density)
    }

    /// Of a sphere about the origin: `m = 4/3 pi R^3 rho`, `I = 2/5 m R^2`.
    pub fn of_sphere(radius: f64, density: f64) -> Result<Self, MaterialError> {
        let volume = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        let second = Mat3::from_diagonal_element(volume * radius * radius / 5.0);
        Self::from_moments(volume, Vec3::zeros(), second, density)
    }

    /// `second` is `integral of x x^T dV` about the origin [m^5].
    fn from_moments(volume: f64, centroid: Vec3, second: Mat3, density: f64) -> Result<Self, MaterialError> {
        if !(density > 0.0 && density.is_finite()) {
            return Err(MaterialError::Density(density));
        }
        let central = second - centroid * centroid.transpose() * volume;
        Ok(MassProperties {
            mass: density * volume,
            centroid,
            inertia: (Mat3::from_diagonal_element(central.trace()) - central) * density,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cuboid_mesh;

    #[test]
    fn box_and_sphere() {
        let mesh = cuboid_mesh([1.0, 2.0, 3.0], 1.0).expect("a mesh");
        let from_mesh = MassProperties::of_mesh(&mesh, 2000.0).expect("a density");
        let shape = Polyhedron::cuboid([1.0, 2.0, 3.0]).expect("a box");
        let shifted = shape.translated(&Vec3::new(5.0, -1.0, 2.0));
        let from_shape = MassProperties::of_polyhedron(&shifted, 2000.0).expect("a density");
        let m = 12_000.0;
        let expected = Mat3::from_diagonal(&Vec3::new(13.0, 10.0, 5.0)) * (m / 12.0);
        for found in [from_mesh, from_shape] {
            assert!((found.mass - m).abs() < 1e-9 && (found.inertia - expected).norm() < 1e-8);
        }
        assert!((from_shape.centroid - Vec3::new(5.0, -1.0, 2.0)).norm() < 1e-12);
        let sphere = MassProperties::of_sphere(2.0, 1.0).expect("a density");
        assert!((sphere.inertia[(1, 1)] - 0.4 * sphere.mass * 4.0).abs() < 1e-12);
        assert!(MassProperties::of_sphere(2.0, 0.0).is_err());
    }
}
