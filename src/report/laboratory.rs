//! Laboratory curves: a CSV file that is overlaid on the computed ones.
//!
//! ```text
//! # remarks and empty lines are skipped
//! curve, axial_strain [%], deviatoric_stress [MPa], volumetric_strain [%]
//! 0.8 MPa, 0,   0,    0
//! 0.8 MPa, 0.5, 1.21, 0.18
//! 1.6 MPa, 0,   0,    0
//! ```
//!
//! The first line names the columns, in any order, each with its unit in brackets: `axial_strain` is needed, and at least
//! one of `deviatoric_stress` and `volumetric_strain`; `curve` tells curves apart. Strains are in `%` or `1`, stresses in
//! `Pa`, `kPa` or `MPa`; without a unit, SI. Compression and contraction count positive. A cell may be empty. Commas,
//! semicolons or tabs part the cells. Other columns are left out, so that what `riprap export --csv` writes can be overlaid too.

use std::path::Path;

use crate::error::{Error, Result};

/// One measured curve, in SI, compression positive.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LaboratoryCurve {
    pub label: String,
    /// Not a number where a cell is empty.
    pub axial_strain: Vec<f64>,
    pub deviatoric_stress: Vec<f64>,
    pub volumetric_strain: Vec<f64>,
}

const COLUMNS: [&str; 4] = ["curve", "axial_strain", "deviatoric_stress", "volumetric_strain"];

/// Reads a file of laboratory curves.
///
/// # Errors
/// `Error::Io`; `Error::Usage` with file and line for what is no such table.
pub fn read_laboratory(path: &Path) -> Result<Vec<LaboratoryCurve>> {
    let bytes = std::fs::read(path).map_err(|e| Error::io("read", path, e))?;
    let text = String::from_utf8(bytes)
        .map_err(|_| Error::Usage(format!("{}: is not UTF-8 text", path.display())))?;
    let stem = path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy();
    parse(&text, &format!("laboratory, {stem}"))
        .map_err(|(line, message)| Error::Usage(format!("{}:{line}: {message}", path.display())))
}

/// The rows of a table, each with the number of its line; without remarks and empty lines.
fn records(text: &str, separator: u8) -> Result<Vec<(usize, csv::StringRecord)>, (usize, String)> {
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator)
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let line_of = |position: Option<&csv::Position>| position.map_or(1, |at| at.line() as usize);
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| (line_of(e.position()), e.to_string()))?;
        let is_remark = record.get(0).is_some_and(|first| first.starts_with('#'));
        if !is_remark && record.iter().any(|cell| !cell.is_empty()) {
            rows.push((line_of(record.position()), record));
        }
    }
    Ok(rows)
}

