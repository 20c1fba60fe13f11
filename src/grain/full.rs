//! An elastic grain with all nodes of its mesh as unknowns: the reference for condensed grains.
//!
//! Displacements are those of the nodes in the grain's frame, strains Green's (St Venant-Kirchhoff on tet10 cells),
//! so the grain may deform and turn by any amount. The frame is the condensed grain's: no mean displacement and no
//! mean rotation, weighed by mass, which six multipliers see to. Body loads that a frame's acceleration would balance
//! are balanced by the multipliers, as inertia relief does for condensed grains.
//!
//! Nodes are numbered anew: those of the surface first, in the order of [`Surface::nodes`].
//!
//! **Eliminated nodes.** With `f(u) = K u + n(u)`, K the stiffness of the sound, undisplaced mesh and n what finite
//! strains add, the balance `f(u) = loads` reads `u = C (loads - n(u))` with the flexibility C of the condensed grain.
//! Nodes can so be eliminated grain by grain, once and for all: a condensed grain with the displacement `-C n(u)`
//! besides, iterated, is the same grain. The iteration contracts by the order of the strain.

use crate::element::{POINT_COUNT, StraightTet10, Strains};
use crate::error::{Error, Result};
use crate::grain::condensed::CondensedGrain;
use crate::grain::held::HeldGrain;
use crate::grain::mass::{MassProperties, nodal_moments};
use crate::grain::stiffness::StiffnessFault;
use crate::grain::surface::Surface;
use crate::linalg::NodeGraph;
use crate::material::Elastic;
use crate::mesh::{Mesh, NodeId};
use crate::tensor::{Mat3, Vec3, Vector6};

/// What a node contributes to the mean motion: its share of the mass, and the first moment of that share about the
/// centroid over the radius of gyration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodeShare {
    pub mass: f64,
    pub moment: Vec3,
}

/// Sweeps of [`FullGrain::settle`] at most, and the share of the finite strains' forces that is left when they are enough.
const SWEEPS: usize = 6;
const SETTLED: f64 = 1e-6;

/// A grain whose nodes all move.
#[derive(Debug)]
pub struct FullGrain {
    mesh: Mesh,
    rock: Vec<Elastic>,
    surface: Surface,
    strains: Strains,
    elements: Vec<StraightTet10>,
    /// Nodes of each cell, in this grain's numbering.
    cells: Vec<[u32; 10]>,
    /// Pairs of nodes that share a cell, the smaller number first.
    couplings: Vec<[u32; 2]>,
    shares: Vec<NodeShare>,
    /// Mesh node of each of this grain's.
    order: Vec<NodeId>,
    /// Its stiffness without displacements, where its nodes are eliminated.
    held: Option<HeldGrain>,
}

impl FullGrain {
    /// A grain of `mesh` with one elastic law per cell and a uniform `density` [kg/m^3].
    ///
    /// Errors ([`Error::Mesh`]): a law missing, a flat cell, more than one part, an impossible density.
    pub fn new(mesh: Mesh, cell_elasticity: &[Elastic], density: f64, strains: Strains) -> Result<Self> {
        let fail = |message: String| Error::Mesh { name: "grain".into(), message };
        if cell_elasticity.len() != mesh.cells.len() {
            let (cells, laws) = (mesh.cells.len(), cell_elasticity.len());
            return Err(fail(format!("has {cells} cells and {laws} elastic laws")));
        }
        let parts = mesh.connected_parts().len();
        if parts != 1 {
            return Err(fail(format!("has {parts} parts; each must be a grain of its own")));
        }
        let mass = MassProperties::of_mesh(&mesh, density).map_err(|error| fail(error.to_string()))?;
        let element = |cell| StraightTet10::new(&mesh.corners(cell));
        let elements: Vec<StraightTet10> = mesh
            .cell_ids()
            .map(element)
            .collect::<Option<_>>()
            .ok_or_else(|| fail("has a flat cell".into()))?;
        let surface = Surface::new(&mesh);
        let mut number = vec![u32::MAX; mesh.nodes.len()];
        let on_surface = surface.nodes().iter().copied();
        for (k, node) in on_surface.enumerate() {
            number[node.index()] = k as u32;
        }
        let inner = number.iter_mut().filter(|slot| **slot == u32::MAX);
        for (slot, next) in inner.zip(surface.nodes().len() as u32..) {
            *slot = next;
        }
        let renumbered = |cell: &[NodeId; 10]| cell.map(|node| number[node.index()]);
        let cells: Vec<[u32; 10]> = mesh.cells.iter().map(renumbered).collect();
        let cliques = cells.iter().map(|cell| &cell[..]);
        let graph = NodeGraph::from_cliques(mesh.nodes.len(), cliques)
            .ok_or_else(|| fail(StiffnessFault::TooLarge.to_string()))?;
        let couplings = graph.edges().collect();
        let gyration = (0.5 * mass.inertia.trace() / mass.mass).sqrt();
        let mut shares = vec![NodeShare { mass: 0.0, moment: Vec3::zeros() }; mesh.nodes.len()];
        let (masses, moments) = nodal_moments(&mesh, density, &mass.centroid);
        for ((&slot, own), moment) in number.iter().zip(masses).zip(moments) {
            shares[slot as usize] =
                NodeShare { mass: own / mass.mass, moment: moment / (mass.mass * gyration) };
        }
        let mut order = vec![NodeId(0); mesh.nodes.len()];
        for (node, &slot) in number.iter().enumerate() {
            order[slot as usize] = NodeId(node as u32);
        }
        let (rock, held) = (cell_elasticity.to_vec(), None);
        Ok(FullGrain { mesh, rock, surface, strains, elements, cells, couplings, shares, order, held })
    }

