//! A grain all of whose nodes move, with finite strains, elastic or damaged: the reference for condensed grains.
//!
//! Displacements are those of the nodes in the grain's frame, strains Green's (St Venant-Kirchhoff on tet10 cells),
//! so the grain may deform and turn by any amount. The frame is the condensed grain's: no mean displacement and no
//! mean rotation, weighed by mass.
//!
//! With `f(u) = K u + n(u)`, K the stiffness of the sound, undisplaced mesh and n what finite
//! strains add, the balance `f(u) = loads` reads `u = C (loads - n(u))` with the flexibility C of the condensed grain.
//! Nodes can so be eliminated grain by grain, once and for all: a condensed grain with the displacement `-C n(u)`
//! besides, iterated, is the same grain. The iteration contracts by the order of the strain.
//!
//! Its **field** [m] is what contacts feel on the surface, node by node of [`Surface::nodes`](crate::grain::Surface::nodes), and behind that the
//! displacements of all nodes of the mesh.

use std::sync::Arc;

use crate::element::{Cell, POINT_COUNT, StraightTet10, Strains};
use crate::error::{Error, Result};
use crate::grain::condensed::CondensedGrain;
use crate::grain::damaged::{DamageChange, DamageCommit, DamagedGrain, Strained, elements_of};
use crate::grain::held::HeldGrain;
use crate::grain::stiffness::sound;
use crate::grain::surface::SurfacePoint;
use crate::material::Secant;
use crate::mesh::{CellId, Mesh, NodeId};
use crate::tensor::Vec3;

/// Sweeps of [`FullGrain::settle`] at most, and the share of the finite strains' forces that is left when they are enough.
const SWEEPS: usize = 6;
const SETTLED: f64 = 1e-6;

/// A grain whose nodes all move.
#[derive(Debug)]
pub struct FullGrain {
    condensed: Arc<CondensedGrain>,
    /// [kg/m^3]
    density: f64,
    strains: Strains,
    elements: Arc<Vec<StraightTet10>>,
    /// What its points keep of their stiffness in the factor.
    points: Vec<[Secant; POINT_COUNT]>,
    /// Its stiffness without displacements.
    held: Arc<HeldGrain>,
}

impl FullGrain {
    /// The sound grain that `condensed` is at small strains, of a uniform `density` [kg/m^3].
    ///
    /// Errors ([`Error::Mesh`]): a flat cell; a mesh that cannot be held.
    pub fn new(condensed: Arc<CondensedGrain>, density: f64, strains: Strains) -> Result<Self> {
        let fail = |message: String| Error::Mesh { name: "grain".into(), message };
        let mesh = condensed.mesh();
        let (elements, points) = (Arc::new(elements_of(mesh)?), sound(mesh.cells.len()));
        let held = || {
            let rock: Vec<_> = mesh.cell_ids().map(|cell| *condensed.rock(cell)).collect();
            HeldGrain::new(mesh, &rock, condensed.mass_properties(), density, &points)
                .map_err(|fault| fail(fault.to_string()))
        };
        let held = condensed.held().map_or_else(|| held().map(Arc::new), |held| Ok(held.clone()))?;
        Ok(FullGrain { condensed, density, strains, elements, points, held })
    }

    /// A part of it, condensed, with all its nodes; sound.
    ///
    /// Errors as [`FullGrain::new`].
    pub fn alike(&self, part: Arc<CondensedGrain>) -> Result<Self> {
        FullGrain::new(part, self.density, self.strains)
    }

    /// The same cells with the trial damage of `grain`, as of its last refresh.
    pub fn damaged(&self, grain: &DamagedGrain) -> Self {
        let condensed = grain.condensed().clone();
        let held = condensed.held().unwrap_or(&self.held).clone();
        FullGrain { condensed, points: grain.held_points(), held, elements: self.elements.clone(), ..*self }
    }

    /// [`DamagedGrain::propose_beyond`] for the same cells, at their strains where this grain has the `field`.
    pub fn propose(
        &self,
        grain: &mut DamagedGrain,
        field: &[Vec3],
        [max_change, least_change]: [f64; 2],
    ) -> Result<DamageChange> {
        grain.propose_at(self.strains(self.nodal(field)), max_change, least_change)
    }

    /// [`DamagedGrain::commit`] for the same cells, likewise.
    pub fn commit(&self, grain: &mut DamagedGrain, field: &[Vec3]) -> Result<DamageCommit> {
        let u = self.nodal(field);
        grain.commit_at(u.to_vec(), self.strains(u))
    }

    pub fn mesh(&self) -> &Mesh {
        self.condensed.mesh()
    }

    /// The same grain at small strains, by whose flexibility its nodes are eliminated.
    pub const fn condensed(&self) -> &Arc<CondensedGrain> {
        &self.condensed
    }

