//! Which features can touch: a broad phase over bounding boxes, then per pair the vertices, facets
//! and edges within reach, kept with a skin until some body has moved through half of it.

use crate::contact::corner::{Corner, section_spreads};
use crate::contact::face::{Face, look_at_each_other, may_face};
use crate::contact::features::{closest_on_segments, closest_on_triangle};
use crate::geometry::{Polyhedron, RoundedBody};
use crate::tensor::{Pose, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Edges between facets whose normals differ by less than this angle [rad] are inside a face and
/// touch nothing; above [`SHARP_EDGE`] they count in full, in between they fade.
const FLAT_EDGE: f64 = 1e-3;
const SHARP_EDGE: f64 = 1e-2;
/// Edges shorter than this many roundings of their body touch nothing, what their ends do not find being a hundredth of the rounding; from
/// [`LONG_EDGE`] on they count in full. Over a shorter edge the weight of a deep contact would change faster than any drag can follow.
const SHORT_EDGE: f64 = 0.5;
const LONG_EDGE: f64 = 2.0;
/// What rounding may take off a distance, over the lengths that it is of.
const ROUNDING: f64 = 1e-9;

/// A body as the search sees it: its rounded shape and the weights of its edges.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactShape {
    pub rounded: RoundedBody,
    /// Weight of each edge, 0 for edges inside a flat face and for what is shorter than the rounding.
    pub edge_weight: Vec<f64>,
    /// The corner at each vertex, `None` where it is blunt or the core is a point.
    pub corners: Vec<Option<Corner>>,
    /// By how much the section of each corner grows per depth, as the radius of a circle of its area over the depth.
    pub corner_spread: Vec<f64>,
    /// The tangent of half the angle between each edge's facets.
    pub edge_spread: Vec<f64>,
    /// Faces that may share a patch with another body's; none unless asked for.
    pub faces: Vec<Face>,
    /// A ball around each facet of the core: its centre and its radius [m].
    pub(super) facet_balls: Vec<(Vec3, f64)>,
    /// Distance of the farthest core vertex from the reference point [m].
    pub bounding_radius: f64,
}

/// From 0 at the first limit to 1 at the second.
fn grown(value: f64, [none, all]: [f64; 2]) -> f64 {
    ((value - none) / (all - none)).clamp(0.0, 1.0)
}

/// Of each edge [m].
fn edge_lengths(core: &Polyhedron) -> impl Iterator<Item = f64> {
    core.edges.iter().map(|edge| {
        let [from, to] = edge.vertices.map(|v| core.vertices[v]);
        (to - from).norm()
    })
}

impl ContactShape {
    pub fn new(rounded: RoundedBody) -> Self {
        let core = &rounded.core;
        let edge_weight = core
            .edges
            .iter()
            .zip(edge_lengths(core))
            .map(|(edge, length)| {
                let [f, g] = edge.facets.map(|f| core.normals[f]);
                let angle = f.cross(&g).norm().atan2(f.dot(&g));
                grown(angle, [FLAT_EDGE, SHARP_EDGE])
                    * grown(length / rounded.radius, [SHORT_EDGE, LONG_EDGE])
            })
            .collect();
        let bounding_radius = core.bounding_radius();
        let corners = Corner::of(core);
        let (corner_spread, edge_spread) = section_spreads(core);
        let ball = |facet: &[usize; 3]| {
            let corners = facet.map(|v| core.vertices[v]);
            let centre = corners.iter().sum::<Vec3>() / 3.0;
            (centre, corners.iter().map(|corner| (corner - centre).norm()).fold(0.0, f64::max))
        };
        let facet_balls = core.facets.iter().map(ball).collect();
        let faces = Vec::new();
        ContactShape {
            rounded,
            edge_weight,
            corners,
            corner_spread,
            edge_spread,
            faces,
            facet_balls,
            bounding_radius,
        }
    }

