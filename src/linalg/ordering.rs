//! Fill-reducing orderings: METIS nested dissection on a graph of nodes, expanded to unknowns.
//!
//! Source: Karypis & Kumar (1998), "A fast and high quality multilevel scheme for partitioning
//! irregular graphs", SIAM J. Sci. Comput. 20(1):359-392.

use std::sync::{Mutex, PoisonError};

use sprs::{CsStructureI, smmp};

use crate::linalg::fault::FactorError;

/// Neighbours of every node, ascending, without the node itself.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeGraph {
    /// A row a node.
    adjacency: CsStructureI<u32>,
}

impl NodeGraph {
    /// Nodes that appear together in a clique (an element, a contact) become neighbours: the pattern of `B^T B`, with `B` the incidence of
    /// cliques and nodes. `None` if a node is not below `nodes`, or the graph is too large for METIS' 32-bit counts.
    pub fn from_cliques<'a>(nodes: usize, cliques: impl IntoIterator<Item = &'a [u32]>) -> Option<Self> {
        i32::try_from(nodes).ok()?;
        let (mut starts, mut members, mut pairs) = (vec![0], Vec::new(), 0_usize);
        for clique in cliques {
            let mut clique = clique.to_vec();
            clique.sort_unstable();
            clique.dedup();
            if clique.last().is_some_and(|&last| last as usize >= nodes) {
                return None;
            }
            members.extend_from_slice(&clique);
            pairs += clique.len() * clique.len();
            starts.push(u32::try_from(members.len()).ok()?);
        }
        // No more than this can come of the product, whose counts are of 32 bits.
        u32::try_from(pairs).ok()?;
        let incidence = structure(nodes, starts, members);
        let of_nodes = incidence.transpose_view().to_csr();
        let (mut starts, mut neighbours) = (vec![0; nodes + 1], Vec::new());
        smmp::symbolic(
            of_nodes.view(),
            incidence.view(),
            &mut starts,
            &mut neighbours,
            &mut vec![false; nodes],
        );
        let product = structure(nodes, starts, neighbours);
        let (mut starts, mut neighbours) = (vec![0], Vec::with_capacity(product.nnz()));
        for (node, row) in product.outer_iterator().enumerate() {
            neighbours.extend(row.indices().iter().filter(|&&other| other as usize != node));
            starts.push(i32::try_from(neighbours.len()).ok()? as u32);
        }
        Some(NodeGraph { adjacency: structure(nodes, starts, neighbours) })
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.adjacency.rows()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Neighbours of `node`, ascending.
    pub fn neighbours(&self, node: usize) -> &[u32] {
        &self.adjacency.indices()[self.adjacency.indptr().outer_inds_sz(node)]
    }

    /// Each two neighbours once, the smaller node first, ascending.
    pub fn edges(&self) -> impl Iterator<Item = [u32; 2]> {
        let beyond = |node: u32| self.neighbours(node as usize).iter().filter(move |&&other| other > node);
        (0..self.len() as u32).flat_map(move |node| beyond(node).map(move |&other| [node, other]))
    }
}

/// A pattern of rows with ascending `columns` below `width`, row k in `starts[k]..starts[k + 1]`.
fn structure(width: usize, starts: Vec<u32>, columns: Vec<u32>) -> CsStructureI<u32> {
    let entries = vec![(); columns.len()];
    CsStructureI::new((starts.len() - 1, width), starts, columns, entries)
}

/// The order in which unknowns are eliminated.
#[derive(Debug, Clone, PartialEq)]
pub enum Ordering {
    /// faer's approximate minimum degree: good for a single small grain, twice the flops at specimen size.
    MinimumDegree,
    /// A given permutation, e.g. from [`Ordering::nested_dissection`].
    Given(Permutation),
}

/// Eliminated k-th is unknown `forward[k]`; `inverse[forward[k]] = k`.
#[derive(Debug, Clone, PartialEq)]
pub struct Permutation {
    forward: Vec<u32>,
    inverse: Vec<u32>,
}

impl Permutation {
    /// `None` if `forward` is not a permutation of `0..forward.len()`.
    pub fn new(forward: Vec<u32>) -> Option<Self> {
        u32::try_from(forward.len()).ok()?;
        let mut inverse = vec![u32::MAX; forward.len()];
        for (place, &unknown) in forward.iter().enumerate() {
            let slot = inverse.get_mut(unknown as usize)?;
            if *slot != u32::MAX {
                return None;
            }
            *slot = place as u32;
        }
        Some(Permutation { forward, inverse })
    }

    pub fn forward(&self) -> &[u32] {
        &self.forward
    }

    pub fn inverse(&self) -> &[u32] {
        &self.inverse
    }
}

// METIS draws from the C library's one random state. Each call seeds it afresh; the lock keeps
// another thread's call from drawing in between, which would make orderings depend on timing.
static METIS: Mutex<()> = Mutex::new(());

