//! The tangent with contact forces as unknowns, split in two so that no more than bodies has to be
//! factorised.
//!
//! The tangent is `P + E`: `E` is what the force of one pair of bodies does to the gaps of another pair on
//! the same body, and `P` all else. In `P` the forces between two bodies depend on the motion of these two
//! alone, so they are eliminated pair by pair, `K + L A^-1 G`, and what is left has six unknowns a body and
//! the pattern of rigid bodies. `E` is small beside `A`: a force displaces the surface around it by far more
//! than what lies across the grain. So `(I + E P^-1) z = r` takes some ten iterations of any Krylov method,
//! however large or close to an instability the model is (motions that need no force are the same in `P`),
//! and its unknowns are forces of contacts alone.

use nalgebra::DMatrix;
use std::ops::Range;

use crate::assembly::contact_forces::{ContactForce, ContactForces};
use crate::assembly::{BlockPattern, Dofs};
use crate::tensor::{Mat3, Vec3};

/// Contacts of one pair at most.
const MOST_IN_A_PAIR: usize = 24;

/// The forces between each two bodies, eliminated.
#[derive(Debug, Clone, Default)]
pub struct PairElimination {
    pairs: Vec<EliminatedPair>,
    /// Number of each unknown's pair.
    of_unknown: Vec<u32>,
    /// `A^-1` of the pairs, column by column, and `A^-1 G`, unknown by unknown.
    inverses: Vec<f64>,
    by_motion: Vec<[[f64; 12]; 3]>,
    /// Displacements by the forces of other pairs where each unknown acts, in [`Self::across_into`].
    moved: Vec<Vec3>,
}

/// The contacts of two bodies.
#[derive(Debug, Clone)]
struct EliminatedPair {
    bodies: [usize; 2],
    unknowns: Range<usize>,
    /// First entry of its inverse.
    first: usize,
}

impl EliminatedPair {
    fn size(&self) -> usize {
        3 * self.unknowns.len()
    }
}

impl ContactForces {
    /// The unknowns of each two bodies.
    fn by_pair(&self) -> impl Iterator<Item = &[ContactForce]> {
        self.unknowns.chunk_by(|a, b| a.key == b.key)
    }

    /// Which pairs of bodies their eliminated forces couple.
    pub fn eliminated_couplings(&self) -> impl Iterator<Item = (usize, usize)> {
        self.by_pair().map(|unknowns| (unknowns[0].key.0 as usize, unknowns[0].key.1 as usize))
    }

    /// Whether there are forces to eliminate, and no pair has so many contacts that its dense tangent is most of the work.
    pub fn can_be_split(&self) -> bool {
        !self.unknowns.is_empty() && self.by_pair().all(|of_pair| of_pair.len() <= MOST_IN_A_PAIR)
    }

    /// Eliminates the forces of each pair by its own tangent. `false` where one is singular.
    pub fn eliminate_into(&self, elimination: &mut PairElimination) -> bool {
        let PairElimination { pairs, of_unknown, inverses, by_motion, .. } = elimination;
        pairs.clear();
        of_unknown.clear();
        inverses.clear();
        by_motion.clear();
        let mut first = 0;
        for of_pair in self.by_pair() {
            let (start, key) = (of_unknown.len(), of_pair[0].key);
            of_unknown.resize(start + of_pair.len(), pairs.len() as u32);
            let pair = EliminatedPair {
                bodies: [key.0 as usize, key.1 as usize],
                unknowns: start..of_unknown.len(),
                first,
            };
            first += pair.size() * pair.size();
            pairs.push(pair);
        }
        inverses.resize(first, 0.0);
        let mut add = |row: usize, column: usize, block: Mat3| {
            let pair = &pairs[of_unknown[row] as usize];
            let (row, column) = (3 * (row - pair.unknowns.start), 3 * (column - pair.unknowns.start));
            for c in 0..3 {
                for r in 0..3 {
                    inverses[pair.first + (column + c) * pair.size() + row + r] += block[(r, c)];
                }
            }
        };
        for (k, unknown) in self.unknowns.iter().enumerate() {
            add(k, k, self.own_block(unknown));
        }
        self.for_each_flexibility(|row, column| of_unknown[row] == of_unknown[column], add);
        for pair in pairs.iter() {
            let n = pair.size();
            let block = &mut inverses[pair.first..pair.first + n * n];
            let Some(inverse) = DMatrix::from_column_slice(n, n, block).try_inverse() else { return false };
            block.copy_from_slice(inverse.as_slice());
            let rows = pair.unknowns.clone().map(|k| self.tangent_of(&self.unknowns[k]).row_by_motion());
            let rows: Vec<[[f64; 12]; 3]> = rows.collect();
            for i in 0..pair.unknowns.len() {
                by_motion.push(std::array::from_fn(|r| {
                    std::array::from_fn(|c| {
                        (0..n).map(|k| block[k * n + 3 * i + r] * rows[k / 3][k % 3][c]).sum()
                    })
                }));
            }
        }
        true
    }

