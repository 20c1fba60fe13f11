//! A results file as a report sees it: what was run, its history, its name among the others.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::error::Result;
use crate::results::{Reader, Summary};

use super::chart::{WIDTH, legend_text};

/// Of a legend's width, for a run's status and for where its name is cut [px].
const STATUS_ROOM: f64 = 160.0;

/// An opened results file with its history at hand.
pub struct Run {
    pub reader: Reader,
    pub summary: Summary,
    /// Short, and its own among the runs of a report.
    pub label: String,
    /// Of files that belong to this run alone: letters, digits, `-` and `_`.
    pub stem: String,
    /// The case with every value in force; null where the file has none that can be read.
    pub case: Value,
    /// The case file as given.
    pub given: String,
    /// Accepted increments.
    pub rows: usize,
}

/// Columns of equal length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curve {
    /// Compression positive.
    pub axial_strain: Vec<f64>,
    /// Contraction positive.
    pub volumetric_strain: Vec<f64>,
    /// [Pa]
    pub deviatoric_stress: Vec<f64>,
}

/// What the largest deviatoric stress of a curve is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Largest {
    /// Strained on, the specimen bears less.
    Peak,
    /// The last there is: nobody knows what follows.
    AtEnd,
    /// The specimen was not strained further.
    Turned,
}

/// The stages behind the leading consolidation, strains counted from its end.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Shearing {
    /// Rows of `/history`, the last of the consolidation first where there is one.
    pub rows: Vec<usize>,
    /// Of these rows; strains are 0 at the first if that is the consolidation's.
    pub curve: Curve,
    /// Whether strains count from the end of the consolidation; else from the start of the run.
    pub behind_consolidation: bool,
    /// Deviatoric stress before the first row [Pa], where strains begin there: of a run that starts from the
    /// consolidated specimen of another one, by the secant modulus of its first row.
    pub start: Option<f64>,
}

impl Run {
    /// Opens results files and names them apart.
    pub fn open_all(paths: &[PathBuf]) -> Result<Vec<Run>> {
        let mut runs = paths.iter().map(|path| Run::open(path)).collect::<Result<Vec<_>>>()?;
        let titles: Vec<String> = runs.iter().map(|run| run.summary.title.clone()).collect();
        let stems: Vec<String> = paths.iter().map(|path| stem_of(path)).collect();
        // What a legend shows of them, with room for a status.
        let [cut_titles, cut_stems] = [&titles, &stems]
            .map(|names| names.iter().map(|name| legend_text(name, WIDTH, STATUS_ROOM)).collect::<Vec<_>>());
        let file_stems = own_stems(&stems);
        let is_own =
            |names: &[String], at: usize| names.iter().filter(|name| **name == names[at]).count() == 1;
        for (at, run) in runs.iter_mut().enumerate() {
            let own_title = is_own(&cut_titles, at) && !titles[at].is_empty();
            run.label = match (own_title, is_own(&cut_stems, at)) {
                (true, _) => titles[at].clone(),
                (false, true) => stems[at].clone(),
                (false, false) => paths[at].display().to_string(),
            };
            if run.summary.status != "finished" {
                run.label = format!("{} ({})", run.label, run.summary.status);
            }
            run.stem = file_stems[at].clone();
        }
        Ok(runs)
    }

    /// Opens a results file; label and stem are empty.
    pub fn open(path: &Path) -> Result<Run> {
        let reader = Reader::open(path)?;
        let summary = Summary::of(&reader)?;
        let completed = reader.text("case/completed")?;
        let case = serde_json::from_str(&completed).unwrap_or(Value::Null);
        let given = reader.text("case/given")?;
        let rows = reader.increments()?;
        Ok(Run { reader, summary, label: String::new(), stem: String::new(), case, given, rows })
    }

    /// Whether bodies were set by hand.
    pub fn is_scene(&self) -> bool {
        !self.summary.bodies.is_empty()
    }

    /// A column of the history.
    pub fn column(&self, name: &str) -> Result<Vec<f64>> {
        let mut values = self.reader.history(name)?;
        values.truncate(self.rows);
        Ok(values)
    }

    /// Stages in front of which strains begin anew.
    pub fn leading_consolidations(&self) -> usize {
        self.summary.stages.iter().take_while(|kind| *kind == "consolidate").count()
    }

    /// The stages behind the consolidation, without rows where the run did not come to them; the whole history where the case has no consolidation, or
    /// nothing behind it.
    pub fn shearing(&self) -> Result<Shearing> {
        let leading = self.leading_consolidations();
        let stage = self.column("stage")?;
        let first = stage.iter().position(|&stage| stage >= leading as f64);
        let (from, from_zero) = match first {
            Some(row) if row > 0 => (row - 1, true),
            None if leading < self.summary.stages.len() => (stage.len(), false),
            Some(_) | None => (0, false),
        };
        let rows: Vec<usize> = (from..stage.len()).collect();
        let part = |name: &str| -> Result<Vec<f64>> { Ok(self.column(name)?.split_off(from)) };
        let mut axial_strain = part("axial_strain")?;
        let mut volumetric_strain = part("volumetric_strain")?;
        if from_zero {
            // Strains count from the end of the consolidation: its last row is their zero.
            for strains in [&mut axial_strain, &mut volumetric_strain] {
                if let Some(first) = strains.first_mut() {
                    *first = 0.0;
                }
            }
        }
        let deviatoric_stress = part("deviatoric_stress")?;
        let start = match (first, axial_strain.first(), deviatoric_stress.first()) {
            (Some(0), Some(strain), Some(q)) => {
                let secant = self.column("secant_modulus")?.first().copied().unwrap_or(f64::NAN);
                Some(q - secant * strain).filter(|q| q.is_finite() && *strain != 0.0)
            }
            _ => None,
        };
        let curve = Curve { axial_strain, volumetric_strain, deviatoric_stress };
        Ok(Shearing { rows, curve, behind_consolidation: from_zero, start })
    }
}

