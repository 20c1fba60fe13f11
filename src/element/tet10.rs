//! The ten-node tetrahedron with straight sides: quadratic displacement on a linear geometry.
//!
//! Source: Zienkiewicz & Taylor, "The Finite Element Method", vol. 1, volume coordinates
//! `L_0..L_3`; corner functions `L (2 L - 1)`, mid-side functions `4 L_i L_j`. With straight sides the gradients of L are constant,
//! so the stiffness integrand of a uniform cell is quadratic and the 4-point rule of degree 2
//! (Hammer, Marlowe & Stroud 1956) is exact.

use nalgebra::{Matrix6x3, Vector6};

use crate::material::{Elastic, Secant};
use crate::mesh::tet10::EDGES;
use crate::tensor::{Mat3, Vec3, symmetric};

/// Number of integration points.
pub const POINT_COUNT: usize = 4;

const NEAR: f64 = 0.585_410_196_624_968_5;
const FAR: f64 = 0.138_196_601_125_010_5;

/// Volume coordinates of the integration points, `(5 + 3 sqrt 5)/20` and `(5 - sqrt 5)/20`; each
/// weighs a quarter of the volume.
pub const POINTS: [[f64; 4]; POINT_COUNT] =
    [[NEAR, FAR, FAR, FAR], [FAR, NEAR, FAR, FAR], [FAR, FAR, NEAR, FAR], [FAR, FAR, FAR, NEAR]];

/// Corners of a cell without any symmetry [m], to try things on.
pub const LOPSIDED: [Vec3; 4] = [
    Vec3::new(0.1, -0.2, 0.05),
    Vec3::new(1.3, 0.2, -0.1),
    Vec3::new(0.4, 1.1, 0.3),
    Vec3::new(-0.2, 0.3, 0.9),
];

/// The ten nodes of the cell with these corners [m].
pub fn nodes_of(corners: &[Vec3; 4]) -> [Vec3; 10] {
    let mut x = [Vec3::zeros(); 10];
    x[..4].copy_from_slice(corners);
    for (k, &[i, j]) in EDGES.iter().enumerate() {
        x[4 + k] = (corners[i] + corners[j]) * 0.5;
    }
    x
}

/// Shape functions of the ten nodes at volume coordinates `l`.
pub fn shape_functions(l: &[f64; 4]) -> [f64; 10] {
    let mut n = [0.0; 10];
    for i in 0..4 {
        n[i] = l[i] * (2.0 * l[i] - 1.0);
    }
    for (k, &[i, j]) in EDGES.iter().enumerate() {
        n[4 + k] = 4.0 * l[i] * l[j];
    }
    n
}

/// Consistent mass of node pair (`i`, `j`) over the mass of the cell:
/// `integral of N_i N_j dV / V`, exact (a quartic in L).
pub fn mass_share(i: usize, j: usize) -> f64 {
    const IN_420: f64 = 1.0 / 420.0;
    let share = match (i.checked_sub(4), j.checked_sub(4)) {
        (None, None) => {
            if i == j {
                6.0
            } else {
                1.0
            }
        }
        (None, Some(edge)) | (Some(edge), None) => {
            if EDGES[edge].contains(&i.min(j)) {
                -4.0
            } else {
                -6.0
            }
        }
        (Some(p), Some(q)) => match EDGES[p].iter().filter(|corner| EDGES[q].contains(corner)).count() {
            2 => 32.0,
            1 => 16.0,
            _ => 8.0,
        },
    };
    share * IN_420
}

/// `integral of N_i dV / V`.
pub const fn volume_share(i: usize) -> f64 {
    if i < 4 { -1.0 / 20.0 } else { 1.0 / 5.0 }
}

/// `B_i`: strain of the displacement of a node whose shape function has this gradient [1/m].
fn strain_of_node(n: &Vec3) -> Matrix6x3<f64> {
    Matrix6x3::new(
        n.x, 0.0, 0.0, 0.0, n.y, 0.0, 0.0, 0.0, n.z, //
        n.y, n.x, 0.0, 0.0, n.z, n.y, n.z, 0.0, n.x,
    )
}

