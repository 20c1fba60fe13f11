//! From a grading curve to grains: size classes, numbers and shapes, the coarsest class first.
//!
//! A curve is a list of sieve sizes with the mass fraction that passes each. Between two neighbouring
//! sieves lies a class. Mass fractions are volume fractions of the nominal polyhedra (one density).

use crate::error::{Error, Result};
use crate::specimen::shape::{self, GrainShape, ShapeLaw, grain};
use rayon::prelude::*;

/// A point of a grading curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SievePoint {
    /// Sieve size [m].
    pub size: f64,
    /// Mass fraction that passes it.
    pub passing: f64,
}

/// The grains between two neighbouring sieves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SizeClass {
    /// Lower and upper sieve size [m].
    pub sizes: [f64; 2],
    /// Share of the specimen's mass.
    pub mass_fraction: f64,
}

/// The size classes of a curve, coarsest first; empty ones are dropped.
///
/// # Errors
/// `Error::Specimen` unless sizes are positive and distinct, and the fraction passing rises with size
/// from 0 to 1.
pub fn size_classes(curve: &[SievePoint]) -> Result<Vec<SizeClass>> {
    let fail = |message: String| Err(Error::Specimen(format!("grading: {message}")));
    let mut curve = curve.to_vec();
    curve.sort_by(|a, b| b.size.total_cmp(&a.size));
    if curve.len() < 2 {
        return fail("two sieves or more are needed".into());
    }
    if let Some(p) = curve.iter().find(|p| !(p.size > 0.0 && p.size.is_finite() && p.passing.is_finite())) {
        return fail(format!("{} m is not a sieve size", p.size));
    }
    let (first, last) = (curve[0], curve[curve.len() - 1]);
    if (first.passing - 1.0).abs() > 1e-9 || last.passing.abs() > 1e-9 {
        return fail(format!(
            "the largest sieve must pass 1 and the smallest 0, not {} and {}",
            first.passing, last.passing
        ));
    }
    let mut classes = vec![];
    for pair in curve.windows(2) {
        let (upper, lower) = (pair[0], pair[1]);
        if upper.size <= lower.size {
            return fail(format!("sieve {} m is given twice", upper.size));
        }
        if upper.passing < lower.passing {
            return fail(format!("less passes {} m than the smaller sieve {} m", upper.size, lower.size));
        }
        if upper.passing > lower.passing {
            let mass_fraction = upper.passing - lower.passing;
            classes.push(SizeClass { sizes: [lower.size, upper.size], mass_fraction });
        }
    }
    Ok(classes)
}

/// Mean nominal volume [m^3] of a grain of each class.
pub fn mean_volumes(classes: &[SizeClass], law: &ShapeLaw) -> Result<Vec<f64>> {
    shape::mean_volumes(classes.iter().map(|class| class.sizes), law)
}

/// Numbers of grains per class that add up to `total` and hold the mass fractions best.
pub fn numbers_of_total(classes: &[SizeClass], mean_volumes: &[f64], total: usize) -> Vec<usize> {
    let weights: Vec<f64> = classes.iter().zip(mean_volumes).map(|(c, v)| c.mass_fraction / v).collect();
    let sum: f64 = weights.iter().sum();
    let exact: Vec<f64> = weights.iter().map(|w| w / sum * total as f64).collect();
    let mut numbers: Vec<usize> = exact.iter().map(|x| (x.floor() as usize).max(1)).collect();
    // Largest remainder; a class too poor for a whole grain has got one already.
    while numbers.iter().sum::<usize>() != total {
        let missing = |k: usize| exact[k] - numbers[k] as f64;
        let order = |a: &usize, b: &usize| missing(*a).total_cmp(&missing(*b));
        if numbers.iter().sum::<usize>() < total {
            if let Some(k) = (0..numbers.len()).max_by(order) {
                numbers[k] += 1;
            }
        } else {
            match (0..numbers.len()).filter(|&k| numbers[k] > 1).min_by(order) {
                Some(k) => numbers[k] -= 1,
                None => break,
            }
        }
    }
    numbers
}

