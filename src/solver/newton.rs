//! State of Newton's iterations in a step: configuration, contacts, forces out of balance, drag.
//!
//! Friction is implicit in the normal force, so the tangent is unsymmetric; it is exact.

use crate::assembly::{self, Contacts, Dofs, Kernel, Losses, PairWork, TooClose};
use crate::model::{Committed, Counters, Loads, Model};
use crate::solver::balance::{Balance, Yardsticks};
use crate::solver::control::Steering;
use crate::solver::settings::Settings;
use crate::solver::system::System;
use crate::tensor::Pose;
use rayon::prelude::*;
use std::borrow::Cow;
use std::time::Instant;

/// The state of a solve and its buffers.
pub struct Newton<'a> {
    pub model: &'a Model,
    /// What the increment began from, or the state in which a dynamic relaxation last re-based friction.
    pub committed: Cow<'a, Committed>,
    /// With the control's load factor as it is at `poses`.
    pub loads: Loads,
    /// The loads' control; its unknown and residual come last in `away` and `residual`.
    pub steering: Option<Steering>,
    pub settings: &'a Settings,
    pub dofs: Dofs,
    pub contacts: Contacts,
    pub poses: Vec<Pose>,
    /// Forces out of balance at `poses` [N].
    pub residual: Vec<f64>,

    /// How far `poses` are from where the step began, in unknowns [m].
    pub away: Vec<f64>,
    pub counters: Counters,
    /// What contacts lost in the present step before friction was re-based last.
    pub(super) lost: Losses,
    pub(super) typical_stiffness: f64,
    /// Largest force out of balance on a body at rest, over the mean contact force.
    pub(super) tolerance: f64,
    pub(super) system: Option<System>,
    /// The bodies that are solved for while all others rest; `None` where all are.
    pub(super) few: Option<Vec<bool>>,
    /// Generation of contact forces that could not be iterated: all unknowns are factorised together for these.
    pub(super) together_for: Option<u64>,
    pub(super) values: Vec<f64>,
    /// Drag on every block of unknowns over its holding stiffness; those behind the list have the last.
    pub(super) weights: Vec<f64>,
}

/// The weight of a block of unknowns.
pub(super) fn weight_of(weights: &[f64], block: usize) -> f64 {
    weights.get(block).or(weights.last()).copied().unwrap_or(0.0)
}

impl<'a> Newton<'a> {
    /// Evaluates the model at `poses`; the contacts come back if bodies are too close there.
    pub fn new(
        model: &'a Model,
        committed: &'a Committed,
        loads: &Loads,
        settings: &'a Settings,
        mut contacts: Contacts,
        poses: Vec<Pose>,
    ) -> Result<Self, Box<(Contacts, TooClose)>> {
        let dofs = Dofs::new(model, loads);
        contacts.start(model, committed);
        if let Err(too_close) = contacts.evaluate(model, committed, &poses) {
            return Err(Box::new((contacts, too_close)));
        }
        let typical_stiffness = model.typical_stiffness();
        let mut loads = loads.clone();
        let steering = loads
            .control
            .as_ref()
            .map(|control| Steering::new(control, model, &dofs, &loads, &poses, typical_stiffness));
        if let Some(steering) = &steering {
            steering.apply(&mut loads);
        }
        let mut newton = Newton {
            model,
            committed: Cow::Borrowed(committed),
            loads,
            away: vec![0.0; dofs.count() + usize::from(steering.is_some())],
            steering,
            settings,
            dofs,
            contacts,
            poses,
            residual: Vec::new(),
            counters: Counters::default(),
            lost: Losses::default(),
            typical_stiffness,
            tolerance: settings.force_tolerance,
            system: None,
            few: None,
            together_for: None,
            values: Vec::new(),
            weights: vec![0.0],
        };
        newton.update_residual();
        Ok(newton)
    }

    /// Makes the forces of contacts on condensed bodies unknowns, or leaves those that are; for the places of contacts found last.
    pub(super) fn gather(&mut self) {
        if !self.model.has_elastic() {
            return;
        }
        if self.contacts.gather(self.model, &self.loads, &self.poses) {
            self.dofs.renew_contacts(self.contacts.unknown_forces.owners());
            self.away.clear();
            self.away.resize(self.dofs.count() + usize::from(self.steering.is_some()), 0.0);
        }
        self.evaluate();
    }

    pub(super) fn update_residual(&mut self) {
        let start = Instant::now();
        assembly::residual_into(
            &mut self.residual,
            self.model,
            &self.dofs,
            &self.contacts,
            &self.loads,
            &self.poses,
        );
        if let Some(steering) = &self.steering {
            self.residual.push(steering.residual(self.model, &self.poses));
        }
        self.contacts.timings.book(Kernel::Residual, start);
    }

    /// What forces are judged by in the present configuration.
    pub(super) fn yardsticks(&self) -> Yardsticks {
        Yardsticks::new(self.model, &self.dofs, &self.contacts, &self.loads, &self.poses)
    }

    /// How well the forces of the present configuration balance.
    pub fn balance(&self) -> Balance {
        let yardsticks = self.yardsticks();
        let (out_of_balance, worst_body) = yardsticks.worst_of(&self.residual, &self.dofs, &self.contacts);
        Balance {
            out_of_balance,
            worst_body,
            reference_force: yardsticks.mean,
            unrest: self.mean_imbalance() / yardsticks.mean,
            least_force: yardsticks.least(),
        }
    }

