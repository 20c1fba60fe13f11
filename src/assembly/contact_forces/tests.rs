//! The assembled stiffness of contact forces as unknowns against differences of the assembled forces.

use super::*;
use crate::assembly::cubes::{contacts_at, pile, product, unpatterned};
use crate::assembly::{Contacts, contact_stiffness_into, residual_into};
use crate::contact::face::FaceContact;
use crate::model::{Committed, Deformation, Loads, Model};
use crate::tensor::Pose;

/// Edges of the lower two cross near the end of one.
fn condensed_pile(faces: FaceContact) -> (Model, Committed, Loads) {
    let (model, committed, loads) = pile(-11e-3, Deformation::condensed);
    (model.with_faces(faces), committed, loads)
}

/// What the unknown forces lack, and the rows of bodies without any of it.
fn forces(contacts: &Contacts, model: &Model, dofs: &Dofs, poses: &[Pose]) -> (Vec<f64>, Vec<Vec3>) {
    let mut rows = Vec::new();
    residual_into(&mut rows, model, dofs, contacts, &Loads::none(3), poses);
    let excess: Vec<Vec3> = contacts
        .unknown_forces
        .unknowns
        .iter()
        .map(|unknown| {
            let law =
                contacts.point_of(unknown).map_or(Vec3::zeros(), |point| point.evaluation.bending_force());
            law - unknown.force
        })
        .collect();
    for (unknown, excess) in contacts.unknown_forces.unknowns.iter().zip(&excess) {
        let Some(point) = contacts.point_of(unknown) else { continue };
        let [a, b] = [unknown.key.0 as usize, unknown.key.1 as usize];
        let lift = plain_lift(&point.evaluation.point, [&poses[a].position, &poses[b].position]);
        let wrench = lifted(&lift, excess);
        dofs.scatter(&mut rows, a, &wrench[..6]);
        dofs.scatter(&mut rows, b, &wrench[6..]);
    }
    (rows, excess)
}

#[test]
fn stiffness_is_derivative_of_combined_rows() {
    compare(FaceContact::Corners);
}

#[test]
fn stiffness_of_patches_is_derivative_of_combined_rows() {
    compare(FaceContact::Area);
}

fn compare(faces: FaceContact) {
    let (model, committed, loads) = condensed_pile(faces);
    let mut dofs = Dofs::new(&model, &loads);
    let mut contacts = contacts_at(&model, &committed, &committed.poses);
    assert!(contacts.gather(&model, &loads, &committed.poses), "new unknowns");
    dofs.renew_contacts(contacts.unknown_forces.owners());
    // Two patches have four cells each.
    let [unknowns, touching] = if faces == FaceContact::Area { [8, 8] } else { [11, 9] };
    assert!(contacts.unknown_forces.count() >= unknowns, "{} unknowns", contacts.unknown_forces.count());
    // Bodies turned and forces that are not the law's, so that no term vanishes by chance.
    let start: Vec<f64> = unpatterned(dofs.count(), 1).iter().map(|x| 5e-6 * x).collect();
    let mut began = committed.poses.clone();
    dofs.move_into(&mut began, &committed.poses, &start, 1.0);
    let mut at = |step: &[f64]| {
        let mut poses = began.clone();
        dofs.move_into(&mut poses, &began, step, 1.0);
        let away: Vec<f64> = start.iter().zip(step).map(|(start, step)| start + step).collect();
        contacts.unknown_forces.move_by(&dofs, &away);
        contacts.yield_to_forces(0.0);
        contacts.evaluate(&model, &committed, &poses).expect("far enough apart");
        let (rows, excess) = forces(&contacts, &model, &dofs, &poses);
        contacts.update_tangents(&model, &poses, |_| true);
        let touching = contacts.pairs.iter().map(|pair| (pair.a(), pair.b()));
        let pattern = BlockPattern::new(&dofs, touching.chain(contacts.unknown_forces.couplings(&dofs)));
        let mut values = vec![0.0; pattern.entries()];
        contact_stiffness_into(&mut values, &pattern, &dofs, &contacts);
        contacts.unknown_forces.stiffness_into(&mut values, &pattern, &dofs);
        (rows, excess, pattern, values, contacts.unknown_forces.clone())
    };
    let (_, _, pattern, values, unknown_forces) = at(&vec![0.0; dofs.count()]);
    let active = unknown_forces
        .unknowns
        .iter()
        .filter(|unknown| unknown.tangent.by_displacement != Mat3::zeros())
        .count();
    let faded = unknown_forces
        .unknowns
        .iter()
        .filter(|unknown| unknown.tangent.lift != unknown.tangent.plain)
        .count();
    let fades = faded > 0 || faces == FaceContact::Area;
    assert!(active >= touching && fades, "{active} touch, {faded} of them with part of their weight");
    let scale = values.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    for seed in 2..6 {
        let direction = unpatterned(dofs.count(), seed);
        let moved = |h: f64| -> Vec<f64> { direction.iter().map(|d| h * d).collect() };
        let h = 1e-10;
        let (plus, minus) = (at(&moved(h)), at(&moved(-h)));
        let mut difference: Vec<f64> =
            minus.0.iter().zip(&plus.0).map(|(m, p)| (m - p) / (2.0 * h)).collect();
        for ((unknown, minus), plus) in unknown_forces.unknowns.iter().zip(&minus.1).zip(&plus.1) {
            let excess = (minus - plus) / (2.0 * h);
            let wrench = lifted(&unknown.tangent.lift, &-excess);
            dofs.scatter(&mut difference, unknown.key.0 as usize, &wrench[..6]);
            dofs.scatter(&mut difference, unknown.key.1 as usize, &wrench[6..]);
        }
        for (i, exact) in product(&pattern, &values, &direction).iter().enumerate() {
            // Forces of 1e4 N, differences of 0.1 N: rounding leaves 1e-7.
            assert!(
                (difference[i] - exact).abs() < 1e-6 * scale,
                "unknown {i}: {} {exact} of {scale}",
                difference[i]
            );
        }
    }
}

