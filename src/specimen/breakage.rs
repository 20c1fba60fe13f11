//! How much a specimen has broken: grading before and after, the usual indices, and fits of the fragments' sizes.
//!
//! A sample is a list of pieces with a sieve size and a volume (one density, so mass fractions are volume fractions). Sizes before and
//! after must come from the same measure: [`sieve_size`] of the mesh or hull, since a fragment has no generating ellipsoid.
//! Cells deleted by damage and parts given up are counted as fines, which pass every sieve: their real size is below what the mesh resolves.
//!
//! - Marsal (1967), "Large scale testing of rockfill materials", J. Soil Mech. Found. Div. 93(SM2): B_g is the sum of the positive
//!   differences (before less after) of the fractions retained between neighbouring sieves.
//! - Hardin (1985), "Crushing of soil particles", J. Geotech. Eng. 111:1177-1192: B_r = B_t / B_p, the breakage potential B_p being the mean of
//!   `log10(d / 0.074 mm)` before, B_t what it has lost.
//! - Einav (2007), "Breakage mechanics, part I", J. Mech. Phys. Solids 55:1274-1297: B is the area between the initial and present cumulative
//!   curves over that between the initial and the ultimate one, on a logarithmic size axis; the ultimate curve is
//!   `(d^(3-a) - d_m^(3-a)) / (d_M^(3-a) - d_m^(3-a))`, a = 2.6, between `d_m` = 0.074 mm and the largest size before.
//!
//! All three are evaluated on the pieces themselves, not on a curve drawn through sieves (Marsal's needs sieves by definition).

use crate::error::{Error, Result};

/// Size below which nothing breaks further, for Hardin's and Einav's indices [m].
pub const FINEST: f64 = 0.074e-3;
/// Fractal dimension of the ultimate grading (Einav 2007, section 2.2; Sammis, King & Biegel 1987).
pub const FRACTAL_DIMENSION: f64 = 2.6;
/// Sieves below the grading's smallest are a fourth root of two apart (as in Tyler's double series) until nothing but fines passes.
const FINER: f64 = 0.840_896_415_253_714_6;

/// A piece of rock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Sieve size [m]; 0 for fines.
    pub size: f64,
    /// [m^3]
    pub volume: f64,
}

/// What became of one grain of the specimen.
#[derive(Debug, Clone, PartialEq)]
pub struct GrainFate {
    /// As generated.
    pub before: Piece,
    /// What is left of it; itself, if nothing happened.
    pub pieces: Vec<Piece>,
    /// Whether it came apart at some time, though one piece may be left. A grain that only lost cells at its corners did not.
    pub came_apart: bool,
    /// Volume of deleted cells and of parts given up [m^3].
    pub crushed_volume: f64,
    /// Volume of living cells' points with damage above 0 [m^3].
    pub damaged_volume: f64,
}

impl GrainFate {
    /// A grain to which nothing happened.
    pub fn whole(before: Piece) -> Self {
        GrainFate {
            before,
            pieces: vec![before],
            came_apart: false,
            crushed_volume: 0.0,
            damaged_volume: 0.0,
        }
    }

    /// Whether it came apart, or nothing is left of it.
    pub fn is_broken(&self) -> bool {
        self.came_apart || self.pieces.is_empty()
    }
}

/// Grains between two sieves and how many of them came apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrokenClass {
    /// Lower and upper sieve [m]; the upper one belongs to it.
    pub sizes: [f64; 2],
    pub grains: usize,
    pub broken: usize,
}

/// A fitted law of sizes, every piece counting once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Lognormal: mean of ln(size / 1 m). Weibull: scale [m].
    pub scale: f64,
    /// Lognormal: standard deviation of ln size. Weibull: shape.
    pub shape: f64,
    /// Kolmogorov's distance between the law and the sample.
    pub distance: f64,
}

