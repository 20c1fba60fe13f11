//! The scalar laws of a contact point: normal spring with a quadratic onset, friction coefficient
//! with slip weakening, and the smooth return onto the friction cone.

use crate::tensor::dual::Real;

/// Cores may not come closer than this share of the sum of their rounding radii.
pub const CORE_FLOOR: f64 = 0.2;
/// From this share of the roundings on an overlap of bodies that can break hardens their contact, without limit before cores are at their floor.
pub const HARDENS_FROM: f64 = 0.5;
/// Newton steps to a hardening's overlap at most; from the floor some twenty are enough.
const MOST_STEPS: usize = 60;
/// Where the hardening is cut off, just before the floor.
const HARDEST: f64 = 0.99;

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
    /// The law of specimens and scenes: bodies whose smallest rounding is `rounding` [m], of rock with Poisson's ratio `nu`.
    pub fn of_rock(rounding: f64, nu: f64) -> Self {
        ContactLaw {
            onset: 4e-3 * rounding,
            fade_length: rounding,
            parallel_limit: 4e-3,
            tangential_ratio: 2.0 * (1.0 - nu) / (2.0 - nu),
            friction_blend: 0.05,
        }
    }

    /// The same without an onset: a patch is smooth by itself.
    #[must_use]
    pub fn of_patches(&self) -> Self {
        ContactLaw { onset: 0.0, ..*self }
    }

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

    /// Force per stiffness [m] and energy per stiffness [m^2] that keep apart two cores whose undeformed bodies overlap [m] by more than
    /// [`HARDENS_FROM`] of the roundings: with `x` from 0 there to 1 at the floor and `w` the way between, energy `w^2 x^4 / (1 - x)`.
    /// Twice continuously differentiable.
    ///
    /// A softened contact under a large force would otherwise bring two cores to their floor, where every further step is
    /// refused and no solver finds a way on or back. It is a spring of its own, beside the contact's: whatever bodies bend, or have bent,
    /// it knows where the cores are.
    pub fn hardening<T: Real>(&self, overlap: T, roundings: f64) -> Option<[T; 2]> {
        let way = (1.0 - CORE_FLOOR - HARDENS_FROM) * roundings;
        let from = HARDENS_FROM * roundings;
        if overlap.value() <= from {
            return None;
        }
        let one = T::constant(1.0);
        let x = (overlap - T::constant(from)).scaled(1.0 / way);
        let x = if x.value() < HARDEST { x } else { T::constant(HARDEST) };
        let (left, cube) = (one - x, x * x * x);
        let force = cube * (T::constant(4.0) - x.scaled(3.0)) / (left * left);
        Some([force.scaled(way), (cube * x / left).scaled(way * way)])
    }

    /// Slope of the force of [`ContactLaw::hardening`] by the overlap, over the stiffness.
    pub fn hardening_slope(&self, overlap: f64, roundings: f64) -> f64 {
        let way = (1.0 - CORE_FLOOR - HARDENS_FROM) * roundings;
        let x = ((overlap - HARDENS_FROM * roundings) / way).clamp(0.0, HARDEST);
        let left = 1.0 - x;
        12.0 * x * x / left + 2.0 * x.powi(3) * (4.0 - 3.0 * x) / left.powi(3)
    }

    /// The overlap [m] at which [`ContactLaw::hardening`] has this force per stiffness [m].
    fn hardening_overlap_for(&self, force_per_stiffness: f64, roundings: f64) -> f64 {
        let mut overlap = (HARDENS_FROM + HARDEST * (1.0 - CORE_FLOOR - HARDENS_FROM)) * roundings;
        // From above, where the force is too large: it is convex in the overlap, so Newton's steps come down to the root.
        for _ in 0..MOST_STEPS {
            let Some([force, _]) = self.hardening(overlap, roundings) else { break };
            let step = (force - force_per_stiffness) / self.hardening_slope(overlap, roundings);
            overlap -= step;
            if step.abs() < 1e-12 * roundings {
                break;
            }
        }
        overlap.max(HARDENS_FROM * roundings)
    }

    /// Energy [J] of a hardening of this stiffness [N/m] under this force [N].
    pub fn hardening_energy(&self, [stiffness, force]: [f64; 2], roundings: f64) -> f64 {
        if force <= 0.0 {
            return 0.0;
        }
        let overlap = self.hardening_overlap_for(force / stiffness, roundings);
        stiffness * self.hardening(overlap, roundings).map_or(0.0, |[_, energy]| energy)
    }

    /// Energy [J] that the hardening frees while it gets softer, from one stiffness [N/m] and force [N] to another: work of the trapezoidal rule
    /// less the energy gained.
    pub fn freed_by_hardening(&self, before: [f64; 2], after: [f64; 2], roundings: f64) -> f64 {
        if before[1] <= 0.0 && after[1] <= 0.0 {
            return 0.0;
        }
        let [(x1, e1), (x2, e2)] = [before, after].map(|[stiffness, force]| {
            let x = self.hardening_overlap_for(force / stiffness, roundings);
            (x, stiffness * self.hardening(x, roundings).map_or(0.0, |[_, energy]| energy))
        });
        0.5 * (before[1] + after[1]) * (x2 - x1) - (e2 - e1)
    }

    /// [`ContactLaw::normal`] of a spring that shares `total` [m] with a compliance behind it, `behind` times
    /// its own: the spring takes `x`, and `x + behind N(x) = total`.
    pub fn normal_behind<T: Real>(&self, total: T, behind: T) -> T {
        let (value, onset, one) = (total.value(), self.onset, T::constant(1.0));
        if behind.value() == 0.0 {
            self.normal(total)
        } else if value <= 0.0 {
            T::constant(0.0)
        } else if value < onset * (1.0 + 0.5 * behind.value()) {
            let root = (one + total * behind.scaled(2.0 / onset)).sqrt();
            self.normal(total.scaled(2.0) / (one + root))
        } else {
            (total - T::constant(0.5 * onset)) / (one + behind)
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
    pub fn share_behind<T: Real>(&self, total: T, behind: T) -> T {
        let (value, blend) = (total.value(), self.friction_blend);
        let start = 1.0 - blend;
        let linear = T::constant(1.0) + behind;
        if behind.value() == 0.0 {
            total
        } else if value <= start * linear.value() {
            total / linear
        } else if value >= blend + linear.value() {
            total - behind
        } else {
            let past = total - linear.scaled(start);
            let root = (linear * linear - past * behind.scaled(1.0 / blend)).sqrt();
            past.scaled(2.0) / (linear + root) + T::constant(start)
        }
    }

    /// The integral of [`ContactLaw::friction_share`] from 0 to `x`, up to the end of the bend.
    pub fn friction_energy(&self, x: f64) -> f64 {
        let past = (x - (1.0 - self.friction_blend)).max(0.0);
        0.5 * x * x - past.powi(3) / (12.0 * self.friction_blend)
    }
}

/// Coulomb friction with slip weakening (docs/formulation.md, section 5).
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

    /// What is left of it for a pair that has slipped by `slip` [m].
    pub fn after(&self, slip: f64) -> Weakening {
        let coefficient = self.coefficient(slip);
        Weakening { coefficient, excess: coefficient - self.residual, distance: self.weakening_distance }
    }
}

