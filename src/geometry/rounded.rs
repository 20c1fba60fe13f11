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

/// A convex core rounded by a ball.
#[derive(Debug, Clone, PartialEq)]
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
const MERGE: [f64; 6] = [1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6];

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
        let size = nominal.vertices.iter().map(|v| (v - nominal.vertices[0]).norm()).fold(0.0, f64::max);
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
fn facet_polygon(planes: &[HalfSpace], index: usize, near: Vec3, size: f64) -> Vec<Vec3> {
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
    if !core.vertices.iter().all(inside) || !(core.volume() > 0.0) {
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
