//! Starts the members of a series, each as a process, and says how each stands.

use std::fs::File;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::error::{Error, Result};
use crate::results::{Outcome, Reader};

use super::Member;

/// How often running processes are looked after.
const PAUSE: Duration = Duration::from_millis(50);

/// How a member stands before it is run, told by its results file.
#[derive(Debug, Clone, PartialEq)]
pub enum Standing {
    /// There is no file.
    New,
    Finished,
    /// It ran and stopped short; it would stop there again.
    Stopped(String),
    /// Interrupted or killed; whether the file has a point to go on from.
    Broken {
        resumable: bool,
    },
    /// Another process is writing the file.
    Running,
    /// The file is of another case.
    Foreign,
    /// The file cannot be read, for this reason.
    Unreadable(String),
}

/// Looks at a member's results file.
pub fn standing(member: &Member) -> Standing {
    if !member.results.exists() {
        return Standing::New;
    }
    let looked = || -> Result<Standing> {
        let reader = Reader::open(&member.results)?;
        let completed: serde_json::Value =
            serde_json::from_str(&reader.text("case/completed")?).unwrap_or_default();
        if completed != member.completed {
            return Ok(Standing::Foreign);
        }
        if reader.is_live() {
            return Ok(Standing::Running);
        }
        let status = reader.status()?;
        Ok(match status.outcome {
            Outcome::Finished => Standing::Finished,
            Outcome::Stopped => Standing::Stopped(status.reason),
            Outcome::Running | Outcome::Interrupted => {
                Standing::Broken { resumable: reader.restart()?.is_some() }
            }
        })
    };
    looked().unwrap_or_else(|error| Standing::Unreadable(error.to_string()))
}

/// What happens in a series, as it happens.
#[derive(Debug, Clone, PartialEq)]
pub enum Event<'a> {
    /// Not run, for it is finished, has stopped, or is running elsewhere.
    Skipped(&'a Member, &'a Standing),
    Started(&'a Member),
    /// With its exit code, if it has one, and the last line it said.
    Ended(&'a Member, Option<i32>, String),
}

/// How a series is run.
pub struct Launch<'a> {
    /// The `riprap` program.
    pub program: &'a Path,
    /// Processes at a time.
    pub jobs: usize,
    /// Threads of each.
    pub threads: usize,
    /// Runs again what is finished or has stopped, and replaces files of other cases.
    pub force: bool,
    /// Asked now and then: whether to end early.
    pub stop: &'a dyn Fn() -> bool,
}

/// A process at work.
struct Worker<'a> {
    member: &'a Member,
    child: Child,
    told: bool,
}

impl Launch<'_> {
    /// Runs what has to be run; true unless it was asked to stop.
    ///
    /// # Errors
    /// `Error::Usage` for results files of other cases; `Error::Io` where a process or its log cannot be made. Runs that
    /// fail are no error here: their files and logs tell.
    pub fn run(&self, members: &[Member], tell: &mut dyn FnMut(Event<'_>)) -> Result<bool> {
        let mut waiting = Vec::new();
        for member in members {
            let standing = standing(member);
            match &standing {
                Standing::New => waiting.push((member, standing)),
                _ if self.force && standing != Standing::Running => waiting.push((member, standing)),
                Standing::Broken { .. } => waiting.push((member, standing)),
                Standing::Finished | Standing::Stopped(_) | Standing::Running => {
                    tell(Event::Skipped(member, &standing));
                }
                Standing::Foreign => return Err(foreign(member)),
                Standing::Unreadable(reason) => return Err(unreadable(member, reason)),
            }
        }
        let mut waiting = waiting.into_iter();
        let mut working: Vec<Worker<'_>> = Vec::new();
        let mut stopped = false;
        loop {
            stopped |= (self.stop)();
            while !stopped && working.len() < self.jobs.max(1) {
                let Some((member, standing)) = waiting.next() else { break };
                tell(Event::Started(member));
                match self.start(member, &standing) {
                    Ok(child) => working.push(Worker { member, child, told: false }),
                    Err(error) => {
                        end_all(&mut working);
                        return Err(error);
                    }
                }
            }
            if working.is_empty() {
                return Ok(!stopped);
            }
            if stopped {
                working.iter_mut().for_each(ask_to_end);
            }
            let mut at = 0;
            while at < working.len() {
                match working[at].child.try_wait() {
                    Ok(None) => at += 1,
                    Ok(Some(status)) => {
                        let worker = working.remove(at);
                        tell(Event::Ended(worker.member, status.code(), last_line(&log_of(worker.member))));
                    }
                    Err(e) => {
                        end_all(&mut working);
                        return Err(Error::io("wait for", self.program, e));
                    }
                }
            }
            std::thread::sleep(PAUSE);
        }
    }

    fn start(&self, member: &Member, standing: &Standing) -> Result<Child> {
        if let Some(folder) = member.results.parent() {
            std::fs::create_dir_all(folder).map_err(|e| Error::io("create", folder, e))?;
        }
        let log = log_of(member);
        let output = File::create(&log).map_err(|e| Error::io("write", &log, e))?;
        let mut command = Command::new(self.program);
        command.args(member.arguments(self.threads));
        match standing {
            Standing::Broken { resumable: true } if !self.force => command.arg("--resume"),
            Standing::New => &mut command,
            _ => command.arg("--force"),
        };
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(output);
        // A Ctrl-C at the terminal reaches this process alone, which passes it on once.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        command.spawn().map_err(|e| Error::io("start", self.program, e))
    }
}

