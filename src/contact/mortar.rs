//! The contact of two faces of which at least one is meshed, by dual mortar functions.
//!
//! The patch that the faces share is cut into triangles. Each of their nodes `k` carries a force that is spread over the triangles around it
//! by the dual function `phi_k`, and feels the mean of the displacements under the same function: for node `i` of either mesh,
//! `s_i = integral of phi_k N_i / integral of phi_k`, with the shape functions `N_i` of its facets (Wohlmuth 2000, SIAM J. Numer. Anal. 38:989).
//! Over what both meshes cover of a triangle `phi = D M^-1 l`, with the area coordinates `l`, `M = integral of l l^T` and `D` the diagonal of
//! the integrals of `l` (of a whole triangle `phi_0 = 3 l_0 - l_1 - l_2`); so the integral of `phi_k l_j` vanishes but for `j = k`. Therefore
//!
//! - the resultant of a node's force acts at the node: a patch bears what it is pressed by as far as its corners;
//! - equal pressures at all nodes are a uniform pressure, however the meshes lie on each other.
//!
//! The triangles are cut along both meshes, and a rule of degree 4 makes the integrals exact where facets are straight.
//!
//! A patch has a quarter as many nodes as the coarser mesh has facets there, and at least its corners and one inside: a pile of twelve
//! polyhedra is the same to 1e-3 with twice or half as many. Each costs three unknowns of a condensed body.
//!
//! Nodes are fixed to the second body. They are found once and stay until the faces have slid by [`SLID`]; what they
//! remember then goes to the nearest of the new ones.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::contact::face::Face;
use crate::contact::features::Feature;
use crate::contact::point_memory::PointMemory;
use crate::geometry::planar::{self, common_part};
use crate::grain::{Surface, SurfacePoint};
use crate::tensor::{Mat3, Pose, Vec3};

/// How far a face may slide over another before the nodes are found anew, over the smaller rounding.
pub const SLID: f64 = 1e-2;

/// Facets within this of a face, over the body's size, lie on it.
const ON_FACE: f64 = 1e-4;
/// Segments below this share of the face's area are rounding, and so are corners of a patch nearer to each other than its root.
const LEAST_SEGMENT: f64 = 1e-12;

/// What is missing of a triangle that counts as wholly covered, over its area.
const COVERED: f64 = 1e-9;

/// Facets of the coarser mesh to a node.
const FACETS: f64 = 4.0;

/// Area coordinates and weights of a rule that is exact to degree 4 on a triangle (Strang & Fix 1973), by orbits of three points.
const RULE: [([f64; 2], f64); 2] = [
    ([0.445_948_490_915_965, 0.108_103_018_168_070], 0.223_381_589_678_011),
    ([0.091_576_213_509_771, 0.816_847_572_980_459], 0.109_951_743_655_322),
];

/// The nodes of one patch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mortar {
    /// Of either body, by number.
    pub faces: (u32, u32),
    pub nodes: Vec<MortarNode>,
    /// Corners of the first face in the second one's axes [m] when the nodes were found.
    reference: Vec<[f64; 2]>,
}

/// A node of a patch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MortarNode {
    /// In the second face's axes [m].
    pub at: [f64; 2],
    /// Integral of its dual function [m^2].
    pub area: f64,
    /// How its force goes to the nodes of either body, where that is meshed.
    pub on: [Option<SurfacePoint>; 2],
}

type Polygon = Vec<[f64; 2]>;

