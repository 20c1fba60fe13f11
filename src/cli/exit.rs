//! Exit codes, and which error means which.

use std::process::ExitCode;

use crate::error::Error;

/// How the command ended; the numbers are a contract.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    Done = 0,
    /// A check failed.
    CheckFailed = 1,
    /// Bad usage or bad input.
    BadInput = 2,
    /// Stopped short of the case's end.
    Stopped = 3,
    /// File trouble, or too little memory.
    File = 4,
    Interrupted = 130,
}

impl From<Ending> for ExitCode {
    fn from(ending: Ending) -> Self {
        ExitCode::from(ending as u8)
    }
}

/// An error and how the command ends for it.
#[derive(Debug)]
pub struct Failure {
    pub error: Error,
    pub ending: Ending,
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let ending = match error {
            Error::Case { .. }
            | Error::Json { .. }
            | Error::Mesh { .. }
            | Error::Specimen(_)
            | Error::Usage(_) => Ending::BadInput,
            Error::Io { .. } | Error::Results { .. } | Error::Memory { .. } => Ending::File,
        };
        Failure { error, ending }
    }
}

impl Failure {
    /// An error of the input, whatever its kind: a case file that cannot be read, say.
    pub fn of_input(error: Error) -> Self {
        Failure { error, ending: Ending::BadInput }
    }
}
