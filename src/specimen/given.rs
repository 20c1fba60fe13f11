//! Grains that come from elsewhere: a library of shapes to draw from, and packings of other codes.

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::specimen::compaction::{DialEnd, Packing, equal_area_factor};
use crate::specimen::grading::SizeClass;
use crate::specimen::placement::{Placement, cylinder_volume};
use crate::specimen::shape::{GrainShape, solid_hull};
use crate::specimen::statistics::void_ratio;
use crate::tensor::{Pose, Vec3};

/// A grain of another code's packing.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenGrain {
    /// Corners of its hull [m], body axes.
    pub corners: Vec<Vec3>,
    pub pose: Pose,
}

/// A packing of another code about the z axis, standing on z = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenPacking {
    pub grains: Vec<GivenGrain>,
    /// Whether it is compacted to the specimen's void ratio; else it is taken as it stands.
    pub compact: bool,
}

impl GivenPacking {
    /// Radius and height [m] of the cylinder about the grains.
    pub fn extent(&self) -> (f64, f64) {
        let corners =
            self.grains.iter().flat_map(|grain| grain.corners.iter().map(|c| grain.pose.to_space(c)));
        corners
            .fold((0.0, 0.0), |(radius, height): (f64, f64), x| (radius.max(x.xy().norm()), height.max(x.z)))
    }

    /// The grains in the classes of a grading, where they stand.
    pub(super) fn standing(
        &self,
        classes: &[SizeClass],
        rounding: f64,
    ) -> Result<(Vec<GrainShape>, Placement)> {
        let grain = |(index, given): (usize, &GivenGrain)| {
            let named = |e| Error::Specimen(format!("grain {index} of the packing: {e}"));
            let hull = solid_hull(&given.corners).map_err(named)?;
            let grain = GrainShape::of_hull(&hull, rounding).map_err(named)?;
            // What is finer than the grading is of its finest class.
            let class = classes.iter().position(|class| grain.sieve_size >= class.sizes[0]);
            let pose = Pose::new(given.pose.to_space(&hull.centroid()), given.pose.rotation);
            Ok((GrainShape { class: class.unwrap_or(classes.len() - 1), ..grain }, pose))
        };
        let found: Vec<_> = self.grains.par_iter().enumerate().map(grain).collect::<Result<_>>()?;
        let (grains, poses) = found.into_iter().unzip();
        let (radius, height) = self.extent();
        Ok((grains, Placement { poses, radius, height }))
    }
}

/// Volume of voids over volume of solids in the wall's polygon of inner radius `radius` [m].
pub fn void_ratio_within(radius: f64, height: f64, solid: f64) -> f64 {
    cylinder_volume(2.0 * radius * equal_area_factor(), height) / solid - 1.0
}

/// What compaction hands on, of a packing that is left as it stands: no steps.
pub(super) fn left_alone(placement: Placement, grains: &[GrainShape]) -> Packing {
    let Placement { poses, radius, height } = placement;
    let diameter = 2.0 * radius * equal_area_factor();
    Packing {
        poses,
        diameter,
        height,
        friction: 0.0,
        end: DialEnd::Met,
        loosest: void_ratio(grains, diameter, height),
        steps: 0,
    }
}

