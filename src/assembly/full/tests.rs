//! The assembled stiffness of full bodies against differences of the assembled forces.

use std::sync::Arc;

use super::*;
use crate::assembly::{contact_stiffness_into, residual_into};
use crate::contact::law::Friction;
use crate::contact::{ContactLaw, ContactShape};
use crate::element::Strains;
use crate::geometry::{Polyhedron, RoundedBody};
use crate::grain::FullGrain;
use crate::material::Elastic;
use crate::mesh::cuboid_mesh;
use crate::model::{Body, BodyKind, Committed};
use crate::tensor::Rotation;

const EDGE: f64 = 0.03;
const ROUNDING: f64 = 1e-3;

/// Three cubes in a pile, askew, overlapping by about 10 um: two full ones on a rigid one.
fn pile() -> (Model, Committed, Loads) {
    let block = |index: usize| {
        let mesh = cuboid_mesh([EDGE; 3], EDGE).expect("a mesh");
        let rock = vec![Elastic::new(30e9, 0.2).expect("allowed"); mesh.cells.len()];
        let full = FullGrain::new(mesh, &rock, 2700.0, Strains::Finite).expect("a grain");
        let core = Polyhedron::cuboid([EDGE - 2.0 * ROUNDING; 3]).expect("a box");
        let body = Body {
            name: "cube".into(),
            kind: BodyKind::Placed,
            nominal: Polyhedron::cuboid([EDGE; 3]).expect("a box"),
            stiffness: 1e8,
            grain: None,
            damaged: None,
            resting: None,
            full: (index > 0).then(|| Arc::new(full)),
            friction: None,
            mass: 0.07,
            centre_of_mass: Vec3::zeros(),
            rotation_scale: 0.02,
        };
        (body, ContactShape::new(RoundedBody { core, radius: ROUNDING }))
    };
    let (bodies, shapes): (Vec<Body>, Vec<ContactShape>) = (0..3).map(block).unzip();
    let law = ContactLaw {
        onset: 4e-6,
        fade_length: 1e-3,
        parallel_limit: 4e-3,
        tangential_ratio: 0.9,
        friction_blend: 0.05,
    };
    let place = |index: usize| {
        let height = index as f64 * (EDGE - 20e-6);
        let turn = Vec3::new(2e-4, -3e-4, 0.35 * index as f64);
        Pose::new(Vec3::new(1e-3 * index as f64, -2e-3, height), Rotation::from_scaled_axis(turn))
    };
    let model = Model::new(bodies, shapes, law, Friction::constant(0.4));
    (model, Committed::new((0..3).map(place).collect()), Loads::none(3))
}

/// A vector without pattern, the same on every machine.
fn unpatterned(count: usize, seed: usize) -> Vec<f64> {
    (0..count).map(|k| ((k * 7919 + seed * 104_729 + 13) % 1009) as f64 / 1009.0 - 0.5).collect()
}

#[test]
fn stiffness_is_derivative_of_forces() {
    let (model, committed, loads) = pile();
    let dofs = Dofs::new(&model, &loads);
    let mut contacts = Contacts::default();
    contacts.start(&model, &committed);
    // Displaced nodes, turned bodies and multipliers, so that no term vanishes by chance.
    let start: Vec<f64> = unpatterned(dofs.count(), 1).iter().map(|x| 1e-5 * x).collect();
    contacts.evaluate(&model, &committed, &committed.poses).expect("far enough apart");
    let mut began = committed.poses.clone();
    dofs.move_into(&mut began, &committed.poses, &start, 1.0);
    // The tangent is by spins from the present poses.
    let mut forces_at = |step: &[f64]| {
        let mut poses = began.clone();
        dofs.move_into(&mut poses, &began, step, 1.0);
        let away: Vec<f64> = start.iter().zip(step).map(|(start, step)| start + step).collect();
        contacts.move_nodes(&dofs, &away);
        contacts.evaluate(&model, &committed, &poses).expect("far enough apart");
        let mut residual = Vec::new();
        residual_into(&mut residual, &model, &dofs, &contacts, &loads, &poses);
        contacts.update_tangents(&model, &poses);
        let couplings = full_couplings(&model, &dofs, &contacts, false);
        let touching = contacts.pairs.iter().map(|pair| (pair.a(), pair.b()));
        let pattern = BlockPattern::new(&dofs, touching.chain(couplings));
        let mut values = vec![0.0; pattern.entries()];
        contact_stiffness_into(&mut values, &pattern, &dofs, &contacts);
        full_stiffness_into(&mut values, &model, &pattern, &dofs, &contacts);
        (residual, pattern, values, contacts.active().count())
    };
    let (_, pattern, values, touching) = forces_at(&vec![0.0; dofs.count()]);
    assert!(touching > 10, "{touching} contacts");
    let scale = values.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    for seed in 2..6 {
        let direction = unpatterned(dofs.count(), seed);
        let moved = |h: f64| -> Vec<f64> { direction.iter().map(|d| h * d).collect() };
        let h = 1e-10;
        let (plus, minus) = (forces_at(&moved(h)).0, forces_at(&moved(-h)).0);
        let mut product = vec![0.0; dofs.count()];
        for (column, d) in direction.iter().enumerate() {
            for k in pattern.pattern.column_starts[column]..pattern.pattern.column_starts[column + 1] {
                product[pattern.pattern.rows[k]] += values[k] * d;
            }
        }
        for (i, exact) in product.iter().enumerate() {
            let difference = (minus[i] - plus[i]) / (2.0 * h);
            // Forces of 1e4 N, differences of 0.1 N: rounding leaves 1e-7.
            assert!(
                (difference - exact).abs() < 1e-6 * scale,
                "unknown {i}: {difference} {exact} of {scale}"
            );
        }
    }
}

#[test]
fn a_moving_frame_does_no_work_on_the_nodes() {
    // Displacing a body's frame and its nodes the other way leaves every gap alone.
    let (model, committed, loads) = pile();
    let dofs = Dofs::new(&model, &loads);
    let mut contacts = Contacts::default();
    contacts.start(&model, &committed);
    contacts.evaluate(&model, &committed, &committed.poses).expect("far enough apart");
    let gaps = |contacts: &Contacts| -> Vec<f64> {
        contacts.active().map(|(_, point)| point.evaluation.gap).collect()
    };
    let before = gaps(&contacts);
    let shift = Vec3::new(3e-9, -2e-9, 4e-9);
    let mut away = vec![0.0; dofs.count()];
    dofs.scatter(&mut away, 1, &[shift.x, shift.y, shift.z, 0.0, 0.0, 0.0]);
    let first = dofs.nodes_of(1).expect("full");
    for node in first..first + contacts.fields[1].len() {
        dofs.scatter(&mut away, node, (committed.poses[1].rotation.inverse() * -shift).as_slice());
    }
    let mut poses = committed.poses.clone();
    dofs.move_into(&mut poses, &committed.poses, &away, 1.0);
    contacts.move_nodes(&dofs, &away);
    contacts.evaluate(&model, &committed, &poses).expect("far enough apart");
    let after = gaps(&contacts);
    assert_eq!(before.len(), after.len());
    for (before, after) in before.iter().zip(&after) {
        assert!((before - after).abs() < 1e-12, "{before} {after}");
    }
}
