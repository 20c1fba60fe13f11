//! `/VTKHDF`: the saved states as one temporal UnstructuredGrid.
//!
//! Source: VTKHDF file format specification, version 2.2 (Kitware), "Temporal Data". The mesh stands in
//! the file once, in its reference configuration; every step points at it with offsets of zero and at
//! its own block of each field. `displacement` moves it (in ParaView: Warp By Vector); moved points would
//! double the size of a state without saying more.
//!
//! `NSteps` is written last and the offsets before it, so that a reader never meets a step without them.

use std::collections::BTreeMap;

use hdf5::types::FixedAscii;
use hdf5::{Dataset, Group};

use crate::error::Result;

use super::fields::{FieldMesh, FieldState, von_mises};
use super::reader::NumberKind;
use super::store::{Growing, Layout, Store, block_stride};

/// Steps are few: chunks of so many.
const STEP_ROWS: usize = 256;
const TIMES: &str = "VTKHDF/Steps/Values";
const INCREMENTS: &str = "VTKHDF/Steps/Increments";

/// A field with its own block for each saved state.
struct Field {
    name: &'static str,
    units: &'static str,
    long_name: &'static str,
    on_points: bool,
    /// Axes after the first.
    width: &'static [usize],
    number: NumberKind,
}

impl Field {
    fn path(&self) -> String {
        format!("VTKHDF/{}/{}", if self.on_points { "PointData" } else { "CellData" }, self.name)
    }

    fn offsets(&self) -> String {
        let group = if self.on_points { "PointDataOffsets" } else { "CellDataOffsets" };
        format!("VTKHDF/Steps/{group}/{}", self.name)
    }

    fn row_bytes(&self) -> usize {
        self.width.iter().product::<usize>().max(1) * self.number.bytes()
    }
}

const fn on_cells(
    name: &'static str,
    units: &'static str,
    long_name: &'static str,
    width: &'static [usize],
    number: NumberKind,
) -> Field {
    Field { name, units, long_name, on_points: false, width, number }
}

const DISPLACEMENT: Field = Field {
    name: "displacement",
    units: "m",
    long_name: "displacement since the reference configuration, with what condensed and full bodies deform by",
    on_points: true,
    width: &[3],
    number: NumberKind::Float64,
};
const DAMAGE: Field =
    on_cells("damage", "1", "mean damage of the cell, 0 intact to 1", &[], NumberKind::Float32);
const FAILED: Field = on_cells("failed", "1", "1 where the cell has been deleted", &[], NumberKind::UInt8);
const FRAGMENT: Field = on_cells(
    "fragment",
    "1",
    "number of the body that the cell is on: that of its grain, or of a part that came off; -1 for none",
    &[],
    NumberKind::Int32,
);
const STRESS: Field = on_cells(
    "stress",
    "Pa",
    "Cauchy stress xx yy zz xy yz xz, tension positive: mean of the cell where its body deforms or can break, 0 where deleted; else mean of the body, from the forces on it",
    &[6],
    NumberKind::Float32,
);
const VON_MISES: Field =
    on_cells("von_mises", "Pa", "von Mises stress of that mean stress", &[], NumberKind::Float32);

const FIDELITY: Field = on_cells(
    "fidelity",
    "1",
    "how the body deforms: 0 rigid with local compliance, 1 condensed, 2 full",
    &[],
    NumberKind::UInt8,
);

const FIELDS: [&Field; 7] = [&DISPLACEMENT, &DAMAGE, &FAILED, &FRAGMENT, &STRESS, &VON_MISES, &FIDELITY];

/// Cell data that do not change: written once, every step points at them.
const STATIC_FIELDS: [Field; 3] = [
    on_cells("grain", "1", "number of the grain, -1 for none", &[], NumberKind::Int32),
    on_cells("part", "1", "number of the part, named in attribute names", &[], NumberKind::Int32),
    on_cells("youngs_modulus", "Pa", "Young's modulus of the intact cell", &[], NumberKind::Float32),
];

/// Names of the components of a vector or a symmetric tensor, in VTK's order; none of anything else.
pub(super) fn component_names(components: usize) -> Option<&'static [&'static str]> {
    match components {
        3 => Some(&["x", "y", "z"]),
        6 => Some(&["xx", "yy", "zz", "xy", "yz", "xz"]),
        _ => None,
    }
}

