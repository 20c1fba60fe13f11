//! How far apart two posed convex polyhedra are, found in three independent ways.
//!
//! - [`gjk_closest_points`]: Gilbert, Johnson & Keerthi's (1988) iteration, parry's; the fast one.
//! - [`feature_distance`]: the least distance over all vertex-facet and edge-edge pairs; exact for
//!   disjoint bodies and slow.
//! - [`separating_axis`]: the widest gap over facet normals and products of edges whose arcs on the
//!   Gauss map cross (Gregorius 2013); its sign is exact, and in overlap it is minus the penetration
//!   depth. For disjoint bodies whose closest features are a vertex and an edge or two vertices it
//!   is a lower bound of the distance.
//!
//! A point body (no facets) is allowed everywhere. Lengths in m.

use crate::geometry::polyhedron::Polyhedron;
use crate::tensor::{Pose, Vec3};
use parry3d_f64::math::{Pose as ParryPose, Rotation as ParryRotation, Vector};
use parry3d_f64::query::gjk::{CsoPoint, GJKResult, VoronoiSimplex, closest_points};
use parry3d_f64::shape::SupportMap;

/// A direction and the gap that two bodies leave along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeparatingAxis {
    /// Gap along the axis [m]; negative in overlap.
    pub gap: f64,
    /// Unit direction in space, from the first body to the second.
    pub direction: Vec3,
}

/// The axis along which two convex polyhedra are furthest apart, or overlap least.
///
/// Zero direction and `-inf` where neither body has a facet.
pub fn separating_axis(a: &Polyhedron, pose_a: &Pose, b: &Polyhedron, pose_b: &Pose) -> SeparatingAxis {
    // Everything in the frame of `a`.
    let relative = pose_a.rotation.inverse() * pose_b.rotation;
    let b_vertices: Vec<Vec3> = b.vertices.iter().map(|v| pose_a.to_body(&pose_b.to_space(v))).collect();
    let b_normals: Vec<Vec3> = b.normals.iter().map(|n| relative * n).collect();
    let mut best = SeparatingAxis { gap: f64::NEG_INFINITY, direction: Vec3::zeros() };

    for (facet, normal) in a.facets.iter().zip(&a.normals) {
        let nearest = lowest(&b_vertices, normal);
        best = wider(best, nearest - normal.dot(&a.vertices[facet[0]]), *normal);
    }
    for (facet, normal) in b.facets.iter().zip(&b_normals) {
        let nearest = lowest(&a.vertices, normal);
        best = wider(best, nearest - normal.dot(&b_vertices[facet[0]]), -normal);
    }
    for edge in &a.edges {
        let start = a.vertices[edge.vertices[0]];
        let along = a.vertices[edge.vertices[1]] - start;
        let (n0, n1) = (a.normals[edge.facets[0]], a.normals[edge.facets[1]]);
        let arc = n1.cross(&n0);
        for other in &b.edges {
            let (m0, m1) = (-b_normals[other.facets[0]], -b_normals[other.facets[1]]);
            if !arcs_cross(&n0, &n1, &arc, &m0, &m1) {
                continue;
            }
            let other_start = b_vertices[other.vertices[0]];
            let other_along = b_vertices[other.vertices[1]] - other_start;
            let product = along.cross(&other_along);
            let length = product.norm();
            if length <= 1e-9 * along.norm() * other_along.norm() {
                continue;
            }
            // Where arcs cross, the axis lies between the normals of the facets beside either edge.
            let axis = if product.dot(&(n0 + n1)) < 0.0 { -product / length } else { product / length };
            best = wider(best, axis.dot(&(other_start - start)), axis);
        }
    }
    SeparatingAxis { gap: best.gap, direction: pose_a.rotation * best.direction }
}

fn lowest(points: &[Vec3], direction: &Vec3) -> f64 {
    points.iter().map(|p| direction.dot(p)).fold(f64::INFINITY, f64::min)
}

fn wider(best: SeparatingAxis, gap: f64, direction: Vec3) -> SeparatingAxis {
    if gap > best.gap { SeparatingAxis { gap, direction } } else { best }
}

/// Whether the arc from `n0` to `n1` crosses that from `m0` to `m1` on the unit sphere.
fn arcs_cross(n0: &Vec3, n1: &Vec3, arc: &Vec3, m0: &Vec3, m1: &Vec3) -> bool {
    let (a, b) = (m0.dot(arc), m1.dot(arc));
    if a * b >= 0.0 {
        return false;
    }
    let other = m1.cross(m0);
    let (c, d) = (n0.dot(&other), n1.dot(&other));
    c * d < 0.0 && a * d > 0.0
}

