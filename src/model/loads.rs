//! What is prescribed and what is applied in an increment.

use crate::tensor::{Vec3, Vector6};
use serde::{Deserialize, Serialize};

/// Boundary conditions at the end of an increment. Components are translations along x, y, z,
/// then rotations about x, y, z, in space axes about the body's reference point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Loads {
    /// Components whose motion is prescribed (the pose says to what), per carrier.
    pub prescribed: Vec<[bool; 6]>,
    /// Applied force and moment per body [N, N m].
    #[serde(with = "crate::tensor::stored")]
    pub applied: Vec<Vector6<f64>>,
    /// [m/s^2]
    #[serde(with = "crate::tensor::stored")]
    pub gravity: Vec3,
    /// Pressure on the cover [Pa], where the model has one.
    pub pressure: f64,
    /// Loads whose size is found with the motion, on top of the others.
    #[serde(skip)]
    pub control: Option<Control>,
}

/// Loads in proportion to an unknown factor, which is such that a scalar meets its target.
#[derive(Debug, Clone, PartialEq)]
pub struct Control {
    /// Pressure on the cover per unit of the factor.
    pub pressure: f64,
    /// Applied force and moment per unit of the factor, with their bodies.
    pub applied: Vec<(usize, Vector6<f64>)>,
    pub of: Controlled,
    /// Value of the scalar to reach, and by how much it may be missed.
    pub target: f64,
    pub tolerance: f64,
    /// The factor to start from.
    pub guess: f64,
}

/// A scalar of the configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Controlled {
    /// Enclosed by the cover [m^3].
    Volume,
    /// A coordinate of a body's reference point [m]; its motion must be free.
    Position { body: usize, axis: usize },
}

impl Loads {
    /// Lets `nodes` nodes of a membrane, which stand behind the bodies, move and not turn.
    pub fn free_nodes(&mut self, nodes: usize) {
        let behind = std::iter::repeat_n([false, false, false, true, true, true], nodes);
        self.prescribed.extend(behind);
    }

    /// Lets the radius of a wall, which stands behind the bodies, move and nothing else of it.
    pub fn free_radius(&mut self) {
        self.prescribed.push([false, true, true, true, true, true]);
    }

    /// Nothing prescribed, nothing applied.
    pub fn none(bodies: usize) -> Self {
        Loads {
            prescribed: vec![[false; 6]; bodies],
            applied: vec![Vector6::zeros(); bodies],
            gravity: Vec3::zeros(),
            pressure: 0.0,
            control: None,
        }
    }
}
