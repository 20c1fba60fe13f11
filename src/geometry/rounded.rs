//! Rounded convex bodies: a convex core swept by a ball of radius r.
//!
//! The core is the nominal polyhedron inset by r: every facet plane moves inwards by r and the core
//! is the polytope of the moved half spaces. The rounded body (Minkowski sum of core and ball)
//! therefore keeps each surviving facet exactly where the nominal one is and only loses its edges
//! and corners. A facet so small that its moved plane no longer bounds the polytope disappears.
//! All lengths in m, in body coordinates; the origin stays that of the nominal body.

use crate::error::{Error, Result};
use crate::geometry::polyhedron::Polyhedron;
use crate::tensor::Vec3;
use serde::{Deserialize, Serialize};

/// A convex core rounded by a ball.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RoundedBody {
    /// The inset polytope; a single point for a sphere.
    pub core: Polyhedron,
    /// Radius of the rounding ball [m].
    pub radius: f64,
}

/// The half space `normal . x <= offset`, with a unit normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfSpace {
    /// Outward unit normal.
    pub normal: Vec3,
    /// Distance of the plane from the origin along the normal [m].
    pub offset: f64,
}

/// Planes closer than this (angle in rad, offset over the body's size) are one plane.
const COPLANAR: f64 = 1e-9;

/// Vertex merging distances over the body's size, tried in turn until the surface closes.
const MERGE: [f64; 9] = [1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3];

impl RoundedBody {
    /// The body whose facets are those of `nominal` and whose edges are rounded with `radius` [m].
    ///
    /// # Errors
    /// `Error::Mesh` where `radius` is negative or not finite, or does not fit into the body.
    pub fn inset(nominal: &Polyhedron, radius: f64) -> Result<Self> {
        if !(radius >= 0.0 && radius.is_finite()) {
            return Err(fault(format!("radius {radius} m is not a length")));
        }
        if radius == 0.0 {
            return Ok(RoundedBody { core: nominal.clone(), radius });
        }
        let mut planes = facet_planes(nominal);
        planes.iter_mut().for_each(|plane| plane.offset -= radius);
        let size = nominal.size();
        let core = polytope(&planes, nominal.vertices[0], size).map_err(|reason| {
            fault(format!(
                "a rounding radius of {radius} m does not fit into a body of size {size} m: {reason}"
            ))
        })?;
        Ok(RoundedBody { core, radius })
    }

    /// A sphere of radius `radius` [m] about the origin.
    pub fn sphere(radius: f64) -> Self {
        RoundedBody { core: Polyhedron::point(), radius }
    }

    /// Largest distance of a surface point from the origin [m].
    pub fn bounding_radius(&self) -> f64 {
        self.core.bounding_radius() + self.radius
    }

    /// The body scaled about the origin.
    pub fn scaled(&self, factor: f64) -> Self {
        RoundedBody { core: self.core.scaled(factor), radius: self.radius * factor }
    }
}

/// The distinct facet planes of a convex polyhedron, coplanar facets counted once.
pub fn facet_planes(shape: &Polyhedron) -> Vec<HalfSpace> {
    let size = shape.bounding_radius();
    let mut planes: Vec<HalfSpace> = Vec::with_capacity(shape.facets.len());
    for (facet, normal) in shape.facets.iter().zip(&shape.normals) {
        let offset = facet.iter().map(|&v| normal.dot(&shape.vertices[v])).sum::<f64>() / 3.0;
        let known = planes
            .iter()
            .any(|p| (p.normal - normal).norm() < COPLANAR && (p.offset - offset).abs() < COPLANAR * size);
        if !known {
            planes.push(HalfSpace { normal: *normal, offset });
        }
    }
    planes
}

/// Planes of a hull or a cut body closer than this (angle in rad, offset over the body's size) are one.
const SAME_PLANE: f64 = 1e-7;
/// Height over its base below which three points are on a line, over the size of the body.
const COLLINEAR: f64 = 1e-6;