    /// Mean over the free carriers of the force out of balance [N].
    pub(super) fn mean_imbalance(&self) -> f64 {
        self.mean_force(&self.residual)
    }

    /// Mean over the free carriers of these forces [N].
    pub(super) fn mean_force(&self, forces: &[f64]) -> f64 {
        let free = (0..self.dofs.carriers()).filter(|carrier| self.dofs.is_free(*carrier));
        let (sum, count) = free
            .fold((0.0, 0), |(sum, count), carrier| (sum + self.dofs.force_on(forces, carrier), count + 1));
        sum / f64::from(count.max(1))
    }

    /// Whether the loads' control has reached its target.
    pub fn control_is_met(&self) -> bool {
        self.steering.as_ref().is_none_or(|steering| steering.is_met(self.model, &self.poses))
    }

    pub(super) fn evaluate(&mut self) -> bool {
        let fine = match &self.few {
            None => self.contacts.evaluate(self.model, &self.committed, &self.poses).is_ok(),
            Some(few) => {
                let (contacts, model, committed) = (&mut self.contacts, self.model, &self.committed);
                let is_new = contacts.look_around(model, committed, &self.poses);
                contacts.place(model, committed, &self.poses, |body| few[body]);
                let counts = |_, pair: &PairWork| is_new || pair.is_of(few);
                contacts.evaluate_pairs(model, committed, &self.poses, counts).is_ok()
            }
        };
        if fine {
            self.update_residual();
        }
        fine
    }

    /// What contacts lost in the present step.
    pub fn losses(&self) -> Losses {
        self.lost + self.contacts.losses(self.model)
    }

    /// The residual with the drag.
    pub(super) fn held_residual(&self) -> Vec<f64> {
        let mut held = self.residual.clone();
        // Nothing holds the load factor, the last entry with a control, back.
        for carrier in 0..self.dofs.carriers() {
            let drag = weight_of(&self.weights, carrier)
                * self.model.holding_stiffness(carrier, self.typical_stiffness);
            for &unknown in self.dofs.of(carrier).iter().flatten() {
                held[unknown as usize] -= drag * self.away[unknown as usize];
            }
        }
        held
    }

    /// How far `step` moves a point of a carrier at most [m].
    pub(super) fn reach(&self, step: &[f64], carrier: usize) -> f64 {
        let (translation, rotation) = self.dofs.motion(step, 1.0, carrier);
        let radius = self.model.shapes.get(carrier).map_or(0.0, |shape| shape.bounding_radius);
        translation.norm() + rotation.norm() * radius
    }

    /// The largest share of `step` that moves no body further than the cap, nor any pair further
    /// than half its cores' distance (so that nothing can pass through).
    pub(super) fn largest_factor(&self, step: &[f64]) -> f64 {
        let reach: Vec<f64> = (0..self.dofs.carriers()).map(|carrier| self.reach(step, carrier)).collect();
        let walls = usize::from(self.model.wall.is_some());
        let bodies = reach[..self.model.bodies.len() + walls].iter();
        let most = self.most_motion();
        let mut factor = bodies.fold(1.0, |f: f64, m| f.min(most / m));
        if let Some(membrane) = &self.model.membrane {
            factor = factor.min(self.contacts.membrane.largest_factor(membrane, &reach));
        }
        let of_pair = |pair: &PairWork| {
            let both = (reach[pair.a()] + reach[pair.b()]).max(f64::MIN_POSITIVE);
            let share = |room: f64| 0.5 * room / both;
            // Bodies no feature of which is listed are their roundings apart at least, and mostly no more has to be known.
            let is_apart = pair.nearest.is_infinite() && share(pair.roundings(self.model)) >= factor;
            if is_apart { factor } else { share(pair.nearest) }
        };
        self.contacts.pairs.par_iter().map(of_pair).reduce(|| factor, f64::min)
    }

    /// How far a body may go in one iteration [m].
    pub(super) fn most_motion(&self) -> f64 {
        self.settings.motion_cap * self.model.smallest_rounding()
    }

    /// Makes the present configuration the one that motion counts from.
    pub(super) fn recentre(&mut self) {
        self.away.iter_mut().for_each(|d| *d = 0.0);
        self.steering.iter_mut().for_each(Steering::recentre);
        self.contacts.unknown_forces.recentre();
    }

    pub(super) fn go_to(&mut self, poses: Vec<Pose>, away: Vec<f64>) {
        self.poses = poses;
        self.away = away;
        self.steer();
        self.evaluate();
    }

    /// Sets the loads to those of the control's unknown in `away`, and contacts' forces to theirs.
    fn steer(&mut self) {
        self.contacts.unknown_forces.move_by(&self.dofs, &self.away);
        if let (Some(steering), Some(away)) = (&mut self.steering, self.away.last()) {
            steering.move_to(*away, &mut self.loads);
        }
        self.contacts.yield_to_forces(self.loads.pressure);
    }

    /// Moves to `from + factor * step` and evaluates; `None` if bodies are too close there.
    pub(super) fn try_step(
        &mut self,
        from: &(Vec<Pose>, Vec<f64>),
        step: &[f64],
        factor: f64,
    ) -> Option<Vec<f64>> {
        self.dofs.move_into(&mut self.poses, &from.0, step, factor);
        for (d, (old, s)) in self.away.iter_mut().zip(from.1.iter().zip(step)) {
            *d = old + factor * s;
        }
        self.steer();
        if !self.evaluate() {
            return None;
        }
        let held = self.held_residual();
        held.iter().all(|x| x.is_finite()).then_some(held)
    }
}
