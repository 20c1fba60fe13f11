//! Ctrl-C: the first asks for an end after the increment at hand, the second ends the process.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::exit::Ending;
use super::note;

static REQUESTS: AtomicUsize = AtomicUsize::new(0);

/// Listens for Ctrl-C and for the system's request to end. Where that is impossible, both end the
/// process at once, as they do by default.
pub fn listen() {
    let heard = ctrlc::set_handler(|| {
        if REQUESTS.fetch_add(1, Ordering::SeqCst) > 0 {
            std::process::exit(Ending::Interrupted as i32);
        }
        note("\nstopping when this increment is done; Ctrl-C again stops at once");
    });
    if let Err(error) = heard {
        note(&format!("riprap: Ctrl-C will not wait for the increment at hand: {error}"));
    }
}

pub fn requested() -> bool {
    REQUESTS.load(Ordering::SeqCst) > 0
}
