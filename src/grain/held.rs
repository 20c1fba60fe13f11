//! The stiffness of a floating grain, held and factored: solutions in the grain's frame.

use std::sync::Arc;

use crate::element::POINT_COUNT;
use crate::grain::mass::{MassProperties, nodal_moments};
use crate::grain::stiffness::{StiffnessFault, node_graph, stiffness_on, stiffness_pattern};
use crate::grain::surface::Surface;
use crate::linalg::conjugate_gradients::{Until, conjugate_gradients};
use crate::linalg::{FactorError, Ordering, SparseCholesky, SymmetricMatrix, SymmetricPattern};
use crate::material::{Elastic, Secant};
use crate::mesh::{Mesh, NodeId};
use crate::tensor::{Mat3, Vec3};

/// Nodes whose flexibility is solved for together.
const BATCH: usize = 32;
/// The same of forces that are spread over some.
const TOGETHER: usize = 8;
/// Nodes from which nested dissection beats minimum degree.
const DISSECTION_NODES: usize = 500;
/// Error of displacements that are found without a factor, over their size, and products with the stiffness that may take: a factor takes as long as
/// some more.
const WITHOUT_FACTOR: f64 = 1e-8;
const MOST_PRODUCTS: usize = 20;

/// Why a grain cannot be condensed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum HoldFault {
    #[error("{0}")]
    Stiffness(#[from] StiffnessFault),
    #[error("its stiffness cannot be factored: {0}")]
    Factor(#[from] FactorError),
    #[error("has no extent to hold it by")]
    NoExtent,
}

/// Displacement of nodes under unit forces on surface nodes [m/N].
#[derive(Debug)]
pub(crate) struct DenseFlexibility {
    /// `[i (i + 1) / 2 + j]` for surface nodes number i >= j.
    pub surface: Vec<Mat3>,
    /// `[k * surface nodes + j]` for the k-th inner node.
    pub inner: Vec<Mat3>,
    pub inner_nodes: Vec<NodeId>,
}

/// The stiffness held at six supports, factored, with what the projections need.
#[derive(Debug)]
pub(crate) struct HeldGrain {
    factor: SparseCholesky,
    frame: Arc<Frame>,
}

/// What does not change with the grain's stiffness.
#[derive(Debug)]
struct Frame {
    pattern: SymmetricPattern,
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
    pub fn new(
        mesh: &Mesh,
        rock: &[Elastic],
        mass: &MassProperties,
        density: f64,
        points: &[[Secant; POINT_COUNT]],
    ) -> Result<Self, HoldFault> {
        let arms: Vec<Vec3> = mesh.nodes.iter().map(|x| x - mass.centroid).collect();
        let (masses, moments) = nodal_moments(mesh, density, &mass.centroid);
        let mut stiffness = stiffness_on(stiffness_pattern(mesh)?, mesh, rock, points)?;
        hold(&mut stiffness, &arms)?;
        let ordering = if arms.len() < DISSECTION_NODES {
            Ordering::MinimumDegree
        } else {
            Ordering::nested_dissection(&node_graph(mesh)?, 3)?
        };
        let mut factor = SparseCholesky::analyse(stiffness.pattern(), &ordering)?;
        factor.factorise(&stiffness)?;
        let inverse_inertia = mass.inertia.try_inverse().ok_or(HoldFault::NoExtent)?;
        let (pattern, inverse_mass) = (stiffness.pattern().clone(), 1.0 / mass.mass);
        let frame = Frame { pattern, arms, masses, moments, inverse_mass, inverse_inertia };
        Ok(HeldGrain { factor, frame: Arc::new(frame) })
    }

    /// The same grain with other stiffnesses of its points; the bits of [`Self::new`].
    pub fn with_points(
        &self,
        mesh: &Mesh,
        rock: &[Elastic],
        points: &[[Secant; POINT_COUNT]],
    ) -> Result<Self, HoldFault> {
        let mut stiffness = stiffness_on(self.frame.pattern.clone(), mesh, rock, points)?;
        hold(&mut stiffness, &self.frame.arms)?;
        let mut factor = self.factor.again();
        factor.factorise(&stiffness)?;
        Ok(HeldGrain { factor, frame: self.frame.clone() })
    }

    /// Acceleration and angular acceleration that a force on a node gives the rigid grain.
    fn acceleration(&self, node: usize, force: &Vec3) -> (Vec3, Vec3) {
        (force * self.frame.inverse_mass, self.frame.inverse_inertia * self.frame.arms[node].cross(force))
    }

    /// `f -= M R a`.
    fn subtract_inertia(&self, f: &mut [f64], (linear, angular): (Vec3, Vec3)) {
        for ((f, mass), moment) in f.chunks_exact_mut(3).zip(&self.frame.masses).zip(&self.frame.moments) {
            let inertia = linear * *mass + angular.cross(moment);
            f.iter_mut().zip(&inertia).for_each(|(f, i)| *f -= i);
        }
    }

    /// Takes out the mean displacement and rotation: `u -= R (R^T M R)^-1 R^T M u`.
    fn remove_mean_motion(&self, u: &mut [f64]) {
        let (mut momentum, mut angular) = (Vec3::zeros(), Vec3::zeros());
        for ((u, mass), moment) in u.chunks_exact(3).zip(&self.frame.masses).zip(&self.frame.moments) {
            let u = Vec3::new(u[0], u[1], u[2]);
            momentum += u * *mass;
            angular += moment.cross(&u);
        }
        let (shift, turn) = (momentum * self.frame.inverse_mass, self.frame.inverse_inertia * angular);
        for (u, arm) in u.chunks_exact_mut(3).zip(&self.frame.arms) {
            let rigid = shift + turn.cross(arm);
            u.iter_mut().zip(&rigid).for_each(|(u, r)| *u -= r);
        }
    }

    /// Forces on all nodes, balanced by inertia.
    fn balanced(&self, forces: &[Vec3]) -> Vec<f64> {
        let (mut linear, mut angular) = (Vec3::zeros(), Vec3::zeros());
        let mut f: Vec<f64> = Vec::with_capacity(3 * forces.len());
        for (node, force) in forces.iter().enumerate() {
            let (a, b) = self.acceleration(node, force);
            linear += a;
            angular += b;
            f.extend(force);
        }
        self.subtract_inertia(&mut f, (linear, angular));
        f
    }

    /// Displacements under forces on all nodes; NaN where the solution overflows.
    pub fn solve(&self, forces: &[Vec3]) -> Vec<Vec3> {
        let mut u = self.balanced(forces);
        if self.factor.back_substitute(&mut u, 1).is_err() {
            return vec![Vec3::repeat(f64::NAN); forces.len()];
        }
        self.in_frame(u)
    }

    /// The same where the stiffness has become another, whose forces `product` gives, without a factor of it: [`conjugate_gradients`] with the one there is.
    /// `None` where that is too far off.
    pub fn solve_without_factor(
        &self,
        forces: &[Vec3],
        product: impl FnMut(&mut [f64], &[f64]),
    ) -> Option<Vec<Vec3>> {
        let until = Until { tolerance: WITHOUT_FACTOR, most_iterations: MOST_PRODUCTS };
        let precondition = |x: &mut [f64]| self.factor.back_substitute(x, 1);
        Some(self.in_frame(conjugate_gradients(&self.balanced(forces), until, product, precondition)?))
    }

    fn in_frame(&self, mut u: Vec<f64>) -> Vec<Vec3> {
        self.remove_mean_motion(&mut u);
        u.chunks_exact(3).map(|u| Vec3::new(u[0], u[1], u[2])).collect()
    }

    /// Right-hand sides for unit forces along x, y, z on `node`, balanced by inertia.
    fn unit_loads_into(&self, out: &mut [f64], node: usize) {
        for (axis, column) in out.chunks_exact_mut(3 * self.frame.arms.len()).enumerate() {
            column.fill(0.0);
            column[3 * node + axis] = 1.0;
            self.subtract_inertia(column, self.acceleration(node, &Vec3::ith(axis, 1.0)));
        }
    }

    /// Displacement of all surface nodes by a unit force of which the surface nodes have these shares; NaN where the solution overflows.
    pub fn column(&self, surface: &Surface, force: &[(u32, f64)]) -> Vec<Mat3> {
        self.solve_for(surface, &[force], 1).swap_remove(0)
    }

    /// The same of many forces, which take less time together. Each has the bits that it has whatever the others are, but not those of [`Self::column`].
    pub fn columns(&self, surface: &Surface, forces: &[&[(u32, f64)]]) -> Vec<Vec<Mat3>> {
        forces.chunks(TOGETHER).flat_map(|batch| self.solve_for(surface, batch, TOGETHER)).collect()
    }

    /// As many forces as are given, solved for with so many in all: how a factor is worked through depends on their number.
    fn solve_for(&self, surface: &Surface, forces: &[&[(u32, f64)]], number: usize) -> Vec<Vec<Mat3>> {
        let size = 3 * self.frame.arms.len();
        let (mut x, mut alone) = (vec![0.0; 3 * size * number], vec![0.0; 3 * size]);
        for (three, shares) in x.chunks_exact_mut(3 * size).zip(forces) {
            for (node, share) in *shares {
                self.unit_loads_into(&mut alone, surface.nodes()[*node as usize].index());
                three.iter_mut().zip(&alone).for_each(|(x, own)| *x += share * own);
            }
        }
        if self.factor.back_substitute(&mut x, 3 * number).is_err() {
            x.fill(f64::NAN);
        }
        x.chunks_exact_mut(size).for_each(|u| self.remove_mean_motion(u));
        let of = |three: &[f64]| surface.nodes().iter().map(|node| block(three, size, *node)).collect();
        x.chunks_exact(3 * size).take(forces.len()).map(of).collect()
    }

    /// Flexibility of the whole surface, and of the inner nodes for forces on it.
    pub fn dense(&self, surface: &Surface) -> Result<DenseFlexibility, HoldFault> {
        let nodes = surface.nodes();
        let on_surface = |node: &NodeId| nodes.binary_search(node).is_ok();
        let all = 0..self.frame.arms.len() as u32;
        let inner_nodes: Vec<NodeId> = all.map(NodeId).filter(|node| !on_surface(node)).collect();
        let mut packed = vec![Mat3::zeros(); nodes.len() * (nodes.len() + 1) / 2];
        let mut inner = vec![Mat3::zeros(); inner_nodes.len() * nodes.len()];
        let size = 3 * self.frame.arms.len();
        let mut x = vec![0.0; 3 * size * BATCH.min(nodes.len())];
        for first in (0..nodes.len()).step_by(BATCH) {
            let batch = &nodes[first..(first + BATCH).min(nodes.len())];
            let x = &mut x[..3 * size * batch.len()];
            for (column, node) in x.chunks_exact_mut(3 * size).zip(batch) {
                self.unit_loads_into(column, node.index());
            }
            self.factor.back_substitute(x, 3 * batch.len())?;
            x.chunks_exact_mut(size).for_each(|u| self.remove_mean_motion(u));
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
        Ok(DenseFlexibility { surface: packed, inner, inner_nodes })
    }
}

/// The block of `node` in three solution columns.
fn block(columns: &[f64], size: usize, node: NodeId) -> Mat3 {
    Mat3::from_fn(|row, column| columns[column * size + 3 * node.index() + row])
}

/// Adds six statically determinate supports at three far-apart nodes: all directions at the first,
/// the two across the line to the second there, and out of the plane of the three at the third.
/// Balanced loads leave them without reactions, whatever their stiffness.
fn hold(stiffness: &mut SymmetricMatrix, arms: &[Vec3]) -> Result<(), HoldFault> {
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
    let supports = support().ok_or(HoldFault::NoExtent)?;
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