    /// As [`Self::new`] for a grain whose nodes are eliminated, and the condensed grain by which they are.
    pub fn eliminated(
        mesh: Mesh,
        cell_elasticity: &[Elastic],
        density: f64,
        strains: Strains,
    ) -> Result<(Self, CondensedGrain)> {
        let condensed = CondensedGrain::new(mesh.clone(), cell_elasticity, density)?;
        let grain = Self::new(mesh, cell_elasticity, density, strains)?;
        let sound = vec![[1.0; POINT_COUNT]; cell_elasticity.len()];
        let held = HeldGrain::new(&grain.mesh, cell_elasticity, condensed.mass_properties(), density, &sound)
            .map_err(|fault| Error::Mesh { name: "grain".into(), message: fault.to_string() })?;
        Ok((FullGrain { held: Some(held), ..grain }, condensed))
    }

    pub const fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    pub const fn surface(&self) -> &Surface {
        &self.surface
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.shares.len()
    }

    /// Pairs of nodes that share a cell.
    pub fn couplings(&self) -> &[[u32; 2]] {
        &self.couplings
    }

    /// Shares of the nodes in the mean motion.
    pub fn shares(&self) -> &[NodeShare] {
        &self.shares
    }

    fn displacements(cell: &[u32; 10], u: &[Vec3]) -> [Vec3; 10] {
        cell.map(|node| u[node as usize])
    }

    fn of_cells(&self) -> impl Iterator<Item = (&StraightTet10, &Elastic, &[u32; 10])> {
        self.elements
            .iter()
            .zip(&self.rock)
            .zip(&self.cells)
            .map(|((element, rock), cell)| (element, rock, cell))
    }

    /// Strain energy [J] at the displacements `u` [m] of all nodes.
    ///
    /// # Panics
    /// As all that takes `u`, if there is not one displacement per node.
    pub fn energy(&self, u: &[Vec3]) -> f64 {
        self.of_cells()
            .map(|(element, rock, cell)| {
                element.strain_energy(rock, self.strains, &Self::displacements(cell, u))
            })
            .sum()
    }

    /// Stresses [Pa] at the integration points of every cell by small strains, in the frame.
    pub fn cell_stresses(&self, u: &[Vec3]) -> Vec<[Vector6<f64>; POINT_COUNT]> {
        self.of_cells()
            .map(|(element, rock, cell)| element.stresses(rock, &Self::displacements(cell, u)))
            .collect()
    }

    /// Derivative of the energy by the displacements [N].
    pub fn inner_forces_into(&self, out: &mut Vec<Vec3>, u: &[Vec3]) {
        out.clear();
        out.resize(self.nodes(), Vec3::zeros());
        for (element, rock, cell) in self.of_cells() {
            let mut forces = [Vec3::zeros(); 10];
            element.add_inner_forces(&mut forces, rock, self.strains, &Self::displacements(cell, u));
            for (node, force) in cell.iter().zip(&forces) {
                out[*node as usize] += force;
            }
        }
    }

