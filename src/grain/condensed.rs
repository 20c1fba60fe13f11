//! An elastic meshed grain, eliminated exactly onto its surface.
//!
//! The grain floats: its displacement is measured in a frame with zero mass-weighted mean
//! displacement and rotation, `R^T M u = 0` with R the six rigid motions and M the consistent mass.
//! A load is balanced by uniform inertia (`P^T f`, `P = 1 - R (R^T M R)^-1 R^T M`), the stiffness is
//! held at six statically determinate supports whose reactions then vanish, and the solution is
//! moved into the frame: `u = P K_held^-1 P^T f`. That flexibility `C = P K_held^-1 P^T` is symmetric
//! and positive semi-definite and does not depend on the supports. With contacts of asperities a force acts on a patch (`grain::patch`).
//!
//! Source: free-free flexibility with inertia relief, e.g. Felippa & Park (2002), "The construction
//! of free-free flexibility matrices", Comput. Methods Appl. Mech. Eng. 191:2139-2168.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use nalgebra::Vector6;

use crate::element::{POINT_COUNT, StraightTet10};
use crate::error::{Error, Result};
use crate::grain::held::{DenseFlexibility, HeldGrain};
use crate::grain::mass::MassProperties;
use crate::grain::patch::{PATCH_OF_BODY, Patches};
use crate::grain::stiffness::sound;
use crate::grain::surface::{Shares, Surface, SurfacePoint};
use crate::material::{Elastic, Secant};
use crate::mesh::{CellId, Mesh};
use crate::tensor::{Mat3, Vec3};

/// Up to this many surface nodes the whole flexibility is computed at once; beyond, column by
/// column when first asked for.
const DENSE_SURFACE_NODES: usize = 600;

/// A condensed elastic grain.
#[derive(Debug)]
pub struct CondensedGrain {
    mesh: Arc<Mesh>,
    rock: Arc<Vec<Elastic>>,
    surface: Arc<Surface>,
    mass: MassProperties,
    flexibility: Flexibility,
    /// What contact forces are spread over; `None` where they act on points.
    patches: Option<OnPatches>,
    /// Displacements of the surface by unit forces that are spread like this, of the last call of [`Self::flexibilities`].
    spread: Mutex<Vec<(Shares, Arc<Vec<Mat3>>)>>,
}

/// Nodes that a force on a point goes to.
const OF_POINT: usize = 6;

/// Contact forces on patches.
#[derive(Debug, Clone)]
struct OnPatches {
    patches: Arc<Patches>,
    /// `S W S^T`, `[i (i + 1) / 2 + j]` for surface nodes number i >= j; empty where columns are solved for on demand.
    flexibility: Vec<Mat3>,
}

/// Displacement of nodes under unit forces on surface nodes [m/N].
#[derive(Debug)]
enum Flexibility {
    /// Of all nodes, by forces on those of the surface.
    Dense(DenseFlexibility),
    /// The factor, and the columns (all surface nodes) computed so far.
    OnDemand { held: Arc<HeldGrain>, columns: Vec<OnceLock<Vec<Mat3>>> },
}

impl CondensedGrain {
    /// Condenses `mesh` with one elastic law per cell and a uniform `density` [kg/m^3].
    ///
    /// Errors ([`Error::Mesh`]): a law missing, a flat cell, more than one part, an impossible
    /// density, or a stiffness that cannot be factored.
    pub fn new(mesh: Mesh, cell_elasticity: &[Elastic], density: f64) -> Result<Self> {
        let (surface, points) = (Surface::new(&mesh), sound(mesh.cells.len()));
        Self::build(mesh, surface, cell_elasticity, density, &points, DENSE_SURFACE_NODES)
    }

    /// As [`Self::new`], each integration point with a stiffness of its own, with a factor only: columns of the
    /// flexibility are solved for when asked for. For grains whose damage moves, most of whose columns nobody asks for before the next factor.
    /// Errors also where too little is left to carry load.
    pub fn with_damage_on_demand(
        mesh: Mesh,
        cell_elasticity: &[Elastic],
        density: f64,
        points: &[[Secant; POINT_COUNT]],
    ) -> Result<Self> {
        let surface = Surface::of_notched(&mesh);
        Self::build(mesh, surface, cell_elasticity, density, points, 0)
    }

