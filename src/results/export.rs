//! Exports the history as comma-separated values.

use std::io::Write;

use crate::error::{Error, Result};

use super::reader::Reader;

/// Writes `/history` with a header line `name [unit]`, one line an increment; floats in the shortest form that
/// reads back to the same bits. `to` names the target in errors.
pub fn write_history_csv(reader: &Reader, output: &mut impl Write, to: &std::path::Path) -> Result<()> {
    let rows = reader.increments()?;
    let mut columns: Vec<Vec<String>> = Vec::new();
    for quantity in reader.columns() {
        let name = format!("history/{}", quantity.name);
        columns.push(match quantity.integer {
            true => reader.integers(&name)?.iter().map(i64::to_string).collect(),
            false => reader.floats(&name)?.iter().map(|value| format!("{value:?}")).collect(),
        });
    }
    let header: Vec<String> = reader.columns().map(|q| format!("{} [{}]", q.name, q.units)).collect();
    let lines = std::iter::once(header.join(",")).chain((0..rows).map(|row| {
        let cells: Vec<&str> = columns.iter().map(|column| column[row].as_str()).collect();
        cells.join(",")
    }));
    for line in lines {
        writeln!(output, "{line}").map_err(|e| Error::io("write", to, e))?;
    }
    Ok(())
}
