//! What damage has made of the bodies, as the results file shows it: cells and grains.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::element::POINT_COUNT;
use crate::mesh::Mesh;
use crate::model::Model;
use crate::tensor::Vec3;

/// The cells of one grain as generated.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct CellStates {
    /// The body that each cell is part of now; `None` where it was deleted.
    pub body: Vec<Option<usize>>,
    /// Mean damage, 1 for a deleted cell.
    pub damage: Vec<f64>,
}

/// One grain as generated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GrainState {
    pub damage_mean: f64,
    pub damage_max: f64,
    pub failed_fraction: f64,
    pub parts: usize,
}

impl Default for GrainState {
    fn default() -> Self {
        GrainState { damage_mean: 0.0, damage_max: 0.0, failed_fraction: 0.0, parts: 1 }
    }
}

/// The cells of every grain that can break, by grain; empty for others.
pub fn cell_states(model: &Model) -> Vec<CellStates> {
    let mut all: Vec<CellStates> = model
        .generated
        .iter()
        .map(|grain| {
            let cells = grain.as_ref().map_or(0, |mesh| mesh.cells.len());
            CellStates { body: vec![None; cells], damage: vec![1.0; cells] }
        })
        .collect();
    for (index, body) in model.bodies.iter().enumerate() {
        let Some(grain) = body.damaged() else { continue };
        let Some(states) = all.get_mut(grain.ancestry().origin as usize) else { continue };
        for (own, cell) in grain.mesh().cell_ids().zip(grain.origin_cells()) {
            let points = &grain.states()[own.index()];
            let damage = points.iter().map(|state| {
                let [d_t, d_c] = grain.law(own).parts(state);
                if state.failed { 1.0 } else { d_t.max(d_c) }
            });
            states.body[cell.index()] = Some(index);
            states.damage[cell.index()] = damage.sum::<f64>() / points.len() as f64;
        }
    }
    all
}

/// Damage of every grain as generated.
pub fn grain_states(model: &Model) -> Vec<GrainState> {
    let of_grain = |(first, parts): (&Option<Arc<Mesh>>, Vec<usize>)| -> GrainState {
        let Some(first) = first else { return GrainState::default() };
        let (mut sum, mut largest, mut failed, mut points) = (0.0, 0.0_f64, 0, 0);
        let mut left = 0.0;
        for grain in parts.iter().filter_map(|part| model.bodies[*part].damaged()) {
            let summary = grain.summary();
            let volume = grain.mesh().volume();
            sum += summary.mean * volume;
            left += volume;
            largest = largest.max(summary.largest);
            failed += summary.failed_points;
            points += summary.points;
        }
        let (all, volume) = (POINT_COUNT * first.cells.len(), first.volume());
        let lost = (volume - left).max(0.0);
        let gone = all - points;
        GrainState {
            damage_mean: (sum + lost) / volume,
            damage_max: if gone > 0 { 1.0 } else { largest },
            failed_fraction: (failed + gone) as f64 / all as f64,
            parts: parts.len(),
        }
    };
    model.generated.iter().zip(model.parts()).map(of_grain).collect()
}

/// Damage, and whether it was deleted, of a cell, with the body that carries it: a deleted one goes with what
/// is left of its grain.
pub fn of_cell(states: &[CellStates], grain: usize, cell: usize) -> (f64, bool, usize) {
    match states.get(grain).filter(|states| cell < states.body.len()) {
        Some(states) => {
            (states.damage[cell], states.body[cell].is_none(), states.body[cell].unwrap_or(grain))
        }
        None => (0.0, false, grain),
    }
}

/// Nodes of a mesh, or, of one that can come apart, of each cell on its own: then neighbours need not stay
/// together.
pub fn shown_nodes(mesh: &crate::mesh::Mesh, apart: bool) -> (Vec<Vec3>, Vec<[usize; 10]>) {
    if apart {
        let nodes = mesh.cells.iter().flatten().map(|node| mesh.nodes[node.index()]).collect();
        let cells = (0..mesh.cells.len()).map(|cell| std::array::from_fn(|k| 10 * cell + k)).collect();
        (nodes, cells)
    } else {
        (mesh.nodes.clone(), mesh.cells.iter().map(|cell| cell.map(|node| node.index())).collect())
    }
}