    /// Distance of the farthest point of its rounded surface from the reference point [m].
    pub fn outer_radius(&self) -> f64 {
        self.bounding_radius + self.rounded.radius
    }

    /// Length of the longest of its edges that are too short to touch anything [m].
    pub fn longest_silent_edge(&self) -> f64 {
        let is_silent = |length: &f64| *length <= SHORT_EDGE * self.rounded.radius;
        edge_lengths(&self.rounded.core).filter(is_silent).fold(0.0, f64::max)
    }

    pub fn is_point(&self) -> bool {
        self.rounded.core.vertices.len() == 1
    }
}

/// A vertex and the opposite facets that may be closest to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct VertexReach {
    pub vertex: u32,
    pub facets: Vec<u32>,
}

/// The features of a pair of bodies that are within reach of each other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairFeatures {
    pub a: u32,
    pub b: u32,
    pub(super) vertices_of_a: Vec<VertexReach>,
    pub(super) vertices_of_b: Vec<VertexReach>,
    pub(super) edges: Vec<(u32, u32)>,
    /// Faces that may be parallel enough to share a patch.
    faces: Vec<(u32, u32)>,
    pub(super) skin: f64,
    /// Features are listed this far beyond radii and skin [m].
    margin: f64,
    /// Where the two bodies were when the features were listed.
    reference: [Pose; 2],
}

impl PairFeatures {
    pub fn is_empty(&self) -> bool {
        self.vertices_of_a.is_empty()
            && self.vertices_of_b.is_empty()
            && self.edges.is_empty()
            && self.faces.is_empty()
    }

    /// Pairs of faces that may be parallel enough to share a patch.
    pub fn faces(&self) -> &[(u32, u32)] {
        &self.faces
    }

    /// How far beyond the radii features are listed while the list is valid [m].
    pub fn margin(&self) -> f64 {
        self.margin
    }

    /// Lists the features whose rounded surfaces are within `skin + margin` [m] of each other; while
    /// the list is valid, it has all that are within `margin`.
    pub fn list(
        shapes: &[ContactShape],
        corners: &[Vec<Vec3>],
        poses: &[Pose],
        (a, b): (u32, u32),
        margins: [f64; 2],
    ) -> Self {
        let (a, b) = (a as usize, b as usize);
        features_within_reach(shapes, corners, a, b, margins, [poses[a], poses[b]])
    }

    /// Whether no feature outside the list can have come into touch.
    pub fn is_valid(&self, shapes: &[ContactShape], poses: &[Pose]) -> bool {
        let (a, b) = (self.a as usize, self.b as usize);
        let [old_a, old_b] = &self.reference;
        approach([&shapes[a], &shapes[b]], [old_a, old_b], [&poses[a], &poses[b]], self.skin) <= self.skin
    }
}

/// The broad phase: pairs whose bounding boxes are within a margin, and where the bodies were when
/// they were found.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Neighbours {
    pub pairs: Vec<(u32, u32)>,
    /// [m]
    margin: f64,
    reference: Vec<Pose>,
}

/// An upper bound on by how much the distance between any two core points of two bodies changes as they go from two poses to two others [m]; how far both
/// go in space where that is `enough`, what they go against each other else.
pub(super) fn approach(shapes: [&ContactShape; 2], from: [&Pose; 2], to: [&Pose; 2], enough: f64) -> f64 {
    let in_space = motion(shapes[0], from[0], to[0]) + motion(shapes[1], from[1], to[1]);
    if in_space <= enough {
        return in_space;
    }
    // Seen from the larger one.
    let (small, large) = if shapes[0].bounding_radius <= shapes[1].bounding_radius { (0, 1) } else { (1, 0) };
    let seen = |poses: [&Pose; 2]| Pose {
        position: poses[large].to_body(&poses[small].position),
        rotation: poses[large].rotation.inverse() * poses[small].rotation,
    };
    in_space.min(motion(shapes[small], &seen(from), &seen(to)))
}

