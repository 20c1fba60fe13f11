//! Where a patch of two faces is felt when at least one of them is meshed.
//!
//! A uniform traction goes through without disturbance where both meshes get the nodal forces that it has on each of them, the
//! integrals of their shape functions. Those are smooth on the segments that both triangulations cut the patch into, so each segment's
//! triangles take the three-point rule of degree 2. Of these points (three for each triangle, hundreds for a dozen of facets) as many are
//! kept as both faces have nodes, with positive weights and the same nodal forces ([`fewest_weights`]): each costs three
//! unknowns of a condensed body. Total force and moment of a linear pressure stay exact, since quadratic functions are among the shape functions.
//!
//! The points are fixed to the second body. They are found once and stay until the faces have slid by [`SLID`]; what they
//! remember then goes to the nearest of the new ones.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::contact::face::Face;
use crate::contact::features::Feature;
use crate::contact::point_memory::PointMemory;
use crate::grain::Surface;
use crate::linalg::fewest_weights;
use crate::tensor::{Pose, Vec3};

/// How far a face may slide over another before the points are found anew, over the smaller rounding.
pub const SLID: f64 = 1e-2;

/// Facets within this (angle in rad, distance over the body's size) of a face lie on it.
const ON_FACE: f64 = 1e-4;
/// Segments below this share of the face's area are rounding.
const LEAST_SEGMENT: f64 = 1e-12;

/// The points of one patch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FaceRule {
    /// Of either body, by number.
    pub faces: (u32, u32),
    pub points: Vec<RulePoint>,
    /// Corners of the first face in the second one's axes [m] when the points were found.
    reference: Vec<[f64; 2]>,
}

/// A point in the second face's axes [m] and the area that it stands for [m^2].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RulePoint {
    pub at: [f64; 2],
    pub area: f64,
}

type Polygon = Vec<[f64; 2]>;

impl FaceRule {
    /// The points of two faces whose bodies are at `poses`; `surfaces` are their meshes, where they have one.
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
        let of_facets = |facets: Vec<[Vec3; 3]>, side: usize, ring: Polygon| -> Vec<Polygon> {
            let flat = |facet: &[Vec3; 3]| -> Polygon {
                let place = |p: &Vec3| if side == 0 { seen(p) } else { faces[1].coordinates(p) };
                facet.iter().map(place).collect()
            };
            if facets.is_empty() { vec![ring] } else { facets.iter().map(flat).collect() }
        };
        let own_ring = faces[1].ring.iter().map(|p| faces[1].coordinates(p)).collect();
        // Seen from outside the second face, what is counter-clockwise on the first runs clockwise.
        let first: Vec<Polygon> =
            of_facets(meshed(0), 0, reference.clone()).into_iter().map(backwards).collect();
        let second = of_facets(meshed(1), 1, own_ring);
        let mut points = Vec::new();
        for a in &first {
            for b in &second {
                segment_into(&mut points, a, b, LEAST_SEGMENT * faces[1].area);
            }
        }
        let points = fewest(points, faces, poses, surfaces);
        FaceRule { faces: numbers, points, reference }
    }

    pub fn feature(&self, point: usize) -> Feature {
        Feature::Faces(self.faces.0, self.faces.1, point as u32)
    }

    /// How far the first face has slid over the second since the points were found [m], with the bodies at `poses`.
    pub fn slid(&self, faces: [&Face; 2], poses: [&Pose; 2]) -> f64 {
        let moved = |(p, [x, y]): (&Vec3, &[f64; 2])| {
            let [to_x, to_y] = faces[1].coordinates(&poses[1].to_body(&poses[0].to_space(p)));
            (to_x - x).hypot(to_y - y)
        };
        faces[0].ring.iter().zip(&self.reference).map(moved).fold(0.0, f64::max)
    }

    /// What its points remember from those of an `old` rule for the same faces.
    pub fn remember(&self, old: &FaceRule, memory: &[PointMemory]) -> Vec<PointMemory> {
        let taken = |(k, point): (usize, &RulePoint)| {
            let away = |other: &RulePoint| (other.at[0] - point.at[0]).hypot(other.at[1] - point.at[1]);
            let nearest = (0..old.points.len())
                .min_by(|&i, &j| away(&old.points[i]).total_cmp(&away(&old.points[j])))?;
            let kept = memory.iter().find(|kept| kept.feature == old.feature(nearest))?;
            let share = point.area / old.points[nearest].area;
            Some(PointMemory {
                feature: self.feature(k),
                pressure: kept.pressure * share,
                load: kept.load * share,
                hardened: kept.hardened * share,
                traction: kept.traction * share,
                bound: kept.bound * share,
                tangential_energy: kept.tangential_energy * share,
                ..*kept
            })
        };
        self.points.iter().enumerate().filter_map(taken).collect()
    }
}

