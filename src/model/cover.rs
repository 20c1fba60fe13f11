//! The `pressure` cover: confining pressure on the side of a specimen through a weightless,
//! perfectly flexible cover.
//!
//! The cover is a closed triangulated surface whose nodes are glued to material points: those of
//! its side to the outermost grains, its two rims to the plates, which close it with flat caps.
//! The enclosed volume V is then a polynomial in the node positions, and the pressure p of the
//! cell fluid outside has the potential p V. So everything follows from V:
//!
//! - load on a node `f = -p dV/dx`, inwards, one third of `p` times area from each facet beside it;
//! - work over any path `-p (V1 - V0)` at constant p;
//! - tangent `-p d2V/dx2`, symmetric, between neighbouring nodes only.
//!
//! The surface is closed, so the loads have no resultant and no moment as a whole: the resultant
//! on any group of bodies is p times the projected area of the cover that they carry. (Follower
//! pressure with a closed volume: Schweizerhof & Ramm 1984, Computers & Structures 18:1099.)
//!
//! What it leaves out: a cover has no stiffness, so where it spans a pore its facets stay flat and
//! hand their load to the grains at their corners; a grain's own elastic strain moves no node.
//! Glued points go with their grain: after large rearrangements drape a new cover
//! ([`PressureCover::drape`]) and look at [`PressureCover::inward_facets`]. A new cover
//! encloses a slightly different V, so work is summed cover by cover.
//!
//! How deep the cover follows the pores is a choice ([`PressureCover::drape`]'s `pore_depth`), and
//! it sets the specimen's cross-section. Compacted packings of 150 and of 500 grains of 20 to 60 mm, in
//! parts of the compaction wall's area: V/H = 0.87, 0.85, 0.83, 0.81 and 0.91, 0.90, 0.88, 0.87 at pore depths
//! of 10, 15, 20 and 30 mm, whereas node spacings of 8, 12 and 18 mm agree within 0.01. So stresses belong to the
//! cover's own V/H, not to the nominal one.
//!
//! Rims. One that is bonded to its plate hands it a share of the pressure. Where that share has a sideways resultant, so has what
//! is left to the grains, and only friction on the plates holds them. On plates without friction rims therefore slide ([`PressureCover::sliding`]): along the plate a node of the rim goes with
//! the grain beside it, across the plate with the plate. All sideways pressure then acts on grains, and since the caps
//! are level it has no sideways resultant and no moment about the axis.
//!
//! Units: m, Pa, N, J. p > 0 presses inwards. The specimen's axis is z.

mod bridging;
mod drape;
mod glue;
mod hold;
mod outline;
mod stored;

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::Matrix6;

use crate::element::pressure_facet;
use crate::error::{Error, Result};
use crate::mesh::CylinderMesh;
use crate::tensor::{Mat3, Pose, Vec3, Vector6};

pub use hold::{Axes, CoverNode, Hold};
pub use outline::{DrapeStatistics, Outline, Rim};
pub use stored::StoredCover;

/// An edge between the nodes of `holds[0]` and `holds[1]`; `beyond[0]` is the third node of the facet that
/// runs along it, `beyond[1]` that of the facet that runs against it.
#[derive(Debug, Clone, Copy)]
struct CoverEdge {
    holds: [Hold; 2],
    beyond: [usize; 2],
}

/// What couples two bodies (or a body to itself) in the tangent.
#[derive(Debug, Clone)]
struct Coupling {
    bodies: [usize; 2],
    /// Range in `PressureCover::edges`; first hold by `bodies[0]`, second by `bodies[1]`.
    edges: Range<usize>,
    /// Range in `PressureCover::corners`, empty unless the two bodies are one.
    corners: Range<usize>,
}

/// A closed flexible surface glued to bodies, loaded by a pressure from outside.
#[derive(Debug, Clone)]
pub struct PressureCover {
    nodes: Vec<CoverNode>,
    /// Point of the plate that holds a node's height, by node, where its rim slides.
    plates: BTreeMap<usize, CoverNode>,
    /// Counter-clockwise seen from outside: the side first, then the caps.
    facets: Vec<[usize; 3]>,
    side_facets: usize,
    /// First and last node of the bottom and of the top rim.
    rims: [Range<usize>; 2],
    edges: Vec<CoverEdge>,
    /// Facet and what holds a corner of it, sorted by the holding body.
    corners: Vec<(usize, Hold)>,
    couplings: Vec<Coupling>,
    statistics: DrapeStatistics,
}

/// Area times normal of a facet with these corners [m^2].
fn area_vector([a, b, c]: [Vec3; 3]) -> Vec3 {
    0.5 * (b - a).cross(&(c - a))
}

