//! The same increments twice, once with rejected trials in between: the committed state is the same.
//!
//! Naive codes let histories of rejected trials leak into the next one. Here a trial with twenty times the
//! step is made and thrown away before each increment. The search may list candidates in other places: 1e-12 of lengths.

use riprap::assembly::Contacts;
use riprap::contact::law::Friction;
use riprap::model::{Committed, Loads};
use riprap::scene::{Scene, SceneParameters};
use riprap::solver::{Increment, Settings, advance};
use riprap::verification::bodies::{body, cuboid, ground, scene};

/// A block pushed along a plane with weakening friction, after twenty steps, and the factorisations that took.
fn pushed(with_rejected_trials: bool) -> (Committed, usize) {
    let block = body("block", cuboid([0.1; 3]), [0.0, 0.0, 0.05], [0.0; 3]);
    let friction = Friction { peak: 0.65, residual: 0.2, weakening_distance: 50e-6 };
    let parameters = SceneParameters { friction, ..scene(vec![ground(), block], 0.0, vec![]) };
    let scene = Scene::new(&parameters).expect("a sound scene");
    let mut committed = scene.committed.clone();
    let settings = Settings::default();
    let mut contacts = Contacts::default();
    let (mut loads, mut factorisations) = (Loads::none(2), 0);
    loads.prescribed[0] = [true; 6];
    loads.applied[1][2] = -1000.0;
    for step in 0..20 {
        loads.prescribed[1] = [step > 0, false, false, false, false, false];
        let mut attempt = |committed: &Committed, distance: f64| {
            let mut start = committed.poses.clone();
            start[1].position.x += distance;
            let increment = Increment { model: &scene.model, committed, loads: &loads, settings: &settings };
            advance(&increment, vec![start], &mut contacts)
        };
        let distance = if step > 0 { 5e-6 } else { 0.0 };
        if with_rejected_trials {
            attempt(&committed, 20.0 * distance);
        }
        let report = attempt(&committed, distance);
        factorisations += report.counters.factorisations;
        if !report.converged() {
            break;
        }
        committed =
            Committed { memory: report.memory, fields: report.fields, ..Committed::new(report.poses) };
    }
    (committed, factorisations)
}

/// The largest difference of two committed states in places, rotations, slips and stretches [m, rad]; infinite where
/// other features touch.
fn difference(one: &Committed, other: &Committed) -> f64 {
    if one.memory.len() != other.memory.len() || one.memory.is_empty() {
        return f64::INFINITY;
    }
    let places = one
        .poses
        .iter()
        .zip(&other.poses)
        .map(|(a, b)| (a.position - b.position).norm().max((a.rotation * b.rotation.inverse()).angle()));
    let memories = one.memory.iter().zip(&other.memory).map(|((key, a), (same, b))| {
        let alike = a.points.iter().map(|p| p.feature).eq(b.points.iter().map(|p| p.feature));
        let stretches = a.points.iter().zip(&b.points).map(|(p, q)| (p.stretch - q.stretch).norm());
        if key == same && alike { stretches.fold((a.slip - b.slip).abs(), f64::max) } else { f64::INFINITY }
    });
    places.chain(memories).fold(0.0, f64::max)
}

#[test]
fn rejected_trials_leave_the_committed_state_alone() {
    let ((plain, fewer), (tried, _)) = (pushed(false), pushed(true));
    assert!(fewer > 0);
    let apart = difference(&plain, &tried);
    assert!(apart < 1e-12, "{apart}");
    assert!(plain.memory.values().all(|pair| pair.slip > 50e-6), "slipped beyond the weakening distance");
    // Nineteen steps of 5 um, less what the springs stretch.
    let slip = tried.memory.values().map(|pair| pair.slip).fold(0.0, f64::max);
    assert!((slip / 95e-6 - 1.0).abs() <= 0.1, "{slip}");
}
