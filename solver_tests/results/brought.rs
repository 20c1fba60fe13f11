//! Meshes as VTK writes them, in every encoding, and what riprap itself exports, read as bodies.

use std::path::Path;

use riprap::case::{Geometry, RawCase};
use riprap::mesh::file::read_mesh;
use riprap::mesh::formats::{holds_all_bodies, read_points};
use riprap::results::{
    CellKind, Column, Existing, FieldMesh, GrainRow, Outcome, Reader, Writer, write_network, write_stl,
    write_tables, write_vtu_series,
};
use riprap::tensor::Vec3;

use crate::two_grains::*;

/// ParaView, VTK, meshio and PyVista write binary by default.
#[test]
fn every_encoding_of_vtk_is_the_same_body() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let program = r#"
import sys, itertools
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter
folder = sys.argv[1]
points = vtkPoints()
points.SetDataTypeToDouble()
for k in range(8):
    points.InsertNextPoint(0.03 * (k & 1), 0.02 * (k >> 1 & 1), 0.01 * (k >> 2 & 1))
grid = vtkUnstructuredGrid()
grid.SetPoints(points)
for cell in [[0, 1, 3, 7], [0, 5, 1, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 6, 4, 7]]:
    grid.InsertNextCell(10, 4, cell)
grid.InsertNextCell(5, 3, [0, 1, 3])
writer = vtkXMLUnstructuredGridWriter()
writer.SetInputData(grid)
modes = {'ascii': writer.SetDataModeToAscii, 'binary': writer.SetDataModeToBinary, 'appended': writer.SetDataModeToAppended}
for mode, packed, wide, base64 in itertools.product(modes, (False, True), (False, True), (False, True)):
    modes[mode]()
    writer.SetCompressorTypeToZLib() if packed else writer.SetCompressorTypeToNone()
    writer.SetHeaderTypeToUInt64() if wide else writer.SetHeaderTypeToUInt32()
    writer.SetEncodeAppendedData(base64)
    name = f'{folder}/{mode}_{int(packed)}{int(wide)}{int(base64)}.vtu'
    writer.SetFileName(name)
    assert writer.Write() == 1
    print(name)
"#;
    let names = run_python(&python, program, &[dir.path().to_str().expect("path")]);
    assert_eq!(names.lines().count(), 24);
    for name in names.lines() {
        let mesh = read_mesh(Path::new(name)).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!((mesh.cells.len(), mesh.surface.len()), (6, 12), "{name}");
        assert!((mesh.volume() / 6e-6 - 1.0).abs() < 1e-12, "{name}: {}", mesh.volume());
    }
}

/// `riprap export --vtu` of one body is a body again, where its state has moved it to.
#[test]
fn riprap_reads_what_it_exports() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("one.vtkhdf");
    let mut mesh = FieldMesh::new();
    let part = mesh.add_part("block");
    let corner = |k: usize| Vec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2 & 1) as f64) * 0.02;
    let mut places: Vec<Vec3> = (0..8).map(corner).collect();
    for cell in KUHN {
        let mut nodes = cell.to_vec();
        for (a, b) in MIDSIDES {
            let middle = (corner(cell[a]) + corner(cell[b])) * 0.5;
            let at = places.iter().position(|p| (p - middle).norm() < 1e-12).unwrap_or_else(|| {
                places.push(middle);
                places.len() - 1
            });
            nodes.push(at);
        }
        if mesh.points() < places.len() {
            (mesh.points()..places.len()).for_each(|at| {
                mesh.add_point(&places[at]);
            });
        }
        mesh.add_cell(CellKind::Tet10, &nodes, part, Some(0), 1e9).expect("a good cell");
    }
    let mut writer = Writer::create(&path, &case_record(), Existing::Refuse).expect("a new file");
    writer.set_mesh(mesh.clone()).expect("mesh");
    let moved = vec![Vec3::new(0.1, 0.0, -0.3); mesh.points()];
    let fields = Fields::new(&mesh, 0);
    let state = riprap::results::FieldState { displacement: &moved, ..fields.at(1) };
    writer.save_state(&state).expect("state");
    writer.commit().expect("commit");
    drop(writer);
    let reader = Reader::open(&path).expect("opens");
    write_vtu_series(&reader, dir.path(), "one").expect("exported");
    let body = read_mesh(&dir.path().join("one_00000.vtu")).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(body.cells.len(), 6);
    assert!((body.volume() / 8e-6 - 1.0).abs() < 1e-12);
    let lowest = body.nodes.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    assert!((lowest + 0.3).abs() < 1e-15, "{lowest}");
}

