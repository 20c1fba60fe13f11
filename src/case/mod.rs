//! The case file: read, checked, completed.
//!
//! [`read`] gives the file as JSON ([`RawCase`]); [`RawCase::check`] lists every fault at once or
//! gives the checked [`Case`], plain data in SI; [`Case::completed`] prints every value in force,
//! defaults included; [`schema`] is the JSON Schema for editors. What a file may contain stands in
//! one place, `table`, from which checks, defaults, messages and schema all follow; rules between
//! several values stand in `rules`. A sound case may still ask for what riprap cannot run yet:
//! [`unsupported`] lists that.

mod document;
mod form;
mod overlap;
mod quantity;
mod rules;
mod schema;
mod size;
mod source;
mod support;
mod table;
mod types;
mod walk;

pub use schema::schema;
pub use source::{RawCase, parse_override, read};
pub use support::unsupported;
pub use types::*;

use crate::error::{Error, Fault, Result};

impl RawCase {
    /// Checks the case.
    ///
    /// # Errors
    /// `Error::Case` with every fault found.
    pub fn check(&self) -> Result<Case> {
        let mut walker = walk::Walker::new(self.faults.clone());
        let walked = walker.walk(&table::CASE, &self.value, "$").map(|mut value| {
            rules::derive(&mut value);
            rules::check(&value, &self.value, self.file.parent(), &mut walker);
            value
        });
        let mut faults = walker.faults;
        if faults.is_empty() {
            match document::to_case(walked.unwrap_or_default()) {
                Ok(case) => return Ok(case),
                // The table accepts what the types do not: an error of this program, said as one.
                Err(problem) => faults.push(Fault::new(
                    "$",
                    "this case",
                    format!(
                        "passes the checks of riprap and cannot be built ({problem}): please report this"
                    ),
                    "a case as riprap schema describes it",
                )),
            }
        }
        Err(Error::Case { file: self.file.clone(), faults })
    }
}
