//! The asperity of a contact of rock: elastic as long as its rock bears the pressure, then crushed to the area that bears the force.
//!
//! A rounded feature (radius R) is pressed into another body by the indentation h [m], the overlap of the two bodies as they were. Below the limit
//! pressure H it is elastic (Hertz 1882), on a patch of radius a:
//!
//! ```text
//! F = 4/3 E* sqrt(R) h^(3/2),    a^2 = R h,    F = pi a^2 H  at  a_y = q R,  q = 3 pi H / (4 E*)
//! ```
//!
//! Beyond, the pressure stays at H (Johnson 1985, *Contact Mechanics*, 6.3) and the patch grows as the rock is crushed by the depth d, the state of the
//! law, over the feature's own section there (Harkness, Zervos et al. 2016 for cones; Ciantia et al. 2015 for the limit):
//!
//! ```text
//! F = H A(d),    A = pi a^2,    h = d + q a,    a^2 = a_y^2 + 2 R d   in the rounding,
//!                                               da/dd = t             behind it
//! ```
//!
//! `t` is the tangent of the half angle of the cone whose sections have the areas of those of the corner: a cone at a tip, two wedges where edges cross. The sides
//! begin where the rounding is as steep as they are, so the area and its slope are continuous.
//!
//! Unloading and reloading up to the depth reached is elastic on the flattened patch (Johnson 1985, 6.4; Thornton & Ning 1998, Powder Technol.
//! 99:154-162): the imprint of radius a^2/(q a) is pressed by h - d,
//!
//! ```text
//! F = H A ((h - d) / (q a))^(3/2),    dF/dh = 2 E* a  where it begins
//! ```
//!
//! so that an untouched feature (d = 0, a = a_y) is Hertz's again: stored energy and force depend continuously on the state as well as on h.
//! Energies over the limit: recovered `2/5 H A q a`, lost the integral of `H A (dd - q/5 da)`.
//!
//! Units: m, N, Pa, J. The indentation and the force are positive in compression. E* and H are those of the two bodies together.

use std::f64::consts::PI;

use crate::tensor::dual::{Dual, Real};
use serde::{Deserialize, Serialize};

/// Limit pressure of an indent over the uniaxial compressive strength, 2.8 for a body that yields at a constant strength however it is
/// confined (Tabor 1951, *The Hardness of Metals*; Johnson 1985, 6.3). Rock gains strength by confinement, and loses by chipping.
pub const LIMIT_OVER_STRENGTH: f64 = 2.8;

/// Steps at most to an indentation that is shared with a compliance.
const MOST_STEPS: usize = 80;

/// What bears the normal force where bodies meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NormalLaw {
    /// A spring of one stiffness, whatever the force.
    Spring,
    /// Asperities that are elastic and crush.
    Asperity,
}

/// What a contact's asperity is made of and how it is shaped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asperity {
    /// E* [Pa]: `1/E* = (1-nu_a^2)/E_a + (1-nu_b^2)/E_b`.
    pub modulus: f64,
    /// H [Pa]; infinite: the rock is never crushed.
    pub limit_pressure: f64,
    /// R [m].
    pub radius: f64,
    /// t: by how much the radius of the section grows per depth behind the rounding.
    pub spread: f64,
}

/// The asperity of a contact in a Newton solve; constant during it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AsperityState {
    pub law: Asperity,
    /// Crushed at the last accepted increment [m].
    pub depth: f64,
    /// Radius of the largest patch until then [m], and at least a trace of the rounding.
    pub grip: f64,
    /// What is left of its force by damage of the rock below, and of nearly flat edges.
    pub share: f64,
}

impl AsperityState {
    /// Radius of the patch that friction holds on to, where it is `patch` now [m]: the largest so far, since one that shrank would give back more than was
    /// put in (Elata & Berryman 1996, Mech. Mater. 24:229-240).
    pub fn grip<T: Real>(&self, patch: T) -> T {
        if patch.value() > self.grip { patch } else { T::constant(self.grip) }
    }

    /// Stiffness over the radius of the patch: `2 E*` [N/m^2].
    pub fn stiffness_of_patch(&self) -> f64 {
        2.0 * self.law.modulus * self.share
    }
}

/// What a contact does at an indentation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Press<T> {
    /// [N]
    pub force: T,
    /// Stored, to be got back where it unloads [J].
    pub energy: T,
    /// Radius of the patch now [m]; `2 E*` times it is the stiffness where it unloads.
    pub patch: T,
}

