//! A CSV of any country: a header whose cells say a column and its unit, as "sieve [mm]" or "x (m)", and rows of numbers.
//!
//! Commas, semicolons or tabs part the cells; where no comma does, decimals may stand behind one. Lines that begin with # are left out, but for the first
//! of YADE's tables, which says their columns: `#format x_y_z_r`.

use std::borrow::Cow;
use std::path::Path;

use crate::input;
use crate::quantity::Dimension;
use crate::report::{Row, Sheet, heading};

/// A table's cells.
pub struct Columns {
    /// Name in small letters and, where there is one, unit.
    pub header: Vec<(String, Option<String>)>,
    pub rows: Vec<Row>,
    separator: u8,
}

impl Columns {
    /// Reads a file; otherwise what is wrong with it.
    pub fn read(path: &Path) -> Result<Self, String> {
        let bytes = input::read_named(path).map_err(|e| format!("cannot be read: {e}"))?;
        Columns::parse(&input::table_of(&bytes)?)
    }

    pub fn parse(text: &str) -> Result<Self, String> {
        let of_yade = text.strip_prefix("#format ").and_then(|text| text.split_once('\n'));
        let text = &of_yade.map_or(Cow::Borrowed(text), |(names, rows)| {
            Cow::Owned(format!("{}\n{rows}", names.trim_end().replace('_', "\t")))
        });
        let Sheet { separator, mut rows } =
            Sheet::parse(text).map_err(|(line, problem)| format!("line {line}: {problem}"))?;
        if rows.is_empty() {
            return Err("is empty".into());
        }
        let (_, header) = rows.remove(0);
        if header.len() < 2 {
            return Err("has a header of one column".into());
        }
        let parted = |cell: &str| {
            let (name, unit) = heading(cell);
            (name.to_lowercase(), unit.map(str::to_string))
        };
        let is_long = |(_, cells): &&Row| cells.iter().skip(header.len()).any(|cell| !cell.is_empty());
        if let Some((line, _)) = rows.iter().find(is_long) {
            return Err(format!(
                "line {line}: more cells than the header; decimal commas need semicolons between the cells"
            ));
        }
        Ok(Columns { header: header.iter().map(parted).collect(), rows, separator })
    }

    /// The first column of this name.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|(column, _)| column == name)
    }

    /// The rows with the largest number in a column.
    pub fn with_largest(mut self, column: usize) -> Result<Self, String> {
        let numbers = self.rows.iter().map(|row| self.number(row, column)).collect::<Result<Vec<_>, _>>()?;
        let largest = numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mut numbers = numbers.into_iter();
        self.rows.retain(|_| numbers.next() == Some(largest));
        Ok(self)
    }

    /// The unit of length of a column [m].
    pub fn metres(&self, column: usize) -> Option<f64> {
        Dimension::Length.si_of(self.header.get(column)?.1.as_deref()?)
    }

    /// A cell; nothing where its row ends before.
    pub fn cell((_, cells): &Row, column: usize) -> &str {
        cells.get(column).unwrap_or("").trim_matches(['"', ' '])
    }

    /// A cell as a number; a sign of per cent behind it is passed over.
    pub fn number(&self, row: &Row, column: usize) -> Result<f64, String> {
        let cell = Columns::cell(row, column);
        let plain = if self.separator == b',' { cell.to_string() } else { cell.replace(',', ".") };
        let value = plain.trim_end_matches('%').trim().parse::<f64>().ok().filter(|value| value.is_finite());
        value.ok_or_else(|| format!("line {}: {cell:?} is no number", row.0))
    }
}
