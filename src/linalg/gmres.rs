//! GMRES (Saad & Schultz 1986, SIAM J. Sci. Stat. Comput. 7(3):856-869) for operators that are near the identity.

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Krylov {
    pub iterations: usize,
    /// 2-norm of the residual by the recurrence; where it is above what was asked, that was not reached.
    pub left: f64,
}

/// Solves `M x = b` to a residual of `target` (2-norm) in `most` products with `M` at most, from zero, without restarts. `product(x, y)` puts `M x` into `y`.
pub fn gmres(
    b: &[f64],
    x: &mut [f64],
    target: f64,
    most: usize,
    mut product: impl FnMut(&[f64], &mut [f64]),
) -> Krylov {
    x.fill(0.0);
    let mut left = norm(b);
    if !(left > target) {
        return Krylov { iterations: 0, left };
    }
    // Basis; columns of the triangle that rotations make of the Hessenberg matrix; and what they make of the right side.
    let mut basis = vec![b.iter().map(|v| v / left).collect::<Vec<f64>>()];
    let mut triangle = Vec::<Vec<f64>>::new();
    let (mut rotations, mut right) = (Vec::<(f64, f64)>::new(), vec![left]);
    while triangle.len() < most && left > target {
        let last = triangle.len();
        let mut next = vec![0.0; b.len()];
        product(&basis[last], &mut next);
        let mut column = Vec::with_capacity(last + 2);
        for v in &basis {
            let along = dot(v, &next);
            next.iter_mut().zip(v).for_each(|(w, v)| *w -= along * v);
            column.push(along);
        }
        let length = norm(&next);
        for (k, &(c, s)) in rotations.iter().enumerate() {
            let (one, two) = (column[k], column[k + 1]);
            (column[k], column[k + 1]) = (c * one + s * two, c * two - s * one);
        }
        let diagonal = column[last].hypot(length);
        if !(diagonal > 0.0 && diagonal.is_finite()) {
            break;
        }
        let (c, s) = (column[last] / diagonal, length / diagonal);
        column[last] = diagonal;
        right.push(-s * right[last]);
        right[last] *= c;
        rotations.push((c, s));
        triangle.push(column);
        left = right[last + 1].abs();
        if length <= f64::EPSILON * diagonal {
            break;
        }
        next.iter_mut().for_each(|w| *w /= length);
        basis.push(next);
    }
    let iterations = triangle.len();
    for k in (0..iterations).rev() {
        right[k] /= triangle[k][k];
        for i in 0..k {
            right[i] -= triangle[k][i] * right[k];
        }
        x.iter_mut().zip(&basis[k]).for_each(|(x, v)| *x += right[k] * v);
    }
    Krylov { iterations, left }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // In lanes: a fixed order that compilers can vectorise.
    let mut lanes = [0.0; 8];
    let (heads, tails) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = heads.remainder().iter().zip(tails.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in heads.zip(tails) {
        for (lane, (x, y)) in lanes.iter_mut().zip(x.iter().zip(y)) {
            *lane += x * y;
        }
    }
    lanes.iter().sum::<f64>() + rest
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// The identity and unsymmetric noise that is not small, against a dense LU.
    fn noisy(n: usize) -> (DMatrix<f64>, DVector<f64>) {
        let noise = |r: usize, c: usize| ((r * 37 + c * 101) % 17) as f64 / 17.0 - 0.5;
        let matrix = DMatrix::from_fn(n, n, |r, c| {
            f64::from(u8::from(r == c)) + 0.8 / (n as f64).sqrt() * noise(r, c)
        });
        (matrix, DVector::from_fn(n, |r, _| noise(r, 3) + 0.1))
    }

    #[test]
    fn agrees_with_a_dense_factor() {
        for n in [1, 2, 9, 60] {
            let (matrix, b) = noisy(n);
            let exact = matrix.clone().lu().solve(&b).expect("regular");
            let mut x = vec![1.0; n];
            let product = |v: &[f64], y: &mut [f64]| {
                y.copy_from_slice((&matrix * DVector::from_column_slice(v)).as_slice())
            };
            let end = gmres(b.as_slice(), &mut x, 1e-12, 80, product);
            let x = DVector::from_vec(x);
            assert!(end.left <= 1e-12 && end.iterations <= n, "{n}: {end:?}");
            assert!((&matrix * &x - &b).norm() < 2e-12, "the residual is what the recurrence says");
            assert!((x - exact).norm() < 1e-11);
        }
    }

    #[test]
    fn says_how_far_it_came() {
        let (matrix, b) = noisy(60);
        let mut x = vec![0.0; 60];
        let product = |v: &[f64], y: &mut [f64]| {
            y.copy_from_slice((&matrix * DVector::from_column_slice(v)).as_slice())
        };
        let end = gmres(b.as_slice(), &mut x, 1e-12, 3, product);
        let left = (&matrix * DVector::from_vec(x) - &b).norm();
        assert!(
            end.iterations == 3 && end.left > 1e-12 && (left - end.left).abs() < 1e-12,
            "{end:?}, {left:e}"
        );
    }

    #[test]
    fn singular_operators_and_nothing_to_solve_end() {
        let mut x = vec![1.0; 4];
        let end = gmres(&[1.0, 2.0, 3.0, 4.0], &mut x, 1e-12, 10, |_, y| y.fill(0.0));
        assert!(end.left > 1.0 && x == [0.0; 4], "{end:?}");
        let end = gmres(&[0.0; 4], &mut x, 1e-12, 10, |_, _| unreachable!("nothing to solve"));
        assert_eq!((end.iterations, end.left), (0, 0.0));
        let end = gmres(&[f64::NAN; 4], &mut x, 1e-12, 10, |v, y| y.copy_from_slice(v));
        assert!(!(end.left <= 1e-12));
    }
}
