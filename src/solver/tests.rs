//! Small scenes with known answers, straight through the solver.

use std::f64::consts::PI;
use std::sync::Arc;

use super::*;
use crate::assembly::cubes::{contacts_at, pile};
use crate::assembly::{Contacts, Dofs};
use crate::contact::law::{CORE_FLOOR, Friction};
use crate::contact::{ContactLaw, ContactShape};
use crate::geometry::{Polyhedron, RoundedBody};
use crate::grain::{Ancestry, DamagedGrain};
use crate::material::{DamageLaw, DamageParameters, Elastic};
use crate::mesh::grain_mesh;
use crate::model::{Body, BodyKind, Breakage, Committed, Control, Controlled, Deformation, Loads, Model};
use crate::solver::audit;
use crate::solver::balance::Yardsticks;
use crate::solver::dynamic_relaxation::Enough;
use crate::solver::newton::Newton;
use crate::solver::step::Room;
use crate::tensor::{Pose, Rotation, Vec3, Vector6};

const ROUNDING: f64 = 1e-3;

fn block(name: &str, size: [f64; 3]) -> (Body, ContactShape) {
    let (body, shape) = Body::block(name, BodyKind::Placed, size, ROUNDING, 0.05);
    (Body { mass: 2700.0 * body.nominal.volume(), ..body }, shape)
}

fn block_on_plate(friction: f64) -> (Model, Committed, Loads) {
    let (plate, plate_shape) = block("plate", [1.0, 1.0, 0.1]);
    let (cube, cube_shape) = block("cube", [0.1, 0.1, 0.1]);
    let law = ContactLaw {
        onset: 1e-7,
        fade_length: 5e-4,
        parallel_limit: 4e-3,
        tangential_ratio: 0.89,
        friction_blend: 0.05,
    };
    let (bodies, shapes) = (vec![plate, cube], vec![plate_shape, cube_shape]);
    let model = Model::new(bodies, shapes, law, Friction::constant(friction));
    let poses = vec![
        Pose::new(Vec3::new(0.0, 0.0, -0.05), crate::tensor::Rotation::identity()),
        Pose::new(Vec3::new(0.0, 0.0, 0.05), crate::tensor::Rotation::identity()),
    ];
    let mut loads = Loads::none(2);
    loads.prescribed[0] = [true; 6];
    (model, Committed::new(poses), loads)
}

fn settle(model: &Model, committed: &Committed, loads: &Loads) -> IncrementReport {
    settle_with(model, committed, loads, &Settings::default())
}

fn settle_with(model: &Model, committed: &Committed, loads: &Loads, settings: &Settings) -> IncrementReport {
    let increment = Increment { model, committed, loads, settings };
    advance(&increment, vec![committed.poses.clone()], &mut Contacts::default())
}

/// Newton's method at these poses.
fn begun<'a>(
    model: &'a Model,
    committed: &'a Committed,
    loads: &Loads,
    settings: &'a Settings,
    poses: &[Pose],
) -> Newton<'a> {
    let newton = Newton::new(model, committed, loads, settings, Contacts::default(), poses.to_vec());
    newton.unwrap_or_else(|_| panic!("bodies overlap"))
}

/// A block that 10 kN press onto a plate, at rest.
fn pressed_block(friction: f64) -> (Model, Committed, Loads) {
    let (model, committed, mut loads) = block_on_plate(friction);
    loads.applied[1].z = -1e4;
    let rest = settle(&model, &committed, &loads);
    assert!(rest.converged());
    (model, Committed { poses: rest.poses, memory: rest.memory, ..committed }, loads)
}

/// Has the block break, at this tensile strength [Pa] and a compressive one ten times that.
fn make_brittle(model: &mut Model, strength: f64) {
    let mesh = grain_mesh(&model.bodies[1].nominal, 60).expect("a mesh");
    let elastic = Elastic::new(3e10, 0.2).expect("allowed");
    let law = DamageLaw::new(elastic, strength, 10.0 * strength, &DamageParameters::default(), 0.01);
    let laws = vec![law.expect("a law"); mesh.cells.len()];
    let grain = DamagedGrain::new(mesh, laws, 2700.0, Ancestry::of_grain(1)).expect("a grain");
    model.bodies[1].breakage = Breakage::Brittle(Arc::new(grain));
    model.begin_damage();
}

