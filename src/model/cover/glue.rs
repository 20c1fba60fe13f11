//! A cover by what holds its nodes, and how rims come to slide.

use std::collections::BTreeSet;

use crate::error::Result;
use crate::model::cover::hold::holds_of;
use crate::model::cover::{CoverNode, Hold, PressureCover};
use crate::tensor::Pose;
use crate::tensor::Vec3;

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
