//! What a pattern says before any value is known: the order of elimination, the fronts and their
//! tree, and where every entry of the matrix and of a child's remainder goes.

use crate::linalg::lu::{Pattern, SolveFailure};
use crate::linalg::ordering::{NodeGraph, Ordering};
use std::ops::Range;

/// A child joins its parent's front where the zeros it brings are at most this share of the joint
/// factor, by the number of joint pivots. Found by trial at 100 to 3783 grains.
const AMALGAMATION: [(usize, f64); 3] = [(24, 0.7), (96, 0.2), (usize::MAX, 0.08)];

/// Consecutive values of the matrix and where they go in the front's factor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    pub from: u32,
    pub to: u32,
    pub length: u32,
}

/// A dense matrix of pivots, which are eliminated in it, and a border, which is passed on.
///
/// Its factor is stored as the panel of pivot columns (pivot and border rows, column by column), then the
/// pivot rows of the border columns.
#[derive(Debug, Clone, Default)]
pub(super) struct Front {
    pub pivots: usize,
    pub border: usize,
    /// Unknowns of the pivots, then of the border: a range of [`Analysis::unknowns`].
    pub unknowns: Range<usize>,
    /// A range of [`Analysis::runs`].
    pub runs: Range<usize>,
    /// Where its border lies in the parent's front: a range of [`Analysis::places`]; ascending.
    pub places: Range<usize>,
    /// Front that its remainder is added to.
    pub parent: Option<usize>,
    pub children: Vec<usize>,
    /// First front, factor entry and pivot of the subtree whose top this front is.
    pub subtree: usize,
    pub subtree_factor: usize,
    pub subtree_pivot: usize,
    /// First entry in the factor and first pivot in the row exchanges.
    pub factor: usize,
    pub pivot: usize,
    /// Multiplications to eliminate the whole subtree.
    pub work: f64,
}

impl Front {
    pub fn size(&self) -> usize {
        self.pivots + self.border
    }

    pub fn factor_length(&self) -> usize {
        self.pivots * (self.size() + self.border)
    }
}

/// The fronts, children before parents and every subtree in one piece.
#[derive(Debug, Default)]
pub(super) struct Analysis {
    pub fronts: Vec<Front>,
    pub unknowns: Vec<u32>,
    pub runs: Vec<Run>,
    pub places: Vec<u32>,
}

/// A front while fronts are being joined, in blocks numbered in the order of elimination.
#[derive(Debug, Clone, Default)]
struct Cluster {
    pivots: Vec<u32>,
    border: Vec<u32>,
    children: Vec<usize>,
    /// Unknowns of the pivots and the border.
    sizes: [usize; 2],
    /// Entries of the factor that are not zeros of amalgamation.
    stored: usize,
    joined: bool,
}

impl Analysis {
    pub fn of(pattern: &Pattern, first: &[u32]) -> Result<Self, SolveFailure> {
        let sound = first.first() == Some(&0)
            && first.last().is_some_and(|&last| last as usize == pattern.size)
            && first.windows(2).all(|w| w[0] < w[1])
            && u32::try_from(pattern.rows.len()).is_ok();
        let empty = pattern.size == 0 && first == [0];
        if !(sound || empty) {
            return Err(SolveFailure::Singular);
        }
        let graph = block_graph(pattern, first).ok_or(SolveFailure::Singular)?;
        let ordering = Ordering::nested_dissection(&graph, 1).map_err(|_| SolveFailure::Singular)?;
        let Ordering::Given(permutation) = ordering else { return Err(SolveFailure::Singular) };
        let (order, rank) = (permutation.forward(), permutation.inverse());
        let clusters = clusters(&graph, first, order, rank);
        Analysis::lay_out(pattern, first, order, &clusters)
    }

    pub fn factor_length(&self) -> usize {
        self.fronts.last().map_or(0, |f| f.factor + f.factor_length())
    }

    pub fn largest_front(&self) -> usize {
        self.fronts.iter().map(Front::size).max().unwrap_or(0)
    }