/// The part of a convex polyhedron inside all `planes`.
///
/// # Errors
/// `Error::Mesh` where nothing is left that has volume.
pub fn intersection(shape: &Polyhedron, planes: &[HalfSpace]) -> Result<Polyhedron> {
    let size = shape.size();
    let mut all = facet_planes(shape);
    for plane in planes {
        let outside = |v: &Vec3| plane.normal.dot(v) - plane.offset > SAME_PLANE * size;
        if shape.vertices.iter().any(outside) {
            add_plane(&mut all, *plane, size);
        }
    }
    polytope(&all, shape.vertices[0], size).map_err(fault)
}

/// Points up to which [`plain_hull`] is made; beyond, it would take seconds.
pub const MOST_PLAIN: usize = 300;

/// The convex hull of `points` [m] with nothing but true corners: points inside of facets and edges are dropped, and no facet is a
/// sliver. By trying the plane through any three points, so for tens of points.
///
/// # Errors
/// `Error::Mesh` where they have no volume.
pub fn plain_hull(points: &[Vec3]) -> Result<Polyhedron> {
    let first = *points.first().ok_or_else(|| fault("a hull of no points".into()))?;
    let size = points.iter().map(|v| (v - first).norm()).fold(0.0, f64::max);
    let mut planes: Vec<HalfSpace> = vec![];
    for (i, a) in points.iter().enumerate() {
        for (j, b) in points.iter().enumerate().skip(i + 1) {
            for c in &points[j + 1..] {
                let (along, across) = (b - a, c - a);
                let normal = along.cross(&across);
                let longest = along.norm().max(across.norm()).max((c - b).norm());
                if !(normal.norm() > COLLINEAR * size * longest) {
                    continue;
                }
                let normal = normal.normalize();
                let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
                for height in points.iter().map(|p| normal.dot(&(p - a))) {
                    (low, high) = (low.min(height), high.max(height));
                    if low < -SAME_PLANE * size && high > SAME_PLANE * size {
                        break;
                    }
                }
                if high <= SAME_PLANE * size {
                    add_plane(&mut planes, HalfSpace { normal, offset: normal.dot(a) + high }, size);
                } else if low >= -SAME_PLANE * size {
                    let offset = -normal.dot(a) - low;
                    add_plane(&mut planes, HalfSpace { normal: -normal, offset }, size);
                }
            }
        }
    }
    polytope(&planes, first, size).map_err(fault)
}

/// Adds a plane, or moves the one that is there already inwards to it.
fn add_plane(planes: &mut Vec<HalfSpace>, plane: HalfSpace, size: f64) {
    let known = planes.iter_mut().find(|p| {
        (p.normal - plane.normal).norm() < 100.0 * SAME_PLANE
            && (p.offset - plane.offset).abs() < 100.0 * SAME_PLANE * size
    });
    match known {
        Some(known) => known.offset = known.offset.min(plane.offset),
        None => planes.push(plane),
    }
}

/// The bounded polytope of `planes`, which lies within `size` [m] of `near`.
///
/// Each plane's polygon is cut out of a large square by all other planes; corners of different
/// polygons that agree within a merging distance become one vertex, so that any number of planes may
/// meet in a vertex. Facets keep the normals of their planes. The reason of a failure is returned.
fn polytope(planes: &[HalfSpace], near: Vec3, size: f64) -> Result<Polyhedron, String> {
    let polygons: Vec<Vec<Vec3>> =
        (0..planes.len()).map(|index| facet_polygon(planes, index, near, size)).collect();
    if polygons.iter().filter(|p| p.len() >= 3).count() < 4 {
        return Err("nothing is left inside the moved facets".into());
    }
    let mut reason = String::new();
    for merge in MERGE {
        match close_surface(planes, &polygons, merge * size) {
            Ok(core) => return Ok(core),
            Err(problem) => reason = problem,
        }
    }
    Err(reason)
}

