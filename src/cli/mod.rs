//! The `riprap` command: arguments in, exit code out. The only room that prints.
//!
//! Results for people and machines go to standard output, progress and errors to standard error
//! (`--progress json` to standard output).

mod arguments;
mod commands;
mod exit;
mod interrupt;
mod machine;
mod progress;
mod series;
mod shells;
mod terminal;

use std::io::ErrorKind;
use std::process::ExitCode;

use clap::Parser;

use arguments::{Arguments, Command};
use exit::{Ending, Failure};
use terminal::{complain, unsaid};

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(message) => {
            // Help and version are no errors. A closed pipe is nobody's fault.
            let _ = message.print();
            return if message.use_stderr() { Ending::BadInput.into() } else { Ending::Done.into() };
        }
    };
    if let Err(accepted) = log_as_asked() {
        complain(&accepted);
        return Ending::BadInput.into();
    }
    let ended = match &arguments.command {
        Command::Run(run) => commands::run(run),
        Command::Check(check) => commands::check(check),
        Command::Specimen(specimen) => commands::specimen(specimen),
        Command::Info(info) => commands::info(info),
        Command::Export(export) => commands::export(export),
        Command::Report(report) => commands::report(report),
        Command::Study(study) => series::study(study),
        Command::Batch(batch) => series::batch(batch),
        Command::Verify(verify) => commands::verify(verify),
        Command::Schema { plan } => commands::schema(*plan),
        Command::Completions { shell } => shells::completions(*shell),
        Command::Man { folder } => shells::manual(folder),
    };
    match (ended, unsaid()) {
        // Whoever read it has seen enough.
        (Ok(_), Some(error)) if error.kind() != ErrorKind::BrokenPipe => {
            complain(&format!("cannot write to standard output: {error}"));
            Ending::File.into()
        }
        (Ok(ending), _) => ending.into(),
        (Err(Failure { error, ending }), _) => {
            complain(&error.to_string());
            ending.into()
        }
    }
}

/// Has the solver's events written to standard error where `RIPRAP_LOG` names a level.
fn log_as_asked() -> Result<(), String> {
    let Ok(level) = std::env::var("RIPRAP_LOG") else { return Ok(()) };
    let level: tracing::Level = level.parse().map_err(|_| {
        format!("RIPRAP_LOG: `{level}` is no level; accepted: error, warn, info, debug, trace")
    })?;
    tracing_subscriber::fmt().with_max_level(level).with_writer(std::io::stderr).without_time().init();
    Ok(())
}