    fn lay_out(
        pattern: &Pattern,
        first: &[u32],
        order: &[u32],
        clusters: &[Cluster],
    ) -> Result<Self, SolveFailure> {
        let listed = postorder(clusters);
        let mut front_of_cluster = vec![usize::MAX; clusters.len()];
        let mut front_of_block = vec![usize::MAX; order.len()];
        for (front, &cluster) in listed.iter().enumerate() {
            front_of_cluster[cluster] = front;
            for &rank in &clusters[cluster].pivots {
                front_of_block[order[rank as usize] as usize] = front;
            }
        }
        let mut analysis = Analysis { fronts: vec![], unknowns: vec![], runs: vec![], places: vec![] };
        let (mut factor, mut pivot) = (0, 0);
        for (index, &cluster) in listed.iter().enumerate() {
            let Cluster { pivots, border, children, sizes, .. } = &clusters[cluster];
            let start = analysis.unknowns.len();
            for &rank in pivots.iter().chain(border) {
                let block = order[rank as usize] as usize;
                analysis.unknowns.extend(first[block]..first[block + 1]);
            }
            let children: Vec<usize> = children.iter().map(|&c| front_of_cluster[c]).collect();
            let lowest = children.iter().map(|&c| analysis.fronts[c].subtree).min().unwrap_or(index);
            let beginning = analysis.fronts.get(lowest);
            let mut front = Front {
                pivots: sizes[0],
                border: sizes[1],
                unknowns: start..analysis.unknowns.len(),
                subtree: lowest,
                subtree_factor: beginning.map_or(factor, |f| f.factor),
                subtree_pivot: beginning.map_or(pivot, |f| f.pivot),
                factor,
                pivot,
                ..Front::default()
            };
            let (p, b) = (sizes[0] as f64, sizes[1] as f64);
            front.work = p * (p * p / 3.0 + p * b + b * b)
                + children.iter().map(|&c| analysis.fronts[c].work).sum::<f64>();
            factor += front.factor_length();
            pivot += front.pivots;
            for &child in &children {
                analysis.fronts[child].parent = Some(index);
            }
            front.children = children;
            analysis.fronts.push(front);
        }
        analysis.place(pattern, first, &front_of_block)?;
        Ok(analysis)
    }

    /// Where the matrix's entries and the children's remainders go.
    fn place(
        &mut self,
        pattern: &Pattern,
        first: &[u32],
        front_of_block: &[usize],
    ) -> Result<(), SolveFailure> {
        let block_of = blocks_of(first);
        // Per front: the runs of values that it takes, as (first value, row, column, length).
        let mut taken: Vec<Vec<[u32; 4]>> = vec![vec![]; self.fronts.len()];
        for column in 0..pattern.size {
            let column_front = front_of_block[block_of[column] as usize];
            let mut at = pattern.column_starts[column];
            while at < pattern.column_starts[column + 1] {
                let block = block_of[pattern.rows[at]] as usize;
                let length = (first[block + 1] - first[block]) as usize;
                let whole = at + length <= pattern.column_starts[column + 1]
                    && pattern.rows[at] == first[block] as usize
                    && pattern.rows[at + length - 1] == (first[block + 1] - 1) as usize;
                if !whole {
                    return Err(SolveFailure::Singular);
                }
                let front = column_front.min(front_of_block[block]);
                taken[front].push([at as u32, first[block], column as u32, length as u32]);
                at += length;
            }
        }
        let mut place = vec![u32::MAX; pattern.size];
        for index in 0..self.fronts.len() {
            let Front { pivots, border, .. } = self.fronts[index];
            let unknowns = self.fronts[index].unknowns.clone();
            for (k, &unknown) in self.unknowns[unknowns.clone()].iter().enumerate() {
                place[unknown as usize] = k as u32;
            }
            let start = self.runs.len();
            for &[from, row, column, length] in &taken[index] {
                let (row, column) = (place[row as usize] as usize, place[column as usize] as usize);
                if row >= pivots + border || column >= pivots + border {
                    return Err(SolveFailure::Singular); // not in the front: the pattern is unsymmetric
                }
                let to = if column < pivots {
                    column * (pivots + border) + row
                } else {
                    pivots * (pivots + border) + (column - pivots) * pivots + row
                };
                self.runs.push(Run { from, to: to as u32, length });
            }
            self.fronts[index].runs = start..self.runs.len();
            for k in 0..self.fronts[index].children.len() {
                let child = self.fronts[index].children[k];
                let Front { pivots: child_pivots, unknowns: of_child, .. } = &self.fronts[child];
                let start = self.places.len();
                for &unknown in &self.unknowns[of_child.start + child_pivots..of_child.end] {
                    if place[unknown as usize] == u32::MAX {
                        return Err(SolveFailure::Singular);
                    }
                    self.places.push(place[unknown as usize]);
                }
                self.fronts[child].places = start..self.places.len();
            }
            for &unknown in &self.unknowns[unknowns] {
                place[unknown as usize] = u32::MAX;
            }
        }
        Ok(())
    }
}

