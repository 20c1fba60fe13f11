//! Meshes and surfaces as other programs save them: cells of `.vtu` (binary, appended, compressed) and Gmsh's `.msh` (2.2 and 4.1, ASCII), points of
//! those and of `.stl`, `.obj` and `.ply`.
//!
//! Sources: Gmsh reference manual, "Gmsh file formats", MSH 2.2 and 4.1; STL by `stl_io`; PLY: Turk (1994), "The PLY polygon file format"; OBJ: the
//! `v` lines alone; `.vtu`: `mesh::encoded`. Cells have VTK's types and order of points. Lengths are those of the file. What crates there are beside
//! `stl_io`: docs/decisions/0195-readers-of-meshes.md.

use std::fs::File;
use std::io::{Cursor, Read as _};
use std::path::Path;
use std::str::SplitWhitespace;

use crate::error::{Error, Result};
use crate::input;
pub use crate::mesh::encoded::Cells;
use crate::mesh::encoded::vtu;
use crate::tensor::Vec3;

/// Endings of files of cells, and of files of points alone.
pub const OF_CELLS: [&str; 2] = ["vtu", "msh"];
pub const OF_POINTS: [&str; 3] = ["stl", "obj", "ply"];

/// What riprap's own binary .stl begin with: the file of one body, and that of all bodies together.
pub const STL_OF_ONE: &[u8] = b"riprap, one body, in metres";
pub const STL_OF_ALL: &[u8] = b"riprap, all bodies, in metres";

/// VTK's types of what a `.msh` may hold.
const VERTEX: u32 = 1;
const LINE: u32 = 3;
const TRIANGLE: u32 = 5;
const QUAD: u32 = 9;
const TETRAHEDRON: u32 = 10;
const QUADRATIC_LINE: u32 = 21;
const QUADRATIC_TRIANGLE: u32 = 22;
const QUADRATIC_TETRAHEDRON: u32 = 24;
/// Refused by whoever needs tetrahedra.
const HEXAHEDRON: u32 = 12;
const WEDGE: u32 = 13;
const PYRAMID: u32 = 14;

type Read<T> = std::result::Result<T, String>;

/// The ending of a file's name, in small letters.
pub fn ending(path: &Path) -> String {
    path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

/// Whether a file is an `.stl` in which riprap put all bodies of a state together. One that cannot be read is none.
pub fn holds_all_bodies(path: &Path) -> bool {
    // A pipe that nobody writes to would never open.
    if ending(path) != "stl" || !path.is_file() {
        return false;
    }
    let mut head = vec![0; STL_OF_ALL.len()];
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut head));
    read.is_ok() && head == STL_OF_ALL
}

/// All points of a file of cells or of a surface, in the file's unit of length.
///
/// # Errors
/// `Error::Io` where it cannot be read, `Error::Mesh` naming the file where it is not what its ending says.
pub fn read_points(path: &Path) -> Result<Vec<Vec3>> {
    let bytes = input::read_named(path).map_err(|source| Error::io("read", path, source))?;
    let read = match ending(path).as_str() {
        "vtu" => vtu(&bytes).map(|read| read.points),
        "msh" => gmsh(&bytes).map(|read| read.points),
        "stl" => stl(&bytes),
        "obj" => obj(&bytes),
        "ply" => ply(&bytes),
        other => Err(format!(
            "has the ending {other:?}; accepted: {}",
            [&OF_POINTS[..], &OF_CELLS[..]].concat().join(", ")
        )),
    };
    let finite = read.and_then(|points| match points.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
        Some(bad) => Err(format!("point {bad} has a coordinate that is not finite")),
        None => Ok(points),
    });
    finite.map_err(|message| Error::Mesh { name: path.display().to_string(), message })
}

/// A mesh of Gmsh, MSH 2.2 or 4.1, ASCII.
pub fn gmsh(bytes: &[u8]) -> Read<Cells> {
    let text = String::from_utf8_lossy(bytes);
    let section = |name: &str| -> Option<&str> {
        let from = text.find(&format!("${name}"))? + name.len() + 1;
        Some(&text[from..from + text[from..].find(&format!("$End{name}"))?])
    };
    let head = section("MeshFormat").ok_or("is no file of Gmsh: it has no $MeshFormat")?;
    let mut words = head.split_whitespace();
    let (version, binary) = (words.next().unwrap_or(""), words.next().unwrap_or(""));
    if binary != "0" {
        return Err("is binary; save it as ASCII (Mesh.Binary = 0, or without -bin)".into());
    }
    let missing = |name: &str| format!("has no whole section ${name}: the file is cut off");
    let nodes = section("Nodes").ok_or_else(|| missing("Nodes"))?;
    let elements = section("Elements").ok_or_else(|| missing("Elements"))?;
    let mut mesh = Numbered::default();
    match version {
        v if v.starts_with("2.") => {
            mesh.nodes_2(&mut Words::of("Nodes", nodes))?;
            mesh.elements_2(&mut Words::of("Elements", elements))?;
        }
        v if v.starts_with("4.1") => {
            mesh.nodes_4(&mut Words::of("Nodes", nodes))?;
            mesh.elements_4(&mut Words::of("Elements", elements))?;
        }
        other => return Err(format!("has the format {other}; accepted: 2.2 and 4.1 (Mesh.MshFileVersion)")),
    }
    Ok(mesh.cells)
}

