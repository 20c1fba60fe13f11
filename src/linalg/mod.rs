//! Sparse linear algebra: patterns, ordering, factorisations, refactorisation. The only user of faer and sprs.

pub mod cholesky;
pub mod lu;
pub mod ordering;
pub mod symmetric;

pub use cholesky::{FactorError, Factorisation, Refinement, SparseCholesky};
pub use ordering::{NodeGraph, Ordering};
pub use symmetric::{SymmetricMatrix, SymmetricPattern};
