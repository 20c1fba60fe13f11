//! Exports the contact network as lines, and the grains of a state as STL.
//!
//! Sources: VTK file formats (Kitware), XML PolyData, ASCII; STL, binary. A line goes from one body's centre to the other's; what has no centre in the
//! file (a plate, a part that came off) is met at the contact point. Strong is a pair that carries more than the mean of the
//! pairs without a plate.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::mesh::formats::{STL_OF_ALL, STL_OF_ONE};
use crate::tensor::Vec3;

use super::pairs::ContactPair;
use super::reader::Reader;
use super::store::failure;
use super::vtu::{entry, write_collection};

/// Writes `<stem>_contacts.pvd` and a `<stem>_contacts_<state>.vtp` for each saved state that has contacts. Returns the `.pvd`.
///
/// # Errors
/// No state has contacts; what cannot be read or written.
pub fn write_network(reader: &Reader, folder: &Path, stem: &str) -> Result<PathBuf> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io("create", folder, e))?;
    let mut list = String::new();
    for (state, saved) in reader.saved_states()?.iter().enumerate() {
        if !reader.has(&format!("contacts/{state}/point")) {
            continue;
        }
        let name = format!("{stem}_contacts_{state:05}.vtp");
        let path = folder.join(&name);
        std::fs::write(&path, network(reader, state)?).map_err(|e| Error::io("write", &path, e))?;
        list += &entry(&name, saved.time);
    }
    if list.is_empty() {
        return Err(failure(reader.path(), "contacts", "has no contacts to export"));
    }
    write_collection(folder.join(format!("{stem}_contacts.pvd")), &list)
}

/// The contact points of a state as PolyData.
fn network(reader: &Reader, state: usize) -> Result<String> {
    let table = |name: &str| format!("contacts/{state}/{name}");
    let (a, b) = (reader.integers(&table("body_a"))?, reader.integers(&table("body_b"))?);
    let points = vectors(&reader.floats(&table("point"))?);
    let centres = centres(reader, state)?;
    let normals = vectors(&reader.floats(&table("normal"))?);
    let normal = reader.floats(&table("normal_force"))?;
    let rows = a.len();
    if [b.len(), points.len(), normals.len(), normal.len()].iter().any(|found| *found != rows) {
        return Err(failure(reader.path(), &table("body_b"), "is not as long as the columns beside it"));
    }
    let mut ends = String::new();
    for row in 0..rows {
        for body in [a[row], b[row]] {
            let centre =
                usize::try_from(body).ok().and_then(|body| centres.get(body)).unwrap_or(&points[row]);
            let _ = writeln!(ends, "{:e} {:e} {:e}", centre.x, centre.y, centre.z);
        }
    }
    let numbers = |name: &str| -> Result<Vec<f64>> { reader.floats(&table(name)) };
    let pairs = ContactPair::of_points((0..rows).map(|row| ([a[row], b[row]], normals[row], normal[row])));
    let between: Vec<f64> =
        pairs.iter().filter(|pair| !pair.has_plate()).map(|pair| pair.normal_force).collect();
    // Not a number where only plates touch: nothing is strong then.
    let mean = between.iter().sum::<f64>() / between.len() as f64;
    let forces: BTreeMap<[i64; 2], f64> = pairs.iter().map(|pair| (pair.bodies, pair.normal_force)).collect();
    let of_pair = |row: usize| forces.get(&ContactPair::key(a[row], b[row])).copied().unwrap_or(0.0);
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\">\n<PolyData>\n\
         <Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"{rows}\" NumberOfStrips=\"0\" NumberOfPolys=\"0\">\n\
         <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\n{ends}</DataArray></Points>\n<Lines>\n",
        2 * rows
    );
    let integers = |values: &mut dyn Iterator<Item = usize>| -> String {
        values.map(|value| value.to_string()).collect::<Vec<_>>().join(" ")
    };
    for (name, values) in [
        ("connectivity", integers(&mut (0..2 * rows))),
        ("offsets", integers(&mut (1..=rows).map(|row| 2 * row))),
    ] {
        let _ =
            writeln!(text, "<DataArray type=\"Int64\" Name=\"{name}\" format=\"ascii\">{values}</DataArray>");
    }
    text += "</Lines>\n<CellData>\n";
    let mut array = |name: &str, components: usize, values: Vec<f64>| {
        // NaN is how VTK writes it, too.
        let words: Vec<String> = values.iter().map(|value| format!("{value:e}")).collect();
        let _ = writeln!(
            text,
            "<DataArray type=\"Float64\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">{}</DataArray>",
            words.join(" ")
        );
    };
    array("body_a", 1, a.iter().map(|n| *n as f64).collect());
    array("body_b", 1, b.iter().map(|n| *n as f64).collect());
    array("pair_force", 1, (0..rows).map(of_pair).collect());
    array("strong", 1, (0..rows).map(|row| f64::from(u8::from(of_pair(row) > mean))).collect());
    array("normal_force", 1, normal.clone());
    // Older files have no gaps.
    let gap = reader.has(&table("gap")).then_some(("gap", 1));
    let all =
        [("force", 3), ("normal", 3), ("friction_force", 3), ("point", 3), ("slip", 1), ("mobilised", 1)];
    for (name, components) in all.into_iter().chain(gap) {
        let values = numbers(name)?;
        if values.len() != components * rows {
            return Err(failure(reader.path(), &table(name), "is not as long as the columns beside it"));
        }
        array(name, components, values);
    }
    Ok(text + "</CellData>\n</Piece>\n</PolyData>\n</VTKFile>\n")
}

