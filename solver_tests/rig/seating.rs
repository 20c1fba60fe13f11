//! Loose grains of a compacted specimen fall into touch.
//!
//! Implicit steps alone need a factorisation for each fifty micrometres or so that something loose has to go: some thousand for a few hundred
//! grains, ever more with their number.

use riprap::triaxial::{Cover, Rims, Test};

use crate::ready::{PRESSURE, rig};

#[test]
fn grains_fall_into_touch_with_few_factorisations() {
    let mut rig = rig(Cover::Pressure(Rims::Bonded));
    let mut test = Test::new(&rig);
    let before = rig.committed.poses.clone();
    let report = test.seat(&mut rig, PRESSURE);
    assert!(report.converged() && report.balance.out_of_balance < 1e-3, "{:?}", report.history);
    let counters = report.counters;
    assert!(counters.relaxation_steps > 100 && counters.factorisations < 60, "{counters:?}");
    // They settle; nothing is rearranged: loose as generated, a grain of 40 to 60 mm goes a millimetre or two.
    let moved = before.iter().zip(&rig.committed.poses).map(|(a, b)| (a.position - b.position).norm());
    assert!(moved.fold(0.0, f64::max) < 5e-3);
    // What slipped on the way weakens nothing.
    assert!(rig.committed.memory.values().all(|pair| pair.slip == 0.0));
    // At once again: there is nothing left to do.
    let again = test.seat(&mut rig, PRESSURE);
    assert!(again.converged() && again.counters.factorisations == 0, "{:?}", again.counters);
}
