//! Statistical fields: a value per cell, drawn from a law with a given mean.
//!
//! Source: Ma, Zhou, Chang & Zhou (2011), eqs. 4-5: Weibull with shape k and scale
//! `mean / Gamma(1 + 1/k)`. Each grain and property has a random stream of its own, keyed by
//! (seed, grain, property), so the values do not depend on threads or on other grains.

use rand_distr::{Distribution, Exp, Gamma, LogNormal, Normal, Weibull};
use rand_mt::Mt64;
use serde::{Deserialize, Serialize};
use statrs::function::gamma::gamma;

use crate::material::MaterialError;

/// A probability law, as cases have it; its mean is given separately.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "law", rename_all = "lowercase")]
pub enum Law {
    /// No scatter.
    Constant,
    /// `shape` is the Weibull modulus k.
    Weibull {
        #[serde(rename = "weibull_shape")]
        shape: f64,
    },
    /// `variation` is the standard deviation over the mean.
    Normal {
        variation: f64,
    },
    /// `variation` is the standard deviation of the value (not of its logarithm) over the mean.
    LogNormal {
        variation: f64,
    },
    /// `shape` is alpha; the scale is mean / alpha.
    Gamma {
        #[serde(rename = "gamma_shape")]
        shape: f64,
    },
    Exponential,
}

/// What is drawn; the number keys the random stream and must not change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Property {
    YoungsModulus = 1,
    PoissonsRatio = 2,
    CompressiveStrength = 3,
    TensileStrength = 4,
}

impl Property {
    pub const fn name(self) -> &'static str {
        match self {
            Property::YoungsModulus => "Young's modulus",
            Property::PoissonsRatio => "Poisson's ratio",
            Property::CompressiveStrength => "compressive strength",
            Property::TensileStrength => "tensile strength",
        }
    }

    /// Open interval of accepted values [Pa, or 1 for Poisson's ratio]. Poisson's ratio stops short
    /// of 0.5, where the stiffness is no longer finite and displacement elements lock.
    pub const fn bounds(self) -> (f64, f64) {
        match self {
            Property::YoungsModulus | Property::CompressiveStrength | Property::TensileStrength => {
                (0.0, f64::INFINITY)
            }
            Property::PoissonsRatio => (-1.0, 0.495),
        }
    }
}

/// A material quantity: its mean (before rejection) and its law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity {
    /// In the unit of the property.
    pub mean: f64,
    pub law: Law,
}

/// Values of one property in the cells of one grain.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    pub values: Vec<f64>,
    /// Draws outside the property's bounds, thrown away and drawn again.
    pub rejected: u64,
}

/// So many rejections in a row mean that the law and the bounds do not fit.
const MOST_ATTEMPTS: u32 = 1000;

/// A law with its parameters checked, ready to draw from.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Sampler {
    Constant(f64),
    Weibull(Weibull<f64>),
    Normal(Normal<f64>),
    LogNormal(LogNormal<f64>),
    Gamma(Gamma<f64>),
    Exponential(Exp<f64>),
}

impl Law {
    pub const fn name(&self) -> &'static str {
        match self {
            Law::Constant => "constant",
            Law::Weibull { .. } => "Weibull",
            Law::Normal { .. } => "normal",
            Law::LogNormal { .. } => "lognormal",
            Law::Gamma { .. } => "gamma",
            Law::Exponential => "exponential",
        }
    }

    fn sampler(&self, mean: f64) -> Result<Sampler, MaterialError> {
        let bad = |name, value| MaterialError::Parameter { law: self.name(), name, value };
        let positive = |name, value: f64| {
            if value > 0.0 && value.is_finite() { Ok(value) } else { Err(bad(name, value)) }
        };
        if !mean.is_finite() {
            return Err(bad("mean", mean));
        }
        Ok(match *self {
            Law::Constant => Sampler::Constant(mean),
            Law::Weibull { shape } => {
                let k = positive("shape", shape)?;
                let scale = positive("mean", mean)? / gamma(1.0 + 1.0 / k);
                Sampler::Weibull(Weibull::new(scale, k).map_err(|_| bad("shape", shape))?)
            }
            Law::Normal { variation } => {
                let deviation = positive("variation", variation)? * mean.abs();
                Sampler::Normal(Normal::new(mean, deviation).map_err(|_| bad("variation", variation))?)
            }
            Law::LogNormal { variation } => {
                // ln x is normal with variance ln(1 + v^2) and mean ln(mean) - variance / 2.
                let variance = positive("variation", variation)?.powi(2).ln_1p();
                let centre = positive("mean", mean)?.ln() - 0.5 * variance;
                Sampler::LogNormal(
                    LogNormal::new(centre, variance.sqrt()).map_err(|_| bad("variation", variation))?,
                )
            }
            Law::Gamma { shape } => {
                let alpha = positive("shape", shape)?;
                let scale = positive("mean", mean)? / alpha;
                Sampler::Gamma(Gamma::new(alpha, scale).map_err(|_| bad("shape", shape))?)
            }
            Law::Exponential => {
                Sampler::Exponential(Exp::new(1.0 / positive("mean", mean)?).map_err(|_| bad("mean", mean))?)
            }
        })
    }
}

