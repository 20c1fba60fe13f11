//! What holds the nodes of a cover: one body, or on a rim that slides a grain along the plate and the plate across it.

use std::collections::{BTreeMap, BTreeSet};

use crate::error::Result;
use crate::model::cover::{CoverNode, PressureCover};
use crate::tensor::{Mat3, Pose, Vec3};

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

impl PressureCover {
    /// What holds node `node`.
    pub fn holds_of(&self, node: usize) -> impl Iterator<Item = Hold> + use<> {
        holds_of(&self.nodes, &self.plates, node)
    }

    /// From the holding body's position to its point [m], in space axes.
    pub(super) fn arm(&self, poses: &[Pose], hold: &Hold) -> Vec3 {
        poses[hold.body].rotation * hold.point
    }

    /// The same cover with rims that slide along their plates: a node of a rim goes with the grain of the nearest node
    /// that the side's facets join the rim to.
    ///
    /// # Errors
    /// As for a new cover; the triangulation stays, so none is expected.
    pub fn sliding(&self, poses: &[Pose]) -> Result<Self> {
        let (mut nodes, mut plates) = (self.nodes.clone(), self.plates.clone());
        for rim in &self.rims {
            let beside = |facet: &&[usize; 3]| facet.iter().any(|node| rim.contains(node));
            let joined = self.side_facets().iter().filter(beside);
            let off_rim =
                joined.flatten().copied().filter(|node| !self.rims.iter().any(|rim| rim.contains(node)));
            let neighbours: BTreeSet<usize> = off_rim.collect();
            for node in rim.clone() {
                let place = self.position(poses, node);
                let distance = |other: &usize| (self.position(poses, *other) - place).norm_squared();
                let nearest = neighbours.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
                if let Some(nearest) = nearest {
                    let body = self.nodes[*nearest].body;
                    plates.entry(node).or_insert(nodes[node]);
                    nodes[node] = CoverNode { body, point: poses[body].to_body(&place) };
                }
            }
        }
        let (side, caps) = self.facets.split_at(self.side_facets);
        Self::closed(nodes, plates, side.to_vec(), caps.to_vec(), self.rims.clone(), self.statistics)
    }
}
