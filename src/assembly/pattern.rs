//! The sparsity pattern of bodies that touch, in blocks, and where each block's entries lie.

use crate::assembly::dofs::Dofs;
use crate::linalg::lu::Pattern;

/// A body-by-body pattern expanded to the free components.
#[derive(Debug, Clone)]
pub struct BlockPattern {
    pub pattern: Pattern,
    /// First unknown of each free body, and their number at the end.
    pub first: Vec<u32>,
    /// Where each body's neighbours begin, itself among them, and the end.
    starts: Vec<u32>,
    /// Neighbours of each body, ascending.
    neighbours: Vec<u32>,
    /// Position of a neighbour's first row within each of the body's columns.
    offsets: Vec<u32>,
}

impl BlockPattern {
    /// `couplings` are pairs of bodies, in any order; every body is coupled to itself.
    pub fn new(dofs: &Dofs, couplings: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut lists: Vec<Vec<u32>> = (0..dofs.bodies()).map(|i| vec![i as u32]).collect();
        for (a, b) in couplings {
            if a != b && dofs.is_free(a) && dofs.is_free(b) {
                lists[a].push(b as u32);
                lists[b].push(a as u32);
            }
        }
        let (mut column_starts, mut rows) = (vec![0], Vec::new());
        let (mut starts, mut neighbours, mut offsets) = (vec![0], Vec::new(), Vec::new());
        let mut first = vec![];
        for (body, list) in lists.iter_mut().enumerate() {
            list.sort_unstable();
            list.dedup();
            let mut offset = 0;
            for &row_body in list.iter() {
                neighbours.push(row_body);
                offsets.push(offset);
                offset += dofs.of(row_body as usize).iter().flatten().count() as u32;
            }
            starts.push(neighbours.len() as u32);
            first.extend(dofs.of(body).iter().flatten().next());
            for _ in dofs.of(body).iter().flatten() {
                rows.extend(
                    list.iter().flat_map(|&b| dofs.of(b as usize).iter().flatten().map(|&i| i as usize)),
                );
                column_starts.push(rows.len());
            }
        }
        first.push(dofs.count() as u32);
        let pattern = Pattern { size: dofs.count(), column_starts, rows };
        BlockPattern { pattern, first, starts, neighbours, offsets }
    }

    /// Position of the first row of `row_body` within each of the columns of `column_body`.
    fn offset(&self, row_body: usize, column_body: usize) -> Option<usize> {
        let range = self.starts[column_body] as usize..self.starts[column_body + 1] as usize;
        let place = self.neighbours[range.clone()].binary_search(&(row_body as u32)).ok()?;
        Some(self.offsets[range.start + place] as usize)
    }

    /// Whether all these couplings have a place.
    pub fn covers(&self, dofs: &Dofs, mut couplings: impl Iterator<Item = (usize, usize)>) -> bool {
        couplings.all(|(a, b)| a == b || !dofs.is_free(a) || !dofs.is_free(b) || self.offset(a, b).is_some())
    }

    pub fn entries(&self) -> usize {
        self.pattern.rows.len()
    }

    /// Adds a 6 x 6 block (rows: force and moment on `row_body`; columns: translation and rotation
    /// of `column_body`) to `values`, scaled to the unknowns; or its first R rows or C columns, where the others are zero.
    pub fn add_block<const R: usize, const C: usize>(
        &self,
        values: &mut [f64],
        dofs: &Dofs,
        row_body: usize,
        column_body: usize,
        block: &[[f64; C]; R],
    ) {
        if !dofs.is_free(row_body) || !dofs.is_free(column_body) {
            return;
        }
        let Some(start) = self.offset(row_body, column_body) else { return };
        for (c, column) in dofs.of(column_body).iter().take(C).enumerate() {
            let Some(column) = column else { continue };
            let mut at = self.pattern.column_starts[*column as usize] + start;
            for (r, row) in dofs.of(row_body).iter().take(R).enumerate() {
                if row.is_some() {
                    values[at] += block[r][c] * dofs.entry_scale(row_body, r, column_body, c);
                    at += 1;
                }
            }
        }
    }

    /// Adds `value(body)` to every diagonal entry.
    pub fn add_diagonal(&self, values: &mut [f64], dofs: &Dofs, value: impl Fn(usize) -> f64) {
        for body in 0..self.starts.len() - 1 {
            let value = value(body);
            let Some(start) = self.offset(body, body) else { continue };
            for (position, column) in dofs.of(body).iter().flatten().enumerate() {
                values[self.pattern.column_starts[*column as usize] + start + position] += value;
            }
        }
    }
}
