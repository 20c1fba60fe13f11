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
//! The first line names the columns, in any order, each with its unit in brackets, square or round: `axial_strain` is needed, and at least
//! one of `deviatoric_stress` and `volumetric_strain`; `curve` tells curves apart, an empty cell of it as the one above. Other usual names are known too
//! (`columns`). Strains are in `%` or `1`, stresses in any unit that a case knows; a column without its unit is refused. Compression and contraction
//! count positive. A cell may be empty. Commas, semicolons or tabs part the cells; where semicolons or tabs do, or cells are quoted, decimals may stand
//! behind a comma. Other columns are left out and named, but those that `riprap export --csv` writes: its tables can be overlaid too, the stages behind
//! the consolidation with strains from its end. A curve whose strain falls back far is remarked on.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::input;
use crate::results::counted;

use super::axis::short;
use super::columns::{COLUMNS, Places, is_used, places_of, unused};
use super::decimal::Decimals;
use super::heading::heading;
use super::parting::{Origin, changes_there, falls, origin, restart};
use super::sheet::{Row, Sheet};

/// One measured curve, in SI, compression positive.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LaboratoryCurve {
    pub label: String,
    /// Not a number where a cell is empty.
    pub axial_strain: Vec<f64>,
    pub deviatoric_stress: Vec<f64>,
    pub volumetric_strain: Vec<f64>,
}

/// A file of laboratory curves.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LaboratoryTable {
    pub curves: Vec<LaboratoryCurve>,
    /// Headings of columns that were left out, those of riprap's own tables not among them.
    pub unused: Vec<String>,
    /// Of curves: what was left out, and where several are probably joined.
    pub remarks: Vec<String>,
}

/// Faults of a table that are listed; the others are counted.
const LISTED: usize = 10;
/// Columns without use that are named; the others are counted.
const NAMED: usize = 5;

/// A line of a table and what is wrong there.
type Fault = (usize, String);

impl LaboratoryTable {
    /// What is said of a file: which columns no curve shows, and what of its curves.
    fn remarks(&self, path: &Path) -> Vec<String> {
        let named = self.unused.iter().take(NAMED).map(String::as_str).collect::<Vec<_>>().join(", ");
        let more = match self.unused.len().saturating_sub(NAMED) {
            0 => String::new(),
            count => format!(" and {count} more"),
        };
        let unused = (!named.is_empty()).then(|| format!("columns not used: {named}{more}"));
        unused.iter().chain(&self.remarks).map(|said| format!("{}: {said}", path.display())).collect()
    }
}

/// Reads a file of laboratory curves.
///
/// # Errors
/// `Error::Io`; `Error::Usage` with file and line of everything that keeps it from being such a table.
pub fn read_laboratory(path: &Path) -> Result<LaboratoryTable> {
    let bytes = input::read_at_most(path, input::LARGEST).map_err(|e| Error::io("read", path, e))?;
    let text = input::table_of(&bytes).map_err(|e| Error::Usage(format!("{}: {e}", path.display())))?;
    let stem = path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy();
    parse(&text, &format!("laboratory, {stem}")).map_err(|faults| Error::Usage(listed(path, &faults)))
}

/// Reads several files: their curves, and remarks. A curve's name that another file has, or that is among
/// `taken`, gets its file's name behind it.
///
/// # Errors
/// As [`read_laboratory`].
pub fn read_laboratories(paths: &[PathBuf], taken: &[String]) -> Result<(Vec<LaboratoryCurve>, Vec<String>)> {
    let tables = paths.iter().map(|path| read_laboratory(path)).collect::<Result<Vec<_>>>()?;
    let has = |table: &LaboratoryTable, label: &str| table.curves.iter().any(|curve| curve.label == label);
    let mut curves = Vec::new();
    for (at, (path, table)) in paths.iter().zip(&tables).enumerate() {
        let others: Vec<usize> = (0..paths.len()).filter(|&other| other != at).collect();
        let own_stem = others.iter().all(|&other| paths[other].file_stem() != path.file_stem());
        let file = match (own_stem, path.file_stem()) {
            (true, Some(stem)) => stem.to_string_lossy().into_owned(),
            (_, _) => path.display().to_string(),
        };
        for curve in &table.curves {
            let elsewhere = others.iter().any(|&other| has(&tables[other], &curve.label));
            let label = match elsewhere || taken.contains(&curve.label) {
                true => format!("{} ({file})", curve.label),
                false => curve.label.clone(),
            };
            curves.push(LaboratoryCurve { label, ..curve.clone() });
        }
    }
    let remarks = paths.iter().zip(&tables).flat_map(|(path, table)| table.remarks(path)).collect();
    Ok((curves, remarks))
}

