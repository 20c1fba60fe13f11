//! Conjugate gradients (Hestenes & Stiefel 1952, J. Res. NBS 49(6):409-436) for a symmetric matrix of which a near one has a factor.

use crate::linalg::FactorError;
use crate::linalg::gmres::dot;

/// When to stop.
#[derive(Debug, Clone, Copy)]
pub struct Until {
    /// Error over the solution, about: both in the norm of what is solved with for the first guess.
    pub tolerance: f64,
    pub most_iterations: usize,
}

/// Solves `A x = b` from zero; `None` where that takes more iterations than allowed, or `A` or its neighbour is not positive along the way.
///
/// `product(y, x)` puts `A x` into `y`; `precondition` overwrites a vector with the neighbour's inverse times it. `A` may be singular where `b` is in its
/// range.
pub fn conjugate_gradients(
    b: &[f64],
    until: Until,
    mut product: impl FnMut(&mut [f64], &[f64]),
    mut precondition: impl FnMut(&mut [f64]) -> Result<(), FactorError>,
) -> Option<Vec<f64>> {
    let (mut x, mut left) = (vec![0.0; b.len()], b.to_vec());
    let mut better = b.to_vec();
    precondition(&mut better).ok()?;
    let mut size = dot(&left, &better);
    let enough = until.tolerance.powi(2) * size;
    let (mut along, mut by_along) = (better.clone(), vec![0.0; b.len()]);
    for _ in 0..until.most_iterations {
        if size <= enough {
            break;
        }
        product(&mut by_along, &along);
        let curvature = dot(&along, &by_along);
        if !(curvature > 0.0) {
            return None;
        }
        let step = size / curvature;
        x.iter_mut().zip(&along).for_each(|(x, along)| *x += step * along);
        left.iter_mut().zip(&by_along).for_each(|(left, by)| *left -= step * by);
        better.copy_from_slice(&left);
        precondition(&mut better).ok()?;
        let before = std::mem::replace(&mut size, dot(&left, &better));
        along.iter_mut().zip(&better).for_each(|(along, better)| *along = better + size / before * *along);
    }
    (size <= enough).then_some(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn agrees_with_a_dense_factor() {
        // A matrix, and a neighbour up to five times as stiff.
        let n = 40;
        let noise = |r: usize, c: usize| ((r * 37 + c * 101) % 17) as f64 / 17.0 - 0.5;
        let root = DMatrix::from_fn(n, n, |r, c| f64::from(u8::from(r == c)) + 0.3 * noise(r, c));
        let scaled = |least: f64| {
            let scales = DVector::from_fn(n, |k, _| least + (1.0 - least) * (k % 7) as f64 / 6.0);
            &root * DMatrix::from_diagonal(&scales) * root.transpose()
        };
        let (matrix, neighbour) = (scaled(0.2), scaled(1.0).cholesky().expect("positive"));
        let b = DVector::from_fn(n, |r, _| noise(r, 3) + 0.1);
        let exact = matrix.clone().lu().solve(&b).expect("regular");
        let solve = |most_iterations: usize| {
            let product = |y: &mut [f64], x: &[f64]| {
                y.copy_from_slice((&matrix * DVector::from_column_slice(x)).as_slice())
            };
            let precondition = |x: &mut [f64]| {
                x.copy_from_slice(neighbour.solve(&DVector::from_column_slice(x)).as_slice());
                Ok(())
            };
            conjugate_gradients(
                b.as_slice(),
                Until { tolerance: 1e-10, most_iterations },
                product,
                precondition,
            )
        };
        let x = DVector::from_vec(solve(40).expect("found"));
        assert!((&x - &exact).norm() < 1e-9 * exact.norm());
        // What takes too long is told.
        assert_eq!(solve(3), None);
    }

    #[test]
    fn no_forces_give_no_displacements() {
        let until = Until { tolerance: 1e-10, most_iterations: 5 };
        let x = conjugate_gradients(&[0.0; 4], until, |_, _| unreachable!(), |_| Ok(()));
        assert_eq!(x, Some(vec![0.0; 4]));
    }
}
