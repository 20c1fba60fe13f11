//! Ctrl-C: the first asks for an end after the increment at hand, which is given up if it takes too long; the second
//! ends the process. While a specimen is generated there is nothing to keep yet, and the first ends it too.

use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use crate::solver::StopSignal;

use super::exit::Ending;
use super::terminal::note;

/// How long the increment at hand may go on.
const PATIENCE: Duration = Duration::from_secs(2);

static REQUESTS: AtomicUsize = AtomicUsize::new(0);
static NOTHING_TO_KEEP: AtomicBool = AtomicBool::new(false);
static SIGNAL: LazyLock<StopSignal> = LazyLock::new(StopSignal::new);

/// Listens for Ctrl-C and for the system's request to end. Where that is impossible, both end the
/// process at once, as they do by default.
pub fn listen() {
    let heard = ctrlc::set_handler(|| {
        let nothing_to_keep = NOTHING_TO_KEEP.load(Ordering::SeqCst);
        if nothing_to_keep {
            note("\ninterrupted before there was a specimen: nothing is kept");
        }
        if REQUESTS.fetch_add(1, Ordering::SeqCst) > 0 || nothing_to_keep {
            std::process::exit(Ending::Interrupted as i32);
        }
        // In a thread of its own, so that a second Ctrl-C is heard meanwhile.
        std::thread::spawn(|| {
            std::thread::sleep(PATIENCE);
            SIGNAL.raise();
        });
        note("\nstopping when this increment is done, or in 2 s; Ctrl-C again stops at once");
    });
    if let Err(error) = heard {
        note(&format!("riprap: Ctrl-C will not wait for the increment at hand: {error}"));
    }
}

/// Says whether the process can end at any moment without losing anything.
pub fn set_nothing_to_keep(nothing: bool) {
    NOTHING_TO_KEEP.store(nothing, Ordering::SeqCst);
}

pub fn requested() -> bool {
    REQUESTS.load(Ordering::SeqCst) > 0
}

/// Raised when the increment at hand is to be given up.
pub fn signal() -> StopSignal {
    SIGNAL.clone()
}
