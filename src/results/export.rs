//! Exports the history, and that of bodies set by hand, as comma-separated values.

use std::io::Write;
use std::path::Path;

use crate::error::{Error, Result};

use super::bodies::BODY_QUANTITIES;
use super::reader::Reader;

/// Writes `/history` with a header line `name [unit]`, one line an increment; floats in the shortest form that
/// reads back to the same bits. `to` names the target in errors.
pub fn write_history_csv(reader: &Reader, output: &mut impl Write, to: &Path) -> Result<()> {
    let rows = reader.increments()?;
    let mut columns: Vec<Vec<String>> = Vec::new();
    for quantity in reader.columns() {
        columns.push(column(reader, quantity.name, quantity.integer)?);
    }
    let header: Vec<String> = reader.columns().map(|q| format!("{} [{}]", q.name, q.units)).collect();
    let mut line = |cells: &[&str]| written(output, cells, to);
    line(&header.iter().map(String::as_str).collect::<Vec<_>>())?;
    (0..rows).try_for_each(|row| line(&columns.iter().map(|c| c[row].as_str()).collect::<Vec<_>>()))
}

/// Writes `/bodies` of a scene: one line a body and increment, the body's name and the increment's numbers first, vectors as
/// three columns each (not a number where a damaged file has none).
pub fn write_bodies_csv(reader: &Reader, output: &mut impl Write, to: &Path) -> Result<()> {
    let rows = reader.increments()?;
    let numbers =
        [column(reader, "stage", true)?, column(reader, "increment", true)?, column(reader, "time", false)?];
    let mut header = ["body", "stage [1]", "increment [1]", "time [1]"].map(str::to_string).to_vec();
    for quantity in &BODY_QUANTITIES {
        header.extend(["x", "y", "z"].map(|axis| format!("{}_{axis} [{}]", quantity.name, quantity.units)));
    }
    written(output, &header.iter().map(String::as_str).collect::<Vec<_>>(), to)?;
    for body in reader.members("bodies")? {
        let mut vectors = Vec::new();
        for quantity in &BODY_QUANTITIES {
            vectors.push(reader.floats(&format!("bodies/{body}/{}", quantity.name))?);
        }
        let name =
            if body.contains([',', '"']) { format!("\"{}\"", body.replace('"', "\"\"")) } else { body };
        for row in 0..rows {
            let components =
                vectors.iter().flat_map(|values| values.chunks_exact(3).nth(row).unwrap_or(&[f64::NAN; 3]));
            let components: Vec<String> = components.map(|value| format!("{value:?}")).collect();
            let leading = std::iter::once(name.as_str()).chain(numbers.iter().map(|n| n[row].as_str()));
            let cells: Vec<&str> = leading.chain(components.iter().map(String::as_str)).collect();
            written(output, &cells, to)?;
        }
    }
    Ok(())
}

/// A column of the history as text.
fn column(reader: &Reader, name: &str, integer: bool) -> Result<Vec<String>> {
    let name = format!("history/{name}");
    Ok(match integer {
        true => reader.integers(&name)?.iter().map(i64::to_string).collect(),
        false => reader.floats(&name)?.iter().map(|value| format!("{value:?}")).collect(),
    })
}

fn written(output: &mut impl Write, cells: &[&str], to: &Path) -> Result<()> {
    writeln!(output, "{}", cells.join(",")).map_err(|e| Error::io("write", to, e))
}
