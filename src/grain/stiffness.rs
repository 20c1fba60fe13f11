//! Stiffness of a meshed grain: all nodes, three unknowns each.

use crate::element::{POINT_COUNT, StraightTet10};
use crate::linalg::{NodeGraph, SymmetricMatrix, SymmetricPattern};
use crate::material::{Elastic, Secant};
use crate::mesh::Mesh;
use crate::tensor::Mat3;

/// Why there is no stiffness.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum StiffnessFault {
    #[error("cell {0} has no volume")]
    FlatCell(usize),
    #[error("has too many nodes for the solver")]
    TooLarge,
    #[error("has {cells} cells, {laws} elastic laws and {states} damage states")]
    Lengths { cells: usize, laws: usize, states: usize },
}

/// Nodes that share a cell.
pub fn node_graph(mesh: &Mesh) -> Result<NodeGraph, StiffnessFault> {
    let cliques: Vec<[u32; 10]> = mesh.cells.iter().map(|cell| cell.map(|node| node.0)).collect();
    NodeGraph::from_cliques(mesh.nodes.len(), cliques.iter().map(|c| &c[..])).ok_or(StiffnessFault::TooLarge)
}

/// Three unknowns a node, those that share a cell coupled.
pub fn stiffness_pattern(mesh: &Mesh) -> Result<SymmetricPattern, StiffnessFault> {
    SymmetricPattern::from_graph(&node_graph(mesh)?, 3).ok_or(StiffnessFault::TooLarge)
}

/// Of every integration point of so many cells of sound rock.
pub fn sound(cells: usize) -> Vec<[Secant; POINT_COUNT]> {
    vec![[Secant::SOUND; POINT_COUNT]; cells]
}

/// Stiffness [N/m] with one elastic law a cell, each integration point with its own. Unknown `3 n + a` is the displacement of node n along axis a.
pub fn stiffness_matrix(
    mesh: &Mesh,
    rock: &[Elastic],
    points: &[[Secant; POINT_COUNT]],
) -> Result<SymmetricMatrix, StiffnessFault> {
    stiffness_on(stiffness_pattern(mesh)?, mesh, rock, points)
}

/// As [`stiffness_matrix`], on the mesh's [`stiffness_pattern`].
pub fn stiffness_on(
    pattern: SymmetricPattern,
    mesh: &Mesh,
    rock: &[Elastic],
    points: &[[Secant; POINT_COUNT]],
) -> Result<SymmetricMatrix, StiffnessFault> {
    if rock.len() != mesh.cells.len() || points.len() != mesh.cells.len() {
        return Err(StiffnessFault::Lengths {
            cells: mesh.cells.len(),
            laws: rock.len(),
            states: points.len(),
        });
    }
    let mut stiffness = SymmetricMatrix::zeros(pattern);
    for cell in mesh.cell_ids() {
        let element =
            StraightTet10::new(&mesh.corners(cell)).ok_or(StiffnessFault::FlatCell(cell.index()))?;
        let mut k = [[Mat3::zeros(); 10]; 10];
        element.add_stiffness(&mut k, &rock[cell.index()], &points[cell.index()]);
        let nodes = &mesh.cells[cell.index()];
        for (i, row) in k.iter().enumerate() {
            for (j, block) in row.iter().enumerate() {
                let (node, other) = (nodes[i].index(), nodes[j].index());
                if node < other {
                    continue;
                }
                let stored = stiffness.add_node_block(node, other, |a, b| block[(a, b)]);
                debug_assert!(stored, "the pattern comes from the same cells");
            }
        }
    }
    Ok(stiffness)
}
