//! The numbers: fronts assembled, eliminated and passed on, and the solution by substitution.

use super::analysis::{Analysis, Front};
use crate::linalg::lu::SolveFailure;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor::{lu_in_place, lu_in_place_scratch};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_unit_lower_triangular_in_place};
use faer::{Accum, MatMut, MatRef, Par, Spec};

/// Subtrees with fewer multiplications than this are not worth another thread.
const PARALLEL_WORK: f64 = 2e6;

/// Remainders waiting for reuse. They are short-lived and of many sizes, so they are kept for the
/// next front rather than given back.
#[derive(Debug, Default)]
struct Buffers(Vec<Vec<f64>>);

impl Buffers {
    fn zeros(&mut self, length: usize) -> Vec<f64> {
        let mut buffer = self.0.pop().unwrap_or_default();
        buffer.clear();
        buffer.resize(length, 0.0);
        buffer
    }
}

/// Factor and row exchanges of a subtree.
struct Part<'a> {
    factor: &'a mut [f64],
    exchanges: &'a mut [u32],
}

impl<'a> Part<'a> {
    fn split_off(&mut self, factor: usize, exchanges: usize) -> Part<'a> {
        let (taken, rest) = std::mem::take(&mut self.factor).split_at_mut(factor);
        let (taken_exchanges, rest_exchanges) = std::mem::take(&mut self.exchanges).split_at_mut(exchanges);
        (self.factor, self.exchanges) = (rest, rest_exchanges);
        Part { factor: taken, exchanges: taken_exchanges }
    }
}

/// Eliminates all fronts.
pub(super) fn eliminate(
    analysis: &Analysis,
    values: &[f64],
    factor: &mut [f64],
    exchanges: &mut [u32],
) -> Result<(), SolveFailure> {
    let tops: Vec<usize> =
        (0..analysis.fronts.len()).filter(|&f| analysis.fronts[f].parent.is_none()).collect();
    let mut part = Part { factor, exchanges };
    subtrees(analysis, values, &tops, &mut part, &mut Buffers::default()).map(|_| ())
}

/// Eliminates neighbouring subtrees, in parallel where that is worth it; their remainders in order.
fn subtrees(
    analysis: &Analysis,
    values: &[f64],
    tops: &[usize],
    part: &mut Part<'_>,
    buffers: &mut Buffers,
) -> Result<Vec<Vec<f64>>, SolveFailure> {
    let work = |tops: &[usize]| tops.iter().map(|&t| analysis.fronts[t].work).sum::<f64>();
    let total = work(tops);
    // The first cut behind which less than half of the work is left.
    let cut = (1..tops.len()).find(|&k| work(&tops[..k]) >= 0.5 * total).unwrap_or(tops.len() / 2);
    let heavy = |tops: &[usize]| !tops.is_empty() && work(tops) > PARALLEL_WORK;
    if heavy(&tops[..cut]) && heavy(&tops[cut..]) {
        let (one, two) = tops.split_at(cut);
        let split = &analysis.fronts[two[0]];
        let begin = &analysis.fronts[one[0]];
        let mut first = part.split_off(
            split.subtree_factor - begin.subtree_factor,
            split.subtree_pivot - begin.subtree_pivot,
        );
        let mut own = Buffers::default();
        let (left, right) = rayon::join(
            || subtrees(analysis, values, one, &mut first, buffers),
            || subtrees(analysis, values, two, part, &mut own),
        );
        let mut all = left?;
        all.extend(right?);
        buffers.0.append(&mut own.0);
        return Ok(all);
    }
    tops.iter()
        .map(|&top| {
            let front = &analysis.fronts[top];
            let mut own = part.split_off(
                front.factor + front.factor_length() - front.subtree_factor,
                front.pivot + front.pivots - front.subtree_pivot,
            );
            subtree(analysis, values, top, &mut own, buffers)
        })
        .collect()
}

/// Eliminates the subtree under `top` and returns its remainder: border by border, column by column.
fn subtree(
    analysis: &Analysis,
    values: &[f64],
    top: usize,
    part: &mut Part<'_>,
    buffers: &mut Buffers,
) -> Result<Vec<f64>, SolveFailure> {
    let front = &analysis.fronts[top];
    let remainders = subtrees(analysis, values, &front.children, part, buffers)?;
    let Part { factor, exchanges } = part;
    factor.fill(0.0);
    for run in &analysis.runs[front.runs.clone()] {
        let (from, to, length) = (run.from as usize, run.to as usize, run.length as usize);
        factor[to..to + length].copy_from_slice(&values[from..from + length]);
    }
    let mut rest = buffers.zeros(front.border * front.border);
    for (&child, remainder) in front.children.iter().zip(&remainders) {
        add_remainder(
            front,
            factor,
            &mut rest,
            remainder,
            &analysis.places[analysis.fronts[child].places.clone()],
        );
    }
    buffers.0.extend(remainders);
    eliminate_front(front, factor, exchanges, &mut rest)?;
    Ok(rest)
}

