//! The linear system of a Newton iteration: its pattern, its factor, its solution.

use crate::assembly::contact_forces::PairElimination;
use crate::assembly::{BlockPattern, ContactForces, Dofs};
use crate::linalg::lu::SolveFailure;
use crate::linalg::{MultifrontalLu, gmres, norm};

/// 2-norm of the residual over that of the right side to which the forces are iterated, in so many iterations at most.
const LINEAR_TOLERANCE: f64 = 1e-6;
const ITERATIONS: usize = 60;

/// A pattern with its factor.
pub(super) struct System {
    pub(super) unknowns: Unknowns,
    pub(super) pattern: BlockPattern,
    pub(super) lu: MultifrontalLu,
    pub(super) elimination: PairElimination,
}

/// Which unknowns are factorised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unknowns {
    /// All, with this generation of contact forces.
    All(u64),
    /// Those of bodies, with the forces of contacts eliminated.
    Bodies,
}

impl System {
    /// Orders these unknowns by what couples them, in the memory of a system that is over.
    pub(super) fn new(
        unknowns: Unknowns,
        pattern: BlockPattern,
        former: Option<System>,
    ) -> Result<Self, SolveFailure> {
        let mut lu = former.map_or_else(MultifrontalLu::default, |system| system.lu);
        lu.analyse_anew(pattern.pattern.clone(), &pattern.first)?;
        Ok(System { unknowns, pattern, lu, elimination: PairElimination::default() })
    }

    /// Overwrites `right`, a right side of all unknowns, with the solution for the matrix of `values`, which was factorised last.
    ///
    /// Where the forces of contacts are eliminated the whole matrix is `P + E`: `(I + E P^-1) z = -E P^-1 b` is iterated in the forces' rows, and the
    /// solution is `P^-1 (b + z)`.
    pub(super) fn solve_in_place(
        &mut self,
        values: &[f64],
        unknown_forces: &ContactForces,
        dofs: &Dofs,
        right: &mut [f64],
    ) -> Result<(), SolveFailure> {
        if self.unknowns != Unknowns::Bodies {
            return self.lu.solve_in_place(values, right).map(|_| ());
        }
        let System { lu, elimination, .. } = self;
        let scale = norm(right);
        if scale == 0.0 {
            return Ok(());
        }
        let (bodies, rows) = right.split_at_mut(lu.size());
        let (mut motion, mut forces) = (vec![0.0; bodies.len()], vec![0.0; rows.len()]);
        // P^-1 of rows of forces, and of bodies where `motion` holds these.
        let mut split =
            |elimination: &mut PairElimination, motion: &mut [f64], forces: &mut [f64], rows: &[f64]| {
                elimination.forces_into(forces, rows);
                elimination.lift_into(motion, unknown_forces, dofs, forces);
                lu.substitute(motion);
                elimination.follow(forces, dofs, motion);
            };
        motion.copy_from_slice(bodies);
        split(elimination, &mut motion, &mut forces, rows);
        let mut across = vec![0.0; rows.len()];
        elimination.across_into(&mut across, unknown_forces, &forces);
        across.iter_mut().for_each(|row| *row = -*row);
        let mut correction = vec![0.0; rows.len()];
        let target = 0.5 * LINEAR_TOLERANCE * scale;
        let found = gmres(&across, &mut correction, target, ITERATIONS, |rows, product| {
            motion.fill(0.0);
            split(elimination, &mut motion, &mut forces, rows);
            elimination.across_into(product, unknown_forces, &forces);
            product.iter_mut().zip(rows).for_each(|(product, row)| *product += row);
        });
        tracing::trace!(iterations = found.iterations, left = found.left / scale, "contact forces iterated");
        // The solution by a refined solve, and what it leaves of the forces' rows.
        rows.iter_mut().zip(&correction).for_each(|(row, z)| *row += z);
        elimination.forces_into(&mut forces, rows);
        elimination.lift_into(bodies, unknown_forces, dofs, &forces);
        lu.solve_in_place(values, bodies)?;
        elimination.follow(&mut forces, dofs, bodies);
        elimination.across_into(&mut across, unknown_forces, &forces);
        across.iter_mut().zip(&correction).for_each(|(row, z)| *row += z);
        rows.copy_from_slice(&forces);
        let left = norm(&across) / scale;
        if left <= LINEAR_TOLERANCE { Ok(()) } else { Err(SolveFailure::of_residual(left)) }
    }
}
