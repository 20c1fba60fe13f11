//! Exports the saved states as a series of `.vtu` files and a `.pvd` that lists them with their times.
//!
//! Source: VTK file formats (Kitware), XML UnstructuredGrid with appended raw data, 64-bit headers, little-endian.
//! Unlike `/VTKHDF`, whose points stay in the reference configuration, the points of each file are where they
//! are in its state, so that nothing has to be warped. All point and cell data of the file come along.

use std::fmt::Write as _;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

use super::reader::{NumberKind, Reader};
use super::store::failure;
use super::vtkhdf::component_names;

/// One array of a piece: its tag's attributes, and its bytes.
struct Array {
    attributes: String,
    bytes: Vec<u8>,
}

/// Writes `<stem>.pvd` and a `<stem>_<state>.vtu` for each saved state into a folder, which is made where it is missing.
/// Returns the `.pvd`. Errors: no saved states; what cannot be read or written.
pub fn write_vtu_series(reader: &Reader, folder: &Path, stem: &str) -> Result<PathBuf> {
    let states = reader.saved_states()?;
    if states.is_empty() {
        return Err(failure(reader.path(), "VTKHDF", "has no saved states to export"));
    }
    std::fs::create_dir_all(folder).map_err(|e| Error::io("create", folder, e))?;
    let mut list = String::new();
    for (state, saved) in states.iter().enumerate() {
        let name = format!("{stem}_{state:05}.vtu");
        write_state(reader, state, &folder.join(&name))?;
        list += &entry(&name, saved.time);
    }
    write_collection(folder.join(format!("{stem}.pvd")), &list)
}

/// A line of a `.pvd`: a file and the time of its state.
pub(super) fn entry(name: &str, time: f64) -> String {
    format!("    <DataSet timestep=\"{time:?}\" part=\"0\" file=\"{}\"/>\n", escaped(name))
}

/// Writes a `.pvd` of these lines, and gives its path back.
pub(super) fn write_collection(series: PathBuf, list: &str) -> Result<PathBuf> {
    let text = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n  \
         <Collection>\n{list}  </Collection>\n</VTKFile>\n"
    );
    std::fs::write(&series, text).map_err(|e| Error::io("write", &series, e))?;
    Ok(series)
}

fn write_state(reader: &Reader, state: usize, path: &Path) -> Result<()> {
    let count = |name: &str| -> Result<usize> {
        let counts = reader.integers(&format!("VTKHDF/{name}"))?;
        counts.first().and_then(|&n| usize::try_from(n).ok()).ok_or_else(|| {
            failure(reader.path(), &format!("VTKHDF/{name}"), "is not a number of points or cells")
        })
    };
    let (points, cells) = (count("NumberOfPoints")?, count("NumberOfCells")?);
    let mut places = reader.floats_in("VTKHDF/Points", 0, points)?;
    let mut sections = Vec::new();
    for (on, rows) in [("PointData", points), ("CellData", cells)] {
        let mut arrays = Vec::new();
        for name in reader.members(&format!("VTKHDF/{on}"))? {
            let values = reader.saved_field(on, &name, state)?;
            if name == "displacement" && values.len() == places.len() {
                places.iter_mut().zip(&values).for_each(|(place, shift)| *place += shift);
            }
            let kind = reader.number_kind(&format!("VTKHDF/{on}/{name}"))?;
            arrays.push(array(&name, kind, &values, rows));
        }
        sections.push((on, arrays));
    }
    let whole = |name: &str| reader.floats(&format!("VTKHDF/{name}"));
    let offsets: Vec<f64> = whole("Offsets")?.into_iter().skip(1).collect();
    sections.push(("Points", vec![array("points", NumberKind::Float64, &places, points)]));
    let of_cells = [
        array("connectivity", NumberKind::Int64, &whole("Connectivity")?, 0),
        array("offsets", NumberKind::Int64, &offsets, 0),
        array("types", NumberKind::UInt8, &whole("Types")?, 0),
    ];
    sections.push(("Cells", of_cells.into()));
    let file = std::fs::File::create(path).map_err(|e| Error::io("write", path, e))?;
    let mut output = BufWriter::new(file);
    write_piece(&mut output, (points, cells), &sections)
        .and_then(|()| output.flush())
        .map_err(|e| Error::io("write", path, e))
}

fn array(name: &str, kind: NumberKind, values: &[f64], rows: usize) -> Array {
    let components = values.len().checked_div(rows).unwrap_or(1).max(1);
    let name = escaped(name);
    let mut attributes =
        format!("type=\"{}\" Name=\"{name}\" NumberOfComponents=\"{components}\"", kind.vtk_name());
    for (at, component) in component_names(components).into_iter().flatten().enumerate() {
        // Writing to a String cannot fail.
        let _ = write!(attributes, " ComponentName{at}=\"{component}\"");
    }
    let mut bytes = Vec::with_capacity(8 * values.len());
    // The numbers come from a dataset of that kind, so nothing is lost on the way back to it.
    for &value in values {
        match kind {
            NumberKind::Float32 => bytes.extend((value as f32).to_le_bytes()),
            NumberKind::Float64 => bytes.extend(value.to_le_bytes()),
            NumberKind::UInt8 => bytes.push(value as u8),
            NumberKind::Int32 => bytes.extend((value as i32).to_le_bytes()),
            NumberKind::Int64 => bytes.extend((value as i64).to_le_bytes()),
        }
    }
    Array { attributes, bytes }
}

fn write_piece(
    output: &mut impl Write,
    (points, cells): (usize, usize),
    sections: &[(&str, Vec<Array>)],
) -> std::io::Result<()> {
    writeln!(output, "<?xml version=\"1.0\"?>")?;
    writeln!(
        output,
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">"
    )?;
    writeln!(output, "  <UnstructuredGrid>")?;
    writeln!(output, "    <Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">")?;
    let mut at = 0;
    for (section, arrays) in sections {
        writeln!(output, "      <{section}>")?;
        for array in arrays {
            let attributes = &array.attributes;
            writeln!(output, "        <DataArray {attributes} format=\"appended\" offset=\"{at}\"/>")?;
            at += 8 + array.bytes.len();
        }
        writeln!(output, "      </{section}>")?;
    }
    writeln!(output, "    </Piece>\n  </UnstructuredGrid>")?;
    write!(output, "  <AppendedData encoding=\"raw\">\n_")?;
    for array in sections.iter().flat_map(|(_, arrays)| arrays) {
        output.write_all(&(array.bytes.len() as u64).to_le_bytes())?;
        output.write_all(&array.bytes)?;
    }
    writeln!(output, "\n  </AppendedData>\n</VTKFile>")
}

/// A text as XML and HTML take it, in attributes too.
pub fn escaped(text: &str) -> String {
    // XML has no control characters but these.
    let text = text.replace(|c: char| c.is_control() && !['\n', '\t', '\r'].contains(&c), "\u{fffd}");
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
