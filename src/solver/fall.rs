//! Falls: damped motion towards balance, for collapses that proximal augmentations follow too slowly.
//!
//! A body that lost its support has centimetres to go, and stiff contacts let a Newton step go tens of micrometres. So bodies move as
//! if they had masses, explicitly: a step costs an evaluation of the contacts and no factorisation. Masses are those for which all contacts
//! swing at one pace (the stiffness on a body times the square of the step); only the way through the collapse depends on them, not
//! the balance at its end, which the augmentations after it have to find. Each component of the force is reduced by a share
//! of itself where it drives the motion and raised by it where it brakes (Cundall 1987, "Distinct element models of rock and soil structure": local
//! damping), so that bodies come to rest each by itself, whatever others still do.
//!
//! Where only a balance is looked for, that share is 0.7 and masses follow the contacts. Where grains have broken, what a collapse sets free
//! matters: then bodies have inertia (masses that never shrink, a share of 0.1, friction against the way of each step), and most of it goes to
//! friction, as in a real specimen, whose grains come to rest by rubbing. No more than it has set free: see [`Purse`]. Still an approximation: the
//! masses are not the rock's.

use crate::assembly::contact_forces_into;
use crate::model::{BodyKind, Committed};
use crate::solver::newton::Newton;
use crate::solver::settings::Falling;
use crate::tensor::Pose;
use std::borrow::Cow;

/// Step of the motion over that of a mass on a spring of its own stiffness, `sqrt(m / k)`. A contact moves by four terms (two bodies, each
/// with its rotation), so the network is stiffer than that by up to 4, and explicit steps are stable below 2 over the root of it, 1.
const STEP: f64 = 0.7;
/// Share of a force that local damping takes, and the largest motion of a body in a step over what Newton's iterations may do at once.
const DAMPED: (f64, f64) = (0.7, 0.3);
/// The same where bodies have inertia.
const INERT: (f64, f64) = (0.1, 1.0);
/// Contacts that a body with inertia is as heavy as at least: what touches nothing yet would else meet the first grain without a blow.
const LEAST_CONTACTS: f64 = 6.0;
/// What drag leaves of a velocity in a step where no force acts; what nothing touches and nothing presses comes to rest by it.
const DRAG: f64 = 0.98;
/// A plate, which has no stiffness of its own, is heavy enough to be moved by this share of the smallest rounding in a step from rest. What presses
/// it would else drive it into the first grains that it meets.
const PLATE_MOTION: f64 = 0.02;
/// What is left of velocities and of the step where bodies would have come too close.
const SHOCK: f64 = 0.25;
/// Shocks in a row before the fall is given up.
const MOST_SHOCKS: usize = 20;
/// Steps between two lines of the log.
const TOLD_EVERY: usize = 50;

/// How a fall ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FallEnd {
    /// Bodies are nearly in balance.
    Landed,
    /// One that touches others has gone as far as friction may be told from where it was: commit, and go on from there.
    Far,
    /// They still move, or swing.
    Moving,
}

