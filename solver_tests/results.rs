//! The results file as its users meet it: opened by VTK's own reader and by h5py, killed while it is
//! written, refused to a second writer, cut off by a full disk, resumed.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use riprap::results::{
    BodyRow, CaseRecord, CellKind, Column, Existing, FieldMesh, FieldState, GrainRow, HistoryRow, Outcome,
    Reader, Summary, Writer, journal, write_history_csv, write_vtu_series,
};
use riprap::tensor::Vec3;

/// Kuhn's split of a unit cube into six tetrahedra, corners by bits xyz.
const KUHN: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 5, 1, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 6, 4, 7]];
/// VTK's mid-side nodes of a quadratic tetrahedron.
const MIDSIDES: [(usize, usize); 6] = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)];

/// Cubic grains of 10 mm in a block of `counts`, with a bottom plate.
fn block_of_grains(counts: [usize; 3]) -> FieldMesh {
    let mut mesh = FieldMesh::new();
    let grains = mesh.add_part("grains");
    let plate = mesh.add_part("bottom plate");
    let size = 0.010;
    let mut grain = 0;
    for k in 0..counts[2] {
        for j in 0..counts[1] {
            for i in 0..counts[0] {
                let origin = Vec3::new(i as f64, j as f64, k as f64) * (1.02 * size);
                // Points on the lattice of half edges, numbered as they are met.
                let mut numbers = std::collections::BTreeMap::new();
                for corners in KUHN {
                    let lattice =
                        |corner: usize| [corner & 1, corner >> 1 & 1, corner >> 2 & 1].map(|c| 2 * c);
                    let mut keys: Vec<[usize; 3]> = corners.iter().map(|&c| lattice(c)).collect();
                    for (a, b) in MIDSIDES {
                        keys.push(std::array::from_fn(|axis| (keys[a][axis] + keys[b][axis]) / 2));
                    }
                    let nodes: Vec<usize> = keys
                        .iter()
                        .map(|key| {
                            *numbers.entry(*key).or_insert_with(|| {
                                let at = Vec3::new(key[0] as f64, key[1] as f64, key[2] as f64);
                                mesh.add_point(&(origin + at * (0.5 * size)))
                            })
                        })
                        .collect();
                    let modulus = 30e9 + 1e9 * grain as f64;
                    mesh.add_cell(CellKind::Tet10, &nodes, grains, Some(grain), modulus)
                        .expect("a good cell");
                }
                grain += 1;
            }
        }
    }
    let width = 0.011 * counts[0] as f64;
    let corners = [(0.0, 0.0), (width, 0.0), (width, width), (0.0, width)]
        .map(|(x, y)| mesh.add_point(&Vec3::new(x, y, -0.001)));
    mesh.add_cell(CellKind::Quad, &corners, plate, None, f64::NAN).expect("a good cell");
    mesh
}

/// Fields of state `state`: a linear displacement, damage and stress that name their cell and state.
struct Fields {
    displacement: Vec<Vec3>,
    damage: Vec<f64>,
    failed: Vec<bool>,
    fragment: Vec<i32>,
    stress: Vec<[f64; 6]>,
    fidelity: Vec<u8>,
}

impl Fields {
    fn new(mesh: &FieldMesh, state: usize) -> Self {
        let share = state as f64;
        let displacement =
            (0..mesh.points()).map(|p| Vec3::new(0.0, 1e-6 * p as f64, -1e-3 * share)).collect();
        let cells = mesh.cells();
        Fields {
            displacement,
            damage: (0..cells).map(|c| 0.1 * share + 1e-3 * c as f64).collect(),
            failed: (0..cells).map(|c| state > 0 && c == 0).collect(),
            fragment: (0..cells).map(|c| (10 * state + c) as i32).collect(),
            fidelity: (0..cells).map(|c| (c % 2) as u8).collect(),
            stress: (0..cells).map(|c| [-1e6 * share, 0.0, 0.0, 0.0, 0.0, c as f64]).collect(),
        }
    }

    fn at(&self, increment: usize) -> FieldState<'_> {
        FieldState {
            time: increment as f64 / 1000.0,
            increment: increment as u64,
            displacement: &self.displacement,
            damage: &self.damage,
            failed: &self.failed,
            fragment: &self.fragment,
            stress: &self.stress,
            fidelity: &self.fidelity,
        }
    }
}

fn history_row(increment: usize) -> HistoryRow {
    let strain = 1e-3 * increment as f64;
    HistoryRow {
        stage: 1,
        increment: increment as i64,
        time: increment as f64 / 1000.0,
        axial_strain: strain,
        volumetric_strain: 0.2 * strain,
        deviatoric_stress: 1e6 * strain * (0.12 - strain),
        confining_pressure: 0.8e6,
        void_ratio: f64::NAN,
        newton_iterations: 4,
        ..HistoryRow::default()
    }
}

fn grain_row(grain: usize, state: usize) -> GrainRow {
    GrainRow {
        position: Vec3::new(grain as f64, 0.0, state as f64),
        rotation: Vec3::new(0.0, 0.0, 0.1),
        damage_mean: 0.1,
        damage_max: 0.2,
        failed_fraction: 0.0,
        fragments: 1,
        local_shear_strain: 0.01,
        local_volumetric_strain: -0.001,
        turn: 0.1,
        level: 1,
    }
}

