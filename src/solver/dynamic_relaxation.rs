//! Dynamic relaxation: explicit damped motion towards balance, for collapses that implicit steps follow too slowly.
//!
//! A body that lost its support has centimetres to go, and stiff contacts let a Newton step go tens of
//! micrometres. So bodies move as if they had masses: a step costs an evaluation of the contacts and no
//! factorisation. Masses are those for which all contacts swing at one pace (the stiffness on a body times
//! the square of the step); only the way through the collapse depends on them, not the balance at its end,
//! which the implicit steps after it have to find. Each component of the force is reduced by a share of itself
//! where it drives the motion and raised by it where it brakes (Cundall 1987, "Distinct element models of
//! rock and soil structure": local damping), so that bodies come to rest each by itself, whatever others
//! still do.

use crate::assembly::{ContactPoint, PairWork};
use crate::contact::force::PointState;
use crate::model::{BodyKind, Committed};
use crate::solver::newton::Newton;
use crate::solver::step::StepEnd;
use crate::tensor::Vector6;
use rayon::prelude::*;
use std::borrow::Cow;

/// Step of the motion over that of a mass on a spring of its own stiffness, `sqrt(m / k)`. A contact moves by four terms (two bodies, each
/// with its rotation), so the network is stiffer than that by up to 4, and explicit steps are stable below 2 over the root of it, 1.
const STEP: f64 = 0.7;
/// Share of a force that local damping takes.
const DAMPING: f64 = 0.7;
/// What drag leaves of a velocity in a step where no force acts: what nothing touches and nothing presses comes to rest by it.
const DRAG: f64 = 0.98;
/// A plate, which has no stiffness of its own, is heavy enough to be moved by this share of the smallest rounding in a step from rest. What presses
/// it would else drive it into the first grains that it meets.
const PLATE_MOTION: f64 = 0.02;
/// Largest motion of a body in a step, over what Newton's iterations may do at once; and where bodies relax to a mean, whose work is summed.
const SHARE_OF_CAP: f64 = 0.3;
const SHARE_IN_THE_MEAN: f64 = 0.1;
/// What is left of velocities and of the step where bodies would have come too close.
const SHOCK: f64 = 0.25;
/// Shocks in a row before the relaxation is given up.
const MOST_SHOCKS: usize = 20;
/// Steps after which friction acts against the way from there on.
const REBASE_EVERY: usize = 20;
/// The same where bodies relax to a mean and work is summed, and after which masses and the mean contact force are taken anew: friction that turns on a longer
/// way is not in what its ends tell (docs/decisions/0196-explicit-steps-to-rest.md).
const TAKEN_EVERY: usize = 5;
/// Steps between two lines of the log.
const TOLD_EVERY: usize = 50;

/// What may be left out of balance, over the mean contact force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Enough {
    /// On any body.
    OnAny(f64),
    /// Mean over the free bodies.
    InTheMean(f64),
}

