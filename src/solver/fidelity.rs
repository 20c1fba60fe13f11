//! Which bodies deform: chosen from what each would omit as a rigid body, and from how near it is to damage.
//!
//! **Estimated error.** What the bodies that rest omit (`assembly::fidelity`) acts on the contact network as
//! displacements put between its bodies. One factorisation of the tangent of the accepted state tells how the
//! forces between bodies answer, to first order; the change over the forces, root of summed squares over the
//! pairs, is the estimate. It is exact for a linear network, a first-order one for contacts that slip or come
//! and go. Bodies with the largest share of the change, computed as if all rested, are condensed until the
//! estimate for those left keeps within the accuracy (marking after Doerfler 1996).
//!
//! **Damage.** The strains of a body that rests are exact under the forces that act on it. It is condensed from half its damage threshold
//! on, and always once damaged.
//!
//! A change of fidelity leaves forces as they are, so what was omitted before stays in them, and what would
//! be omitted from then on is made up for: both are kept with the contacts and counted in the estimate. Hence
//! an increment whose outcome shows the error beyond the accuracy, or a resting body beyond its damage
//! threshold, is to be repeated with these bodies condensed from its start. Both limits have a lower one for
//! going back to rest.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use crate::assembly::elastic::spread_over;
use crate::assembly::place::SurfaceLoads;
use crate::assembly::{Contacts, Dofs, ForceChange, OVERESTIMATE, Recovery, is_free_to_change};
use crate::contact::ContactKey;
use crate::grain::DamagedGrain;
use crate::model::{Body, Committed, Loads, Model};
use crate::solver::Settings;
use crate::solver::newton::Newton;
use crate::tensor::Vec3;

/// Effective strain over its damage threshold from which a body is condensed, and below which it may rest.
const NEAR_DAMAGE: f64 = 0.5;
const FAR_FROM_DAMAGE: f64 = 0.3;
/// Shares of the accuracy: beyond the first bodies are condensed, until the estimate is below the second; what fits in the third may rest.
const CONDENSE_BEYOND: f64 = 0.85;
const AIM: f64 = 0.7;
const REST_WITHIN: f64 = 0.35;
/// Times that the set left to rest is made smaller where the estimate for it is still beyond the aim.
const MOST_SHRINKS: usize = 6;

/// What is to become of the bodies whose fidelity is chosen.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Verdict {
    /// Resting bodies to be condensed.
    pub wake: Vec<usize>,
    /// Condensed bodies that may rest.
    pub rest: Vec<usize>,
    /// Estimated relative error of the contact forces by the bodies that rest now.
    pub error: f64,
    /// The same where all rested that can.
    pub error_at_rest: f64,
    /// Largest effective strain of a resting body over its damage threshold.
    pub utilisation: f64,
    /// Whether the outcome cannot be accepted with the bodies as they are.
    pub urgent: bool,
}

impl Verdict {
    /// Nothing was judged.
    pub fn unknown() -> Self {
        Verdict { error: f64::NAN, error_at_rest: f64::NAN, ..Verdict::default() }
    }
}

/// What a change of fidelities did.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Transition {
    pub woken: usize,
    pub rested: usize,
    /// Elastic energy after the change less that before [J]: of the description, not of the bodies, which do not move.
    pub energy: f64,
    /// Largest change of a contact force over the mean contact force.
    pub jump: f64,
}

