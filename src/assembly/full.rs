//! Grains all of whose nodes are unknowns: forces and stiffness of nodes, frames and contacts together. (Where their nodes are
//! eliminated grain by grain, `grain::full`, they are condensed bodies here, with a displacement besides that each augmentation renews.)
//!
//! A full grain has its frame, the displacements `u` of its nodes in it, and six multipliers `y` that keep the frame
//! where the mean motion `G u` of the nodes vanishes. Contacts see the frame's geometry and the displacement of the
//! surface in their gap, as for condensed grains (`assembly::elastic`), here with the displacements of the same
//! configuration: `n.(R_b u_b - R_a u_a)` at places and with rotations R that stay for one augmentation. What is left
//! between two augmentations of these is of second order in the increment and gone at rest.
//!
//! Forces on a node [N], in the frame: of contacts and cover, less the derivative of the strain energy, less `s G^T y`;
//! on the multipliers `-s G u`, with a stiffness s [N/m] that gives them the unit of the others. The tangent is exact but
//! for what a change of shape or pose does to the loads of cover and membrane on the nodes (a pressure over a modulus,
//! relatively).

use rayon::prelude::*;

use crate::assembly::contacts::{Contacts, PairWork};
use crate::assembly::elastic::{Spot, SurfaceField, for_each_cover_force};
use crate::assembly::{BlockPattern, Dofs};
use crate::grain::SurfacePoint;
use crate::grain::full::NodeShare;
use crate::model::{Loads, Model};
use crate::tensor::{Mat3, Pose, Vec3};

/// Full bodies whose cells' stiffness is computed at once.
const BATCH: usize = 32;

/// Multipliers of the frames of full bodies, and where a Newton solve began.
#[derive(Debug, Clone, Default)]
pub struct Frames {
    /// In the unit of the unknowns [m], by body: of the mean displacement, and of the mean rotation.
    multipliers: Vec<[Vec3; 2]>,
    /// Displacements and multipliers at the proximal centre.
    centre: Vec<(SurfaceField, [Vec3; 2])>,
}

impl Contacts {
    /// Gives full bodies their nodes, undisplaced where nothing is committed yet.
    pub(super) fn start_nodes(&mut self, model: &Model) {
        self.frames.multipliers.clear();
        self.frames.multipliers.resize(model.bodies.len(), [Vec3::zeros(); 2]);
        self.surplus.clear();
        for (field, body) in self.fields.iter_mut().zip(&model.bodies) {
            if let Some(grain) = &body.full {
                field.resize(grain.nodes(), Vec3::zeros());
            }
            self.surplus
                .push(body.eliminated_nodes().map_or_else(SurfaceField::new, |grain| grain.surplus(field)));
        }
        self.recentre_nodes(model);
    }

    /// Displaces the nodes of full bodies to `fields` [m], by body, where those fit.
    pub fn place_nodes(&mut self, model: &Model, fields: &[SurfaceField]) {
        let full = model.bodies.iter().zip(fields).zip(&mut self.fields);
        for ((_, wanted), field) in full.filter(|((body, _), _)| body.nodes_among_unknowns().is_some()) {
            if wanted.len() == field.len() {
                field.clone_from(wanted);
            }
        }
        if !fields.is_empty() {
            self.recentre_nodes(model);
            self.update_reach();
        }
    }

    /// Makes the present displacements of full bodies those from which [`Self::move_nodes`] counts.
    pub fn recentre_nodes(&mut self, model: &Model) {
        let Frames { multipliers, centre } = &mut self.frames;
        centre.clear();
        if model.has_nodes() {
            centre.extend(self.fields.iter().cloned().zip(multipliers.iter().copied()));
        }
    }

    /// Displaces the nodes of full bodies by `away` (unknowns) from the centre.
    pub fn move_nodes(&mut self, dofs: &Dofs, away: &[f64]) {
        let Frames { multipliers, centre } = &mut self.frames;
        for (body, (field, multiplier)) in centre.iter().enumerate() {
            let Some(first) = dofs.nodes_of(body) else { continue };
            for (k, (u, centre)) in self.fields[body].iter_mut().zip(field).enumerate() {
                *u = centre + dofs.motion(away, 1.0, first + k).0;
            }
            let (shift, turn) = dofs.motion(away, 1.0, first + field.len());
            multipliers[body] = [multiplier[0] + shift, multiplier[1] + turn];
        }
        if !centre.is_empty() {
            self.update_reach();
        }
    }
}

/// Full bodies with their number and first block.
fn full_bodies<'a>(
    model: &'a Model,
    dofs: &'a Dofs,
) -> impl Iterator<Item = (usize, usize, &'a crate::grain::FullGrain)> {
    let full = |(body, b): (usize, &'a crate::model::Body)| {
        Some((body, dofs.nodes_of(body)?, &**b.nodes_among_unknowns()?))
    };
    model.bodies.iter().enumerate().filter_map(full)
}