/// Per-step numbers that a reader needs: name and axes after the first.
const STEP_OFFSETS: [(&str, &[usize]); 5] = [
    ("PartOffsets", &[]),
    ("NumberOfParts", &[]),
    ("PointOffsets", &[]),
    ("CellOffsets", &[1]),
    ("ConnectivityIdOffsets", &[1]),
];

/// The open `/VTKHDF` group of a file being written.
pub(super) struct VtkHdf {
    steps: Group,
    /// All that grows, by name: open until the file is closed, so that nothing is written but by a flush.
    columns: BTreeMap<String, Growing>,
    points: usize,
    cells: usize,
    states: usize,
    last_time: f64,
}

/// Writes the mesh; the datasets of it.
fn write_mesh(store: &Store, mesh: &FieldMesh) -> Result<Vec<Dataset>> {
    let mut fixed = Vec::new();
    let mut keep = |dataset: Result<Dataset>| -> Result<Dataset> {
        let dataset = dataset?;
        fixed.push(dataset.clone());
        Ok(dataset)
    };
    for (name, count) in [
        ("NumberOfPoints", mesh.points()),
        ("NumberOfCells", mesh.cells()),
        ("NumberOfConnectivityIds", mesh.connectivity.len()),
    ] {
        store.whole(&format!("VTKHDF/{name}"), &[count as i64], &[])?;
    }
    let points = keep(store.whole("VTKHDF/Points", mesh.points.as_flattened(), &[3]))?;
    store.describe(&points, "m", "points in the reference configuration")?;
    keep(store.whole("VTKHDF/Types", &mesh.types, &[]))?;
    keep(store.whole("VTKHDF/Connectivity", &mesh.connectivity, &[]))?;
    let offsets = if mesh.offsets.is_empty() { &[0][..] } else { &mesh.offsets };
    keep(store.whole("VTKHDF/Offsets", offsets, &[]))?;
    for group in ["PointData", "CellData", "FieldData", "Steps"] {
        store.group(&format!("VTKHDF/{group}"))?;
    }
    for group in ["PointDataOffsets", "CellDataOffsets", "FieldDataOffsets"] {
        store.group(&format!("VTKHDF/Steps/{group}"))?;
    }
    let [grain, part, modulus] = &STATIC_FIELDS;
    let datasets = [
        (grain, keep(store.whole(&grain.path(), &mesh.grain, &[]))?),
        (part, keep(store.whole(&part.path(), &mesh.part, &[]))?),
        (modulus, keep(store.whole(&modulus.path(), &mesh.youngs_modulus, &[]))?),
    ];
    for (field, dataset) in &datasets {
        store.describe(dataset, field.units, field.long_name)?;
    }
    let names: Vec<String> = mesh.parts.iter().enumerate().map(|(at, name)| format!("{at} {name}")).collect();
    store.text_attribute(&datasets[1].1, "names", &names.join("; "))?;
    Ok(fixed)
}

