//! The straight tet10 at finite strain: St Venant-Kirchhoff, total Lagrangian.
//!
//! With F the displacement gradient plus one, `E = (F^T F - 1)/2` and `S = lambda tr(E) 1 + 2 mu E`, the energy is
//! half of `S : E`, the force on node i `F S g_i`, each integrated over the
//! undeformed cell with the four points of the small-strain element (exact derivatives of one another, whatever the
//! rule misses of the integral). Source: Bonet & Wood (2008), "Nonlinear Continuum Mechanics for Finite Element
//! Analysis", sections 6.3 and 9.4.

use crate::element::tet10::{POINTS, StraightTet10};
use crate::material::Elastic;
use crate::tensor::{Mat3, Vec3};

/// How strains follow from displacements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Strains {
    /// Linear in the displacements: for comparison with condensed grains.
    Small,
    /// Green's.
    #[default]
    Finite,
}

/// What one integration point needs: gradients of the shape functions, F, and S times the point's volume.
struct Point {
    gradients: [Vec3; 10],
    deformation: Mat3,
    stress: Mat3,
    energy: f64,
}

impl StraightTet10 {
    fn deformed(&self, l: &[f64; 4], rock: &Elastic, strains: Strains, u: &[Vec3; 10]) -> Point {
        let gradients = self.shape_gradients(l);
        let mut h = Mat3::zeros();
        for (u, g) in u.iter().zip(&gradients) {
            h += u * g.transpose();
        }
        let linear = (h + h.transpose()) * 0.5;
        let (strain, deformation) = match strains {
            Strains::Small => (linear, Mat3::identity()),
            Strains::Finite => (linear + h.transpose() * h * 0.5, Mat3::identity() + h),
        };
        let (lambda, mu) = rock.lame();
        let volume = self.point_volume();
        let stress = (Mat3::from_diagonal_element(lambda * strain.trace()) + strain * (2.0 * mu)) * volume;
        Point { gradients, deformation, stress, energy: 0.5 * stress.dot(&strain) }
    }

    /// Strain energy [J] at the nodal displacements `u` [m].
    pub fn strain_energy(&self, rock: &Elastic, strains: Strains, u: &[Vec3; 10]) -> f64 {
        POINTS.iter().map(|l| self.deformed(l, rock, strains, u).energy).sum()
    }

    /// Adds the derivative of the strain energy by the nodal displacements [N].
    pub fn add_inner_forces(&self, out: &mut [Vec3; 10], rock: &Elastic, strains: Strains, u: &[Vec3; 10]) {
        for l in &POINTS {
            let point = self.deformed(l, rock, strains, u);
            let nominal = point.deformation * point.stress;
            for (force, g) in out.iter_mut().zip(&point.gradients) {
                *force += nominal * g;
            }
        }
    }

