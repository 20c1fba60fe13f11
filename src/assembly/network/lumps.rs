//! The network of contact forces split in two, so that no more than bodies has to be factorised.
//!
//! The tangent is `P + E`: `E` is what the force of one pair of bodies does to the gaps of another pair on the same body, and `P` all
//! else. In `P` the forces between two bodies depend on the motion of these two alone, so they are eliminated pair by pair,
//! `K + L A^-1 G`, and what is left has six unknowns a body and the pattern of rigid bodies. `E` is small beside `A`: a force displaces the surface
//! around it by far more than what lies across the grain. So `(I + E P^-1) z = r` takes some ten iterations of any Krylov method,
//! however large or close to an instability the network is (motions that need no force are the same in `P`), and its
//! unknowns are forces of contacts alone.

use nalgebra::DMatrix;
use std::ops::Range;

use crate::assembly::network::{Knot, Network};
use crate::assembly::{BlockPattern, Dofs};
use crate::tensor::{Mat3, Vec3};

/// Contacts of one pair at most.
const MOST_IN_A_PAIR: usize = 24;

/// The forces between each two bodies, eliminated.
#[derive(Debug, Clone, Default)]
pub struct Lumps {
    lumps: Vec<Lump>,
    /// Number of each knot's lump.
    of_knot: Vec<u32>,
    /// `A^-1` of the lumps, column by column, and `A^-1 G`, knot by knot.
    inverses: Vec<f64>,
    by_motion: Vec<[[f64; 12]; 3]>,
    /// Displacements of the knots by the forces of other pairs, in [`Self::across_into`].
    moved: Vec<Vec3>,
}

/// The contacts of two bodies.
#[derive(Debug, Clone)]
struct Lump {
    bodies: [usize; 2],
    knots: Range<usize>,
    /// First entry of its inverse.
    first: usize,
}

impl Lump {
    fn size(&self) -> usize {
        3 * self.knots.len()
    }
}

impl Network {
    /// The knots of each two bodies.
    fn by_pair(&self) -> impl Iterator<Item = &[Knot]> {
        self.knots.chunk_by(|a, b| a.key == b.key)
    }

    /// Which pairs of bodies their eliminated forces couple.
    pub fn lumped_couplings(&self) -> impl Iterator<Item = (usize, usize)> {
        self.by_pair().map(|knots| (knots[0].key.0 as usize, knots[0].key.1 as usize))
    }

    /// Whether there are forces to eliminate, and no pair has so many contacts that its dense tangent is most of the work.
    pub fn can_be_split(&self) -> bool {
        !self.knots.is_empty() && self.by_pair().all(|of_pair| of_pair.len() <= MOST_IN_A_PAIR)
    }

