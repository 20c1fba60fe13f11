//! Stresses of cells and displacements of nodes in a file, against closed forms.

use std::path::Path;
use std::process::Command;

use riprap::results::{Reader, SavedCells};
use riprap::tensor::{Mat3, Vec3};

/// Runs a case of `cases` with overrides, and opens what it wrote.
fn run(case: &str, overrides: &[&str], out: &Path) -> Reader {
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases").join(case);
    let mut riprap = Command::new(env!("CARGO_BIN_EXE_riprap"));
    riprap.arg("run").arg(case).args(["--quiet", "--out"]).arg(out);
    overrides.iter().for_each(|set| {
        riprap.args(["--set", set]);
    });
    let output = riprap.output().expect("riprap runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Reader::open(out).expect("the results")
}

/// The cells of a part, and their stresses in a saved state.
fn stresses(reader: &Reader, cells: &SavedCells, part: &str, state: usize) -> Vec<(usize, [f64; 6])> {
    let all = reader.saved_field("CellData", "stress", state).expect("stresses");
    let of = |cell: usize| std::array::from_fn(|k| all[6 * cell + k]);
    let wanted = cells.parts.iter().position(|name| name == part).expect("the part");
    (0..cells.cells()).filter(|&cell| cells.part[cell] == wanted).map(|cell| (cell, of(cell))).collect()
}

/// The gradient of a field that is linear in a cell, from its corners.
fn gradient(points: &[Vec3], field: &[Vec3], corners: &[usize]) -> Mat3 {
    let edges = |of: &[Vec3]| {
        let [a, b, c] = [1, 2, 3].map(|k| of[corners[k]] - of[corners[0]]);
        Mat3::from_columns(&[a, b, c])
    };
    edges(field) * edges(points).try_inverse().expect("a cell with a volume")
}

/// A column of two blocks under 3 kPa: no other stress, and the strain that goes with it.
#[test]
fn column_has_the_stress_and_strain_of_its_load_in_every_cell() {
    let (pressure, modulus, poisson) = (3000.0, 30e9, 0.2);
    let strain = Vec3::new(poisson, poisson, -1.0) * (pressure / modulus);
    let dir = tempfile::tempdir().expect("temporary directory");
    // The lower block as in the case, and with axes of its own: x, and z for y.
    let (low, high, top) = (0.031801488286690, 0.068198511713310, 0.05);
    let corner = |x: f64, y: f64, z: f64| format!("[{x}, {z}, {}]", -y);
    let corners = [-top, top].map(|y| {
        [(-top, -top), (top, -top), (-top, low), (top, high)].map(|(x, z)| corner(x, y, z)).join(", ")
    });
    let turned = [
        format!("/scene/bodies/1/shape/polyhedron=[{}]", corners.join(", ")),
        "/scene/bodies/1/rotation=[\"90 deg\", 0, 0]".into(),
    ];
    for (fidelity, turned) in [("condensed", &[][..]), ("full", &[][..]), ("condensed", &turned)] {
        let of = [1, 2].map(|body| format!("/scene/bodies/{body}/fidelity={fidelity}"));
        let overrides: Vec<&str> = of.iter().chain(turned).map(String::as_str).collect();
        let out = dir.path().join(format!("{fidelity}_{}.h5", turned.len()));
        let reader = run("scenes/contact_patch.json", &overrides, &out);
        let cells = reader.saved_cells().expect("cells");
        let moved = reader.saved_field("PointData", "displacement", 1).expect("displacements");
        let moved: Vec<Vec3> = moved.chunks_exact(3).map(Vec3::from_column_slice).collect();
        for block in ["lower", "upper"] {
            let stresses = stresses(&reader, &cells, block, 1);
            assert!(stresses.len() > 20, "{} cells", stresses.len());
            for (cell, stress) in stresses {
                let off = stress.iter().zip([0.0, 0.0, -pressure, 0.0, 0.0, 0.0]).map(|(s, e)| (s - e).abs());
                let off = off.fold(0.0, f64::max) / pressure;
                assert!(off < 1e-5, "{fidelity}, {block}, cell {cell}: {stress:?}");
                let h = gradient(&cells.points, &moved, &cells.nodes(cell)[..4]);
                let found = 0.5 * (h + h.transpose());
                let off = (found - Mat3::from_diagonal(&strain)).norm() / strain.norm();
                assert!(off < 1e-5, "{fidelity}, {block}, cell {cell}: {found}");
            }
        }
    }
}

/// A block that can break, between smooth plates: the plates' force over its section, nothing else, and what it shortens by.
#[test]
fn block_that_can_break_has_the_stress_of_its_load_in_every_cell() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let (edge, modulus, push) = (0.02, 30e9, 4e-6);
    let overrides = [
        "/rock/youngs_modulus=\"30 GPa\"",
        "/stages/0/increments=2",
        &format!("/stages/0/bodies/top/displacement=[0, 0, -{push:e}]"),
    ];
    let reader = run("crushing/uniaxial_block.json", &overrides, &dir.path().join("block.h5"));
    let cells = reader.saved_cells().expect("cells");
    let state = reader.saved_states().expect("states").len() - 1;
    let force = reader.floats("bodies/block/force").expect("forces");
    let pushed = reader.floats("bodies/top/reaction_force").expect("reactions");
    let expected = pushed[pushed.len() - 1] / (edge * edge);
    assert!(force.iter().all(|f| f.abs() < 1e-6 * pushed[pushed.len() - 1].abs()), "the block is in balance");
    assert!((expected / (-modulus * push / (2.0 * edge)) - 1.0).abs() < 1e-3, "{expected:e} Pa");
    let stresses = stresses(&reader, &cells, "block", state);
    assert!(stresses.len() > 20, "{} cells", stresses.len());
    for (cell, stress) in stresses {
        let off = stress.iter().zip([0.0, 0.0, expected, 0.0, 0.0, 0.0]).map(|(s, e)| (s - e).abs());
        assert!(off.fold(0.0, f64::max) < 1e-5 * expected.abs(), "cell {cell}: {stress:?}, not {expected:e}");
    }
}

