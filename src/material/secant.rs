//! What an integration point keeps of its stiffness while its damage is frozen, and the energies that open and close cracks.
//!
//! A strain is the sum of an opening `a`, no principal value of which is negative, and a rest whose stress `C (e - a)` has no positive one, with
//! `a : C (e - a) = 0`. The rest is the strain of a solid without tension; the split exists once and has the axes of the strain.
//! `psi+ = a : C a / 2` and `psi- = (e - a) : C (e - a) / 2` add up to the energy of sound rock. Both are convex and go with the square of the
//! strain, so that their second derivatives are secants, too. In uniaxial compression with free sides `psi+` is 0.
//!
//! Source: Del Piero (1989), Meccanica 24:150, for the solid without tension; Freddi & Royer-Carfagni (2010), J. Mech. Phys. Solids
//! 58:1154, for its energy as the part that damage leaves.

use nalgebra::{Matrix6, SymmetricEigen, Vector6};

use crate::material::Elastic;
use crate::tensor::stored::Numbers;
use crate::tensor::{Mat3, Vec3};

/// Part of the stiffness of a failed point that stays in a factor while its cell lives; no direction of a working one keeps less.
pub const HELD: f64 = 1e-6;

/// The strain tensor of a Voigt strain.
pub(super) fn tensor_of(e: &Vector6<f64>) -> Mat3 {
    let (xy, yz, zx) = (0.5 * e[3], 0.5 * e[4], 0.5 * e[5]);
    Mat3::new(e[0], xy, zx, xy, e[1], yz, zx, yz, e[2])
}

/// In how many principal directions a solid without tension opens; `values` are the principal strains, the largest first.
fn opened(rock: &Elastic, values: &Vec3) -> usize {
    let (lambda, mu) = rock.lame();
    if lambda * values.sum() + 2.0 * mu * values[0] <= 0.0 {
        0
    } else if values[1] + rock.poissons_ratio() * values[2] <= 0.0 {
        1
    } else if values[2] <= 0.0 {
        2
    } else {
        3
    }
}

/// Principal stresses of the rest by the principal strains [Pa]: of a solid, of a sheet, of a bar, or none.
fn closed_principal(rock: &Elastic, opened: usize) -> Mat3 {
    let (nu, contact) = (rock.poissons_ratio(), rock.contact_modulus());
    let (lambda, mu) = rock.lame();
    match opened {
        0 => Mat3::repeat(lambda) + Mat3::from_diagonal_element(2.0 * mu),
        1 => Mat3::new(0.0, 0.0, 0.0, 0.0, 1.0, nu, 0.0, nu, 1.0) * contact,
        2 => Mat3::from_diagonal(&Vec3::new(0.0, 0.0, rock.youngs_modulus())),
        _ => Mat3::zeros(),
    }
}

/// `psi-` [J/m^3] at principal strains, the largest first.
pub(super) fn closed_energy(rock: &Elastic, values: &Vec3) -> f64 {
    0.5 * values.dot(&(closed_principal(rock, opened(rock, values)) * values))
}

/// Second derivative of `psi-` [Pa], for engineering shear strains.
fn closed_stiffness(rock: &Elastic, values: &Vec3, axes: &Mat3, opened: usize) -> Matrix6<f64> {
    let in_axes = closed_principal(rock, opened);
    let stresses = in_axes * values;
    let product = |i: usize, j: usize| {
        let (n, m) = (axes.column(i), axes.column(j));
        let both = |a: usize, b: usize| 0.5 * (n[a] * m[b] + n[b] * m[a]);
        Vector6::new(both(0, 0), both(1, 1), both(2, 2), both(0, 1), both(1, 2), both(2, 0))
    };
    let most = 2.0 * rock.shear_modulus();
    let mut out = Matrix6::zeros();
    for i in 0..3 {
        for j in 0..3 {
            out += product(i, i) * product(j, j).transpose() * in_axes[(i, j)];
        }
        for j in i + 1..3 {
            // How the stress turns with the axes: (s_i - s_j) / (e_i - e_j).
            let apart = values[i] - values[j];
            let turning = match (i < opened, j < opened) {
                (true, true) => 0.0,
                (true, false) if apart > 0.0 => (-stresses[j] / apart).clamp(0.0, most),
                _ => most,
            };
            out += product(i, j) * product(i, j).transpose() * (2.0 * turning);
        }
    }
    out
}

/// A symmetric stiffness of a point, positive semi-definite.
#[derive(Debug, Clone, PartialEq)]
pub struct Secant {
    /// Part of the energy of sound rock that it stores at the strain that it was made for; without a matrix, at any strain.
    share: f64,
    /// Stress [Pa] by strain (Voigt, engineering shear) where that is no share of the stiffness of sound rock.
    matrix: Option<Box<Matrix6<f64>>>,
}