/// Centres of the grains, or of a scene's bodies, in a state [m].
fn centres(reader: &Reader, state: usize) -> Result<Vec<Vec3>> {
    if reader.has("grains/position") {
        return Ok(vectors(&reader.floats_in("grains/position", state, 1)?));
    }
    if !reader.has("bodies") {
        return Ok(Vec::new());
    }
    let increment = reader.saved_states()?.get(state).map_or(0, |saved| saved.increment);
    // Row i is increment i + 1; of the start there is none.
    let Some(row) = usize::try_from(increment).ok().and_then(|n| n.checked_sub(1)) else {
        return Ok(Vec::new());
    };
    let place = |name: String| {
        let column = format!("bodies/{name}/position");
        let found = vectors(&reader.floats_in(&column, row, 1)?).first().copied();
        found.ok_or_else(|| failure(reader.path(), &column, "has no place of the body"))
    };
    reader.body_order()?.into_iter().map(place).collect()
}

fn vectors(numbers: &[f64]) -> Vec<Vec3> {
    numbers.chunks_exact(3).map(Vec3::from_column_slice).collect()
}

/// Writes the bodies of the last saved state as binary STL [m], where they are in it: `<stem>.stl` of all, and `<stem>_<body>.stl` of each. Cells that failed are
/// left out, plates and membrane too. The head of the file of all says so: it is no grain of a library. Returns the file of all, and how many bodies there are.
///
/// # Errors
/// No saved state; what cannot be read or written.
pub fn write_stl(reader: &Reader, folder: &Path, stem: &str) -> Result<(PathBuf, usize)> {
    let Some(state) = reader.saved_states()?.len().checked_sub(1) else {
        return Err(failure(reader.path(), "VTKHDF", "has no saved states to export"));
    };
    let cells = reader.saved_cells()?;
    let moved = reader.saved_points(&cells, state)?;
    let failed = reader.saved_field("CellData", "failed", state)?;
    let owner = reader.saved_field("CellData", "fragment", state)?;
    if failed.len() != cells.cells() || owner.len() != cells.cells() {
        return Err(failure(reader.path(), "VTKHDF", "fields of the last state and its mesh do not match"));
    }
    let stands = |cell: usize| cells.grain[cell] >= 0 && failed[cell] < 0.5;
    let mut bodies: BTreeMap<i64, Vec<[Vec3; 3]>> = BTreeMap::new();
    for (nodes, cell) in cells.outside(|cell| stands(cell).then(|| owner[cell] as i64)) {
        bodies.entry(owner[cell] as i64).or_default().push(nodes.map(|node| moved[node]));
    }
    std::fs::create_dir_all(folder).map_err(|e| Error::io("create", folder, e))?;
    for (body, facets) in &bodies {
        put_stl(&folder.join(format!("{stem}_{body:05}.stl")), STL_OF_ONE, facets)?;
    }
    let all = folder.join(format!("{stem}.stl"));
    put_stl(&all, STL_OF_ALL, &bodies.values().flatten().copied().collect::<Vec<_>>())?;
    Ok((all, bodies.len()))
}

/// `says` is what its head of 80 bytes begins with.
fn put_stl(path: &Path, says: &[u8], facets: &[[Vec3; 3]]) -> Result<()> {
    let write = || -> std::io::Result<()> {
        let mut output = BufWriter::new(File::create(path)?);
        let mut head = [b' '; 80];
        head[..says.len()].copy_from_slice(says);
        output.write_all(&head)?;
        output.write_all(&(facets.len() as u32).to_le_bytes())?;
        for [a, b, c] in facets {
            let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(Vec3::zeros);
            for vector in [&normal, a, b, c] {
                for k in 0..3 {
                    output.write_all(&(vector[k] as f32).to_le_bytes())?;
                }
            }
            output.write_all(&[0; 2])?;
        }
        output.flush()
    };
    write().map_err(|e| Error::io("write", path, e))
}
