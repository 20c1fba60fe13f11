//! Exports a results file as comma-separated values: the history, that of a scene's bodies, and the other tables: grains, stages, contacts,
//! specimen, rock, gradings and breakage, pieces. A column is a dataset, its unit in the header; vectors and stresses are several columns.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

use super::history::{BODY_QUANTITIES, GRAIN_QUANTITIES, HISTORY, Quantity};
use super::reader::{NumberKind, Reader};
use super::store::failure;
use super::summary::in_order;
use super::vtkhdf::component_names;

/// Datasets that only name axes.
const AXES: [&str; 2] = ["axis", "component"];
/// Groups of tables with equal columns: what a member is called, and in which order.
const SERIES: [(&str, &str); 2] = [("stages", "stage [1]"), ("contacts", "state [1]")];
/// Columns of `/rock` in the unit of the quantity that a row is about.
const OF_QUANTITY: [&str; 5] = ["mean_asked", "mean", "deviation", "smallest", "largest"];
const SINGLE: [&str; 3] = ["specimen", "breakage", "pieces"];

/// Writes `/history` with a header line `name [unit]`, one line an increment; floats in the shortest form that
/// reads back to the same bits. `to` names the target in errors.
pub fn write_history_csv(reader: &Reader, output: &mut impl Write, to: &Path) -> Result<()> {
    let columns = known_columns(reader, "history", reader.columns())?;
    write_parts(reader, "history", (output, to), &[], [Ok((vec![], reader.increments()?, columns))])
}

/// Writes `/bodies` of a scene: one line a body and increment, the body's name and the increment's numbers first, vectors as
/// three columns each (not a number where a damaged file has none).
pub fn write_bodies_csv(reader: &Reader, output: &mut impl Write, to: &Path) -> Result<()> {
    let rows = reader.increments()?;
    let parts = reader.members("bodies")?.into_iter().map(|body| -> Result<Part> {
        // Stage, increment and time.
        let mut columns = known_columns(reader, "history", &HISTORY[..3])?;
        columns.extend(known_columns(reader, &format!("bodies/{body}"), BODY_QUANTITIES)?);
        Ok((vec![plain_cell(&body).into_owned()], rows, columns))
    });
    write_parts(reader, "bodies", (output, to), &["body"], parts)
}

/// Writes one file a table into `folder`, `<stem>_<table>.csv`; their paths.
///
/// # Errors
/// Files that cannot be read or written.
pub fn write_tables(reader: &Reader, folder: &Path, stem: &str) -> Result<Vec<PathBuf>> {
    let mut export = Export { reader, folder, stem, written: Vec::new() };
    export.grains()?;
    for (group, member) in SERIES {
        export.series(group, member)?;
    }
    export.rock()?;
    for group in SINGLE {
        export.single(group)?;
    }
    Ok(export.written)
}

/// A text as a cell of a table that a spreadsheet may open: one that it would take for a formula begins with an apostrophe.
pub fn plain_cell(text: &str) -> std::borrow::Cow<'_, str> {
    let formula = text.starts_with(['=', '+', '-', '@', '\t', '\r']) && text.parse::<f64>().is_err();
    match formula {
        true => format!("'{text}").into(),
        false => text.into(),
    }
}

struct Export<'a> {
    reader: &'a Reader,
    folder: &'a Path,
    stem: &'a str,
    written: Vec<PathBuf>,
}

/// A dataset as columns of a table.
struct Column {
    header: Vec<String>,
    numbers: Numbers,
}

enum Numbers {
    Floats(Vec<f64>),
    Integers(Vec<i64>),
}

/// The first cells of its rows, how many there are, and their columns.
type Part = (Vec<String>, usize, Vec<Column>);

