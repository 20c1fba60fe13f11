//! What holds the nodes of a cover: one body, or on a rim that slides a grain along the plate and the plate across it.

use std::collections::BTreeMap;

use crate::tensor::{Mat3, Vec3};

/// A node of the cover: a material point of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoverNode {
    /// Index of the body in the model's list of poses.
    pub body: usize,
    /// The glued point in body coordinates [m].
    pub point: Vec3,
}

/// Directions in which a body holds a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axes {
    All,
    /// x and y.
    Level,
    /// z.
    Upright,
}

/// One body's hold on a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hold {
    pub node: usize,
    /// Index of the body in the model's list of poses.
    pub body: usize,
    /// The held point in body coordinates [m].
    pub point: Vec3,
    pub axes: Axes,
}

impl Axes {
    /// The part of a force on the node that the body takes.
    pub fn of(self, force: &Vec3) -> Vec3 {
        match self {
            Axes::All => *force,
            Axes::Level => Vec3::new(force.x, force.y, 0.0),
            Axes::Upright => Vec3::new(0.0, 0.0, force.z),
        }
    }

    /// The part of a stiffness between two nodes that acts between the bodies which hold them so.
    pub(super) fn between([rows, columns]: [Axes; 2], stiffness: Mat3) -> Mat3 {
        let taken = |axes: Axes, k: usize| match axes {
            Axes::All => true,
            Axes::Level => k < 2,
            Axes::Upright => k == 2,
        };
        Mat3::from_fn(|i, j| if taken(rows, i) && taken(columns, j) { stiffness[(i, j)] } else { 0.0 })
    }
}

/// The holds on a node: of what it is glued to, and of the plate.
pub(super) fn holds_of(
    nodes: &[CoverNode],
    plates: &BTreeMap<usize, CoverNode>,
    node: usize,
) -> impl Iterator<Item = Hold> + use<> {
    let hold = |by: CoverNode, axes: Axes| Hold { node, body: by.body, point: by.point, axes };
    let (glued, plate) = (nodes[node], plates.get(&node).copied());
    let along = hold(glued, if plate.is_some() { Axes::Level } else { Axes::All });
    std::iter::once(along).chain(plate.map(|plate| hold(plate, Axes::Upright)))
}