/// An upper bound on how far any core point of `shape` moves between two poses [m].
fn motion(shape: &ContactShape, from: &Pose, to: &Pose) -> f64 {
    let turn = (to.rotation.coords - from.rotation.coords)
        .norm()
        .min((to.rotation.coords + from.rotation.coords).norm());
    // A chord c between unit quaternions turns by 4 asin(c/2) <= 2.1 c for turns up to a radian.
    (to.position - from.position).norm() + 2.1 * turn * shape.bounding_radius
}

impl Neighbours {
    /// Pairs of `shapes` whose bounding boxes are within `margin` [m] of each other.
    /// Pairs for which `ignores` holds (two fixed bodies, say) are left out.
    pub fn find(
        shapes: &[ContactShape],
        poses: &[Pose],
        margin: f64,
        ignores: impl Fn(usize, usize) -> bool + Sync,
    ) -> Self {
        let boxes: Vec<(Vec3, Vec3)> = shapes
            .iter()
            .zip(poses)
            .map(|(shape, pose)| {
                let reach = Vec3::repeat(shape.rounded.radius + 0.5 * margin);
                let corners = || shape.rounded.core.vertices.iter().map(|v| pose.to_space(v));
                let low = corners().fold(Vec3::repeat(f64::INFINITY), |m, v| m.inf(&v));
                let high = corners().fold(Vec3::repeat(f64::NEG_INFINITY), |m, v| m.sup(&v));
                (low - reach, high + reach)
            })
            .collect();
        let mut order: Vec<usize> = (0..shapes.len()).collect();
        order.sort_by(|&i, &j| boxes[i].0.x.total_cmp(&boxes[j].0.x).then(i.cmp(&j)));
        let mut candidates = Vec::new();
        let mut open: Vec<usize> = Vec::new();
        for &i in &order {
            open.retain(|&j| boxes[j].1.x >= boxes[i].0.x);
            for &j in &open {
                let overlap =
                    (1..3).all(|k| boxes[i].0[k] <= boxes[j].1[k] && boxes[j].0[k] <= boxes[i].1[k]);
                if overlap && !ignores(i, j) {
                    candidates.push((i.min(j) as u32, i.max(j) as u32));
                }
            }
            open.push(i);
        }
        candidates.sort_unstable();
        Neighbours { pairs: candidates, margin, reference: poses.to_vec() }
    }

    /// Whether every body is still within half its margin of where the search found it.
    pub fn is_valid(&self, shapes: &[ContactShape], poses: &[Pose]) -> bool {
        self.reference.len() == poses.len()
            && shapes
                .par_iter()
                .zip(poses)
                .zip(&self.reference)
                .all(|((shape, pose), old)| motion(shape, old, pose) <= 0.5 * self.margin)
    }
}

