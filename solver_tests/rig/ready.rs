//! A specimen of sixteen grains, seated and consolidated once for all tests, per cover.

use std::sync::{Arc, OnceLock};

use riprap::contact::NormalLaw;
use riprap::contact::face::FaceContact;
use riprap::contact::law::Friction;
use riprap::grain::CondensedGrain;
use riprap::loading::StageEnd;
use riprap::material::{Elastic, Rubber, RubberLaw};
use riprap::mesh::grain_mesh;
use riprap::model::Body;
use riprap::solver::Settings;
use riprap::specimen::Specimen;
use riprap::triaxial::{
    Cover, Lateral, Path, Rig, RigParameters, Rims, Row, RubberSheet, Stage, Steps, Test, Until,
};
use riprap::verification::rig::sixteen_grains;

pub const PRESSURE: f64 = 4e5;
/// What the rig promises for what it prescribes.
pub const HELD: f64 = 1e-3;

/// A rig and its test, consolidated, with the rows of the consolidation.
type Ready = (Rig, Test, Vec<Row>);

pub fn specimen() -> &'static Specimen {
    static SPECIMEN: OnceLock<Specimen> = OnceLock::new();
    SPECIMEN.get_or_init(sixteen_grains)
}

/// A rig around the specimen, as generated, with rough plates.
pub fn rig(cover: Cover) -> Rig {
    rig_on(0.65, cover)
}

/// The same with plates of this friction.
pub fn rig_on(plate_friction: f64, cover: Cover) -> Rig {
    let parameters = RigParameters {
        density: 2700.0,
        youngs_modulus: 3e10,
        poissons_ratio: 0.2,
        friction: Friction::constant(0.65),
        plate_friction: Friction::constant(plate_friction),
        faces: FaceContact::Corners,
        normal: NormalLaw::Spring,
        limit_pressure: f64::INFINITY,
        tilting: false,
        cover,
    };
    Rig::new(specimen(), &parameters, Settings::default()).expect("a rig")
}

/// 5 mm of rubber of 2 MPa.
pub fn rubber() -> Cover {
    Cover::Rubber(RubberSheet {
        rubber: Rubber::new(2e6, RubberLaw::NeoHookean).expect("rubber"),
        thickness: 5e-3,
        mesh_size: Some(0.015),
        pressure: PRESSURE,
    })
}

/// The grains on meshes of about so many cells; where asperities bear, forces act on patches of them.
pub fn condensed_grains(rig: &Rig, cells: usize) -> Vec<Arc<CondensedGrain>> {
    let rock = Elastic::new(3e10, 0.2).expect("allowed");
    let grain = |body: &Body| {
        let mesh = grain_mesh(&body.nominal, cells).expect("a mesh");
        let rock = vec![rock; mesh.cells.len()];
        let grain = CondensedGrain::new(mesh, &rock, 2700.0).expect("a grain");
        Arc::new(if rig.model.normal == NormalLaw::Asperity { grain.on_patches() } else { grain })
    };
    rig.model.bodies[..16].iter().map(grain).collect()
}

/// Brings the grains into touch; whether they came to rest.
pub fn seat(rig: &mut Rig, test: &mut Test) -> bool {
    (0..8).any(|_| test.seat(rig, PRESSURE).converged())
}

/// Lays a membrane, seats the grains and consolidates them in so many increments.
pub fn consolidate(rig: &mut Rig, increments: usize) -> (Test, Vec<Row>) {
    let (test, rows, end) = try_to_consolidate(rig, increments);
    assert_eq!(end, StageEnd::Finished);
    (test, rows)
}

/// The same, wherever it ends.
pub fn try_to_consolidate(rig: &mut Rig, increments: usize) -> (Test, Vec<Row>, StageEnd) {
    let mut test = Test::new(rig);
    test.lay_membrane(rig, PRESSURE).unwrap_or_else(|reason| panic!("{reason}"));
    let (rows, end) = try_to_consolidate_seated(rig, &mut test, increments);
    (test, rows, end)
}

/// The same for a test whose membrane, if there is one, lies against the grains.
pub fn consolidate_seated(rig: &mut Rig, test: &mut Test, increments: usize) -> Vec<Row> {
    let (rows, end) = try_to_consolidate_seated(rig, test, increments);
    assert_eq!(end, StageEnd::Finished);
    rows
}

/// The same, wherever it ends.
pub fn try_to_consolidate_seated(rig: &mut Rig, test: &mut Test, increments: usize) -> (Vec<Row>, StageEnd) {
    seat(rig, test);
    let stage = loaded(Path::Stress { axial: PRESSURE, radial: PRESSURE }, increments);
    let (rows, end) = run(rig, test, &stage);
    test.zero_strains(rig);
    (rows, end)
}

/// A rig and its test, consolidated, with the rows of the consolidation.
pub fn consolidated(cover: Cover) -> (Rig, Test, &'static [Row]) {
    static PRESSED: OnceLock<Ready> = OnceLock::new();
    static WALLED: OnceLock<Ready> = OnceLock::new();
    let ready = || {
        let mut rig = rig(cover);
        let (test, rows) = consolidate(&mut rig, 6);
        (rig, test, rows)
    };
    let (rig, test, rows) = match cover {
        Cover::Pressure(Rims::Bonded) => PRESSED.get_or_init(ready),
        Cover::RigidWall => WALLED.get_or_init(ready),
        Cover::Rubber(_) | Cover::Pressure(Rims::Sliding) => {
            panic!("not made ready: call `rig` and `consolidate`")
        }
    };
    (rig.clone(), test.clone(), rows)
}

pub fn run(rig: &mut Rig, test: &mut Test, stage: &Stage) -> (Vec<Row>, StageEnd) {
    let mut rows = Vec::new();
    let end = test.run(rig, stage, &mut |_, step| {
        rows.push(step.row.clone());
        true
    });
    (rows, end)
}

pub fn steps(nominal: f64) -> Steps {
    Steps::Strain { nominal, largest: nominal, growth: 1.5 }
}

/// A stage of so many increments.
pub fn loaded(path: Path, increments: usize) -> Stage {
    Stage { path, steps: Steps::Count(increments), until: Until::default() }
}

/// Back to where unloading began.
pub fn reloaded() -> Stage {
    let path = Path::Return { lateral: Lateral::Pressure };
    Stage { path, steps: steps(2e-5), until: Until::default() }
}

/// Where the deviatoric stress is `q` [Pa].
pub fn to_stress(q: f64, must: bool) -> Until {
    Until { deviatoric_stress: Some(q), drop_after_peak: None, must }
}

pub fn drive(axial_strain: f64, lateral: Lateral) -> Stage {
    Stage { path: Path::Strain { axial_strain, lateral }, steps: steps(5e-5), until: Until::default() }
}

#[track_caller]
pub fn finished(rows: &[Row], end: &StageEnd, least: usize) {
    assert_eq!(*end, StageEnd::Finished);
    assert!(rows.len() >= least, "{} rows", rows.len());
    for row in rows {
        assert!(row.control_error <= HELD && row.out_of_balance < 1e-3, "{row:?}");
        // Plates, pressure and contact forces say the same.
        assert!(row.picture.contact_stress.disagreement < 0.01, "{row:?}");
    }
}
