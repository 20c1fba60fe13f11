//! Damage softening of rock: isotropic, with separate histories in tension and compression.
//!
//! The energy is `psi = g+ psi+ + g- psi-`, with `psi+` and `psi-` of what opens and what closes cracks ([`crate::material::secant`]); the stress is its
//! derivative by the strain. What is left is `g+ = (1 - (1 - w_t) d_c)(1 - d_t)` and `g- = (1 - d_c)(1 - (1 - w_c) d_t)`. Each of
//! `d_t`, `d_c` is `1 - (e0 / theta)^N` of the largest equivalent strain so far, `theta_t = sqrt(sum <e_i>^2)` and
//! `theta_c = sqrt(sum <-e_i>^2)` of the principal strains; `e0` is the strength over Young's modulus. Damage sets
//! `-psi+ dg+ - psi- dg-` free, never less than nothing.
//!
//! A point has failed, and carries nothing any more, where `d = 1 - psi / (psi+ + psi-)` exceeds the threshold.
//!
//! Source: Ma, Zhou, Chang & Zhou (2011), eqs. 6-10. Continuity at the peak makes `e_p` of eq. 6 zero, hence `sigma = E e (e0 / e)^N`. Eq. 9 pairs
//! `w_c` with the compression damage, while the recovery that its text describes (cracks close: `w_c = 1` restores the stiffness lost in
//! tension) needs the crosswise pairing above, that of Lee & Fenves (1998). There the stress is `(1 - d) C e`, d by the tensile share of
//! its principal values, which has no potential: closing cracks give back what nobody put in. In pure tension and compression
//! `1 - d` is `g+` and `g-`, as here.
//!
//! With `w_c = 1` tension damage does not weaken uniaxial compression. With less it does, and not only after tension: the
//! lateral strains `nu e` damage in tension from `nu sqrt 2 e = f_t / E` on, well before the peak where `f_c / f_t > 1 / (nu sqrt 2)`.
//! In uniaxial tension the sides of a cracked point stop contracting, since they are closed: it then carries up to
//! `(1 - nu) / (1 + nu) / (1 - 2 nu)` of `g+ E e`.
//!
//! Stress [Pa] and strain tension positive; the histories and strengths are positive in both.
//!
//! **Kinks.** The stress is continuous except where a point fails. Its derivative jumps where a history starts or stops
//! growing and where a direction opens or closes. Equal principal values are no kink.

use nalgebra::Vector6;

use crate::material::secant::{Secant, closed_energy};
use crate::material::softening::{Branch, Softening};
use crate::material::{Elastic, MaterialError};
use crate::tensor::Vec3;

/// Damage parameters that all cells share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DamageParameters {
    pub tension: Softening,
    pub compression: Softening,
    /// Damage above which a point fails, above 0 and at most 1.
    pub threshold: f64,
    /// w_c: share of the stiffness lost in tension that returns in compression, 0 to 1.
    pub recovery_in_compression: f64,
    /// w_t: share of the stiffness lost in compression that returns in tension, 0 to 1.
    pub recovery_in_tension: f64,
}

impl Default for DamageParameters {
    fn default() -> Self {
        DamageParameters {
            tension: Softening::Exponent(3.0),
            compression: Softening::Exponent(3.0),
            threshold: 0.99,
            recovery_in_compression: 1.0,
            recovery_in_tension: 0.0,
        }
    }
}

/// The law of one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DamageLaw {
    elastic: Elastic,
    tension: Branch,
    compression: Branch,
    threshold: f64,
    /// w_c and w_t.
    recovery: [f64; 2],
}

/// What an integration point remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DamageState {
    /// Strain at which this state was reached (Voigt, engineering shear).
    pub strain: Vector6<f64>,
    /// Largest theta_t so far.
    pub tension: f64,
    /// Largest theta_c so far.
    pub compression: f64,
    /// Failed points carry nothing and stay so.
    pub failed: bool,
}

impl Default for DamageState {
    fn default() -> Self {
        DamageState { strain: Vector6::zeros(), tension: 0.0, compression: 0.0, failed: false }
    }
}