impl Ordering {
    /// Nested dissection of `graph`, each node carrying `unknowns` consecutive unknowns
    /// (node `n` has `n * unknowns ..`). The same graph always gives the same ordering.
    pub fn nested_dissection(graph: &NodeGraph, unknowns: usize) -> Result<Self, FactorError> {
        let nodes = dissect(graph)?;
        let forward = nodes
            .iter()
            .flat_map(|&node| (0..unknowns).map(move |k| (node as usize * unknowns + k) as u32))
            .collect();
        Permutation::new(forward).map(Ordering::Given).ok_or(FactorError::Ordering(METIS_NOT_A_PERMUTATION))
    }
}

/// Status reported where METIS says success and returns no permutation.
const METIS_NOT_A_PERMUTATION: i32 = 0;

fn dissect(graph: &NodeGraph) -> Result<Vec<u32>, FactorError> {
    // METIS is not meant for graphs without edges; any order of those is as good.
    if graph.adjacency.nnz() == 0 {
        return Ok((0..graph.len() as u32).collect());
    }
    let mut nodes = graph.len() as i32;
    let mut starts: Vec<i32> = graph.adjacency.proper_indptr().iter().map(|&k| k as i32).collect();
    let mut neighbours: Vec<i32> = graph.adjacency.indices().iter().map(|&k| k as i32).collect();
    let (mut permutation, mut inverse) = (vec![0i32; graph.len()], vec![0i32; graph.len()]);
    let mut options = [0i32; metis_sys::METIS_NOPTIONS as usize];
    let guard = METIS.lock().unwrap_or_else(PoisonError::into_inner);
    // SAFETY: the arrays have the lengths METIS_NodeND documents (nvtxs + 1, xadj[nvtxs], nvtxs,
    // nvtxs), live through the call, and METIS keeps no pointer to them.
    let status = unsafe {
        metis_sys::METIS_SetDefaultOptions(options.as_mut_ptr());
        metis_sys::METIS_NodeND(
            &mut nodes,
            starts.as_mut_ptr(),
            neighbours.as_mut_ptr(),
            std::ptr::null_mut(),
            options.as_mut_ptr(),
            permutation.as_mut_ptr(),
            inverse.as_mut_ptr(),
        )
    };
    drop(guard);
    if status != metis_sys::rstatus_et_METIS_OK {
        return Err(FactorError::Ordering(status));
    }
    permutation
        .into_iter()
        .map(|node| u32::try_from(node).map_err(|_| FactorError::Ordering(METIS_NOT_A_PERMUTATION)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(side: u32) -> NodeGraph {
        let mut cliques = Vec::new();
        for i in 0..side {
            for j in 0..side {
                if i + 1 < side {
                    cliques.push([i * side + j, (i + 1) * side + j]);
                }
                if j + 1 < side {
                    cliques.push([i * side + j, i * side + j + 1]);
                }
            }
        }
        NodeGraph::from_cliques((side * side) as usize, cliques.iter().map(|c| &c[..])).expect("in range")
    }

    #[test]
    fn neighbours_share_a_clique() {
        // A clique may name a node twice, and two cliques may share an edge.
        let cliques = [&[4u32, 1, 2, 1][..], &[2, 4], &[3], &[0, 2]];
        let graph = NodeGraph::from_cliques(6, cliques).expect("in range");
        let expected: [&[u32]; 6] = [&[2], &[2, 4], &[0, 1, 4], &[], &[1, 2], &[]];
        assert_eq!(graph.len(), 6);
        for (node, expected) in expected.into_iter().enumerate() {
            assert_eq!(graph.neighbours(node), expected, "{node}");
        }
        assert_eq!(graph.edges().collect::<Vec<_>>(), [[0, 2], [1, 2], [1, 4], [2, 4]]);
        assert_eq!(NodeGraph::from_cliques(6, [&[6u32, 0][..]]), None);
    }

    #[test]
    fn dissection_is_a_permutation_on_awkward_graphs() {
        let lonely = NodeGraph::from_cliques(5, std::iter::empty()).expect("no edges");
        let single = NodeGraph::from_cliques(1, std::iter::empty()).expect("one node");
        let partly = NodeGraph::from_cliques(300, [&[3u32, 4][..], &[7, 8, 9]]).expect("isolated nodes");
        let empty = NodeGraph::from_cliques(0, std::iter::empty()).expect("no nodes");
        for graph in [lonely, single, partly, empty, grid(30)] {
            let Ordering::Given(order) = Ordering::nested_dissection(&graph, 3).expect("an ordering") else {
                panic!("nested dissection gives a permutation");
            };
            assert_eq!(order.forward().len(), 3 * graph.len());
        }
    }

    #[test]
    fn dissection_does_not_depend_on_threads() {
        let reference = Ordering::nested_dissection(&grid(40), 1).expect("an ordering");
        std::thread::scope(|scope| {
            for side in [40u32, 33, 40, 25] {
                let reference = &reference;
                scope.spawn(move || {
                    for _ in 0..3 {
                        let order = Ordering::nested_dissection(&grid(side), 1).expect("an ordering");
                        assert!(side != 40 || order == *reference);
                    }
                });
            }
        });
    }
}
