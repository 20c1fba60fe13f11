//! Every quantity that a stage prescribes is held to 1e-3 in every accepted increment, stages end where they say, and what
//! is measured in different ways agrees.

use riprap::loading::{EnergyGate, StageEnd};
use riprap::solver::Stabilisation;
use riprap::triaxial::{Cover, Lateral, Path, Rig, Rims, Row, Stage, Test, Until};
use riprap::verification::rig::{TALL, prism};

use crate::ready::{HELD, PRESSURE, drive, finished, loaded, reloaded, run, steps, to_stress};

fn consolidated() -> (Rig, Test, &'static [Row]) {
    crate::ready::consolidated(Cover::Pressure(Rims::Bonded))
}

/// Isotropic: no deviatoric stress, the pressure in equal steps up to the asked one, and the stress from
/// contact forces that of pressure and plates, whose friction confines so small a specimen too.
#[test]
fn isotropic_consolidation_is_isotropic() {
    let (_, _, rows) = consolidated();
    finished(rows, &StageEnd::Finished, 6);
    for (k, row) in rows.iter().enumerate() {
        let m = &row.measures;
        let pressure = PRESSURE * (0.5 + 0.5 * (k + 1) as f64 / 6.0);
        assert!((m.confining_pressure / pressure - 1.0).abs() < 1e-12);
        assert!(m.deviatoric_stress.abs() < HELD * pressure, "{m:?}");
        let stress = &row.picture.contact_stress;
        assert!((stress.axial / m.axial_stress - 1.0).abs() < 0.01, "{stress:?}");
        assert!(((stress.radial - stress.end_friction) / pressure - 1.0).abs() < 0.01, "{stress:?}");
    }
}

#[test]
fn anisotropic_consolidation_follows_both_stresses() {
    let (mut rig, mut test, _) = consolidated();
    let (axial, radial) = (1.2 * PRESSURE, 0.9 * PRESSURE);
    let (rows, end) = run(&mut rig, &mut test, &loaded(Path::Stress { axial, radial }, 8));
    finished(&rows, &end, 8);
    for row in &rows {
        let m = &row.measures;
        let at = |to: f64| PRESSURE + row.progress * (to - PRESSURE);
        assert!((m.axial_stress - at(axial)).abs() < HELD * PRESSURE, "{m:?}");
        assert!((m.confining_pressure - at(radial)).abs() < HELD * PRESSURE);
    }
}

#[test]
fn drained_shear_lands_on_a_stress_and_unloads_and_reloads() {
    let (mut rig, mut test, _) = consolidated();
    let height = rig.height(&rig.committed.poses);
    let goal = 0.3 * PRESSURE;
    let loading = Stage { until: to_stress(goal, false), ..drive(0.01, Lateral::Pressure) };
    let (rows, end) = run(&mut rig, &mut test, &loading);
    finished(&rows, &end, 2);
    let loaded = rows[rows.len() - 1].measures;
    assert!((loaded.deviatoric_stress / goal - 1.0).abs() < HELD, "{loaded:?}");
    for row in &rows[..rows.len() - 1] {
        assert!(row.measures.deviatoric_stress < goal);
        assert!((row.measures.confining_pressure - PRESSURE).abs() < 1e-9 * PRESSURE);
    }
    assert!((1.0 - rig.height(&rig.committed.poses) / height - loaded.axial_strain).abs() < 1e-12);

    let until = to_stress(0.1 * PRESSURE, true);
    let unloading = Stage { steps: steps(2e-5), until, ..drive(-0.01, Lateral::Pressure) };
    let (rows, end) = run(&mut rig, &mut test, &unloading);
    finished(&rows, &end, 2);
    let unloaded = rows[rows.len() - 1].measures;
    assert!((unloaded.deviatoric_stress - 0.1 * PRESSURE).abs() < HELD * goal, "{unloaded:?}");
    assert!(unloaded.axial_strain < loaded.axial_strain);

    let (rows, end) = run(&mut rig, &mut test, &reloaded());
    finished(&rows, &end, 2);
    let reloaded = rows[rows.len() - 1].measures;
    assert!((reloaded.axial_strain - loaded.axial_strain).abs() < 1e-12, "{reloaded:?}");
    // A loop takes energy, it gives none.
    assert!(test.ledger.friction > 0.0);
}

