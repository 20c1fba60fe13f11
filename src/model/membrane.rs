//! The `rubber` membrane: a cylinder of hyperelastic triangles bonded to the plates.
//!
//! Its free nodes are unknowns like the bodies, and stand behind them wherever positions are listed:
//! a node is a pose that never turns. The nodes of the two rims are glued to the plates, and turn
//! with them. The cell pressure acts through a [`PressureCover`] on the same nodes, from outside on the
//! closed surface of membrane and plates.
//!
//! The surface is the membrane's middle. Inside it lie the specimen and half of the rubber, whose volume does
//! not change.
//!
//! Source of the mechanics: [`crate::element::membrane`], [`crate::material::rubber`]. Units SI; tension
//! positive.

use crate::contact::{ContactLaw, MembraneContactLaw};
use crate::element::MembraneTriangle;
use crate::error::{Error, Result};
use crate::material::{Rubber, SheetState, Wrinkling};
use crate::mesh::CylinderMesh;
use crate::model::PressureCover;
use crate::model::cover::CoverNode;
use crate::tensor::{Mat3, Pose, Vec3, Vector6};

/// Share of a flat sheet's stiffness that wrinkles keep: enough to hold slack rubber in place, and a
/// thousandth of what the sheet carries when taut.
const WRINKLE_SUPPORT: f64 = 1e-3;
/// Overlap with a grain under the node's share of the pressure, over the thickness.
const OVERLAP: f64 = 0.01;
/// Share of a membrane edge over which its contacts fade in.
const EDGE_FADE: f64 = 0.25;

/// What a membrane is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MembraneParameters {
    pub rubber: Rubber,
    /// Unstrained [m]. On bodies it stays so: the middle is half of that off, and hands on what the pressure does on that larger surface.
    pub thickness: f64,
    /// Edge length of the triangles [m].
    pub mesh_size: f64,
    /// The largest pressure it is to carry [Pa]; it sets the stiffness of its contacts.
    pub pressure: f64,
}

/// Where the membrane is fastened: a plate, its pose, and the height of its inner face [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fastening {
    pub body: usize,
    pub pose: Pose,
    pub height: f64,
}

/// How much of the membrane is in which state, and its largest stretch.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MembraneMeasures {
    /// Shares of the triangles.
    pub taut: f64,
    pub wrinkled: f64,
    pub slack: f64,
    pub largest_stretch: f64,
}

/// A membrane; only its nodes move.
#[derive(Debug, Clone)]
pub struct Membrane {
    /// Carrier and point of each node: a free node carries itself.
    pub nodes: Vec<CoverNode>,
    pub facets: Vec<[usize; 3]>,
    pub edges: Vec<[usize; 2]>,
    pub parameters: MembraneParameters,
    pub contact: MembraneContactLaw,
    elements: Vec<MembraneTriangle>,
    wrinkling: Wrinkling,
    /// First carrier that is a node of the membrane: the number of bodies.
    first: usize,
    /// Free nodes.
    free: usize,
    /// The plates that the rims are glued to.
    fastened: [usize; 2],
    /// Volume of the rubber [m^3].
    volume: f64,
}

