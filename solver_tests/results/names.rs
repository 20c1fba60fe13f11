//! A results file as its users open it: by its name in PyVista and VTK, by the names of its axes in h5py.

use riprap::results::{Reader, write_vtu_series};

use crate::two_grains::*;

/// `pyvista.read` and ParaView choose the reader by the ending of the name alone.
#[test]
fn pyvista_and_vtk_open_the_file_by_its_name() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("two.vtkhdf");
    let mesh = write_small_file(&path);
    let reader = Reader::open(&path).expect("opens");
    let series = write_vtu_series(&reader, &dir.path().join("out"), "two").expect("exported");
    drop(reader);
    let program = r#"
import sys, os, numpy, pyvista
from vtkmodules.vtkIOHDF import vtkHDFReader
path, points, cells, series = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
grid = pyvista.read(path)
assert isinstance(grid, pyvista.UnstructuredGrid), type(grid)
assert (grid.n_points, grid.n_cells) == (points, cells), grid
names = 'damage failed fragment stress von_mises fidelity grain part youngs_modulus'.split()
assert sorted(grid.cell_data.keys()) == sorted(names), grid.cell_data.keys()
reader = pyvista.get_reader(path)
assert isinstance(reader.reader, vtkHDFReader), reader
reader.reader.UpdateInformation()
assert reader.reader.GetNumberOfSteps() == 3
reader.reader.SetStep(2)
warped = reader.read().warp_by_vector('displacement')
assert abs(warped.points[0, 2] - (grid.points[0, 2] - 2e-3)) < 1e-9, warped.points[0]
# The exported series names its components.
exported = pyvista.read(os.path.join(os.path.dirname(series), 'two_00001.vtu'))
stress = exported.GetCellData().GetArray('stress')
assert [stress.GetComponentName(k) for k in range(6)] == 'xx yy zz xy yz xz'.split()
print('read')
"#;
    let (path, series) = (path.to_str().expect("path"), series.to_str().expect("path"));
    let arguments = [path, &mesh.points().to_string(), &mesh.cells().to_string(), series];
    assert_eq!(run_python(&python, program, &arguments).trim(), "read");
}

#[test]
fn axes_have_names() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("two.vtkhdf");
    write_small_file(&path);
    let program = r#"
import sys, h5py
file = h5py.File(sys.argv[1])
def axes(name):
    return [axis[0].name if len(axis) else None for axis in file[name].dims]
assert axes('history/axial_strain') == axes('history/stage') == ['/history/increment']
assert axes('grains/volume') == ['/grains/grain']
assert axes('grains/position') == ['/grains/state', '/grains/grain', '/grains/axis']
assert axes('grains/stress') == ['/grains/state', '/grains/grain', '/grains/component']
assert axes('grains/damage_max') == ['/grains/state', '/grains/grain']
assert axes('contacts/2/force') == ['/contacts/2/contact', '/contacts/2/axis']
for scale in 'history/increment grains/state grains/grain grains/axis grains/component contacts/1/contact'.split():
    assert h5py.h5ds.is_scale(file[scale].id), scale
    assert h5py.h5ds.get_scale_name(file[scale].id).decode() == scale.split('/')[-1]
assert list(file['grains/state']) == [0, 1, 2] and list(file['grains/grain']) == [0, 1]
# A scale knows its datasets, too: the other way of the same link.
uses = file['grains/grain'].attrs['REFERENCE_LIST']
assert ('/grains/stress', 1) in [(file[use[0]].name, int(use[1])) for use in uses], uses
assert file['VTKHDF/CellData/stress'].attrs['component_names'] == 'xx yy zz xy yz xz'
assert file.attrs['format'] == 'riprap results' and file.attrs['format_version'] == 2 and len(file.attrs['identity']) == 32
print('read')
"#;
    assert_eq!(run_python(&python, program, &[path.to_str().expect("path")]).trim(), "read");
}

#[test]
fn files_of_a_later_layout_are_refused() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("later.vtkhdf");
    write_small_file(&path);
    let changed =
        hdf5::File::open_rw(&path).and_then(|file| file.attr("format_version")?.write_scalar(&7_u64));
    changed.expect("a number changed");
    let told = Reader::open(&path).err().expect("a refusal").to_string();
    assert!(
        told.contains("later.vtkhdf") && told.contains("format_version") && told.contains("is 7"),
        "{told}"
    );
}