/// An indentation gone through from one state to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Update {
    /// [N]
    pub force: f64,
    /// dF/dh [N/m].
    pub tangent: f64,
    /// Crushed depth now [m], which is the state.
    pub depth: f64,
    /// Energy stored now [J].
    pub stored: f64,
    /// Work that crushing took on the way [J].
    pub dissipated: f64,
}

impl Asperity {
    /// Of a vertex of rounding `radius` [m] whose cone has the `spread` t.
    pub fn tip(modulus: f64, limit_pressure: f64, radius: f64, spread: f64) -> Self {
        Asperity { modulus, limit_pressure, radius, spread }
    }

    /// Of two edges with these roundings [m] across each other at a right angle, `spreads` being the tangents of their half angles: the gap
    /// `x^2/(2 R_1) + y^2/(2 R_2)` has sections as of the radius `sqrt(R_1 R_2)`, two wedges rhombi of the area `2 t_1 t_2` times the depth squared. At
    /// other angles sections are larger by one over the sine, which is left out.
    pub fn crossed_edges(modulus: f64, limit_pressure: f64, radii: [f64; 2], spreads: [f64; 2]) -> Self {
        let radius = (radii[0] * radii[1]).sqrt();
        let spread = (2.0 * spreads[0] * spreads[1] / PI).sqrt();
        Asperity { modulus, limit_pressure, radius, spread }
    }

    /// q: elastic indentation over the radius of a patch at the limit pressure.
    fn yielding(&self) -> f64 {
        0.75 * PI * self.limit_pressure / self.modulus
    }

    /// 1/t. A cone blunter than q keeps below the limit pressure whatever its load: it counts as q.
    fn steepness(&self) -> f64 {
        self.spread.recip().max(self.yielding())
    }

    /// Radius of the patch at which crushing begins [m].
    fn first_patch(&self) -> f64 {
        self.yielding() * self.radius
    }

    /// Radius of the patch at which the rounding ends [m], and the depth there [m].
    fn rounding_end(&self) -> [f64; 2] {
        let patch = self.radius * self.steepness();
        [patch, self.depth_in_rounding(patch)]
    }

    fn depth_in_rounding<T: Real>(&self, patch: T) -> T {
        if self.radius == 0.0 {
            return T::constant(0.0);
        }
        (patch * patch - T::constant(self.first_patch().powi(2))).scaled(0.5 / self.radius)
    }

    /// Radius of the patch that a crushed depth [m] leaves [m].
    pub fn patch(&self, depth: f64) -> f64 {
        let [end, depth_there] = self.rounding_end();
        if depth <= depth_there {
            (self.first_patch().powi(2) + 2.0 * self.radius * depth).sqrt()
        } else {
            end + (depth - depth_there) / self.steepness()
        }
    }

    /// Crushed depth that a patch of this radius takes [m].
    fn depth<T: Real>(&self, patch: T) -> T {
        let [end, depth_there] = self.rounding_end();
        if patch.value() <= end {
            self.depth_in_rounding(patch)
        } else {
            (patch - T::constant(end)).scaled(self.steepness()) + T::constant(depth_there)
        }
    }

    /// The largest indentation at which it stays elastic, crushed to `depth` [m].
    pub fn elastic_limit(&self, depth: f64) -> f64 {
        if !self.limit_pressure.is_finite() {
            return f64::INFINITY;
        }
        depth + self.yielding() * self.patch(depth)
    }

    /// Radius of the patch where the pressure is at its limit [m]: `depth(a) + q a = h`.
    fn patch_at_limit<T: Real>(&self, indentation: T) -> T {
        let (q, steep) = (self.yielding(), self.steepness());
        let [end, depth_there] = self.rounding_end();
        if indentation.value() <= depth_there + q * end {
            let (r, first) = (self.radius, self.first_patch());
            let square = indentation.scaled(2.0 * r) + T::constant((q * r).powi(2) + first * first);
            square.sqrt() - T::constant(q * r)
        } else {
            (indentation - T::constant(depth_there - end * steep)).scaled(1.0 / (steep + q))
        }
    }

    /// Radius of curvature of the imprint at a crushed depth [m].
    fn imprint(&self, depth: f64) -> f64 {
        if self.limit_pressure.is_finite() { self.patch(depth) / self.yielding() } else { self.radius }
    }

