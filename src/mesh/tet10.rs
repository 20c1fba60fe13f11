//! The tet10 mesh: nodes, cells, outward surface facets, volumes and connected parts.

use std::collections::{BTreeMap, HashMap};

use crate::error::{Error, Result};
use crate::geometry::Polyhedron;
use crate::tensor::{Mat3, Vec3};

/// Index of a node in its mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u32);

/// Index of a cell in its mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CellId(pub u32);

impl NodeId {
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

impl CellId {
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// Corner pairs of the six edges, in the order of a cell's mid-side nodes 4 to 9.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];

/// The four facets: three corners counter-clockwise from outside, then the nodes in the middle of
/// the edges 01, 12 and 20 of the facet.
pub const FACETS: [[usize; 6]; 4] =
    [[1, 2, 3, 5, 9, 8], [0, 3, 2, 7, 9, 6], [0, 1, 3, 4, 8, 7], [0, 2, 1, 6, 5, 4]];

/// A facet on the surface: three corners counter-clockwise from outside, then the middles of its
/// edges 01, 12, 20; and the cell behind it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SurfaceFacet {
    pub nodes: [NodeId; 6],
    pub cell: CellId,
}

/// A straight-sided tet10 mesh in body coordinates [m].
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    pub nodes: Vec<Vec3>,
    pub cells: Vec<[NodeId; 10]>,
    /// Outward facets that belong to one cell only, in cell order.
    pub surface: Vec<SurfaceFacet>,
}

