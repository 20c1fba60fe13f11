//! Augmentations: proximal Newton solves, re-centred and relaxed until the forces balance.

use crate::assembly::elastic::Relaxed;
use crate::solver::balance::Balance;
use crate::solver::damage::DamageWatch;
use crate::solver::newton::{Newton, NewtonEnd};
use crate::solver::proximal::ProximalWeight;
use crate::tensor::{self, Vector6};

/// What the search for an equilibrium came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    pub converged: bool,
    pub balance: Balance,
    /// Out-of-balance of each augmentation.
    pub history: Vec<f64>,
    pub augmentations: usize,
    /// Energy in elastic bodies [J].
    pub surface_energy: f64,
    /// Work on each component of each carrier along a stabilised increment [J].
    pub work: Vec<Vector6<f64>>,
    /// Why a body that damage has softened could not be solved for, if so.
    pub broke: Option<String>,
}

impl Equilibrium {
    /// Nothing has been done yet.
    pub(super) fn begun(balance: Balance) -> Self {
        Equilibrium {
            converged: false,
            balance,
            history: vec![balance.out_of_balance],
            augmentations: 0,
            surface_energy: 0.0,
            work: Vec::new(),
            broke: None,
        }
    }
}

/// A gap of elastic bodies may miss by this share of what a rigid body yields to the mean contact
/// force, where that is less than the gap tolerance.
const GAP_SHARE: f64 = 1e-2;

/// What bodies that deform are off by, once their displacements follow the forces of a configuration.
pub(super) struct Following {
    /// The largest miss of a gap over its tolerance.
    pub gap: f64,
    /// The largest force out of balance on a node that is eliminated, over the force tolerance.
    pub node: f64,
    /// Elastic energy of these bodies [J].
    pub energy: f64,
}

/// A dwell begins with contacts that all loads together press by this share of what they may yield; they then harden by a factor at a
/// time, and need not balance better than this before.
const SOFT_OVERLAP: f64 = 0.05;
const HARDENING: f64 = 30.0;
const SOFT_TOLERANCE: f64 = 1e-2;
/// An augmentation that stopped because bodies went as far as they may, in a dwell, over one that did not.
const ON_THE_WAY: f64 = 0.1;

/// The bounds of dynamic relaxations where the largest proximal weight gets nowhere.
const LATE_RELAXATIONS: [f64; 2] = [5e-3, 1e-3];
/// Dynamic relaxations in the search for one equilibrium; each waits twice as long as the one before.
const MOST_RELAXATIONS: u32 = 6;

