//! The straight tet10 at finite strain: St Venant-Kirchhoff, total Lagrangian.
//!
//! With F the displacement gradient plus one, `E = (F^T F - 1)/2` and `S = C E`, C what damage left of `lambda tr(E) 1 + 2 mu E`, the energy is
//! half of `S : E`, the force on node i `F S g_i`, each integrated over the
//! undeformed cell with the four points of the small-strain element (exact derivatives of one another, whatever the
//! rule misses of the integral). Source: Bonet & Wood (2008), "Nonlinear Continuum Mechanics for Finite Element
//! Analysis", sections 6.3 and 9.4.

use nalgebra::Vector6;

use crate::element::POINT_COUNT;
use crate::element::tet10::{POINTS, StraightTet10};
use crate::material::{Elastic, Secant};
use crate::tensor::{Mat3, Vec3, components, symmetric};

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

/// Rock of a cell, and what is left of its stiffness at each integration point.
#[derive(Debug, Clone, Copy)]
pub struct Cell<'a> {
    pub rock: &'a Elastic,
    pub points: &'a [Secant; POINT_COUNT],
}

impl Cell<'_> {
    /// Stress [Pa] at a strain.
    fn stress(&self, point: usize, strain: &Mat3) -> Mat3 {
        let left = &self.points[point];
        if left.matrix().is_some() {
            return symmetric(left.stress(self.rock, &voigt(strain)).into());
        }
        let (lambda, mu) = self.rock.lame();
        (Mat3::from_diagonal_element(lambda * strain.trace()) + strain * (2.0 * mu)) * left.share()
    }
}

/// With engineering shear.
fn voigt(strain: &Mat3) -> Vector6<f64> {
    let [xx, yy, zz, xy, yz, zx] = components(strain);
    Vector6::new(xx, yy, zz, 2.0 * xy, 2.0 * yz, 2.0 * zx)
}

impl StraightTet10 {
    /// Shape functions' and displacements' gradients at a point.
    fn gradients(&self, l: &[f64; 4], u: &[Vec3; 10]) -> ([Vec3; 10], Mat3) {
        let gradients = self.shape_gradients(l);
        let mut h = Mat3::zeros();
        for (u, g) in u.iter().zip(&gradients) {
            h += u * g.transpose();
        }
        (gradients, h)
    }

    fn deformed(&self, number: usize, cell: Cell<'_>, strains: Strains, u: &[Vec3; 10]) -> Point {
        let (gradients, h) = self.gradients(&POINTS[number], u);
        let (strain, deformation) = match strains {
            Strains::Small => (linear(&h), Mat3::identity()),
            Strains::Finite => (linear(&h) + h.transpose() * h * 0.5, Mat3::identity() + h),
        };
        let stress = cell.stress(number, &strain) * self.point_volume();
        Point { gradients, deformation, stress, energy: 0.5 * stress.dot(&strain) }
    }

    /// Green's strains at the integration points, with engineering shear.
    pub fn green_strains(&self, u: &[Vec3; 10]) -> [Vector6<f64>; POINT_COUNT] {
        POINTS.map(|l| {
            let (_, h) = self.gradients(&l, u);
            voigt(&(linear(&h) + h.transpose() * h * 0.5))
        })
    }

    /// Strain energy [J] at the nodal displacements `u` [m].
    pub fn strain_energy(&self, cell: Cell<'_>, strains: Strains, u: &[Vec3; 10]) -> f64 {
        (0..POINT_COUNT).map(|point| self.deformed(point, cell, strains, u).energy).sum()
    }

    /// Adds the derivative of the strain energy by the nodal displacements [N].
    pub fn add_inner_forces(&self, out: &mut [Vec3; 10], cell: Cell<'_>, strains: Strains, u: &[Vec3; 10]) {
        for point in 0..POINT_COUNT {
            let point = self.deformed(point, cell, strains, u);
            let nominal = point.deformation * point.stress;
            for (force, g) in out.iter_mut().zip(&point.gradients) {
                *force += nominal * g;
            }
        }
    }

    /// Adds what Green's strains add to the forces of linear ones [N]: `(H S(E) + S(E - e)) g` with the displacement gradient H and the
    /// linear strain e.
    pub fn add_surplus_forces(&self, out: &mut [Vec3; 10], cell: Cell<'_>, u: &[Vec3; 10]) {
        let volume = self.point_volume();
        for (number, l) in POINTS.iter().enumerate() {
            let (gradients, h) = self.gradients(l, u);
            let stress = |strain: Mat3| cell.stress(number, &strain) * volume;
            let beyond = stress(h.transpose() * h * 0.5);
            let nominal = h * (stress(linear(&h)) + beyond) + beyond;
            for (force, g) in out.iter_mut().zip(&gradients) {
                *force += nominal * g;
            }
        }
    }
}

