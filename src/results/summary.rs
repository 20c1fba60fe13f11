//! What is in a results file, in short: `riprap info`.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

use crate::error::{Error, Result};

use super::number::{counted, fixed};
use super::reader::Reader;
use super::verify::Verified;

/// A number with its name and unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Named {
    pub name: String,
    /// `None` for what the run does not have.
    pub value: Option<f64>,
    pub units: String,
}

/// The summary; `Display` gives the text for people, [`Summary::to_json`] that for machines.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Summary {
    pub file: PathBuf,
    pub file_bytes: u64,
    pub title: String,
    pub seed: u64,
    pub riprap_version: String,
    pub riprap_commit: String,
    pub host: String,
    pub threads: i64,
    /// `running`, `finished`, `interrupted` or `stopped`; `killed` where it says running and nobody runs.
    pub status: String,
    pub reason: String,
    pub last_good_increment: u64,
    /// The increment that `--resume` would continue from.
    pub restart_increment: Option<u64>,
    pub stages: Vec<String>,
    /// Rows of `/history`.
    pub increments: usize,
    pub grains: usize,
    pub points: usize,
    pub cells: usize,
    /// Of these, the cells of a specimen's grains: not of plates, cover or bodies set by hand.
    pub grain_cells: usize,
    pub bodies: Vec<String>,
    /// Pseudo-times of the saved states.
    pub states: Vec<f64>,
    /// States that have a contact table.
    pub contact_states: Vec<String>,
    /// Last row of `/history`.
    pub last: Vec<Named>,
    /// Largest deviatoric stress so far and the axial strain there.
    pub peak: Option<Peak>,
    /// Stored bytes of the groups.
    pub group_bytes: Vec<(String, u64)>,
    /// What was read and found sound, where that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verified: Option<Verified>,
}

/// The peak of the stress-strain curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Peak {
    /// [Pa]
    pub deviatoric_stress: f64,
    /// Compression positive.
    pub axial_strain: f64,
}

impl Summary {
    pub fn of(reader: &Reader) -> Result<Self> {
        let status = reader.status()?;
        let increments = reader.increments()?;
        let mut last = Vec::new();
        for quantity in reader.columns() {
            let value = increments.checked_sub(1).map(|row| {
                let column = reader.history(quantity.name)?;
                Ok::<_, Error>(column.get(row).copied().filter(|value| value.is_finite()))
            });
            let value = value.transpose()?.flatten();
            last.push(Named { name: quantity.name.into(), value, units: quantity.units.into() });
        }
        let count = |name: &str| match reader.has(name) {
            true => reader.shape(name).map(|shape| shape.first().copied().unwrap_or(0)),
            false => Ok(0),
        };
        let single = |name: &str| reader.integers(name).map(|v| v.first().copied().unwrap_or(0));
        let grains = match count("grains/volume")? {
            0 if reader.has("grains/position") => {
                reader.shape("grains/position")?.get(1).copied().unwrap_or(0)
            }
            found => found,
        };
        let status_text = match status.outcome.as_str() {
            "running" if !reader.is_live() => "killed",
            text => text,
        };
        let stages = reader.text("case/stages")?;
        Ok(Summary {
            file: reader.path().to_path_buf(),
            file_bytes: std::fs::metadata(reader.path())
                .map_err(|e| Error::io("read", reader.path(), e))?
                .len(),
            title: reader.text("case/title")?,
            seed: reader.seed()?,
            riprap_version: reader.text("case/version")?,
            riprap_commit: reader.text("case/commit")?,
            host: reader.text("case/host")?,
            threads: single("case/threads")?,
            status: status_text.to_string(),
            reason: status.reason,
            last_good_increment: status.last_good_increment,
            restart_increment: reader.restart()?.map(|restart| restart.increment),
            stages: stages.lines().map(str::to_string).collect(),
            increments,
            grains,
            points: count("VTKHDF/Points")?,
            cells: count("VTKHDF/Types")?,
            grain_cells: match count("VTKHDF/Types")? {
                0 => 0,
                _ => reader.integers("VTKHDF/CellData/grain")?.iter().filter(|&&grain| grain >= 0).count(),
            },
            bodies: reader.members("bodies")?,
            states: reader.saved_states()?.iter().map(|state| state.time).collect(),
            contact_states: in_order(reader.members("contacts")?),
            last,
            peak: peak(reader, increments)?,
            group_bytes: group_bytes(reader)?,
            verified: None,
        })
    }

