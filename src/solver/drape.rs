//! Lays a membrane against bodies that are held, under a pressure.
//!
//! A membrane that touches nothing yet is pushed by the same force wherever it is: no line search on forces
//! leads it anywhere. But with the bodies held everything is conservative. So this descends the potential energy
//! of sheet, contacts and pressure by Newton steps with a proximal term (Rockafellar 1976) that is raised
//! where a step does not lower the energy enough (Armijo 1966) and lowered where it does.

use crate::assembly::Contacts;
use crate::model::{Counters, Membrane};
use crate::solver::increment::Increment;
use crate::solver::newton::Newton;
use crate::tensor::Pose;

/// A node's force out of balance over its share of the pressure, once the membrane lies still.
const TOLERANCE: f64 = 1e-3;
const MOST_ITERATIONS: usize = 400;
/// Proximal weights over the contact stiffness: the first, and the range.
const FIRST_WEIGHT: f64 = 1e-2;
const WEIGHTS: [f64; 2] = [1e-6, 1e3];
/// Share of the decrease that the slope promises which a step must give.
const ENOUGH: f64 = 1e-3;

/// What draping came to; nothing is committed yet.
#[derive(Debug, Clone, PartialEq)]
pub struct Drape {
    pub poses: Vec<Pose>,
    pub converged: bool,
    /// Largest force out of balance on a node over its share of the pressure.
    pub out_of_balance: f64,
    /// The carrier with it.
    pub worst: usize,
    pub counters: Counters,
}

/// Drapes the membrane of the model under the pressure of the loads, which must hold every body.
/// `None` without a membrane, or where it is too close to a body from the start.
pub fn drape(increment: &Increment<'_>, contacts: &mut Contacts) -> Option<Drape> {
    let Increment { model, committed, loads, settings } = *increment;
    let membrane = model.membrane.as_ref()?;
    let lent = std::mem::take(contacts);
    let mut newton = match Newton::new(model, committed, loads, settings, lent, committed.poses.clone()) {
        Ok(newton) => newton,
        Err(back) => {
            *contacts = back.0;
            return None;
        }
    };
    let reference = membrane.node_load(loads.pressure);
    let mut weight = FIRST_WEIGHT;
    let mut energy = potential(&newton, membrane);
    let mut converged = false;
    for _ in 0..MOST_ITERATIONS {
        converged = newton.dofs.largest_force(&newton.residual).0 < TOLERANCE * reference;
        if converged || weight > WEIGHTS[1] || settings.stop.is_raised() {
            break;
        }
        newton.counters.newton_iterations += 1;
        let from = (newton.poses.clone(), vec![0.0; newton.dofs.count()]);
        let residual = newton.residual.clone();
        newton.weights = vec![weight];
        let Some(step) = newton.step(&residual) else {
            weight *= 10.0;
            continue;
        };
        let factor = newton.largest_factor(&step);
        let promised = factor * step.iter().zip(&residual).map(|(s, r)| s * r).sum::<f64>();
        let fine = promised > 0.0 && newton.try_step(&from, &step, factor).is_some();
        let now = if fine { potential(&newton, membrane) } else { f64::INFINITY };
        tracing::trace!(weight, factor, energy, gained = energy - now, promised, "step");
        if now <= energy - ENOUGH * promised {
            energy = now;
            // A step cut short by its neighbours is no sign that longer ones would do.
            if factor >= 1.0 {
                weight = (0.3 * weight).max(WEIGHTS[0]);
            }
        } else {
            newton.go_to(from.0, from.1);
            weight *= 5.0;
        }
    }
    let (force, worst) = newton.dofs.largest_force(&newton.residual);
    let drape = Drape {
        poses: newton.poses.clone(),
        converged,
        out_of_balance: force / reference,
        worst,
        counters: newton.counters,
    };
    *contacts = newton.contacts;
    Some(drape)
}

/// Energy of sheet and contacts, and the pressure's potential `p V` [J].
fn potential(newton: &Newton<'_>, membrane: &Membrane) -> f64 {
    let contacts = &newton.contacts.membrane;
    let volume = newton.model.cover.as_ref().map_or(0.0, |cover| cover.volume(&newton.poses));
    membrane.energy(&contacts.positions) + contacts.energy() + newton.loads.pressure * volume
}