/// Geometry of one cell: volume and gradients of the volume coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StraightTet10 {
    /// [m^3]
    pub volume: f64,
    /// Gradients of L_0 to L_3 [1/m].
    pub gradients: [Vec3; 4],
}

impl StraightTet10 {
    /// From the corners [m]; `None` unless the volume is positive and finite.
    pub fn new([a, b, c, d]: &[Vec3; 4]) -> Option<Self> {
        let (u, v, w) = (b - a, c - a, d - a);
        let six_volumes = u.dot(&v.cross(&w));
        if !(six_volumes > 0.0 && six_volumes.is_finite()) {
            return None;
        }
        let (first, second, third) =
            (v.cross(&w) / six_volumes, w.cross(&u) / six_volumes, u.cross(&v) / six_volumes);
        Some(StraightTet10 {
            volume: six_volumes / 6.0,
            gradients: [-(first + second + third), first, second, third],
        })
    }

    /// Gradients of the ten shape functions [1/m] at volume coordinates `l`.
    pub fn shape_gradients(&self, l: &[f64; 4]) -> [Vec3; 10] {
        let g = &self.gradients;
        let mut n = [Vec3::zeros(); 10];
        for i in 0..4 {
            n[i] = g[i] * (4.0 * l[i] - 1.0);
        }
        for (k, &[i, j]) in EDGES.iter().enumerate() {
            n[4 + k] = (g[i] * l[j] + g[j] * l[i]) * 4.0;
        }
        n
    }

    /// Adds the stiffness [N/m] to `out`, block (i, j) for nodes i, j: `integral of B_i^T D B_j dV` with D of each integration point.
    pub fn add_stiffness(&self, out: &mut [[Mat3; 10]; 10], rock: &Elastic, points: &[Secant; POINT_COUNT]) {
        let (lambda, mu) = rock.lame();
        for (l, secant) in POINTS.iter().zip(points) {
            let n = self.shape_gradients(l);
            if let Some(matrix) = secant.matrix() {
                let strains = n.each_ref().map(strain_of_node);
                for (i, strain) in strains.iter().enumerate() {
                    let stresses = matrix * strain * self.point_volume();
                    for (j, other) in strains.iter().enumerate() {
                        out[j][i] += other.transpose() * stresses;
                    }
                }
                continue;
            }
            let weight = secant.share() * self.point_volume();
            if weight == 0.0 {
                continue;
            }
            for i in 0..10 {
                for j in 0..=i {
                    // lambda n_i n_j^T + mu n_j n_i^T + mu (n_i . n_j) I
                    let outer = n[i] * n[j].transpose();
                    let block = outer * (lambda * weight)
                        + outer.transpose() * (mu * weight)
                        + Mat3::from_diagonal_element(mu * weight * n[i].dot(&n[j]));
                    out[i][j] += block;
                    if i != j {
                        out[j][i] += block.transpose();
                    }
                }
            }
        }
    }

    /// Strain at volume coordinates `l` of the nodal displacements `u` [m].
    pub fn strain(&self, l: &[f64; 4], u: &[Vec3; 10]) -> Vector6<f64> {
        let n = self.shape_gradients(l);
        let mut gradient = Mat3::zeros();
        for (n, u) in n.iter().zip(u) {
            gradient += u * n.transpose();
        }
        Vector6::new(
            gradient[(0, 0)],
            gradient[(1, 1)],
            gradient[(2, 2)],
            gradient[(0, 1)] + gradient[(1, 0)],
            gradient[(1, 2)] + gradient[(2, 1)],
            gradient[(2, 0)] + gradient[(0, 2)],
        )
    }

    /// Strains at the integration points.
    pub fn strains(&self, u: &[Vec3; 10]) -> [Vector6<f64>; POINT_COUNT] {
        POINTS.each_ref().map(|l| self.strain(l, u))
    }

    /// Volume that one integration point stands for [m^3].
    pub fn point_volume(&self) -> f64 {
        self.volume / POINT_COUNT as f64
    }

