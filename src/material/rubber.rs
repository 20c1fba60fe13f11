//! Rubber sheets: isotropic incompressible hyperelasticity in plane stress, and its relaxation by
//! wrinkles.
//!
//! The energy density W [J/m^3] is a function of two invariants of the in-plane right Cauchy-Green
//! tensor C (2 x 2): `a = tr C` and `d = det C`. Incompressibility gives the thickness stretch,
//! `lambda_3^2 = 1/d`, so that `I1 = a + 1/d` and `I2 = d + a/d`.
//!
//! - neo-Hooke: `W = G/2 (I1 - 3)` (Treloar 1943)
//! - Mooney-Rivlin: `W = G/2 [(1 - s)(I1 - 3) + s (I2 - 3)]` (Mooney 1940, Rivlin 1948)
//! - Gent: `W = -G J/2 ln(1 - (I1 - 3)/J)` (Gent 1996), which locks at `I1 = 3 + J`
//!
//! A thin sheet carries no compression: it wrinkles. Tension-field theory (Reissner 1938) replaces W by the
//! relaxed energy of Pipkin (1986), IMA J. Appl. Math. 36:85, eqs. 3.1-3.4: W where the sheet is taut,
//! the energy of simple tension along the larger stretch where it is narrower than its natural width
//! `lambda_1^(-1/2)`, zero where it is slack. It is continuously differentiable. Tension positive.

use crate::material::MaterialError;

/// The energy law of a sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RubberLaw {
    NeoHookean,
    /// `share` of the small-strain modulus that comes with the second invariant, 0 to 1.
    MooneyRivlin {
        share: f64,
    },
    /// `limit` is the largest `I1 - 3`.
    Gent {
        limit: f64,
    },
}

/// An isotropic incompressible rubber.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rubber {
    shear_modulus: f64,
    law: RubberLaw,
}

/// What a sheet does with compression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wrinkling {
    /// It carries it, as a sheet that something holds flat.
    Held,
    /// It wrinkles: the relaxed energy, plus the share `support` of what a neo-Hookean sheet of the
    /// same modulus gives up by wrinkling, which keeps a slack sheet from having no stiffness at all.
    Free { support: f64 },
}

/// How a piece of sheet is strained.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SheetState {
    /// Tension both ways.
    Taut,
    /// Tension one way, wrinkles along it.
    Wrinkled,
    /// No tension.
    Slack,
}

/// Energy density [J/m^3] with its derivatives by `a = tr C` and `d = det C`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SheetEnergy {
    pub value: f64,
    pub by_a: f64,
    pub by_d: f64,
    pub by_aa: f64,
    pub by_ad: f64,
    pub by_dd: f64,
}

impl SheetEnergy {
    const ZERO: SheetEnergy =
        SheetEnergy { value: 0.0, by_a: 0.0, by_d: 0.0, by_aa: 0.0, by_ad: 0.0, by_dd: 0.0 };

    /// `self + factor (other - third)`, entry by entry.
    fn plus(&self, factor: f64, other: &SheetEnergy, third: &SheetEnergy) -> SheetEnergy {
        let sum = |x: f64, y: f64, z: f64| x + factor * (y - z);
        SheetEnergy {
            value: sum(self.value, other.value, third.value),
            by_a: sum(self.by_a, other.by_a, third.by_a),
            by_d: sum(self.by_d, other.by_d, third.by_d),
            by_aa: sum(self.by_aa, other.by_aa, third.by_aa),
            by_ad: sum(self.by_ad, other.by_ad, third.by_ad),
            by_dd: sum(self.by_dd, other.by_dd, third.by_dd),
        }
    }
}

impl Rubber {
    /// Whether there is a stretch that it cannot go beyond.
    pub fn has_limit(&self) -> bool {
        matches!(self.law, RubberLaw::Gent { .. })
    }

    /// # Errors
    /// [`MaterialError::Parameter`] unless `shear_modulus` [Pa] and a Gent limit are positive and
    /// finite and a Mooney-Rivlin share is within 0 to 1.
    pub fn new(shear_modulus: f64, law: RubberLaw) -> Result<Self, MaterialError> {
        let parameter = |law, name, value| Err(MaterialError::Parameter { law, name, value });
        if !(shear_modulus > 0.0 && shear_modulus.is_finite()) {
            return parameter("rubber", "shear modulus", shear_modulus);
        }
        match law {
            RubberLaw::MooneyRivlin { share } if !(0.0..=1.0).contains(&share) => {
                parameter("Mooney-Rivlin", "share of the second invariant", share)
            }
            RubberLaw::Gent { limit } if !(limit > 0.0 && limit.is_finite()) => {
                parameter("Gent", "limit of I1 - 3", limit)
            }
            RubberLaw::NeoHookean | RubberLaw::MooneyRivlin { .. } | RubberLaw::Gent { .. } => {
                Ok(Rubber { shear_modulus, law })
            }
        }
    }

