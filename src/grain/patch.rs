//! The patch that a contact force is spread over, and whose displacement the contact feels.
//!
//! A force on a point of a mesh displaces it by about `1/(E h)`, h [m] the size of its cells: refinement ends nowhere. Contacts of asperities have what
//! rock yields near the point in their own law ([`crate::contact::asperity`]); what is left to a body is how it yields to a force on a patch of a size
//! of its own, rho [m], which a mesh finds the better the finer it is. For surface node i
//!
//! ```text
//! s_ij = integral over the surface of w_i N_j / integral of w_i,    w_i(x) = max(0, 1 - |x - x_i| / rho)
//! ```
//!
//! with the shape functions `N_j` of the facets. A force on node i acts as `s_ij` of it on each node j, and what is felt at i is the mean `s_ij u_j`:
//! the flexibility is `S W S^T`, symmetric and positive semi-definite as `W` is.

use crate::grain::surface::Surface;
use crate::mesh::Mesh;
use crate::tensor::Vec3;

/// Radius of the patch over the diameter of the ball of the body's volume.
pub const PATCH_OF_BODY: f64 = 0.2;

/// Facets are cut until their parts are this share of the radius long, into no more than so many along a side.
const PART: f64 = 0.25;
const MOST_PARTS: f64 = 16.0;

/// The matrix S of a surface: of each row the nodes and shares that are not zero.
#[derive(Debug, Clone)]
pub(crate) struct Patches {
    rows: Vec<Vec<(u32, f64)>>,
}

impl Patches {
    /// Patches of `radius` [m] about the nodes of the `surface` of `mesh`.
    pub fn new(mesh: &Mesh, surface: &Surface, radius: f64) -> Self {
        let nodes = surface.nodes();
        let places: Vec<Vec3> = nodes.iter().map(|node| mesh.nodes[node.index()]).collect();
        let mut rows = vec![vec![0.0; nodes.len()]; nodes.len()];
        for facet in 0..mesh.surface.len() as u32 {
            let corners = surface.corners(facet);
            let size = [0, 1, 2].map(|k| (corners[(k + 1) % 3] - corners[k]).norm());
            let longest = size.into_iter().fold(0.0, f64::max);
            let middle = corners.iter().sum::<Vec3>() / 3.0;
            let near: Vec<usize> =
                (0..places.len()).filter(|&i| (places[i] - middle).norm() < radius + longest).collect();
            if near.is_empty() {
                continue;
            }
            let parts = (longest / (PART * radius)).ceil().clamp(1.0, MOST_PARTS) as u32;
            let area = surface.facet_area(facet) / f64::from(parts * parts);
            for l in middles(parts) {
                let point = surface.point(facet, &l);
                for &i in &near {
                    let weight = area * (1.0 - (point.position - places[i]).norm() / radius);
                    if weight > 0.0 {
                        for &(node, shape) in &point.shares {
                            rows[i][node as usize] += weight * shape;
                        }
                    }
                }
            }
        }
        let normalised = |(i, row): (usize, Vec<f64>)| {
            let whole: f64 = row.iter().sum();
            if !(whole > 0.0) {
                return vec![(i as u32, 1.0)];
            }
            let some = row.iter().enumerate().filter(|(_, share)| **share != 0.0);
            some.map(|(j, share)| (j as u32, share / whole)).collect()
        };
        Patches { rows: rows.into_iter().enumerate().map(normalised).collect() }
    }

    /// The nodes that a force on node `i` acts on, and its shares there.
    pub fn of(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.rows[i].iter().map(|(j, share)| (*j as usize, *share))
    }

    /// Forces on the surface nodes, spread: `S^T f`.
    pub fn spread(&self, forces: &[Vec3]) -> Vec<Vec3> {
        let mut spread = vec![Vec3::zeros(); forces.len()];
        for (i, force) in forces.iter().enumerate().filter(|(_, force)| **force != Vec3::zeros()) {
            self.of(i).for_each(|(j, share)| spread[j] += force * share);
        }
        spread
    }