fn body_row(increment: usize) -> BodyRow {
    let along = |value: f64| Vec3::new(value, 0.0, 0.0);
    BodyRow {
        position: along(1.0 + increment as f64),
        rotation: Vec3::zeros(),
        displacement: along(increment as f64),
        force: along(-5.0),
        moment: Vec3::zeros(),
        reaction_force: along(5.0),
        reaction_moment: Vec3::zeros(),
    }
}

fn case_record() -> CaseRecord {
    CaseRecord {
        title: "two grains – Zwei Körner".into(),
        given: "{ \"title\": \"two grains\" } // as given".into(),
        completed: "{}".into(),
        seed: 20110105,
        threads: 2,
        stages: vec!["consolidate".into(), "shear".into()],
    }
}

/// Two grains, two bodies, three states, twelve increments.
fn write_small_file(path: &Path) -> FieldMesh {
    let mesh = block_of_grains([2, 1, 1]);
    let mut writer = Writer::create(path, &case_record(), Existing::Refuse).expect("a new file");
    writer.set_mesh(mesh.clone()).expect("mesh");
    writer
        .write_table("grains", &[Column::floats("volume", "m3", "volume of the grain", vec![1e-6, 1e-6])])
        .expect("grains");
    writer.set_bodies(&["left", "right"]).expect("bodies");
    let mut state = 0;
    for increment in 0..=12 {
        if increment > 0 {
            writer.append(&history_row(increment), &[body_row(increment); 2]).expect("row");
        }
        if increment % 6 == 0 {
            let number = writer.save_state(&Fields::new(&mesh, state).at(increment)).expect("state");
            assert_eq!(number, state);
            writer.save_grains(&[grain_row(0, state), grain_row(1, state)]).expect("grains");
            let contacts = [
                Column::integers("first", "number of the first grain", vec![0]),
                Column::integers("second", "number of the second grain", vec![1]),
                Column::vectors("force", "N", "force on the second grain", vec![[1.0, 0.0, 0.0]]),
            ];
            writer.write_table(&format!("contacts/{state}"), &contacts).expect("contacts");
            state += 1;
        }
        writer.commit().expect("commit");
    }
    writer.finish(Outcome::Finished, "end of the case", 12).expect("end");
    mesh
}

/// Python with h5py and vtk, from `scripts/python_env`. Where those cannot be had the test is skipped, with the
/// reason printed, but never in CI.
fn python() -> Option<PathBuf> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/python_env");
    let output = Command::new("sh").arg(&script).output().expect("sh runs");
    if output.status.success() {
        return Some(PathBuf::from(String::from_utf8_lossy(&output.stdout).trim()));
    }
    let reason = String::from_utf8_lossy(&output.stderr).trim().to_string();
    assert!(std::env::var("CI").as_deref() != Ok("true"), "CI needs Python: {reason}");
    eprintln!("SKIPPED: {reason}");
    None
}

