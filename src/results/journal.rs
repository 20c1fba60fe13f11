//! The rollback journal that makes a commit of a results file all or nothing.
//!
//! HDF5 keeps its changed metadata in memory until it flushes (the writer turns evictions off), and
//! then overwrites many small blocks one by one: a process killed in between leaves a mixture. So before
//! each flush the writer copies all bytes that the flush may overwrite to `FILE.h5.journal` and deletes
//! that journal afterwards (the scheme of SQLite's rollback journal). Whoever opens the file next finds
//! the journal, puts the old bytes back and cuts the file to its old length; a journal that is itself
//! incomplete (wrong checksum) means that the flush had not begun, and is removed.
//!
//! A killed process is covered, since the kernel keeps what was written. Loss of power is covered for commits that wait
//! for the disk: those with a restart point, and all others that come slowly enough for that wait of milliseconds.
//!
//! Layout, little-endian: magic, old length, number of blocks; then offset, length and bytes of each
//! block; then the CRC-32 of all that.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

use super::lock::Lock;
use super::store::failure;

const MAGIC: &[u8; 8] = b"RIPRAPJ1";

/// The journal of a results file.
pub fn path_of(file: &Path) -> PathBuf {
    let mut name = file.as_os_str().to_os_string();
    name.push(".journal");
    PathBuf::from(name)
}

/// Copies what a flush may overwrite, the first `old_length` bytes except `fixed` (sorted (offset, length)
/// that no flush touches), in the layout of a journal.
pub fn snapshot(file: &Path, old_length: u64, fixed: &[(u64, u64)]) -> Result<Vec<u8>> {
    let blocks = complement(old_length, fixed);
    let mut source = File::open(file).map_err(|e| Error::io("read", file, e))?;
    let mut bytes = Vec::new();
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&old_length.to_le_bytes());
    bytes.extend_from_slice(&(blocks.len() as u64).to_le_bytes());
    for (offset, length) in blocks {
        bytes.extend_from_slice(&offset.to_le_bytes());
        bytes.extend_from_slice(&length.to_le_bytes());
        let copied = source
            .seek(SeekFrom::Start(offset))
            .and_then(|_| (&mut source).take(length).read_to_end(&mut bytes))
            .map_err(|e| Error::io("read", file, e))?;
        if copied as u64 != length {
            let message = format!("ends at byte {} instead of {old_length}", offset + copied as u64);
            return Err(failure(file, "/", message));
        }
    }
    let checksum = crc32(&bytes);
    bytes.extend_from_slice(&checksum.to_le_bytes());
    Ok(bytes)
}

/// Writes a snapshot beside its file; `durable` waits until it is on the disk.
pub fn write(file: &Path, snapshot: &[u8], durable: bool) -> Result<()> {
    let journal = path_of(file);
    std::fs::write(&journal, snapshot).map_err(|e| Error::io("write", &journal, e))?;
    if durable { sync(&journal) } else { Ok(()) }
}

/// Waits until a file and its name are on the disk.
pub fn sync(file: &Path) -> Result<()> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let synced = File::open(file).and_then(|file| file.sync_all());
    synced.map_err(|e| Error::io("write", file, e))?;
    // Some systems cannot open a folder, or not sync one; the file itself is safe then.
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
    Ok(())
}

/// Puts a file back when it is dropped, if it holds a snapshot. For a writer that is dropped with changes that it did not
/// commit: HDF5 flushes those as the file is closed, and on a full disk only some of them.
#[derive(Debug, Default)]
pub(super) struct Undo {
    /// The file and its snapshot.
    pub armed: Option<(PathBuf, Vec<u8>)>,
}

impl Drop for Undo {
    fn drop(&mut self) {
        if let Some((file, snapshot)) = self.armed.take() {
            let restored = parse(&snapshot).map(|(length, blocks)| restore(&file, length, &blocks));
            // Where it could not be put back now, the journal stays for whoever opens the file next.
            if let Some(Ok(())) = restored {
                let _ = discard(&file);
            } else {
                let _ = write(&file, &snapshot, true);
            }
        }
    }
}

/// Removes the journal: the flush is done.
pub(super) fn discard(file: &Path) -> Result<()> {
    let journal = path_of(file);
    match std::fs::remove_file(&journal) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => Err(Error::io("remove", &journal, e)),
        _ => Ok(()),
    }
}

/// Puts a results file back to its last commit if a killed process left a journal beside it; tells
/// whether it had to. Errors: the file is in use, or cannot be written.
pub fn recover(file: &Path) -> Result<bool> {
    if !path_of(file).exists() || !file.exists() {
        return Ok(false);
    }
    recover_locked(file, &Lock::for_writing(file)?)
}

/// As [`recover`], for one who has the file locked for writing.
pub(super) fn recover_locked(file: &Path, _lock: &Lock) -> Result<bool> {
    // Read it under the lock: its writer may have finished in the meantime.
    let journal = path_of(file);
    let bytes = match std::fs::read(&journal) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(false),
        Err(e) => return Err(Error::io("read", &journal, e)),
    };
    let rolled_back = match parse(&bytes) {
        Some((old_length, blocks)) => {
            restore(file, old_length, &blocks).map_err(|e| Error::io("repair", file, e))?;
            true
        }
        None => false,
    };
    discard(file)?;
    Ok(rolled_back)
}

