//! Sparse linear algebra: patterns, ordering, factorisations, refactorisation. The only user of faer and sprs.

pub mod lu;
