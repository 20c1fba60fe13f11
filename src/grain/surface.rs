//! Points on the surface of a mesh: where they are and how they hang on the surface nodes.
//!
//! Displacement over a facet is interpolated with the six quadratic shape functions, so it is
//! continuous over the whole surface.

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

use crate::geometry::separation::closest_on_triangle;
use crate::mesh::{Mesh, NodeId};
use crate::tensor::Vec3;

/// A place on the surface, in body coordinates: a point of a facet, or part of a face that forces are spread over.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SurfacePoint {
    /// Index of the facet in the mesh's surface.
    pub facet: u32,
    /// Surface nodes, by number, and their shares of a force here, which are those of their displacements in what is felt here; they sum to
    /// one. At a point the six of the facet with its shape functions.
    pub shares: Shares,
    /// [m]
    #[serde(with = "crate::tensor::stored")]
    pub position: Vec3,
    /// Outward unit normal of the facet.
    #[serde(with = "crate::tensor::stored")]
    pub normal: Vec3,
}

/// Surface nodes by number, each with its share.
pub type Shares = SmallVec<[(u32, f64); 6]>;

#[derive(Debug, Clone, Copy)]
struct Facet {
    corners: [Vec3; 3],
    normal: Vec3,
    nodes: [u32; 6],
    /// From the first corner to the farthest point [m].
    reach: f64,
}

/// A node of the bounding-volume tree: a leaf has facets `first..first + count`, an inner node has
/// its children at `first` and `first + 1`.
#[derive(Debug, Clone, Copy)]
struct Branch {
    low: Vec3,
    high: Vec3,
    first: u32,
    count: u32,
}

/// The surface of a mesh, ready for closest-point searches.
#[derive(Debug, Clone)]
pub struct Surface {
    facets: Vec<Facet>,
    /// Facet numbers in tree order.
    order: Vec<u32>,
    branches: Vec<Branch>,
    nodes: Vec<NodeId>,
    /// Whether the body may have notches.
    notched: bool,
}

const LEAF: usize = 4;
/// Cosine of what a facet in a plane may lean from it.
const ALONG: f64 = 0.9;
/// Twice the depth of a balanced tree over 2^32 facets is enough: each level leaves one behind.
const DEEPEST: usize = 64;

impl Surface {
    pub fn new(mesh: &Mesh) -> Self {
        let nodes = mesh.surface_nodes();
        let index = |node: NodeId| nodes.partition_point(|other| *other < node) as u32;
        let facets: Vec<Facet> = mesh
            .surface
            .iter()
            .map(|facet| {
                let corners = [0, 1, 2].map(|k| mesh.nodes[facet.nodes[k].index()]);
                let [a, b, c] = corners;
                let reach = (b - a).norm().max((c - a).norm());
                let normal = (b - a).cross(&(c - a)).normalize();
                Facet { corners, normal, nodes: facet.nodes.map(index), reach }
            })
            .collect();
        let mut order: Vec<u32> = (0..facets.len() as u32).collect();
        let mut branches = vec![Branch { low: Vec3::zeros(), high: Vec3::zeros(), first: 0, count: 0 }];
        let mut waiting = vec![(0usize, 0usize, facets.len())];
        while let Some((slot, first, last)) = waiting.pop() {
            let (mut low, mut high) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
            for &facet in &order[first..last] {
                for corner in &facets[facet as usize].corners {
                    low = low.inf(corner);
                    high = high.sup(corner);
                }
            }
            let count = last - first;
            if count <= LEAF {
                branches[slot] = Branch { low, high, first: first as u32, count: count as u32 };
                continue;
            }
            let axis = (high - low).imax();
            let centre = |facet: &u32| facets[*facet as usize].corners.iter().map(|p| p[axis]).sum::<f64>();
            order[first..last].sort_by(|a, b| centre(a).total_cmp(&centre(b)).then(a.cmp(b)));
            let middle = first + count / 2;
            let children = branches.len();
            branches[slot] = Branch { low, high, first: children as u32, count: 0 };
            branches.extend([branches[slot]; 2]);
            waiting.push((children, first, middle));
            waiting.push((children + 1, middle, last));
        }
        Surface { facets, order, branches, nodes, notched: false }
    }