/// The words of a section.
struct Words<'a> {
    section: &'a str,
    rest: SplitWhitespace<'a>,
}

impl<'a> Words<'a> {
    fn of(section: &'a str, text: &'a str) -> Self {
        Words { section, rest: text.split_whitespace() }
    }

    fn next<T: std::str::FromStr>(&mut self) -> Read<T> {
        let word = self.rest.next().ok_or_else(|| format!("${}: ends too early", self.section))?;
        word.parse().map_err(|_| format!("${}: {word:?} is not a number that fits", self.section))
    }

    fn skip(&mut self, count: usize) -> Read<()> {
        (0..count).try_for_each(|_| self.next::<f64>().map(|_| ()))
    }
}

/// Cells whose points have numbers of the file's own.
#[derive(Default)]
struct Numbered {
    cells: Cells,
    place: std::collections::BTreeMap<u64, usize>,
}

impl Numbered {
    fn add_node(&mut self, number: u64, words: &mut Words<'_>) -> Read<()> {
        let point = Vec3::new(words.next()?, words.next()?, words.next()?);
        self.place.insert(number, self.cells.points.len());
        self.cells.points.push(point);
        Ok(())
    }

    fn add_element(&mut self, kind: u32, words: &mut Words<'_>) -> Read<()> {
        let (vtk, count) = element(kind)?;
        let mut nodes = Vec::with_capacity(count);
        for _ in 0..count {
            let number: u64 = words.next()?;
            nodes.push(
                *self
                    .place
                    .get(&number)
                    .ok_or_else(|| format!("an element names node {number}, which is not there"))?,
            );
        }
        if vtk == QUADRATIC_TETRAHEDRON {
            // Gmsh has the middles of the edges 2-3 and 1-3 the other way round.
            nodes.swap(8, 9);
        }
        self.cells.cells.push((vtk, nodes));
        Ok(())
    }

    fn nodes_2(&mut self, words: &mut Words<'_>) -> Read<()> {
        let count: usize = words.next()?;
        for _ in 0..count {
            let number = words.next()?;
            self.add_node(number, words)?;
        }
        Ok(())
    }

    fn elements_2(&mut self, words: &mut Words<'_>) -> Read<()> {
        let count: usize = words.next()?;
        for _ in 0..count {
            words.skip(1)?;
            let (kind, tags) = (words.next()?, words.next()?);
            words.skip(tags)?;
            self.add_element(kind, words)?;
        }
        Ok(())
    }

    fn nodes_4(&mut self, words: &mut Words<'_>) -> Read<()> {
        let blocks: usize = words.next()?;
        words.skip(3)?;
        for _ in 0..blocks {
            let dimension: usize = words.next()?;
            words.skip(1)?;
            let parametric: usize = words.next()?;
            let count: usize = words.next()?;
            let numbers = (0..count).map(|_| words.next()).collect::<Read<Vec<u64>>>()?;
            for number in numbers {
                self.add_node(number, words)?;
                words.skip(if parametric == 0 { 0 } else { dimension })?;
            }
        }
        Ok(())
    }

    fn elements_4(&mut self, words: &mut Words<'_>) -> Read<()> {
        let blocks: usize = words.next()?;
        words.skip(3)?;
        for _ in 0..blocks {
            words.skip(2)?;
            let (kind, count): (u32, usize) = (words.next()?, words.next()?);
            for _ in 0..count {
                words.skip(1)?;
                self.add_element(kind, words)?;
            }
        }
        Ok(())
    }
}

/// VTK's type of an element of Gmsh, and how many nodes it has.
fn element(kind: u32) -> Read<(u32, usize)> {
    Ok(match kind {
        1 => (LINE, 2),
        2 => (TRIANGLE, 3),
        3 => (QUAD, 4),
        4 => (TETRAHEDRON, 4),
        5 => (HEXAHEDRON, 8),
        6 => (WEDGE, 6),
        7 => (PYRAMID, 5),
        8 => (QUADRATIC_LINE, 3),
        9 => (QUADRATIC_TRIANGLE, 6),
        11 => (QUADRATIC_TETRAHEDRON, 10),
        15 => (VERTEX, 1),
        other => {
            return Err(format!("has elements of Gmsh's type {other}; only tetrahedra (4, 11) can be used"));
        }
    })
}

