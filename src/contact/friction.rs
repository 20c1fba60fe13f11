//! The friction force of a contact point; see [`crate::contact::force`].

use crate::contact::law::ContactLaw;
use crate::contact::state::{Evaluation, Frame, PointState};
use crate::tensor::Vec3;
use crate::tensor::dual::{Real, Vector};

/// Surfaces nearer than this share of their roundings count as in touch: turns of second order hide whether they are.
const NEAR: f64 = 1e-4;

/// A contact that carries.
pub(super) struct Pressed<T> {
    pub point: Vector<T>,
    /// From `a` to `b`.
    pub normal: Vector<T>,
    /// Normal force, weight included [N].
    pub pressure: T,
    pub weight: T,
    /// Of the rounded surfaces, elastic displacement included [m].
    pub overlap: T,
    /// Radius of the patch that friction holds on to [m], where the contact is one of asperities.
    pub grip: Option<T>,
}

/// The friction force on `b` [N], and what it is made of in `evaluation`. The trial force bends onto the disc of radius `mu w p`.
pub(super) fn rub<T: Real>(
    law: &ContactLaw,
    state: &PointState,
    [frame_a, frame_b]: [&Frame<T>; 2],
    &Pressed { point, normal, pressure, weight, overlap, grip }: &Pressed<T>,
    displaced: &Vector<T>,
    evaluation: &mut Evaluation,
) -> Vector<T> {
    let one = T::constant(1.0);
    // A patch that grows is stiffer from then on; the force that it had stays.
    let (tangential_spring, kept) = match (&state.asperity, grip) {
        (Some(asperity), Some(grip)) => (
            grip.scaled(asperity.stiffness_of_patch() * law.tangential_ratio),
            T::constant(asperity.grip) / grip,
        ),
        (None, _) | (_, None) => (T::constant(state.spring * law.tangential_ratio), one),
    };
    let behind = T::constant(state.behind()) + weight * tangential_spring.scaled(state.compliance);
    let spring = weight * tangential_spring;
    let stiffness = spring / (one + behind);
    let moved = frame_a.committed(point) - frame_b.committed(point)
        + Vector::constant(&state.elastic_change)
        + *displaced;
    let slide =
        if state.is_new { moved.times(share_in_touch(&moved, normal, overlap, state.radii)) } else { moved };
    let tangential = |v: Vector<T>| v - normal.times(v.dot(normal));
    let carried = carried_over(&state.stretch, normal, [frame_a, frame_b]).times(kept);
    let trial = carried + tangential(Vector::constant(&(state.behind_stretch + state.returned)) - slide);
    let trial_length = trial.norm();
    let mut bound = pressure.scaled(state.friction.coefficient);
    let most = 1.0 + law.friction_blend;
    // The trial force over the bound at which the contact starts to slip, compliance behind the spring included.
    let slips_at = (T::constant(most) + behind) / (one + behind);
    if state.friction.excess > 0.0
        && stiffness.value() * trial_length.value() > slips_at.value() * bound.value()
        && trial_length.value() > 0.0
    {
        let slipped = state.friction.slipped(trial_length, pressure * slips_at / stiffness);
        bound = pressure * slipped.coefficient;
        evaluation.coefficient = slipped.coefficient.value();
        evaluation.mean_coefficient = slipped.mean / evaluation.coefficient;
    }
    // Trial force of the spring in units of what the bound can hold.
    let mut share = 0.0;
    let friction = if trial_length.value() > 0.0 {
        let x = law.share_behind(spring * trial_length / bound, behind);
        share = x.value();
        if share <= 1.0 - law.friction_blend {
            trial.times(stiffness)
        } else {
            trial.times(bound * law.friction_share(x) / trial_length)
        }
    } else {
        trial.times(stiffness)
    };
    evaluation.friction = friction.value();
    evaluation.carried_stretch = carried.value();
    evaluation.trial_stretch = trial.value();
    let behind = behind.value();
    evaluation.stretch =
        if share > most { trial.value() * ((most + behind) / (share + behind)) } else { trial.value() };
    evaluation.tangential_energy =
        bound.value().powi(2) / spring.value() * law.friction_energy(share.min(most));
    friction
}

/// The share of their motion that bodies made in touch which came together on a straight way: `overlap` of all that they came closer by.
fn share_in_touch<T: Real>(moved: &Vector<T>, normal: Vector<T>, overlap: T, radii: f64) -> T {
    let near = T::constant(NEAR * radii);
    let (in_touch, closer) = (overlap + near, near - moved.dot(normal));
    if closer.value() <= in_touch.value() {
        T::constant(1.0)
    } else if in_touch.value() <= 0.0 {
        T::constant(0.0)
    } else {
        in_touch / closer
    }
}

/// The stretch of the last accepted increment in the present tangent plane, its length kept, and turned about the normal by the mean of what
/// the bodies have: where both turn as one the force turns with them.
fn carried_over<T: Real>(stretch: &Vec3, normal: Vector<T>, [a, b]: [&Frame<T>; 2]) -> Vector<T> {
    let length = stretch.norm();
    if length == 0.0 {
        return Vector::zero();
    }
    let old = Vector::constant(stretch);
    let projected = old - normal.times(old.dot(normal));
    let projected_length = projected.norm();
    if projected_length.value() < 1e-3 * length {
        return Vector::zero();
    }
    let ([cos_a, sin_a], [cos_b, sin_b]) = (a.half_twist(normal), b.half_twist(normal));
    // Two halves make the mean.
    let (cos, sin) = (cos_a * cos_b - sin_a * sin_b, sin_a * cos_b + cos_a * sin_b);
    let size = (cos * cos + sin * sin).sqrt();
    if size.value() < 1e-3 {
        return Vector::zero();
    }
    let turned = projected.times(cos) + normal.cross(projected).times(sin);
    turned.times(T::constant(length) / (projected_length * size))
}
