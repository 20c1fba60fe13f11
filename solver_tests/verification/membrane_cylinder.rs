//! Rubber cylinders: inflated, around a core, under a follower pressure: see `verification::membranes` for
//! the problems, their sources and their tolerances.

use riprap::material::{Rubber, RubberLaw, Wrinkling};
use riprap::verification::membranes::{
    Cylinder, MODULUS, RADIUS, correction, first_order, follower_work, inflation,
};

#[test]
fn inflated_cylinder_meets_the_closed_form() {
    for law in
        [RubberLaw::NeoHookean, RubberLaw::MooneyRivlin { share: 0.2 }, RubberLaw::Gent { limit: 25.0 }]
    {
        let rubber = Rubber::new(MODULUS, law).expect("allowed");
        for (hoop, axial) in [(1.1, 1.0), (1.5, 1.0), (2.5, 1.2)] {
            let closed = inflation(law, hoop, axial);
            for size in [0.04, 0.02] {
                let cylinder = Cylinder::new(size).expect("a mesh");
                let x = cylinder.stretched(hoop, axial);
                let pressure = cylinder.balancing_pressure(&x, &rubber, Wrinkling::Free { support: 0.0 });
                let n = cylinder.mesh.around as f64;
                let error = (pressure / closed - 1.0).abs();
                assert!(error < (std::f64::consts::PI / n).powi(2), "{law:?} {hoop}: {pressure} {closed}");
            }
        }
    }
}

#[test]
fn membrane_correction_to_first_order() {
    let rubber = Rubber::new(MODULUS, RubberLaw::NeoHookean).expect("allowed");
    let cylinder = Cylinder::new(0.01).expect("a mesh");
    let area = std::f64::consts::PI * RADIUS * RADIUS;
    for strain in [1e-3, 2e-3, -1e-3, -2e-3] {
        let axial = 1.0 - strain;
        let x = cylinder.stretched(1.0 / f64::sqrt(axial), axial);
        let [on_the_core, at_the_side] = correction(strain);
        let held = -cylinder.axial_force(&x, &rubber, Wrinkling::Held) / area;
        assert!((held / on_the_core - 1.0).abs() < first_order(strain), "{held} {on_the_core}");
        let free = Wrinkling::Free { support: 0.0 };
        let axial_part = -cylinder.axial_force(&x, &rubber, free) / area;
        let lateral = cylinder.balancing_pressure(&x, &rubber, free);
        if strain > 0.0 {
            assert!(axial_part.abs() < 1e-3 * on_the_core, "{axial_part}");
            assert!((lateral / at_the_side - 1.0).abs() < first_order(strain), "{lateral} {at_the_side}");
        } else {
            assert!((axial_part / on_the_core - 1.0).abs() < first_order(strain));
            assert!(lateral.abs() < 1e-3 * on_the_core.abs(), "{lateral}");
        }
    }
}

#[test]
fn follower_pressure_works_by_the_change_of_volume() {
    for pressure in [1e3, 0.8e6] {
        let [work, exact] = follower_work(pressure).expect("a cover");
        assert!((work / exact - 1.0).abs() < 1e-12, "{work} {exact}");
    }
}
