//! Sparse LU of unsymmetric systems (faer's supernodal LU with COLAMD), symbolic part reused.

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Lu, SymbolicLu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};

/// Why a linear system could not be solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SolveFailure {
    #[error("the matrix is structurally or numerically singular")]
    Singular,
    #[error("the solution is not finite")]
    NotFinite,
    #[error("out of memory")]
    OutOfMemory,
}

/// A square sparsity pattern, column by column, rows ascending.
#[derive(Debug, Clone, PartialEq)]
pub struct Pattern {
    pub size: usize,
    pub column_starts: Vec<usize>,
    pub rows: Vec<usize>,
}

/// A pattern analysed for LU.
pub struct LuSymbolic {
    pattern: SymbolicSparseColMat<usize>,
    symbolic: SymbolicLu<usize>,
}

impl LuSymbolic {
    pub fn analyse(pattern: Pattern) -> Result<Self, SolveFailure> {
        let Pattern { size, column_starts, rows } = pattern;
        let pattern = SymbolicSparseColMat::<usize>::new_checked(size, size, column_starts, None, rows);
        let symbolic = SymbolicLu::try_new(pattern.as_ref()).map_err(|_| SolveFailure::OutOfMemory)?;
        Ok(LuSymbolic { pattern, symbolic })
    }

    pub fn size(&self) -> usize {
        self.pattern.ncols()
    }

    pub fn factorise(&self, values: &[f64]) -> Result<LuFactor, SolveFailure> {
        let matrix = SparseColMatRef::new(self.pattern.as_ref(), values);
        let factor =
            Lu::try_new_with_symbolic(self.symbolic.clone(), matrix).map_err(|_| SolveFailure::Singular)?;
        Ok(LuFactor(factor))
    }
}

pub struct LuFactor(Lu<usize, f64>);

impl LuFactor {
    /// Overwrites `right_side` with the solution.
    pub fn solve_in_place(&self, right_side: &mut [f64]) -> Result<(), SolveFailure> {
        let mut column = faer::ColMut::from_slice_mut(right_side);
        self.0.solve_in_place(column.as_mut());
        if right_side.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(SolveFailure::NotFinite) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_an_unsymmetric_system() {
        // [2 1 0; 0 3 1; 1 0 4]
        let pattern = Pattern { size: 3, column_starts: vec![0, 2, 4, 6], rows: vec![0, 2, 0, 1, 1, 2] };
        let lu = LuSymbolic::analyse(pattern)
            .expect("analysed")
            .factorise(&[2.0, 1.0, 1.0, 3.0, 1.0, 4.0])
            .expect("factorised");
        let mut x = vec![4.0, 9.0, 13.0];
        lu.solve_in_place(&mut x).expect("solved");
        for (x, expected) in x.iter().zip([1.0, 2.0, 3.0]) {
            assert!((x - expected).abs() < 1e-13);
        }
    }

    #[test]
    fn singular_matrix_is_a_value_not_a_panic() {
        let pattern = Pattern { size: 2, column_starts: vec![0, 1, 2], rows: vec![0, 0] };
        let outcome = LuSymbolic::analyse(pattern).and_then(|s| s.factorise(&[1.0, 1.0])).and_then(|f| {
            let mut x = vec![1.0, 1.0];
            f.solve_in_place(&mut x)
        });
        assert!(outcome.is_err());
    }
}