/// Numbers of grains per class whose mean volumes add up to `solid_volume` [m^3].
pub fn numbers_of_volume(classes: &[SizeClass], mean_volumes: &[f64], solid_volume: f64) -> Vec<usize> {
    classes
        .iter()
        .zip(mean_volumes)
        .map(|(class, mean)| ((class.mass_fraction * solid_volume / mean).round() as usize).max(1))
        .collect()
}

/// Least number of redraws in a class to meet its volume.
const REDRAWS: u64 = 400;

/// A class's volume may miss its goal by this share of the specimen's.
const VOLUME_TOLERANCE: f64 = 1e-4;

/// Grains of the given numbers per class whose volumes meet each class's share of `solid_volume`
/// [m^3], coarsest class first, larger grains first within a class.
///
/// The grains are drawn independently; then single ones are drawn again, and kept where that brings
/// the class nearer to its goal, until it is met to 1e-4 of the total.
pub fn draw(
    classes: &[SizeClass],
    numbers: &[usize],
    solid_volume: f64,
    law: &ShapeLaw,
    seed: u64,
) -> Result<Vec<GrainShape>> {
    let mut grains = vec![];
    let mut first_index = 0u64;
    for (c, (class, &number)) in classes.iter().zip(numbers).enumerate() {
        let goal = class.mass_fraction * solid_volume;
        let number = number as u64;
        let mut members: Vec<GrainShape> = (0..number)
            .into_par_iter()
            .map(|k| grain(law, class.sizes, c, seed, first_index + k))
            .collect::<Result<_>>()?;
        let mut volume: f64 = members.iter().map(|g| g.nominal.volume()).sum();
        for attempt in 1..=REDRAWS.max(4 * number) {
            if (volume - goal).abs() <= VOLUME_TOLERANCE * solid_volume {
                break;
            }
            let k = (attempt - 1) % number;
            // A redraw has an index of its own, so it disturbs no other grain's stream.
            let again = grain(law, class.sizes, c, seed, (attempt << 32) + first_index + k)?;
            let changed = volume - members[k as usize].nominal.volume() + again.nominal.volume();
            if (changed - goal).abs() < (volume - goal).abs() {
                volume = changed;
                members[k as usize] = again;
            }
        }
        members.sort_by(|a, b| b.nominal.volume().total_cmp(&a.nominal.volume()));
        grains.extend(members);
        first_index += number;
    }
    Ok(grains)
}