impl Mortar {
    /// The nodes of two faces whose bodies are at `poses`; `surfaces` are their meshes, where they have one.
    pub fn new(
        numbers: (u32, u32),
        faces: [&Face; 2],
        poses: [&Pose; 2],
        surfaces: [Option<&Surface>; 2],
    ) -> Self {
        let seen = |p: &Vec3| faces[1].coordinates(&poses[1].to_body(&poses[0].to_space(p)));
        let reference: Polygon = faces[0].ring.iter().map(seen).collect();
        let meshed = |side: usize| -> Vec<[Vec3; 3]> {
            let face = faces[side];
            let offset = face.normal.dot(&face.ring[0]);
            surfaces[side].map_or(vec![], |surface| surface.facets_in(&face.normal, offset, ON_FACE))
        };
        let backwards = |mut polygon: Polygon| {
            polygon.reverse();
            polygon
        };
        let of_facets = |facets: Vec<[Vec3; 3]>, side: usize, ring: &Polygon| -> Vec<Polygon> {
            let flat = |facet: &[Vec3; 3]| -> Polygon {
                let place = |p: &Vec3| if side == 0 { seen(p) } else { faces[1].coordinates(p) };
                facet.iter().map(place).collect()
            };
            if facets.is_empty() { vec![ring.clone()] } else { facets.iter().map(flat).collect() }
        };
        let own_ring: Polygon = faces[1].ring.iter().map(|p| faces[1].coordinates(p)).collect();
        // Seen from outside the second face, what is counter-clockwise on the first runs clockwise.
        let first: Vec<Polygon> = of_facets(meshed(0), 0, &reference).into_iter().map(backwards).collect();
        let second = of_facets(meshed(1), 1, &own_ring);
        let least = LEAST_SEGMENT * faces[1].area;
        let mut segments = Vec::new();
        for a in &first {
            segments.extend(second.iter().filter_map(|b| cut(a, b, least)));
        }
        // Facets per area of the coarser mesh; none where neither is meshed.
        let meshes = [(0, &first), (1, &second)].into_iter().filter(|(side, _)| surfaces[*side].is_some());
        let densities = meshes.map(|(side, facets)| facets.len() as f64 / faces[side].area);
        let density = densities.reduce(f64::min).unwrap_or(0.0);
        let area: f64 = segments.iter().map(|segment| planar::area(segment)).sum();
        let outline = common_part(&backwards(reference.clone()), &own_ring);
        let triangles = Triangles::new(&outline, least.sqrt(), (area * density / FACETS).ceil() as usize);
        let nodes = triangles.nodes(&segments, least, faces, poses, surfaces);
        Mortar { faces: numbers, nodes, reference }
    }

    pub fn feature(&self, node: usize) -> Feature {
        Feature::Faces(self.faces.0, self.faces.1, node as u32)
    }

    /// The node that a feature is.
    pub fn node(&self, feature: Feature) -> Option<&MortarNode> {
        let Feature::Faces(first, second, number) = feature else { return None };
        self.nodes.get(number as usize).filter(|_| self.faces == (first, second))
    }

    /// How far the first face has slid over the second since the nodes were found [m], with the bodies at `poses`.
    pub fn slid(&self, faces: [&Face; 2], poses: [&Pose; 2]) -> f64 {
        let moved = |(p, [x, y]): (&Vec3, &[f64; 2])| {
            let [to_x, to_y] = faces[1].coordinates(&poses[1].to_body(&poses[0].to_space(p)));
            (to_x - x).hypot(to_y - y)
        };
        faces[0].ring.iter().zip(&self.reference).map(moved).fold(0.0, f64::max)
    }

    /// What its nodes remember from those of the `old` ones of the same faces.
    pub fn remember(&self, old: &Mortar, memory: &[PointMemory]) -> Vec<PointMemory> {
        let taken = |(k, node): (usize, &MortarNode)| {
            let away = |other: &MortarNode| (other.at[0] - node.at[0]).hypot(other.at[1] - node.at[1]);
            let nearest =
                (0..old.nodes.len()).min_by(|&i, &j| away(&old.nodes[i]).total_cmp(&away(&old.nodes[j])))?;
            let kept = memory.iter().find(|kept| kept.feature == old.feature(nearest))?;
            let share = node.area / old.nodes[nearest].area;
            Some(PointMemory { feature: self.feature(k), ..kept.of_spring(share) })
        };
        self.nodes.iter().enumerate().filter_map(taken).collect()
    }
}

/// The common part of two convex polygons that run counter-clockwise, where it is larger than `least` [m^2].
fn cut(a: &Polygon, b: &Polygon, least: f64) -> Option<Polygon> {
    let apart = |axis: usize| {
        let range = |polygon: &Polygon| {
            let along = polygon.iter().map(|p| p[axis]);
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        };
        let ((low_a, high_a), (low_b, high_b)) = (range(a), range(b));
        low_a >= high_b || low_b >= high_a
    };
    if apart(0) || apart(1) {
        return None;
    }
    let common = common_part(a, b);
    (planar::area(&common) > least).then_some(common)
}

/// Integrals of a node's dual function.
#[derive(Clone, Default)]
struct Dual {
    /// [m^2]
    area: f64,
    /// Times the shape functions of either mesh, by its nodes [m^2].
    shares: [BTreeMap<u32, f64>; 2],
}

/// A convex polygon cut into triangles.
struct Triangles {
    nodes: Vec<[f64; 2]>,
    /// Counter-clockwise.
    corners: Vec<[usize; 3]>,
}

