//! Parameters of the hyperbolic model of Duncan & Chang (E-B form) from the shear curves of several confining pressures.
//!
//! Source: Duncan & Chang (1970), J. Soil Mech. Found. Div. 96(SM5):1629-1653; bulk modulus and the choice of points after Duncan, Byrne, Wong & Mabry
//! (1980), UCB/GT/80-01. Compression positive, SI.
//!
//! ```text
//! q = e / (1/Ei + Rf e / qf)        Ei = K pa (s3/pa)^n            Rf = qf / q_ult
//! B = Kb pa (s3/pa)^m               phi = phi0 - dphi log10(s3/pa), no cohesion
//! ```
//!
//! Curves count that are sheared from an isotropic state under one confining pressure. Of each the hyperbola runs
//! through the points at 70 % and 95 % of its largest q, qf. B is q/3 over the volume strain at 70 %, or where the
//! volume is least if that comes before. A q that still rises at the end is taken for qf; its cell says so.

use crate::error::Result;

use super::axis::short;
use super::page::Section;
use super::run::{Curve, Largest, Run, Shearing};
use super::strength::{circle, differ};

/// pa [Pa]
const ATMOSPHERE: f64 = 101_325.0;
/// The confining pressure of one curve keeps within this share up to the largest q.
const STEADY_PRESSURE: f64 = 0.01;
/// A state is isotropic where q is at most this share of the curve's largest.
const ISOTROPIC: f64 = 0.05;

/// Refuses a curve that the model is not of, with the reason; `pressures` are the confining ones of its rows [Pa].
fn check(shearing: &Shearing, pressures: &[f64]) -> std::result::Result<(), &'static str> {
    let q = &shearing.curve.deviatoric_stress;
    let (peak, _) = shearing.curve.largest().ok_or("has no shear")?;
    let (least, most) = pressures
        .iter()
        .take(peak + 1)
        .fold((f64::INFINITY, 0.0_f64), |(least, most), p| (least.min(*p), most.max(*p)));
    if !(most - least <= STEADY_PRESSURE * most) {
        return Err("is not sheared under one confining pressure");
    }
    let start = shearing.start.or(q.first().copied()).unwrap_or(f64::NAN);
    if !(start.abs() <= ISOTROPIC * q[peak]) {
        return Err("begins sheared");
    }
    Ok(())
}

/// What one curve says by itself; stresses in Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Hyperbola {
    pressure: f64,
    initial_modulus: f64,
    failure_stress: f64,
    ultimate_stress: f64,
    /// `None` where the volume does not decrease.
    bulk_modulus: Option<f64>,
    /// Root mean square of the difference up to the largest q, over that.
    misfit: f64,
}

impl Hyperbola {
    /// Of a curve at a confining pressure [Pa]; otherwise why it is none.
    fn of(curve: &Curve, pressure: f64) -> std::result::Result<Self, &'static str> {
        let (strain, q) = (&curve.axial_strain, &curve.deviatoric_stress);
        let (peak, _) = curve.largest().ok_or("has no shear")?;
        let failure_stress = q[peak];
        if peak < 4 || !(failure_stress > 0.0) {
            return Err("has no rising curve");
        }
        let between = |at: usize, level: f64, values: &[f64]| {
            let part = (level - q[at - 1]) / (q[at] - q[at - 1]);
            values[at - 1] + part * (values[at] - values[at - 1])
        };
        // Where the curve first reaches a share of qf.
        let reach = |share: f64| {
            let level = share * failure_stress;
            let at = q.iter().position(|q| *q >= level).filter(|at| *at > 0)?;
            Some((between(at, level, strain), between(at, level, &curve.volumetric_strain)))
        };
        let (Some((e70, volume)), Some((e95, _))) = (reach(0.70), reach(0.95)) else {
            return Err("begins above 70 % of its largest q");
        };
        // e / q = a + b e
        let [y70, y95] = [(e70, 0.70), (e95, 0.95)].map(|(e, share)| e / (share * failure_stress));
        let b = (y95 - y70) / (e95 - e70);
        let a = y70 - b * e70;
        if !(e70 > 0.0 && e95 > e70 && a > 0.0 && b > 0.0) {
            return Err("is no hyperbola between 70 % and 95 % of its largest q");
        }
        let before = strain.iter().take_while(|e| **e < e70).count();
        let densest =
            (0..before).max_by(|a, b| curve.volumetric_strain[*a].total_cmp(&curve.volumetric_strain[*b]));
        let (stress, decrease) = match densest.map(|at| (q[at], curve.volumetric_strain[at])) {
            Some((stress, most)) if most > volume => (stress, most),
            _ => (0.70 * failure_stress, volume),
        };
        let squares = (0..=peak).map(|k| (strain[k] / (a + b * strain[k]) - q[k]).powi(2));
        Ok(Hyperbola {
            pressure,
            initial_modulus: 1.0 / a,
            failure_stress,
            ultimate_stress: 1.0 / b,
            bulk_modulus: (decrease > 0.0).then_some(stress / 3.0 / decrease),
            misfit: (squares.sum::<f64>() / (peak + 1) as f64).sqrt() / failure_stress,
        })
    }

    fn failure_ratio(&self) -> f64 {
        self.failure_stress / self.ultimate_stress
    }

    /// Without cohesion [rad].
    fn friction_angle(&self) -> f64 {
        (self.failure_stress / (self.failure_stress + 2.0 * self.pressure)).asin()
    }

    /// The cells of the table behind the run's name; qf says where the largest q is no peak.
    fn cells(&self, largest: Option<Largest>) -> Vec<String> {
        let mega = |x: f64| short(1e-6 * x);
        let remark = largest.map_or("", Largest::remark);
        let bulk = self.bulk_modulus.map_or("–".to_string(), mega);
        let [ratio, misfit] = [self.failure_ratio(), self.misfit].map(short);
        let angle = short(self.friction_angle().to_degrees());
        let failure_stress = mega(self.failure_stress) + remark;
        vec![mega(self.pressure), mega(self.initial_modulus), failure_stress, ratio, bulk, angle, misfit]
    }
}

