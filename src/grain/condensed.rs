//! An elastic meshed grain, eliminated exactly onto its surface.
//!
//! The grain floats: its displacement is measured in a frame with zero mass-weighted mean
//! displacement and rotation, `R^T M u = 0` with R the six rigid motions and M the consistent mass.
//! A load is balanced by uniform inertia (`P^T f`, `P = 1 - R (R^T M R)^-1 R^T M`), the stiffness is
//! held at six statically determinate supports whose reactions then vanish, and the solution is
//! moved into the frame: `u = P K_held^-1 P^T f`. That flexibility `C = P K_held^-1 P^T` is symmetric
//! and positive semi-definite and does not depend on the supports.
//!
//! Source: free-free flexibility with inertia relief, e.g. Felippa & Park (2002), "The construction
//! of free-free flexibility matrices", Comput. Methods Appl. Mech. Eng. 191:2139-2168.

use std::sync::OnceLock;

use nalgebra::Vector6;

use crate::element::{POINT_COUNT, StraightTet10, tet10::mass_share};
use crate::error::{Error, Result};
use crate::grain::local::LocalStiffness;
use crate::grain::mass::MassProperties;
use crate::grain::surface::{Surface, SurfacePoint};
use crate::linalg::{Factorisation, NodeGraph, Ordering, SparseCholesky, SymmetricMatrix, SymmetricPattern};
use crate::material::Elastic;
use crate::mesh::{CellId, Mesh, NodeId};
use crate::tensor::{Mat3, Vec3};

/// Up to this many surface nodes the whole flexibility is computed at once; beyond, column by
/// column when first asked for.
const DENSE_SURFACE_NODES: usize = 600;
/// Nodes whose flexibility is solved for together.
const BATCH: usize = 32;
/// Nodes from which nested dissection beats minimum degree.
const DISSECTION_NODES: usize = 500;

/// A condensed elastic grain.
#[derive(Debug)]
pub struct CondensedGrain {
    mesh: Mesh,
    rock: Vec<Elastic>,
    surface: Surface,
    mass: MassProperties,
    flexibility: Flexibility,
}

/// Displacement of nodes under unit forces on surface nodes [m/N].
#[derive(Debug)]
enum Flexibility {
    /// `surface[i (i + 1) / 2 + j]` for surface nodes i >= j, and for the k-th inner node
    /// `inner[k * surface nodes + j]`.
    Dense { surface: Vec<Mat3>, inner: Vec<Mat3>, inner_nodes: Vec<NodeId> },
    /// The factor, and the columns (all surface nodes) computed so far.
    OnDemand { held: Box<HeldGrain>, columns: Vec<OnceLock<Vec<Mat3>>> },
}

impl CondensedGrain {
    /// Condenses `mesh` with one elastic law per cell and a uniform `density` [kg/m^3].
    ///
    /// Errors ([`Error::Mesh`]): a law missing, a flat cell, more than one part, an impossible
    /// density, or a stiffness that cannot be factored.
    pub fn new(mesh: Mesh, cell_elasticity: &[Elastic], density: f64) -> Result<Self> {
        let intact = vec![[1.0; POINT_COUNT]; mesh.cells.len()];
        Self::with_damage(mesh, cell_elasticity, density, &intact)
    }

    /// As [`Self::new`], each integration point keeping only the part `intact` of its stiffness (1:
    /// sound). Errors also where too little is left to carry load.
    pub fn with_damage(
        mesh: Mesh,
        cell_elasticity: &[Elastic],
        density: f64,
        intact: &[[f64; POINT_COUNT]],
    ) -> Result<Self> {
        let fail = |message: String| Error::Mesh { name: "grain".into(), message };
        if cell_elasticity.len() != mesh.cells.len() || intact.len() != mesh.cells.len() {
            return Err(fail(format!(
                "has {} cells, {} elastic laws and {} damage states",
                mesh.cells.len(),
                cell_elasticity.len(),
                intact.len()
            )));
        }
        let parts = mesh.connected_parts().len();
        if parts != 1 {
            return Err(fail(format!("has {parts} parts; each must be a grain of its own")));
        }
        let mass = MassProperties::of_mesh(&mesh, density).map_err(|error| fail(error.to_string()))?;
        let surface = Surface::new(&mesh);
        let mut held = HeldGrain::new(&mesh, cell_elasticity, &mass, density, intact).map_err(fail)?;
        let flexibility = if surface.nodes().len() <= DENSE_SURFACE_NODES {
            held.dense(&surface).map_err(fail)?
        } else {
            let columns = surface.nodes().iter().map(|_| OnceLock::new()).collect();
            Flexibility::OnDemand { held: Box::new(held), columns }
        };
        Ok(CondensedGrain { rock: cell_elasticity.to_vec(), mesh, surface, mass, flexibility })
    }

