//! Weights that meet as many conditions with no more points than conditions.
//!
//! Given points with positive weights, each with a column of values, others of the points suffice for the same weighted sum of
//! columns, with positive weights, and no more of them than columns are independent (Caratheodory's theorem; for quadrature Tchakaloff
//! 1957). Found as a linear programme finds a corner: one point after another gives up its weight to a basis of columns, or
//! takes the place of one of them that then has none.

use nalgebra::{DMatrix, DVector};

/// Pivots below this share of the largest are rounding.
const RANK: f64 = 1e-10;

/// Weights as said, zero for points that are not needed. Points are taken up in their order, so that the same points give the same bits.
///
/// # Panics
/// If there is not one column for each weight, or they differ in length.
pub fn fewest_weights(columns: &[Vec<f64>], weights: &[f64]) -> Vec<f64> {
    assert_eq!(columns.len(), weights.len(), "a column for each weight");
    let rows = columns.first().map_or(0, Vec::len);
    let mut tableau = DMatrix::from_fn(rows, columns.len(), |r, c| columns[c][r]);
    let (basis_rows, mut basis) = reduce(&mut tableau);
    let mut left = weights.to_vec();
    for point in 0..columns.len() {
        if !basis.contains(&point) && left[point] > 0.0 {
            give_up(&mut tableau, &basis_rows, &mut basis, &mut left, point);
        }
    }
    if basis.is_empty() {
        return left;
    }
    // What many exchanges have rounded off.
    let total = |row: usize, weights: &[f64]| -> f64 {
        columns.iter().zip(weights).map(|(column, weight)| column[row] * weight).sum()
    };
    let matrix = DMatrix::from_fn(basis.len(), basis.len(), |r, c| columns[basis[c]][basis_rows[r]]);
    let lack =
        DVector::from_fn(basis.len(), |r, _| total(basis_rows[r], weights) - total(basis_rows[r], &left));
    if let Some(more) = matrix.lu().solve(&lack) {
        basis.iter().zip(more.iter()).for_each(|(&point, more)| left[point] = (left[point] + more).max(0.0));
    }
    left
}

/// Gauss-Jordan elimination with full pivoting: the rows and the columns of the basis that it finds.
fn reduce(tableau: &mut DMatrix<f64>) -> (Vec<usize>, Vec<usize>) {
    let (mut rows, mut basis): (Vec<usize>, Vec<usize>) = (vec![], vec![]);
    let largest = tableau.amax();
    while rows.len() < tableau.nrows() {
        let mut best = (0.0, 0, 0);
        for c in 0..tableau.ncols() {
            for r in (0..tableau.nrows()).filter(|r| !rows.contains(r)) {
                if tableau[(r, c)].abs() > best.0 {
                    best = (tableau[(r, c)].abs(), r, c);
                }
            }
        }
        let (size, row, column) = best;
        if size <= RANK * largest {
            break;
        }
        pivot(tableau, row, column);
        rows.push(row);
        basis.push(column);
    }
    (rows, basis)
}

fn pivot(tableau: &mut DMatrix<f64>, row: usize, column: usize) {
    let by: Vec<f64> = tableau.column(column).iter().copied().collect();
    for c in 0..tableau.ncols() {
        let here = tableau[(row, c)] / by[row];
        if here != 0.0 {
            let mut column = tableau.column_mut(c);
            for (r, by) in by.iter().enumerate() {
                column[r] -= by * here;
            }
            column[row] = here;
        }
    }
}

/// Moves the weight of `point` into the basis, or `point` in the place of a basic point that has none left then: whichever way the
/// larger pivot leads.
fn give_up(tableau: &mut DMatrix<f64>, rows: &[usize], basis: &mut [usize], left: &mut [f64], point: usize) {
    // With `point` less by t the basis gains t times its column.
    let own = left[point];
    let mut limits = [(own, None), (f64::INFINITY, None)];
    for (k, &row) in rows.iter().enumerate() {
        let gain = tableau[(row, point)];
        let (way, rate) = if gain < 0.0 { (0, -gain) } else { (1, gain) };
        if rate > RANK && left[basis[k]] / rate < limits[way].0 {
            limits[way] = (left[basis[k]] / rate, Some(k));
        }
    }
    let size = |k: Option<usize>| k.map_or(f64::INFINITY, |k: usize| tableau[(rows[k], point)].abs());
    let forward = size(limits[0].1) >= size(limits[1].1) || limits[1].1.is_none();
    let (way, (step, leaving)) = if forward { (1.0, limits[0]) } else { (-1.0, limits[1]) };
    for (k, &row) in rows.iter().enumerate() {
        let basic = &mut left[basis[k]];
        *basic = (*basic + way * step * tableau[(row, point)]).max(0.0);
    }
    left[point] = own - way * step;
    match leaving {
        None => left[point] = 0.0,
        Some(k) => {
            left[basis[k]] = 0.0;
            pivot(tableau, rows[k], point);
            basis[k] = point;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_points_integrate_as_many_did() {
        // Points of a fine grid over a square; monomials up to degree 4, one of them twice.
        let points: Vec<[f64; 2]> =
            (0..400).map(|k| [(k % 20) as f64 / 20.0 - 0.48, (k / 20) as f64 / 20.0 - 0.47]).collect();
        let values = |p: &[f64; 2]| -> Vec<f64> {
            let mut all = vec![];
            for i in 0..5 {
                for j in 0..5 - i {
                    all.push(p[0].powi(i) * p[1].powi(j));
                }
            }
            all.push(all[3]);
            all
        };
        let columns: Vec<Vec<f64>> = points.iter().map(values).collect();
        let weights: Vec<f64> = (0..400).map(|k| 1.0 + 0.5 * (k as f64).sin()).collect();
        let few = fewest_weights(&columns, &weights);
        assert!(few.iter().all(|w| *w >= 0.0));
        let used = few.iter().filter(|w| **w > 0.0).count();
        assert!(used <= 15, "{used} points for 15 monomials");
        for row in 0..columns[0].len() {
            let sum = |weights: &[f64]| -> f64 { columns.iter().zip(weights).map(|(c, w)| c[row] * w).sum() };
            assert!((sum(&few) - sum(&weights)).abs() < 1e-11 * 400.0, "row {row}");
        }
    }

    #[test]
    fn points_that_are_all_needed_keep_their_weights() {
        let columns = vec![vec![1.0, 0.0, 2.0], vec![0.0, 1.0, 0.0], vec![0.0, 0.0, 1.0]];
        let few = fewest_weights(&columns, &[0.3, 0.2, 0.9]);
        assert!(few.iter().zip([0.3, 0.2, 0.9]).all(|(a, b)| (a - b).abs() < 1e-15));
        assert!(fewest_weights(&[], &[]).is_empty());
    }
}
