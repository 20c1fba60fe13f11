//! Stages under a rubber membrane, 5 mm of 2 MPa, whose inner half is enclosed and not the specimen's.

use std::sync::OnceLock;

use riprap::loading::{EnergyGate, StageEnd};
use riprap::triaxial::{Lateral, Path, Rig, Row, Stage, Test};

use crate::ready::{
    HELD, PRESSURE, consolidate, drive, finished, loaded, reloaded, rig, rubber, run, steps, to_stress,
};

fn wrapped() -> (Rig, Test) {
    static WRAPPED: OnceLock<(Rig, Test)> = OnceLock::new();
    let ready = WRAPPED.get_or_init(|| {
        let mut rig = rig(rubber());
        let (test, _) = consolidate(&mut rig, 4);
        (rig, test)
    });
    ready.clone()
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
        loaded(Path::Hold, 1),
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
        assert_eq!(end, StageEnd::Finished, "{stage:?}");
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

/// The pressure is held, the loop ends where it was asked to, and it costs work.
#[test]
fn a_specimen_in_rubber_is_unloaded_and_reloaded() {
    let (mut rig, mut test) = wrapped();
    let goal = 0.2 * PRESSURE;
    let loading = Stage { until: to_stress(goal, false), ..drive(0.01, Lateral::Pressure) };
    let (rows, end) = run(&mut rig, &mut test, &loading);
    finished(&rows, &end, 2);
    let loaded = rows[rows.len() - 1].clone();
    assert!((loaded.measures.deviatoric_stress / goal - 1.0).abs() < HELD, "{loaded:?}");
    let until = to_stress(0.0, true);
    let unloading = Stage { steps: steps(2e-5), until, ..drive(-0.01, Lateral::Pressure) };
    let (rows, end) = run(&mut rig, &mut test, &unloading);
    finished(&rows, &end, 2);
    let unloaded = rows[rows.len() - 1].clone();
    assert!(unloaded.measures.deviatoric_stress.abs() < HELD * goal, "{unloaded:?}");
    let (rows, end) = run(&mut rig, &mut test, &reloaded());
    finished(&rows, &end, 2);
    let reloaded = &rows[rows.len() - 1];
    assert!((reloaded.measures.axial_strain - loaded.measures.axial_strain).abs() < 1e-12, "{reloaded:?}");
    assert!((reloaded.measures.confining_pressure / PRESSURE - 1.0).abs() < HELD);
    assert!(reloaded.ledger.external > loaded.ledger.external);
    assert!(reloaded.ledger.friction > loaded.ledger.friction);
}

/// A plate that is free to tilt does so until sheet, pressure and grains turn it no more: the solver balances that moment as
/// it does the grains'. The membrane's rim turns with it.
#[test]
fn a_free_top_plate_tilts_with_its_membrane() {
    let (mut rig, mut test) = wrapped();
    rig.tilting = true;
    let stage = Stage { steps: steps(2e-5), ..drive(1e-4, Lateral::Pressure) };
    let (rows, end) = run(&mut rig, &mut test, &stage);
    finished(&rows, &end, 4);
    let tilt = rows[rows.len() - 1].picture.tilt;
    assert!(tilt > 1e-6 && tilt < 0.1, "{tilt}");
    let membrane = rig.model.membrane.as_ref().expect("there");
    let mut positions = Vec::new();
    membrane.positions_into(&mut positions, &rig.committed.poses);
    let heights: Vec<f64> = (0..positions.len())
        .filter(|&node| membrane.nodes[node].body == rig.top)
        .map(|node| positions[node].z)
        .collect();
    let [low, high] = [f64::min, f64::max].map(|f| heights.iter().copied().reduce(f).expect("a rim"));
    let width = 2.0 * positions[0].xy().norm();
    // The rim's nodes reach the highest and the lowest point of its circle to one in (pi/n)^2/2, 1 % here.
    assert!(((high - low) / (width * tilt.sin()) - 1.0).abs() < 0.03, "{} {tilt}", (high - low) / width);
}

/// A gate that warns marks the increments that one that cuts would have refused, and leaves them as they are.
#[test]
fn an_energy_gate_that_warns_marks_what_it_lets_pass() {
    let stage = Stage { steps: steps(2e-5), ..drive(1e-4, Lateral::Pressure) };
    let under = |gate: EnergyGate| {
        let (mut rig, mut test) = wrapped();
        test.energy_gate = gate;
        let (rows, end) = run(&mut rig, &mut test, &stage);
        finished(&rows, &end, 5);
        rows
    };
    let open = under(EnergyGate::default());
    let mut gaps: Vec<f64> = open.iter().map(|row| row.energy_gap.abs()).collect();
    gaps.sort_by(f64::total_cmp);
    // Between the largest gap and the next.
    let tolerance = (gaps[gaps.len() - 1] * gaps[gaps.len() - 2]).sqrt();
    let warned = under(EnergyGate { tolerance, cuts: false });
    let marked = |rows: &[Row]| rows.iter().filter(|row| row.poorly_closed).count();
    assert_eq!((marked(&open), marked(&warned)), (0, 1), "{gaps:?}");
    let same = |a: &Row, b: &Row| a.measures == b.measures && a.energy_gap == b.energy_gap;
    assert!(open.iter().zip(&warned).all(|(a, b)| same(a, b)));
    let cut = under(EnergyGate { tolerance, cuts: true });
    assert!(cut.len() > warned.len() && cut.iter().any(|row| row.counters.cuts > 0), "{}", cut.len());
    // The row behind the first cut counts what was refused, too: that was what the other took for its row, and something came of it.
    let first = cut.iter().position(|row| row.counters.cuts > 0).expect("a cut");
    let (all, refused) = (cut[first].counters, warned[first].counters);
    assert!(
        all.factorisations > refused.factorisations && all.augmentations > refused.augmentations,
        "{all:?} {refused:?}"
    );
}