/// Makes everything that grows by a saved state, empty.
fn growing_columns(store: &Store, mesh: &FieldMesh) -> Result<BTreeMap<String, Growing>> {
    let mut columns = BTreeMap::new();
    let mut grows = |made: Growing| {
        columns.insert(made.name.clone(), made);
    };
    for field in FIELDS {
        let rows = if field.on_points { mesh.points() } else { mesh.cells() };
        let layout = Layout::Blocks { rows };
        let made = match field.number {
            NumberKind::Float64 => store.growing::<f64>(&field.path(), field.width, layout)?,
            NumberKind::Float32 => store.growing::<f32>(&field.path(), field.width, layout)?,
            NumberKind::Int32 => store.growing::<i32>(&field.path(), field.width, layout)?,
            NumberKind::UInt8 => store.growing::<u8>(&field.path(), field.width, layout)?,
            NumberKind::Int64 => store.growing::<i64>(&field.path(), field.width, layout)?,
        };
        store.describe(&made.dataset, field.units, field.long_name)?;
        if let Some(names) = component_names(field.width.first().copied().unwrap_or(1)) {
            store.text_attribute(&made.dataset, "component_names", &names.join(" "))?;
        }
        grows(made);
    }
    let times = store.growing::<f64>(TIMES, &[], Layout::Rows(STEP_ROWS))?;
    store.describe(&times.dataset, "1", "stages completed plus the completed share of the present one")?;
    grows(times);
    // Not of the format; readers ignore it.
    let increments = store.growing::<i64>(INCREMENTS, &[], Layout::Rows(STEP_ROWS))?;
    store.describe(&increments.dataset, "1", "accepted increment that the state belongs to")?;
    grows(increments);
    for (name, width) in STEP_OFFSETS {
        grows(store.growing::<i64>(&format!("VTKHDF/Steps/{name}"), width, Layout::Rows(STEP_ROWS))?);
    }
    for field in FIELDS.into_iter().chain(&STATIC_FIELDS) {
        grows(store.growing::<i64>(&field.offsets(), &[], Layout::Rows(STEP_ROWS))?);
    }
    Ok(columns)
}

impl VtkHdf {
    /// Writes the mesh and makes the empty fields. Returns the datasets that are never written again too.
    pub fn create(store: &Store, mesh: &FieldMesh) -> Result<(Self, Vec<Dataset>)> {
        let root = store.group("VTKHDF")?;
        let kind = FixedAscii::<16>::from_ascii("UnstructuredGrid")
            .map_err(|e| store.fail("VTKHDF@Type", format!("{e:?}")))?;
        store.number_attribute(&root, "Type", kind)?;
        let version = root.new_attr_builder().with_data(&[2_i64, 2]).create("Version");
        store.hdf5("VTKHDF@Version", version)?;
        let fixed = write_mesh(store, mesh)?;
        let columns = growing_columns(store, mesh)?;
        let steps = store.group("VTKHDF/Steps")?;
        store.number_attribute(&steps, "NSteps", 0_i64)?;
        let (points, cells) = (mesh.points(), mesh.cells());
        let made = VtkHdf { steps, columns, points, cells, states: 0, last_time: f64::NEG_INFINITY };
        Ok((made, fixed))
    }

    /// Opens the group of an existing file and forgets the states from `states` on.
    pub fn resume(store: &Store, states: usize) -> Result<Self> {
        let points = store.hdf5("VTKHDF/Points", store.open("VTKHDF/Points")?.read_raw::<f64>())?.len() / 3;
        let cells = store.open("VTKHDF/Types")?.size();
        let mut columns = BTreeMap::new();
        let mut cut = |name: String, rows: usize, end: usize| -> Result<()> {
            let column = store.grown(&name)?;
            if column.rows() < rows {
                return Err(store.fail(&name, format!("has fewer than {states} states")));
            }
            column.resize(store, end)?;
            columns.insert(name, column);
            Ok(())
        };
        let steps = store.group("VTKHDF/Steps")?;
        store.number_attribute(&steps, "NSteps", states as i64)?;
        for name in [TIMES, INCREMENTS] {
            cut(name.into(), states, states)?;
        }
        for (name, _) in STEP_OFFSETS {
            cut(format!("VTKHDF/Steps/{name}"), states, states)?;
        }
        for field in FIELDS.into_iter().chain(&STATIC_FIELDS) {
            cut(field.offsets(), states, states)?;
        }
        for field in FIELDS {
            // To the end of a chunk, so that none that is there is touched.
            let rows = if field.on_points { points } else { cells };
            let end = states * block_stride(rows, field.row_bytes());
            let filled = if states > 0 { end - block_stride(rows, field.row_bytes()) + rows } else { 0 };
            cut(field.path(), filled, end)?;
        }
        let mut resumed = VtkHdf { steps, columns, points, cells, states, last_time: f64::NEG_INFINITY };
        let seen = store.hdf5(TIMES, resumed.column(store, TIMES)?.dataset.read_raw::<f64>())?;
        resumed.last_time = seen.last().copied().unwrap_or(f64::NEG_INFINITY);
        Ok(resumed)
    }

