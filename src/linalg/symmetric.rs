//! Symmetric sparse matrices, lower triangle by columns (compressed, rows ascending).
//!
//! The diagonal is always stored, so that grounding or regularising an unknown never changes the
//! pattern. Indices are `u32`: half the memory traffic of `usize`, and what the factorisation takes.

use sprs::CsStructureI;

use crate::linalg::ordering::NodeGraph;

/// Which entries of the lower triangle are stored.
#[derive(Debug, Clone, PartialEq)]
pub struct SymmetricPattern {
    /// By columns.
    lower: CsStructureI<u32>,
}

impl SymmetricPattern {
    /// Column k has the ascending rows `rows[starts[k]..starts[k + 1]]`.
    fn new(starts: Vec<u32>, rows: Vec<u32>) -> Self {
        let (size, entries) = (starts.len() - 1, vec![(); rows.len()]);
        SymmetricPattern { lower: CsStructureI::new_csc((size, size), starts, rows, entries) }
    }

    /// Dense blocks of `unknowns` x `unknowns` for every node and every pair of neighbours.
    /// `None` if there are more entries than `u32` counts.
    pub fn from_graph(graph: &NodeGraph, unknowns: usize) -> Option<Self> {
        let size = graph.len().checked_mul(unknowns)?;
        u32::try_from(size).ok()?;
        let mut starts = Vec::with_capacity(size + 1);
        let mut rows = Vec::new();
        starts.push(0);
        for node in 0..graph.len() {
            for column in node * unknowns..(node + 1) * unknowns {
                rows.extend((column..(node + 1) * unknowns).map(|row| row as u32));
                for &other in graph.neighbours(node).iter().filter(|&&other| other as usize > node) {
                    let first = other as usize * unknowns;
                    rows.extend((first..first + unknowns).map(|row| row as u32));
                }
                starts.push(u32::try_from(rows.len()).ok()?);
            }
        }
        Some(SymmetricPattern::new(starts, rows))
    }

    /// Number of rows.
    pub fn size(&self) -> usize {
        self.lower.rows()
    }

    /// Number of stored entries.
    pub fn entries(&self) -> usize {
        self.lower.nnz()
    }

    /// Where each column begins in [`Self::rows`]; one more than there are columns.
    pub fn starts(&self) -> &[u32] {
        self.lower.view().into_raw_storage().0
    }

    /// Row of each stored entry, ascending in each column.
    pub fn rows(&self) -> &[u32] {
        self.lower.indices()
    }

    /// Place of entry (`i`, `j`) or (`j`, `i`) in the values; `None` if it is not stored.
    pub fn position(&self, i: usize, j: usize) -> Option<usize> {
        self.lower.nnz_index(i.max(j), i.min(j)).map(|place| place.0)
    }
}

/// A symmetric matrix on a [`SymmetricPattern`].
#[derive(Debug, Clone, PartialEq)]
pub struct SymmetricMatrix {
    pattern: SymmetricPattern,
    /// One value per stored entry, in the order of [`SymmetricPattern::rows`].
    pub values: Vec<f64>,
}

impl SymmetricMatrix {
    pub fn zeros(pattern: SymmetricPattern) -> Self {
        let values = vec![0.0; pattern.entries()];
        SymmetricMatrix { pattern, values }
    }

    pub const fn pattern(&self) -> &SymmetricPattern {
        &self.pattern
    }

    pub fn size(&self) -> usize {
        self.pattern.size()
    }

    /// Adds `block(a, b)` to entries (`3 row + a`, `3 column + b`), `row` at least `column`, of a matrix whose pattern has three unknowns a
    /// node ([`SymmetricPattern::from_graph`]); of a diagonal block the lower triangle. Returns whether the block is in the pattern.
    #[must_use = "a block outside the pattern is not added"]
    pub fn add_node_block(&mut self, row: usize, column: usize, block: impl Fn(usize, usize) -> f64) -> bool {
        let Some(first) = self.pattern.position(3 * row, 3 * column) else { return false };
        let starts = self.pattern.starts();
        let below = first - starts[3 * column] as usize;
        for b in 0..3 {
            // Each column of a node lacks one entry more above its diagonal.
            let start = starts[3 * column + b] as usize + below - if row == column { 0 } else { b };
            let top = if row == column { b } else { 0 };
            for a in top..3 {
                self.values[start + a - top] += block(a, b);
            }
        }
        true
    }

    /// Adds `value` to entry (`i`, `j`) of the symmetric matrix (both triangles at once). Returns
    /// whether the entry is in the pattern; nothing is added where it is not.
    #[must_use = "an entry outside the pattern is not added"]
    pub fn add(&mut self, i: usize, j: usize, value: f64) -> bool {
        match self.pattern.position(i, j) {
            Some(place) => {
                self.values[place] += value;
                true
            }
            None => false,
        }
    }

    /// Entry (`i`, `j`), zero where none is stored.
    pub fn get(&self, i: usize, j: usize) -> f64 {
        self.pattern.position(i, j).map_or(0.0, |place| self.values[place])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn graphs_give_dense_blocks() {
        let graph = NodeGraph::from_cliques(4, [&[0u32, 2][..], &[1, 2], &[3]]).expect("a graph");
        let pattern = SymmetricPattern::from_graph(&graph, 3).expect("small");
        // Half of the four blocks on the diagonal, and two whole ones.
        assert_eq!((pattern.size(), pattern.entries()), (12, 4 * 6 + 2 * 9));
        let joined = |i: usize, j: usize| i == j || [[0, 2], [1, 2]].contains(&[i.min(j), i.max(j)]);
        for (i, j) in (0..12).flat_map(|i| (0..12).map(move |j| (i, j))) {
            assert_eq!(pattern.position(i, j).is_some(), joined(i / 3, j / 3), "{i} {j}");
        }
    }

    #[test]
    fn blocks_of_nodes_go_where_their_entries_go() {
        let graph = NodeGraph::from_cliques(5, [&[0u32, 2, 3][..], &[1, 2], &[3, 4]]).expect("a graph");
        let pattern = SymmetricPattern::from_graph(&graph, 3).expect("small");
        let (mut whole, mut single) =
            (SymmetricMatrix::zeros(pattern.clone()), SymmetricMatrix::zeros(pattern));
        for (row, column) in [(0, 0), (2, 0), (3, 2), (2, 1), (4, 3), (4, 4), (3, 0)] {
            let value = |a: usize, b: usize| (1 + 9 * row + 45 * column + 3 * a + b) as f64;
            assert!(whole.add_node_block(row, column, value));
            for a in 0..3 {
                for b in 0..=if row == column { a } else { 2 } {
                    assert!(single.add(3 * row + a, 3 * column + b, value(a, b)));
                }
            }
        }
        assert_eq!(whole, single);
        assert!(!whole.add_node_block(1, 0, |_, _| 1.0));
    }
}