/// A small block inside a large one touches nothing, and all forces balance.
#[test]
fn a_balance_of_bodies_inside_each_other_is_none() {
    let (model, committed, mut loads) = block_on_plate(0.65);
    let (inner, inner_shape) = block("inner", [0.02; 3]);
    let (mut bodies, mut shapes, mut poses) = (model.bodies, model.shapes, committed.poses);
    bodies.push(inner);
    shapes.push(inner_shape);
    poses.push(poses[1]);
    let model = Model::new(bodies, shapes, model.law, model.friction);
    loads.prescribed.push([false; 6]);
    loads.applied = vec![Vector6::zeros(); 3];
    loads.applied[1][2] = -100.0;
    let report = settle(&model, &Committed::new(poses), &loads);
    assert!(report.balance.out_of_balance < 1e-3, "{}", report.balance.out_of_balance);
    let StepStatus::Overlapping { problem } = &report.status else { panic!("{:?}", report.status) };
    assert!(problem.contains("inner") && problem.contains("cube"), "{problem}");
    assert!(!report.converged());
}

/// Rest does not depend on the drag on the way.
#[test]
fn steps_come_to_the_same_rest() {
    let (model, committed, mut loads) = block_on_plate(0.65);
    loads.applied[1] = Vector6::new(2e3, 1e3, -1e4, 0.0, 30.0, 0.0);
    let [soon, late] = [1e-4, 30.0].map(|first| {
        let settings = Settings { drag_to_rest: [first, 1e-5], force_tolerance: 1e-7, ..Settings::default() };
        let report = settle_with(&model, &committed, &loads, &settings);
        assert!(report.converged() && !report.restless, "{:?}", report.history);
        report
    });
    // To what a part in 1e7 of the force moves a block whose contacts yield some micrometres.
    let apart = (soon.poses[1].position - late.poses[1].position).norm();
    assert!(apart < 1e-9 && late.augmentations > soon.augmentations, "{apart:e}");
}

/// A plate with towers of two cubes, which overlap by 10 um where they touch.
fn towers(count: usize) -> (Model, Committed, Loads) {
    let (model, committed, _) = block_on_plate(0.65);
    let (mut bodies, mut shapes) = (vec![model.bodies[0].clone()], vec![model.shapes[0].clone()]);
    let mut poses = vec![committed.poses[0]];
    for (tower, storey) in (0..count).flat_map(|tower| [(tower, 0), (tower, 1)]) {
        bodies.push(Body { name: format!("cube {storey} of {tower}"), ..model.bodies[1].clone() });
        shapes.push(model.shapes[1].clone());
        let place = Vec3::new(0.15 * (tower % 5) as f64 - 0.3, 0.15 * (tower / 5) as f64 - 0.3, 0.05);
        let height = 0.1 * f64::from(storey) - 1e-5 * f64::from(1 + storey);
        poses.push(Pose::new(place + Vec3::z() * height, crate::tensor::Rotation::identity()));
    }
    let mut loads = Loads::none(bodies.len());
    loads.prescribed[0] = [true; 6];
    (Model::new(bodies, shapes, model.law, model.friction), Committed::new(poses), loads)
}

/// One of twenty towers is pressed: it is solved for by itself, and all others stay where they are.
#[test]
fn few_bodies_out_of_balance_are_solved_for_alone() {
    let (model, committed, mut loads) = towers(20);
    loads.applied[8] = Vector6::new(0.0, 0.0, -1e5, 0.0, 0.0, 0.0);
    let settings = Settings::default();
    let dragged = |poses: &[Pose]| {
        let mut newton = begun(&model, &committed, &loads, &settings, poses);
        newton.weights = vec![1e-4];
        newton
    };
    let mut newton = dragged(&committed.poses);
    let held = newton.held_residual();
    let left = newton.settle_few(&held, Room::OfEach).expect("few leave most");
    assert!(newton.dofs.force_on(&left, 8) < 0.1 * newton.dofs.force_on(&held, 8));
    let moved: Vec<usize> =
        (0..model.bodies.len()).filter(|body| newton.poses[*body] != committed.poses[*body]).collect();
    assert_eq!(moved, [7, 8]);
    // The forces are those of the place that it came to, and so is how far it is away.
    let mut there = dragged(&newton.poses);
    there.away.clone_from(&newton.away);
    let off = there.held_residual().iter().zip(&left).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-6, "{off:e} N");
    let (shift, _) = newton.dofs.motion(&newton.away, 1.0, 8);
    assert!((committed.poses[8].position + shift - newton.poses[8].position).norm() < 1e-15);
    assert_eq!(newton.counters.factorisations, 0);
    // Where all are pressed alike they are not few.
    (2..41).step_by(2).for_each(|body| loads.applied[body][2] = -1e5);
    let mut newton = begun(&model, &committed, &loads, &settings, &committed.poses);
    let held = newton.held_residual();
    assert!(newton.settle_few(&held, Room::OfEach).is_none() && newton.poses == committed.poses);
}

