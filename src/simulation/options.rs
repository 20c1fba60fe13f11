//! What a run takes besides its case.

use std::path::{Path, PathBuf};

use crate::case::{Case, RawCase};
use crate::error::Result;
use crate::recording::{Target, check_target, followed};
use crate::results::Existing;

use super::start;

/// What a run takes besides its case.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The results file to write.
    pub out: PathBuf,
    /// What to do where it exists already.
    pub existing: Existing,
    /// Threads at work, for the record.
    pub threads: usize,
    /// Whether `/profile` is written.
    pub profile: bool,
    /// Whether every accepted state is checked for overlap, apart from the contact search; a fault stops the
    /// run.
    pub audit: bool,
}

impl Options {
    /// The options with links to the results file followed, where that can be written and is nothing that the
    /// run reads.
    ///
    /// # Errors
    /// As [`check_target`].
    pub(super) fn aimed(&self, case: &Case, source: &RawCase) -> Result<Options> {
        let options = Options { out: followed(&self.out), ..self.clone() };
        let start = start::file_of(case, source);
        let folder = source.file.parent().unwrap_or(Path::new(""));
        let files = case.files().into_iter().map(|name| folder.join(name));
        let inputs: Vec<PathBuf> = std::iter::once(source.file.clone()).chain(start).chain(files).collect();
        check_target(&options.out, options.existing, &inputs)?;
        Ok(options)
    }

    pub(super) fn target(&self) -> Target<'_> {
        Target { out: &self.out, existing: self.existing, threads: self.threads }
    }
}
