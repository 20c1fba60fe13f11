//! Reads the saved states of `/VTKHDF`: what a picture needs.

use hdf5::{Hyperslab, SliceOrIndex};
use ndarray::IxDyn;

use crate::error::Result;
use crate::tensor::Vec3;

use super::fields::CellKind;
use super::reader::Reader;
use super::store::failure;

/// When a saved state was taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SavedState {
    /// Stages completed plus the completed share of the present one.
    pub time: f64,
    /// Accepted increment that it belongs to; 0 for the start.
    pub increment: u64,
}

/// The cells of `/VTKHDF`, in the reference configuration.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SavedCells {
    /// [m]
    pub points: Vec<Vec3>,
    /// VTK's number of the kind of each cell.
    pub types: Vec<i64>,
    /// Nodes of all cells, one after the other.
    pub connectivity: Vec<usize>,
    /// Where a cell's nodes begin, and the end of the last.
    pub offsets: Vec<usize>,
    /// Grain of each cell, -1 for none.
    pub grain: Vec<i64>,
    /// Number of each cell's part in `parts`.
    pub part: Vec<usize>,
    pub parts: Vec<String>,
}

impl SavedCells {
    pub fn cells(&self) -> usize {
        self.types.len()
    }

    /// Nodes of a cell.
    pub fn nodes(&self, cell: usize) -> &[usize] {
        match (self.offsets.get(cell), self.offsets.get(cell + 1)) {
            (Some(&from), Some(&to)) => self.connectivity.get(from..to).unwrap_or_default(),
            _ => &[],
        }
    }

    /// Whether a cell is a tetrahedron.
    pub fn is_solid(&self, cell: usize) -> bool {
        let kind = self.types[cell];
        let is_tetrahedron = kind == CellKind::Tet10 as i64 || kind == CellKind::Tetrahedron as i64;
        is_tetrahedron && self.nodes(cell).len() >= 4
    }

    /// The triangles that a cell shows by their corners among its nodes, of a tetrahedron counter-clockwise from outside.
    pub fn facets(&self, cell: usize) -> &'static [[usize; 3]] {
        match self.nodes(cell).len() {
            _ if self.is_solid(cell) => &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
            3 => &[[0, 1, 2]],
            4 => &[[0, 1, 2], [0, 2, 3]],
            _ => &[],
        }
    }
}

impl Reader {
    /// The saved states in order; none where nothing was saved.
    pub fn saved_states(&self) -> Result<Vec<SavedState>> {
        if !self.has("VTKHDF/Steps/Values") {
            return Ok(Vec::new());
        }
        let times = self.floats("VTKHDF/Steps/Values")?;
        let increments = self.integers("VTKHDF/Steps/Increments")?;
        let states = times.into_iter().zip(increments);
        Ok(states.map(|(time, increment)| SavedState { time, increment: increment.max(0) as u64 }).collect())
    }

    /// The mesh of the saved states.
    ///
    /// # Errors
    /// Besides those of the file: cells that name nodes or parts that are not there.
    pub fn saved_cells(&self) -> Result<SavedCells> {
        let points = self.floats("VTKHDF/Points")?;
        let names = self.text_attribute("VTKHDF/CellData/part", "names")?;
        let part_name = |text: &str| text.split_once(' ').map_or(text, |(_, name)| name).to_string();
        let whole = |name: &str, below: usize| -> Result<Vec<usize>> {
            let numbers = self.integers(name)?;
            let checked = numbers.iter().map(|&n| usize::try_from(n).ok().filter(|&n| n < below));
            checked
                .collect::<Option<Vec<_>>>()
                .ok_or_else(|| failure(self.path(), name, format!("has a number outside 0 to {below}")))
        };
        let types = self.integers("VTKHDF/Types")?;
        let parts: Vec<String> = names.split("; ").filter(|n| !n.is_empty()).map(part_name).collect();
        let connectivity = whole("VTKHDF/Connectivity", points.len() / 3)?;
        let offsets = whole("VTKHDF/Offsets", connectivity.len() + 1)?;
        // Blocks may be longer than the mesh; static fields have one.
        let (mut grain, mut part) =
            (self.integers("VTKHDF/CellData/grain")?, whole("VTKHDF/CellData/part", parts.len())?);
        let ordered = offsets.windows(2).all(|pair| pair[0] <= pair[1]);
        if offsets.len() != types.len() + 1
            || grain.len() < types.len()
            || part.len() < types.len()
            || !ordered
        {
            return Err(failure(self.path(), "VTKHDF", "cells, their nodes and their parts do not match"));
        }
        grain.truncate(types.len());
        part.truncate(types.len());
        let points = points.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect();
        Ok(SavedCells { points, types, connectivity, offsets, grain, part, parts })
    }

    /// A field of a saved state, row after row: `on` is `PointData` or `CellData`.
    pub fn saved_field(&self, on: &str, name: &str, state: usize) -> Result<Vec<f64>> {
        let path = format!("VTKHDF/{on}/{name}");
        let starts = self.integers(&format!("VTKHDF/Steps/{on}Offsets/{name}"))?;
        let counted = if on == "PointData" { "VTKHDF/NumberOfPoints" } else { "VTKHDF/NumberOfCells" };
        let rows = self.integers(counted)?.first().copied().unwrap_or(0).max(0) as usize;
        let dataset = self.dataset(&path)?;
        let shape = dataset.shape();
        let start = starts.get(state).and_then(|&start| usize::try_from(start).ok());
        let Some(start) = start.filter(|start| shape.first().is_some_and(|&all| start + rows <= all)) else {
            return Err(failure(self.path(), &path, format!("has no state {state}")));
        };
        let mut selection = vec![SliceOrIndex::from(start..start + rows)];
        selection.extend(shape[1..].iter().map(|&n| SliceOrIndex::from(0..n)));
        let block = self.named(&path, dataset.read_slice::<f64, _, IxDyn>(Hyperslab::from(selection)))?;
        Ok(block.into_iter().collect())
    }
}