/// The volume stays, and the mean cross-section stays; the pressure follows. Not further than to 2e-4: so loose a specimen has lost all its pressure
/// at constant volume by 4e-4, or has not, depending on how it was seated.
#[test]
fn constant_volume_and_oedometer_hold_volume_and_area() {
    for (lateral, per_axial) in [(Lateral::Volume, 0.0), (Lateral::Area, 1.0)] {
        let (mut rig, mut test, _) = consolidated();
        let stage = drive(2e-4, lateral);
        let (rows, end) = run(&mut rig, &mut test, &stage);
        finished(&rows, &end, 4);
        for row in &rows {
            let m = &row.measures;
            let miss = (m.volumetric_strain - per_axial * m.axial_strain).abs();
            assert!(miss < HELD * 5e-5, "{lateral:?}: {m:?}");
            assert!(m.confining_pressure != PRESSURE);
        }
        let last = rows[rows.len() - 1].measures;
        assert!((last.axial_strain - 2e-4).abs() < 1e-12);
        assert!((rig.pressure - last.confining_pressure).abs() == 0.0);
    }
}

#[test]
fn constant_mean_stress_is_constant() {
    let (mut rig, mut test, _) = consolidated();
    let (rows, end) = run(&mut rig, &mut test, &drive(4e-4, Lateral::MeanStress));
    finished(&rows, &end, 8);
    for (k, row) in rows.iter().enumerate() {
        let m = &row.measures;
        assert!((m.mean_stress / PRESSURE - 1.0).abs() < HELD, "{m:?}");
        assert!((m.axial_strain - 5e-5 * (k + 1) as f64).abs() < HELD * 5e-5);
    }
    assert!(rows[rows.len() - 1].measures.deviatoric_stress > 0.0);
}

/// Loaded and driven, the specimen goes the same way as long as it gets stronger.
#[test]
fn stress_control_reaches_what_strain_control_reaches() {
    let (mut rig, mut test, _) = consolidated();
    let deviatoric_stress = 0.2 * PRESSURE;
    let (rows, end) = run(&mut rig, &mut test, &loaded(Path::Shear { deviatoric_stress }, 10));
    finished(&rows, &end, 10);
    let loaded = rows[rows.len() - 1].measures;
    assert!((loaded.deviatoric_stress / deviatoric_stress - 1.0).abs() < HELD);

    let (mut rig, mut test, _) = consolidated();
    let until = to_stress(deviatoric_stress, true);
    let stage = Stage { until, steps: steps(1e-5), ..drive(0.01, Lateral::Pressure) };
    let (rows, end) = run(&mut rig, &mut test, &stage);
    finished(&rows, &end, 2);
    // Increments of different sizes take different paths through friction: first order in their size,
    // of which there are ten.
    let driven = rows[rows.len() - 1].measures;
    assert!((driven.axial_strain / loaded.axial_strain - 1.0).abs() < 0.1, "{driven:?} {loaded:?}");
}

#[test]
fn hold_changes_nothing() {
    for lateral in [None, Some(Lateral::Pressure)] {
        let (mut rig, mut test, _) = consolidated();
        if let Some(lateral) = lateral {
            run(&mut rig, &mut test, &drive(1e-4, lateral));
        }
        let before = rig.committed.poses.clone();
        let (rows, end) = run(&mut rig, &mut test, &loaded(Path::Hold, 2));
        finished(&rows, &end, 2);
        for (old, new) in before.iter().zip(&rig.committed.poses) {
            // Nothing moves further than what the tolerance on forces leaves open.
            assert!((new.position - old.position).norm() < 1e-7);
        }
    }
}

#[test]
fn a_free_top_plate_tilts_until_it_carries_no_moment() {
    let (mut rig, mut test, _) = consolidated();
    rig.tilting = true;
    let (rows, end) = run(&mut rig, &mut test, &drive(2e-4, Lateral::Pressure));
    finished(&rows, &end, 4);
    let tilt = rows[rows.len() - 1].picture.tilt;
    assert!(tilt > 1e-6 && tilt < 0.1, "{tilt}");
}

/// Where rows may move on the one that a stage lands with is at rest all the same, and so is the one behind a drop.
#[test]
fn stages_that_end_early_come_to_rest() {
    for (q, drop) in [(Some(0.3 * PRESSURE), None), (None, Some(0.05))] {
        let (mut rig, mut test, _) = consolidated();
        rig.settings.stabilisation = Stabilisation::Unrest(1e-2);
        let until = Until { deviatoric_stress: q, drop_after_peak: drop, must: false };
        let (rows, end) = run(&mut rig, &mut test, &Stage { until, ..drive(0.02, Lateral::Pressure) });
        assert_eq!(end, StageEnd::Finished);
        let last = &rows[rows.len() - 1];
        let tolerance = rig.settings.force_tolerance;
        assert!(last.path < 1.0 && last.out_of_balance < tolerance, "{last:?}");
        let moving = rows.iter().filter(|row| row.out_of_balance > tolerance).count();
        assert!(moving > rows.len() / 4, "{moving} of {}", rows.len());
        if let Some(q) = q {
            assert!((last.measures.deviatoric_stress / q - 1.0).abs() < HELD, "{last:?}");
        }
    }
}

