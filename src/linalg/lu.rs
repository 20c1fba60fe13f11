//! Unsymmetric systems: their patterns, and why one could not be solved.

/// Why a linear system could not be solved.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SolveFailure {
    #[error("the matrix is structurally or numerically singular")]
    Singular,
    #[error("the solution is not finite")]
    NotFinite,
    /// What the best solution leaves of the right side, over its norm.
    #[error("the solution leaves {0:.1e} of the right side")]
    Inaccurate(f64),
    #[error("out of memory")]
    OutOfMemory,
}

impl SolveFailure {
    /// Of a solution that leaves so much of the right side, over its norm.
    pub const fn of_residual(left: f64) -> Self {
        if left.is_finite() { SolveFailure::Inaccurate(left) } else { SolveFailure::NotFinite }
    }
}

/// A square sparsity pattern, column by column, rows ascending.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pattern {
    pub size: usize,
    pub column_starts: Vec<usize>,
    pub rows: Vec<usize>,
}