fn run_python(python: &Path, program: &str, arguments: &[&str]) -> String {
    let output = Command::new(python)
        .arg("-c")
        .arg(program)
        .args(arguments)
        .env("PYTHONPATH", Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts"))
        .output()
        .expect("python runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "python failed:\n{}{}", text(&output.stdout), text(&output.stderr));
    text(&output.stdout)
}

#[test]
fn vtk_reads_every_state() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("two.h5");
    let mesh = write_small_file(&path);
    let program = r#"
import sys
from vtkmodules.vtkIOHDF import vtkHDFReader
from vtkmodules.util.numpy_support import vtk_to_numpy as numpy_of
path, points, cells = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
reader = vtkHDFReader()
assert reader.CanReadFile(path)
reader.SetFileName(path)
reader.UpdateInformation()
assert reader.GetNumberOfSteps() == 3, reader.GetNumberOfSteps()
for state in range(3):
    reader.SetStep(state)
    reader.Update()
    assert abs(reader.GetTimeValue() - 0.006 * state) < 1e-12, reader.GetTimeValue()
    grid = reader.GetOutputDataObject(0)
    assert grid.GetClassName() == 'vtkUnstructuredGrid', grid.GetClassName()
    assert (grid.GetNumberOfPoints(), grid.GetNumberOfCells()) == (points, cells)
    kinds = [grid.GetCellType(c) for c in range(cells)]
    assert kinds == [24] * (cells - 1) + [9], kinds
    data = grid.GetCellData()
    array = lambda name: numpy_of(data.GetArray(name))
    u = numpy_of(grid.GetPointData().GetArray('displacement'))
    assert u.shape == (points, 3)
    assert (abs(u[:, 2] + 1e-3 * state) < 1e-15).all()
    assert abs(u[-1, 1] - 1e-6 * (points - 1)) < 1e-12
    assert abs(array('damage')[7] - (0.1 * state + 7e-3)) < 1e-6
    assert array('fragment')[7] == 10 * state + 7
    assert list(array('failed')) == [int(state > 0)] + [0] * (cells - 1)
    stress = array('stress')
    assert stress.shape == (cells, 6)
    assert (stress[:, 0] == -1e6 * state).all() and stress[5, 5] == 5
    assert abs(array('von_mises')[5] - ((1e6 * state) ** 2 + 75) ** 0.5) <= 1e-6 * (1e6 * state + 1)
    assert list(array('grain')) == [0] * 6 + [1] * 6 + [-1]
    assert list(array('part')) == [0] * 12 + [1]
    modulus = array('youngs_modulus')
    assert abs(modulus[0] / 30e9 - 1) < 1e-6 and abs(modulus[6] / 31e9 - 1) < 1e-6
    # Volume by VTK's own quadrature of the cells: the connectivity is in VTK's order.
    from vtkmodules.vtkFiltersVerdict import vtkCellSizeFilter
    sizes = vtkCellSizeFilter()
    sizes.SetInputData(grid)
    sizes.Update()
    volume = numpy_of(sizes.GetOutput().GetCellData().GetArray('Volume'))[:12].sum()
    assert abs(volume - 2e-6) < 1e-15, volume
print('read')
"#;
    let arguments = [path.to_str().expect("path"), &mesh.points().to_string(), &mesh.cells().to_string()];
    assert_eq!(run_python(&python, program, &arguments).trim(), "read");
}

#[test]
fn vtk_reads_the_exported_series() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("two.h5");
    write_small_file(&path);
    let reader = Reader::open(&path).expect("opens");
    let series = write_vtu_series(&reader, &dir.path().join("out"), "a <b> & \"c\"").expect("exported");
    // Every file against the temporary grid that VTK reads from the results file itself.
    let program = r#"
import sys, os, xml.etree.ElementTree
import numpy
from vtkmodules.vtkIOHDF import vtkHDFReader
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
from vtkmodules.util.numpy_support import vtk_to_numpy as numpy_of
path, series = sys.argv[1:3]
sets = xml.etree.ElementTree.parse(series).getroot().findall('Collection/DataSet')
assert len(sets) == 3
reader = vtkHDFReader()
reader.SetFileName(path)
reader.UpdateInformation()
for state, entry in enumerate(sets):
    reader.SetStep(state)
    reader.Update()
    expected = reader.GetOutputDataObject(0)
    assert float(entry.get('timestep')) == reader.GetTimeValue()
    one = vtkXMLUnstructuredGridReader()
    one.SetFileName(os.path.join(os.path.dirname(series), entry.get('file')))
    one.Update()
    grid = one.GetOutput()
    assert one.GetErrorCode() == 0
    counts = lambda g: (g.GetNumberOfPoints(), g.GetNumberOfCells())
    assert counts(grid) == counts(expected), (counts(grid), counts(expected))
    for cell in range(grid.GetNumberOfCells()):
        assert grid.GetCellType(cell) == expected.GetCellType(cell)
        ids = lambda g: [g.GetCell(cell).GetPointId(k) for k in range(g.GetCell(cell).GetNumberOfPoints())]
        assert ids(grid) == ids(expected)
    u = numpy_of(expected.GetPointData().GetArray('displacement'))
    places = lambda g: numpy_of(g.GetPoints().GetData())
    assert (places(grid) == places(expected) + u).all()
    for of in ['GetPointData', 'GetCellData']:
        there, here = getattr(expected, of)(), getattr(grid, of)()
        assert there.GetNumberOfArrays() == here.GetNumberOfArrays() > 0
        for k in range(there.GetNumberOfArrays()):
            a, b = there.GetArray(k), here.GetArray(there.GetArrayName(k))
            assert a.GetDataType() == b.GetDataType(), there.GetArrayName(k)
            numpy.testing.assert_array_equal(numpy_of(a), numpy_of(b))
print('read')
"#;
    let arguments = [&path, &series].map(|path| path.to_str().expect("path"));
    assert_eq!(run_python(&python, program, &arguments).trim(), "read");
}

/// The bodies of a scene in `/VTKHDF`: meshes of their volume that move as `/bodies` says.
#[test]
fn vtk_reads_the_bodies_of_a_scene() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("scene.h5");
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/scenes/card_tent_stands.json");
    let mut run = Command::new(env!("CARGO_BIN_EXE_riprap"));
    run.arg("run").arg(&case).args(["--quiet", "--out"]).arg(&path);
    assert!(run.status().expect("riprap starts").success());
    let program = r#"
import sys
import numpy
from vtkmodules.vtkIOHDF import vtkHDFReader
from vtkmodules.vtkFiltersVerdict import vtkCellSizeFilter
from vtkmodules.util.numpy_support import vtk_to_numpy as numpy_of
from riprap_results import Results
from read_results import bodies, contacts, history, states
path = sys.argv[1]
with Results(path) as results:
    parts, increments = results.parts, results.state_increments
tables = bodies(path, plain=True)
assert sorted(parts) == sorted(tables), (parts, sorted(tables))
reader = vtkHDFReader()
reader.SetFileName(path)
reader.UpdateInformation()
assert reader.GetNumberOfSteps() == len(increments) > 2
reader.SetStep(len(increments) - 1)
reader.Update()
grid = reader.GetOutputDataObject(0)
u = numpy_of(grid.GetPointData().GetArray('displacement'))
points = numpy_of(grid.GetPoints().GetData())
part = numpy_of(grid.GetCellData().GetArray('part'))
sizes = vtkCellSizeFilter()
sizes.SetInputData(grid)
sizes.Update()
volume = numpy_of(sizes.GetOutput().GetCellData().GetArray('Volume'))
for number, name in enumerate(parts):
    cells = numpy.flatnonzero(part == number)
    ids = sorted({grid.GetCell(c).GetPointId(k) for c in cells for k in range(grid.GetCell(c).GetNumberOfPoints())})
    expected = 0.1 if name == 'ground' else 2e-4
    assert abs(volume[cells].sum() / expected - 1) < 1e-9, (name, volume[cells].sum())
    # A rigid motion: distances stay. The nodes of these boxes lie evenly about the reference point.
    moved = points[ids] + u[ids]
    distances = [numpy.linalg.norm(places[0] - places, axis=1) for places in (points[ids], moved)]
    assert abs(distances[0] - distances[1]).max() < 1e-12
    end = [tables[name][f'displacement_{axis}'][increments[-1] - 1] for axis in 'xyz']
    assert abs(u[ids].mean(axis=0) - end).max() < 1e-12, (name, u[ids].mean(axis=0), end)
    assert (abs(u[ids]).max() == 0) == (name == 'ground'), name
