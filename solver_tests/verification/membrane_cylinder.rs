//! Rubber cylinders: inflated, around a core, under a follower pressure.
//!
//! - Cylinder inflated at fixed length: with hoop stretch l, axial stretch m and energy density W(l, m), `p = t W_l / (R l m)`; for
//!   neo-Hooke at m = 1 `p R/(G t) = 1 - l^-4` (Rivlin 1949).
//! - Membrane correction: a smooth core of constant volume strained by e axially widens by e/2; the membrane around it is then
//!   in simple tension or compression, of force `pi D t E_m e`, or `4 E_m t e/D` over the core's section (Henkel & Gilbert 1952,
//!   Geotechnique 3:20), E_m = 3 G. That holds for a membrane that the cell pressure keeps flat. A free one wrinkles
//!   instead when the core is shortened: it then carries nothing axially, and its hoop tension adds `2 E_m t (e/2)/D` to the pressure.
//! - Follower pressure: on a closed surface its force is `-p dV/dx` and its work `-p` times the change of V, whatever the way.
//!
//! Tolerances: the hoop is a polygon of n sides. Its chords stretch as the arcs do, so strains are exact and only lever arms err, by
//! less than `(pi/n)^2`; first-order formulas err by a few e. V is a cubic of the positions: rounding.

use riprap::element::{MembraneTriangle, pressure_facet};
use riprap::error::Result;
use riprap::material::{Rubber, RubberLaw, Wrinkling};
use riprap::mesh::CylinderMesh;
use riprap::model::PressureCover;
use riprap::model::cover::CoverNode;
use riprap::tensor::{Pose, Rotation, Vec3};

/// Shear modulus [Pa] and lengths [m] of the cylinders.
const MODULUS: f64 = 0.45e6;
const THICKNESS: f64 = 2e-3;
const RADIUS: f64 = 0.15;
const HEIGHT: f64 = 0.2;
/// The polygon's sides are shorter than the arc, by `(pi/n)^2/6`: 2e-4 at 10 mm.
const POLYGON: f64 = 1e-3;

/// A cylinder of membrane triangles, its positions given.
#[derive(Debug)]
struct Cylinder {
    mesh: CylinderMesh,
    elements: Vec<MembraneTriangle>,
}

impl Cylinder {
    fn new(size: f64) -> Result<Self> {
        let mesh = CylinderMesh::new(RADIUS, 0.0, HEIGHT, size)?;
        let elements = mesh
            .facets
            .iter()
            .filter_map(|f| MembraneTriangle::new(&f.map(|n| mesh.nodes[n]), THICKNESS))
            .collect();
        Ok(Cylinder { mesh, elements })
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

    /// Pressure that balances the inward pull of the rings off the rims [Pa].
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

/// `t W_l / (R l m)`, W(l, m) by its own definition and differentiated by hand [Pa].
fn inflation(law: RubberLaw, l: f64, m: f64) -> f64 {
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
    THICKNESS * slope / (RADIUS * l * m)
}

/// Stress that the membrane adds to the axial stress of a core strained by `strain` [Pa], to first order, and the pressure that a
/// free membrane adds at the side.
fn correction(strain: f64) -> [f64; 2] {
    let young = 3.0 * MODULUS;
    [2.0 * young * THICKNESS * strain / RADIUS, 0.5 * young * THICKNESS * strain / RADIUS]
}

/// What a strain may miss of the first-order formulas.
fn first_order(strain: f64) -> f64 {
    3.0 * strain.abs() + POLYGON
}

/// Work of `pressure` on the free nodes of a closed cylinder as they go straight from one place to another, by Gauss's rule
/// (exact: the force is quadratic), and `-p (V1 - V0)` [J].
fn follower_work(pressure: f64) -> Result<[f64; 2]> {
    let mesh = CylinderMesh::new(RADIUS, 0.0, HEIGHT, 0.03)?;
    let nodes: Vec<CoverNode> =
        (0..mesh.nodes.len()).map(|body| CoverNode { body, point: Vec3::zeros() }).collect();
    let cover = PressureCover::on_cylinder(&nodes, &mesh)?;
    // Wider, sheared and crumpled.
    let goal = |at: usize, x: &Vec3| {
        let jolt = |k: usize| ((at * 7919 + k * 104_729) % 1009) as f64 / 1009.0 - 0.5;
        Vec3::new(1.2 * x.x + 0.3 * x.z, 1.1 * x.y, 0.9 * x.z) + Vec3::new(jolt(1), jolt(2), jolt(3)) * 0.01
    };
    let way: Vec<[Vec3; 2]> = mesh.nodes.iter().enumerate().map(|(at, x)| [*x, goal(at, x) - x]).collect();
    let at = |share: f64| -> Vec<Pose> {
        way.iter().map(|[x, d]| Pose::new(x + d * share, Rotation::identity())).collect()
    };
    let mut work = 0.0;
    for side in [-1.0, 1.0] {
        let mut forces = vec![Vec3::zeros(); way.len()];
        cover.node_forces_into(&mut forces, &at(0.5 * (1.0 + side / f64::sqrt(3.0))), pressure);
        work += 0.5 * way.iter().zip(&forces).map(|([_, d], f)| d.dot(f)).sum::<f64>();
    }
    Ok([work, -pressure * (cover.volume(&at(1.0)) - cover.volume(&at(0.0)))])
}

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