/// Two grains, a part that came off one and the plate below them, with the contacts of one state.
fn file_with_contacts(path: &Path) {
    let mesh = block_of_grains([2, 1, 1]);
    let mut writer = Writer::create(path, &case_record(), Existing::Refuse).expect("a new file");
    writer.set_mesh(mesh.clone()).expect("mesh");
    writer
        .write_table("grains", &[Column::floats("volume", "m3", "volume", vec![1e-6; 2])])
        .expect("a table of grains");
    writer.save_state(&Fields::new(&mesh, 0).at(1)).expect("state");
    writer.save_grains(&[grain_row(0, 0), grain_row(1, 0)]).expect("grains");
    let numbers = |name: &str, values: [f64; 4]| Column::floats(name, "N", "a number", values.to_vec());
    let rows = vec![[0.5, 0.0, 0.1], [0.5, 0.0, -0.1], [0.0, 0.0, -0.2], [1.0, 0.5, 0.0]];
    let vectors = |name: &str| Column::vectors(name, "N", "a vector", rows.clone());
    let table = [
        Column::integers("body_a", "a body", vec![0, 1, -1, 2]),
        Column::integers("body_b", "a body", vec![1, 0, 0, 1]),
        vectors("point"),
        vectors("normal"),
        vectors("force"),
        numbers("normal_force", [3.0, 4.0, 50.0, 1.0]),
        vectors("friction_force"),
        numbers("gap", [-1e-6, 0.0, -3e-6, 0.0]),
        numbers("slip", [0.0, 1e-6, 2e-6, 0.0]),
        numbers("mobilised", [0.1, f64::NAN, 1.0, 0.2]),
    ];
    writer.write_table("contacts/0", &table).expect("contacts");
    writer.commit().expect("commit");
}

#[test]
fn vtk_reads_the_contact_network() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("two.vtkhdf");
    file_with_contacts(&path);
    let reader = Reader::open(&path).expect("opens");
    write_network(&reader, dir.path(), "two").expect("exported");
    let program = r#"
import sys, pyvista, numpy
lines = pyvista.read(sys.argv[1])
assert lines.n_lines == 4 and lines.n_points == 8, lines
# From centre to centre, whichever of the two is named first; from the contact point of the plate or of the part to the grain.
ends = [[0, 0, 0], [1, 0, 0], [1, 0, 0], [0, 0, 0], [0, 0, -0.2], [0, 0, 0], [1, 0.5, 0], [1, 0, 0]]
assert numpy.allclose(lines.points, ends), lines.points
data = lines.cell_data
assert list(data['normal_force']) == [3, 4, 50, 1] and list(data['pair_force']) == [7, 7, 50, 1]
# The mean of the two pairs of grains is 4: the plate's does not count.
assert list(data['strong']) == [1, 1, 1, 0] and list(data['body_a']) == [0, 1, -1, 2]
assert list(data['gap']) == [-1e-6, 0, -3e-6, 0]
assert data['force'].shape == (4, 3) and numpy.isnan(data['mobilised'][1])
print('read')
"#;
    let file = dir.path().join("two_contacts_00000.vtp");
    assert_eq!(run_python(&python, program, &[file.to_str().expect("path")]).trim(), "read");
}

