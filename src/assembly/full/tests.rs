//! The assembled stiffness of full bodies against differences of the assembled forces.

use std::sync::Arc;

use super::*;
use crate::assembly::cubes::{pile, product, unpatterned};
use crate::assembly::{contact_stiffness_into, residual_into};
use crate::contact::face::FaceContact;
use crate::element::Strains;
use crate::grain::FullGrain;
use crate::model::Committed;
use crate::tensor::Rotation;

fn full_pile(faces: FaceContact, tilt: f64) -> (Model, Committed, Loads) {
    let (model, mut committed, loads) = pile(1e-3, |body, mesh, rock| {
        body.full = Some(Arc::new(FullGrain::new(mesh, rock, 2700.0, Strains::Finite).expect("a grain")));
    });
    let upper = &mut committed.poses[2];
    upper.rotation = Rotation::from_scaled_axis(Vec3::new(0.0, tilt, 0.0)) * upper.rotation;
    (model.with_faces(faces), committed, loads)
}

#[test]
fn stiffness_is_derivative_of_forces() {
    compare(FaceContact::Corners, 0.0, 10);
}

/// Faces in full and, of the upper two cubes, in the fade between patch and corners.
#[test]
fn stiffness_of_patches_is_derivative_of_forces() {
    compare(FaceContact::Area, 0.0, 20);
    compare(FaceContact::Area, 4e-3, 12);
}

fn compare(faces: FaceContact, tilt: f64, least: usize) {
    let (model, committed, loads) = full_pile(faces, tilt);
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
    assert!(touching > least, "{touching} contacts");
    let scale = values.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    for seed in 2..6 {
        let direction = unpatterned(dofs.count(), seed);
        let moved = |h: f64| -> Vec<f64> { direction.iter().map(|d| h * d).collect() };
        let h = 1e-10;
        let (plus, minus) = (forces_at(&moved(h)).0, forces_at(&moved(-h)).0);
        for (i, exact) in product(&pattern, &values, &direction).iter().enumerate() {
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
    let (model, committed, loads) = full_pile(FaceContact::Corners, 0.0);
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
