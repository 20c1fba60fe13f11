//! Supernodal LLT of symmetric sparse matrices: analysed once, refactored in place. Memory to work in is held no longer than that takes: specimens
//! keep a factor a grain.
//!
//! faer does the work, sequentially: parallelism inside one factorisation gains little on the
//! matrices met here, so callers parallelise over grains and cases. The same input gives the same
//! bits on any thread count.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    self, CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
};
use faer::sparse::{FaerError, SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};

use crate::linalg::fault::FactorError;
use crate::linalg::ordering::Ordering;
use crate::linalg::symmetric::{SymmetricMatrix, SymmetricPattern};

impl From<FaerError> for FactorError {
    fn from(_: FaerError) -> Self {
        FactorError::OutOfMemory
    }
}

/// A sparse factorisation.
pub struct SparseCholesky {
    symbolic: Arc<SymbolicCholesky<u32>>,
    pattern_entries: usize,
    values: Vec<f64>,
    factorised: bool,
}

impl std::fmt::Debug for SparseCholesky {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SparseCholesky")
            .field("size", &self.size())
            .field("factorised", &self.factorised)
            .finish_non_exhaustive()
    }
}

impl SparseCholesky {
    /// Symbolic factorisation of `pattern`.
    pub fn analyse(pattern: &SymmetricPattern, ordering: &Ordering) -> Result<Self, FactorError> {
        let size = pattern.size();
        let order = match ordering {
            Ordering::MinimumDegree => SymmetricOrdering::Amd,
            Ordering::Given(permutation) if permutation.forward().len() == size => SymmetricOrdering::Custom(
                PermRef::new_checked(permutation.forward(), permutation.inverse(), size),
            ),
            Ordering::Given(permutation) => {
                return Err(FactorError::Size { expected: size, found: permutation.forward().len() });
            }
        };
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let symbolic =
            cholesky::factorize_symbolic_cholesky(symbolic_ref(pattern), Side::Lower, order, params)?;
        Ok(Self::over(Arc::new(symbolic), pattern.entries()))
    }

    /// For another matrix of the same pattern, with the same symbolic factorisation.
    pub fn again(&self) -> Self {
        Self::over(self.symbolic.clone(), self.pattern_entries)
    }

    fn over(symbolic: Arc<SymbolicCholesky<u32>>, pattern_entries: usize) -> Self {
        let values = vec![0.0; symbolic.len_val()];
        SparseCholesky { symbolic, pattern_entries, values, factorised: false }
    }

    /// Number of unknowns.
    pub fn size(&self) -> usize {
        self.symbolic.nrows()
    }

    /// Numeric factorisation of `matrix`, which must have the analysed pattern.
    pub fn factorise(&mut self, matrix: &SymmetricMatrix) -> Result<(), FactorError> {
        self.factorised = false;
        check_size(self.size(), matrix.size())?;
        check_size(self.pattern_entries, matrix.values.len())?;
        if !matrix.values.iter().all(|v| v.is_finite()) {
            return Err(FactorError::NotFinite("the matrix"));
        }
        let a = SparseColMatRef::new(symbolic_ref(matrix.pattern()), &matrix.values);
        let request = self.symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        let mut scratch = allocate(request)?;
        let stack = MemStack::new(&mut scratch);
        self.symbolic
            .factorize_numeric_llt(
                &mut self.values,
                a,
                Side::Lower,
                Default::default(),
                Par::Seq,
                stack,
                Spec::default(),
            )
            .map_err(|LltError::NonPositivePivot { index }| FactorError::NotPositiveDefinite {
                pivot: index,
            })?;
        if !self.values.iter().all(|v| v.is_finite()) {
            return Err(FactorError::NotFinite("the factor"));
        }
        self.factorised = true;
        Ok(())
    }

    /// Overwrites the `columns` right-hand sides in `x`, one after another, with `A^-1` times them.
    /// All that is checked is that the result is finite.
    pub fn back_substitute(&self, x: &mut [f64], columns: usize) -> Result<(), FactorError> {
        let mut scratch = allocate(self.symbolic.solve_in_place_scratch::<f64>(columns, Par::Seq))?;
        let size = self.size();
        check_size(size * columns, x.len())?;
        if !self.factorised {
            return Err(FactorError::NotFactorised);
        }
        let rhs = MatMut::from_column_major_slice_mut(x, size, columns);
        let stack = MemStack::new(&mut scratch);
        LltRef::<'_, u32, f64>::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            rhs,
            Par::Seq,
            stack,
        );
        if x.iter().all(|v| v.is_finite()) { Ok(()) } else { Err(FactorError::NotFinite("the solution")) }
    }
}

fn allocate(request: StackReq) -> Result<MemBuffer, FactorError> {
    MemBuffer::try_new(request).map_err(|_| FactorError::OutOfMemory)
}