impl Secant {
    pub const SOUND: Secant = Secant::of_share(1.0);

    /// So much of the stiffness of sound rock.
    pub const fn of_share(share: f64) -> Self {
        Secant { share, matrix: None }
    }

    /// Of `psi+` and `psi-` at a strain, of which the shares `[open, closed]` are left.
    pub fn of_split(rock: &Elastic, strain: &Vector6<f64>, [open, closed]: [f64; 2]) -> Self {
        if open == closed {
            return Secant::of_share(open);
        }
        let eigen = SymmetricEigen::new(tensor_of(strain));
        let mut order = [0, 1, 2];
        order.sort_by(|i, j| eigen.eigenvalues[*j].total_cmp(&eigen.eigenvalues[*i]));
        let values = Vec3::from(order.map(|i| eigen.eigenvalues[i]));
        let axes = Mat3::from_columns(&order.map(|i| eigen.eigenvectors.column(i).into_owned()));
        match opened(rock, &values) {
            0 => Secant::of_share(closed),
            3 => Secant::of_share(open),
            directions => {
                let [open, closed] = [open, closed].map(|share| share.max(HELD));
                let rest = closed_stiffness(rock, &values, &axes, directions);
                let matrix = rock.matrix() * open + rest * (closed - open);
                let share = 0.5 * strain.dot(&(matrix * strain)) / rock.energy_density(strain);
                Secant { share, matrix: Some(Box::new(matrix)) }
            }
        }
    }

    /// Part of the energy of sound rock that it stores at the strain that it was made for: 1 sound, 0 failed.
    pub const fn share(&self) -> f64 {
        self.share
    }

    /// The matrix, where the stiffness is no share of that of sound rock.
    pub fn matrix(&self) -> Option<&Matrix6<f64>> {
        self.matrix.as_deref()
    }

    /// The same, or that share of sound rock's where it is a smaller one.
    pub fn at_least(&self, share: f64) -> Self {
        if self.matrix.is_none() && self.share < share { Secant::of_share(share) } else { self.clone() }
    }

    /// Whether it is that of sound rock.
    pub fn is_sound(&self) -> bool {
        self.share == 1.0 && self.matrix.is_none()
    }

    /// Stress [Pa] at a strain, of rock that is this when sound.
    pub fn stress(&self, rock: &Elastic, strain: &Vector6<f64>) -> Vector6<f64> {
        match &self.matrix {
            Some(matrix) => **matrix * strain,
            None => rock.stress(strain) * self.share,
        }
    }

    /// Energy per volume at a strain [J/m^3].
    pub fn energy_density(&self, rock: &Elastic, strain: &Vector6<f64>) -> f64 {
        0.5 * strain.dot(&self.stress(rock, strain))
    }

    /// How far the stresses of `other` at a strain are from these, over those of sound rock; negative where it is softer.
    pub fn change_to(&self, other: &Secant, rock: &Elastic, strain: &Vector6<f64>) -> f64 {
        if self.matrix.is_none() && other.matrix.is_none() {
            return other.share - self.share;
        }
        let sound = rock.stress(strain).norm();
        if sound == 0.0 {
            return 0.0;
        }
        let change = other.stress(rock, strain) - self.stress(rock, strain);
        (change.norm() / sound).copysign(change.dot(strain))
    }

    /// The part `part` of the way from this to `other`, 0 to 1.
    pub fn towards(&self, other: &Secant, part: f64, rock: &Elastic) -> Secant {
        if part >= 1.0 {
            return other.clone();
        }
        let share = self.share + part * (other.share - self.share);
        let whole = |secant: &Secant| {
            secant.matrix.as_deref().copied().unwrap_or_else(|| rock.matrix() * secant.share.max(HELD))
        };
        let is_share = self.matrix.is_none() && other.matrix.is_none();
        let matrix = (!is_share).then(|| Box::new(whole(self) * (1.0 - part) + whole(other) * part));
        Secant { share, matrix }
    }
}

impl Numbers for Secant {
    fn put(&self, row: &mut Vec<f64>) {
        row.push(self.share);
        let matrix: Vec<Matrix6<f64>> = self.matrix.as_deref().copied().into_iter().collect();
        matrix.put(row);
    }

