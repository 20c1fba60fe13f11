//! Bodies whose fidelity changes under load, and fidelity chosen for an accuracy.
//!
//! Two cubes, one turned on the other, pressed and pushed between a fixed plate and a driven one.
//!
//! - A change of fidelity leaves every contact force as it was: to rounding (1e-9 of the mean force), since gaps get the offset that this
//!   takes. What does move is the force by which an edge contact that fades presses sideways, the energy it stores over the length in which it fades:
//!   the state must still balance to the force tolerance.
//! - Energies count on: what the description holds more or less of them after a change is left out, so external work closes against
//!   elastic and friction energy as well as without a change.
//! - With an accuracy that no rigid body meets the outcome is that of condensed bodies, with one that all meet that of rigid ones, to the
//!   last bit: nothing of the choice leaks into the solution.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use riprap::assembly::Contacts;
use riprap::case::RawCase;
use riprap::contact::face::FaceContact;
use riprap::grain::CondensedGrain;
use riprap::loading::StageEnd;
use riprap::model::Loads;
use riprap::scene::{Row, Scene, SceneBody, SceneParameters};
use riprap::solver::fidelity::change;
use riprap::solver::{Increment, advance};
use riprap::tensor::Vec3;

use riprap::verification::bodies::DENSITY;

use crate::scene_rows::{rows, scene};
use crate::two_cubes::{between_plates, meshed};

const CUBES: [usize; 2] = [1, 2];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Cubes {
    Rigid,
    Condensed,
    Chosen(f64),
}

fn pressed(cubes: Cubes, increments: usize, friction: f64) -> SceneParameters {
    let made = |cube: SceneBody| {
        let (mesh, rock) = meshed();
        let grain = CondensedGrain::new(mesh, &rock, DENSITY).expect("a grain");
        let grain = Some(Arc::new(grain)).filter(|_| cubes != Cubes::Rigid);
        SceneBody { grain, rests: matches!(cubes, Cubes::Chosen(_)), ..cube }
    };
    let mut parameters = between_plates(friction, increments, [4e-6, 0.0, -40e-6], made);
    parameters.settings.force_tolerance = 1e-5;
    parameters.settings.gap_tolerance = 1e-7;
    if let Cubes::Chosen(accuracy) = cubes {
        parameters.settings.accuracy = Some(accuracy);
    }
    parameters
}

fn run(parameters: &SceneParameters) -> (Scene, Vec<Row>) {
    let mut scene = Scene::new(parameters).expect("a sound scene");
    let mut rows = Vec::new();
    let end = scene.run(|_, row| {
        rows.push(row.clone());
        true
    });
    assert_eq!(end, StageEnd::Finished);
    (scene, rows)
}

/// The scene after so many of its increments.
fn interrupted(parameters: &SceneParameters, increments: usize) -> Scene {
    let mut scene = Scene::new(parameters).expect("a sound scene");
    let mut count = 0;
    let end = scene.run(|_, _| {
        count += 1;
        count < increments
    });
    assert_eq!(end, StageEnd::Interrupted);
    scene
}

/// Both plates held where they are.
fn plates_held(bodies: usize) -> Loads {
    let mut loads = Loads::none(bodies);
    loads.prescribed[0] = [true; 6];
    loads.prescribed[3] = [true; 6];
    loads
}

#[test]
fn a_change_leaves_forces_as_they_were() {
    // All stick, and all slide or nearly.
    for friction in [0.5, 0.02] {
        changed_and_back(&pressed(Cubes::Chosen(1e9), 4, friction));
    }
}

/// The nodes of patches stay as they are when a body is condensed or comes to rest.
#[test]
fn a_change_leaves_forces_on_patches_as_they_were() {
    for friction in [0.5, 0.02] {
        changed_and_back(&by_area(pressed(Cubes::Chosen(1e9), 4, friction)));
    }
}

fn by_area(parameters: SceneParameters) -> SceneParameters {
    SceneParameters { faces: FaceContact::Area, ..parameters }
}

fn changed_and_back(parameters: &SceneParameters) {
    let (scene, rows) = run(parameters);
    println!("{:.2} of the contacts slide", rows[rows.len() - 1].measures.sliding_fraction);
    assert!(rows.iter().all(|row| row.fidelity.condensed == 0), "none needs to be condensed");
    let (mut model, mut committed) = (scene.model.clone(), scene.committed.clone());
    let mut contacts = Contacts::default();
    let loads = plates_held(model.bodies.len());
    for [wake, rest] in [[&CUBES[..1], &[]], [&CUBES[1..], &[]], [&[], &CUBES[..1]], [&[], &CUBES[1..]]] {
        let done = change(&mut model, &mut committed, &mut contacts, 0.0, [wake, rest]);
        assert_eq!(done.woken + done.rested, 1);
        println!("jump {:.1e} of the mean force, energy {:.3e} J", done.jump, done.energy);
        assert!(done.jump < 1e-9, "{done:?}");
        assert!(done.energy != 0.0);
        let settings = parameters.settings.clone();
        let increment =
            Increment { model: &model, committed: &committed, loads: &loads, settings: &settings };
        let report = advance(&increment, vec![committed.poses.clone()], &mut Contacts::default());
        let off = report.history[0];
        println!(
            "out of balance by {off:.1e} before anything moves, {} factorisations",
            report.counters.factorisations
        );
        // The default tolerance of an increment.
        assert!(report.converged() && off < 1e-3, "{off}");
    }
}