/// The volume mean of a grain's cells is that of the forces on its surface, a linear displacement being one of the mesh's; grains are turned
/// any way. Contacts lie on rounded bodies, their forces act on the mesh, with its sharp edges, where it is nearest: a twentieth of the size
/// at most.
#[test]
fn mean_of_a_grains_cells_is_the_stress_of_the_forces_on_it() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let overrides = [
        "/contact/normal=spring",
        "/solver/fidelity=condensed",
        "/rock/damage=null",
        "/specimen/grains=20",
        "/specimen/unreachable=nearest",
        "/stages=[{\"kind\": \"consolidate\", \"pressure\": \"0.4 MPa\"}]",
    ];
    let reader = run("quick_start.json", &overrides, &dir.path().join("grains.h5"));
    let cells = reader.saved_cells().expect("cells");
    let state = reader.saved_states().expect("states").len() - 1;
    let means = reader.floats("grains/stress").expect("stresses of grains");
    let grains = reader.shape("grains/stress").expect("a shape")[1];
    let (mut sums, mut volumes) = (vec![[0.0; 6]; grains], vec![0.0; grains]);
    for (cell, stress) in stresses(&reader, &cells, "grains", state) {
        let [a, b, c, d] = std::array::from_fn(|k| cells.points[cells.nodes(cell)[k]]);
        let volume = (b - a).cross(&(c - a)).dot(&(d - a)).abs() / 6.0;
        let grain = usize::try_from(cells.grain[cell]).expect("a grain");
        volumes[grain] += volume;
        sums[grain].iter_mut().zip(stress).for_each(|(sum, s)| *sum += volume * s);
    }
    for (grain, (sum, volume)) in sums.iter().zip(volumes).enumerate() {
        let mean = &means[6 * (grains * state + grain)..][..6];
        let scale = mean.iter().fold(0.0, |largest: f64, s| largest.max(s.abs()));
        let sum = sum.map(|s| s / volume);
        let off = sum.iter().zip(mean).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / scale;
        println!("grain {grain}: {off:.1e}");
        assert!(off < 5e-2, "grain {grain}: {sum:?} {mean:?}");
    }
}
