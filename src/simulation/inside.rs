//! What bodies that deform or can break are like inside: stresses of their cells and displacements of their nodes.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::assembly::Contacts;
use crate::element::POINT_COUNT;
use crate::grain::DamagedGrain;
use crate::mesh::Mesh;
use crate::model::{Body, Model};
use crate::tensor::{Mat3, Pose, Rotation, Vec3, Vector6};

use super::grain_stress::components;

/// The cells of one body as generated; of a rigid one that cannot break there are none.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Inside {
    /// Mean Cauchy stress of each cell in space [Pa], xx yy zz xy yz xz, tension positive; zero where deleted, not a number in parts whose
    /// cells are not known.
    pub stress: Vec<[f64; 6]>,
    /// What each cell's nodes have moved by deformation, in space [m]; empty where the body is rigid.
    pub displacement: Vec<[[f64; 3]; 10]>,
}

/// The cells of one body as it is now.
struct Own<'a> {
    mesh: &'a Mesh,
    stress: Vec<[f64; 6]>,
    /// Of the nodes of `mesh`; empty where the body is rigid.
    displacement: Vec<Vec3>,
}

/// Of all bodies as generated, in the configuration that was last accepted. `frames` are those of the bodies' coordinates.
pub fn of_bodies(model: &Model, contacts: &Contacts, frames: &[Pose]) -> Vec<Inside> {
    let own: Vec<Option<Own<'_>>> = model
        .bodies
        .par_iter()
        .enumerate()
        .zip(frames)
        .map(|((index, body), frame)| own(body, index, contacts, &frame.rotation))
        .collect();
    let mut all: Vec<Inside> = match model.generated.is_empty() {
        true => vec![Inside::default(); model.bodies.len()],
        false => model.generated.iter().map(|grain| gone(grain.as_deref())).collect(),
    };
    for ((index, body), own) in model.bodies.iter().enumerate().zip(own) {
        let origin = body.damaged.as_ref().map_or(index, |grain| grain.ancestry().origin as usize);
        let Some(inside) = all.get_mut(origin) else { continue };
        match (&body.damaged, own) {
            (Some(grain), own) => inside.take(grain.origin_cells().iter().map(|cell| cell.index()), own),
            (None, Some(own)) => {
                let cells = own.mesh.cells.len();
                inside.stress = vec![[0.0; 6]; cells];
                inside.take(0..cells, Some(own));
            }
            (None, None) => {}
        }
    }
    all
}

/// A grain all cells of which are deleted.
fn gone(grain: Option<&DamagedGrain>) -> Inside {
    let cells = grain.map_or(0, |grain| grain.states().len());
    Inside { stress: vec![[0.0; 6]; cells], displacement: Vec::new() }
}

impl Inside {
    /// Takes a body's cells, whose numbers as generated are `cells`; `None`: nothing is known of them.
    fn take(&mut self, cells: impl Iterator<Item = usize>, own: Option<Own<'_>>) {
        let Some(Own { mesh, stress, displacement }) = own else {
            cells.for_each(|cell| self.stress[cell] = [f64::NAN; 6]);
            return;
        };
        if !displacement.is_empty() {
            self.displacement.resize(self.stress.len(), [[0.0; 3]; 10]);
        }
        for ((cell, nodes), stress) in cells.zip(&mesh.cells).zip(stress) {
            self.stress[cell] = stress;
            if !displacement.is_empty() {
                self.displacement[cell] = nodes.map(|node| displacement[node.index()].into());
            }
        }
    }
}

fn own<'a>(body: &'a Body, index: usize, contacts: &Contacts, turn: &Rotation) -> Option<Own<'a>> {
    if body.resting.is_some() {
        return None;
    }
    let (mesh, stresses, displacement) = match (&body.damaged, &body.full, &body.grain) {
        (Some(grain), _, _) => {
            // A part that has just come off has not been displaced yet.
            let moved = grain.displaced();
            let moved =
                if body.is_elastic() && moved.len() == grain.mesh().nodes.len() { moved } else { &[] };
            (grain.mesh(), grain.stresses(), moved.to_vec())
        }
        (None, Some(grain), _) => {
            let field = contacts.fields.get(index).filter(|field| field.len() == grain.nodes())?;
            (grain.mesh(), grain.cell_stresses(field), grain.on_mesh(field))
        }
        (None, None, Some(grain)) => {
            let moved = grain.nodal_displacements(contacts.surface_loads.get(index)?);
            (grain.mesh(), grain.cell_stresses(&moved), moved)
        }
        (None, None, None) => return None,
    };
    let turn = turn.to_rotation_matrix();
    let turned = |points: &[Vector6<f64>; POINT_COUNT]| {
        let [xx, yy, zz, xy, yz, xz] = (points.iter().sum::<Vector6<f64>>() / POINT_COUNT as f64).into();
        let stress = Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        components(&(turn.matrix() * stress * turn.matrix().transpose()))
    };
    let stress = stresses.iter().map(turned).collect();
    Some(Own { mesh, stress, displacement: displacement.iter().map(|u| turn * u).collect() })
}