    /// Force, energy and patch at an indentation [m], crushed to `depth` [m] before. What it crushes on the way is in no state yet.
    pub fn press<T: Real>(&self, indentation: T, depth: f64) -> Press<T> {
        let zero = T::constant(0.0);
        let h = indentation.value();
        if h <= depth {
            return Press { force: zero, energy: zero, patch: zero };
        }
        if h <= self.elastic_limit(depth) {
            let imprint = self.imprint(depth);
            let way = indentation - T::constant(depth);
            let patch = way.scaled(imprint).sqrt();
            let force = patch * way.scaled(4.0 / 3.0 * self.modulus);
            return Press { force, energy: force * way.scaled(0.4), patch };
        }
        let patch = self.patch_at_limit(indentation);
        let force = (patch * patch).scaled(PI * self.limit_pressure);
        Press { force, energy: force * patch.scaled(0.4 * self.yielding()), patch }
    }

    /// The indentation `h` [m] of an asperity that shares a `way` [m] with a `compliance` [m/N] behind it: `h + c F(h) = way`. Exact in its derivatives.
    pub fn indentation_behind<T: Real>(&self, way: T, depth: f64, compliance: T) -> T {
        let (total, c) = (way.value(), compliance.value());
        if c == 0.0 || total <= depth {
            return way;
        }
        let pressed = |h: f64| self.press(Dual::<1>::variable(h, 0), depth).force;
        // Where crushing begins the slope falls, so Newton's steps are kept within what is known to hold the root.
        let ([mut low, mut high], mut h) = ([depth, total], total);
        for _ in 0..MOST_STEPS {
            let force = pressed(h);
            let miss = h + c * force.value - total;
            if miss > 0.0 {
                high = h
            } else {
                low = h
            }
            let next = h - miss / (1.0 + c * force.gradient[0]);
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if (next - h).abs() <= 1e-15 * total.abs() {
                break;
            }
            h = next;
        }
        let force = pressed(h);
        let miss = T::constant(h) + compliance.scaled(force.value) - way;
        T::constant(h) - miss.scaled(1.0 / (1.0 + c * force.gradient[0]))
    }

    /// The crushed depth after an indentation [m], crushed to `depth` [m] before.
    pub fn crushed(&self, indentation: f64, depth: f64) -> f64 {
        if indentation <= self.elastic_limit(depth) {
            return depth;
        }
        self.depth(self.patch_at_limit(indentation)).max(depth)
    }

    /// Work that crushing to a depth [m] has taken [J].
    pub fn work_of_crushing(&self, depth: f64) -> f64 {
        if depth <= 0.0 || !self.limit_pressure.is_finite() {
            return 0.0;
        }
        let (q, first, [end, _]) = (self.yielding(), self.first_patch(), self.rounding_end());
        let patch = self.patch(depth);
        let rounded = patch.min(end);
        let cubes = |a: f64, b: f64| (b.powi(3) - a.powi(3)) / 3.0;
        let mut work = -0.2 * q * cubes(first, patch) + self.steepness() * cubes(rounded, patch);
        if self.radius > 0.0 {
            work += (rounded.powi(4) - first.powi(4)) / (4.0 * self.radius);
        }
        PI * self.limit_pressure * work
    }

    /// The indentation at which it exerts this `force` [N], crushed to `depth` [m] before.
    pub fn indentation_for(&self, force: f64, depth: f64) -> f64 {
        if force <= 0.0 {
            return 0.0;
        }
        let patch = (force / (PI * self.limit_pressure)).sqrt();
        if self.limit_pressure.is_finite() && patch > self.patch(depth) {
            return self.depth(patch) + self.yielding() * patch;
        }
        depth + (0.75 * force / (self.modulus * self.imprint(depth).sqrt())).powf(2.0 / 3.0)
    }

    /// The whole step from the state `depth` [m] to an `indentation` [m].
    pub fn update(&self, depth: f64, indentation: f64) -> Update {
        let press = self.press(Dual::<1>::variable(indentation, 0), depth);
        let crushed = self.crushed(indentation, depth);
        Update {
            force: press.force.value,
            tangent: press.force.gradient[0],
            depth: crushed,
            stored: press.energy.value,
            dissipated: self.work_of_crushing(crushed) - self.work_of_crushing(depth),
        }
    }
}

#[cfg(test)]
mod tests;