    /// What is felt of displacements of the surface nodes: `S u`.
    pub fn felt(&self, displaced: &[Vec3]) -> Vec<Vec3> {
        (0..displaced.len()).map(|i| self.of(i).map(|(j, share)| displaced[j] * share).sum()).collect()
    }

    /// Bytes on the heap.
    pub fn memory(&self) -> usize {
        self.rows.iter().map(|row| size_of_val(&row[..])).sum()
    }
}

/// Area coordinates of the middles of the n^2 equal triangles that a triangle is cut into.
fn middles(parts: u32) -> impl Iterator<Item = [f64; 3]> {
    let n = f64::from(parts);
    (0..parts).flat_map(move |i| {
        (0..parts - i).flat_map(move |j| {
            let (x, y) = (f64::from(i), f64::from(j));
            let upright = [x + 1.0 / 3.0, y + 1.0 / 3.0];
            let hanging = [x + 2.0 / 3.0, y + 2.0 / 3.0];
            let inside = (i + j + 1 < parts).then_some(hanging);
            [Some(upright), inside].into_iter().flatten().map(move |[x, y]| {
                let (x, y) = (x / n, y / n);
                [1.0 - x - y, x, y]
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cuboid_mesh;

    fn cube(cell: f64) -> (Mesh, Surface) {
        let mesh = cuboid_mesh([1.0, 1.0, 1.0], cell).expect("a mesh");
        let surface = Surface::new(&mesh);
        (mesh, surface)
    }

    #[test]
    fn middles_are_those_of_equal_parts() {
        for parts in 1..6 {
            let all: Vec<[f64; 3]> = middles(parts).collect();
            assert_eq!(all.len(), (parts * parts) as usize);
            let mean = |k: usize| all.iter().map(|l| l[k]).sum::<f64>() / all.len() as f64;
            assert!((0..3).all(|k| (mean(k) - 1.0 / 3.0).abs() < 1e-14));
        }
    }

    #[test]
    fn a_spread_force_is_the_force_and_does_the_work_of_what_is_felt() {
        let (mesh, surface) = cube(0.25);
        let patches = Patches::new(&mesh, &surface, 0.3);
        let forces: Vec<Vec3> = (0..surface.nodes().len())
            .map(|k| Vec3::new((k as f64).sin(), (2.0 * k as f64).cos(), 0.5))
            .collect();
        let displaced: Vec<Vec3> =
            surface.nodes().iter().map(|node| mesh.nodes[node.index()].map(|x| x * x - 0.3 * x)).collect();
        let spread = patches.spread(&forces);
        assert!((spread.iter().sum::<Vec3>() - forces.iter().sum::<Vec3>()).norm() < 1e-12);
        let work = |f: &[Vec3], u: &[Vec3]| f.iter().zip(u).map(|(f, u)| f.dot(u)).sum::<f64>();
        let (there, here) = (work(&spread, &displaced), work(&forces, &patches.felt(&displaced)));
        assert!((there - here).abs() < 1e-12 * here.abs(), "{there} {here}");
    }

    /// In the middle of a flat face the patch is a disc: the mean of `|x - x_i|^2` under the weight is 3/10 of the squared radius, whatever the mesh.
    #[test]
    fn a_patch_has_the_radius_that_it_is_given() {
        let radius = 0.2;
        for cell in [0.5, 0.25, 0.125] {
            let (mesh, surface) = cube(cell);
            let patches = Patches::new(&mesh, &surface, radius);
            let place = |k: usize| mesh.nodes[surface.nodes()[k].index()];
            let middle = Vec3::new(0.0, 0.0, 0.5);
            let i = (0..surface.nodes().len())
                .min_by(|&a, &b| (place(a) - middle).norm().total_cmp(&(place(b) - middle).norm()))
                .expect("a node");
            let centre = place(i);
            assert!((centre - middle).norm() < 1e-12);
            // Quadratic shape functions reproduce squares.
            let square: f64 =
                patches.of(i).map(|(j, share)| (place(j) - centre).norm_squared() * share).sum();
            assert!((square / (0.3 * radius * radius) - 1.0).abs() < 0.05, "{cell}: {square}");
        }
    }
}