    /// Adds the forces [N] that `stresses` [Pa] at the integration points put on the nodes,
    /// `integral of B_i^T sigma dV`.
    pub fn add_forces(&self, out: &mut [Vec3; 10], stresses: &[Vector6<f64>; POINT_COUNT]) {
        for (l, s) in POINTS.iter().zip(stresses) {
            let stress = symmetric((*s).into()) * self.point_volume();
            for (force, n) in out.iter_mut().zip(&self.shape_gradients(l)) {
                *force += stress * n;
            }
        }
    }

    /// Stresses [Pa] of the sound rock at the integration points.
    pub fn stresses(&self, rock: &Elastic, u: &[Vec3; 10]) -> [Vector6<f64>; POINT_COUNT] {
        POINTS.each_ref().map(|l| rock.stress(&self.strain(l, u)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rock() -> Elastic {
        Elastic::new(30e9, 0.2).expect("allowed")
    }

    fn stiffness(corners: &[Vec3; 4]) -> [[Mat3; 10]; 10] {
        let mut k = [[Mat3::zeros(); 10]; 10];
        StraightTet10::new(corners).expect("a cell").add_stiffness(&mut k, &rock(), &[Secant::SOUND; 4]);
        k
    }

    #[test]
    fn shape_functions_are_one_at_their_node_and_sum_to_one() {
        for i in 0..10 {
            let mut l = [0.0; 4];
            if i < 4 {
                l[i] = 1.0;
            } else {
                EDGES[i - 4].iter().for_each(|&corner| l[corner] = 0.5);
            }
            let n = shape_functions(&l);
            for (j, value) in n.iter().enumerate() {
                assert_eq!(*value, if i == j { 1.0 } else { 0.0 });
            }
        }
        for l in &POINTS {
            assert!((shape_functions(l).iter().sum::<f64>() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn shape_gradients_are_derivatives_of_shape_functions() {
        let corners = LOPSIDED;
        let cell = StraightTet10::new(&corners).expect("a cell");
        let coordinates = |x: &Vec3| [0, 1, 2, 3].map(|i| cell.gradients[i].dot(&(x - corners[(i + 1) % 4])));
        let x = corners.iter().sum::<Vec3>() * 0.25 + Vec3::new(0.03, -0.02, 0.01);
        let gradients = cell.shape_gradients(&coordinates(&x));
        for axis in 0..3 {
            let step = Vec3::ith(axis, 1e-6);
            let (plus, minus) =
                (shape_functions(&coordinates(&(x + step))), shape_functions(&coordinates(&(x - step))));
            for (gradient, (plus, minus)) in gradients.iter().zip(plus.iter().zip(&minus)) {
                assert!(((plus - minus) / 2e-6 - gradient[axis]).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn stiffness_is_the_integral_of_b_c_b() {
        let corners = LOPSIDED;
        let cell = StraightTet10::new(&corners).expect("a cell");
        let k = stiffness(&corners);
        for (i, row) in k.iter().enumerate() {
            for (j, found) in row.iter().enumerate() {
                let mut expected = Mat3::zeros();
                for l in &POINTS {
                    for a in 0..3 {
                        for b in 0..3 {
                            let unit = |node: usize, axis: usize| {
                                let mut u = [Vec3::zeros(); 10];
                                u[node][axis] = 1.0;
                                cell.strain(l, &u)
                            };
                            expected[(a, b)] +=
                                unit(i, a).dot(&rock().stress(&unit(j, b))) * cell.volume / 4.0;
                        }
                    }
                }
                // Of the order of the stiffness's largest entry.
                assert!((found - expected).norm() < 1e-13 * 33e9);
                assert!((found - k[j][i].transpose()).norm() == 0.0);
            }
        }
    }

    #[test]
    fn forces_are_stiffness_times_displacement() {
        let corners = LOPSIDED;
        let cell = StraightTet10::new(&corners).expect("a cell");
        let strain = Vector6::new(1e-3, -2e-4, -1e-3, 5e-4, 0.0, 2e-4);
        let cracked = Secant::of_split(&rock(), &strain, [0.1, 0.8]);
        assert!(cracked.matrix().is_some());
        let points = [Secant::SOUND, Secant::of_share(0.3), Secant::of_share(0.0), cracked];
        let mut k = [[Mat3::zeros(); 10]; 10];
        cell.add_stiffness(&mut k, &rock(), &points);
        let u =
            nodes_of(&corners).map(|x| Vec3::new(x.y * x.z, x.x + x.z * x.z, x.x * x.y - 2.0 * x.z) * 1e-3);
        let strains = cell.strains(&u);
        let stresses = std::array::from_fn(|p| points[p].stress(&rock(), &strains[p]));
        let mut forces = [Vec3::zeros(); 10];
        cell.add_forces(&mut forces, &stresses);
        let scale = forces.iter().map(Vec3::norm).fold(0.0, f64::max);
        for (row, force) in k.iter().zip(&forces) {
            let expected: Vec3 = row.iter().zip(&u).map(|(k, u)| k * u).sum();
            assert!((force - expected).norm() < 1e-12 * scale);
        }
        assert!((4.0 * cell.point_volume() - cell.volume).abs() < 1e-15);
    }

    #[test]
    fn rigid_motion_costs_nothing_and_there_are_six() {
        let corners = LOPSIDED;
        let k = stiffness(&corners);
        let x = nodes_of(&corners);
        let mut dense = nalgebra::DMatrix::zeros(30, 30);
        for (i, row) in k.iter().enumerate() {
            for (j, block) in row.iter().enumerate() {
                dense.fixed_view_mut::<3, 3>(3 * i, 3 * j).copy_from(block);
            }
        }
        for (t, w) in [(Vec3::new(1., 2., 3.), Vec3::zeros()), (Vec3::zeros(), Vec3::new(0.3, -0.5, 0.7))] {
            let u = x.map(|x| t + w.cross(&x));
            for row in &k {
                let force: Vec3 = row.iter().zip(&u).map(|(k, u)| k * u).sum();
                assert!(force.norm() < 1e-13 * 30e9 * 10.0);
            }
        }
        let mut values: Vec<f64> = dense.symmetric_eigenvalues().iter().copied().collect();
        values.sort_by(f64::total_cmp);
        assert!(values[5].abs() < 1e-10 * values[29] && values[6] > 1e-4 * values[29], "{values:?}");
    }

    #[test]
    fn mass_shares_integrate_products() {
        // Against a Monte-Carlo-free check: exact integration of L monomials,
        // integral of L0^a L1^b L2^c L3^d dV = 6 V a! b! c! d! / (a + b + c + d + 3)!.
        let terms = |i: usize| -> Vec<(f64, [u32; 4])> {
            let mut power = [0u32; 4];
            if i < 4 {
                power[i] = 1;
                let mut square = [0u32; 4];
                square[i] = 2;
                vec![(2.0, square), (-1.0, power)]
            } else {
                EDGES[i - 4].iter().for_each(|&corner| power[corner] = 1);
                vec![(4.0, power)]
            }
        };
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        let integral = |p: &[u32; 4]| {
            6.0 * p.iter().map(|&a| factorial(a)).product::<f64>() / factorial(p.iter().sum::<u32>() + 3)
        };
        for i in 0..10 {
            let single: f64 = terms(i).iter().map(|(f, p)| f * integral(p)).sum();
            assert!((single - volume_share(i)).abs() < 1e-15);
            for j in 0..10 {
                let mut expected = 0.0;
                for (f, p) in terms(i) {
                    for (g, q) in terms(j) {
                        let power = [0, 1, 2, 3].map(|k| p[k] + q[k]);
                        expected += f * g * integral(&power);
                    }
                }
                assert!((mass_share(i, j) - expected).abs() < 1e-15, "{i} {j}");
            }
        }
    }

    #[test]
    fn failed_points_give_no_stiffness() {
        let corners = LOPSIDED;
        let cell = StraightTet10::new(&corners).expect("a cell");
        let mut none = [[Mat3::zeros(); 10]; 10];
        cell.add_stiffness(&mut none, &rock(), &[const { Secant::of_share(0.0) }; 4]);
        assert!(none.iter().flatten().all(|block| *block == Mat3::zeros()));
        let mut half = [[Mat3::zeros(); 10]; 10];
        cell.add_stiffness(&mut half, &rock(), &[const { Secant::of_share(0.5) }; 4]);
        let full = stiffness(&corners);
        assert!((half[3][7] * 2.0 - full[3][7]).norm() < 1e-12 * full[3][7].norm());
    }
}