    fn take(row: &mut impl Iterator<Item = f64>) -> Option<Self> {
        let share = row.next()?;
        let matrix = Vec::<Matrix6<f64>>::take(row)?.into_iter().next().map(Box::new);
        Some(Secant { share, matrix })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::draws;

    fn rock() -> Elastic {
        Elastic::new(30e9, 0.25).expect("allowed")
    }

    fn strains(count: usize) -> Vec<Vector6<f64>> {
        let mut draw = draws(7);
        (0..count).map(|_| Vector6::from_fn(|_, _| 2e-3 * draw())).collect()
    }

    /// The rest's energy by its definition: the least of a strain less an opening, found by projected descent on the principal values.
    fn least_energy(values: &Vec3) -> f64 {
        let stiffness = closed_principal(&rock(), 0);
        let mut opening = Vec3::zeros();
        for _ in 0..4000 {
            let stresses = stiffness * (values - opening);
            opening = (opening + stresses / 90e9).map(|a| a.max(0.0));
        }
        0.5 * (values - opening).dot(&(stiffness * (values - opening)))
    }

    #[test]
    fn the_rest_stores_the_least_that_an_opening_leaves() {
        let mut seen = [0; 4];
        for strain in strains(60) {
            let mut values: Vec<f64> =
                SymmetricEigen::new(tensor_of(&strain)).eigenvalues.iter().copied().collect();
            values.sort_by(|a, b| b.total_cmp(a));
            let values = Vec3::new(values[0], values[1], values[2]);
            let whole = rock().energy_density(&strain);
            assert!((closed_energy(&rock(), &values) - least_energy(&values)).abs() < 1e-9 * whole);
            seen[opened(&rock(), &values)] += 1;
        }
        assert!(seen.iter().all(|count| *count > 0), "{seen:?}");
    }

    /// Against differences of the energy at frozen shares: once for the stress, twice for the stiffness.
    #[test]
    fn stress_and_stiffness_are_derivatives_of_the_energy() {
        let rock = rock();
        for shares in [[0.1, 0.9], [0.4, 0.2], [0.0, 1.0]] {
            for strain in strains(60) {
                let at = |strain: &Vector6<f64>| Secant::of_split(&rock, strain, shares);
                let energy = |strain: &Vector6<f64>| at(strain).energy_density(&rock, strain);
                let stress = |strain: &Vector6<f64>| at(strain).stress(&rock, strain);
                for j in 0..6 {
                    let step = Vector6::ith(j, 1e-8);
                    let slope = (energy(&(strain + step)) - energy(&(strain - step))) / 2e-8;
                    assert!(
                        (slope - stress(&strain)[j]).abs() < 1e-5 * stress(&strain).norm().max(1e5),
                        "{slope}"
                    );
                    let column = (stress(&(strain + step)) - stress(&(strain - step))) / 2e-8;
                    let found = at(&strain).stress(&rock, &Vector6::ith(j, 1.0));
                    assert!((column - found).norm() < 1e-5 * rock.youngs_modulus(), "{column} {found}");
                }
            }
        }
    }

    #[test]
    fn free_sides_leave_no_opening_in_compression() {
        let (rock, nu) = (rock(), 0.25);
        let pressed = Vector6::new(-1e-3, nu * 1e-3, nu * 1e-3, 0.0, 0.0, 0.0);
        let cracked = Secant::of_split(&rock, &pressed, [1e-3, 1.0]);
        assert!((cracked.share() - 1.0).abs() < 1e-12);
        assert!((cracked.stress(&rock, &pressed) - rock.stress(&pressed)).norm() < 1e-9 * 30e6);
        // Rock that is compressed from all sides is whole again, and gone where it is pulled to all sides.
        let all = |e: f64| Secant::of_split(&rock, &Vector6::new(e, e, 2.0 * e, 0.0, 0.0, 0.0), [0.0, 1.0]);
        assert_eq!([all(-1e-3), all(1e-3)], [Secant::SOUND, Secant::of_share(0.0)]);
    }

    #[test]
    fn parts_of_the_way_are_between() {
        let (rock, strain) = (rock(), Vector6::new(1e-3, -1e-3, 2e-4, 3e-4, 0.0, 0.0));
        let [from, to] = [Secant::SOUND, Secant::of_split(&rock, &strain, [0.1, 0.9])];
        let whole = from.change_to(&to, &rock, &strain);
        assert!(whole < 0.0 && to.change_to(&from, &rock, &strain) == -whole);
        let half = from.towards(&to, 0.5, &rock);
        assert!((from.change_to(&half, &rock, &strain) / whole - 0.5).abs() < 1e-12);
        assert_eq!(half.towards(&to, 1.0, &rock), to);
        let mut row = Vec::new();
        vec![from.clone(), half.clone(), to.clone()].put(&mut row);
        assert_eq!(Vec::<Secant>::take(&mut row.into_iter()), Some(vec![from, half, to]));
    }
}
