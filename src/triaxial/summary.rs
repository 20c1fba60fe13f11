//! What a stage came to: peak, residual, moduli. Compression positive, angles in radians.

use serde::{Deserialize, Serialize};

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
    /// Secant modulus to half the rise of the deviatoric stress, E50 [Pa].
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
    points: Vec<Point>,
}

/// Share of the peak that has to be lost before what is left counts as residual.
const LOST: f64 = 0.02;
const LAST_PART: f64 = 0.1;

impl StageCurve {
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
        let first = self.points.first()?;
        let peak = self.points.iter().map(|p| p.deviatoric_stress).fold(f64::NAN, f64::max);
        let half = 0.5 * (first.deviatoric_stress + peak);
        let pair = self.points.windows(2).find(|w| w[1].deviatoric_stress >= half)?;
        let rise = pair[1].deviatoric_stress - pair[0].deviatoric_stress;
        let share = if rise > 0.0 { (half - pair[0].deviatoric_stress) / rise } else { 1.0 };
        let strain = pair[0].axial_strain + share * (pair[1].axial_strain - pair[0].axial_strain);
        Some((half - first.deviatoric_stress) / (strain - first.axial_strain)).filter(|e| e.is_finite())
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
        StageCurve { points: points.iter().map(point).collect() }
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

    #[test]
    fn a_rising_curve_has_no_residual_and_an_empty_one_nothing() {
        let rising: Vec<(f64, f64)> = (0..=10).map(|k| (1e-3 * f64::from(k), 4e4 * f64::from(k))).collect();
        assert!(curve(&rising).summary().residual_friction_angle.is_nan());
        let empty = StageCurve::default().summary();
        assert!(empty.peak[0].is_nan() && empty.half_modulus.is_nan() && empty.initial_modulus.is_nan());
    }
}