impl Triangles {
    /// Around the centre, then halved along the longest edge until there are `wanted` nodes. Corners nearer than `short` [m] are one.
    fn new(outline: &Polygon, short: f64, wanted: usize) -> Self {
        let mut nodes: Polygon = Vec::new();
        let apart = |p: &[f64; 2], q: &[f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]) > short;
        for corner in outline {
            if nodes.iter().all(|node| apart(node, corner)) {
                nodes.push(*corner);
            }
        }
        let count = nodes.len();
        if count < 3 {
            return Triangles { nodes: vec![], corners: vec![] };
        }
        nodes.push([0, 1].map(|axis| nodes.iter().map(|p| p[axis]).sum::<f64>() / count as f64));
        let corners = (0..count).map(|k| [k, (k + 1) % count, count]).collect();
        let mut triangles = Triangles { nodes, corners };
        while triangles.nodes.len() < wanted {
            triangles.halve();
        }
        triangles
    }

    /// Puts a node into the middle of the longest edge. It is the longest of both triangles that share it, so that none gets flatter.
    fn halve(&mut self) {
        let length = |[i, j]: [usize; 2]| {
            let [p, q] = [self.nodes[i], self.nodes[j]];
            (p[0] - q[0]).hypot(p[1] - q[1])
        };
        let edges = self.corners.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
        let Some(longest) = edges.reduce(|best, edge| if length(edge) > length(best) { edge } else { best })
        else {
            return;
        };
        let middle = self.nodes.len();
        let [p, q] = longest.map(|k| self.nodes[k]);
        self.nodes.push([0, 1].map(|axis| 0.5 * (p[axis] + q[axis])));
        for triangle in 0..self.corners.len() {
            let corners = self.corners[triangle];
            let has = |k: usize| corners.iter().position(|corner| *corner == k);
            if let (Some(i), Some(j)) = (has(longest[0]), has(longest[1])) {
                let with = |slot: usize| {
                    let mut half = corners;
                    half[slot] = middle;
                    half
                };
                self.corners[triangle] = with(i);
                self.corners.push(with(j));
            }
        }
    }

    /// The nodes with their dual functions over these segments, on which the shape functions of both meshes are smooth.
    fn nodes(
        &self,
        segments: &[Polygon],
        least: f64,
        faces: [&Face; 2],
        poses: [&Pose; 2],
        surfaces: [Option<&Surface>; 2],
    ) -> Vec<MortarNode> {
        let seen = |side: usize, at: [f64; 2]| {
            let here = faces[1].point(at);
            if side == 1 { here } else { poses[0].to_body(&poses[1].to_space(&here)) }
        };
        let mut duals = vec![Dual::default(); self.nodes.len()];
        for corners in &self.corners {
            let triangle: Polygon = corners.iter().map(|k| self.nodes[*k]).collect();
            let parts: Vec<Polygon> =
                segments.iter().filter_map(|segment| cut(segment, &triangle, least)).collect();
            let Some(of_coordinates) = dual_functions(&triangle, &parts) else { continue };
            for part in &parts {
                each_point(part, |at, weight| {
                    let dual = of_coordinates * Vec3::from(area_coordinates(&triangle, at)) * weight;
                    let dual: [f64; 3] = dual.into();
                    corners.iter().zip(dual).for_each(|(node, dual)| duals[*node].area += dual);
                    for side in [0, 1] {
                        let Some(surface) = surfaces[side] else { continue };
                        for (of_mesh, shape) in surface.locate(&seen(side, at)).shares {
                            for (node, dual) in corners.iter().zip(dual) {
                                *duals[*node].shares[side].entry(of_mesh).or_default() += dual * shape;
                            }
                        }
                    }
                });
            }
        }
        let node = |(at, Dual { area, shares }): (&[f64; 2], Dual)| {
            let mut on = [None, None];
            for (side, shares) in shares.into_iter().enumerate() {
                on[side] = surfaces[side].map(|surface| SurfacePoint {
                    shares: shares.into_iter().map(|(of_mesh, sum)| (of_mesh, sum / area)).collect(),
                    ..surface.locate(&seen(side, *at))
                });
            }
            // Where a mesh leaves a gap there may be nothing to a node.
            (area > least).then_some(MortarNode { at: *at, area, on })
        };
        self.nodes.iter().zip(duals).filter_map(node).collect()
    }
}

