//! What this machine has, where the system tells it in the way of Linux.

use crate::case::{Case, unsupported};
use crate::error::Error;

/// An estimate of memory is meant to be right within a factor of two. A run is refused where not even this share of it fits.
const SURELY_NEEDED: f64 = 1.0 / 3.0;

/// Memory that a process may have [B]: the machine's with its swap space, or what its control group is allowed.
pub fn memory() -> Option<f64> {
    let table = std::fs::read_to_string("/proc/meminfo").ok()?;
    let machine = row(&table, "MemTotal:")? + row(&table, "SwapTotal:").unwrap_or(0.0);
    let group = std::fs::read_to_string("/sys/fs/cgroup/memory.max").ok();
    Some(group.and_then(|limit| limit.trim().parse().ok()).map_or(machine, |limit: f64| limit.min(machine)))
}

fn row(table: &str, name: &str) -> Option<f64> {
    let line = table.lines().find_map(|line| line.strip_prefix(name))?;
    let kibibytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024.0 * kibibytes)
}

/// Refuses a case that would need far more memory than `there` is [B]. What riprap cannot run at all is refused by its path, not here.
///
/// # Errors
/// [`Error::Memory`].
pub fn check_memory(case: &Case, there: Option<f64>) -> Result<(), Error> {
    let needed = case.estimate().memory;
    match there {
        Some(there) if SURELY_NEEDED * needed > there && unsupported(case).is_empty() => {
            Err(Error::Memory { needed, there })
        }
        Some(_) | None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_the_table_are_bytes() {
        let table = "MemTotal:       24689484 kB\nMemFree:  1 kB\nSwapTotal:             0 kB\n";
        assert_eq!(row(table, "MemTotal:"), Some(24_689_484.0 * 1024.0));
        assert_eq!(row(table, "SwapTotal:"), Some(0.0));
        assert_eq!(row(table, "Buffers:"), None);
        assert_eq!(row("MemTotal: many\n", "MemTotal:"), None);
    }
}
