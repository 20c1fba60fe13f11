//! What can go wrong with a factor.

/// Why a factorisation or a solution is not there. Callers cut the step or report; nothing panics.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FactorError {
    #[error("the matrix is not positive definite (pivot {pivot} of the elimination)")]
    NotPositiveDefinite { pivot: usize },
    #[error("{0} holds a value that is not finite")]
    NotFinite(&'static str),
    #[error("expected {expected} entries, found {found}")]
    Size { expected: usize, found: usize },
    #[error("there is no numeric factor yet, or the last factorisation failed")]
    NotFactorised,
    #[error("the ordering does not belong to the pattern, or METIS failed with status {0}")]
    Ordering(i32),
    #[error("not enough memory for the factor")]
    OutOfMemory,
}
