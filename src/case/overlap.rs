//! Whether bodies of a scene overlap at the start. Touching is fine.

use crate::geometry::Polyhedron;
use crate::geometry::separation::{point_triangle_distance, separating_axis};
use crate::tensor::{Pose, Rotation, Vec3};

use super::types::{BodyCase, ShapeCase};

/// Overlap [m] over the smaller body's size that still counts as touching: rotation vectors and
/// coordinates are written with few digits.
const TOUCHING: f64 = 1e-6;

/// A convex body in its place: a polyhedron, or a ball as a point with a radius.
#[derive(Clone)]
pub struct Placed {
    pub shape: Polyhedron,
    radius: f64,
    pose: Pose,
    /// Largest distance from the position [m].
    reach: f64,
    /// [m]
    size: f64,
}

impl Placed {
    /// `made` is the hull of a mesh file or a random grain; `None` where there is none.
    ///
    /// # Errors
    /// The problem of a polyhedron without volume.
    pub fn new(body: &BodyCase, made: Option<Polyhedron>) -> Result<Option<Placed>, String> {
        let (shape, radius) = match &body.shape {
            ShapeCase::Box(size) => (Polyhedron::cuboid(*size).map_err(|e| e.to_string())?, 0.0),
            ShapeCase::Sphere(radius) => (Polyhedron::point(), *radius),
            ShapeCase::Cylinder { radius, length, sides } => {
                let prism = Polyhedron::cylinder(*radius, *length, *sides);
                (prism.map_err(|e| e.to_string())?, 0.0)
            }
            ShapeCase::Polyhedron(points) => {
                let points: Vec<Vec3> = points.iter().map(|p| Vec3::from(*p)).collect();
                (hull(&points)?, 0.0)
            }
            ShapeCase::Mesh(_) | ShapeCase::Grain(_) => match made {
                Some(hull) => (hull, 0.0),
                None => return Ok(None),
            },
        };
        let rotation = Rotation::from_scaled_axis(Vec3::from(body.rotation));
        let reach = shape.bounding_radius() + radius;
        let size = extent(&shape.vertices) + 2.0 * radius;
        Ok(Some(Placed { shape, radius, pose: Pose::new(Vec3::from(body.position), rotation), reach, size }))
    }

    /// [m]
    pub fn size(&self) -> f64 {
        self.size
    }

    /// The middle of its vertices, in space [m].
    pub fn middle(&self) -> Vec3 {
        self.pose.to_space(&(self.shape.vertices.iter().sum::<Vec3>() / self.shape.vertices.len() as f64))
    }

    /// Extents along its own axes [m].
    pub fn extents(&self) -> [f64; 3] {
        std::array::from_fn(|k| {
            let along = || self.shape.vertices.iter().map(|v| v[k]);
            along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
                + 2.0 * self.radius
        })
    }

    /// The least of them [m].
    pub fn smallest_extent(&self) -> f64 {
        self.extents().into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Where the body lies at most along a space axis [m].
    pub fn span(&self, axis: usize) -> [f64; 2] {
        let centre = self.pose.position[axis];
        [centre - self.reach, centre + self.reach]
    }

    /// The extents along x and y of its lowest or highest part, in space [m].
    pub fn end_face(&self, upper: bool) -> [[f64; 2]; 2] {
        let places: Vec<Vec3> = self.shape.vertices.iter().map(|v| self.pose.to_space(v)).collect();
        let up = if upper { 1.0 } else { -1.0 };
        let highest = places.iter().map(|p| up * p.z).fold(f64::NEG_INFINITY, f64::max);
        let near = |p: &&Vec3| up * p.z > highest - TOUCHING * self.size;
        std::array::from_fn(|k| {
            let along = || places.iter().filter(near).map(|p| p[k]);
            [along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max)]
        })
    }

