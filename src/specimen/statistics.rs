//! What a generated specimen is like: grading achieved, void ratio, contacts, shapes, overlaps.

use crate::geometry::neighbours::{Ball, near_pairs};
use crate::geometry::separation::{GjkShape, feature_distance, gjk_closest_points, separating_axis};
use crate::specimen::compaction::{DialEnd, Packing};
use crate::specimen::grading::{SizeClass, mass_fractions};
use crate::specimen::opening::square_opening;
use crate::specimen::placement::cylinder_volume;
use crate::specimen::relaxation::Relaxation;
use crate::specimen::shape::GrainShape;
use crate::tensor::Pose;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A contact is a gap below this share of the smaller grain's sieve size.
pub const CONTACT_TOLERANCE: f64 = 1e-3;

/// A grain with fewer contacts (grains, wall and plates) than this is a rattler.
pub const RATTLER_CONTACTS: usize = 3;

/// Grading of one class.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ClassStatistics {
    /// Sieve sizes [m].
    pub sizes: [f64; 2],
    /// Number of grains.
    pub grains: usize,
    /// Mass fraction asked and achieved.
    pub mass_fraction: [f64; 2],
}

/// Counts in equal intervals from `low` to `high`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Histogram {
    pub low: f64,
    pub high: f64,
    pub counts: Vec<usize>,
    pub mean: f64,
}

impl Histogram {
    /// Values outside count in the first or last interval.
    fn of(values: &[f64], low: f64, high: f64, intervals: usize) -> Self {
        let mut counts = vec![0; intervals];
        for value in values {
            let at = ((value - low) / (high - low) * intervals as f64).floor();
            counts[(at.max(0.0) as usize).min(intervals - 1)] += 1;
        }
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        Histogram { low, high, counts, mean }
    }
}

/// Statistics of a specimen. Ratios are dimensionless.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Statistics {
    pub classes: Vec<ClassStatistics>,
    /// Void ratio reached.
    pub void_ratio: f64,
    /// Void ratio of the loosest packing: at rest with the largest friction, under compaction pressure.
    pub loosest_void_ratio: f64,
    /// Whether compaction met the asked void ratio or came to an end of its range.
    pub compaction_end: Option<DialEnd>,
    /// Friction at which the compaction stopped.
    pub compaction_friction: f64,
    /// Time steps of the compaction.
    pub compaction_steps: usize,
    /// Volume of all nominal grains [m^3].
    pub solid_volume: f64,
    /// Factor by which the drawn grains were scaled to meet the asked diameter.
    pub grain_scale: f64,
    /// Grain contacts per grain (each pair counts for both), gap below [`CONTACT_TOLERANCE`].
    pub coordination_number: f64,
    /// The same over grains that are not rattlers.
    pub coordination_number_without_rattlers: f64,
    /// Grains with fewer than [`RATTLER_CONTACTS`] contacts, wall and plates included.
    pub rattlers: usize,
    /// Number of grain pairs in contact.
    pub contacts: usize,
    /// Worst overlap over the smaller sieve size: by GJK, and by separating axis and feature pairs.
    pub worst_overlap: [f64; 2],
    /// Worst overlap as compaction left it, over the smaller sieve size.
    pub overlap_before_relaxation: f64,
    /// Largest distance [m] by which a rounded grain passes the cylinder of the specimen's diameter.
    pub wall_protrusion: f64,
    /// Largest distance [m] by which a rounded grain passes the bottom or top plane.
    pub plate_protrusion: f64,
    /// Intermediate over long, and short over intermediate semi-axis of the ellipsoid.
    pub elongation: Histogram,
    pub flatness: Histogram,
    /// Surface of the ball of equal volume over the grain's surface (Wadell).
    pub sphericity: Histogram,
    pub vertices: Histogram,
    pub facets: Histogram,
    /// Smallest square hole that the polyhedron passes over its sieve size.
    pub square_opening: Histogram,
}

/// Volume of voids over volume of the nominal grains in a cylinder [m].
pub(super) fn void_ratio(grains: &[GrainShape], diameter: f64, height: f64) -> f64 {
    let solid: f64 = grains.iter().map(|g| g.nominal.volume()).sum();
    cylinder_volume(diameter, height) / solid - 1.0
}

/// Which grains touch, and how far they overlap and stand out.
struct Touching {
    contacts: usize,
    rattlers: usize,
    /// Contacts of grains that are no rattlers, counted at both.
    held: usize,
    worst_overlap: [f64; 2],
    wall_protrusion: f64,
    plate_protrusion: f64,
}

impl Touching {
    fn of(grains: &[GrainShape], poses: &[Pose], [diameter, height]: [f64; 2]) -> Self {
        let mut touching = vec![0usize; grains.len()];
        let mut bearing = vec![0usize; grains.len()];
        let mut worst_overlap = [0.0f64; 2];
        for &(i, j, gap, independent) in &pair_gaps(grains, poses) {
            let size = grains[i].sieve_size.min(grains[j].sieve_size);
            worst_overlap = [worst_overlap[0].max(-gap / size), worst_overlap[1].max(-independent / size)];
            if gap <= CONTACT_TOLERANCE * size {
                for k in [i, j] {
                    touching[k] += 1;
                    bearing[k] += 1;
                }
            }
        }
        let (mut wall_protrusion, mut plate_protrusion) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        for (k, (grain, pose)) in grains.iter().zip(poses).enumerate() {
            let r = grain.rounded.radius;
            let mut outermost = [f64::NEG_INFINITY; 3];
            for vertex in &grain.rounded.core.vertices {
                let x = pose.to_space(vertex);
                let passes = [x.xy().norm() + r - 0.5 * diameter, r - x.z, x.z + r - height];
                (0..3).for_each(|m| outermost[m] = outermost[m].max(passes[m]));
            }
            wall_protrusion = wall_protrusion.max(outermost[0]);
            plate_protrusion = plate_protrusion.max(outermost[1]).max(outermost[2]);
            // The wall was a polygon about 0.3 % of the radius inside the circle.
            let near_wall = [
                -0.005 * diameter,
                -CONTACT_TOLERANCE * grain.sieve_size,
                -CONTACT_TOLERANCE * grain.sieve_size,
            ];
            bearing[k] += (0..3).filter(|&m| outermost[m] >= near_wall[m]).count();
        }
        let contacts = touching.iter().sum::<usize>() / 2;
        let rattlers = bearing.iter().filter(|&&n| n < RATTLER_CONTACTS).count();
        let held: usize =
            touching.iter().zip(&bearing).filter(|(_, b)| **b >= RATTLER_CONTACTS).map(|(t, _)| *t).sum();
        Touching { contacts, rattlers, held, worst_overlap, wall_protrusion, plate_protrusion }
    }
}

