//! What the stress-strain curve says at a point: moduli, dilatancy, friction angles. Compression
//! positive, angles in radians.

use serde::{Deserialize, Serialize};

use std::collections::VecDeque;

/// Slopes are taken over this much axial strain, and over at least so many increments.
const WINDOW: f64 = 1e-3;
const FEWEST: usize = 4;

/// Moduli and angles at an accepted increment; not a number where they mean nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Slope of the deviatoric stress over the axial strain [Pa], by least squares over the last part
    /// of the stage (0.1 % axial strain, at least four increments).
    pub tangent_modulus: f64,
    /// Change of the deviatoric stress since the start of the stage over that of the axial strain [Pa].
    pub secant_modulus: f64,
    /// From the slope `d` of the volumetric over the axial strain, taken as the tangent is:
    /// `sin psi = -d / (2 - d)` (Schanz & Vermeer 1996, Geotechnique 46:145); positive where the volume grows. Of compression only.
    pub dilatancy_angle: f64,
    /// Mobilised: `sin phi = q / (2 confining + q)`.
    pub friction_angle: f64,
    /// The largest mobilised since the curve began.
    pub peak_friction_angle: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Sample {
    axial_strain: f64,
    volumetric_strain: f64,
    deviatoric_stress: f64,
}

/// The curve of a stage so far, as much as is needed of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    start: Option<Sample>,
    recent: VecDeque<Sample>,
    peak: f64,
}

impl Curve {
    /// A curve that has not begun; `peak` is the largest friction angle met before.
    pub fn new(peak: f64) -> Self {
        Curve { start: None, recent: VecDeque::new(), peak }
    }

    /// The largest friction angle so far; negative infinity before the first.
    pub fn peak(&self) -> f64 {
        self.peak
    }

    /// Enters a point; the first is where the stage starts.
    pub fn push(
        &mut self,
        axial_strain: f64,
        volumetric_strain: f64,
        deviatoric_stress: f64,
        confining_pressure: f64,
    ) -> Response {
        let sample = Sample { axial_strain, volumetric_strain, deviatoric_stress };
        self.start.get_or_insert(sample);
        self.recent.push_back(sample);
        while self.recent.len() > FEWEST + 1
            && self.recent.get(1).is_some_and(|s| (axial_strain - s.axial_strain).abs() >= WINDOW)
        {
            self.recent.pop_front();
        }
        let sine = deviatoric_stress / (2.0 * confining_pressure + deviatoric_stress);
        let friction_angle = sine.asin();
        // Shared by the whole test; the start of a stage repeats the end of the one before.
        if friction_angle > self.peak {
            self.peak = friction_angle;
        }
        let compresses = self.recent.front().is_some_and(|first| axial_strain > first.axial_strain);
        let slope = if compresses { self.slope(|s| s.volumetric_strain) } else { f64::NAN };
        Response {
            tangent_modulus: self.tangent_modulus(),
            secant_modulus: self.secant_modulus(),
            dilatancy_angle: (-slope / (2.0 - slope)).asin(),
            friction_angle,
            peak_friction_angle: self.peak,
        }
    }

    /// Slope of the deviatoric stress over the axial strain at the last point [Pa].
    pub fn tangent_modulus(&self) -> f64 {
        self.slope(|s| s.deviatoric_stress)
    }

    /// The same from the first to the last point [Pa].
    pub fn secant_modulus(&self) -> f64 {
        match (&self.start, self.recent.back()) {
            (Some(start), Some(last)) => {
                (last.deviatoric_stress - start.deviatoric_stress) / (last.axial_strain - start.axial_strain)
            }
            (None, _) | (_, None) => f64::NAN,
        }
    }

