//! What is left of a grain when failed cells are deleted: one smaller grain, fragments, or nothing.
//!
//! Parts hang together through whole facets. Parts that touch only along an edge or at a node come apart: such a hinge
//! carries no moment and next to no force; each part gets its own copy of the shared nodes.
//!
//! Where failed cells stay as rubble ([`DamagedGrain::keeping_rubble`]) each of them goes with one part, and the parts fill the room of the grain.
//!
//! A part keeps the body coordinates of the grain that broke (nodes, laws and damage states are where they were) and has a frame of its own: its mean
//! motion at the moment of breaking, so that the displacement left in that frame has neither linear nor angular momentum.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::element::POINT_COUNT;
use crate::error::Result;
use crate::grain::damaged::{Ancestry, Condition, DamagedGrain, Past};
use crate::grain::mass::mean_motion;
use crate::grain::surface::SurfacePoint;
use crate::material::Secant;
use crate::mesh::{CellId, NodeId};
use crate::tensor::Vec3;

/// A part of a grain, itself a grain.
#[derive(Debug, Clone)]
pub struct Fragment {
    pub grain: DamagedGrain,
    /// Its cells in the mesh of the grain that broke.
    pub cells: Vec<CellId>,
    /// The node that each of its nodes was there.
    pub nodes: Vec<NodeId>,
    /// Mean translation [m] at its centroid and rotation [rad], in the frame of the grain that broke: where the fragment's own frame goes.
    pub translation: Vec3,
    pub rotation: Vec3,
}

/// The outcome of deleting failed cells. One fragment: the grain lives on, smaller. None: nothing is left.
#[derive(Debug, Clone)]
pub struct BreakUp {
    /// Largest first, which goes on with what damage has set free in the whole.
    pub fragments: Vec<Fragment>,
    /// Cells all of whose points had failed.
    pub deleted: Vec<CellId>,
    /// [m^3]
    pub deleted_volume: f64,
    /// Cells of the parts that were given up: too small, or of a stiffness that could not be factored.
    pub lost: Vec<Vec<CellId>>,
    /// Volume of those parts [m^3].
    pub lost_volume: f64,
    /// Elastic energy [J] that went with deleted cells and lost parts.
    pub lost_energy: f64,
}

/// Flexibility of a node times Young's modulus and the size of the grain, above which the node is loose: some 10 at a sharp corner of a sound
/// grain, a million times that where only [`HELD`](crate::material::secant::HELD) is left.
const LOOSE: f64 = 1e4;

impl DamagedGrain {
    /// Gives up the cells that have a surface node which nothing holds any more but the remainders of failed points: a force on it
    /// would find no resistance, and whatever pressed there has to meet what lies behind. All points of these cells
    /// fail; returns the elastic energy that goes with them [J], which damage has set free. Works on the committed state.
    pub fn crumble(&mut self) -> f64 {
        let states = &self.committed.states;
        let touched: Vec<usize> = (0..states.len())
            .filter(|&cell| {
                let failed = states[cell].iter().filter(|state| state.failed).count();
                failed > 0 && failed < states[cell].len()
            })
            .collect();
        if touched.is_empty() {
            return 0.0;
        }
        let condensed = &self.committed.condensed;
        let points = condensed.surface().node_points();
        let firm = self.laws.iter().map(|law| law.elastic().youngs_modulus()).fold(f64::INFINITY, f64::min)
            * self.mesh().volume().cbrt();
        let loose: Vec<NodeId> = condensed
            .surface()
            .nodes()
            .iter()
            .zip(&points)
            .filter(|(node, _)| touched.iter().any(|&cell| self.mesh().cells[cell].contains(node)))
            .filter(|(_, point)| condensed.flexibility(point, point).trace() * firm > LOOSE)
            .map(|(node, _)| *node)
            .collect();
        let crumbled: Vec<CellId> = touched
            .into_iter()
            .map(|cell| CellId(cell as u32))
            .filter(|cell| self.mesh().cells[cell.index()].iter().any(|node| loose.contains(node)))
            .collect();
        let lost = self.energy_of(&crumbled);
        for cell in crumbled {
            self.committed.states[cell.index()].iter_mut().for_each(|state| state.failed = true);
            self.committed.points[cell.index()] = [const { Secant::of_share(0.0) }; POINT_COUNT];
        }
        self.reject();
        self.dissipated += lost;
        lost
    }

    /// Deletes the cells all of whose points have failed, and separates what no longer hangs together. `None` if no cell has
    /// failed. `number` is this body's number, the parent of its fragments; parts below `least_volume` [m^3] are given up.
    ///
    /// `loads` are the forces [N] of the committed state, from which the fragments' motion follows. Works on the
    /// committed state and leaves this grain as it is.
    pub fn break_up(
        &self,
        loads: &[(SurfacePoint, Vec3)],
        number: u32,
        least_volume: f64,
    ) -> Result<Option<BreakUp>> {
        let u = self.committed.condensed.nodal_displacements(loads);
        self.break_up_from(&u, number, least_volume)
    }