/// Where one body of many is stuck, its drag rises and that of what touches it; the others' stays.
#[test]
fn drag_rises_where_a_body_is_stuck() {
    let (model, committed, loads) = towers(3);
    let settings = Settings::default();
    let newton = begun(&model, &committed, &loads, &settings, &committed.poses);
    let mut drag = newton.uniform_drag(0.01);
    let mut held = vec![1.0; newton.dofs.count()];
    newton.dofs.scatter(&mut held, 4, &[0.0, 0.0, 1e3, 0.0, 0.0, 0.0]);
    newton.raise(&mut drag, &held, &held);
    let raised: Vec<bool> = (1..7).map(|body| drag.of(body) > 0.01).collect();
    assert_eq!(raised, [false, false, true, true, false, false]);
}

/// Where a change of fidelity keeps contacts more open than the bodies are, or less, that is no overlap that they do not know of.
#[test]
fn an_initial_overlap_is_known_to_the_audit() {
    let (model, committed, mut loads) = block_on_plate(0.65);
    loads.applied[1][2] = -5e3;
    let first = settle(&model, &committed, &loads);
    assert!(first.converged(), "{:?}", first.status);
    let depth = first.measures.max_penetration;
    for share in [-0.3, 0.3] {
        let mut led = Committed { memory: first.memory.clone(), ..Committed::new(first.poses.clone()) };
        let points = led.memory.values_mut().flat_map(|pair| &mut pair.points);
        points.for_each(|point| point.initial_overlap = share * depth);
        let second = settle(&model, &led, &loads);
        assert!(second.converged(), "{:?}", second.status);
        let sunk = first.poses[1].position.z - second.poses[1].position.z;
        assert!((sunk + share * depth).abs() < 0.01 * depth, "{sunk} m of {depth} m at {share}");
    }
}

/// Two roofs, the upper one upside down and turned, whose ridges of 0.4 roundings cross: their ends alone touch, and know of less than the ridges' depth.
#[test]
fn edges_too_short_to_touch_are_no_overlap_that_contacts_miss() {
    let half_ridge = 0.2 * ROUNDING;
    let roof = |name: &str| {
        let eaves =
            [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]].map(|[x, y]| 0.05 * Vec3::new(x, y, -1.0));
        let ridge = [1.0, -1.0].map(|x| Vec3::new(x * half_ridge, 0.0, 0.0));
        let core = Polyhedron::convex_hull(&[&eaves[..], &ridge].concat()).expect("a roof");
        (block(name, [0.1; 3]).0, ContactShape::new(RoundedBody { core, radius: ROUNDING }))
    };
    let ((lower, lower_shape), (upper, upper_shape)) = (roof("lower"), roof("upper"));
    let shapes = vec![lower_shape, upper_shape];
    let law = block_on_plate(0.5).0.law;
    let model = Model::new(vec![lower, upper], shapes, law, Friction::constant(0.5));
    let apart = 1.9 * ROUNDING;
    let over =
        Rotation::from_axis_angle(&Vec3::z_axis(), 0.5 * PI) * Rotation::from_axis_angle(&Vec3::x_axis(), PI);
    let poses = vec![Pose::identity(), Pose::new(Vec3::new(0.0, 0.0, apart), over)];
    let contacts = contacts_at(&model, &Committed::new(poses.clone()), &poses);
    let known = contacts.active().map(|(_, point)| point.geometric_overlap()).fold(0.0, f64::max);
    let missed = 2.0 * ROUNDING - apart - known;
    assert!((missed - (apart.hypot(half_ridge) - apart)).abs() < 1e-12, "{missed}");
    assert_eq!(audit::fault(&model, &contacts, &poses), None);
    let closer = vec![Pose::identity(), Pose::new(Vec3::new(0.0, 0.0, apart - 2.0 * missed), over)];
    assert!(audit::fault(&model, &contacts, &closer).is_some());
}

