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

use std::sync::{Arc, OnceLock};

use nalgebra::Vector6;

use crate::element::{POINT_COUNT, StraightTet10};
use crate::error::{Error, Result};
use crate::grain::held::{DenseFlexibility, HeldGrain};
use crate::grain::local::LocalStiffness;
use crate::grain::mass::MassProperties;
use crate::grain::surface::{Surface, SurfacePoint};
use crate::material::Elastic;
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
}

/// Displacement of nodes under unit forces on surface nodes [m/N].
#[derive(Debug)]
enum Flexibility {
    Dense(DenseFlexibility),
    /// The factor, and the columns (all surface nodes) computed so far.
    OnDemand {
        held: Box<HeldGrain>,
        columns: Vec<OnceLock<Vec<Mat3>>>,
    },
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
        Self::build(mesh, cell_elasticity, density, intact, DENSE_SURFACE_NODES)
    }

    /// As [`Self::with_damage`], with a factor only: columns of the flexibility are solved for when asked for. For grains whose damage
    /// moves, most of whose columns nobody asks for before the next factor.
    pub fn with_damage_on_demand(
        mesh: Mesh,
        cell_elasticity: &[Elastic],
        density: f64,
        intact: &[[f64; POINT_COUNT]],
    ) -> Result<Self> {
        Self::build(mesh, cell_elasticity, density, intact, 0)
    }

    fn build(
        mesh: Mesh,
        cell_elasticity: &[Elastic],
        density: f64,
        intact: &[[f64; POINT_COUNT]],
        dense_nodes: usize,
    ) -> Result<Self> {
        let fail = |message: String| Error::Mesh { name: "grain".into(), message };
        let parts = mesh.connected_parts().len();
        if parts != 1 {
            return Err(fail(format!("has {parts} parts; each must be a grain of its own")));
        }
        let mass = MassProperties::of_mesh(&mesh, density).map_err(|error| fail(error.to_string()))?;
        let surface = if dense_nodes == 0 { Surface::of_notched(&mesh) } else { Surface::new(&mesh) };
        let mut held = HeldGrain::new(&mesh, cell_elasticity, &mass, density, intact)
            .map_err(|fault| fail(fault.to_string()))?;
        let flexibility = if surface.nodes().len() <= dense_nodes {
            Flexibility::Dense(held.dense(&surface).map_err(|fault| fail(fault.to_string()))?)
        } else {
            let columns = surface.nodes().iter().map(|_| OnceLock::new()).collect();
            Flexibility::OnDemand { held: Box::new(held), columns }
        };
        let (mesh, surface) = (Arc::new(mesh), Arc::new(surface));
        Ok(CondensedGrain { rock: Arc::new(cell_elasticity.to_vec()), mesh, surface, mass, flexibility })
    }

    /// This grain, which solves on demand, with another part `intact` of its stiffness: the bits of
    /// [`Self::with_damage_on_demand`], without what does not change. `None` where it does not solve on demand.
    pub fn with_intact(&self, intact: &[[f64; POINT_COUNT]]) -> Option<Result<Self>> {
        let Flexibility::OnDemand { held, columns } = &self.flexibility else { return None };
        let made = held.with_intact(&self.mesh, &self.rock, intact);
        Some(made.map_err(|fault| Error::Mesh { name: "grain".into(), message: fault.to_string() }).map(
            |held| CondensedGrain {
                mesh: self.mesh.clone(),
                rock: self.rock.clone(),
                surface: self.surface.clone(),
                mass: self.mass,
                flexibility: Flexibility::OnDemand {
                    held: Box::new(held),
                    columns: columns.iter().map(|_| OnceLock::new()).collect(),
                },
            },
        ))
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

    /// Where the line from `xi` along `outward` leaves the body; see [`Surface::locate_along`].
    pub fn locate_along(&self, xi: &Vec3, outward: &Vec3) -> SurfacePoint {
        self.surface.locate_along(xi, outward)
    }

    /// About the displacement along the unit vector `n` per force along it [m/N] at a surface point:
    /// its own flexibility, or that of a patch as large as the facet on a grain of very many nodes.
    pub fn flexibility_along(&self, at: &SurfacePoint, n: &Vec3) -> f64 {
        match &self.flexibility {
            Flexibility::Dense(_) => n.dot(&(self.flexibility(at, at) * n)),
            Flexibility::OnDemand { held, .. } if self.surface.nodes().len() <= DENSE_SURFACE_NODES => {
                let mut forces = vec![Vec3::zeros(); self.mesh.nodes.len()];
                let node = |&k: &u32| self.surface.nodes()[k as usize].index();
                at.nodes.iter().zip(&at.weights).for_each(|(k, weight)| forces[node(k)] += n * *weight);
                let u = held.solve(&forces);
                at.nodes.iter().zip(&at.weights).map(|(k, weight)| n.dot(&u[node(k)]) * weight).sum()
            }
            Flexibility::OnDemand { .. } => {
                let patch = (self.surface.facet_area(at.facet) / std::f64::consts::PI).sqrt();
                LocalStiffness::of_patch(&self.rock[0], patch).normal.recip()
            }
        }
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

    /// Displacements [m] of all surface nodes, in the frame, under forces [N] on surface points.
    pub fn surface_field_into(&self, out: &mut Vec<Vec3>, loads: &[(SurfacePoint, Vec3)]) {
        let count = self.surface.nodes().len();
        out.clear();
        out.resize(count, Vec3::zeros());
        let mut forces = vec![Vec3::zeros(); count];
        for (point, force) in loads {
            for (&node, &weight) in point.nodes.iter().zip(&point.weights) {
                forces[node as usize] += force * weight;
            }
        }
        if let Flexibility::OnDemand { held, .. } = &self.flexibility {
            let mut field = vec![Vec3::zeros(); self.mesh.nodes.len()];
            let nodes = self.surface.nodes();
            nodes.iter().zip(&forces).for_each(|(node, force)| field[node.index()] = *force);
            let u = held.solve(&field);
            nodes.iter().zip(out.iter_mut()).for_each(|(node, out)| *out = u[node.index()]);
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
            for (&node, &weight) in point.nodes.iter().zip(&point.weights) {
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
            Flexibility::Dense(DenseFlexibility { surface, inner, inner_nodes }) => {
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
            Flexibility::Dense(DenseFlexibility { surface, .. }) => {
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

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::element::tet10::mass_share;
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

    #[test]
    fn a_grain_softened_again_has_the_bits_of_one_made_anew() {
        let mesh = grain_mesh(&shape(), 38).expect("a mesh");
        let rock = rocks(mesh.cells.len());
        let intact = |k: usize| -> Vec<[f64; POINT_COUNT]> {
            (0..rock.len()).map(|cell| [1.0 / (1 + (cell * k) % 5) as f64; POINT_COUNT]).collect()
        };
        let make = |k| {
            CondensedGrain::with_damage_on_demand(mesh.clone(), &rock, DENSITY, &intact(k)).expect("a grain")
        };
        let again = make(1).with_intact(&intact(3)).expect("on demand").expect("a grain");
        let anew = make(3);
        let loads = loads(&anew);
        assert_eq!(again.nodal_displacements(&loads), anew.nodal_displacements(&loads));
        assert_ne!(make(1).nodal_displacements(&loads), anew.nodal_displacements(&loads));
        assert!(grain().with_intact(&intact(1)).is_none());
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
    fn grain_is_small() {
        let memory = grain().memory();
        assert!(memory < 400_000, "{memory} bytes");
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