    /// Depth of the overlap [m]; `None` if the bodies are apart or touch.
    pub fn overlap(&self, other: &Placed) -> Option<f64> {
        let apart = (self.pose.position - other.pose.position).norm();
        if apart > self.reach + other.reach {
            return None;
        }
        let gap = match (self.radius > 0.0, other.radius > 0.0) {
            (true, true) => apart,
            (true, false) => other.distance_of(&self.pose.position),
            (false, true) => self.distance_of(&other.pose.position),
            (false, false) => separating_axis(&self.shape, &self.pose, &other.shape, &other.pose).gap,
        };
        let depth = self.radius + other.radius - gap;
        (depth > TOUCHING * self.size.min(other.size)).then_some(depth)
    }

    /// Of a point from the polyhedron's surface [m]; negative inside.
    fn distance_of(&self, point: &Vec3) -> f64 {
        let point = self.pose.to_body(point);
        let corners = |facet: &[usize; 3]| facet.map(|v| self.shape.vertices[v]);
        let highest = self.shape.facets.iter().zip(&self.shape.normals);
        let highest = highest.map(|(facet, normal)| normal.dot(&(point - corners(facet)[0])));
        match highest.fold(f64::NEG_INFINITY, f64::max) {
            inside if inside <= 0.0 => inside,
            _ => {
                let distances =
                    self.shape.facets.iter().map(|f| point_triangle_distance(&point, &corners(f)));
                distances.fold(f64::INFINITY, f64::min)
            }
        }
    }
}

fn extent(points: &[Vec3]) -> f64 {
    points.iter().map(|p| (p - points[0]).norm()).fold(0.0, f64::max)
}

fn hull(points: &[Vec3]) -> Result<Polyhedron, String> {
    /// Volume over cubed size below which a hull counts as flat.
    const FLAT: f64 = 1e-9;
    match Polyhedron::convex_hull(points) {
        Ok(hull) if hull.volume() > FLAT * extent(points).powi(3) => Ok(hull),
        _ => Err("has no volume: its vertices lie in a plane".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(shape: ShapeCase, position: [f64; 3], rotation: [f64; 3]) -> Placed {
        let body = BodyCase {
            name: "body".into(),
            shape,
            mesh_size: None,
            refine: None,
            position,
            rotation,
            fidelity: None,
            rock: None,
            friction: None,
            rounding: None,
            fixed: false,
        };
        Placed::new(&body, None).expect("a volume").expect("a convex body")
    }

    #[test]
    fn depth_is_the_known_one() {
        use std::f64::consts::{FRAC_PI_4, SQRT_2};
        let cube = |z: f64, rotation| body(ShapeCase::Box([1.0; 3]), [0.0, 0.0, z], rotation);
        let ball = |z: f64| body(ShapeCase::Sphere(0.5), [0.0, 0.0, z], [0.0; 3]);
        let level = [0.0; 3];
        let crossed = |z: f64| (cube(0.0, [FRAC_PI_4, 0.0, 0.0]), cube(z, [0.0, FRAC_PI_4, 0.0]));
        let near = |found: Option<f64>, expected: f64| (found.expect("an overlap") - expected).abs() < 1e-12;
        assert!(near(cube(0.0, level).overlap(&cube(0.9, level)), 0.1));
        assert!(near(ball(0.0).overlap(&ball(0.9)), 0.1));
        assert!(near(ball(0.9).overlap(&cube(0.0, level)), 0.1));
        assert!(near(cube(0.0, level).overlap(&ball(0.4)), 0.6));
        let (lower, upper) = crossed(SQRT_2 - 0.1);
        assert!(near(lower.overlap(&upper), 0.1));
        let (lower, upper) = crossed(SQRT_2 + 1e-9);
        assert_eq!(lower.overlap(&upper), None);
        // Touching, and within the digits that people write.
        assert_eq!(cube(0.0, level).overlap(&cube(1.0, level)), None);
        assert_eq!(cube(0.0, level).overlap(&cube(1.0 - 1e-7, level)), None);
        // Beside an edge the axis of the facets alone would see an overlap.
        let beside = body(ShapeCase::Sphere(0.5), [0.9, 0.0, 0.9], [0.0; 3]);
        assert_eq!(cube(0.0, level).overlap(&beside), None);
    }
}