    /// As [`Self::new`], with a factor only: of a body that is stressed but does not bend hardly any column of the flexibility is asked for, and they take
    /// most of the memory.
    pub fn stressed(mesh: Mesh, cell_elasticity: &[Elastic], density: f64) -> Result<Self> {
        let (surface, points) = (Surface::new(&mesh), sound(mesh.cells.len()));
        Self::build(mesh, surface, cell_elasticity, density, &points, 0)
    }

    fn build(
        mesh: Mesh,
        surface: Surface,
        cell_elasticity: &[Elastic],
        density: f64,
        points: &[[Secant; POINT_COUNT]],
        dense_nodes: usize,
    ) -> Result<Self> {
        let fail = |message: String| Error::Mesh { name: "grain".into(), message };
        let parts = mesh.connected_parts().len();
        if parts != 1 {
            return Err(fail(format!("has {parts} parts; each must be a grain of its own")));
        }
        let mass = MassProperties::of_mesh(&mesh, density).map_err(|error| fail(error.to_string()))?;
        let held = HeldGrain::new(&mesh, cell_elasticity, &mass, density, points)
            .map_err(|fault| fail(fault.to_string()))?;
        let count = surface.nodes().len();
        let flexibility = if count <= dense_nodes {
            Flexibility::Dense(held.dense(&surface).map_err(|fault| fail(fault.to_string()))?)
        } else {
            let columns = surface.nodes().iter().map(|_| OnceLock::new()).collect();
            Flexibility::OnDemand { held: Arc::new(held), columns }
        };
        let (mesh, surface) = (Arc::new(mesh), Arc::new(surface));
        let rock = Arc::new(cell_elasticity.to_vec());
        Ok(CondensedGrain { rock, mesh, surface, mass, flexibility, patches: None, spread: Mutex::default() })
    }

    /// The same whose contact forces act on patches of [`PATCH_OF_BODY`] of its size.
    pub fn on_patches(mut self) -> Self {
        let size = (6.0 * self.mesh.volume() / std::f64::consts::PI).cbrt();
        let patches = Arc::new(Patches::new(&self.mesh, &self.surface, PATCH_OF_BODY * size));
        let flexibility = match &self.flexibility {
            Flexibility::Dense(_) => self.over(&patches),
            Flexibility::OnDemand { .. } => Vec::new(),
        };
        self.patches = Some(OnPatches { patches, flexibility });
        self
    }

    /// Whether its contact forces act on patches.
    pub const fn is_on_patches(&self) -> bool {
        self.patches.is_some()
    }

    /// `S W S^T` of a flexibility that is known as a whole.
    fn over(&self, patches: &Patches) -> Vec<Mat3> {
        let count = self.surface.nodes().len();
        let mut packed = Vec::with_capacity(count * (count + 1) / 2);
        for i in 0..count {
            let own: Vec<(usize, f64)> = patches.of(i).collect();
            let row: Vec<Mat3> = (0..count)
                .map(|k| own.iter().map(|(j, share)| self.point_block(*j, k) * *share).sum())
                .collect();
            packed.extend((0..=i).map(|j| {
                let block = patches.of(j).map(|(k, share)| row[k] * share).sum::<Mat3>();
                // Symmetric up to rounding; make it exact on the diagonal.
                if i == j { (block + block.transpose()) * 0.5 } else { block }
            }));
        }
        packed
    }

