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

use crate::element::{MembraneTriangle, pressure_facet};
use crate::ladder::{Findings, Tolerance, timed};
use crate::material::{Rubber, RubberLaw, Wrinkling};
use crate::mesh::CylinderMesh;
use crate::tensor::Vec3;

pub const MODULUS: f64 = 0.45e6;
pub const THICKNESS: f64 = 2e-3;
pub const RADIUS: f64 = 0.15;
const HEIGHT: f64 = 0.2;

/// A membrane cylinder.
#[derive(Debug)]
pub struct Cylinder {
    pub mesh: CylinderMesh,
    elements: Vec<MembraneTriangle>,
}

impl Cylinder {
    /// Of triangles of about this size [m].
    pub fn new(size: f64) -> Self {
        let mesh = CylinderMesh::new(RADIUS, 0.0, HEIGHT, size).expect("a mesh");
        let elements = mesh
            .facets
            .iter()
            .map(|f| MembraneTriangle::new(&f.map(|n| mesh.nodes[n]), THICKNESS).expect("a triangle"))
            .collect();
        Cylinder { mesh, elements }
    }

    /// Positions with hoop and axial stretch.
    pub fn stretched(&self, hoop: f64, axial: f64) -> Vec<Vec3> {
        self.mesh.nodes.iter().map(|x| Vec3::new(hoop * x.x, hoop * x.y, axial * x.z)).collect()
    }

    /// Of the sheet on each node [N].
    pub fn forces(&self, x: &[Vec3], rubber: &Rubber, wrinkling: Wrinkling) -> Vec<Vec3> {
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
    pub fn balancing_pressure(&self, x: &[Vec3], rubber: &Rubber, wrinkling: Wrinkling) -> f64 {
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
    pub fn axial_force(&self, x: &[Vec3], rubber: &Rubber, wrinkling: Wrinkling) -> f64 {
        let forces = self.forces(x, rubber, wrinkling);
        let [_, top] = self.mesh.rims();
        -top.map(|n| forces[n].z).sum::<f64>()
    }
}

pub(super) fn cylinder(findings: &mut Findings) {
    let Ok(rubber) = Rubber::new(MODULUS, RubberLaw::NeoHookean) else { return };
    let (cylinder, _) = timed(|| Cylinder::new(0.02));
    let polygon = (std::f64::consts::PI / cylinder.mesh.around as f64).powi(2);
    for hoop in [1.1, 1.5, 2.5] {
        let x = cylinder.stretched(hoop, 1.0);
        let free = Wrinkling::Free { support: 0.0 };
        let (pressure, time) = timed(|| cylinder.balancing_pressure(&x, &rubber, free));
        let scale = RADIUS / (MODULUS * THICKNESS);
        let reference = 1.0 - f64::powi(hoop, -4);
        let what = format!("p R/(G t), hoop stretch {hoop}");
        findings.compare(
            what,
            pressure * scale,
            reference,
            Tolerance::Relative(polygon),
            (0, time, String::new()),
        );
    }
    let fine = Cylinder::new(0.01);
    let area = std::f64::consts::PI * RADIUS * RADIUS;
    for strain in [1e-3, 2e-3, -2e-3] {
        let axial: f64 = 1.0 - strain;
        let x = fine.stretched(1.0 / axial.sqrt(), axial);
        let (force, time) = timed(|| fine.axial_force(&x, &rubber, Wrinkling::Held));
        let reference = 4.0 * rubber.youngs_modulus() * THICKNESS * strain / (2.0 * RADIUS);
        // The sides of the polygon are shorter than the arc.
        let tolerance = Tolerance::Relative(3.0 * f64::abs(strain) + 1e-3);
        let what = format!("membrane correction [Pa], axial strain {strain:e}");
        findings.compare(what, -force / area, reference, tolerance, (0, time, String::new()));
    }
}

/// Following pressure on a closed surface that is pulled out of shape: its force is the derivative of `-p V`, against central differences of a
/// facet's volume, whose error is that of rounding over the step, 1e-9.
pub(super) fn follower(findings: &mut Findings) {
    let cylinder = Cylinder::new(0.04);
    let mut x = cylinder.stretched(1.3, 0.9);
    for (k, point) in x.iter_mut().enumerate() {
        point.x *= 1.0 + 0.05 * (k as f64).sin();
        point.z += 0.01 * (k as f64).cos();
    }
    let volume = |x: &[Vec3]| {
        cylinder.mesh.facets.iter().map(|f| pressure_facet::volume(&f.map(|n| x[n]))).sum::<f64>()
    };
    let mut gradient = vec![Vec3::zeros(); x.len()];
    for facet in &cylinder.mesh.facets {
        for (node, part) in facet.iter().zip(pressure_facet::volume_gradient(&facet.map(|n| x[n]))) {
            gradient[*node] += part;
        }
    }
    let step = 1e-4 * RADIUS;
    let (mut off, mut largest): (f64, f64) = (0.0, 0.0);
    for node in 0..x.len() {
        for k in 0..3 {
            let here = x[node][k];
            x[node][k] = here + step;
            let above = volume(&x);
            x[node][k] = here - step;
            let below = volume(&x);
            x[node][k] = here;
            off = off.max(((above - below) / (2.0 * step) - gradient[node][k]).abs());
            largest = largest.max(gradient[node][k].abs());
        }
    }
    let cost = (0, std::time::Duration::ZERO, String::new());
    findings.compare(
        "force off dV/dx, over the largest",
        off / largest,
        0.0,
        Tolerance::Absolute(1e-9),
        cost,
    );
}
