//! Whether an accepted state of a scene has company: another equilibrium under the same loads and prescriptions.
//!
//! With friction above a critical coefficient there may be several (Klarbring 1990, Ing.-Arch. 60:529). There is no test that finds all of them. The
//! one here looks in one place: friction is taken away, and the bodies slide to the equilibrium that is left, if one is. With friction
//! back they stay in balance there. Where the forces are others than those of the accepted state, that one is held by friction
//! alone, and which of the two a body is in follows from its history, not from the loads.

use crate::assembly::Contacts;
use crate::contact::law::Friction;
use crate::model::Committed;
use crate::scene::Scene;
use crate::solver::{Increment, IncrementReport, advance};

/// Another equilibrium differs by more than this share of the mean contact force on some body; tolerances leave 1e-3.
const DIFFERENT: f64 = 0.02;

/// The other equilibrium, where one is found.
pub fn other_equilibrium(scene: &Scene) -> Option<IncrementReport> {
    let mut smooth = scene.model.clone();
    smooth.friction = Friction::constant(0.0);
    smooth.bodies.iter_mut().for_each(|body| body.friction = Some(smooth.friction));
    let loads = scene.loads();
    let Committed { poses, .. } = &scene.committed;
    let forgotten = Committed::new(poses.clone());
    let slide = Increment { model: &smooth, committed: &forgotten, loads, settings: &scene.settings };
    let slid = advance(&slide, vec![poses.clone()], &mut Contacts::default());
    if !slid.converged() {
        return None;
    }
    let settle = |committed: &Committed| {
        let increment = Increment { model: &scene.model, committed, loads, settings: &scene.settings };
        advance(&increment, vec![committed.poses.clone()], &mut Contacts::default())
    };
    // The accepted state itself by the same measure, and the other from where the bodies slid to, where contacts begin anew.
    let (here, there) = (settle(&scene.committed), settle(&Committed::new(slid.poses)));
    let largest = here
        .contact_wrench
        .iter()
        .zip(&there.contact_wrench)
        .map(|(own, other)| (own - other).fixed_rows::<3>(0).norm())
        .fold(0.0, f64::max);
    let differs = largest > DIFFERENT * here.balance.reference_force.max(there.balance.reference_force);
    (here.converged() && there.converged() && differs).then_some(there)
}
