//! Reads the saved states of `/VTKHDF`: what a picture needs.

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

    /// A number for each node, the same for nodes at the same place: cells of grains that can break share none. Numbers grow along x.
    pub fn places(&self) -> Vec<usize> {
        let size = self.points.iter().map(|p| p.amax()).fold(0.0, f64::max).max(1e-30);
        let place = |p: &Vec3| [0, 1, 2].map(|k| (p[k] / size * 1e7).round() as i64);
        let places: Vec<[i64; 3]> = self.points.iter().map(place).collect();
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by_key(|&node| places[node]);
        let mut numbers = vec![0; places.len()];
        for pair in order.windows(2) {
            numbers[pair[1]] = numbers[pair[0]] + usize::from(places[pair[0]] != places[pair[1]]);
        }
        numbers
    }

    /// The facets that one cell of an owner alone has, by their nodes, each with its cell; in the order of owners and places. What has
    /// no owner is left out.
    pub fn outside(&self, owner: impl Fn(usize) -> Option<i64>) -> Vec<([usize; 3], usize)> {
        let places = self.places();
        let mut facets = Vec::new();
        for cell in 0..self.cells() {
            let Some(owner) = owner(cell) else { continue };
            let nodes = self.nodes(cell);
            for facet in self.facets(cell) {
                let corners = facet.map(|k| nodes[k]);
                let mut key = corners.map(|node| places[node]);
                key.sort_unstable();
                facets.push((owner, key, corners, cell));
            }
        }
        facets.sort_unstable();
        let alike = facets.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
        alike.filter(|facets| facets.len() == 1).map(|facets| (facets[0].2, facets[0].3)).collect()
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
        let (path, offsets) = (format!("VTKHDF/{on}/{name}"), format!("VTKHDF/Steps/{on}Offsets/{name}"));
        let counted = if on == "PointData" { "VTKHDF/NumberOfPoints" } else { "VTKHDF/NumberOfCells" };
        let rows = self.integers(counted)?.first().copied().unwrap_or(0).max(0) as usize;
        let start = self.integers(&offsets)?.get(state).and_then(|&start| usize::try_from(start).ok());
        let start = start.ok_or_else(|| failure(self.path(), &offsets, format!("lacks state {state}")))?;
        self.floats_in(&path, start, rows)
    }

    /// Where the nodes of the mesh are in a saved state [m].
    pub fn saved_points(&self, cells: &SavedCells, state: usize) -> Result<Vec<Vec3>> {
        let displacement = self.saved_field("PointData", "displacement", state)?;
        if displacement.len() != 3 * cells.points.len() {
            return Err(failure(self.path(), "VTKHDF", "displacements and points do not match"));
        }
        let moved = cells.points.iter().zip(displacement.chunks_exact(3));
        Ok(moved.map(|(x, u)| x + Vec3::from_column_slice(u)).collect())
    }
}