impl Shearing {
    /// The curve from where strains are zero, which need not be a row.
    pub fn into_curve(self) -> Curve {
        let mut curve = self.curve;
        if let Some(deviatoric_stress) = self.start {
            curve.axial_strain.insert(0, 0.0);
            curve.volumetric_strain.insert(0, 0.0);
            curve.deviatoric_stress.insert(0, deviatoric_stress);
        }
        curve
    }
}

impl Curve {
    /// Place of the largest deviatoric stress, and what it is.
    pub fn largest(&self) -> Option<(usize, Largest)> {
        let finite = self.deviatoric_stress.iter().enumerate().filter(|(_, q)| q.is_finite());
        let last = finite.clone().next_back()?.0;
        let at = finite.max_by(|a, b| a.1.total_cmp(b.1))?.0;
        let strained_on = self.axial_strain[at..=last].iter().any(|strain| *strain > self.axial_strain[at]);
        Some(match (at == last, strained_on) {
            (true, _) => (at, Largest::AtEnd),
            (false, true) => (at, Largest::Peak),
            (false, false) => (at, Largest::Turned),
        })
    }
}

impl Largest {
    /// In words, behind the number; none for a peak.
    pub fn remark(self) -> &'static str {
        match self {
            Largest::Peak => "",
            Largest::AtEnd => ", at the end: still rising",
            Largest::Turned => ", where it was unloaded or held",
        }
    }
}

/// A name that files may have on any system: letters and digits of any script are kept, and those of `also`.
pub fn safe(name: &str, also: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || also.contains(c) { c } else { '_' }).collect()
}

/// What files of each run are called, all different: two stems may be the same, or become so where a character is left out.
fn own_stems(stems: &[String]) -> Vec<String> {
    let plain: Vec<String> = stems.iter().map(|stem| safe(stem, "-_")).collect();
    let mut own: Vec<String> = Vec::new();
    for (at, stem) in plain.iter().enumerate() {
        let is_alone = plain.iter().filter(|other| *other == stem).count() == 1;
        let mut name = if is_alone { stem.clone() } else { format!("{stem}_{}", at + 1) };
        // Another file may be called what the number makes of this one.
        while own.contains(&name) || (!is_alone && plain.contains(&name)) {
            name.push('_');
        }
        own.push(name);
    }
    own
}

fn stem_of(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_of_files_in_any_script_stay_apart() {
        assert_eq!(["试验一", "试验二", "a b.c"].map(|stem| safe(stem, "-_")), ["试验一", "试验二", "a_b_c"]);
    }

    #[test]
    fn charts_of_files_that_are_called_nearly_alike_stay_apart() {
        let own = |stems: &[&str]| own_stems(&stems.iter().map(|stem| stem.to_string()).collect::<Vec<_>>());
        assert_eq!(own(&["a b", "a=b", "c"]), ["a_b_1", "a_b_2", "c"]);
        assert_eq!(own(&["a", "a", "a_2"]), ["a_1", "a_2_", "a_2"]);
    }

    #[test]
    fn a_curve_begins_where_strains_are_zero() {
        let curve = Curve {
            axial_strain: vec![0.001, 0.002],
            volumetric_strain: vec![0.0005, 0.0008],
            deviatoric_stress: vec![3e5, 4e5],
        };
        let rows = Shearing { rows: vec![0, 1], curve, behind_consolidation: false, start: None };
        assert_eq!(rows.clone().into_curve().axial_strain, rows.curve.axial_strain);
        let curve = Shearing { start: Some(2e5), ..rows }.into_curve();
        assert_eq!(curve.axial_strain, [0.0, 0.001, 0.002]);
        assert_eq!(curve.volumetric_strain, [0.0, 0.0005, 0.0008]);
        assert_eq!(curve.deviatoric_stress, [2e5, 3e5, 4e5]);
    }

    #[test]
    fn a_peak_is_where_stress_falls_behind() {
        let curve = |axial_strain: &[f64], q: &[f64]| Curve {
            axial_strain: axial_strain.to_vec(),
            volumetric_strain: vec![0.0; q.len()],
            deviatoric_stress: q.to_vec(),
        };
        let falls = curve(&[0.0, 1.0, 2.0, 3.0], &[0.0, 3.0, 2.9, f64::NAN]);
        assert_eq!(falls.largest(), Some((1, Largest::Peak)));
        let rises = curve(&[0.0, 1.0, 2.0], &[0.0, 1.0, 2.0]);
        assert_eq!(rises.largest(), Some((2, Largest::AtEnd)));
        let unloaded = curve(&[0.0, 2.0, 1.5], &[0.0, 3.0, 0.5]);
        assert_eq!(unloaded.largest(), Some((1, Largest::Turned)));
        assert_eq!(curve(&[], &[]).largest(), None);
    }
}