/// Least distance [m] between two disjoint polyhedra over all pairs of features, but those whose levels along the line of the centres alone are further
/// apart than two of the vertices.
///
/// For overlapping bodies the value has no meaning: ask [`separating_axis`] first.
pub fn feature_distance(a: &Polyhedron, pose_a: &Pose, b: &Polyhedron, pose_b: &Pose) -> f64 {
    let b_vertices: Vec<Vec3> = b.vertices.iter().map(|v| pose_a.to_body(&pose_b.to_space(v))).collect();
    let mut least = f64::INFINITY;
    if a.facets.is_empty() && b.facets.is_empty() {
        return (a.vertices[0] - b_vertices[0]).norm();
    }
    let centre = |points: &[Vec3]| points.iter().sum::<Vec3>() / points.len() as f64;
    let along = (centre(&b_vertices) - centre(&a.vertices)).try_normalize(0.0).unwrap_or_default();
    let levels: Vec<f64> = a.vertices.iter().map(|v| along.dot(v)).collect();
    let b_levels: Vec<f64> = b_vertices.iter().map(|v| along.dot(v)).collect();
    let top = (0..levels.len()).max_by(|&i, &j| levels[i].total_cmp(&levels[j])).expect("a vertex");
    let bottom = (0..b_levels.len()).min_by(|&i, &j| b_levels[i].total_cmp(&b_levels[j])).expect("a vertex");
    least = least.min((a.vertices[top] - b_vertices[bottom]).norm());
    let (lowest, highest) = (b_levels[bottom] - least, levels[top] + least);
    let reaches = |v: &[usize]| v.iter().any(|&v| levels[v] >= lowest);
    let b_reaches = |v: &[usize]| v.iter().any(|&v| b_levels[v] <= highest);

    let near: Vec<&Vec3> = (0..levels.len()).filter(|&v| reaches(&[v])).map(|v| &a.vertices[v]).collect();
    let b_near: Vec<&Vec3> =
        (0..b_levels.len()).filter(|&v| b_reaches(&[v])).map(|v| &b_vertices[v]).collect();
    for facet in a.facets.iter().filter(|facet| reaches(&facet[..])) {
        let corners = facet.map(|v| a.vertices[v]);
        for point in &b_near {
            least = least.min(point_triangle_distance(point, &corners));
        }
    }
    for facet in b.facets.iter().filter(|facet| b_reaches(&facet[..])) {
        let corners = facet.map(|v| b_vertices[v]);
        for point in &near {
            least = least.min(point_triangle_distance(point, &corners));
        }
    }
    let b_edges: Vec<_> = b.edges.iter().filter(|edge| b_reaches(&edge.vertices)).collect();
    for edge in a.edges.iter().filter(|edge| reaches(&edge.vertices)) {
        let [p, q] = edge.vertices.map(|v| a.vertices[v]);
        for other in &b_edges {
            let [r, s] = other.vertices.map(|v| b_vertices[v]);
            least = least.min(segment_distance(&p, &q, &r, &s));
        }
    }
    least
}

/// Distance [m] of a point from a triangle.
pub fn point_triangle_distance(p: &Vec3, corners: &[Vec3; 3]) -> f64 {
    let l = closest_on_triangle(corners, p);
    let [a, b, c] = corners;
    (p - a - (b - a) * l[1] - (c - a) * l[2]).norm()
}

/// Area coordinates of the point of a triangle that is closest to `p`. Source: Ericson (2005), "Real-Time Collision Detection", 5.1.5.
pub fn closest_on_triangle([a, b, c]: &[Vec3; 3], p: &Vec3) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - w, w];
    }
    let sum = va + vb + vc;
    let (v, w) = (vb / sum, vc / sum);
    [1.0 - v - w, v, w]
}

/// Distance [m] between the segments `p q` and `r s` (Ericson 2005, section 5.1.9).
pub fn segment_distance(p: &Vec3, q: &Vec3, r: &Vec3, s: &Vec3) -> f64 {
    let (d1, d2, between) = (q - p, s - r, p - r);
    let (a, e, f) = (d1.norm_squared(), d2.norm_squared(), d2.dot(&between));
    if a == 0.0 && e == 0.0 {
        return between.norm();
    }
    if a == 0.0 {
        return (between - d2 * (f / e).clamp(0.0, 1.0)).norm();
    }
    let c = d1.dot(&between);
    if e == 0.0 {
        return (between + d1 * (-c / a).clamp(0.0, 1.0)).norm();
    }
    let b = d1.dot(&d2);
    let denominator = a * e - b * b;
    let mut t1 =
        if denominator > 1e-14 * a * e { ((b * f - c * e) / denominator).clamp(0.0, 1.0) } else { 0.0 };
    let mut t2 = (b * t1 + f) / e;
    if t2 < 0.0 {
        t2 = 0.0;
        t1 = (-c / a).clamp(0.0, 1.0);
    } else if t2 > 1.0 {
        t2 = 1.0;
        t1 = ((b - c) / a).clamp(0.0, 1.0);
    }
    (between + d1 * t1 - d2 * t2).norm()
}

