//! A semicircular masonry arch of equal blocks under its own weight.
//!
//! Without sliding it stands iff a line of thrust fits into it (Heyman 1966): for many blocks, t/R above 0.1075, R to the middle of its
//! thickness (Milankovitch 1907). For a given number of blocks the least thickness follows from the same statics: with the thrust `H` at
//! the crown at height `r0`, the resultant crosses the joint at `theta` from the crown at the radius
//! `(H r0 + W x) / (H cos(theta) + W sin(theta))`, W being the weight between and x the distance of its centroid from the
//! crown. Blocks hinge about the corners of their cores, r from both faces, and where meshed faces carry over their area, about sharp corners. Tried at 2 % of the thickness on either side: contacts
//! yield by micrometres, which an arch at its limit feels 1e-3 as much as thickness, and forces balance to 1e-5.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::scene::SceneParameters;
use crate::verification::bodies::{body, cuboid, fixed, gravity, hull, meshed_by_area, scene, sharp};
use crate::verification::standing::stands;
use crate::verification::{Absolute, Findings, Run};

/// Radius to the middle of the thickness [m], width of the arch [m].
const RADIUS: f64 = 1.0;
const WIDTH: f64 = 0.2;
/// Of the blocks' edges [m].
const ROUNDING: f64 = 1e-3;

/// The corners of a block of an arch of `count` blocks and thickness `t`, its joints half an angle to either side of the vertical: in the
/// x-z plane, counter-clockwise from its inner left one.
fn block(count: usize, t: f64) -> [[f64; 2]; 4] {
    let (sin, cos) = (0.5 * PI / count as f64).sin_cos();
    let (inner, outer) = (RADIUS - 0.5 * t, RADIUS + 0.5 * t);
    [
        [-inner * sin, inner * cos],
        [inner * sin, inner * cos],
        [outer * sin, outer * cos],
        [-outer * sin, outer * cos],
    ]
}

/// Area and height of the centroid of a block.
fn area_and_height(corners: &[[f64; 2]; 4]) -> [f64; 2] {
    let (mut area, mut moment) = (0.0, 0.0);
    for k in 0..4 {
        let ([x0, z0], [x1, z1]) = (corners[k], corners[(k + 1) % 4]);
        let cross = x0 * z1 - x1 * z0;
        area += 0.5 * cross;
        moment += (z0 + z1) * cross / 6.0;
    }
    [area, moment / area]
}

/// How far a line of thrust can stay inside the joints of half an arch of an even number of blocks: the largest
/// `min over pairs of joints of (outer - inner)` that some thrust H leaves; it stands iff that is not negative.
fn room(count: usize, t: f64, rounding: f64) -> f64 {
    let [area, height] = area_and_height(&block(count, t));
    let step = PI / count as f64;
    // The core's corners on a joint: r from the joint's face and r from the inner or outer one.
    let shift = |corner: f64| rounding / (0.5 * corner).tan();
    let inner = RADIUS - 0.5 * t + shift(FRAC_PI_2 + 0.5 * step);
    let outer = RADIUS + 0.5 * t - shift(FRAC_PI_2 - 0.5 * step);
    let mut joints = vec![[1.0, 0.0, 0.0, 0.0]];
    let (mut weight, mut moment) = (0.0, 0.0);
    for k in 0..count / 2 {
        let middle = (k as f64 + 0.5) * step;
        weight += area;
        moment += area * height * middle.sin();
        let (sin, cos) = ((k + 1) as f64 * step).sin_cos();
        joints.push([cos, sin, weight, moment]);
    }
    let gap = |thrust: f64| {
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for [cos, sin, weight, moment] in &joints {
            let across = thrust * cos + weight * sin;
            low = low.max(inner * across - moment);
            high = high.min(outer * across - moment);
        }
        high - low
    };
    // Concave in the thrust.
    let (mut from, mut to) = (0.0, weight);
    for _ in 0..200 {
        let [a, b] = [from + (to - from) / 3.0, to - (to - from) / 3.0];
        if gap(a) < gap(b) { from = a } else { to = b }
    }
    gap(0.5 * (from + to))
}

/// The least thickness of an arch of `count` blocks, an even number, over its radius; blocks hinge `rounding` [m] from their faces.
pub fn least_thickness(count: usize, rounding: f64) -> f64 {
    let (mut low, mut high) = (0.01, 0.5);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if room(count, middle, rounding) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high) / RADIUS
}

/// An arch of `count` blocks, `thickness` over its radius, between two fixed abutments, under gravity.
pub fn arch(count: usize, thickness: f64) -> SceneParameters {
    let t = thickness * RADIUS;
    let corners = block(count, t);
    let [_, height] = area_and_height(&corners);
    // Around the block's centroid, so that it turns about that.
    let points: Vec<[f64; 3]> =
        corners.iter().flat_map(|[x, z]| [-0.5, 0.5].map(|y| [*x, y * WIDTH, z - height])).collect();
    let step = PI / count as f64;
    let mut bodies: Vec<_> = [-1.0, 1.0]
        .map(|side| {
            let shape = cuboid([2.0 * t, 2.0 * WIDTH, 0.1]);
            fixed(body(
                if side < 0.0 { "left" } else { "right" },
                shape,
                [side * RADIUS, 0.0, -0.05],
                [0.0; 3],
            ))
        })
        .into();
    for k in 0..count {
        let angle = (k as f64 + 0.5) * step - FRAC_PI_2;
        let place = [height * angle.sin(), 0.0, height * angle.cos()];
        bodies.push(body(&format!("block {k}"), hull(&points, ROUNDING), place, [0.0, angle, 0.0]));
    }
    let mut parameters = sharp(scene(bodies, 1.0, vec![gravity(4, [0.0, 0.0, -9.81])]));
    // What stands is found in some ten augmentations.
    parameters.settings.max_augmentations = 60;
    parameters
}

pub(super) fn stands_or_falls(findings: &mut Findings) {
    let ((many, few), time) = crate::verification::timed(|| (least_thickness(2000, ROUNDING), 0.1075));
    // Printed with four digits; the blocks' rounding adds 2 r = 0.002.
    let what = "least t/R less 2 r, thrust line, 2000 blocks";
    let computed = many - 2.0 * ROUNDING / RADIUS;
    findings.compare(what, computed, few, Absolute(1e-4), time);
    let mut tried = |what: String, parameters: &SceneParameters, expected: bool| {
        let run = Run::of(parameters);
        findings.stands(what, &run, stands(&run), expected);
    };
    for (share, expected) in [(1.02, true), (0.98, false)] {
        for count in [12, 24] {
            let what = format!("{count} blocks, t/R {share} of the least");
            tried(what, &arch(count, share * least_thickness(count, ROUNDING)), expected);
        }
        let thickness = share * least_thickness(12, 0.0);
        let what = format!("12 meshed ones by area, {share} of the least");
        tried(what, &meshed_by_area(arch(12, thickness), 0.3), expected);
    }
}
