//! An overlap check that shares nothing with the contact search: every pair of bodies, by separating
//! axis and then by the least distance over all their features.

use crate::assembly::Contacts;
use crate::geometry::separation::{feature_distance, separating_axis};
use crate::model::{BodyKind, Model};
use crate::tensor::Pose;

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

/// What is wrong with the accepted state `poses`, whose contacts are `contacts`: bodies that overlap deeper than any contact knows of,
/// or whose cores overlap. `None` where nothing is. A condensed body's elastic displacement is taken off: these are
/// the undeformed bodies.
pub fn fault(model: &Model, contacts: &Contacts, poses: &[Pose]) -> Option<String> {
    let Overlap { a, b, depth } = deepest_overlap(model, poses)?;
    let points = contacts.pairs.iter().flat_map(|pair| &pair.points);
    let known = points
        .map(|point| point.evaluation.normal.dot(&point.state.elastic) - point.evaluation.gap)
        .fold(0.0, f64::max);
    let allowed = known + AGREE[0] * model.smallest_rounding() + AGREE[1];
    let roundings = model.shapes[a].rounded.radius + model.shapes[b].rounded.radius;
    let [first, second] = [a, b].map(|body| &model.bodies[body].name);
    if !(depth <= allowed) {
        Some(format!("{first} and {second} overlap by {depth:.3e} m, contacts know of {known:.3e} m"))
    } else if !(depth < roundings) {
        Some(format!("the cores of {first} and {second} overlap: {depth:.3e} m, roundings {roundings:.3e} m"))
    } else {
        None
    }
}

/// The deepest overlap of any two bodies at `poses`; `None` if there are no two. Where even the cores
/// overlap, the depth is theirs and both radii. Pairs of bodies that never move are left out, and what is no more.
pub fn deepest_overlap(model: &Model, poses: &[Pose]) -> Option<Overlap> {
    let still = |i: usize| matches!(model.bodies[i].kind, BodyKind::Fixed | BodyKind::Plate);
    let gone = |i: usize| model.bodies[i].kind == BodyKind::Gone;
    let mut deepest: Option<Overlap> = None;
    for b in 0..model.bodies.len() {
        for a in 0..b {
            if (still(a) && still(b)) || gone(a) || gone(b) {
                continue;
            }
            let [(core_a, radius_a), (core_b, radius_b)] =
                [a, b].map(|i| (&model.shapes[i].rounded.core, model.shapes[i].rounded.radius));
            let reach = core_a.bounding_radius() + radius_a + core_b.bounding_radius() + radius_b;
            let apart = (poses[a].position - poses[b].position).norm() - reach;
            let depth = if apart > 0.0 {
                -apart
            } else {
                let axis = separating_axis(core_a, &poses[a], core_b, &poses[b]);
                let points = core_a.facets.is_empty() && core_b.facets.is_empty();
                let distance = if axis.gap > 0.0 || points {
                    feature_distance(core_a, &poses[a], core_b, &poses[b])
                } else {
                    axis.gap
                };
                radius_a + radius_b - distance
            };
            if deepest.is_none_or(|d| depth > d.depth) {
                deepest = Some(Overlap { a, b, depth });
            }
        }
    }
    deepest
}