impl Sampler {
    fn draw(&self, random: &mut Mt64) -> f64 {
        match self {
            Sampler::Constant(value) => *value,
            Sampler::Weibull(law) => law.sample(random),
            Sampler::Normal(law) => law.sample(random),
            Sampler::LogNormal(law) => law.sample(random),
            Sampler::Gamma(law) => law.sample(random),
            Sampler::Exponential(law) => law.sample(random),
        }
    }
}

impl Quantity {
    /// Whether mean and law are possible for `property`.
    pub fn check(&self, property: Property) -> Result<(), MaterialError> {
        let (low, high) = property.bounds();
        if !(self.mean > low && self.mean < high) {
            return Err(MaterialError::Mean { property: property.name(), mean: self.mean, low, high });
        }
        self.law.sampler(self.mean).map(|_| ())
    }
}

/// Draws `property` for the `cells` cells of grain number `grain`.
///
/// Errors where the quantity is impossible, or its law keeps missing the property's bounds.
pub fn sample_field(
    quantity: &Quantity,
    property: Property,
    seed: u64,
    grain: u64,
    cells: usize,
) -> Result<Field, MaterialError> {
    quantity.check(property)?;
    let sampler = quantity.law.sampler(quantity.mean)?;
    let (low, high) = property.bounds();
    let mut random = Mt64::new_with_key([seed, grain, property as u64]);
    let mut field = Field { values: Vec::with_capacity(cells), rejected: 0 };
    for _ in 0..cells {
        let mut attempts = 0;
        let value = loop {
            let value = sampler.draw(&mut random);
            if value > low && value < high {
                break value;
            }
            field.rejected += 1;
            attempts += 1;
            if attempts == MOST_ATTEMPTS {
                return Err(MaterialError::Bounds {
                    law: quantity.law.name(),
                    property: property.name(),
                    low,
                    high,
                    attempts,
                });
            }
        };
        field.values.push(value);
    }
    Ok(field)
}

#[cfg(test)]
mod tests {
    use statrs::distribution::{self, ContinuousCDF};

    use super::*;

    const SAMPLES: usize = 100_000;
    /// Kolmogorov's statistic `D sqrt(n)` is exceeded with probability 0.01 (Smirnov 1948).
    const KOLMOGOROV_1_PERCENT: f64 = 1.6276;

    fn kolmogorov(mut values: Vec<f64>, distribution: impl Fn(f64) -> f64) -> f64 {
        values.sort_by(f64::total_cmp);
        let n = values.len() as f64;
        let gap = |(k, x): (usize, &f64)| {
            let f = distribution(*x);
            (f - k as f64 / n).abs().max((f - (k + 1) as f64 / n).abs())
        };
        values.iter().enumerate().map(gap).fold(0.0, f64::max) * n.sqrt()
    }

    fn draw(quantity: Quantity, property: Property) -> Vec<f64> {
        let field = sample_field(&quantity, property, 20110105, 7, SAMPLES).expect("a field");
        assert_eq!(field.rejected, 0);
        field.values
    }

    fn check(quantity: Quantity, deviation: f64, distribution: impl Fn(f64) -> f64) {
        let values = draw(quantity, Property::YoungsModulus);
        let mean = values.iter().sum::<f64>() / SAMPLES as f64;
        // Four standard errors of the mean.
        assert!(
            (mean - quantity.mean).abs() < 4.0 * deviation / (SAMPLES as f64).sqrt(),
            "{quantity:?} {mean}"
        );
        let statistic = kolmogorov(values, distribution);
        assert!(statistic < KOLMOGOROV_1_PERCENT, "{quantity:?}: D sqrt(n) = {statistic}");
    }

    #[test]
    fn weibull_fields_have_mean_and_distribution() {
        for shape in [1.0, 2.0, 10.0, 20.0, 100.0] {
            let mean = 30.0;
            let scale = mean / gamma(1.0 + 1.0 / shape);
            let deviation = (scale * scale * gamma(1.0 + 2.0 / shape) - mean * mean).max(0.0).sqrt();
            let quantity = Quantity { mean, law: Law::Weibull { shape } };
            check(quantity, deviation, |x| -(-(x / scale).powf(shape)).exp_m1());
        }
    }