/// Cubes of 10 mm, side by side, each twelve triangles: as points they come back as they are.
#[test]
fn grains_go_out_as_stl_and_come_back() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("two.vtkhdf");
    let mesh = block_of_grains([2, 1, 1]);
    let mut writer = Writer::create(&path, &case_record(), Existing::Refuse).expect("a new file");
    writer.set_mesh(mesh.clone()).expect("mesh");
    let still = vec![Vec3::zeros(); mesh.points()];
    let grain: Vec<i32> = (0..mesh.cells()).map(|cell| (cell / 6) as i32).collect();
    let whole = vec![false; mesh.cells()];
    let fields = Fields::new(&mesh, 0);
    let state = riprap::results::FieldState {
        displacement: &still,
        fragment: &grain,
        failed: &whole,
        ..fields.at(1)
    };
    writer.save_state(&state).expect("state");
    writer.commit().expect("commit");
    drop(writer);
    let reader = Reader::open(&path).expect("opens");
    let (all, bodies) = write_stl(&reader, dir.path(), "two").expect("exported");
    assert_eq!(bodies, 2);
    assert_eq!(std::fs::metadata(&all).expect("a file").len(), 84 + 24 * 50);
    let one = dir.path().join("two_00001.stl");
    assert!(holds_all_bodies(&all) && !holds_all_bodies(&one), "a folder of grains is a library of them");
    let points = read_points(&one).unwrap_or_else(|e| panic!("{e}"));
    let hull = riprap::geometry::Polyhedron::convex_hull(&points).expect("a hull");
    assert!((hull.volume() / 1e-6 - 1.0).abs() < 1e-6, "{}", hull.volume());
    assert!((hull.centroid() - Vec3::new(0.0152, 0.005, 0.005)).norm() < 1e-7, "{}", hull.centroid());
    // What is of all bodies makes none, and says what does.
    write_vtu_series(&reader, dir.path(), "two").expect("exported");
    let case = |shape: &str| {
        let text = format!(
            r#"{{"scene": {{"bodies": [{{"name": "a", "shape": {shape}}}]}}, "contact": {{"friction": 0.5}},
            "rock": {{"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}},
            "stages": [{{"kind": "load", "increments": 2}}]}}"#
        );
        RawCase::parse(&dir.path().join("x.json"), &text)?.check()
    };
    let hull = |file: &str| case(&format!(r#"{{"hull": {{"file": "{file}", "unit": "m"}}}}"#));
    hull("two_00001.stl").unwrap_or_else(|e| panic!("{e}"));
    let name = all.file_name().and_then(|name| name.to_str()).expect("a name");
    for (refused, says) in
        [(hull(name), "holds all bodies"), (case(r#"{"mesh": "two_00000.vtu"}"#), "riprap export --stl")]
    {
        let said = refused.expect_err("refused").to_string();
        assert!(said.contains("$.scene.bodies[0].shape") && said.contains(says), "{said}");
    }
}

/// `riprap export --csv` of a specimen is a packing again: the grains of its last state, of their sieve sizes.
#[test]
fn an_exported_table_of_grains_is_a_packing() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("cube.vtkhdf");
    let mesh = block_of_grains([3, 3, 3]);
    let mut writer = Writer::create(&path, &case_record(), Existing::Refuse).expect("a new file");
    writer.set_mesh(mesh.clone()).expect("a mesh");
    let sizes = (0..27).map(|grain| 0.2 + 0.1 * f64::from(grain % 2));
    writer.write_table("grains", &[Column::floats("sieve_size", "m", "sieve size", sizes)]).expect("grains");
    for state in 0..2 {
        if state > 0 {
            writer.append(&history_row(state), &[]).expect("a row");
        }
        writer.save_state(&Fields::new(&mesh, state).at(state)).expect("a state");
        let row = |grain: usize| {
            let place = [grain % 3, grain / 3 % 3, grain / 9].map(|at| (0.4 + state as f64) * at as f64);
            GrainRow { position: Vec3::from(place), ..grain_row(grain, state) }
        };
        writer.save_grains(&(0..27).map(row).collect::<Vec<_>>()).expect("grains");
    }
    writer.finish(Outcome::Finished, "", 1).expect("an end");
    drop(writer);
    let reader = Reader::open(&path).expect("opens");
    write_tables(&reader, dir.path(), "cube").unwrap_or_else(|e| panic!("{e}"));
    let case = r#"{"specimen": {"packing": {"file": "cube_grains_states.csv", "compact": true}, "void_ratio": 0.6},
        "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}, "contact": {"friction": 0.65},
        "stages": [{"kind": "consolidate", "pressure": "0.8 MPa"}]}"#;
    let case = RawCase::parse(&dir.path().join("x.json"), case).and_then(|raw| raw.check());
    let case = case.unwrap_or_else(|e| panic!("{e}"));
    let Geometry::Specimen(specimen) = &case.geometry else { panic!("no specimen") };
    let grains = &specimen.packing.as_ref().expect("a packing").grains;
    assert_eq!(grains.len(), 27);
    // Random grains stand for them, spread until none overlap.
    let along = grains[1].position[0] - grains[0].position[0];
    assert!(along >= 1.4 && (grains[0].rotation[2] - 0.1).abs() < 1e-12, "{along}");
    let ends = [specimen.grading.first(), specimen.grading.last()].map(|point| point.expect("sieves")[0]);
    assert!((ends[0] / 0.3 - 1.0).abs() < 0.02 && (ends[1] / 0.2 - 1.0).abs() < 0.02, "{ends:?}");
}