/// The faults of a file, a line each.
fn listed(path: &Path, faults: &[Fault]) -> String {
    let one = |(line, message): &Fault| format!("{}:{line}: {message}", path.display());
    let mut lines: Vec<String> = faults.iter().take(LISTED).map(one).collect();
    if faults.len() > LISTED {
        lines.push(format!("{}: and {} faults more", path.display(), faults.len() - LISTED));
    }
    lines.join("\n")
}

/// A row's axial strain, deviatoric stress and volumetric strain in SI; not a number where a cell is empty.
fn numbers(cells: &csv::StringRecord, places: &Places, decimals: Decimals) -> Result<[f64; 3], String> {
    let number = |column: usize| -> Result<f64, String> {
        let Some((at, factor)) = places[column] else { return Ok(f64::NAN) };
        match cells.get(at).unwrap_or("") {
            "" => Ok(f64::NAN),
            cell => match decimals.number(cell) {
                Ok(value) => Ok(value * factor),
                Err(fault) => Err(format!("{}: {fault}", COLUMNS[column])),
            },
        }
    };
    let deviatoric = if places[4].is_some() { number(4)? - number(5)? } else { number(2)? };
    Ok([number(1)?, deviatoric, number(3)?])
}

/// `name` is the curve's where the table has no `curve` column.
fn parse(text: &str, name: &str) -> Result<LaboratoryTable, Vec<Fault>> {
    let Sheet { separator, rows } = Sheet::parse(text).map_err(|fault| vec![fault])?;
    let Some(((header_line, header), rows)) = rows.split_first() else {
        return Err(vec![(1, "has no header line".into())]);
    };
    let (places, faults) = places_of(header);
    let mut faults: Vec<Fault> = faults.into_iter().map(|fault| (*header_line, fault)).collect();
    let columns = places[1..].iter().flatten().map(|(at, _)| *at);
    let cells = rows
        .iter()
        .flat_map(|(line, cells)| columns.clone().filter_map(move |at| Some((*line, cells.get(at)?))));
    let decimals = Decimals::of(cells, separator).unwrap_or_else(|fault| {
        faults.push(fault);
        Decimals::Comma
    });
    let (mut curves, mut rows_of): (Vec<LaboratoryCurve>, Vec<Vec<&Row>>) = Default::default();
    let mut above = "";
    for whole in rows {
        let (line, cells) = whole;
        let (count, columns) = (cells.len(), header.len());
        if cells.iter().skip(columns).any(|cell| !cell.trim().is_empty()) {
            let problem = format!("has {count} cells under a header of {columns}");
            faults.push((*line, problem + "; decimal commas need semicolons between the cells"));
            continue;
        }
        let row = numbers(cells, &places, decimals).unwrap_or_else(|fault| {
            faults.push((*line, fault));
            [f64::NAN; 3]
        });
        let own = places[0].map_or(name, |(at, _)| cells.get(at).unwrap_or(""));
        let label = match (own, row.iter().any(|x| x.is_finite())) {
            // A row of remarks.
            ("", false) => continue,
            // Cells that a spreadsheet merged: the first has the text.
            ("", true) => above,
            (own, _) => own,
        };
        if label.is_empty() {
            let problem = "is empty, and no row above names one";
            faults.push((*line, format!("{}: {problem}", COLUMNS[0])));
            continue;
        }
        above = label;
        let found = curves.iter().position(|curve| curve.label == label);
        let at = found.unwrap_or_else(|| {
            curves.push(LaboratoryCurve { label: label.to_string(), ..LaboratoryCurve::default() });
            rows_of.push(Vec::new());
            curves.len() - 1
        });
        rows_of[at].push(whole);
        let curve = &mut curves[at];
        curve.axial_strain.push(row[0]);
        curve.deviatoric_stress.push(row[1]);
        curve.volumetric_strain.push(row[2]);
    }
    if curves.is_empty() && faults.is_empty() {
        faults.push((*header_line, "has no rows below its header".into()));
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    let mut remarks = Vec::new();
    for (curve, rows) in curves.iter_mut().zip(&rows_of) {
        let origins = origins(header, rows, &curve.volumetric_strain, decimals);
        let left_out = leave_consolidation_out(curve, &origins);
        if left_out > 0 {
            let rows = counted(left_out, "row");
            remarks.push(format!("{rows} of the consolidation left out, strains count from its end"));
        }
        remarks.extend(joined(curve, &rows[left_out..], header, &places));
    }
    Ok(LaboratoryTable { curves, unused: unused(header, &places), remarks })
}

/// Where the strains of rows of riprap's own history count from; nothing of other tables.
fn origins(
    header: &csv::StringRecord,
    rows: &[&Row],
    volumetric_strain: &[f64],
    decimals: Decimals,
) -> Vec<Origin> {
    let named = |name: &str| header.iter().position(|cell| heading(cell) == (name, Some("1")));
    let places = ["stage", "void_ratio", "cover_volume_ratio"].map(named);
    let [Some(stage), Some(void_ratio), Some(cover)] = places else { return Vec::new() };
    let of = |((_, cells), strain): (&&Row, &f64)| {
        let number = |at: usize| decimals.number(cells.get(at).unwrap_or("")).unwrap_or(f64::NAN);
        origin([stage, void_ratio, cover].map(number), *strain)
    };
    rows.iter().zip(volumetric_strain).map(of).collect()
}

/// Begins a curve at the end of its consolidation, as those of runs begin; how many rows are before that.
fn leave_consolidation_out(curve: &mut LaboratoryCurve, origins: &[Origin]) -> usize {
    let Some(last) = restart(origins).and_then(|first| first.checked_sub(1)) else { return 0 };
    for values in [&mut curve.axial_strain, &mut curve.deviatoric_stress, &mut curve.volumetric_strain] {
        values.drain(..last);
    }
    for strains in [&mut curve.axial_strain, &mut curve.volumetric_strain] {
        strains[0] = 0.0;
    }
    last
}

/// What is said of a curve whose strain falls back far, and what would part it.
fn joined(
    curve: &LaboratoryCurve,
    rows: &[&Row],
    header: &csv::StringRecord,
    places: &Places,
) -> Option<String> {
    let quantities = [&curve.deviatoric_stress, &curve.volumetric_strain];
    let found = quantities.map(|values| falls(&curve.axial_strain, values));
    let falls = found.into_iter().find(|falls| !falls.is_empty())?;
    let (line, _) = rows.get(falls[0])?;
    let cells = |at: usize| rows.iter().map(move |(_, cells)| cells.get(at).unwrap_or(""));
    let parting = (0..header.len()).find(|at| !is_used(places, *at) && changes_there(cells(*at), &falls));
    let name = |at: usize| header.get(at).unwrap_or("");
    let way = match (places[0], parting) {
        (Some((at, _)), _) => format!("each needs a name of its own in the column {}", name(at)),
        (None, Some(at)) => format!("the column {} would part them if it were called curve", name(at)),
        (None, None) => "a column curve with a name for each would part them".into(),
    };
    let (label, strain) = (&curve.label, short(100.0 * curve.axial_strain[falls[0]]));
    Some(format!(
        "the strain of {label:?} falls back to {strain} % in line {line}: several curves are probably joined; {way}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::HISTORY;

    /// The curves alone.
    fn parse(text: &str, name: &str) -> Result<Vec<LaboratoryCurve>, Vec<Fault>> {
        super::parse(text, name).map(|table| table.curves)
    }

    #[test]
    fn columns_without_use_are_named() {
        let unused = |header: &str| {
            let cells = "1;".repeat(header.split(';').count());
            let table = super::parse(&format!("{header}\n{}\n", cells.trim_end_matches(';')), "file");
            table.unwrap_or_else(|e| panic!("{header}: {e:?}")).unused
        };
        assert_eq!(unused("ε1 [%];q [kPa];u [kPa];date;"), ["u [kPa]", "date"]);
        // A quantity in another unit beside the one that counts.
        assert_eq!(unused("ε1 [%];体变 [cm3];体应变 [%]"), ["体变 [cm3]"]);
        let ours: Vec<String> = HISTORY.iter().map(|q| format!("{} [{}]", q.name, q.units)).collect();
        assert_eq!(unused(&ours.join(";")), Vec::<String>::new());
        let table = |count: usize| {
            let unused = (1..=count).map(|k| format!("x{k}")).collect();
            LaboratoryTable { unused, ..LaboratoryTable::default() }.remarks(Path::new("lab.csv"))
        };
        assert_eq!(table(0), Vec::<String>::new());
        assert_eq!(table(2), ["lab.csv: columns not used: x1, x2"]);
        assert_eq!(table(8), ["lab.csv: columns not used: x1, x2, x3, x4, x5 and 3 more"]);
    }

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
    fn merged_cells_name_the_rows_below() {
        let text = "curve;axial_strain [%];q [MPa];remark\nA;0;0;\n;1;2;\n;;;by hand\nB;0;1;\n;1;3;\n";
        let curves = parse(text, "file").unwrap_or_else(|e| panic!("{e:?}"));
        let told: Vec<_> = curves.iter().map(|c| (c.label.as_str(), c.axial_strain.len())).collect();
        assert_eq!(told, [("A", 2), ("B", 2)]);
        let faults = parse("curve;axial_strain [%];q [MPa]\n;0;0\nA;1;2\n", "file").expect_err("no name");
        assert!(faults[0].0 == 2 && faults[0].1.contains("curve: is empty"), "{faults:?}");
    }

    /// What spreadsheets write where the comma parts decimals; the message on decimal commas between commas sends there.
    #[test]
    fn decimal_commas_are_read_where_commas_do_not_part_cells() {
        let written = |separator: &str, quote: &str| {
            let cell = |text: &str| format!("{quote}{text}{quote}");
            let row = |cells: [&str; 3]| cells.map(cell).join(separator) + "\n";
            let header = ["axial_strain [%]", "deviatoric_stress [kPa]", "remark, of no use"];
            row(header) + &row(["0", "0", "1.5 h"]) + &row(["0,25", "412,5", "3,1"]) + &row(["1", "1250", ""])
        };
        for text in [written(";", ""), written("\t", ""), written(",", "\"")] {
            let curves = parse(&text, "file").unwrap_or_else(|e| panic!("{text:?}: {e:?}"));
            assert_eq!(curves[0].axial_strain, [0.0, 0.25 * 0.01, 0.01], "{text:?}");
            assert_eq!(curves[0].deviatoric_stress, [0.0, 412.5e3, 1250e3], "{text:?}");
        }
        let commas = "axial_strain [%],deviatoric_stress [kPa]\n0,0\n0,25,412,5\n";
        let faults = parse(commas, "file").expect_err("commas between cells and in them");
        assert!(faults[0].1.contains("semicolons"), "{faults:?}");
        let semicolons = "axial_strain [%];deviatoric_stress [kPa]\n0,25;412,5\n";
        assert!(parse(semicolons, "file").is_ok(), "the message's advice");
        // Excel's own first line.
        for text in [
            "sep=;\r\naxial_strain [%];deviatoric_stress [kPa]\r\n0,25;412,5\r\n",
            "sep=\t\naxial_strain [%]\tq [kPa]\n0,25\t412,5\n",
        ] {
            let curves = parse(text, "file").unwrap_or_else(|e| panic!("{text:?}: {e:?}"));
            assert_eq!((curves[0].axial_strain[0], curves[0].deviatoric_stress[0]), (0.0025, 412.5e3));
        }
        let faults = parse("sep=;\naxial_strain [%];deviatoric_stress [kPa]\n0;x\n", "file").expect_err("x");
        assert_eq!(faults[0].0, 3, "{faults:?}");
        let mixed = "axial_strain [%];deviatoric_stress [kPa]\n0,25;412.5\n";
        let faults = parse(mixed, "file").expect_err("points and commas");
        assert!(faults[0].0 == 2 && faults[0].1.contains("mixes decimal points"), "{faults:?}");
    }

    #[test]
    fn columns_are_known_by_their_usual_names() {
        for header in [
            "Test; Axial strain (%); Deviator stress (kPa); Volume strain (%)",
            "curve;ε1 [%];σ1-σ3 [kN/m²];εv [%]",
            "sample;eps_1 (%);sigma1 - sigma3 (kN/m2);eps_v (%)",
            "Sample;Axial strain, ea (%);Dev. stress (kPa);Vol. strain (%)",
            "test;axial strain ea [%];deviator [kPa];vol strain ev [%]",
            "试样;轴向应变/%;偏差应力/kPa;体变/%",
            "试样;轴应变（%）;主应力差（kPa）;体变率（%）",
            "试样;轴向应变 (%);主应力差 (kPa);体应变 (%)",
            "试样编号;轴向应变ε1/%;偏应力(σ1-σ3)/kPa;体应变εv/%",
            "试样;轴向应变（％）;偏应力q（KPa）;体积应变（％）",
            "Probe;Axialdehnung ε1 in %;Deviatorspannung / kN/m^2;Volumendehnung in %",
        ] {
            let curves = parse(&format!("{header}\nA;2;500;0.5\n"), "file")
                .unwrap_or_else(|e| panic!("{header}: {e:?}"));
            assert_eq!(curves[0].label, "A");
            let row =
                [curves[0].axial_strain[0], curves[0].deviatoric_stress[0], curves[0].volumetric_strain[0]];
            assert_eq!(row, [0.02, 5e5, 0.005], "{header}");
        }
    }

    #[test]
    fn curves_are_told_apart_by_columns_of_many_names() {
        for name in [
            "曲线",
            "组号",
            "试样编号",
            "Serie",
            "Kurve",
            "Test no.",
            "Versuchs-Nr.",
            "Probennummer",
            "Series",
        ] {
            let text = format!("{name};axial strain [%];q [kPa]\nA;0;0\nA;1;2\nB;0;0\nB;1;3\n");
            let table = super::parse(&text, "file").unwrap_or_else(|e| panic!("{name}: {e:?}"));
            assert_eq!((table.curves.len(), table.remarks), (2, vec![]), "{name}");
        }
        // Of several the plainest, wherever it stands.
        for header in ["编号;组;试样", "Nr.;Serie;Probe", "run;group;specimen"] {
            let text = format!("{header};axial strain [%];q [kPa]\n1;I;A;0;0\n2;I;A;1;2\n3;I;B;0;0\n");
            let table = super::parse(&text, "file").unwrap_or_else(|e| panic!("{header}: {e:?}"));
            assert_eq!((table.curves.len(), table.unused.len()), (2, 2), "{header}");
        }
        let faults = parse("test;test no.;axial strain [%];q [kPa]\nA;1;0;0\n", "file").expect_err("two");
        assert!(faults[0].1.contains("two columns curve"), "{faults:?}");
    }

    #[test]
    fn principal_stresses_stand_in_for_their_difference() {
        let curves = parse("Axiale Dehnung [%];σ1 [kPa];sigma_3 [MPa]\n1;1500;0.5\n", "lab").expect("sound");
        assert_eq!((curves[0].axial_strain[0], curves[0].deviatoric_stress[0]), (0.01, 1e6));
        // Beside the difference, or alone, they are columns without use.
        let table = super::parse("ea [%];q [kPa];sigma3\n1;900;500\n", "lab").expect("sound");
        assert_eq!((table.unused, table.curves[0].deviatoric_stress[0]), (vec!["sigma3".to_string()], 9e5));
        assert!(parse("ea [%];sigma1 [kPa]\n1;900\n", "lab").is_err());
        let faults = parse("ea [%];sigma1;sigma3 [kPa]\n1;900;500\n", "lab").expect_err("no unit");
        assert!(faults[0].1.contains("major_stress has no unit"), "{faults:?}");
    }

    #[test]
    fn joined_curves_are_remarked_on() {
        let said = |text: &str| super::parse(text, "lab").unwrap_or_else(|e| panic!("{e:?}")).remarks;
        let rows = "A;0;0\nA;0.6;600\nB;0;0\nB;0.6;1050\n";
        let found = said(&format!("Werkstoff;axial strain [%];q [kPa]\n{rows}"));
        assert!(
            found[0].starts_with("the strain of \"lab\" falls back to 0 % in line 4: several"),
            "{found:?}"
        );
        assert!(
            found[0].ends_with("the column Werkstoff would part them if it were called curve"),
            "{found:?}"
        );
        let found = said("axial strain [%];q [kPa]\n0;0\n0.6;600\n0;0\n0.6;1050\n");
        assert!(found[0].ends_with("a column curve with a name for each would part them"), "{found:?}");
        let found = said("Probe;axial strain [%];q [kPa]\nA;0;0\nA;0.6;600\nA;0;0\n");
        assert!(found[0].ends_with("a name of its own in the column Probe"), "{found:?}");
        // Unloaded and loaded again.
        assert_eq!(said("ea [%];q [kPa]\n0;0\n0.6;600\n0.4;0\n0.6;590\n"), Vec::<String>::new());
    }

    /// Two rows of a consolidation to a void ratio of 0.485, then shear.
    #[test]
    fn our_own_history_begins_at_the_end_of_the_consolidation() {
        let header = "stage [1],axial_strain [1],volumetric_strain [1],deviatoric_stress [Pa],void_ratio [1],\
                      cover_volume_ratio [1]";
        let text = format!(
            "{header}\n0,0.001,0.004,20,0.494,1\n0,0.003,0.01,30,0.485,1\n1,0.002,0.001,5e5,0.483515,1\n1,0.004,0.002,7e5,0.48203,1\n"
        );
        let table = super::parse(&text, "run").unwrap_or_else(|e| panic!("{e:?}"));
        let curve = &table.curves[0];
        assert_eq!(curve.axial_strain, [0.0, 0.002, 0.004]);
        assert_eq!(curve.volumetric_strain, [0.0, 0.001, 0.002]);
        assert_eq!(curve.deviatoric_stress, [30.0, 5e5, 7e5]);
        assert_eq!(table.remarks, ["1 row of the consolidation left out, strains count from its end"]);
    }

    #[test]
    fn stresses_come_in_units_of_any_country() {
        for (heading, factor) in [
            ("q [psi]", 6_894.757_293_168_361),
            ("deviator stress (ksi)", 6_894_757.293_168_36),
            ("偏应力/kgf/cm²", 98066.5),
            ("q in kgf/cm^2", 98066.5),
        ] {
            let curves = parse(&format!("axial strain [%];{heading}\n1;2\n"), "file")
                .unwrap_or_else(|e| panic!("{heading}: {e:?}"));
            let found = curves[0].deviatoric_stress[0];
            assert!((found / (2.0 * factor) - 1.0).abs() < 1e-14, "{heading}: {found}");
        }
    }

    #[test]
    fn quoted_cells_may_hold_the_separator() {
        let text = "curve,axial_strain [1],deviatoric_stress [Pa]\n\"a, b\",0.1,2\n\"say \"\"c\"\"\",0.2,3\n\n#, \"open\n";
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
            ("axial_strain [%], deviatoric_stress [atm]\n1,2\n", 1, "atm"),
            ("axial strain [%], eps1 [%], q [Pa]\n1,2,3\n", 1, "two columns axial_strain"),
            ("axial_strain [1], axial_strain [1], deviatoric_stress [Pa]\n1,2,3\n", 1, "two columns"),
            ("axial_strain [1], deviatoric_stress [Pa]\n", 1, "no rows"),
            ("axial_strain [1], deviatoric_stress [Pa]\n1,2\n1,two\n", 3, "\"two\""),
            ("axial_strain [1], deviatoric_stress [Pa]\n0,1,0,3\n", 2, "4 cells under a header of 2"),
        ] {
            let faults = parse(text, "x").expect_err(text);
            let (at, message) = &faults[0];
            assert!(*at == line && message.contains(says), "{text:?}: {at}: {message}");
        }
    }

    #[test]
    fn curves_of_one_name_are_told_by_their_files() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, labels: [&str; 2]| -> PathBuf {
            let path = folder.path().join(name);
            let [a, b] = labels;
            let text = format!("curve, axial_strain [%], deviatoric_stress [MPa]\n{a},0,0\n{b},1,1\n");
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            std::fs::write(&path, text).expect("a table");
            path
        };
        let labels = |paths: &[PathBuf]| -> Vec<String> {
            let (curves, remarks) =
                read_laboratories(paths, &["a run".into()]).unwrap_or_else(|e| panic!("{e}"));
            assert!(remarks.is_empty(), "{remarks:?}");
            curves.into_iter().map(|curve| curve.label).collect()
        };
        let (wet, dry) = (write("wet.csv", ["0.8 MPa", "wet"]), write("dry.csv", ["0.8 MPa", "a run"]));
        let found = labels(&[wet.clone(), dry]);
        assert_eq!(found, ["0.8 MPa (wet)", "wet", "0.8 MPa (dry)", "a run (dry)"]);
        let found = labels(&[wet, write("other/wet.csv", ["0.8 MPa", "b"])]);
        assert_ne!(found[0], found[2]);
    }

    /// 1, 2 in per cent and in MPa would be 100 % and 2 Pa.
    #[test]
    fn columns_without_units_are_refused() {
        for header in ["curve,axial_strain,deviatoric_stress", "curve,axial_strain [],deviatoric_stress []"] {
            let faults = parse(&format!("{header}\nA,1,2\n"), "x").expect_err(header);
            assert_eq!(faults.len(), 2, "{faults:?}");
            assert!(faults[0].1.contains("axial_strain has no unit (accepted: [%], [1]"), "{faults:?}");
            assert!(faults[1].1.contains("deviatoric_stress has no unit (accepted: [Pa]"), "{faults:?}");
        }
    }

    #[test]
    fn all_faults_are_listed_with_what_was_found() {
        let text = "strain [%], deviatoric_stress [atm]\n1,2\n1,two\n1,2,3\n";
        let faults = parse(text, "x").expect_err(text);
        let lines: Vec<usize> = faults.iter().map(|(line, _)| *line).collect();
        assert_eq!(lines, [1, 1, 3, 4]);
        assert!(
            faults[1].1.contains("no column axial_strain (found: strain, deviatoric_stress)"),
            "{faults:?}"
        );
        let many: Vec<Fault> = (1..=14).map(|line| (line, "wrong".into())).collect();
        let text = listed(Path::new("lab.csv"), &many);
        assert_eq!(text.lines().count(), LISTED + 1);
        assert!(
            text.starts_with("lab.csv:1: wrong\n") && text.ends_with("lab.csv: and 4 faults more"),
            "{text}"
        );
    }
}
