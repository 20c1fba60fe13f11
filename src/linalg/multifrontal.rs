//! LU of unsymmetric matrices whose pattern is symmetric and made of small blocks (bodies that
//! touch): multifrontal elimination along a nested dissection of the graph of blocks.
//!
//! Source: Duff & Reid (1984), "The multifrontal solution of unsymmetric sets of linear equations",
//! SIAM J. Sci. Stat. Comput. 5(3):633-641. Rows are exchanged only within the pivots of a front, so the
//! analysis holds for any values; what that may lose is put right by iterative refinement, and every
//! solution is checked against its residual.
//!
//! Subtrees are eliminated in parallel. Each sum is taken by one thread in an order that the analysis
//! fixes, so the same values give the same bits on any number of threads.

mod analysis;
mod elimination;

use crate::linalg::lu::{Pattern, SolveFailure};
use crate::linalg::norm;
use analysis::Analysis;

/// Relative residual `|b - A x| / |b|` (2-norms) at which a solution is good, and which it may not
/// exceed after all refinements.
const GOOD_RESIDUAL: f64 = 1e-12;
const LARGEST_RESIDUAL: f64 = 1e-6;

/// Steps of iterative refinement at most.
const REFINEMENTS: usize = 4;

/// An analysed pattern with its factor and buffers.
#[derive(Debug, Default)]
pub struct MultifrontalLu {
    pattern: Pattern,
    analysis: Analysis,
    /// Factors of the fronts, one after another in the order of elimination.
    factor: Vec<f64>,
    /// Row exchanges within each front's pivots.
    exchanges: Vec<u32>,
    residual: Vec<f64>,
    best: Vec<f64>,
    work: Vec<f64>,
}

impl MultifrontalLu {
    /// Analyses a symmetric pattern; block `g` has the unknowns `first[g]..first[g + 1]`, and the
    /// pattern holds whole blocks. An unsymmetric pattern or one of broken blocks is `Singular`.
    pub fn analyse(pattern: Pattern, first: &[u32]) -> Result<Self, SolveFailure> {
        let mut lu = MultifrontalLu::default();
        lu.analyse_anew(pattern, first)?;
        Ok(lu)
    }

    /// The same in the memory that it has; not to be used for anything else where that fails.
    pub fn analyse_anew(&mut self, pattern: Pattern, first: &[u32]) -> Result<(), SolveFailure> {
        self.analysis = Analysis::of(&pattern, first)?;
        self.factor.resize(self.analysis.factor_length(), 0.0);
        self.exchanges.resize(pattern.size, 0);
        self.residual.resize(pattern.size, 0.0);
        self.best.resize(pattern.size, 0.0);
        self.work.resize(self.analysis.largest_front(), 0.0);
        self.pattern = pattern;
        Ok(())
    }

    /// Number of unknowns.
    pub const fn size(&self) -> usize {
        self.pattern.size
    }

    /// Entries of the factor, zeros that amalgamation stores included.
    pub fn factor_entries(&self) -> usize {
        self.factor.len()
    }

    /// Factorises the matrix with these values, in the order of the pattern's rows.
    pub fn factorise(&mut self, values: &[f64]) -> Result<(), SolveFailure> {
        if values.len() != self.pattern.rows.len() {
            return Err(SolveFailure::Singular);
        }
        elimination::eliminate(&self.analysis, values, &mut self.factor, &mut self.exchanges)
    }

    /// Overwrites `x`, the right side, with the solution for the matrix of `values`, which was
    /// factorised last; returns the relative residual.
    pub fn solve_in_place(&mut self, values: &[f64], x: &mut [f64]) -> Result<f64, SolveFailure> {
        if x.len() != self.size() || values.len() != self.pattern.rows.len() {
            return Err(SolveFailure::Singular);
        }
        let right_side = x.to_vec();
        let scale = norm(&right_side);
        if scale == 0.0 {
            return Ok(0.0);
        }
        self.substitute(x);
        let mut left = self.residual_of(values, x, &right_side) / scale;
        for _ in 0..REFINEMENTS {
            if left <= GOOD_RESIDUAL || !left.is_finite() {
                break;
            }
            self.best.copy_from_slice(x);
            let mut correction = std::mem::take(&mut self.residual);
            self.substitute(&mut correction);
            x.iter_mut().zip(&correction).for_each(|(x, c)| *x += c);
            self.residual = correction;
            let refined = self.residual_of(values, x, &right_side) / scale;
            if !(refined < left) {
                x.copy_from_slice(&self.best);
                break;
            }
            left = refined;
        }
        if left <= LARGEST_RESIDUAL { Ok(left) } else { Err(SolveFailure::of_residual(left)) }
    }

    /// Overwrites `x`, the right side, with the solution by the factor alone: neither refined nor checked.
    pub fn substitute(&mut self, x: &mut [f64]) {
        elimination::substitute(&self.analysis, &self.factor, &self.exchanges, x, &mut self.work);
    }

    /// Leaves `b - A x` in the buffer and returns its norm.
    fn residual_of(&mut self, values: &[f64], x: &[f64], right_side: &[f64]) -> f64 {
        self.residual.copy_from_slice(right_side);
        for (column, x) in x.iter().enumerate() {
            let entries = self.pattern.column_starts[column]..self.pattern.column_starts[column + 1];
            for (&row, value) in self.pattern.rows[entries.clone()].iter().zip(&values[entries]) {
                self.residual[row] -= value * x;
            }
        }
        norm(&self.residual)
    }
}

#[cfg(test)]
mod tests;