/// Measures a specimen of this diameter and height [m].
pub fn measure(
    (grains, poses): (&[GrainShape], &[Pose]),
    [diameter, height]: [f64; 2],
    classes: &[SizeClass],
    packing: &Packing,
    relaxation: &Relaxation,
    grain_scale: f64,
) -> Statistics {
    let solid_volume: f64 = grains.iter().map(|g| g.nominal.volume()).sum();
    let class_statistics = classes
        .iter()
        .zip(mass_fractions(classes.len(), grains))
        .enumerate()
        .map(|(c, (class, achieved))| ClassStatistics {
            sizes: class.sizes,
            grains: grains.iter().filter(|g| g.class == c).count(),
            mass_fraction: [class.mass_fraction, achieved],
        })
        .collect();

    let Touching { contacts, rattlers, held, worst_overlap, wall_protrusion, plate_protrusion } =
        Touching::of(grains, poses, [diameter, height]);
    let sorted: Vec<[f64; 3]> = grains
        .iter()
        .map(|g| {
            let mut axes = g.semi_axes;
            axes.sort_by(|a, b| b.total_cmp(a));
            axes
        })
        .collect();
    let each = |f: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..grains.len()).map(f).collect() };
    let openings: Vec<f64> =
        grains.par_iter().map(|g| square_opening(&g.nominal.vertices) / g.sieve_size).collect();
    let sphericity = |k: usize| {
        let shape = &grains[k].nominal;
        (36.0 * PI * shape.volume().powi(2)).cbrt() / shape.area()
    };
    Statistics {
        classes: class_statistics,
        void_ratio: void_ratio(grains, diameter, height),
        loosest_void_ratio: packing.loosest,
        compaction_end: Some(packing.end),
        compaction_friction: packing.friction,
        compaction_steps: packing.steps,
        solid_volume,
        grain_scale,
        coordination_number: 2.0 * contacts as f64 / grains.len() as f64,
        coordination_number_without_rattlers: held as f64 / (grains.len() - rattlers).max(1) as f64,
        rattlers,
        contacts,
        worst_overlap,
        overlap_before_relaxation: relaxation.overlap[0],
        wall_protrusion,
        plate_protrusion,
        elongation: Histogram::of(&each(&|k| sorted[k][1] / sorted[k][0]), 0.0, 1.0, 20),
        flatness: Histogram::of(&each(&|k| sorted[k][2] / sorted[k][1]), 0.0, 1.0, 20),
        sphericity: Histogram::of(&each(&sphericity), 0.0, 1.0, 20),
        vertices: Histogram::of(&each(&|k| grains[k].nominal.vertices.len() as f64), 0.0, 32.0, 32),
        facets: Histogram::of(&each(&|k| grains[k].nominal.facets.len() as f64), 0.0, 64.0, 32),
        square_opening: Histogram::of(&openings, 0.5, 1.1, 12),
    }
}

/// Pairs near contact with their gap [m] by GJK and by an independent way.
pub fn pair_gaps(grains: &[GrainShape], poses: &[Pose]) -> Vec<(usize, usize, f64, f64)> {
    let unit = grains.iter().map(|g| g.sieve_size).fold(0.0, f64::max);
    let shapes: Vec<GjkShape> = grains.iter().map(|g| GjkShape::new(&g.rounded.core, unit)).collect();
    let balls: Vec<Ball> = grains
        .iter()
        .zip(poses)
        .map(|(g, p)| Ball { centre: p.position, radius: g.rounded.bounding_radius() })
        .collect();
    let margin =
        |i: usize, j: usize| 10.0 * CONTACT_TOLERANCE * grains[i].sieve_size.min(grains[j].sieve_size);
    near_pairs(&balls, 10.0 * CONTACT_TOLERANCE * unit)
        .into_par_iter()
        .filter_map(|(i, j)| {
            let reach = grains[i].rounded.radius + grains[j].rounded.radius;
            let (a, b) = (&grains[i].rounded.core, &grains[j].rounded.core);
            let axis = separating_axis(a, &poses[i], b, &poses[j]);
            if axis.gap > reach + margin(i, j) {
                return None;
            }
            let closest =
                gjk_closest_points(&shapes[i], &poses[i], &shapes[j], &poses[j], 2.0 * reach + margin(i, j));
            let gap = closest.map_or(f64::INFINITY, |c| c.distance) - reach;
            let independent =
                if axis.gap > 0.0 { feature_distance(a, &poses[i], b, &poses[j]) } else { axis.gap } - reach;
            Some((i, j, gap, independent))
        })
        .filter(|&(i, j, gap, independent)| gap.min(independent) <= margin(i, j))
        .collect()
}
