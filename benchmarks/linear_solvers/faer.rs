//! faer's sparse LU on one thread, its columns ordered by COLAMD or by an order of the caller's.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::PermRef;
use faer::sparse::linalg::lu::{
    LuRef, LuSymbolicParams, NumericLu, SymbolicLu, factorize_symbolic_lu, supernodal,
};
use faer::sparse::linalg::qr;
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};

/// As faer does it by itself: COLAMD, and supernodes where they pay.
pub struct ByColamd {
    symbolic: SymbolicLu<usize>,
    numeric: NumericLu<usize, f64>,
}

impl ByColamd {
    pub fn analyse(pattern: SymbolicSparseColMatRef<'_, usize>) -> Self {
        let symbolic = factorize_symbolic_lu(pattern, LuSymbolicParams::default()).expect("analysed");
        ByColamd { symbolic, numeric: NumericLu::new() }
    }

    pub fn factorise(&mut self, matrix: SparseColMatRef<'_, usize, f64>) {
        let needed = self.symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default());
        let mut buffer = MemBuffer::new(needed);
        let stack = MemStack::new(&mut buffer);
        self.symbolic
            .factorize_numeric_lu(&mut self.numeric, matrix, Par::Seq, stack, Default::default())
            .expect("factorised");
    }

    pub fn solve(&self, x: &mut [f64]) {
        let mut buffer = MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        let rows = x.len();
        LuRef::new_unchecked(&self.symbolic, &self.numeric).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, rows, 1),
            Par::Seq,
            MemStack::new(&mut buffer),
        );
    }
}

/// An order of columns, its inverse, and faer's supernodal LU in it. faer's own entry takes no order, so this is put together from its parts.
pub struct Ordered {
    columns: [Vec<usize>; 2],
    rows: [Vec<usize>; 2],
    symbolic: supernodal::SymbolicSupernodalLu<usize>,
    numeric: supernodal::SupernodalLu<usize, f64>,
}

impl Ordered {
    /// Eliminated k-th is column `order[k]`, but for a postordering of the column elimination tree.
    pub fn analyse(pattern: SymbolicSparseColMatRef<'_, usize>, order: &[usize]) -> Self {
        let size = pattern.ncols();
        let mut buffer = MemBuffer::new(scratch(size));
        let stack = MemStack::new(&mut buffer);
        let (mut tree, mut post) = (vec![0; size], vec![0; size]);
        let first = [order.to_vec(), inverse(order)];
        qr::postorder(&mut post, qr::col_etree(pattern, Some(permutation(&first)), &mut tree, stack), stack);
        let forward: Vec<usize> = post.iter().map(|&k| order[k]).collect();
        let backward = inverse(&forward);
        let columns = [forward, backward];

        let transposed = pattern.transpose().to_col_major().expect("transposed");
        let tree = qr::col_etree(pattern, Some(permutation(&columns)), &mut tree, stack);
        qr::postorder(&mut post, tree, stack);
        let (mut counts, mut first_column) = (vec![0; size], vec![0; size]);
        let by = Some(permutation(&columns));
        qr::column_counts_ata(&mut counts, &mut first_column, transposed.as_ref(), by, tree, &post, stack);
        let params = Default::default();
        let symbolic = supernodal::factorize_supernodal_symbolic_lu(
            pattern,
            by,
            &first_column,
            tree,
            &counts,
            stack,
            params,
        )
        .expect("analysed");
        let rows = [vec![0; size], vec![0; size]];
        Ordered { columns, rows, symbolic, numeric: supernodal::SupernodalLu::new() }
    }

    pub fn factorise(&mut self, matrix: SparseColMatRef<'_, usize, f64>) {
        let transposed = matrix.transpose().to_col_major().expect("transposed");
        let needed = supernodal::factorize_supernodal_numeric_lu_scratch::<usize, f64>(
            &self.symbolic,
            Default::default(),
        );
        let [forward, backward] = &mut self.rows;
        supernodal::factorize_supernodal_numeric_lu(
            forward,
            backward,
            &mut self.numeric,
            matrix,
            transposed.as_ref(),
            permutation(&self.columns),
            &self.symbolic,
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(needed)),
            Default::default(),
        )
        .expect("factorised");
    }

    pub fn solve(&self, x: &mut [f64]) {
        let rows = x.len();
        let mut buffer = MemBuffer::new(supernodal::solve_in_place_scratch::<usize, f64>(rows, 1, Par::Seq));
        self.numeric.solve_in_place_with_conj(
            permutation(&self.rows),
            permutation(&self.columns),
            Conj::No,
            MatMut::from_column_major_slice_mut(x, rows, 1),
            Par::Seq,
            MemStack::new(&mut buffer),
        );
    }
}

fn permutation(both: &[Vec<usize>; 2]) -> PermRef<'_, usize> {
    PermRef::new_checked(&both[0], &both[1], both[0].len())
}

fn inverse(order: &[usize]) -> Vec<usize> {
    let mut inverse = vec![0; order.len()];
    order.iter().enumerate().for_each(|(place, &column)| inverse[column] = place);
    inverse
}

/// Enough for each step of the analysis.
fn scratch(size: usize) -> StackReq {
    let analysis = supernodal::factorize_supernodal_symbolic_lu_scratch::<usize>(size, size);
    analysis.or(qr::column_counts_aat_scratch::<usize>(size, size)).or(qr::postorder_scratch::<usize>(size))
}
