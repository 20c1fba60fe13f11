//! What VTK's own readers, that is ParaView, find in a results file and in an exported series.

use std::path::Path;
use std::process::Command;

use riprap::results::{Existing, Reader, Writer, write_vtu_series};

use crate::two_grains::*;

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
from read_results import bodies, contacts, states
path = sys.argv[1]
with Results(path) as results:
    parts, increments, rows = results.parts, results.state_increments, len(results.history)
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
assert rows == increments[-1]
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
