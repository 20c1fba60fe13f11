//! What `/VTKHDF` shows: of a specimen in its rig the grains' meshes, the plates, the cover; of a scene its
//! bodies.

use crate::error::Result;
use crate::mesh::Mesh;
use crate::results::{CellKind, FieldMesh};
use crate::scene::{Scene, SceneParameters};
use crate::tensor::{Mat3, Pose, Vec3, components};
use crate::triaxial::Rig;

use super::breaking::{CellStates, of_cell, shown_nodes};
use super::cell_fields::CellFields;

/// Corners of the polygon that shows a plate.
const PLATE_CORNERS: usize = 64;
/// Radius of the disc that shows a plate over the specimen's. The rig's plates reach further.
const PLATE_REACH: f64 = 1.12;

/// The points of the field mesh, each fixed to a body.
#[derive(Debug, Clone, Default)]
pub struct Points {
    body: Vec<usize>,
    /// In body coordinates [m].
    place: Vec<Vec3>,
    /// In space in the reference configuration [m].
    reference: Vec<Vec3>,
    /// Grain of each cell.
    grain: Vec<Option<usize>>,
    /// Its number among those of its grain.
    number: Vec<usize>,
    /// A cell that each point of a grain is a node of, and which node. Of a grain that can come apart it is
    /// the only one.
    node: Vec<Option<(usize, usize)>>,
    /// Bodies there were when the mesh was made, and all that has a pose: a membrane's nodes stay behind parts that come in between.
    bodies: usize,
    carriers: usize,
}

impl Points {
    /// Where among so many frames that of a body, or a membrane's node, is now.
    fn frame_of(&self, carrier: usize, frames: usize) -> usize {
        if carrier < self.bodies { carrier } else { carrier + frames - self.carriers }
    }

    /// Displacement of every point since the reference configuration [m]: its body's and, where that deforms,
    /// what is known of it inside. `frames` are those of the body coordinates as generated, and `carriers`
    /// the bodies of the cells.
    pub fn displacements(
        &self,
        frames: &[Pose],
        carriers: &[Option<usize>],
        cell_fields: &[CellFields],
    ) -> Vec<Vec3> {
        let moved = |(point, (place, reference)): (usize, (&Vec3, &Vec3))| {
            let part = self.node[point].and_then(|(cell, _)| carriers[cell]);
            let frame = part.unwrap_or_else(|| self.frame_of(self.body[point], frames.len()));
            let inside = self.node[point].and_then(|(cell, node)| {
                let nodes = cell_fields.get(self.body[point])?.displacement.get(self.number[cell])?;
                Some(Vec3::from(nodes[node]))
            });
            frames[frame].to_space(place) - reference + inside.unwrap_or_default()
        };
        self.place.iter().zip(&self.reference).enumerate().map(moved).collect()
    }

    /// Damage of each cell, whether it was deleted, and the body that it is on.
    pub fn cells_of(&self, states: &[CellStates]) -> (Vec<f64>, Vec<bool>, Vec<Option<usize>>) {
        let (mut damage, mut deleted, mut carriers) = (vec![], vec![], vec![]);
        for (grain, number) in self.grain.iter().zip(&self.number) {
            let (d, gone, body) = grain.map_or((0.0, false, 0), |grain| of_cell(states, grain, *number));
            damage.push(d);
            deleted.push(gone);
            carriers.push(grain.map(|_| body));
        }
        (damage, deleted, carriers)
    }

    /// Each cell's own stress where that is known, else that of the body that it is on; not a number on what
    /// has none.
    pub fn cell_stresses(
        &self,
        of_bodies: &[Mat3],
        carriers: &[Option<usize>],
        cell_fields: &[CellFields],
    ) -> Vec<[f64; 6]> {
        let of_cell = |(cell, body): (usize, &Option<usize>)| {
            let inside =
                self.grain[cell].and_then(|grain| cell_fields.get(grain)?.stress.get(self.number[cell]));
            let known = inside.filter(|stress| !stress[0].is_nan()).copied();
            let of_body = || body.and_then(|body| of_bodies.get(body)).map(components);
            known.or_else(of_body).unwrap_or([f64::NAN; 6])
        };
        carriers.iter().enumerate().map(of_cell).collect()
    }
}

/// The meshes by which the grains of a specimen are shown.
#[derive(Debug, Clone, Copy)]
pub struct GrainMeshes<'a> {
    pub meshes: &'a [Mesh],
    /// Young's, of the cells of each grain [Pa].
    pub moduli: &'a [Vec<f64>],
    /// Whether grains can come apart.
    pub apart: bool,
}

/// A field mesh in the making.
struct Builder<'a> {
    mesh: FieldMesh,
    points: Points,
    poses: &'a [Pose],
}

impl<'a> Builder<'a> {
    fn new(poses: &'a [Pose], bodies: usize) -> Self {
        let points = Points { bodies, carriers: poses.len(), ..Points::default() };
        Builder { mesh: FieldMesh::new(), points, poses }
    }

    fn point(&mut self, body: usize, place: Vec3) -> usize {
        let reference = self.poses[body].to_space(&place);
        self.points.body.push(body);
        self.points.place.push(place);
        self.points.node.push(None);
        self.points.reference.push(reference);
        self.mesh.add_point(&reference)
    }

    fn cell(
        &mut self,
        kind: CellKind,
        nodes: &[usize],
        part: usize,
        grain: Option<usize>,
        youngs_modulus: f64,
    ) -> Result<()> {
        self.points.grain.push(grain);
        self.points.number.push(0);
        self.mesh.add_cell(kind, nodes, part, grain, youngs_modulus)
    }