/// What cannot be reached ends the stage with a reason: no stress, no silence.
#[test]
fn a_stress_that_never_comes_stops_the_stage() {
    let (mut rig, mut test, _) = consolidated();
    let until = to_stress(100.0 * PRESSURE, true);
    let stage = Stage { until, ..drive(1e-4, Lateral::Pressure) };
    let (_, end) = run(&mut rig, &mut test, &stage);
    assert!(matches!(end, StageEnd::Stopped { reason } if reason.contains("deviatoric stress")));
}

/// A driven stage passes the peak and ends behind it; a loaded one stops there and says what it carries.
#[test]
fn a_peak_is_passed_when_driven_and_stops_a_load() {
    let (mut rig, mut test, _) = consolidated();
    let drop = 0.05;
    let until = Until { deviatoric_stress: None, drop_after_peak: Some(drop), must: false };
    let stage = Stage { until, ..drive(0.02, Lateral::Pressure) };
    let (rows, end) = run(&mut rig, &mut test, &stage);
    finished(&rows, &end, 3);
    let q: Vec<f64> = rows.iter().map(|row| row.measures.deviatoric_stress).collect();
    let (last, before) = q.split_last().expect("rows");
    let peak = before.iter().copied().fold(0.0, f64::max);
    assert!(rows[rows.len() - 1].path < 1.0, "no peak came");
    assert_eq!(rows[rows.len() - 1].progress, 1.0);
    assert!(*last < (1.0 - drop) * peak, "{last} after {peak}");
    let mut largest: f64 = 0.0;
    for q in before {
        largest = largest.max(*q);
        assert!(*q >= (1.0 - drop) * largest, "went on behind {q}");
    }

    let (mut rig, mut test, _) = consolidated();
    let deviatoric_stress = 3.0 * peak;
    let (rows, end) = run(&mut rig, &mut test, &loaded(Path::Shear { deviatoric_stress }, 30));
    let carried = rows[rows.len() - 1].measures.deviatoric_stress;
    let StageEnd::Stopped { reason } = end else { panic!("{end:?} at {carried} Pa of {deviatoric_stress}") };
    assert!(reason.contains("cannot pass a peak") && reason.contains(&format!("{carried:.4e}")), "{reason}");
}

/// Strains of stages in turn add up: all count from the height behind the consolidation.
#[test]
fn strains_of_stages_add_up() {
    let (mut rig, mut test, _) = consolidated();
    test.zero_strains(&rig);
    let mut sum = 0.0;
    for strain in [2e-3, 2e-3, -4e-4, 1e-3] {
        let (rows, end) =
            run(&mut rig, &mut test, &Stage { steps: steps(2e-4), ..drive(strain, Lateral::Pressure) });
        finished(&rows, &end, 2);
        sum += strain;
        let reached = rows[rows.len() - 1].measures.axial_strain;
        assert!((reached - sum).abs() < 1e-12, "{reached} for {sum}");
    }
}

/// Cutting at the energy gate: every increment closes within it, or is the smallest there is.
#[test]
fn an_energy_gate_that_cuts_keeps_increments_closed() {
    let (mut rig, mut test, _) = consolidated();
    test.energy_gate = EnergyGate { tolerance: 5e-3, cuts: true };
    let (rows, end) = run(&mut rig, &mut test, &drive(3e-4, Lateral::Pressure));
    finished(&rows, &end, 6);
    let smallest = 5e-5 * 0.5f64.powi(rig.settings.max_cuts as i32);
    let mut before = 0.0;
    for row in &rows {
        let increment = row.measures.axial_strain - before;
        before = row.measures.axial_strain;
        assert!(row.energy_gap.abs() <= 5e-3 || row.poorly_closed, "{row:?}");
        assert!(!row.poorly_closed || increment < 1.01 * smallest, "{increment}: {row:?}");
    }
}

/// See `verification::rig` for the problem and its tolerance: q over the axial strain is E, and the volume strain over it 1 - 2 nu.
#[test]
fn an_elastic_prism_is_in_simple_compression_away_from_its_ends() {
    let [short, tall] = TALL;
    for (strain, height, tolerance) in
        [(1e-4, short, 0.01), (-2e-5, short, 0.01), (1e-4, tall, 1e-3), (-5e-5, tall, 1e-3)]
    {
        let ([modulus, poisson], _) = prism(strain, height).expect("a rig").expect("every stage finishes");
        let volume = (1.0 - 2.0 * poisson) / (1.0 - 2.0 * 0.2);
        assert!(
            (modulus - 1.0).abs() < tolerance && (volume - 1.0).abs() < tolerance,
            "{strain} {height}: {modulus} {poisson}"
        );
    }
}