    /// This grain, which solves on demand, with other stiffnesses of its points: the bits of
    /// [`Self::with_damage_on_demand`], without what does not change. `None` where it does not solve on demand.
    pub fn with_points(&self, points: &[[Secant; POINT_COUNT]]) -> Option<Result<Self>> {
        let Flexibility::OnDemand { held, columns } = &self.flexibility else { return None };
        let made = held.with_points(&self.mesh, &self.rock, points);
        Some(made.map_err(|fault| Error::Mesh { name: "grain".into(), message: fault.to_string() }).map(
            |held| CondensedGrain {
                mesh: self.mesh.clone(),
                rock: self.rock.clone(),
                surface: self.surface.clone(),
                mass: self.mass,
                flexibility: Flexibility::OnDemand {
                    held: Arc::new(held),
                    columns: columns.iter().map(|_| OnceLock::new()).collect(),
                },
                patches: self.patches.clone(),
                spread: Mutex::default(),
            },
        ))
    }

    /// Its factor, where columns are solved for on demand.
    pub(super) fn held(&self) -> Option<&Arc<HeldGrain>> {
        match &self.flexibility {
            Flexibility::Dense(_) => None,
            Flexibility::OnDemand { held, .. } => Some(held),
        }
    }

    /// Its mesh, for others to hold too.
    pub fn shared_mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// Mass, centroid and inertia; the frame's mean rotation is about this centroid.
    pub const fn mass_properties(&self) -> &MassProperties {
        &self.mass
    }

    /// Surface point closest to the body point `xi` [m]; see [`Surface::locate`].
    pub fn locate(&self, xi: &Vec3) -> SurfacePoint {
        self.surface.locate(xi)
    }

    /// About the displacement along the unit vector `n` per force along it [m/N] at a surface point:
    /// its own flexibility, or that of a patch as large as the facet on a grain of very many nodes.
    pub fn flexibility_along(&self, at: &SurfacePoint, n: &Vec3) -> f64 {
        match &self.flexibility {
            Flexibility::Dense(_) => n.dot(&(self.flexibility(at, at) * n)),
            Flexibility::OnDemand { .. } if self.surface.nodes().len() <= DENSE_SURFACE_NODES => {
                let mut field = Vec::new();
                self.surface_field_into(&mut field, &[(at.clone(), *n)]);
                at.shares.iter().map(|&(k, weight)| n.dot(&field[k as usize]) * weight).sum()
            }
            Flexibility::OnDemand { .. } => {
                let patch = (self.surface.facet_area(at.facet) / std::f64::consts::PI).sqrt();
                // A rigid punch on a half-space: Johnson (1985), "Contact Mechanics", section 3.4.
                (2.0 * patch * self.rock[0].contact_modulus()).recip()
            }
        }
    }

    /// Displacement [m] at `a`, in the frame, per force [N] at `b`. `flexibility(b, a)` is its transpose.
    ///
    /// On a grain with very many surface nodes a column is solved for when it is first needed; should
    /// that overflow, it holds NaN.
    pub fn flexibility(&self, a: &SurfacePoint, b: &SurfacePoint) -> Mat3 {
        let mut sum = Mat3::zeros();
        for &(i, p) in &a.shares {
            if p == 0.0 {
                continue;
            }
            for &(j, q) in &b.shares {
                if q != 0.0 {
                    sum += self.surface_block(i as usize, j as usize) * (p * q);
                }
            }
        }
        sum
    }

    /// [`Self::flexibility`] of the i-th of `places` by the j-th, at `[i * places + j]`.
    ///
    /// That of forces that are spread over more than a point goes by their displacements of the whole surface, which are kept for the next call.
    pub fn flexibilities(&self, places: &[&SurfacePoint]) -> Vec<Mat3> {
        self.solve_for_columns(places);
        let displaced = self.displaced_by(places);
        let felt = |place: &SurfacePoint, displaced: &[Mat3]| -> Mat3 {
            place.shares.iter().map(|(node, share)| displaced[*node as usize] * *share).sum()
        };
        let n = places.len();
        let mut all = vec![Mat3::zeros(); n * n];
        for i in 0..n {
            for j in 0..=i {
                let block = match (&displaced[i], &displaced[j]) {
                    (_, Some(by)) => felt(places[i], by),
                    (Some(by), None) => felt(places[j], by).transpose(),
                    (None, None) => self.flexibility(places[i], places[j]),
                };
                all[i * n + j] = block;
                all[j * n + i] = block.transpose();
            }
        }
        all
    }

