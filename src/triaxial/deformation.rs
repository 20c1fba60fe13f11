//! Where the specimen deforms: slices of its height, rotations of grains, and the displacement
//! gradient around each grain. Compression positive.
//!
//! The gradient around a grain is the best affine fit to how its neighbours moved relative to it
//! (Falk & Langer 1998, Phys. Rev. E 57:7192, eq. 2.11-2.13). Of the deformation gradient F the strain
//! is Green's, `(F^T F - I) / 2`, so that a block that turns as a whole is not strained.

use serde::{Deserialize, Serialize};

use crate::tensor::{Mat3, Pose, Vec3};

/// Slices of equal height, from the bottom.
pub const SLICES: usize = 5;
/// Grains count as neighbours within this many mean diameters of the two, but at least so many.
const REACH: f64 = 1.5;
const FEWEST: usize = 6;
/// A grain below this share of the mean shear strain lies in a dead zone.
const DEAD: f64 = 1.0 / 3.0;

/// Neighbours of each grain in a reference configuration.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Neighbourhood {
    reference: Vec<Pose>,
    neighbours: Vec<Vec<u32>>,
}

/// What happens around a grain since the reference configuration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LocalStrain {
    /// `sqrt(2/3 e:e)` of the deviator e of the strain; not a number without enough neighbours.
    pub shear: f64,
    /// `1 - det F`, compression positive.
    pub volumetric: f64,
    /// Angle by which the grain has turned [rad].
    pub rotation: f64,
}

impl LocalStrain {
    /// Where there is nothing to say.
    pub const UNKNOWN: LocalStrain =
        LocalStrain { shear: f64::NAN, volumetric: f64::NAN, rotation: f64::NAN };
}

/// How unevenly the specimen deforms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unevenness {
    /// Mean angle by which grains have turned [rad].
    pub mean_rotation: f64,
    /// 0 where all grains see the same shear strain; towards 1 where few see it all:
    /// `1 - (sum s)^2 / (n sum s^2)`.
    pub localisation: f64,
    /// Share of the grains that see less than a third of the mean shear strain.
    pub dead_fraction: f64,
}

impl Neighbourhood {
    /// `diameters` [m] are those of the grains, `poses` begins with theirs.
    pub fn new(poses: &[Pose], diameters: &[f64]) -> Self {
        let count = diameters.len().min(poses.len());
        let reference = poses[..count].to_vec();
        let neighbours = (0..count).map(|i| {
            let mut others: Vec<(f64, u32)> = (0..count)
                .filter(|&j| j != i)
                .map(|j| {
                    let distance = (reference[j].position - reference[i].position).norm();
                    (distance / (0.5 * (diameters[i] + diameters[j])), j as u32)
                })
                .collect();
            others.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let near = others.iter().take_while(|(ratio, _)| *ratio <= REACH).count().max(FEWEST);
            others.truncate(near);
            others.into_iter().map(|(_, j)| j).collect()
        });
        let neighbours = neighbours.collect();
        Neighbourhood { reference, neighbours }
    }

    /// The deformation gradient around grain `i`; `None` where those of its neighbours that are there do not span space.
    fn gradient(&self, poses: &[Pose], is_there: impl Fn(usize) -> bool, i: usize) -> Option<Mat3> {
        let (mut moved, mut spread) = (Mat3::zeros(), Mat3::zeros());
        for j in self.neighbours[i].iter().map(|&j| j as usize).filter(|&j| is_there(j)) {
            let before: Vec3 = self.reference[j].position - self.reference[i].position;
            let now: Vec3 = poses[j].position - poses[i].position;
            moved += now * before.transpose();
            spread += before * before.transpose();
        }
        // Neighbours in a plane leave one direction without a motion.
        let size = spread.trace() / 3.0;
        if spread.determinant() < 1e-6 * size.powi(3) {
            return None;
        }
        spread.try_inverse().map(|inverse| moved * inverse)
    }

    /// Where the grains were [m].
    pub fn positions(&self) -> Vec<Vec3> {
        self.reference[..self.neighbours.len()].iter().map(|pose| pose.position).collect()
    }

    /// What happened around each grain; not a number of those of which nothing is left.
    pub fn local_strains(&self, poses: &[Pose], is_there: impl Fn(usize) -> bool) -> Vec<LocalStrain> {
        let around = |i: usize| {
            if !is_there(i) {
                return LocalStrain::UNKNOWN;
            }
            let rotation = (poses[i].rotation * self.reference[i].rotation.inverse()).angle();
            let Some(f) = self.gradient(poses, &is_there, i) else {
                return LocalStrain { rotation, ..LocalStrain::UNKNOWN };
            };
            let strain = 0.5 * (f.transpose() * f - Mat3::identity());
            let deviator = strain - Mat3::from_diagonal_element(strain.trace() / 3.0);
            LocalStrain {
                shear: (2.0 / 3.0 * deviator.norm_squared()).sqrt(),
                volumetric: 1.0 - f.determinant(),
                rotation,
            }
        };
        (0..self.neighbours.len()).map(around).collect()
    }
}

