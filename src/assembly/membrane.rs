//! Contacts between the membrane and the bodies inside it in one configuration.
//!
//! Per body the features within reach are listed with a skin and evaluated until something has moved through
//! half of it. Features of plates against triangles or edges glued to a plate are left out.

use crate::assembly::too_close::TooClose;
use crate::contact::ContactShape;
use crate::contact::features::{Feature, Site, closest_on_segments, closest_on_triangle, spanned};
use crate::contact::law::CORE_FLOOR;
use crate::contact::membrane::{self, MembraneContact, MembraneForce, MembraneTangent};
use crate::contact::visit::nearest_piece;
use crate::geometry::Edge;
use crate::geometry::neighbours::{Ball, BallGrid};
use crate::grain::{Surface, SurfacePoint};
use crate::model::{BodyKind, Membrane, Model};
use crate::tensor::{Pose, Vec3};
use rayon::prelude::*;

/// Skin of the lists of features over the sum of the two roundings.
const SKIN: f64 = 0.75;

/// One contact in the present configuration.
#[derive(Debug, Clone, Copy)]
pub struct MembranePoint {
    pub contact: MembraneContact,
    pub force: MembraneForce,
}

impl MembranePoint {
    /// Force on the body [N].
    pub fn on_body(&self) -> Vec3 {
        Vec3::from_column_slice(&self.force.on_body[..3])
    }

    /// Where that acts on the surface of the body, whose core point is the force's [m].
    pub fn on_surface(&self) -> Vec3 {
        let out = (-self.on_body()).try_normalize(0.0).unwrap_or_default();
        self.force.point + out * self.contact.rounding
    }

    /// The same on the mesh of a body at this pose: where the contact leaves it outwards. The core point's nearest place would jump.
    fn place_on(&self, surface: &Surface, pose: &Pose) -> SurfacePoint {
        let outward = pose.rotation.inverse() * -self.on_body();
        surface.locate_along(&pose.to_body(&self.force.point), &outward)
    }
}

/// A node of the membrane and the facets of a core that may be closest to it.
#[derive(Debug, Clone)]
struct NodeReach {
    node: u32,
    facets: Vec<u32>,
}

/// A body and the pieces of membrane near it.
#[derive(Debug, Clone)]
pub struct BodyContacts {
    pub body: usize,
    nodes: Vec<NodeReach>,
    /// Core vertex, membrane facet.
    vertices: Vec<(u32, u32)>,
    /// Core edge, membrane edge.
    edges: Vec<(u32, u32)>,
    radii: f64,
    /// Every membrane node named by the lists, sorted.
    pub named: Vec<u32>,
    /// Active contacts.
    pub points: Vec<MembranePoint>,
    pub tangents: Vec<MembraneTangent>,
    /// Smallest distance between core and membrane met [m]; infinite where nothing is in reach.
    pub nearest: f64,
}

/// All contacts of the membrane, with buffers that are reused.
#[derive(Debug, Clone, Default)]
pub struct MembraneContacts {
    pub bodies: Vec<BodyContacts>,
    /// Where the membrane's nodes are [m].
    pub positions: Vec<Vec3>,
    /// Where nodes and bodies were when the lists were made.
    listed_at: Vec<Vec3>,
    listed_poses: Vec<Pose>,
    skin: f64,
}

impl MembraneContacts {
    /// Forgets the lists, so that an increment depends on nothing but the committed state.
    pub fn start(&mut self) {
        self.listed_at.clear();
    }

    /// Evaluates every contact; `corners` are the core vertices of every body in space [m].
    pub fn evaluate(
        &mut self,
        model: &Model,
        membrane: &Membrane,
        corners: &[Vec<Vec3>],
        poses: &[Pose],
    ) -> Result<(), TooClose> {
        let mut positions = std::mem::take(&mut self.positions);
        membrane.positions_into(&mut positions, poses);
        self.positions = positions;
        if let Some(node) = membrane.torn(&self.positions) {
            return Err(TooClose { a: node, b: node, distance: 0.0 });
        }
        if !self.is_valid(model, poses) {
            self.list(model, membrane, corners, poses);
        }
        let positions = &self.positions;
        self.bodies.par_iter_mut().for_each(|list| {
            let body = list.body;
            list.evaluate(membrane, &model.shapes[body], &corners[body], &poses[body].position, positions);
        });
        for list in &self.bodies {
            if list.nearest < CORE_FLOOR * list.radii {
                let node = list.named.first().map_or(0, |&node| membrane.nodes[node as usize].body);
                return Err(TooClose { a: list.body, b: node, distance: list.nearest });
            }
        }
        Ok(())
    }