    /// Displacements of all surface nodes by a unit force at each of `places` that is spread over more than a point.
    fn displaced_by(&self, places: &[&SurfacePoint]) -> Vec<Option<Arc<Vec<Mat3>>>> {
        let mut known = self.spread.lock().unwrap_or_else(PoisonError::into_inner);
        let spread = || places.iter().map(|place| &place.shares).filter(|shares| shares.len() > OF_POINT);
        let mut kept: Vec<(Shares, Arc<Vec<Mat3>>)> = std::mem::take(&mut *known);
        kept.retain(|(shares, _)| spread().any(|asked| asked == shares));
        let missing: Vec<&Shares> =
            spread().filter(|asked| kept.iter().all(|(shares, _)| shares != *asked)).collect();
        let found = self.displaced_by_shares(&missing);
        kept.extend(missing.into_iter().cloned().zip(found.into_iter().map(Arc::new)));
        let of = |place: &&SurfacePoint| {
            kept.iter().find(|(shares, _)| *shares == place.shares).map(|(_, displaced)| displaced.clone())
        };
        let displaced = places.iter().map(of).collect();
        *known = kept;
        displaced
    }

    fn displaced_by_shares(&self, forces: &[&Shares]) -> Vec<Vec<Mat3>> {
        if let (Flexibility::OnDemand { held, .. }, None) = (&self.flexibility, &self.patches) {
            let forces: Vec<&[(u32, f64)]> = forces.iter().map(|shares| &shares[..]).collect();
            return held.columns(&self.surface, &forces);
        }
        let by = |i: usize, shares: &Shares| {
            shares.iter().map(|(j, share)| self.surface_block(i, *j as usize) * *share).sum()
        };
        let all = 0..self.surface.nodes().len();
        forces.iter().map(|shares| all.clone().map(|i| by(i, shares)).collect()).collect()
    }

    /// Displacements [m] of all surface nodes, in the frame, under forces [N] on surface points, as contacts feel them: means over patches where
    /// these are what forces act on.
    pub fn surface_field_into(&self, out: &mut Vec<Vec3>, loads: &[(SurfacePoint, Vec3)]) {
        let count = self.surface.nodes().len();
        out.clear();
        out.resize(count, Vec3::zeros());
        let forces = self.surface_forces(loads);
        if let Flexibility::OnDemand { held, .. } = &self.flexibility {
            *out = self.felt(&held.solve(&self.on_all_nodes(&forces)));
            return;
        }
        for (j, force) in forces.iter().enumerate() {
            if *force != Vec3::zeros() {
                for (i, u) in out.iter_mut().enumerate() {
                    *u += self.surface_block(i, j) * force;
                }
            }
        }
    }

    /// What contacts feel on the surface nodes of these displacements of all nodes [m].
    pub(crate) fn felt(&self, nodal: &[Vec3]) -> Vec<Vec3> {
        let displaced: Vec<Vec3> = self.surface.nodes().iter().map(|node| nodal[node.index()]).collect();
        self.patches.as_ref().map(|on| on.patches.felt(&displaced)).unwrap_or(displaced)
    }

    /// Forces on all nodes that `loads` at surface points come to [N].
    pub fn forces_on_nodes(&self, loads: &[(SurfacePoint, Vec3)]) -> Vec<Vec3> {
        self.on_all_nodes(&self.surface_forces(loads))
    }

    /// Forces on all nodes that forces on those of the surface come to, spread over patches where there are any [N].
    fn on_all_nodes(&self, forces: &[Vec3]) -> Vec<Vec3> {
        let mut all = vec![Vec3::zeros(); self.mesh.nodes.len()];
        let spread = self.patches.as_ref().map(|on| on.patches.spread(forces));
        let forces = spread.as_deref().unwrap_or(forces);
        self.surface.nodes().iter().zip(forces).for_each(|(node, force)| all[node.index()] = *force);
        all
    }

