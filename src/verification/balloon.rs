//! Rubber: a neo-Hookean spherical balloon under inner pressure, and its limit point.
//!
//! Source: Treloar 1943; Beatty 1987, Appl. Mech. Rev. 40:1699. With stretch l = r/R,
//! `p = 2 G t/R (1/l - 1/l^7)`, largest at `l = 7^(1/6) = 1.3831`, where `p R/(G t) = 1.2395`.
//!
//! An octant of membrane triangles with the symmetry planes held, in equilibrium at a given volume:
//! Newton on positions and pressure together. Tolerance: facets are chords, so both numbers err with the
//! square of the mesh size; the observed order must be 2 within 0.3, and the extrapolated values must meet the closed
//! form to a tenth of the finest error.

use nalgebra::{DMatrix, DVector};

use crate::element::{MembraneTriangle, pressure_facet};
use crate::material::{Rubber, RubberLaw, Wrinkling};
use crate::tensor::Vec3;
use crate::verification::{Absolute, Findings, timed};

/// Shear modulus [Pa], thickness and radius [m].
pub const MODULUS: f64 = 0.45e6;
const THICKNESS: f64 = 2e-3;
const RADIUS: f64 = 0.1;

/// An eighth of a sphere, its symmetry planes held.
#[derive(Debug)]
pub struct Octant {
    pub nodes: Vec<Vec3>,
    pub facets: Vec<[usize; 3]>,
    pub elements: Vec<MembraneTriangle>,
    /// Unknown of each coordinate; those in a symmetry plane are held.
    unknown: Vec<[Option<usize>; 3]>,
    count: usize,
}

/// `n` facets along each edge.
pub fn octant(n: usize) -> Octant {
    let index = |i: usize, j: usize| i * (2 * n + 3 - i) / 2 + j;
    let (mut nodes, mut unknown, mut count) = (vec![], vec![], 0);
    for i in 0..=n {
        for j in 0..=n - i {
            let grid = [n - i - j, i, j];
            nodes.push(Vec3::from(grid.map(|g| g as f64)).normalize() * RADIUS);
            unknown.push(grid.map(|g| {
                (g > 0).then(|| {
                    count += 1;
                    count - 1
                })
            }));
        }
    }
    let mut facets = vec![];
    for i in 0..n {
        for j in 0..n - i {
            facets.push([index(i, j), index(i + 1, j), index(i, j + 1)]);
            if i + j + 1 < n {
                facets.push([index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)]);
            }
        }
    }
    let elements = facets
        .iter()
        .map(|f| MembraneTriangle::new(&f.map(|k| nodes[k]), THICKNESS).expect("a triangle"))
        .collect();
    Octant { nodes, facets, elements, unknown, count }
}

impl Octant {
    /// Enclosed with the symmetry planes [m^3].
    pub fn volume(&self, x: &[Vec3]) -> f64 {
        self.facets.iter().map(|f| pressure_facet::volume(&f.map(|k| x[k]))).sum()
    }

    /// Pressure in equilibrium at `volume`; `x` starts near it and ends there. Not a number where there is none.
    pub fn pressure_at(&self, x: &mut [Vec3], volume: f64, rubber: &Rubber) -> f64 {
        let n = self.count;
        let mut pressure = 0.0;
        for _ in 0..30 {
            let mut matrix = DMatrix::zeros(n + 1, n + 1);
            let mut right = DVector::zeros(n + 1);
            for (facet, element) in self.facets.iter().zip(&self.elements) {
                let at = facet.map(|k| x[k]);
                let held = element.forces(&at, rubber, Wrinkling::Held);
                let stiffness = element.stiffness(&at, rubber, Wrinkling::Held);
                let gradient = pressure_facet::volume_gradient(&at);
                let hessian = pressure_facet::volume_hessian(&at);
                for (i, &node) in facet.iter().enumerate() {
                    for r in 0..3 {
                        let Some(row) = self.unknown[node][r] else { continue };
                        right[row] += held.forces[i][r] + pressure * gradient[i][r];
                        matrix[(row, n)] -= gradient[i][r];
                        matrix[(n, row)] -= gradient[i][r];
                        for (j, &other) in facet.iter().enumerate() {
                            for c in 0..3 {
                                let Some(column) = self.unknown[other][c] else { continue };
                                matrix[(row, column)] +=
                                    stiffness[i][j][(r, c)] - pressure * hessian[i][j][(r, c)];
                            }
                        }
                    }
                }
            }
            right[n] = self.volume(x) - volume;
            let Some(step) = matrix.lu().solve(&right) else { return f64::NAN };
            for (position, unknown) in x.iter_mut().zip(&self.unknown) {
                for k in 0..3 {
                    if let Some(u) = unknown[k] {
                        position[k] += step[u];
                    }
                }
            }
            pressure += step[n];
            if step.amax() < 1e-12 * RADIUS.max(pressure.abs()) {
                return pressure;
            }
        }
        f64::NAN
    }

    /// Largest pressure times R/(G t), and the stretch there, from the volumes.
    pub fn limit(&self, rubber: &Rubber) -> [f64; 2] {
        let start = self.volume(&self.nodes);
        let mut x = self.nodes.clone();
        let mut at =
            |l: f64| self.pressure_at(&mut x, start * l.powi(3), rubber) * RADIUS / (MODULUS * THICKNESS);
        let h = 0.02;
        let middle = 1.38;
        let [low, mid, high] = [at(middle - h), at(middle), at(middle + h)];
        // The parabola's top; its fourth-order error is 1e-6 here.
        let (slope, bend) = ((high - low) / (2.0 * h), (high - 2.0 * mid + low) / (h * h));
        [mid - 0.5 * slope * slope / bend, middle - slope / bend]
    }
}

/// Pressure times R/(G t) and stretch at the limit, in closed form.
pub fn limit_point() -> [f64; 2] {
    [2.0 * (7f64.powf(-1.0 / 6.0) - 7f64.powf(-7.0 / 6.0)), 7f64.powf(1.0 / 6.0)]
}

pub(super) fn balloon(findings: &mut Findings) {
    let Ok(rubber) = Rubber::new(MODULUS, RubberLaw::NeoHookean) else { return };
    let (limits, time) = timed(|| [6, 12].map(|n| octant(n).limit(&rubber)));
    let exact = limit_point();
    for (k, (what, floor)) in [("p R/(G t)", 2e-5), ("stretch", 1e-3)].into_iter().enumerate() {
        let [coarse, fine] = [limits[0][k], limits[1][k]];
        let extrapolated = (4.0 * fine - coarse) / 3.0;
        let tolerance = Absolute((0.1 * (fine - exact[k]).abs()).max(floor));
        let what = format!("{what} at the limit, extrapolated");
        findings.compare(what, extrapolated, exact[k], tolerance, time);
    }
}