/// Adds the forces on nodes and multipliers to `residual` [N].
pub(super) fn node_forces_into(
    residual: &mut [f64],
    model: &Model,
    dofs: &Dofs,
    contacts: &Contacts,
    loads: &Loads,
    poses: &[Pose],
) {
    if !model.has_nodes() {
        return;
    }
    let outer = contacts.surface_loads(model, loads, poses);
    let bodies: Vec<_> = full_bodies(model, dofs).collect();
    let forces: Vec<Vec<Vec3>> = bodies
        .par_iter()
        .map(|&(body, _, grain)| {
            let mut forces = Vec::new();
            grain.inner_forces_into(&mut forces, &contacts.fields[body]);
            let [shift, turn] = contacts.frames.multipliers[body];
            let stiffness = model.bodies[body].stiffness;
            for (force, NodeShare { mass, moment }) in forces.iter_mut().zip(grain.shares()) {
                *force = -*force - (shift * *mass + turn.cross(moment)) * stiffness;
            }
            for (place, force) in &outer[body] {
                add_at(&mut forces, place, force);
            }
            forces
        })
        .collect();
    for (&(body, first, grain), forces) in bodies.iter().zip(&forces) {
        for (k, force) in forces.iter().enumerate() {
            dofs.scatter(residual, first + k, force.as_slice());
        }
        let stiffness = model.bodies[body].stiffness;
        let [shift, turn] = grain.mean_motion(&contacts.fields[body]).map(|mean| mean * -stiffness);
        let lack = [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z];
        dofs.scatter(residual, first + grain.nodes(), &lack);
    }
}

fn add_at(forces: &mut [Vec3], place: &SurfacePoint, force: &Vec3) {
    for (&node, &weight) in place.nodes.iter().zip(&place.weights) {
        forces[node as usize] += force * weight;
    }
}

/// Adds what `pressure` on the cover puts on the nodes of full bodies to `forces` [N].
pub fn cover_on_nodes_into(forces: &mut [f64], model: &Model, dofs: &Dofs, poses: &[Pose], pressure: f64) {
    if !model.has_nodes() {
        return;
    }
    for_each_cover_force(model, poses, pressure, |body, place, force| {
        let Some(first) = dofs.nodes_of(body) else { return };
        let force = poses[body].rotation.inverse() * force;
        for (&node, &weight) in place.nodes.iter().zip(&place.weights) {
            dofs.scatter(forces, first + node as usize, (force * weight).as_slice());
        }
    });
}

/// A side of a contact whose nodes are unknowns: the sign of its displacement in the gap.
struct Side<'a> {
    first: usize,
    place: &'a SurfacePoint,
    turn: Mat3,
    sign: f64,
}

fn full_sides<'a>(dofs: &Dofs, pair: &PairWork, spot: &'a Spot) -> [Option<Side<'a>>; 2] {
    let side = |body: usize, place: &'a Option<SurfacePoint>, k: usize, sign: f64| {
        let turn = spot.turns[k].to_rotation_matrix().into_inner();
        Some(Side { first: dofs.nodes_of(body)?, place: place.as_ref()?, turn, sign })
    };
    [side(pair.a(), &spot.on_a, 0, -1.0), side(pair.b(), &spot.on_b, 1, 1.0)]
}

impl Side<'_> {
    fn nodes(&self) -> impl Iterator<Item = (usize, f64)> {
        let nodes = self.place.nodes.iter().zip(&self.place.weights);
        nodes
            .filter(|(_, weight)| **weight != 0.0)
            .map(|(&node, &weight)| (self.first + node as usize, weight))
    }
}

/// The couplings of full bodies, but for those of their contacts.
fn inner_couplings<'a>(model: &'a Model, dofs: &'a Dofs) -> impl Iterator<Item = (usize, usize)> {
    full_bodies(model, dofs).flat_map(|(_, first, grain)| {
        let place = move |node: u32| first + node as usize;
        let cells = grain.couplings().iter().map(move |&[i, j]| (place(i), place(j)));
        let multipliers = first + grain.nodes();
        cells.chain((first..multipliers).map(move |node| (node, multipliers)))
    })
}

/// The couplings of full bodies: within them, or (with `touching` alone) by contacts only.
pub fn full_couplings(
    model: &Model,
    dofs: &Dofs,
    contacts: &Contacts,
    touching: bool,
) -> Vec<(usize, usize)> {
    let mut all = Vec::new();
    if !model.has_nodes() {
        return all;
    }
    if !touching {
        all.extend(inner_couplings(model, dofs));
    }
    for pair in contacts.pairs.iter().filter(|pair| !pair.elastic_tangents.is_empty()) {
        for spot in pair.active().filter_map(|point| pair.spot(point.site.feature)) {
            let mut together = vec![pair.a(), pair.b()];
            for side in full_sides(dofs, pair, spot).iter().flatten() {
                together.extend(side.nodes().map(|(node, _)| node));
            }
            for (k, &a) in together.iter().enumerate() {
                all.extend(together[..k].iter().map(|&b| (b, a)));
            }
        }
    }
    all
}