    /// A meshed grain, its cells, with these Young's `moduli` [Pa], on their own where it can come `apart`.
    fn grain(&mut self, body: usize, mesh: &Mesh, part: usize, apart: bool, moduli: &[f64]) -> Result<()> {
        let (nodes, cells) = shown_nodes(mesh, apart);
        let points: Vec<usize> = nodes.into_iter().map(|node| self.point(body, node)).collect();
        for (number, cell) in cells.into_iter().enumerate() {
            let nodes = cell.map(|node| points[node]);
            let youngs_modulus = moduli.get(number).copied().unwrap_or(f64::NAN);
            self.cell(CellKind::Tet10, &nodes, part, Some(body), youngs_modulus)?;
            let index = self.points.number.len() - 1;
            self.points.number[index] = number;
            nodes.iter().enumerate().for_each(|(k, point)| self.points.node[*point] = Some((index, k)));
        }
        Ok(())
    }

    fn disc(&mut self, name: &str, body: usize, radius: f64, half: f64) -> Result<()> {
        let part = self.mesh.add_part(name);
        let mut rings = [Vec::new(), Vec::new()];
        let mut centres = [0; 2];
        for (side, z) in [-half, half].into_iter().enumerate() {
            centres[side] = self.point(body, Vec3::new(0.0, 0.0, z));
            for corner in 0..PLATE_CORNERS {
                let (sin, cos) = (std::f64::consts::TAU * corner as f64 / PLATE_CORNERS as f64).sin_cos();
                let node = self.point(body, Vec3::new(radius * cos, radius * sin, z));
                rings[side].push(node);
            }
        }
        let [low, high] = rings;
        for at in 0..PLATE_CORNERS {
            let next = (at + 1) % PLATE_CORNERS;
            let none = f64::NAN;
            self.cell(CellKind::Triangle, &[centres[0], low[next], low[at]], part, None, none)?;
            self.cell(CellKind::Triangle, &[centres[1], high[at], high[next]], part, None, none)?;
            self.cell(CellKind::Quad, &[low[at], low[next], high[next], high[at]], part, None, none)?;
        }
        Ok(())
    }
}

/// The mesh of a scene's bodies as they stand now, which becomes the reference configuration: a part and a
/// number of its own for each. A body without a mesh is shown by its facets. `moduli`: Young's, of the cells
/// of each body [Pa].
pub fn scene_mesh(
    scene: &Scene,
    parameters: &SceneParameters,
    meshes: &[Option<Mesh>],
    moduli: &[Vec<f64>],
) -> Result<(FieldMesh, Points)> {
    let poses = &scene.model.frames(&scene.committed.poses);
    let mut builder = Builder::new(poses, scene.model.bodies.len());
    for (number, (body, mesh)) in scene.model.bodies.iter().zip(meshes).enumerate() {
        let part = builder.mesh.add_part(&body.name);
        match mesh {
            Some(mesh) => {
                let apart = scene.model.generated[number].is_some();
                builder.grain(number, mesh, part, apart, moduli.get(number).map_or(&[], Vec::as_slice))?;
            }
            None => {
                let youngs_modulus = parameters.bodies[number].youngs_modulus;
                let places = &body.nominal.vertices;
                let nodes: Vec<usize> =
                    places.iter().map(|place| builder.point(number, place + body.offset)).collect();
                for facet in &body.nominal.facets {
                    let nodes = facet.map(|node| nodes[node]);
                    builder.cell(CellKind::Triangle, &nodes, part, Some(number), youngs_modulus)?;
                }
            }
        }
    }
    Ok((builder.mesh, builder.points))
}

/// The mesh of a specimen of `diameter` [m] in its rig as it stands now, which becomes the reference
/// configuration.
pub fn field_mesh(rig: &Rig, diameter: f64, grains: &GrainMeshes<'_>) -> Result<(FieldMesh, Points)> {
    let poses = &rig.committed.poses;
    let mut builder = Builder::new(poses, rig.model.bodies.len());
    let part = builder.mesh.add_part("grains");
    for (grain, (mesh, moduli)) in grains.meshes.iter().zip(grains.moduli).enumerate() {
        builder.grain(grain, mesh, part, grains.apart, moduli)?;
    }
    for (name, body) in [("bottom plate", rig.bottom), ("top plate", rig.top)] {
        let half = rig.model.bodies[body].nominal.vertices.iter().map(|v| v.z).fold(0.0, f64::max);
        builder.disc(name, body, 0.5 * PLATE_REACH * diameter, half)?;
    }
    if let Some(cover) = &rig.model.cover {
        let part = builder.mesh.add_part("membrane");
        let nodes: Vec<usize> =
            cover.nodes().iter().map(|node| builder.point(node.body, node.point)).collect();
        for facet in cover.side_facets() {
            let nodes = facet.map(|node| nodes[node]);
            builder.cell(CellKind::Triangle, &nodes, part, None, f64::NAN)?;
        }
    }
    Ok((builder.mesh, builder.points))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three bodies and two nodes of a membrane, between which two parts come.
    #[test]
    fn nodes_of_a_membrane_stay_behind_all_bodies() {
        let points = Points { bodies: 3, carriers: 5, ..Points::default() };
        assert_eq!([0, 2, 3, 4].map(|carrier| points.frame_of(carrier, 5)), [0, 2, 3, 4]);
        assert_eq!([0, 2, 3, 4].map(|carrier| points.frame_of(carrier, 7)), [0, 2, 5, 6]);
    }
}
