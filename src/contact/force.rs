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

use crate::contact::corner::CornerWeight;
use crate::contact::face::FaceWeight;
use crate::contact::features::{EdgeWeight, LinePair, Site, closest_points};
use crate::contact::friction::{Pressed, rub};
use crate::contact::law::ContactLaw;
use crate::contact::state::Frame;
pub use crate::contact::state::{Evaluation, Kinematics, PointState};
use crate::contact::wrench::Wrench;
use crate::tensor::Vec3;
use crate::tensor::dual::{Dual, Real, Vector};

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

/// What the force of a contact point follows from.
#[derive(Debug, Clone, Copy)]
pub struct Situation<'a> {
    pub law: &'a ContactLaw,
    pub site: &'a Site,
    pub points: &'a SitePoints,
    /// Of `a` and of `b`.
    pub kinematics: [&'a Kinematics; 2],
    pub state: &'a PointState,
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

impl Situation<'_> {
    pub fn evaluate(&self) -> Evaluation {
        let constants = |p: &[Vec3; 3]| p.map(|x| Vector::constant(&x));
        let SitePoints { a, b, normals } = self.points;
        let sides =
            Sides { a: constants(a), b: constants(b), normals: normals.map(|n| Vector::constant(&n)) };
        let [frame_a, frame_b] = self.kinematics.map(Frame::<f64>::still);
        wrench(self, &sides, [&frame_a, &frame_b], &Vector::zero()).0
    }

    /// The exact derivative of the evaluation's wrench.
    pub fn tangent(&self) -> Tangent {
        let (wrench, _) = self.derivative::<9>();
        std::array::from_fn(|k| wrench[k].gradient)
    }

    /// The exact derivative of wrench and force where the elastic displacement is unknown as well.
    pub fn elastic_tangent(&self) -> ElasticTangent {
        let (wrench, force) = self.derivative::<12>();
        std::array::from_fn(|k| if k < 12 { wrench[k].gradient } else { force.0[k - 12].gradient })
    }

    /// Wrench and force on `b` with their derivatives by the first `N` of position and spin of `b`, spin of `a`, and
    /// elastic displacement.
    fn derivative<const N: usize>(&self) -> ([Dual<N>; 12], Vector<Dual<N>>) {
        let [frame_a, frame_b] = moving_frames(self.kinematics);
        let SitePoints { a, b, normals } = self.points;
        let sides = Sides {
            a: a.map(|p| frame_a.carried(&p)),
            b: b.map(|p| frame_b.carried(&p)),
            normals: [frame_a.turned(&normals[0]), frame_b.turned(&normals[1])],
        };
        let (_, wrench, force) = wrench(self, &sides, [&frame_a, &frame_b], &variables(9));
        (wrench, force)
    }
}

/// Three variables of zero, the first of them number `first`; constants beyond the last variable.
fn variables<const N: usize>(first: usize) -> Vector<Dual<N>> {
    let variable = |k: usize| {
        if first + k < N { Dual::<N>::variable(0.0, first + k) } else { Dual::constant(0.0) }
    };
    Vector([0, 1, 2].map(variable))
}

/// The frames of `a` and `b`, moved by variables: position of `b` (0-2), spin of `b` (3-5), spin of `a` (6-8).
pub(super) fn moving_frames<const N: usize>([a, b]: [&Kinematics; 2]) -> [Frame<Dual<N>>; 2] {
    let still = |k: &Kinematics| Vector::constant(&k.position);
    [
        Frame { position: still(a), spin: Some(variables(6)), kinematics: *a },
        Frame { position: still(b) + variables(0), spin: Some(variables(3)), kinematics: *b },
    ]
}

/// The points that span a site and the normals of its faces.
struct Sides<T> {
    a: [Vector<T>; 3],
    b: [Vector<T>; 3],
    normals: [Vector<T>; 2],
}

impl<T: Real> Sides<T> {
    /// From the first point of each body to its second: the axes of corners.
    fn axes(&self) -> [Vector<T>; 2] {
        [self.a[1] - self.a[0], self.b[1] - self.b[0]]
    }
}

