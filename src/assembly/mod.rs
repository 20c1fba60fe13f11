//! Residual and tangent of the model in one configuration.
//!
//! Unknowns are the free components of the motion of all carriers, bodies and nodes of the membrane: translations [m] and rotations times
//! the body's rotation scale [m], so that all entries have the units of a stiffness [N/m] and all
//! residuals of a force [N]. The residual is the force that is out of balance.

pub mod contact_forces;
pub mod contacts;
mod crushing;
pub mod damage;
mod dissipation;
pub mod dofs;
pub mod elastic;
mod faces;
pub mod fidelity;
mod following;
mod inherit;
mod losses;
pub mod membrane;
mod memory;
mod pair;
pub mod pattern;
pub mod place;
mod point;
mod rubber;
mod sites;
mod springs;
pub mod timings;
pub mod too_close;
mod trial;
pub mod wall;

pub use contact_forces::ContactForces;
pub use contacts::Contacts;
pub use damage::{DamageStep, Damages, Failing};
pub use dofs::Dofs;
pub use fidelity::{ForceChange, Recovery, is_free_to_change};
pub use losses::Losses;
pub use membrane::MembraneContacts;
pub use pair::{Borne, PairWork};
pub use pattern::BlockPattern;
pub use place::{OVERESTIMATE, SurfaceField};
pub use point::ContactPoint;
pub use rubber::{membrane_couplings, membrane_forces_into, membrane_stiffness_into, membrane_touching};
pub use timings::{Kernel, Timings};
pub use too_close::TooClose;
pub use wall::{pressure_loads_into, wall_couplings, wall_forces_into, wall_stiffness_into};

use crate::model::{Loads, Model};
use crate::tensor::{Pose, Vec3, Vector6};

/// Forces and moments of contacts, of what covers the side under a pressure [Pa], and of weight in a gravity [m/s2] on every carrier [N, N m]: all but
/// those applied from outside.
pub fn carrier_forces_into(
    wrenches: &mut Vec<Vector6<f64>>,
    model: &Model,
    contacts: &Contacts,
    weighing: (f64, Vec3),
    poses: &[Pose],
) {
    wrenches.clear();
    wrenches.resize(model.carriers(), Vector6::zeros());
    add_contact_forces(wrenches, contacts, |_| true);
    add_other_forces(wrenches, model, contacts, weighing, poses);
}

/// The part of [`carrier_forces_into`] that is of contacts between bodies, of those pairs that `counts` holds for, by number in their list.
pub fn add_contact_forces(
    wrenches: &mut [Vector6<f64>],
    contacts: &Contacts,
    counts: impl Fn(usize) -> bool,
) {
    for (_, pair) in contacts.pairs.iter().enumerate().filter(|(number, _)| counts(*number)) {
        for Borne { wrench, .. } in &pair.borne {
            for k in 0..6 {
                wrenches[pair.a()][k] += wrench[k];
                wrenches[pair.b()][k] += wrench[6 + k];
            }
        }
    }
}

/// The rest of it.
pub fn add_other_forces(
    wrenches: &mut [Vector6<f64>],
    model: &Model,
    contacts: &Contacts,
    (pressure, gravity): (f64, Vec3),
    poses: &[Pose],
) {
    if model.cover.is_some() || model.wall.is_some() {
        pressure_loads_into(wrenches, model, poses, pressure);
        if let Some(membrane) = &model.membrane {
            membrane_forces_into(wrenches, membrane, contacts, poses);
        }
        if let Some(wall) = &model.wall {
            wall_forces_into(wrenches, wall, &contacts.wall, poses);
        }
    }
    if gravity != Vec3::zeros() {
        for ((wrench, body), pose) in wrenches.iter_mut().zip(&model.bodies).zip(poses) {
            *wrench += body.weight(&gravity, pose);
        }
    }
}

/// Whether any of the two bodies is free: where few are solved for, most pairs have none of them.
fn is_felt(pair: &PairWork, dofs: &Dofs) -> bool {
    dofs.is_free(pair.a()) || dofs.is_free(pair.b())
}