    /// The surface of a body that may have notches.
    pub fn of_notched(mesh: &Mesh) -> Self {
        Surface { notched: true, ..Self::new(mesh) }
    }

    /// Surface nodes of the mesh, ascending; [`SurfacePoint::shares`] counts in this list.
    pub fn nodes(&self) -> &[NodeId] {
        &self.nodes
    }

    /// Corners of a facet [m].
    pub fn corners(&self, facet: u32) -> [Vec3; 3] {
        self.facets[facet as usize].corners
    }

    /// Area of a facet [m^2].
    pub fn facet_area(&self, facet: u32) -> f64 {
        let [a, b, c] = self.facets[facet as usize].corners;
        0.5 * (b - a).cross(&(c - a)).norm()
    }

    /// Corners [m] of the facets that look where `normal` does and lie in its plane, to `tolerance` over the body's size. Of small facets of
    /// files with few digits the normals say less than the corners.
    pub fn facets_in(&self, normal: &Vec3, offset: f64, tolerance: f64) -> Vec<[Vec3; 3]> {
        let root = &self.branches[0];
        let reach = tolerance * (root.high - root.low).norm();
        let near = |p: &Vec3| (normal.dot(p) - offset).abs() < reach;
        let within = |facet: &&Facet| facet.normal.dot(normal) > ALONG && facet.corners.iter().all(near);
        self.facets.iter().filter(within).map(|facet| facet.corners).collect()
    }