impl Newton<'_> {
    /// Brings the model into balance from its present configuration.
    pub fn equilibrate(&mut self) -> Equilibrium {
        if let Some(stabilisation) = self.settings.stabilisation {
            return self.march(stabilisation);
        }
        let mut history = Vec::new();
        if self.settings.dwells && !self.model.has_elastic() {
            history = self.soften();
        }
        let mut found = self.balance_to(self.settings.force_tolerance);
        let augmentations = history.len() + found.augmentations;
        history.append(&mut found.history);
        Equilibrium { history, augmentations, ..found }
    }

    /// Brings the model nearly into balance with soft contacts, harder and harder; what was out of balance on the way.
    fn soften(&mut self) -> Vec<f64> {
        let free = || (0..self.model.bodies.len()).filter(|&body| self.dofs.is_free(body));
        let gravity = self.loads.gravity.norm();
        let dead = |body: usize| {
            self.model.bodies[body].mass * gravity + self.loads.applied[body].fixed_rows::<3>(0).norm()
        };
        let pressing = self.contacts.active().map(|(_, point)| point.evaluation.pressure).sum();
        let loads = free().map(dead).sum::<f64>().max(pressing);
        let yielding = || self.model.shapes.iter().map(|shape| shape.yielding());
        let stiffest =
            self.model.bodies.iter().map(|b| b.stiffness).filter(|k| k.is_finite()).fold(0.0, f64::max);
        let hardest = 2.0 * stiffest * yielding().fold(0.0, f64::max);
        let median = tensor::median(yielding()).unwrap_or(0.0);
        let (typical, mut history) = (self.typical_stiffness, Vec::new());
        let mut strength = loads / SOFT_OVERLAP;
        while strength > 0.0 && strength < hardest && !self.settings.stop.is_raised() {
            self.contacts.strength = strength;
            self.typical_stiffness = typical.min(0.5 * strength / median);
            self.evaluate();
            let found = self.balance_to(SOFT_TOLERANCE.max(self.settings.force_tolerance));
            tracing::debug!(
                strength,
                converged = found.converged,
                augmentations = found.history.len(),
                "soft contacts"
            );
            history.extend(found.history);
            if !found.converged {
                break;
            }
            strength *= HARDENING;
        }
        self.contacts.strength = f64::INFINITY;
        self.typical_stiffness = typical;
        self.evaluate();
        history
    }

    /// Elastic energy of what deforms in the configuration last evaluated, in balance or not [J].
    fn surface_energy(&self) -> f64 {
        self.contacts.elastic_energy(self.model, &self.loads, &self.poses)
    }

    /// Has the displacements of bodies follow the forces of the present configuration.
    pub(super) fn follow(&mut self, balance: &Balance, damage: &DamageWatch, tolerance: f64) -> Following {
        let yielding = balance.least_force / self.typical_stiffness;
        let usual = self.settings.gap_tolerance * self.model.typical_size();
        let gap_tolerance = usual.min((GAP_SHARE * yielding).max(damage.gap_floor()));
        let Relaxed { mismatch, left, energy } =
            self.contacts.relax(self.model, &self.loads, &self.poses, gap_tolerance);
        tracing::trace!(out_of_balance = balance.out_of_balance, mismatch, gap_tolerance, "elastic");
        Following { gap: mismatch / gap_tolerance, node: left / balance.least_force / tolerance, energy }
    }

    fn balance_to(&mut self, tolerance: f64) -> Equilibrium {
        let settings = self.settings;
        let elastic = self.model.has_elastic();
        let mut proximal = ProximalWeight::new(settings);
        let mut on_the_way = 0;
        let mut history = Vec::new();
        // Whether forces are worth taking over: a solve has brought them towards balance.
        let mut fresh = false;
        let mut damage = DamageWatch::new(self.model, settings);
        self.gather();
        let mut relaxations = 0;
        // Whether the largest proximal weight got nowhere.
        let mut exhausted = false;
        let mut next_relaxation = settings.relaxes_after.filter(|_| self.can_relax());
        let ended = |converged, balance, history: Vec<f64>, surface_energy| Equilibrium {
            converged,
            balance,
            augmentations: history.len(),
            history,
            surface_energy,
            work: Vec::new(),
            broke: None,
        };
        loop {
            let balance = self.balance();
            history.push(balance.out_of_balance);
            let mut converged = balance.out_of_balance < tolerance && self.control_is_met();
            let mut surface_energy = 0.0;
            if (elastic || damage.follows()) && (converged || fresh) {
                let mut off = balance.out_of_balance / tolerance;
                if elastic {
                    let Following { gap, node, energy } = self.follow(&balance, &damage, tolerance);
                    surface_energy = energy;
                    converged &= gap < 1.0 && node < 1.0;
                    off = off.max(gap).max(node);
                } else if converged || damage.is_due(off, settings) {
                    self.contacts.note_loads(self.model, &self.loads, &self.poses);
                }
                fresh = false;
                match damage.step(&mut self.contacts, self.model, settings, off) {
                    Ok(settled) => converged &= settled,
                    Err(problem) => {
                        let broke = Some(problem.to_string());
                        return Equilibrium { broke, ..ended(false, balance, history, surface_energy) };
                    }
                }
                if !converged {
                    self.evaluate();
                    self.gather();
                }
            }
            let whole = history.len();
            let spared = damage.moves() + ((1.0 - ON_THE_WAY) * f64::from(on_the_way)) as usize;
            let tired = whole.saturating_sub(spared) > settings.max_augmentations;
            if converged {
                return ended(true, balance, history, surface_energy);
            }
            if tired || settings.stop.is_raised() {
                return ended(false, balance, history, self.surface_energy());
            }
            let balance = self.balance();
            self.counters.augmentations += 1;
            let limits = if exhausted { LATE_RELAXATIONS } else { settings.relaxation_bounds };
            let due = next_relaxation.is_some_and(|next| whole > next);
            if exhausted || due && balance.out_of_balance > limits[0] {
                exhausted = false;
                relaxations += 1;
                let next = |after: usize| whole + (after.max(1) << relaxations);
                next_relaxation = settings.relaxes_after.filter(|_| relaxations < MOST_RELAXATIONS).map(next);
                let (from, steps) = (balance.out_of_balance, self.counters.relaxation_steps);
                let end = self.relax_dynamically(limits[1], settings.relaxation_steps);
                let (steps, to) = (self.counters.relaxation_steps - steps, self.balance().out_of_balance);
                tracing::debug!(from, to, steps, ?end, "fall");
                (proximal, fresh) = (ProximalWeight::new(settings), false);
                continue;
            }
            let target = balance.target(settings, tolerance);
            let end = self.solve(proximal.weight, target, |n| {
                n.balance().out_of_balance < tolerance && n.control_is_met()
            });
            tracing::trace!(
                out_of_balance = balance.out_of_balance,
                weight = proximal.weight,
                ?end,
                factorisations = self.counters.factorisations,
                body = balance.worst_body,
                moved = self.reach(&self.away, balance.worst_body),
                "augmentation"
            );
            let drives = !self.can_relax() && self.balance().out_of_balance > balance.out_of_balance;
            if !proximal.after(end, drives, settings) {
                if next_relaxation.is_none() || !settings.relaxes_when_stuck {
                    return ended(false, balance, history, self.surface_energy());
                }
                exhausted = true;
            }
            if end == NewtonEnd::Stalled {
                continue;
            }
            fresh = true;
            on_the_way += u32::from(settings.dwells && self.was_capped);
        }
    }
}