    /// As [`Self::break_up`], from the displacements of the nodes [m].
    pub fn break_up_from(&self, u: &[Vec3], number: u32, least_volume: f64) -> Result<Option<BreakUp>> {
        let mesh = self.mesh();
        let alive = |cell: CellId| self.states()[cell.index()].iter().any(|state| !state.failed);
        let deleted: Vec<CellId> = mesh.cell_ids().filter(|&cell| !alive(cell)).collect();
        if deleted.is_empty() {
            return Ok(None);
        }
        let volume_of = |cells: &[CellId]| cells.iter().map(|&cell| mesh.cell_volume(cell)).sum::<f64>();
        let mut parts: Vec<(f64, Vec<CellId>)> =
            mesh.connected_parts_of(alive).into_iter().map(|part| (volume_of(&part), part)).collect();
        parts.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let kept = parts.iter().filter(|(volume, _)| *volume >= least_volume).count();
        let ancestry = if kept > 1 {
            Ancestry { parent: Some(number), generation: self.ancestry().generation + 1, ..*self.ancestry() }
        } else {
            *self.ancestry()
        };
        let mut outcome = BreakUp {
            fragments: vec![],
            deleted_volume: volume_of(&deleted),
            lost_energy: self.energy_of(&deleted),
            deleted,
            lost: vec![],
            lost_volume: 0.0,
        };
        for (volume, cells) in parts {
            if volume >= least_volume {
                match self.part(&cells, ancestry) {
                    Ok((mut grain, nodes)) => {
                        if outcome.fragments.is_empty() {
                            grain.dissipated = self.dissipated;
                        }
                        let displacements: Vec<Vec3> = nodes.iter().map(|node| u[node.index()]).collect();
                        let (translation, rotation) = mean_motion(grain.mesh(), &displacements);
                        outcome.fragments.push(Fragment { grain, cells, nodes, translation, rotation });
                        continue;
                    }
                    Err(error) => tracing::debug!(body = number, volume, %error, "a part is given up"),
                }
            }
            outcome.lost_volume += volume;
            outcome.lost_energy += self.energy_of(&cells);
            outcome.lost.push(cells);
        }
        self.share_rubble(&mut outcome);
        Ok(Some(outcome))
    }

    /// Hands what has failed, and what is too small to be a part, to the parts that it hangs on to: facet by facet away from them, each cell to
    /// the one with the largest share of its neighbours' facets.
    fn share_rubble(&self, outcome: &mut BreakUp) {
        if !self.keeps_rubble() {
            return;
        }
        let failed = outcome.deleted.iter().chain(outcome.lost.iter().flatten());
        let mut loose: Vec<CellId> = failed.map(|cell| self.origin_cells[cell.index()]).collect();
        loose.extend(self.rubble());
        loose.sort_unstable();
        let mut part_of: BTreeMap<CellId, usize> = BTreeMap::new();
        for (part, fragment) in outcome.fragments.iter().enumerate() {
            part_of.extend(fragment.grain.origin_cells().iter().map(|cell| (*cell, part)));
        }
        let beside = self
            .origin
            .neighbours_among(|cell| part_of.contains_key(&cell) || loose.binary_search(&cell).is_ok());
        let mut rubble = vec![Vec::new(); outcome.fragments.len()];
        loop {
            let nearest = |cell: &CellId| {
                let mut areas = vec![0.0; rubble.len()];
                for (other, area) in &beside[cell.index()] {
                    if let Some(part) = part_of.get(other) {
                        areas[*part] += area;
                    }
                }
                let (part, area) = areas.iter().enumerate().rev().max_by(|a, b| a.1.total_cmp(b.1))?;
                (*area > 0.0).then_some((*cell, part))
            };
            let joined: Vec<(CellId, usize)> = loose.iter().filter_map(nearest).collect();
            if joined.is_empty() {
                break;
            }
            loose.retain(|cell| joined.binary_search_by_key(cell, |(joined, _)| *joined).is_err());
            for (cell, part) in joined {
                part_of.insert(cell, part);
                rubble[part].push(cell);
            }
        }
        for (fragment, mut cells) in outcome.fragments.iter_mut().zip(rubble) {
            cells.sort_unstable();
            fragment.grain.rubble = Some(Arc::new(cells));
        }
    }

    fn part(&self, cells: &[CellId], ancestry: Ancestry) -> Result<(DamagedGrain, Vec<NodeId>)> {
        let (mesh, nodes) = self.mesh().part(cells)?;
        let laws: Vec<_> = cells.iter().map(|&cell| *self.law(cell)).collect();
        let states = cells.iter().map(|cell| self.states()[cell.index()]).collect();
        let points: Vec<_> = cells.iter().map(|cell| self.points()[cell.index()].clone()).collect();
        let origin_cells = cells.iter().map(|cell| self.origin_cells()[cell.index()]).collect();
        let condensed = Arc::new(self.condensed_alike(mesh, &laws, &points)?);
        let condition = Condition { states, points, condensed, sound: false };
        let past = Past { ancestry, ..self.past(origin_cells) };
        let grain = DamagedGrain::assemble(laws, self.density, condition, past)?;
        Ok((grain, nodes))
    }

    /// Elastic energy of some of the cells [J].
    pub(super) fn energy_of(&self, cells: &[CellId]) -> f64 {
        let point = |cell: usize, point: usize| {
            let strain = &self.states()[cell][point].strain;
            self.points()[cell][point].energy_density(self.laws[cell].elastic(), strain)
        };
        let of = |cell: &CellId| {
            let k = cell.index();
            self.elements[k].point_volume() * (0..self.states()[k].len()).map(|p| point(k, p)).sum::<f64>()
        };
        cells.iter().map(of).sum()
    }
}
