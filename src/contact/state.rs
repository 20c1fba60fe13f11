//! What the force of a contact point depends on, and what an evaluation gives; see [`crate::contact::force`].

use crate::contact::asperity::AsperityState;
use crate::contact::face::FaceShare;
use crate::contact::law::{ContactLaw, Weakening};
use crate::tensor::dual::{Real, Vector};
use crate::tensor::{Mat3, Pose, Vec3};

/// Where a body is now and where it was at the last accepted increment.
#[derive(Debug, Clone, Copy)]
pub struct Kinematics {
    /// Reference point now [m].
    pub position: Vec3,
    /// Reference point at the last accepted increment [m].
    pub committed_position: Vec3,
    /// Turns a vector now back to what it was: committed rotation times inverse of the present one.
    turn_back: Mat3,
    /// The turn since then as a quaternion: its real part, not negative, and the other three.
    turn: (f64, Vec3),
}

impl Kinematics {
    pub fn between(committed: &Pose, now: &Pose) -> Self {
        let turn = now.rotation * committed.rotation.inverse();
        let sign = if turn.w < 0.0 { -1.0 } else { 1.0 };
        Kinematics {
            position: now.position,
            committed_position: committed.position,
            turn_back: turn.inverse().to_rotation_matrix().into_inner(),
            turn: (sign * turn.w, turn.imag() * sign),
        }
    }

    /// How far the body's point that was at `place` [m] then has come.
    pub fn moved(&self, place: &Vec3) -> Vec3 {
        self.position + self.turn_back.tr_mul(&(place - self.committed_position)) - place
    }
}

/// What a contact point carries into a Newton solve; constant during it.
#[derive(Debug, Clone, Copy)]
pub struct PointState {
    /// Sum of the two rounding radii [m].
    pub radii: f64,
    /// Radius of `a` less that of `b` [m].
    pub radius_difference: f64,
    /// Normal stiffness during a Newton solve [N/m]: the spring, or a softer penalty.
    pub stiffness: f64,
    /// Stiffness of the contact's own spring [N/m], which is what stores energy here.
    pub spring: f64,
    pub friction: Weakening,
    /// Normal force of the last augmentation over the weight, times the penalty's compliance beyond
    /// the spring's [m].
    pub offset: f64,
    /// Tangential stretch of the spring at the last accepted increment [m], in space as it was then; it turns with the bodies. Times the
    /// tangential stiffness it is the friction force at no further slide, on `b`.
    pub stretch: Vec3,
    /// What the penalty's compliance beyond the spring's gave along the contact under the friction of the last augmentation [m], in space.
    pub behind_stretch: Vec3,
    /// Whether the bodies were apart at the last accepted increment: what they moved before they touched is no slide.
    pub is_new: bool,
    /// Cosines of the corners' cones where a vertex meets a vertex and both are sharp. Each side's second site point is then its
    /// corner's axis away from the vertex.
    pub corners: Option<[f64; 2]>,
    /// Where two faces are nearly parallel: what the contact has to do with the patch that they carry on.
    pub faces: Option<FaceShare>,
    /// Elastic displacement of `b`'s surface relative to `a`'s here [m], in space.
    pub elastic: Vec3,
    /// The part of it that came since the last accepted increment [m].
    pub elastic_change: Vec3,
    /// Overlap besides [m]; see [`crate::contact::memory::PointMemory::initial_overlap`].
    pub initial_overlap: f64,
    /// Where the contact's force is an unknown, or an asperity's: compliance behind the spring per force, weight included [m/N], in all directions; and what
    /// it gave under the unknown force, or that of the last augmentation [m], in space, which it gives back. Where the two forces agree nothing of it is left.
    pub compliance: f64,
    pub returned: Vec3,
    /// Stiffness with which it hardens before the cores meet ([`ContactLaw::hardening`]) [N/m]; zero of springs between bodies that cannot break.
    /// That of the contact of rigid bodies, so that it does not depend on which of them deform.
    pub hardening: f64,
    /// In the place of the spring, where the contact is one of asperities. The spring is then what hardens it, and a scale.
    pub asperity: Option<AsperityState>,
}

impl PointState {
    /// Of two rigid bodies with these roundings [m] that touch by a spring [N/m].
    pub fn of_spring([a, b]: [f64; 2], spring: f64, friction: Weakening) -> Self {
        PointState {
            radii: a + b,
            radius_difference: a - b,
            stiffness: spring,
            spring,
            friction,
            offset: 0.0,
            stretch: Vec3::zeros(),
            behind_stretch: Vec3::zeros(),
            is_new: false,
            corners: None,
            faces: None,
            elastic: Vec3::zeros(),
            elastic_change: Vec3::zeros(),
            initial_overlap: 0.0,
            compliance: 0.0,
            returned: Vec3::zeros(),
            hardening: 0.0,
            asperity: None,
        }
    }

    /// Compliance that stands behind the spring, over the spring's own; zero for two rigid bodies.
    pub(super) fn behind(&self) -> f64 {
        self.spring / self.stiffness - 1.0
    }

    /// Tangential stiffness over the weight where the contact holds on to a patch of this radius [m]; a spring's is what it is [N/m].
    pub fn tangential_stiffness(&self, law: &ContactLaw, grip: f64) -> f64 {
        law.tangential_ratio * self.asperity.map_or(self.spring, |a| grip * a.stiffness_of_patch())
    }

    /// Normal stiffness over the weight where it unloads from a patch of this radius [m], which is the largest it has [N/m].
    pub fn unloading_stiffness(&self, patch: f64) -> f64 {
        self.asperity.map_or(self.spring, |a| patch * a.stiffness_of_patch())
    }

