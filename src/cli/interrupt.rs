//! Ctrl-C: the first asks for an end after the increment at hand, which is given up if it takes too long; the second
//! ends the process. One within a second of the first is the same request: `timeout` and terminals signal a process and its
//! group. While nothing is written, because a specimen is generated or bodies are built, the first ends it too.

use std::sync::{LazyLock, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use crate::solver::StopSignal;

use super::exit::Ending;
use super::terminal::note;

/// How long the increment at hand may go on, and how long it may take to hear that it is given up: a large body can be solved for in one piece.
const PATIENCE: Duration = Duration::from_secs(2);
const DEAF: Duration = Duration::from_secs(6);
/// Requests closer to the first than this are that one, heard again.
const ECHO: Duration = Duration::from_secs(1);

/// When the first request came.
static REQUESTED: OnceLock<Instant> = OnceLock::new();
static PHASE: Mutex<Phase> = Mutex::new(Phase::Other);
static SIGNAL: LazyLock<StopSignal> = LazyLock::new(StopSignal::new);

/// What an end of the process would break into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// A specimen is generated: there is nothing to keep yet.
    Generating,
    /// Bodies are built, and files are left alone meanwhile.
    Building,
    /// Increments are solved, until somebody asks whether to stop and hears so.
    Solving,
    Other,
}

/// Listens for Ctrl-C and for the system's request to end. Where that is impossible, both end the
/// process at once, as they do by default.
pub fn listen() {
    let heard = ctrlc::set_handler(|| {
        let said = match phase() {
            Phase::Generating => Some("\ninterrupted before there was a specimen: nothing is kept"),
            Phase::Building => Some("\ninterrupted while bodies were built: a results file stays as it is"),
            Phase::Solving | Phase::Other => None,
        };
        said.iter().for_each(|text| note(text));
        if said.is_some() {
            std::process::exit(Ending::Interrupted as i32);
        }
        match REQUESTED.get() {
            None => _ = REQUESTED.set(Instant::now()),
            Some(first) if first.elapsed() < ECHO => return,
            Some(_) => std::process::exit(Ending::Interrupted as i32),
        }
        // In a thread of its own, so that a second Ctrl-C is heard meanwhile.
        std::thread::spawn(|| {
            std::thread::sleep(PATIENCE);
            SIGNAL.raise();
            std::thread::sleep(DEAF);
            if phase() == Phase::Solving {
                note("ended within an increment: the results file stays as the last one left it");
                std::process::exit(Ending::Interrupted as i32);
            }
        });
        note("\nstopping when this increment is done, or in 2 s; Ctrl-C again stops at once");
    });
    if let Err(error) = heard {
        note(&format!("riprap: Ctrl-C will not wait for the increment at hand: {error}"));
    }
}

pub fn set_phase(phase: Phase) {
    *PHASE.lock().unwrap_or_else(PoisonError::into_inner) = phase;
}

fn phase() -> Phase {
    *PHASE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whether to stop; who asks ends the run if so.
pub fn requested() -> bool {
    let requested = REQUESTED.get().is_some();
    if requested {
        set_phase(Phase::Other);
    }
    requested
}

/// Raised when the increment at hand is to be given up.
pub fn signal() -> StopSignal {
    SIGNAL.clone()
}