    #[test]
    fn other_laws_have_mean_and_distribution() {
        let mean = 30.0;
        let normal = distribution::Normal::new(mean, 3.0).expect("a law");
        check(Quantity { mean, law: Law::Normal { variation: 0.1 } }, 3.0, |x| normal.cdf(x));
        let variance = 0.5_f64.powi(2).ln_1p();
        let lognormal =
            distribution::LogNormal::new(mean.ln() - variance / 2.0, variance.sqrt()).expect("a law");
        check(Quantity { mean, law: Law::LogNormal { variation: 0.5 } }, 15.0, |x| lognormal.cdf(x));
        let gamma_law = distribution::Gamma::new(4.0, 4.0 / mean).expect("a law");
        check(Quantity { mean, law: Law::Gamma { shape: 4.0 } }, 15.0, |x| gamma_law.cdf(x));
        check(Quantity { mean, law: Law::Exponential }, mean, |x| -(-x / mean).exp_m1());
    }

    #[test]
    fn cells_and_properties_are_independent() {
        // Correlation coefficients of independent samples have a standard deviation of 1/sqrt(n): five of them.
        let law = Law::Weibull { shape: 10.0 };
        let draw = |property| draw(Quantity { mean: 30.0, law }, property);
        let (first, second) = (draw(Property::CompressiveStrength), draw(Property::TensileStrength));
        let correlation = |a: &[f64], b: &[f64]| {
            let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
            let (p, q) = (mean(a), mean(b));
            let sum =
                |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(a, b)| f(a - p, b - q)).sum::<f64>();
            sum(&|a, b| a * b) / (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt()
        };
        let limit = 5.0 / (SAMPLES as f64).sqrt();
        assert!(correlation(&first, &second).abs() < limit);
        for lag in [1, 2, 38] {
            assert!(correlation(&first[lag..], &first[..SAMPLES - lag]).abs() < limit, "cells {lag} apart");
        }
        assert!(correlation(&first, &first) > 0.999);
    }

    #[test]
    fn constant_has_no_scatter() {
        let field =
            sample_field(&Quantity { mean: 0.2, law: Law::Constant }, Property::PoissonsRatio, 1, 2, 5)
                .expect("a field");
        assert_eq!(field, Field { values: vec![0.2; 5], rejected: 0 });
    }

    #[test]
    fn same_bits_on_any_thread_count() {
        use rayon::prelude::*;
        let quantity = Quantity { mean: 30e9, law: Law::Weibull { shape: 20.0 } };
        let all = |threads: usize| -> Vec<Field> {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| {
                (0..200u64)
                    .into_par_iter()
                    .map(|grain| {
                        sample_field(&quantity, Property::YoungsModulus, 3, grain, 38).expect("a field")
                    })
                    .collect()
            })
        };
        let reference = all(1);
        assert_eq!(reference, all(2));
        assert_eq!(reference, all(7));
        assert_ne!(reference[0], reference[1]);
        let other = sample_field(&quantity, Property::CompressiveStrength, 3, 0, 38).expect("a field");
        assert_ne!(reference[0], other);
    }

    #[test]
    fn values_outside_the_bounds_are_drawn_again_and_counted() {
        let quantity = Quantity { mean: 0.2, law: Law::Normal { variation: 1.0 } };
        let field = sample_field(&quantity, Property::PoissonsRatio, 1, 1, 10_000).expect("a field");
        assert!(field.values.iter().all(|&nu| nu > -1.0 && nu < 0.495));
        // P(x > 0.495) at 1.475 deviations is 0.0701: of n accepted, n p / (1 - p) rejected.
        let expected = 10_000.0 * 0.0701 / 0.9299;
        assert!((field.rejected as f64 - expected).abs() < 5.0 * expected.sqrt(), "{}", field.rejected);
    }

    #[test]
    fn impossible_quantities_are_refused() {
        let refused = |mean: f64, law: Law, property: Property| {
            sample_field(&Quantity { mean, law }, property, 1, 1, 3).is_err()
        };
        assert!(refused(0.6, Law::Constant, Property::PoissonsRatio));
        assert!(refused(-1.0, Law::Constant, Property::YoungsModulus));
        assert!(refused(f64::NAN, Law::Constant, Property::YoungsModulus));
        assert!(refused(1.0, Law::Weibull { shape: 0.0 }, Property::YoungsModulus));
        assert!(refused(1.0, Law::Weibull { shape: 1e-3 }, Property::YoungsModulus));
        assert!(refused(1.0, Law::Normal { variation: f64::INFINITY }, Property::YoungsModulus));
        assert!(refused(-0.1, Law::Exponential, Property::PoissonsRatio));
        assert!(refused(1.0, Law::Gamma { shape: -2.0 }, Property::YoungsModulus));
    }
}