fn stl(bytes: &[u8]) -> Read<Vec<Vec3>> {
    let read =
        stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|e| format!("is no .stl that can be read: {e}"))?;
    Ok(read.vertices.iter().map(|v| Vec3::new(v[0].into(), v[1].into(), v[2].into())).collect())
}

fn obj(bytes: &[u8]) -> Read<Vec<Vec3>> {
    let text = String::from_utf8_lossy(bytes);
    let vertices =
        text.lines().enumerate().filter_map(|(at, line)| Some((at, line.trim().strip_prefix("v ")?)));
    vertices
        .map(|(at, line)| {
            let numbers: Vec<f64> =
                line.split_whitespace().map_while(|word| word.parse().ok()).take(3).collect();
            match numbers[..] {
                [x, y, z] => Ok(Vec3::new(x, y, z)),
                _ => Err(format!("line {}: a vertex without three numbers", at + 1)),
            }
        })
        .collect()
}

/// The vertices of a PLY file, ASCII or binary of either order of bytes (Turk 1994).
fn ply(bytes: &[u8]) -> Read<Vec<Vec3>> {
    let marks = b"end_header";
    let end = bytes.windows(marks.len()).position(|w| w == marks).filter(|_| bytes.starts_with(b"ply"));
    let end = end.ok_or("is no .ply that can be read: its header is missing or cut off")?;
    let body = end + bytes[end..].iter().position(|c| *c == b'\n').unwrap_or(0) + 1;
    let head = String::from_utf8_lossy(&bytes[..end]);
    let (mut format, mut count, mut columns) = (String::new(), None, Vec::new());
    let mut element = "";
    for line in head.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["format", kind, ..] => format = kind.into(),
            ["element", name, number] => {
                if name == "vertex" {
                    // What comes before would have to be read to be skipped; no program writes it so.
                    if !element.is_empty() {
                        return Err(format!("has its vertices behind the element {element}"));
                    }
                    count = Some(number.parse::<usize>().map_err(|_| format!("has {number:?} vertices"))?);
                }
                element = name;
            }
            ["property", kind, name] if element == "vertex" => columns.push((width(kind)?, name.to_string())),
            ["property", "list", ..] if element == "vertex" => return Err("has lists at its vertices".into()),
            _ => {}
        }
    }
    let count = count.ok_or("has no element vertex")?;
    let place = |axis: &str| {
        columns
            .iter()
            .position(|(_, name)| name == axis)
            .ok_or_else(|| format!("has vertices without {axis}"))
    };
    let places = [place("x")?, place("y")?, place("z")?];
    let rest = bytes.get(body..).unwrap_or_default();
    let few = || "ends before its last vertex".to_string();
    if format == "ascii" {
        let text = String::from_utf8_lossy(rest);
        let mut words = text.split_whitespace();
        return (0..count)
            .map(|_| {
                let row =
                    columns.iter().map(|_| words.next().ok_or_else(few)).collect::<Read<Vec<&str>>>()?;
                let number =
                    |k: usize| row[k].parse::<f64>().map_err(|_| format!("{:?} is no number", row[k]));
                Ok(Vec3::new(number(places[0])?, number(places[1])?, number(places[2])?))
            })
            .collect();
    }
    let big = match format.as_str() {
        "binary_little_endian" => false,
        "binary_big_endian" => true,
        other => {
            return Err(format!(
                "has the format {other:?}; accepted: ascii, binary_little_endian, binary_big_endian"
            ));
        }
    };
    let start = |k: usize| columns[..k].iter().map(|((size, _), _)| size).sum::<usize>();
    let row_size = start(columns.len());
    if count.checked_mul(row_size).is_none_or(|size| size > rest.len()) {
        return Err(few());
    }
    let point = |row: &[u8]| {
        let number = |k: usize| {
            let ((size, kind), _) = columns[k];
            let mut field = row[start(k)..start(k) + size].to_vec();
            if big {
                field.reverse();
            }
            scalar(&field, kind)
        };
        Vec3::new(number(places[0]), number(places[1]), number(places[2]))
    };
    Ok(rest.chunks_exact(row_size.max(1)).take(count).map(point).collect())
}

/// What the bytes of a number of PLY mean.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Signed,
    Unsigned,
    Real,
}

