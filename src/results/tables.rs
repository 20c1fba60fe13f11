//! Exports the tables of a results file but the history as comma-separated values: grains, stages, contacts, specimen, rock,
//! gradings and breakage, pieces. A column is a dataset, its unit in the header; vectors and stresses are several columns.

use std::fs::File;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

use super::export::plain_cell;
use super::grains::GRAIN_QUANTITIES;
use super::reader::{NumberKind, Reader};

/// Datasets that only name axes.
const AXES: [&str; 2] = ["axis", "component"];
/// Groups of tables with equal columns: what a member is called, and in which order.
const SERIES: [(&str, &str); 2] = [("stages", "stage [1]"), ("contacts", "state [1]")];
/// Columns of `/rock` in the unit of the quantity that a row is about.
const OF_QUANTITY: [&str; 5] = ["mean_asked", "mean", "deviation", "smallest", "largest"];
const SINGLE: [&str; 3] = ["specimen", "breakage", "pieces"];

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

impl Export<'_> {
    /// `/grains`: once as generated, once a saved state.
    fn grains(&mut self) -> Result<()> {
        let names = self.datasets("grains")?;
        let changing = |name: &String| GRAIN_QUANTITIES.iter().any(|quantity| quantity.name == name);
        let (states, fixed): (Vec<String>, Vec<String>) =
            names.into_iter().filter(|name| name != "state").partition(changing);
        if let Some(first) = fixed.first() {
            let grains = self.reader.shape(&format!("grains/{first}"))?.first().copied().unwrap_or(0);
            let columns = self.columns("grains", &fixed, 1)?;
            self.table("grains", &[], [(vec![], grains, columns)])?;
        }
        let Some(first) = states.first() else { return Ok(()) };
        let shape = self.reader.shape(&format!("grains/{first}"))?;
        let &[count, grains, ..] = &shape[..] else { return Ok(()) };
        let columns = self.columns("grains", &states, 2)?;
        let numbers =
            Numbers::Integers((0..count * grains).map(|row| (row / grains.max(1)) as i64).collect());
        let state = Column { header: vec!["state [1]".into()], numbers };
        let numbers =
            Numbers::Integers((0..count * grains).map(|row| (row % grains.max(1)) as i64).collect());
        let grain = Column { header: vec!["grain [1]".into()], numbers };
        let all = [state, grain].into_iter().chain(columns).collect();
        self.table("grains_states", &[], [(vec![], count * grains, all)])
    }

    /// Tables of equal columns below each other.
    fn series(&mut self, group: &str, member: &str) -> Result<()> {
        let mut names = self.reader.members(group)?;
        // Numbers come in their own order, not the alphabet's.
        names.sort_by_key(|name| (name.parse::<usize>().unwrap_or(usize::MAX), name.clone()));
        let mut parts = Vec::new();
        for name in names {
            let place = format!("{group}/{name}");
            let datasets = self.datasets(&place)?;
            let Some(first) = datasets.first() else { continue };
            let rows = self.reader.shape(&format!("{place}/{first}"))?.first().copied().unwrap_or(0);
            // Where there is nothing yet, columns may be missing too.
            if rows > 0 {
                parts.push((name, place, datasets, rows));
            }
        }
        if parts.is_empty() {
            return Ok(());
        }
        let reader = self.reader;
        // Read when written: the contacts of all states at once would be too much.
        let tables = parts.iter().map(|(name, place, datasets, rows)| {
            columns_of(reader, place, datasets, 1)
                .map(|columns| (vec![plain_cell(name).into_owned()], *rows, columns))
        });
        self.write(group, &[member.to_string()], tables)
    }

    /// `/rock`: a row a quantity, its unit in a column, since strengths are in Pa and Poisson's ratio is a number.
    fn rock(&mut self) -> Result<()> {
        let mut parts = Vec::new();
        for name in self.reader.members("rock")? {
            let place = format!("rock/{name}");
            let datasets = self.datasets(&place)?;
            let of_quantity = |name: &&String| OF_QUANTITY.contains(&name.as_str());
            let Some(first) = datasets.iter().find(of_quantity) else { continue };
            let rows = self.reader.shape(&format!("{place}/{first}"))?.first().copied().unwrap_or(0);
            let unit = self.reader.text_attribute(&format!("{place}/{first}"), "units")?;
            let mut columns = self.columns(&place, &datasets, 1)?;
            for (column, dataset) in columns.iter_mut().zip(&datasets) {
                if OF_QUANTITY.contains(&dataset.as_str()) {
                    column.header = vec![dataset.clone()];
                }
            }
            let lead = [&name, &unit].map(|cell| plain_cell(cell).into_owned());
            parts.push(Ok((lead.to_vec(), rows, columns)));
        }
        if parts.is_empty() {
            return Ok(());
        }
        self.write("rock", &["quantity".into(), "unit".into()], parts.into_iter())
    }

    /// A group's own datasets as one table, those of each group in it as another.
    fn single(&mut self, group: &str) -> Result<()> {
        let names = self.datasets(group)?;
        if let Some(first) = names.first() {
            let rows = self.reader.shape(&format!("{group}/{first}"))?.first().copied().unwrap_or(0);
            let columns = self.columns(group, &names, 1)?;
            self.table(&group.replace('/', "_"), &[], [(vec![], rows, columns)])?;
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

    fn columns(&self, group: &str, names: &[String], axes: usize) -> Result<Vec<Column>> {
        columns_of(self.reader, group, names, axes)
    }

    fn table<const N: usize>(&mut self, name: &str, lead: &[String], parts: [Part; N]) -> Result<()> {
        self.write(name, lead, parts.into_iter().map(Ok))
    }

    /// `lead` names the first cells of each row, which are the same in a whole part.
    fn write(
        &mut self,
        name: &str,
        lead: &[String],
        parts: impl Iterator<Item = Result<Part>>,
    ) -> Result<()> {
        let target = self.folder.join(format!("{}_{name}.csv", self.stem));
        let file = File::create(&target).map_err(|e| Error::io("write", &target, e))?;
        let mut table = csv::Writer::from_writer(std::io::BufWriter::new(file));
        let failed = |e: csv::Error| Error::io("write", &target, e.into());
        let mut header = Vec::new();
        for part in parts {
            let (cells, rows, columns) = part?;
            let own: Vec<&String> =
                lead.iter().chain(columns.iter().flat_map(|column| &column.header)).collect();
            if header.is_empty() {
                table.write_record(&own).map_err(failed)?;
                header = own.into_iter().cloned().collect();
            } else if !header.iter().eq(own) {
                return Err(Error::Results {
                    file: self.reader.path().to_path_buf(),
                    dataset: format!("{name}/{}", cells.join(" ")),
                    message: "has other columns than the one before".into(),
                });
            }
            for row in 0..rows {
                let numbers = columns.iter().flat_map(|column| column.cells(row));
                table.write_record(cells.iter().cloned().chain(numbers)).map_err(failed)?;
            }
        }
        table.flush().map_err(|e| Error::io("write", &target, e))?;
        self.written.push(target);
        Ok(())
    }
}

/// The first cells of its rows, how many there are, and their columns.
type Part = (Vec<String>, usize, Vec<Column>);

/// The datasets of a group as columns; of their axes the first `axes` count rows.
fn columns_of(reader: &Reader, group: &str, names: &[String], axes: usize) -> Result<Vec<Column>> {
    let read = |name: &String| {
        let place = format!("{group}/{name}");
        let width = reader.shape(&place)?.iter().skip(axes).product();
        let units = reader.text_attribute(&place, "units")?;
        let header = header(name, &units, width);
        let numbers = match reader.number_kind(&place)? {
            NumberKind::Float32 | NumberKind::Float64 => Numbers::Floats(reader.floats(&place)?),
            NumberKind::UInt8 | NumberKind::Int32 | NumberKind::Int64 => {
                Numbers::Integers(reader.integers(&place)?)
            }
        };
        Ok(Column { header, numbers })
    };
    names.iter().map(read).collect()
}

/// What the columns of a dataset of this width are called: names of a file that may be anyone's, and no formulas.
fn header(name: &str, units: &str, width: usize) -> Vec<String> {
    let part = |part: &str| plain_cell(&format!("{name}{part} [{units}]")).into_owned();
    match width {
        1 => vec![part("")],
        3 => ["_x", "_y", "_z"].map(part).to_vec(),
        6 => ["_xx", "_yy", "_zz", "_xy", "_yz", "_xz"].map(part).to_vec(),
        _ => (0..width).map(|k| part(&format!("_{k}"))).collect(),
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
}