/// `D M^-1` over these parts of a triangle; `None` where they are too little of it to say.
fn dual_functions(triangle: &Polygon, parts: &[Polygon]) -> Option<Mat3> {
    // Of a whole triangle, as the integrals below give it but for rounding.
    const WHOLE: Mat3 = Mat3::new(3.0, -1.0, -1.0, -1.0, 3.0, -1.0, -1.0, -1.0, 3.0);
    let covered: f64 = parts.iter().map(|part| planar::area(part)).sum();
    if covered > (1.0 - COVERED) * planar::area(triangle) {
        return Some(WHOLE);
    }
    let (mut mass, mut sum) = (Mat3::zeros(), Vec3::zeros());
    for part in parts {
        each_point(part, |at, weight| {
            let l = Vec3::from(area_coordinates(triangle, at));
            mass += l * l.transpose() * weight;
            sum += l * weight;
        });
    }
    Some(Mat3::from_diagonal(&sum) * mass.try_inverse()?)
}

/// Calls back with the points and weights [m^2] of a convex polygon.
fn each_point(polygon: &Polygon, mut point: impl FnMut([f64; 2], f64)) {
    for k in 1..polygon.len() - 1 {
        let corners = [polygon[0], polygon[k], polygon[k + 1]];
        let area = planar::area(&corners);
        for ([twice, once], weight) in RULE {
            for own in 0..3 {
                let share = |corner: usize| if corner == own { once } else { twice };
                let at = [0, 1].map(|axis| (0..3).map(|c| share(c) * corners[c][axis]).sum());
                point(at, weight * area);
            }
        }
    }
}