impl Export<'_> {
    /// `/grains`: once as generated, once a saved state.
    fn grains(&mut self) -> Result<()> {
        let names = self.datasets("grains")?;
        let changing = |name: &String| GRAIN_QUANTITIES.iter().any(|quantity| quantity.name == name);
        let (states, fixed): (Vec<String>, Vec<String>) =
            names.into_iter().filter(|name| name != "state").partition(changing);
        if !fixed.is_empty() {
            let part = part_of(self.reader, "grains", &fixed, vec![]);
            self.write("grains", &[], [part])?;
        }
        let Some(first) = states.first() else { return Ok(()) };
        let shape = self.reader.shape(&format!("grains/{first}"))?;
        let &[count, grains, ..] = &shape[..] else { return Ok(()) };
        let numbered = |name: &str, number: &dyn Fn(usize) -> usize| Column {
            header: vec![name.into()],
            numbers: Numbers::Integers((0..count * grains).map(|row| number(row) as i64).collect()),
        };
        let mut columns = vec![
            numbered("state [1]", &|row| row / grains.max(1)),
            numbered("grain [1]", &|row| row % grains.max(1)),
        ];
        if fixed.iter().any(|name| name == "sieve_size") {
            // With it the table is a packing that a case can begin with.
            let sizes = self.reader.floats("grains/sieve_size")?;
            let of_row = |row: usize| sizes.get(row % grains.max(1)).copied().unwrap_or(f64::NAN);
            columns.push(Column {
                header: header("sieve_size", "m", 1),
                numbers: Numbers::Floats((0..count * grains).map(of_row).collect()),
            });
        }
        columns.extend(columns_of(self.reader, "grains", &states, 2)?);
        self.write("grains_states", &[], [Ok((vec![], count * grains, columns))])
    }

    /// Tables of equal columns below each other.
    fn series(&mut self, group: &str, member: &str) -> Result<()> {
        let reader = self.reader;
        let mut parts = Vec::new();
        for name in in_order(reader.members(group)?) {
            let place = format!("{group}/{name}");
            let datasets = self.datasets(&place)?;
            // Where there is nothing yet, columns may be missing too.
            if rows_of(reader, &place, &datasets)? > 0 {
                parts.push((name, place, datasets));
            }
        }
        if parts.is_empty() {
            return Ok(());
        }
        // Read when written: the contacts of all states at once would be too much.
        let tables = parts.iter().map(|(name, place, datasets)| {
            part_of(reader, place, datasets, vec![plain_cell(name).into_owned()])
        });
        self.write(group, &[member], tables)
    }

    /// `/rock`: a row a quantity, its unit in a column, since strengths are in Pa and Poisson's ratio is a number.
    fn rock(&mut self) -> Result<()> {
        let is_of_quantity = |name: &String| OF_QUANTITY.contains(&name.as_str());
        let mut parts = Vec::new();
        for name in self.reader.members("rock")? {
            let place = format!("rock/{name}");
            let datasets = self.datasets(&place)?;
            let Some(first) = datasets.iter().find(|name| is_of_quantity(name)) else { continue };
            let unit = self.reader.text_attribute(&format!("{place}/{first}"), "units")?;
            let lead = [&name, &unit].map(|cell| plain_cell(cell).into_owned());
            let (lead, rows, mut columns) = part_of(self.reader, &place, &datasets, lead.to_vec())?;
            for (column, dataset) in
                columns.iter_mut().zip(&datasets).filter(|(_, name)| is_of_quantity(name))
            {
                column.header = vec![dataset.clone()];
            }
            parts.push(Ok((lead, rows, columns)));
        }
        match parts.is_empty() {
            true => Ok(()),
            false => self.write("rock", &["quantity", "unit"], parts),
        }
    }

    /// A group's own datasets as one table, those of each group in it as another.
    fn single(&mut self, group: &str) -> Result<()> {
        let names = self.datasets(group)?;
        if !names.is_empty() {
            let part = part_of(self.reader, group, &names, vec![]);
            self.write(&group.replace('/', "_"), &[], [part])?;
        }
        for name in self.reader.members(group)? {
            let inner = format!("{group}/{name}");
            if self.reader.is_group(&inner) {
                self.single(&inner)?;
            }
        }
        Ok(())
    }

    /// Names of a group's datasets.
    fn datasets(&self, group: &str) -> Result<Vec<String>> {
        let mut names = self.reader.members(group)?;
        names.retain(|name| {
            !AXES.contains(&name.as_str()) && !self.reader.is_group(&format!("{group}/{name}"))
        });
        // HDF5 lists members as it likes.
        names.sort();
        Ok(names)
    }

    fn write(
        &mut self,
        name: &str,
        lead: &[&str],
        parts: impl IntoIterator<Item = Result<Part>>,
    ) -> Result<()> {
        let target = self.folder.join(format!("{}_{name}.csv", self.stem));
        let mut file = File::create(&target).map_err(|e| Error::io("write", &target, e))?;
        write_parts(self.reader, name, (&mut file, target.as_path()), lead, parts)?;
        self.written.push(target);
        Ok(())
    }
}