/// Judges the balanced state `at` under `loads`, which `contacts` has been evaluated in.
pub fn judge(
    model: &Model,
    at: &Committed,
    loads: &Loads,
    settings: &Settings,
    contacts: &Contacts,
) -> Verdict {
    let Some(accuracy) = settings.accuracy else { return Verdict::unknown() };
    // In a solve a contact of condensed bodies is too soft on purpose; here as soft as they are there.
    let mut at = at.clone();
    at.memory
        .values_mut()
        .flat_map(|pair| &mut pair.points)
        .for_each(|point| point.scale = 1.0 / OVERESTIMATE);
    let loads = Loads { control: None, ..loads.clone() };
    let Ok(mut newton) = Newton::new(model, &at, &loads, settings, contacts.clone(), at.poses.clone()) else {
        return Verdict::unknown();
    };
    let recovery = newton.contacts.recover(model, &at.poses, loads.pressure);
    let used = |(body, loads): (usize, &SurfaceLoads)| {
        let it = &model.bodies[body];
        match it.damaged() {
            Some(grain) if grain.is_sound() => grain.utilisation(&stressing(it, grain, loads)),
            Some(_) if it.is_brittle() => 1.0,
            Some(_) | None => 0.0,
        }
    };
    let used: Vec<f64> = recovery.loads.par_iter().enumerate().map(used).collect();
    let free: Vec<bool> = (0..model.bodies.len()).map(|body| is_free_to_change(model, body)).collect();
    let resting: Vec<bool> = model.bodies.iter().map(|body| body.is_resting()).collect();
    let mut verdict = Verdict::unknown();
    let near = |body: usize| used[body] >= NEAR_DAMAGE;
    verdict.utilisation =
        (0..used.len()).filter(|&body| resting[body]).map(|body| used[body]).fold(0.0, f64::max);
    let mut wakes: Vec<bool> = (0..used.len()).map(|body| resting[body] && near(body)).collect();
    let mut rests = vec![false; used.len()];
    if let Some(mut network) = Network::new(&mut newton, &recovery) {
        let all = network.changes(&free);
        verdict.error_at_rest = relative(&all);
        verdict.error = relative(&network.present());
        let shares = Shares::new(&all, &free);
        if verdict.error > CONDENSE_BEYOND * accuracy {
            let mut budget = AIM * accuracy;
            for _ in 0..MOST_SHRINKS {
                let left = shares.within(budget, |body| free[body] && !near(body));
                (0..wakes.len()).for_each(|body| wakes[body] |= resting[body] && !left[body]);
                let still: Vec<bool> = (0..left.len()).map(|body| resting[body] && !wakes[body]).collect();
                if relative(&network.changes(&still)) <= AIM * accuracy {
                    break;
                }
                budget *= 0.7;
            }
        } else {
            let may_rest =
                shares.within(REST_WITHIN * accuracy, |body| free[body] && used[body] < FAR_FROM_DAMAGE);
            (0..rests.len()).for_each(|body| rests[body] = may_rest[body] && free[body] && !resting[body]);
        }
    }
    let numbers = |flags: &[bool]| (0..flags.len()).filter(|&body| flags[body]).collect::<Vec<_>>();
    (verdict.wake, verdict.rest) = (numbers(&wakes), numbers(&rests));
    tracing::debug!(
        error = verdict.error,
        at_rest = verdict.error_at_rest,
        used = verdict.utilisation,
        "fidelity judged"
    );
    let breaks = (0..used.len())
        .any(|body| resting[body] && model.bodies[body].softens_with_damage() && used[body] >= 1.0);
    verdict.urgent = breaks || (verdict.error > accuracy && !verdict.wake.is_empty());
    verdict
}

/// `loads` on a body as they stress its `grain`.
fn stressing<'a>(body: &Body, grain: &DamagedGrain, loads: &'a SurfaceLoads) -> Cow<'a, SurfaceLoads> {
    if !body.spreads_forces() {
        return Cow::Borrowed(loads);
    }
    let surface = grain.condensed().surface();
    let spread = loads.iter().flat_map(|(place, force)| spread_over(surface, body, place, force));
    Cow::Owned(spread.collect())
}

/// Drag over the typical contact stiffness: bodies that nothing holds have a position with it.
const DRAG: f64 = 1e-5;

/// The contact network of a state, linearised.
struct Network<'a, 'n> {
    newton: &'a mut Newton<'n>,
    recovery: &'a Recovery,
}

impl<'a, 'n> Network<'a, 'n> {
    /// `None` where its tangent cannot be factored.
    fn new(newton: &'a mut Newton<'n>, recovery: &'a Recovery) -> Option<Self> {
        let nothing = vec![0.0; newton.dofs.count()];
        newton.weights = vec![DRAG];
        newton.step(&nothing)?;
        Some(Network { newton, recovery })
    }

    /// How the contacts' forces would change, did the bodies not omit what they do.
    fn present(&mut self) -> Vec<ForceChange> {
        self.respond(&self.recovery.present(&self.newton.contacts, self.newton.model))
    }

    /// The same, had those bodies been at rest from the first that `rests` says.
    fn changes(&mut self, rests: &[bool]) -> Vec<ForceChange> {
        self.respond(&self.recovery.omitted(&self.newton.contacts, rests))
    }

    fn respond(&mut self, omitted: &[Vec3]) -> Vec<ForceChange> {
        let dofs: Dofs = self.newton.dofs.clone();
        let mut step = self.newton.contacts.forces_of_omitted(&dofs, omitted);
        if self.newton.respond(&mut step).is_none() {
            step.fill(f64::NAN);
        }
        self.newton.contacts.force_changes(&dofs, &step, omitted)
    }
}