impl PressureCover {
    /// From nodes and a closed triangulation of them: the facets of the side, then those of the
    /// caps, all counter-clockwise seen from outside; `rims` are the nodes of the bottom and top rim.
    ///
    /// # Errors
    /// [`Error::Specimen`] where the surface is not closed or not consistently oriented.
    fn closed(
        nodes: Vec<CoverNode>,
        plates: BTreeMap<usize, CoverNode>,
        side: Vec<[usize; 3]>,
        caps: Vec<[usize; 3]>,
        rims: [Range<usize>; 2],
        statistics: DrapeStatistics,
    ) -> Result<Self> {
        let side_facets = side.len();
        let facets: Vec<[usize; 3]> = side.into_iter().chain(caps).collect();

        // Third node of the facet that runs along each directed edge.
        let mut along = BTreeMap::<[usize; 2], usize>::new();
        for facet in &facets {
            for k in 0..3 {
                let [a, b, c] = [facet[k], facet[(k + 1) % 3], facet[(k + 2) % 3]];
                if along.insert([a, b], c).is_some() {
                    return Err(Error::Specimen(format!("the cover folds onto itself at nodes {a} and {b}")));
                }
            }
        }
        let holds_of = |node: usize| hold::holds_of(&nodes, &plates, node);
        let mut by_pair = BTreeMap::<[usize; 2], (Vec<CoverEdge>, Vec<(usize, Hold)>)>::new();
        for (&[a, b], &beyond) in &along {
            let Some(&against) = along.get(&[b, a]) else {
                return Err(Error::Specimen(format!("the cover is open between nodes {a} and {b}")));
            };
            for first in holds_of(a) {
                for second in holds_of(b) {
                    // Each pair once, with the body of smaller index first.
                    if (first.body, a) < (second.body, b) {
                        let edge = CoverEdge { holds: [first, second], beyond: [beyond, against] };
                        by_pair.entry([first.body, second.body]).or_default().0.push(edge);
                    }
                }
            }
        }
        for (index, facet) in facets.iter().enumerate() {
            for hold in facet.iter().flat_map(|&node| holds_of(node)) {
                by_pair.entry([hold.body, hold.body]).or_default().1.push((index, hold));
            }
        }
        let (mut edges, mut corners, mut couplings) = (vec![], vec![], vec![]);
        for (bodies, (pair_edges, pair_corners)) in by_pair {
            let (first_edge, first_corner) = (edges.len(), corners.len());
            edges.extend(pair_edges);
            corners.extend(pair_corners);
            couplings.push(Coupling {
                bodies,
                edges: first_edge..edges.len(),
                corners: first_corner..corners.len(),
            });
        }
        Ok(PressureCover { nodes, plates, facets, side_facets, rims, edges, corners, couplings, statistics })
    }

    /// A cover on the nodes of a cylinder mesh, its rims closed with flat caps.
    ///
    /// # Errors
    /// [`Error::Specimen`] where the surface is not closed.
    pub fn on_cylinder(nodes: &[CoverNode], mesh: &CylinderMesh) -> Result<Self> {
        let [bottom, top] = mesh.rims();
        let (first, count) = (top.start, mesh.around);
        let caps = (1..count - 1).flat_map(|k| [[0, k + 1, k], [first, first + k, first + k + 1]]).collect();
        let (nodes, side, statistics) = (nodes.to_vec(), mesh.facets.clone(), DrapeStatistics::default());
        Self::closed(nodes, BTreeMap::new(), side, caps, [bottom, top], statistics)
    }

    /// The same surface with each node (by number) where `glue` puts it, body and point [m] in its coordinates. On rims that slide
    /// plates go on holding the heights.
    ///
    /// # Errors
    /// As for a new cover; the triangulation stays, so none is expected.
    pub fn glued_anew(&self, glue: impl Fn(usize) -> (usize, Vec3)) -> Result<Self> {
        let place = |node: usize| {
            let (body, point) = glue(node);
            CoverNode { body, point }
        };
        let nodes = (0..self.nodes.len()).map(place).collect();
        let (side, caps) = self.facets.split_at(self.side_facets);
        let plates = self.plates.clone();
        Self::closed(nodes, plates, side.to_vec(), caps.to_vec(), self.rims.clone(), self.statistics)
    }

    /// What each node is glued to; on rims that slide, a grain, which holds it along the plate only.
    pub fn nodes(&self) -> &[CoverNode] {
        &self.nodes
    }