/// `name` is the curve's where the table has no `curve` column. The error is a line number and what is wrong there.
fn parse(text: &str, name: &str) -> Result<Vec<LaboratoryCurve>, (usize, String)> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let is_content = |line: &str| !line.trim().is_empty() && !line.trim().starts_with('#');
    let header = text.lines().find(|line| is_content(line)).unwrap_or("");
    let separator = [b';', b'\t', b','].into_iter().find(|&c| header.contains(char::from(c))).unwrap_or(b',');
    let mut rows = records(text, separator)?.into_iter();
    let Some((header_line, header)) = rows.next() else {
        return Err((1, "has no header line".into()));
    };
    let mut places: [Option<(usize, f64)>; 4] = [None; 4];
    for (at, cell) in header.iter().enumerate() {
        let cell = cell.trim_matches('"');
        let (column, unit) = match cell.split_once('[') {
            Some((column, unit)) => (column.trim(), Some(unit.trim_end_matches(']').trim())),
            None => (cell, None),
        };
        let Some(number) = COLUMNS.iter().position(|known| *known == column) else { continue };
        let factor = match (number, unit) {
            (0, _) | (_, None | Some("1" | "-" | "")) if number != 2 || unit.is_none() => 1.0,
            (1 | 3, Some("%")) => 0.01,
            (2, Some("Pa")) => 1.0,
            (2, Some("kPa")) => 1e3,
            (2, Some("MPa")) => 1e6,
            (_, unit) => {
                let accepted = if number == 2 { "Pa, kPa, MPa" } else { "%, 1" };
                let unit = unit.unwrap_or_default();
                return Err((
                    header_line,
                    format!("{column}: unit [{unit}] is unknown (accepted: {accepted})"),
                ));
            }
        };
        if places[number].is_some() {
            return Err((header_line, format!("has two columns {column}")));
        }
        places[number] = Some((at, factor));
    }
    if places[1].is_none() {
        return Err((header_line, "has no column axial_strain".into()));
    }
    if places[2].is_none() && places[3].is_none() {
        return Err((header_line, "has neither a column deviatoric_stress nor volumetric_strain".into()));
    }
    let mut curves: Vec<LaboratoryCurve> = Vec::new();
    for (line_number, cells) in rows {
        let (count, columns) = (cells.len(), header.len());
        if cells.iter().skip(columns).any(|cell| !cell.trim().is_empty()) {
            let problem = format!("has {count} cells under a header of {columns}");
            return Err((line_number, problem + "; decimal commas need semicolons between the cells"));
        }
        let number = |column: usize| -> Result<f64, (usize, String)> {
            let Some((at, factor)) = places[column] else { return Ok(f64::NAN) };
            match cells.get(at).unwrap_or("") {
                "" => Ok(f64::NAN),
                cell => match cell.parse::<f64>() {
                    // Our own export writes NaN for what a row does not have.
                    Ok(value) if value.is_finite() || value.is_nan() => Ok(value * factor),
                    _ => Err((line_number, format!("{}: {cell:?} is no number", COLUMNS[column]))),
                },
            }
        };
        let label = match places[0] {
            Some((at, _)) => cells.get(at).unwrap_or(""),
            None => name,
        };
        let found = curves.iter().position(|curve| curve.label == label);
        let at = found.unwrap_or_else(|| {
            curves.push(LaboratoryCurve { label: label.to_string(), ..LaboratoryCurve::default() });
            curves.len() - 1
        });
        let row = [number(1)?, number(2)?, number(3)?];
        let curve = &mut curves[at];
        curve.axial_strain.push(row[0]);
        curve.deviatoric_stress.push(row[1]);
        curve.volumetric_strain.push(row[2]);
    }
    match curves.is_empty() {
        true => Err((header_line, "has no rows below its header".into())),
        false => Ok(curves),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_and_curves() {
        let text = "# remark\ncurve; axial_strain [%]; remark; deviatoric_stress [MPa]\n\nA;0;x;0\nB; 1.5 ;;2\nA;1;;\n";
        let curves = parse(text, "file").unwrap_or_else(|e| panic!("{e:?}"));
        assert_eq!(curves.len(), 2);
        assert_eq!((curves[0].label.as_str(), curves[1].label.as_str()), ("A", "B"));
        assert_eq!(curves[0].axial_strain, [0.0, 0.01]);
        assert!(curves[0].deviatoric_stress[1].is_nan() && curves[0].volumetric_strain[0].is_nan());
        assert_eq!((curves[1].axial_strain[0], curves[1].deviatoric_stress[0]), (0.015, 2e6));
    }

    #[test]
    fn quoted_cells_may_hold_the_separator() {
        let text =
            "curve,axial_strain,deviatoric_stress\n\"a, b\",0.1,2\n\"say \"\"c\"\"\",0.2,3\n\n#, \"open\n";
        let curves = parse(text, "file").unwrap_or_else(|e| panic!("{e:?}"));
        let labels: Vec<&str> = curves.iter().map(|curve| curve.label.as_str()).collect();
        assert_eq!(labels, ["a, b", "say \"c\""]);
        assert_eq!((curves[0].axial_strain[0], curves[1].deviatoric_stress[0]), (0.1, 3.0));
    }

    #[test]
    fn our_own_export_is_a_laboratory_file() {
        let text =
            "stage [1],axial_strain [1],deviatoric_stress [Pa],volumetric_strain [1]\n0,0.01,2000000,NaN\n";
        let curves = parse(text, "run").unwrap_or_else(|e| panic!("{e:?}"));
        assert_eq!(curves[0].label, "run");
        assert_eq!(curves[0].deviatoric_stress, [2e6]);
    }

    #[test]
    fn faults_name_their_lines() {
        for (text, line, says) in [
            ("", 1, "no header"),
            ("axial_strain [%]\n1\n", 1, "neither"),
            ("deviatoric_stress [MPa], x\n1,2\n", 1, "no column axial_strain"),
            ("axial_strain [inch], deviatoric_stress [MPa]\n1,2\n", 1, "inch"),
            ("axial_strain [%], deviatoric_stress [psi]\n1,2\n", 1, "psi"),
            ("axial_strain, axial_strain, deviatoric_stress\n1,2,3\n", 1, "two columns"),
            ("axial_strain, deviatoric_stress\n", 1, "no rows"),
            ("axial_strain, deviatoric_stress\n1,2\n1,two\n", 3, "\"two\""),
            ("axial_strain, deviatoric_stress\n0,1,0,3\n", 2, "4 cells under a header of 2"),
        ] {
            let (at, message) = parse(text, "x").expect_err(text);
            assert!(at == line && message.contains(says), "{text:?}: {at}: {message}");
        }
    }
}
