//! One body of the scene: a grain, a plate, or a body placed by hand.

use std::sync::Arc;

use crate::contact::law::Friction;
use crate::geometry::Polyhedron;
use crate::grain::{CondensedGrain, DamagedGrain, FullGrain, Surface};
use crate::model::STIFFNESS_RATIO;

/// Index of a body in its model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BodyId(pub usize);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BodyKind {
    Grain,
    Plate,
    /// A body of a scene that never moves; two of these do not touch each other.
    Fixed,
    /// A body of a scene.
    Placed,
    /// What stands for a grain of which nothing is left; it touches nothing and does not move.
    Gone,
}

impl BodyKind {
    /// Whether it bounds a scene or a specimen and goes where it is put: plates and fixed bodies.
    pub fn is_support(self) -> bool {
        matches!(self, BodyKind::Fixed | BodyKind::Plate)
    }
}

#[derive(Debug, Clone)]
pub struct Body {
    pub name: String,
    pub kind: BodyKind,
    /// The shape before its corners are rounded, in body coordinates [m].
    pub nominal: Polyhedron,
    /// Its share of a contact's normal stiffness [N/m], were it rigid; infinite for a rigid plate.
    pub stiffness: f64,
    /// The pressure at which its rock is crushed where it is indented [Pa]; infinite where it never is.
    pub limit_pressure: f64,
    /// Its own flexibility, where it is condensed; then it is in every gap.
    pub grain: Option<Arc<CondensedGrain>>,
    /// Its mesh, where all its nodes move with finite strains; then `grain` eliminates them.
    pub full: Option<Arc<FullGrain>>,
    /// Its damage as of the last accepted increment, where it can break.
    pub damaged: Option<Arc<DamagedGrain>>,
    /// Whether `grain` softens with its damage, which then has to be found together with the forces; such a body is sound while it rests. Else it
    /// is brittle: the forces on it stress it, its contacts soften and cells fail, and what cells are left bend as sound rock, if at all.
    pub yields: bool,
    /// Its own flexibility, where it is rigid for now and may become condensed; then it is in no gap.
    pub resting: Option<Arc<CondensedGrain>>,
    /// Whether it is a grain, or a part of one, all of whose rock has failed and stays as rubble: it has no mesh any more.
    pub is_rubble: bool,
    /// Its own friction, where it has one.
    pub friction: Option<Friction>,
    /// [kg]
    pub mass: f64,
    /// Centre of mass in body coordinates [m].
    pub centre_of_mass: crate::tensor::Vec3,
    /// Where its frame, or that of the grain that it is a part of, lay from the point that it was placed by, in body coordinates [m]: bodies
    /// given far from that point have a frame of their own, since rounding grows with the arm.
    pub offset: crate::tensor::Vec3,
    /// Length that makes rotations commensurate with translations [m]; about the body's radius.
    pub rotation_scale: f64,
}

impl Body {
    /// A rigid body without mass: `stiffness` is its share of a contact's [N/m], `radius` [m] its own, about.
    pub fn rigid(
        name: impl Into<String>,
        kind: BodyKind,
        nominal: Polyhedron,
        stiffness: f64,
        radius: f64,
    ) -> Self {
        Body {
            name: name.into(),
            kind,
            nominal,
            stiffness,
            limit_pressure: f64::INFINITY,
            grain: None,
            full: None,
            damaged: None,
            yields: false,
            resting: None,
            is_rubble: false,
            friction: None,
            mass: 0.0,
            centre_of_mass: crate::tensor::Vec3::zeros(),
            offset: crate::tensor::Vec3::zeros(),
            rotation_scale: radius,
        }
    }

    /// A rigid box for tests, of sides `size` [m] with edges rounded by `rounding` [m].
    #[cfg(test)]
    pub fn block(
        name: &str,
        kind: BodyKind,
        size: [f64; 3],
        rounding: f64,
        radius: f64,
    ) -> (Self, crate::contact::ContactShape) {
        let nominal = Polyhedron::cuboid(size).expect("a box");
        let core = Polyhedron::cuboid(size.map(|s| s - 2.0 * rounding)).expect("a box");
        let shape =
            crate::contact::ContactShape::new(crate::geometry::RoundedBody { core, radius: rounding });
        (Body::rigid(name, kind, nominal, 1e8, radius), shape)
    }

    /// Where its frame lies from the point that it, or the grain that it is a part of, was placed by, in body coordinates [m].
    pub fn frame_offset(&self) -> crate::tensor::Vec3 {
        self.offset + self.damaged.as_ref().map_or_else(crate::tensor::Vec3::zeros, |grain| grain.offset())
    }

    /// The meshed surface, where the body deforms.
    pub fn surface(&self) -> Option<&Surface> {
        self.grain.as_ref().map(|grain| grain.surface())
    }

    /// The meshed surface that forces stress: that of a body that deforms, or that breaks.
    pub fn stressed_surface(&self) -> Option<&Surface> {
        let brittle = self.damaged.as_ref().filter(|_| self.is_brittle());
        brittle.map(|grain| grain.condensed().surface()).or_else(|| self.surface())
    }

    pub fn is_elastic(&self) -> bool {
        self.grain.is_some()
    }

    /// Whether it breaks and does not bend any more for its damage, but where cells are gone.
    pub fn is_brittle(&self) -> bool {
        self.damaged.is_some() && !self.yields
    }

    /// Whether a force on it stresses the facets around its place: it breaks, and its mesh does not spread forces over patches by itself.
    pub fn spreads_forces(&self) -> bool {
        self.is_brittle() && self.damaged.as_ref().is_some_and(|grain| !grain.is_on_patches())
    }

    /// Whether its contacts soften with its rock, and so harden where their overlap comes near the rounding.
    pub fn softens(&self) -> bool {
        self.is_brittle() || self.is_rubble
    }

    /// Its flexibility, whether or not it is in the gaps now.
    pub fn flexibility(&self) -> Option<&Arc<CondensedGrain>> {
        self.grain.as_ref().or(self.resting.as_ref())
    }

    /// Makes a resting body condensed; says whether it was resting.
    pub fn wake(&mut self) -> bool {
        let rested = self.resting.take();
        let woken = rested.is_some();
        self.grain = rested.or(self.grain.take());
        woken
    }

    /// `E / (1 - nu^2)` of its rock [Pa]; infinite where it does not yield.
    pub fn plane_strain_modulus(&self) -> f64 {
        self.stiffness / (2.0 * STIFFNESS_RATIO * self.rotation_scale)
    }

    /// Whether it may be rigid for a while: damage has not changed how it bends.
    pub fn may_rest(&self) -> bool {
        self.is_sound() || self.is_brittle()
    }

    /// Whether it bends now and may be rigid for a while.
    pub fn can_rest(&self) -> bool {
        self.grain.is_some() && self.may_rest()
    }

    /// Makes a condensed body rigid for a while, if it may be; says whether it did.
    pub fn rest(&mut self) -> bool {
        let can = self.can_rest();
        if can {
            self.resting = self.grain.take();
        }
        can
    }

    /// Whether its rock is as generated.
    pub fn is_sound(&self) -> bool {
        self.damaged.as_ref().is_none_or(|grain| grain.is_sound())
    }

    /// How it deforms, as results files number it: 0 rigid, 1 condensed, 2 full.
    pub fn level(&self) -> u8 {
        match (&self.grain, &self.full) {
            (_, Some(_)) => 2,
            (Some(_), None) => 1,
            (None, None) => 0,
        }
    }
}
