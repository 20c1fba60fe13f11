//! Sparse linear algebra: patterns, ordering, factorisations, refactorisation. The only user of faer and sprs.

pub mod cholesky;
pub mod conjugate_gradients;
mod fault;
pub mod gmres;
pub mod lu;
pub mod multifrontal;
pub mod ordering;
pub mod symmetric;

pub use cholesky::SparseCholesky;
pub use conjugate_gradients::conjugate_gradients;
pub use fault::FactorError;
pub use gmres::gmres;
pub use multifrontal::MultifrontalLu;
pub use ordering::{NodeGraph, Ordering};
pub use symmetric::{SymmetricMatrix, SymmetricPattern};

/// Makes every factorisation of this process run on the thread that asks for it. Work is divided
/// among grains and contacts instead, so that sums are taken in one order on any number of threads.
pub fn factorise_sequentially() {
    faer::set_global_parallelism(faer::Par::Seq);
}

/// 2-norm, summed in order.
pub fn norm(x: &[f64]) -> f64 {
    x.iter().map(|v| v * v).sum::<f64>().sqrt()
}