/// Root of the summed squares over that of the forces; zero without forces.
fn relative(changes: &[ForceChange]) -> f64 {
    let square = |of: fn(&ForceChange) -> f64| changes.iter().map(|c| of(c).powi(2)).sum::<f64>();
    let forces = square(|c| c.force);
    if forces > 0.0 { (square(|c| c.change) / forces).sqrt() } else { 0.0 }
}

/// Each body's share of a change of all forces.
struct Shares {
    /// Square of its part over the summed squares of the forces, with the body; the least first.
    sorted: Vec<(f64, usize)>,
    bodies: usize,
}

impl Shares {
    /// The change in a contact is halved between its bodies that are free to rest.
    fn new(changes: &[ForceChange], free: &[bool]) -> Self {
        let mut parts = vec![0.0; free.len()];
        let forces = changes.iter().map(|c| c.force.powi(2)).sum::<f64>().max(f64::MIN_POSITIVE);
        for change in changes {
            let own = change.bodies.iter().filter(|&&body| free[body]);
            let count = own.clone().count();
            own.for_each(|&body| parts[body] += change.change.powi(2) / (forces * count as f64));
        }
        let mut sorted: Vec<(f64, usize)> =
            (0..free.len()).filter(|&body| free[body]).map(|body| (parts[body], body)).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        Shares { sorted, bodies: free.len() }
    }

    /// The bodies with the least parts that together stay within `budget`, of those that `may`.
    fn within(&self, budget: f64, may: impl Fn(usize) -> bool) -> Vec<bool> {
        let mut within = vec![false; self.bodies];
        let mut sum = 0.0;
        for &(part, body) in self.sorted.iter().filter(|(_, body)| may(*body)) {
            sum += part;
            if !(sum <= budget * budget) {
                break;
            }
            within[body] = true;
        }
        within
    }
}

/// Changes fidelities in the committed state without changing a contact force; `pressure` [Pa] is that on the cover.
pub fn change(
    model: &mut Model,
    committed: &mut Committed,
    contacts: &mut Contacts,
    pressure: f64,
    [wake, rest]: [&[usize]; 2],
) -> Transition {
    let mut transition = Transition::default();
    if wake.is_empty() && rest.is_empty() {
        return transition;
    }
    contacts.start(model, committed);
    if contacts.evaluate(model, committed, &committed.poses).is_err() {
        return transition;
    }
    let recovery = contacts.recover(model, &committed.poses, pressure);
    let before = (contacts.stored_energy(model, &recovery), contacts.forces(), contacts.mean_force());
    committed.fields.resize(model.bodies.len(), Vec::new());
    let mut changed = vec![false; model.bodies.len()];
    for &body in wake {
        changed[body] = model.bodies[body].wake();
        transition.woken += usize::from(changed[body]);
        if changed[body] {
            committed.fields[body] = match model.bodies[body].full() {
                Some(full) => full.displaced(&recovery.loads[body]),
                None => recovery.fields[body].clone(),
            };
        }
    }
    for &body in rest {
        changed[body] = model.bodies[body].rest();
        transition.rested += usize::from(changed[body]);
        if changed[body] {
            committed.fields[body].clear();
        }
    }
    committed.memory = contacts.carried_over(model, committed, &changed, &recovery);
    contacts.forget_bodies();
    contacts.start(model, committed);
    let mut met = contacts.evaluate(model, committed, &committed.poses).is_ok();
    let bore: BTreeSet<ContactKey> = before.1.iter().map(|(key, _)| *key).collect();
    if met && contacts.hold_new(model, committed, &changed, &bore) {
        contacts.start(model, committed);
        met = contacts.evaluate(model, committed, &committed.poses).is_ok();
    }
    if met {
        let recovery = contacts.recover(model, &committed.poses, pressure);
        transition.energy = contacts.stored_energy(model, &recovery) - before.0;
        transition.jump = largest_change(&before.1, &contacts.forces()) / before.2.max(f64::MIN_POSITIVE);
    }
    tracing::info!(
        woken = transition.woken,
        rested = transition.rested,
        condensed = model.bodies.iter().filter(|body| body.is_elastic()).count(),
        energy = transition.energy,
        jump = transition.jump,
        "fidelity"
    );
    transition
}

/// The largest difference of a force between two lists [N]; one that is missing in the other counts in full.
fn largest_change(before: &[(ContactKey, Vec3)], after: &[(ContactKey, Vec3)]) -> f64 {
    let mut differences: BTreeMap<ContactKey, Vec3> = before.iter().copied().collect();
    for (key, force) in after {
        *differences.entry(*key).or_insert_with(Vec3::zeros) -= force;
    }
    differences.values().map(|difference| difference.norm()).fold(0.0, f64::max)
}