/// Adds the three points of each triangle of the common part of two convex polygons that run counter-clockwise.
fn segment_into(points: &mut Vec<RulePoint>, a: &Polygon, b: &Polygon, least: f64) {
    let apart = |axis: usize| {
        let range = |polygon: &Polygon| {
            let along = polygon.iter().map(|p| p[axis]);
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        };
        let ((low_a, high_a), (low_b, high_b)) = (range(a), range(b));
        low_a >= high_b || low_b >= high_a
    };
    if apart(0) || apart(1) {
        return;
    }
    let mut common = a.clone();
    for (k, from) in b.iter().enumerate() {
        let to = b[(k + 1) % b.len()];
        let height =
            |p: &[f64; 2]| (to[0] - from[0]) * (p[1] - from[1]) - (to[1] - from[1]) * (p[0] - from[0]);
        let mut kept = Polygon::with_capacity(common.len() + 1);
        for (i, start) in common.iter().enumerate() {
            let end = &common[(i + 1) % common.len()];
            let (before, after) = (height(start), height(end));
            if before >= 0.0 {
                kept.push(*start);
            }
            if (before < 0.0) != (after < 0.0) {
                let share = before / (before - after);
                kept.push([0, 1].map(|axis| start[axis] + (end[axis] - start[axis]) * share));
            }
        }
        common = kept;
    }
    for k in 1..common.len().saturating_sub(1) {
        let corners = [common[0], common[k], common[k + 1]];
        let side = |i: usize, axis: usize| corners[i][axis] - corners[0][axis];
        let area = 0.5 * (side(1, 0) * side(2, 1) - side(1, 1) * side(2, 0));
        if area > least {
            for i in 0..3 {
                let at = [0, 1].map(|axis| {
                    (corners[0][axis] + corners[1][axis] + corners[2][axis] + 3.0 * corners[i][axis]) / 6.0
                });
                points.push(RulePoint { at, area: area / 3.0 });
            }
        }
    }
}

/// As few of `points` as give the same nodal forces of a uniform traction.
fn fewest(
    points: Vec<RulePoint>,
    faces: [&Face; 2],
    poses: [&Pose; 2],
    surfaces: [Option<&Surface>; 2],
) -> Vec<RulePoint> {
    let mut rows: BTreeMap<(usize, u32), usize> = BTreeMap::new();
    let mut values: Vec<Vec<(usize, f64)>> = Vec::with_capacity(points.len());
    for point in &points {
        let here = faces[1].point(point.at);
        let places = [poses[0].to_body(&poses[1].to_space(&here)), here];
        let mut value = Vec::new();
        for (side, place) in places.iter().enumerate() {
            let Some(surface) = surfaces[side] else { continue };
            let place = surface.locate(place);
            for (&node, &weight) in place.nodes.iter().zip(&place.weights) {
                let next = rows.len();
                value.push((*rows.entry((side, node)).or_insert(next), weight));
            }
        }
        values.push(value);
    }
    let column = |value: &Vec<(usize, f64)>| {
        let mut column = vec![0.0; rows.len()];
        value.iter().for_each(|(row, weight)| column[*row] += weight);
        column
    };
    let columns: Vec<Vec<f64>> = values.iter().map(column).collect();
    let areas: Vec<f64> = points.iter().map(|point| point.area).collect();
    let kept = fewest_weights(&columns, &areas);
    let largest = kept.iter().copied().fold(0.0, f64::max);
    let with_area = |(point, area): (&RulePoint, f64)| RulePoint { area, ..*point };
    points.iter().zip(kept).map(with_area).filter(|point| point.area > 1e-12 * largest).collect()
}
