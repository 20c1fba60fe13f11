//! Brings the grains of a generated specimen into touch, before the test and its history begin.
//!
//! A compacted specimen hangs together loosely: grains fall into place as soon as anything presses
//! on them. That is no part of the test, so friction does not weaken by it: the peak value holds
//! while grains are seated, and slip counts from the end of the seating on.

use crate::contact::law::Friction;
use crate::solver::StepStatus;
use crate::triaxial::{Rig, Test};

/// Each goes on from where the one before gave up.
const MOST_ATTEMPTS: usize = 8;
/// Forces further out of balance than this, over the mean contact force, are no specimen: its grains have
/// flown apart.
const APART: f64 = 100.0;

/// What the seating came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Seating {
    /// Out-of-balance force over the mean contact force. The first increment goes on from here and
    /// has to meet the tolerance itself.
    pub out_of_balance: f64,
    pub factorisations: usize,
    /// Steps of dynamic relaxations, each an evaluation of the contacts.
    pub relaxation_steps: usize,
    /// Which grains overlap, if any do more than contacts know of.
    pub overlap: Option<String>,
}

impl Seating {
    /// Why no test can begin from it, if so.
    pub fn fault(&self) -> Option<String> {
        if let Some(overlap) = &self.overlap {
            return Some(format!(
                "the grains could not be seated: {overlap}; another seed packs them otherwise"
            ));
        }
        // Not a number either.
        let holds_together = self.out_of_balance < APART;
        (!holds_together).then(|| {
            format!(
                "the grains could not be seated: forces are out of balance by {:.0e} of the mean contact force after {} steps of falling; \
                 a specimen with so little friction, or so few grains, comes apart before anything holds it",
                self.out_of_balance, self.relaxation_steps
            )
        })
    }
}

/// Seats the grains under a share of the consolidation pressure [Pa]; gives up early where `stop` says so.
/// Grains that deform fall into place as rigid bodies first, which is most of the work of it and costs a
/// fraction so; and a specimen is then the same packing at every fidelity.
pub fn seat(test: &mut Test, rig: &mut Rig, pressure: f64, stop: &dyn Fn() -> bool) -> Seating {
    let friction = rig.model.friction;
    rig.model.friction = Friction::constant(friction.peak);
    let mut seating =
        Seating { out_of_balance: f64::INFINITY, factorisations: 0, relaxation_steps: 0, overlap: None };
    if let Some(elasticity) = rig.stiffen() {
        attempts(&mut seating, test, rig, pressure, stop);
        rig.soften(elasticity);
    }
    if !stop() {
        attempts(&mut seating, test, rig, pressure, stop);
    }
    if !stop() && rig.condense_seated() > 0 {
        attempts(&mut seating, test, rig, pressure, stop);
    }
    rig.model.friction = friction;
    seating
}

fn attempts(seating: &mut Seating, test: &mut Test, rig: &mut Rig, pressure: f64, stop: &dyn Fn() -> bool) {
    for _ in 0..MOST_ATTEMPTS {
        let report = test.seat(rig, pressure);
        seating.out_of_balance = report.balance.out_of_balance;
        seating.factorisations += report.counters.factorisations;
        seating.relaxation_steps += report.counters.relaxation_steps;
        seating.overlap = match &report.status {
            StepStatus::Overlapping { problem } => Some(problem.clone()),
            _ => None,
        };
        if report.converged() || stop() {
            break;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_grains_that_flew_apart_are_no_specimen() {
        let seating = |out_of_balance| Seating {
            out_of_balance,
            factorisations: 1,
            relaxation_steps: 240_000,
            overlap: None,
        };
        // One that gave up short of its tolerance may still be consolidated; low friction as met; nothing
        // known.
        assert!(seating(0.5).fault().is_none());
        assert!(seating(6.2e12).fault().is_some_and(|reason| reason.contains("6e12")));
        assert!(seating(f64::NAN).fault().is_some() && seating(f64::INFINITY).fault().is_some());
        let overlapping = Seating { overlap: Some("a and b overlap".into()), ..seating(1e-4) };
        assert!(overlapping.fault().is_some_and(|reason| reason.contains("a and b overlap")));
    }
}
