//! Meshes from files: VTK XML unstructured grids (`.vtu`) and Gmsh's (`.msh`).
//!
//! Tetrahedra (cell type 10) and quadratic tetrahedra with straight sides (24) are read; cells of
//! lower dimension are ignored; anything else is refused. Lengths are metres.
//! Sources: `mesh::encoded` and `mesh::formats`, which read them.

use std::path::Path;

use crate::error::{Error, Result};
use crate::geometry::Polyhedron;
use crate::input;
use crate::mesh::encoded::{Cells, vtu};
use crate::mesh::formats;
use crate::mesh::tet10::{EDGES, Mesh, NodeId, SurfaceFacet};
use crate::tensor::Vec3;

/// How a case takes points alone.
const HULL: &str = "{\"hull\": {\"file\": …, \"unit\": \"m\"}}";
/// Largest distance of a mid-side node from the middle of its edge, over the length of the edge.
const STRAIGHT: f64 = 1e-6;
/// Largest part by which the convex hull may exceed the mesh in volume: a mesh generator's triangles on a curved surface leave dents (measured with
/// Gmsh: balls 4e-5, ellipsoids up to 4e-3, cylinders 8e-3, cones 2e-2), of the size of what the triangles cut off anyway.
const CONVEX: f64 = 0.02;
/// Largest part by which cells may exceed their convex hull in volume: rounding.
const OVERLAP: f64 = 1e-6;

/// Reads a mesh and checks that it is one convex body.
///
/// Linear tetrahedra get straight mid-side nodes; unused nodes are dropped.
/// Errors: [`Error::Io`] where the file cannot be read; [`Error::Mesh`], naming the file, where it is
/// not a .vtu or .msh of tetrahedra, a cell is flat or curved, the cells do not form one part, or the
/// body is not convex (contact needs convex bodies for now).
pub fn read_mesh(path: &Path) -> Result<Mesh> {
    let bytes = input::read_named(path).map_err(|source| Error::io("read", path, source))?;
    let read = match formats::ending(path).as_str() {
        "msh" => formats::gmsh(&bytes),
        _ => vtu(&bytes),
    };
    mesh_of(&path.display().to_string(), read).map_err(|fault| match fault {
        // Its grains share no nodes, and in later states cells are curved.
        Error::Mesh { name, message } if holds_all_bodies(&bytes) => Error::Mesh {
            name,
            message: format!(
                "{message}; riprap export wrote it of all bodies of a state: for one of them take \
                 riprap export --stl and {HULL}"
            ),
        },
        other => other,
    })
}

/// Whether it is a state that riprap exported: its cells say which grain they are of.
fn holds_all_bodies(bytes: &[u8]) -> bool {
    const OF_GRAINS: &[u8] = b"Name=\"grain\"";
    bytes.windows(OF_GRAINS.len()).any(|window| window == OF_GRAINS)
}

/// The mesh of what was read; `name` is what errors call it.
fn mesh_of(name: &str, read: std::result::Result<Cells, String>) -> Result<Mesh> {
    let corners = read.and_then(|read| corners_of(read.points, &read.cells));
    convex_body(name, corners.map_err(|message| Error::Mesh { name: name.into(), message })?)
}

/// The mesh of these tetrahedra, if it is one convex body.
fn convex_body(name: &str, (points, cells): Corners) -> Result<Mesh> {
    let fail = |message: String| Error::Mesh { name: name.into(), message };
    let mesh = Mesh::from_tetrahedra(name, points, &cells)?;
    let parts = mesh.connected_parts().len();
    if parts != 1 {
        return Err(fail(format!(
            "falls into {parts} parts that share no facet; merge coincident nodes or use one file a body"
        )));
    }
    let hull = mesh.convex_hull()?;
    let (filled, volume) = (hull.volume(), mesh.volume());
    if filled > volume * (1.0 + CONVEX) {
        return Err(fail(format!(
            "is not convex (its convex hull has {filled:.6e} m^3, the cells {volume:.6e} m^3); \
             contact needs convex bodies: split it into convex parts"
        )));
    }
    if volume > filled * (1.0 + OVERLAP) {
        return Err(fail(format!(
            "has cells that overlap: they hold {volume:.6e} m^3, their convex hull {filled:.6e} m^3"
        )));
    }
    if let Some(problem) = hidden_crack(&mesh, &hull) {
        return Err(fail(problem));
    }
    Ok(mesh)
}