impl Mesh {
    /// Promotes linear tetrahedra: corners keep their numbers, mid-side nodes follow.
    ///
    /// Cells with negative volume are turned round. Errors ([`Error::Mesh`]) where a corner does not
    /// exist or is not finite, a cell is flat, or three cells share a facet.
    pub fn from_tetrahedra(name: &str, corners: Vec<Vec3>, cells: &[[u32; 4]]) -> Result<Self> {
        let fail = |message: String| Error::Mesh { name: name.into(), message };
        if cells.is_empty() {
            return Err(fail("has no tetrahedra".into()));
        }
        if let Some(bad) = corners.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
            return Err(fail(format!("node {bad} has a coordinate that is not finite")));
        }
        let mut nodes = corners;
        let corner_count = nodes.len();
        let mut middles = HashMap::<[u32; 2], NodeId>::new();
        let mut tet10 = Vec::with_capacity(cells.len());
        for (index, cell) in cells.iter().enumerate() {
            if let Some(bad) = cell.iter().find(|&&node| node as usize >= corner_count) {
                return Err(fail(format!("cell {index} names node {bad}; there are {corner_count}")));
            }
            let mut cell = *cell;
            let points = cell.map(|node| nodes[node as usize]);
            let volume = signed_volume(&points);
            let longest = EDGES.iter().map(|&[i, j]| (points[i] - points[j]).norm()).fold(0.0, f64::max);
            let flat = 1e-12 * longest.powi(3);
            if volume.abs() <= flat || volume.is_nan() {
                return Err(fail(format!("cell {index} is flat (volume {volume:.3e} m^3)")));
            }
            if volume < 0.0 {
                cell.swap(2, 3);
            }
            let mut all = [NodeId(0); 10];
            for (slot, &node) in all.iter_mut().zip(&cell) {
                *slot = NodeId(node);
            }
            for (k, &[i, j]) in EDGES.iter().enumerate() {
                let (a, b) = (cell[i].min(cell[j]), cell[i].max(cell[j]));
                let middle = match middles.get(&[a, b]) {
                    Some(&node) => node,
                    None => {
                        let node = NodeId(
                            u32::try_from(nodes.len()).map_err(|_| fail("has too many nodes".into()))?,
                        );
                        nodes.push((nodes[a as usize] + nodes[b as usize]) * 0.5);
                        middles.insert([a, b], node);
                        node
                    }
                };
                all[4 + k] = middle;
            }
            tet10.push(all);
        }
        let surface = surface_of(&tet10).map_err(fail)?;
        Ok(Mesh { nodes, cells: tet10, surface })
    }

    /// The four corners of a cell.
    pub fn corners(&self, cell: CellId) -> [Vec3; 4] {
        let nodes = &self.cells[cell.index()];
        [0, 1, 2, 3].map(|k| self.nodes[nodes[k].index()])
    }

    /// All cell numbers.
    pub fn cell_ids(&self) -> impl Iterator<Item = CellId> + use<> {
        (0..self.cells.len() as u32).map(CellId)
    }

    /// Volume of one cell [m^3].
    pub fn cell_volume(&self, cell: CellId) -> f64 {
        signed_volume(&self.corners(cell))
    }

    /// The same shifted by `way` [m].
    pub fn moved(mut self, way: &Vec3) -> Self {
        self.nodes.iter_mut().for_each(|node| *node += way);
        self
    }

    /// Volume of the mesh [m^3].
    pub fn volume(&self) -> f64 {
        self.cell_ids().map(|cell| self.cell_volume(cell)).sum()
    }

    /// Area of the surface [m^2].
    pub fn surface_area(&self) -> f64 {
        self.surface.iter().map(|facet| 0.5 * self.area_vector(facet).norm()).sum()
    }

    /// Twice the outward area vector of a facet [m^2].
    fn area_vector(&self, facet: &SurfaceFacet) -> Vec3 {
        let [a, b, c] = [0, 1, 2].map(|k| self.nodes[facet.nodes[k].index()]);
        (b - a).cross(&(c - a))
    }

    /// Centre of volume [m].
    pub fn centroid(&self) -> Vec3 {
        let mut moment = Vec3::zeros();
        for cell in self.cell_ids() {
            moment += self.corners(cell).iter().sum::<Vec3>() * (0.25 * self.cell_volume(cell));
        }
        moment / self.volume()
    }

    /// Second moment of volume about the origin, `integral of x x^T dV` [m^5].
    pub fn second_moment(&self) -> Mat3 {
        let mut moment = Mat3::zeros();
        for cell in self.cell_ids() {
            let corners = self.corners(cell);
            let sum: Vec3 = corners.iter().sum();
            let squares: Mat3 = corners.iter().map(|p| p * p.transpose()).sum();
            moment += (squares + sum * sum.transpose()) * (self.cell_volume(cell) / 20.0);
        }
        moment
    }

    /// Nodes on the surface, ascending.
    pub fn surface_nodes(&self) -> Vec<NodeId> {
        let mut nodes: Vec<NodeId> = self.surface.iter().flat_map(|facet| facet.nodes).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Corners of the surface's facets [m].
    pub fn surface_corners(&self) -> Vec<Vec3> {
        let mut corners: Vec<NodeId> =
            self.surface.iter().flat_map(|facet| [facet.nodes[0], facet.nodes[1], facet.nodes[2]]).collect();
        corners.sort_unstable();
        corners.dedup();
        corners.iter().map(|node| self.nodes[node.index()]).collect()
    }

    /// Convex hull of the surface corners, for contact.
    pub fn convex_hull(&self) -> Result<Polyhedron> {
        Polyhedron::convex_hull(&self.surface_corners())
    }

    /// Parts of the mesh that share facets, each a list of ascending cells; the part with the
    /// smallest cell first. Cells that touch only along an edge or at a node are not connected:
    /// such a hinge carries no moment.
    pub fn connected_parts(&self) -> Vec<Vec<CellId>> {
        self.connected_parts_of(|_| true)
    }

    /// [`Self::connected_parts`] of the cells for which `alive` holds.
    pub fn connected_parts_of(&self, alive: impl Fn(CellId) -> bool) -> Vec<Vec<CellId>> {
        let neighbours = self.neighbours_among(&alive);
        let mut seen = vec![false; self.cells.len()];
        let mut parts = Vec::new();
        for start in self.cell_ids().filter(|&cell| alive(cell)) {
            if std::mem::replace(&mut seen[start.index()], true) {
                continue;
            }
            let mut part = vec![start];
            let mut next = 0;
            while next < part.len() {
                for &(other, _) in &neighbours[part[next].index()] {
                    if !std::mem::replace(&mut seen[other.index()], true) {
                        part.push(other);
                    }
                }
                next += 1;
            }
            part.sort_unstable();
            parts.push(part);
        }
        parts
    }

    /// For each cell those that share a facet with it, and the facet's area [m^2], among the cells for which `alive` holds.
    pub fn neighbours_among(&self, alive: impl Fn(CellId) -> bool) -> Vec<Vec<(CellId, f64)>> {
        let mut beside = BTreeMap::<[NodeId; 3], Vec<CellId>>::new();
        for cell in self.cell_ids().filter(|&cell| alive(cell)) {
            for facet in &FACETS {
                beside.entry(facet_key(&self.cells[cell.index()], facet)).or_default().push(cell);
            }
        }
        let mut neighbours = vec![Vec::new(); self.cells.len()];
        for (corners, cells) in &beside {
            if let [one, two] = cells[..] {
                let [a, b, c] = corners.map(|node| self.nodes[node.index()]);
                let area = 0.5 * (b - a).cross(&(c - a)).norm();
                neighbours[one.index()].push((two, area));
                neighbours[two.index()].push((one, area));
            }
        }
        neighbours
    }

    /// The mesh of some of the cells, with the node each of its nodes had here.
    pub fn part(&self, cells: &[CellId]) -> Result<(Mesh, Vec<NodeId>)> {
        let mut origin: Vec<NodeId> = cells.iter().flat_map(|cell| self.cells[cell.index()]).collect();
        origin.sort_unstable();
        origin.dedup();
        let renumbered = |node: &NodeId| NodeId(origin.partition_point(|old| old < node) as u32);
        let cells: Vec<[NodeId; 10]> =
            cells.iter().map(|cell| self.cells[cell.index()].each_ref().map(renumbered)).collect();
        let surface =
            surface_of(&cells).map_err(|message| Error::Mesh { name: "grain part".into(), message })?;
        let nodes = origin.iter().map(|node| self.nodes[node.index()]).collect();
        Ok((Mesh { nodes, cells, surface }, origin))
    }
}

