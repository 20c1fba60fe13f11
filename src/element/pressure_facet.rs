//! The pressure facet: one triangle of a closed surface under a follower pressure.
//!
//! A facet `(a, b, c)`, counter-clockwise from outside, contributes `a . (b x c) / 6` to the enclosed volume
//! V. The pressure p of the fluid outside has the potential `p V`: forces `-p dV/dx`, tangent
//! `-p d2V/dx2`, symmetric. The sums over a closed surface do not depend on the origin, and the force
//! is then a third of `p` times area on each corner (Schweizerhof & Ramm 1984, Computers & Structures
//! 18:1099). A surface with an edge closes with a cone to the origin.

use crate::tensor::{Mat3, Vec3};

/// Signed volume of the tetrahedron from the origin to the facet [m^3].
pub fn volume([a, b, c]: &[Vec3; 3]) -> f64 {
    a.dot(&b.cross(c)) / 6.0
}

/// Its gradient by the corners [m^2].
pub fn volume_gradient([a, b, c]: &[Vec3; 3]) -> [Vec3; 3] {
    [b.cross(c) / 6.0, c.cross(a) / 6.0, a.cross(b) / 6.0]
}

/// Its second derivative [m]: block `[i][j]` by corners i and j. The diagonal blocks vanish.
pub fn volume_hessian([a, b, c]: &[Vec3; 3]) -> [[Mat3; 3]; 3] {
    let zero = Mat3::zeros();
    // d/db (b x c) = -[c]x, d/dc (b x c) = [b]x, and so on around.
    let [a, b, c] = [a, b, c].map(|x| x.cross_matrix() / 6.0);
    [[zero, -c, b], [c, zero, -a], [-b, a, zero]]
}

#[cfg(test)]
mod tests {
    use super::*;

    const FACET: [Vec3; 3] = [Vec3::new(1.0, 0.2, -0.1), Vec3::new(0.3, 1.1, 0.2), Vec3::new(-0.2, 0.4, 0.9)];

    fn moved(node: usize, k: usize, step: f64) -> [Vec3; 3] {
        let mut x = FACET;
        x[node][k] += step;
        x
    }

    #[test]
    fn gradient_and_hessian_are_derivatives_of_the_volume() {
        // The volume is linear in each coordinate: central differences are exact up to rounding.
        let (gradient, hessian) = (volume_gradient(&FACET), volume_hessian(&FACET));
        for j in 0..3 {
            for k in 0..3 {
                let (plus, minus) = (moved(j, k, 0.5), moved(j, k, -0.5));
                assert!((volume(&plus) - volume(&minus) - gradient[j][k]).abs() < 1e-15);
                let change = (volume_gradient(&plus), volume_gradient(&minus));
                for i in 0..3 {
                    let exact: Vec3 = hessian[i][j].column(k).into();
                    assert!((change.0[i] - change.1[i] - exact).norm() < 1e-15);
                }
            }
        }
    }

    #[test]
    fn hessian_is_symmetric() {
        let hessian = volume_hessian(&FACET);
        for i in 0..3 {
            for j in 0..3 {
                assert_eq!(hessian[i][j], hessian[j][i].transpose());
            }
        }
    }

    /// On a closed surface the force is a third of p times area per corner, wherever the origin is.
    #[test]
    fn closed_surface_shares_its_area_vectors() {
        let corners = [Vec3::new(3.0, 1.0, 2.0), Vec3::new(4.0, 1.2, 2.1), FACET[1], FACET[2]];
        let facets = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let (mut by_volume, mut by_area) = ([Vec3::zeros(); 4], [Vec3::zeros(); 4]);
        for facet in facets {
            let x = facet.map(|n| corners[n]);
            let area = (x[1] - x[0]).cross(&(x[2] - x[0])) * 0.5;
            for (node, gradient) in facet.iter().zip(volume_gradient(&x)) {
                by_volume[*node] += gradient;
                by_area[*node] += area / 3.0;
            }
        }
        for (v, a) in by_volume.iter().zip(&by_area) {
            assert!((v - a).norm() < 1e-14);
        }
    }
}
