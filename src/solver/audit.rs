//! An overlap check that does not rely on the contact search: of all pairs of bodies those that could be the deepest, by
//! separating axis and then by the least distance over all their features.

use crate::assembly::{ContactPoint, Contacts};
use crate::geometry::Polyhedron;
use crate::geometry::separation::{GjkShape, feature_distance, gjk_closest_points, separating_axis};
use crate::model::Model;
use crate::tensor::{Pose, Vec3};

/// Two rounded bodies that reach into each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap {
    pub a: usize,
    pub b: usize,
    /// [m]; negative where they are apart.
    pub depth: f64,
}

/// Depths that are found in different ways agree to this share of the smallest rounding, and to this length [m].
const AGREE: [f64; 2] = [1e-9, 1e-12];

/// What is wrong with the state `poses`, whose contacts are `contacts`: bodies that overlap deeper than any contact knows of,
/// or whose cores overlap. `None` where nothing is. A condensed body's elastic displacement is taken off: these are
/// the undeformed bodies.
pub fn fault(model: &Model, contacts: &Contacts, poses: &[Pose]) -> Option<String> {
    let Overlap { a, b, depth } = deepest_overlap(model, poses)?;
    let points = contacts.pairs.iter().flat_map(|pair| &pair.points);
    let known = points.map(ContactPoint::geometric_overlap).fold(0.0, f64::max);
    let allowed = known + AGREE[0] * model.smallest_rounding() + AGREE[1];
    let roundings = model.shapes[a].rounded.radius + model.shapes[b].rounded.radius;
    let allowed = allowed + missed_by_ends(model, [a, b], roundings - depth);
    let [first, second] = [a, b].map(|body| &model.bodies[body].name);
    if !(depth <= allowed) {
        Some(format!("{first} and {second} overlap by {depth:.3e} m, contacts know of {known:.3e} m"))
    } else if !(depth < roundings) {
        Some(format!("the cores of {first} and {second} overlap: {depth:.3e} m, roundings {roundings:.3e} m"))
    } else {
        None
    }
}

/// By how much more than its ends an edge that is too short to touch may be in the other body [m], where cores are so far `apart` [m]: the end next to
/// the closest point is half the edge away from it at most, at right angles to what is between the cores.
fn missed_by_ends(model: &Model, bodies: [usize; 2], apart: f64) -> f64 {
    let longest = bodies.map(|body| model.shapes[body].longest_silent_edge()).into_iter().fold(0.0, f64::max);
    apart.max(0.0).hypot(0.5 * longest) - apart.max(0.0)
}

/// The deepest overlap of any two bodies at `poses`; `None` if there are no two. Where even the cores
/// overlap, the depth is theirs and both radii; where bounding spheres are apart, it is minus what is between them. Pairs of bodies
/// that never move are left out, and what is no more.
///
/// A depth takes all features of a pair. So pairs come in the order of what theirs is at most, until the next cannot be deeper.
pub fn deepest_overlap(model: &Model, poses: &[Pose]) -> Option<Overlap> {
    let bodies = 0..model.bodies.len();
    let moving = bodies.clone().filter(|&i| !model.bodies[i].kind.is_support());
    let unit = moving.map(|i| model.shapes[i].rounded.bounding_radius()).fold(0.0, f64::max);
    let core = |i: usize| GjkShape::new(&model.shapes[i].rounded.core, unit);
    let cores: Vec<GjkShape> = bodies.clone().map(core).collect();
    let mut deepest: Option<Overlap> = None;
    let mut near = Vec::new();
    for (a, b) in bodies.flat_map(|b| (0..b).map(move |a| (a, b))).filter(|&(a, b)| model.can_meet(a, b)) {
        let apart = model.between_spheres(poses, a, b);
        if apart > 0.0 {
            deepest = deeper(deepest, Overlap { a, b, depth: -apart });
        } else {
            let pair = Pair::new(model, poses, [a, b]);
            near.push((pair.at_most([&cores[a], &cores[b]]), pair));
        }
    }
    near.sort_by(|x, y| y.0.total_cmp(&x.0));
    for (at_most, pair) in near {
        if deepest.is_some_and(|d| d.depth >= at_most) {
            break;
        }
        let [a, b] = pair.bodies;
        deepest = deeper(deepest, Overlap { a, b, depth: pair.depth() });
    }
    deepest
}

fn deeper(deepest: Option<Overlap>, found: Overlap) -> Option<Overlap> {
    deepest.filter(|deepest| !(found.depth > deepest.depth)).or(Some(found))
}

/// Two bodies in space.
struct Pair<'a> {
    bodies: [usize; 2],
    cores: [&'a Polyhedron; 2],
    poses: [&'a Pose; 2],
    /// Of both roundings [m].
    radii: f64,
}

impl<'a> Pair<'a> {
    fn new(model: &'a Model, poses: &'a [Pose], bodies: [usize; 2]) -> Self {
        let shapes = bodies.map(|i| &model.shapes[i].rounded);
        let radii = shapes[0].radius + shapes[1].radius;
        Pair { bodies, cores: shapes.map(|shape| &shape.core), poses: bodies.map(|i| &poses[i]), radii }
    }

    /// What the depth of an overlap cannot exceed [m]: along any direction cores lie at least as far apart as their extents do, and where
    /// they are disjoint hardly further along that between their closest points. That it bounds depends on neither search being right.
    fn at_most(&self, gjk: [&GjkShape; 2]) -> f64 {
        let [a, b] = self.poses;
        let closest = gjk_closest_points(gjk[0], a, gjk[1], b, f64::MAX);
        let Some(direction) = closest.map(|c| c.direction).filter(|d| *d != Vec3::zeros()) else {
            return f64::INFINITY;
        };
        let along = |side: usize| {
            let pose = self.poses[side];
            self.cores[side].vertices.iter().map(move |v| direction.dot(&pose.to_space(v)))
        };
        let gap = along(1).fold(f64::INFINITY, f64::min) - along(0).fold(f64::NEG_INFINITY, f64::max);
        self.radii - gap
    }

    /// How deep the bodies overlap [m], by separating axis and least distance over all features.
    fn depth(&self) -> f64 {
        let ([core_a, core_b], [a, b]) = (self.cores, self.poses);
        let axis = separating_axis(core_a, a, core_b, b);
        let points = core_a.facets.is_empty() && core_b.facets.is_empty();
        let distance =
            if axis.gap > 0.0 || points { feature_distance(core_a, a, core_b, b) } else { axis.gap };
        self.radii - distance
    }
}
