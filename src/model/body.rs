//! One body of the scene: a grain, a plate, or a body placed by hand.

use std::sync::Arc;

use crate::contact::law::Friction;
use crate::error::Result;
use crate::geometry::Polyhedron;
use crate::grain::{CondensedGrain, DamagedGrain, FullGrain, Surface};
use crate::tensor::{Pose, Vec3, Vector6};

/// A body's share of a contact's stiffness ([`Body::stiffness`]) over `E / (1 - nu^2)` times its size, the diameter of the ball of its volume.
pub const STIFFNESS_RATIO: f64 = 0.1;

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

    /// Of a part that came off such a body: nothing holds it any more.
    #[must_use]
    pub fn of_part(self) -> Self {
        match self {
            BodyKind::Fixed => BodyKind::Placed,
            BodyKind::Grain | BodyKind::Plate | BodyKind::Placed | BodyKind::Gone => self,
        }
    }
}

/// How a body deforms.
#[derive(Debug, Clone, Default)]
pub enum Deformation {
    /// Not at all.
    #[default]
    Rigid,
    /// Not for now: it may get back this flexibility, which is in no gap.
    Resting(Flexibility),
    /// By its own flexibility, which is in every gap.
    Bending(Flexibility),
}

/// What a body bends by.
#[derive(Debug, Clone)]
pub enum Flexibility {
    /// The flexibility between the nodes of its surface.
    Condensed(Arc<CondensedGrain>),
    /// The motion of all nodes of its mesh, with finite strains.
    Full(Arc<FullGrain>),
}

/// How a body breaks. Its damage is that of the last accepted increment.
#[derive(Debug, Clone, Default)]
pub enum Breakage {
    #[default]
    Never,
    /// The forces on it stress it, its contacts soften and cells fail; what cells are left bend as sound rock, if at all.
    Brittle(Arc<DamagedGrain>),
    /// Its flexibility goes with its damage, which has to be found together with the forces; it is sound while it rests.
    Softening(Arc<DamagedGrain>),
    /// All the rock of this grain, or of this part of one, has failed and stays as rubble: it has no mesh any more.
    Rubble,
}

impl Flexibility {
    /// Between the nodes of its surface.
    pub fn grain(&self) -> &Arc<CondensedGrain> {
        match self {
            Flexibility::Condensed(grain) => grain,
            Flexibility::Full(full) => full.condensed(),
        }
    }

    /// Its mesh, where all nodes of it move.
    pub fn full(&self) -> Option<&Arc<FullGrain>> {
        match self {
            Flexibility::Condensed(_) => None,
            Flexibility::Full(full) => Some(full),
        }
    }

    /// The same cells with the trial damage of `grain`, as of its last refresh.
    #[must_use]
    pub fn damaged(&self, grain: &DamagedGrain) -> Self {
        match self {
            Flexibility::Condensed(_) => Flexibility::Condensed(grain.condensed().clone()),
            Flexibility::Full(full) => Flexibility::Full(Arc::new(full.damaged(grain))),
        }
    }

    /// The same kind, of a part with this flexibility.
    fn of_part(&self, part: Arc<CondensedGrain>) -> Result<Self> {
        Ok(match self {
            Flexibility::Condensed(_) => Flexibility::Condensed(part),
            Flexibility::Full(full) => Flexibility::Full(Arc::new(full.alike(part)?)),
        })
    }
}

impl Deformation {
    /// By the flexibility between the nodes of its surface.
    pub fn condensed(grain: Arc<CondensedGrain>) -> Self {
        Deformation::Bending(Flexibility::Condensed(grain))
    }

    /// By the motion of all nodes of its mesh.
    pub fn full(grain: Arc<FullGrain>) -> Self {
        Deformation::Bending(Flexibility::Full(grain))
    }

    /// Not for now; once woken by the flexibility between the nodes of its surface.
    pub fn resting(grain: Arc<CondensedGrain>) -> Self {
        Deformation::Resting(Flexibility::Condensed(grain))
    }

    /// The flexibility by which a body deforms now.
    pub fn bending(&self) -> Option<&Flexibility> {
        match self {
            Deformation::Bending(flexibility) => Some(flexibility),
            Deformation::Rigid | Deformation::Resting(_) => None,
        }
    }

    /// The same cells with the trial damage of `grain`, where they deform now.
    #[must_use]
    pub fn damaged(&self, grain: &DamagedGrain) -> Self {
        self.bending().map_or_else(|| self.clone(), |bends| Deformation::Bending(bends.damaged(grain)))
    }

    /// The flexibility of a body, whether or not it is in the gaps now.
    pub fn flexibility(&self) -> Option<&Arc<CondensedGrain>> {
        match self {
            Deformation::Resting(flexibility) | Deformation::Bending(flexibility) => {
                Some(flexibility.grain())
            }
            Deformation::Rigid => None,
        }
    }

    /// The same way to deform, by the flexibility of a part.
    pub fn of_part(&self, part: impl FnOnce() -> Result<Arc<CondensedGrain>>) -> Result<Self> {
        Ok(match self {
            Deformation::Rigid => Deformation::Rigid,
            Deformation::Resting(flexibility) => Deformation::Resting(flexibility.of_part(part()?)?),
            Deformation::Bending(flexibility) => Deformation::Bending(flexibility.of_part(part()?)?),
        })
    }
}

impl Breakage {
    pub fn grain(&self) -> Option<&Arc<DamagedGrain>> {
        match self {
            Breakage::Brittle(grain) | Breakage::Softening(grain) => Some(grain),
            Breakage::Never | Breakage::Rubble => None,
        }
    }

