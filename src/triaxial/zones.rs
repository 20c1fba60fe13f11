//! Where the shear strain is: little in cones under the plates, much in a band.
//!
//! Rough ends hold the grains beside them; what they hold is about a cone on each plate, with sides at 45 degrees (Rowe & Barden
//! 1964, J. Soil Mech. Found. Div. 90:1). A shear band is a layer in which the strain is: its thickness follows from the
//! spread of the grains' positions weighted with the squared shear strain, against their spread without weights, so that the
//! specimen's own shape does not count.

use crate::tensor::{Mat3, Vec3};
use crate::triaxial::deformation::LocalStrain;

/// How the shear strain is distributed in the specimen; not a number where there are too few grains to say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Zones {
    /// Mean shear strain around the grains in the cones over that around the others: 1 where ends do not matter, towards
    /// 0 where the cones are dead.
    pub cone_shear: f64,
    /// Spread of the shear strain across the layer that fits it best, over the larger of those along it: 1 where it is
    /// everywhere, in a lump or on a line, towards 0 where it is in a plane.
    pub band_flatness: f64,
    /// Angle between that layer and the horizontal [rad]; means little where the flatness is near 1.
    pub band_inclination: f64,
}

impl Zones {
    /// `positions` [m] are those of the grains before the strains, about the axis and from the bottom of a specimen of
    /// `height` and `radius` [m].
    pub fn of(positions: &[Vec3], strains: &[LocalStrain], height: f64, radius: f64) -> Self {
        let known: Vec<(Vec3, f64)> = positions
            .iter()
            .zip(strains)
            .filter_map(|(x, strain)| strain.shear.is_finite().then_some((*x, strain.shear)))
            .collect();
        let tall = radius.min(0.5 * height);
        let in_a_cone = |x: &Vec3| {
            let depth = x.z.min(height - x.z);
            x.xy().norm() < radius * (1.0 - depth / tall)
        };
        let mean = |inside: bool| {
            let of = || known.iter().filter(|(x, _)| in_a_cone(x) == inside);
            of().map(|(_, shear)| shear).sum::<f64>() / of().count() as f64
        };
        let (band_flatness, band_inclination) = layer(&known).unwrap_or((f64::NAN, f64::NAN));
        Zones { cone_shear: mean(true) / mean(false), band_flatness, band_inclination }
    }
}

/// Mean square distances of weighted points from their mean.
fn spread(points: impl Iterator<Item = (Vec3, f64)> + Clone) -> Mat3 {
    let total: f64 = points.clone().map(|(_, w)| w).sum();
    let middle = points.clone().map(|(x, w)| x * w).sum::<Vec3>() / total;
    points.map(|(x, w)| (x - middle) * (x - middle).transpose() * w).sum::<Mat3>() / total
}

/// Flatness and inclination of the layer in which the squared strains are.
fn layer(known: &[(Vec3, f64)]) -> Option<(f64, f64)> {
    let plain = spread(known.iter().map(|(x, _)| (*x, 1.0)));
    let strained = spread(known.iter().map(|(x, shear)| (*x, shear * shear)));
    // Strained spread n = value times plain spread n.
    let lower = plain.cholesky()?.l();
    let inverse = lower.try_inverse()?;
    let relative = inverse * strained * inverse.transpose();
    if !relative.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let eigen = (0.5 * (relative + relative.transpose())).symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    let mut values: Vec<f64> = eigen.eigenvalues.iter().map(|value| value.max(0.0)).collect();
    values.sort_by(f64::total_cmp);
    let normal = (inverse.transpose() * eigen.eigenvectors.column(least)).try_normalize(0.0)?;
    Some(((values[0] / values[1]).sqrt(), normal.z.abs().min(1.0).acos()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEIGHT: f64 = 0.8;
    const RADIUS: f64 = 0.2;

    /// A cylinder of points on a lattice, and the strain that `shear` gives each.
    fn zones(shear: impl Fn(&Vec3) -> f64) -> Zones {
        let mut positions = Vec::new();
        for i in -9i32..=9 {
            for j in -9i32..=9 {
                for k in 0..40 {
                    let x = Vec3::new(f64::from(i), f64::from(j), f64::from(k) + 0.5) * 0.02;
                    if x.xy().norm() < RADIUS {
                        positions.push(x);
                    }
                }
            }
        }
        let strain = |x: &Vec3| LocalStrain { shear: shear(x), volumetric: 0.0, rotation: 0.0 };
        let strains: Vec<LocalStrain> = positions.iter().map(strain).collect();
        Zones::of(&positions, &strains, HEIGHT, RADIUS)
    }

    #[test]
    fn even_strain_has_no_cones_and_no_band() {
        let even = zones(|_| 0.03);
        assert!((even.cone_shear - 1.0).abs() < 1e-12, "{even:?}");
        assert!((even.band_flatness - 1.0).abs() < 1e-9, "{even:?}");
        assert!(zones(|_| f64::NAN).cone_shear.is_nan());
    }

    #[test]
    fn dead_cones_are_seen() {
        let depth = |x: &Vec3| x.z.min(HEIGHT - x.z);
        let dead = zones(|x| if x.xy().norm() < RADIUS - depth(x) { 0.01 } else { 0.04 });
        assert!((dead.cone_shear - 0.25).abs() < 1e-12, "{dead:?}");
    }

    /// Strain in the lattice points of an inclined plane alone; of a thick layer at any angle a share of the specimen's spread.
    #[test]
    fn a_band_has_its_inclination() {
        for (rise, run) in [(0.0, 1.0), (1.0, 1.0), (2.0, 1.0)] {
            let plane = zones(|x| {
                let z = x.z - 0.41;
                if (z * run - x.x * rise).abs() < 1e-9 { 0.05 } else { 0.0 }
            });
            let angle = f64::atan2(rise, run);
            assert!(plane.band_flatness < 1e-6 && (plane.band_inclination - angle).abs() < 1e-6, "{plane:?}");
        }
        // A slab across the axis, a quarter of the height thick: its spread is a quarter of the height's.
        let slab = zones(|x| if (x.z - 0.4).abs() < 0.1 { 0.05 } else { 0.0 });
        let share = f64::sqrt((10.0f64.powi(2) - 1.0) / (40.0f64.powi(2) - 1.0));
        assert!((slab.band_flatness - share).abs() < 1e-9 && slab.band_inclination < 1e-6, "{slab:?}");
    }

    /// A lump is no band. Of an ellipsoid a fifth of each squared semi-axis is its spread, of the cylinder a quarter of the
    /// squared radius and a third of the squared half height: so sqrt(3/4), to the lattice's spacing over the lump.
    #[test]
    fn a_lump_is_no_band() {
        let lump = zones(|x| {
            let scaled = Vec3::new(x.x / RADIUS, x.y / RADIUS, (x.z - 0.4) / (0.5 * HEIGHT));
            if scaled.norm() < 0.5 { 0.05 } else { 0.0 }
        });
        assert!((lump.band_flatness - 0.75f64.sqrt()).abs() < 0.05, "{lump:?}");
    }
}
