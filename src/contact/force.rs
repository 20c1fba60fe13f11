//! The force of one contact point and its tangent.
//!
//! Normal part: `w s N(overlap)`, plus the gradient of the weight `w` times the energy stored per weight:
//! `-d/dq [ w s psi(overlap) ]`, a plain spring. Where the bodies' own flexibility is in the gap, a compliance stands behind the
//! spring (both together are the penalty, `stiffness`) and `offset` is what it gave under the force of the last
//! augmentation. The spring keeps its own law, onset and bend included, so that at rest that law is left, and
//! energies are the spring's (`assembly::elastic`). Bodies of rock meet by an asperity in the spring's place (`contact::asperity`). Friction: the trial
//! force `k_t w (stretch - slide)` is bent smoothly onto the disc of radius `mu w p`, `p` being the
//! normal force of the same configuration (implicit, never lagged). The bend is elastic; only what
//! the stretch exceeds the end of the bend by slips, so that repeating a step changes nothing. `mu` weakens with the slip
//! of the present step too (`law::Weakening`), solved for together with it.

use crate::contact::asperity::AsperityState;
use crate::contact::corner::CornerWeight;
use crate::contact::face::{FaceShare, FaceWeight};
use crate::contact::features::{LinePair, Site, closest_points};
use crate::contact::friction::{Pressed, rub};
use crate::contact::law::{ContactLaw, Weakening};
use crate::tensor::dual::{Dual, Real, Vector};
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
    /// Overlap besides [m]; see [`crate::contact::memory::PointMemory::lead`].
    pub lead: f64,
    /// Where the contact's force is an unknown, or an asperity's: compliance behind the spring per force, weight included [m/N], in all directions; and what
    /// it gave under the unknown force, or that of the last augmentation [m], in space, which it gives back. Where the two forces agree nothing of it is left.
    pub compliance: f64,
    pub given: Vec3,
    /// Stiffness with which it hardens before the cores meet ([`ContactLaw::hardening`]) [N/m]; zero where no body can break. That of the contact of
    /// rigid bodies, so that it does not depend on which of them deform.
    pub hardening: f64,
    /// In the place of the spring, where the contact is one of asperities. The spring is then what hardens it, and a scale.
    pub asperity: Option<AsperityState>,
}

