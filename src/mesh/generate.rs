//! Mesh generators: grains and other convex polyhedra, boxes, spheres.

use crate::error::{Error, Result};
use crate::geometry::Polyhedron;
use crate::mesh::improve::{lift_worst, smooth};
use crate::mesh::refine::{refine_to_count, refine_to_size};
use crate::mesh::tet10::{Mesh, NodeId};
use crate::mesh::tetrahedra::{Freedom, Tetrahedra};
use crate::tensor::Vec3;

/// Below this radius ratio the worst cell of a generated mesh gets extra work.
const WANTED_RADIUS_RATIO: f64 = 0.2;
/// How a grain is cut, one attempt after the other: what an edge inside the body counts of its length
/// when the longest is sought, how many more cells than asked, and the worst radius ratio from which
/// the best mesh so far is good enough to skip the attempt. The first cuts the surface first, which
/// spreads the nodes over it, where contact needs them; one grain in a hundred needs the next, one in
/// a thousand those that follow.
const ATTEMPTS: [(f64, usize, f64); 10] = [
    (0.75, 0, WANTED_RADIUS_RATIO),
    (1.0, 0, WANTED_RADIUS_RATIO),
    (0.5, 0, WANTED_RADIUS_RATIO),
    (1.4, 0, WANTED_RADIUS_RATIO),
    (0.75, 3, 0.15),
    (1.0, 3, 0.15),
    (0.75, 6, 0.15),
    (1.0, 6, 0.15),
    (0.75, 9, 0.12),
    (1.0, 12, 0.12),
];
/// Largest number of cells of one generated mesh.
pub const MOST_CELLS: usize = 2_000_000;

/// Mesh of a convex grain with about `cells` cells (as near as whole edge cuts come, at least one per
/// facet, up to a dozen more for a grain that meshes badly): a fan from an inner point, longest-edge bisection, smoothing.
///
/// The surface stays exactly that of `shape`. The result depends on `shape` and `cells` only.
/// Errors ([`Error::Mesh`]) where the shape is not convex or has no volume.
pub fn grain_mesh(shape: &Polyhedron, cells: usize) -> Result<Mesh> {
    let fan = fan(shape)?;
    let mut best: Option<(f64, Tetrahedra)> = None;
    for (inner_edge, more, enough) in ATTEMPTS {
        if best.as_ref().is_some_and(|(worst, _)| *worst >= enough) {
            break;
        }
        let mut mesh = fan.clone();
        refine_to_count(&mut mesh, cells + more, inner_edge);
        improve(&mut mesh);
        let worst = mesh.worst_quality();
        if best.as_ref().is_none_or(|(other, _)| worst > *other) {
            best = Some((worst, mesh));
        }
    }
    finish("grain", best.map_or(fan, |(_, mesh)| mesh))
}

/// Mesh of a convex polyhedron with no edge longer than `mesh_size` [m] before smoothing.
///
/// Errors ([`Error::Mesh`]) as [`grain_mesh`], and where the size is not positive or too small.
pub fn polyhedron_mesh(shape: &Polyhedron, mesh_size: f64) -> Result<Mesh> {
    check_size("polyhedron", mesh_size)?;
    let mut mesh = fan(shape)?;
    if !refine_to_size(&mut mesh, |_| mesh_size, MOST_CELLS) {
        return Err(too_many("polyhedron"));
    }
    improve(&mut mesh);
    finish("polyhedron", mesh)
}

/// Structured mesh of a box centred on the origin with full edge lengths `size` [m]: bricks no
/// longer than `mesh_size` [m] a side, six tetrahedra each.
///
/// Errors ([`Error::Mesh`]) where a length is not positive or there would be too many cells.
pub fn cuboid_mesh(size: [f64; 3], mesh_size: f64) -> Result<Mesh> {
    check_size("box", mesh_size)?;
    for length in size {
        check_size("box", length)?;
    }
    // The small margin keeps 0.3 / 0.1 at three bricks.
    let counts = size.map(|length| ((length / mesh_size - 1e-9).ceil()).max(1.0));
    if 6.0 * counts.iter().product::<f64>() > MOST_CELLS as f64 {
        return Err(too_many("box"));
    }
    let [nx, ny, nz] = counts.map(|count| count as usize);
    let index = |i: usize, j: usize, k: usize| ((k * (ny + 1) + j) * (nx + 1) + i) as u32;
    let mut points = Vec::with_capacity((nx + 1) * (ny + 1) * (nz + 1));
    for k in 0..=nz {
        for j in 0..=ny {
            for i in 0..=nx {
                points.push(Vec3::new(
                    size[0] * (i as f64 / nx as f64 - 0.5),
                    size[1] * (j as f64 / ny as f64 - 0.5),
                    size[2] * (k as f64 / nz as f64 - 0.5),
                ));
            }
        }
    }
    // Kuhn's subdivision: one tetrahedron per order in which the three axes are walked.
    const WALKS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let mut cells = Vec::with_capacity(6 * nx * ny * nz);
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                for walk in WALKS {
                    let mut at = [i, j, k];
                    let mut cell = [index(i, j, k); 4];
                    for (corner, axis) in walk.into_iter().enumerate() {
                        at[axis] += 1;
                        cell[corner + 1] = index(at[0], at[1], at[2]);
                    }
                    cells.push(cell);
                }
            }
        }
    }
    Mesh::from_tetrahedra("box", points, &cells)
}