/// Breakage of a specimen.
#[derive(Debug, Clone, PartialEq)]
pub struct Breakage {
    /// Sieves, ascending [m]: those given, and finer ones as far down as there are pieces.
    pub sieves: Vec<f64>,
    /// Volume fraction that passes each.
    pub passing_before: Vec<f64>,
    pub passing_after: Vec<f64>,
    /// B_g.
    pub marsal: f64,
    /// B_r.
    pub hardin: f64,
    /// B.
    pub einav: f64,
    /// Volume with damage above 0, crushed volume included, over all.
    pub damaged_share: f64,
    /// Crushed volume over all.
    pub crushed_share: f64,
    /// Pieces that are left of grains that came apart.
    pub fragments: usize,
    /// From the first sieve up.
    pub classes: Vec<BrokenClass>,
    /// Fits of all present pieces' sizes; `None` for fewer than two different sizes.
    pub lognormal: Option<Fit>,
    pub weibull: Option<Fit>,
}

/// The measures of a specimen over `sieves` [m].
///
/// # Errors
/// `Error::Specimen` where there is no grain, a sieve or a size before is not positive, or a volume is negative.
pub fn measure(fates: &[GrainFate], sieves: &[f64]) -> Result<Breakage> {
    let fail = |message: String| Err(Error::Specimen(format!("breakage: {message}")));
    if fates.is_empty() {
        return fail("there is no grain".into());
    }
    let mut sieves = sieves.to_vec();
    sieves.sort_by(f64::total_cmp);
    sieves.dedup();
    if let Some(bad) = sieves.iter().find(|size| !(**size > 0.0 && size.is_finite())) {
        return fail(format!("{bad} m is not a sieve size"));
    }
    let sound = |piece: &Piece| piece.size > 0.0 && piece.size.is_finite() && piece.volume > 0.0;
    for (number, fate) in fates.iter().enumerate() {
        let pieces = std::iter::once(&fate.before).chain(&fate.pieces);
        if let Some(bad) = pieces.into_iter().find(|piece| !sound(piece)) {
            return fail(format!("grain {number} has a piece of {} m and {} m^3", bad.size, bad.volume));
        }
        if !(fate.crushed_volume >= 0.0 && fate.damaged_volume >= 0.0) {
            return fail(format!("grain {number} has a negative damaged volume"));
        }
    }
    let before: Vec<Piece> = fates.iter().map(|fate| fate.before).collect();
    let pieces: Vec<Piece> = fates.iter().flat_map(|fate| fate.pieces.iter().copied()).collect();
    let crushed: f64 = fates.iter().map(|fate| fate.crushed_volume).sum();
    let mut after = pieces.clone();
    after.push(Piece { size: 0.0, volume: crushed });
    let all: f64 = before.iter().map(|piece| piece.volume).sum();
    let damaged: f64 = fates.iter().map(|fate| fate.damaged_volume).sum();
    let sizes: Vec<f64> = pieces.iter().map(|piece| piece.size).collect();
    let finest = before.iter().chain(&pieces).map(|piece| piece.size).fold(f64::INFINITY, f64::min);
    let (given, sieves) = (sieves.clone(), with_finer(sieves, finest));
    Ok(Breakage {
        passing_before: sieves.iter().map(|sieve| passing(&before, *sieve)).collect(),
        passing_after: sieves.iter().map(|sieve| passing(&after, *sieve)).collect(),
        marsal: marsal(&before, &after, &given),
        hardin: hardin(&before, &after),
        einav: einav(&before, &after),
        damaged_share: (damaged + crushed) / all,
        crushed_share: crushed / all,
        fragments: fates.iter().filter(|fate| fate.is_broken()).map(|fate| fate.pieces.len()).sum(),
        classes: broken_classes(fates, &given),
        lognormal: fit_lognormal(&sizes),
        weibull: fit_weibull(&sizes),
        sieves,
    })
}

