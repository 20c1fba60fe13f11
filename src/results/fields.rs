//! The mesh and the fields of `/VTKHDF`, as plain numbers.

use crate::error::{Error, Result};
use crate::tensor::Vec3;

/// Kind of a cell; the numbers are VTK's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellKind {
    Triangle = 5,
    Quad = 9,
    Tetrahedron = 10,
    /// Ten-node tetrahedron, VTK's order: corners 0 1 2 3, then the nodes amid 01, 12, 02, 03, 13, 23.
    Tet10 = 24,
}

impl CellKind {
    pub fn nodes(self) -> usize {
        match self {
            CellKind::Triangle => 3,
            CellKind::Quad | CellKind::Tetrahedron => 4,
            CellKind::Tet10 => 10,
        }
    }
}

/// All that `/VTKHDF` shows, in the reference configuration. Grains, plates and membrane are parts.
#[derive(Debug, Clone, Default)]
pub struct FieldMesh {
    pub(super) points: Vec<[f64; 3]>,
    pub(super) types: Vec<u8>,
    pub(super) connectivity: Vec<i64>,
    pub(super) offsets: Vec<i64>,
    pub(super) grain: Vec<i32>,
    pub(super) part: Vec<i32>,
    pub(super) youngs_modulus: Vec<f32>,
    pub(super) parts: Vec<String>,
}

impl FieldMesh {
    pub fn new() -> Self {
        FieldMesh { offsets: vec![0], ..FieldMesh::default() }
    }

    /// Adds a part, e.g. `grains`, `top plate`, `membrane`, or a scene body's name; returns its number.
    pub fn add_part(&mut self, name: &str) -> usize {
        self.parts.push(name.to_string());
        self.parts.len() - 1
    }

    /// Adds a point at its reference position [m] (where displacement is zero); returns its number.
    pub fn add_point(&mut self, position: &Vec3) -> usize {
        self.points.push([position.x, position.y, position.z]);
        self.points.len() - 1
    }

    /// Adds a cell of a grain (number from 0) or of none, with Young's modulus [Pa] (NaN for what has none).
    /// Refuses a wrong number of nodes, unknown points and unknown parts.
    pub fn add_cell(
        &mut self,
        kind: CellKind,
        nodes: &[usize],
        part: usize,
        grain: Option<usize>,
        youngs_modulus: f64,
    ) -> Result<()> {
        let fault = |message: String| Error::Mesh { name: "results file".into(), message };
        if nodes.len() != kind.nodes() {
            return Err(fault(format!("a {kind:?} cell has {} nodes, not {}", kind.nodes(), nodes.len())));
        }
        if let Some(node) = nodes.iter().find(|&&node| node >= self.points.len()) {
            return Err(fault(format!("a cell names point {node} of {}", self.points.len())));
        }
        if part >= self.parts.len() {
            return Err(fault(format!("a cell names part {part} of {}", self.parts.len())));
        }
        if self.offsets.is_empty() {
            self.offsets.push(0);
        }
        self.types.push(kind as u8);
        self.connectivity.extend(nodes.iter().map(|&node| node as i64));
        self.offsets.push(self.connectivity.len() as i64);
        self.grain.push(grain.map_or(-1, |g| g as i32));
        self.part.push(part as i32);
        self.youngs_modulus.push(youngs_modulus as f32);
        Ok(())
    }

    pub fn points(&self) -> usize {
        self.points.len()
    }

    pub fn cells(&self) -> usize {
        self.types.len()
    }
}

/// The fields of one saved state; every slice has an entry for each point or cell of the mesh.
#[derive(Debug, Clone, Copy)]
pub struct FieldState<'a> {
    /// Pseudo-time, e.g. stages completed plus the share of the present one; grows from state to state.
    pub time: f64,
    /// Accepted increment that the state belongs to; 0 for the start.
    pub increment: u64,
    /// Displacement of the points since the reference configuration, rigid motion included [m].
    pub displacement: &'a [Vec3],
    /// Mean damage of each cell, 0 intact to 1.
    pub damage: &'a [f64],
    /// Cells that have been deleted.
    pub failed: &'a [bool],
    /// The body that carries each cell: its grain, or a part that came off it; -1 for none.
    pub fragment: &'a [i32],
    /// Mean Cauchy stress of each cell, xx yy zz xy yz xz, tension positive [Pa].
    pub stress: &'a [[f64; 6]],
    /// How the body of each cell deforms: 0 rigid, 1 condensed, 2 full.
    pub fidelity: &'a [u8],
}

/// Von Mises stress of a stress xx yy zz xy yz xz: sqrt(3/2 s:s) with the deviator s.
pub fn von_mises(stress: &[f64; 6]) -> f64 {
    let [xx, yy, zz, xy, yz, xz] = *stress;
    let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
    (0.5 * normal + 3.0 * (xy * xy + yz * yz + xz * xz)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn von_mises_of_simple_states() {
        assert_eq!(von_mises(&[7.0, 0.0, 0.0, 0.0, 0.0, 0.0]), 7.0);
        assert_eq!(von_mises(&[5.0, 5.0, 5.0, 0.0, 0.0, 0.0]), 0.0);
        for shear in 3..6 {
            let mut stress = [0.0; 6];
            stress[shear] = -2.0;
            assert!((von_mises(&stress) - 2.0 * 3.0_f64.sqrt()).abs() < 1e-15);
        }
    }

    #[test]
    fn cells_with_unknown_points_are_refused() {
        let mut mesh = FieldMesh::new();
        let part = mesh.add_part("grains");
        for corner in 0..3 {
            mesh.add_point(&Vec3::new(f64::from(corner), 0.0, 0.0));
        }
        assert!(mesh.add_cell(CellKind::Triangle, &[0, 1, 3], part, None, 0.0).is_err());
        assert!(mesh.add_cell(CellKind::Triangle, &[0, 1], part, None, 0.0).is_err());
        assert!(mesh.add_cell(CellKind::Triangle, &[0, 1, 2], part + 1, None, 0.0).is_err());
        assert!(mesh.add_cell(CellKind::Triangle, &[0, 1, 2], part, Some(0), 0.0).is_ok());
        assert_eq!((mesh.points(), mesh.cells()), (3, 1));
    }
}
