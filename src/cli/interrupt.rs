//! Ctrl-C: the first asks for an end after the increment at hand, which is given up if it takes too long; the second
//! ends the process. While nothing is written, because a specimen is generated or bodies are built, the first ends it too.

use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicUsize, Ordering};
use std::time::Duration;

use crate::solver::StopSignal;

use super::exit::Ending;
use super::terminal::note;

/// How long the increment at hand may go on, and how long it may take to hear that it is given up: a large body can be solved for in one piece.
const PATIENCE: Duration = Duration::from_secs(2);
const DEAF: Duration = Duration::from_secs(6);

static REQUESTS: AtomicUsize = AtomicUsize::new(0);
static SOLVING: AtomicBool = AtomicBool::new(false);
static HEARD: AtomicBool = AtomicBool::new(false);
static ENDS_AT_ONCE: AtomicU8 = AtomicU8::new(0);
static SIGNAL: LazyLock<StopSignal> = LazyLock::new(StopSignal::new);

/// Why nothing is lost by an end at any moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AtOnce {
    /// There is no specimen yet.
    NoSpecimen = 1,
    /// Bodies are built, and files are left alone meanwhile.
    Building = 2,
}

/// Listens for Ctrl-C and for the system's request to end. Where that is impossible, both end the
/// process at once, as they do by default.
pub fn listen() {
    let heard = ctrlc::set_handler(|| {
        let said = match ENDS_AT_ONCE.load(Ordering::SeqCst) {
            0 => None,
            code if code == AtOnce::NoSpecimen as u8 => {
                Some("\ninterrupted before there was a specimen: nothing is kept")
            }
            _ => Some("\ninterrupted while bodies were built: a results file stays as it is"),
        };
        said.iter().for_each(|text| note(text));
        if REQUESTS.fetch_add(1, Ordering::SeqCst) > 0 || said.is_some() {
            std::process::exit(Ending::Interrupted as i32);
        }
        // In a thread of its own, so that a second Ctrl-C is heard meanwhile.
        std::thread::spawn(|| {
            std::thread::sleep(PATIENCE);
            SIGNAL.raise();
            std::thread::sleep(DEAF);
            if SOLVING.load(Ordering::SeqCst) && !HEARD.load(Ordering::SeqCst) {
                note("ended in the midst of an increment: the results file stays as the last one left it");
                std::process::exit(Ending::Interrupted as i32);
            }
        });
        note("\nstopping when this increment is done, or in 2 s; Ctrl-C again stops at once");
    });
    if let Err(error) = heard {
        note(&format!("riprap: Ctrl-C will not wait for the increment at hand: {error}"));
    }
}

/// Says whether, and why, the process can end at any moment without losing anything.
pub fn set_ends_at_once(why: Option<AtOnce>) {
    ENDS_AT_ONCE.store(why.map_or(0, |why| why as u8), Ordering::SeqCst);
}

/// Says whether increments are being solved.
pub fn set_solving(solving: bool) {
    SOLVING.store(solving, Ordering::SeqCst);
}

/// Whether to stop; who asks ends the run if so.
pub fn requested() -> bool {
    let requested = REQUESTS.load(Ordering::SeqCst) > 0;
    if requested {
        HEARD.store(true, Ordering::SeqCst);
    }
    requested
}

/// Raised when the increment at hand is to be given up.
pub fn signal() -> StopSignal {
    SIGNAL.clone()
}