    /// G [Pa].
    pub const fn shear_modulus(&self) -> f64 {
        self.shear_modulus
    }

    /// The energy of a sheet held flat. Infinite beyond a Gent limit and where `d` is not positive.
    pub fn energy(&self, a: f64, d: f64) -> SheetEnergy {
        let half = 0.5 * self.shear_modulus;
        if !(d > 0.0) {
            return SheetEnergy { value: f64::INFINITY, ..SheetEnergy::ZERO };
        }
        // I1 - 3 and I2 - 3 with their derivatives by a and d; I1 has no mixed one.
        let (first, first_d, first_dd) = (a + 1.0 / d - 3.0, -1.0 / (d * d), 2.0 / (d * d * d));
        match self.law {
            RubberLaw::NeoHookean => SheetEnergy {
                value: half * first,
                by_a: half,
                by_d: half * first_d,
                by_aa: 0.0,
                by_ad: 0.0,
                by_dd: half * first_dd,
            },
            RubberLaw::MooneyRivlin { share } => {
                let rest = 1.0 - share;
                SheetEnergy {
                    value: half * (rest * first + share * (d + a / d - 3.0)),
                    by_a: half * (rest + share / d),
                    by_d: half * (rest * first_d + share * (1.0 - a / (d * d))),
                    by_aa: 0.0,
                    by_ad: -half * share / (d * d),
                    by_dd: half * (rest * first_dd + 2.0 * share * a / (d * d * d)),
                }
            }
            RubberLaw::Gent { limit } => {
                let left = 1.0 - first / limit;
                if left <= 0.0 {
                    return SheetEnergy { value: f64::INFINITY, ..SheetEnergy::ZERO };
                }
                let (slope, bend) = (half / left, half / (limit * left * left));
                SheetEnergy {
                    value: -half * limit * left.ln(),
                    by_a: slope,
                    by_d: slope * first_d,
                    by_aa: bend,
                    by_ad: bend * first_d,
                    by_dd: bend * first_d * first_d + slope * first_dd,
                }
            }
        }
    }

    /// The energy with wrinkles treated as `wrinkling` says, and the state of the sheet.
    pub fn sheet_energy(&self, a: f64, d: f64, wrinkling: Wrinkling) -> (SheetEnergy, SheetState) {
        // Squares of the principal stretches.
        let spread = (a * a - 4.0 * d).max(0.0).sqrt();
        let (larger, smaller) = (0.5 * (a + spread), d / (0.5 * (a + spread)));
        let state = if larger <= 1.0 {
            SheetState::Slack
        } else if smaller * larger.sqrt() > 1.0 {
            SheetState::Taut
        } else {
            SheetState::Wrinkled
        };
        let (Wrinkling::Free { support }, SheetState::Wrinkled | SheetState::Slack) = (wrinkling, state)
        else {
            return (self.energy(a, d), state);
        };
        let tension = |rubber: &Rubber| match state {
            SheetState::Slack => SheetEnergy::ZERO,
            SheetState::Wrinkled | SheetState::Taut => rubber.tension(a, d, larger, spread),
        };
        let plain = Rubber { law: RubberLaw::NeoHookean, ..*self };
        (tension(self).plus(support, &plain.energy(a, d), &tension(&plain)), state)
    }

    /// Energy of simple tension to the squared stretch `larger`, as a function of a and d;
    /// `spread` is the difference of the squared principal stretches.
    fn tension(&self, a: f64, d: f64, larger: f64, spread: f64) -> SheetEnergy {
        // At natural width a = m + m^(-1/2) and d = m^(1/2).
        let root = larger.sqrt();
        let at = self.energy(larger + 1.0 / root, root);
        let (a1, a2) = (1.0 - 0.5 / (larger * root), 0.75 / (larger * larger * root));
        let (d1, d2) = (0.5 / root, -0.25 / (larger * root));
        let slope = at.by_a * a1 + at.by_d * d1;
        let bend =
            at.by_aa * a1 * a1 + 2.0 * at.by_ad * a1 * d1 + at.by_dd * d1 * d1 + at.by_a * a2 + at.by_d * d2;
        // m = (a + r)/2 with r = sqrt(a^2 - 4 d).
        let (m_a, m_d) = (larger / spread, -1.0 / spread);
        let cube = spread * spread * spread;
        SheetEnergy {
            value: at.value,
            by_a: slope * m_a,
            by_d: slope * m_d,
            by_aa: bend * m_a * m_a - slope * 2.0 * d / cube,
            by_ad: bend * m_a * m_d + slope * a / cube,
            by_dd: bend * m_d * m_d - slope * 2.0 / cube,
        }
    }