    /// Adds what Green's strains add to the forces of linear ones [N]: `(H S(E) + S(E - e)) g` with the displacement gradient H and the
    /// linear strain e.
    pub fn add_surplus_forces(&self, out: &mut [Vec3; 10], rock: &Elastic, u: &[Vec3; 10]) {
        let (lambda, mu) = rock.lame();
        let volume = self.point_volume();
        let stress = |strain: Mat3| {
            (Mat3::from_diagonal_element(lambda * strain.trace()) + strain * (2.0 * mu)) * volume
        };
        for l in &POINTS {
            let gradients = self.shape_gradients(l);
            let mut h = Mat3::zeros();
            for (u, g) in u.iter().zip(&gradients) {
                h += u * g.transpose();
            }
            let beyond = stress(h.transpose() * h * 0.5);
            let nominal = h * (stress((h + h.transpose()) * 0.5) + beyond) + beyond;
            for (force, g) in out.iter_mut().zip(&gradients) {
                *force += nominal * g;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::tet10::{LOPSIDED, nodes_of};
    use crate::material::Secant;
    use crate::tensor::{Rotation, draws};

    fn cell() -> StraightTet10 {
        StraightTet10::new(&LOPSIDED).expect("a cell")
    }

    fn rock() -> Elastic {
        Elastic::new(30e9, 0.2).expect("allowed")
    }

    /// Displacements with strains of about `size`.
    fn displacements(size: f64) -> [Vec3; 10] {
        let mut draw = draws(11);
        std::array::from_fn(|_| Vec3::new(draw(), draw(), draw()) * size)
    }

    #[test]
    fn force_is_derivative_of_energy() {
        for strains in [Strains::Small, Strains::Finite] {
            let u = displacements(0.1);
            let mut force = [Vec3::zeros(); 10];
            cell().add_inner_forces(&mut force, &rock(), strains, &u);
            let scale = force.iter().map(Vec3::norm).fold(0.0, f64::max);
            for node in 0..10 {
                for axis in 0..3 {
                    let at = |step: f64| {
                        let mut moved = u;
                        moved[node][axis] += step;
                        cell().strain_energy(&rock(), strains, &moved)
                    };
                    let difference = (at(1e-5) - at(-1e-5)) / 2e-5;
                    assert!(
                        (difference - force[node][axis]).abs() < 1e-7 * scale,
                        "{strains:?} {node} {axis}"
                    );
                }
            }
        }
    }

    #[test]
    fn surplus_is_what_finite_strains_add() {
        for size in [1e-3, 0.1] {
            let u = displacements(size);
            let [mut finite, mut small, mut surplus] = [[Vec3::zeros(); 10]; 3];
            cell().add_inner_forces(&mut finite, &rock(), Strains::Finite, &u);
            cell().add_inner_forces(&mut small, &rock(), Strains::Small, &u);
            cell().add_surplus_forces(&mut surplus, &rock(), &u);
            let scale = finite.iter().map(Vec3::norm).fold(0.0, f64::max);
            for node in 0..10 {
                assert!((finite[node] - small[node] - surplus[node]).norm() < 1e-14 * scale, "{node}");
            }
        }
    }

    #[test]
    fn small_strains_are_the_linear_element() {
        let mut linear = [[Mat3::zeros(); 10]; 10];
        cell().add_stiffness(&mut linear, &rock(), &[Secant::SOUND; 4]);
        let u = displacements(0.3);
        let mut forces = [Vec3::zeros(); 10];
        cell().add_inner_forces(&mut forces, &rock(), Strains::Small, &u);
        for (force, row) in forces.iter().zip(&linear) {
            let by_stiffness: Vec3 = row.iter().zip(&u).map(|(block, u)| block * u).sum();
            assert!((force - by_stiffness).norm() < 1e-13 * 30e9);
        }
    }

    #[test]
    fn turning_costs_nothing_at_any_angle() {
        // A stressed cell turned by any angle keeps its energy, and its forces turn with it.
        let x = nodes_of(&LOPSIDED);
        let u = displacements(0.02);
        let energy = cell().strain_energy(&rock(), Strains::Finite, &u);
        let mut force = [Vec3::zeros(); 10];
        cell().add_inner_forces(&mut force, &rock(), Strains::Finite, &u);
        let scale = force.iter().map(Vec3::norm).fold(0.0, f64::max);
        for degrees in [1.0_f64, 37.0, 90.0, 180.0, 271.0] {
            let turn = Rotation::from_scaled_axis(Vec3::new(0.48, -0.6, 0.64) * degrees.to_radians());
            let turned: [Vec3; 10] = std::array::from_fn(|k| turn * (x[k] + u[k]) - x[k]);
            let again = cell().strain_energy(&rock(), Strains::Finite, &turned);
            assert!((again / energy - 1.0).abs() < 1e-9, "{degrees} degrees: {again} {energy}");
            let mut forces = [Vec3::zeros(); 10];
            cell().add_inner_forces(&mut forces, &rock(), Strains::Finite, &turned);
            for (a, b) in forces.iter().zip(&force) {
                assert!((a - turn * b).norm() < 1e-9 * scale);
            }
        }
    }
}
