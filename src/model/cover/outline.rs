//! What a cover is draped over, and what that found.

use serde::{Deserialize, Serialize};

use crate::geometry::Polyhedron;
use crate::tensor::{Pose, Vec3};

/// A grain's outline: facet planes of `core` moved outwards by `rounding`, or a sphere where the
/// core is a point. A nominal polyhedron comes with `rounding` 0.
#[derive(Debug, Clone, Copy)]
pub struct Outline<'a> {
    /// Index of the body in the model's list of poses.
    pub body: usize,
    pub core: &'a Polyhedron,
    /// Radius of the rounding [m].
    pub rounding: f64,
    pub pose: Pose,
}

/// Where the cover is fastened to a plate: a horizontal circle on the plate's inner face.
#[derive(Debug, Clone, Copy)]
pub struct Rim {
    /// Index of the plate in the model's list of poses.
    pub body: usize,
    pub pose: Pose,
    /// Centre of the circle in space [m].
    pub centre: Vec3,
    /// Radius of the circle [m].
    pub radius: f64,
}

/// What draping found.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct DrapeStatistics {
    /// Nodes taken out because they met a pore: facets span the place.
    pub bridged_nodes: usize,
    /// Mean distance of the nodes on grains from the axis [m].
    pub mean_radius: f64,
}

impl Outline<'_> {
    /// Radius [m] about the body's position that holds the body.
    pub(super) fn reach(&self) -> f64 {
        self.core.bounding_radius() + self.rounding
    }

    /// Distance [m] at which the ray from `origin` (outside, in space) along the unit vector `direction`
    /// enters the outline.
    pub(super) fn entry(&self, origin: &Vec3, direction: &Vec3) -> Option<f64> {
        if self.core.facets.is_empty() {
            let origin = self.pose.to_body(origin) - self.core.vertices[0];
            let direction = self.pose.rotation.inverse() * direction;
            let along = -origin.dot(&direction);
            let half_chord = self.rounding.powi(2) - (origin.norm_squared() - along * along);
            return (half_chord >= 0.0).then(|| along - half_chord.sqrt());
        }
        let origin = self.pose.to_body(origin);
        let direction = self.pose.rotation.inverse() * direction;
        let (mut enter, mut leave) = (0.0, f64::INFINITY);
        for (facet, normal) in self.core.facets.iter().zip(&self.core.normals) {
            let inside_by = normal.dot(&(self.core.vertices[facet[0]] - origin)) + self.rounding;
            let slope = normal.dot(&direction);
            if slope < 0.0 {
                enter = f64::max(enter, inside_by / slope);
            } else if slope > 0.0 {
                leave = f64::min(leave, inside_by / slope);
            } else if inside_by < 0.0 {
                return None;
            }
        }
        (enter <= leave).then_some(enter)
    }
}