/// A 3 x 3 block of stiffness as a 6 x 6 one.
fn in_corner(block: &Mat3) -> [[f64; 6]; 6] {
    let mut whole = [[0.0; 6]; 6];
    for r in 0..3 {
        for c in 0..3 {
            whole[r][c] = block[(r, c)];
        }
    }
    whole
}

/// Adds the stiffness of full bodies and of their nodes in contacts to `values`. Call
/// [`Contacts::update_tangents`] first.
pub fn full_stiffness_into(
    values: &mut [f64],
    model: &Model,
    pattern: &BlockPattern,
    dofs: &Dofs,
    contacts: &Contacts,
) {
    if !model.has_nodes() {
        return;
    }
    let bodies: Vec<_> = full_bodies(model, dofs).collect();
    for batch in bodies.chunks(BATCH) {
        let tangents: Vec<_> =
            batch.par_iter().map(|&(body, _, grain)| grain.tangents(&contacts.fields[body])).collect();
        for (&(body, first, grain), cells) in batch.iter().zip(&tangents) {
            for (nodes, blocks) in cells {
                for (&i, row) in nodes.iter().zip(blocks) {
                    for (&j, block) in nodes.iter().zip(row) {
                        let (i, j) = (first + i as usize, first + j as usize);
                        pattern.add_block(values, dofs, i, j, &in_corner(block));
                    }
                }
            }
            let (multipliers, stiffness) = (first + grain.nodes(), model.bodies[body].stiffness);
            for (k, share) in grain.shares().iter().enumerate() {
                let turn = share.moment.cross_matrix() * stiffness;
                let (mut on_multipliers, mut on_node) = ([[0.0; 6]; 6], [[0.0; 6]; 6]);
                for r in 0..3 {
                    on_multipliers[r][r] = stiffness * share.mass;
                    on_node[r][r] = stiffness * share.mass;
                    for c in 0..3 {
                        on_multipliers[3 + r][c] = turn[(r, c)];
                        on_node[c][3 + r] = turn[(r, c)];
                    }
                }
                pattern.add_block(values, dofs, multipliers, first + k, &on_multipliers);
                pattern.add_block(values, dofs, first + k, multipliers, &on_node);
            }
        }
    }
    for pair in &contacts.pairs {
        for (point, tangent) in pair.active().zip(&pair.elastic_tangents) {
            if let Some(spot) = pair.spot(point.site.feature) {
                contact_nodes_into(values, pattern, dofs, pair, spot, tangent);
            }
        }
    }
}

/// Adds what one contact's force does by and to the nodes of its full sides.
fn contact_nodes_into(
    values: &mut [f64],
    pattern: &BlockPattern,
    dofs: &Dofs,
    pair: &PairWork,
    spot: &Spot,
    tangent: &crate::contact::force::ElasticTangent,
) {
    let block = |row: usize, column: usize| Mat3::from_fn(|r, c| tangent[row + r][column + c]);
    let sides = full_sides(dofs, pair, spot);
    let by_displacement = block(12, 9);
    for side in sides.iter().flatten() {
        // Force and moment on the two bodies by this side's displacement.
        for (body, row) in [(pair.a(), 0), (pair.b(), 6)] {
            let (force, moment) = (block(row, 9) * side.turn, block(row + 3, 9) * side.turn);
            for (node, weight) in side.nodes() {
                let mut whole = [[0.0; 6]; 6];
                for r in 0..3 {
                    for c in 0..3 {
                        whole[r][c] = -side.sign * weight * force[(r, c)];
                        whole[3 + r][c] = -side.sign * weight * moment[(r, c)];
                    }
                }
                pattern.add_block(values, dofs, body, node, &whole);
            }
        }
        // Force on this side's nodes by the motion of the bodies, and by the displacement of either side.
        let back = side.turn.transpose() * -side.sign;
        for (body, by_position, by_spin) in
            [(pair.a(), -block(12, 0), block(12, 6)), (pair.b(), block(12, 0), block(12, 3))]
        {
            let (by_position, by_spin) = (back * by_position, back * by_spin);
            for (node, weight) in side.nodes() {
                let mut whole = [[0.0; 6]; 6];
                for r in 0..3 {
                    for c in 0..3 {
                        whole[r][c] = weight * by_position[(r, c)];
                        whole[r][3 + c] = weight * by_spin[(r, c)];
                    }
                }
                pattern.add_block(values, dofs, node, body, &whole);
            }
        }
        for other in sides.iter().flatten() {
            let stiffness = back * by_displacement * other.turn * other.sign;
            for (node, weight) in side.nodes() {
                for (column, share) in other.nodes() {
                    pattern.add_block(
                        values,
                        dofs,
                        node,
                        column,
                        &in_corner(&(stiffness * (weight * share))),
                    );
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