    /// The same way to break, of another state of the grain or of a part of it.
    #[must_use]
    pub fn of(&self, grain: Arc<DamagedGrain>) -> Self {
        match self {
            Breakage::Brittle(_) => Breakage::Brittle(grain),
            Breakage::Softening(_) => Breakage::Softening(grain),
            Breakage::Never => Breakage::Never,
            Breakage::Rubble => Breakage::Rubble,
        }
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
    pub deformation: Deformation,
    pub breakage: Breakage,
    /// Its own friction, where it has one.
    pub friction: Option<Friction>,
    /// [kg]
    pub mass: f64,
    /// Centre of mass in body coordinates [m].
    pub centre_of_mass: Vec3,
    /// Where its frame, or that of the grain that it is a part of, lay from the point that it was placed by, in body coordinates [m]: bodies
    /// given far from that point have a frame of their own, since rounding grows with the arm.
    pub offset: crate::tensor::Vec3,
    /// Length that makes rotations commensurate with translations [m]; about the body's radius.
    pub rotation_scale: f64,
}

impl Body {
    /// Force and moment of its weight about its reference point [N, N m], under `gravity` [m/s^2].
    pub fn weight(&self, gravity: &Vec3, pose: &Pose) -> Vector6<f64> {
        let force = gravity * self.mass;
        let moment = (pose.rotation * self.centre_of_mass).cross(&force);
        Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
    }

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
            deformation: Deformation::Rigid,
            breakage: Breakage::Never,
            friction: None,
            mass: 0.0,
            centre_of_mass: Vec3::zeros(),
            offset: Vec3::zeros(),
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
        self.offset + self.damaged().map_or_else(crate::tensor::Vec3::zeros, |grain| grain.offset())
    }

    /// The flexibility by which it deforms now.
    pub fn grain(&self) -> Option<&Arc<CondensedGrain>> {
        self.deformation.bending().map(Flexibility::grain)
    }

    /// Its mesh, where all nodes of it move.
    pub fn full(&self) -> Option<&Arc<FullGrain>> {
        self.deformation.bending()?.full()
    }

    /// Its damage as of the last accepted increment, where it can break.
    pub fn damaged(&self) -> Option<&Arc<DamagedGrain>> {
        self.breakage.grain()
    }

    /// Whether it is rigid for now and may become condensed.
    pub fn is_resting(&self) -> bool {
        matches!(self.deformation, Deformation::Resting(_))
    }

    /// The meshed surface, where the body deforms.
    pub fn surface(&self) -> Option<&Surface> {
        self.grain().map(|grain| grain.surface())
    }

    /// The meshed surface that forces stress: that of a body that deforms, or that breaks.
    pub fn stressed_surface(&self) -> Option<&Surface> {
        match &self.breakage {
            Breakage::Brittle(grain) => Some(grain.condensed().surface()),
            Breakage::Never | Breakage::Softening(_) | Breakage::Rubble => self.surface(),
        }
    }

    /// The meshed surface by which its faces meet others: of a body that deforms, may do so, or breaks.
    pub fn meshed_surface(&self) -> Option<&Surface> {
        self.stressed_surface().or_else(|| self.flexibility().map(|grain| grain.surface()))
    }

    pub fn is_elastic(&self) -> bool {
        self.grain().is_some()
    }

    pub fn is_brittle(&self) -> bool {
        matches!(self.breakage, Breakage::Brittle(_))
    }

    pub fn is_rubble(&self) -> bool {
        matches!(self.breakage, Breakage::Rubble)
    }

    /// Whether its flexibility goes with its damage.
    pub fn softens_with_damage(&self) -> bool {
        matches!(self.breakage, Breakage::Softening(_))
    }

    /// Whether a force on it stresses the facets around its place: it breaks, and its mesh does not spread forces over patches by itself.
    pub fn spreads_forces(&self) -> bool {
        matches!(&self.breakage, Breakage::Brittle(grain) if !grain.is_on_patches())
    }

    /// Whether its contacts soften with its rock, and so harden where their overlap comes near the rounding.
    pub fn softens(&self) -> bool {
        self.is_brittle() || self.is_rubble()
    }

    /// Its flexibility, whether or not it is in the gaps now.
    pub fn flexibility(&self) -> Option<&Arc<CondensedGrain>> {
        self.deformation.flexibility()
    }

    /// Has a resting body deform again; says whether it was resting.
    pub fn wake(&mut self) -> bool {
        let Deformation::Resting(flexibility) = &self.deformation else { return false };
        self.deformation = Deformation::Bending(flexibility.clone());
        true
    }

    /// `E / (1 - nu^2)` of its rock [Pa]; infinite where it does not yield.
    pub fn plane_strain_modulus(&self) -> f64 {
        self.stiffness / (2.0 * STIFFNESS_RATIO * self.rotation_scale)
    }

    /// Whether it may be rigid for a while: damage has not changed how it bends.
    pub fn may_rest(&self) -> bool {
        self.is_sound() || self.is_brittle()
    }

    /// Makes a body that deforms rigid for a while, if it may be; says whether it did.
    pub fn rest(&mut self) -> bool {
        if !self.may_rest() {
            return false;
        }
        let Deformation::Bending(flexibility) = &self.deformation else { return false };
        self.deformation = Deformation::Resting(flexibility.clone());
        true
    }

    /// Whether its rock is as generated.
    pub fn is_sound(&self) -> bool {
        self.damaged().is_none_or(|grain| grain.is_sound())
    }

    /// How it deforms, as results files number it: 0 rigid, 1 condensed, 2 full.
    pub fn level(&self) -> u8 {
        match self.deformation {
            Deformation::Rigid | Deformation::Resting(_) => 0,
            Deformation::Bending(Flexibility::Condensed(_)) => 1,
            Deformation::Bending(Flexibility::Full(_)) => 2,
        }
    }
}
