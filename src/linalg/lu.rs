//! Unsymmetric systems: their patterns, and why one could not be solved.

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