/// The pile with its upper cubes condensed, the lowest held and the highest pressed down.
fn pressed_pile() -> (Model, Committed, Loads) {
    let (model, committed, mut loads) = pile(1e-3, Deformation::condensed);
    loads.prescribed[0] = [true; 6];
    loads.applied[2][2] = -2e4;
    (model, committed, loads)
}

/// Contact forces eliminated pair by pair and iterated, against one factor of all unknowns: a step, and what forces cause.
#[test]
fn iterated_contact_forces_are_those_of_a_factor() {
    let (model, committed, loads) = pressed_pile();
    let settings = Settings::default();
    let newton = || {
        let mut newton = begun(&model, &committed, &loads, &settings, &committed.poses);
        newton.gather();
        newton
    };
    let [split, whole] = [false, true].map(|together| {
        let mut newton = newton();
        let held = newton.residual.clone();
        assert!(newton.contacts.unknown_forces.can_be_split() && newton.contacts.unknown_forces.count() > 8);
        newton.together_for = together.then_some(newton.contacts.unknown_forces.generation);
        newton.weights = vec![1e-3];
        let step = newton.step(&held).expect("regular");
        let mut response = held.iter().enumerate().map(|(k, _)| (k as f64).sin()).collect::<Vec<f64>>();
        newton.respond(&mut response).expect("regular");
        assert_eq!(newton.together_for.is_some(), together, "no silent way out");
        [step, response]
    });
    for (split, whole) in split.iter().zip(&whole) {
        let largest = whole.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let off = split.iter().zip(whole).fold(0.0, |m: f64, (x, y)| m.max((x - y).abs()));
        assert!(off > 0.0 && off < 1e-5 * largest, "{off:e} of {largest:e}");
    }
}

/// An increment that is given up tells what grains have stored as well as what contacts have.
#[test]
fn what_missed_has_the_energy_of_what_deforms() {
    let (model, committed, mut loads) = pressed_pile();
    let mut contacts = Contacts::default();
    let settings = Settings::default();
    let increment = Increment { model: &model, committed: &committed, loads: &loads, settings: &settings };
    let rest = advance(&increment, vec![committed.poses.clone()], &mut contacts);
    assert_eq!(rest.status, StepStatus::Converged, "{:?}", rest.history);
    let stored =
        contacts.active().map(|(_, point)| point.evaluation.energy + point.evaluation.tangential_energy);
    let in_contacts: f64 = stored.sum();
    assert!(in_contacts < 0.7 * rest.energy.elastic, "{in_contacts} of {}", rest.energy.elastic);

    let mut committed = Committed::new(rest.poses);
    (committed.memory, committed.fields) = (rest.memory, rest.fields);
    loads.applied[2][2] *= 1.1;
    let settings = Settings { max_augmentations: 0, ..settings };
    let increment = Increment { model: &model, committed: &committed, loads: &loads, settings: &settings };
    let missed = advance(&increment, vec![committed.poses.clone()], &mut contacts);
    assert!(!missed.converged());
    let ratio = missed.energy.elastic / rest.energy.elastic;
    assert!((0.9..1.4).contains(&ratio), "{ratio}");
}