    /// Tangents of all active contacts in the configuration last evaluated.
    pub fn update_tangents(&mut self, membrane: &Membrane, corners: &[Vec<Vec3>], poses: &[Pose]) {
        let positions = &self.positions;
        self.bodies.par_iter_mut().for_each(|list| {
            let body = list.body;
            list.tangents.clear();
            for point in &list.points {
                let site = &point.contact.site;
                list.tangents.push(membrane::tangent(
                    &membrane.contact,
                    &point.contact,
                    &poses[body].position,
                    &site.on_a.map(|v| corners[body][v as usize]),
                    &site.on_b.map(|n| positions[n as usize]),
                ));
            }
        });
    }

    /// Every active contact with its body.
    pub fn points(&self) -> impl Iterator<Item = (usize, &MembranePoint)> {
        self.bodies.iter().flat_map(|list| list.points.iter().map(|point| (list.body, point)))
    }

    /// Calls `visit(body, place, force)` for each force [N], in space, on a body that `surface` gives one for.
    pub(super) fn for_each_force_on<'a>(
        &self,
        poses: &[Pose],
        surface: impl Fn(usize) -> Option<&'a Surface>,
        mut visit: impl FnMut(usize, SurfacePoint, Vec3),
    ) {
        for (body, point) in self.points() {
            if let Some(surface) = surface(body) {
                visit(body, point.place_on(surface, &poses[body]), point.on_body());
            }
        }
    }

    /// Energy of the contacts [J].
    pub fn energy(&self) -> f64 {
        self.bodies.iter().flat_map(|list| &list.points).map(|point| point.force.energy).sum()
    }

    /// The free node farthest from every node that presses on a body, and that distance [m]: about the
    /// radius of the largest opening that the membrane spans.
    pub fn widest_span(&self, membrane: &Membrane) -> (usize, f64) {
        let mut rests = vec![false; self.positions.len()];
        for point in self.bodies.iter().flat_map(|list| &list.points) {
            point.contact.nodes().iter().for_each(|&n| rests[n as usize] = true);
        }
        (0..rests.len()).filter(|&n| membrane.is_glued(n)).for_each(|n| rests[n] = true);
        let held: Vec<Vec3> =
            self.positions.iter().zip(&rests).filter(|(_, r)| **r).map(|(x, _)| *x).collect();
        let mut widest = (0, 0.0);
        for node in (0..rests.len()).filter(|&n| !rests[n]) {
            let x = self.positions[node];
            let nearest = held.iter().map(|y| (y - x).norm()).fold(f64::INFINITY, f64::min);
            if nearest > widest.1 {
                widest = (node, nearest);
            }
        }
        widest
    }

    /// The largest share of a step in which no node and body come closer than half their distance, and no
    /// node leaves its lists; `travel` is how far each carrier goes [m].
    pub fn largest_factor(&self, membrane: &Membrane, travel: &[f64]) -> f64 {
        let farthest =
            travel.iter().skip(travel.len() - membrane.free_nodes()).fold(0.0, |m: f64, &t| m.max(t));
        let mut factor = (self.skin / farthest.max(f64::MIN_POSITIVE)).min(1.0);
        for list in &self.bodies {
            let of_nodes = list.named.iter().map(|&n| travel[membrane.nodes[n as usize].body]);
            let both = travel[list.body] + of_nodes.fold(0.0, f64::max);
            factor = factor.min(0.5 * list.nearest / both.max(f64::MIN_POSITIVE));
        }
        factor
    }

    fn is_valid(&self, model: &Model, poses: &[Pose]) -> bool {
        let farthest = |moved: &mut dyn Iterator<Item = f64>| moved.fold(0.0, f64::max);
        if self.listed_at.len() != self.positions.len() {
            return false;
        }
        let nodes =
            farthest(&mut self.positions.iter().zip(&self.listed_at).map(|(x, old)| (x - old).norm()));
        let bodies = farthest(&mut model.shapes.iter().zip(poses).zip(&self.listed_poses).map(
            |((shape, now), old)| {
                // A chord c between unit quaternions turns by at most 2.1 c for turns up to a radian.
                let (p, q) = (now.rotation.coords, old.rotation.coords);
                let turn = (p - q).norm().min((p + q).norm());
                (now.position - old.position).norm() + 2.1 * turn * shape.bounding_radius
            },
        ));
        nodes + bodies <= self.skin
    }

    fn list(&mut self, model: &Model, membrane: &Membrane, corners: &[Vec<Vec3>], poses: &[Pose]) {
        let smallest = model.smallest_rounding();
        self.skin = SKIN * (smallest + membrane.rounding());
        let positions = &self.positions;
        let mut grid = BallGrid::new(2.0 * membrane.parameters.mesh_size);
        for facet in &membrane.facets {
            let x = facet.map(|n| positions[n]);
            let centre = (x[0] + x[1] + x[2]) / 3.0;
            let radius = x.iter().map(|p| (p - centre).norm()).fold(0.0, f64::max);
            grid.push(Ball { centre, radius });
        }
        let skin = self.skin;
        self.bodies = (0..model.bodies.len())
            .into_par_iter()
            .filter(|body| model.bodies[*body].kind != BodyKind::Gone)
            .filter_map(|body| {
                let shape = &model.shapes[body];
                let radii = shape.rounded.radius + membrane.rounding();
                let ball = Ball { centre: poses[body].position, radius: shape.bounding_radius };
                let of = Vicinity {
                    is_plate: model.bodies[body].kind == BodyKind::Plate,
                    membrane,
                    shape,
                    corners: &corners[body],
                    positions,
                    radii,
                    skin,
                };
                let list = BodyContacts::list(body, &of, &grid.near(&ball, of.reach()));
                (!list.named.is_empty()).then_some(list)
            })
            .collect();
        self.listed_at.clone_from(positions);
        self.listed_poses = poses[..model.bodies.len()].to_vec();
    }
}

