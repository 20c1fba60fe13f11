//! The sparsity pattern of bodies that touch, in blocks, and where each block's entries lie.

use crate::assembly::dofs::Dofs;
use crate::linalg::lu::Pattern;
use std::collections::BTreeSet;

/// A body-by-body pattern expanded to the free components.
#[derive(Debug, Clone)]
pub struct BlockPattern {
    pub pattern: Pattern,
    /// First unknown of each free body, and their number at the end.
    pub first: Vec<u32>,
    /// For each column body its row bodies, ascending, and the position of their first row within each of the column's
    /// entries. Looked up for every block of every assembly.
    row_starts: Vec<Vec<(u32, u32)>>,
}

impl BlockPattern {
    /// `couplings` are pairs of bodies, in any order; every body is coupled to itself.
    pub fn new(dofs: &Dofs, couplings: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut set = BTreeSet::new();
        for (a, b) in couplings {
            if a != b && dofs.is_free(a) && dofs.is_free(b) {
                set.insert((a.min(b) as u32, a.max(b) as u32));
            }
        }
        let mut neighbours: Vec<Vec<u32>> = (0..dofs.bodies()).map(|i| vec![i as u32]).collect();
        for &(a, b) in &set {
            neighbours[a as usize].push(b);
            neighbours[b as usize].push(a);
        }
        let mut column_starts = vec![0];
        let mut rows = Vec::new();
        let mut row_starts = Vec::with_capacity(neighbours.len());
        let mut first = vec![];
        for (column_body, list) in neighbours.iter_mut().enumerate() {
            list.sort_unstable();
            let mut offset = 0;
            let starts = list.iter().map(|&row_body| {
                let start = offset;
                offset += dofs.of(row_body as usize).iter().flatten().count() as u32;
                (row_body, start)
            });
            row_starts.push(starts.collect());
            first.extend(dofs.of(column_body).iter().flatten().next());
            for _ in dofs.of(column_body).iter().flatten() {
                rows.extend(
                    list.iter().flat_map(|&b| dofs.of(b as usize).iter().flatten().map(|&i| i as usize)),
                );
                column_starts.push(rows.len());
            }
        }
        first.push(dofs.count() as u32);
        BlockPattern { pattern: Pattern { size: dofs.count(), column_starts, rows }, first, row_starts }
    }

    /// Whether all these couplings have a place.
    pub fn covers(&self, dofs: &Dofs, mut couplings: impl Iterator<Item = (usize, usize)>) -> bool {
        couplings.all(|(a, b)| a == b || !dofs.is_free(a) || !dofs.is_free(b) || self.start(a, b).is_some())
    }

    fn start(&self, row_body: usize, column_body: usize) -> Option<u32> {
        let list = self.row_starts.get(column_body)?;
        list.binary_search_by_key(&(row_body as u32), |&(body, _)| body).ok().map(|at| list[at].1)
    }

    pub fn entries(&self) -> usize {
        self.pattern.rows.len()
    }

    /// Adds a 6 x 6 block (rows: force and moment on `row_body`; columns: translation and rotation
    /// of `column_body`) to `values`, scaled to the unknowns.
    pub fn add_block(
        &self,
        values: &mut [f64],
        dofs: &Dofs,
        row_body: usize,
        column_body: usize,
        block: &[[f64; 6]; 6],
    ) {
        if !dofs.is_free(row_body) || !dofs.is_free(column_body) {
            return;
        }
        let Some(start) = self.start(row_body, column_body) else { return };
        for (c, column) in dofs.of(column_body).iter().enumerate() {
            let Some(column) = column else { continue };
            let mut at = self.pattern.column_starts[*column as usize] + start as usize;
            for (r, row) in dofs.of(row_body).iter().enumerate() {
                if row.is_some() {
                    values[at] += block[r][c] * dofs.entry_scale(row_body, r, column_body, c);
                    at += 1;
                }
            }
        }
    }

    /// Adds `value(body)` to every diagonal entry.
    pub fn add_diagonal(&self, values: &mut [f64], dofs: &Dofs, value: impl Fn(usize) -> f64) {
        for body in 0..dofs.bodies() {
            let value = value(body);
            let Some(start) = self.start(body, body) else { continue };
            for (position, column) in dofs.of(body).iter().flatten().enumerate() {
                values[self.pattern.column_starts[*column as usize] + start as usize + position] += value;
            }
        }
    }
}
