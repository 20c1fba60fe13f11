//! The membrane triangle: three nodes, constant strain, large stretch, no bending.
//!
//! With `F` (3 x 2) the gradient of the positions by the flat reference triangle's own coordinates,
//! `C = F^T F`, and `W(tr C, det C)` from [`crate::material::rubber`], the energy is `A t W`, with
//! A and t the reference area and thickness. Forces and tangent are its exact derivatives
//! (Bonet & Wood 2008, "Nonlinear continuum mechanics", section 6.6, in terms of two invariants).
//! Forces are those of the triangle on its nodes [N]; tension pulls the nodes together.

use crate::material::rubber::{Rubber, SheetState, Wrinkling};
use crate::tensor::{Mat3, Vec3};

/// A triangle in its reference configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MembraneTriangle {
    /// Gradients of the shape functions [1/m] along two axes in the reference plane.
    gradients: [[f64; 2]; 3],
    /// Reference area times thickness [m^3].
    volume: f64,
}

/// Energy [J], forces [N] and state of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MembraneForces {
    pub energy: f64,
    pub forces: [Vec3; 3],
    pub state: SheetState,
}

impl MembraneTriangle {
    /// From the unstrained corners [m] and thickness [m]; `None` unless its volume is positive and finite.
    pub fn new([a, b, c]: &[Vec3; 3], thickness: f64) -> Option<Self> {
        let (u, v) = (b - a, c - a);
        let along = u.norm();
        // In axes along u and across it: u = (along, 0), v = (shift, height).
        let shift = u.dot(&v) / along;
        let height = u.cross(&v).norm() / along;
        let volume = 0.5 * along * height * thickness;
        if !(volume > 0.0 && volume.is_finite() && thickness > 0.0) {
            return None;
        }
        let second = [1.0 / along, -shift / (along * height)];
        let third = [0.0, 1.0 / height];
        let first = [-second[0] - third[0], -second[1] - third[1]];
        Some(MembraneTriangle { gradients: [first, second, third], volume })
    }

    /// Reference area times thickness [m^3]; it does not change.
    pub const fn volume(&self) -> f64 {
        self.volume
    }

    /// Trace and determinant of the in-plane right Cauchy-Green tensor at positions `x` [m].
    pub fn invariants(&self, x: &[Vec3; 3]) -> (f64, f64) {
        let [f, g] = self.deformation(x);
        (f.norm_squared() + g.norm_squared(), f.cross(&g).norm_squared())
    }

    /// Principal stretches, the larger first.
    pub fn stretches(&self, x: &[Vec3; 3]) -> [f64; 2] {
        let (a, d) = self.invariants(x);
        let larger = 0.5 * (a + (a * a - 4.0 * d).max(0.0).sqrt());
        [larger.sqrt(), (d / larger).sqrt()]
    }

    /// Columns of F.
    fn deformation(&self, x: &[Vec3; 3]) -> [Vec3; 2] {
        let [_, second, third] = &self.gradients;
        let (u, v) = (x[1] - x[0], x[2] - x[0]);
        [u * second[0] + v * third[0], u * second[1] + v * third[1]]
    }

    /// `F g` and `F adj(C) g` for each node's gradient g.
    fn arms(&self, [f, g]: &[Vec3; 2]) -> [[Vec3; 2]; 3] {
        let (ff, fg, gg) = (f.norm_squared(), f.dot(g), g.norm_squared());
        self.gradients.map(|[p, q]| [f * p + g * q, f * (gg * p - fg * q) + g * (ff * q - fg * p)])
    }

    /// Energy and forces at positions `x` [m]. The energy is infinite beyond a Gent limit.
    pub fn forces(&self, x: &[Vec3; 3], rubber: &Rubber, wrinkling: Wrinkling) -> MembraneForces {
        let (a, d) = self.invariants(x);
        let (energy, state) = rubber.sheet_energy(a, d, wrinkling);
        let arms = self.arms(&self.deformation(x));
        let forces =
            arms.map(|[plain, crossed]| (plain * energy.by_a + crossed * energy.by_d) * (-2.0 * self.volume));
        MembraneForces { energy: self.volume * energy.value, forces, state }
    }