/// The coefficient of a contact as it slips on within an increment:
/// `mu(s) = mu_0 - excess (1 - exp(-s / D_c))`.
///
/// A contact that weakens faster than its stretch can follow has no equilibrium next to where it was: it drops at
/// a fixed position, and its force would jump with the configuration. So within one increment the coefficient falls by no more than
/// half of what its stretch gives up: `mu >= mu_0 - s / (2 c)`, `c` being the stretch per unit of the coefficient. What is left of
/// the drop follows in the next increments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weakening {
    /// At the start of the increment.
    pub coefficient: f64,
    /// How much of it can still go.
    pub excess: f64,
    /// [m]
    pub distance: f64,
}

/// See [`Weakening`]; 1 is where equilibria cease to be unique.
const FALL: f64 = 0.5;

/// A contact's slip in an increment [m] and its coefficient then, and on average over the slip.
#[derive(Debug, Clone, Copy)]
pub struct Slipped<T> {
    pub slip: T,
    pub coefficient: T,
    pub mean: f64,
}

impl Weakening {
    pub fn constant(coefficient: f64) -> Self {
        Weakening { coefficient, excess: 0.0, distance: 1.0 }
    }

    /// The slip `s` that solves `s + c mu(s) = T` for the trial stretch `T` [m], which is beyond `c mu_0`; `c` is the stretch that
    /// holds per unit of the coefficient [m]. Exact in its derivatives.
    pub fn slipped<T: Real>(&self, stretch: T, per_coefficient: T) -> Slipped<T> {
        let Weakening { coefficient, excess, distance } = *self;
        let (total, c) = (stretch.value(), per_coefficient.value());
        let full = T::constant(coefficient);
        let limited = (stretch - per_coefficient * full).scaled(1.0 / (1.0 - FALL));
        let by_limit = limited.scaled(FALL) / per_coefficient;
        let decay = |slip: f64| (-slip / distance).exp_m1();
        if -excess * decay(limited.value()) >= by_limit.value() {
            let mean = coefficient - 0.5 * by_limit.value();
            return Slipped { slip: limited, coefficient: full - by_limit, mean };
        }
        // Convex and increasing from the root on: Newton's method from above falls onto it.
        let mut slip = (total - c * (coefficient - excess)).max(0.0);
        let mut decayed = decay(slip);
        for _ in 0..60 {
            let gone = -excess * decayed;
            let slope = 1.0 - c * (excess - gone) / distance;
            let step = (slip + c * (coefficient - gone) - total) / slope;
            slip -= step;
            decayed = decay(slip);
            if step.abs() <= 1e-15 * total {
                break;
            }
        }
        let gone = -excess * decayed;
        let fall = (excess - gone) / distance;
        // One step more with derivatives makes the root's exact.
        let at = T::constant(slip);
        let held = T::constant(coefficient - gone);
        let off = (at + per_coefficient * held - stretch).scaled(1.0 / (1.0 - c * fall));
        let ratio = slip / distance;
        let mean = if ratio < 1e-9 { held.value() } else { coefficient - excess * (1.0 + decayed / ratio) };
        Slipped { slip: at - off, coefficient: held + off.scaled(fall), mean }
    }
}

