//! Joins the run of a scene to its results file.

use std::borrow::Cow;

use crate::error::Result;
use crate::mesh::Mesh;
use crate::model::Body;
use crate::results::HistoryRow;
use crate::scene::{Row, Scene, SceneParameters};

use super::breaking::cell_states;
use super::cell_fields::{self, CellFields};
use super::contact_table::ContactTable;
use super::fields::scene_mesh;
use super::grain_stress::body_stresses;
use super::history_row::{body_rows, row_of_scene};
use super::recorder::Recorder;
use super::restart_data::{ScenePoint, State};

impl Recorder {
    /// Writes the bodies' meshes and the first state, or compares them with those of a continued run.
    /// `moduli` are Young's, of the cells of each body [Pa].
    pub fn begin_scene(
        &mut self,
        scene: &Scene,
        parameters: &SceneParameters,
        meshes: &[Option<Mesh>],
        moduli: &[Vec<f64>],
    ) -> Result<()> {
        let names: Vec<&str> = scene.model.bodies.iter().map(|body| body.name.as_str()).collect();
        self.writer.set_bodies(&names)?;
        let (mesh, points) = scene_mesh(scene, parameters, meshes, moduli)?;
        let poses = scene.model.frames(&scene.committed.poses);
        let first = State::reference(poses, scene.model.bodies.len(), levels(scene));
        self.begin_fields(mesh, points, (first, &[]))
    }

    /// Takes down an accepted increment; it is in the file when this returns.
    pub fn accept_scene(
        &mut self,
        parameters: &SceneParameters,
        scene: &Scene,
        row: &Row,
    ) -> Result<HistoryRow> {
        if self.at.stage != row.stage || row.increment == 1 {
            self.begin_stage(row.stage, None);
        }
        let begun = self.end_solving();
        let history = row_of_scene(row, self.times());
        let poses = &scene.committed.poses;
        let state = State {
            time: history.time,
            increment: row.increment as u64,
            poses: scene.model.frames(poses),
            stress: match &scene.pressing {
                Some(pressing) => pressing.mean_stresses(poses.len()),
                None => body_stresses(scene, parameters, row.gravity),
            },
            local_strains: Vec::new(),
            contacts: match &scene.pressing {
                Some(pressing) => ContactTable::of_press(pressing),
                None => ContactTable::of(&scene.contacts, &scene.committed.memory, poses.len()),
            },
            cells: cell_states(&scene.model),
            grains: Vec::new(),
            levels: levels(scene),
        };
        self.append(&history, &body_rows(row), state, [row.progress; 2], || fields_of(scene))?;
        self.hold_scene(scene)?;
        self.commit()?;
        self.took_since(begun);
        Ok(history)
    }

    /// As [`Recorder::hold`], of a scene.
    pub fn hold_scene(&mut self, scene: &Scene) -> Result<()> {
        let point = ScenePoint {
            at: self.at,
            scene: scene.state(),
            sums: self.sums(),
            unsaved: self.unsaved.as_ref().map(Cow::Borrowed),
        };
        self.restarts.hold(self.increments(), &point, self.writer.path())
    }

    /// As [`Recorder::end_stage`], of a scene.
    pub fn end_scene(&mut self, scene: &Scene) -> Result<()> {
        self.end_with(&scene.model, &scene.committed.poses, || fields_of(scene))
    }
}

/// How each body deforms.
fn levels(scene: &Scene) -> Vec<u8> {
    scene.model.bodies.iter().map(Body::level).collect()
}

fn fields_of(scene: &Scene) -> Vec<CellFields> {
    cell_fields::of_committed(&scene.model, &scene.contacts, &scene.committed, scene.loads())
}
