//! The head of a results file: its first 4 KiB, in front of the HDF5 data (HDF5's user block, which its readers skip).
//!
//! It says which run the file is of and which commit it is at, in a place that no flush of HDF5 touches, so that it can be
//! trusted where the rest is half written. A journal that belongs to this file at this commit, and no other, puts it back.
//!
//! Layout, little-endian: at 0 the magic, at 16 the format (u32), at 24 the identity (16 bytes), at 40 the CRC-32 of these 40
//! bytes; at 48 the commits made so far (u64); at 56 the number of the commit under way, if it is larger (u64); at 64 the
//! commit of which the CRC-32 of all bytes behind the head stands at 72 (u64, u32), 0 for none; at 126 the length of a
//! path in UTF-8 (u16) and at 128 the path: the file's name when its run last had it.

use std::fs::File;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

use super::checksum::crc32;
use super::store::failure;

/// Bytes of the head: HDF5's user block.
pub(super) const HEAD: u64 = 4096;
/// The layout of results files that this riprap writes, and the newest that it reads: also the root's attribute `format_version`. It grows when what
/// is there changes its name, shape or meaning, not when something is added. 1 had no head.
pub const FORMAT: u32 = 2;
const MAGIC: &[u8; 16] = b"riprap results\n\0";
const HDF5: &[u8; 8] = b"\x89HDF\r\n\x1a\n";
const COMMIT_AT: u64 = 48;
const UNDER_WAY_AT: u64 = 56;
const CHECKED_AT: u64 = 64;
const NAME_AT: u64 = 126;
const LONGEST_NAME: usize = HEAD as usize - 128;

/// Whether a file begins as results files do, or as other files of HDF5; what is no file or cannot be read does not.
pub fn is_results(path: &Path) -> bool {
    // A pipe that nobody writes to would never open.
    if !path.is_file() {
        return false;
    }
    let mut start = [0; MAGIC.len()];
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut start));
    read.is_ok() && (start.starts_with(HDF5) || start == *MAGIC)
}

/// Which run a file is of: drawn once, when the file is made. Copies have it too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Identity(pub [u8; 16]);

impl Identity {
    /// A new one. Of the system's randomness, not of the case's seed: two runs of one case have two.
    pub fn draw() -> Self {
        let mut bytes = [0; 16];
        for half in bytes.chunks_exact_mut(8) {
            let mut hasher = RandomState::new().build_hasher();
            hasher.write_u32(std::process::id());
            half.copy_from_slice(&hasher.finish().to_le_bytes());
        }
        Identity(bytes)
    }
}

impl std::fmt::Display for Identity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// What the head of a file says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Head {
    pub identity: Identity,
    /// Commits made so far.
    pub commit: u64,
    /// A commit that was begun and not ended.
    pub under_way: Option<u64>,
    /// CRC-32 of all bytes behind the head, where the file was closed at this commit.
    pub checksum: Option<u32>,
    /// The file's name when its run last had it.
    pub name: PathBuf,
}

impl Head {
    /// The head of a file; `None` of a file from before there were heads. Errors: no results file, a damaged one, one of a
    /// newer version.
    pub fn read(file: &File, path: &Path) -> Result<Option<Self>> {
        let mut bytes = Vec::new();
        let mut from = file;
        from.seek(SeekFrom::Start(0))
            .and_then(|_| from.take(HEAD).read_to_end(&mut bytes))
            .map_err(|e| Error::io("read", path, e))?;
        if bytes.starts_with(HDF5) {
            return Ok(None);
        }
        let damaged = || failure(path, "/", "not an HDF5 file of riprap, or damaged at its start");
        if bytes.len() < HEAD as usize
            || !bytes.starts_with(MAGIC)
            || bytes[40..44] != crc32(&bytes[..40]).to_le_bytes()
        {
            return Err(damaged());
        }
        let number = |at: u64| {
            let at = at as usize;
            bytes[at..at + 8].iter().rev().fold(0_u64, |number, &byte| number << 8 | u64::from(byte))
        };
        let format = number(16) as u32;
        if format != FORMAT {
            let message = format!("has format {format}; this riprap reads formats up to {FORMAT}");
            return Err(failure(path, "/", message));
        }
        let commit = number(COMMIT_AT);
        let length = usize::from(u16::from_le_bytes([bytes[126], bytes[127]])).min(LONGEST_NAME);
        Ok(Some(Head {
            identity: Identity(bytes[24..40].try_into().map_err(|_| damaged())?),
            commit,
            under_way: Some(number(UNDER_WAY_AT)).filter(|&begun| begun > commit),
            checksum: (number(CHECKED_AT) == commit).then(|| number(CHECKED_AT + 8) as u32),
            name: String::from_utf8_lossy(&bytes[128..128 + length]).into_owned().into(),
        }))
    }

    /// Writes the head of a new file.
    pub fn begin(file: &File, identity: Identity) -> io::Result<()> {
        let mut bytes = vec![0; HEAD as usize];
        bytes[..16].copy_from_slice(MAGIC);
        bytes[16..20].copy_from_slice(&FORMAT.to_le_bytes());
        bytes[24..40].copy_from_slice(&identity.0);
        let checksum = crc32(&bytes[..40]);
        bytes[40..44].copy_from_slice(&checksum.to_le_bytes());
        put(file, 0, &bytes)
    }

