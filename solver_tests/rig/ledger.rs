//! The energy ledger, increment by increment: external work is what is stored and dissipated, to second order.

use riprap::solver::Stabilisation;
use riprap::triaxial::{Cover, Lateral, Rims, Row, Stage};

use crate::ready::{consolidate, consolidated, drive, finished, rig, run, steps};

/// What the rig promises.
const CLOSED: f64 = 1e-3;
/// Trapezoidal rules are of second order: half the increment leaves a quarter of the gap. A contact that comes, goes, or
/// begins to slide within an increment bends the curve, so more than half of that is asked.
const GAIN: f64 = 2.5;

/// Median of the increments' gaps, and the error of the rows over their external work.
fn gaps(rows: &[Row], before: Option<&Row>) -> [f64; 2] {
    let mut all: Vec<f64> = rows.iter().map(|row| row.energy_gap.abs()).collect();
    all.sort_by(f64::total_cmp);
    let last = &rows[rows.len() - 1].ledger;
    let (external, error) = before.map_or((0.0, 0.0), |row| (row.ledger.external, row.ledger.error()));
    let cumulative = (last.error() - error) / (last.external - external);
    [all[all.len() / 2], cumulative.abs()]
}

#[test]
fn consolidation_closes_to_second_order() {
    for cover in [Cover::Pressure(Rims::Bonded), Cover::RigidWall] {
        let of = |increments: usize| {
            let (_, rows) = consolidate(&mut rig(cover), increments);
            assert!(increments < 12 || rows.iter().all(|row| row.energy_gap.abs() < CLOSED), "{cover:?}");
            gaps(&rows, None)
        };
        let [coarse, fine] = [12, 24].map(of);
        assert!(coarse[1] < CLOSED && fine[0] < coarse[0] / GAIN, "{cover:?}: {coarse:?} {fine:?}");
    }
}

/// Contacts slide, are lost and slide off edges here, so that the medians of single sizes scatter: a quarter of the increment.
#[test]
fn drained_shear_closes_to_second_order() {
    for cover in [Cover::Pressure(Rims::Bonded), Cover::RigidWall] {
        let of = |size: f64| {
            let (mut rig, mut test, before) = consolidated(cover);
            let stage = Stage { steps: steps(size), ..drive(2e-3, Lateral::Pressure) };
            let (rows, end) = run(&mut rig, &mut test, &stage);
            finished(&rows, &end, 40);
            gaps(&rows, before.last())
        };
        let [coarse, fine] = [5e-5, 1.25e-5].map(of);
        assert!(coarse[1] < CLOSED && coarse[0] < CLOSED, "{cover:?}: {coarse:?}");
        assert!(fine[0] < coarse[0] / GAIN.powi(2) && fine[1] < CLOSED, "{cover:?}: {coarse:?} {fine:?}");
    }
}

/// In an increment of several ways the pressure rises on the first and bodies go on moving on the others: its work is booked way by way.
#[test]
fn the_pressure_is_booked_along_the_way() {
    let mut rig = rig(Cover::Pressure(Rims::Bonded));
    rig.settings.stabilisation = Stabilisation::Unrest(1e-4);
    let (_, rows) = consolidate(&mut rig, 3);
    let [_, error] = gaps(&rows, None);
    println!("{error:.1e}");
    assert!(error < 1e-3, "{error:.1e}");
}
