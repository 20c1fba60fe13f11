//! (being built)

pub mod cover;