/// Intercept and slope of the least-squares line through `values` over `log10(s3/pa)`; none of one pressure.
fn line(found: &[(f64, f64)]) -> Option<[f64; 2]> {
    if !differ(found.iter().map(|(pressure, _)| *pressure)) {
        return None;
    }
    let points: Vec<[f64; 2]> = found.iter().map(|(s3, value)| [(s3 / ATMOSPHERE).log10(), *value]).collect();
    let mean = |k: usize| points.iter().map(|point| point[k]).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(0), mean(1));
    let slope = points.iter().map(|p| (p[0] - x) * (p[1] - y)).sum::<f64>()
        / points.iter().map(|p| (p[0] - x).powi(2)).sum::<f64>();
    Some([y - slope * x, slope])
}

/// Names and values of the parameters that several hyperbolas have together.
fn parameters(found: &[Hyperbola]) -> Vec<(&'static str, f64)> {
    let over = |value: fn(&Hyperbola) -> Option<f64>| {
        let values = found.iter().filter_map(|h| Some((h.pressure, value(h)?)));
        line(&values.collect::<Vec<_>>())
    };
    let mut all = Vec::new();
    if let Some([k, n]) = over(|h| Some((h.initial_modulus / ATMOSPHERE).log10())) {
        let ratios: f64 = found.iter().map(Hyperbola::failure_ratio).sum();
        all.extend([("K", 10f64.powf(k)), ("n", n), ("Rf", ratios / found.len() as f64)]);
    }
    if let Some([k, m]) = over(|h| h.bulk_modulus.map(|b| (b / ATMOSPHERE).log10())) {
        all.extend([("Kb", 10f64.powf(k)), ("m", m)]);
    }
    if let Some([phi, slope]) = over(|h| Some(h.friction_angle().to_degrees())) {
        all.extend([("φ0 [°]", phi), ("Δφ [°]", -slope)]);
    }
    all
}

/// What is said of parameters where the largest q of these runs is no peak.
fn provisional(unfinished: &[&str]) -> Option<String> {
    let runs = unfinished.join(", ");
    (!unfinished.is_empty())
        .then(|| format!("provisional: qf is no peak of {runs}; strained on, all would change"))
}