assert len(contacts(path, plain=True)['slip']) > 0
assert states(path, plain=True)['displacement'].shape == (len(increments), len(points), 3)
assert len(history(path, plain=True)['increment']) == increments[-1]
print('read')
"#;
    assert_eq!(run_python(&python, program, &[path.to_str().expect("path")]).trim(), "read");
}

#[test]
fn vtk_reads_after_each_state() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let mesh = block_of_grains([2, 1, 1]);
    let path = dir.path().join("growing.h5");
    let mut writer = Writer::create(&path, &case_record(), Existing::Refuse).expect("a new file");
    writer.set_mesh(mesh.clone()).expect("mesh");
    let mut copies = Vec::new();
    for state in 0..3 {
        writer.save_state(&Fields::new(&mesh, state).at(state)).expect("state");
        writer.commit().expect("commit");
        // A copy is what a kill would leave now.
        let copy = dir.path().join(format!("after{state}.h5"));
        std::fs::copy(&path, &copy).expect("copy");
        copies.push(copy);
    }
    let program = r#"
import sys
from vtkmodules.vtkIOHDF import vtkHDFReader
for count, path in enumerate(sys.argv[1:], 1):
    reader = vtkHDFReader()
    reader.SetFileName(path)
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == count, (reader.GetNumberOfSteps(), count, path)
    reader.SetStep(count - 1)
    reader.Update()
    assert reader.GetOutputDataObject(0).GetNumberOfCells() == 13
print('read')
"#;
    let names: Vec<&str> = copies.iter().map(|copy| copy.to_str().expect("path")).collect();
    assert_eq!(run_python(&python, program, &names).trim(), "read");
}

#[test]
fn h5py_finds_names_units_and_shapes() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("two.h5");
    write_small_file(&path);
    // The names are written out here, apart from the program's table: they are the contract.
    let program = r#"
import sys, h5py, numpy
names = '''stage increment axial_strain radial_strain volumetric_strain axial_stress confining_pressure
    deviatoric_stress mean_stress void_ratio coordination_number sliding_fraction failed_points deleted_cells
    fragments augmentations newton_iterations factorisations cuts wall_time out_of_balance max_penetration
    energy_external energy_elastic energy_friction energy_damage energy_stabilisation energy_membrane
    energy_error'''.split()
file = h5py.File(sys.argv[1])
for name in names:
    dataset = file['history'][name]
    assert dataset.shape == (12,), name
    assert isinstance(dataset.attrs['units'], str) and dataset.attrs['units'], name
    assert isinstance(dataset.attrs['long_name'], str) and dataset.attrs['long_name'], name
for name in names:
    if name.startswith('energy'):
        assert file['history'][name].attrs['units'] == 'J'
assert file['history/axial_stress'].attrs['units'] == 'Pa'
assert list(file['history/increment']) == list(range(1, 13))
assert numpy.allclose(file['history/axial_strain'], numpy.arange(1, 13) * 1e-3, rtol=1e-15)
assert numpy.isnan(file['history/void_ratio'][0])
for body in ('left', 'right'):
    for name in 'position rotation displacement force moment reaction_force reaction_moment'.split():
        assert file['bodies'][body][name].shape == (12, 3)
        assert file['bodies'][body][name].attrs['units']
assert list(file['bodies/left/displacement'][:, 0]) == list(range(1, 13))
assert file['grains/volume'].shape == (2,)
assert file['grains/position'].shape == (3, 2, 3) and file['grains/position'][2, 1].tolist() == [1, 0, 2]
assert file['grains/damage_max'].shape == (3, 2)
assert file['contacts/2/force'].shape == (1, 3)
assert file['case/seed'][()] == 20110105 and file['case/threads'][()] == 2
assert file['case/given'].asstr()[()].endswith('as given')
assert 'Körner' in file['case/title'].asstr()[()]
for name in ('completed', 'version', 'commit', 'host'):
    assert file['case'][name].asstr()[()]
assert file['status'].asstr()[()] == 'finished'
assert file['status'].attrs['reason'] == 'end of the case'
assert file['status'].attrs['last_good_increment'] == 12
print('read')
"#;
    assert_eq!(run_python(&python, program, &[path.to_str().expect("path")]).trim(), "read");
}