/// The contact with the elastic displacement `displaced` on top of the state's; its wrench, and the force on `b` that bends bodies, which the weight's
/// gradient is no part of.
fn wrench<T: Real>(
    &Situation { law, site, state, .. }: &Situation<'_>,
    sides: &Sides<T>,
    [frame_a, frame_b]: [&Frame<T>; 2],
    displaced: &Vector<T>,
) -> (Evaluation, [T; 12], Vector<T>) {
    let zero = T::constant(0.0);
    let (xa, xb) = closest_points(site, &sides.a, &sides.b);
    let difference = xb - xa;
    let distance = difference.norm();
    if distance.value().is_nan() {
        // Edges that are parallel to the last bit have no nearest points, and no weight.
        let none = Evaluation::new(state, 0.0, Vec3::zeros(), Vec3::zeros(), 0.0);
        return (none, [zero; 12], Vector::zero());
    }
    let normal = difference.times(T::constant(1.0) / distance);
    let elastic = Vector::constant(&state.elastic) + *displaced;
    let undeformed = T::constant(state.radii) - distance;
    let overlap = undeformed - normal.dot(elastic) + T::constant(state.initial_overlap);
    // Halfway between the rounded surfaces, not between the cores.
    let point = (xa + xb + normal.times(T::constant(state.radius_difference))).times(T::constant(0.5));
    let weights = Weights::new(law, site, state, sides, normal);
    let weight = weights.own * weights.faced;

    let returned = Vector::constant(&state.returned);
    let pushed = overlap + T::constant(state.offset) + normal.dot(returned);
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
    let mut wrench = Wrench::new([frame_a, frame_b], point, force_on_b);
    let excess = match press {
        Some((asperity, _, press)) => press.energy.scaled(asperity.share),
        None => law.energy_at(linear.scaled(1.0 / state.spring)).scaled(state.spring),
    };
    let excess = hardened.map_or(excess, |[_, more]| excess + more);
    evaluation.energy = (weight * excess).value();
    weights.push(&mut wrench, sides, difference, excess);
    let all = wrench.components();
    evaluation.wrench = all.map(T::value);
    (evaluation, all, bending)
}

/// What share of a contact its features carry, and how that changes.
struct Weights<T> {
    edge: Option<(LinePair<T>, EdgeWeight<T>)>,
    corner: Option<CornerWeight<T>>,
    face: Option<FaceWeight<T>>,
    /// Of the edges or corners, and what faces leave to them.
    own: T,
    faced: T,
}

impl<T: Real> Weights<T> {
    #[inline]
    fn new(law: &ContactLaw, site: &Site, state: &PointState, sides: &Sides<T>, normal: Vector<T>) -> Self {
        let one = T::constant(1.0);
        let edge = (site.count_a == 2 && site.count_b == 2).then(|| {
            let lines = LinePair::new(&sides.a, &sides.b);
            let weight = lines.weight(law);
            (lines, weight)
        });
        let corner = state.corners.map(|cosines| CornerWeight::new(normal, sides.axes(), cosines));
        let own = match (&edge, &corner) {
            (Some((_, edge)), _) => edge.value,
            (None, Some(corner)) => corner.value,
            (None, None) => one,
        };
        let face = state.faces.map(|share| FaceWeight::new(share, sides.normals, normal));
        let faced = face.as_ref().map_or(one, |face| face.value);
        Weights { edge, corner, face, own, faced }
    }

    /// Adds the force that comes of the share's own gradient: `difference` is from the core of `a` to that of `b` [m], `excess` the energy of the whole
    /// contact [J].
    #[inline]
    fn push(&self, wrench: &mut Wrench<T>, sides: &Sides<T>, difference: Vector<T>, excess: T) {
        if let Some((lines, edge)) = &self.edge
            && edge.value.value() < 1.0
        {
            let gradient = lines.end_point_gradient(edge, difference);
            for (k, g) in gradient.iter().enumerate() {
                let push = -g.times(excess * self.faced);
                if k < 2 { wrench.push_a(sides.a[k], push) } else { wrench.push_b(sides.b[k - 2], push) }
            }
        }
        if let Some(corner) = self.corner.as_ref().filter(|corner| corner.value.value() < 1.0) {
            let distance = difference.norm();
            let normal = difference.times(T::constant(1.0) / distance);
            let across = corner.by_normal - normal.times(corner.by_normal.dot(normal));
            let excess = excess * self.faced;
            let push = -across.times(excess / distance);
            wrench.push_b(sides.b[0], push);
            wrench.push_a(sides.a[0], -push);
            let [axis_a, axis_b] = sides.axes();
            wrench.turn_a(-axis_a.cross(corner.by_axes[0]).times(excess));
            wrench.turn_b(-axis_b.cross(corner.by_axes[1]).times(excess));
        }
        if let Some(face) = &self.face {
            let moment = face.by_turn.times(excess * self.own);
            wrench.turn_a(-moment);
            wrench.turn_b(moment);
        }
    }
}

#[cfg(test)]
mod tests;
