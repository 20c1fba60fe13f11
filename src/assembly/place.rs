//! Where contacts lie on bodies that deform or break, and what is known of them there; see [`crate::assembly::elastic`].

use crate::contact::Feature;
use crate::contact::memory::PointMemory;
use crate::grain::{CondensedGrain, Surface, SurfacePoint};
use crate::tensor::{Pose, Rotation, Vec3};

/// Displacement of the nodes of a body in its own frame [m]: those of the surface where it is condensed, all (the
/// surface's first) where it is full; empty for a rigid body.
pub type SurfaceField = Vec<Vec3>;

/// Forces on the surface of a body, in its own frame.
pub type SurfaceLoads = Vec<(SurfacePoint, Vec3)>;

/// A contact's compliance in the solve over the bodies' own flexibilities there. Other contacts of the
/// same grain push as well: with 1 the augmentations swing and end nowhere, with 1.5 to 3 they
/// converge, far above they creep.
pub const OVERESTIMATE: f64 = 2.5;

/// Forces near an asperity's contact displace it by so many times what its own does at most.
const MOST_SHARED: f64 = 10.0;

/// Share of the change before by which a gap or a stretch changes back where the iteration swings.
const SWINGS: f64 = -0.5;
/// A stretch that is off by less than this share of the tolerance says nothing of how it goes on.
const HEEDED: f64 = 1e-2;

/// What one augmentation knows of a contact's place.
#[derive(Debug, Clone)]
pub struct ContactPlace {
    pub feature: Feature,
    pub on_a: Option<SurfacePoint>,
    pub on_b: Option<SurfacePoint>,
    /// Rotations of `a` and `b` when the place was found: displacements turn with these until the next augmentation.
    pub turns: [Rotation; 2],
    /// Elastic displacement of `b`'s surface relative to `a`'s [m], in space.
    pub elastic: Vec3,
    /// The part of it since the last accepted increment [m].
    pub change: Vec3,
    /// Compliance in place of the bodies' flexibility [m/N].
    pub compliance: f64,
    /// What damage of brittle bodies leaves of the contact's spring.
    pub stiffness_left: f64,
    /// What `compliance` gives under the contact's force [m], in space, where that is an unknown
    /// (`assembly::contact_forces`; `elastic` is that of all these forces then), or under that of the last
    /// augmentation, where an asperity has it.
    pub returned: Option<Vec3>,
}

/// Force of the last augmentation.
#[derive(Debug, Clone, Copy)]
pub struct Multiplier {
    pub feature: Feature,
    pub weight: f64,
    /// Normal force of the contact's own spring over the weight [N].
    pub load: f64,
    /// Friction force on `b` over the weight [N], in space.
    pub traction: Vec3,
    /// The contact's compliance over the first guess.
    pub scale: f64,
    /// What the last augmentation left of the gap [m], signed.
    pub left: f64,
    /// What it left of a sticking contact's stretch [m], in space; an accepted increment's memory
    /// has to make up for it, or each would let sticking contacts slip by its tolerance.
    pub slid: Vec3,
}

impl Multiplier {
    pub fn committed(memory: &PointMemory) -> Self {
        let PointMemory { feature, traction, scale, .. } = *memory;
        let weight = if memory.load > 0.0 { memory.pressure / memory.load } else { 0.0 };
        Multiplier { feature, weight, load: memory.sprung(), traction, scale, left: 0.0, slid: Vec3::zeros() }
    }

    /// The scale for the next augmentation, which `left` [m] of the gap now, and `slid` [m] of a sticking contact's stretch: swinging
    /// wants a softer contact, creeping a stiffer one (after Bussetta, Marceau & Ponthot 2012), but never stiffer than
    /// the bodies' own flexibility there allows. Tangentially a slender body can yield far more than at the point (it twists), so
    /// halving has to leave that room: a mode of flexibility L contracts by `1 - L/w`, by `1 - 2 L/w` with half the compliance w.
    pub(super) fn adapted(&self, left: f64, slid: &Vec3, tolerance: f64) -> f64 {
        let undefined = |defined: bool, ratio: f64| if defined { ratio } else { f64::NAN };
        let normal = undefined(self.left != 0.0 && left.abs() >= tolerance, left / self.left);
        let heeded = self.slid != Vec3::zeros() && slid.norm() >= HEEDED * tolerance;
        let tangential = undefined(heeded, slid.dot(&self.slid) / self.slid.norm_squared());
        let worst = normal.min(tangential);
        if worst < SWINGS {
            (1.0 - worst).min(2.0) * self.scale
        } else if normal > 0.5 && normal < 1.1 && (!heeded || 2.0 * tangential - 1.0 > SWINGS) {
            (0.5 * self.scale).max(self.scale.min(1.0 / OVERESTIMATE))
        } else {
            self.scale
        }
    }
}

