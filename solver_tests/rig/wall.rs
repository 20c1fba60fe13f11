//! The `rigid_wall` cover: a smooth cylinder whose mean pressure is the confining pressure.

use riprap::triaxial::{Cover, Lateral, Path, Rig, Row, Stage, Test};

use crate::ready::{HELD, PRESSURE, consolidated, drive, finished, loaded, reloaded, rig, steps, to_stress};

/// Mean pressure of the grains on the wall over its whole side, from the contacts [Pa].
fn mean_pressure(rig: &Rig) -> f64 {
    let wall = rig.model.wall.as_ref().expect("a wall");
    let poses = &rig.committed.poses;
    let force: f64 = rig.contacts.wall.iter().map(|contact| contact.pressure).sum();
    force / (2.0 * std::f64::consts::PI * wall.radius(poses) * wall.height(poses))
}

/// Runs a stage and checks, in every row, the wall's pressure, the volume strain, and the stress in three ways.
fn watched(rig: &mut Rig, test: &mut Test, stage: &Stage, least: usize) -> Vec<Row> {
    let mut rows = Vec::new();
    let zero = test.zero.volume;
    let end = test.run(rig, stage, &mut |rig, step| {
        let m = &step.row.measures;
        assert!((mean_pressure(rig) / m.confining_pressure - 1.0).abs() < HELD, "{m:?}");
        let wall = rig.model.wall.as_ref().expect("a wall");
        let poses = &rig.committed.poses;
        let volume = std::f64::consts::PI * wall.radius(poses).powi(2) * wall.height(poses);
        assert!((m.volumetric_strain - (1.0 - volume / zero)).abs() < 1e-14);
        let stress = &step.row.picture.contact_stress;
        assert!(stress.disagreement < 0.01, "{stress:?} {m:?}");
        rows.push(step.row.clone());
        true
    });
    finished(&rows, &end, least);
    rows
}

#[test]
fn the_wall_presses_with_the_confining_pressure_in_every_stage() {
    let (mut rig, mut test, rows) = consolidated(Cover::RigidWall);
    assert_eq!(rows.len(), 6);
    assert!((mean_pressure(&rig) / PRESSURE - 1.0).abs() < HELD);
    watched(&mut rig, &mut test, &loaded(Path::Hold, 2), 2);
    let goal = 0.3 * PRESSURE;
    let loading = Stage { until: to_stress(goal, false), ..drive(0.01, Lateral::Pressure) };
    let rows = watched(&mut rig, &mut test, &loading, 2);
    let loaded = rows[rows.len() - 1].measures;
    assert!((loaded.deviatoric_stress / goal - 1.0).abs() < HELD, "{loaded:?}");
    let until = to_stress(0.1 * PRESSURE, true);
    let unloading = Stage { steps: steps(2e-5), until, ..drive(-0.01, Lateral::Pressure) };
    watched(&mut rig, &mut test, &unloading, 2);
    let rows = watched(&mut rig, &mut test, &reloaded(), 2);
    let reloaded = rows[rows.len() - 1].measures;
    assert!((reloaded.axial_strain - loaded.axial_strain).abs() < 1e-12, "{reloaded:?}");
}

#[test]
fn stages_in_which_the_pressure_follows_move_the_wall_as_they_say() {
    for (lateral, per_axial) in [(Lateral::Volume, 0.0), (Lateral::Area, 1.0)] {
        let (mut rig, mut test, _) = consolidated(Cover::RigidWall);
        for row in watched(&mut rig, &mut test, &drive(2e-4, lateral), 4) {
            let m = &row.measures;
            assert!((m.volumetric_strain - per_axial * m.axial_strain).abs() < HELD * 5e-5, "{m:?}");
        }
    }
    let (mut rig, mut test, _) = consolidated(Cover::RigidWall);
    for row in watched(&mut rig, &mut test, &drive(2e-4, Lateral::MeanStress), 4) {
        assert!((row.measures.mean_stress / PRESSURE - 1.0).abs() < HELD, "{row:?}");
    }
}

/// Before anything moves the wall touches the outermost grain and encloses them all.
#[test]
fn the_wall_begins_at_the_outermost_grain() {
    let rig = rig(Cover::RigidWall);
    let wall = rig.model.wall.as_ref().expect("a wall");
    let radius = wall.radius(&rig.committed.poses);
    let mut reach: f64 = 0.0;
    for (body, pose) in rig.model.shapes.iter().zip(&rig.committed.poses).take(16) {
        let vertices = body.rounded.core.vertices.iter();
        reach = vertices.map(|v| pose.to_space(v).xy().norm() + body.rounded.radius).fold(reach, f64::max);
    }
    assert_eq!(reach, radius);
}
