//! Removal of the overlaps that compaction leaves: grains that overlap, or stick out of the wall
//! panels or plates, are shifted apart along their normals, sweep by sweep; where the
//! walls leave no room, all positions and the walls are spread evenly by a little, and so on.

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
const SWEEP_TOLERANCE: f64 = 0.1;

/// Sweeps before each spread, and number of spreads at most.
const SWEEPS: usize = 60;
const SPREADS: usize = 80;

/// Share of the worst overlap by which positions and walls are spread.
const SPREAD: f64 = 0.2;

/// At most this much at a time, so that one deep overlap does not open the whole packing.
const LARGEST_SPREAD: f64 = 1e-4;

/// Pairs with a larger gap than this share of the smaller sieve size are left out of the sweeps
/// until the next spread.
const NEAR: f64 = 0.03;

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

/// Moves grains until no pair overlaps by more than the tolerance, spreading positions and walls
/// evenly where the walls leave no room.
///
/// # Errors
/// `Error::Specimen` where that cannot be reached in bounded work.
pub fn relax(grains: &[GrainShape], poses: &mut [Pose], walls: &mut Walls) -> Result<Relaxation> {
    let mut contacts = Contacts::near(grains, poses);
    let before = contacts.worst_overlap(poses);
    let (mut sweeps, mut spread) = (0, 1.0);
    for _ in 0..SPREADS {
        for _ in 0..SWEEPS {
            let worst = contacts.sweep(poses, walls);
            sweeps += 1;
            if worst <= SWEEP_TOLERANCE * OVERLAP_TOLERANCE {
                break;
            }
        }
        contacts = Contacts::near(grains, poses);
        let worst = contacts.worst_overlap(poses);
        if worst <= 0.5 * OVERLAP_TOLERANCE {
            return Ok(Relaxation { overlap: [before, worst], sweeps, spread });
        }
        let factor = 1.0 + (SPREAD * worst).min(LARGEST_SPREAD);
        spread *= factor;
        poses.iter_mut().for_each(|p| p.position *= factor);
        walls.radius *= factor;
        walls.height *= factor;
    }
    let worst = contacts.worst_overlap(poses);
    Err(Error::Specimen(format!(
        "grains overlap by {worst:.1e} of their size, and shifting them apart does not mend it"
    )))
}

/// The pairs of grains that may touch.
struct Contacts<'a> {
    grains: &'a [GrainShape],
    shapes: Vec<GjkShape>,
    pairs: Vec<(usize, usize)>,
}

impl<'a> Contacts<'a> {
    fn near(grains: &'a [GrainShape], poses: &[Pose]) -> Self {
        let unit = grains.iter().map(|g| g.sieve_size).fold(0.0, f64::max);
        let shapes: Vec<GjkShape> = grains.iter().map(|g| GjkShape::new(&g.rounded.core, unit)).collect();
        let balls: Vec<Ball> = grains
            .iter()
            .zip(poses.iter())
            .map(|(g, p)| Ball { centre: p.position, radius: g.rounded.bounding_radius() })
            .collect();
        let mut contacts = Contacts { grains, shapes, pairs: vec![] };
        contacts.pairs = near_pairs(&balls, NEAR * unit)
            .into_iter()
            .filter(|&(i, j)| contacts.gap(poses, i, j).0 <= NEAR * contacts.size(i, j))
            .collect();
        contacts
    }

    fn size(&self, i: usize, j: usize) -> f64 {
        self.grains[i].sieve_size.min(self.grains[j].sieve_size)
    }

    /// Shifts every overlapping pair apart and every grain inside; the worst overlap it met.
    fn sweep(&self, poses: &mut [Pose], walls: &Walls) -> f64 {
        let mut worst = 0.0f64;
        for &(i, j) in &self.pairs {
            let (gap, normal) = self.gap(poses, i, j);
            if gap < 0.0 {
                let shift = normal * (-0.5 * gap);
                poses[i].position -= shift;
                poses[j].position += shift;
                worst = worst.max(-gap / self.size(i, j));
            }
        }
        for (grain, pose) in self.grains.iter().zip(poses.iter_mut()) {
            push_inside(grain, pose, walls);
        }
        worst
    }

    /// Worst overlap over the smaller sieve size.
    fn worst_overlap(&self, poses: &[Pose]) -> f64 {
        let overlap = |&(i, j): &(usize, usize)| -self.gap(poses, i, j).0 / self.size(i, j);
        self.pairs.iter().map(overlap).fold(0.0, f64::max)
    }

    /// Gap of two rounded bodies [m] with the direction from the first to the second; a gap that is
    /// well above the near range may come back as infinite.
    fn gap(&self, poses: &[Pose], i: usize, j: usize) -> (f64, Vec3) {
        let reach = self.grains[i].rounded.radius + self.grains[j].rounded.radius;
        let within = reach + 2.0 * NEAR * self.size(i, j);
        match gjk_closest_points(&self.shapes[i], &poses[i], &self.shapes[j], &poses[j], within) {
            None => (f64::INFINITY, Vec3::zeros()),
            Some(closest) if closest.distance > 1e-3 * reach => (closest.distance - reach, closest.direction),
            Some(_) => {
                let (a, b) = (&self.grains[i].rounded.core, &self.grains[j].rounded.core);
                let axis = separating_axis(a, &poses[i], b, &poses[j]);
                (axis.gap - reach, axis.direction)
            }
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