/// Writes parts below each other, which must have the same columns. `lead` names the first cells of each row, which are the same in a
/// whole part; `name` and the path behind the output are for errors.
fn write_parts(
    reader: &Reader,
    name: &str,
    (output, to): (&mut impl Write, &Path),
    lead: &[&str],
    parts: impl IntoIterator<Item = Result<Part>>,
) -> Result<()> {
    let mut table = csv::Writer::from_writer(output);
    let failed = |e: csv::Error| Error::io("write", to, e.into());
    let mut header: Vec<String> = Vec::new();
    for part in parts {
        let (cells, rows, columns) = part?;
        let mut own: Vec<String> = lead.iter().map(|cell| cell.to_string()).collect();
        own.extend(columns.iter().flat_map(|column| column.header.iter().cloned()));
        if header.is_empty() {
            table.write_record(&own).map_err(failed)?;
            header = own;
        } else if header != own {
            let dataset = format!("{name}/{}", cells.join(" "));
            return Err(failure(reader.path(), &dataset, "has other columns than the one before"));
        }
        for row in 0..rows {
            let numbers = columns.iter().flat_map(|column| column.cells(row));
            table.write_record(cells.iter().cloned().chain(numbers)).map_err(failed)?;
        }
    }
    table.flush().map_err(|e| Error::io("write", to, e))
}

/// The datasets of a group, with the first cells of their rows.
fn part_of(reader: &Reader, group: &str, names: &[String], lead: Vec<String>) -> Result<Part> {
    Ok((lead, rows_of(reader, group, names)?, columns_of(reader, group, names, 1)?))
}

/// Rows of the datasets of a group, by the first of them.
fn rows_of(reader: &Reader, group: &str, names: &[String]) -> Result<usize> {
    let Some(first) = names.first() else { return Ok(0) };
    Ok(reader.shape(&format!("{group}/{first}"))?.first().copied().unwrap_or(0))
}

/// The datasets of a group as columns; of their axes the first `axes` count rows.
fn columns_of(reader: &Reader, group: &str, names: &[String], axes: usize) -> Result<Vec<Column>> {
    let read = |name: &String| -> Result<Column> {
        let units = reader.text_attribute(&format!("{group}/{name}"), "units")?;
        column_of(reader, group, name, &units, axes)
    };
    names.iter().map(read).collect()
}

/// The datasets of quantities in a group as columns, in the units that they are known to have.
fn known_columns<'a>(
    reader: &Reader,
    group: &str,
    quantities: impl IntoIterator<Item = &'a Quantity>,
) -> Result<Vec<Column>> {
    quantities.into_iter().map(|known| column_of(reader, group, known.name, known.units, 1)).collect()
}

fn column_of(reader: &Reader, group: &str, name: &str, units: &str, axes: usize) -> Result<Column> {
    let place = format!("{group}/{name}");
    let width = reader.shape(&place)?.iter().skip(axes).product();
    let numbers = match reader.number_kind(&place)? {
        NumberKind::Float32 | NumberKind::Float64 => Numbers::Floats(reader.floats(&place)?),
        NumberKind::UInt8 | NumberKind::Int32 | NumberKind::Int64 => {
            Numbers::Integers(reader.integers(&place)?)
        }
    };
    Ok(Column { header: header(name, units, width), numbers })
}

/// What the columns of a dataset of this width are called: names of a file that may be anyone's, and no formulas.
fn header(name: &str, units: &str, width: usize) -> Vec<String> {
    let part = |part: &str| plain_cell(&format!("{name}{part} [{units}]")).into_owned();
    match (width, component_names(width)) {
        (1, _) => vec![part("")],
        (_, Some(names)) => names.iter().map(|name| part(&format!("_{name}"))).collect(),
        (_, None) => (0..width).map(|k| part(&format!("_{k}"))).collect(),
    }
}

impl Column {
    /// Its cells in a row; not a number where a damaged file has none.
    fn cells(&self, row: usize) -> Vec<String> {
        let width = self.header.len();
        let place = |k: usize| row * width + k;
        let cell = |k: usize| match &self.numbers {
            Numbers::Floats(values) => format!("{:?}", values.get(place(k)).unwrap_or(&f64::NAN)),
            Numbers::Integers(values) => values.get(place(k)).map_or("NaN".into(), i64::to_string),
        };
        (0..width).map(cell).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_named_by_their_parts_and_are_no_formulas() {
        assert_eq!(header("position", "m", 3), ["position_x [m]", "position_y [m]", "position_z [m]"]);
        assert_eq!(header("share", "1", 2), ["share_0 [1]", "share_1 [1]"]);
        let hostile = header("=1+1", "1", 1);
        assert!(!hostile[0].starts_with('='), "{hostile:?}");
    }

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