fn restore(file: &Path, old_length: u64, blocks: &[Block<'_>]) -> io::Result<()> {
    let mut target = OpenOptions::new().write(true).open(file)?;
    for (offset, bytes) in blocks {
        target.seek(SeekFrom::Start(*offset))?;
        target.write_all(bytes)?;
    }
    target.set_len(old_length)?;
    target.sync_all()
}

/// A stretch of a file: offset and bytes.
type Block<'a> = (u64, &'a [u8]);

/// Old length and blocks of a journal; `None` if it is incomplete.
fn parse(bytes: &[u8]) -> Option<(u64, Vec<Block<'_>>)> {
    let (body, checksum) = bytes.split_at_checked(bytes.len().checked_sub(4)?)?;
    if crc32(body).to_le_bytes() != *checksum {
        return None;
    }
    let mut rest = body.strip_prefix(MAGIC)?;
    let old_length = take_u64(&mut rest)?;
    let count = take_u64(&mut rest)?;
    let mut blocks = Vec::new();
    for _ in 0..count {
        let offset = take_u64(&mut rest)?;
        let length = usize::try_from(take_u64(&mut rest)?).ok()?;
        let (block, after) = rest.split_at_checked(length)?;
        blocks.push((offset, block));
        rest = after;
    }
    Some((old_length, blocks))
}

fn take_u64(rest: &mut &[u8]) -> Option<u64> {
    let (number, after) = rest.split_at_checked(8)?;
    *rest = after;
    Some(u64::from_le_bytes(number.try_into().ok()?))
}

/// The parts of `0..length` outside the sorted extents.
fn complement(length: u64, fixed: &[(u64, u64)]) -> Vec<(u64, u64)> {
    let mut blocks = Vec::new();
    let mut at = 0;
    for &(offset, size) in fixed {
        if offset >= length {
            break;
        }
        if offset > at {
            blocks.push((at, offset - at));
        }
        at = at.max(offset.saturating_add(size));
    }
    if at < length {
        blocks.push((at, length - at));
    }
    blocks
}

/// CRC-32 (IEEE 802.3, as in zlib), so that Python's `zlib.crc32` checks the same.
pub(super) fn crc32(bytes: &[u8]) -> u32 {
    const TABLE: [u32; 256] = {
        let mut table = [0; 256];
        let mut at = 0;
        while at < 256 {
            let mut entry = at as u32;
            let mut bit = 0;
            while bit < 8 {
                entry = if entry & 1 == 1 { (entry >> 1) ^ 0xedb8_8320 } else { entry >> 1 };
                bit += 1;
            }
            table[at] = entry;
            at += 1;
        }
        table
    };
    !bytes.iter().fold(!0, |crc, &byte| (crc >> 8) ^ TABLE[((crc ^ u32::from(byte)) & 0xff) as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksum_is_the_standard_one() {
        // The check value of CRC-32/ISO-HDLC.
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
    }

    #[test]
    fn complement_covers_what_is_not_fixed() {
        assert_eq!(complement(100, &[]), [(0, 100)]);
        assert_eq!(complement(100, &[(0, 10), (10, 20), (50, 25), (90, 30)]), [(30, 20), (75, 15)]);
        assert_eq!(complement(100, &[(120, 10)]), [(0, 100)]);
    }

    #[test]
    fn half_done_flush_is_rolled_back() {
        let dir = tempfile::tempdir().expect("temporary directory");
        let file = dir.path().join("a.h5");
        let old: Vec<u8> = (0..=255).cycle().take(1000).collect();
        std::fs::write(&file, &old).expect("file");
        let kept = snapshot(&file, 1000, &[(100, 200)]).expect("snapshot");
        write(&file, &kept, false).expect("journal");
        let mut torn = old.clone();
        torn[50] = 0;
        torn[400..500].fill(7);
        torn.extend_from_slice(&[1; 77]);
        std::fs::write(&file, &torn).expect("file");
        assert!(recover(&file).expect("recovery"));
        assert_eq!(std::fs::read(&file).expect("file"), old);
        assert!(!path_of(&file).exists());
        assert!(!recover(&file).expect("nothing to do"));
    }

    #[test]
    fn incomplete_journal_means_an_untouched_file() {
        let dir = tempfile::tempdir().expect("temporary directory");
        let file = dir.path().join("a.h5");
        std::fs::write(&file, [5; 1000]).expect("file");
        write(&file, &snapshot(&file, 1000, &[]).expect("snapshot"), false).expect("journal");
        let journal = std::fs::read(path_of(&file)).expect("journal");
        for length in [0, 7, 500, journal.len() - 1] {
            std::fs::write(path_of(&file), &journal[..length]).expect("journal");
            assert!(!recover(&file).expect("recovery"), "journal cut to {length} bytes");
            assert_eq!(std::fs::read(&file).expect("file"), [5; 1000]);
        }
    }
}
