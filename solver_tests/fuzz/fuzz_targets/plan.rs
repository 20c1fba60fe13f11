//! A plan of a campaign, without the case files that it names.
#![no_main]

use libfuzzer_sys::fuzz_target;
use riprap::study::plan::read_plan;

fuzz_target!(|text: &[u8]| {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("plan.json");
    std::fs::write(&file, text).expect("a file");
    let _ = read_plan(&file, None);
});