impl Membrane {
    /// A membrane whose unstrained radius is `unstrained` [m], stretched to stand at `radius` [m], the middle
    /// of its thickness, between two plates. `first` is the number of bodies; `law` that of the grains'
    /// contacts. Also its cover, and the poses of its free nodes.
    ///
    /// # Errors
    /// [`Error::Mesh`] where the mesh or the sheet is impossible.
    pub fn new(
        parameters: &MembraneParameters,
        unstrained: f64,
        radius: f64,
        fastenings: &[Fastening; 2],
        first: usize,
        law: &ContactLaw,
    ) -> Result<(Self, PressureCover, Vec<Pose>)> {
        let [bottom, top] = fastenings;
        let mesh = CylinderMesh::new(unstrained, bottom.height, top.height, parameters.mesh_size)?;
        let widen = radius / unstrained;
        let placed = |x: &Vec3| Vec3::new(widen * x.x, widen * x.y, x.z);
        let (mut nodes, mut poses) = (Vec::with_capacity(mesh.nodes.len()), Vec::new());
        let [low, _] = mesh.rims();
        for (index, x) in mesh.nodes.iter().enumerate() {
            if mesh.is_rim(index) {
                let plate = if low.contains(&index) { bottom } else { top };
                nodes.push(CoverNode { body: plate.body, point: plate.pose.to_body(&placed(x)) });
            } else {
                nodes.push(CoverNode { body: first + poses.len(), point: Vec3::zeros() });
                poses.push(Pose { position: placed(x), ..Pose::identity() });
            }
        }
        let elements: Vec<MembraneTriangle> = mesh
            .facets
            .iter()
            .map(|f| MembraneTriangle::new(&f.map(|n| mesh.nodes[n]), parameters.thickness))
            .collect::<Option<_>>()
            .ok_or_else(|| Error::Mesh {
                name: "membrane".into(),
                message: format!("a thickness of {} m makes no sheet", parameters.thickness),
            })?;
        let volume: f64 = elements.iter().map(MembraneTriangle::volume).sum();
        let overlap = OVERLAP * parameters.thickness;
        let contact = MembraneContactLaw {
            law: ContactLaw { onset: overlap, ..*law },
            stiffness: parameters.pressure * volume
                / parameters.thickness
                / mesh.nodes.len() as f64
                / overlap,
            edge_fade: EDGE_FADE,
        };
        let cover = PressureCover::on_cylinder(&nodes, &mesh)?;
        let membrane = Membrane {
            nodes,
            edges: mesh.edges(),
            facets: mesh.facets,
            parameters: *parameters,
            contact,
            elements,
            wrinkling: Wrinkling::Free { support: WRINKLE_SUPPORT },
            first,
            free: poses.len(),
            fastened: [bottom.body, top.body],
            volume,
        };
        Ok((membrane, cover, poses))
    }

    /// Has the free nodes stand behind so many bodies.
    pub(super) fn stand_behind(&mut self, bodies: usize) {
        let free = self.nodes.iter_mut().filter(|node| node.body >= self.first);
        free.for_each(|node| node.body = node.body - self.first + bodies);
        self.first = bodies;
    }

    /// How many nodes are free.
    pub const fn free_nodes(&self) -> usize {
        self.free
    }

    /// Whether nodes are glued to a body.
    pub fn holds(&self, body: usize) -> bool {
        self.fastened.contains(&body)
    }

    /// Whether a node is glued to a plate.
    pub fn is_glued(&self, node: usize) -> bool {
        self.nodes[node].body < self.first
    }

    /// Radius of the rounding: half the thickness [m].
    pub fn rounding(&self) -> f64 {
        0.5 * self.parameters.thickness
    }

    /// A node's share of a pressure [Pa]: on its part of the unstrained area [N].
    pub fn node_load(&self, pressure: f64) -> f64 {
        pressure * self.volume / self.parameters.thickness / self.nodes.len() as f64
    }

    /// Volume of the rubber [m^3].
    pub fn rubber_volume(&self) -> f64 {
        self.volume
    }

    /// Where every node is [m].
    pub fn positions_into(&self, positions: &mut Vec<Vec3>, poses: &[Pose]) {
        positions.clear();
        positions.extend(self.nodes.iter().map(|node| poses[node.body].to_space(&node.point)));
    }

    /// A carrier of a triangle that is stretched beyond what its rubber can be ([`crate::material::RubberLaw::Gent`]): a place that no step may lead
    /// to, since no force leads back from it.
    pub fn torn(&self, positions: &[Vec3]) -> Option<usize> {
        if !self.parameters.rubber.has_limit() {
            return None;
        }
        let is_torn = |(facet, element): &(&[usize; 3], &MembraneTriangle)| {
            let at = element.forces(&facet.map(|n| positions[n]), &self.parameters.rubber, self.wrinkling);
            !at.energy.is_finite()
        };
        let (facet, _) = self.facets.iter().zip(&self.elements).find(is_torn)?;
        Some(self.nodes[facet[0]].body)
    }

    /// Energy stored in the sheet [J].
    pub fn energy(&self, positions: &[Vec3]) -> f64 {
        let energy = |(facet, element): (&[usize; 3], &MembraneTriangle)| {
            element.forces(&facet.map(|n| positions[n]), &self.parameters.rubber, self.wrinkling).energy
        };
        self.facets.iter().zip(&self.elements).map(energy).sum()
    }