impl Unevenness {
    pub fn of(strains: &[LocalStrain]) -> Self {
        let finite = |of: fn(&LocalStrain) -> f64| -> Vec<f64> {
            strains.iter().map(of).filter(|value| value.is_finite()).collect()
        };
        let (shear, rotation) = (finite(|s| s.shear), finite(|s| s.rotation));
        let (n, sum) = (shear.len() as f64, shear.iter().sum::<f64>());
        let squares: f64 = shear.iter().map(|s| s * s).sum();
        let dead = shear.iter().filter(|s| **s < DEAD * sum / n).count() as f64;
        Unevenness {
            mean_rotation: rotation.iter().sum::<f64>() / rotation.len() as f64,
            localisation: 1.0 - sum * sum / (n * squares),
            dead_fraction: dead / n,
        }
    }
}

/// Radial strain of slices from their cross-sections [m^2] before and now.
pub fn slice_strains(before: &[f64; SLICES], now: &[f64; SLICES]) -> [f64; SLICES] {
    std::array::from_fn(|k| 1.0 - (now[k] / before[k]).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::Rotation;

    fn lattice() -> (Vec<Pose>, Vec<f64>) {
        let mut poses = Vec::new();
        for x in 0..3 {
            for y in 0..3 {
                for z in 0..4 {
                    let at = Vec3::new(f64::from(x), f64::from(y), f64::from(z)) * 0.05;
                    poses.push(Pose::new(at, Rotation::identity()));
                }
            }
        }
        let diameters = vec![0.05; poses.len()];
        (poses, diameters)
    }

    #[test]
    fn affine_motion_is_found_around_every_grain() {
        let (before, diameters) = lattice();
        let neighbourhood = Neighbourhood::new(&before, &diameters);
        // 2 % shorter, 0.5 % wider, then turned as a whole by 0.3 rad.
        let f = Mat3::from_diagonal(&Vec3::new(1.005, 1.005, 0.98));
        let turn = Rotation::from_scaled_axis(Vec3::new(0.2, -0.1, 0.2));
        let after: Vec<Pose> =
            before.iter().map(|p| Pose::new(turn * (f * p.position), turn * p.rotation)).collect();
        let strains = neighbourhood.local_strains(&after, |_| true);
        let e = [0.5 * (1.005f64.powi(2) - 1.0), 0.5 * (0.98f64.powi(2) - 1.0)];
        let shear = 2.0 / 3.0 * (e[0] - e[1]).abs();
        for strain in &strains {
            assert!((strain.shear - shear).abs() < 1e-12, "{strain:?}");
            assert!((strain.volumetric - (1.0 - 1.005 * 1.005 * 0.98)).abs() < 1e-12);
            assert!((strain.rotation - 0.3).abs() < 1e-12);
        }
        let even = Unevenness::of(&strains);
        assert!(even.localisation.abs() < 1e-12 && even.dead_fraction == 0.0);
        assert!((even.mean_rotation - 0.3).abs() < 1e-12);
        // One of which nothing is left stays where it was last seen, and is neither asked nor looked at.
        let mut left = after;
        left[5] = before[5];
        let strains = neighbourhood.local_strains(&left, |i| i != 5);
        let found = Unevenness::of(&strains);
        assert!(strains[5].shear.is_nan() && strains[5].rotation.is_nan());
        assert!(strains.iter().all(|s| s.shear.is_nan() || (s.shear - shear).abs() < 1e-12));
        assert!(found.localisation.abs() < 1e-12 && (found.mean_rotation - 0.3).abs() < 1e-12);
    }

    /// The upper half slides as a block: grains at the cut see the shear, the others none.
    #[test]
    fn sliding_block_localises() {
        let (before, diameters) = lattice();
        let neighbourhood = Neighbourhood::new(&before, &diameters);
        let slide = |p: &Pose| {
            let shift = if p.position.z > 0.075 { 0.004 } else { 0.0 };
            Pose::new(p.position + Vec3::new(shift, 0.0, 0.0), p.rotation)
        };
        let after: Vec<Pose> = before.iter().map(slide).collect();
        let strains = neighbourhood.local_strains(&after, |_| true);
        let mean = |level: i32| {
            let at = |p: &Pose| (p.position.z / 0.05).round() as i32 == level;
            let of: Vec<f64> =
                before.iter().zip(&strains).filter(|(p, _)| at(p)).map(|(_, s)| s.shear).collect();
            of.iter().sum::<f64>() / of.len() as f64
        };
        assert!(mean(0) < 1e-12 && mean(3) < 1e-12 && mean(1) > 0.01 && mean(2) > 0.01);
        let uneven = Unevenness::of(&strains);
        // Half of the grains see nothing; the other half about the same.
        assert!(uneven.localisation > 0.45 && (uneven.dead_fraction - 0.5).abs() < 1e-12, "{uneven:?}");
        assert!(uneven.mean_rotation == 0.0);
    }

    #[test]
    fn slices_that_bulge_have_negative_radial_strain() {
        let before = [1.0; SLICES];
        let now = [1.0, 1.0201, 1.0404, 1.0201, 0.9801];
        let strains = slice_strains(&before, &now);
        for (strain, expected) in strains.iter().zip([0.0, -0.01, -0.02, -0.01, 0.01]) {
            assert!((strain - expected).abs() < 1e-12);
        }
    }
}