    /// Every surface node as a surface point, in the order of [`Self::nodes`]; its facet is the first one that has it.
    pub fn node_points(&self) -> Vec<SurfacePoint> {
        const CORNERS_AND_MIDDLES: [[f64; 3]; 6] = [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.5, 0.5, 0.0],
            [0.0, 0.5, 0.5],
            [0.5, 0.0, 0.5],
        ];
        let mut points = vec![None; self.nodes.len()];
        for (number, facet) in self.facets.iter().enumerate() {
            for (node, l) in facet.nodes.iter().zip(&CORNERS_AND_MIDDLES) {
                points[*node as usize].get_or_insert_with(|| self.point(number as u32, l));
            }
        }
        points.into_iter().flatten().collect()
    }

    /// Bytes on the heap.
    pub fn memory(&self) -> usize {
        size_of_val(&self.facets[..])
            + size_of_val(&self.order[..])
            + size_of_val(&self.branches[..])
            + size_of_val(&self.nodes[..])
    }

    /// The surface point closest to `xi` [m], of equally close ones the one found first in a fixed
    /// order. From outside a convex body (and on it) a continuous function of `xi`; from inside it
    /// jumps where two facets are equally near: there use [`Self::locate_along`].
    pub fn locate(&self, xi: &Vec3) -> SurfacePoint {
        let (mut best_facet, mut best, mut best_distance) = (0u32, [1.0, 0.0, 0.0], f64::INFINITY);
        let mut stack = [0u32; DEEPEST];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let branch = &self.branches[stack[height] as usize];
            if box_distance(branch, xi) >= best_distance {
                continue;
            }
            if branch.count > 0 {
                for &facet in &self.order[branch.first as usize..(branch.first + branch.count) as usize] {
                    let corners = &self.facets[facet as usize].corners;
                    let l = closest_on_triangle(corners, xi);
                    let distance = (interpolate(corners, &l) - xi).norm_squared();
                    if distance < best_distance {
                        (best_facet, best, best_distance) = (facet, l, distance);
                    }
                }
            } else {
                let (left, right) = (branch.first, branch.first + 1);
                let left_first = box_distance(&self.branches[left as usize], xi)
                    <= box_distance(&self.branches[right as usize], xi);
                let (near, far) = if left_first { (left, right) } else { (right, left) };
                // The tree is balanced, so its depth stays far below the stack's.
                stack[height] = far;
                stack[height + 1] = near;
                height += 2;
            }
        }
        self.point(best_facet, &best)
    }

    /// Where the line from `xi` along `outward` leaves a convex body. With the contact normal as
    /// direction this is a continuous function of both, for `xi` inside or outside.
    ///
    /// Of a body with notches, the last place where it does; the point closest to `xi` where the line misses it or `outward` is zero.
    pub fn locate_along(&self, xi: &Vec3, outward: &Vec3) -> SurfacePoint {
        if self.notched {
            let last = |(best, found): (f64, Option<SurfacePoint>), facet: usize| match self
                .crossing(facet, xi, outward)
            {
                Some((travel, l)) if travel > best => (travel, Some(self.point(facet as u32, &l))),
                Some(_) | None => (best, found),
            };
            let (_, found) = (0..self.facets.len()).fold((f64::NEG_INFINITY, None), last);
            return found.unwrap_or_else(|| self.locate(xi));
        }
        let mut travel = f64::INFINITY;
        for facet in &self.facets {
            let speed = facet.normal.dot(outward);
            if speed > 0.0 {
                travel = travel.min(facet.normal.dot(&(facet.corners[0] - xi)) / speed);
            }
        }
        if travel.is_finite() { self.locate(&(xi + outward * travel)) } else { self.locate(xi) }
    }

    /// How far along `outward` from `xi` the line leaves the body through a facet, and where in it.
    fn crossing(&self, facet: usize, xi: &Vec3, outward: &Vec3) -> Option<(f64, [f64; 3])> {
        let Facet { corners: [a, b, c], normal, .. } = &self.facets[facet];
        let speed = normal.dot(outward);
        if !(speed > 0.0) {
            return None;
        }
        let travel = normal.dot(&(a - xi)) / speed;
        let x = xi + outward * travel;
        let whole = normal.dot(&(b - a).cross(&(c - a)));
        let share = |p: &Vec3, q: &Vec3| normal.dot(&(p - x).cross(&(q - x))) / whole;
        let l = [share(b, c), share(c, a), share(a, b)];
        l.iter().all(|l| *l >= -1e-9).then_some((travel, l))
    }

    /// A force at `at` spread over the facets that come closer than `radius` [m] to it: places and their shares, which sum to one. A facet takes
    /// its share as a uniform pressure does, by its middle nodes alone; shares go with the area and fall linearly with the distance.
    pub fn spread(&self, at: &SurfacePoint, radius: f64) -> Vec<(SurfacePoint, f64)> {
        let mut shares: Vec<(SurfacePoint, f64)> = Vec::new();
        let may_be_near = |facet: &Facet| (facet.corners[0] - at.position).norm() < radius + facet.reach;
        for (number, facet) in self.facets.iter().enumerate().filter(|(_, facet)| may_be_near(facet)) {
            let nearest = interpolate(&facet.corners, &closest_on_triangle(&facet.corners, &at.position));
            let near = 1.0 - (nearest - at.position).norm() / radius;
            if near > 0.0 {
                let mut place = self.point(number as u32, &[1.0 / 3.0; 3]);
                for (share, whole) in place.shares.iter_mut().zip([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]) {
                    share.1 = whole / 3.0;
                }
                shares.push((place, near * self.facet_area(number as u32)));
            }
        }
        let sum: f64 = shares.iter().map(|(_, share)| share).sum();
        if !(sum > 0.0) {
            return vec![(at.clone(), 1.0)];
        }
        shares.iter_mut().for_each(|(_, share)| *share /= sum);
        shares
    }

    /// The point of a facet with these area coordinates.
    pub(crate) fn point(&self, facet: u32, l: &[f64; 3]) -> SurfacePoint {
        let &Facet { corners, normal, nodes, .. } = &self.facets[facet as usize];
        let weights = [
            l[0] * (2.0 * l[0] - 1.0),
            l[1] * (2.0 * l[1] - 1.0),
            l[2] * (2.0 * l[2] - 1.0),
            4.0 * l[0] * l[1],
            4.0 * l[1] * l[2],
            4.0 * l[2] * l[0],
        ];
        let shares = nodes.into_iter().zip(weights).collect();
        SurfacePoint { facet, shares, position: interpolate(&corners, l), normal }
    }
}

fn interpolate(corners: &[Vec3; 3], l: &[f64; 3]) -> Vec3 {
    corners[0] * l[0] + corners[1] * l[1] + corners[2] * l[2]
}