/// Volume of a tetrahedron [m^3], positive where corners 1, 2, 3 are counter-clockwise from outside.
pub fn signed_volume([a, b, c, d]: &[Vec3; 4]) -> f64 {
    (b - a).dot(&(c - a).cross(&(d - a))) / 6.0
}

fn facet_key(cell: &[NodeId; 10], facet: &[usize; 6]) -> [NodeId; 3] {
    let mut key = [cell[facet[0]], cell[facet[1]], cell[facet[2]]];
    key.sort_unstable();
    key
}

/// Facets of one cell only, in cell order; the message names a facet of more than two cells.
fn surface_of(cells: &[[NodeId; 10]]) -> std::result::Result<Vec<SurfaceFacet>, String> {
    let mut count = HashMap::<[NodeId; 3], u32>::with_capacity(2 * cells.len());
    for cell in cells {
        for facet in &FACETS {
            *count.entry(facet_key(cell, facet)).or_default() += 1;
        }
    }
    let mut surface = Vec::new();
    for (index, cell) in cells.iter().enumerate() {
        for facet in &FACETS {
            let key = facet_key(cell, facet);
            match count[&key] {
                1 => surface.push(SurfaceFacet { nodes: facet.map(|k| cell[k]), cell: CellId(index as u32) }),
                2 => {}
                n => return Err(format!("the facet {:?} belongs to {n} cells", key.map(|node| node.0))),
            }
        }
    }
    Ok(surface)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_cells() -> Mesh {
        let p = |x: f64, y: f64, z: f64| Vec3::new(x, y, z);
        let corners = vec![p(0., 0., 0.), p(1., 0., 0.), p(0., 1., 0.), p(0., 0., 1.), p(1., 1., 1.)];
        // The second one is the wrong way round on purpose.
        Mesh::from_tetrahedra("two", corners, &[[0, 1, 2, 3], [1, 2, 3, 4]]).expect("a mesh")
    }

    #[test]
    fn facets_are_outward_with_their_middles() {
        let mesh = two_cells();
        assert_eq!(mesh.surface.len(), 6);
        let centre = mesh.centroid();
        let mut total = Vec3::zeros();
        for facet in &mesh.surface {
            let x = facet.nodes.map(|node| mesh.nodes[node.index()]);
            for (k, [i, j]) in [[0, 1], [1, 2], [2, 0]].into_iter().enumerate() {
                assert!((x[3 + k] - (x[i] + x[j]) * 0.5).norm() < 1e-15);
            }
            let normal = mesh.area_vector(facet);
            assert!(normal.dot(&(x[0] - centre)) > 0.0);
            total += normal;
        }
        assert!(total.norm() < 1e-15, "the surface is closed");
        for cell in mesh.cell_ids() {
            assert!(mesh.cell_volume(cell) > 0.0);
            let nodes = mesh.cells[cell.index()];
            for (k, [i, j]) in EDGES.into_iter().enumerate() {
                let middle = (mesh.nodes[nodes[i].index()] + mesh.nodes[nodes[j].index()]) * 0.5;
                assert!((mesh.nodes[nodes[4 + k].index()] - middle).norm() < 1e-15);
            }
        }
    }

    #[test]
    fn parts_come_apart_at_an_edge() {
        let mesh = two_cells();
        assert_eq!(mesh.connected_parts().len(), 1);
        assert_eq!(mesh.connected_parts_of(|cell| cell.0 == 1), vec![vec![CellId(1)]]);
        let (part, origin) = mesh.part(&[CellId(1)]).expect("a part");
        assert_eq!((part.nodes.len(), part.surface.len(), origin.len()), (10, 4, 10));
        assert!((part.volume() - mesh.cell_volume(CellId(1))).abs() < 1e-15);
        let p = |x: f64, y: f64, z: f64| Vec3::new(x, y, z);
        let corners =
            vec![p(0., 0., 0.), p(1., 0., 0.), p(0., 1., 0.), p(0., 0., 1.), p(0., -1., 0.), p(0., 0., -1.)];
        let hinge = Mesh::from_tetrahedra("hinge", corners, &[[0, 1, 2, 3], [0, 1, 4, 5]]).expect("a mesh");
        assert_eq!(hinge.connected_parts().len(), 2);
    }

    #[test]
    fn bad_cells_are_refused() {
        let corners = vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::new(0.3, 0.3, 0.0)];
        assert!(Mesh::from_tetrahedra("flat", corners.clone(), &[[0, 1, 2, 3]]).is_err());
        assert!(Mesh::from_tetrahedra("missing", corners, &[[0, 1, 2, 7]]).is_err());
        assert!(Mesh::from_tetrahedra("nan", vec![Vec3::repeat(f64::NAN); 4], &[[0, 1, 2, 3]]).is_err());
        assert!(Mesh::from_tetrahedra("empty", vec![], &[]).is_err());
    }
}