/// Everything about one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// [Pa]
    pub stress: Vector6<f64>,
    /// Part of the energy of sound rock at this strain that damage has taken, 1 where failed.
    pub damage: f64,
    pub state: DamageState,
    /// Energy per volume set free on a straight strain path from the old state [J/m^3]; see [`DamageLaw::dissipation`].
    pub dissipated: f64,
}

/// Of the strain tensor of a Voigt strain.
fn norm_squared(e: &Vector6<f64>) -> f64 {
    e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + 0.5 * (e[3] * e[3] + e[4] * e[4] + e[5] * e[5])
}

/// Principal values of a strain, the largest first, in closed form (Smith 1961, "Eigenvalues of a symmetric 3 x 3 matrix", Comm. ACM 4:168). Two that are equal come
/// apart by 1e-8 of the largest at most; sums over them are exact to rounding, since their mean is.
fn principal_values(e: &Vector6<f64>) -> Vec3 {
    let (xy, yz, zx) = (0.5 * e[3], 0.5 * e[4], 0.5 * e[5]);
    let mean = (e[0] + e[1] + e[2]) / 3.0;
    let (x, y, z) = (e[0] - mean, e[1] - mean, e[2] - mean);
    let size = ((x * x + y * y + z * z + 2.0 * (xy * xy + yz * yz + zx * zx)) / 6.0).sqrt();
    if size == 0.0 {
        return Vec3::repeat(mean);
    }
    let (x, y, z, xy, yz, zx) = (x / size, y / size, z / size, xy / size, yz / size, zx / size);
    let half_determinant = 0.5 * (x * (y * z - yz * yz) - xy * (xy * z - yz * zx) + zx * (xy * yz - y * zx));
    let angle = half_determinant.clamp(-1.0, 1.0).acos() / 3.0;
    let first = mean + 2.0 * size * angle.cos();
    let last = mean + 2.0 * size * (angle + 2.0 * std::f64::consts::FRAC_PI_3).cos();
    Vec3::new(first, 3.0 * mean - first - last, last)
}

/// `theta_t` and `theta_c` of principal strains.
fn thetas(values: &Vec3) -> [f64; 2] {
    [1.0, -1.0].map(|sign| values.iter().map(|v| (sign * v).max(0.0).powi(2)).sum::<f64>().sqrt())
}

/// Share of a path that a step of [`DamageLaw::dissipation`] takes, at most and at least, and what it may change `g+` and `g-` by.
const STEP: [f64; 2] = [0.125, 1e-9];
const CHANGE: f64 = 1.0 / 64.0;

impl DamageLaw {
    /// The law of a cell of `cell_size` [m] (used by [`Softening::FractureEnergy`] only) with strengths [Pa],
    /// both positive.
    ///
    /// Errors where a parameter is impossible, or the cell is too large for its fracture energy: its stored energy at the
    /// peak would exceed what its crack can take (or too small: softening would be slower than N = 1).
    pub fn new(
        elastic: Elastic,
        tensile_strength: f64,
        compressive_strength: f64,
        parameters: &DamageParameters,
        cell_size: f64,
    ) -> Result<Self, MaterialError> {
        let threshold = parameters.threshold;
        if !(threshold > 0.0 && threshold <= 1.0) {
            return Err(MaterialError::Threshold(threshold));
        }
        let recovery = [parameters.recovery_in_compression, parameters.recovery_in_tension];
        if let Some(bad) = recovery.into_iter().find(|w| !(0.0..=1.0).contains(w)) {
            return Err(MaterialError::Recovery(bad));
        }
        // A threshold of 1 is never exceeded; the tail's energy is then counted to 1 - 1e-12.
        let counted = threshold.min(1.0 - 1e-12);
        Ok(DamageLaw {
            tension: parameters.tension.branch("tensile", tensile_strength, &elastic, cell_size, counted)?,
            compression: parameters.compression.branch(
                "compressive",
                compressive_strength,
                &elastic,
                cell_size,
                counted,
            )?,
            elastic,
            threshold,
            recovery,
        })
    }

    /// The sound rock.
    pub const fn elastic(&self) -> &Elastic {
        &self.elastic
    }

    /// Damage above which a point fails.
    pub const fn threshold(&self) -> f64 {
        self.threshold
    }

