//! What bodies that deform or can break are like inside: stresses of their cells and displacements of their
//! nodes.

use rayon::prelude::*;

use crate::assembly::Contacts;
use crate::element::POINT_COUNT;
use crate::mesh::Mesh;
use crate::model::{Body, Committed, Loads, Model};
use crate::tensor::{Pose, Rotation, Vec3, Vector6, components, symmetric};
use crate::triaxial::Rig;

/// The cells of one body as generated; of a rigid one that cannot break there are none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CellFields {
    /// Mean Cauchy stress of each cell in space [Pa], xx yy zz xy yz xz, tension positive; zero where
    /// deleted, not a number in parts whose cells are not known.
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

/// Of all bodies as generated, as they are committed, whatever `contacts` was last evaluated in; under
/// `loads`. Of none where these contacts cannot be evaluated.
pub fn of_committed(
    model: &Model,
    contacts: &Contacts,
    committed: &Committed,
    loads: &Loads,
) -> Vec<CellFields> {
    let poses = &committed.poses;
    // What does not bend has its stresses from its last damage.
    if !model.bodies.iter().any(|body| body.grain().is_some() || body.full().is_some()) {
        return of_bodies(model, contacts, poses);
    }
    let mut contacts = contacts.clone();
    contacts.start(model, committed);
    if contacts.evaluate(model, committed, poses).is_err() {
        return Vec::new();
    }
    contacts.note_loads(model, loads, poses);
    of_bodies(model, &contacts, poses)
}

/// [`of_committed`] of a rig under its pressure.
pub fn of_rig(rig: &Rig) -> Vec<CellFields> {
    of_committed(&rig.model, &rig.contacts, &rig.committed, &rig.loads(false, rig.pressure))
}

/// The same in the configuration that `contacts` was last accepted in.
fn of_bodies(model: &Model, contacts: &Contacts, poses: &[Pose]) -> Vec<CellFields> {
    let own: Vec<Option<Own<'_>>> = model
        .bodies
        .par_iter()
        .enumerate()
        .zip(poses)
        .map(|((index, body), pose)| own(body, index, contacts, &pose.rotation))
        .collect();
    let mut all: Vec<CellFields> = match model.generated.is_empty() {
        true => vec![CellFields::default(); model.bodies.len()],
        false => model.generated.iter().map(|mesh| gone(mesh.as_deref())).collect(),
    };
    for ((index, body), own) in model.bodies.iter().enumerate().zip(own) {
        let origin = body.damaged().map_or(index, |grain| grain.ancestry().origin as usize);
        let Some(fields) = all.get_mut(origin) else { continue };
        match (body.damaged(), own) {
            (Some(grain), own) => fields.take(grain.origin_cells().iter().map(|cell| cell.index()), own),
            (None, Some(own)) => {
                let cells = own.mesh.cells.len();
                fields.stress = vec![[0.0; 6]; cells];
                fields.take(0..cells, Some(own));
            }
            (None, None) => {}
        }
    }
    all
}

/// A grain all cells of which are deleted.
fn gone(mesh: Option<&Mesh>) -> CellFields {
    let cells = mesh.map_or(0, |mesh| mesh.cells.len());
    CellFields { stress: vec![[0.0; 6]; cells], displacement: Vec::new() }
}

impl CellFields {
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
    if body.is_resting() {
        return None;
    }
    let (mesh, stresses, displacement) = match (body.damaged(), body.full(), body.grain()) {
        (damaged, Some(full), _) => {
            let moved = contacts.fields.get(index).map(|field| full.nodal(field))?;
            let broken = damaged.filter(|grain| !grain.is_sound());
            let stresses =
                || broken.map_or_else(|| full.condensed().cell_stresses(moved), |grain| grain.stresses());
            (!moved.is_empty()).then(|| (full.mesh(), stresses(), moved.to_vec()))?
        }
        (Some(grain), None, Some(sound)) if body.is_brittle() && !grain.is_sound() => {
            let moved = sound.nodal_displacements(contacts.surface_loads.get(index)?);
            (grain.mesh(), grain.stresses(), moved)
        }
        // Not strained yet: it was rigid until now, or a restart point has its states only.
        (Some(grain), None, _) if body.is_elastic() && grain.displaced().is_empty() => {
            let moved = grain.condensed().nodal_displacements(contacts.surface_loads.get(index)?);
            let stresses =
                if grain.is_sound() { grain.condensed().cell_stresses(&moved) } else { grain.stresses() };
            (grain.mesh(), stresses, moved)
        }
        (Some(grain), None, _) => {
            // A part that has just come off has not been displaced yet.
            let moved = grain.displaced();
            let moved =
                if body.is_elastic() && moved.len() == grain.mesh().nodes.len() { moved } else { &[] };
            (grain.mesh(), grain.stresses(), moved.to_vec())
        }
        (None, None, Some(grain)) => {
            let moved = grain.nodal_displacements(contacts.surface_loads.get(index)?);
            (grain.mesh(), grain.cell_stresses(&moved), moved)
        }
        (None, None, None) => return None,
    };
    let turn = turn.to_rotation_matrix();
    let turned = |points: &[Vector6<f64>; POINT_COUNT]| {
        let stress = symmetric((points.iter().sum::<Vector6<f64>>() / POINT_COUNT as f64).into());
        components(&(turn.matrix() * stress * turn.matrix().transpose()))
    };
    let stress = stresses.iter().map(turned).collect();
    Some(Own { mesh, stress, displacement: displacement.iter().map(|u| turn * u).collect() })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::case::checked;
    use crate::scene::Scene;
    use crate::setup::scene_parameters;

    /// A run that ends between saved states has nothing but its committed state to tell from.
    #[test]
    fn committed_bodies_have_the_fields_that_the_increment_left() {
        let text = include_str!("../../cases/scenes/contact_patch.json");
        for fidelity in ["condensed", "full"] {
            let text = text.replace("\"fidelity\": \"condensed\"", &format!("\"fidelity\": \"{fidelity}\""));
            let case = checked(&text, &[]).expect("a case");
            let mut blocks = 0;
            let parameters = scene_parameters(&case, Path::new("")).expect("parameters");
            let end = Scene::new(&parameters).expect("a scene").run(|scene, _| {
                let (model, contacts) = (&scene.model, &scene.contacts);
                let left = of_bodies(model, contacts, &scene.committed.poses);
                let told = of_committed(model, contacts, &scene.committed, scene.loads());
                for (left, told) in left.iter().zip(&told).filter(|(left, _)| !left.stress.is_empty()) {
                    blocks += 1;
                    assert_eq!(left.stress.len(), told.stress.len());
                    // 3 kPa, and 0.1 um of strain over a metre: both to 1e-6.
                    let stress = left.stress.iter().flatten().zip(told.stress.iter().flatten());
                    stress.for_each(|(a, b)| assert!((a - b).abs() < 3e-3, "{fidelity}: {a} and {b} Pa"));
                    let moved = left.displacement.iter().flatten().flatten();
                    moved.zip(told.displacement.iter().flatten().flatten()).for_each(|(a, b)| {
                        assert!((a - b).abs() < 1e-14, "{fidelity}: {a:e} and {b:e} m");
                    });
                }
                true
            });
            assert_eq!(end, crate::loading::StageEnd::Finished);
            assert_eq!(blocks, 2, "{fidelity}");
        }
    }
}
