//! An elastic grain with all nodes of its mesh as unknowns: the reference for condensed grains.
//!
//! Displacements are those of the nodes in the grain's frame, strains Green's (St Venant-Kirchhoff on tet10 cells),
//! so the grain may deform and turn by any amount. The frame is the condensed grain's: no mean displacement and no
//! mean rotation, weighed by mass, which six multipliers see to. Body loads that a frame's acceleration would balance
//! are balanced by the multipliers, as inertia relief does for condensed grains.
//!
//! Nodes are numbered anew: those of the surface first, in the order of [`Surface::nodes`].

use crate::element::{POINT_COUNT, StraightTet10, Strains};
use crate::error::{Error, Result};
use crate::grain::mass::{MassProperties, nodal_moments};
use crate::grain::surface::Surface;
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
        let mut couplings: Vec<[u32; 2]> = cells
            .iter()
            .flat_map(|cell| {
                let pairs = (0..10).flat_map(|i| (0..i).map(move |j| (i, j)));
                pairs.map(|(i, j)| [cell[i].min(cell[j]), cell[i].max(cell[j])])
            })
            .collect();
        couplings.sort_unstable();
        couplings.dedup();
        let gyration = (0.5 * mass.inertia.trace() / mass.mass).sqrt();
        let mut shares = vec![NodeShare { mass: 0.0, moment: Vec3::zeros() }; mesh.nodes.len()];
        let (masses, moments) = nodal_moments(&mesh, density, &mass.centroid);
        for ((&slot, own), moment) in number.iter().zip(masses).zip(moments) {
            shares[slot as usize] =
                NodeShare { mass: own / mass.mass, moment: moment / (mass.mass * gyration) };
        }
        let rock = cell_elasticity.to_vec();
        Ok(FullGrain { mesh, rock, surface, strains, elements, cells, couplings, shares })
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
