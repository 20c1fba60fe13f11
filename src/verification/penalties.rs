//! First guesses that must not matter: penalties of condensed contacts, drag of rigid bodies,
//! rejected trials.
//!
//! - A condensed cube squeezed between plates, turned a little so that edges and corners touch, with first penalties from 1e-3 to 1e3
//!   times the default. Gaps agree to 1e-8 of the cube's size, 3e-10 m, where each plate presses it in by 10 um: forces may differ by 3e-5
//!   an increment and plate, 3e-4 over four with friction that remembers the way.
//! - The contacts of rigid bodies are springs, without multipliers; what is guessed there is the drag of the first step, 1e-3 to 1e3
//!   times the default. A wedge pressed between walls, forces balanced to 1e-5.
//! - A block pushed along a plane with weakening friction, with and without a rejected trial of twenty times the step before each increment. The search may
//!   list candidates in other places: 1e-12 of lengths.

use std::sync::Arc;

use crate::assembly::Contacts;
use crate::contact::law::Friction;
use crate::grain::CondensedGrain;
use crate::material::Elastic;
use crate::mesh::cuboid_mesh;
use crate::model::{Committed, Loads};
use crate::scene::{Scene, SceneBody, SceneParameters};
use crate::solver::{Increment, Settings, advance};
use crate::verification::bodies::{DENSITY, HELD, body, cuboid, drive, fixed, ground, load, scene, sharp};
use crate::verification::wedges::{on_wall, pressed};
use crate::verification::{Absolute, Findings, Relative, Run, timed};

const EDGE: f64 = 0.03;

/// The cube, squeezed by 30 um.
pub fn squeezed(increments: usize, friction: f64) -> SceneParameters {
    let mesh = cuboid_mesh([EDGE; 3], 0.5 * EDGE).expect("a mesh");
    let rock = vec![Elastic::new(30e9, 0.2).expect("allowed"); mesh.cells.len()];
    let grain = CondensedGrain::new(mesh, &rock, DENSITY).expect("a grain");
    let cube = body("cube", cuboid([EDGE; 3]), [0.0, 0.0, 0.5 * EDGE], [0.0; 3]);
    let cube = SceneBody { grain: Some(Arc::new(grain)), ..cube };
    let plate = |name: &str, z: f64| body(name, cuboid([0.1, 0.1, 0.02]), [0.0, 0.0, z], [0.0, 0.0, 0.4]);
    let bodies = vec![fixed(plate("bottom", -0.01)), cube, plate("top", EDGE + 0.01)];
    let push = drive([Some(0.0), Some(0.0), Some(-30e-6)], HELD);
    scene(bodies, friction, vec![load(increments, "top", push)])
}

pub(super) fn first_guesses(findings: &mut Findings) {
    let condensed = |first_penalty: f64| {
        let mut parameters = sharp(squeezed(4, 0.3));
        parameters.settings.first_penalty = first_penalty;
        parameters.settings.gap_tolerance = 1e-8;
        let run = Run::of(&parameters);
        (run.at_end(|row| row.bodies[2].contact_force.z), run)
    };
    let (reference, _) = condensed(1.0);
    for first in [1e-3, 1e-1, 10.0, 1e3] {
        let (force, run) = condensed(first);
        let what = format!("condensed: plate [N], first penalty x {first:e}");
        findings.of_run(what, &run, force, reference, Relative(3e-4));
    }
    let angle = 20f64.to_radians();
    let rigid = |first: f64| {
        let mut parameters = sharp(pressed(angle, 0.65));
        parameters.settings.drag_to_rest[0] *= first;
        let run = Run::of(&parameters);
        (run.at_end(|row| on_wall(row, 2, angle)[0]), run)
    };
    let (reference, _) = rigid(1.0);
    for first in [1e-3, 1e-1, 10.0, 1e3] {
        let (force, run) = rigid(first);
        let what = format!("rigid: N [N], first drag x {first:e}");
        findings.of_run(what, &run, force, reference, Relative(1e-4));
    }
}

/// The block after twenty steps, and the factorisations that took.
pub fn pushed(with_rejected_trials: bool) -> (Committed, usize) {
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
pub fn difference(one: &Committed, other: &Committed) -> f64 {
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

pub(super) fn rejected_trials(findings: &mut Findings) {
    let ((plain, _), _) = timed(|| pushed(false));
    let ((tried, factorisations), time) = timed(|| pushed(true));
    let apart = difference(&plain, &tried);
    let cost = (factorisations, time);
    findings.compare("states with and without, apart [m]", apart, 0.0, Absolute(1e-12), cost);
    let slip = tried.memory.values().map(|pair| pair.slip).fold(0.0, f64::max);
    // Nineteen steps of 5 um, less what the springs stretch.
    let cost = (factorisations, time);
    findings.compare("slip that both remember [m]", slip, 95e-6, Relative(0.1), cost);
}