#[cfg(test)]
impl ContactLaw {
    /// For tests, here and elsewhere: grains of some centimetres.
    pub const SAMPLE: ContactLaw = ContactLaw {
        onset: 3e-6,
        fade_length: 5e-4,
        parallel_limit: 4e-3,
        tangential_ratio: 0.9,
        friction_blend: 0.05,
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: ContactLaw = ContactLaw::SAMPLE;

    #[test]
    fn normal_force_is_derivative_of_energy() {
        for overlap in [-1e-6, 1e-6, 2.9e-6, 3.1e-6, 4e-5] {
            let h = 1e-9;
            let slope = (LAW.energy(overlap + h) - LAW.energy(overlap - h)) / (2.0 * h);
            assert!((slope - LAW.normal(overlap)).abs() < 1e-12, "{overlap}");
        }
    }

    #[test]
    fn hardening_is_derivative_of_its_energy_and_begins_smoothly() {
        let roundings = 2e-3;
        let added = |overlap: f64| LAW.hardening(overlap, roundings).unwrap_or([0.0; 2]);
        for share in [0.3, 0.49, 0.51, 0.6, 0.7, 0.76, 0.79] {
            let (overlap, h) = (share * roundings, 1e-9);
            let [force, _] = added(overlap);
            let slope = (added(overlap + h)[1] - added(overlap - h)[1]) / (2.0 * h);
            // Differences of the energy w^2 x^4/(1-x), w = 6e-4 m, err by h^2/6 of its third derivative.
            assert!((slope - force).abs() < 1e-6 * (force + 1e-3 * roundings), "{share}: {slope} {force}");
            let steep = (added(overlap + h)[0] - added(overlap - h)[0]) / (2.0 * h);
            let found = LAW.hardening_slope(overlap, roundings);
            assert!((steep - found).abs() < 1e-5 * (1.0 + steep), "{share}: {found} {steep}");
        }
        // Nothing up to half of the roundings, and more than any other force before the floor.
        assert_eq!(LAW.hardening(0.5 * roundings, roundings), None);
        assert!(added(0.79 * roundings)[0] > 100.0 * roundings);
    }

    #[test]
    fn the_overlap_of_a_hardening_inverts_its_force() {
        let roundings = 2e-3;
        for share in [0.51, 0.6, 0.7, 0.76, 0.79] {
            let overlap = share * roundings;
            let [force, _] = LAW.hardening(overlap, roundings).expect("hardens");
            let found = LAW.hardening_overlap_for(force, roundings);
            assert!((found - overlap).abs() < 1e-10 * roundings, "{share}: {found} {overlap}");
        }
    }

    /// A hardening that goes down to a third of its stiffness in a thousand steps, its overlap given at each: what it frees is the integral of its
    /// energy per stiffness over the stiffness.
    #[test]
    fn softening_frees_the_energy_per_stiffness_of_a_hardening() {
        let (roundings, steps) = (2e-3, 1000);
        for [first, last] in [[0.45, 0.55], [0.55, 0.78]] {
            let state = |k: usize| {
                let t = k as f64 / steps as f64;
                let (overlap, stiffness) = ((first + (last - first) * t) * roundings, 1e8 * (1.0 - t / 1.5));
                let [force, energy] = LAW.hardening(overlap, roundings).unwrap_or([0.0; 2]);
                ([stiffness, stiffness * force], energy)
            };
            let (mut freed, mut expected) = (0.0, 0.0);
            for k in 1..=steps {
                let [(before, e1), (after, e2)] = [state(k - 1), state(k)];
                freed += LAW.freed_by_hardening(before, after, roundings);
                expected += 0.5 * (e1 + e2) * (before[0] - after[0]);
            }
            assert!((freed / expected - 1.0).abs() < 1e-3, "{first}: {freed} {expected}");
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
    fn slip_meets_the_weakening_law() {
        use crate::tensor::dual::Dual;
        for (excess, distance) in [(0.45, 5e-5), (0.45, 1e-4), (0.1, 1e-6), (0.45, 1e-7), (0.45, 1e-12)] {
            let law = Weakening { coefficient: 0.65, excess, distance };
            let c = 8e-6;
            let mut before = law.slipped(c * 0.65, c);
            assert!(before.slip.abs() < 1e-18 && (before.coefficient - 0.65).abs() < 1e-12);
            for k in 1..400 {
                let stretch = c * 0.65 + 1e-7 * k as f64;
                let now = law.slipped(stretch, c);
                // Force and slip agree, the slip follows the stretch without a jump, the coefficient only falls.
                assert!((now.slip + c * now.coefficient - stretch).abs() < 1e-18, "{excess} {distance} {k}");
                let least = 0.65 - excess * (1.0 - (-now.slip / distance).exp());
                let limit = 0.65 - FALL * now.slip / c;
                assert!((now.coefficient - least.max(limit)).abs() < 1e-10, "{excess} {distance} {k}");
                assert!(now.slip > before.slip && now.slip - before.slip < 1e-7 / (1.0 - FALL) * 1.001);
                assert!(now.coefficient <= before.coefficient && now.mean >= now.coefficient);
                assert!(now.mean <= 0.65 + 1e-15);
                let (t, p) = (Dual::<2>::variable(stretch, 0), Dual::<2>::variable(c, 1));
                let exact = law.slipped(t, p);
                assert!((exact.slip.value - now.slip).abs() < 1e-18);
                for (i, h) in [(0, 1e-11), (1, 1e-11)] {
                    let at = |d: f64| {
                        law.slipped(stretch + if i == 0 { d } else { 0.0 }, c + if i == 1 { d } else { 0.0 })
                    };
                    let slope = (at(h).coefficient - at(-h).coefficient) / (2.0 * h);
                    let found = exact.coefficient.gradient[i];
                    // Away from the change of branch, where there are two slopes.
                    let kink = (least - limit).abs() < 1e-4;
                    assert!(kink || (slope - found).abs() < 1e-3 * found.abs() + 1.0, "{slope} {found}");
                }
                before = now;
            }
        }
    }

    #[test]
    fn mean_coefficient_is_the_area_over_the_slip() {
        let law = Weakening { coefficient: 0.65, excess: 0.45, distance: 5e-5 };
        let Slipped { slip, mean, .. } = law.slipped(6e-5, 8e-6);
        let steps = 2000;
        let middle = |k: usize| (k as f64 + 0.5) / steps as f64 * slip;
        let area: f64 = (0..steps).map(|k| 0.2 + 0.45 * (-middle(k) / 5e-5).exp()).sum::<f64>();
        assert!((mean - area / steps as f64).abs() < 1e-7);
    }

    #[test]
    fn friction_weakens_from_peak_to_residual() {
        let law = Friction { peak: 0.65, residual: 0.2, weakening_distance: 5e-5 };
        assert_eq!(law.coefficient(0.0), 0.65);
        assert!((law.coefficient(5e-5) - (0.2 + 0.45 / std::f64::consts::E)).abs() < 1e-15);
        assert!((law.coefficient(1.0) - 0.2).abs() < 1e-12);
    }
}