#[test]
fn summary_and_csv_say_what_is_in_the_file() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("two.h5");
    let mesh = write_small_file(&path);
    let reader = Reader::open(&path).expect("opens");
    let summary = Summary::of(&reader).expect("summary");
    assert_eq!((summary.status.as_str(), summary.increments, summary.states.len()), ("finished", 12, 3));
    assert_eq!((summary.grains, summary.cells, summary.points), (2, mesh.cells(), mesh.points()));
    assert_eq!(summary.bodies, ["left", "right"]);
    assert_eq!(summary.contact_states, ["0", "1", "2"]);
    let json: serde_json::Value = serde_json::from_str(&summary.to_json()).expect("JSON");
    assert_eq!(json["last_good_increment"], 12);
    assert!(summary.to_string().contains("two grains"));
    let mut csv = Vec::new();
    write_history_csv(&reader, &mut csv, Path::new("-")).expect("export");
    let csv = String::from_utf8(csv).expect("text");
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 13);
    assert!(lines[0].starts_with("stage [1],increment [1],time [1],axial_strain [1]"), "{}", lines[0]);
    let strain: f64 = lines[12].split(',').nth(3).expect("column").parse().expect("number");
    assert_eq!(strain, history_row(12).axial_strain);
}

/// Later versions add columns; what an earlier one wrote is still read.
#[test]
fn file_without_the_newest_columns_is_read() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("older.h5");
    write_small_file(&path);
    hdf5::File::open_rw(&path).and_then(|file| file.unlink("history/energy_gap")).expect("column taken out");
    let reader = Reader::open(&path).expect("opens");
    assert_eq!(reader.increments().expect("rows"), 12);
    assert!(reader.history("energy_gap").expect("column").iter().all(|value| value.is_nan()));
    assert_eq!(reader.history("energy_gap").expect("column").len(), 12);
    assert!(reader.history("energy_gape").is_err());
    assert!(Summary::of(&reader).expect("summary").last.iter().all(|last| last.name != "energy_gap"));
    let mut csv = Vec::new();
    write_history_csv(&reader, &mut csv, Path::new("-")).expect("export");
    let csv = String::from_utf8(csv).expect("text");
    assert!(csv.lines().all(|line| line.split(',').count() == riprap::results::HISTORY.len() - 1));
}

#[test]
fn existing_file_is_kept_unless_replaced() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("kept.h5");
    std::fs::write(&path, "precious").expect("file");
    let refused = Writer::create(&path, &case_record(), Existing::Refuse).err().expect("a refusal");
    assert!(refused.to_string().contains("--force"), "{refused}");
    assert_eq!(std::fs::read(&path).expect("file"), b"precious");
    drop(Writer::create(&path, &case_record(), Existing::Replace).expect("replaced"));
    assert_eq!(Reader::open(&path).expect("opens").increments().expect("rows"), 0);
}

#[test]
fn dropping_a_writer_does_not_commit() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("dropped.h5");
    let mesh = block_of_grains([2, 1, 1]);
    let mut writer = Writer::create(&path, &case_record(), Existing::Refuse).expect("a new file");
    writer.set_mesh(mesh.clone()).expect("mesh");
    writer.append(&history_row(1), &[]).expect("row");
    writer.commit().expect("commit");
    let committed = std::fs::metadata(&path).expect("file").len();
    writer.append(&history_row(2), &[]).expect("row");
    writer.save_state(&Fields::new(&mesh, 1).at(2)).expect("state");
    writer.save_restart(2, &[1; 100_000]).expect("restart");
    drop(writer);
    assert_eq!(std::fs::metadata(&path).expect("file").len(), committed);
    assert!(!journal::path_of(&path).exists());
    let summary = Summary::of(&Reader::open(&path).expect("opens")).expect("summary");
    assert_eq!((summary.increments, summary.states.len(), summary.restart_increment), (1, 0, None));
}

#[test]
fn foreign_and_damaged_files_are_errors() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("bad.h5");
    let message = |path: &Path| match Reader::open(path).and_then(|reader| Summary::of(&reader)) {
        Ok(_) => panic!("{} was accepted", path.display()),
        Err(error) => error.to_string(),
    };
    assert!(message(&path).contains("no such file"));
    std::fs::write(&path, "not HDF5").expect("file");
    assert!(message(&path).contains("not an HDF5 file"), "{}", message(&path));
    write_small_file(&dir.path().join("good.h5"));
    let good = std::fs::read(dir.path().join("good.h5")).expect("file");
    // Cut anywhere or overwritten anywhere: an error or a summary, never a panic.
    for share in [1, 5, 20, 50, 80, 99] {
        std::fs::write(&path, &good[..good.len() * share / 100]).expect("file");
        let _ = message(&path);
    }
    for share in 0..40 {
        let mut bytes = good.clone();
        let start = good.len() * share / 40;
        let end = (start + 64).min(good.len());
        bytes[start..end].fill(0xa5);
        std::fs::write(&path, &bytes).expect("file");
        let _ = Reader::open(&path).and_then(|reader| Summary::of(&reader));
    }
}

