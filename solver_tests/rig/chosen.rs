//! Fidelity chosen for an accuracy, on sixteen grains consolidated and sheared.
//!
//! Reference: all grains condensed, the same increments. Asked is that q keeps within the accuracy of it: root of the mean square over the
//! shear, over the largest q, as the charts of work against precision measure it. Nothing here is fitted: the choice sees its own estimate
//! alone. All changes of fidelity leave contact forces as they are, to a thousandth of the mean force.

use std::sync::Arc;

use riprap::contact::law::Friction;
use riprap::grain::CondensedGrain;
use riprap::loading::StageEnd;
use riprap::model::Deformation;
use riprap::solver::Stabilisation;
use riprap::triaxial::{Cover, Lateral, Rig, Rims, Row, Stage, Steps, Test};

use crate::ready::{condensed_grains, consolidate_seated, drive, finished, rig, run, seat};

fn make(rig: &mut Rig, deforms: fn(Arc<CondensedGrain>) -> Deformation) {
    rig.make(condensed_grains(rig, 38).into_iter().map(|grain| (deforms(grain), None)));
}

/// The rows of the shear; grains are seated rigid first, as `simulation::seating` does it.
fn sheared(accuracy: Option<f64>) -> Vec<Row> {
    let mut rig = rig(Cover::Pressure(Rims::Bonded));
    make(&mut rig, if accuracy.is_some() { Deformation::resting } else { Deformation::condensed });
    let mut test = Test::new(&rig);
    if accuracy.is_some() {
        rig.settings.accuracy = accuracy;
        seat(&mut rig, &mut test);
        rig.condense_seated();
    } else {
        let elasticity = rig.stiffen().expect("condensed grains");
        seat(&mut rig, &mut test);
        rig.soften(elasticity);
    }
    let before = consolidate_seated(&mut rig, &mut test, 6);
    let (rows, end) = run(&mut rig, &mut test, &drive(1e-3, Lateral::Pressure));
    finished(&rows, &end, 20);
    for row in before.iter().chain(&rows) {
        assert!(row.fidelity.jump < 1e-3, "{:?}", row.fidelity);
    }
    rows
}

#[test]
fn q_keeps_within_the_accuracy() {
    let stress =
        |rows: &[Row]| -> Vec<f64> { rows.iter().map(|row| row.measures.deviatoric_stress).collect() };
    let reference = stress(&sheared(None));
    let largest = reference.iter().copied().fold(0.0, f64::max);
    let mut condensed = Vec::new();
    for accuracy in [0.02, 0.05, 0.1, 1.0] {
        let rows = sheared(Some(accuracy));
        let q = stress(&rows);
        assert_eq!(q.len(), reference.len());
        let square: f64 = q.iter().zip(&reference).map(|(q, r)| (q - r).powi(2)).sum();
        let error = (square / q.len() as f64).sqrt() / largest;
        let counts = rows[rows.len() - 1].fidelity;
        let estimate = rows.iter().filter_map(|row| row.fidelity.error).fold(0.0, f64::max);
        println!(
            "asked {accuracy}: {error:.4}, at most {estimate:.4} estimated, {} condensed",
            counts.condensed
        );
        assert!(error < accuracy, "{error}, asked for {accuracy}");
        condensed.push(counts.condensed);
    }
    assert!(condensed[0] >= condensed[2] && condensed[0] > condensed[3], "{condensed:?}");
}

/// A collapse that leads too far to be followed to rest at once: what moves goes on moving from row to row, at the end of the stage, too, and rows say so.
#[test]
fn grains_that_bend_move_on_through_a_collapse() {
    let mut rig = rig(Cover::Pressure(Rims::Bonded));
    make(&mut rig, Deformation::resting);
    let mut test = Test::new(&rig);
    rig.settings.accuracy = Some(0.05);
    seat(&mut rig, &mut test);
    rig.condense_seated();
    consolidate_seated(&mut rig, &mut test, 6);
    rig.settings.stabilisation = Stabilisation::Unrest(3e-3);
    // Slippery grains cannot bear what they bore.
    rig.model.friction = Friction::constant(0.2);
    let stage = Stage { steps: Steps::Count(10), ..drive(4e-3, Lateral::Pressure) };
    let (rows, end) = run(&mut rig, &mut test, &stage);
    assert_eq!(end, StageEnd::Finished);
    assert!(rows[0].restless && rows[0].unrest > 3e-3, "{:?}", rows[0]);
    assert!(rows.iter().all(|row| row.restless || row.unrest < 3e-3));
    let last = &rows[rows.len() - 1].ledger;
    assert!(last.error().abs() < 1e-2 * last.external, "{last:?}");
}