    /// Facets of the side (without caps), counter-clockwise seen from outside: for output.
    pub fn side_facets(&self) -> &[[usize; 3]] {
        &self.facets[..self.side_facets]
    }

    pub fn statistics(&self) -> &DrapeStatistics {
        &self.statistics
    }

    /// Where node `node` is [m].
    pub fn position(&self, poses: &[Pose], node: usize) -> Vec3 {
        let place = |CoverNode { body, point }: &CoverNode| poses[*body].to_space(point);
        let mut position = place(&self.nodes[node]);
        if let Some(plate) = self.plates.get(&node) {
            position.z = place(plate).z;
        }
        position
    }

    fn corners_of(&self, poses: &[Pose], facet: usize) -> [Vec3; 3] {
        self.facets[facet].map(|node| self.position(poses, node))
    }

    /// Area times outward normal of a facet [m^2].
    fn area_vector(&self, poses: &[Pose], facet: usize) -> Vec3 {
        area_vector(self.corners_of(poses, facet))
    }

    /// Enclosed volume [m^3], pores and grains together.
    pub fn volume(&self, poses: &[Pose]) -> f64 {
        // Any origin gives the same sum; one on the cover keeps the terms small.
        let origin = self.position(poses, 0);
        let of = |facet| pressure_facet::volume(&self.corners_of(poses, facet).map(|x| x - origin));
        (0..self.facets.len()).map(of).sum()
    }

    /// Adds the loads of `pressure` [Pa] to `loads`: per body the force [N] and the moment [N m]
    /// about the body's position.
    ///
    /// On a closed surface a third of each facet's `p` times area to each of its corners
    /// is exactly `-p dV/dx`.
    ///
    /// # Panics
    /// If `loads` or `poses` is shorter than the list of bodies that the cover was draped over.
    pub fn loads_into(&self, loads: &mut [Vector6<f64>], poses: &[Pose], pressure: f64) {
        // Each node is a corner of some six facets.
        let positions: Vec<Vec3> = (0..self.nodes.len()).map(|node| self.position(poses, node)).collect();
        for facet in &self.facets {
            let force = area_vector(facet.map(|node| positions[node])) * (-pressure / 3.0);
            for hold in facet.iter().flat_map(|&node| self.holds_of(node)) {
                let force = hold.axes.of(&force);
                let moment = self.arm(poses, &hold).cross(&force);
                let load = &mut loads[hold.body];
                for k in 0..3 {
                    load[k] += force[k];
                    load[k + 3] += moment[k];
                }
            }
        }
    }

    /// Force [N] of `pressure` [Pa] on each node, added to `forces`.
    pub fn node_forces_into(&self, forces: &mut [Vec3], poses: &[Pose], pressure: f64) {
        for (index, facet) in self.facets.iter().enumerate() {
            let force = self.area_vector(poses, index) * (-pressure / 3.0);
            for &node in facet {
                forces[node] += force;
            }
        }
    }

    /// The bodies `[i, j]`, i ≤ j, between which [`Self::for_each_tangent_block`] has blocks.
    pub fn coupled_bodies(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        self.couplings.iter().map(|coupling| coupling.bodies)
    }

    /// Calls `block(i, j, &K)` with the derivative of the loads on body i with respect to the
    /// motion of body j (translation [m], then rotation vector [rad], in space axes and
    /// about the body's position, as [`Pose::moved`] applies them). A pair of different bodies comes twice,
    /// as (i, j) and (j, i), the one the transpose of the other.
    ///
    /// K is the exact derivative of [`Self::loads_into`]. Its rotation-rotation part on the diagonal has
    /// the skew part `-[m]x / 2`, m being the moment of the load: so has the derivative of every
    /// moment by spatial rotations. It cancels in the sum over all moments on a body in equilibrium.
    /// The symmetric part is the second derivative of `-p V`.
    ///
    /// Bodies that are not `wanted` are left out.
    ///
    /// # Panics
    /// If `poses` is shorter than the list of bodies that the cover was draped over.
    pub fn for_each_tangent_block(
        &self,
        poses: &[Pose],
        pressure: f64,
        wanted: impl Fn(usize, usize) -> bool,
        mut block: impl FnMut(usize, usize, &Matrix6<f64>),
    ) {
        for Coupling { bodies: [i, j], edges, corners } in &self.couplings {
            if !wanted(*i, *j) {
                continue;
            }
            let mut tangent = Matrix6::zeros();
            for edge in &self.edges[edges.clone()] {
                // d2V / dx_a dx_b = [x_against - x_along]x / 6
                let [along, against] = edge.beyond.map(|node| self.position(poses, node));
                let stiffness = (against - along).cross_matrix() * (-pressure / 6.0);
                let stiffness = Axes::between(edge.holds.map(|hold| hold.axes), stiffness);
                let [first, second] = edge.holds.map(|hold| self.arm(poses, &hold).cross_matrix());
                let moment_row = first * stiffness;
                add_at(&mut tangent, [0, 0], &stiffness);
                add_at(&mut tangent, [0, 3], &(-stiffness * second));
                add_at(&mut tangent, [3, 0], &moment_row);
                add_at(&mut tangent, [3, 3], &(-moment_row * second));
            }
            if i == j {
                // Each edge inside a body counts for both of its directions.
                tangent += tangent.transpose();
                let mut turning = Mat3::zeros();
                for (facet, hold) in &self.corners[corners.clone()] {
                    // (theta x r) x f = [f]x [r]x theta = (r f^T - (r.f) I) theta
                    let force = hold.axes.of(&(self.area_vector(poses, *facet) * (-pressure / 3.0)));
                    let arm = self.arm(poses, hold);
                    turning += arm * force.transpose() - Mat3::from_diagonal_element(arm.dot(&force));
                }
                add_at(&mut tangent, [3, 3], &turning);
                block(*i, *i, &tangent);
            } else {
                block(*i, *j, &tangent);
                block(*j, *i, &tangent.transpose());
            }
        }
    }

