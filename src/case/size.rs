//! How many grains fill how large a specimen: estimates for the check, before any is generated.

use std::f64::consts::PI;

/// Mean volume of a grain over the volume of the ellipsoid in which its vertices lie, for 8-16
/// vertices kept 0.45 apart; a test measures it.
pub const HULL_SHARE: f64 = 0.42;

/// Mean volume of a grain [m3] of a grading of sieve sizes [m] and mass fractions passing.
///
/// Semi-axes are uniform within half the sizes of a class (Ma et al. 2011, eq. 1), independent, so
/// that their mean product is the cube of their mean.
pub fn mean_grain_volume(grading: &[[f64; 2]]) -> f64 {
    let per_volume: f64 = grading
        .windows(2)
        .map(|class| {
            let [upper, lower] = [class[0], class[1]];
            let semi_axis = (upper[0] + lower[0]) / 4.0;
            (upper[1] - lower[1]) / (HULL_SHARE * 4.0 / 3.0 * PI * semi_axis.powi(3))
        })
        .sum();
    1.0 / per_volume
}

/// Volume of a cylinder [m3].
pub fn cylinder(diameter: f64, height: f64) -> f64 {
    PI / 4.0 * diameter * diameter * height
}

/// Diameter [m] of the cylinder of this volume [m3] with `aspect` = height over diameter.
pub fn diameter_of(volume: f64, aspect: f64) -> f64 {
    (4.0 * volume / (PI * aspect)).cbrt()
}