    /// Notes that a file is at this commit and no other is under way; nothing where it is no longer this run's file.
    pub fn take_back(file: &File, identity: Identity, commit: u64) -> io::Result<()> {
        let mut bytes = [0; 24];
        let mut from = file;
        from.seek(SeekFrom::Start(0))?;
        let whole = from.read_exact(&mut bytes).is_ok() && bytes.starts_with(MAGIC);
        let mut of = [0; 16];
        if !whole || from.read_exact(&mut of).is_err() || of != identity.0 {
            return Ok(());
        }
        put(file, CHECKED_AT, &0_u64.to_le_bytes())?;
        put(file, COMMIT_AT, &commit.to_le_bytes())?;
        put(file, UNDER_WAY_AT, &0_u64.to_le_bytes())
    }

    /// Notes that a commit is begun. Eight bytes in one disk sector: written whole or not at all.
    pub fn note_under_way(file: &File, commit: u64) -> io::Result<()> {
        put(file, UNDER_WAY_AT, &commit.to_le_bytes())
    }

    /// Notes that a commit is done.
    pub fn note_commit(file: &File, commit: u64) -> io::Result<()> {
        put(file, COMMIT_AT, &commit.to_le_bytes())
    }

    /// Notes the checksum of all bytes behind the head, as they are at this commit.
    pub fn note_checksum(file: &File, commit: u64, checksum: u32) -> io::Result<()> {
        // In one write: a loss of power may leave any of several.
        let mut bytes = commit.to_le_bytes().to_vec();
        bytes.extend_from_slice(&checksum.to_le_bytes());
        put(file, CHECKED_AT, &bytes)
    }

    /// Notes the file's name, so that a copy or link elsewhere can tell where its journal is.
    pub fn note_name(file: &File, path: &Path) -> io::Result<()> {
        let name = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        let name = name.to_string_lossy();
        // One that is too long is left out: it only helps to find a journal.
        let name = if name.len() > LONGEST_NAME { "" } else { &name };
        let mut bytes = (name.len() as u16).to_le_bytes().to_vec();
        bytes.extend_from_slice(name.as_bytes());
        put(file, NAME_AT, &bytes)
    }
}

/// Whether a file may be one that a run began to write: with a head, with none yet, or of a version that wrote none.
pub(super) fn is_unfinished(file: &File) -> bool {
    let mut start = Vec::new();
    let mut from = file;
    let read = from.seek(SeekFrom::Start(0)).and_then(|_| from.take(16).read_to_end(&mut start));
    read.is_ok()
        && (start.iter().all(|&byte| byte == 0) || start.starts_with(MAGIC) || start.starts_with(HDF5))
}

/// CRC-32 of all bytes behind the head.
pub(super) fn checksum(file: &File) -> io::Result<u32> {
    let mut from = file;
    from.seek(SeekFrom::Start(HEAD))?;
    let mut hasher = crc32fast::Hasher::new();
    let mut piece = vec![0; 1 << 20];
    loop {
        match from.read(&mut piece)? {
            0 => return Ok(hasher.finalize()),
            read => hasher.update(&piece[..read]),
        }
    }
}

fn put(mut file: &File, at: u64, bytes: &[u8]) -> io::Result<()> {
    file.seek(SeekFrom::Start(at))?;
    file.write_all(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn new_file(name: &str) -> (tempfile::TempDir, PathBuf, File) {
        let dir = tempfile::tempdir().expect("temporary directory");
        let path = dir.path().join(name);
        let options = File::options().read(true).write(true).create_new(true).open(&path);
        (dir, path, options.expect("a file"))
    }

    #[test]
    fn what_is_noted_is_read() {
        let (_dir, path, file) = new_file("a.h5");
        let identity = Identity::draw();
        assert_ne!(identity, Identity::draw());
        Head::begin(&file, identity).expect("written");
        let read = || Head::read(&file, &path).unwrap_or_else(|e| panic!("{e}")).expect("a head");
        assert_eq!((read().identity, read().commit, read().under_way), (identity, 0, None));
        Head::note_name(&file, &path).expect("written");
        Head::note_under_way(&file, 0x1_0000_0007).expect("written");
        assert_eq!((read().commit, read().under_way), (0, Some(0x1_0000_0007)));
        assert_eq!(read().name, path);
        Head::note_commit(&file, 0x1_0000_0007).expect("written");
        assert_eq!((read().commit, read().under_way, read().checksum), (0x1_0000_0007, None, None));
        Head::note_checksum(&file, 0x1_0000_0007, 0xfedc_ba98).expect("written");
        assert_eq!(read().checksum, Some(0xfedc_ba98));
        Head::note_commit(&file, 0x1_0000_0008).expect("written");
        assert_eq!(read().checksum, None, "it is of another commit");
    }

    #[test]
    fn a_damaged_head_is_refused_and_none_is_an_older_file() {
        let (_dir, path, file) = new_file("a.h5");
        assert!(Head::read(&file, &path).is_err(), "empty");
        Head::begin(&file, Identity([7; 16])).expect("written");
        for at in [0, 15, 16, 24, 39, 40, 43] {
            let mut bytes = std::fs::read(&path).expect("bytes");
            bytes[at] ^= 0x20;
            std::fs::write(&path, &bytes).expect("written");
            assert!(Head::read(&file, &path).is_err(), "byte {at}");
            bytes[at] ^= 0x20;
            std::fs::write(&path, &bytes).expect("written");
        }
        std::fs::write(&path, b"\x89HDF\r\n\x1a\nand so on").expect("written");
        assert!(is_results(&path) && !path.parent().is_some_and(is_results));
        assert_eq!(Head::read(&file, &path).unwrap_or_else(|e| panic!("{e}")), None);
    }
}