/// Share of each class in the grains' volume.
pub fn mass_fractions(class_count: usize, grains: &[GrainShape]) -> Vec<f64> {
    let mut volumes = vec![0.0; class_count];
    for grain in grains {
        volumes[grain.class] += grain.nominal.volume();
    }
    let total: f64 = volumes.iter().sum();
    volumes.iter().map(|v| v / total).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::specimen::shape::WithinClass;

    fn curve(points: &[(f64, f64)]) -> Vec<SievePoint> {
        points.iter().map(|&(size, passing)| SievePoint { size, passing }).collect()
    }

    /// One wide class. Tolerance: three standard deviations of the share of 4000 grains' mass that is finer, by the variance of their volumes; the
    /// mean volume likewise, and half a per cent for that of the hulls.
    #[test]
    fn mass_within_a_class_follows_its_law() {
        let [low, high] = [0.02, 0.09];
        let classes = size_classes(&curve(&[(high, 1.0), (low, 0.0)])).expect("a curve");
        for within_class in [WithinClass::Number, WithinClass::Mass] {
            let law = ShapeLaw { within_class, ..ShapeLaw::SAMPLE };
            let grains: Vec<GrainShape> =
                (0..4000).map(|k| grain(&law, [low, high], 0, 5, k).expect("a grain")).collect();
            let volume = |grain: &GrainShape| grain.nominal.volume();
            let total: f64 = grains.iter().map(volume).sum();
            let squares: f64 = grains.iter().map(|grain| volume(grain).powi(2)).sum();
            let deviation = squares.sqrt() / total;
            for size in [0.03, 0.045, 0.055, 0.08] {
                let finer: f64 =
                    grains.iter().filter(|grain| grain.sieve_size < size).map(volume).sum::<f64>() / total;
                let expected = within_class.passing([low, high], size);
                assert!(
                    (finer - expected).abs() < 3.0 * deviation,
                    "{within_class:?} {size}: {finer} {expected}"
                );
            }
            let mean = mean_volumes(&classes, &law).expect("volumes")[0];
            let off = total / 4000.0 / mean - 1.0;
            assert!(off.abs() < 3.0 * deviation + 5e-3, "{within_class:?}: {off}");
        }
        // By number less than half of the mass is below the middle; by mass half of it is.
        assert!(WithinClass::Number.passing([low, high], 0.055) < 0.3);
        assert!((WithinClass::Mass.passing([low, high], 0.055) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn classes_come_coarsest_first() {
        let classes = size_classes(&curve(&[(0.02, 0.0), (0.06, 1.0), (0.04, 0.62)])).expect("a curve");
        assert_eq!(classes.len(), 2);
        assert_eq!(classes[0].sizes, [0.04, 0.06]);
        assert!((classes[0].mass_fraction - 0.38).abs() < 1e-12);
        assert!((classes[1].mass_fraction - 0.62).abs() < 1e-12);
        let gap = size_classes(&curve(&[(4.0, 1.0), (3.0, 0.5), (2.0, 0.5), (1.0, 0.0)])).expect("a curve");
        assert_eq!(gap.len(), 2);
    }

    #[test]
    fn impossible_curves_are_refused() {
        for points in [
            &[(1.0, 1.0)][..],
            &[(2.0, 0.9), (1.0, 0.0)],
            &[(2.0, 1.0), (1.0, 0.1)],
            &[(2.0, 1.0), (2.0, 0.0)],
            &[(3.0, 1.0), (2.0, 0.2), (1.5, 0.4), (1.0, 0.0)],
            &[(2.0, 1.0), (-1.0, 0.0)],
            &[(2.0, 1.0), (1.5, f64::NAN), (1.0, 0.0)],
        ] {
            assert!(size_classes(&curve(points)).is_err(), "{points:?}");
        }
    }

    #[test]
    fn numbers_add_up() {
        let classes =
            size_classes(&curve(&[(6.0, 1.0), (4.0, 0.7), (2.0, 0.3), (1.0, 0.0)])).expect("a curve");
        let volumes = mean_volumes(&classes, &ShapeLaw::SAMPLE).expect("volumes");
        for total in [3, 10, 57, 300, 3783] {
            let numbers = numbers_of_total(&classes, &volumes, total);
            assert_eq!(numbers.iter().sum::<usize>(), total);
            assert!(numbers.iter().all(|n| *n > 0));
        }
        let numbers = numbers_of_volume(&classes, &volumes, 1e4);
        let total: f64 = numbers.iter().zip(&volumes).map(|(&n, v)| n as f64 * v).sum();
        assert!((total / 1e4 - 1.0).abs() < 0.01);
    }

    #[test]
    fn drawn_grains_meet_the_curve() {
        let classes = size_classes(&curve(&[(6.0, 1.0), (4.0, 0.7), (2.0, 0.0)])).expect("a curve");
        let volumes = mean_volumes(&classes, &ShapeLaw::SAMPLE).expect("volumes");
        for total in [30, 400] {
            let numbers = numbers_of_total(&classes, &volumes, total);
            let solid: f64 = numbers.iter().zip(&volumes).map(|(&n, v)| n as f64 * v).sum();
            let grains = draw(&classes, &numbers, solid, &ShapeLaw::SAMPLE, 3).expect("grains");
            assert_eq!(grains.len(), total);
            for (class, achieved) in classes.iter().zip(mass_fractions(2, &grains)) {
                assert!((class.mass_fraction - achieved).abs() < 0.001, "{total}: {achieved}");
            }
            let drawn: f64 = grains.iter().map(|g| g.nominal.volume()).sum();
            assert!((drawn / solid - 1.0).abs() < 0.001);
            for pair in grains.windows(2) {
                assert!(pair[0].class <= pair[1].class);
            }
        }
    }
}