    pub const fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    pub const fn surface(&self) -> &Surface {
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

    /// Where the line from `xi` along `outward` leaves the body; see [`Surface::locate_along`].
    pub fn locate_along(&self, xi: &Vec3, outward: &Vec3) -> SurfacePoint {
        self.surface.locate_along(xi, outward)
    }

    /// Displacement [m] at `a`, in the frame, per force [N] at `b`. `flexibility(b, a)` is its transpose.
    ///
    /// On a grain with very many surface nodes a column is solved for when it is first needed; should
    /// that overflow, it holds NaN.
    pub fn flexibility(&self, a: &SurfacePoint, b: &SurfacePoint) -> Mat3 {
        let mut sum = Mat3::zeros();
        for (&i, &p) in a.nodes.iter().zip(&a.weights) {
            if p == 0.0 {
                continue;
            }
            for (&j, &q) in b.nodes.iter().zip(&b.weights) {
                if q != 0.0 {
                    sum += self.surface_block(i as usize, j as usize) * (p * q);
                }
            }
        }
        sum
    }

    /// Displacements [m] at `at`, in the frame, under forces [N] on surface points.
    ///
    /// # Panics
    /// If `out` and `at` differ in length.
    pub fn surface_displacement_into(
        &self,
        out: &mut [Vec3],
        loads: &[(SurfacePoint, Vec3)],
        at: &[SurfacePoint],
    ) {
        assert_eq!(out.len(), at.len(), "one displacement per point");
        for (u, point) in out.iter_mut().zip(at) {
            *u = loads.iter().map(|(place, force)| self.flexibility(point, place) * force).sum();
        }
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

    /// Displacement [m] of every node, in the frame, under forces [N] on surface points.
    pub fn nodal_displacements(&self, loads: &[(SurfacePoint, Vec3)]) -> Vec<Vec3> {
        let nodes = self.surface.nodes();
        let mut forces = vec![Vec3::zeros(); nodes.len()];
        for (point, force) in loads {
            for (&node, &weight) in point.nodes.iter().zip(&point.weights) {
                forces[node as usize] += force * weight;
            }
        }
        match &self.flexibility {
            Flexibility::Dense { inner, inner_nodes, .. } => {
                let loaded: Vec<usize> = (0..nodes.len()).filter(|&k| forces[k] != Vec3::zeros()).collect();
                let mut u = vec![Vec3::zeros(); self.mesh.nodes.len()];
                for (i, node) in nodes.iter().enumerate() {
                    u[node.index()] = loaded.iter().map(|&j| self.surface_block(i, j) * forces[j]).sum();
                }
                for (row, node) in inner.chunks_exact(nodes.len()).zip(inner_nodes) {
                    u[node.index()] = loaded.iter().map(|&j| row[j] * forces[j]).sum();
                }
                u
            }
            Flexibility::OnDemand { held, .. } => {
                let mut field = vec![Vec3::zeros(); self.mesh.nodes.len()];
                nodes.iter().zip(&forces).for_each(|(node, force)| field[node.index()] = *force);
                held.solve(&field)
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

    /// Local contact stiffness [N/m] at a surface point, from its own flexibility. It is that of a
    /// patch as large as the cells there.
    pub fn local_stiffness(&self, at: &SurfacePoint) -> LocalStiffness {
        LocalStiffness::of_flexibility(&self.flexibility(at, at), &at.normal)
    }

    /// Bytes on the heap, without a factor that is kept for columns on demand.
    pub fn memory(&self) -> usize {
        let mesh = size_of_val(&self.mesh.nodes[..])
            + size_of_val(&self.mesh.cells[..])
            + size_of_val(&self.mesh.surface[..]);
        let flexibility = match &self.flexibility {
            Flexibility::Dense { surface, inner, inner_nodes } => {
                size_of_val(&surface[..]) + size_of_val(&inner[..]) + size_of_val(&inner_nodes[..])
            }
            Flexibility::OnDemand { columns, .. } => {
                columns.iter().filter_map(OnceLock::get).map(|column| size_of_val(&column[..])).sum()
            }
        };
        mesh + size_of_val(&self.rock[..]) + self.surface.memory() + flexibility
    }

    /// Flexibility between surface nodes number `i` and `j`.
    fn surface_block(&self, i: usize, j: usize) -> Mat3 {
        match &self.flexibility {
            Flexibility::Dense { surface, .. } => {
                if i >= j {
                    surface[i * (i + 1) / 2 + j]
                } else {
                    surface[j * (j + 1) / 2 + i].transpose()
                }
            }
            Flexibility::OnDemand { held, columns } => {
                // The column of the larger number, whoever asks, so that both give the same bits.
                let (row, column) = (i.min(j), i.max(j));
                let block = columns[column].get_or_init(|| held.column(&self.surface, column))[row];
                if i <= j { block } else { block.transpose() }
            }
        }
    }
}

/// The stiffness held at six supports, factored, with what the projections need.
#[derive(Debug)]
struct HeldGrain {
    factor: SparseCholesky,
    /// Node positions from the centroid [m].
    arms: Vec<Vec3>,
    /// `integral of rho N dV` of each node [kg].
    masses: Vec<f64>,
    /// `integral of rho N x dV` of each node, from the centroid [kg m].
    moments: Vec<Vec3>,
    inverse_mass: f64,
    inverse_inertia: Mat3,
}

impl HeldGrain {
    fn new(
        mesh: &Mesh,
        rock: &[Elastic],
        mass: &MassProperties,
        density: f64,
        intact: &[[f64; POINT_COUNT]],
    ) -> std::result::Result<Self, String> {
        let arms: Vec<Vec3> = mesh.nodes.iter().map(|x| x - mass.centroid).collect();
        let (mut masses, mut moments) = (vec![0.0; arms.len()], vec![Vec3::zeros(); arms.len()]);
        let mut stiffness = assemble(mesh, rock, intact)?;
        for cell in mesh.cell_ids() {
            let nodes = &mesh.cells[cell.index()];
            let cell_mass = density * mesh.cell_volume(cell);
            for (i, node) in nodes.iter().enumerate() {
                for (j, other) in nodes.iter().enumerate() {
                    let share = cell_mass * mass_share(i, j);
                    masses[node.index()] += share;
                    moments[node.index()] += arms[other.index()] * share;
                }
            }
        }
        hold(&mut stiffness, &arms)?;
        let ordering = if arms.len() < DISSECTION_NODES {
            Ordering::MinimumDegree
        } else {
            Ordering::nested_dissection(&graph(mesh)?, 3).map_err(|error| error.to_string())?
        };
        let mut factor = SparseCholesky::analyse(stiffness.pattern(), &ordering, Factorisation::Llt)
            .map_err(|error| error.to_string())?;
        factor.factorise(&stiffness).map_err(|error| error.to_string())?;
        let inverse_inertia =
            mass.inertia.try_inverse().ok_or_else(|| "has a singular moment of inertia".to_string())?;
        Ok(HeldGrain { factor, arms, masses, moments, inverse_mass: 1.0 / mass.mass, inverse_inertia })
    }

    /// Acceleration and angular acceleration that a force on a node gives the rigid grain.
    fn acceleration(&self, node: usize, force: &Vec3) -> (Vec3, Vec3) {
        (force * self.inverse_mass, self.inverse_inertia * self.arms[node].cross(force))
    }

    /// `f -= M R a`.
    fn subtract_inertia(&self, f: &mut [f64], (linear, angular): (Vec3, Vec3)) {
        for ((f, mass), moment) in f.chunks_exact_mut(3).zip(&self.masses).zip(&self.moments) {
            let inertia = linear * *mass + angular.cross(moment);
            f.iter_mut().zip(&inertia).for_each(|(f, i)| *f -= i);
        }
    }

    /// Takes out the mean displacement and rotation: `u -= R (R^T M R)^-1 R^T M u`.
    fn into_frame(&self, u: &mut [f64]) {
        let (mut momentum, mut angular) = (Vec3::zeros(), Vec3::zeros());
        for ((u, mass), moment) in u.chunks_exact(3).zip(&self.masses).zip(&self.moments) {
            let u = Vec3::new(u[0], u[1], u[2]);
            momentum += u * *mass;
            angular += moment.cross(&u);
        }
        let (shift, turn) = (momentum * self.inverse_mass, self.inverse_inertia * angular);
        for (u, arm) in u.chunks_exact_mut(3).zip(&self.arms) {
            let rigid = shift + turn.cross(arm);
            u.iter_mut().zip(&rigid).for_each(|(u, r)| *u -= r);
        }
    }

    /// Displacements under forces on all nodes; NaN where the solution overflows.
    fn solve(&self, forces: &[Vec3]) -> Vec<Vec3> {
        let (mut linear, mut angular) = (Vec3::zeros(), Vec3::zeros());
        let mut u: Vec<f64> = Vec::with_capacity(3 * forces.len());
        for (node, force) in forces.iter().enumerate() {
            let (a, b) = self.acceleration(node, force);
            linear += a;
            angular += b;
            u.extend(force);
        }
        self.subtract_inertia(&mut u, (linear, angular));
        if self.factor.back_substitute_shared(&mut u, 1).is_err() {
            return vec![Vec3::repeat(f64::NAN); forces.len()];
        }
        self.into_frame(&mut u);
        u.chunks_exact(3).map(|u| Vec3::new(u[0], u[1], u[2])).collect()
    }

    /// Right-hand sides for unit forces along x, y, z on `node`, balanced by inertia.
    fn unit_loads_into(&self, out: &mut [f64], node: usize) {
        for (axis, column) in out.chunks_exact_mut(3 * self.arms.len()).enumerate() {
            column.fill(0.0);
            column[3 * node + axis] = 1.0;
            self.subtract_inertia(column, self.acceleration(node, &Vec3::ith(axis, 1.0)));
        }
    }

    /// Flexibility of all surface nodes for forces on surface node number `column`.
    fn column(&self, surface: &Surface, column: usize) -> Vec<Mat3> {
        let size = 3 * self.arms.len();
        let mut x = vec![0.0; 3 * size];
        self.unit_loads_into(&mut x, surface.nodes()[column].index());
        if self.factor.back_substitute_shared(&mut x, 3).is_err() {
            x.fill(f64::NAN);
        }
        x.chunks_exact_mut(size).for_each(|u| self.into_frame(u));
        surface.nodes().iter().map(|node| block(&x, size, *node)).collect()
    }

    fn dense(&mut self, surface: &Surface) -> std::result::Result<Flexibility, String> {
        let nodes = surface.nodes();
        let on_surface = |node: &NodeId| nodes.binary_search(node).is_ok();
        let inner_nodes: Vec<NodeId> =
            (0..self.arms.len() as u32).map(NodeId).filter(|node| !on_surface(node)).collect();
        let mut packed = vec![Mat3::zeros(); nodes.len() * (nodes.len() + 1) / 2];
        let mut inner = vec![Mat3::zeros(); inner_nodes.len() * nodes.len()];
        let size = 3 * self.arms.len();
        let mut x = vec![0.0; 3 * size * BATCH.min(nodes.len())];
        for first in (0..nodes.len()).step_by(BATCH) {
            let batch = &nodes[first..(first + BATCH).min(nodes.len())];
            let x = &mut x[..3 * size * batch.len()];
            for (column, node) in x.chunks_exact_mut(3 * size).zip(batch) {
                self.unit_loads_into(column, node.index());
            }
            self.factor.back_substitute(x, 3 * batch.len()).map_err(|error| error.to_string())?;
            x.chunks_exact_mut(size).for_each(|u| self.into_frame(u));
            for (k, three) in x.chunks_exact(3 * size).enumerate() {
                let j = first + k;
                for (i, node) in nodes.iter().enumerate().skip(j) {
                    let found = block(three, size, *node);
                    // Symmetric up to rounding; make it exact on the diagonal.
                    packed[i * (i + 1) / 2 + j] =
                        if i == j { (found + found.transpose()) * 0.5 } else { found };
                }
                for (row, node) in inner_nodes.iter().enumerate() {
                    inner[row * nodes.len() + j] = block(three, size, *node);
                }
            }
        }
        Ok(Flexibility::Dense { surface: packed, inner, inner_nodes })
    }
}

/// The block of `node` in three solution columns.
fn block(columns: &[f64], size: usize, node: NodeId) -> Mat3 {
    Mat3::from_fn(|row, column| columns[column * size + 3 * node.index() + row])
}

fn graph(mesh: &Mesh) -> std::result::Result<NodeGraph, String> {
    let cliques: Vec<[u32; 10]> = mesh.cells.iter().map(|cell| cell.map(|node| node.0)).collect();
    NodeGraph::from_cliques(mesh.nodes.len(), cliques.iter().map(|c| &c[..]))
        .ok_or_else(|| "has too many nodes for the solver".to_string())
}

/// Stiffness [N/m] of a mesh, three unknowns a node.
fn assemble(
    mesh: &Mesh,
    rock: &[Elastic],
    intact: &[[f64; POINT_COUNT]],
) -> std::result::Result<SymmetricMatrix, String> {
    let pattern = SymmetricPattern::from_graph(&graph(mesh)?, 3)
        .ok_or_else(|| "has too many nodes for the solver".to_string())?;
    let mut stiffness = SymmetricMatrix::zeros(pattern);
    for cell in mesh.cell_ids() {
        let element = StraightTet10::new(&mesh.corners(cell))
            .ok_or_else(|| format!("cell {} has no volume", cell.index()))?;
        let mut k = [[Mat3::zeros(); 10]; 10];
        element.add_stiffness(&mut k, &rock[cell.index()], &intact[cell.index()]);
        let nodes = &mesh.cells[cell.index()];
        for (i, row) in k.iter().enumerate() {
            for (j, block) in row.iter().enumerate() {
                let (node, other) = (nodes[i].index(), nodes[j].index());
                if node < other {
                    continue;
                }
                for a in 0..3 {
                    let last = if node == other { a } else { 2 };
                    for b in 0..=last {
                        let stored = stiffness.add(3 * node + a, 3 * other + b, block[(a, b)]);
                        debug_assert!(stored, "the pattern comes from the same cells");
                    }
                }
            }
        }
    }
    Ok(stiffness)
}

/// Adds six statically determinate supports at three far-apart nodes: all directions at the first,
/// the two across the line to the second there, and out of the plane of the three at the third.
/// Balanced loads leave them without reactions, whatever their stiffness.
fn hold(stiffness: &mut SymmetricMatrix, arms: &[Vec3]) -> std::result::Result<(), String> {
    let farthest = |measure: &dyn Fn(&Vec3) -> f64| {
        (0..arms.len()).max_by(|&i, &j| measure(&arms[i]).total_cmp(&measure(&arms[j])).then(j.cmp(&i)))
    };
    let support = || -> Option<[(usize, Mat3); 3]> {
        let first = farthest(&|x| x.norm())?;
        let second = farthest(&|x| (x - arms[first]).norm())?;
        let line = (arms[second] - arms[first]).try_normalize(0.0)?;
        let third = farthest(&|x| (x - arms[first]).cross(&line).norm())?;
        let across = (arms[third] - arms[first]).cross(&line).try_normalize(0.0)?;
        Some([
            (first, Mat3::identity()),
            (second, Mat3::identity() - line * line.transpose()),
            (third, across * across.transpose()),
        ])
    };
    let supports = support().ok_or_else(|| "has no extent".to_string())?;
    let diagonal = |k: usize| stiffness.get(k, k);
    let scale = (0..stiffness.size()).map(diagonal).sum::<f64>() / stiffness.size() as f64;
    for (node, directions) in supports {
        for a in 0..3 {
            for b in 0..=a {
                let stored = stiffness.add(3 * node + a, 3 * node + b, scale * directions[(a, b)]);
                debug_assert!(stored, "diagonal blocks are stored");
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::geometry::Polyhedron;
    use crate::mesh::{cuboid_mesh, grain_mesh};

    const DENSITY: f64 = 2700.0;

    fn shape() -> Polyhedron {
        let points: Vec<Vec3> = [
            [9.0, 1.0, 2.0],
            [-8.0, 3.0, -1.0],
            [1.0, 11.0, 3.0],
            [2.0, -10.0, 1.0],
            [0.0, 2.0, 14.0],
            [-1.0, 1.0, -13.0],
            [7.0, 6.0, -6.0],
            [-6.0, -6.0, 7.0],
            [6.0, -5.0, -7.0],
            [-5.0, 7.0, 6.0],
        ]
        .iter()
        .map(|p| Vec3::from(*p) * 1e-3)
        .collect();
        let hull = Polyhedron::convex_hull(&points).expect("a hull");
        hull.translated(&-hull.centroid())
    }

    fn rocks(count: usize) -> Vec<Elastic> {
        (0..count)
            .map(|k| Elastic::new(30e9 * (1.0 + 0.2 * (k as f64).sin()), 0.2).expect("allowed"))
            .collect()
    }

    fn grain() -> CondensedGrain {
        let mesh = grain_mesh(&shape(), 38).expect("a mesh");
        let rock = rocks(mesh.cells.len());
        CondensedGrain::new(mesh, &rock, DENSITY).expect("a grain")
    }

    fn loads(grain: &CondensedGrain) -> Vec<(SurfacePoint, Vec3)> {
        let mut random = rand_mt::Mt64::new(3);
        let mut draw = move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
        (0..9)
            .map(|_| {
                let place = Vec3::new(draw(), draw(), draw()) * 0.04;
                (grain.locate(&place), Vec3::new(draw(), draw(), draw()) * 1e3)
            })
            .collect()
    }

    /// Dense reference: `[K, M R; R^T M, 0]` with `u` and the accelerations unknown.
    fn full_solution(grain: &CondensedGrain, loads: &[(SurfacePoint, Vec3)]) -> Vec<Vec3> {
        let mesh = grain.mesh();
        let n = 3 * mesh.nodes.len();
        let mut k = DMatrix::zeros(n, n);
        let mut m = DMatrix::zeros(n, n);
        let mut r = DMatrix::zeros(n, 6);
        for cell in mesh.cell_ids() {
            let element = StraightTet10::new(&mesh.corners(cell)).expect("a cell");
            let mut local = [[Mat3::zeros(); 10]; 10];
            element.add_stiffness(&mut local, grain.rock(cell), &[1.0; 4]);
            let nodes = mesh.cells[cell.index()];
            for i in 0..10 {
                for j in 0..10 {
                    let at = (3 * nodes[i].index(), 3 * nodes[j].index());
                    let mut view = k.fixed_view_mut::<3, 3>(at.0, at.1);
                    view += local[i][j];
                    let mut view = m.fixed_view_mut::<3, 3>(at.0, at.1);
                    view += Mat3::from_diagonal_element(DENSITY * element.volume * mass_share(i, j));
                }
            }
        }
        for (node, x) in mesh.nodes.iter().enumerate() {
            for axis in 0..3 {
                r[(3 * node + axis, axis)] = 1.0;
                let turn = Vec3::ith(axis, 1.0).cross(&(x - grain.mass_properties().centroid));
                r.fixed_view_mut::<3, 1>(3 * node, 3 + axis).copy_from(&turn);
            }
        }
        let mr = &m * &r;
        let mass = r.transpose() * &mr;
        let properties = grain.mass_properties();
        assert!((mass[(0, 0)] / properties.mass - 1.0).abs() < 1e-12);
        assert!(
            (mass.fixed_view::<3, 3>(3, 3) - properties.inertia).norm() < 1e-12 * properties.inertia.norm()
        );
        assert!(mass.fixed_view::<3, 3>(0, 3).norm() < 1e-14 * properties.mass);
        // Scaled so that both blocks weigh alike in the pivoting.
        let scale = k[(0, 0)] / mr.amax();
        let mut system = DMatrix::zeros(n + 6, n + 6);
        system.view_mut((0, 0), (n, n)).copy_from(&k);
        system.view_mut((0, n), (n, 6)).copy_from(&(&mr * scale));
        system.view_mut((n, 0), (6, n)).copy_from(&(mr.transpose() * scale));
        let mut rhs = DVector::zeros(n + 6);
        for (point, force) in loads {
            for (&node, &weight) in point.nodes.iter().zip(&point.weights) {
                let node = grain.surface().nodes()[node as usize].index();
                for axis in 0..3 {
                    rhs[3 * node + axis] += weight * force[axis];
                }
            }
        }
        let x = system.lu().solve(&rhs).expect("a regular system");
        (0..mesh.nodes.len()).map(|node| Vec3::new(x[3 * node], x[3 * node + 1], x[3 * node + 2])).collect()
    }

    fn largest(u: &[Vec3]) -> f64 {
        u.iter().map(Vec3::norm).fold(0.0, f64::max)
    }

    #[test]
    fn condensed_equals_full_solution() {
        let grain = grain();
        let loads = loads(&grain);
        let full = full_solution(&grain, &loads);
        let nodal = grain.nodal_displacements(&loads);
        let scale = largest(&full);
        for (a, b) in full.iter().zip(&nodal) {
            assert!((a - b).norm() < 1e-8 * scale);
        }
        let at: Vec<SurfacePoint> = loads.iter().map(|(point, _)| *point).collect();
        let mut u = vec![Vec3::zeros(); at.len()];
        grain.surface_displacement_into(&mut u, &loads, &at);
        let mut work = 0.0;
        for ((point, force), u) in loads.iter().zip(&u) {
            let expected: Vec3 = point
                .nodes
                .iter()
                .zip(&point.weights)
                .map(|(&k, w)| full[grain.surface().nodes()[k as usize].index()] * *w)
                .sum();
            assert!((expected - u).norm() < 1e-8 * scale);
            work += 0.5 * force.dot(u);
        }
        assert!((grain.elastic_energy(&loads) / work - 1.0).abs() < 1e-10);
        // The strain energy of the recovered field is that same energy.
        let mut strain_energy = 0.0;
        for cell in grain.mesh().cell_ids() {
            let element = StraightTet10::new(&grain.mesh().corners(cell)).expect("a cell");
            let u = grain.mesh().cells[cell.index()].map(|node| nodal[node.index()]);
            for l in &crate::element::POINTS {
                strain_energy += grain.rock(cell).energy_density(&element.strain(l, &u)) * element.volume
                    / POINT_COUNT as f64;
            }
        }
        assert!((strain_energy / work - 1.0).abs() < 1e-9, "{strain_energy} {work}");
    }

    #[test]
    fn flexibility_is_symmetric_and_positive() {
        let grain = grain();
        let points: Vec<SurfacePoint> = loads(&grain).iter().map(|(point, _)| *point).collect();
        // Maxwell and Betti: the displacement at a under a force at b, and the other way round.
        for a in &points {
            for b in &points {
                let (ab, ba) = (grain.flexibility(a, b), grain.flexibility(b, a));
                assert!((ab - ba.transpose()).norm() < 1e-12 * ab.norm().max(grain.flexibility(a, a).norm()));
            }
        }
        let n = grain.surface().nodes().len();
        let mut c = DMatrix::zeros(3 * n, 3 * n);
        for i in 0..n {
            for j in 0..n {
                c.fixed_view_mut::<3, 3>(3 * i, 3 * j).copy_from(&grain.surface_block(i, j));
            }
        }
        assert!((&c - c.transpose()).norm() == 0.0);
        let values = c.symmetric_eigenvalues();
        assert!(values.min() > -1e-12 * values.max(), "{} {}", values.min(), values.max());
    }

    #[test]
    fn balanced_rigid_loads_do_nothing_and_mean_motion_is_zero() {
        let grain = grain();
        let u = grain.nodal_displacements(&loads(&grain));
        let (mut mean, mut turn) = (Vec3::zeros(), Vec3::zeros());
        for cell in grain.mesh().cell_ids() {
            let nodes = grain.mesh().cells[cell.index()];
            let volume = grain.mesh().cell_volume(cell);
            for i in 0..10 {
                for j in 0..10 {
                    let share = volume * mass_share(i, j);
                    let x = grain.mesh().nodes[nodes[j].index()] - grain.mass_properties().centroid;
                    mean += u[nodes[i].index()] * share;
                    turn += x.cross(&u[nodes[i].index()]) * share;
                }
            }
        }
        let volume = grain.mesh().volume();
        assert!(mean.norm() < 1e-12 * volume * largest(&u));
        assert!(turn.norm() < 1e-12 * volume * largest(&u) * 0.01);
    }

    #[test]
    fn uniform_traction_gives_uniform_stress() {
        // sigma n on every facet, as consistent nodal loads of a constant traction: a third of the
        // facet's force on each mid-side node, none on the corners.
        let mesh = grain_mesh(&shape(), 38).expect("a mesh");
        let rock = vec![Elastic::new(30e9, 0.2).expect("allowed"); mesh.cells.len()];
        let grain = CondensedGrain::new(mesh, &rock, DENSITY).expect("a grain");
        let sigma = Mat3::new(-3e6, 1e6, 0.5e6, 1e6, -1e6, 0.2e6, 0.5e6, 0.2e6, 2e6);
        let mut loads = Vec::new();
        for facet in &grain.mesh().surface {
            let [a, b, c] = [0, 1, 2].map(|k| grain.mesh().nodes[facet.nodes[k].index()]);
            let area = (b - a).cross(&(c - a)) * 0.5;
            for k in 3..6 {
                let middle = grain.mesh().nodes[facet.nodes[k].index()];
                loads.push((grain.locate(&middle), sigma * area / 3.0));
            }
        }
        let u = grain.nodal_displacements(&loads);
        for stress in grain.cell_stresses(&u).iter().flatten() {
            let found = Mat3::new(
                stress[0], stress[3], stress[5], stress[3], stress[1], stress[4], stress[5], stress[4],
                stress[2],
            );
            assert!((found - sigma).norm() < 1e-9 * sigma.norm(), "{found}");
        }
    }

    #[test]
    fn on_demand_equals_dense() {
        let mesh = cuboid_mesh([0.02, 0.01, 0.015], 0.005).expect("a mesh");
        let rock = rocks(mesh.cells.len());
        let dense = CondensedGrain::new(mesh, &rock, DENSITY).expect("a grain");
        let intact = vec![[1.0; POINT_COUNT]; rock.len()];
        let held =
            HeldGrain::new(dense.mesh(), &rock, dense.mass_properties(), DENSITY, &intact).expect("held");
        let lazy = CondensedGrain {
            flexibility: Flexibility::OnDemand {
                held: Box::new(held),
                columns: dense.surface().nodes().iter().map(|_| OnceLock::new()).collect(),
            },
            mesh: dense.mesh.clone(),
            rock: dense.rock.clone(),
            surface: dense.surface.clone(),
            mass: dense.mass,
        };
        let loads = loads(&dense);
        for (a, _) in &loads {
            for (b, _) in &loads {
                let expected = dense.flexibility(a, b);
                assert!((lazy.flexibility(a, b) - expected).norm() < 1e-10 * dense.flexibility(a, a).norm());
            }
        }
        let (u, v) = (dense.nodal_displacements(&loads), lazy.nodal_displacements(&loads));
        let scale = largest(&u);
        assert!(u.iter().zip(&v).all(|(u, v)| (u - v).norm() < 1e-10 * scale));
    }

    #[test]
    fn grain_is_small_and_quick() {
        let mesh = grain_mesh(&shape(), 38).expect("a mesh");
        let rock = rocks(mesh.cells.len());
        let start = std::time::Instant::now();
        for _ in 0..20 {
            CondensedGrain::new(mesh.clone(), &rock, DENSITY).expect("a grain");
        }
        let each = start.elapsed() / 20;
        let grain = grain();
        println!(
            "{} cells, {} nodes, {} on the surface: {} bytes, {each:?} to condense",
            grain.mesh().cells.len(),
            grain.mesh().nodes.len(),
            grain.surface().nodes().len(),
            grain.memory()
        );
        assert!(grain.memory() < 400_000);
    }

    #[test]
    fn grains_can_be_shared_between_threads() {
        fn shared<T: Send + Sync>() {}
        shared::<CondensedGrain>();
    }

    #[test]
    fn unusable_grains_are_refused() {
        let mesh = grain_mesh(&shape(), 38).expect("a mesh");
        let rock = rocks(mesh.cells.len());
        assert!(CondensedGrain::new(mesh.clone(), &rock[1..], DENSITY).is_err());
        assert!(CondensedGrain::new(mesh.clone(), &rock, 0.0).is_err());
        let gone = vec![[0.0; POINT_COUNT]; rock.len()];
        assert!(CondensedGrain::with_damage(mesh, &rock, DENSITY, &gone).is_err());
    }
}
