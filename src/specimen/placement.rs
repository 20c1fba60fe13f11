//! Random sequential placement: each grain, largest first, at a random place and rotation where it
//! touches nothing, in a cylinder wide enough for a solid fraction of 0.30.

use crate::error::{Error, Result};
use crate::geometry::neighbours::{Ball, BallGrid};
use crate::geometry::separation::{GjkShape, gjk_closest_points};
use crate::specimen::random::{Purpose, Stream};
use crate::specimen::shape::GrainShape;
use crate::tensor::{Pose, Vec3};
use std::f64::consts::{PI, TAU};

/// Solid fraction of the first try.
const SOLID_FRACTION: f64 = 0.30;

/// Each further try makes the cylinder's volume larger by this factor.
const ENLARGEMENT: f64 = 1.15;

const TRIES: usize = 12;

/// Positions tried for one grain.
const POSITIONS: usize = 5000;

/// Grains placed in a cylinder about the z axis, standing on z = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Placement {
    /// One per grain, in the grains' order.
    pub poses: Vec<Pose>,
    /// Radius of the cylinder [m].
    pub radius: f64,
    /// Height of the cylinder [m].
    pub height: f64,
}

/// Places grains, which come in descending size, into a cylinder of height over diameter `aspect`.
///
/// # Errors
/// `Error::Specimen` where some grain finds no place even in the widest cylinder tried.
pub fn place(grains: &[GrainShape], aspect: f64, seed: u64) -> Result<Placement> {
    let solid: f64 = grains.iter().map(|g| g.nominal.volume()).sum();
    let largest = grains.iter().map(|g| g.rounded.bounding_radius()).fold(0.0, f64::max);
    let shapes: Vec<GjkShape> = grains.iter().map(|g| GjkShape::new(&g.rounded.core, largest)).collect();
    for attempt in 0..TRIES {
        let volume = solid / SOLID_FRACTION * ENLARGEMENT.powi(attempt as i32);
        // A grain must be able to turn freely somewhere.
        let radius = (volume / (TAU * aspect)).cbrt().max(1.05 * largest);
        let height = (2.0 * aspect * radius).max(2.1 * largest);
        let radius = radius.max(height / (2.0 * aspect));
        if let Some(poses) = fill(grains, &shapes, radius, height, seed) {
            return Ok(Placement { poses, radius, height });
        }
    }
    Err(Error::Specimen(format!("{} grains cannot be placed at random without overlap", grains.len())))
}

fn fill(
    grains: &[GrainShape],
    shapes: &[GjkShape],
    radius: f64,
    height: f64,
    seed: u64,
) -> Option<Vec<Pose>> {
    let largest = grains.iter().map(|g| g.rounded.bounding_radius()).fold(0.0, f64::max);
    let mut grid = BallGrid::new(1.6 * largest);
    let mut poses: Vec<Pose> = Vec::with_capacity(grains.len());
    for (index, grain) in grains.iter().enumerate() {
        let mut stream = Stream::new(seed, Purpose::Placement, index as u64);
        let pose = (0..POSITIONS).find_map(|_| {
            let rotation = stream.rotation();
            let (from_axis, azimuth) = (radius * stream.unit().sqrt(), stream.between(0.0, TAU));
            let position =
                Vec3::new(from_axis * azimuth.cos(), from_axis * azimuth.sin(), stream.between(0.0, height));
            let pose = Pose::new(position, rotation);
            if !lies_within(grain, &pose, radius, height) {
                return None;
            }
            let ball = Ball { centre: position, radius: grain.rounded.bounding_radius() };
            let free = grid.near(&ball, 0.0).into_iter().all(|other| {
                let reach = grain.rounded.radius + grains[other].rounded.radius;
                gjk_closest_points(&shapes[index], &pose, &shapes[other], &poses[other], 2.0 * reach)
                    .is_none_or(|closest| closest.distance > reach)
            });
            free.then_some(pose)
        })?;
        grid.push(Ball { centre: pose.position, radius: grain.rounded.bounding_radius() });
        poses.push(pose);
    }
    Some(poses)
}

fn lies_within(grain: &GrainShape, pose: &Pose, radius: f64, height: f64) -> bool {
    let r = grain.rounded.radius;
    grain.rounded.core.vertices.iter().all(|v| {
        let x = pose.to_space(v);
        x.z >= r && x.z <= height - r && x.xy().norm() <= radius - r
    })
}

/// Volume of a cylinder [m^3].
pub fn cylinder_volume(diameter: f64, height: f64) -> f64 {
    0.25 * PI * diameter * diameter * height
}