    /// Largest pressure [Pa] that a spherical balloon of this rubber takes, `radius` and `thickness`
    /// [m] unstrained: for neo-Hooke `1.2395 G t/R` at the stretch `7^(1/6)`; infinite for a law
    /// that stiffens without a limit point. What a flat sheet over a hole of that radius takes is of the
    /// same size.
    pub fn balloon_limit(&self, thickness: f64, radius: f64) -> f64 {
        // p R/t = W'(l)/l^2 with W(l) at a = 2 l^2, d = l^4.
        let pressure = |l: f64| {
            let e = self.energy(2.0 * l * l, l.powi(4));
            (e.by_a * 4.0 * l + e.by_d * 4.0 * l.powi(3)) / (l * l)
        };
        let mut last = 0.0;
        for step in 1..=4000 {
            let l = 1.0 + 1e-3 * f64::from(step);
            let now = pressure(l);
            if !now.is_finite() || !self.energy(2.0 * l * l, l.powi(4)).value.is_finite() {
                return f64::INFINITY;
            }
            if now < last {
                // A second rise, as of Gent rubber near its limit, needs no search: the sheet has
                // jumped by then.
                return last * thickness / radius;
            }
            last = now;
        }
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn laws() -> [Rubber; 4] {
        [
            RubberLaw::NeoHookean,
            RubberLaw::MooneyRivlin { share: 0.3 },
            RubberLaw::Gent { limit: 30.0 },
            RubberLaw::Gent { limit: 2.5 },
        ]
        .map(|law| Rubber::new(0.45e6, law).expect("allowed"))
    }

    const FREE: Wrinkling = Wrinkling::Free { support: 0.0 };

    fn at(rubber: &Rubber, l1: f64, l2: f64, wrinkling: Wrinkling) -> (SheetEnergy, SheetState) {
        rubber.sheet_energy(l1 * l1 + l2 * l2, (l1 * l2).powi(2), wrinkling)
    }

    #[test]
    fn derivatives_are_those_of_the_energy_in_every_state() {
        // One sample in each state, and the unrelaxed energy at the same places.
        for rubber in laws() {
            for (l1, l2) in [(1.2, 1.1), (1.3, 0.95), (1.3, 0.6), (1.05, 0.3), (0.9, 0.8)] {
                for wrinkling in [Wrinkling::Held, FREE, Wrinkling::Free { support: 0.01 }] {
                    let (a, d): (f64, f64) = (l1 * l1 + l2 * l2, f64::powi(l1 * l2, 2));
                    if !rubber.sheet_energy(a, d, wrinkling).0.value.is_finite() {
                        continue; // beyond the limit of the stiffest law
                    }
                    let of = |a: f64, d: f64| rubber.sheet_energy(a, d, wrinkling).0;
                    let h = 1e-6;
                    let (e, g) = (of(a, d), rubber.shear_modulus());
                    let slope = |f: fn(&SheetEnergy) -> f64, (da, dd): (f64, f64)| {
                        (f(&of(a + h * da, d + h * dd)) - f(&of(a - h * da, d - h * dd))) / (2.0 * h)
                    };
                    let (by_a, by_d) = ((1.0, 0.0), (0.0, 1.0));
                    // Central differences: h^2 times third derivatives, which reach 1e4 G where
                    // d is small, and rounding over h.
                    for (difference, exact) in [
                        (slope(|e| e.value, by_a), e.by_a),
                        (slope(|e| e.value, by_d), e.by_d),
                        (slope(|e| e.by_a, by_a), e.by_aa),
                        (slope(|e| e.by_a, by_d), e.by_ad),
                        (slope(|e| e.by_d, by_d), e.by_dd),
                    ] {
                        let scale = g.max(exact.abs());
                        assert!(
                            (difference - exact).abs() < 1e-6 * scale,
                            "{rubber:?} {l1} {l2} {wrinkling:?}: {difference} {exact}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn all_laws_agree_at_small_strain() {
        // Plane stress of an incompressible sheet: W = 2 G (e1^2 + e1 e2 + e2^2) to second order.
        for rubber in laws() {
            for (e1, e2) in [(1e-4, 2e-4), (1e-4, -3e-4)] {
                let (energy, _) = at(&rubber, 1.0 + e1, 1.0 + e2, Wrinkling::Held);
                let small = 2.0 * rubber.shear_modulus() * (e1 * e1 + e1 * e2 + e2 * e2);
                assert!((energy.value - small).abs() < 1e-3 * small, "{} {small}", energy.value);
            }
        }
    }

    #[test]
    fn sheet_wrinkles_below_its_natural_width_and_then_feels_only_the_larger_stretch() {
        for rubber in laws() {
            let l1 = 1.4;
            let natural = 1.0 / f64::sqrt(l1);
            let (tension, _) = at(&rubber, l1, natural, Wrinkling::Held);
            assert_eq!(at(&rubber, l1, 1.001 * natural, FREE).1, SheetState::Taut);
            for narrow in [0.999, 0.7, 0.2] {
                let (energy, state) = at(&rubber, l1, narrow * natural, FREE);
                assert_eq!(state, SheetState::Wrinkled);
                assert!((energy.value - tension.value).abs() < 1e-12 * tension.value);
                // Relaxation only ever lowers the energy.
                assert!(energy.value < at(&rubber, l1, narrow * natural, Wrinkling::Held).0.value);
            }
            for (l1, l2) in [(0.99, 0.5), (1.0, 1.0), (0.7, 0.7)] {
                let (energy, state) = at(&rubber, l1, l2, FREE);
                assert_eq!((energy.value, state), (0.0, SheetState::Slack));
            }
        }
    }

    #[test]
    fn stress_is_continuous_where_the_state_changes() {
        for rubber in laws() {
            let g = rubber.shear_modulus();
            let jump = |l1: f64, l2: f64, towards: (f64, f64)| {
                let h = 1e-7;
                let (before, s) = at(&rubber, l1 - h * towards.0, l2 - h * towards.1, FREE);
                let (after, t) = at(&rubber, l1 + h * towards.0, l2 + h * towards.1, FREE);
                assert_ne!(s, t, "the sample must cross a border");
                // Principal stresses, not W_a and W_d, which are not unique where l1 = l2.
                let stress = |e: &SheetEnergy| 2.0 * l1 * (e.by_a + e.by_d * l2 * l2);
                (stress(&after) - stress(&before)).abs() / g
            };
            // Twice h times a stiffness of a few G.
            assert!(jump(1.4, 1.0 / f64::sqrt(1.4), (0.0, 1.0)) < 1e-5);
            assert!(jump(1.0, 0.5, (1.0, 0.0)) < 1e-5);
        }
    }

    #[test]
    fn balloon_limits() {
        let [neo, mooney, gent, stiff] = laws();
        // 2 (l^-1 - l^-7) at l = 7^(1/6).
        let l = 7f64.powf(1.0 / 6.0);
        let closed = 2.0 * (1.0 / l - l.powi(-7)) * 0.45e6 * 2e-3 / 0.01;
        assert!((neo.balloon_limit(2e-3, 0.01) / closed - 1.0).abs() < 1e-5);
        assert!((closed / (0.45e6 * 2e-3 / 0.01) - 1.2395).abs() < 1e-4);
        // The second invariant carries at large stretch: 30 % of it has no limit point below.
        assert!(mooney.balloon_limit(2e-3, 0.01) > neo.balloon_limit(2e-3, 0.01));
        assert!(gent.balloon_limit(2e-3, 0.01) > neo.balloon_limit(2e-3, 0.01));
        assert!(stiff.balloon_limit(2e-3, 0.01).is_infinite());
    }

    #[test]
    fn impossible_parameters_are_refused() {
        for (g, law) in [
            (0.0, RubberLaw::NeoHookean),
            (f64::NAN, RubberLaw::NeoHookean),
            (1.0, RubberLaw::MooneyRivlin { share: 1.1 }),
            (1.0, RubberLaw::Gent { limit: 0.0 }),
            (1.0, RubberLaw::Gent { limit: f64::NAN }),
        ] {
            assert!(Rubber::new(g, law).is_err());
        }
    }
}