/// Energies of a state as it stands are asked for in this way.
#[test]
fn without_augmentations_nothing_moves() {
    let (model, committed, mut loads) = block_on_plate(0.65);
    loads.gravity = Vec3::new(0.0, 0.0, -9.81);
    for stabilisation in [Stabilisation::Rest, Stabilisation::Unrest(3e-3)] {
        let settings = Settings { stabilisation, max_augmentations: 0, ..Settings::default() };
        let report = settle_with(&model, &committed, &loads, &settings);
        assert!(!report.converged() && report.augmentations == 0, "{stabilisation:?}");
        assert_eq!(report.poses, committed.poses, "{stabilisation:?}");
    }
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

/// A block that hangs 20 mm above the plate, its rounding's twentyfold, and is pressed towards it: falling finds the plate, and the
/// steps the same rest as for a block that starts on it.
#[test]
fn a_block_falls_onto_a_plate() {
    let (model, mut committed, mut loads) = block_on_plate(0.65);
    loads.applied[1].z = -1e4;
    let rest = settle(&model, &committed, &loads);
    assert_eq!(rest.status, StepStatus::Converged);
    committed.poses[1].position.z += 0.02;
    let relaxation = Some(Relaxation { after: 1, bounds: [0.1, 0.03], most_steps: 3000 });
    let falling = Settings { relaxation, ..Settings::default() };
    let fell = settle_with(&model, &committed, &loads, &falling);
    assert_eq!(fell.status, StepStatus::Converged, "{:?}", fell.history);
    assert!(fell.counters.relaxation_steps > 10, "{:?}", fell.counters);
    // A force that misses by 1e-3 moves the block by that share of what its contacts yield.
    let yielded = committed.poses[1].position.z - 0.02 - rest.poses[1].position.z;
    let apart = fell.poses[1].position.z - rest.poses[1].position.z;
    assert!(yielded > 1e-6 && apart.abs() < 2e-3 * yielded, "{apart} of {yielded}");
}

/// Newton's method that may do no iteration gets nowhere under any drag. A block above the plate then falls, where it may, though it is no time yet
/// for a dynamic relaxation; else the increment is given up at once.
#[test]
fn bodies_relax_dynamically_where_steps_get_nowhere() {
    let (model, mut committed, mut loads) = block_on_plate(0.65);
    loads.applied[1].z = -1e4;
    committed.poses[1].position.z += 2e-5;
    let relaxation = Relaxation { after: 1000, bounds: [0.1, 0.03], most_steps: 100 };
    for relaxation in [None, Some(relaxation)] {
        let settings = Settings { max_newton: 0, relaxation, ..Settings::default() };
        let report = settle_with(&model, &committed, &loads, &settings);
        assert_eq!(report.converged(), relaxation.is_some(), "{:?}", report.history);
        let fell = committed.poses[1].position.z - report.poses[1].position.z;
        if relaxation.is_some() {
            assert!(report.counters.relaxation_steps > 100 && fell > 1e-5, "{fell}");
        } else {
            assert_eq!((report.counters.relaxation_steps, fell), (0, 0.0));
        }
    }
}

/// A block set down sideways slides and comes to rest; what its dynamic relaxation loses to friction is then
/// friction force times way.
#[test]
fn dynamic_relaxation_books_the_friction_of_its_way() {
    let (model, committed, mut loads) = pressed_block(0.3);
    // A force beyond the bound: it slides until the steps are used up.
    loads.applied[1].x = 1.2 * 0.3 * 1e4;
    let relaxation = Some(Relaxation { after: 0, bounds: [1e-3, 1e-4], most_steps: 100 });
    let settings = Settings { relaxation, max_augmentations: 1, ..Settings::default() };
    let report = settle_with(&model, &committed, &loads, &settings);
    let way = report.poses[1].position.x - committed.poses[1].position.x;
    let friction = report.lost.friction;
    // Its contacts press with 1e4 N to a few per cent while it moves, and the onset of sliding costs a few micrometres of way.
    assert!(way > 1e-4 && (friction / (0.3 * 1e4 * way) - 1.0).abs() < 0.1, "{way} {friction}");
}

/// A block that a force shoves beyond the bound: explicit steps sum the work of its contacts, the friction force times its way, which is what
/// friction is booked with, but for what its contacts store.
#[test]
fn explicit_steps_sum_the_work_of_their_way() {
    let (model, committed, mut loads) = pressed_block(0.3);
    loads.applied[1].x = 1.2 * 0.3 * 1e4;
    let settings = Settings::default();
    let mut newton = begun(&model, &committed, &loads, &settings, &committed.poses);
    let mut work = vec![Vector6::zeros(); 2];
    newton.relax_dynamically(Enough::InTheMean(1e-9), 100, Some(&mut work));
    let way = newton.poses[1].position.x - committed.poses[1].position.x;
    assert!(way > 1e-4 && (work[1].x / (-0.3 * 1e4 * way) - 1.0).abs() < 0.1, "{way} {work:?}");
    let friction = newton.losses().friction;
    assert!((work[1].sum() + friction).abs() < 0.02 * friction, "{work:?} {friction}");
    assert_eq!(work[0], Vector6::zeros());
}

/// Two edges that cross near the end of one of them: what explicit steps take a body to be held with is no less than what its force changes by.
#[test]
fn explicit_steps_are_no_longer_than_contacts_that_fade_allow() {
    let (below, below_shape) = block("below", [0.1; 3]);
    let (above, above_shape) = block("above", [0.1; 3]);
    let (half, overlap) = (0.05 - ROUNDING, 0.8 * ROUNDING);
    let (mut model, _, loads) = block_on_plate(0.0);
    let law = model.law;
    model = Model::new(vec![below, above], vec![below_shape, above_shape], law, Friction::constant(0.0));
    let turned = |axis: [f64; 3]| crate::tensor::Rotation::from_scaled_axis(Vec3::from(axis) * PI / 4.0);
    // The end of the upper edge is a quarter of the fade length beyond the lower one.
    let at = Vec3::new(half - 0.25 * law.fade_length, 0.0, 2.0 * (2f64.sqrt() * half + ROUNDING) - overlap);
    let poses =
        vec![Pose::new(Vec3::zeros(), turned([0.0, 1.0, 0.0])), Pose::new(at, turned([1.0, 0.0, 0.0]))];
    let committed = Committed::new(poses.clone());
    let settings = Settings::default();
    let newton = Newton::new(&model, &committed, &loads, &settings, Contacts::default(), poses);
    let mut newton = newton.unwrap_or_else(|_| panic!("too close"));
    let mut held = Vec::new();
    newton.stiffness_of_bodies_into(&mut held, true);
    let springs: f64 = newton.contacts.active().map(|(_, p)| p.evaluation.weight * p.state.spring).sum();
    let h = 1e-8;
    let changes = [Vec3::x(), Vec3::y(), Vec3::z()].map(|along| {
        let forces = [h, -h].map(|way| {
            newton.poses[1].position = at + way * along;
            assert!(newton.evaluate());
            newton.forces()[1].fixed_rows::<3>(0).into_owned()
        });
        (forces[0] - forces[1]).norm() / (2.0 * h)
    });
    let changes = changes.into_iter().fold(0.0, f64::max);
    assert!(changes > 4.0 * springs, "the weight matters here: {changes} {springs}");
    assert!(held[1][0] > 0.99 * changes, "{held:?} {changes}");
}

/// What contacts set free by getting softer is booked once, whether or not friction is re-based on the way.
#[test]
fn dynamic_relaxation_books_what_contacts_set_free_by_softening() {
    let (mut model, committed, loads) = pressed_block(0.3);
    make_brittle(&mut model, 1e5);
    let settings = Settings::default();
    let mut newton = begun(&model, &committed, &loads, &settings, &committed.poses);
    let mut books = vec![];
    for rebases in [false, false, true, false, true] {
        newton.contacts.note_loads(&model, &newton.loads, &newton.poses);
        newton.contacts.move_damage(&model, 0.02, 1e-5).expect("still a body");
        newton.contacts.forget_damaged_places(&model);
        assert!(newton.evaluate());
        let before = newton.losses().softening;
        // Places on bodies whose damage rests are those that would be found anew.
        newton.contacts.forget_places();
        assert!(newton.evaluate());
        assert_eq!(before, newton.losses().softening);
        if rebases {
            newton.rebase();
            assert!(newton.evaluate());
        }
        let behind = newton.losses().softening;
        assert!((behind - before).abs() <= 1e-9 * before, "{before} {behind}");
        books.push(behind);
    }
    // Contacts get softer all the way; in the second and third round by something that has to be carried over.
    assert!(books[0] > 0.0 && books[3] > 1.1 * books[2], "{books:?}");
}

/// Bodies that had bent when they came to rest keep what they had bent: their cores are nearer than the overlap of their contacts says. A load that
/// would overlap these by half of the roundings brings the cores to their floor (300 bending grains at 2.5 MPa stopped so at 6.88 %) unless
/// contacts harden by the distance of the cores. What they then do is known: all forces, springs' and hardenings', make up the load.
#[test]
fn cores_of_bodies_that_had_bent_stay_apart() {
    let (mut model, mut committed, mut loads) = pressed_block(0.3);
    make_brittle(&mut model, 1e12);
    let (roundings, bent, stiffness) = (2.0 * ROUNDING, 0.35 * 2.0 * ROUNDING, model.contact_stiffness(0, 1));
    let points = committed.memory.values_mut().flat_map(|pair| &mut pair.points);
    let count = points.map(|point| point.initial_overlap = -bent).count() as f64;
    assert_eq!(count, 4.0);
    loads.applied[1].z = -count * stiffness * 0.5 * roundings;
    let settings = Settings {
        damage: DamageSettings { moves: false, ..DamageSettings::default() },
        ..Settings::default()
    };
    let report = settle_with(&model, &committed, &loads, &settings);
    assert!(report.converged(), "{:?}", report.history);
    let overlap = -(report.poses[1].position.z - 0.05);
    assert!(overlap > 0.5 * roundings && overlap < (1.0 - CORE_FLOOR) * roundings, "{overlap}");
    let spring = model.law.normal(overlap - bent);
    let [hardening, _] = model.law.hardening(overlap, roundings).expect("beyond half of the roundings");
    let held = count * stiffness * (spring + hardening);
    assert!((held / -loads.applied[1].z - 1.0).abs() < 1e-3, "{held:e} of {:e}", loads.applied[1].z);
}

#[test]
fn a_raised_signal_has_the_increment_given_up() {
    let (model, committed, mut loads) = block_on_plate(0.65);
    loads.gravity = Vec3::new(0.0, 0.0, -9.81);
    let settings = Settings { stop: StopSignal::new(), ..Settings::default() };
    let attempt = || settle_with(&model, &committed, &loads, &settings);
    assert!(attempt().converged());
    // Copies of the settings hear the same signal.
    let careful = settings.clone();
    settings.stop.raise();
    assert!(careful.stop.is_raised() && !Settings::default().stop.is_raised());
    let report = attempt();
    assert_eq!(report.status, StepStatus::Abandoned);
    assert_eq!(report.counters.factorisations, 0);
}

/// A block pressed onto a plate until it is where it should be: the load that the control finds is the
/// contact force of a block that is put there, and the same whatever the guess.
#[test]
fn control_finds_the_load_that_a_position_needs() {
    let depth = 4e-5;
    let (model, committed, mut loads) = block_on_plate(0.65);
    let mut put = committed.clone();
    put.poses[1].position.z -= depth;
    loads.prescribed[1] = [true; 6];
    let settings = Settings::default();
    let increment = Increment { model: &model, committed: &committed, loads: &loads, settings: &settings };
    let held = advance(&increment, vec![put.poses.clone()], &mut Contacts::default());
    assert_eq!(held.status, StepStatus::Converged);
    let force = held.contact_wrench[1][2];
    assert!(force > 1e3, "{force}");

    loads.prescribed[1] = [false; 6];
    for guess in [0.0, 0.7 * force, 3.0 * force] {
        loads.control = Some(Control {
            pressure: 0.0,
            applied: vec![(1, Vector6::new(0.0, 0.0, -1.0, 0.0, 0.0, 0.0))],
            of: Controlled::Position { body: 1, axis: 2 },
            target: put.poses[1].position.z,
            tolerance: 1e-3 * depth,
            guess,
        });
        let report = settle(&model, &committed, &loads);
        assert_eq!(report.status, StepStatus::Converged, "{:?}", report.history);
        // As well as the position is met, and the forces balance: 1e-3 each.
        assert!((report.factor / force - 1.0).abs() < 2e-3, "{} N, not {force} N", report.factor);
        assert!((report.poses[1].position.z - put.poses[1].position.z).abs() <= 1e-3 * depth);
    }
}

/// Two bodies that touch by less than positions are known to, and nothing presses them: what rounding leaves is no force to be balanced.
#[test]
fn contacts_without_a_load_are_judged_by_rounding() {
    let (model, mut committed, loads) = block_on_plate(0.65);
    committed.poses[1].position.z -= 1e-15;
    let least = |loads: &Loads| {
        let contacts = contacts_at(&model, &committed, &committed.poses);
        let mean = contacts.mean_force();
        let dofs = Dofs::new(&model, loads);
        [mean, Yardsticks::new(&model, &dofs, &contacts, loads, &committed.poses).least()]
    };
    let [force, yardstick] = least(&loads);
    let rounding = f64::EPSILON * model.typical_stiffness() * 0.1;
    assert!(force > 0.0 && force < rounding, "{force} {rounding}");
    assert!(yardstick > rounding, "{yardstick} {rounding}");
    // A load counts, however small.
    let mut loaded = loads;
    loaded.applied[1].z = -rounding;
    assert!(least(&loaded)[1] < rounding);
}
