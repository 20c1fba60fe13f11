//! The assembled stiffness against differences of the assembled forces.

use super::*;
use crate::assembly::cubes::{contacts_at, product, unpatterned};
use crate::contact::law::Friction;
use crate::contact::{ContactLaw, ContactShape};
use crate::geometry::{Polyhedron, RoundedBody};
use crate::material::{Rubber, RubberLaw};
use crate::model::membrane::Fastening;
use crate::model::{Body, BodyKind, Committed, Membrane, MembraneParameters, RigidWall};
use crate::tensor::Rotation;

const ROUNDING: f64 = 1e-3;
const HEIGHT: f64 = 0.06;
const RADIUS: f64 = 0.03;

fn block(kind: BodyKind, size: [f64; 3]) -> (Body, ContactShape) {
    let (body, shape) = Body::block("block", kind, size, ROUNDING, 0.02);
    (Body { mass: 1.0, ..body }, shape)
}

/// A turned block between two plates in a membrane that its edges and corners press against.
fn wrapped_block() -> (Model, Committed, Loads) {
    // Half diagonal of the core in plan: the membrane's middle less the roundings and 0.15 mm of overlap.
    let side = std::f64::consts::SQRT_2 * (RADIUS - 2e-3 + 1.5e-4) + 2.0 * ROUNDING;
    let parts = [
        block(BodyKind::Grain, [side, side, 0.7 * HEIGHT]),
        block(BodyKind::Plate, [0.2, 0.2, 0.02]),
        block(BodyKind::Plate, [0.2, 0.2, 0.02]),
    ];
    let (bodies, shapes): (Vec<Body>, Vec<ContactShape>) = parts.into_iter().unzip();
    let law = ContactLaw { onset: 4e-6, fade_length: 1e-3, ..ContactLaw::SAMPLE };
    let mut poses = vec![
        Pose::new(Vec3::new(0.0, 0.0, 0.5 * HEIGHT), Rotation::from_scaled_axis(Vec3::new(4e-3, 2e-3, 0.3))),
        Pose::new(Vec3::new(0.0, 0.0, -0.01), Rotation::identity()),
        Pose::new(Vec3::new(0.0, 0.0, HEIGHT + 0.01), Rotation::identity()),
    ];
    let parameters = MembraneParameters {
        rubber: Rubber::new(0.45e6, RubberLaw::Gent { limit: 20.0 }).expect("allowed"),
        thickness: 2e-3,
        mesh_size: 0.012,
        pressure: 2e5,
    };
    let fastening = |body: usize, height: f64| Fastening { body, pose: poses[body], height };
    let fastenings = [fastening(1, 0.0), fastening(2, HEIGHT)];
    let (membrane, cover, nodes) =
        Membrane::new(&parameters, 0.98 * RADIUS, RADIUS, &fastenings, 3, &law).expect("a membrane");
    poses.extend(nodes);
    let mut loads = Loads::none(3);
    loads.prescribed[1] = [true; 6];
    loads.prescribed[2] = [true, true, false, false, false, true];
    loads.free_nodes(membrane.free_nodes());
    loads.pressure = 2e5;
    let model = Model {
        cover: Some(cover),
        membrane: Some(membrane),
        ..Model::new(bodies, shapes, law, Friction::constant(0.5))
    };
    (model, Committed::new(poses), loads)
}

fn forces_at(
    model: &Model,
    committed: &Committed,
    loads: &Loads,
    dofs: &Dofs,
    step: &[f64],
    factor: f64,
) -> (Vec<f64>, Contacts, Vec<Pose>) {
    let mut poses = committed.poses.clone();
    dofs.move_into(&mut poses, &committed.poses, step, factor);
    let contacts = contacts_at(model, committed, &poses);
    let mut residual = Vec::new();
    residual_into(&mut residual, model, dofs, &contacts, loads, &poses);
    (residual, contacts, poses)
}

