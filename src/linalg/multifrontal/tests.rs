use super::*;
use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Lu, SymbolicLu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};

/// Numbers between -1 and 1 that repeat (Knuth's linear congruential generator).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Blocks of 1 to 6 unknowns on a box of `side` x `side` x `layers` places, coupled with their neighbours.
fn boxed(side: usize, layers: usize, numbers: &mut Numbers) -> (Pattern, Vec<u32>) {
    let count = side * side * layers;
    let mut first = vec![0u32];
    for block in 0..count {
        let width = if numbers.next() > -0.8 { 6 } else { 1 + (block % 5) as u32 };
        first.push(first[block] + width);
    }
    let place = |block: usize| [block % side, block / side % side, block / (side * side)];
    let near = |a: usize, b: usize| {
        let (a, b) = (place(a), place(b));
        (0..3).map(|k| a[k].abs_diff(b[k])).sum::<usize>() <= 1
    };
    let mut pattern = Pattern { size: first[count] as usize, column_starts: vec![0], rows: vec![] };
    for column_block in 0..count {
        for _ in first[column_block]..first[column_block + 1] {
            for row_block in (0..count).filter(|&row| near(row, column_block)) {
                pattern.rows.extend((first[row_block]..first[row_block + 1]).map(|row| row as usize));
            }
            pattern.column_starts.push(pattern.rows.len());
        }
    }
    (pattern, first)
}

fn values(pattern: &Pattern, diagonal: f64, numbers: &mut Numbers) -> Vec<f64> {
    let mut values = vec![];
    for column in 0..pattern.size {
        for &row in &pattern.rows[pattern.column_starts[column]..pattern.column_starts[column + 1]] {
            values.push(numbers.next() + if row == column { diagonal } else { 0.0 });
        }
    }
    values
}

#[test]
fn agrees_with_full_pivoting_elsewhere() {
    let mut numbers = Numbers(7);
    for (side, layers) in [(1, 1), (2, 1), (3, 3), (5, 4)] {
        let (pattern, first) = boxed(side, layers, &mut numbers);
        let mut lu = MultifrontalLu::analyse(pattern.clone(), &first).expect("analysed");
        for _ in 0..2 {
            let values = values(&pattern, 12.0, &mut numbers);
            let right_side: Vec<f64> = (0..pattern.size).map(|_| numbers.next()).collect();
            lu.factorise(&values).expect("factorised");
            let mut x = right_side.clone();
            assert!(lu.solve_in_place(&values, &mut x).expect("solved") < 1e-12);
            let mut other = right_side;
            let Pattern { size, column_starts, rows } = &pattern;
            let symbolic = SymbolicSparseColMatRef::new_checked(*size, *size, column_starts, None, rows);
            let reference = SymbolicLu::try_new(symbolic).expect("analysed");
            let matrix = SparseColMatRef::new(symbolic, &values[..]);
            let factor = Lu::try_new_with_symbolic(reference, matrix).expect("factorised");
            factor.solve_in_place(faer::ColMut::from_slice_mut(&mut other).as_mut());
            let error = x.iter().zip(&other).fold(0.0f64, |m, (x, y)| m.max((x - y).abs()));
            // Both solutions leave residuals near rounding, and the condition is below 1e3.
            assert!(error < 1e-11, "{side} {layers}: {error:e}");
        }
    }
}

/// The factor of A for the matrix -A: what is left of b is 2 b, and a correction makes it 4 b.
#[test]
fn what_a_solution_leaves_is_told() {
    let mut numbers = Numbers(5);
    let (pattern, first) = boxed(2, 1, &mut numbers);
    let mut lu = MultifrontalLu::analyse(pattern.clone(), &first).expect("analysed");
    let values = values(&pattern, 12.0, &mut numbers);
    lu.factorise(&values).expect("factorised");
    let other: Vec<f64> = values.iter().map(|value| -value).collect();
    match lu.solve_in_place(&other, &mut vec![1.0; pattern.size]) {
        Err(SolveFailure::Inaccurate(left)) => assert!((left - 2.0).abs() < 1e-9, "{left}"),
        other => panic!("{other:?}"),
    }
    let nonsense = lu.solve_in_place(&values, &mut vec![f64::NAN; pattern.size]);
    assert_eq!(nonsense, Err(SolveFailure::NotFinite));
}

