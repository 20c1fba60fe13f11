//! A wish to stop, heard between augmentations.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Raised from outside, perhaps from another thread, to have the increment at hand given up; the
/// committed state stays as it is. Copies are of the same signal; the default one is never raised.
#[derive(Debug, Clone, Default)]
pub struct StopSignal(Option<Arc<AtomicBool>>);

impl StopSignal {
    pub fn new() -> Self {
        StopSignal(Some(Arc::default()))
    }

    pub fn raise(&self) {
        if let Some(raised) = &self.0 {
            raised.store(true, Ordering::SeqCst);
        }
    }

    pub fn is_raised(&self) -> bool {
        self.0.as_ref().is_some_and(|raised| raised.load(Ordering::SeqCst))
    }
}

/// Whether both are of the same signal.
impl PartialEq for StopSignal {
    fn eq(&self, other: &Self) -> bool {
        match (&self.0, &other.0) {
            (Some(own), Some(other)) => Arc::ptr_eq(own, other),
            (None, None) => true,
            (None, Some(_)) | (Some(_), None) => false,
        }
    }
}