impl PointState {
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

/// Derivative of the twelve wrench components by: position of `b` relative to `a` (0-2), spin of
/// `b` (3-5), spin of `a` (6-8). Moving `a` is moving `b` the other way.
pub type Tangent = [[f64; 9]; 12];

/// The bodies' points that span the site, in space.
#[derive(Debug, Clone, Copy)]
pub struct SitePoints {
    pub a: [Vec3; 3],
    pub b: [Vec3; 3],
    /// Outward normals of the two faces that [`PointState::faces`] is about; else unused.
    pub normals: [Vec3; 2],
}

pub fn evaluate(
    law: &ContactLaw,
    site: &Site,
    points: &SitePoints,
    a: &Kinematics,
    b: &Kinematics,
    state: &PointState,
) -> Evaluation {
    let constants =
        |p: &[Vec3; 3]| [Vector::constant(&p[0]), Vector::constant(&p[1]), Vector::constant(&p[2])];
    let sides = Sides {
        a: constants(&points.a),
        b: constants(&points.b),
        normals: points.normals.map(|n| Vector::constant(&n)),
    };
    wrench::<f64>(law, site, &sides, [&Frame::still(a), &Frame::still(b)], &Vector::zero(), state).0
}

/// Where a contact's force acts [m] and its normal from `a` to `b`.
pub fn place(site: &Site, points: &SitePoints, radius_difference: f64) -> (Vec3, Vec3) {
    let constants = |p: &[Vec3; 3]| p.map(|x| Vector::<f64>::constant(&x));
    let (xa, xb) = closest_points(site, &constants(&points.a), &constants(&points.b));
    let (xa, xb) = (xa.value(), xb.value());
    let normal = (xb - xa).normalize();
    (0.5 * (xa + xb + normal * radius_difference), normal)
}

/// As [`Tangent`] with the force on `b` that bends bodies ([`Evaluation::bending_force`]) behind the wrench, by the same nine and by the
/// elastic displacement of `b`'s surface relative to `a`'s (9-11).
pub type ElasticTangent = [[f64; 12]; 15];

/// The exact derivative of [`evaluate`]'s wrench.
pub fn tangent(
    law: &ContactLaw,
    site: &Site,
    points: &SitePoints,
    a: &Kinematics,
    b: &Kinematics,
    state: &PointState,
) -> Tangent {
    let (wrench, _) = derivative::<9>(law, site, points, a, b, state);
    std::array::from_fn(|k| wrench[k].gradient)
}

/// The exact derivative of wrench and force where the elastic displacement is unknown as well.
pub fn elastic_tangent(
    law: &ContactLaw,
    site: &Site,
    points: &SitePoints,
    a: &Kinematics,
    b: &Kinematics,
    state: &PointState,
) -> ElasticTangent {
    let (wrench, force) = derivative::<12>(law, site, points, a, b, state);
    std::array::from_fn(|k| if k < 12 { wrench[k].gradient } else { force.0[k - 12].gradient })
}

/// Wrench and force on `b` with their derivatives by the first `N` of position and spin of `b`, spin of `a`, and
/// elastic displacement.
fn derivative<const N: usize>(
    law: &ContactLaw,
    site: &Site,
    points: &SitePoints,
    a: &Kinematics,
    b: &Kinematics,
    state: &PointState,
) -> ([Dual<N>; 12], Vector<Dual<N>>) {
    let displaced = variables(9);
    let [frame_a, frame_b] = moving_frames(a, b);
    let sides = Sides {
        a: points.a.map(|p| frame_a.carried(&p)),
        b: points.b.map(|p| frame_b.carried(&p)),
        normals: [frame_a.turned(&points.normals[0]), frame_b.turned(&points.normals[1])],
    };
    let (_, wrench, force) = wrench(law, site, &sides, [&frame_a, &frame_b], &displaced, state);
    (wrench, force)
}

/// Three variables of zero, the first of them number `first`; constants beyond the last variable.
fn variables<const N: usize>(first: usize) -> Vector<Dual<N>> {
    let variable = |k: usize| {
        if first + k < N { Dual::<N>::variable(0.0, first + k) } else { Dual::constant(0.0) }
    };
    Vector([0, 1, 2].map(variable))
}

/// The frames of `a` and `b`, moved by variables: position of `b` (0-2), spin of `b` (3-5), spin of `a` (6-8).
pub(super) fn moving_frames<const N: usize>(a: &Kinematics, b: &Kinematics) -> [Frame<Dual<N>>; 2] {
    let still = |k: &Kinematics| Vector::constant(&k.position);
    [
        Frame { position: still(a), spin: Some(variables(6)), kinematics: *a },
        Frame { position: still(b) + variables(0), spin: Some(variables(3)), kinematics: *b },
    ]
}

/// A body's motion about its present pose.
pub(super) struct Frame<T> {
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

/// The points that span a site and the normals of its faces.
struct Sides<T> {
    a: [Vector<T>; 3],
    b: [Vector<T>; 3],
    normals: [Vector<T>; 2],
}

/// The contact with the elastic displacement `displaced` on top of the state's; its wrench, and the force on `b` that bends bodies, which the weight's
/// gradient is no part of.
fn wrench<T: Real>(
    law: &ContactLaw,
    site: &Site,
    Sides { a, b, normals }: &Sides<T>,
    [frame_a, frame_b]: [&Frame<T>; 2],
    displaced: &Vector<T>,
    state: &PointState,
) -> (Evaluation, [T; 12], Vector<T>) {
    let zero = T::constant(0.0);
    let is_edge_pair = site.count_a == 2 && site.count_b == 2;
    let (xa, xb) = closest_points(site, a, b);
    let difference = xb - xa;
    let distance = difference.norm();
    let normal = difference.times(T::constant(1.0) / distance);
    let elastic = Vector::constant(&state.elastic) + *displaced;
    let undeformed = T::constant(state.radii) - distance;
    let overlap = undeformed - normal.dot(elastic) + T::constant(state.lead);
    // Halfway between the rounded surfaces, not between the cores.
    let point = (xa + xb + normal.times(T::constant(state.radius_difference))).times(T::constant(0.5));
    let lines = is_edge_pair.then(|| LinePair::new(a, b));
    let edge_weight = lines.as_ref().map(|l| l.weight(law));
    let axes = [a[1] - a[0], b[1] - b[0]];
    let corner_weight = state.corners.map(|cosines| CornerWeight::new(normal, axes, cosines));
    let own_weight = match (&edge_weight, &corner_weight) {
        (Some(edge), _) => edge.value,
        (None, Some(corner)) => corner.value,
        (None, None) => T::constant(1.0),
    };
    let face_weight = state.faces.map(|share| FaceWeight::new(share, *normals, normal));
    let faced = face_weight.as_ref().map_or(T::constant(1.0), |face| face.value);
    let weight = own_weight * faced;

    let given = Vector::constant(&state.given);
    let pushed = overlap + T::constant(state.offset) + normal.dot(given);
    let behind = T::constant(state.behind()) + weight.scaled(state.spring * state.compliance);
    let press = state.asperity.map(|asperity| {
        let compliance = weight.scaled(asperity.share * state.compliance);
        let indentation = asperity.law.indentation_behind(pushed, asperity.depth, compliance);
        (asperity, indentation, asperity.law.press(indentation, asperity.depth))
    });
    let linear = match &press {
        Some((asperity, _, press)) => press.force.scaled(asperity.share),
        None => law.normal_behind(pushed, behind).scaled(state.spring),
    };
    let grip = press.map(|(asperity, _, press)| asperity.grip(press.patch));
    let hardens = state.hardening > 0.0;
    let hardened = if hardens { law.hardening(undeformed, state.radii) } else { None };
    let hardened = hardened.map(|both| both.map(|part| part.scaled(state.hardening)));
    let load = hardened.map_or(linear, |[more, _]| linear + more);
    let pressure = weight * load;
    let mut evaluation = Evaluation {
        gap: -overlap.value(),
        load: load.value(),
        hardened: hardened.map_or(0.0, |[more, _]| more.value()),
        indentation: press.map_or(0.0, |(_, indentation, _)| indentation.value()),
        patch: press.map_or(0.0, |(.., press)| press.patch.value()),
        grip: grip.map_or(0.0, T::value),
        ..Evaluation::new(state, weight.value(), normal.value(), point.value(), pressure.value())
    };
    if pressure.value() <= 0.0 {
        return (evaluation, [zero; 12], Vector::zero());
    }

    let mut force_on_b = normal.times(pressure);
    if state.friction.coefficient > 0.0 {
        let pressed = Pressed { point, normal, pressure, weight, overlap, grip };
        force_on_b = force_on_b + rub(law, state, [frame_a, frame_b], &pressed, displaced, &mut evaluation);
    }
    let bending = hardened.map_or(force_on_b, |[more, _]| force_on_b - normal.times(weight * more));
    let arm_a = point - frame_a.position;
    let arm_b = point - frame_b.position;
    let mut force_a = -force_on_b;
    let mut moment_a = arm_a.cross(force_a);
    let mut force_b = force_on_b;
    let mut moment_b = arm_b.cross(force_b);

    let excess = match press {
        Some((asperity, _, press)) => press.energy.scaled(asperity.share),
        None => law.energy_at(linear.scaled(1.0 / state.spring)).scaled(state.spring),
    };
    let excess = hardened.map_or(excess, |[_, more]| excess + more);
    evaluation.energy = (weight * excess).value();
    if let (Some(lines), Some(edge_weight)) = (&lines, &edge_weight)
        && edge_weight.value.value() < 1.0
    {
        let gradient = lines.end_point_gradient(edge_weight, difference);
        for (k, g) in gradient.iter().enumerate() {
            let push = -g.times(excess * faced);
            if k < 2 {
                force_a = force_a + push;
                moment_a = moment_a + (a[k] - frame_a.position).cross(push);
            } else {
                force_b = force_b + push;
                moment_b = moment_b + (b[k - 2] - frame_b.position).cross(push);
            }
        }
    }
    if let Some(corner) = corner_weight.filter(|corner| corner.value.value() < 1.0) {
        let across = corner.by_normal - normal.times(corner.by_normal.dot(normal));
        let excess = excess * faced;
        let push = -across.times(excess / distance);
        force_b = force_b + push;
        moment_b = moment_b + (b[0] - frame_b.position).cross(push);
        force_a = force_a - push;
        moment_a = moment_a - (a[0] - frame_a.position).cross(push);
        moment_a = moment_a - axes[0].cross(corner.by_axes[0]).times(excess);
        moment_b = moment_b - axes[1].cross(corner.by_axes[1]).times(excess);
    }
    if let Some(face) = face_weight {
        let moment = face.by_turn.times(excess * own_weight);
        moment_a = moment_a - moment;
        moment_b = moment_b + moment;
    }
    let mut all = [zero; 12];
    for (part, vector) in all.chunks_exact_mut(3).zip([force_a, moment_a, force_b, moment_b]) {
        part.copy_from_slice(&vector.0);
    }
    evaluation.wrench = all.map(T::value);
    (evaluation, all, bending)
}

#[cfg(test)]
mod tests;