fn bounds(points: impl Iterator<Item = Vec3>, margin: f64) -> (Vec3, Vec3) {
    let start = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    let (low, high) = points.fold(start, |(low, high), p| (low.inf(&p), high.sup(&p)));
    (low - Vec3::repeat(margin), high + Vec3::repeat(margin))
}

fn overlap(a: &(Vec3, Vec3), b: &(Vec3, Vec3)) -> bool {
    (0..3).all(|k| a.0[k] <= b.1[k] && b.0[k] <= a.1[k])
}

/// A body beside the membrane, as its lists are made.
struct Vicinity<'a> {
    is_plate: bool,
    membrane: &'a Membrane,
    shape: &'a ContactShape,
    /// Vertices of the body's core in space [m].
    corners: &'a [Vec3],
    /// Nodes of the membrane [m].
    positions: &'a [Vec3],
    /// Sum of the roundings [m].
    radii: f64,
    /// And how much farther off pieces are listed [m].
    skin: f64,
}

impl Vicinity<'_> {
    /// Distance from the core up to which pieces are listed [m].
    fn reach(&self) -> f64 {
        self.radii + self.skin
    }

    /// What is glued to a plate is beside it, not in contact with it.
    fn counts(&self, nodes: &[usize]) -> bool {
        !(self.is_plate && nodes.iter().any(|&n| self.membrane.is_glued(n)))
    }

    /// Where the nodes of a piece of membrane are [m].
    fn at<const N: usize>(&self, nodes: [usize; N]) -> [Vec3; N] {
        nodes.map(|n| self.positions[n])
    }

    /// The nodes of these facets that are in reach, with the facets of the core that may be closest to them.
    fn nodes(&self, near: &[usize], around: &(Vec3, Vec3)) -> Vec<NodeReach> {
        let core = &self.shape.rounded.core;
        let mut candidates: Vec<usize> = near.iter().flat_map(|&f| self.membrane.facets[f]).collect();
        candidates.sort_unstable();
        candidates.dedup();
        let mut nodes = Vec::new();
        for &node in candidates.iter().filter(|&&node| self.counts(&[node])) {
            let x = &self.positions[node];
            if core.facets.is_empty() {
                if (x - self.corners[0]).norm() < self.reach() {
                    nodes.push(NodeReach { node: node as u32, facets: Vec::new() });
                }
                continue;
            }
            if !overlap(around, &(*x, *x)) {
                continue;
            }
            let distance =
                |f: &[usize; 3]| (closest_on_triangle(x, f.map(|v| &self.corners[v])).0 - x).norm();
            let distances: Vec<f64> = core.facets.iter().map(distance).collect();
            let nearest = distances.iter().copied().fold(f64::INFINITY, f64::min);
            if nearest < self.reach() {
                let may_be_closest = |&f: &u32| distances[f as usize] <= nearest + 2.0 * self.skin;
                let facets = (0..distances.len() as u32).filter(may_be_closest).collect();
                nodes.push(NodeReach { node: node as u32, facets });
            }
        }
        nodes
    }

    /// The vertices of the core that are in reach of one of these facets, each with it.
    fn vertices(&self, near: &[usize]) -> Vec<(u32, u32)> {
        let mut vertices = Vec::new();
        for &f in near.iter().filter(|&&f| self.counts(&self.membrane.facets[f])) {
            let x = self.at(self.membrane.facets[f]);
            let boxed = bounds(x.into_iter(), self.reach());
            for (v, p) in self.corners.iter().enumerate() {
                if overlap(&boxed, &(*p, *p))
                    && (closest_on_triangle(p, [&x[0], &x[1], &x[2]]).0 - p).norm() < self.reach()
                {
                    vertices.push((v as u32, f as u32));
                }
            }
        }
        vertices
    }

    /// The edges of the core that are in reach of an edge of one of these facets, each with it.
    fn edges(&self, near: &[usize]) -> Vec<(u32, u32)> {
        let membrane = self.membrane;
        let sides = |&f: &usize| {
            let [a, b, c] = membrane.facets[f];
            [[a, b], [b, c], [c, a]].map(|[i, j]| [i.min(j), i.max(j)])
        };
        let number = |edge: [usize; 2]| membrane.edges.binary_search(&edge).ok().map(|e| e as u32);
        let counting = near.iter().flat_map(sides).filter(|edge| self.counts(edge));
        let mut own: Vec<u32> = counting.filter_map(number).collect();
        own.sort_unstable();
        own.dedup();
        let edges_of_core = &self.shape.rounded.core.edges;
        let boxed = |edge: &Edge| bounds(edge.vertices.iter().map(|&v| self.corners[v]), self.reach());
        let boxes: Vec<(Vec3, Vec3)> = edges_of_core.iter().map(boxed).collect();
        let mut edges = Vec::new();
        for &e in &own {
            let [q0, q1] = self.at(membrane.edges[e as usize]);
            let boxed = bounds([q0, q1].into_iter(), 0.0);
            for (i, edge) in edges_of_core.iter().enumerate() {
                if self.shape.edge_weight[i] == 0.0 || !overlap(&boxes[i], &boxed) {
                    continue;
                }
                let [p0, p1] = edge.vertices.map(|v| self.corners[v]);
                let (s, t) = closest_on_segments(&p0, &p1, &q0, &q1);
                if ((p0 + (p1 - p0) * s) - (q0 + (q1 - q0) * t)).norm() < self.reach() {
                    edges.push((i as u32, e));
                }
            }
        }
        edges
    }
}

