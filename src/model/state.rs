//! The committed state: what the last accepted increment left.

use crate::contact::Memory;
use crate::tensor::{Pose, Vec3, Vector6};
use serde::{Deserialize, Serialize};

/// Poses and contact memory of the last accepted increment. A rejected trial leaves no trace here.
/// Poses are those of all carriers: the bodies, then the free nodes of the membrane, or the wall.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Committed {
    pub poses: Vec<Pose>,
    pub memory: Memory,
    /// Displacement of the nodes of every body in its own frame [m], of a condensed one those of its surface; empty for a rigid body, or nothing at
    /// all before the first increment.
    #[serde(with = "crate::tensor::stored")]
    pub fields: Vec<Vec<Vec3>>,
    /// Forces and moments on each carrier, but for those applied from outside [N, N m]; empty where they are not known.
    #[serde(with = "crate::tensor::stored")]
    pub forces: Vec<Vector6<f64>>,
    /// Pressure on what covers the side [Pa]; `None` where it is that of the next increment.
    pub pressure: Option<f64>,
}

impl Committed {
    pub fn new(poses: Vec<Pose>) -> Self {
        Committed { poses, memory: Memory::new(), fields: Vec::new(), forces: Vec::new(), pressure: None }
    }
}

/// Work done, for the history and the log.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    pub augmentations: usize,
    pub newton_iterations: usize,
    pub factorisations: usize,
    /// Steps of dynamic relaxations (`solver::dynamic_relaxation`).
    pub relaxation_steps: usize,
    pub searches: usize,
    pub cuts: usize,
}

impl Counters {
    pub fn add(&mut self, other: &Counters) {
        self.augmentations += other.augmentations;
        self.newton_iterations += other.newton_iterations;
        self.factorisations += other.factorisations;
        self.relaxation_steps += other.relaxation_steps;
        self.searches += other.searches;
        self.cuts += other.cuts;
    }
}