/// The convex polygon that the other planes leave of plane `index`, counter-clockwise from outside.
pub(crate) fn facet_polygon(planes: &[HalfSpace], index: usize, near: Vec3, size: f64) -> Vec<Vec3> {
    let HalfSpace { normal, offset } = planes[index];
    let centre = near + normal * (offset - normal.dot(&near));
    let axis = normal.iamin();
    let u = normal.cross(&Vec3::ith(axis, 1.0)).normalize() * (4.0 * size);
    let v = normal.cross(&u);
    let mut polygon = vec![centre - u - v, centre + u - v, centre + u + v, centre - u + v];
    let mut kept = Vec::with_capacity(16);
    for (other, plane) in planes.iter().enumerate() {
        if other == index {
            continue;
        }
        kept.clear();
        for (k, &start) in polygon.iter().enumerate() {
            let end = polygon[(k + 1) % polygon.len()];
            let (a, b) = (plane.normal.dot(&start) - plane.offset, plane.normal.dot(&end) - plane.offset);
            if a <= 0.0 {
                kept.push(start);
            }
            if (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0) {
                kept.push(start + (end - start) * (a / (a - b)));
            }
        }
        std::mem::swap(&mut polygon, &mut kept);
        if polygon.len() < 3 {
            return vec![];
        }
    }
    polygon
}

/// Joins the polygons into a closed surface, or says why they do not close.
fn close_surface(planes: &[HalfSpace], polygons: &[Vec<Vec3>], merge: f64) -> Result<Polyhedron, String> {
    let mut vertices: Vec<Vec3> = vec![];
    let mut facets = vec![];
    let mut normals = vec![];
    for (plane, polygon) in planes.iter().zip(polygons) {
        let mut ring: Vec<usize> = Vec::with_capacity(polygon.len());
        for corner in polygon {
            let id = vertices.iter().position(|v| (v - corner).norm() <= merge).unwrap_or_else(|| {
                vertices.push(*corner);
                vertices.len() - 1
            });
            if ring.last() != Some(&id) {
                ring.push(id);
            }
        }
        while ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
        if ring.len() < 3 {
            continue;
        }
        for triangle in best_fan(&vertices, &ring) {
            facets.push(triangle);
            normals.push(plane.normal);
        }
    }
    let used: std::collections::BTreeSet<usize> = facets.iter().flatten().copied().collect();
    let renumber: Vec<usize> = (0..vertices.len()).map(|v| used.range(..v).count()).collect();
    let vertices: Vec<Vec3> = used.iter().map(|&v| vertices[v]).collect();
    let facets: Vec<[usize; 3]> = facets.iter().map(|f: &[usize; 3]| f.map(|v| renumber[v])).collect();

    let mut core = Polyhedron::from_facets(vertices, facets).map_err(|e| e.to_string())?;
    core.normals = normals;
    if core.vertices.len() + core.facets.len() != core.edges.len() + 2 {
        return Err("the moved facets do not close".into());
    }
    let slack = 4.0 * merge;
    let inside = |v: &Vec3| planes.iter().all(|p| p.normal.dot(v) - p.offset <= slack);
    if !core.vertices.iter().all(inside) || core.volume().is_nan() || core.volume() <= 0.0 {
        return Err("the moved facets enclose nothing".into());
    }
    Ok(core)
}

/// The fan over the convex `ring` whose smallest triangle is largest.
fn best_fan(vertices: &[Vec3], ring: &[usize]) -> Vec<[usize; 3]> {
    let count = ring.len();
    let fan = |start: usize| -> Vec<[usize; 3]> {
        (1..count - 1)
            .map(|k| [ring[start], ring[(start + k) % count], ring[(start + k + 1) % count]])
            .collect()
    };
    let smallest = |fan: &[[usize; 3]]| {
        fan.iter()
            .map(|f| {
                let [a, b, c] = f.map(|v| vertices[v]);
                (b - a).cross(&(c - a)).norm()
            })
            .fold(f64::INFINITY, f64::min)
    };
    (0..count).map(fan).max_by(|a, b| smallest(a).total_cmp(&smallest(b))).unwrap_or_default()
}