impl BodyContacts {
    /// What of these `facets` of the membrane and their nodes and edges is in reach of a `body`.
    fn list(body: usize, of: &Vicinity<'_>, facets: &[usize]) -> Self {
        let membrane = of.membrane;
        let around = bounds(of.corners.iter().copied(), of.reach());
        let is_near = |&f: &usize| overlap(&around, &bounds(of.at(membrane.facets[f]).into_iter(), 0.0));
        let near: Vec<usize> = facets.iter().copied().filter(is_near).collect();
        let (nodes, vertices, edges) = (of.nodes(&near, &around), of.vertices(&near), of.edges(&near));
        let mut named: Vec<u32> = nodes.iter().map(|n| n.node).collect();
        named.extend(vertices.iter().flat_map(|&(_, f)| membrane.facets[f as usize].map(|n| n as u32)));
        named.extend(edges.iter().flat_map(|&(_, e)| membrane.edges[e as usize].map(|n| n as u32)));
        named.sort_unstable();
        named.dedup();
        BodyContacts {
            body,
            nodes,
            vertices,
            edges,
            radii: of.radii,
            named,
            points: Vec::new(),
            tangents: Vec::new(),
            nearest: f64::INFINITY,
        }
    }

    fn evaluate(
        &mut self,
        membrane: &Membrane,
        shape: &ContactShape,
        corners: &[Vec3],
        position: &Vec3,
        positions: &[Vec3],
    ) {
        let BodyContacts { nodes, vertices, edges, radii, points, nearest, .. } = self;
        let (core, radii, rounding) = (&shape.rounded.core, *radii, shape.rounded.radius);
        points.clear();
        *nearest = f64::INFINITY;
        let mut add = |site: Site, edge_weight: f64| {
            let contact = MembraneContact { site, rounding, offset: membrane.rounding(), edge_weight };
            let on_body = site.on_a.map(|v| corners[v as usize]);
            let on_membrane = site.on_b.map(|n| positions[n as usize]);
            let force = membrane::evaluate(&membrane.contact, &contact, position, &on_body, &on_membrane);
            if force.pressure > 0.0 {
                points.push(MembranePoint { contact, force });
            }
        };
        for NodeReach { node, facets } in nodes.iter() {
            let (distance, piece, count) = nearest_piece(&positions[*node as usize], shape, facets, corners);
            *nearest = nearest.min(distance);
            if distance < radii {
                let feature = Feature::VertexOfB(*node);
                add(Site { feature, on_a: piece, on_b: [*node; 3], count_a: count, count_b: 1 }, 1.0);
            }
        }
        for &(v, f) in vertices.iter() {
            let of_facet = membrane.facets[f as usize];
            let p = &corners[v as usize];
            let (closest, spans) = closest_on_triangle(p, of_facet.map(|n| &positions[n]));
            let distance = (closest - p).norm();
            *nearest = nearest.min(distance);
            if distance < radii {
                let (piece, count) = spanned(of_facet.map(|n| n as u32), spans);
                let feature = Feature::VertexOfA(v);
                add(Site { feature, on_a: [v; 3], on_b: piece, count_a: 1, count_b: count }, 1.0);
            }
        }
        for &(i, e) in edges.iter() {
            let [p, q] = core.edges[i as usize].vertices.map(|v| v as u32);
            let [m, n] = membrane.edges[e as usize].map(|n| n as u32);
            let ends = [p, q].map(|v| &corners[v as usize]);
            let others = [m, n].map(|n| &positions[n as usize]);
            let (s, t) = closest_on_segments(ends[0], ends[1], others[0], others[1]);
            let between = (ends[0] + (ends[1] - ends[0]) * s) - (others[0] + (others[1] - others[0]) * t);
            let distance = between.norm();
            *nearest = nearest.min(distance);
            let inside = |s: f64| s > 1e-12 && s < 1.0 - 1e-12;
            if distance < radii && inside(s) && inside(t) {
                let feature = Feature::Edges(i, e);
                let site = Site { feature, on_a: [p, q, p], on_b: [m, n, m], count_a: 2, count_b: 2 };
                add(site, shape.edge_weight[i as usize]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cuboid_mesh;

    /// A core's corner is as near to one face as to another: what presses there does not jump between them.
    #[test]
    fn a_force_stays_where_it_is_when_its_core_point_hardly_moves() {
        let surface = Surface::new(&cuboid_mesh([2.0; 3], 1.0).expect("a mesh"));
        let site =
            Site { feature: Feature::VertexOfA(0), on_a: [0; 3], on_b: [0, 1, 2], count_a: 1, count_b: 3 };
        let contact = MembraneContact { site, rounding: 0.1, offset: 0.0, edge_weight: 1.0 };
        for axis in 0..3 {
            let force = MembraneForce {
                pressure: 1.0,
                energy: 0.0,
                overlap: 0.0,
                point: Vec3::repeat(0.9) + Vec3::ith(axis, 1e-9),
                on_body: [-1.0, -1.0, -1.0, 0.0, 0.0, 0.0],
                on_membrane: [Vec3::zeros(); 3],
            };
            let place = MembranePoint { contact, force }.place_on(&surface, &Pose::identity()).position;
            assert!((place - Vec3::repeat(1.0)).norm() < 1e-8, "{place}");
        }
    }
}