/// A ball in which a mesh is finer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearPoint {
    /// Its centre [m].
    pub point: Vec3,
    /// Its radius, positive [m].
    pub radius: f64,
    /// Edge length inside it [m].
    pub mesh_size: f64,
    /// Growth, positive, of the edge length with the distance from the ball [m/m]; 0.3 grades gently.
    pub growth: f64,
}

/// Mesh of a sphere about the origin: edges no longer than `mesh_size` [m] before smoothing, finer in
/// `near`. Surface corners lie on the sphere, cells are straight-sided, so the volume is a little
/// below the sphere's (by at most about `3/8 (mesh_size / radius)^2`).
///
/// Errors ([`Error::Mesh`]) where a length is not positive or there would be too many cells.
pub fn sphere_mesh(radius: f64, mesh_size: f64, near: Option<&NearPoint>) -> Result<Mesh> {
    check_size("sphere", radius)?;
    check_size("sphere", mesh_size)?;
    if let Some(near) = near {
        check_size("sphere", near.mesh_size)?;
        check_size("sphere", near.growth)?;
        check_size("sphere", near.radius)?;
    }
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut corners = Vec::with_capacity(12);
    for (s, t) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        corners.extend([Vec3::new(0.0, s, t), Vec3::new(s, t, 0.0), Vec3::new(t, 0.0, s)]);
    }
    corners.iter_mut().for_each(|p| *p *= radius / p.norm());
    let icosahedron = Polyhedron::convex_hull(&corners)?;
    let centre = icosahedron.vertices.len() as u32;
    let cells = icosahedron.facets.iter().map(|f| [centre, f[0] as u32, f[1] as u32, f[2] as u32]).collect();
    let mut freedom = vec![Freedom::Sphere(radius); icosahedron.vertices.len()];
    freedom.push(Freedom::Planes(Vec::new()));
    let mut points = icosahedron.vertices;
    points.push(Vec3::zeros());
    let mut mesh = Tetrahedra::new(points, freedom, cells, Vec::new());
    let size = |x: &Vec3| match near {
        Some(near) => {
            let outside = ((x - near.point).norm() - near.radius).max(0.0);
            mesh_size.min(near.mesh_size + near.growth * outside)
        }
        None => mesh_size,
    };
    if !refine_to_size(&mut mesh, size, MOST_CELLS) {
        return Err(too_many("sphere"));
    }
    improve(&mut mesh);
    finish("sphere", mesh)
}

/// What a mesh of [`sphere_mesh`] touches others by: the convex hull of its surface nodes, middle nodes put out onto the sphere.
///
/// Gaps are then the sphere's at all nodes; left to the corners alone, middle nodes would sink in between.
pub fn sphere_hull(mesh: &Mesh, radius: f64) -> Result<Polyhedron> {
    let nodes = mesh.surface_nodes();
    let put_out = |node: &NodeId| mesh.nodes[node.index()].normalize() * radius;
    Polyhedron::convex_hull(&nodes.iter().map(put_out).collect::<Vec<_>>())
}

fn improve(mesh: &mut Tetrahedra) {
    // Random search gains little per sweep on large meshes, whose cells bisection leaves good.
    let sweeps = if mesh.cells.len() <= 1000 { 60 } else { 8 };
    smooth(mesh, sweeps);
    lift_worst(mesh, WANTED_RADIUS_RATIO, 40);
}

/// Tetrahedra from an inner point to every facet, the point where the worst of them is best.
fn fan(shape: &Polyhedron) -> Result<Tetrahedra> {
    let fail = |message: &str| Error::Mesh { name: "polyhedron".into(), message: message.into() };
    let solid = !shape.facets.is_empty() && shape.volume() > 0.0;
    if !solid {
        return Err(fail("has no volume"));
    }
    let centroid = shape.centroid();
    let size = shape.vertices.iter().map(|v| (v - centroid).norm()).fold(0.0, f64::max);
    // Facets in one plane (up to rounding) share it.
    let tolerance = 1e-9 * size;
    let mut planes: Vec<(Vec3, f64)> = Vec::new();
    let mut plane_of = Vec::with_capacity(shape.facets.len());
    for (facet, normal) in shape.facets.iter().zip(&shape.normals) {
        let offset = normal.dot(&shape.vertices[facet[0]]);
        if shape.vertices.iter().any(|v| normal.dot(v) > offset + 1e3 * tolerance) {
            return Err(fail("is not convex"));
        }
        let known = planes.iter().position(|(other, d)| {
            facet.iter().all(|&v| (other.dot(&shape.vertices[v]) - d).abs() <= tolerance)
        });
        plane_of.push(known.unwrap_or(planes.len()) as u32);
        if known.is_none() {
            planes.push((*normal, offset));
        }
    }
    let mut on: Vec<Vec<u32>> = vec![Vec::new(); shape.vertices.len()];
    for (facet, &plane) in shape.facets.iter().zip(&plane_of) {
        for &vertex in facet {
            if !on[vertex].contains(&plane) {
                on[vertex].push(plane);
            }
        }
    }
    on.iter_mut().for_each(|planes| planes.sort_unstable());
    let centre = shape.vertices.len() as u32;
    let mut points = shape.vertices.clone();
    points.push(centroid);
    let mut freedom: Vec<Freedom> = on.into_iter().map(Freedom::Planes).collect();
    // While the centre is sought the vertices must not slide.
    let normals = planes.into_iter().map(|(normal, _)| normal).collect();
    let cells = shape.facets.iter().map(|f| [centre, f[0] as u32, f[1] as u32, f[2] as u32]).collect();
    freedom.push(Freedom::Planes(Vec::new()));
    let mut mesh = Tetrahedra::new(points, freedom, cells, normals);
    smooth(&mut mesh, 60);
    Ok(mesh)
}