    /// The stiffness at positions `x` [m]: block `[i][j]` is minus the derivative of the force on node
    /// i by the position of node j [N/m]. Symmetric as a whole.
    pub fn stiffness(&self, x: &[Vec3; 3], rubber: &Rubber, wrinkling: Wrinkling) -> [[Mat3; 3]; 3] {
        let (a, d) = self.invariants(x);
        let (energy, _) = rubber.sheet_energy(a, d, wrinkling);
        let deformation = self.deformation(x);
        let arms = self.arms(&deformation);
        let [f, g] = &deformation;
        let left = f * f.transpose() + g * g.transpose();
        let (ff, fg, gg) = (f.norm_squared(), f.dot(g), g.norm_squared());
        let mut blocks = [[Mat3::zeros(); 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                let (gi, gj) = (self.gradients[i], self.gradients[j]);
                let ([ei, hi], [ej, hj]) = (arms[i], arms[j]);
                let plain = gi[0] * gj[0] + gi[1] * gj[1];
                let crossed = gg * gi[0] * gj[0] - fg * (gi[0] * gj[1] + gi[1] * gj[0]) + ff * gi[1] * gj[1];
                // Second Piola-Kirchhoff stress between the two gradients.
                let initial = 2.0 * (energy.by_a * plain + energy.by_d * crossed);
                let material = (ei * ej.transpose()) * energy.by_aa
                    + (ei * hj.transpose() + hi * ej.transpose()) * energy.by_ad
                    + (hi * hj.transpose()) * energy.by_dd;
                let turning = ei * ej.transpose() * 2.0 - ej * ei.transpose() - left * plain;
                blocks[i][j] =
                    (Mat3::from_diagonal_element(initial) + material * 4.0 + turning * (2.0 * energy.by_d))
                        * self.volume;
            }
        }
        blocks
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::rubber::RubberLaw;

    const REFERENCE: [Vec3; 3] =
        [Vec3::new(0.0, 0.0, 0.0), Vec3::new(9e-3, 1e-3, -2e-3), Vec3::new(3e-3, 7e-3, 1e-3)];
    const THICKNESS: f64 = 2e-3;

    fn rubbers() -> [Rubber; 3] {
        [RubberLaw::NeoHookean, RubberLaw::MooneyRivlin { share: 0.25 }, RubberLaw::Gent { limit: 20.0 }]
            .map(|law| Rubber::new(0.45e6, law).expect("allowed"))
    }

    fn triangle() -> MembraneTriangle {
        MembraneTriangle::new(&REFERENCE, THICKNESS).expect("a triangle")
    }

    /// The reference stretched by `along` and `across` two axes in its plane, turned and shifted.
    fn strained(along: f64, across: f64) -> [Vec3; 3] {
        let u = (REFERENCE[1] + REFERENCE[2] * 0.4).normalize();
        let normal = REFERENCE[1].cross(&REFERENCE[2]).normalize();
        let v = normal.cross(&u);
        let turn = crate::tensor::Rotation::from_scaled_axis(Vec3::new(0.4, -1.1, 0.7));
        REFERENCE
            .map(|x| turn * (u * (along * u.dot(&x)) + v * (across * v.dot(&x))) + Vec3::new(0.1, -0.2, 0.3))
    }

    /// Taut, wrinkled, slack.
    const SAMPLES: [(f64, f64, SheetState); 4] = [
        (1.3, 1.1, SheetState::Taut),
        (2.2, 1.6, SheetState::Taut),
        (1.4, 0.5, SheetState::Wrinkled),
        (0.9, 0.7, SheetState::Slack),
    ];

    #[test]
    fn force_is_derivative_of_energy() {
        let element = triangle();
        for rubber in rubbers() {
            for wrinkling in [Wrinkling::Held, Wrinkling::Free { support: 0.02 }] {
                for (along, across, state) in SAMPLES {
                    let x = strained(along, across);
                    let at = element.forces(&x, &rubber, wrinkling);
                    assert_eq!(at.state, state);
                    let scale = rubber.shear_modulus() * THICKNESS * 1e-2;
                    for node in 0..3 {
                        for k in 0..3 {
                            let h = 1e-8;
                            let energy = |step: f64| {
                                let mut y = x;
                                y[node][k] += step;
                                element.forces(&y, &rubber, wrinkling).energy
                            };
                            let slope = (energy(h) - energy(-h)) / (2.0 * h);
                            // h^2 over the size squared, and rounding of the energy over h.
                            assert!(
                                (slope + at.forces[node][k]).abs()
                                    < 1e-7 * scale.max(at.forces[node].norm()) + 1e-15 * at.energy / h * 10.0,
                                "{rubber:?} {wrinkling:?} {state:?}: {slope} {}",
                                at.forces[node][k]
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn stiffness_is_derivative_of_force() {
        let element = triangle();
        for rubber in rubbers() {
            for wrinkling in [Wrinkling::Held, Wrinkling::Free { support: 0.02 }] {
                for (along, across, _) in SAMPLES {
                    let x = strained(along, across);
                    let stiffness = element.stiffness(&x, &rubber, wrinkling);
                    let scale = rubber.shear_modulus() * THICKNESS;
                    for j in 0..3 {
                        for k in 0..3 {
                            let h = 1e-8;
                            let forces = |step: f64| {
                                let mut y = x;
                                y[j][k] += step;
                                element.forces(&y, &rubber, wrinkling).forces
                            };
                            let (plus, minus) = (forces(h), forces(-h));
                            for i in 0..3 {
                                let difference = (minus[i] - plus[i]) / (2.0 * h);
                                let exact: Vec3 = stiffness[i][j].column(k).into();
                                assert!(
                                    (difference - exact).norm() < 1e-5 * scale,
                                    "{rubber:?} {wrinkling:?} {along} {across}: {difference:?} {exact:?}"
                                );
                            }
                        }
                    }
                    for i in 0..3 {
                        for j in 0..3 {
                            let skew = stiffness[i][j] - stiffness[j][i].transpose();
                            assert!(skew.norm() < 1e-12 * scale);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn rigid_motion_strains_nothing() {
        let element = triangle();
        for rubber in rubbers() {
            let at = element.forces(&strained(1.0, 1.0), &rubber, Wrinkling::Held);
            let scale = rubber.shear_modulus() * THICKNESS * 1e-2;
            assert!(at.forces.iter().all(|f| f.norm() < 1e-13 * scale), "{at:?}");
            assert!(at.energy.abs() < 1e-14 * scale * 1e-2);
        }
    }

    #[test]
    fn forces_have_no_resultant_and_no_moment() {
        let element = triangle();
        let x = strained(1.7, 0.8);
        for rubber in rubbers() {
            let at = element.forces(&x, &rubber, Wrinkling::Held);
            let force: Vec3 = at.forces.iter().sum();
            let moment: Vec3 = x.iter().zip(&at.forces).map(|(x, f)| x.cross(f)).sum();
            let scale = at.forces[0].norm();
            assert!(force.norm() < 1e-12 * scale && moment.norm() < 1e-12 * scale);
        }
    }

    /// Simple tension of an incompressible neo-Hookean sheet: nominal stress G (l - l^-2).
    #[test]
    fn wrinkled_triangle_pulls_with_the_tension_of_its_larger_stretch() {
        let corners = [Vec3::zeros(), Vec3::new(1e-2, 0.0, 0.0), Vec3::new(0.0, 1e-2, 0.0)];
        let element = MembraneTriangle::new(&corners, THICKNESS).expect("a triangle");
        let rubber = rubbers()[0];
        for stretch in [1.05, 1.5, 3.0] {
            for width in [0.5, 0.1] {
                let x = corners.map(|c| Vec3::new(stretch * c.x, width * c.y, 0.0));
                let at = element.forces(&x, &rubber, Wrinkling::Free { support: 0.0 });
                let nominal = 0.45e6 * (stretch - stretch.powi(-2));
                // Half the leg times thickness acts on the node at the end.
                let expected = Vec3::new(-nominal * 0.5e-2 * THICKNESS, 0.0, 0.0);
                assert!((at.forces[1] - expected).norm() < 1e-12 * expected.norm(), "{at:?}");
                assert!(at.forces[2].norm() < 1e-12 * expected.norm());
            }
        }
    }

    #[test]
    fn degenerate_triangles_are_refused() {
        let line = [Vec3::zeros(), Vec3::x(), Vec3::x() * 2.0];
        assert!(MembraneTriangle::new(&line, 1e-3).is_none());
        assert!(MembraneTriangle::new(&[Vec3::zeros(); 3], 1e-3).is_none());
        assert!(MembraneTriangle::new(&REFERENCE, -1.0).is_none());
        assert!(MembraneTriangle::new(&REFERENCE, f64::NAN).is_none());
    }
}
