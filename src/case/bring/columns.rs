//! A CSV of any country: a header whose cells say a column and its unit, as "sieve [mm]" or "x (m)", and rows of numbers.
//!
//! Commas, semicolons or tabs part the cells; where no comma does, decimals may stand behind one. Lines that begin with # are left out.

use std::path::Path;

use crate::input;
use crate::report::{heading, plain_unit, separator_line};

use super::words::{METRES, UNITS};

/// A table's cells.
pub struct Columns {
    /// Name and, where there is one, unit, both in small letters.
    pub header: Vec<(String, Option<String>)>,
    /// Number of the line in the file, and cells.
    pub rows: Vec<(usize, Vec<String>)>,
    separator: char,
}

impl Columns {
    /// Reads a file; otherwise what is wrong with it.
    pub fn read(path: &Path) -> Result<Self, String> {
        let bytes = input::read_named(path).map_err(|e| format!("cannot be read: {e}"))?;
        Columns::parse(&input::text_of(&bytes))
    }

    pub fn parse(text: &str) -> Result<Self, String> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let (said, text) = separator_line(text);
        let mut lines = text
            .lines()
            .enumerate()
            .map(|(at, line)| (at + 1, line.trim()))
            .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let (_, header) = lines.next().ok_or("is empty")?;
        let found = [';', '\t', ','].into_iter().find(|c| header.contains(*c));
        let separator = said.or(found).ok_or("has a header of one column")?;
        let cells = |line: &str| -> Vec<String> {
            line.split(separator).map(|cell| cell.trim().trim_matches('"').trim().to_string()).collect()
        };
        let parted = |cell: &String| {
            let (name, unit) = heading(cell);
            (name.to_lowercase(), unit.map(plain_unit))
        };
        let header: Vec<_> = cells(header).iter().map(parted).collect();
        let rows: Vec<_> = lines.map(|(line, row)| (line, cells(row))).collect();
        let long = |row: &&(usize, Vec<String>)| row.1.iter().skip(header.len()).any(|cell| !cell.is_empty());
        if let Some((line, _)) = rows.iter().find(long) {
            return Err(format!(
                "line {line}: more cells than the header; decimal commas need semicolons between the cells"
            ));
        }
        Ok(Columns { header, rows, separator })
    }

    /// The unit of length of a column [m].
    pub fn metres(&self, column: usize) -> Option<f64> {
        let unit = self.header.get(column)?.1.as_deref()?;
        UNITS.iter().zip(METRES).find(|(name, _)| **name == unit).map(|(_, metres)| metres)
    }

    /// A cell as a number; a sign of per cent behind it is passed over.
    pub fn number(&self, (line, cells): &(usize, Vec<String>), column: usize) -> Result<f64, String> {
        let cell = cells.get(column).map_or("", String::as_str);
        let plain = if self.separator == ',' { cell.to_string() } else { cell.replace(',', ".") };
        let value = plain.trim_end_matches('%').trim().parse::<f64>().ok().filter(|value| value.is_finite());
        value.ok_or_else(|| format!("line {line}: {cell:?} is no number"))
    }
}