    /// The summary as JSON, keys as the fields' names.
    pub fn to_json(&self) -> String {
        // A struct of texts, numbers and lists always has a JSON form.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    fn last(&self, name: &str) -> Option<f64> {
        self.last.iter().find(|named| named.name == name).and_then(|named| named.value)
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let title = if self.title.is_empty() { "(untitled)" } else { &self.title };
        writeln!(f, "{title}")?;
        writeln!(f, "  file        {} ({})", self.file.display(), size(self.file_bytes))?;
        write!(f, "  status      {}", self.status)?;
        match (self.reason.as_str(), self.status.as_str()) {
            // Whoever was killed could not say why.
            ("", "killed") => {
                write!(f, ", or stopped by a full disk or a crash; run --resume goes on from it")?
            }
            ("", _) => {}
            (reason, _) => write!(f, ": {reason}")?,
        }
        writeln!(f)?;
        writeln!(f, "  made by     riprap {} ({})", self.riprap_version, self.riprap_commit)?;
        writeln!(f, "  on          {}, {}, seed {}", self.host, counted(self.threads, "thread"), self.seed)?;
        if self.grains > 0 {
            writeln!(f, "  grains      {}", self.grains)?;
        }
        if !self.bodies.is_empty() {
            writeln!(f, "  bodies      {}", self.bodies.join(", "))?;
        }
        let of_grains = match self.grain_cells < self.cells {
            true => format!(", {} of them grains'", self.grain_cells),
            false => String::new(),
        };
        writeln!(f, "  mesh        {} cells{of_grains}, {} points", self.cells, self.points)?;
        write!(f, "  increments  {}", self.increments)?;
        match self.restart_increment {
            Some(increment) if self.status != "finished" => {
                writeln!(f, " (--resume continues after {increment})")?
            }
            Some(_) | None => writeln!(f)?,
        }
        writeln!(f, "  states      {}", self.states.len())?;
        if let Some(peak) = &self.peak {
            let q = fixed(peak.deviatoric_stress / 1e6, 4);
            let strain = fixed(100.0 * peak.axial_strain, 3);
            // Behind the last increment it may rise on.
            let (name, remark) = match self.last("deviatoric_stress") == Some(peak.deviatoric_stress) {
                true => ("largest", ", at the end"),
                false => ("peak   ", ""),
            };
            writeln!(f, "  {name}     q = {q} MPa at {strain} % axial strain{remark}")?;
        }
        for (name, factor, unit, label) in [
            ("axial_strain", 100.0, "%", "axial strain"),
            ("volumetric_strain", 100.0, "%", "vol. strain"),
            ("deviatoric_stress", 1e-6, "MPa", "q"),
            ("confining_pressure", 1e-6, "MPa", "confinement"),
            ("void_ratio", 1.0, "inside the cover", "void ratio"),
            ("void_ratio_nominal", 1.0, "between the walls of the compaction, carried on", "void ratio"),
            ("coordination_number", 1.0, "", "coordination"),
        ] {
            if let Some(value) = self.last(name) {
                writeln!(f, "  last {label:<14} {} {unit}", fixed(value * factor, 5))?;
            }
        }
        for (group, bytes) in &self.group_bytes {
            writeln!(f, "  /{group:<10} {}", size(*bytes))?;
        }
        if let Some(verified) = &self.verified {
            let (datasets, bytes) = (verified.datasets, size(verified.bytes));
            let whole = match verified.whole {
                true => "; every byte is as its run closed it",
                false => "; its run has not closed it, so names and attributes have no checksum",
            };
            writeln!(f, "  verified    {datasets} datasets, {bytes} of values{whole}")?;
        }
        Ok(())
    }
}

fn peak(reader: &Reader, increments: usize) -> Result<Option<Peak>> {
    let q = reader.history("deviatoric_stress")?;
    let strain = reader.history("axial_strain")?;
    Ok(q.into_iter()
        .zip(strain)
        .take(increments)
        .filter(|(q, strain)| q.is_finite() && strain.is_finite())
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(deviatoric_stress, axial_strain)| Peak { deviatoric_stress, axial_strain }))
}

/// Stored bytes of the datasets of each group (one and two levels deep, as far as the file goes).
fn group_bytes(reader: &Reader) -> Result<Vec<(String, u64)>> {
    let mut sizes = Vec::new();
    for group in reader.members("/")? {
        let mut total = 0;
        let mut waiting = vec![group.clone()];
        while let Some(name) = waiting.pop() {
            match reader.is_group(&name) {
                true => waiting.extend(reader.members(&name)?.into_iter().map(|m| format!("{name}/{m}"))),
                false => total += reader.stored_bytes(&name)?,
            }
        }
        sizes.push((group, total));
    }
    Ok(sizes)
}

/// Bytes in the unit that gives a short number.
fn size(bytes: u64) -> String {
    let mut value = bytes as f64;
    for unit in ["B", "kB", "MB"] {
        if value < 1000.0 {
            return format!("{value:.3} {unit}").replace(".000", "");
        }
        value /= 1000.0;
    }
    format!("{value:.3} GB")
}

/// Names that are numbers, in their order.
pub(super) fn in_order(mut names: Vec<String>) -> Vec<String> {
    names.sort_by_key(|name| name.parse::<u64>().unwrap_or(u64::MAX));
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A draped cover lies in the gaps between grains: the void ratio inside it is far below the one that was asked for.
    #[test]
    fn void_ratios_say_of_what_they_are() {
        let named =
            |name: &str, value: f64| Named { name: name.into(), value: Some(value), units: "1".into() };
        let last = vec![named("void_ratio", 0.28), named("void_ratio_nominal", 0.85)];
        let text = Summary { last, ..Summary::default() }.to_string();
        assert!(text.contains("last void ratio     0.28000 inside the cover\n"), "{text}");
        assert!(text.contains("last void ratio     0.85000 between the walls"), "{text}");
        // Files of versions that knew the one alone.
        let older = Summary { last: vec![named("void_ratio", 0.28)], ..Summary::default() }.to_string();
        assert!(!older.contains("between the walls"), "{older}");
    }

    #[test]
    fn a_killed_run_says_what_to_do() {
        let of = |status: &str, reason: &str| {
            let summary = Summary { status: status.into(), reason: reason.into(), ..Summary::default() };
            summary.to_string().lines().nth(2).unwrap_or("").to_string()
        };
        let hint = "killed, or stopped by a full disk or a crash; run --resume goes on from it";
        assert_eq!(of("killed", ""), format!("  status      {hint}"));
        assert_eq!(of("finished", ""), "  status      finished");
        assert_eq!(of("stopped", "no balance"), "  status      stopped: no balance");
    }

    #[test]
    fn states_are_listed_in_order() {
        let names = |names: &[&str]| names.iter().map(|name| name.to_string()).collect::<Vec<_>>();
        assert_eq!(in_order(names(&["0", "1", "10", "11", "2"])), names(&["0", "1", "2", "10", "11"]));
    }
}