#[test]
fn python_reader_rolls_back_as_riprap_does() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("two.h5");
    write_small_file(&path);
    let good = std::fs::read(&path).expect("file");
    let program = "import sys, riprap_results\n\
        with riprap_results.Results(sys.argv[1]) as results: print(len(results.history), len(results.states))";
    for whole_journal in [true, false] {
        let snapshot = journal::snapshot(&path, good.len() as u64, &[(4096, 1000)]).expect("snapshot");
        journal::write(&path, &snapshot, false).expect("journal");
        if whole_journal {
            let mut torn = good.clone();
            torn[..2000].fill(0);
            torn.extend_from_slice(b"half of a chunk");
            std::fs::write(&path, &torn).expect("file");
        } else {
            let journal = std::fs::read(journal::path_of(&path)).expect("journal");
            std::fs::write(journal::path_of(&path), &journal[..journal.len() / 2]).expect("journal");
        }
        let printed = run_python(&python, program, &[path.to_str().expect("path")]);
        assert_eq!(printed.trim(), "12 3");
        assert_eq!(std::fs::read(&path).expect("file"), good);
        assert!(!journal::path_of(&path).exists());
    }
}

#[test]
fn scripts_draw_their_pictures() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("two.h5");
    write_small_file(&path);
    let draw = |script: &str, options: &[&str], picture: &str| {
        let picture = dir.path().join(picture);
        let output = Command::new(&python)
            .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts").join(script))
            .arg(&path)
            .args(options)
            .arg("--out")
            .arg(&picture)
            .output()
            .expect("python runs");
        assert!(output.status.success(), "{script}: {}", String::from_utf8_lossy(&output.stderr));
        let bytes = std::fs::read(&picture).expect("picture");
        assert!(bytes.starts_with(b"\x89PNG") && bytes.len() > 5000, "{script}: {} bytes", bytes.len());
    };
    draw("plot_history.py", &[], "curves.png");
    draw("plot_history.py", &["--energy"], "energies.png");
    draw("plot_specimen.py", &["--state", "0", "-1", "--colour", "damage", "--size", "200"], "specimen.png");
    let missing = Command::new(&python)
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/plot_history.py"))
        .args(["nowhere.h5", "--out", "x.png"])
        .output()
        .expect("python runs");
    let message = String::from_utf8_lossy(&missing.stderr);
    assert!(!missing.status.success() && message.contains("nowhere.h5: no such file"), "{message}");
    assert!(!message.contains("Traceback"), "{message}");
}

/// Not a test: the process that the tests below kill. Writes `RIPRAP_TEST_FILE` without end.
#[test]
#[ignore = "run by other tests as a child process"]
fn child_writes_without_end() {
    let Ok(path) = std::env::var("RIPRAP_TEST_FILE") else { return };
    let limit: usize =
        std::env::var("RIPRAP_TEST_ROWS").ok().and_then(|rows| rows.parse().ok()).unwrap_or(1_000_000);
    let mesh = block_of_grains([6, 6, 6]);
    let path = PathBuf::from(path);
    let write = || -> riprap::error::Result<()> {
        let (mut writer, done) = match path.exists() && std::env::var("RIPRAP_TEST_RESUME").is_ok() {
            true => {
                let (writer, restart) = Writer::resume(&path)?;
                (writer, restart.rows)
            }
            false => {
                let mut writer = Writer::create(&path, &case_record(), Existing::Replace)?;
                writer.set_bodies(&["left"])?;
                writer.save_restart(0, &[])?;
                writer.commit()?;
                (writer, 0)
            }
        };
        writer.set_mesh(mesh.clone())?;
        for increment in done + 1..=limit {
            writer.append(&history_row(increment), &[body_row(increment)])?;
            if increment % 10 == 0 {
                let state = writer.save_state(&Fields::new(&mesh, increment / 10).at(increment))?;
                let table = [Column::integers(
                    "first",
                    "first grain",
                    (0..1000).map(|n| n * increment as i64).collect(),
                )];
                writer.write_table(&format!("contacts/{state}"), &table)?;
                writer.save_restart(increment as u64, &vec![(increment % 251) as u8; 200_000 + increment])?;
            }
            if let Err(error) = writer.commit() {
                assert!(
                    writer.finish(Outcome::Stopped, "as a run would", 0).is_err(),
                    "no commit after a failed one"
                );
                return Err(error);
            }
        }
        writer.finish(Outcome::Finished, "", limit as u64)
    };
    if let Err(error) = write() {
        eprintln!("ERROR {error}");
        std::process::exit(4);
    }
}

fn child(path: &Path) -> Command {
    let mut command = Command::new(std::env::current_exe().expect("this test"));
    command
        .args(["child_writes_without_end", "--exact", "--ignored", "--nocapture"])
        .env("RIPRAP_TEST_FILE", path)
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command
}

fn spawn_child(path: &Path) -> Child {
    child(path).spawn().expect("a child process")
}