    /// Elastic energy [J] under the loads: half the work of the forces on the displacements they cause.
    pub fn elastic_energy(&self, loads: &[(SurfacePoint, Vec3)]) -> f64 {
        let mut twice = 0.0;
        for (k, (a, force)) in loads.iter().enumerate() {
            for (b, other) in &loads[..k] {
                twice += 2.0 * force.dot(&(self.flexibility(a, b) * other));
            }
            twice += force.dot(&(self.flexibility(a, a) * force));
        }
        0.5 * twice
    }

    /// Forces on the surface nodes that `loads` at surface points come to [N].
    pub fn surface_forces(&self, loads: &[(SurfacePoint, Vec3)]) -> Vec<Vec3> {
        let mut forces = vec![Vec3::zeros(); self.surface.nodes().len()];
        for (point, force) in loads {
            for &(node, weight) in &point.shares {
                forces[node as usize] += force * weight;
            }
        }
        forces
    }

    /// Displacement [m] of every node, in the frame, under forces [N] on surface points.
    pub fn nodal_displacements(&self, loads: &[(SurfacePoint, Vec3)]) -> Vec<Vec3> {
        let nodes = self.surface.nodes();
        let forces = self.surface_forces(loads);
        match &self.flexibility {
            Flexibility::Dense(DenseFlexibility { inner, inner_nodes, .. }) => {
                let spread = self.patches.as_ref().map(|on| on.patches.spread(&forces));
                let forces = spread.unwrap_or(forces);
                let loaded: Vec<usize> = (0..nodes.len()).filter(|&k| forces[k] != Vec3::zeros()).collect();
                let mut u = vec![Vec3::zeros(); self.mesh.nodes.len()];
                for (i, node) in nodes.iter().enumerate() {
                    u[node.index()] = loaded.iter().map(|&j| self.point_block(i, j) * forces[j]).sum();
                }
                for (row, node) in inner.chunks_exact(nodes.len()).zip(inner_nodes) {
                    u[node.index()] = loaded.iter().map(|&j| row[j] * forces[j]).sum();
                }
                u
            }
            Flexibility::OnDemand { held, .. } => held.solve(&self.on_all_nodes(&forces)),
        }
    }

    /// The same where the stiffness has become another, whose forces `product` gives; `None` where no factor is kept, or it is too far off.
    pub(super) fn displacements_without_factor(
        &self,
        loads: &[(SurfacePoint, Vec3)],
        product: impl FnMut(&mut [f64], &[f64]),
    ) -> Option<Vec<Vec3>> {
        match &self.flexibility {
            Flexibility::Dense(_) => None,
            Flexibility::OnDemand { held, .. } => {
                held.solve_without_factor(&self.forces_on_nodes(loads), product)
            }
        }
    }

    /// Stresses [Pa] of the sound rock at the integration points of every cell, from nodal
    /// displacements [m].
    ///
    /// # Panics
    /// If there is not one displacement per node.
    pub fn cell_stresses(&self, u: &[Vec3]) -> Vec<[Vector6<f64>; POINT_COUNT]> {
        assert_eq!(u.len(), self.mesh.nodes.len(), "one displacement per node");
        self.mesh
            .cell_ids()
            .map(|cell| {
                let nodal = self.mesh.cells[cell.index()].map(|node| u[node.index()]);
                StraightTet10::new(&self.mesh.corners(cell)).map_or(
                    // Not reached: the constructor refused flat cells.
                    [Vector6::repeat(f64::NAN); POINT_COUNT],
                    |element| element.stresses(&self.rock[cell.index()], &nodal),
                )
            })
            .collect()
    }

    /// Elastic law of a cell.
    pub fn rock(&self, cell: CellId) -> &Elastic {
        &self.rock[cell.index()]
    }

