//! The `riprap` command: arguments in, exit code out. The only room that prints.
//!
//! Results for people and machines go to standard output, progress and errors to standard error
//! (`--progress json` to standard output).

mod arguments;
mod commands;
mod exit;
mod interrupt;
mod progress;
mod series;

use std::io::{ErrorKind, Write};
use std::process::ExitCode;
use std::sync::OnceLock;

use clap::Parser;

use arguments::{Arguments, Command};
use exit::{Ending, Failure};

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
        Command::Schema => commands::schema(),
    };
    match (ended, UNSAID.get()) {
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

/// The first trouble with standard output.
static UNSAID: OnceLock<std::io::Error> = OnceLock::new();

/// A line on standard output; what keeps it from there is told at the end.
fn say(text: &str) {
    if let Err(error) = writeln!(std::io::stdout().lock(), "{}", harmless(text)) {
        UNSAID.get_or_init(|| error);
    }
}

/// An error on standard error.
fn complain(text: &str) {
    note(&format!("riprap: {text}"));
}

/// A line on standard error.
fn note(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{}", harmless(text));
}

/// A text as a terminal may see it: titles and names are from case files and results files, which others made. Characters that a
/// terminal obeys, and those that turn the direction of writing, are shown by their numbers, as JSON writes them.
pub(crate) fn harmless(text: &str) -> std::borrow::Cow<'_, str> {
    let obeyed = |c: char| {
        (c.is_control() && c != '\n' && c != '\t')
            || matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    if !text.contains(obeyed) {
        return text.into();
    }
    let shown = |c: char| if obeyed(c) { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() };
    text.chars().map(shown).collect::<String>().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_terminal_obeys_no_title() {
        let hostile = "a\u{1b}]0;owned\u{7}\u{1b}[31mred\u{9b}2J\r\u{202e}cod\u{7f}";
        assert_eq!(
            harmless(hostile),
            "a\\u001b]0;owned\\u0007\\u001b[31mred\\u009b2J\\u000d\\u202ecod\\u007f"
        );
        assert_eq!(harmless("q = 0,8 MPa\n\tSchüttung 试验"), "q = 0,8 MPa\n\tSchüttung 试验");
    }
}