fn wait_for(what: &str, mut ready: impl FnMut() -> bool) {
    let start = Instant::now();
    while !ready() {
        assert!(start.elapsed() < Duration::from_secs(60), "waited a minute for {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn killed_writer_leaves_its_last_commit() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("killed.h5");
    let kills: u64 = std::env::var("RIPRAP_TEST_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(12);
    let (mut torn, mut in_commit) = (0, 0);
    for kill in 0..kills {
        let _ = std::fs::remove_file(&path);
        let _ = std::fs::remove_file(journal::path_of(&path));
        let mut child = spawn_child(&path);
        wait_for("the child's file", || path.exists());
        // A different moment each time, spread over the first 600 ms.
        std::thread::sleep(Duration::from_micros(20_000 + (kill * 48_271) % 600_000));
        child.kill().expect("kill");
        child.wait().expect("end of the child");
        // As it lies there, without a repair: for the record.
        in_commit += u64::from(journal::path_of(&path).exists());
        let plain = dir.path().join("plain.h5");
        std::fs::copy(&path, &plain).expect("copy");
        torn += u64::from(Reader::open(&plain).and_then(|reader| Summary::of(&reader)).is_err());
        // As riprap opens it.
        let reader = Reader::open(&path).expect("opens after a kill");
        assert!(!reader.is_live() && !journal::path_of(&path).exists());
        let summary = Summary::of(&reader).expect("everything can be read");
        assert_eq!(summary.status, "killed");
        assert_eq!(summary.last_good_increment as usize, summary.increments, "row and status are one commit");
        let expected: Vec<f64> = (1..=summary.increments).map(|i| history_row(i).axial_strain).collect();
        assert_eq!(reader.history("axial_strain").expect("column"), expected);
        if summary.increments > 0 {
            assert_eq!(reader.shape("bodies/left/force").expect("shape")[0], summary.increments);
        }
        if reader.has("VTKHDF") {
            assert_eq!(summary.states.len(), summary.increments / 10);
            let stress = reader.floats("VTKHDF/CellData/stress").expect("stress");
            assert!(stress.len() >= summary.states.len() * summary.cells * 6);
        }
        if summary.increments >= 10 {
            let restart = reader.restart().expect("restart").expect("a restart point");
            assert_eq!(restart.rows, summary.increments / 10 * 10);
            assert!(restart.bytes.iter().all(|&byte| byte == (restart.rows % 251) as u8));
        }
    }
    println!("{kills} kills, {in_commit} in a commit, {torn} files unreadable before the roll-back");
}

#[test]
fn run_killed_again_and_again_ends_as_an_uninterrupted_one() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let (killed, whole) = (dir.path().join("killed.h5"), dir.path().join("whole.h5"));
    let rows = "150";
    for kill in 0..5_u64 {
        let mut running = child(&killed)
            .env("RIPRAP_TEST_ROWS", rows)
            .env("RIPRAP_TEST_RESUME", "1")
            .spawn()
            .expect("a child process");
        wait_for("the child's file", || killed.exists());
        std::thread::sleep(Duration::from_micros(60_000 + (kill * 48_271) % 90_000));
        running.kill().expect("kill");
        running.wait().expect("end of the child");
    }
    for path in [&killed, &whole] {
        let mut running = child(path);
        let ended = running.env("RIPRAP_TEST_ROWS", rows).env("RIPRAP_TEST_RESUME", "1").status();
        assert!(ended.expect("runs").success());
    }
    let (a, b) = (Reader::open(&whole).expect("opens"), Reader::open(&killed).expect("opens"));
    assert_eq!(a.members("contacts").expect("names"), b.members("contacts").expect("names"));
    for name in [
        "history/increment",
        "history/axial_strain",
        "bodies/left/position",
        "contacts/0/first",
        "contacts/14/first",
        "VTKHDF/Points",
        "VTKHDF/Connectivity",
        "VTKHDF/PointData/displacement",
        "VTKHDF/CellData/damage",
        "VTKHDF/CellData/stress",
        "VTKHDF/Steps/Values",
        "VTKHDF/Steps/PointDataOffsets/displacement",
    ] {
        let (of_whole, of_killed) = (a.floats(name).expect("numbers"), b.floats(name).expect("numbers"));
        assert!(of_whole == of_killed && !of_whole.is_empty(), "{name} differs");
    }
    assert_eq!(
        a.restart().expect("restart").map(|r| r.bytes),
        b.restart().expect("restart").map(|r| r.bytes)
    );
    assert_eq!(a.status().expect("status"), b.status().expect("status"));
}

#[test]
fn locked_file_is_refused_to_writers_and_open_to_readers() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("locked.h5");
    let mut child = spawn_child(&path);
    wait_for("the child's file", || path.exists());
    let replaced = Writer::create(&path, &case_record(), Existing::Replace).err();
    let resumed = Writer::resume(&path).err();
    let read: Vec<_> = (0..20)
        .map(|_| Reader::open(&path).and_then(|reader| Ok((reader.is_live(), reader.increments()?))))
        .collect();
    child.kill().expect("kill");
    child.wait().expect("end of the child");
    for error in [replaced, resumed] {
        let message = error.expect("a refusal").to_string();
        assert!(message.contains("in use"), "{message}");
    }
    let read_well = read.iter().filter(|result| matches!(result, Ok((true, _)))).count();
    // The child does nothing but write, so a read may fall into a commit.
    assert!(read_well >= 10, "{read:?}");
}

#[test]
fn resumed_file_equals_an_uninterrupted_one() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let mesh = block_of_grains([2, 1, 1]);
    let go_on = |writer: &mut Writer, from: usize, to: usize| {
        for increment in from..=to {
            writer.append(&history_row(increment), &[body_row(increment), body_row(0)]).expect("row");
            if increment % 4 == 0 {
                writer.save_state(&Fields::new(&mesh, increment / 4).at(increment)).expect("state");
                writer.save_grains(&[grain_row(0, increment), grain_row(1, increment)]).expect("grains");
                let table = [Column::integers("first", "first grain", vec![increment as i64])];
                writer.write_table(&format!("contacts/{}", increment / 4 - 1), &table).expect("contacts");
                writer.save_restart(increment as u64, &increment.to_le_bytes()).expect("restart");
            }
            writer.commit().expect("commit");
        }
    };
    let begin = |path: &Path| {
        let mut writer = Writer::create(path, &case_record(), Existing::Refuse).expect("a new file");
        writer.set_mesh(mesh.clone()).expect("mesh");
        // Not in alphabetical order, and not to be put into it.
        writer.set_bodies(&["wedge", "base"]).expect("bodies");
        writer
    };
    let whole = dir.path().join("whole.h5");
    let mut writer = begin(&whole);
    go_on(&mut writer, 1, 20);
    writer.finish(Outcome::Finished, "", 20).expect("end");
    drop(writer);

    let parts = dir.path().join("parts.h5");
    let mut writer = begin(&parts);
    go_on(&mut writer, 1, 10);
    // More that was never committed.
    writer.append(&history_row(11), &[body_row(11), body_row(0)]).expect("row");
    drop(writer);
    let (mut writer, restart) = Writer::resume(&parts).expect("resumes");
    assert!(writer.set_bodies(&["base", "wedge"]).is_err(), "other bodies are refused");
    writer.set_bodies(&["wedge", "base"]).expect("the same bodies");
    assert!(writer.set_mesh(block_of_grains([1, 1, 1])).is_err(), "another mesh is refused");
    writer.set_mesh(mesh.clone()).expect("the same mesh");
    assert_eq!((restart.increment, restart.rows, restart.states), (8, 8, 2));
    assert_eq!(restart.bytes, 8_usize.to_le_bytes());
    go_on(&mut writer, 9, 13);
    drop(writer);
    let (mut writer, restart) = Writer::resume(&parts).expect("resumes");
    assert_eq!(restart.increment, 12);
    go_on(&mut writer, 13, 20);
    writer.finish(Outcome::Finished, "", 20).expect("end");
    drop(writer);

    let (a, b) = (Reader::open(&whole).expect("opens"), Reader::open(&parts).expect("opens"));
    for name in [
        "history/increment",
        "history/axial_strain",
        "bodies/wedge/position",
        "bodies/base/position",
        "grains/position",
        "contacts/4/first",
        "VTKHDF/PointData/displacement",
        "VTKHDF/CellData/stress",
        "VTKHDF/Steps/Values",
        "VTKHDF/Steps/CellDataOffsets/stress",
    ] {
        assert_eq!(a.floats(name).expect("numbers"), b.floats(name).expect("numbers"), "{name}");
    }
    assert_eq!(a.members("contacts").expect("names"), b.members("contacts").expect("names"));
    assert_eq!(a.status().expect("status"), b.status().expect("status"));
}

