//! A case file: parsed, checked, remarked on and estimated.
#![no_main]

use libfuzzer_sys::fuzz_target;
use riprap::case::{RawCase, unsupported};

fuzz_target!(|text: &str| {
    let Ok(raw) = RawCase::parse("fuzz.json".as_ref(), text) else { return };
    if let Ok(case) = raw.check() {
        let _ = (unsupported(&case), case.remarks(), case.burdens(Some(1e10)));
        assert!(case.estimate().memory.is_finite());
    }
});
