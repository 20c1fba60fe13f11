//! Neo-Hookean spherical balloon under inner pressure, and its limit point.
//!
//! Source: Treloar 1943; Beatty 1987, Appl. Mech. Rev. 40:1699. With stretch l = r/R,
//! `p = 2 G t/R (1/l - 1/l^7)`, largest at `l = 7^(1/6) = 1.3831`, where `p R/(G t) = 1.2395`.
//!
//! An octant of membrane triangles with the symmetry planes held, in equilibrium at a given volume:
//! Newton on positions and pressure together. Tolerance: facets are chords, so both numbers err with the
//! square of the mesh size; the observed order must be 2 within 0.3, and the extrapolated values must meet the closed
//! form to a tenth of the finest error.

use nalgebra::{DMatrix, DVector};
use riprap::element::{MembraneTriangle, pressure_facet};
use riprap::material::{Rubber, RubberLaw, Wrinkling};
use riprap::tensor::Vec3;

const MODULUS: f64 = 0.45e6;
const THICKNESS: f64 = 2e-3;
const RADIUS: f64 = 0.1;

struct Octant {
    nodes: Vec<Vec3>,
    facets: Vec<[usize; 3]>,
    elements: Vec<MembraneTriangle>,
    /// Unknown of each coordinate; those in a symmetry plane are held.
    unknown: Vec<[Option<usize>; 3]>,
    count: usize,
}

fn octant(n: usize) -> Octant {
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
    fn volume(&self, x: &[Vec3]) -> f64 {
        self.facets.iter().map(|f| pressure_facet::volume(&f.map(|k| x[k]))).sum()
    }

    /// Pressure in equilibrium at `volume`; `x` starts near it and ends there.
    fn pressure_at(&self, x: &mut [Vec3], volume: f64, rubber: &Rubber) -> f64 {
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
            let step = matrix.lu().solve(&right).expect("regular");
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
        panic!("no equilibrium at volume {volume}");
    }

    /// Largest pressure times R/(G t), and the stretch there, from the volumes.
    fn limit(&self, rubber: &Rubber) -> [f64; 2] {
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

#[test]
fn limit_point_converges_to_the_closed_form() {
    let rubber = Rubber::new(MODULUS, RubberLaw::NeoHookean).expect("allowed");
    let exact = [2.0 * (7f64.powf(-1.0 / 6.0) - 7f64.powf(-7.0 / 6.0)), 7f64.powf(1.0 / 6.0)];
    let limits: Vec<[f64; 2]> = [3, 6, 12].map(|n| octant(n).limit(&rubber)).to_vec();
    println!("n  p R/(G t)  stretch");
    for (n, [p, l]) in [3, 6, 12].iter().zip(&limits) {
        println!("{n:2} {p:.6}   {l:.6}");
    }
    println!("   {:.6}   {:.6} exact", exact[0], exact[1]);
    let pressure_errors: Vec<f64> = limits.iter().map(|l| (l[0] - exact[0]).abs()).collect();
    let order = (pressure_errors[1] / pressure_errors[2]).log2();
    println!("observed order {order:.2}");
    assert!((order - 2.0).abs() < 0.3, "{pressure_errors:?}");
    for k in 0..2 {
        let extrapolated = (4.0 * limits[2][k] - limits[1][k]) / 3.0;
        let finest = (limits[2][k] - exact[k]).abs();
        // The parabola through three points misses the stretch at the top by up to 1e-3.
        let floor = [2e-5, 1e-3][k];
        assert!((extrapolated - exact[k]).abs() < (0.1 * finest).max(floor), "{k}: {extrapolated} {finest}");
    }
}

/// `p dV` along the way is what the membrane stores.
#[test]
fn work_of_the_pressure_is_the_energy_stored() {
    let rubber = Rubber::new(MODULUS, RubberLaw::Gent { limit: 8.0 }).expect("allowed");
    let balloon = octant(4);
    let energy = |x: &[Vec3]| -> f64 {
        balloon
            .facets
            .iter()
            .zip(&balloon.elements)
            .map(|(f, e)| e.forces(&f.map(|k| x[k]), &rubber, Wrinkling::Held).energy)
            .sum()
    };
    let start = balloon.volume(&balloon.nodes);
    let mut x = balloon.nodes.clone();
    let pressure = |x: &mut Vec<Vec3>, factor: f64| balloon.pressure_at(x, start * factor, &rubber);
    // Simpson's rule over the volume: what it misses falls with the fourth power of the interval.
    let errors = [8, 16].map(|intervals| {
        pressure(&mut x, 1.2);
        let before = energy(&x);
        let (mut work, width) = (0.0, 0.8 * start / f64::from(intervals));
        for k in 0..=intervals {
            let weight = if k == 0 || k == intervals { 1.0 } else { f64::from(2 + 2 * (k % 2)) };
            work += weight * width / 3.0 * pressure(&mut x, 1.2 + 0.8 * f64::from(k) / f64::from(intervals));
        }
        let stored = energy(&x) - before;
        (work / stored - 1.0).abs()
    });
    println!("p dV over the energy stored, less 1: {errors:?}");
    assert!(errors[0] < 1e-4 && errors[1] < errors[0] / 8.0, "{errors:?}");
}
