//! `/case` and `/status`: what was run, by what, and how it ended; names in `/restart`.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// What `/case` keeps, so that a results file can be understood and repeated by itself.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CaseRecord {
    pub title: String,
    /// The case file, byte for byte.
    pub given: String,
    /// The case with every default filled in, as JSON.
    pub completed: String,
    pub seed: u64,
    pub threads: u64,
    /// Kinds of the stages in order, so that `stage` in `/history` can be named.
    pub stages: Vec<String>,
}

/// Endings of a results file's name, the usual one first: the one by which ParaView and PyVista know its format, and the one that riprap gave
/// before.
pub const ENDINGS: [&str; 2] = ["vtkhdf", "h5"];

/// The results file `name` in `folder`: the one with an older ending where it is there and the usual one is not.
pub fn results_file(folder: &Path, name: &OsStr) -> PathBuf {
    let ending = |ending: &str| {
        let mut file = name.to_os_string();
        file.push(".");
        file.push(ending);
        folder.join(file)
    };
    let [usual, older] = ENDINGS.map(ending);
    if older.exists() && !usual.exists() { older } else { usual }
}

/// The two restart slots, written in turn, so that one of them is always whole.
pub(super) const RESTART_SLOTS: [&str; 2] = ["restart/a", "restart/b"];
/// What all restart points have in common.
pub(super) const ORIGIN: &str = "restart/origin";
/// The state that other runs can start from.
pub(super) const CONSOLIDATED: &str = "restart/consolidated";

/// riprap's version.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The commit that riprap was built from (see `build.rs`), else `unknown`.
pub const COMMIT: &str = match option_env!("RIPRAP_COMMIT") {
    Some(commit) => commit,
    None => "unknown",
};

/// The name of this computer, or `unknown`.
pub fn host() -> String {
    std::fs::read_to_string("/proc/sys/kernel/hostname")
        .ok()
        .or_else(|| std::env::var("HOSTNAME").ok())
        .or_else(|| std::env::var("COMPUTERNAME").ok())
        .map(|name| name.trim().to_string())
        .filter(|name| !name.is_empty())
        .unwrap_or_else(|| "unknown".to_string())
}

/// How a run stands or ended: the text of `/status`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Still running, or killed: nobody wrote an end.
    Running,
    /// Reached the end of the case.
    Finished,
    /// Ended by the user; resumable.
    Interrupted,
    /// Could not go on; the reason says why.
    Stopped,
}

impl Outcome {
    pub fn as_str(self) -> &'static str {
        match self {
            Outcome::Running => "running",
            Outcome::Finished => "finished",
            Outcome::Interrupted => "interrupted",
            Outcome::Stopped => "stopped",
        }
    }

    pub(super) fn parse(text: &str) -> Option<Self> {
        [Outcome::Running, Outcome::Finished, Outcome::Interrupted, Outcome::Stopped]
            .into_iter()
            .find(|outcome| outcome.as_str() == text)
    }
}

/// What `/status` says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Status {
    pub outcome: Outcome,
    pub reason: String,
    /// The last increment that was accepted and written; 0 before the first.
    pub last_good_increment: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_with_the_older_ending_is_gone_on_with() {
        let folder = tempfile::tempdir().expect("a folder");
        let name = || {
            let file = results_file(folder.path(), "dam 1.5".as_ref());
            file.file_name().map(|name| name.to_string_lossy().into_owned())
        };
        assert_eq!(name().as_deref(), Some("dam 1.5.vtkhdf"));
        std::fs::write(folder.path().join("dam 1.5.h5"), "older").expect("a file");
        assert_eq!(name().as_deref(), Some("dam 1.5.h5"));
        std::fs::write(folder.path().join("dam 1.5.vtkhdf"), "newer").expect("a file");
        assert_eq!(name().as_deref(), Some("dam 1.5.vtkhdf"));
    }
}