/// Ascending sieves and finer ones, the last of which pieces of the size `finest` [m] do not pass.
fn with_finer(mut sieves: Vec<f64>, finest: f64) -> Vec<f64> {
    while let Some(&smallest) = sieves.first().filter(|smallest| **smallest >= finest.max(FINEST)) {
        sieves.insert(0, FINER * smallest);
    }
    sieves
}

/// Volume fraction of a sample that passes a sieve [m]: pieces of at most that size.
pub fn passing(sample: &[Piece], sieve: f64) -> f64 {
    let total: f64 = sample.iter().map(|piece| piece.volume).sum();
    // A sum over nothing is -0.
    (sample.iter().filter(|piece| piece.size <= sieve).map(|piece| piece.volume).sum::<f64>() + 0.0) / total
}

/// Marsal's B_g over ascending sieves, the pan below the finest and what stays on the coarsest included.
pub fn marsal(before: &[Piece], after: &[Piece], sieves: &[f64]) -> f64 {
    let retained = |sample: &[Piece]| -> Vec<f64> {
        let mut steps: Vec<f64> = sieves.iter().map(|sieve| passing(sample, *sieve)).collect();
        steps.push(1.0);
        (0..steps.len()).map(|k| if k == 0 { steps[0] } else { steps[k] - steps[k - 1] }).collect()
    };
    retained(before).iter().zip(retained(after)).map(|(before, after)| (before - after).max(0.0)).sum()
}

/// Volume-weighted mean of `f(size)`, sizes below [`FINEST`] counted as that.
fn mean_of(sample: &[Piece], f: impl Fn(f64) -> f64) -> f64 {
    let total: f64 = sample.iter().map(|piece| piece.volume).sum();
    sample.iter().map(|piece| piece.volume * f(piece.size.max(FINEST))).sum::<f64>() / total
}

/// Hardin's B_r; 0 where there was no potential.
pub fn hardin(before: &[Piece], after: &[Piece]) -> f64 {
    let potential = |sample: &[Piece]| mean_of(sample, |d| (d / FINEST).log10());
    let first = potential(before);
    if first > 0.0 { (first - potential(after)) / first } else { 0.0 }
}

/// Einav's B; 0 where nothing can break.
///
/// The area between two cumulative curves over ln d is the difference of their means of ln d; that of the ultimate
/// curve is `(M^p ln M - m^p ln m) / (M^p - m^p) - 1/p`, `p = 3 - a`.
pub fn einav(before: &[Piece], after: &[Piece]) -> f64 {
    let largest = before.iter().map(|piece| piece.size).fold(0.0, f64::max);
    if largest <= FINEST {
        return 0.0;
    }
    // Sizes in units of the largest.
    let (p, m) = (3.0 - FRACTAL_DIMENSION, FINEST / largest);
    let power = m.powf(p);
    let ultimate = -power * m.ln() / (1.0 - power) - 1.0 / p;
    let log = |sample: &[Piece]| mean_of(sample, |d| (d / largest).ln());
    let first = log(before);
    if first > ultimate { (first - log(after)) / (first - ultimate) } else { 0.0 }
}

fn broken_classes(fates: &[GrainFate], sieves: &[f64]) -> Vec<BrokenClass> {
    let mut limits = vec![0.0];
    limits.extend_from_slice(sieves);
    limits.push(f64::INFINITY);
    limits
        .windows(2)
        .map(|pair| {
            let inside = |fate: &&GrainFate| fate.before.size > pair[0] && fate.before.size <= pair[1];
            BrokenClass {
                sizes: [pair[0], pair[1]],
                grains: fates.iter().filter(inside).count(),
                broken: fates.iter().filter(inside).filter(|fate| fate.is_broken()).count(),
            }
        })
        .filter(|class| class.grains > 0)
        .collect()
}

