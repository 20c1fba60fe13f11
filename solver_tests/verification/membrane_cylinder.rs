//! Membrane cylinders with closed forms: see `ladder::cylinder` for the problems, their sources and their tolerances.

use riprap::ladder::cylinder::{Cylinder, MODULUS, RADIUS, THICKNESS};
use riprap::material::{Rubber, RubberLaw, Wrinkling};

#[test]
fn inflated_cylinder_meets_the_closed_form() {
    for law in
        [RubberLaw::NeoHookean, RubberLaw::MooneyRivlin { share: 0.2 }, RubberLaw::Gent { limit: 25.0 }]
    {
        let rubber = Rubber::new(MODULUS, law).expect("allowed");
        for (hoop, axial) in [(1.1, 1.0), (1.5, 1.0), (2.5, 1.2)] {
            // W(l, m) by its own definition, differentiated by hand.
            let (l, m): (f64, f64) = (hoop, axial);
            let first = 2.0 * l - 2.0 / (l.powi(3) * m * m);
            let second = 2.0 * l * m * m - 2.0 / l.powi(3);
            let excess = l * l + m * m + 1.0 / (l * m).powi(2) - 3.0;
            let slope = 0.5
                * MODULUS
                * match law {
                    RubberLaw::NeoHookean => first,
                    RubberLaw::MooneyRivlin { share } => (1.0 - share) * first + share * second,
                    RubberLaw::Gent { limit } => first / (1.0 - excess / limit),
                };
            let closed = THICKNESS * slope / (RADIUS * l * m);
            let mut errors = vec![];
            for size in [0.04, 0.02] {
                let cylinder = Cylinder::new(size);
                let x = cylinder.stretched(hoop, axial);
                let pressure = cylinder.balancing_pressure(&x, &rubber, Wrinkling::Free { support: 0.0 });
                errors.push((pressure / closed - 1.0).abs());
                let n = cylinder.mesh.around as f64;
                assert!(
                    errors[errors.len() - 1] < (std::f64::consts::PI / n).powi(2),
                    "{law:?} {hoop}: {pressure} {closed}"
                );
            }
        }
    }
}

#[test]
fn membrane_correction_to_first_order() {
    let rubber = Rubber::new(MODULUS, RubberLaw::NeoHookean).expect("allowed");
    let young = rubber.youngs_modulus();
    let cylinder = Cylinder::new(0.01);
    let diameter = 2.0 * RADIUS;
    // The polygon's sides are shorter than the arc, by (pi/n)^2/6 = 2e-4.
    let polygon = 1e-3;
    for strain in [1e-3, 2e-3, -1e-3, -2e-3] {
        let axial = 1.0 - strain;
        let x = cylinder.stretched(1.0 / f64::sqrt(axial), axial);
        let area = std::f64::consts::PI * RADIUS * RADIUS;
        let first_order = 4.0 * young * THICKNESS * strain / diameter;
        let held = -cylinder.axial_force(&x, &rubber, Wrinkling::Held) / area;
        assert!((held / first_order - 1.0).abs() < 3.0 * strain.abs() + polygon, "{held} {first_order}");
        let free = Wrinkling::Free { support: 0.0 };
        let axial_part = -cylinder.axial_force(&x, &rubber, free) / area;
        let lateral = cylinder.balancing_pressure(&x, &rubber, free);
        if strain > 0.0 {
            assert!(axial_part.abs() < 1e-3 * first_order, "{axial_part}");
            let hoop = young * THICKNESS * strain / diameter;
            assert!((lateral / hoop - 1.0).abs() < 3.0 * strain + polygon, "{lateral} {hoop}");
        } else {
            assert!((axial_part / first_order - 1.0).abs() < 3.0 * strain.abs() + polygon);
            assert!(lateral.abs() < 1e-3 * first_order.abs(), "{lateral}");
        }
    }
}