    /// Eliminates the forces of each pair by its own tangent. `false` where one is singular.
    pub fn lump_into(&self, lumps: &mut Lumps) -> bool {
        let Lumps { lumps, of_knot, inverses, by_motion, .. } = lumps;
        lumps.clear();
        of_knot.clear();
        inverses.clear();
        by_motion.clear();
        let mut first = 0;
        for of_pair in self.by_pair() {
            let (start, key) = (of_knot.len(), of_pair[0].key);
            of_knot.resize(start + of_pair.len(), lumps.len() as u32);
            let lump = Lump { bodies: [key.0 as usize, key.1 as usize], knots: start..of_knot.len(), first };
            first += lump.size() * lump.size();
            lumps.push(lump);
        }
        inverses.resize(first, 0.0);
        let mut add = |row: usize, column: usize, block: Mat3| {
            let lump = &lumps[of_knot[row] as usize];
            let (row, column) = (3 * (row - lump.knots.start), 3 * (column - lump.knots.start));
            for c in 0..3 {
                for r in 0..3 {
                    inverses[lump.first + (column + c) * lump.size() + row + r] += block[(r, c)];
                }
            }
        };
        for (k, knot) in self.knots.iter().enumerate() {
            add(k, k, self.own_block(knot));
        }
        self.for_each_flexibility(|row, column| of_knot[row] == of_knot[column], add);
        for lump in lumps.iter() {
            let n = lump.size();
            let block = &mut inverses[lump.first..lump.first + n * n];
            let Some(inverse) = DMatrix::from_column_slice(n, n, block).try_inverse() else { return false };
            block.copy_from_slice(inverse.as_slice());
            let rows = lump.knots.clone().map(|k| self.tangent_of(&self.knots[k]).row_by_motion());
            let rows: Vec<[[f64; 12]; 3]> = rows.collect();
            for i in 0..lump.knots.len() {
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
    pub fn lumped_stiffness_into(
        &self,
        values: &mut [f64],
        pattern: &BlockPattern,
        dofs: &Dofs,
        lumps: &Lumps,
    ) {
        for lump in &lumps.lumps {
            let mut whole = [[0.0; 12]; 12];
            for k in lump.knots.clone() {
                let lift = &self.tangent_of(&self.knots[k]).lift;
                for (row, lift) in whole.iter_mut().zip(lift) {
                    for (lift, by_motion) in lift.iter().zip(&lumps.by_motion[k]) {
                        for (entry, by) in row.iter_mut().zip(by_motion) {
                            *entry += lift * self.stiffness * by;
                        }
                    }
                }
            }
            for (i, row) in lump.bodies.into_iter().enumerate() {
                for (j, column) in lump.bodies.into_iter().enumerate() {
                    let block: [[f64; 6]; 6] =
                        std::array::from_fn(|r| std::array::from_fn(|c| whole[6 * i + r][6 * j + c]));
                    pattern.add_block(values, dofs, row, column, &block);
                }
            }
        }
    }
}

impl Lumps {
    /// Forces of the contacts alone under `rows`, `A^-1 r`, into `forces` (unknowns).
    pub fn held_into(&self, forces: &mut [f64], rows: &[f64]) {
        for lump in &self.lumps {
            let (n, at) = (lump.size(), 3 * lump.knots.start..3 * lump.knots.end);
            let (forces, rows) = (&mut forces[at.clone()], &rows[at]);
            forces.fill(0.0);
            for (column, row) in self.inverses[lump.first..lump.first + n * n].chunks_exact(n).zip(rows) {
                forces.iter_mut().zip(column).for_each(|(force, entry)| *force += entry * row);
            }
        }
    }

    /// Adds the wrenches of `forces` (unknowns) to the rows of the bodies, `L y`.
    pub fn lift_into(&self, bodies: &mut [f64], network: &Network, dofs: &Dofs, forces: &[f64]) {
        for lump in &self.lumps {
            let mut wrench = [0.0; 12];
            for k in lump.knots.clone() {
                let lift = &network.tangent_of(&network.knots[k]).lift;
                for (entry, lift) in wrench.iter_mut().zip(lift) {
                    let along = lift.iter().zip(&forces[3 * k..3 * k + 3]).map(|(l, f)| l * f).sum::<f64>();
                    *entry += network.stiffness * along;
                }
            }
            dofs.scatter(bodies, lump.bodies[0], &wrench[..6]);
            dofs.scatter(bodies, lump.bodies[1], &wrench[6..]);
        }
    }

    /// Takes off the forces what they lose to the `motion` of the bodies (unknowns), `y - A^-1 G q`.
    pub fn follow(&self, forces: &mut [f64], dofs: &Dofs, motion: &[f64]) {
        for lump in &self.lumps {
            let [a, b] = lump.bodies.map(|body| dofs.motion(motion, 1.0, body));
            let mut moved = [0.0; 12];
            for (moved, part) in moved.chunks_exact_mut(3).zip([a.0, a.1, b.0, b.1]) {
                moved.copy_from_slice(part.as_slice());
            }
            for k in lump.knots.clone() {
                for (force, row) in forces[3 * k..3 * k + 3].iter_mut().zip(&self.by_motion[k]) {
                    *force -= row.iter().zip(&moved).map(|(entry, moved)| entry * moved).sum::<f64>();
                }
            }
        }
    }

    /// What forces (unknowns) do to the rows of other pairs' forces, `E y`, into `rows`.
    pub fn across_into(&mut self, rows: &mut [f64], network: &Network, forces: &[f64]) {
        if !network.placed {
            rows.fill(0.0);
            return;
        }
        self.moved.clear();
        self.moved.resize(network.knots.len(), Vec3::zeros());
        for patch in &network.patches {
            for (i, (row, row_sign, _)) in patch.spots.iter().enumerate() {
                let mut moved = Vec3::zeros();
                for (j, (column, sign, _)) in patch.spots.iter().enumerate() {
                    if self.of_knot[*row] != self.of_knot[*column] {
                        let force = Vec3::from_column_slice(&forces[3 * column..3 * column + 3]);
                        moved += patch.block(i, j) * (force * *sign);
                    }
                }
                self.moved[*row] += moved * *row_sign;
            }
        }
        for ((rows, knot), moved) in rows.chunks_exact_mut(3).zip(&network.knots).zip(&self.moved) {
            let row = knot.tangent.by_displacement * moved * -network.stiffness;
            rows.copy_from_slice(row.as_slice());
        }
    }
}