/// Logarithms of the sizes [m] and their mean; `None` unless two differ.
fn logarithms(sizes: &[f64]) -> Option<(Vec<f64>, f64)> {
    let logs: Vec<f64> = sizes.iter().map(|size| size.ln()).collect();
    let mean = logs.iter().sum::<f64>() / logs.len() as f64;
    logs.iter().any(|x| (x - mean).abs() > 1e-12).then_some((logs, mean))
}

/// Kolmogorov's distance between a distribution and a sample.
fn distance(sizes: &[f64], distribution: impl Fn(f64) -> f64) -> f64 {
    let mut sizes = sizes.to_vec();
    sizes.sort_by(f64::total_cmp);
    let n = sizes.len() as f64;
    let gap = |(k, x): (usize, &f64)| {
        let f = distribution(*x);
        (f - k as f64 / n).abs().max((f - (k + 1) as f64 / n).abs())
    };
    sizes.iter().enumerate().map(gap).fold(0.0, f64::max)
}

/// Lognormal law of positive sizes [m] by maximum likelihood: mean and standard deviation (over n) of ln size.
pub fn fit_lognormal(sizes: &[f64]) -> Option<Fit> {
    let (logs, mean) = logarithms(sizes)?;
    let deviation = (logs.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / logs.len() as f64).sqrt();
    let normal = |x: f64| 0.5 * statrs::function::erf::erfc(-(x.ln() - mean) / (deviation * 2.0_f64.sqrt()));
    Some(Fit { scale: mean, shape: deviation, distance: distance(sizes, normal) })
}

