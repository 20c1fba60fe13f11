//! Exports the history, and that of bodies set by hand, as comma-separated values.

use std::io::Write;
use std::path::Path;

use crate::error::{Error, Result};

use super::bodies::BODY_QUANTITIES;
use super::history::Quantity;
use super::reader::Reader;

/// Writes `/history` with a header line `name [unit]`, one line an increment; floats in the shortest form that
/// reads back to the same bits. `to` names the target in errors.
pub fn write_history_csv(reader: &Reader, output: &mut impl Write, to: &Path) -> Result<()> {
    let mut columns: Vec<Vec<String>> = Vec::new();
    for quantity in reader.columns() {
        columns.push(column(reader, quantity.name, quantity.integer)?);
    }
    let rows = reader.increments()?;
    let write = || -> csv::Result<()> {
        let mut table = csv::Writer::from_writer(output);
        table.write_record(reader.columns().map(|q| format!("{} [{}]", q.name, q.units)))?;
        for row in 0..rows {
            table.write_record(columns.iter().map(|column| &column[row]))?;
        }
        Ok(table.flush()?)
    };
    write().map_err(|e| Error::io("write", to, e.into()))
}

/// Writes `/bodies` of a scene: one line a body and increment, the body's name and the increment's numbers first, vectors as
/// three columns each (not a number where a damaged file has none).
pub fn write_bodies_csv(reader: &Reader, output: &mut impl Write, to: &Path) -> Result<()> {
    let mut bodies = Vec::new();
    for body in reader.members("bodies")? {
        let vectors = |quantity: &Quantity| reader.floats(&format!("bodies/{body}/{}", quantity.name));
        let vectors = BODY_QUANTITIES.iter().map(vectors).collect::<Result<Vec<_>>>()?;
        bodies.push((body, vectors));
    }
    let numbers =
        [column(reader, "stage", true)?, column(reader, "increment", true)?, column(reader, "time", false)?];
    let rows = reader.increments()?;
    let write = || -> csv::Result<()> {
        let mut table = csv::Writer::from_writer(output);
        let mut header = ["body", "stage [1]", "increment [1]", "time [1]"].map(str::to_string).to_vec();
        for q in &BODY_QUANTITIES {
            header.extend(["x", "y", "z"].map(|axis| format!("{}_{axis} [{}]", q.name, q.units)));
        }
        table.write_record(&header)?;
        for (body, vectors) in &bodies {
            for row in 0..rows {
                table.write_field(plain_cell(body).as_bytes())?;
                for number in &numbers {
                    table.write_field(&number[row])?;
                }
                for values in vectors {
                    for value in values.chunks_exact(3).nth(row).unwrap_or(&[f64::NAN; 3]) {
                        table.write_field(format!("{value:?}"))?;
                    }
                }
                table.write_record(None::<&[u8]>)?;
            }
        }
        Ok(table.flush()?)
    };
    write().map_err(|e| Error::io("write", to, e.into()))
}

/// A text as a cell of a table that a spreadsheet may open: one that it would take for a formula begins with an apostrophe.
pub fn plain_cell(text: &str) -> std::borrow::Cow<'_, str> {
    let formula = text.starts_with(['=', '+', '-', '@', '\t', '\r']) && text.parse::<f64>().is_err();
    match formula {
        true => format!("'{text}").into(),
        false => text.into(),
    }
}

/// A column of the history as text.
fn column(reader: &Reader, name: &str, integer: bool) -> Result<Vec<String>> {
    let name = format!("history/{name}");
    Ok(match integer {
        true => reader.integers(&name)?.iter().map(i64::to_string).collect(),
        false => reader.floats(&name)?.iter().map(|value| format!("{value:?}")).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_cell_is_a_formula() {
        for (text, cell) in [
            ("=cmd|'/c calc'!A0", "'=cmd|'/c calc'!A0"),
            ("@SUM(A1)", "'@SUM(A1)"),
            ("+x", "'+x"),
            ("-2+3", "'-2+3"),
            ("\t=1", "'\t=1"),
            ("-2.5e-3", "-2.5e-3"),
            ("-inf", "-inf"),
            ("left", "left"),
        ] {
            assert_eq!(plain_cell(text), cell);
        }
    }
}