fn linear(h: &Mat3) -> Mat3 {
    (h + h.transpose()) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::tet10::{LOPSIDED, nodes_of};
    use crate::material::secant::HELD;
    use crate::tensor::{Rotation, draws};

    fn cell() -> StraightTet10 {
        StraightTet10::new(&LOPSIDED).expect("a cell")
    }

    fn rock() -> Elastic {
        Elastic::new(30e9, 0.2).expect("allowed")
    }

    /// Sound cells, and one with damage: a point is sound, one is cracked, one has failed.
    fn points() -> [[Secant; POINT_COUNT]; 2] {
        let cracked = Vector6::new(2.0, -1.0, -0.5, 0.7, -0.3, 0.4) * 1e-3;
        let cracked = Secant::of_split(&rock(), &cracked, [0.2, 0.9]);
        assert!(cracked.matrix().is_some());
        let damaged = [Secant::SOUND, Secant::of_share(0.3), cracked, Secant::of_share(0.0)];
        [[Secant::SOUND; POINT_COUNT], damaged.map(|point| point.at_least(HELD))]
    }

    /// Displacements with strains of about `size`.
    fn displacements(size: f64) -> [Vec3; 10] {
        let mut draw = draws(11);
        std::array::from_fn(|_| Vec3::new(draw(), draw(), draw()) * size)
    }

    #[test]
    fn force_is_derivative_of_energy() {
        for (points, strains) in points().iter().flat_map(|p| [(p, Strains::Small), (p, Strains::Finite)]) {
            let (u, rock) = (displacements(0.1), &rock());
            let mut force = [Vec3::zeros(); 10];
            cell().add_inner_forces(&mut force, Cell { rock, points }, strains, &u);
            let scale = force.iter().map(Vec3::norm).fold(0.0, f64::max);
            for node in 0..10 {
                for axis in 0..3 {
                    let at = |step: f64| {
                        let mut moved = u;
                        moved[node][axis] += step;
                        cell().strain_energy(Cell { rock, points }, strains, &moved)
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
        for (points, size) in points().iter().flat_map(|points| [(points, 1e-3), (points, 0.1)]) {
            let (u, rock) = (displacements(size), &rock());
            let [mut finite, mut small, mut surplus] = [[Vec3::zeros(); 10]; 3];
            cell().add_inner_forces(&mut finite, Cell { rock, points }, Strains::Finite, &u);
            cell().add_inner_forces(&mut small, Cell { rock, points }, Strains::Small, &u);
            cell().add_surplus_forces(&mut surplus, Cell { rock, points }, &u);
            let scale = finite.iter().map(Vec3::norm).fold(0.0, f64::max);
            for node in 0..10 {
                assert!((finite[node] - small[node] - surplus[node]).norm() < 1e-14 * scale, "{node}");
            }
        }
    }

    #[test]
    fn small_strains_are_the_linear_element() {
        for points in &points() {
            let (u, rock) = (displacements(0.3), &rock());
            let mut linear = [[Mat3::zeros(); 10]; 10];
            cell().add_stiffness(&mut linear, rock, points);
            let mut forces = [Vec3::zeros(); 10];
            cell().add_inner_forces(&mut forces, Cell { rock, points }, Strains::Small, &u);
            for (force, row) in forces.iter().zip(&linear) {
                let by_stiffness: Vec3 = row.iter().zip(&u).map(|(block, u)| block * u).sum();
                assert!((force - by_stiffness).norm() < 1e-13 * 30e9);
            }
        }
    }

    #[test]
    fn green_strains_are_those_of_small_displacements() {
        let u = displacements(1e-6);
        for (green, small) in cell().green_strains(&u).iter().zip(&cell().strains(&u)) {
            assert!((green - small).norm() < 1e-5 * small.norm(), "{green} {small}");
        }
    }

    #[test]
    fn turning_costs_nothing_at_any_angle() {
        // A stressed cell turned by any angle keeps its strains and its energy, and its forces turn with it.
        let x = nodes_of(&LOPSIDED);
        let (u, rock) = (displacements(0.02), &rock());
        for points in &points() {
            let cell_of = Cell { rock, points };
            let energy = cell().strain_energy(cell_of, Strains::Finite, &u);
            let mut force = [Vec3::zeros(); 10];
            cell().add_inner_forces(&mut force, cell_of, Strains::Finite, &u);
            let scale = force.iter().map(Vec3::norm).fold(0.0, f64::max);
            for degrees in [1.0_f64, 37.0, 90.0, 180.0, 271.0] {
                let turn = Rotation::from_scaled_axis(Vec3::new(0.48, -0.6, 0.64) * degrees.to_radians());
                let turned: [Vec3; 10] = std::array::from_fn(|k| turn * (x[k] + u[k]) - x[k]);
                for (turned, straight) in cell().green_strains(&turned).iter().zip(&cell().green_strains(&u))
                {
                    assert!((turned - straight).norm() < 1e-12, "{degrees} degrees: {turned} {straight}");
                }
                let again = cell().strain_energy(cell_of, Strains::Finite, &turned);
                assert!((again / energy - 1.0).abs() < 1e-9, "{degrees} degrees: {again} {energy}");
                let mut forces = [Vec3::zeros(); 10];
                cell().add_inner_forces(&mut forces, cell_of, Strains::Finite, &turned);
                for (a, b) in forces.iter().zip(&force) {
                    assert!((a - turn * b).norm() < 1e-9 * scale);
                }
            }
        }
    }
}
