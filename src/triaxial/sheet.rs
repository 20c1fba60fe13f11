//! The rubber sheet that a membrane is cut from.

use crate::material::Rubber;

/// A rubber membrane as the case asks for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RubberSheet {
    pub rubber: Rubber,
    /// Unstrained [m].
    pub thickness: f64,
    /// Edge length of the triangles [m]; `None`: `MESH_SIZE` of the median grain.
    pub mesh_size: Option<f64>,
    /// Largest pressure of the test [Pa].
    pub pressure: f64,
}