/// The vertices of a convex body ready for many GJK calls, in lengths of `unit` so that parry's
/// absolute tolerances act on numbers of order one.
#[derive(Debug, Clone)]
pub struct GjkShape {
    vertices: Vec<Vector>,
    unit: f64,
}

impl GjkShape {
    /// `unit` [m] should be near the bodies' size and must be the same for the two of a pair.
    pub fn new(shape: &Polyhedron, unit: f64) -> Self {
        let vertices =
            shape.vertices.iter().map(|v| Vector::new(v.x / unit, v.y / unit, v.z / unit)).collect();
        GjkShape { vertices, unit }
    }
}

impl SupportMap for GjkShape {
    fn local_support_point(&self, direction: Vector) -> Vector {
        let mut best = (f64::NEG_INFINITY, Vector::ZERO);
        for vertex in &self.vertices {
            let height = vertex.dot(direction);
            if height > best.0 {
                best = (height, *vertex);
            }
        }
        best.1
    }
}

/// The closest points of two convex bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosestPoints {
    /// Closest point of the first and of the second body, in space [m].
    pub points: [Vec3; 2],
    /// Their distance [m]; zero in overlap, where the direction is zero too.
    pub distance: f64,
    /// Unit direction from the first to the second.
    pub direction: Vec3,
}