/// Facets further below the hull than this share of their own size lie inside the body (measured with Gmsh on curved surfaces: up to 0.09).
const INSIDE: f64 = 0.1;
/// Of those that lie less deep, others look straight at them: normals more opposite than this cosine.
const FACING: f64 = 0.5;
/// Nodes nearer to each other than this share of the body's size lie at the same place.
const SAME: f64 = 1e-6;

/// What lets a body open or slide inside, though it is in one piece: nodes at the same place that are not one, or surface inside of its convex
/// hull, where two meshes meet and share no nodes.
fn hidden_crack(mesh: &Mesh, hull: &Polyhedron) -> Option<String> {
    let place = |node: NodeId| mesh.nodes[node.index()];
    let size = hull.size();
    // Mid-side nodes come and go with the corners.
    let mut nodes: Vec<NodeId> = mesh.surface.iter().flat_map(|facet| facet.nodes[..3].to_vec()).collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes.sort_by(|a, b| place(*a).x.total_cmp(&place(*b).x));
    let near = |(k, node): (usize, &NodeId)| {
        let next = nodes[k + 1..].iter().take_while(|other| place(**other).x - place(*node).x < SAME * size);
        next.copied().find(|other| (place(*other) - place(*node)).norm() < SAME * size)
    };
    let doubled: Vec<NodeId> = nodes.iter().enumerate().filter_map(near).collect();
    if let Some(first) = doubled.first() {
        let [x, y, z] = place(*first).into();
        return Some(format!(
            "has {} nodes at places where it has another one, the first at ({x:.4e}, {y:.4e}, {z:.4e}) m: a hidden crack; merge coincident nodes",
            doubled.len()
        ));
    }
    let corners = |facet: &SurfaceFacet| [0, 1, 2].map(|k| place(facet.nodes[k]));
    let inside = |facet: &&SurfaceFacet| {
        let [a, b, c] = corners(facet);
        let (middle, spanned) = ((a + b + c) / 3.0, (b - a).cross(&(c - a)));
        let heights = hull.facets.iter().zip(&hull.normals);
        let highest =
            heights.map(|(f, n)| n.dot(&(middle - hull.vertices[f[0]]))).fold(f64::NEG_INFINITY, f64::max);
        let normal = spanned.normalize();
        let met = |other: &SurfaceFacet| is_met(&corners(other), &middle, &normal, SAME * size);
        // A facet just below the hull is of a dent, or of a crack in a thin layer: then another one looks at it.
        highest < -INSIDE * spanned.norm().sqrt() || (highest < -SAME * size && mesh.surface.iter().any(met))
    };
    let count = mesh.surface.iter().filter(inside).count();
    (count > 0).then(|| {
        format!(
            "has {count} facets of its surface inside, where two meshes meet and share no nodes: a hidden crack; mesh both sides of it alike \
             and merge coincident nodes"
        )
    })
}

/// Whether a triangle, counter-clockwise from outside, looks back at a point that looks along `normal`: it lies in front of it, at most
/// `behind` [m] behind.
fn is_met([a, b, c]: &[Vec3; 3], point: &Vec3, normal: &Vec3, behind: f64) -> bool {
    let spanned = (b - a).cross(&(c - a));
    let against = -normal.dot(&spanned);
    if !(against > FACING * spanned.norm()) {
        return false;
    }
    let distance = spanned.dot(&(point - a)) / against;
    let struck = point + normal * distance;
    let within =
        |p: &Vec3, q: &Vec3| (q - p).cross(&(struck - p)).dot(&spanned) >= -1e-9 * spanned.norm_squared();
    distance > -behind && within(a, b) && within(b, c) && within(c, a)
}

