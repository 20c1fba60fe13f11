//! What shells and `man` know of the command.

use std::path::Path;

use clap::CommandFactory;
use clap_complete::Shell;

use crate::error::Error;

use super::arguments::Arguments;
use super::commands::Ended;
use super::exit::Ending;
use super::terminal::say;

/// Prints the script that completes commands and options in a shell.
pub fn completions(shell: Shell) -> Ended {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "riprap", &mut script);
    say(String::from_utf8_lossy(&script).trim_end());
    Ok(Ending::Done)
}

/// Writes `riprap.1` and `riprap-<command>.1`.
pub fn manual(folder: &Path) -> Ended {
    std::fs::create_dir_all(folder).map_err(|e| Error::io("create", folder, e))?;
    clap_mangen::generate_to(Arguments::command(), folder).map_err(|e| Error::io("write into", folder, e))?;
    say(&folder.join("riprap.1").display().to_string());
    Ok(Ending::Done)
}
