//! The convex hull of points.

use crate::error::{Error, Result};
use crate::geometry::polyhedron::Polyhedron;
use crate::geometry::rounded::{MOST_PLAIN, plain_hull};
use crate::tensor::Vec3;

/// How far a vertex of a hull may stand out of a facet, over the hull's size; what has less volume than this, over the size cubed, is looked at twice.
const FLAT: f64 = 1e-6;

impl Polyhedron {
    /// The convex hull of `points` [m] (parry's, f64). Points inside are dropped. Where points within facets or edges mislead the
    /// library into triangles without area or turned over, or lie nearly in one plane, that of true corners alone.
    pub fn convex_hull(points: &[Vec3]) -> Result<Self> {
        let given: Vec<_> = points.iter().map(|p| parry3d_f64::math::Vector::new(p.x, p.y, p.z)).collect();
        let (vertices, facets) = parry3d_f64::transformation::try_convex_hull(&given)
            .map_err(|e| Error::Mesh { name: "convex hull".into(), message: e.to_string() })?;
        let vertices: Vec<Vec3> = vertices.iter().map(|p| Vec3::new(p.x, p.y, p.z)).collect();
        let facets = facets.iter().map(|f| f.map(|i| i as usize)).collect();
        match Polyhedron::from_facets(vertices.clone(), facets) {
            Ok(hull) if hull.is_convex() && hull.volume() > FLAT * hull.size().powi(3) => Ok(hull),
            Ok(_) | Err(_) if points.len() <= MOST_PLAIN => plain_hull(points),
            Ok(_) | Err(_) => plain_hull(&vertices),
        }
    }

    /// Whether no vertex lies in front of a facet, but for rounding.
    fn is_convex(&self) -> bool {
        let size = self.size();
        self.facets.iter().zip(&self.normals).all(|(facet, normal)| {
            let level = normal.dot(&self.vertices[facet[0]]);
            self.vertices.iter().all(|v| normal.dot(v) - level < FLAT * size)
        })
    }
}
