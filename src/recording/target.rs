//! The results file that a run is to write: where it is, and whether it can be made.

use std::path::{Path, PathBuf};

use crate::case::{Case, RawCase};
use crate::error::{Error, Result};
use crate::results::{CaseRecord, Existing, Writer, check_unused};

/// A file to write.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target<'a> {
    pub out: &'a Path,
    /// What to do where it exists already.
    pub existing: Existing,
    /// Threads at work, for the record.
    pub threads: usize,
}

impl Target<'_> {
    /// A results file with its `/case`, complete but empty.
    pub(super) fn create(&self, case: &Case, source: &RawCase) -> Result<Writer> {
        let record = CaseRecord {
            title: case.title.clone(),
            given: source.text.clone(),
            completed: format!("{:#}", case.completed()),
            seed: case.seed,
            threads: self.threads as u64,
            stages: case.stages.iter().map(|stage| stage.kind().to_string()).collect(),
        };
        Writer::create(self.out, &record, self.existing)
    }
}

/// Links that are followed, one after another.
const MOST_LINKS: usize = 40;

/// The file that `path` leads to over links, there or not.
pub fn followed(path: &Path) -> PathBuf {
    let mut path = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        let Ok(to) = std::fs::read_link(&path) else { break };
        path = path.parent().unwrap_or(Path::new("")).join(to);
    }
    path
}

/// Whether the results file can be written, before anything is computed.
///
/// # Errors
/// `Error::Usage` where it exists and is not to be replaced, is no file or one of the `inputs`,
/// `Error::Results` where another process has it, `Error::Io` where it cannot be made.
pub fn check_target(out: &Path, existing: Existing, inputs: &[PathBuf]) -> Result<()> {
    if existing == Existing::Refuse && out.exists() {
        return Err(Error::Usage(format!(
            "{} exists already: --force replaces it, --out writes elsewhere, riprap run --resume continues a run",
            out.display()
        )));
    }
    if out.is_dir() {
        return Err(Error::Usage(format!("{} is a directory; --out wants a file", out.display())));
    }
    if out.exists() && !out.is_file() {
        return Err(Error::Usage(format!("{} is a device or pipe; --out wants a file", out.display())));
    }
    let place = |path: &Path| std::fs::canonicalize(path).ok();
    for ending in ["", ".new", ".journal"] {
        // Names that the run writes to as well.
        let mut name = out.as_os_str().to_os_string();
        name.push(ending);
        let name = PathBuf::from(name);
        if place(&name).is_some_and(|to| inputs.iter().any(|input| place(input).as_ref() == Some(&to))) {
            let message = format!("{} is what the run reads; --out wants another file", name.display());
            return Err(Error::Usage(message));
        }
    }
    check_unused(out)?;
    let folder = out.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(|e| Error::io("create", folder, e))?;
    // A name that nobody can have put there, and no link is followed.
    let number = std::hash::BuildHasher::hash_one(&std::hash::RandomState::new(), std::process::id());
    let probe = folder.join(format!(".riprap-{number:016x}"));
    let made = std::fs::OpenOptions::new().write(true).create_new(true).open(&probe);
    made.map_err(|e| Error::io("write", out, e))?;
    std::fs::remove_file(&probe).map_err(|e| Error::io("write", out, e))
}
