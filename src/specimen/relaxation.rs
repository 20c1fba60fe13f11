//! Removal of the overlaps that compaction leaves: grains that overlap, or stick out of the wall
//! panels or plates, are shifted apart along their normals, sweep by sweep; what is left after that
//! is taken out by spreading all positions evenly.

use crate::error::{Error, Result};
use crate::geometry::neighbours::{Ball, near_pairs};
use crate::geometry::separation::{GjkShape, gjk_closest_points, separating_axis};
use crate::specimen::compaction::WALL_PANELS;
use crate::specimen::shape::GrainShape;
use crate::tensor::{Pose, Vec3};
use std::f64::consts::TAU;

/// Overlap that may remain between two grains, over the smaller one's sieve size.
pub const OVERLAP_TOLERANCE: f64 = 1e-4;

/// The sweeps stop at this fraction of the tolerance.
const SWEEP_TOLERANCE: f64 = 0.05;
const SWEEPS: usize = 200;
const SPREADS: usize = 20;

/// The chamber that the grains were compacted in, [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Walls {
    /// Inner radius of the polygon of wall panels.
    pub radius: f64,
    pub height: f64,
}

/// What the removal took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relaxation {
    /// Worst overlap over the smaller grain's sieve size, before and after.
    pub overlap: [f64; 2],
    pub sweeps: usize,
    /// Factor by which all positions were spread in the end, in plan and height.
    pub spread: f64,
}

/// Moves grains until no pair overlaps by more than the tolerance.
///
/// # Errors
/// `Error::Specimen` where that cannot be reached in bounded work.
pub fn relax(grains: &[GrainShape], poses: &mut [Pose], walls: &Walls) -> Result<Relaxation> {
    let unit = grains.iter().map(|g| g.sieve_size).fold(0.0, f64::max);
    let shapes: Vec<GjkShape> = grains.iter().map(|g| GjkShape::new(&g.rounded.core, unit)).collect();
    let balls: Vec<Ball> = grains
        .iter()
        .zip(poses.iter())
        .map(|(g, p)| Ball { centre: p.position, radius: g.rounded.bounding_radius() })
        .collect();
    let smallest = grains.iter().map(|g| g.sieve_size).fold(f64::INFINITY, f64::min);
    let pairs = near_pairs(&balls, 0.05 * smallest);

    let mut first = None;
    let mut sweeps = 0;
    let mut worst = 0.0;
    while sweeps < SWEEPS {
        worst = 0.0f64;
        for &(i, j) in &pairs {
            let (gap, normal) = contact_gap(grains, &shapes, poses, i, j);
            if gap < 0.0 {
                let shift = normal * (-0.5 * gap);
                poses[i].position -= shift;
                poses[j].position += shift;
                worst = worst.max(-gap / grains[i].sieve_size.min(grains[j].sieve_size));
            }
        }
        for (grain, pose) in grains.iter().zip(poses.iter_mut()) {
            push_inside(grain, pose, walls);
        }
        first.get_or_insert(worst);
        sweeps += 1;
        if worst <= SWEEP_TOLERANCE * OVERLAP_TOLERANCE {
            break;
        }
    }
    let mut spread = 1.0;
    for _ in 0..SPREADS {
        worst = worst_overlap(grains, &shapes, poses, &pairs);
        if worst <= OVERLAP_TOLERANCE {
            return Ok(Relaxation { overlap: [first.unwrap_or(worst), worst], sweeps, spread });
        }
        // Centres are at least an inscribed radius apart, of the order of half the size.
        let factor = 1.0 + worst;
        spread *= factor;
        poses.iter_mut().for_each(|p| p.position *= factor);
    }
    Err(Error::Specimen(format!("grains still overlap by {worst:.1e} of their size after compaction")))
}

fn worst_overlap(
    grains: &[GrainShape],
    shapes: &[GjkShape],
    poses: &[Pose],
    pairs: &[(usize, usize)],
) -> f64 {
    pairs
        .iter()
        .map(|&(i, j)| {
            -contact_gap(grains, shapes, poses, i, j).0 / grains[i].sieve_size.min(grains[j].sieve_size)
        })
        .fold(0.0, f64::max)
}

/// Gap of two rounded bodies [m] with the direction from the first to the second; a gap that is
/// certainly positive may come back as infinite.
fn contact_gap(
    grains: &[GrainShape],
    shapes: &[GjkShape],
    poses: &[Pose],
    i: usize,
    j: usize,
) -> (f64, Vec3) {
    let reach = grains[i].rounded.radius + grains[j].rounded.radius;
    match gjk_closest_points(&shapes[i], &poses[i], &shapes[j], &poses[j], 1.5 * reach) {
        None => (f64::INFINITY, Vec3::zeros()),
        Some(closest) if closest.distance > 1e-3 * reach => (closest.distance - reach, closest.direction),
        Some(_) => {
            let (a, b) = (&grains[i].rounded.core, &grains[j].rounded.core);
            let axis = separating_axis(a, &poses[i], b, &poses[j]);
            (axis.gap - reach, axis.direction)
        }
    }
}

/// Shifts a grain back over panels and plates that it passes.
fn push_inside(grain: &GrainShape, pose: &mut Pose, walls: &Walls) {
    let r = grain.rounded.radius;
    let heights = grain.rounded.core.vertices.iter().map(|v| pose.to_space(v).z);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
    pose.position.z += (r - low).max(0.0) - (high + r - walls.height).max(0.0);
    if pose.position.xy().norm() + grain.rounded.bounding_radius() < walls.radius {
        return;
    }
    for k in 0..WALL_PANELS {
        let angle = TAU * k as f64 / WALL_PANELS as f64;
        let normal = Vec3::new(angle.cos(), angle.sin(), 0.0);
        let reach =
            grain.rounded.core.vertices.iter().map(|v| normal.dot(&pose.to_space(v))).fold(0.0, f64::max);
        pose.position -= normal * (reach + r - walls.radius).max(0.0);
    }
}
