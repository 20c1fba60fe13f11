//! The scalar laws of a contact point: normal spring with a quadratic onset, friction coefficient
//! with slip weakening, and the smooth return onto the friction cone.

use crate::tensor::dual::Real;

/// Settings that all contacts of a model share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactLaw {
    /// Overlap over which the normal force sets in quadratically [m].
    pub onset: f64,
    /// Distance along an edge from its end over which its contacts fade in [m].
    pub fade_length: f64,
    /// Edges whose squared sine of the angle between them is below this fade out.
    pub parallel_limit: f64,
    /// Tangential over normal stiffness; 2(1-nu)/(2-nu) for elastic bodies (Mindlin 1949).
    pub tangential_ratio: f64,
    /// Half width of the smooth transition from stick to slip, as a share of the bound mu p.
    pub friction_blend: f64,
}

impl ContactLaw {
    /// Normal force per stiffness, `p / k` [m], at an overlap [m]: quadratic below the onset,
    /// then linear.
    pub fn normal<T: Real>(&self, overlap: T) -> T {
        let value = overlap.value();
        if value <= 0.0 {
            T::constant(0.0)
        } else if value < self.onset {
            (overlap * overlap).scaled(0.5 / self.onset)
        } else {
            overlap - T::constant(0.5 * self.onset)
        }
    }

    /// [`ContactLaw::normal`] of a spring that shares `total` [m] with a compliance behind it, `behind` times
    /// its own: the spring takes `x`, and `x + behind N(x) = total`.
    pub fn normal_behind<T: Real>(&self, total: T, behind: f64) -> T {
        let (value, onset) = (total.value(), self.onset);
        if behind == 0.0 {
            self.normal(total)
        } else if value <= 0.0 {
            T::constant(0.0)
        } else if value < onset * (1.0 + 0.5 * behind) {
            let root = (T::constant(1.0) + total.scaled(2.0 * behind / onset)).sqrt();
            self.normal(total.scaled(2.0) / (T::constant(1.0) + root))
        } else {
            (total - T::constant(0.5 * onset)).scaled(1.0 / (1.0 + behind))
        }
    }

    /// Energy per stiffness [m^2]: the integral of [`ContactLaw::normal`].
    pub fn energy<T: Real>(&self, overlap: T) -> T {
        let (value, onset) = (overlap.value(), self.onset);
        if value <= 0.0 {
            T::constant(0.0)
        } else if value < onset {
            (overlap * overlap * overlap).scaled(1.0 / (6.0 * onset))
        } else {
            (overlap * overlap - overlap.scaled(onset)).scaled(0.5) + T::constant(onset * onset / 6.0)
        }
    }

    /// Energy per stiffness [m^2] where [`ContactLaw::normal`] gives `force_per_stiffness` [m].
    pub fn energy_at<T: Real>(&self, force_per_stiffness: T) -> T {
        let value = force_per_stiffness.value();
        if value <= 0.0 {
            T::constant(0.0)
        } else if value < 0.5 * self.onset {
            let overlap = force_per_stiffness.scaled(2.0 * self.onset).sqrt();
            (overlap * overlap * overlap).scaled(1.0 / (6.0 * self.onset))
        } else {
            (force_per_stiffness * force_per_stiffness).scaled(0.5)
                + T::constant(self.onset * self.onset / 24.0)
        }
    }

    /// The overlap [m] at which [`ContactLaw::normal`] gives `force_per_stiffness` [m].
    pub fn overlap_for(&self, force_per_stiffness: f64) -> f64 {
        if force_per_stiffness <= 0.0 {
            0.0
        } else if force_per_stiffness < 0.5 * self.onset {
            (2.0 * self.onset * force_per_stiffness).sqrt()
        } else {
            force_per_stiffness + 0.5 * self.onset
        }
    }

    /// `S(x)`: the tangential force over the bound `mu p`, where `x` is the trial force over the
    /// same bound. The identity when sticking, 1 when sliding, quadratic in between.
    pub fn friction_share<T: Real>(&self, x: T) -> T {
        let (value, blend) = (x.value(), self.friction_blend);
        if value <= 1.0 - blend {
            x
        } else if value >= 1.0 + blend {
            T::constant(1.0)
        } else {
            let past = x - T::constant(1.0 - blend);
            x - (past * past).scaled(0.25 / blend)
        }
    }

    /// The trial force of a contact's own spring over the bound, where a compliance `behind` times the
    /// spring's own takes its part of the stretch: `x + behind S(x) = total`.
    pub fn share_behind<T: Real>(&self, total: T, behind: f64) -> T {
        let (value, blend) = (total.value(), self.friction_blend);
        let start = 1.0 - blend;
        if behind == 0.0 {
            total
        } else if value <= start * (1.0 + behind) {
            total.scaled(1.0 / (1.0 + behind))
        } else if value >= 1.0 + blend + behind {
            total - T::constant(behind)
        } else {
            let past = total - T::constant(start * (1.0 + behind));
            let linear = 1.0 + behind;
            let root = (T::constant(linear * linear) - past.scaled(behind / blend)).sqrt();
            past.scaled(2.0) / (T::constant(linear) + root) + T::constant(start)
        }
    }

