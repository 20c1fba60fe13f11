//! Whether bodies of a scene overlap at the start. Touching is fine.

use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query;
use parry3d_f64::shape::SharedShape;

use super::types::{BodyCase, ShapeCase};

/// Overlap [m] over the smaller body's size that still counts as touching: rotation vectors and
/// coordinates are written with few digits.
const TOUCHING: f64 = 1e-6;

/// A body ready for distance queries; `None` for a mesh, which is not read yet here.
pub struct Placed {
    pose: Pose,
    shape: SharedShape,
    size: f64,
}

impl Placed {
    /// # Errors
    /// The problem of a polyhedron without volume.
    pub fn new(body: &BodyCase) -> Result<Option<Placed>, String> {
        let vector = |x: &[f64; 3]| Vector::new(x[0], x[1], x[2]);
        let shape = match &body.shape {
            ShapeCase::Box(size) => SharedShape::cuboid(size[0] / 2.0, size[1] / 2.0, size[2] / 2.0),
            ShapeCase::Sphere(radius) => SharedShape::ball(*radius),
            ShapeCase::Polyhedron(points) => {
                let points: Vec<_> = points.iter().map(vector).collect();
                hull(&points)?
            }
            ShapeCase::Mesh(_) => return Ok(None),
        };
        let pose = Pose::new(vector(&body.position), vector(&body.rotation));
        let size = 2.0 * shape.compute_local_bounding_sphere().radius;
        Ok(Some(Placed { pose, shape, size }))
    }

    /// Depth of the overlap [m]; `None` if the bodies are apart or touch.
    pub fn overlap(&self, other: &Placed) -> Option<f64> {
        let apart = (self.pose.translation - other.pose.translation).length();
        let reach = |body: &Placed| {
            let sphere = body.shape.compute_local_bounding_sphere();
            sphere.center.length() + sphere.radius
        };
        if apart > reach(self) + reach(other) {
            return None;
        }
        let contact =
            query::contact(&self.pose, &*self.shape, &other.pose, &*other.shape, 0.0).ok().flatten()?;
        let depth = -contact.dist;
        (depth > TOUCHING * self.size.min(other.size)).then_some(depth)
    }
}

fn hull(points: &[Vector]) -> Result<SharedShape, String> {
    let flat = || "has no volume: its vertices lie in a plane".to_string();
    let (vertices, facets) = parry3d_f64::transformation::try_convex_hull(points).map_err(|_| flat())?;
    let volume: f64 = facets
        .iter()
        .map(|f| {
            let [a, b, c] = f.map(|i| vertices[i as usize] - vertices[0]);
            a.dot(b.cross(c)) / 6.0
        })
        .sum();
    let reach = vertices.iter().map(|v| (*v - vertices[0]).length()).fold(0.0, f64::max);
    if !(volume > 1e-9 * reach.powi(3)) {
        return Err(flat());
    }
    SharedShape::convex_mesh(vertices, &facets).ok_or_else(flat)
}