/// Solving with the forces eliminated pair by pair, `P`, and the rest, `E`: at once by a dense factor of the whole matrix.
#[test]
fn split_is_the_stiffness() {
    let (model, committed, loads) = condensed_pile(FaceContact::Corners);
    let mut dofs = Dofs::new(&model, &loads);
    let mut contacts = contacts_at(&model, &committed, &committed.poses);
    contacts.gather(&model, &loads, &committed.poses);
    dofs.renew_contacts(contacts.unknown_forces.owners());
    let away: Vec<f64> = unpatterned(dofs.count(), 1).iter().map(|x| 5e-6 * x).collect();
    let mut poses = committed.poses.clone();
    dofs.move_into(&mut poses, &committed.poses, &away, 1.0);
    contacts.unknown_forces.move_by(&dofs, &away);
    contacts.yield_to_forces(0.0);
    contacts.evaluate(&model, &committed, &poses).expect("far enough apart");
    contacts.update_tangents(&model, &poses, |_| true);
    let (unknown_forces, bodies) = (&contacts.unknown_forces, dofs.without_contacts());
    let touching = || contacts.pairs.iter().map(|pair| (pair.a(), pair.b()));
    let whole = BlockPattern::new(&dofs, touching().chain(unknown_forces.couplings(&dofs)));
    let split = BlockPattern::new(&bodies, touching().chain(unknown_forces.eliminated_couplings()));
    let mut values = [&whole, &split].map(|pattern| vec![0.0; pattern.entries()]);
    let mut elimination = PairElimination::default();
    assert!(unknown_forces.eliminate_into(&mut elimination), "no pair is singular");
    for (pattern, values) in [&whole, &split].into_iter().zip(&mut values) {
        contact_stiffness_into(values, pattern, &dofs, &contacts);
        pattern.add_diagonal(values, &dofs, |body| if body < dofs.carriers() { 1e6 } else { 0.0 });
    }
    unknown_forces.stiffness_into(&mut values[0], &whole, &dofs);
    unknown_forces.eliminated_stiffness_into(&mut values[1], &split, &dofs, &elimination);
    // P x = b - E x for a solution of the whole: bodies' rows by the split, forces' rows by what is eliminated.
    let x = unpatterned(dofs.count(), 7);
    let b = product(&whole, &values[0], &x);
    let (motion, forces) = x.split_at(bodies.count());
    let mut across = vec![0.0; forces.len()];
    elimination.across_into(&mut across, unknown_forces, forces);
    let rows: Vec<f64> = b[bodies.count()..].iter().zip(&across).map(|(row, across)| row - across).collect();
    let mut alone = vec![0.0; forces.len()];
    elimination.forces_into(&mut alone, &rows);
    let mut right = b[..bodies.count()].to_vec();
    elimination.lift_into(&mut right, unknown_forces, &dofs, &alone);
    let largest = |v: &[f64]| v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    for (left, right) in product(&split, &values[1], motion).iter().zip(&right) {
        assert!((left - right).abs() < 1e-9 * largest(&b), "{left} {right} of {}", largest(&b));
    }
    elimination.follow(&mut alone, &dofs, motion);
    let scale = largest(forces);
    for (found, force) in alone.iter().zip(forces) {
        assert!((found - force).abs() < 1e-9 * scale, "{found} {force} of {scale}");
    }
    assert!(largest(&across) > 1e-3 * largest(&rows), "pairs act on each other");
}
