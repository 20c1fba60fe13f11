//! Grains with all their nodes against condensed ones.
//!
//! Two cubes, one turned on the other, are pressed and pushed between a fixed plate and a driven one; friction holds
//! them (without it they would turn away).
//!
//! - With strains that are linear in the displacements both are the same equations, solved in different ways: plate
//!   forces agree to 1e-8 when both are converged far beyond that.
//! - With Green's strains the difference is of the order of the strain.

use std::sync::Arc;

use riprap::element::Strains;
use riprap::grain::{CondensedGrain, FullGrain};
use riprap::loading::StageEnd;
use riprap::scene::{Scene, SceneBody};
use riprap::tensor::Vec3;

use riprap::verification::bodies::DENSITY;

use crate::two_cubes::{EDGE, between_plates, meshed};

#[derive(Debug, Clone, Copy)]
enum Cubes {
    Condensed,
    Full(Strains),
}

struct Pressed {
    force: Vec3,
    moment: Vec3,
    elastic: f64,
    factorisations: usize,
}

fn pressed(cubes: Cubes, approach: f64) -> Pressed {
    let made = |cube: SceneBody| {
        let (mesh, rock) = meshed();
        let grain = Arc::new(CondensedGrain::new(mesh, &rock, DENSITY).expect("a grain"));
        match cubes {
            Cubes::Condensed => SceneBody { grain: Some(grain), ..cube },
            Cubes::Full(strains) => {
                let full = FullGrain::new(grain.clone(), DENSITY, strains).expect("a grain");
                SceneBody { full: Some(Arc::new(full)), grain: Some(grain), ..cube }
            }
        }
    };
    let mut parameters = between_plates(0.65, 4, [0.1 * approach, 0.0, -approach], made);
    parameters.settings.force_tolerance = 1e-8;
    parameters.settings.gap_tolerance = 1e-13;
    let mut scene = Scene::new(&parameters).expect("a sound scene");
    let (mut last, mut increments, mut factorisations) = (None, 0, 0);
    let end = scene.run(|_, row| {
        increments = row.increment;
        factorisations += row.counters.factorisations;
        last = Some((row.bodies[3].contact_force, row.bodies[3].contact_moment));
        true
    });
    assert_eq!(end, StageEnd::Finished, "{cubes:?}");
    assert_eq!(increments, 4, "{cubes:?}: the same increments for all");
    let (force, moment) = last.expect("increments");
    Pressed { force, moment, elastic: scene.ledger.elastic, factorisations }
}

fn difference(a: &Pressed, b: &Pressed) -> f64 {
    let force = (a.force - b.force).norm() / b.force.norm();
    let moment = (a.moment - b.moment).norm() / (EDGE * b.force.norm());
    force.max(moment).max((a.elastic / b.elastic - 1.0).abs())
}

#[test]
fn full_equals_condensed_at_small_strains() {
    for approach in [40e-6, 100e-6] {
        let condensed = pressed(Cubes::Condensed, approach);
        let full = pressed(Cubes::Full(Strains::Small), approach);
        let difference = difference(&full, &condensed);
        println!(
            "{:.3} N, difference {difference:.1e}, {} and {} factorisations",
            full.force.z, condensed.factorisations, full.factorisations
        );
        assert!(full.force.z > 100.0);
        assert!(difference < 1e-8, "approach {approach} m: {difference}");
    }
}

#[test]
fn finite_strains_differ_by_the_order_of_the_strain() {
    for approach in [4e-6, 40e-6, 400e-6] {
        let small = pressed(Cubes::Full(Strains::Small), approach);
        let finite = pressed(Cubes::Full(Strains::Finite), approach);
        let (difference, strain) = (difference(&finite, &small), approach / (2.0 * EDGE));
        println!("strain {strain:.1e}: difference {difference:.2e}");
        // Contacts concentrate the strain on facets of a quarter of the cube.
        assert!(difference < 30.0 * strain, "strain {strain}: {difference}");
        assert!(difference > 1e-3 * strain, "strain {strain}: {difference}");
    }
}
