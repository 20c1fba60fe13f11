//! Membrane cylinders with closed forms: inflated at fixed length, and around a smooth core that is
//! squeezed (the membrane correction of triaxial tests).
//!
//! Inflation: with hoop stretch l, axial stretch m and energy density W(l, m),
//! `p = t W_l / (R l m)`; for neo-Hooke at m = 1 `p R/(G t) = 1 - l^-4` (Rivlin 1949).
//!
//! Correction: a smooth core of constant volume strained by e axially widens by e/2; the membrane
//! around it is then in simple tension or compression, of force `pi D t E_m e`, or `4 E_m t e/D`
//! over the core's section (Henkel & Gilbert 1952, Geotechnique 3:20), E_m = 3 G. That holds for a
//! membrane that the cell pressure keeps flat. A free one wrinkles instead when the core is shortened: it
//! then carries nothing axially, and its hoop tension adds `2 E_m t (e/2)/D` to the pressure.
//!
//! Tolerance: the hoop is a polygon of n sides. Its chords stretch as the arcs do, so strains are exact and
//! only lever arms err, by less than `(pi/n)^2`; first-order formulas err by a few e.

use riprap::element::{MembraneTriangle, pressure_facet};
use riprap::material::{Rubber, RubberLaw, Wrinkling};
use riprap::mesh::CylinderMesh;
use riprap::tensor::Vec3;

const MODULUS: f64 = 0.45e6;
const THICKNESS: f64 = 2e-3;
const RADIUS: f64 = 0.15;
const HEIGHT: f64 = 0.2;

struct Cylinder {
    mesh: CylinderMesh,
    elements: Vec<MembraneTriangle>,
}

impl Cylinder {
    fn new(size: f64) -> Self {
        let mesh = CylinderMesh::new(RADIUS, 0.0, HEIGHT, size).expect("a mesh");
        let elements = mesh
            .facets
            .iter()
            .map(|f| MembraneTriangle::new(&f.map(|n| mesh.nodes[n]), THICKNESS).expect("a triangle"))
            .collect();
        Cylinder { mesh, elements }
    }

    /// Positions with hoop and axial stretch.
    fn stretched(&self, hoop: f64, axial: f64) -> Vec<Vec3> {
        self.mesh.nodes.iter().map(|x| Vec3::new(hoop * x.x, hoop * x.y, axial * x.z)).collect()
    }

    fn forces(&self, x: &[Vec3], rubber: &Rubber, wrinkling: Wrinkling) -> Vec<Vec3> {
        let mut forces = vec![Vec3::zeros(); x.len()];
        for (facet, element) in self.mesh.facets.iter().zip(&self.elements) {
            let at = element.forces(&facet.map(|n| x[n]), rubber, wrinkling);
            for (node, force) in facet.iter().zip(at.forces) {
                forces[*node] += force;
            }
        }
        forces
    }

    /// Pressure that balances the inward pull of the rings off the rims.
    fn balancing_pressure(&self, x: &[Vec3], rubber: &Rubber, wrinkling: Wrinkling) -> f64 {
        let forces = self.forces(x, rubber, wrinkling);
        let mut areas = vec![Vec3::zeros(); x.len()];
        for facet in &self.mesh.facets {
            for (node, gradient) in facet.iter().zip(pressure_facet::volume_gradient(&facet.map(|n| x[n]))) {
                areas[*node] += gradient;
            }
        }
        let radial = |v: &Vec3, x: &Vec3| (v.x * x.x + v.y * x.y) / x.xy().norm();
        let inner = || (0..x.len()).filter(|&n| !self.mesh.is_rim(n));
        let pull: f64 = inner().map(|n| -radial(&forces[n], &x[n])).sum();
        let area: f64 = inner().map(|n| radial(&areas[n], &x[n])).sum();
        pull / area
    }

    /// Tension in a horizontal section [N]: what the top rim pulls down.
    fn axial_force(&self, x: &[Vec3], rubber: &Rubber, wrinkling: Wrinkling) -> f64 {
        let forces = self.forces(x, rubber, wrinkling);
        let [_, top] = self.mesh.rims();
        -top.map(|n| forces[n].z).sum::<f64>()
    }
}

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