    /// The integral of [`ContactLaw::friction_share`] from 0 to `x`, up to the end of the bend.
    pub fn friction_energy(&self, x: f64) -> f64 {
        let past = (x - (1.0 - self.friction_blend)).max(0.0);
        0.5 * x * x - past.powi(3) / (12.0 * self.friction_blend)
    }
}

/// Coulomb friction with slip weakening (FORMULATION section 3).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friction {
    pub peak: f64,
    pub residual: f64,
    /// Slip over which the coefficient drops by 1/e of its excess [m].
    pub weakening_distance: f64,
}

impl Friction {
    pub fn constant(coefficient: f64) -> Self {
        Friction { peak: coefficient, residual: coefficient, weakening_distance: 1.0 }
    }

    /// `mu(s) = mu_r + (mu_p - mu_r) exp(-s / D_c)` for the slip `s` [m].
    pub fn coefficient(&self, slip: f64) -> f64 {
        self.residual + (self.peak - self.residual) * (-slip / self.weakening_distance).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: ContactLaw = ContactLaw {
        onset: 3e-6,
        fade_length: 5e-4,
        parallel_limit: 4e-3,
        tangential_ratio: 0.9,
        friction_blend: 0.05,
    };

    #[test]
    fn normal_force_is_derivative_of_energy() {
        for overlap in [-1e-6, 1e-6, 2.9e-6, 3.1e-6, 4e-5] {
            let h = 1e-9;
            let slope = (LAW.energy(overlap + h) - LAW.energy(overlap - h)) / (2.0 * h);
            assert!((slope - LAW.normal(overlap)).abs() < 1e-12, "{overlap}");
        }
    }

    #[test]
    fn energy_by_force_is_energy_by_overlap() {
        for overlap in [-1e-6, 0.0, 1e-7, 2e-6, 2.99e-6, 3.01e-6, 5e-5] {
            let by_force = LAW.energy_at(LAW.normal(overlap));
            assert!((by_force - LAW.energy(overlap)).abs() < 1e-15 * LAW.onset);
        }
    }

    #[test]
    fn overlap_for_inverts_normal() {
        for overlap in [1e-7, 2e-6, 3e-6, 5e-5] {
            assert!((LAW.overlap_for(LAW.normal(overlap)) - overlap).abs() < 1e-15);
        }
    }

    #[test]
    fn springs_behind_a_compliance_share_the_way() {
        for behind in [0.0, 0.3, 4.0, 60.0] {
            for overlap in [1e-7, 2e-6, 2.99e-6, 3.01e-6, 5e-5] {
                let expected = LAW.normal(overlap);
                let found = LAW.normal_behind(overlap + behind * expected, behind);
                assert!((found / expected - 1.0).abs() < 1e-9, "{behind} {overlap}: {found} {expected}");
            }
            for x in [0.3, 0.94, 0.96, 1.0, 1.049, 1.051, 3.0] {
                let found = LAW.share_behind(x + behind * LAW.friction_share(x), behind);
                assert!((found - x).abs() < 1e-12 * (1.0 + behind), "{behind} {x}: {found}");
            }
        }
    }

    #[test]
    fn friction_share_is_smooth_and_bounded() {
        let h = 1e-7;
        for x in [0.5, 0.95, 1.0, 1.05, 1.5] {
            let left = (LAW.friction_share(x) - LAW.friction_share(x - h)) / h;
            let right = (LAW.friction_share(x + h) - LAW.friction_share(x)) / h;
            assert!((left - right).abs() < 1e-5, "kink at {x}");
            assert!(LAW.friction_share(x) <= 1.0);
        }
    }

    #[test]
    fn friction_share_is_derivative_of_its_energy() {
        for x in [0.3, 0.94, 0.97, 1.02, 1.049] {
            let h = 1e-6;
            let slope = (LAW.friction_energy(x + h) - LAW.friction_energy(x - h)) / (2.0 * h);
            assert!((slope - LAW.friction_share(x)).abs() < 1e-8, "{x}");
        }
    }

    #[test]
    fn friction_weakens_from_peak_to_residual() {
        let law = Friction { peak: 0.65, residual: 0.2, weakening_distance: 5e-5 };
        assert_eq!(law.coefficient(0.0), 0.65);
        assert!((law.coefficient(5e-5) - (0.2 + 0.45 / std::f64::consts::E)).abs() < 1e-15);
        assert!((law.coefficient(1.0) - 0.2).abs() < 1e-12);
    }
}
