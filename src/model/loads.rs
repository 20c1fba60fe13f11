//! What is prescribed and what is applied in an increment.

use crate::tensor::{Vec3, Vector6};
use serde::{Deserialize, Serialize};

/// Boundary conditions at the end of an increment. Components are translations along x, y, z,
/// then rotations about x, y, z, in space axes about the body's reference point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Loads {
    /// Components whose motion is prescribed (the pose says to what), per body.
    pub prescribed: Vec<[bool; 6]>,
    /// Applied force and moment per body [N, N m].
    #[serde(with = "crate::tensor::stored")]
    pub applied: Vec<Vector6<f64>>,
    /// [m/s^2]
    #[serde(with = "crate::tensor::stored")]
    pub gravity: Vec3,
    /// Pressure on the cover [Pa], where the model has one.
    pub pressure: f64,
}

impl Loads {
    /// Nothing prescribed, nothing applied.
    pub fn none(bodies: usize) -> Self {
        Loads {
            prescribed: vec![[false; 6]; bodies],
            applied: vec![Vector6::zeros(); bodies],
            gravity: Vec3::zeros(),
            pressure: 0.0,
        }
    }
}