/// Weak diagonals: rows are exchanged within fronts, and refinement does the rest or it is said.
#[test]
fn hard_matrices_are_solved_or_refused() {
    let mut numbers = Numbers(11);
    let (pattern, first) = boxed(4, 4, &mut numbers);
    let mut lu = MultifrontalLu::analyse(pattern.clone(), &first).expect("analysed");
    let mut solved = 0;
    for _ in 0..20 {
        let values = values(&pattern, 0.0, &mut numbers);
        let right_side: Vec<f64> = (0..pattern.size).map(|_| numbers.next()).collect();
        let mut x = right_side.clone();
        if lu.factorise(&values).and_then(|()| lu.solve_in_place(&values, &mut x)).is_ok() {
            let left = lu.residual_of(&values, &x, &right_side) / norm(&right_side);
            assert!(left <= LARGEST_RESIDUAL);
            solved += 1;
        }
    }
    assert!(solved >= 15, "{solved} of 20");
}

#[test]
fn same_bits_on_any_number_of_threads() {
    let solve = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let mut numbers = Numbers(3);
            let (pattern, first) = boxed(8, 10, &mut numbers);
            let values = values(&pattern, 9.0, &mut numbers);
            let mut x: Vec<f64> = (0..pattern.size).map(|_| numbers.next()).collect();
            let mut lu = MultifrontalLu::analyse(pattern, &first).expect("analysed");
            lu.factorise(&values).expect("factorised");
            lu.solve_in_place(&values, &mut x).expect("solved");
            x
        })
    };
    let one = solve(1);
    for threads in [2, 3] {
        assert_eq!(one, solve(threads));
    }
}

/// Larger and smaller systems in the same memory, after each other and after one that cannot be factorised.
#[test]
fn memory_of_another_system_changes_no_bit() {
    let mut numbers = Numbers(13);
    let mut used = MultifrontalLu::default();
    for (side, layers) in [(5, 4), (2, 1), (8, 10), (3, 3)] {
        let (pattern, first) = boxed(side, layers, &mut numbers);
        let values = values(&pattern, 12.0, &mut numbers);
        let right_side: Vec<f64> = (0..pattern.size).map(|_| numbers.next()).collect();
        let mut fresh = MultifrontalLu::analyse(pattern.clone(), &first).expect("analysed");
        used.analyse_anew(pattern.clone(), &first).expect("analysed");
        let [fresh, used] = [&mut fresh, &mut used].map(|lu| {
            let nonsense = vec![f64::NAN; values.len()];
            assert!(lu.factorise(&nonsense).is_err());
            lu.factorise(&values).expect("factorised");
            let mut x = right_side.clone();
            lu.solve_in_place(&values, &mut x).expect("solved");
            x
        });
        assert_eq!(fresh, used, "{side} {layers}");
    }
}

#[test]
fn singular_and_broken_input_is_a_value_not_a_panic() {
    let dense = Pattern { size: 2, column_starts: vec![0, 2, 4], rows: vec![0, 1, 0, 1] };
    let mut lu = MultifrontalLu::analyse(dense.clone(), &[0, 2]).expect("analysed");
    assert!(lu.factorise(&[1.0, 1.0, 1.0, 1.0]).is_err());
    assert!(lu.factorise(&[f64::NAN, 1.0, 1.0, 1.0]).is_err());
    assert!(lu.factorise(&[1.0]).is_err());
    // Unsymmetric pattern; broken block; blocks that do not cover the matrix.
    let triangle = Pattern { size: 2, column_starts: vec![0, 2, 3], rows: vec![0, 1, 1] };
    assert!(MultifrontalLu::analyse(triangle.clone(), &[0, 2]).is_err());
    assert!(MultifrontalLu::analyse(dense.clone(), &[0, 1]).is_err());
    assert!(MultifrontalLu::analyse(dense, &[]).is_err());
    let empty = Pattern { size: 0, column_starts: vec![0], rows: vec![] };
    assert!(MultifrontalLu::analyse(empty, &[0]).is_ok_and(|mut lu| lu.factorise(&[]).is_ok()));
}
