//! Small scenes with known answers, straight through the solver.

use super::*;
use crate::assembly::Contacts;
use crate::contact::law::Friction;
use crate::contact::{ContactLaw, ContactShape};
use crate::geometry::Polyhedron;
use crate::geometry::rounded::RoundedBody;
use crate::model::{Body, BodyKind, Committed, Loads, Model};
use crate::tensor::{Pose, Vec3};

const ROUNDING: f64 = 1e-3;

fn block(name: &str, size: [f64; 3]) -> (Body, ContactShape) {
    let nominal = Polyhedron::cuboid(size).expect("a box");
    let core = Polyhedron::cuboid(size.map(|s| s - 2.0 * ROUNDING)).expect("a box");
    let body = Body {
        name: name.into(),
        kind: BodyKind::Placed,
        stiffness: 1e8,
        friction: None,
        mass: 2700.0 * nominal.volume(),
        centre_of_mass: Vec3::zeros(),
        grain: None,
        rotation_scale: 0.05,
        nominal,
    };
    (body, ContactShape::new(RoundedBody { core, radius: ROUNDING }))
}

fn block_on_plate(friction: f64) -> (Model, Committed, Loads) {
    let (plate, plate_shape) = block("plate", [1.0, 1.0, 0.1]);
    let (cube, cube_shape) = block("cube", [0.1, 0.1, 0.1]);
    let model = Model {
        bodies: vec![plate, cube],
        shapes: vec![plate_shape, cube_shape],
        law: ContactLaw {
            onset: 1e-7,
            fade_length: 5e-4,
            parallel_limit: 4e-3,
            tangential_ratio: 0.89,
            friction_blend: 0.05,
        },
        friction: Friction::constant(friction),
        cover: None,
    };
    let poses = vec![
        Pose::new(Vec3::new(0.0, 0.0, -0.05), crate::tensor::Rotation::identity()),
        Pose::new(Vec3::new(0.0, 0.0, 0.05), crate::tensor::Rotation::identity()),
    ];
    let mut loads = Loads::none(2);
    loads.prescribed[0] = [true; 6];
    (model, Committed::new(poses), loads)
}

fn settle(model: &Model, committed: &Committed, loads: &Loads) -> IncrementReport {
    let settings = Settings::default();
    let increment = Increment { model, committed, loads, settings: &settings };
    advance(&increment, vec![committed.poses.clone()], &mut Contacts::default())
}

#[test]
fn block_rests_on_a_plate() {
    let (model, committed, mut loads) = block_on_plate(0.65);
    loads.gravity = Vec3::new(0.0, 0.0, -9.81);
    let report = settle(&model, &committed, &loads);
    assert_eq!(report.status, StepStatus::Converged, "{:?}", report.history);
    let weight = 2700.0 * 1e-3 * 9.81;
    assert!((report.contact_wrench[1][2] - weight).abs() < 1e-3 * weight, "{:?}", report.contact_wrench[1]);
    assert!(report.counters.factorisations < 60, "{:?}", report.counters);
}

#[test]
fn block_slides_on_an_incline_beyond_the_friction_angle() {
    for friction in [0.2, 0.65] {
        for (factor, holds) in [(0.97, true), (1.03, false)] {
            let (model, mut committed, mut loads) = block_on_plate(friction);
            loads.gravity = Vec3::new(0.0, 0.0, -9.81);
            let rest = settle(&model, &committed, &loads);
            committed.poses = rest.poses;
            committed.memory = rest.memory;
            let angle = factor * f64::atan(friction);
            loads.gravity = Vec3::new(9.81 * angle.sin(), 0.0, -9.81 * angle.cos());
            let report = settle(&model, &committed, &loads);
            let moved = report.poses[1].position.x - committed.poses[1].position.x;
            assert_eq!(
                report.converged(),
                holds,
                "mu {friction}, {factor}: moved {moved}, {:?}",
                report.balance
            );
            if holds {
                assert!(moved < 1e-5, "{moved}");
            }
        }
    }
}

#[test]
fn a_raised_signal_has_the_increment_given_up() {
    let (model, committed, mut loads) = block_on_plate(0.65);
    loads.gravity = Vec3::new(0.0, 0.0, -9.81);
    let settings = Settings { stop: StopSignal::new(), ..Settings::default() };
    let attempt = || {
        let increment =
            Increment { model: &model, committed: &committed, loads: &loads, settings: &settings };
        advance(&increment, vec![committed.poses.clone()], &mut Contacts::default())
    };
    assert!(attempt().converged());
    // Copies of the settings, for a more careful try say, hear the same signal.
    let careful = settings.cautious();
    settings.stop.raise();
    assert!(careful.stop.is_raised() && !Settings::default().stop.is_raised());
    let report = attempt();
    assert_eq!(report.status, StepStatus::Abandoned);
    assert_eq!(report.counters.factorisations, 0);
}