/// Bytes of a number of PLY, and what they mean.
fn width(kind: &str) -> Read<(usize, Kind)> {
    Ok(match kind {
        "char" | "int8" => (1, Kind::Signed),
        "uchar" | "uint8" => (1, Kind::Unsigned),
        "short" | "int16" => (2, Kind::Signed),
        "ushort" | "uint16" => (2, Kind::Unsigned),
        "int" | "int32" => (4, Kind::Signed),
        "uint" | "uint32" => (4, Kind::Unsigned),
        "float" | "float32" => (4, Kind::Real),
        "double" | "float64" => (8, Kind::Real),
        other => return Err(format!("has numbers of the kind {other:?}")),
    })
}

/// A number of up to eight bytes, least first.
fn scalar(bytes: &[u8], kind: Kind) -> f64 {
    let is_negative = kind == Kind::Signed && bytes.last().is_some_and(|b| *b > 127);
    let mut all = [if is_negative { 255 } else { 0 }; 8];
    all[..bytes.len()].copy_from_slice(bytes);
    match (bytes.len(), kind) {
        (4, Kind::Real) => f64::from(f32::from_le_bytes([all[0], all[1], all[2], all[3]])),
        (_, Kind::Real) => f64::from_le_bytes(all),
        (_, Kind::Signed | Kind::Unsigned) => i64::from_le_bytes(all) as f64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron with its mid-side nodes at thirds, so that a wrong order shows, in Gmsh's order; numbers with gaps.
    fn msh(version: &str) -> String {
        let corners = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 3.0]];
        let edges = [[0, 1], [1, 2], [0, 2], [0, 3], [2, 3], [1, 3]];
        let middles = edges
            .map(|[a, b]| std::array::from_fn::<f64, 3, _>(|k| (2.0 * corners[a][k] + corners[b][k]) / 3.0));
        let points: Vec<[f64; 3]> = corners.into_iter().chain(middles).collect();
        let place = |p: &[f64; 3]| format!("{} {} {}\n", p[0], p[1], p[2]);
        let numbers: Vec<usize> = (0..10).map(|k| 7 + 3 * k).collect();
        let all: Vec<String> = numbers.iter().map(usize::to_string).collect();
        let mut text = format!(
            "$MeshFormat\n{version} 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"4 rock\"\n$EndPhysicalNames\n$Nodes\n"
        );
        match version {
            "2.2" => {
                text += "10\n";
                for (number, point) in numbers.iter().zip(&points) {
                    text += &format!("{number} {}", place(point));
                }
                text +=
                    &format!("$EndNodes\n$Elements\n2\n1 2 2 1 1 7 10 13\n2 11 3 1 1 0 {}\n", all.join(" "));
            }
            _ => {
                // Two blocks, the second with parameters of its surface.
                text += "2 10 7 34\n3 1 0 4\n7\n10\n13\n16\n";
                points[..4].iter().for_each(|point| text += &place(point));
                text += "2 5 1 6\n19\n22\n25\n28\n31\n34\n";
                points[4..].iter().for_each(|point| text += &format!("{} 0.1 0.2\n", place(point).trim()));
                text += &format!(
                    "$EndNodes\n$Elements\n2 2 1 2\n2 5 2 1\n1 7 10 13\n3 1 11 1\n2 {}\n",
                    all.join(" ")
                );
            }
        }
        text + "$EndElements\n"
    }

    #[test]
    fn both_formats_of_gmsh_give_the_same_cells_in_the_order_of_vtk() {
        let [old, new] =
            ["2.2", "4.1"].map(|version| gmsh(msh(version).as_bytes()).unwrap_or_else(|e| panic!("{e}")));
        assert_eq!(old, new);
        assert_eq!(old.cells[0], (TRIANGLE, vec![0, 1, 2]));
        let (kind, nodes) = &old.cells[1];
        assert_eq!(*kind, QUADRATIC_TETRAHEDRON);
        for (k, [a, b]) in [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]].into_iter().enumerate() {
            let [a, b] = [old.points[nodes[a]], old.points[nodes[b]]];
            let middle = old.points[nodes[4 + k]];
            // On the edge, at a third from one of its ends.
            assert!((middle - a).cross(&(b - a)).norm() < 1e-12, "edge {k}");
        }
        let refused = |text: &str| gmsh(text.as_bytes()).expect_err("refused");
        assert!(refused("solid").contains("no $MeshFormat"));
        assert!(refused(&msh("2.2").replace("2.2 0 8", "2.2 1 8")).contains("binary"));
        assert!(refused(&msh("2.2").replace("2.2 0 8", "1.0 0 8")).contains("2.2 and 4.1"));
        assert!(refused(&msh("2.2").replace("1 1 7 10 13", "1 1 7 10 14")).contains("node 14"));
        assert!(refused(&msh("4.1").replace("3 1 11 1", "3 1 12 1")).contains("type 12"));
        assert!(refused(&msh("4.1").replace("$EndElements", "")).contains("cut off"));
    }

    /// The corners of a box, as each format has them.
    #[test]
    fn surfaces_give_their_points() {
        let folder = tempfile::tempdir().expect("a folder");
        let read = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).expect("a file");
            let mut points = read_points(&path).map_err(|e| e.to_string())?;
            points.sort_by(|a, b| a.as_slice().partial_cmp(b.as_slice()).expect("numbers"));
            Ok::<_, String>(points)
        };
        let corners = [[0.0, 0.0, 0.5], [0.0, 2.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.5]];
        let expected = corners.map(Vec3::from).to_vec();
        let facets = [[0, 1, 2], [0, 1, 3], [1, 2, 3], [0, 2, 3]];
        let lines: Vec<String> = corners.iter().map(|c| format!("{} {} {}", c[0], c[1], c[2])).collect();
        let ascii: String = facets
            .iter()
            .map(|f| {
                format!(
                    "facet normal 0 0 1\nouter loop\n{}endloop\nendfacet\n",
                    f.map(|v| format!("vertex {}\n", lines[v])).join("")
                )
            })
            .collect();
        assert_eq!(
            read("a.stl", format!("solid grain\n{ascii}endsolid grain\n").as_bytes()),
            Ok(expected.clone())
        );
        let mut binary = vec![b' '; 80];
        binary.extend(4_u32.to_le_bytes());
        for facet in facets {
            binary.extend([0; 12]);
            facet.iter().flat_map(|&v| corners[v]).for_each(|c| binary.extend((c as f32).to_le_bytes()));
            binary.extend([0; 2]);
        }
        assert_eq!(read("b.STL", &binary), Ok(expected.clone()));
        let obj = format!("# scan\no grain\nv {}\nvn 0 0 1\nf 1 2 3\n", lines.join(" 1.0\nv "));
        assert_eq!(read("c.obj", obj.as_bytes()), Ok(expected.clone()));
        let head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty double z\nproperty uchar red\n\
                    element face 1\nproperty list uchar int vertex_indices\nend_header\n";
        let ply = format!("{head}{} 255\n3 0 1 2\n", lines.join(" 255\n"));
        assert_eq!(read("d.ply", ply.as_bytes()), Ok(expected.clone()));
        for (name, big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
            let mut binary = head.replace("ascii", name).into_bytes();
            for [x, y, z] in corners {
                let fields = [
                    (x as f32).to_be_bytes().to_vec(),
                    (y as f32).to_be_bytes().to_vec(),
                    z.to_be_bytes().to_vec(),
                    vec![255],
                ];
                for mut field in fields {
                    if !big {
                        field.reverse();
                    }
                    binary.extend(field);
                }
            }
            binary.extend([3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
            assert_eq!(read("b.ply", &binary), Ok(expected.clone()), "{name}");
            assert!(
                read("c.ply", &binary[..binary.len() - 20]).is_err_and(|told| told.contains("ends before"))
            );
        }
        assert!(
            read("e.ply", b"ply\nformat")
                .is_err_and(|told| told.contains("e.ply") && told.contains("no .ply"))
        );
        assert!(read("f.obj", b"v 1 2\n").is_err_and(|told| told.contains("line 1")));
        assert!(read("g.obj", b"v 1 2 nan\n").is_err_and(|told| told.contains("not finite")));
        assert!(read("h.step", b"").is_err_and(|told| told.contains("accepted: stl, obj, ply, vtu, msh")));
    }

    #[test]
    fn whole_numbers_of_ply_have_a_sign_only_where_their_kind_has() {
        let kinds = [("uchar", "char", 1), ("ushort", "int16", 2), ("uint32", "int", 4)];
        for (unsigned, signed, size) in kinds {
            let head = format!(
                "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty {unsigned} x\nproperty {signed} y\n\
                 property double z\nend_header\n"
            );
            let mut bytes = head.into_bytes();
            bytes.extend(vec![0xFE; 2 * size]);
            bytes.extend(0.5_f64.to_le_bytes());
            let ones = (0..size).fold(0.0, |sum, _| 256.0 * sum + 254.0);
            let full = 256.0_f64.powi(size as i32);
            assert_eq!(ply(&bytes), Ok(vec![Vec3::new(ones, ones - full, 0.5)]), "{unsigned}");
        }
    }
}