#[test]
fn membrane_stiffness_is_derivative_of_its_forces() {
    let (model, committed, loads) = wrapped_block();
    let dofs = Dofs::new(&model, &loads);
    // Off the symmetric start, so that no term vanishes by chance.
    let start = unpatterned(dofs.count(), 1);
    let (_, mut contacts, poses) = forces_at(&model, &committed, &loads, &dofs, &start, 2e-4);
    let touching: usize = contacts.membrane.bodies.iter().map(|list| list.points.len()).sum();
    assert!(touching > 8, "{touching} contacts");
    contacts.update_tangents(&model, &poses, |_| true);
    let membrane = model.membrane.as_ref().expect("there");
    let cover = model.cover.as_ref().expect("there");
    let couplings = cover
        .coupled_bodies()
        .map(|[a, b]| (a, b))
        .chain(membrane_couplings(membrane, &contacts))
        .chain(contacts.pairs.iter().map(|p| (p.a(), p.b())));
    let pattern = BlockPattern::new(&dofs, couplings);
    let mut values = vec![0.0; pattern.entries()];
    contact_stiffness_into(&mut values, &pattern, &dofs, &contacts);
    cover_stiffness_into(&mut values, &model, &pattern, &dofs, &loads, &poses);
    membrane_stiffness_into(&mut values, &model, &pattern, &dofs, &contacts, &poses);
    let at = Committed { poses, ..committed };
    for seed in 2..6 {
        let direction = unpatterned(dofs.count(), seed);
        let h = 1e-8;
        let (plus, ..) = forces_at(&model, &at, &loads, &dofs, &direction, h);
        let (minus, ..) = forces_at(&model, &at, &loads, &dofs, &direction, -h);
        let scale = membrane.contact.stiffness;
        for (i, exact) in product(&pattern, &values, &direction).iter().enumerate() {
            let difference = (minus[i] - plus[i]) / (2.0 * h);
            // Contacts are stiffest; differences of their force are good to 1e-5 of that stiffness.
            assert!((difference - exact).abs() < 1e-5 * scale, "unknown {i}: {difference} {exact}");
        }
    }
}

#[test]
fn membrane_contacts_and_sheet_have_no_resultant() {
    let (model, committed, loads) = wrapped_block();
    let dofs = Dofs::new(&model, &loads);
    let (_, contacts, poses) =
        forces_at(&model, &committed, &loads, &dofs, &unpatterned(dofs.count(), 1), 2e-4);
    let membrane = model.membrane.as_ref().expect("there");
    let mut wrenches = vec![Vector6::zeros(); model.carriers()];
    membrane_forces_into(&mut wrenches, membrane, &contacts, &poses);
    let (mut force, mut moment, mut largest) = (Vec3::zeros(), Vec3::zeros(), 0.0f64);
    for (wrench, pose) in wrenches.iter().zip(&poses) {
        let own = Vec3::new(wrench[0], wrench[1], wrench[2]);
        force += own;
        moment += pose.position.cross(&own) + Vec3::new(wrench[3], wrench[4], wrench[5]);
        largest = largest.max(own.norm());
    }
    assert!(largest > 1.0);
    assert!(force.norm() < 1e-11 * largest && moment.norm() < 1e-12 * largest, "{force:?} {moment:?}");
}