    /// Peak strains in tension and compression, both positive.
    pub const fn onsets(&self) -> [f64; 2] {
        [self.tension.onset, self.compression.onset]
    }

    /// N in tension and compression.
    pub const fn exponents(&self) -> [f64; 2] {
        [self.tension.exponent, self.compression.exponent]
    }

    /// `d_t` and `d_c` of a state, without recovery.
    pub fn parts(&self, state: &DamageState) -> [f64; 2] {
        [self.tension.damage(state.tension), self.compression.damage(state.compression)]
    }

    /// Whether a sound point certainly stays sound: theta_t and theta_c are at most the norm of the strain tensor.
    fn cannot_damage(&self, strain: &Vector6<f64>, old: &DamageState) -> bool {
        let least = self.tension.onset.min(self.compression.onset);
        self.is_sound(old) && norm_squared(strain) < least * least
    }

    /// `g+` and `g-` of histories.
    fn left(&self, [theta_t, theta_c]: [f64; 2]) -> [f64; 2] {
        let ([w_c, w_t], d_t, d_c) =
            (self.recovery, self.tension.damage(theta_t), self.compression.damage(theta_c));
        [(1.0 - (1.0 - w_t) * d_c) * (1.0 - d_t), (1.0 - d_c) * (1.0 - (1.0 - w_c) * d_t)]
    }

    fn is_sound(&self, state: &DamageState) -> bool {
        state.tension <= self.tension.onset && state.compression <= self.compression.onset
    }

    /// The secant stiffness of a state at its own strain.
    pub fn secant(&self, state: &DamageState) -> Secant {
        if state.failed {
            Secant::of_share(0.0)
        } else if self.is_sound(state) {
            Secant::SOUND
        } else {
            Secant::of_split(&self.elastic, &state.strain, self.left([state.tension, state.compression]))
        }
    }

    /// `psi+` and `psi-` [J/m^3] at a strain with these principal values.
    fn energies(&self, strain: &Vector6<f64>, values: &Vec3) -> [f64; 2] {
        let closed = closed_energy(&self.elastic, values);
        [self.elastic.energy_density(strain) - closed, closed]
    }

    /// Stored energy per volume of a state at its own strain [J/m^3].
    pub fn stored_energy(&self, state: &DamageState) -> f64 {
        if state.failed {
            return 0.0;
        }
        let energies = self.energies(&state.strain, &principal_values(&state.strain));
        let left = self.left([state.tension, state.compression]);
        left[0] * energies[0] + left[1] * energies[1]
    }

    /// The state at a new strain. Not a number where the strain is not.
    pub fn advance(&self, strain: &Vector6<f64>, old: &DamageState) -> DamageState {
        if old.failed || self.cannot_damage(strain, old) {
            return DamageState { strain: *strain, ..*old };
        }
        let values = principal_values(strain);
        let [theta_t, theta_c] = thetas(&values);
        let new = DamageState {
            strain: *strain,
            tension: old.tension.max(theta_t),
            compression: old.compression.max(theta_c),
            failed: false,
        };
        let energies = self.energies(strain, &values);
        let is_gone = |left| self.is_gone(energies, left);
        DamageState {
            failed: !self.is_sound(&new) && is_gone(self.left([new.tension, new.compression])),
            ..new
        }
    }

    /// Whether so little is left of `psi+` and `psi-` that a point fails; of a point without strain, of its stiffness in compression.
    fn is_gone(&self, energies: [f64; 2], left: [f64; 2]) -> bool {
        let sound = energies[0] + energies[1];
        let share =
            if sound > 0.0 { (left[0] * energies[0] + left[1] * energies[1]) / sound } else { left[1] };
        1.0 - share > self.threshold
    }

    /// How near a strain brings sound rock to its first damage: the larger of the effective strains over their peak strains, or
    /// `enough` where it is certainly below that.
    pub fn utilisation(&self, strain: &Vector6<f64>, enough: f64) -> f64 {
        let bound = norm_squared(strain).sqrt() / self.tension.onset.min(self.compression.onset);
        if bound <= enough {
            return enough;
        }
        let [theta_t, theta_c] = thetas(&principal_values(strain));
        (theta_t / self.tension.onset).max(theta_c / self.compression.onset)
    }

