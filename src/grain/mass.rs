//! Mass, centre of mass and moment of inertia of homogeneous bodies.

use crate::element::tet10::{mass_share, volume_share};
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
        let (volume, centroid) = (mesh.volume(), mesh.centroid());
        if !(density > 0.0 && density.is_finite()) {
            return Err(MaterialError::Density(density));
        }
        let central = mesh.second_moment() - centroid * centroid.transpose() * volume;
        Ok(MassProperties {
            mass: density * volume,
            centroid,
            inertia: (Mat3::from_diagonal_element(central.trace()) - central) * density,
        })
    }
}

/// Mean translation [m] and rotation [rad] of a displacement field [m], one value a node: the rigid motion about the
/// mesh's centroid with the same linear and angular momentum as the field (per time, at uniform density).
///
/// # Panics
/// If there is not one displacement per node.
pub fn mean_motion(mesh: &Mesh, u: &[Vec3]) -> (Vec3, Vec3) {
    assert_eq!(u.len(), mesh.nodes.len(), "one displacement per node");
    let (volume, centroid) = (mesh.volume(), mesh.centroid());
    let (mut linear, mut angular) = (Vec3::zeros(), Vec3::zeros());
    for cell in mesh.cell_ids() {
        let nodes = &mesh.cells[cell.index()];
        let cell_volume = mesh.cell_volume(cell);
        for (i, node) in nodes.iter().enumerate() {
            let mut arm = Vec3::zeros();
            for (j, other) in nodes.iter().enumerate() {
                arm += (mesh.nodes[other.index()] - centroid) * mass_share(i, j);
            }
            linear += u[node.index()] * (cell_volume * volume_share(i));
            angular += arm.cross(&u[node.index()]) * cell_volume;
        }
    }
    let second = mesh.second_moment() - centroid * centroid.transpose() * volume;
    let inertia = Mat3::from_diagonal_element(second.trace()) - second;
    // A mesh has volume, so its inertia is regular.
    let turn = inertia.try_inverse().map_or(Vec3::zeros(), |inverse| inverse * angular);
    (linear / volume, turn)
}

/// Mass [kg] and first moment about `centroid` [kg m] that each node stands for: the integrals of `rho N` and
/// `rho N x`.
pub fn nodal_moments(mesh: &Mesh, density: f64, centroid: &Vec3) -> (Vec<f64>, Vec<Vec3>) {
    let (mut masses, mut moments) = (vec![0.0; mesh.nodes.len()], vec![Vec3::zeros(); mesh.nodes.len()]);
    for cell in mesh.cell_ids() {
        let nodes = &mesh.cells[cell.index()];
        let cell_mass = density * mesh.cell_volume(cell);
        for (i, node) in nodes.iter().enumerate() {
            for (j, other) in nodes.iter().enumerate() {
                let share = cell_mass * mass_share(i, j);
                masses[node.index()] += share;
                moments[node.index()] += (mesh.nodes[other.index()] - centroid) * share;
            }
        }
    }
    (masses, moments)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cuboid_mesh;

    #[test]
    fn rigid_motion_is_found_again() {
        let mesh = cuboid_mesh([1.0, 2.0, 3.0], 0.7).expect("a mesh");
        let (shift, turn) = (Vec3::new(1.0, -2.0, 0.5) * 1e-3, Vec3::new(0.3, 0.2, -0.7) * 1e-3);
        let u: Vec<Vec3> = mesh.nodes.iter().map(|x| shift + turn.cross(&(x - mesh.centroid()))).collect();
        let (linear, angular) = mean_motion(&mesh, &u);
        assert!((linear - shift).norm() < 1e-15 && (angular - turn).norm() < 1e-15);
        // A pure stretch about the centroid has no mean motion.
        let stretch: Vec<Vec3> = mesh.nodes.iter().map(|x| (x - mesh.centroid()) * 1e-3).collect();
        let (linear, angular) = mean_motion(&mesh, &stretch);
        assert!(linear.norm() < 1e-16 && angular.norm() < 1e-16);
    }

    #[test]
    fn a_box_beside_the_origin() {
        let mut mesh = cuboid_mesh([1.0, 2.0, 3.0], 1.0).expect("a mesh");
        let place = Vec3::new(5.0, -1.0, 2.0);
        mesh.nodes.iter_mut().for_each(|x| *x += place);
        let found = MassProperties::of_mesh(&mesh, 2000.0).expect("a density");
        let m = 12_000.0;
        let expected = Mat3::from_diagonal(&Vec3::new(13.0, 10.0, 5.0)) * (m / 12.0);
        assert!((found.mass - m).abs() < 1e-9 && (found.inertia - expected).norm() < 1e-8);
        assert!((found.centroid - place).norm() < 1e-12);
        assert!(MassProperties::of_mesh(&mesh, 0.0).is_err());
    }
}