/// Adds a child's remainder where its border lies in this front.
fn add_remainder(front: &Front, factor: &mut [f64], rest: &mut [f64], remainder: &[f64], places: &[u32]) {
    let Front { pivots, border, .. } = *front;
    let among_pivots = places.partition_point(|&p| (p as usize) < pivots);
    let (above, below) = places.split_at(among_pivots);
    let (panel, upper) = factor.split_at_mut(pivots * (pivots + border));
    for (column, from) in places.iter().map(|&p| p as usize).zip(remainder.chunks_exact(places.len())) {
        if column < pivots {
            let to = &mut panel[column * (pivots + border)..][..pivots + border];
            for (&row, value) in places.iter().zip(from) {
                to[row as usize] += value;
            }
        } else {
            let column = column - pivots;
            let to = &mut upper[column * pivots..][..pivots];
            for (&row, value) in above.iter().zip(from) {
                to[row as usize] += value;
            }
            let to = &mut rest[column * border..][..border];
            for (&row, value) in below.iter().zip(&from[among_pivots..]) {
                to[row as usize - pivots] += value;
            }
        }
    }
}

/// Factors the pivots with row exchanges among them and takes their part off the rest.
fn eliminate_front(
    front: &Front,
    factor: &mut [f64],
    exchanges: &mut [u32],
    rest: &mut [f64],
) -> Result<(), SolveFailure> {
    let Front { pivots, border, .. } = *front;
    let (panel, upper) = factor.split_at_mut(pivots * (pivots + border));
    let panel = MatMut::from_column_major_slice_mut(panel, pivots + border, pivots);
    let (mut square, mut low) = panel.split_at_row_mut(pivots);
    let mut inverse = vec![0u32; pivots];
    let mut scratch =
        MemBuffer::try_new(lu_in_place_scratch::<u32, f64>(pivots, pivots, Par::Seq, Spec::default()))
            .map_err(|_| SolveFailure::OutOfMemory)?;
    lu_in_place(
        square.as_mut(),
        exchanges,
        &mut inverse,
        Par::Seq,
        MemStack::new(&mut scratch),
        Spec::default(),
    );
    if (0..pivots).any(|k| !(square[(k, k)].abs() > 0.0 && square[(k, k)].is_finite())) {
        return Err(SolveFailure::Singular);
    }
    if border == 0 {
        return Ok(());
    }
    let mut column = vec![0.0; pivots];
    for values in upper.chunks_exact_mut(pivots) {
        column.copy_from_slice(values);
        for (value, &from) in values.iter_mut().zip(exchanges.iter()) {
            *value = column[from as usize];
        }
    }
    let mut upper = MatMut::from_column_major_slice_mut(upper, pivots, border);
    solve_unit_lower_triangular_in_place(square.as_ref(), upper.as_mut(), Par::Seq);
    // L21 U11 = F21, transposed.
    solve_lower_triangular_in_place(square.as_ref().transpose(), low.as_mut().transpose_mut(), Par::Seq);
    let rest = MatMut::from_column_major_slice_mut(rest, border, border);
    let (low, upper): (MatRef<'_, f64>, MatRef<'_, f64>) = (low.as_ref(), upper.as_ref());
    matmul(rest, Accum::Add, low, upper, -1.0, Par::Seq);
    Ok(())
}

/// Overwrites `x` with the solution by the factor alone. `work` is as long as the largest front.
pub(super) fn substitute(
    analysis: &Analysis,
    factor: &[f64],
    exchanges: &[u32],
    x: &mut [f64],
    work: &mut [f64],
) {
    for front in &analysis.fronts {
        let (panel, _) = parts(front, factor);
        let unknowns = &analysis.unknowns[front.unknowns.clone()];
        let size = front.size();
        let work = &mut work[..size];
        work[front.pivots..].fill(0.0);
        for (k, &from) in exchanges[front.pivot..front.pivot + front.pivots].iter().enumerate() {
            work[k] = x[unknowns[from as usize] as usize];
        }
        for k in 0..front.pivots {
            let value = work[k];
            let column = &panel[k * size..(k + 1) * size];
            work[k + 1..].iter_mut().zip(&column[k + 1..]).for_each(|(w, l)| *w -= l * value);
        }
        for k in 0..front.pivots {
            x[unknowns[k] as usize] = work[k];
        }
        for k in front.pivots..size {
            x[unknowns[k] as usize] += work[k];
        }
    }
    for front in analysis.fronts.iter().rev() {
        let (panel, upper) = parts(front, factor);
        let unknowns = &analysis.unknowns[front.unknowns.clone()];
        let (size, pivots) = (front.size(), front.pivots);
        let work = &mut work[..pivots];
        for k in 0..pivots {
            work[k] = x[unknowns[k] as usize];
        }
        for (column, &unknown) in upper.chunks_exact(pivots).zip(&unknowns[pivots..]) {
            let value = x[unknown as usize];
            work.iter_mut().zip(column).for_each(|(w, u)| *w -= u * value);
        }
        for k in (0..pivots).rev() {
            let column = &panel[k * size..(k + 1) * size];
            work[k] /= column[k];
            let value = work[k];
            work[..k].iter_mut().zip(column).for_each(|(w, u)| *w -= u * value);
        }
        for k in 0..pivots {
            x[unknowns[k] as usize] = work[k];
        }
    }
}

/// Panel and upper part of a front's factor.
fn parts<'a>(front: &Front, factor: &'a [f64]) -> (&'a [f64], &'a [f64]) {
    factor[front.factor..front.factor + front.factor_length()].split_at(front.pivots * front.size())
}