/// Shapes of sieve size 1 to draw from.
///
/// # Errors
/// `Error::Specimen` naming the shape that makes no grain.
pub fn library(shapes: &[Vec<Vec3>], rounding: f64) -> Result<Vec<GrainShape>> {
    let grain = |(index, corners): (usize, &Vec<Vec3>)| {
        let grain = GrainShape::of_corners(corners, rounding)
            .map_err(|e| Error::Specimen(format!("shape {index} of the library: {e}")))?;
        Ok(grain.scaled(1.0 / grain.sieve_size))
    };
    shapes.par_iter().enumerate().map(grain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::specimen::{SievePoint, SpecimenParameters, SpecimenSize, Statistics, generate, relaxation};
    use crate::tensor::Rotation;

    /// Corners of a box of these edges, anywhere.
    fn cuboid(edges: [f64; 3]) -> Vec<Vec3> {
        (0..8)
            .map(|k| {
                Vec3::from_fn(|i, _| if k >> i & 1 == 1 { edges[i] } else { 0.0 }) + Vec3::new(7.0, 0.0, 1.0)
            })
            .collect()
    }

    fn grading() -> Vec<SievePoint> {
        [(0.04, 1.0), (0.03, 0.5), (0.02, 0.0)].map(|(size, passing)| SievePoint { size, passing }).to_vec()
    }

    /// Boxes and flat boxes: all grains are one of them, scaled into their classes, and the masses meet the curve as random grains do.
    #[test]
    fn a_specimen_is_drawn_from_a_library() {
        let size = SpecimenSize::Grains { count: 40, aspect: 1.5 };
        let parameters = SpecimenParameters {
            shapes: vec![cuboid([2.0, 2.0, 2.0]), cuboid([30.0, 20.0, 15.0])],
            seed: 3,
            ..SpecimenParameters::new(grading(), size, 1.1)
        };
        let specimen = generate(&parameters, &mut |_, _| ()).expect("a specimen");
        assert_eq!(specimen.grains.len(), 40);
        let mut kinds = [0, 0];
        for grain in &specimen.grains {
            let [a, b, c] = grain.semi_axes.map(|axis| 2.0 * axis);
            // A cube has no principal axes of its own: any box about it is one.
            let elongated = (a / c - 2.0).abs() < 1e-6 && (a / b - 1.5).abs() < 1e-6;
            kinds[usize::from(elongated)] += 1;
            let within = [[0.03, 0.04], [0.02, 0.03]][grain.class];
            assert!(within[0] <= grain.sieve_size && grain.sieve_size <= within[1]);
            // The square hole that a box passes has the edge of its middle one; the search is good to a per cent.
            assert!(!elongated || (b / grain.sieve_size - 1.0).abs() < 0.01, "{b} {}", grain.sieve_size);
        }
        assert!(kinds.iter().all(|&n| n > 8), "{kinds:?}");
        for class in &specimen.statistics.classes {
            assert!((class.mass_fraction[0] - class.mass_fraction[1]).abs() < 0.01);
        }
        let flat = SpecimenParameters { shapes: vec![cuboid([1.0, 1.0, 0.01])], ..parameters };
        let refused = generate(&flat, &mut |_, _| ()).expect_err("too flat").to_string();
        assert!(refused.contains("shape 0 of the library"), "{refused}");
    }

    /// Cubes in a column, each overlapping the next by a thousandth: left alone they stay where they are but for that; set apart to a void ratio of
    /// 2.5 and compacted they come together again.
    #[test]
    fn a_packing_is_where_a_specimen_begins() {
        let at = |k: usize| Vec3::new(0.03 * (k % 3) as f64 - 0.03, 0.03 * (k / 3 % 3) as f64 - 0.03, 0.0);
        let grains: Vec<GivenGrain> = (0..36)
            .map(|k| GivenGrain {
                corners: cuboid([0.03, 0.03, 0.03])
                    .iter()
                    .map(|c| c - Vec3::new(7.015, 0.015, 1.015))
                    .collect(),
                pose: Pose::new(at(k) + Vec3::z() * (0.015 + 0.02997 * (k / 9) as f64), Rotation::identity()),
            })
            .collect();
        let solid = 36.0 * 0.03f64.powi(3);
        let given = GivenPacking { grains, compact: false };
        let (radius, height) = given.extent();
        assert!((radius - 0.045 * 2f64.sqrt()).abs() < 1e-12 && (height - 0.11991).abs() < 1e-12);
        let size = SpecimenSize::Grains { count: 36, aspect: 1.0 };
        let parameters = SpecimenParameters {
            packing: Some(given.clone()),
            ..SpecimenParameters::new(grading(), size, void_ratio_within(radius, height, solid))
        };
        let specimen = generate(&parameters, &mut |_, _| ()).expect("a specimen");
        let moved = |(a, b): (&Pose, &GivenGrain)| (a.position - b.pose.position).norm();
        let furthest = specimen.poses.iter().zip(&given.grains).map(moved).fold(0.0, f64::max);
        assert!(furthest < 5e-4, "{furthest}");
        assert!(specimen.statistics.worst_overlap[0] < relaxation::OVERLAP_TOLERANCE);
        assert!((specimen.diameter / (2.0 * radius) - 1.0).abs() < 0.01);

        let mut apart = GivenPacking { compact: true, ..given };
        apart.grains.iter_mut().for_each(|grain| grain.pose.position *= 1.3);
        let compacted = SpecimenParameters {
            packing: Some(apart),
            unreachable: crate::specimen::Unreachable::Nearest,
            ..parameters
        };
        let specimen = generate(&compacted, &mut |_, _| ()).expect("a specimen");
        let Statistics { void_ratio, compaction_steps, .. } = specimen.statistics;
        assert!(compaction_steps > 0 && void_ratio > 0.5 && void_ratio < 0.9, "{void_ratio}");
    }
}