/// A file of another case in a member's place.
fn foreign(member: &Member) -> Error {
    let (file, name) = (member.results.display(), &member.name);
    let ways = "remove it, choose another --out, or --force runs all again";
    Error::Usage(format!("{file}: holds another case than {name} is now; {ways}"))
}

/// A file in a member's place that cannot be read, for this reason.
fn unreadable(member: &Member, reason: &str) -> Error {
    let file = member.results.display();
    Error::Usage(format!("{file}: cannot be read ({reason}); remove it, or --force runs all again"))
}

/// Generates the specimen of a member's case into its file, in a process of its own, unless it is there. `force` replaces
/// a file of another case, or one that cannot be read.
///
/// # Errors
/// A process that cannot be started; `Error::Usage` with what it said where there is no such specimen, for a file that is not
/// replaced, and for one that another process is writing.
pub fn generate(program: &Path, member: &Member, threads: usize, force: bool) -> Result<()> {
    match standing(member) {
        Standing::Finished => return Ok(()),
        Standing::Running => {
            let file = member.results.display();
            return Err(Error::Usage(format!("{file}: is being written by another process")));
        }
        Standing::Foreign if !force => return Err(foreign(member)),
        Standing::Unreadable(reason) if !force => return Err(unreadable(member, &reason)),
        // Without a finished specimen there is nothing to lose.
        Standing::New | Standing::Stopped(_) | Standing::Broken { .. } => {}
        Standing::Foreign | Standing::Unreadable(_) => {}
    }
    if let Some(folder) = member.results.parent() {
        std::fs::create_dir_all(folder).map_err(|e| Error::io("create", folder, e))?;
    }
    let arguments = member.arguments(threads);
    let output = Command::new(program)
        .args(["specimen", "--force"])
        // Behind `run`, which takes the same.
        .args(&arguments[1..])
        .output()
        .map_err(|e| Error::io("start", program, e))?;
    match output.status.success() {
        true => Ok(()),
        false => Err(Error::Usage(String::from_utf8_lossy(&output.stderr).trim().to_string())),
    }
}

/// Where a member's process writes what it has to say.
pub fn log_of(member: &Member) -> std::path::PathBuf {
    member.results.with_extension("log")
}

/// Asks a process to finish its increment, once.
fn ask_to_end(worker: &mut Worker<'_>) {
    if !std::mem::replace(&mut worker.told, true) {
        let asked = Command::new("kill")
            .args(["-INT", &worker.child.id().to_string()])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        // Where there is no such program, the process is ended; its file keeps the last increment.
        if !asked.is_ok_and(|status| status.success()) {
            let _ = worker.child.kill();
        }
    }
}

/// Ends what still runs when the series itself fails.
fn end_all(working: &mut [Worker<'_>]) {
    for worker in working {
        let _ = worker.child.kill();
        let _ = worker.child.wait();
    }
}

/// What a log ends with: its last message, or, without one, the last line with anything in it.
pub fn last_line(path: &Path) -> String {
    let text = std::fs::read(path).unwrap_or_default();
    let text = String::from_utf8_lossy(&text).into_owned();
    // A dossier may follow the message.
    let message = text.lines().rev().find_map(|line| line.strip_prefix("riprap: "));
    let last = || text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or_default();
    message.unwrap_or_else(last).trim().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_specimen_replaces_no_file_of_another_unasked() {
        let folder = tempfile::tempdir().expect("a folder");
        let member = Member::sample("specimen", folder.path());
        std::fs::write(&member.results, "notes").expect("written");
        // No program is found, so that what is said tells how far it came.
        let program = folder.path().join("none");
        let refused = generate(&program, &member, 1, false).expect_err("a file of somebody's").to_string();
        assert!(refused.contains("remove it, or --force runs all again"), "{refused}");
        let forced = generate(&program, &member, 1, true).expect_err("no program").to_string();
        assert!(forced.contains("none") && !forced.contains("remove it"), "{forced}");
        assert_eq!(std::fs::read_to_string(&member.results).expect("the file"), "notes");
    }

    #[test]
    fn a_log_ends_with_its_message_not_with_the_dossier_below() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        let ends = |text: &str| {
            std::fs::write(file.path(), text).expect("written");
            last_line(file.path())
        };
        assert_eq!(ends("riprap: one\nriprap: stopped\nworst body   3\nto try   less\n"), "stopped");
        assert_eq!(ends("Killed\n\n"), "Killed");
        assert_eq!(ends(""), "");
    }
}