/// A body at a place in space: its grain (where it is condensed), pose, and surface displacement now and as committed.
#[derive(Clone, Copy)]
pub struct Side<'a> {
    /// Its surface, where it deforms or breaks.
    pub surface: Option<&'a Surface>,
    pub grain: Option<&'a CondensedGrain>,
    pub pose: &'a Pose,
    pub now: &'a [Vec3],
    pub committed: &'a [Vec3],
}

impl Side<'_> {
    /// The surface point below `x` in direction `outward` (both in space).
    pub(super) fn look(&self, x: &Vec3, outward: &Vec3) -> Option<SurfacePoint> {
        let back = self.pose.rotation.inverse();
        Some(self.surface?.locate_along(&(back * (x - self.pose.position)), &(back * outward)))
    }

    /// The flexibility at a place along `outward`, in space, that is not among the unknowns [m/N]; zero where it has none.
    pub(super) fn flexibility(&self, place: &Option<SurfacePoint>, outward: &Vec3) -> f64 {
        let n = self.pose.rotation.inverse() * outward;
        self.grain.zip(place.as_ref()).map_or(0.0, |(grain, place)| grain.flexibility_along(place, &n))
    }
}

pub(super) fn interpolate(place: &SurfacePoint, field: &[Vec3]) -> Vec3 {
    let value = |&(node, weight): &(u32, f64)| field.get(node as usize).map_or(Vec3::zeros(), |u| u * weight);
    place.shares.iter().map(value).sum()
}

impl ContactPlace {
    /// The contact between `a` and `b` at the places `on` their surfaces, with `normal` from `a` to `b`, in space. Where a compliance stands in for
    /// the bodies' flexibility it is `scale` times the first guess.
    pub fn new(
        feature: Feature,
        [a, b]: [Side<'_>; 2],
        [on_a, on_b]: [Option<SurfacePoint>; 2],
        normal: &Vec3,
        scale: Option<f64>,
    ) -> Self {
        let own = || a.flexibility(&on_a, normal) + b.flexibility(&on_b, &-normal);
        let compliance = scale.map_or(0.0, |scale| scale * OVERESTIMATE * own());
        let mut place = ContactPlace {
            feature,
            on_a,
            on_b,
            turns: [a.pose.rotation, b.pose.rotation],
            elastic: Vec3::zeros(),
            change: Vec3::zeros(),
            compliance,
            stiffness_left: 1.0,
            returned: None,
        };
        place.follow([a, b]);
        place
    }

    /// Has an asperity's contact yield in a solve by about what its bodies do under its own force and those
    /// that go with it, `multiplier` being what is known of these: so far as its surfaces have retreated
    /// along the `normal` under them, and at least by its own flexibility.
    pub fn yield_at_once(&mut self, [a, b]: [Side<'_>; 2], normal: &Vec3, multiplier: Option<&Multiplier>) {
        let own = a.flexibility(&self.on_a, normal) + b.flexibility(&self.on_b, &-normal);
        let force = multiplier.map_or(Vec3::zeros(), |multiplier| {
            (normal * multiplier.load + multiplier.traction) * multiplier.weight
        });
        let pressed = force.dot(normal);
        let shared = if pressed > 0.0 { normal.dot(&self.elastic) / pressed } else { 0.0 };
        self.compliance = shared.max(own).min(MOST_SHARED * own);
        self.returned = Some(force * self.compliance);
    }

    /// Takes over the displacements of the two sides.
    pub fn follow(&mut self, sides: [Side<'_>; 2]) {
        (self.elastic, self.change) = (Vec3::zeros(), Vec3::zeros());
        for ((place, side), (turn, sign)) in
            [&self.on_a, &self.on_b].into_iter().zip(&sides).zip(self.turns.iter().zip([-1.0, 1.0]))
        {
            if let Some(place) = place {
                let now = interpolate(place, side.now);
                self.elastic += turn * now * sign;
                self.change += turn * (now - interpolate(place, side.committed)) * sign;
            }
        }
    }
}

/// The largest displacement of a surface [m].
pub fn reach(field: &[Vec3]) -> f64 {
    field.iter().map(|u| u.norm_squared()).fold(0.0, f64::max).sqrt()
}