/// Of a point in a triangle.
fn area_coordinates(triangle: &Polygon, [x, y]: [f64; 2]) -> [f64; 3] {
    let whole = planar::area(triangle);
    let opposite = |k: usize| {
        let [p, q] = [triangle[(k + 1) % 3], triangle[(k + 2) % 3]];
        0.5 * ((p[0] - x) * (q[1] - y) - (p[1] - y) * (q[0] - x)) / whole
    };
    [opposite(0), opposite(1), opposite(2)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Polyhedron, RoundedBody};
    use crate::mesh::{Mesh, cuboid_mesh};
    use crate::tensor::Rotation;

    const LOWER: [f64; 3] = [0.4, 0.3, 0.2];
    const UPPER: [f64; 3] = [0.2, 0.2, 0.2];
    /// Of the upper box over the lower one [m]; its rim stands over by 5 cm.
    const SHIFT: [f64; 2] = [0.15, 0.02];

    fn faces_of(size: [f64; 3]) -> Vec<Face> {
        let shape = Polyhedron::cuboid(size).expect("a box");
        Face::of(&RoundedBody::inset(&shape, 1e-3).expect("fits"))
    }

    fn looking(faces: &[Face], z: f64) -> &Face {
        faces.iter().find(|face| face.normal.z * z > 0.9).expect("a face that looks there")
    }

    fn meshed(size: [f64; 3], cell: f64) -> (Mesh, Surface) {
        let mesh = cuboid_mesh(size, cell).expect("a mesh");
        let surface = Surface::new(&mesh);
        (mesh, surface)
    }

    /// The upper box, turned about the vertical, on the lower one.
    fn poses(turn: f64) -> [Pose; 2] {
        let height = 0.5 * (LOWER[2] + UPPER[2]);
        let upper = Rotation::from_scaled_axis(Vec3::new(0.0, 0.0, turn));
        [Pose::identity(), Pose::new(Vec3::new(SHIFT[0], SHIFT[1], height), upper)]
    }

    /// Meshes that do not match: over all nodes the shares reproduce area, centre and second moments of the common part, on either body, which
    /// quadratic shape functions can.
    #[test]
    fn shares_of_nodes_are_the_integrals_of_shape_functions() {
        let (lower_faces, upper_faces) = (faces_of(LOWER), faces_of(UPPER));
        let faces = [looking(&lower_faces, 1.0), looking(&upper_faces, -1.0)];
        let (lower, upper) = (meshed(LOWER, 0.07), meshed(UPPER, 0.055));
        let poses = poses(0.0);
        let mortar = Mortar::new((0, 0), faces, [&poses[0], &poses[1]], [Some(&lower.1), Some(&upper.1)]);
        assert!(mortar.nodes.len() > 4);
        // The common part in the lower box's frame: up to its edge along x.
        let x = [SHIFT[0] - 0.5 * UPPER[0], 0.5 * LOWER[0]];
        let y = [SHIFT[1] - 0.5 * UPPER[1], SHIFT[1] + 0.5 * UPPER[1]];
        let power = |[low, high]: [f64; 2], n: i32| (high.powi(n + 1) - low.powi(n + 1)) / f64::from(n + 1);
        for (side, (mesh, surface)) in [&lower, &upper].into_iter().enumerate() {
            let mut sums = [0.0; 5];
            for node in &mortar.nodes {
                let on = node.on[side].as_ref().expect("meshed");
                let whole: f64 = on.shares.iter().map(|(_, share)| share).sum();
                assert!((whole - 1.0).abs() < 1e-12, "{whole}");
                for (of_mesh, share) in &on.shares {
                    let p = poses[side].to_space(&mesh.nodes[surface.nodes()[*of_mesh as usize].index()]);
                    for (sum, value) in sums.iter_mut().zip([1.0, p.x, p.y, p.x * p.x, p.x * p.y]) {
                        *sum += node.area * share * value;
                    }
                }
            }
            let of = |m: i32, n: i32| power(x, m) * power(y, n);
            for (sum, exact) in sums.iter().zip([of(0, 0), of(1, 0), of(0, 1), of(2, 0), of(1, 1)]) {
                assert!((sum - exact).abs() < 1e-12, "side {side}: {sums:?}");
            }
        }
    }

    /// On both meshes, which match nowhere: what bears a patch that tips is its corner, so that a force has to reach it.
    #[test]
    fn forces_act_at_their_nodes_and_the_corners_are_nodes() {
        let (lower_faces, upper_faces) = (faces_of(LOWER), faces_of(UPPER));
        let faces = [looking(&lower_faces, 1.0), looking(&upper_faces, -1.0)];
        for (turn, size) in [(0.0, 0.2), (0.3, 0.2), (0.3, 0.05)] {
            let (lower, upper) = (meshed(LOWER, 1.3 * size), meshed(UPPER, size));
            let poses = poses(turn);
            let surfaces = [Some(&lower.1), Some(&upper.1)];
            let nodes = Mortar::new((0, 0), faces, [&poses[0], &poses[1]], surfaces).nodes;
            for node in &nodes {
                let place = poses[1].to_space(&faces[1].point(node.at));
                for (side, (mesh, surface)) in [&lower, &upper].into_iter().enumerate() {
                    let on = node.on[side].as_ref().expect("meshed");
                    let at = |(of_mesh, share): &(u32, f64)| {
                        mesh.nodes[surface.nodes()[*of_mesh as usize].index()] * *share
                    };
                    let resultant = poses[side].to_space(&on.shares.iter().map(at).sum());
                    assert!((resultant - place).norm() < 1e-12, "{turn} {size}: {resultant} {place}");
                }
            }
            // The upper face's corners that are over the lower one.
            for corner in &faces[1].ring {
                let place = poses[1].to_space(corner);
                if place.x < 0.5 * LOWER[0] && place.y.abs() < 0.5 * LOWER[1] {
                    let reached = |node: &MortarNode| (faces[1].point(node.at) - corner).norm() < 1e-12;
                    assert!(nodes.iter().any(reached), "{turn} {size}: {corner}");
                }
            }
        }
    }

    /// Where a mesh has lost facets, nodes still bear what is left of the patch, each at its place and none against the others: duals of whole
    /// triangles come to nothing or less there.
    #[test]
    fn nodes_beside_a_hole_bear_what_is_left() {
        let faces = faces_of(UPPER);
        let face = looking(&faces, 1.0);
        let outline: Polygon = face.ring.iter().map(|corner| face.coordinates(corner)).collect();
        let centre = [0, 1].map(|axis| outline.iter().map(|p| p[axis]).sum::<f64>() / 4.0);
        for share in [1.0 / 3.0, 0.42, 0.6, 0.9] {
            let towards = |p: &[f64; 2]| [0, 1].map(|axis| centre[axis] + share * (p[axis] - centre[axis]));
            let inner: Polygon = outline.iter().map(towards).collect();
            let ring = (0..4).map(|k| {
                let next = (k + 1) % 4;
                vec![outline[k], outline[next], inner[next], inner[k]]
            });
            let parts: Vec<Polygon> = ring.collect();
            let triangles = Triangles::new(&outline, 1e-6, 0);
            let (mesh, surface) = meshed(UPPER, 0.05);
            let poses = [Pose::identity(), Pose::identity()];
            let nodes =
                triangles.nodes(&parts, 1e-15, [face, face], [&poses[0], &poses[1]], [None, Some(&surface)]);
            assert_eq!(nodes.len(), 5, "{share}");
            let area: f64 = nodes.iter().map(|node| node.area).sum();
            assert!((area / (0.04 * (1.0 - share * share)) - 1.0).abs() < 1e-12, "{share}: {area}");
            for node in &nodes {
                let on = node.on[1].as_ref().expect("meshed");
                let at = |(of_mesh, part): &(u32, f64)| {
                    mesh.nodes[surface.nodes()[*of_mesh as usize].index()] * *part
                };
                let resultant: Vec3 = on.shares.iter().map(at).sum();
                assert!((resultant - face.point(node.at)).norm() < 1e-12, "{share}: {resultant}");
                let spread: f64 = on.shares.iter().map(|(_, part)| part.abs()).sum();
                // The one in the hole is far from all that bears, but has little.
                assert!(spread * node.area < 2.0 * area, "{share}: {spread}");
            }
        }
    }

    /// Meshes of files with six digits: facets of 5 mm lean by up to 2e-4, and lie on the face all the same.
    #[test]
    fn facets_of_rounded_coordinates_lie_on_their_face() {
        let (mut mesh, exact) = meshed(LOWER, 0.02);
        let turn = Rotation::from_scaled_axis(Vec3::new(0.3, 0.2, 0.1));
        for node in &mut mesh.nodes {
            *node = (turn * *node).map(|x| (x * 1e6).round() / 1e6);
        }
        let found = Surface::new(&mesh).facets_in(&(turn * Vec3::z()), 0.5 * LOWER[2], ON_FACE).len();
        assert_eq!(found, exact.facets_in(&Vec3::z(), 0.5 * LOWER[2], ON_FACE).len());
        assert!(found > 100);
    }

    #[test]
    fn faces_without_a_mesh_have_their_corners_and_centre() {
        let (lower_faces, upper_faces) = (faces_of(LOWER), faces_of(UPPER));
        let faces = [looking(&lower_faces, 1.0), looking(&upper_faces, -1.0)];
        let poses = poses(0.0);
        assert_eq!(Mortar::new((0, 0), faces, [&poses[0], &poses[1]], [None, None]).nodes.len(), 5);
    }

    #[test]
    fn finer_meshes_have_more_nodes_and_together_they_have_the_patch() {
        let (lower_faces, upper_faces) = (faces_of(LOWER), faces_of(UPPER));
        let faces = [looking(&lower_faces, 1.0), looking(&upper_faces, -1.0)];
        let poses = poses(0.3);
        let (mut last, mut first_area) = (0, None);
        for cell in [0.1, 0.05, 0.025] {
            let (_, surface) = meshed(UPPER, cell);
            let found = Mortar::new((0, 0), faces, [&poses[0], &poses[1]], [None, Some(&surface)]).nodes;
            assert!(found.len() > last, "{} nodes of {cell}", found.len());
            assert!(found.iter().all(|node| node.on[0].is_none() && node.on[1].is_some()));
            let area: f64 = found.iter().map(|node| node.area).sum();
            let expected = *first_area.get_or_insert(area);
            assert!((area / expected - 1.0).abs() < 1e-12, "{area} {expected}");
            let mean = area / found.len() as f64;
            assert!(found.iter().all(|node| node.area < 3.0 * mean && node.area > 0.1 * mean), "{found:?}");
            last = found.len();
        }
    }

    #[test]
    fn nodes_remember_by_area_what_lay_nearest() {
        let (lower_faces, upper_faces) = (faces_of(LOWER), faces_of(UPPER));
        let faces = [looking(&lower_faces, 1.0), looking(&upper_faces, -1.0)];
        let poses = poses(0.0);
        let of = |cell: f64| {
            let (_, surface) = meshed(UPPER, cell);
            Mortar::new((0, 0), faces, [&poses[0], &poses[1]], [None, Some(&surface)])
        };
        let (coarse, fine) = (of(0.1), of(0.04));
        let memory = |mortar: &Mortar| -> Vec<PointMemory> {
            let of_node = |(k, node): (usize, &MortarNode)| PointMemory {
                pressure: 3.0 * node.area,
                load: 3.0 * node.area,
                ..PointMemory::open(mortar.feature(k), 0.0)
            };
            mortar.nodes.iter().enumerate().map(of_node).collect()
        };
        let kept = fine.remember(&coarse, &memory(&coarse));
        assert_eq!(kept.len(), fine.nodes.len());
        for (point, node) in kept.iter().zip(&fine.nodes) {
            assert!((point.pressure / (3.0 * node.area) - 1.0).abs() < 1e-12);
        }
    }
}
