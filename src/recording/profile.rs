//! Where a run's time and memory went: its parts one after another, and the kernels inside the
//! equilibria. Wall time, on whatever machine and beside whatever else ran there.

use std::fmt;
use std::time::{Duration, Instant};

use crate::assembly::{Kernel, Timings};
use crate::results::Column;

/// A part of the run, e.g. a kind of stage.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    name: &'static str,
    calls: u64,
    time: Duration,
}

/// Calls and wall time of everything worth knowing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Profile {
    parts: Vec<Part>,
    /// Inside seating and stages.
    pub kernels: Timings,
    /// Largest memory that the process has held [bytes], where the system tells (Linux).
    pub peak_memory: Option<u64>,
}

impl Profile {
    /// Books time of a part; the same name adds up.
    pub fn book(&mut self, name: &'static str, time: Duration) {
        match self.parts.iter_mut().find(|part| part.name == name) {
            Some(part) => (part.calls, part.time) = (part.calls + 1, part.time + time),
            None => self.parts.push(Part { name, calls: 1, time }),
        }
    }

    /// Books a part that began at `start` and ends now.
    pub fn book_since(&mut self, name: &'static str, start: Instant) {
        self.book(name, start.elapsed());
    }

    /// Closes the books.
    pub fn finish(&mut self, kernels: Timings) {
        self.kernels = kernels;
        self.peak_memory = peak_memory();
    }

    /// Wall time of all parts [s].
    fn total(&self) -> f64 {
        self.parts.iter().map(|part| part.time.as_secs_f64()).sum()
    }

    /// The columns of `/profile`: one row.
    pub(super) fn columns(&self) -> Vec<Column> {
        let pair = |name: &str, calls: u64, seconds: f64| {
            [
                Column::integers(&format!("{name}_calls"), &format!("calls, {name}"), [calls]),
                Column::number(&format!("{name}_seconds"), "s", &format!("wall time, {name}"), seconds),
            ]
        };
        let parts = self.parts.iter().flat_map(|p| pair(p.name, p.calls, p.time.as_secs_f64()));
        let kernels = Kernel::ALL.into_iter().flat_map(|k| {
            pair(&format!("kernel_{}", k.name()), self.kernels.calls(k), self.kernels.seconds(k))
        });
        let memory = self
            .peak_memory
            .map(|bytes| Column::integers("peak_memory", "largest memory of the process in bytes", [bytes]));
        parts.chain(kernels).chain(memory).collect()
    }
}

impl fmt::Display for Profile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let total = self.total().max(f64::MIN_POSITIVE);
        let line = |f: &mut fmt::Formatter<'_>, name: &str, calls: u64, seconds: f64| {
            let share = 100.0 * seconds / total;
            let each = 1e3 * seconds / calls.max(1) as f64;
            write!(f, "\n{name:<14} {calls:>8} {seconds:>10.3} {share:>6.1} {each:>12.4}")
        };
        write!(f, "{:<14} {:>8} {:>10} {:>6} {:>12}", "profile", "calls", "s", "%", "ms a call")?;
        for part in &self.parts {
            line(f, part.name, part.calls, part.time.as_secs_f64())?;
        }
        if Kernel::ALL.into_iter().any(|k| self.kernels.calls(k) > 0) {
            write!(f, "\nof these, in the kernels of seating and stages")?;
            for kernel in Kernel::ALL {
                let name = format!("  {}", kernel.name());
                line(f, &name, self.kernels.calls(kernel), self.kernels.seconds(kernel))?;
            }
        }
        if let Some(bytes) = self.peak_memory {
            write!(f, "\npeak memory    {:.0} MB", 1e-6 * bytes as f64)?;
        }
        Ok(())
    }
}

/// The kernel's `VmHWM`; `None` on systems that do not have it.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kibibytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(1024 * kibibytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_one_name_add_up() {
        let mut profile = Profile::default();
        profile.book("shear", Duration::from_secs(1));
        profile.book("output", Duration::from_secs(2));
        profile.book("shear", Duration::from_secs(3));
        profile.finish(Timings::default());
        let text = profile.to_string();
        let shear = text.lines().find(|l| l.starts_with("shear")).expect("a line");
        let fields: Vec<&str> = shear.split_whitespace().collect();
        assert_eq!(fields, ["shear", "2", "4.000", "66.7", "2000.0000"]);
        assert!(!text.contains("kernels"));
        let named = |name: &str| profile.columns().iter().any(|c| c.name == name);
        assert!(named("shear_seconds") && named("output_calls") && named("kernel_factor_seconds"));
    }
}