/// Weibull law of positive sizes [m] by maximum likelihood: the shape k solves
/// `sum x^k ln x / sum x^k - 1/k = mean of ln x`, whose left side rises with k.
pub fn fit_weibull(sizes: &[f64]) -> Option<Fit> {
    let (logs, mean) = logarithms(sizes)?;
    // Relative to the largest, so that powers stay below 1.
    let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let excess = |k: f64| {
        let weight = |x: &f64| (k * (x - top)).exp();
        let total: f64 = logs.iter().map(weight).sum();
        logs.iter().map(|x| weight(x) * x).sum::<f64>() / total - 1.0 / k - mean
    };
    let (mut low, mut high) = (1e-6_f64.ln(), 1e6_f64.ln());
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if excess(middle.exp()) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let k = (0.5 * (low + high)).exp();
    let mean_power = logs.iter().map(|x| (k * (x - top)).exp()).sum::<f64>() / logs.len() as f64;
    let scale = (top + mean_power.ln() / k).exp();
    let law = |x: f64| -(-(x / scale).powf(k)).exp_m1();
    Some(Fit { scale, shape: k, distance: distance(sizes, law) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(size: f64, volume: f64) -> Piece {
        Piece { size, volume }
    }

    /// Two grains: 40 mm (8 parts by volume) breaks into 30 mm (5), 20 mm (2) and fines (1); 20 mm (2) stays.
    fn fates() -> Vec<GrainFate> {
        vec![
            GrainFate {
                before: piece(0.04, 8.0),
                pieces: vec![piece(0.03, 5.0), piece(0.02, 2.0)],
                came_apart: true,
                crushed_volume: 1.0,
                damaged_volume: 3.0,
            },
            GrainFate::whole(piece(0.02, 2.0)),
        ]
    }

    #[test]
    fn grading_and_marsal_by_hand() {
        let found = measure(&fates(), &[0.04, 0.01, 0.025, 0.05]).expect("measures");
        assert_eq!(found.sieves, [0.01, 0.025, 0.04, 0.05]);
        assert_eq!(found.passing_before, [0.0, 0.2, 1.0, 1.0]);
        assert!(found.passing_before[0].is_sign_positive(), "a sum over nothing");
        assert_eq!(found.passing_after, [0.1, 0.5, 1.0, 1.0]);
        // Retained before 0, 0.2, 0.8, 0; after 0.1, 0.4, 0.5, 0: what falls is 0.3.
        assert!((found.marsal - 0.3).abs() < 1e-15);
        assert!((found.damaged_share - 0.4).abs() < 1e-15 && (found.crushed_share - 0.1).abs() < 1e-15);
        assert_eq!(found.fragments, 2);
        assert_eq!(
            found.classes,
            [
                BrokenClass { sizes: [0.01, 0.025], grains: 1, broken: 0 },
                BrokenClass { sizes: [0.025, 0.04], grains: 1, broken: 1 },
            ]
        );
    }

    /// Sieves of 25 and 40 mm: finer ones follow down to below the piece of 20 mm, and B_g does not see them.
    #[test]
    fn finer_sieves_show_what_lies_below_the_grading() {
        let found = measure(&fates(), &[0.025, 0.04]).expect("measures");
        let sieves: Vec<f64> = found.sieves.iter().map(|size| (1e5 * size).round()).collect();
        assert_eq!(sieves, [1768.0, 2102.0, 2500.0, 4000.0]);
        assert_eq!(found.passing_before, [0.0, 0.2, 0.2, 1.0]);
        assert_eq!(found.passing_after, [0.1, 0.5, 0.5, 1.0]);
        // Retained before 0.2, 0.8, 0; after 0.5, 0.5, 0.
        assert!((found.marsal - 0.3).abs() < 1e-15 && found.classes.len() == 2);
    }

    #[test]
    fn marsal_of_his_definition() {
        // Fractions retained before 30, 40, 30 %, after 20, 45, 35 %: B_g = 10 %.
        let before = [piece(3.0, 0.3), piece(2.0, 0.4), piece(1.0, 0.3)];
        let after = [piece(3.0, 0.2), piece(2.0, 0.45), piece(1.0, 0.35)];
        assert!((marsal(&before, &after, &[1.5, 2.5]) - 0.1).abs() < 1e-15);
        assert_eq!(marsal(&before, &before, &[1.5, 2.5]), 0.0);
    }

    #[test]
    fn hardin_by_hand() {
        // Potential before: everything at 0.74 mm is log10(10) = 1. After: half at 0.74 mm, a quarter at 0.074 * 10^0.5 mm (1/2), a
        // quarter finer than 0.074 mm (0): 0.625. B_r = 0.375.
        let before = [piece(10.0 * FINEST, 4.0)];
        let after = [piece(10.0 * FINEST, 2.0), piece(10.0_f64.sqrt() * FINEST, 1.0), piece(1e-6, 1.0)];
        assert!((hardin(&before, &after) - 0.375).abs() < 1e-14);
        assert_eq!(hardin(&before, &before), 0.0);
        assert!((hardin(&before, &[piece(0.0, 4.0)]) - 1.0).abs() < 1e-14, "all potential used up");
    }

    #[test]
    fn einav_by_hand_and_by_areas() {
        let before = [piece(0.04, 8.0), piece(0.02, 2.0)];
        let after = [piece(0.03, 5.0), piece(0.02, 4.0), piece(0.0, 1.0)];
        // Areas between cumulative curves over ln d, by midpoints.
        let (largest, p) = (0.04_f64, 0.4_f64);
        let ultimate = |d: f64| (d.powf(p) - FINEST.powf(p)) / (largest.powf(p) - FINEST.powf(p));
        let (low, high, steps) = (FINEST.ln(), largest.ln(), 200_000);
        let (mut grown, mut possible) = (0.0, 0.0);
        for k in 0..steps {
            let d = (low + (high - low) * (f64::from(k) + 0.5) / f64::from(steps)).exp();
            grown += passing(&after, d) - passing(&before, d);
            possible += ultimate(d) - passing(&before, d);
        }
        assert!((einav(&before, &after) - grown / possible).abs() < 1e-5);
        assert_eq!(einav(&before, &before), 0.0);
        // The ultimate grading itself, as many thin slices: B = 1.
        let slices = 20_000;
        let ended: Vec<Piece> = (0..slices)
            .map(|k| {
                let f = (f64::from(k) + 0.5) / f64::from(slices);
                let d = (FINEST.powf(p) + f * (largest.powf(p) - FINEST.powf(p))).powf(1.0 / p);
                piece(d, 1.0)
            })
            .collect();
        assert!((einav(&before, &ended) - 1.0).abs() < 1e-4);
    }

    #[test]
    fn fits_by_hand() {
        // ln sizes 0, 1, 2: mean 1, deviation sqrt(2/3); the distance by hand: at the smallest, Phi(-1.2247) = 0.1103
        // against 1/3.
        let sizes = [1.0, 1.0_f64.exp(), 2.0_f64.exp()];
        let fit = fit_lognormal(&sizes).expect("a fit");
        assert!((fit.scale - 1.0).abs() < 1e-14 && (fit.shape - (2.0_f64 / 3.0).sqrt()).abs() < 1e-14);
        assert!((fit.distance - (1.0 / 3.0 - 0.110_336)).abs() < 1e-5, "{}", fit.distance);
        // Two sizes 1 and e: with x = e^k, x/(1 + x) - 1/k = 1/2, so k (x - 1) = 2 (x + 1): k tanh(k/2) = 2, k = 2.399357.
        let fit = fit_weibull(&sizes[..2]).expect("a fit");
        assert!((fit.shape - 2.399_357_280_520_5).abs() < 1e-9, "{}", fit.shape);
        let expected = ((1.0 + fit.shape.exp()) / 2.0).powf(1.0 / fit.shape);
        assert!((fit.scale - expected).abs() < 1e-12);
        assert!(
            fit_weibull(&[2.0, 2.0]).is_none()
                && fit_lognormal(&[3.0]).is_none()
                && fit_weibull(&[]).is_none()
        );
    }

    #[test]
    fn fits_find_the_law_of_its_own_quantiles() {
        let n = 4000;
        let quantile = |k: usize| (k as f64 + 0.5) / n as f64;
        let weibull: Vec<f64> = (0..n).map(|k| 0.03 * (-(-quantile(k)).ln_1p()).powf(1.0 / 1.7)).collect();
        let fit = fit_weibull(&weibull).expect("a fit");
        assert!((fit.shape / 1.7 - 1.0).abs() < 5e-3 && (fit.scale / 0.03 - 1.0).abs() < 2e-3, "{fit:?}");
        assert!(fit.distance < 2e-3 && fit_lognormal(&weibull).expect("a fit").distance > 0.02);
    }

    #[test]
    fn impossible_samples_are_refused() {
        assert!(measure(&[], &[0.01]).is_err());
        assert!(measure(&fates(), &[0.0]).is_err() && measure(&fates(), &[f64::NAN]).is_err());
        let mut bad = fates();
        bad[0].pieces[0].size = f64::NAN;
        assert!(measure(&bad, &[0.01]).is_err());
        bad = fates();
        bad[1].crushed_volume = -1.0;
        assert!(measure(&bad, &[0.01]).is_err());
        // A grain of which nothing is left is broken.
        let gone = GrainFate {
            pieces: vec![],
            crushed_volume: 1.0,
            damaged_volume: 0.0,
            ..GrainFate::whole(piece(0.01, 1.0))
        };
        let found = measure(&[gone, GrainFate::whole(piece(0.02, 1.0))], &[0.03]).expect("measures");
        assert_eq!((found.classes[0].broken, found.crushed_share, found.lognormal), (1, 0.5, None));
        // One that came apart stays so when all but one of its pieces are lost.
        let fate = &fates()[0];
        let last = GrainFate { pieces: vec![piece(0.03, 5.0)], crushed_volume: 3.0, ..fate.clone() };
        let found = measure(&[last, GrainFate::whole(piece(0.02, 2.0))], &[0.05]).expect("measures");
        assert_eq!((found.classes[0].broken, found.fragments), (1, 1));
    }
}