/// The closest points by GJK; `None` where the bodies are further apart than `within` [m].
pub fn gjk_closest_points(
    a: &GjkShape,
    pose_a: &Pose,
    b: &GjkShape,
    pose_b: &Pose,
    within: f64,
) -> Option<ClosestPoints> {
    let unit = a.unit;
    let relative_rotation = pose_a.rotation.inverse() * pose_b.rotation;
    let relative_position = pose_a.to_body(&pose_b.position) / unit;
    let relative = ParryPose::from_parts(
        Vector::new(relative_position.x, relative_position.y, relative_position.z),
        ParryRotation::from_xyzw(
            relative_rotation.i,
            relative_rotation.j,
            relative_rotation.k,
            relative_rotation.w,
        ),
    );
    let start = if relative.translation.length_squared() > 0.0 {
        relative.translation.normalize()
    } else {
        Vector::X
    };
    let mut simplex = VoronoiSimplex::new();
    simplex.reset(CsoPoint::from_shapes(&relative, a, b, start));
    match closest_points(&relative, a, b, within / unit, true, &mut simplex) {
        GJKResult::ClosestPoints(p, q, _) => {
            let [p, q] = [p, q].map(|x| pose_a.to_space(&(Vec3::new(x.x, x.y, x.z) * unit)));
            let distance = (q - p).norm();
            let direction = if distance > 0.0 { (q - p) / distance } else { Vec3::zeros() };
            Some(ClosestPoints { points: [p, q], distance, direction })
        }
        GJKResult::Intersection => {
            let middle = 0.5 * (pose_a.position + pose_b.position);
            Some(ClosestPoints { points: [middle, middle], distance: 0.0, direction: Vec3::zeros() })
        }
        GJKResult::Proximity(_) | GJKResult::NoIntersection(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::Rotation;
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_4, SQRT_2};

    fn cube() -> Polyhedron {
        Polyhedron::cuboid([1.0, 1.0, 1.0]).expect("a box")
    }

    fn at(x: f64, y: f64, z: f64, turn: Vec3) -> Pose {
        Pose::new(Vec3::new(x, y, z), Rotation::from_scaled_axis(turn))
    }

    fn all_three(a: &Polyhedron, pose_a: &Pose, b: &Polyhedron, pose_b: &Pose) -> [f64; 3] {
        let (ga, gb) = (GjkShape::new(a, 1.0), GjkShape::new(b, 1.0));
        let gjk = gjk_closest_points(&ga, pose_a, &gb, pose_b, 1e3).map_or(f64::NAN, |c| c.distance);
        [gjk, feature_distance(a, pose_a, b, pose_b), separating_axis(a, pose_a, b, pose_b).gap]
    }

    #[test]
    fn cubes_face_to_face_edge_to_edge_and_corner_to_corner() {
        let still = Pose::identity();
        let face = all_three(&cube(), &still, &cube(), &at(1.3, 0.2, -0.1, Vec3::zeros()));
        assert!(face.iter().all(|d| (d - 0.3).abs() < 1e-9), "{face:?}");
        // One cube turned about z, the other about y, edges crossing at right angles on the x axis.
        let (a, b) = (at(0.0, 0.0, 0.0, Vec3::z() * FRAC_PI_4), at(2.0, 0.0, 0.0, Vec3::y() * FRAC_PI_4));
        let edge = all_three(&cube(), &a, &cube(), &b);
        assert!(edge.iter().all(|d| (d - (2.0 - SQRT_2)).abs() < 1e-9), "{edge:?}");
        // Corner to corner: the axes give a lower bound only.
        let corner = all_three(&cube(), &still, &cube(), &at(2.0, 2.0, 2.0, Vec3::zeros()));
        assert!((corner[0] - 3.0f64.sqrt()).abs() < 1e-9);
        assert!((corner[1] - 3.0f64.sqrt()).abs() < 1e-12);
        assert!((corner[2] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn penetration_of_cubes_has_its_closed_form() {
        let face = separating_axis(&cube(), &Pose::identity(), &cube(), &at(0.7, 0.1, 0.2, Vec3::zeros()));
        assert!((face.gap + 0.3).abs() < 1e-12 && (face.direction - Vec3::x()).norm() < 1e-12);
        let (a, b) = (at(0.0, 0.0, 0.0, Vec3::z() * FRAC_PI_4), at(1.3, 0.0, 0.0, Vec3::y() * FRAC_PI_4));
        let edge = separating_axis(&cube(), &a, &cube(), &b);
        assert!((edge.gap - (1.3 - SQRT_2)).abs() < 1e-12 && (edge.direction - Vec3::x()).norm() < 1e-9);
    }

    #[test]
    fn points_are_bodies_too() {
        let point = Polyhedron::point();
        let pose = at(2.0, 0.1, 0.0, Vec3::zeros());
        let found = all_three(&cube(), &Pose::identity(), &point, &pose);
        assert!(found.iter().all(|d| (d - 1.5).abs() < 1e-9), "{found:?}");
        let (a, b) = (GjkShape::new(&point, 1.0), GjkShape::new(&point, 1.0));
        let closest = gjk_closest_points(&a, &Pose::identity(), &b, &pose, 10.0).expect("near");
        assert!((closest.distance - 4.01f64.sqrt()).abs() < 1e-12);
        assert!((feature_distance(&point, &Pose::identity(), &point, &pose) - 4.01f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn bodies_further_than_asked_are_none() {
        let shape = GjkShape::new(&cube(), 1.0);
        let far = at(3.0, 0.0, 0.0, Vec3::zeros());
        assert!(gjk_closest_points(&shape, &Pose::identity(), &shape, &far, 1.9).is_none());
        assert!(gjk_closest_points(&shape, &Pose::identity(), &shape, &far, 2.1).is_some());
    }

    fn hull() -> impl Strategy<Value = Polyhedron> {
        prop::collection::vec((-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64), 6..16).prop_filter_map(
            "a solid hull",
            |points| {
                let points: Vec<Vec3> = points.iter().map(|&(x, y, z)| Vec3::new(x, y, z)).collect();
                Polyhedron::convex_hull(&points).ok().filter(|h| h.volume() > 0.05)
            },
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]
        #[test]
        fn three_ways_agree(
            a in hull(),
            b in hull(),
            place in (0.2..2.5f64, -1.0..1.0f64, -1.0..1.0f64),
            turn in (-3.0..3.0f64, -3.0..3.0f64, -3.0..3.0f64),
        ) {
            let pose_a = at(0.3, -0.2, 0.1, Vec3::new(0.4, 0.5, -0.6));
            let pose_b = at(place.0, place.1, place.2, Vec3::new(turn.0, turn.1, turn.2));
            let [gjk, features, axis] = all_three(&a, &pose_a, &b, &pose_b);
            prop_assume!(axis.abs() > 1e-7);
            if axis > 0.0 {
                prop_assert!((gjk - features).abs() < 1e-7, "{gjk} {features}");
                prop_assert!(axis <= features + 1e-12);
            } else {
                prop_assert_eq!(gjk, 0.0);
                // Shifted by the depth along the axis, the bodies just touch.
                let found = separating_axis(&a, &pose_a, &b, &pose_b);
                let apart = Pose::new(pose_b.position - found.direction * (found.gap - 1e-6), pose_b.rotation);
                prop_assert!(separating_axis(&a, &pose_a, &b, &apart).gap > 0.0);
            }
        }
    }
}