fn finish(name: &str, mesh: Tetrahedra) -> Result<Mesh> {
    if mesh.worst_quality() <= 0.0 {
        let message = "a cell has no volume; ask for a smaller mesh size or gentler local refinement";
        return Err(Error::Mesh { name: name.into(), message: message.into() });
    }
    Mesh::from_tetrahedra(name, mesh.points, &mesh.cells)
}

fn check_size(name: &str, length: f64) -> Result<()> {
    if length > 0.0 && length.is_finite() {
        return Ok(());
    }
    Err(Error::Mesh { name: name.into(), message: format!("the size {length} is not positive") })
}

fn too_many(name: &str) -> Error {
    Error::Mesh {
        name: name.into(),
        message: format!("the mesh size needs more than {MOST_CELLS} cells; ask for a larger one"),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::mesh::quality::QualityReport;

    fn closed_surface(mesh: &Mesh) -> bool {
        let mut edges = std::collections::BTreeMap::<[u32; 2], i32>::new();
        for facet in &mesh.surface {
            for k in 0..3 {
                let (a, b) = (facet.nodes[k].0, facet.nodes[(k + 1) % 3].0);
                *edges.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
            }
        }
        edges.values().all(|&sum| sum == 0)
    }

    #[test]
    fn box_meshes() {
        let mesh = cuboid_mesh([0.3, 0.2, 0.1], 0.1).expect("a mesh");
        assert_eq!(mesh.cells.len(), 36);
        assert!((mesh.volume() - 0.006).abs() < 1e-15);
        assert!((mesh.surface_area() - 0.22).abs() < 1e-15);
        assert!(closed_surface(&mesh) && mesh.centroid().norm() < 1e-15);
        assert!(cuboid_mesh([1.0, 0.0, 1.0], 0.1).is_err());
        assert!(cuboid_mesh([1.0, 1.0, 1.0], 1e-4).is_err());
        assert!(cuboid_mesh([1.0, 1.0, 1.0], f64::NAN).is_err());
        let shape = Polyhedron::cuboid([0.3, 0.2, 0.1]).expect("a box");
        let mesh = polyhedron_mesh(&shape, 0.06).expect("a mesh");
        assert!((mesh.volume() - 0.006).abs() < 1e-14);
        let report = QualityReport::of(&mesh);
        assert!(report.worst_radius_ratio > 0.1, "{report:?}");
    }

    #[test]
    fn sphere_meshes_converge_to_the_sphere() {
        let mut last = f64::INFINITY;
        for size in [0.6, 0.3] {
            let mesh = sphere_mesh(1.0, size, None).expect("a mesh");
            let missing = 1.0 - mesh.volume() / (4.0 / 3.0 * PI);
            // A triangle of edge h under the sphere misses h^2 / 8R of height on average: 3/8 (h/R)^2.
            assert!(missing > 0.0 && missing < 0.375 * size * size, "{size}: {missing}");
            assert!(missing < 0.5 * last, "second order: {missing} after {last}");
            last = missing;
            let report = QualityReport::of(&mesh);
            assert!(closed_surface(&mesh) && report.worst_radius_ratio > 0.1, "{report:?}");
        }
    }

    #[test]
    fn sphere_is_fine_near_the_pole() {
        let near =
            NearPoint { point: Vec3::new(0.0, 0.0, 0.012), radius: 3e-4, mesh_size: 1e-4, growth: 0.3 };
        let mesh = sphere_mesh(0.012, 0.004, Some(&near)).expect("a mesh");
        let report = QualityReport::of(&mesh);
        assert!(closed_surface(&mesh) && report.worst_radius_ratio > 0.1, "{report:?}");
        for facet in &mesh.surface {
            let x = [0, 1, 2].map(|k| mesh.nodes[facet.nodes[k].index()]);
            assert!(x.iter().all(|p| (p.norm() - 0.012).abs() < 1e-12));
            if x.iter().all(|p| (p - near.point).norm() < near.radius) {
                let longest = (0..3).map(|k| (x[k] - x[(k + 1) % 3]).norm()).fold(0.0, f64::max);
                assert!(longest < 1.6 * near.mesh_size, "{longest}");
            }
        }
    }
}