fn fault(message: String) -> Error {
    Error::Mesh { name: "rounded body".into(), message }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn box_insets_to_the_smaller_box() {
        for (size, r) in [([2.0, 3.0, 4.0], 0.25), ([1.0, 1.0, 1.0], 0.02), ([0.02, 0.03, 0.5], 0.009)] {
            let body = RoundedBody::inset(&Polyhedron::cuboid(size).expect("a box"), r).expect("fits");
            let expected: f64 = size.iter().map(|s| s - 2.0 * r).product();
            assert_eq!(body.core.vertices.len(), 8);
            assert_eq!(body.core.facets.len(), 12);
            assert!((body.core.volume() - expected).abs() < 1e-12 * size[2].powi(3));
            for vertex in &body.core.vertices {
                for k in 0..3 {
                    assert!((vertex[k].abs() - (0.5 * size[k] - r)).abs() < 1e-13);
                }
            }
        }
    }

    #[test]
    fn box_cut_by_planes() {
        let shape = Polyhedron::cuboid([2.0, 3.0, 4.0]).expect("a box");
        let half = intersection(&shape, &[HalfSpace { normal: Vec3::z(), offset: -0.5 }]).expect("a part");
        assert!((half.volume() - 9.0).abs() < 1e-12);
        // Off one corner: a tetrahedron of edges 0.3 sqrt 3 along the axes.
        let normal = Vec3::repeat(1.0 / 3.0_f64.sqrt());
        let corner = normal.dot(&Vec3::new(1.0, 1.5, 2.0));
        let rest = intersection(&shape, &[HalfSpace { normal, offset: corner - 0.3 }]).expect("a part");
        assert!((24.0 - rest.volume() - (0.3 * 3.0_f64.sqrt()).powi(3) / 6.0).abs() < 1e-12);
        assert!(intersection(&shape, &[HalfSpace { normal: Vec3::x(), offset: -1.5 }]).is_err());
    }

    #[test]
    fn a_plain_hull_has_true_corners_only() {
        // A box with points all over its faces and edges, turned so that nothing is exact.
        let turn = crate::tensor::Rotation::from_scaled_axis(Vec3::new(0.3, 1.0, -0.4));
        let steps = |k: usize| [-0.5, -0.2, 0.1, 0.5][k];
        let points: Vec<Vec3> =
            (0..64).map(|k| turn * Vec3::new(steps(k % 4), steps(k / 4 % 4), steps(k / 16))).collect();
        let hull = plain_hull(&points).expect("a hull");
        assert_eq!((hull.vertices.len(), hull.facets.len()), (8, 12));
        assert!((hull.volume() - 1.0).abs() < 1e-12);
        assert!(plain_hull(&points[..4]).is_err() && plain_hull(&[]).is_err());
    }

    #[test]
    fn octahedron_keeps_its_fourfold_corners() {
        let corners = [Vec3::x(), -Vec3::x(), Vec3::y(), -Vec3::y(), Vec3::z(), -Vec3::z()];
        let shape = Polyhedron::convex_hull(&corners).expect("a hull");
        let body = RoundedBody::inset(&shape, 0.1).expect("fits");
        // |x| + |y| + |z| <= 1 becomes 1 - r sqrt 3.
        let reach = 1.0 - 0.1 * 3.0f64.sqrt();
        assert_eq!(body.core.vertices.len(), 6);
        assert!((body.core.bounding_radius() - reach).abs() < 1e-12);
        assert!((body.core.volume() - 4.0 / 3.0 * reach.powi(3)).abs() < 1e-12);
    }

    #[test]
    fn cone_of_many_facets_keeps_its_apex() {
        let count = 17;
        let mut points = vec![Vec3::new(0.0, 0.0, 2.0)];
        points.extend((0..count).map(|k| {
            let angle = std::f64::consts::TAU * k as f64 / count as f64;
            Vec3::new(angle.cos(), angle.sin(), 0.0)
        }));
        let shape = Polyhedron::convex_hull(&points).expect("a hull");
        let r = 0.05;
        let body = RoundedBody::inset(&shape, r).expect("fits");
        assert_eq!(body.core.vertices.len(), count + 1);
        // The side facets' inner radius is cos(pi/n); the apex sinks by r over the sine of their slope.
        let inner = (std::f64::consts::PI / count as f64).cos();
        let apex = 2.0 - r * (inner * inner + 4.0f64).sqrt() / inner;
        let top = body.core.vertices.iter().map(|v| v.z).fold(0.0, f64::max);
        assert!((top - apex).abs() < 1e-11, "{top} {apex}");
    }

    #[test]
    fn small_facets_vanish_and_the_core_closes() {
        // A cube with one corner cut off by less than the inset removes.
        let mut points = Polyhedron::cuboid([1.0, 1.0, 1.0]).expect("a box").vertices;
        let corner = points.pop().expect("a corner");
        points.extend((0..3).map(|k| corner - Vec3::ith(k, 0.01)));
        let shape = Polyhedron::convex_hull(&points).expect("a hull");
        let body = RoundedBody::inset(&shape, 0.1).expect("fits");
        assert_eq!(body.core.vertices.len(), 8);
        assert!((body.core.volume() - 0.512).abs() < 1e-12);
    }

    #[test]
    fn radius_that_does_not_fit_is_refused() {
        let shape = Polyhedron::cuboid([1.0, 2.0, 3.0]).expect("a box");
        assert!(RoundedBody::inset(&shape, 0.499).is_ok());
        for r in [0.5, 0.6, 10.0, -0.1, f64::NAN, f64::INFINITY] {
            assert!(RoundedBody::inset(&shape, r).is_err(), "{r}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn core_is_the_polytope_of_the_moved_planes(
            points in prop::collection::vec((-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64), 8..20),
            share in 0.001..0.9f64,
            turn in 0.0..6.0f64,
        ) {
            let turn = crate::tensor::Rotation::from_scaled_axis(Vec3::new(turn, 1.0, 0.3));
            let points: Vec<Vec3> = points.iter().map(|&(x, y, z)| turn * Vec3::new(x, y, z)).collect();
            let Ok(shape) = Polyhedron::convex_hull(&points) else { return Ok(()) };
            let centre = shape.centroid();
            let planes = facet_planes(&shape);
            let depth = planes.iter().map(|p| p.offset - p.normal.dot(&centre)).fold(f64::INFINITY, f64::min);
            prop_assume!(depth > 1e-3);
            let r = share * depth;
            let body = RoundedBody::inset(&shape, r).expect("a ball around the centroid fits");
            // Every vertex keeps the moved planes and lies on three of them or more.
            for vertex in &body.core.vertices {
                let gaps: Vec<f64> = planes.iter().map(|p| p.offset - r - p.normal.dot(vertex)).collect();
                prop_assert!(gaps.iter().all(|g| *g > -1e-9));
                prop_assert!(gaps.iter().filter(|g| g.abs() < 1e-6).count() >= 3);
            }
            // The centroid is inside every facet, and the surface is closed.
            for (facet, normal) in body.core.facets.iter().zip(&body.core.normals) {
                prop_assert!(normal.dot(&(body.core.vertices[facet[0]] - centre)) > 0.0);
            }
            let core = &body.core;
            prop_assert_eq!(core.vertices.len() + core.facets.len(), core.edges.len() + 2);
        }
    }
}