    /// The field of a grain that nothing has displaced.
    pub fn undisplaced(&self) -> Vec<Vec3> {
        vec![Vec3::zeros(); self.condensed.surface().nodes().len() + self.mesh().nodes.len()]
    }

    /// The field under these `loads` on the surface [N].
    pub fn displaced(&self, loads: &[(SurfacePoint, Vec3)]) -> Vec<Vec3> {
        let (mut field, mut surplus) = (self.undisplaced(), vec![Vec3::zeros(); self.mesh().nodes.len()]);
        self.settle(&mut field, &mut surplus, loads);
        field
    }

    /// Displacements of all nodes of the mesh in its `field` [m]; empty if that is no field of this grain.
    pub fn nodal<'a>(&self, field: &'a [Vec3]) -> &'a [Vec3] {
        let nodal = field.get(self.condensed.surface().nodes().len()..).unwrap_or(&[]);
        if nodal.len() == self.mesh().nodes.len() { nodal } else { &[] }
    }

    /// Strains of each cell at the displacements `u` [m] of all nodes.
    fn strains(&self, u: &[Vec3]) -> Vec<Strained> {
        let of_cell = |(element, _, nodes): (&StraightTet10, _, &[NodeId; 10])| {
            let u = nodes.map(|node| u[node.index()]);
            match self.strains {
                Strains::Small => element.strains(&u),
                Strains::Finite => element.green_strains(&u),
            }
        };
        self.of_cells().map(of_cell).collect()
    }

    fn of_cells(&self) -> impl Iterator<Item = (&StraightTet10, Cell<'_>, &[NodeId; 10])> {
        let cells = self.elements.iter().zip(&self.points).zip(&self.mesh().cells).enumerate();
        cells.map(|(cell, ((element, points), nodes))| {
            (element, Cell { rock: self.condensed.rock(CellId(cell as u32)), points }, nodes)
        })
    }

    /// Strain energy [J] at the displacements `u` [m] of all nodes.
    ///
    /// # Panics
    /// As all that takes `u`, if there is not one displacement per node.
    pub fn energy(&self, u: &[Vec3]) -> f64 {
        let of_cell = |(element, cell, nodes): (&StraightTet10, Cell<'_>, &[NodeId; 10])| {
            element.strain_energy(cell, self.strains, &nodes.map(|node| u[node.index()]))
        };
        self.of_cells().map(of_cell).sum()
    }

    /// Derivative of the energy by the displacements [N].
    pub fn inner_forces(&self, u: &[Vec3]) -> Vec<Vec3> {
        let mut out = vec![Vec3::zeros(); u.len()];
        for (element, cell, nodes) in self.of_cells() {
            let mut forces = [Vec3::zeros(); 10];
            element.add_inner_forces(&mut forces, cell, self.strains, &nodes.map(|node| u[node.index()]));
            nodes.iter().zip(&forces).for_each(|(node, force)| out[node.index()] += force);
        }
        out
    }

    /// What finite strains add to the forces of the undisplaced mesh's stiffness [N], node by node: `n(u)`.
    fn surplus_forces(&self, u: &[Vec3]) -> Vec<Vec3> {
        let mut surplus = vec![Vec3::zeros(); self.mesh().nodes.len()];
        match self.strains {
            Strains::Small => return surplus,
            Strains::Finite => {}
        }
        for (element, cell, nodes) in self.of_cells() {
            let mut forces = [Vec3::zeros(); 10];
            element.add_surplus_forces(&mut forces, cell, &nodes.map(|node| u[node.index()]));
            nodes.iter().zip(&forces).for_each(|(node, force)| surplus[node.index()] += force);
        }
        surplus
    }

    /// The displacement `-C n(u)` [m] that finite strains cause in this `field` besides that of the loads on the condensed grain.
    pub fn surplus(&self, field: &[Vec3]) -> Vec<Vec3> {
        self.opposed(&self.surplus_forces(self.nodal(field)))
    }

    fn opposed(&self, forces: &[Vec3]) -> Vec<Vec3> {
        if forces.iter().all(|force| *force == Vec3::zeros()) {
            return vec![Vec3::zeros(); forces.len()];
        }
        let mut displacements = self.held.solve(forces);
        displacements.iter_mut().for_each(|u| *u = -*u);
        displacements
    }

    /// Moves the nodes from where they are to where they balance these `loads` on the surface [N]; `surplus` is [`Self::surplus`] of the `field`,
    /// before and after. Returns the largest force that is left out of balance on a node [N], infinite where they do not settle.
    pub fn settle(
        &self,
        field: &mut Vec<Vec3>,
        surplus: &mut Vec<Vec3>,
        loads: &[(SurfacePoint, Vec3)],
    ) -> f64 {
        let largest = |forces: &mut dyn Iterator<Item = f64>| forces.fold(0.0, f64::max);
        let linear = self.condensed.nodal_displacements(loads);
        let mut forces = self.surplus_forces(self.nodal(field));
        let mut left = f64::INFINITY;
        let mut u = Vec::new();
        for _ in 0..SWEEPS {
            u.clear();
            u.extend(linear.iter().zip(&*surplus).map(|(linear, besides)| linear + besides));
            let before = std::mem::replace(&mut forces, self.surplus_forces(&u));
            left = largest(&mut forces.iter().zip(&before).map(|(new, old)| (new - old).norm()));
            let scale = largest(&mut forces.iter().map(Vec3::norm));
            if !forces.iter().flatten().all(|force| force.is_finite()) {
                u = linear;
                surplus.iter_mut().for_each(|u| *u = Vec3::zeros());
                left = f64::INFINITY;
                break;
            }
            *surplus = self.opposed(&forces);
            if left <= SETTLED * scale {
                break;
            }
        }
        *field = self.condensed.felt(&u);
        field.append(&mut u);
        left
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grain::Ancestry;
    use crate::grain::mass::nodal_moments;
    use crate::grain::mean_motion;
    use crate::material::{DamageLaw, DamageParameters, Elastic};
    use crate::mesh::cuboid_mesh;

    fn cube(strains: Strains, on_patches: bool) -> FullGrain {
        let mesh = cuboid_mesh([0.03; 3], 0.015).expect("a mesh");
        let rock = vec![Elastic::new(30e9, 0.2).expect("allowed"); mesh.cells.len()];
        let condensed = CondensedGrain::new(mesh, &rock, 2700.0).expect("a grain");
        let condensed = if on_patches { condensed.on_patches() } else { condensed };
        FullGrain::new(Arc::new(condensed), 2700.0, strains).expect("a grain")
    }

    /// Two forces that hold each other, across the cube.
    fn squeeze(grain: &FullGrain, force: f64) -> Vec<(SurfacePoint, Vec3)> {
        let at = |x: f64| grain.condensed().locate(&Vec3::new(x, 1e-3, -2e-3));
        vec![(at(-0.015), Vec3::x() * force), (at(0.015), Vec3::x() * -force)]
    }

    /// Forces less those of the acceleration as a rigid body that they would cause.
    fn without_inertia(grain: &FullGrain, forces: &[Vec3]) -> Vec<Vec3> {
        let (mesh, mass) = (grain.mesh(), grain.condensed().mass_properties());
        let total: Vec3 = forces.iter().sum();
        let about = |(node, force): (&Vec3, &Vec3)| (node - mass.centroid).cross(force);
        let moment: Vec3 = mesh.nodes.iter().zip(forces).map(about).sum();
        let shift = total / mass.mass;
        let spin = mass.inertia.try_inverse().expect("a volume") * moment;
        let (masses, moments) = nodal_moments(mesh, 2700.0, &mass.centroid);
        let each = forces.iter().zip(masses.iter().zip(&moments));
        each.map(|(force, (own, moment))| force - shift * *own - spin.cross(moment)).collect()
    }

    /// The forces within are computed by another element routine than the one the iteration uses.
    #[test]
    fn settled_nodes_balance_their_loads() {
        for on_patches in [false, true] {
            for force in [1e3, 1e5] {
                let grain = cube(Strains::Finite, on_patches);
                let loads = squeeze(&grain, force);
                let (mut field, mut surplus) = (grain.undisplaced(), grain.surplus(&grain.undisplaced()));
                for _ in 0..8 {
                    grain.settle(&mut field, &mut surplus, &loads);
                }
                let u = grain.nodal(&field);
                let outer = grain.condensed().forces_on_nodes(&loads);
                let inner = grain.inner_forces(u);
                let off: Vec<Vec3> = inner.iter().zip(&outer).map(|(inner, outer)| inner - outer).collect();
                let largest = |of: &[Vec3]| of.iter().map(|f| f.norm()).fold(0.0, f64::max) / force;
                let left = largest(&without_inertia(&grain, &off));
                assert!(left < 1e-9, "{force} N: {left:.1e}");
                let (shift, turn) = mean_motion(grain.mesh(), u);
                assert!(shift.norm() < 1e-12 && turn.norm() < 1e-10, "{shift} {turn}");
            }
        }
    }

    #[test]
    fn small_strains_are_the_condensed_grain() {
        for on_patches in [false, true] {
            let grain = cube(Strains::Small, on_patches);
            let loads = squeeze(&grain, 1e4);
            let (mut field, mut surplus) = (grain.undisplaced(), grain.surplus(&grain.undisplaced()));
            grain.settle(&mut field, &mut surplus, &loads);
            let mut felt = Vec::new();
            grain.condensed().surface_field_into(&mut felt, &loads);
            let scale = felt.iter().map(|u| u.norm()).fold(0.0, f64::max);
            for (here, there) in field.iter().zip(&felt) {
                assert!((here - there).norm() < 1e-9 * scale, "{here} {there}");
            }
        }
    }

    /// Softens some points of the cube to less than half [N].
    const FORCE: f64 = 1.2e4;

    /// The cube and its damage under a squeeze.
    fn damaged(strains: Strains, on_patches: bool) -> (FullGrain, DamagedGrain, Vec<(SurfacePoint, Vec3)>) {
        let sound = cube(strains, on_patches);
        let rock = Elastic::new(30e9, 0.2).expect("allowed");
        let law = DamageLaw::new(rock, 10e6, 100e6, &DamageParameters::default(), 1.0).expect("a law");
        let laws = vec![law; sound.mesh().cells.len()];
        let ancestry = Ancestry::of_grain(0);
        let mut grain =
            DamagedGrain::over(sound.condensed().clone(), laws, 2700.0, ancestry).expect("a grain");
        let loads = squeeze(&sound, FORCE);
        for _ in 0..6 {
            grain.propose(&loads, 0.2).expect("a change");
        }
        assert!(grain.refresh().expect("a factor"));
        let full = sound.damaged(&grain);
        let left = full.points.iter().flatten().map(Secant::share).fold(1.0, f64::min);
        assert!(left < 0.5, "{left}");
        (full, grain, loads)
    }

    /// Nodes of the damaged mesh, too: forces are those of another element routine, at small strains displacements those of the condensed grain.
    #[test]
    fn damaged_nodes_balance_their_loads() {
        for on_patches in [false, true] {
            let (full, grain, loads) = damaged(Strains::Finite, on_patches);
            let (mut field, mut surplus) = (full.undisplaced(), full.surplus(&full.undisplaced()));
            for _ in 0..8 {
                full.settle(&mut field, &mut surplus, &loads);
            }
            let (inner, outer) =
                (full.inner_forces(full.nodal(&field)), full.condensed().forces_on_nodes(&loads));
            let off: Vec<Vec3> = inner.iter().zip(&outer).map(|(inner, outer)| inner - outer).collect();
            let left = without_inertia(&full, &off).iter().map(|f| f.norm()).fold(0.0, f64::max);
            assert!(left < 1e-9 * FORCE, "{left:.1e} N");
            let (small, ..) = damaged(Strains::Small, on_patches);
            let expected = grain.condensed().nodal_displacements(&loads);
            let scale = expected.iter().map(|u| u.norm()).fold(0.0, f64::max);
            let displaced = small.displaced(&loads);
            for (here, there) in small.nodal(&displaced).iter().zip(&expected) {
                assert!((here - there).norm() < 1e-9 * scale, "{here} {there}");
            }
        }
    }

    /// What more damage a grain at finite strains asks for is what it asks for at small ones, to the strain itself.
    #[test]
    fn damage_follows_finite_strains() {
        let (full, grain, loads) = damaged(Strains::Finite, false);
        let (mut condensed, mut finite) = (grain.clone(), grain);
        let expected = condensed.propose(&loads, 1.0).expect("a change");
        let found = full.propose(&mut finite, &full.displaced(&loads), [1.0, 0.0]).expect("a change");
        assert!(expected.applied > 1e-3, "{expected:?}");
        assert!((found.applied / expected.applied - 1.0).abs() < 1e-2, "{found:?} {expected:?}");
        finite.refresh().expect("a factor");
        let full = full.damaged(&finite);
        let found = full.commit(&mut finite, &full.displaced(&loads)).expect("a commit");
        let expected = condensed.commit(&loads).expect("a commit");
        assert!((found.dissipated / expected.dissipated - 1.0).abs() < 1e-2, "{found:?} {expected:?}");
        assert!((found.elastic / expected.elastic - 1.0).abs() < 1e-2, "{found:?} {expected:?}");
    }

    #[test]
    fn forces_are_the_derivative_of_the_energy() {
        let grain = cube(Strains::Finite, false);
        let way = |k: usize, seed: f64| Vec3::new(1.0, 2.0, 3.0).map(|s| (s * seed + k as f64).sin() * 1e-4);
        let u: Vec<Vec3> = (0..grain.mesh().nodes.len()).map(|k| way(k, 0.7)).collect();
        let along: Vec<Vec3> = (0..u.len()).map(|k| way(k, 1.9)).collect();
        let at = |h: f64| -> f64 {
            let moved: Vec<Vec3> = u.iter().zip(&along).map(|(u, d)| u + d * h).collect();
            grain.energy(&moved)
        };
        let exact: f64 = grain.inner_forces(&u).iter().zip(&along).map(|(f, d)| f.dot(d)).sum();
        let difference = (at(1e-3) - at(-1e-3)) / 2e-3;
        assert!((difference / exact - 1.0).abs() < 1e-6, "{difference} {exact}");
    }
}