impl Newton<'_> {
    /// Whether bodies can relax dynamically: all unknowns are the motion of rigid ones.
    pub(super) fn can_relax(&self) -> bool {
        self.steering.is_none() && self.model.is_of_rigid_bodies()
    }

    /// Lets bodies move from where they are, until no more than `enough` is out of balance or `most_steps` are done. Adds the work of forces but those
    /// applied from outside to `work` [J], by component of each carrier: the mean of the forces at both ends of each step.
    pub(super) fn relax_dynamically(
        &mut self,
        enough: Enough,
        most_steps: usize,
        mut work: Option<&mut [Vector6<f64>]>,
    ) -> StepEnd {
        let count = self.dofs.count();
        let mut velocity: Vec<f64> = vec![0.0; count];
        let mut step = vec![0.0; count];
        let (mut stiffness, mut before, mut mean_contact) = (Vec::new(), Vec::new(), 0.0);
        let mut pace = STEP;
        let mut shocks = 0;
        self.away.iter_mut().for_each(|d| *d = 0.0);
        let mut from = (self.poses.clone(), self.away.clone());
        let in_the_mean = matches!(enough, Enough::InTheMean(_));
        let (rebase_every, share_of_cap) =
            if in_the_mean { (TAKEN_EVERY, SHARE_IN_THE_MEAN) } else { (REBASE_EVERY, SHARE_OF_CAP) };
        for done in 0..most_steps {
            let takes_anew = !in_the_mean || done % TAKEN_EVERY == 0;
            if in_the_mean && takes_anew {
                mean_contact = self.yardsticks().mean;
            }
            let (left, most) = match enough {
                Enough::OnAny(most) => (self.balance().out_of_balance, most),
                Enough::InTheMean(most) => (self.mean_imbalance() / mean_contact, most),
            };
            if done % TOLD_EVERY == 0 {
                tracing::trace!(done, left, pace, "falling");
            }
            if left < most {
                return StepEnd::Solved;
            }
            if self.settings.stop.is_raised() {
                break;
            }
            self.counters.relaxation_steps += 1;
            if takes_anew {
                self.stiffness_of_bodies_into(&mut stiffness, in_the_mean);
            }
            self.accelerate(&mut velocity, &stiffness, pace);
            self.limit(&mut velocity, share_of_cap * self.most_motion());
            let factor = self.largest_factor(&velocity);
            step.iter_mut().zip(&velocity).for_each(|(s, v)| *s = factor * v);
            from.0.clone_from(&self.poses);
            from.1.clone_from(&self.away);
            if done % rebase_every == 0 {
                self.rebase();
            }
            before.clone_from(&self.residual);
            if self.try_step(&from, &step, 1.0).is_some() {
                if let Some(work) = &mut work {
                    before
                        .iter_mut()
                        .zip(&self.residual)
                        .for_each(|(force, after)| *force = 0.5 * (*force + after));
                    self.add_work(work, &before, &step);
                }
                shocks = 0;
                pace = (1.1 * pace).min(STEP);
            } else {
                self.go_to(from.0.clone(), from.1.clone());
                velocity.iter_mut().for_each(|v| *v *= SHOCK);
                pace *= SHOCK;
                shocks += 1;
                if shocks > MOST_SHOCKS {
                    break;
                }
            }
        }
        StepEnd::Reduced
    }

    /// Changes velocities [m a step] by the forces on bodies and by damping.
    fn accelerate(&self, velocity: &mut [f64], stiffness: &[[f64; 2]], pace: f64) {
        for (body, stiffness) in stiffness.iter().enumerate() {
            for (component, unknown) in self.dofs.of(body).iter().enumerate() {
                let Some(k) = unknown.map(|k| k as usize) else { continue };
                let force = self.residual[k];
                let against = if velocity[k] == 0.0 { 0.0 } else { velocity[k].signum() };
                let damped = force - DAMPING * force.abs() * against;
                let drag = if force == 0.0 { DRAG } else { 1.0 };
                velocity[k] = drag * velocity[k] + pace * pace * damped / stiffness[component / 3];
            }
        }
    }

    /// Keeps each body within what it may go at `most` [m]: what is light must not hold up the others.
    fn limit(&self, velocity: &mut [f64], most: f64) {
        for body in 0..self.dofs.carriers() {
            let reach = self.reach(velocity, body);
            if reach > most {
                for k in self.dofs.of(body).iter().flatten() {
                    velocity[*k as usize] *= most / reach;
                }
            }
        }
    }

    /// Adds the work of `forces` [N] on the unknowns over a step [m], without that of forces applied from outside [J].
    fn add_work(&self, work: &mut [Vector6<f64>], forces: &[f64], step: &[f64]) {
        let wrenches = self.dofs.wrenches(forces);
        for (carrier, (work, wrench)) in work.iter_mut().zip(wrenches).enumerate() {
            let (shift, turn) = self.dofs.motion(step, 1.0, carrier);
            let motion = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
            let applied = self.loads.applied.get(carrier).copied().unwrap_or_else(Vector6::zeros);
            *work += (wrench - applied).component_mul(&motion);
        }
    }

    /// Has friction act against the way from here on, as if this had been committed.
    pub(super) fn rebase(&mut self) {
        let follows = self.model.follows_by_steps();
        let fields = if follows { self.contacts.fields.clone() } else { self.committed.fields.clone() };
        self.lost = self.lost + self.contacts.rebase(self.model, &self.poses);
        self.committed = Cow::Owned(Committed { fields, ..Committed::new(self.poses.clone()) });
    }

    /// What contacts resist each body's translation and rotation with [N/m], and at least what one would. `exactly`: where a contact's weight changes with the
    /// way, so does its force, and more than its spring's.
    pub(super) fn stiffness_of_bodies_into(&self, stiffness: &mut Vec<[f64; 2]>, exactly: bool) {
        let own = |body: usize| {
            let body = &self.model.bodies[body];
            if body.stiffness.is_finite() && body.kind != BodyKind::Gone { 0.5 * body.stiffness } else { 0.0 }
        };
        stiffness.clear();
        stiffness.extend((0..self.dofs.carriers()).map(|i| [own(i); 2]));
        let law = &self.model.law;
        let of_point = &|pair: &PairWork, point: &ContactPoint| {
            let e = &point.evaluation;
            let PointState { hardening, radii, .. } = point.state;
            let spring = point.state.unloading_stiffness(e.patch);
            let harder = hardening * law.hardening_slope(point.geometric_overlap(), radii);
            let spring = e.weight * (spring + harder);
            let tangent =
                (exactly && e.weight < 1.0).then(|| self.contacts.tangent_of(self.model, pair, point));
            let bodies = [pair.a(), pair.b()];
            let held = [0, 1].map(|side: usize| {
                let body = bodies[side];
                let scale = self.model.bodies[body].rotation_scale;
                let arm = (e.point - self.poses[body].position).norm() / scale;
                let [along, about] = tangent.as_ref().map_or([0.0; 2], |tangent| {
                    let block = |row: usize, column: usize| {
                        let entries = tangent[row..row + 3].iter().flat_map(|row| &row[column..column + 3]);
                        entries.map(|k| k * k).sum::<f64>().sqrt()
                    };
                    [block(6 * side, 0), block(6 * side + 3, 6 - 3 * side) / (scale * scale)]
                });
                [along.max(spring), about.max(spring * arm * arm)]
            });
            (bodies, held)
        };
        let pairs = self.contacts.pairs.par_iter();
        let all: Vec<_> =
            pairs.flat_map_iter(|pair| pair.active().map(move |point| of_point(pair, point))).collect();
        for (body, held) in all.into_iter().flat_map(|(bodies, held)| bodies.into_iter().zip(held)) {
            (0..2).for_each(|k| stiffness[body][k] += held[k]);
        }
        stiffness.iter_mut().flatten().for_each(|k| *k = k.max(1e-3 * self.typical_stiffness));
        let plate_motion = PLATE_MOTION * self.model.smallest_rounding();
        for (body, k) in stiffness.iter_mut().enumerate().take(self.model.bodies.len()) {
            if !self.model.bodies[body].stiffness.is_finite() {
                let forces = self.dofs.of(body).iter().flatten().map(|i| self.residual[*i as usize]);
                let force = forces.map(|f| f * f).sum::<f64>().sqrt();
                k.iter_mut().for_each(|k| *k = k.max(STEP * STEP * force / plate_motion));
            }
        }
    }
}
