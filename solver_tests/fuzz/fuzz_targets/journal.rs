//! A results file and the journal beside it: four bytes with the length of the file, the file, the journal.
//!
//! The journal gets the checksum that it should have, or nothing behind that would be reached.
#![no_main]

use libfuzzer_sys::fuzz_target;
use riprap::results::Reader;

fuzz_target!(|bytes: &[u8]| {
    let Some((length, rest)) = bytes.split_first_chunk::<4>() else { return };
    let length = (u32::from_le_bytes(*length) as usize).min(rest.len());
    let (results, journal) = rest.split_at(length);
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("x.vtkhdf");
    std::fs::write(&file, results).expect("a file");
    if !journal.is_empty() {
        let mut whole = journal.to_vec();
        whole.extend_from_slice(&crc32fast::hash(journal).to_le_bytes());
        std::fs::write(riprap::results::journal::path_of(&file), whole).expect("a journal");
    }
    if let Ok(reader) = Reader::open(&file) {
        let _ = (reader.status(), reader.increments(), reader.restart(), reader.origin());
    }
});