type Corners = (Vec<Vec3>, Vec<[u32; 4]>);

/// The corners of the tetrahedra among cells of these VTK types, and the points that these use.
fn corners_of(points: Vec<Vec3>, given: &[(u32, Vec<usize>)]) -> std::result::Result<Corners, String> {
    if let Some(bad) = points.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
        return Err(format!("point {bad} has a coordinate that is not finite"));
    }
    let mut cells = Vec::new();
    for (index, (kind, nodes)) in given.iter().enumerate() {
        if let Some(bad) = nodes.iter().find(|&&node| node >= points.len()) {
            return Err(format!("cell {index} names point {bad}; there are {}", points.len()));
        }
        match (*kind, nodes.len()) {
            (10, 4) => {}
            (24, 10) => check_straight(index, nodes, &points)?,
            (10 | 24, count) => return Err(format!("cell {index}: a tetrahedron with {count} points")),
            // Vertices, lines, triangles, pixels and quadrilaterals, linear and quadratic.
            (1..=9 | 21..=23 | 28 | 30 | 34..=36, _) => continue,
            (other, _) => {
                return Err(format!("cell {index} is {}; only tetrahedra can be used", called(other)));
            }
        }
        cells.push([nodes[0], nodes[1], nodes[2], nodes[3]]);
    }
    if cells.is_empty() {
        return Err(format!("has no tetrahedra; of a surface {HULL} takes the convex hull"));
    }
    let mut used: Vec<usize> = cells.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    // Positions in `used` fit u32: promotion refuses more nodes than that.
    let cells =
        cells.iter().map(|cell| cell.map(|node| used.partition_point(|&k| k < node) as u32)).collect();
    Ok((used.iter().map(|&node| points[node]).collect(), cells))
}

/// What a cell of one of VTK's types is called.
fn called(kind: u32) -> String {
    let name = match kind {
        11 => "a voxel",
        12 | 25 | 29 | 33 => "a hexahedron",
        13 | 26 | 31 | 32 => "a wedge, or prism",
        14 | 27 | 37 => "a pyramid",
        _ => "of another kind",
    };
    format!("{name} (VTK's type {kind})")
}