    fn column(&self, store: &Store, name: &str) -> Result<&Growing> {
        self.columns.get(name).ok_or_else(|| store.fail(name, "is missing"))
    }

    /// Refuses a mesh that is not the file's.
    pub fn check_mesh(&self, store: &Store, mesh: &FieldMesh) -> Result<()> {
        if (mesh.points(), mesh.cells()) != (self.points, self.cells) {
            let message = format!(
                "has {} points and {} cells, the run to continue has {} and {}",
                self.points,
                self.cells,
                mesh.points(),
                mesh.cells()
            );
            return Err(store.fail("VTKHDF", message));
        }
        Ok(())
    }

    /// States saved so far.
    pub fn states(&self) -> usize {
        self.states
    }

    /// Appends a state and returns its number.
    pub fn save(&mut self, store: &Store, state: &FieldState<'_>) -> Result<usize> {
        self.check(store, state)?;
        let displacement: Vec<[f64; 3]> = state.displacement.iter().map(|u| [u.x, u.y, u.z]).collect();
        let damage: Vec<f32> = state.damage.iter().map(|&d| d as f32).collect();
        let failed: Vec<u8> = state.failed.iter().map(|&f| u8::from(f)).collect();
        let stress: Vec<[f32; 6]> = state.stress.iter().map(|s| s.map(|c| c as f32)).collect();
        let equivalent: Vec<f32> = state.stress.iter().map(|s| von_mises(s) as f32).collect();
        self.put(store, &DISPLACEMENT, displacement.as_flattened())?;
        self.put(store, &DAMAGE, &damage)?;
        self.put(store, &FAILED, &failed)?;
        self.put(store, &FRAGMENT, state.fragment)?;
        self.put(store, &STRESS, stress.as_flattened())?;
        self.put(store, &VON_MISES, &equivalent)?;
        self.put(store, &FIDELITY, state.fidelity)?;
        for field in &STATIC_FIELDS {
            self.column(store, &field.offsets())?.put(store, self.states, &[0_i64])?;
        }
        for (name, _) in STEP_OFFSETS {
            let value = i64::from(name == "NumberOfParts");
            self.column(store, &format!("VTKHDF/Steps/{name}"))?.put(store, self.states, &[value])?;
        }
        self.column(store, INCREMENTS)?.put(store, self.states, &[state.increment as i64])?;
        self.column(store, TIMES)?.put(store, self.states, &[state.time])?;
        store.number_attribute(&self.steps, "NSteps", self.states as i64 + 1)?;
        self.states += 1;
        self.last_time = state.time;
        Ok(self.states - 1)
    }

    /// The datasets whose blocks are never written again.
    pub fn block_datasets(&self, store: &Store) -> Result<Vec<&Dataset>> {
        FIELDS.into_iter().map(|field| Ok(&self.column(store, &field.path())?.dataset)).collect()
    }

    fn check(&self, store: &Store, state: &FieldState<'_>) -> Result<()> {
        for (name, found, expected) in [
            ("displacement", state.displacement.len(), self.points),
            ("damage", state.damage.len(), self.cells),
            ("failed", state.failed.len(), self.cells),
            ("fragment", state.fragment.len(), self.cells),
            ("stress", state.stress.len(), self.cells),
            ("fidelity", state.fidelity.len(), self.cells),
        ] {
            if found != expected {
                return Err(store.fail(name, format!("has {found} entries, the mesh has {expected}")));
            }
        }
        // No order at all: NaN.
        if state.time.partial_cmp(&self.last_time) != Some(std::cmp::Ordering::Greater) {
            let message = format!("time {} does not follow {}", state.time, self.last_time);
            return Err(store.fail("VTKHDF/Steps/Values", message));
        }
        Ok(())
    }

    fn block_start(&self, field: &Field, state: usize) -> usize {
        let rows = if field.on_points { self.points } else { self.cells };
        state * block_stride(rows, field.row_bytes())
    }

    fn put<T: hdf5::H5Type>(&self, store: &Store, field: &Field, values: &[T]) -> Result<()> {
        let start = self.block_start(field, self.states);
        self.column(store, &field.path())?.put(store, start, values)?;
        self.column(store, &field.offsets())?.put(store, self.states, &[start as i64])
    }
}
