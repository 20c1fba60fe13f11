//! Full grains against condensed ones: sixteen of them consolidated and sheared, behind springs and behind asperities.
//!
//! Both are the same equations but for the finite strains, which change the forces of a grain by about its strain (`verification::full_grain`).

use std::sync::Arc;

use riprap::contact::NormalLaw;
use riprap::element::Strains;
use riprap::grain::{CondensedGrain, FullGrain};
use riprap::model::Deformation;
use riprap::triaxial::{Cover, Lateral, Rig, Rims, Row, Test};

use crate::behind::with_asperities;
use crate::ready::{condensed_grains, consolidate_seated, drive, finished, rig, run, seat};

const FORCE_TOLERANCE: f64 = 1e-4;

fn deform(rig: &mut Rig, strains: Option<Strains>) {
    let deformation = |grain| match strains {
        Some(strains) => fully(grain, strains),
        None => Deformation::condensed(grain),
    };
    rig.make(condensed_grains(rig, 38).into_iter().map(|grain| (deformation(grain), None)));
}

/// By the motion of all nodes.
pub fn fully(grain: Arc<CondensedGrain>, strains: Strains) -> Deformation {
    Deformation::full(Arc::new(FullGrain::new(grain, 2700.0, strains).expect("a grain")))
}

/// The rows of the consolidation and of the shear; grains are seated rigid first, as `simulation::seating` does it.
fn sheared(normal: NormalLaw, strains: Option<Strains>) -> Vec<Row> {
    let mut rig = rig(Cover::Pressure(Rims::Bonded));
    if normal == NormalLaw::Asperity {
        rig = with_asperities(rig);
    }
    rig.settings.force_tolerance = FORCE_TOLERANCE;
    deform(&mut rig, strains);
    let mut test = Test::new(&rig);
    let elasticity = rig.stiffen().expect("grains that deform");
    seat(&mut rig, &mut test);
    rig.soften(elasticity);
    let mut rows = consolidate_seated(&mut rig, &mut test, 4);
    let (more, end) = run(&mut rig, &mut test, &drive(2e-4, Lateral::Pressure));
    finished(&more, &end, 4);
    rows.extend(more);
    let ledger = &rows[rows.len() - 1].ledger;
    assert!(ledger.error().abs() < 1e-3 * ledger.external, "{ledger:?}");
    rows
}

/// The largest difference of q over its largest, and of the volume strain over its own.
fn difference(some: &[Row], others: &[Row]) -> [f64; 2] {
    assert_eq!(some.len(), others.len());
    let largest = |of: &dyn Fn(&Row) -> f64| others.iter().map(|row| of(row).abs()).fold(0.0, f64::max);
    let off = |of: &dyn Fn(&Row) -> f64| {
        let apart = some.iter().zip(others).map(|(one, other)| (of(one) - of(other)).abs());
        apart.fold(0.0, f64::max) / largest(of)
    };
    [off(&|row| row.measures.deviatoric_stress), off(&|row| row.measures.volumetric_strain)]
}

#[test]
fn full_grains_are_condensed_ones_but_for_finite_strains() {
    for normal in [NormalLaw::Spring, NormalLaw::Asperity] {
        let condensed = sheared(normal, None);
        let [small, finite] = [Strains::Small, Strains::Finite]
            .map(|strains| difference(&sheared(normal, Some(strains)), &condensed));
        println!("{normal:?}: small {small:?}, finite {finite:?}");
        // A tolerance of 1e-4 of the mean contact force, at each of some tens of contacts on the way to the plates.
        assert!(small.iter().all(|off| *off < 10.0 * FORCE_TOLERANCE), "{small:?}");
        assert!(finite.iter().all(|off| *off < 20.0 * FORCE_TOLERANCE && *off > 0.0), "{finite:?}");
    }
}
