//! How many grains fill how large a specimen, before any is generated.

use crate::specimen::SievePoint;
use crate::specimen::SpecimenSize;
use crate::specimen::given::library;
use crate::specimen::grading::{SizeClass, mean_volumes, size_classes};
use crate::specimen::shape::{ShapeLaw, WithinClass};
use crate::specimen::size::{Plan, plan};
use crate::tensor::Vec3;

/// Slip over which friction weakens in scenes that do not say [m].
pub const SCENE_WEAKENING: f64 = 50e-6;

/// Slip over which friction weakens in a specimen that does not say [m]: a quarter of the size that half of the mass passes,
/// linear between the points of the grading, which go from large to small (decision 0019).
pub fn weakening_distance(grading: &[[f64; 2]]) -> f64 {
    let median = median_class(grading)
        .map(|[[large, above], [small, below]]| small + (0.5 - below) / (above - below) * (large - small));
    0.25 * median.or(grading.last().map(|point| point[0])).unwrap_or(0.0)
}

/// The two points of a grading, which goes from large to small, between which half of the mass passes.
pub fn median_class(grading: &[[f64; 2]]) -> Option<[[f64; 2]; 2]> {
    grading.windows(2).map(|pair| [pair[0], pair[1]]).find(|[_, below]| below[1] <= 0.5)
}

/// The part of a grading, which goes from large to small, between the last sieve that passes all and the first that passes nothing.
pub fn with_mass(grading: &[[f64; 2]]) -> &[[f64; 2]] {
    let mut curve = grading;
    while let [[a, p], [b, q], _, ..] = curve
        && a > b
        && *p >= 1.0
        && *q >= 1.0
    {
        curve = &curve[1..];
    }
    while let [.., _, [a, p], [b, q]] = curve
        && a > b
        && *p <= 0.0
        && *q <= 0.0
    {
        curve = &curve[..curve.len() - 1];
    }
    curve
}

/// The grains of a grading and a shape law, on average.
#[derive(Debug, Clone, PartialEq)]
pub struct MeanGrains {
    classes: Vec<SizeClass>,
    /// [m3] per class.
    volumes: Vec<f64>,
}

impl MeanGrains {
    /// # Errors
    /// What the specimen generator refuses: a grading that is none, vertices that don't fit, shapes without room for `rounding`.
    pub fn new(
        grading: &[[f64; 2]],
        within_class: WithinClass,
        vertices: [usize; 2],
        vertex_separation: f64,
        (shapes, rounding): (&[Vec<[f64; 3]>], f64),
    ) -> Result<Self, String> {
        let curve: Vec<_> = grading.iter().map(|&[size, passing]| SievePoint { size, passing }).collect();
        let shapes: Vec<Vec<Vec3>> =
            shapes.iter().map(|shape| shape.iter().copied().map(Vec3::from).collect()).collect();
        let library = library(&shapes, rounding).map_err(|e| e.to_string())?;
        let law = ShapeLaw { vertices, vertex_separation, rounding, within_class, library };
        let classes = size_classes(&curve).map_err(|e| e.to_string())?;
        let volumes = mean_volumes(&classes, &law).map_err(|e| e.to_string())?;
        Ok(MeanGrains { classes, volumes })
    }

    /// The same grains, scaled so that `count` of them have the volume `solid` [m3].
    pub fn filling(mut self, count: usize, solid: f64) -> Self {
        let factor = solid / self.plan(SpecimenSize::Grains { count, aspect: 1.0 }, 1.0).solid_volume;
        self.volumes.iter_mut().for_each(|volume| *volume *= factor);
        self
    }

    /// Expected diameter, height and numbers of grains.
    pub fn plan(&self, size: SpecimenSize, void_ratio: f64) -> Plan {
        plan(&self.classes, &self.volumes, &size, void_ratio)
    }

    /// The number of grains that a diameter and height [m] with this void ratio hold.
    pub fn number(&self, diameter: f64, height: f64, void_ratio: f64) -> usize {
        self.plan(SpecimenSize::Cylinder { diameter, height }, void_ratio).numbers.iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_weakens_over_a_quarter_of_the_median_size() {
        let close = |grading: &[[f64; 2]], expected: f64| {
            let distance = weakening_distance(grading);
            assert!((distance - expected).abs() < 1e-12, "{grading:?}: {distance}");
        };
        close(&[[0.06, 1.0], [0.04, 0.0]], 0.0125);
        close(&[[0.06, 1.0], [0.04, 0.62], [0.02, 0.0]], 0.25 * (0.02 + 0.02 * 0.5 / 0.62));
        close(&[[0.06, 1.0], [0.04, 0.5], [0.02, 0.0]], 0.01);
    }

    #[test]
    fn sieves_without_grains_are_left_out_and_slips_are_not() {
        let same = |grading: &[[f64; 2]], kept: std::ops::Range<usize>| {
            assert_eq!(with_mass(grading), &grading[kept], "{grading:?}");
        };
        let coarser = [[0.08, 1.0], [0.07, 1.0], [0.06, 1.0]];
        let finer = [[0.04, 0.5], [0.02, 0.0], [0.01, 0.0], [0.005, 0.0]];
        same(&[&coarser[..], &finer[..]].concat(), 2..5);
        same(&[[0.08, 1.0], [0.06, 1.0], [0.04, 0.0], [0.02, 0.0]], 1..3);
        same(&[[0.06, 1.0], [0.04, 1.0]], 0..2);
        // Faults that are to be told of.
        same(&[[0.08, 0.9], [0.06, 1.0], [0.04, 0.0], [0.02, 0.1]], 0..4);
        same(&[[0.06, 1.0], [0.07, 1.0], [0.02, 0.0], [0.03, 0.0]], 0..4);
    }
}