fn check_straight(index: usize, nodes: &[usize], points: &[Vec3]) -> std::result::Result<(), String> {
    for (k, &[i, j]) in EDGES.iter().enumerate() {
        let (a, b) = (points[nodes[i]], points[nodes[j]]);
        let off = (points[nodes[4 + k]] - (a + b) * 0.5).norm();
        if off > STRAIGHT * (b - a).norm() {
            return Err(format!(
                "cell {index} is curved: point {} is {off:.2e} m off the middle of its edge; only straight-sided \
                 cells can be used (Gmsh: Mesh.ElementOrder = 1, or Mesh.SecondOrderLinear = 1)",
                nodes[4 + k]
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;

    use super::*;
    use crate::mesh::cuboid_mesh;

    fn vtu(points: &[Vec3], cells: &[Vec<u32>]) -> String {
        let mut text = String::from(
            "<?xml version=\"1.0\"?>\n<!-- <Piece> in a comment -->\n<VTKFile type=\"UnstructuredGrid\" version='1.0'>\n\
             <UnstructuredGrid><Piece NumberOfPoints=\"0\" NumberOfCells=\"0\">\n\
             <PointData><DataArray Name=\"x\" format=\"binary\">AAAA</DataArray></PointData>\n\
             <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\n",
        );
        let write = |text: &mut String, name: &str, values: Vec<u32>| {
            let words: Vec<String> = values.iter().map(u32::to_string).collect();
            writeln!(text, "<DataArray Name=\"{name}\" format = \"ascii\">{}</DataArray>", words.join(" "))
                .expect("to a string");
        };
        points.iter().for_each(|p| writeln!(text, "{:e} {:e} {:e}", p.x, p.y, p.z).expect("to a string"));
        text += "</DataArray></Points><Cells>";
        write(&mut text, "connectivity", cells.iter().flatten().copied().collect());
        let mut end = 0;
        let ends = cells.iter().map(|cell| {
            end += cell.len() as u32;
            end
        });
        write(&mut text, "offsets", ends.collect());
        let types = cells.iter().map(|cell| match cell.len() {
            4 => 10,
            10 => 24,
            8 => 12,
            3 => 5,
            _ => 1,
        });
        write(&mut text, "types", types.collect());
        text + "</Cells></Piece></UnstructuredGrid></VTKFile>\n"
    }

    fn box_file(quadratic: bool) -> (Mesh, String) {
        let mesh = cuboid_mesh([0.2, 0.1, 0.1], 0.1).expect("a mesh");
        let count = if quadratic { 10 } else { 4 };
        let mut cells: Vec<Vec<u32>> =
            mesh.cells.iter().map(|cell| cell[..count].iter().map(|node| node.0).collect()).collect();
        cells.push(vec![0, 1, 2]);
        let text = vtu(&mesh.nodes, &cells);
        (mesh, text)
    }

    fn parse_mesh(text: &str) -> Result<Mesh> {
        mesh_of("body.vtu", super::vtu(text.as_bytes()))
    }

    fn message(text: &str) -> String {
        parse_mesh(text).expect_err("refused").to_string()
    }

    #[test]
    fn linear_and_quadratic_files_give_the_same_mesh() {
        for quadratic in [false, true] {
            let (mesh, text) = box_file(quadratic);
            assert_eq!(parse_mesh(&text).expect("a mesh"), mesh);
        }
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("body.vtu");
        std::fs::write(&path, box_file(true).1).expect("written");
        assert_eq!(read_mesh(&path).expect("a mesh").cells.len(), 12);
        assert!(matches!(read_mesh(&directory.path().join("none.vtu")), Err(Error::Io { .. })));
    }

    /// Points are text and cells raw bytes behind the tags, as VTK and ParaView save by default, and so is a field of no interest.
    #[test]
    fn raw_bytes_behind_the_tags_are_read() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("body.vtu");
        let head = r#"<VTKFile type="UnstructuredGrid" byte_order="BigEndian"><UnstructuredGrid><Piece>
            <CellData><DataArray type="UInt8" Name="rock" format="appended" offset="0"/></CellData>
            <Points><DataArray type="Float64" format="ascii">0 0 0 0.3 0 0 0 0.2 0 0 0 0.1</DataArray></Points><Cells>
            <DataArray type="Int32" Name="connectivity" format="appended" offset="5"/><DataArray type="Int64" Name="offsets" format="ascii">4</DataArray>
            <DataArray type="UInt8" Name="types" format="appended" offset="25"/></Cells></Piece></UnstructuredGrid><AppendedData encoding="raw">_"#;
        // Each behind its number of bytes: 1 value, 4 numbers of points, 1 type.
        let mut bytes = head.as_bytes().to_vec();
        bytes.extend([0, 0, 0, 1, 0xff]);
        bytes.extend([0, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3]);
        bytes.extend([0, 0, 0, 1, 10]);
        let whole = bytes.len();
        bytes.extend(b"</AppendedData></VTKFile>");
        std::fs::write(&path, &bytes).expect("written");
        let mesh = read_mesh(&path).unwrap_or_else(|e| panic!("{e}"));
        assert!(mesh.cells.len() == 1 && (mesh.volume() - 1e-3).abs() < 1e-15, "{}", mesh.volume());
        std::fs::write(&path, &bytes[..whole - 1]).expect("written");
        let cut = read_mesh(&path).expect_err("cut off").to_string();
        assert!(cut.contains("types: the data are cut off"), "{cut}");
        // A hidden crack is found whatever the cells are written as.
        let plain = cracked(0.0);
        let (points, cells) = plain.split_once("</Points>").expect("points");
        let other = "<AppendedData encoding=\"raw\">_\u{1}</AppendedData></VTKFile>";
        let appended = format!("{points}</Points>{}", cells.replace("</VTKFile>", other));
        std::fs::write(&path, appended).expect("written");
        let refused = read_mesh(&path).expect_err("cracked").to_string();
        assert!(refused.contains("hidden crack"), "{refused}");
    }

    /// A cuboid whose mid-plane is cut but for its rim, its nodes `apart` [m] on one side.
    fn cracked(apart: f64) -> String {
        cracked_below(apart, 0.1)
    }

    /// The same with the cut so deep below its top [m].
    fn cracked_below(apart: f64, depth: f64) -> String {
        let mesh = cuboid_mesh([0.3, 0.2, 0.2], 0.05).expect("a mesh");
        let lifted = |p: &Vec3| {
            let share = if p.z > 0.0 { p.z * depth } else { p.z * (0.2 - depth) } / 0.1;
            Vec3::new(p.x, p.y, 0.1 - depth + share)
        };
        let mut nodes: Vec<Vec3> = mesh.nodes.iter().map(lifted).collect();
        let mut cells: Vec<Vec<u32>> =
            mesh.cells.iter().map(|cell| cell[..4].iter().map(|node| node.0).collect()).collect();
        let plane = |p: &Vec3| p.z.abs() < 1e-9 && p.x.abs() < 0.14 && p.y.abs() < 0.09;
        let mut twins = std::collections::BTreeMap::new();
        for cell in &mut cells {
            let above = cell.iter().map(|n| mesh.nodes[*n as usize].z).sum::<f64>() > 0.0;
            for node in cell.iter_mut().filter(|n| above && plane(&mesh.nodes[**n as usize])) {
                *node = *twins.entry(*node).or_insert_with(|| {
                    let place = nodes[*node as usize];
                    nodes.push(place + Vec3::new(apart, 0.0, 0.0));
                    nodes.len() as u32 - 1
                });
            }
        }
        assert_eq!(twins.len(), 15);
        vtu(&nodes, &cells)
    }

    #[test]
    fn cracks_hidden_inside_are_refused() {
        let same = message(&cracked(0.0));
        assert!(same.contains("merge coincident nodes") && same.contains("hidden crack"), "{same}");
        // Nodes that do not lie on each other, as where both sides were meshed apart.
        let unlike = message(&cracked(1e-3));
        assert!(unlike.contains("facets of its surface inside"), "{unlike}");
        // Under a layer far thinner than its facets are wide.
        for depth in [2e-3, 1e-4, 5e-6] {
            let thin = message(&cracked_below(3e-4, depth));
            // Both sides of 24 quads, but for two halves at corners, which the rim keeps together.
            assert!(thin.contains("has 92 facets of its surface inside"), "{depth:e}: {thin}");
            // As many as were doubled: mid-side nodes are not counted.
            let same = message(&cracked_below(0.0, depth));
            assert!(same.contains("has 15 nodes"), "{depth:e}: {same}");
        }
        let whole = cuboid_mesh([0.3, 0.2, 0.2], 0.05).expect("a mesh");
        // A node inside that is moved past its neighbours folds cells over others.
        let mut folded = whole.nodes.clone();
        let inner =
            folded.iter().position(|p| (p - Vec3::new(0.05, 0.0, 0.05)).norm() < 1e-9).expect("a node");
        folded[inner].x += 0.083;
        let corners: Vec<Vec<u32>> =
            whole.cells.iter().map(|cell| cell[..4].iter().map(|node| node.0).collect()).collect();
        assert!(message(&vtu(&folded, &corners)).contains("cells that overlap"));
        let cells: Vec<Vec<u32>> =
            whole.cells.iter().map(|cell| cell[..4].iter().map(|node| node.0).collect()).collect();
        assert!(parse_mesh(&vtu(&whole.nodes, &cells)).is_ok());
    }

    /// Triangles on a curved surface leave such dents; an eighth of the body is none.
    #[test]
    fn dents_of_meshed_surfaces_are_filled() {
        let whole = cuboid_mesh([0.3, 0.2, 0.2], 0.05).expect("a mesh");
        let top =
            whole.nodes.iter().position(|p| (p - Vec3::new(0.05, 0.0, 0.1)).norm() < 1e-9).expect("a node");
        let corners: Vec<Vec<u32>> =
            whole.cells.iter().map(|cell| cell[..4].iter().map(|node| node.0).collect()).collect();
        let pressed_in = |depth: f64| {
            let mut nodes = whole.nodes.clone();
            nodes[top].z -= depth;
            vtu(&nodes, &corners)
        };
        let mesh = parse_mesh(&pressed_in(0.01)).unwrap_or_else(|e| panic!("{e}"));
        let filled = mesh.convex_hull().expect("a hull").volume() / mesh.volume() - 1.0;
        assert!(filled > 1e-3 && filled < CONVEX, "{filled}");
        assert!(message(&pressed_in(0.04)).contains("facets of its surface inside"));
    }

    #[test]
    fn unusable_files_are_refused_with_a_reason() {
        let (mesh, text) = box_file(true);
        assert!(message("").contains("not a VTK XML file"));
        assert!(message(&text.replace("UnstructuredGrid\"", "PolyData\"")).contains("PolyData"));
        assert!(message(&text.replace("format = \"ascii\"", "format = \"binary\"")).contains("is no base64"));
        assert!(message(&text[..text.len() / 2]).contains("body.vtu"));
        assert!(message(&text.replace("Name=\"types\"", "Name=\"kinds\"")).contains("has no Cells/types"));
        let corners: Vec<u32> = mesh.cells[0].iter().map(|node| node.0).collect();
        assert!(message(&vtu(&mesh.nodes, &[(0..8).collect()])).contains("type 12"));
        assert!(message(&vtu(&mesh.nodes, &[vec![0, 1, 2, 999]])).contains("names point 999"));
        assert!(message(&vtu(&mesh.nodes, &[vec![0, 1, 2]])).contains("no tetrahedra"));
        let mut curved = mesh.nodes.clone();
        curved[corners[5] as usize].x += 1e-3;
        assert!(message(&vtu(&curved, std::slice::from_ref(&corners))).contains("curved"));
        // An L of two bricks out of three.
        let bent = cuboid_mesh([0.2, 0.2, 0.1], 0.1).expect("a mesh");
        let cells: Vec<Vec<u32>> =
            bent.cells[..18].iter().map(|cell| cell.iter().map(|node| node.0).collect()).collect();
        assert!(message(&vtu(&bent.nodes, &cells)).contains("not convex"));
        let apart: Vec<Vec<u32>> =
            [0usize, 23].iter().map(|&k| bent.cells[k].iter().map(|node| node.0).collect()).collect();
        assert!(message(&vtu(&bent.nodes, &apart)).contains("2 parts"));
        assert!(message(&text.replace("e-2", "e-x")).contains("not a number"));
        let nodes: String = (1..=8).map(|k| format!("{k} {} {} {k}\n", k % 2, k / 2 % 2)).collect();
        for (kind, count, says) in [(5, 8, "a hexahedron"), (6, 6, "a wedge"), (7, 5, "a pyramid")] {
            let corners: Vec<String> = (1..=count).map(|k: usize| k.to_string()).collect();
            let msh = format!(
                "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n8\n{nodes}$EndNodes\n\
                 $Elements\n1\n1 {kind} 2 1 1 {}\n$EndElements\n",
                corners.join(" ")
            );
            let said = mesh_of("x.msh", formats::gmsh(msh.as_bytes())).expect_err(says).to_string();
            assert!(said.contains(&format!("cell 0 is {says}")), "{said}");
        }
    }
}
