//! Forces and stiffness of a rigid wall's contacts, and the pressure on whatever confines the side: flexible cover,
//! membrane or wall.

use crate::assembly::dofs::Dofs;
use crate::assembly::pattern::BlockPattern;
use crate::model::wall::WallContact;
use crate::model::{BodyKind, Loads, Model, RigidWall};
use crate::tensor::{Pose, Vec3, Vector6};

/// Lists the core vertices that press against the wall; `corners` are those of every body in space [m].
pub fn touch_wall_into(
    found: &mut Vec<WallContact>,
    model: &Model,
    wall: &RigidWall,
    corners: &[Vec<Vec3>],
    poses: &[Pose],
) {
    found.clear();
    let radius = wall.radius(poses);
    for (body, shape) in model.shapes.iter().enumerate() {
        let reach = poses[body].position.xy().norm() + shape.outer_radius();
        if model.bodies[body].kind == BodyKind::Plate || reach < radius {
            continue;
        }
        let corner = (shape.rounded.radius, model.bodies[body].stiffness);
        wall.touch_into(found, poses, (body, &corners[body]), corner, &model.law);
    }
}

/// Adds the forces of the wall's contacts on bodies and wall to `wrenches`, one per carrier [N, N m].
pub fn wall_forces_into(
    wrenches: &mut [Vector6<f64>],
    wall: &RigidWall,
    contacts: &[WallContact],
    poses: &[Pose],
) {
    for contact in contacts {
        wrenches[contact.body] += contact.wrench(&poses[contact.body].position);
        wrenches[wall.carrier][0] += contact.pressure;
    }
}

/// The carriers that the wall couples.
pub fn wall_couplings<'a>(
    wall: &'a RigidWall,
    contacts: &'a [WallContact],
) -> impl Iterator<Item = (usize, usize)> + 'a {
    let touching = contacts.iter().map(|contact| (contact.body, wall.carrier));
    touching.chain(wall.coupled())
}

/// The stiffness of the wall's contacts and of the pressure on it.
pub fn wall_stiffness_into(
    values: &mut [f64],
    model: &Model,
    pattern: &BlockPattern,
    dofs: &Dofs,
    contacts: &[WallContact],
    loads: &Loads,
    poses: &[Pose],
) {
    let Some(wall) = &model.wall else { return };
    for contact in contacts {
        let (motion, by_radius) = contact.tangent(&poses[contact.body].position);
        pattern.add_block(values, dofs, contact.body, contact.body, &motion.map(|row| row.map(|k| -k)));
        let (mut on_body, mut on_wall) = ([[0.0; 6]; 6], [[0.0; 6]; 6]);
        for (k, entry) in by_radius.iter().enumerate() {
            on_body[k][0] = -entry;
            on_wall[0][k] = -entry;
        }
        pattern.add_block(values, dofs, contact.body, wall.carrier, &on_body);
        pattern.add_block(values, dofs, wall.carrier, contact.body, &on_wall);
        let mut own = [[0.0; 6]; 6];
        own[0][0] = contact.slope;
        pattern.add_block(values, dofs, wall.carrier, wall.carrier, &own);
    }
    wall.for_each_tangent_entry(poses, loads.pressure, |i, j, row, column, k| {
        let mut block = [[0.0; 6]; 6];
        block[row][column] = -k;
        pattern.add_block(values, dofs, i, j, &block);
    });
}

/// Adds the loads of `pressure` [Pa] on what confines the side and on the ends to `wrenches`, one per carrier [N, N m].
pub fn pressure_loads_into(wrenches: &mut [Vector6<f64>], model: &Model, poses: &[Pose], pressure: f64) {
    if let Some(cover) = &model.cover {
        cover.loads_into(wrenches, poses, pressure);
    }
    if let Some(wall) = &model.wall {
        wall.loads_into(wrenches, poses, pressure);
    }
}