/// The hyperbola of each specimen, and the parameters of all; nothing where there is but one run or none has a hyperbola.
pub fn sections(runs: &[Run]) -> Result<Vec<Section>> {
    let (mut found, mut rows, mut unfinished) = (Vec::new(), Vec::new(), Vec::new());
    for run in runs.iter().filter(|run| !run.is_scene()) {
        let shearing = run.shearing()?;
        let Some(circle) = circle(run, &shearing)? else { continue };
        let confining = run.column("confining_pressure")?;
        let pressures: Vec<f64> = shearing.rows.iter().map(|row| confining[*row]).collect();
        match check(&shearing, &pressures).and_then(|()| Hyperbola::of(&shearing.curve, circle.minor)) {
            Ok(h) => {
                let largest = shearing.curve.largest().map(|(_, largest)| largest);
                if largest != Some(Largest::Peak) {
                    unfinished.push(run.label.as_str());
                }
                rows.push([vec![run.label.clone()], h.cells(largest)].concat());
                found.push(h);
            }
            Err(problem) => {
                rows.push(vec![run.label.clone(), format!("{} – {problem}", short(1e-6 * circle.minor))])
            }
        }
    }
    if runs.len() < 2 || found.is_empty() {
        return Ok(Vec::new());
    }
    let header = ["run", "σ3 [MPa]", "Ei [MPa]", "qf [MPa]", "Rf", "B [MPa]", "φ [°]", "misfit"];
    let table = |header: Vec<String>, rows| Section::Table(header, rows);
    let mut sections = vec![
        Section::Heading("Duncan-Chang parameters".into()),
        table(header.map(String::from).to_vec(), rows),
    ];
    let mut parameters: Vec<(&str, String)> =
        parameters(&found).into_iter().map(|(name, value)| (name, short(value))).collect();
    if !parameters.is_empty() {
        parameters.extend(provisional(&unfinished).map(|said| ("", said)));
        let (names, values): (Vec<&str>, Vec<String>) = parameters.into_iter().unzip();
        sections.push(table(names.into_iter().map(String::from).collect(), vec![values]));
    }
    Ok(sections)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_of_other_tests_are_refused() {
        let sheared = |first: f64, start| {
            let deviatoric_stress = vec![first, 5e5, 1e6, 9e5];
            let axial_strain = vec![0.0, 0.01, 0.02, 0.03];
            let curve = Curve { deviatoric_stress, volumetric_strain: vec![0.0; 4], axial_strain };
            Shearing { rows: (0..4).collect(), curve, behind_consolidation: true, start }
        };
        let drained = [4e5, 4.02e5, 4e5, 8e5];
        assert_eq!(check(&sheared(1e4, None), &drained), Ok(()));
        assert_eq!(check(&sheared(2e5, None), &drained), Err("begins sheared"));
        // The first increment of a run that starts from a consolidated specimen.
        assert_eq!(check(&sheared(2e5, Some(0.0)), &drained), Ok(()));
        let undrained = [4e5, 3e5, 2.5e5, 2.5e5];
        assert_eq!(
            check(&sheared(0.0, None), &undrained),
            Err("is not sheared under one confining pressure")
        );
    }

    #[test]
    fn a_strength_that_is_not_reached_is_marked() {
        let h = Hyperbola {
            pressure: 1e6,
            initial_modulus: 1e8,
            failure_stress: 3e6,
            ultimate_stress: 4e6,
            bulk_modulus: None,
            misfit: 0.0,
        };
        assert_eq!(h.cells(Some(Largest::Peak))[2], "3");
        assert_eq!(h.cells(Some(Largest::AtEnd))[2], "3, at the end: still rising");
        assert_eq!(provisional(&[]), None);
        let said = provisional(&["A", "B"]).expect("a remark");
        assert!(said.starts_with("provisional: qf is no peak of A, B;"), "{said}");
    }

    /// Curves that the model itself makes, 2000 points each, so that interpolation between them is good to 1e-6.
    #[test]
    fn parameters_of_synthetic_curves_are_found() {
        let given = [1200.0, 0.45, 0.78, 600.0, 0.2, 52.0, 9.0];
        let [k, n, rf, kb, m, phi, drop] = given;
        let curve = |pressure: f64| {
            let ratio = pressure / ATMOSPHERE;
            let sine = f64::to_radians(phi - drop * ratio.log10()).sin();
            let strength = 2.0 * pressure * sine / (1.0 - sine);
            let modulus = k * ATMOSPHERE * ratio.powf(n);
            let bulk = kb * ATMOSPHERE * ratio.powf(m);
            let last = strength / modulus / (1.0 - rf);
            let strain: Vec<f64> = (0..2000).map(|i| last * i as f64 / 1999.0).collect();
            let q: Vec<f64> = strain.iter().map(|e| e / (1.0 / modulus + rf * e / strength)).collect();
            let volumetric_strain = q.iter().map(|q| q / 3.0 / bulk).collect();
            Hyperbola::of(&Curve { axial_strain: strain, volumetric_strain, deviatoric_stress: q }, pressure)
        };
        let found = [0.4e6, 0.8e6, 1.6e6, 2.5e6].map(|pressure| curve(pressure).expect("a hyperbola"));
        assert!(found.iter().all(|h| h.misfit < 1e-6));
        let parameters = parameters(&found);
        assert_eq!(parameters.len(), given.len());
        for ((name, value), expected) in parameters.iter().zip(given) {
            assert!((value / expected - 1.0).abs() < 1e-6, "{name}: {value} {expected}");
        }
        assert_eq!(super::parameters(&found[..1]), []);
        let strain: Vec<f64> = (0..2000).map(|i| 1e-6 * i as f64).collect();
        let straight = Curve {
            deviatoric_stress: strain.iter().map(|e| 1e9 * e).collect(),
            volumetric_strain: strain.clone(),
            axial_strain: strain,
        };
        assert!(Hyperbola::of(&straight, 1e6).is_err());
    }
}