/// Adds every force on the free components into `residual` [N], which it clears first.
pub fn residual_into(
    residual: &mut Vec<f64>,
    model: &Model,
    dofs: &Dofs,
    contacts: &Contacts,
    loads: &Loads,
    poses: &[Pose],
) {
    residual.clear();
    residual.resize(dofs.count(), 0.0);
    let mut wrenches = vec![Vector6::zeros(); model.carriers()];
    add_contact_forces(&mut wrenches, contacts, |number| is_felt(&contacts.pairs[number], dofs));
    add_other_forces(&mut wrenches, model, contacts, (loads.pressure, loads.gravity), poses);
    for (i, wrench) in wrenches.iter().enumerate() {
        let applied = loads.applied.get(i).copied().unwrap_or_else(Vector6::zeros);
        dofs.scatter(residual, i, (wrench + applied).as_slice());
    }
    contacts.unknown_forces_into(residual, dofs, poses);
}

/// Adds the stiffness of all active contacts into `values`, laid out by `pattern`. Call
/// [`Contacts::update_tangents`] first.
pub fn contact_stiffness_into(values: &mut [f64], pattern: &BlockPattern, dofs: &Dofs, contacts: &Contacts) {
    for pair in contacts.pairs.iter().filter(|pair| is_felt(pair, dofs)) {
        let (a, b) = (pair.a(), pair.b());
        for tangent in &pair.tangents {
            for (row_body, first_row) in [(a, 0), (b, 6)] {
                let mut on_a = [[0.0; 6]; 6];
                let mut on_b = [[0.0; 6]; 6];
                for r in 0..6 {
                    let row = &tangent[first_row + r];
                    for c in 0..3 {
                        on_b[r][c] = -row[c];
                        on_b[r][3 + c] = -row[3 + c];
                        on_a[r][c] = row[c];
                        on_a[r][3 + c] = -row[6 + c];
                    }
                }
                pattern.add_block(values, dofs, row_body, a, &on_a);
                pattern.add_block(values, dofs, row_body, b, &on_b);
            }
        }
    }
}

/// The geometric stiffness of gravity acting off a body's reference point:
/// minus the derivative of the moment `(R c) x w` by the spin of the body.
pub fn gravity_stiffness_into(
    values: &mut [f64],
    model: &Model,
    pattern: &BlockPattern,
    dofs: &Dofs,
    loads: &Loads,
    poses: &[Pose],
) {
    if loads.gravity == Vec3::zeros() {
        return;
    }
    for (i, body) in model.bodies.iter().enumerate() {
        let arm = poses[i].rotation * body.centre_of_mass;
        let weight = loads.gravity * body.mass;
        // d/dtheta of (theta x arm) x w = -(w x (theta x arm)).
        let block = weight.cross_matrix() * -arm.cross_matrix();
        let mut full = [[0.0; 6]; 6];
        for r in 0..3 {
            for c in 0..3 {
                full[3 + r][3 + c] = block[(r, c)];
            }
        }
        pattern.add_block(values, dofs, i, i, &full);
    }
}

/// The stiffness of the cover's follower pressure: minus the derivative of its loads.
pub fn cover_stiffness_into(
    values: &mut [f64],
    model: &Model,
    pattern: &BlockPattern,
    dofs: &Dofs,
    loads: &Loads,
    poses: &[Pose],
) {
    let Some(cover) = &model.cover else { return };
    let wanted = |i: usize, j: usize| dofs.is_free(i) && dofs.is_free(j);
    cover.for_each_tangent_block(poses, loads.pressure, wanted, |i, j, tangent| {
        let mut block = [[0.0; 6]; 6];
        for (r, row) in block.iter_mut().enumerate() {
            for (c, entry) in row.iter_mut().enumerate() {
                *entry = -tangent[(r, c)];
            }
        }
        pattern.add_block(values, dofs, i, j, &block);
    });
}

#[cfg(test)]
pub(crate) mod cubes;
#[cfg(test)]
mod tests;
