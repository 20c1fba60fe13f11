//! (being built)

pub mod scene;