    /// Bytes on the heap, without a factor that is kept for columns on demand.
    pub fn memory(&self) -> usize {
        let mesh = size_of_val(&self.mesh.nodes[..])
            + size_of_val(&self.mesh.cells[..])
            + size_of_val(&self.mesh.surface[..]);
        let flexibility = match &self.flexibility {
            Flexibility::Dense(DenseFlexibility { surface, inner, inner_nodes }) => {
                size_of_val(&surface[..]) + size_of_val(&inner[..]) + size_of_val(&inner_nodes[..])
            }
            Flexibility::OnDemand { columns, .. } => {
                columns.iter().filter_map(OnceLock::get).map(|column| size_of_val(&column[..])).sum()
            }
        };
        let patches =
            self.patches.as_ref().map_or(0, |on| on.patches.memory() + size_of_val(&on.flexibility[..]));
        mesh + size_of_val(&self.rock[..]) + self.surface.memory() + flexibility + patches
    }

    /// Flexibility between surface nodes number `i` and `j`, of patches where these are what forces act on.
    fn surface_block(&self, i: usize, j: usize) -> Mat3 {
        match (&self.flexibility, &self.patches) {
            (Flexibility::Dense(_), None) => self.point_block(i, j),
            (Flexibility::Dense(_), Some(on)) => lower(&on.flexibility, i, j),
            (Flexibility::OnDemand { held, columns }, _) => {
                // The column of the larger number, whoever asks, so that both give the same bits.
                let (row, column) = (i.min(j), i.max(j));
                let solved = || self.columns_of(held, &[column]).swap_remove(0);
                let block = columns[column].get_or_init(solved)[row];
                if i <= j { block } else { block.transpose() }
            }
        }
    }

    /// Solves for the columns that forces on points need and that are not known yet.
    fn solve_for_columns(&self, places: &[&SurfacePoint]) {
        let Flexibility::OnDemand { held, columns } = &self.flexibility else { return };
        let points = places.iter().map(|place| &place.shares).filter(|shares| shares.len() <= OF_POINT);
        let nodes = points.flatten().filter(|(_, share)| *share != 0.0).map(|(node, _)| *node as usize);
        let mut missing: Vec<usize> = nodes.filter(|node| columns[*node].get().is_none()).collect();
        missing.sort_unstable();
        missing.dedup();
        for (&column, solved) in missing.iter().zip(self.columns_of(held, &missing)) {
            columns[column].get_or_init(|| solved);
        }
    }

    /// Columns of the flexibility between surface nodes, as [`Self::surface_block`] has it. On grains of very many nodes they take less time together.
    fn columns_of(&self, held: &HeldGrain, numbers: &[usize]) -> Vec<Vec<Mat3>> {
        let patches = self.patches.as_ref().map(|on| &on.patches);
        let shares_of = |&column: &usize| -> Vec<(u32, f64)> {
            patches.map_or_else(
                || vec![(column as u32, 1.0)],
                |patches| patches.of(column).map(|(node, share)| (node as u32, share)).collect(),
            )
        };
        let forces: Vec<Vec<(u32, f64)>> = numbers.iter().map(shares_of).collect();
        let forces: Vec<&[(u32, f64)]> = forces.iter().map(|shares| &shares[..]).collect();
        let displaced = if self.surface.nodes().len() > DENSE_SURFACE_NODES {
            held.columns(&self.surface, &forces)
        } else {
            forces.iter().map(|force| held.column(&self.surface, force)).collect()
        };
        let Some(patches) = patches else { return displaced };
        let felt = |all: &Vec<Mat3>| -> Vec<Mat3> {
            (0..all.len()).map(|i| patches.of(i).map(|(j, share)| all[j] * share).sum()).collect()
        };
        displaced.iter().map(felt).collect()
    }

    /// Displacement of surface node number `i` by a force on number `j`; zero where columns are solved for on demand.
    fn point_block(&self, i: usize, j: usize) -> Mat3 {
        match &self.flexibility {
            Flexibility::Dense(DenseFlexibility { surface, .. }) => lower(surface, i, j),
            Flexibility::OnDemand { .. } => Mat3::zeros(),
        }
    }
}

/// A block of a symmetric matrix of which those are kept whose row is not below the column.
fn lower(packed: &[Mat3], i: usize, j: usize) -> Mat3 {
    if i >= j { packed[i * (i + 1) / 2 + j] } else { packed[j * (j + 1) / 2 + i].transpose() }
}

#[cfg(test)]
mod tests;