fn features_within_reach(
    shapes: &[ContactShape],
    corners: &[Vec<Vec3>],
    a: usize,
    b: usize,
    [skin, margin]: [f64; 2],
    reference: [Pose; 2],
) -> PairFeatures {
    let reach = shapes[a].rounded.radius + shapes[b].rounded.radius + skin + margin;
    let (low_a, high_a) = bounds(&corners[a], reach);
    let (low_b, high_b) = bounds(&corners[b], 0.0);
    if (0..3).any(|k| low_a[k] > high_b[k] || high_a[k] < low_b[k]) {
        let none = Vec::new;
        return PairFeatures {
            a: a as u32,
            b: b as u32,
            vertices_of_a: none(),
            vertices_of_b: none(),
            edges: Vec::new(),
            faces: Vec::new(),
            skin,
            margin,
            reference,
        };
    }
    let both = [(a, b), (b, a)].map(|(own, other)| {
        if shapes[own].is_point() || !shapes[other].is_point() {
            let placed = (&shapes[other], &reference[usize::from(other == b)]);
            vertices_within_reach(placed, &corners[own], &corners[other], reach, skin)
        } else {
            Vec::new() // the point's own distance to the core is the whole contact
        }
    });
    let [vertices_of_a, mut vertices_of_b] = both;
    if shapes[a].is_point() && shapes[b].is_point() {
        vertices_of_b.clear();
    }
    let mut edges = Vec::new();
    let (low, high) = bounds(&corners[b], reach);
    for (i, edge_a) in shapes[a].rounded.core.edges.iter().enumerate() {
        let [p0, p1] = edge_a.vertices.map(|v| &corners[a][v]);
        let (edge_low, edge_high) = (p0.inf(p1), p0.sup(p1));
        if shapes[a].edge_weight[i] == 0.0 || (0..3).any(|k| edge_low[k] > high[k] || edge_high[k] < low[k]) {
            continue;
        }
        for (j, edge_b) in shapes[b].rounded.core.edges.iter().enumerate() {
            let [q0, q1] = edge_b.vertices.map(|v| &corners[b][v]);
            if shapes[b].edge_weight[j] == 0.0
                || (0..3).any(|k| {
                    q0[k].min(q1[k]) - reach > edge_high[k] || q0[k].max(q1[k]) + reach < edge_low[k]
                })
            {
                continue;
            }
            let (s, t) = closest_on_segments(p0, p1, q0, q1);
            if ((p0 + (p1 - p0) * s) - (q0 + (q1 - q0) * t)).norm() < reach {
                edges.push((i as u32, j as u32));
            }
        }
    }
    let faces = faces_within_reach([&shapes[a], &shapes[b]], &reference, skin);
    let (a, b) = (a as u32, b as u32);
    PairFeatures { a, b, vertices_of_a, vertices_of_b, edges, faces, skin, margin, reference }
}

/// Pairs of faces that may be parallel enough while the list is valid.
fn faces_within_reach(shapes: [&ContactShape; 2], poses: &[Pose; 2], skin: f64) -> Vec<(u32, u32)> {
    let mut found = Vec::new();
    if shapes.iter().any(|shape| shape.faces.is_empty()) {
        return found;
    }
    // What both bodies together may turn by before the list is made anew: `motion` takes 2.1 chords, and a chord turns by two of them.
    let turn = skin / shapes[0].bounding_radius.min(shapes[1].bounding_radius);
    let seen = poses[1].rotation.inverse() * poses[0].rotation;
    for (i, a) in shapes[0].faces.iter().enumerate() {
        let normal = seen * a.normal;
        for (j, b) in shapes[1].faces.iter().enumerate() {
            let opposite = may_face(&normal, &b.normal, turn);
            if opposite && look_at_each_other([a, b], [&poses[0], &poses[1]]) {
                found.push((i as u32, j as u32));
            }
        }
    }
    found
}

fn bounds(points: &[Vec3], margin: f64) -> (Vec3, Vec3) {
    let low = points.iter().fold(Vec3::repeat(f64::INFINITY), |m, v| m.inf(v));
    let high = points.iter().fold(Vec3::repeat(f64::NEG_INFINITY), |m, v| m.sup(v));
    (low - Vec3::repeat(margin), high + Vec3::repeat(margin))
}

