//! Full grains whose nodes are eliminated against those whose nodes are unknowns: sixteen of them consolidated and sheared.
//!
//! Both are the same equations, so q and volume strain agree to what the tolerance of the forces leaves; condensed grains lack the finite strains.

use std::sync::Arc;

use riprap::element::Strains;
use riprap::grain::FullGrain;
use riprap::material::Elastic;
use riprap::mesh::grain_mesh;
use riprap::triaxial::{Cover, Lateral, Rig, Rims, Row, Test};

use crate::ready::{PRESSURE, consolidate_seated, drive, finished, rig, run};

const FORCE_TOLERANCE: f64 = 1e-4;

fn resolve(rig: &mut Rig, eliminated: bool) {
    let rock = Elastic::new(3e10, 0.2).expect("allowed");
    let grains = rig.model.bodies[..16].iter().map(|body| {
        let mesh = grain_mesh(&body.nominal, 38).expect("a mesh");
        let rock = vec![rock; mesh.cells.len()];
        if eliminated {
            let (full, condensed) =
                FullGrain::eliminated(mesh, &rock, 2700.0, Strains::Finite).expect("a grain");
            return (Arc::new(full), Some(Arc::new(condensed)));
        }
        (Arc::new(FullGrain::new(mesh, &rock, 2700.0, Strains::Finite).expect("a grain")), None)
    });
    let grains = grains.collect();
    rig.resolve(grains);
}

/// The rows of the consolidation and of the shear; grains are seated rigid first, as `simulation::seating` does it.
fn sheared(eliminated: bool) -> Vec<Row> {
    let mut rig = rig(Cover::Pressure(Rims::Bonded));
    rig.settings.force_tolerance = FORCE_TOLERANCE;
    resolve(&mut rig, eliminated);
    let mut test = Test::new(&rig);
    let elasticity = rig.stiffen().expect("full grains");
    for _ in 0..8 {
        if test.seat(&mut rig, PRESSURE).converged() {
            break;
        }
    }
    rig.soften(elasticity);
    let mut rows = consolidate_seated(&mut rig, &mut test, 4);
    let (more, end) = run(&mut rig, &mut test, &drive(2e-4, Lateral::Pressure));
    finished(&more, &end, 4);
    rows.extend(more);
    rows
}

#[test]
fn eliminated_nodes_give_the_specimen_of_unknown_ones() {
    let (eliminated, unknown) = (sheared(true), sheared(false));
    assert_eq!(eliminated.len(), unknown.len());
    let work = |rows: &[Row]| rows.iter().map(|row| row.counters.factorisations).sum::<usize>();
    let largest = unknown.iter().map(|row| row.measures.deviatoric_stress).fold(0.0, f64::max);
    for (one, other) in eliminated.iter().zip(&unknown) {
        let q = (one.measures.deviatoric_stress - other.measures.deviatoric_stress).abs() / largest;
        let v = (one.measures.volumetric_strain - other.measures.volumetric_strain).abs();
        println!("q {q:.1e}, volume strain {v:.1e} of {:.1e}", other.measures.volumetric_strain);
        // A tolerance of 1e-4 of the mean contact force, at each of some tens of contacts on the way to the plates.
        assert!(q < 10.0 * FORCE_TOLERANCE, "{q}");
        // Steps to rest end at 1.1e-7 of 9.3e-5, whatever the tolerances.
        assert!(v < 20.0 * FORCE_TOLERANCE * other.measures.volumetric_strain.abs().max(1e-4), "{v}");
    }
    println!("{} and {} factorisations", work(&eliminated), work(&unknown));
}