/// A flat block that points at the wall with a corner: the wall meets the rounding before the core is there.
#[test]
fn the_wall_meets_a_corner_as_soon_as_its_rounding_is_there() {
    let parts = [
        block(BodyKind::Grain, [0.02, 0.02, 2.1 * ROUNDING]),
        block(BodyKind::Plate, [0.2, 0.2, 0.02]),
        block(BodyKind::Plate, [0.2, 0.2, 0.02]),
    ];
    let (bodies, shapes): (Vec<Body>, Vec<ContactShape>) = parts.into_iter().unzip();
    let corner = std::f64::consts::SQRT_2 * (0.01 - ROUNDING);
    let (wall, carrier) = RigidWall::new(3, [1, 2], [0.01, -0.01], RADIUS);
    let turn = Rotation::from_scaled_axis(Vec3::z() * std::f64::consts::FRAC_PI_4);
    let model = Model {
        wall: Some(wall),
        ..Model::new(
            bodies,
            shapes,
            ContactLaw { fade_length: 1e-3, ..ContactLaw::SAMPLE },
            Friction::constant(0.5),
        )
    };
    for overlap in [-1e-7, 1e-7, 1e-5, 0.5 * ROUNDING, 0.99 * ROUNDING] {
        let x = RADIUS + overlap - ROUNDING - corner;
        let poses = vec![
            Pose::new(Vec3::new(x, 0.0, 0.5 * HEIGHT), turn),
            Pose::new(Vec3::new(0.0, 0.0, -0.01), Rotation::identity()),
            Pose::new(Vec3::new(0.0, 0.0, HEIGHT + 0.01), Rotation::identity()),
            carrier,
        ];
        let committed = Committed::new(poses.clone());
        let contacts = contacts_at(&model, &committed, &poses);
        let deepest = contacts.wall.iter().map(|contact| contact.overlap).fold(0.0, f64::max);
        assert!((deepest - overlap.max(0.0)).abs() < 1e-12, "{overlap}: {deepest}");
    }
}

/// The body that a short edge of `length` [roundings] and a long one across it span, 20 roundings apart: the long one above.
fn spindle(length: f64) -> (Body, ContactShape) {
    let (body, _) = block(BodyKind::Grain, [0.02; 3]);
    let end = |x: f64, y: f64, z: f64| Vec3::new(x, y, z) * ROUNDING;
    let half = 0.5 * length;
    let corners = [end(half, 0.0, 0.0), end(-half, 0.0, 0.0), end(0.0, 8.0, 20.0), end(0.0, -8.0, 20.0)];
    let core = Polyhedron::convex_hull(&corners).expect("four corners");
    (body, ContactShape::new(RoundedBody { core, radius: ROUNDING }))
}

/// However short the edge that another one slides over, and however deep: the force along it changes no faster than some contacts' springs.
#[test]
fn an_edge_that_slides_over_a_short_one_pushes_smoothly() {
    for length in [0.1, 0.4, 0.7, 1.0, 1.5, 2.0, 4.0] {
        let (bodies, shapes): (Vec<Body>, Vec<ContactShape>) =
            [spindle(20.0), spindle(length)].into_iter().unzip();
        let law = ContactLaw { onset: 4e-6, fade_length: ROUNDING, ..ContactLaw::SAMPLE };
        let model = Model::new(bodies, shapes, law, Friction::constant(0.0));
        // The long edge of the lower body lies across the short one of the upper body, 0.7 roundings below it.
        let lower = Pose::new(Vec3::new(0.0, 0.0, -20.0 * ROUNDING), Rotation::identity());
        let loads = Loads::none(2);
        let dofs = Dofs::new(&model, &loads);
        let push = |x: f64| {
            let upper = Pose::new(Vec3::new(x, 0.0, 0.7 * ROUNDING), Rotation::identity());
            let committed = Committed::new(vec![lower, upper]);
            let (residual, ..) = forces_at(&model, &committed, &loads, &dofs, &vec![0.0; dofs.count()], 0.0);
            let along = dofs.of(1)[0].expect("free") as usize;
            residual[along]
        };
        let step = 2e-3 * ROUNDING;
        let slopes =
            (-1500..1500).map(|k| (push(f64::from(k + 1) * step) - push(f64::from(k) * step)) / step);
        let steepest = slopes.map(f64::abs).fold(0.0, f64::max);
        let spring = model.contact_spring(0, 1);
        assert!(steepest > 0.1 * spring, "{length}: nothing touches");
        assert!(steepest < 10.0 * spring, "{length}: {} springs", steepest / spring);
    }
}
