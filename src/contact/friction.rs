//! The friction force of a contact point; see [`crate::contact::force`].

use crate::contact::force::{Evaluation, Frame, PointState};
use crate::contact::law::ContactLaw;
use crate::tensor::Vec3;
use crate::tensor::dual::{Real, Vector};

/// A contact that carries.
pub(super) struct Pressed<T> {
    pub point: Vector<T>,
    /// From `a` to `b`.
    pub normal: Vector<T>,
    /// Normal force, weight included [N].
    pub pressure: T,
    pub weight: T,
}

/// The friction force on `b` [N], and what it is made of in `evaluation`. The trial force bends onto the disc of radius `mu w p`.
pub(super) fn rub<T: Real>(
    law: &ContactLaw,
    state: &PointState,
    [frame_a, frame_b]: [&Frame<T>; 2],
    &Pressed { point, normal, pressure, weight }: &Pressed<T>,
    displaced: &Vector<T>,
    evaluation: &mut Evaluation,
) -> Vector<T> {
    let one = T::constant(1.0);
    let tangential_spring = state.spring * law.tangential_ratio;
    let behind = T::constant(state.behind()) + weight.scaled(tangential_spring * state.compliance);
    let spring = weight.scaled(tangential_spring);
    let stiffness = spring / (one + behind);
    let slide = frame_a.committed(point) - frame_b.committed(point)
        + Vector::constant(&(state.elastic_change - state.given))
        + *displaced;
    let tangential = |v: Vector<T>| v - normal.times(v.dot(normal));
    let trial = carried_over(&state.stretch, normal) - tangential(slide);
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
    evaluation.trial_stretch = trial.value();
    let behind = behind.value();
    evaluation.stretch =
        if share > most { trial.value() * ((most + behind) / (share + behind)) } else { trial.value() };
    evaluation.tangential_energy =
        bound.value().powi(2) / spring.value() * law.friction_energy(share.min(most));
    friction
}

/// The stretch of the last accepted increment in the present tangent plane, its length kept.
fn carried_over<T: Real>(stretch: &Vec3, normal: Vector<T>) -> Vector<T> {
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
    projected.times(T::constant(length) / projected_length)
}