#[test]
fn what_is_asked_for_decides() {
    let force = |rows: &[Row]| rows[rows.len() - 1].bodies[3].contact_force;
    let condensed = force(&run(&pressed(Cubes::Condensed, 4, 0.5)).1);
    let rigid = force(&run(&pressed(Cubes::Rigid, 4, 0.5)).1);
    let (_, sharp) = run(&pressed(Cubes::Chosen(1e-6), 4, 0.5));
    let (_, blunt) = run(&pressed(Cubes::Chosen(1e9), 4, 0.5));
    println!("condensed {condensed:?}, rigid {rigid:?}");
    println!("chosen for 1e-6 {:?}, for 1e9 {:?}", force(&sharp), force(&blunt));
    assert_eq!(force(&blunt), rigid);
    // Both cubes are condensed before the first increment is accepted, from a state without forces.
    assert!(sharp[0].fidelity.condensed == 2 && sharp[0].fidelity.repeats > 0, "{:?}", sharp[0].fidelity);
    assert_eq!(force(&sharp), condensed);
    // The estimate of the last row is that of the bodies as they were: of rigid cubes the error that they have, within a factor of two
    // (it is of first order, and their error is not small).
    let error = (rigid - condensed).norm() / condensed.norm();
    let estimate = blunt[3].fidelity.error.expect("an estimate");
    println!("rigid cubes: error {error:.3}, estimated {estimate:.3}");
    assert!(estimate > 0.5 * error && estimate < 2.0 * error, "{error} {estimate}");
}

/// By area as well, but to the bits: nodes of patches are found where bodies are woken, which is not where the first step of condensed ones looks.
#[test]
fn what_is_asked_for_decides_by_area() {
    let force = |rows: &[Row]| rows[rows.len() - 1].bodies[3].contact_force;
    let condensed = force(&run(&by_area(pressed(Cubes::Condensed, 4, 0.5))).1);
    let (_, sharp) = run(&by_area(pressed(Cubes::Chosen(1e-6), 4, 0.5)));
    let (_, blunt) = run(&by_area(pressed(Cubes::Chosen(1e9), 4, 0.5)));
    assert!(sharp[0].fidelity.condensed == 2 && blunt[3].fidelity.condensed == 0);
    let miss = (force(&sharp) - condensed).norm() / condensed.norm();
    assert!(miss < 1e-9, "{miss:e}");
    let error = (force(&blunt) - condensed).norm() / condensed.norm();
    let estimate = blunt[3].fidelity.error.expect("an estimate");
    println!("resting cubes: error {error:.4}, estimated {estimate:.4}");
    assert!(estimate > 0.5 * error && estimate < 2.0 * error, "{error} {estimate}");
}

/// Six boxes face on face: forces between all of them against those of full bodies. Where an accuracy is asked for by which some may rest, some do.
#[test]
fn a_pile_keeps_within_the_accuracy_that_is_asked() {
    let pile = |solver: serde_json::Value| {
        let text = include_str!("../../benchmarks/work_precision/cases/pile.json");
        let mut raw = RawCase::parse(Path::new("pile.json"), text).expect("parses");
        raw.set(&[("/solver".into(), solver)]);
        let mut scene = scene(&raw.check().expect("a sound case"));
        let (rows, end) = rows(&mut scene, usize::MAX);
        assert_eq!(end, StageEnd::Finished);
        let mut forces: BTreeMap<_, Vec3> = BTreeMap::new();
        for ((pair, _), force) in scene.contacts.forces() {
            *forces.entry(pair).or_insert_with(Vec3::zeros) += force;
        }
        (forces, rows)
    };
    let square = |forces: &BTreeMap<_, Vec3>| forces.values().map(|force| force.norm_squared()).sum::<f64>();
    let (full, _) = pile(serde_json::json!({"fidelity": "full"}));
    for (accuracy, condensed) in [(0.005, 6..7), (0.02, 1..6), (0.05, 0..6)] {
        let (mut forces, rows) = pile(serde_json::json!({"fidelity": "auto", "accuracy": accuracy}));
        full.iter().for_each(|(pair, force)| *forces.entry(*pair).or_insert_with(Vec3::zeros) -= force);
        let error = (square(&forces) / square(&full)).sqrt();
        let count = rows[rows.len() - 1].fidelity.condensed;
        println!("asked {accuracy}: {error:.4}, {count} condensed");
        assert!(
            error < accuracy && condensed.contains(&count),
            "asked {accuracy}: {error}, {count} condensed"
        );
    }
}

#[test]
fn energies_count_on() {
    // Woken in the middle: rests for four increments, then is asked for more.
    let parameters = pressed(Cubes::Chosen(1e9), 16, 0.5);
    let mut scene = interrupted(&parameters, 8);
    scene.settings.accuracy = Some(1e-6);
    let mut rows = Vec::new();
    scene.run(|_, row| {
        rows.push(row.clone());
        true
    });
    let (first, last) = (&rows[0], &rows[rows.len() - 1]);
    assert!(first.fidelity.promoted == 2 && last.fidelity.condensed == 2, "{:?}", first.fidelity);
    println!("{:?}", last.ledger);
    // As of condensed cubes throughout: second order in the increment, 1e-3 in 16.
    let error = last.ledger.error().abs() / last.ledger.external;
    assert!(error < 5e-3, "{error}");
}