    /// Adds what the eliminated forces do to the bodies as these move, `L A^-1 G`, to `values`.
    pub fn eliminated_stiffness_into(
        &self,
        values: &mut [f64],
        pattern: &BlockPattern,
        dofs: &Dofs,
        elimination: &PairElimination,
    ) {
        for pair in &elimination.pairs {
            let mut whole = [[0.0; 12]; 12];
            for k in pair.unknowns.clone() {
                let lift = &self.tangent_of(&self.unknowns[k]).lift;
                for (row, lift) in whole.iter_mut().zip(lift) {
                    for (lift, by_motion) in lift.iter().zip(&elimination.by_motion[k]) {
                        for (entry, by) in row.iter_mut().zip(by_motion) {
                            *entry += lift * self.stiffness * by;
                        }
                    }
                }
            }
            for (i, row) in pair.bodies.into_iter().enumerate() {
                for (j, column) in pair.bodies.into_iter().enumerate() {
                    let block: [[f64; 6]; 6] =
                        std::array::from_fn(|r| std::array::from_fn(|c| whole[6 * i + r][6 * j + c]));
                    pattern.add_block(values, dofs, row, column, &block);
                }
            }
        }
    }
}

impl PairElimination {
    /// Forces of the contacts alone under `rows`, `A^-1 r`, into `forces` (unknowns).
    pub fn forces_into(&self, forces: &mut [f64], rows: &[f64]) {
        for pair in &self.pairs {
            let (n, at) = (pair.size(), 3 * pair.unknowns.start..3 * pair.unknowns.end);
            let (forces, rows) = (&mut forces[at.clone()], &rows[at]);
            forces.fill(0.0);
            for (column, row) in self.inverses[pair.first..pair.first + n * n].chunks_exact(n).zip(rows) {
                forces.iter_mut().zip(column).for_each(|(force, entry)| *force += entry * row);
            }
        }
    }

    /// Adds the wrenches of `forces` (unknowns) to the rows of the bodies, `L y`.
    pub fn lift_into(&self, bodies: &mut [f64], unknown_forces: &ContactForces, dofs: &Dofs, forces: &[f64]) {
        for pair in &self.pairs {
            let mut wrench = [0.0; 12];
            for k in pair.unknowns.clone() {
                let lift = &unknown_forces.tangent_of(&unknown_forces.unknowns[k]).lift;
                for (entry, lift) in wrench.iter_mut().zip(lift) {
                    let along = lift.iter().zip(&forces[3 * k..3 * k + 3]).map(|(l, f)| l * f).sum::<f64>();
                    *entry += unknown_forces.stiffness * along;
                }
            }
            dofs.scatter(bodies, pair.bodies[0], &wrench[..6]);
            dofs.scatter(bodies, pair.bodies[1], &wrench[6..]);
        }
    }

    /// Takes off the forces what they lose to the `motion` of the bodies (unknowns), `y - A^-1 G q`.
    pub fn follow(&self, forces: &mut [f64], dofs: &Dofs, motion: &[f64]) {
        for pair in &self.pairs {
            let [a, b] = pair.bodies.map(|body| dofs.motion(motion, 1.0, body));
            let mut moved = [0.0; 12];
            for (moved, part) in moved.chunks_exact_mut(3).zip([a.0, a.1, b.0, b.1]) {
                moved.copy_from_slice(part.as_slice());
            }
            for k in pair.unknowns.clone() {
                for (force, row) in forces[3 * k..3 * k + 3].iter_mut().zip(&self.by_motion[k]) {
                    *force -= row.iter().zip(&moved).map(|(entry, moved)| entry * moved).sum::<f64>();
                }
            }
        }
    }

    /// What forces (unknowns) do to the rows of other pairs' forces, `E y`, into `rows`.
    pub fn across_into(&mut self, rows: &mut [f64], unknown_forces: &ContactForces, forces: &[f64]) {
        if !unknown_forces.placed {
            rows.fill(0.0);
            return;
        }
        self.moved.clear();
        self.moved.resize(unknown_forces.unknowns.len(), Vec3::zeros());
        for patch in &unknown_forces.patches {
            for (i, (row, row_sign, _)) in patch.places.iter().enumerate() {
                let mut moved = Vec3::zeros();
                for (j, (column, sign, _)) in patch.places.iter().enumerate() {
                    if self.of_unknown[*row] != self.of_unknown[*column] {
                        let force = Vec3::from_column_slice(&forces[3 * column..3 * column + 3]);
                        moved += patch.block(i, j) * (force * *sign);
                    }
                }
                self.moved[*row] += moved * *row_sign;
            }
        }
        for ((rows, unknown), moved) in
            rows.chunks_exact_mut(3).zip(&unknown_forces.unknowns).zip(&self.moved)
        {
            let row = unknown.tangent.by_displacement * moved * -unknown_forces.stiffness;
            rows.copy_from_slice(row.as_slice());
        }
    }
}