    /// Least squares over the recent points.
    fn slope(&self, of: impl Fn(&Sample) -> f64) -> f64 {
        let n = self.recent.len() as f64;
        let mean_strain = self.recent.iter().map(|s| s.axial_strain).sum::<f64>() / n;
        let mean = self.recent.iter().map(&of).sum::<f64>() / n;
        let (mut covariance, mut variance) = (0.0, 0.0);
        for sample in &self.recent {
            let strain = sample.axial_strain - mean_strain;
            covariance += strain * (of(sample) - mean);
            variance += strain * strain;
        }
        covariance / variance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_curves_give_their_slopes_and_angles() {
        let mut curve = Curve::new(f64::NEG_INFINITY);
        let (modulus, d, p) = (4e7, -0.5, 2e5);
        let mut last = None;
        for step in 0..50 {
            let strain = 1e-4 * f64::from(step);
            last = Some(curve.push(strain, d * strain, 1e4 + modulus * strain, p));
        }
        let r = last.expect("points");
        assert!((r.tangent_modulus / modulus - 1.0).abs() < 1e-9, "{r:?}");
        assert!((r.secant_modulus / modulus - 1.0).abs() < 1e-9);
        // sin psi = 0.5 / 2.5
        assert!((r.dilatancy_angle - 0.2f64.asin()).abs() < 1e-9);
        let q = 1e4 + modulus * 49e-4;
        assert!((r.friction_angle - (q / (2.0 * p + q)).asin()).abs() < 1e-12);
    }

    #[test]
    fn tangent_forgets_and_the_peak_stays() {
        let mut curve = Curve::new(f64::NEG_INFINITY);
        // Up to 0.3 MPa over 0.5 %, then down again: principal stress ratio 4 at the peak, phi = 36.87 deg.
        for step in 0..=50 {
            curve.push(1e-4 * f64::from(step), 0.0, 6e7 * 1e-4 * f64::from(step), 1e5);
        }
        let mut last = None;
        for step in 51..=80 {
            last =
                Some(curve.push(1e-4 * f64::from(step), 0.0, 3e5 - 2e7 * 1e-4 * f64::from(step - 50), 1e5));
        }
        let r = last.expect("points");
        assert!((r.tangent_modulus / -2e7 - 1.0).abs() < 1e-9, "{r:?}");
        assert!((r.peak_friction_angle - 0.6f64.asin()).abs() < 1e-12);
        assert!(r.friction_angle < r.peak_friction_angle);
        assert!(r.dilatancy_angle.abs() < 1e-12);
    }

    /// Increments longer than the window: of a parabola the slope is that at the middle of the last four.
    #[test]
    fn slopes_are_over_four_increments_at_least() {
        let mut curve = Curve::new(f64::NEG_INFINITY);
        let mut last = None;
        for step in 0..10 {
            let strain = 2e-3 * f64::from(step);
            last = Some(curve.push(strain, 0.0, 1e10 * strain * strain, 1e5));
        }
        let modulus = last.expect("points").tangent_modulus;
        assert!((modulus / (2e10 * 2e-3 * 7.0) - 1.0).abs() < 1e-9, "{modulus:e}");
    }

    /// The volume grows as the load goes; that says nothing of how rock dilates in shear.
    #[test]
    fn an_unloading_has_no_dilatancy_angle() {
        let mut curve = Curve::new(f64::NEG_INFINITY);
        for step in 0..10 {
            let strain = 0.01 - 1e-4 * f64::from(step);
            let r = curve.push(strain, 0.3 * strain, 1e8 * strain, 1e5);
            assert!(r.dilatancy_angle.is_nan(), "{r:?}");
            assert!(step == 0 || (r.tangent_modulus / 1e8 - 1.0).abs() < 1e-9, "{r:?}");
        }
    }

    #[test]
    fn a_single_point_has_no_slope() {
        let r = Curve::new(f64::NEG_INFINITY).push(0.0, 0.0, 0.0, 1e5);
        assert!(r.tangent_modulus.is_nan() && r.secant_modulus.is_nan() && r.dilatancy_angle.is_nan());
        assert_eq!(r.friction_angle, 0.0);
    }
}