    /// Mean distance of the two rims along z [m].
    pub fn height(&self, poses: &[Pose]) -> f64 {
        let [bottom, top] = self.rim_heights(poses);
        top - bottom
    }

    fn rim_heights(&self, poses: &[Pose]) -> [f64; 2] {
        self.rims.clone().map(|rim| {
            let count = rim.len() as f64;
            rim.map(|node| self.position(poses, node).z).sum::<f64>() / count
        })
    }

    /// Cross-sections [m^2] at the middles of `areas.len()` slices of equal height, from the
    /// bottom. The radius of a slice is `sqrt(area / pi)`.
    pub fn section_areas_into(&self, areas: &mut [f64], poses: &[Pose]) {
        let [bottom, top] = self.rim_heights(poses);
        let count = areas.len() as f64;
        let centre = self.position(poses, 0);
        areas.fill(0.0);
        for facet in 0..self.facets.len() {
            let corners = self.corners_of(poses, facet);
            for (slice, area) in areas.iter_mut().enumerate() {
                let z = bottom + (top - bottom) * (slice as f64 + 0.5) / count;
                if let Some([p, q]) = section(&corners, z) {
                    // Green: half the sum of p x q over the closed outline, in any order.
                    let (p, q) = (p - centre, q - centre);
                    *area += 0.5 * (p.x * q.y - p.y * q.x);
                }
            }
        }
    }

    /// How many facets of the side face the axis: none on a cover just draped, some where grains
    /// have folded it since.
    pub fn inward_facets(&self, poses: &[Pose]) -> usize {
        let [bottom, top] = self.rims.clone().map(|rim| {
            let count = rim.len() as f64;
            rim.map(|node| self.position(poses, node)).sum::<Vec3>() / count
        });
        let faces_inwards = |&facet: &usize| {
            let [a, b, c] = self.corners_of(poses, facet);
            let middle = (a + b + c) / 3.0;
            let axis = bottom + (top - bottom) * ((middle.z - bottom.z) / (top.z - bottom.z));
            let outwards = middle - axis;
            let normal = (b - a).cross(&(c - a));
            normal.x * outwards.x + normal.y * outwards.y < 0.0
        };
        (0..self.side_facets).filter(faces_inwards).count()
    }
}

/// Where the plane at height `z` cuts a triangle, directed so that the inside lies on the left.
/// A corner exactly on the plane counts as above it.
fn section(corners: &[Vec3; 3], z: f64) -> Option<[Vec3; 2]> {
    let above = corners.map(|x| x.z >= z);
    let lone = (0..3).find(|&k| above[k] != above[(k + 1) % 3] && above[k] != above[(k + 2) % 3])?;
    let cut = |other: usize| {
        let (a, b) = (corners[lone], corners[other % 3]);
        a + (b - a) * ((z - a.z) / (b.z - a.z))
    };
    let (next, previous) = (cut(lone + 1), cut(lone + 2));
    Some(if above[lone] { [next, previous] } else { [previous, next] })
}

fn add_at(tangent: &mut Matrix6<f64>, at: [usize; 2], part: &Mat3) {
    let mut view = tangent.fixed_view_mut::<3, 3>(at[0], at[1]);
    view += part;
}

#[cfg(test)]
mod tests;