/// The block of each unknown.
fn blocks_of(first: &[u32]) -> Vec<u32> {
    first.windows(2).enumerate().flat_map(|(g, w)| (w[0]..w[1]).map(move |_| g as u32)).collect()
}

fn block_graph(pattern: &Pattern, first: &[u32]) -> Option<NodeGraph> {
    let block_of = blocks_of(first);
    let mut couplings = Vec::new();
    for block in 0..first.len().saturating_sub(1) {
        let column = first[block] as usize;
        for &row in &pattern.rows[pattern.column_starts[column]..pattern.column_starts[column + 1]] {
            let other = *block_of.get(row)?;
            if other as usize > block {
                couplings.push([block as u32, other]);
            }
        }
    }
    couplings.dedup();
    NodeGraph::from_cliques(first.len().saturating_sub(1), couplings.iter().map(|c| &c[..]))
}

/// Symbolic elimination block by block, children joined to parents where few zeros come of it.
/// The cluster of the block of rank `k` is at `k`, unless it was joined to a later one.
fn clusters(graph: &NodeGraph, first: &[u32], order: &[u32], rank: &[u32]) -> Vec<Cluster> {
    let width = |rank: u32| {
        let block = order[rank as usize] as usize;
        (first[block + 1] - first[block]) as usize
    };
    let mut clusters: Vec<Cluster> = vec![Cluster::default(); order.len()];
    for k in 0..order.len() {
        let children = std::mem::take(&mut clusters[k].children);
        let mut border: Vec<u32> =
            graph.neighbours(order[k] as usize).iter().map(|&n| rank[n as usize]).collect();
        for &child in &children {
            border.extend_from_slice(&clusters[child].border);
        }
        border.retain(|&r| r as usize > k);
        border.sort_unstable();
        border.dedup();
        let sizes = [width(k as u32), border.iter().map(|&r| width(r)).sum()];
        let mut cluster = Cluster {
            pivots: vec![k as u32],
            stored: sizes[0] * (sizes[0] + 2 * sizes[1]),
            border,
            children: vec![],
            sizes,
            joined: false,
        };
        for &child in children.iter().rev() {
            let stored = cluster.stored + clusters[child].stored;
            let pivots = cluster.sizes[0] + clusters[child].sizes[0];
            let joint = pivots * (pivots + 2 * cluster.sizes[1]);
            let zeros = joint.saturating_sub(stored) as f64 / joint as f64;
            if AMALGAMATION.iter().any(|&(most, share)| pivots <= most && zeros <= share) {
                let child =
                    std::mem::replace(&mut clusters[child], Cluster { joined: true, ..Cluster::default() });
                cluster.pivots.extend(child.pivots);
                cluster.children.extend(child.children);
                cluster.sizes[0] = pivots;
                cluster.stored = stored;
            } else {
                cluster.children.push(child);
            }
        }
        cluster.pivots.sort_unstable();
        cluster.children.sort_unstable();
        if let Some(&parent) = cluster.border.first() {
            clusters[parent as usize].children.push(k);
        }
        clusters[k] = cluster;
    }
    clusters
}

/// Clusters with children before parents and every subtree in one piece.
fn postorder(clusters: &[Cluster]) -> Vec<usize> {
    let mut listed = Vec::new();
    // Parents before children, last subtree first; then backwards.
    let mut open: Vec<usize> = Vec::new();
    let tops = (0..clusters.len()).filter(|&k| !clusters[k].joined && clusters[k].border.is_empty());
    open.extend(tops);
    while let Some(k) = open.pop() {
        listed.push(k);
        open.extend(&clusters[k].children);
    }
    listed.reverse();
    listed
}