fn vertices_within_reach(
    (other, pose): (&ContactShape, &Pose),
    own_corners: &[Vec3],
    other_corners: &[Vec3],
    reach: f64,
    skin: f64,
) -> Vec<VertexReach> {
    let (low, high) = bounds(other_corners, reach);
    let mut found = Vec::new();
    let (mut least, mut distances) = (Vec::new(), Vec::new());
    for (vertex, p) in own_corners.iter().enumerate() {
        if (0..3).any(|k| p[k] < low[k] || p[k] > high[k]) {
            continue;
        }
        let core = &other.rounded.core;
        if core.facets.is_empty() {
            if (p - other_corners[0]).norm() < reach {
                found.push(VertexReach { vertex: vertex as u32, facets: Vec::new() });
            }
            continue;
        }
        // No point of a facet is nearer than its ball, but for rounding.
        let seen = pose.to_body(p);
        least.clear();
        least.extend(other.facet_balls.iter().map(|(centre, radius)| {
            let away = (seen - centre).norm();
            away - radius - ROUNDING * (away + radius)
        }));
        let distance = |facet: usize| {
            (closest_on_triangle(p, core.facets[facet].map(|v| &other_corners[v])).0 - p).norm()
        };
        let first = (0..least.len()).min_by(|&i, &j| least[i].total_cmp(&least[j])).map(distance);
        let mut nearest = first.unwrap_or(f64::INFINITY).min(reach);
        distances.clear();
        for (facet, &least) in least.iter().enumerate() {
            if least <= nearest + 2.0 * skin {
                distances.push((facet as u32, distance(facet)));
                nearest = nearest.min(distances[distances.len() - 1].1);
            }
        }
        if nearest < reach {
            let is_near = |(_, distance): &&(u32, f64)| *distance <= nearest + 2.0 * skin;
            let facets = distances.iter().filter(is_near).map(|(facet, _)| *facet).collect();
            found.push(VertexReach { vertex: vertex as u32, facets });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reference: the distances of each vertex from all facets of the other body.
    #[test]
    fn listed_facets_are_the_nearest_of_all() {
        let scattered = |k: usize| (43758.5453 * (12.9898 * k as f64).sin()).fract() * 20e-3;
        let shape = |seed: usize, stretch: f64| {
            let corner = |k: usize| {
                let [x, y, z] = [0, 1, 2].map(|axis| scattered(97 * seed + 3 * k + axis));
                Vec3::new(stretch * x, y, z)
            };
            let corners: Vec<Vec3> = (0..14).map(corner).collect();
            let core = Polyhedron::convex_hull(&corners).expect("a hull");
            ContactShape::new(RoundedBody { core, radius: 1e-3 })
        };
        let (mut listed, mut passed_over) = (0, 0);
        for seed in 0..40 {
            let shapes = [shape(seed, 1.0), shape(seed + 400, 3.0)];
            let share = |speed: f64| (speed * seed as f64).sin();
            let turn = Vec3::new(share(1.1), share(2.3), share(3.7));
            let away = Vec3::new(share(0.7), share(1.9), share(2.9)).normalize() * 25e-3;
            let poses = [Pose::identity(), Pose::identity().moved(&away, &turn)];
            let corners = [0, 1].map(|k: usize| {
                let vertices = &shapes[k].rounded.core.vertices;
                vertices.iter().map(|v| poses[k].to_space(v)).collect::<Vec<_>>()
            });
            let skin = 2e-3;
            let list = PairFeatures::list(&shapes, &corners, &poses, (0, 1), [skin, 0.0]);
            for (own, found) in [&list.vertices_of_a, &list.vertices_of_b].into_iter().enumerate() {
                let (core, others) = (&shapes[1 - own].rounded.core, &corners[1 - own]);
                for (vertex, p) in corners[own].iter().enumerate() {
                    let to =
                        |facet: &[usize; 3]| (closest_on_triangle(p, facet.map(|v| &others[v])).0 - p).norm();
                    let distances: Vec<f64> = core.facets.iter().map(to).collect();
                    let nearest = distances.iter().copied().fold(f64::INFINITY, f64::min);
                    let is_near = |facet: &u32| distances[*facet as usize] <= nearest + 2.0 * skin;
                    let near: Vec<u32> = (0..distances.len() as u32).filter(is_near).collect();
                    let known = found.iter().find(|reach| reach.vertex as usize == vertex);
                    assert_eq!(known.is_some(), nearest < 2e-3 + skin, "{seed} {own} {vertex}");
                    if let Some(known) = known {
                        assert_eq!(known.facets, near, "{seed} {own} {vertex}");
                        listed += near.len();
                        passed_over += distances.len() - near.len();
                    }
                }
            }
        }
        assert!(listed > 200 && passed_over > 200, "{listed} {passed_over}");
    }
}