impl Newton<'_> {
    /// Whether bodies can fall: all unknowns are the motion of rigid ones.
    pub(super) fn can_fall(&self) -> bool {
        let model = self.model;
        self.steering.is_none() && !model.has_elastic() && model.membrane.is_none() && model.wall.is_none()
    }

    /// Lets bodies move from where they are, until the worst is out of balance by less than the second of the bounds or all steps are done.
    pub(super) fn fall(&mut self, falling: &Falling) -> FallEnd {
        let enough = falling.bounds[1];
        let count = self.dofs.count();
        let mut velocity: Vec<f64> = vec![0.0; count];
        let mut step = vec![0.0; count];
        let mut stiffness = Vec::new();
        let (damping, share_of_cap) = if falling.inertia { INERT } else { DAMPED };
        let least = |body| [LEAST_CONTACTS * self.own_stiffness(body); 2];
        let mut masses: Vec<_> = (0..self.dofs.carriers()).map(least).collect();
        let lengths = self.settings.travel.lengths(self.model);
        let centre = self.poses.clone();
        let mut pace = STEP;
        let mut shocks = 0;
        let mut purse = falling.inertia.then(|| Purse::new(self));
        let mut before = Vec::new();
        self.away.iter_mut().for_each(|d| *d = 0.0);
        let mut from = (self.poses.clone(), self.away.clone());
        for done in 0..falling.most_steps {
            let out_of_balance = self.balance().out_of_balance;
            if done % TOLD_EVERY == 0 {
                tracing::trace!(done, out_of_balance, pace, "falling");
            }
            if out_of_balance < enough {
                return FallEnd::Landed;
            }
            if self.settings.stop.is_raised() {
                break;
            }
            if self.has_gone_far(&centre, falling.travel) {
                return FallEnd::Far;
            }
            self.counters.falling_steps += 1;
            self.stiffness_of_bodies_into(&mut stiffness);
            if falling.inertia {
                self.grow_masses(&mut masses, &stiffness, &mut velocity);
            } else {
                masses.clone_from(&stiffness);
            }
            before.clone_from(&velocity);
            for body in 0..self.dofs.carriers() {
                for (component, unknown) in self.dofs.of(body).iter().enumerate() {
                    let Some(k) = unknown.map(|k| k as usize) else { continue };
                    let force = self.residual[k];
                    let against = if velocity[k] == 0.0 { 0.0 } else { velocity[k].signum() };
                    let damped = force - damping * force.abs() * against;
                    // Velocities in lengths a step.
                    let drag = if force == 0.0 { DRAG } else { 1.0 };
                    velocity[k] = drag * velocity[k] + pace * pace * damped / masses[body][component / 3];
                }
            }
            if let Some(purse) = &mut purse {
                purse.spend_on_damping(damping, &self.residual, &before, &velocity);
                let moving = self.kinetic_energy(&masses, pace, &before, &velocity);
                if moving > purse.left {
                    let share = (purse.left / moving).max(0.0);
                    velocity.iter_mut().for_each(|v| *v *= share);
                }
            }
            // Each body within its own cap; what is light must not hold up the others.
            for body in 0..self.dofs.carriers() {
                let reach = self.reach(&velocity, body);
                let most = share_of_cap * self.settings.motion_cap * lengths[body];
                if reach > most {
                    for k in self.dofs.of(body).iter().flatten() {
                        velocity[*k as usize] *= most / reach;
                    }
                }
            }
            let factor = self.largest_factor(&velocity);
            step.iter_mut().zip(&velocity).for_each(|(s, v)| *s = factor * v);
            from.0.clone_from(&self.poses);
            from.1.clone_from(&self.away);
            if done % falling.rebase.max(1) == 0 {
                self.rebase();
            }
            if self.try_step(&from, &step, 1.0, 0.0).is_some() {
                shocks = 0;
                if let Some(purse) = &mut purse {
                    purse.book(self, &step);
                }
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
        FallEnd::Moving
    }

    /// Has `masses` [N/m: over the square of a step] grow to the `stiffness` of bodies where that is more, at the same momentum. Of masses
    /// that came and went with contacts bodies would gain energy at every touch.
    fn grow_masses(&self, masses: &mut [[f64; 2]], stiffness: &[[f64; 2]], velocity: &mut [f64]) {
        for (body, (mass, stiffness)) in masses.iter_mut().zip(stiffness).enumerate() {
            for (component, unknown) in self.dofs.of(body).iter().enumerate() {
                let (mass, stiffness) = (mass[component / 3], stiffness[component / 3]);
                if let Some(k) = unknown.filter(|_| stiffness > mass) {
                    velocity[k as usize] *= mass / stiffness;
                }
            }
            *mass = std::array::from_fn(|k| mass[k].max(stiffness[k]));
        }
    }

    /// What one contact of a body resists it with [N/m]; zero for what is rigid or gone.
    fn own_stiffness(&self, body: usize) -> f64 {
        let body = &self.model.bodies[body];
        if body.stiffness.is_finite() && body.kind != BodyKind::Gone { 0.5 * body.stiffness } else { 0.0 }
    }

    /// Kinetic energy between two steps, before and after which the bodies move by `before` and `after` [J]: the product of the two, not the
    /// square of either, is what such steps conserve on linear springs.
    fn kinetic_energy(&self, masses: &[[f64; 2]], pace: f64, before: &[f64], after: &[f64]) -> f64 {
        let unknowns = |body: usize| self.dofs.of(body).iter().enumerate();
        let of = |(body, mass): (usize, &[f64; 2])| {
            let of = |(component, unknown): (usize, &Option<u32>)| {
                unknown.map_or(0.0, |k| mass[component / 3] * before[k as usize] * after[k as usize])
            };
            unknowns(body).map(of).sum::<f64>()
        };
        0.5 * masses.iter().enumerate().map(of).sum::<f64>() / (pace * pace)
    }

    /// Has friction act against the way from here on, as if this had been committed.
    fn rebase(&mut self) {
        self.dissipated = self.step_dissipation();
        let fields = self.committed.fields.clone();
        let mut here = Committed { fields, ..Committed::new(self.poses.clone()) };
        self.contacts.rebase(self.model, &mut here);
        self.committed = Cow::Owned(here);
    }

    fn has_gone_far(&self, from: &[Pose], travel: f64) -> bool {
        let most = travel * self.model.smallest_rounding();
        let gone = |i: usize| (self.poses[i].position - from[i].position).norm() > most;
        most.is_finite() && self.contacts.active().any(|(pair, _)| gone(pair.a()) || gone(pair.b()))
    }

    /// What contacts resist each body's translation and rotation with [N/m], and at least what one would.
    fn stiffness_of_bodies_into(&self, stiffness: &mut Vec<[f64; 2]>) {
        stiffness.clear();
        stiffness.extend((0..self.dofs.carriers()).map(|i| [self.own_stiffness(i); 2]));
        let law = &self.model.law;
        for (pair, point) in self.contacts.active() {
            let e = &point.evaluation;
            let spring = point.state.spring
                * e.weight
                * if point.state.hardens { law.steepness(-e.gap, point.state.radii) } else { 1.0 };
            for body in [pair.a(), pair.b()] {
                let arm =
                    (e.point - self.poses[body].position).norm() / self.model.bodies[body].rotation_scale;
                stiffness[body][0] += spring;
                stiffness[body][1] += spring * arm * arm;
            }
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

/// What a collapse has set free and not yet spent on friction and damping [J]. Bodies never have more kinetic energy than this: explicit steps on
/// contacts that stiffen, slide and turn over can else feed on themselves, and book friction that nothing paid for.
struct Purse {
    left: f64,
    elastic: f64,
    dissipated: f64,
    /// Forces on the unknowns but for those of contacts [N].
    external: Vec<f64>,
}

impl Purse {
    fn new(newton: &Newton<'_>) -> Self {
        let [elastic, dissipated] = [newton.contacts.contact_energy(), newton.step_dissipation()];
        Purse { left: 0.0, elastic, dissipated, external: external(newton) }
    }

    /// After a `step` of all unknowns.
    fn book(&mut self, newton: &Newton<'_>, step: &[f64]) {
        let now = Purse::new(newton);
        let forces = self.external.iter().zip(&now.external);
        let work: f64 = forces.zip(step).map(|((old, new), step)| 0.5 * (old + new) * step).sum();
        let left = self.left + work - (now.elastic - self.elastic) - (now.dissipated - self.dissipated);
        *self = Purse { left, ..now };
    }

    /// Takes what local damping takes between two steps of bodies that move by `before` and `after` in them.
    fn spend_on_damping(&mut self, share: f64, forces: &[f64], before: &[f64], after: &[f64]) {
        let ways = before.iter().zip(after);
        let lost = ways.zip(forces).map(|((before, after), force)| {
            let against = if *before == 0.0 { 0.0 } else { before.signum() };
            share * force.abs() * against * 0.5 * (before + after)
        });
        self.left -= lost.sum::<f64>();
    }
}

fn external(newton: &Newton<'_>) -> Vec<f64> {
    let mut contacts = vec![0.0; newton.residual.len()];
    contact_forces_into(&mut contacts, &newton.dofs, &newton.contacts);
    newton.residual.iter().zip(&contacts).map(|(all, contacts)| all - contacts).collect()
}