fn symbolic_ref(pattern: &SymmetricPattern) -> SymbolicSparseColMatRef<'_, u32> {
    SymbolicSparseColMatRef::new_checked(
        pattern.size(),
        pattern.size(),
        pattern.starts(),
        None,
        pattern.rows(),
    )
}

fn check_size(expected: usize, found: usize) -> Result<(), FactorError> {
    if expected == found { Ok(()) } else { Err(FactorError::Size { expected, found }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::norm;
    use crate::linalg::ordering::NodeGraph;

    /// Laplacian of a square grid plus `shift` on the diagonal.
    fn laplacian(side: usize, shift: f64) -> (SymmetricMatrix, NodeGraph) {
        let n = side * side;
        let mut cliques = Vec::new();
        for k in 0..n {
            if k % side + 1 < side {
                cliques.push([k as u32, k as u32 + 1]);
            }
            if k + side < n {
                cliques.push([k as u32, (k + side) as u32]);
            }
        }
        let graph = NodeGraph::from_cliques(n, cliques.iter().map(|c| &c[..])).expect("in range");
        let mut a = SymmetricMatrix::zeros(SymmetricPattern::from_graph(&graph, 1).expect("small"));
        for k in 0..n {
            assert!(a.add(k, k, 4.0 + shift));
        }
        for [i, j] in cliques {
            assert!(a.add(i as usize, j as usize, -1.0));
        }
        (a, graph)
    }

    fn load(n: usize) -> Vec<f64> {
        (0..n).map(|k| ((k * 7919) % 101) as f64 / 101.0 - 0.4).collect()
    }

    #[test]
    fn factors_solve_and_refactor() {
        let (a, graph) = laplacian(31, 0.1);
        for ordering in
            [Ordering::MinimumDegree, Ordering::nested_dissection(&graph, 1).expect("an ordering")]
        {
            let mut factor = SparseCholesky::analyse(a.pattern(), &ordering).expect("analysed");
            let rhs = load(a.size());
            let mut x: Vec<f64> = vec![];
            for scale in [1.0, 3.0] {
                let mut b = a.clone();
                b.values.iter_mut().for_each(|v| *v *= scale);
                factor.factorise(&b).expect("factorised");
                x.clone_from(&rhs);
                factor.back_substitute(&mut x, 1).expect("solved");
                let row = |i: usize| (0..x.len()).map(|j| b.get(i, j) * x[j]).sum::<f64>();
                let left: Vec<f64> = rhs.iter().enumerate().map(|(i, right)| right - row(i)).collect();
                let residual = norm(&left) / norm(&rhs);
                assert!(residual < 1e-12, "{residual:e}");
            }
            let mut two: Vec<f64> = [rhs.clone(), rhs.clone()].concat();
            factor.back_substitute(&mut two, 2).expect("solved");
            for k in 0..rhs.len() {
                assert!((two[k] - x[k]).abs() < 1e-10 && (two[k + rhs.len()] - x[k]).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn bad_matrices_are_errors() {
        let (mut a, _) = laplacian(5, -8.0);
        let mut factor = SparseCholesky::analyse(a.pattern(), &Ordering::MinimumDegree).expect("analysed");
        assert!(matches!(factor.factorise(&a), Err(FactorError::NotPositiveDefinite { .. })));
        assert_eq!(factor.back_substitute(&mut load(25), 1), Err(FactorError::NotFactorised));
        a.values[3] = f64::NAN;
        assert_eq!(factor.factorise(&a), Err(FactorError::NotFinite("the matrix")));

        let graph = NodeGraph::from_cliques(2, [&[0u32, 1][..]]).expect("in range");
        let singular = SymmetricMatrix::zeros(SymmetricPattern::from_graph(&graph, 1).expect("small"));
        let mut factor =
            SparseCholesky::analyse(singular.pattern(), &Ordering::MinimumDegree).expect("analysed");
        assert!(matches!(factor.factorise(&singular), Err(FactorError::NotPositiveDefinite { .. })));
    }

    #[test]
    fn same_bits_each_time() {
        let (a, graph) = laplacian(40, 0.01);
        let solve = || {
            let ordering = Ordering::nested_dissection(&graph, 1).expect("an ordering");
            let mut factor = SparseCholesky::analyse(a.pattern(), &ordering).expect("analysed");
            factor.factorise(&a).expect("factorised");
            let mut x = load(a.size());
            factor.back_substitute(&mut x, 1).expect("solved");
            x
        };
        let reference = solve();
        std::thread::scope(|scope| {
            let runs: Vec<_> = (0..2).map(|_| scope.spawn(solve)).collect();
            for run in runs {
                assert_eq!(run.join().expect("no panic"), reference);
            }
        });
    }
}
