//! A small file of two grains and two bodies, written row by row, and Python to read it with.

use std::path::{Path, PathBuf};
use std::process::Command;

use riprap::results::{
    BodyRow, CaseRecord, CellKind, Column, Existing, FieldMesh, FieldState, GrainRow, HistoryRow, Outcome,
    Writer,
};
use riprap::tensor::Vec3;

/// Kuhn's split of a unit cube into six tetrahedra, corners by bits xyz.
pub(crate) const KUHN: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 5, 1, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 6, 4, 7]];
/// VTK's mid-side nodes of a quadratic tetrahedron.
pub(crate) const MIDSIDES: [(usize, usize); 6] = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)];

/// Cubic grains of 10 mm in a block of `counts`, with a bottom plate.
pub(crate) fn block_of_grains(counts: [usize; 3]) -> FieldMesh {
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
pub(crate) struct Fields {
    displacement: Vec<Vec3>,
    damage: Vec<f64>,
    failed: Vec<bool>,
    fragment: Vec<i32>,
    stress: Vec<[f64; 6]>,
    fidelity: Vec<u8>,
}

impl Fields {
    pub(crate) fn new(mesh: &FieldMesh, state: usize) -> Self {
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

    pub(crate) fn at(&self, increment: usize) -> FieldState<'_> {
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

pub(crate) fn history_row(increment: usize) -> HistoryRow {
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

pub(crate) fn grain_row(grain: usize, state: usize) -> GrainRow {
    GrainRow {
        position: Vec3::new(grain as f64, 0.0, state as f64),
        rotation: Vec3::new(0.0, 0.0, 0.1),
        stress: [-1e6, -2e6, grain as f64, 0.0, 0.0, state as f64],
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

pub(crate) fn body_row(increment: usize) -> BodyRow {
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

pub(crate) fn case_record() -> CaseRecord {
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
pub(crate) fn write_small_file(path: &Path) -> FieldMesh {
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
pub(crate) fn python() -> Option<PathBuf> {
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

pub(crate) fn run_python(python: &Path, program: &str, arguments: &[&str]) -> String {
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