/// Squared distance from a box; zero inside.
fn box_distance(branch: &Branch, x: &Vec3) -> f64 {
    (branch.low - x).sup(&(x - branch.high)).sup(&Vec3::zeros()).norm_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{cuboid_mesh, sphere_mesh};
    use crate::tensor::draws;

    fn points(count: usize) -> impl Iterator<Item = Vec3> {
        let mut draw = draws(9);
        (0..count).map(move |_| Vec3::new(draw(), draw(), draw()) * 3.0)
    }

    #[test]
    fn tree_search_finds_the_closest_facet() {
        let mesh = sphere_mesh(1.0, 0.4, None).expect("a mesh");
        let surface = Surface::new(&mesh);
        for x in points(500) {
            let found = surface.locate(&x);
            let nearest = surface
                .facets
                .iter()
                .map(|f| (interpolate(&f.corners, &closest_on_triangle(&f.corners, &x)) - x).norm())
                .fold(f64::INFINITY, f64::min);
            assert!(((found.position - x).norm() - nearest).abs() < 1e-14);
            assert!((found.shares.iter().map(|(_, w)| w).sum::<f64>() - 1.0).abs() < 1e-14);
            // Quadratic shape functions reproduce the position itself.
            let again: Vec3 =
                found.shares.iter().map(|&(k, w)| mesh.nodes[surface.nodes()[k as usize].index()] * w).sum();
            assert!((again - found.position).norm() < 1e-14);
        }
    }

    #[test]
    fn a_spread_force_is_the_force_and_stays_near() {
        let surface = Surface::new(&cuboid_mesh([1.0, 1.0, 1.0], 0.25).expect("a mesh"));
        let corner = surface.locate(&Vec3::repeat(1.0));
        let shares = surface.spread(&corner, 0.1);
        assert!((shares.iter().map(|(_, share)| share).sum::<f64>() - 1.0).abs() < 1e-14);
        // The facets at the corner of the three faces and no others.
        assert!(
            shares.len() >= 3
                && shares.iter().all(|(place, _)| (place.position - corner.position).norm() < 0.25)
        );
        assert!(
            shares
                .iter()
                .all(|(place, _)| (place.shares.iter().map(|(_, w)| w).sum::<f64>() - 1.0).abs() < 1e-14)
        );
        // In the middle of a face: as much on either side.
        let shares = surface.spread(&surface.locate(&Vec3::new(0.0, 0.0, 1.0)), 0.4);
        let middle: Vec3 = shares.iter().map(|(place, share)| place.position * *share).sum();
        assert!((middle - Vec3::new(0.0, 0.0, 0.5)).norm() < 0.02, "{middle}");
    }

    #[test]
    fn node_points_are_the_nodes() {
        let mesh = sphere_mesh(1.0, 0.5, None).expect("a mesh");
        let surface = Surface::new(&mesh);
        let points = surface.node_points();
        assert_eq!(points.len(), surface.nodes().len());
        for (number, (point, node)) in points.iter().zip(surface.nodes()).enumerate() {
            assert!((point.position - mesh.nodes[node.index()]).norm() < 1e-15);
            for (k, weight) in &point.shares {
                assert_eq!(*weight, if *k as usize == number { 1.0 } else { 0.0 });
            }
        }
    }

    #[test]
    fn line_leaves_the_box_where_it_should() {
        let surface = Surface::new(&cuboid_mesh([1.0, 1.0, 1.0], 0.5).expect("a mesh"));
        let x = Vec3::new(0.48, 0.49, 0.1);
        let found = surface.locate_along(&x, &Vec3::new(1.0, 1.0, 0.0).normalize());
        assert!((found.position - Vec3::new(0.49, 0.5, 0.1)).norm() < 1e-14);
        let outside = surface.locate_along(&Vec3::new(0.2, 0.7, 0.1), &Vec3::y());
        assert!((outside.position - Vec3::new(0.2, 0.5, 0.1)).norm() < 1e-14);
        assert_eq!(surface.locate_along(&x, &Vec3::zeros()), surface.locate(&x));
    }
}
