//! Stages under a rubber membrane, 5 mm of 2 MPa, whose inner half is enclosed and not the specimen's.

use riprap::material::{Rubber, RubberLaw};
use riprap::triaxial::{Cover, Lateral, Path, Rig, RubberSheet, Stage, Steps, Test, Until};

use crate::ready::{HELD, PRESSURE, consolidate_seated, drive, rig, run, steps};

fn wrapped() -> (Rig, Test) {
    let rubber = Rubber::new(2e6, RubberLaw::NeoHookean).expect("rubber");
    let sheet = RubberSheet { rubber, thickness: 5e-3, mesh_size: Some(0.015), pressure: PRESSURE };
    let mut rig = rig(Cover::Rubber(sheet));
    let mut test = Test::new(&rig);
    test.lay_membrane(&mut rig, PRESSURE).unwrap_or_else(|reason| panic!("{reason}"));
    consolidate_seated(&mut rig, &mut test, 4);
    (rig, test)
}

#[test]
fn every_stage_holds_what_it_prescribes() {
    let (mut rig, mut test) = wrapped();
    let (start, zero) = (rig.volume(&rig.committed.poses), test.zero.volume);
    assert_eq!(start, zero);
    assert!(rig.rubber_inside() > 0.01 * start);
    let size = 2e-5;
    let stages = [
        drive(4e-5, Lateral::Pressure),
        Stage { path: Path::Hold, steps: Steps::Count(1), until: Until::default() },
        drive(4e-5, Lateral::Area),
        drive(4e-5, Lateral::Volume),
        drive(4e-5, Lateral::MeanStress),
    ];
    for stage in stages {
        let before = test.zero.volume * (1.0 - last_strains(&rig, &test)[1]);
        let height = rig.height(&rig.committed.poses);
        let stage = match stage.path {
            Path::Hold => stage,
            _ => Stage { steps: steps(size), ..stage },
        };
        let (rows, end) = run(&mut rig, &mut test, &stage);
        assert_eq!(end, riprap::triaxial::StageEnd::Finished, "{stage:?}");
        assert!(!rows.is_empty());
        for row in &rows {
            assert!(row.control_error <= HELD && row.out_of_balance < 1e-3, "{row:?}");
        }
        let volume = rig.volume(&rig.committed.poses);
        let shortening = 1.0 - rig.height(&rig.committed.poses) / height;
        let expected = match stage.path {
            Path::Strain { lateral: Lateral::Volume, .. } => 0.0,
            Path::Strain { lateral: Lateral::Area, .. } => shortening,
            _ => continue,
        };
        assert!((1.0 - volume / before - expected).abs() < HELD * size, "{stage:?}");
    }
}

/// Axial and volume strain now.
fn last_strains(rig: &Rig, test: &Test) -> [f64; 2] {
    let poses = &rig.committed.poses;
    [1.0 - rig.height(poses) / test.zero.height, 1.0 - rig.volume(poses) / test.zero.volume]
}