    /// A field of this grain's nodes in the order of the mesh's.
    pub fn on_mesh(&self, field: &[Vec3]) -> Vec<Vec3> {
        let mut on_mesh = vec![Vec3::zeros(); field.len()];
        self.order.iter().zip(field).for_each(|(node, value)| on_mesh[node.index()] = *value);
        on_mesh
    }

    /// What finite strains add to the forces of the undisplaced mesh's stiffness [N], node by node: `n(u)`.
    fn surplus_forces(&self, u: &[Vec3]) -> Vec<Vec3> {
        let mut surplus = vec![Vec3::zeros(); self.nodes()];
        match self.strains {
            Strains::Small => return surplus,
            Strains::Finite => {}
        }
        for (element, rock, cell) in self.of_cells() {
            let mut forces = [Vec3::zeros(); 10];
            element.add_surplus_forces(&mut forces, rock, &Self::displacements(cell, u));
            for (node, force) in cell.iter().zip(&forces) {
                surplus[*node as usize] += force;
            }
        }
        surplus
    }

    /// Displacements under forces on all nodes by the stiffness of the undisplaced mesh; none where nodes are not eliminated.
    fn yielding_to(&self, forces: &[Vec3]) -> Vec<Vec3> {
        let Some(held) = self.held.as_ref().filter(|_| forces.iter().any(|f| *f != Vec3::zeros())) else {
            return vec![Vec3::zeros(); forces.len()];
        };
        let moved = held.solve(&self.on_mesh(forces));
        self.order.iter().map(|node| moved[node.index()]).collect()
    }

    /// The displacement `-C n(u)` [m] that finite strains at `u` cause besides that of the loads on the condensed grain; for eliminated nodes.
    pub fn surplus(&self, u: &[Vec3]) -> Vec<Vec3> {
        self.opposed(&self.surplus_forces(u))
    }

    fn opposed(&self, forces: &[Vec3]) -> Vec<Vec3> {
        let mut displacements = self.yielding_to(forces);
        displacements.iter_mut().for_each(|u| *u = -*u);
        displacements
    }

    /// Moves eliminated nodes from where they are to where they balance the loads that displace those of the condensed grain by `linear` [m],
    /// mesh node by mesh node; `surplus` is [`Self::surplus`] at `u`, before and after. Returns the largest force that is left out of
    /// balance on a node [N], infinite where they do not settle.
    pub fn settle(&self, u: &mut Vec<Vec3>, surplus: &mut Vec<Vec3>, linear: &[Vec3]) -> f64 {
        let largest = |forces: &mut dyn Iterator<Item = f64>| forces.fold(0.0, f64::max);
        let mut forces = self.surplus_forces(u);
        let mut left = f64::INFINITY;
        for _ in 0..SWEEPS {
            u.clear();
            u.extend(self.order.iter().zip(&*surplus).map(|(node, besides)| linear[node.index()] + besides));
            let before = std::mem::replace(&mut forces, self.surplus_forces(u));
            left = largest(&mut forces.iter().zip(&before).map(|(new, old)| (new - old).norm()));
            let scale = largest(&mut forces.iter().map(Vec3::norm));
            if !forces.iter().flatten().all(|force| force.is_finite()) {
                u.clear();
                u.extend(self.order.iter().map(|node| linear[node.index()]));
                surplus.iter_mut().for_each(|u| *u = Vec3::zeros());
                return f64::INFINITY;
            }
            *surplus = self.opposed(&forces);
            if left <= SETTLED * scale {
                break;
            }
        }
        left
    }

    /// Derivative of [`Self::inner_forces_into`] [N/m], cell by cell: its nodes, and their blocks.
    pub fn tangents(&self, u: &[Vec3]) -> Vec<([u32; 10], [[Mat3; 10]; 10])> {
        self.of_cells()
            .map(|(element, rock, cell)| {
                let mut blocks = [[Mat3::zeros(); 10]; 10];
                element.add_tangent(&mut blocks, rock, self.strains, &Self::displacements(cell, u));
                (*cell, blocks)
            })
            .collect()
    }

    /// Mean displacement [m] and mean rotation times the radius of gyration [m], which are to vanish.
    pub fn mean_motion(&self, u: &[Vec3]) -> [Vec3; 2] {
        let (mut shift, mut turn) = (Vec3::zeros(), Vec3::zeros());
        for (u, share) in u.iter().zip(&self.shares) {
            shift += u * share.mass;
            turn += share.moment.cross(u);
        }
        [shift, turn]
    }
}
