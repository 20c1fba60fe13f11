//! What a stage came to: peak, residual, moduli. Compression positive, angles in radians.

use serde::{Deserialize, Serialize};

use crate::triaxial::measures::Measures;
use crate::triaxial::test::Row;

/// A stage summed up; not a number where it has no such point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageSummary {
    /// Largest deviatoric stress [Pa] and the axial strain where it is met.
    pub peak: [f64; 2],
    /// Of the largest ratio of principal stresses.
    pub peak_friction_angle: f64,
    /// Mean over the last tenth of the stage's axial strain, if the deviatoric stress stays
    /// 2 % below its peak there.
    pub residual_friction_angle: f64,
    /// First tangent modulus of the stage [Pa].
    pub initial_modulus: f64,
    /// Secant modulus from the start of the stage to half the rise of the deviatoric stress to its peak, E50 [Pa].
    pub half_modulus: f64,
    pub largest_dilatancy_angle: f64,
}

/// A point of the stage's curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Point {
    axial_strain: f64,
    deviatoric_stress: f64,
    friction_angle: f64,
    tangent_modulus: f64,
    dilatancy_angle: f64,
}

/// The curve of a stage in the making.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StageCurve {
    /// Axial strain and deviatoric stress [Pa] before the first increment.
    start: Option<[f64; 2]>,
    points: Vec<Point>,
}

/// Share of the peak that has to be lost before what is left counts as residual.
const LOST: f64 = 0.02;
const LAST_PART: f64 = 0.1;

impl StageCurve {
    /// The curve of a stage that begins with these measures.
    pub fn starting_at(measures: &Measures) -> Self {
        let start = Some([measures.axial_strain, measures.deviatoric_stress]);
        StageCurve { start, points: Vec::new() }
    }

    pub fn push(&mut self, row: &Row) {
        self.points.push(Point {
            axial_strain: row.measures.axial_strain,
            deviatoric_stress: row.measures.deviatoric_stress,
            friction_angle: row.response.friction_angle,
            tangent_modulus: row.response.tangent_modulus,
            dilatancy_angle: row.response.dilatancy_angle,
        });
    }

    pub fn summary(&self) -> StageSummary {
        let none = f64::NAN;
        let by_stress = |a: &&Point, b: &&Point| a.deviatoric_stress.total_cmp(&b.deviatoric_stress);
        let peak = self.points.iter().max_by(by_stress);
        let largest = |of: fn(&Point) -> f64| self.points.iter().map(of).fold(none, f64::max);
        StageSummary {
            peak: peak.map_or([none; 2], |peak| [peak.deviatoric_stress, peak.axial_strain]),
            peak_friction_angle: largest(|p| p.friction_angle),
            residual_friction_angle: self.residual().unwrap_or(none),
            initial_modulus: self
                .points
                .iter()
                .map(|p| p.tangent_modulus)
                .find(|e| e.is_finite())
                .unwrap_or(none),
            half_modulus: self.half_modulus().unwrap_or(none),
            largest_dilatancy_angle: largest(|p| p.dilatancy_angle),
        }
    }

    fn residual(&self) -> Option<f64> {
        let (first, last) = (self.points.first()?, self.points.last()?);
        let from = last.axial_strain - LAST_PART * (last.axial_strain - first.axial_strain);
        let end: Vec<&Point> = self.points.iter().filter(|p| p.axial_strain >= from).collect();
        let count = end.len() as f64;
        let stress = end.iter().map(|p| p.deviatoric_stress).fold(f64::NAN, f64::max);
        let peak = self.points.iter().map(|p| p.deviatoric_stress).fold(f64::NAN, f64::max);
        (stress < (1.0 - LOST) * peak).then(|| end.iter().map(|p| p.friction_angle).sum::<f64>() / count)
    }

    fn half_modulus(&self) -> Option<f64> {
        let start = self.start?;
        let peak = self.points.iter().map(|p| p.deviatoric_stress).fold(f64::NAN, f64::max);
        let half = 0.5 * (start[1] + peak);
        let mut before = start;
        for now in self.points.iter().map(|p| [p.axial_strain, p.deviatoric_stress]) {
            if now[1] >= half && now[1] > before[1] {
                let strain = before[0] + (half - before[1]) / (now[1] - before[1]) * (now[0] - before[0]);
                return Some((half - start[1]) / (strain - start[0])).filter(|e| e.is_finite());
            }
            before = now;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(points: &[(f64, f64)]) -> StageCurve {
        let point = |&(axial_strain, q): &(f64, f64)| Point {
            axial_strain,
            deviatoric_stress: q,
            friction_angle: (q / (2e5 + q)).asin(),
            tangent_modulus: 1e8,
            dilatancy_angle: 0.1,
        };
        // The start is no row.
        let start = points.first().map(|&(strain, q)| [strain, q]);
        StageCurve { start, points: points.iter().skip(1).map(point).collect() }
    }

    #[test]
    fn peak_residual_and_half_modulus_of_a_curve_in_three_lines() {
        // Up to 0.4 MPa at 1 %, down to 0.2 MPa at 2 %, then level to 4 %.
        let mut points: Vec<(f64, f64)> =
            (0..=10).map(|k| (1e-3 * f64::from(k), 4e4 * f64::from(k))).collect();
        points.extend((1..=10).map(|k| (0.01 + 1e-3 * f64::from(k), 4e5 - 2e4 * f64::from(k))));
        points.extend((1..=20).map(|k| (0.02 + 1e-3 * f64::from(k), 2e5)));
        let s = curve(&points).summary();
        assert_eq!(s.peak, [4e5, 0.01]);
        assert!((s.peak_friction_angle - (2.0f64 / 3.0).asin()).abs() < 1e-12);
        assert!((s.residual_friction_angle - 0.5f64.asin()).abs() < 1e-12);
        assert!((s.half_modulus / 4e7 - 1.0).abs() < 1e-9 && s.initial_modulus == 1e8);
    }

    /// Of a hyperbola E50 is the secant to half its last stress, in long increments too.
    #[test]
    fn half_modulus_counts_from_the_start_of_the_stage() {
        let q = |strain: f64| 2e6 * strain / (2e-3 + strain);
        for increments in [10, 1000] {
            let strains = (0..=increments).map(|k| 0.05 * f64::from(k) / f64::from(increments));
            let points: Vec<(f64, f64)> = strains.map(|e| (e, q(e))).collect();
            // The strain of half q is 2e-3 x / (1 - x) with x = 0.5 * 0.05 / 0.052.
            let half = 0.5 * q(0.05);
            let exact = half / (2e-3 * half / (2e6 - half));
            // Within the first increment of the coarse curve what is known is its chord.
            let expected = if increments == 10 { q(5e-3) / 5e-3 } else { exact };
            let found = curve(&points).summary().half_modulus;
            assert!((found / expected - 1.0).abs() < 2e-3, "{increments}: {found:e} {expected:e}");
        }
        // An unloading has no rise.
        assert!(curve(&[(0.02, 4e5), (0.019, 2e5), (0.018, 1e5)]).summary().half_modulus.is_nan());
    }

    #[test]
    fn a_rising_curve_has_no_residual_and_an_empty_one_nothing() {
        let rising: Vec<(f64, f64)> = (0..=10).map(|k| (1e-3 * f64::from(k), 4e4 * f64::from(k))).collect();
        assert!(curve(&rising).summary().residual_friction_angle.is_nan());
        let empty = StageCurve::default().summary();
        assert!(empty.peak[0].is_nan() && empty.half_modulus.is_nan() && empty.initial_modulus.is_nan());
    }
}
