//! A laboratory's table.
#![no_main]

use libfuzzer_sys::fuzz_target;
use riprap::report::read_laboratory;

fuzz_target!(|text: &[u8]| {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("sheet.csv");
    std::fs::write(&file, text).expect("a file");
    let _ = read_laboratory(&file);
});