    /// Adds the sheet's forces to `wrenches`, one per carrier: force [N] and moment about its position [N m].
    pub fn forces_into(&self, wrenches: &mut [Vector6<f64>], positions: &[Vec3], poses: &[Pose]) {
        for (facet, element) in self.facets.iter().zip(&self.elements) {
            let x = facet.map(|n| positions[n]);
            let at = element.forces(&x, &self.parameters.rubber, self.wrinkling);
            for (k, &node) in facet.iter().enumerate() {
                let carrier = self.nodes[node].body;
                let moment = (x[k] - poses[carrier].position).cross(&at.forces[k]);
                for c in 0..3 {
                    wrenches[carrier][c] += at.forces[k][c];
                    wrenches[carrier][3 + c] += moment[c];
                }
            }
        }
    }

    /// Adds the sheet's forces on its nodes [N].
    pub fn node_forces_into(&self, forces: &mut [Vec3], positions: &[Vec3]) {
        for (facet, element) in self.facets.iter().zip(&self.elements) {
            let x = facet.map(|n| positions[n]);
            let at = element.forces(&x, &self.parameters.rubber, self.wrinkling);
            for (&node, force) in facet.iter().zip(&at.forces) {
                forces[node] += force;
            }
        }
    }

    /// Calls `block(i, j, &K)` with the stiffness between nodes i and j [N/m].
    pub fn for_each_stiffness_block(&self, positions: &[Vec3], mut block: impl FnMut(usize, usize, &Mat3)) {
        for (facet, element) in self.facets.iter().zip(&self.elements) {
            let x = facet.map(|n| positions[n]);
            let stiffness = element.stiffness(&x, &self.parameters.rubber, self.wrinkling);
            for (i, row) in stiffness.iter().enumerate() {
                for (j, entry) in row.iter().enumerate() {
                    block(facet[i], facet[j], entry);
                }
            }
        }
    }

    pub fn measures(&self, positions: &[Vec3]) -> MembraneMeasures {
        let mut measures = MembraneMeasures::default();
        let share = 1.0 / self.facets.len() as f64;
        for (facet, element) in self.facets.iter().zip(&self.elements) {
            let x = facet.map(|n| positions[n]);
            match element.forces(&x, &self.parameters.rubber, self.wrinkling).state {
                SheetState::Taut => measures.taut += share,
                SheetState::Wrinkled => measures.wrinkled += share,
                SheetState::Slack => measures.slack += share,
            }
            measures.largest_stretch = measures.largest_stretch.max(element.stretches(&x)[0]);
        }
        measures
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::RubberLaw;
    use crate::tensor::Rotation;

    #[test]
    fn only_rubber_with_a_limit_tears() {
        let at = |body: usize, height: f64| {
            let pose = Pose::new(Vec3::new(0.0, 0.0, height), Rotation::identity());
            Fastening { body, pose, height }
        };
        let fastenings = [at(0, 0.0), at(1, 0.1)];
        let torn = |law: RubberLaw, widened: f64| {
            let rubber = Rubber::new(1e6, law).expect("allowed");
            let (thickness, mesh_size) = (2e-3, 0.02);
            let parameters = MembraneParameters { rubber, thickness, mesh_size, pressure: 1e5 };
            let made = Membrane::new(&parameters, 0.05, 0.05, &fastenings, 2, &ContactLaw::SAMPLE);
            let (membrane, _, nodes) = made.expect("a membrane");
            let mut poses: Vec<Pose> = fastenings.iter().map(|fastening| fastening.pose).collect();
            poses.extend(nodes);
            let mut positions = Vec::new();
            membrane.positions_into(&mut positions, &poses);
            positions.iter_mut().for_each(|x| *x *= widened);
            membrane.torn(&positions)
        };
        // Twice as long both ways, I1 - 3 = 4 + 4 + 1/16 - 3 = 5.06.
        assert_eq!(torn(RubberLaw::NeoHookean, 2.0), None);
        assert_eq!(torn(RubberLaw::Gent { limit: 6.0 }, 2.0), None);
        assert!(torn(RubberLaw::Gent { limit: 5.0 }, 2.0).is_some());
    }
}