    /// Growth of `d_t` or `d_c`, the larger, that a strain asks for.
    pub fn growth(&self, strain: &Vector6<f64>, old: &DamageState) -> f64 {
        if old.failed || self.cannot_damage(strain, old) {
            return 0.0;
        }
        let [theta_t, theta_c] = thetas(&principal_values(strain));
        let grown = |branch: &Branch, before: f64, theta: f64| branch.damage(theta) - branch.damage(before);
        grown(&self.tension, old.tension, theta_t)
            .max(grown(&self.compression, old.compression, theta_c))
            .max(0.0)
    }

    /// The state on the straight way from the old strain to a new one where the larger of `d_t` and `d_c` has grown by `share` (0 to 1) of what the new
    /// strain asks for. What leads weakens the point first: rock that is torn is not crushed by how far its parts then fly.
    pub fn advance_partly(&self, strain: &Vector6<f64>, old: &DamageState, share: f64) -> DamageState {
        let asked = self.growth(strain, old);
        if share >= 1.0 || asked == 0.0 {
            return self.advance(strain, old);
        }
        let at = |s: f64| old.strain + (strain - old.strain) * s;
        let mut bounds = [0.0, 1.0];
        while bounds[1] - bounds[0] > f64::EPSILON * bounds[1] {
            let middle = 0.5 * (bounds[0] + bounds[1]);
            bounds[usize::from(self.growth(&at(middle), old) >= share * asked)] = middle;
        }
        self.advance(&at(bounds[1]), old)
    }

    /// Energy per volume [J/m^3] that damage sets free between two states of a point, `-integral of psi+ dg+ + psi- dg-`, the strain going straight
    /// from one to the other and the histories growing with it from those of the one to those of the other; with what a failing point still stores.
    ///
    /// By trapezoids over steps that change `g+` and `g-` by 1/64 at most, exact at a strain that stays; never negative.
    pub fn dissipation(&self, from: &DamageState, to: &DamageState) -> f64 {
        if from.failed || (!to.failed && (self.is_sound(to) || self.parts(from) == self.parts(to))) {
            return 0.0;
        }
        let at = |s: f64| {
            let strain = from.strain + (to.strain - from.strain) * s;
            let values = principal_values(&strain);
            let history = |now: f64, from: f64, to: f64| match s {
                0.0 => from,
                1.0 => to,
                _ => now.min(to).max(from),
            };
            let [theta_t, theta_c] = thetas(&values);
            let left = self.left([
                history(theta_t, from.tension, to.tension),
                history(theta_c, from.compression, to.compression),
            ]);
            let energies = self.energies(&strain, &values);
            (energies, left, to.failed && (s == 1.0 || self.is_gone(energies, left)))
        };
        let (mut energies, mut left, _) = at(0.0);
        let (mut s, mut step, mut freed) = (0.0, STEP[0], 0.0);
        if from.strain == to.strain {
            step = 1.0;
        }
        while s < 1.0 {
            let next = f64::min(s + step, 1.0);
            let (new_energies, new_left, failed) = at(next);
            let change = (0..2).map(|part| (left[part] - new_left[part]).abs()).fold(0.0, f64::max);
            if change > CHANGE && step < 1.0 && step > STEP[1] {
                step *= 0.5;
                continue;
            }
            for part in 0..2 {
                freed += 0.5 * (energies[part] + new_energies[part]) * (left[part] - new_left[part]);
            }
            if failed {
                return freed + new_left[0] * new_energies[0] + new_left[1] * new_energies[1];
            }
            (energies, left, s, step) = (new_energies, new_left, next, f64::min(2.0 * step, STEP[0]));
        }
        freed
    }

    /// Stress, new state and dissipation at a new strain.
    pub fn respond(&self, strain: &Vector6<f64>, old: &DamageState) -> Response {
        let state = self.advance(strain, old);
        let (secant, dissipated) = (self.secant(&state), self.dissipation(old, &state));
        Response {
            stress: secant.stress(&self.elastic, strain),
            damage: 1.0 - secant.share(),
            state,
            dissipated,
        }
    }
}

#[cfg(test)]
mod tests;