    /// The part of an evaluation's stretch that is the spring's own [m].
    pub fn own_stretch(&self, law: &ContactLaw, e: &Evaluation) -> Vec3 {
        let shared = 1.0 / self.stiffness - 1.0 / self.spring;
        e.stretch - e.friction * (shared / (e.weight * law.tangential_ratio) + self.compliance)
    }
}

/// A contact point in one configuration.
#[derive(Debug, Clone, Copy)]
pub struct Evaluation {
    /// 0 to 1; below 1 only for edge pairs near an edge's end or nearly parallel, and for vertex pairs.
    pub weight: f64,
    /// Distance between the rounded surfaces, elastic displacement included [m].
    pub gap: f64,
    /// From `a` to `b`.
    pub normal: Vec3,
    /// Where the force acts [m].
    pub point: Vec3,
    /// Normal force, weight included [N].
    pub pressure: f64,
    /// Friction force on `b` [N].
    pub friction: Vec3,
    /// Friction coefficient in force.
    pub coefficient: f64,
    /// Its mean over the slip of the step, over its present value.
    pub mean_coefficient: f64,
    /// Normal force over the weight [N].
    pub load: f64,
    /// The part of it that keeps the cores apart ([`ContactLaw::hardening`]), which bends no body.
    pub hardened: f64,
    /// Tangential stretch of the last accepted increment where the bodies' turn has brought it [m].
    pub carried_stretch: Vec3,
    /// Tangential stretch had nothing slipped [m].
    pub trial_stretch: Vec3,
    /// What is left of it when the excess over the bound has slipped [m].
    pub stretch: Vec3,
    /// Energy stored in the tangential stretch [J].
    pub tangential_energy: f64,
    /// How far its asperity is pressed in [m]; zero without one.
    pub indentation: f64,
    /// Radius of the patch of its asperity now, and of the one that friction holds on to [m]; zero without one.
    pub patch: f64,
    pub grip: f64,
    /// Energy of the normal part [J].
    pub energy: f64,
    /// Force and moment about the body's reference point on `a`, then on `b` [N, N m].
    pub wrench: [f64; 12],
}

impl Evaluation {
    /// Before friction and wrench are known, the gap zero.
    pub(super) fn new(state: &PointState, weight: f64, normal: Vec3, point: Vec3, pressure: f64) -> Self {
        Evaluation {
            weight,
            gap: 0.0,
            normal,
            point,
            pressure,
            friction: Vec3::zeros(),
            coefficient: state.friction.coefficient,
            mean_coefficient: 1.0,
            load: 0.0,
            hardened: 0.0,
            carried_stretch: Vec3::zeros(),
            trial_stretch: Vec3::zeros(),
            stretch: Vec3::zeros(),
            tangential_energy: 0.0,
            indentation: 0.0,
            patch: 0.0,
            grip: 0.0,
            energy: 0.0,
            wrench: [0.0; 12],
        }
    }

    /// Normal force of the contact's own spring over the weight [N].
    pub fn sprung(&self) -> f64 {
        self.load - self.hardened
    }

    /// The force on `b` that bends the bodies [N]: what the contact's own spring presses, and friction.
    pub fn bending_force(&self) -> Vec3 {
        self.normal * (self.pressure - self.weight * self.hardened) + self.friction
    }

    pub fn is_active(&self) -> bool {
        self.pressure > 0.0
    }

    /// Whether the friction force is at its bound.
    pub fn slides(&self) -> bool {
        self.friction.norm() > (1.0 - 1e-6) * self.coefficient * self.pressure
    }

    /// Slip in the step [m].
    pub fn slip(&self) -> f64 {
        (self.trial_stretch - self.stretch).norm()
    }
}

/// A body's motion about its present pose.
pub struct Frame<T> {
    pub position: Vector<T>,
    /// Infinitesimal rotation away from the present one; `None` where it is zero.
    pub spin: Option<Vector<T>>,
    pub kinematics: Kinematics,
}

impl<T: Real> Frame<T> {
    /// Of a body where it is.
    pub fn still(kinematics: &Kinematics) -> Self {
        Frame { position: Vector::constant(&kinematics.position), spin: None, kinematics: *kinematics }
    }

    /// A material point that is at `point` without the frame's motion.
    pub fn carried(&self, point: &Vec3) -> Vector<T> {
        self.position + self.turned(&(point - self.kinematics.position))
    }

    /// A direction fixed to the body.
    pub fn turned(&self, direction: &Vec3) -> Vector<T> {
        let direction = Vector::constant(direction);
        self.spin.map_or(direction, |spin| direction + spin.cross(direction))
    }

    /// Cosine and sine, times one positive factor, of half the angle by which the body has turned about the unit vector `n` since the last
    /// accepted increment, the rest of its turn being about an axis across `n` and before that.
    pub fn half_twist(&self, n: Vector<T>) -> [T; 2] {
        let (real, imaginary) = self.kinematics.turn;
        let vector = Vector::constant(&imaginary);
        let still = [T::constant(real), vector.dot(n)];
        let Some(spin) = self.spin else { return still };
        let turned = vector + (spin.times(still[0]) + spin.cross(vector)).times(T::constant(0.5));
        [still[0] - spin.dot(vector).scaled(0.5), turned.dot(n)]
    }

    /// Where the material point that is now at `x` was at the last accepted increment.
    pub fn committed(&self, x: Vector<T>) -> Vector<T> {
        let mut arm = x - self.position;
        if let Some(spin) = self.spin {
            arm = arm - spin.cross(arm);
        }
        Vector::constant(&self.kinematics.committed_position) + arm.turned_by(&self.kinematics.turn_back)
    }
}