#[test]
#[cfg(unix)]
fn full_disk_is_an_error_and_keeps_what_was_committed() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("full.h5");
    let output = Command::new("sh")
        .arg("-c")
        // A limit on the size of files acts like a full disk: writes fail from some moment on. 1,500 kB.
        .arg("trap '' XFSZ; ulimit -f 3000; exec \"$0\" child_writes_without_end --exact --ignored --nocapture")
        .arg(std::env::current_exe().expect("this test"))
        .env("RIPRAP_TEST_FILE", &path)
        .output()
        .expect("sh runs");
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(4), "an error, not a panic or a signal: {errors}");
    assert!(!journal::path_of(&path).exists(), "put back by the writer itself");
    assert!(errors.contains("full.h5") && errors.contains("may not grow further"), "{errors}");
    let reader = Reader::open(&path).expect("opens");
    let summary = Summary::of(&reader).expect("everything can be read");
    assert!(summary.increments >= 1, "{summary}");
}

#[test]
fn breakage_is_written_as_tables() {
    use riprap::specimen::breakage::{GrainFate, Piece, measure};
    let piece = |size: f64, volume: f64| Piece { size, volume };
    let broken = GrainFate {
        before: piece(0.04, 8.0),
        pieces: vec![piece(0.03, 5.0), piece(0.02, 2.0)],
        crushed_volume: 1.0,
        damaged_volume: 3.0,
    };
    let fates = [broken, GrainFate::whole(piece(0.02, 2.0))];
    let breakage = measure(&fates, &[0.01, 0.025, 0.04]).expect("measures");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("breakage.h5");
    let mut writer = Writer::create(&path, &case_record(), Existing::Refuse).expect("a new file");
    writer.write_breakage(&breakage).expect("written");
    writer.commit().expect("commit");
    writer.finish(Outcome::Finished, "end of the case", 0).expect("end");
    drop(writer);
    let reader = Reader::open(&path).expect("a file");
    assert_eq!(reader.floats("breakage/marsal").expect("an index"), [breakage.marsal]);
    assert_eq!(reader.floats("breakage/grading/passing_before").expect("a curve"), [0.0, 0.2, 1.0]);
    assert_eq!(reader.floats("breakage/grading/passing_after").expect("a curve"), [0.1, 0.5, 1.0]);
    assert_eq!(reader.integers("breakage/classes/broken").expect("numbers"), [0, 1]);
    assert_eq!(reader.integers("breakage/fragments").expect("a number"), [2]);
    assert_eq!(reader.text_attribute("breakage/weibull_scale", "units").expect("units"), "m");
    assert!(reader.floats("breakage/hardin").expect("an index")[0] > 0.0);
}
