//! The rollback journal that makes a commit of a results file all or nothing.
//!
//! HDF5 keeps its changed metadata in memory until it flushes (the writer turns evictions off), and
//! then overwrites many small blocks one by one: a process killed in between leaves a mixture. So before
//! each flush the writer copies all bytes that the flush may overwrite to `FILE.vtkhdf.journal` and deletes
//! that journal afterwards (the scheme of SQLite's rollback journal). Whoever opens the file next finds
//! the journal, puts the old bytes back and cuts the file to its old length.
//!
//! A journal belongs to one file at one commit: it holds the file's identity and the number of the commit that the file was at, and
//! the file's head holds the same in a place that no flush touches. A journal that does not fit is never
//! rolled back, whatever its name. A file whose head says that a commit was under way is not read without its journal.
//!
//! The order covers loss of power as well as kills: the journal is on the disk, its name included, before the head and the flush are written;
//! these are on the disk before the head says that the commit is done; that is on the disk before the journal goes.
//!
//! Layout, little-endian: magic, identity (16 bytes), commit, old length, number of blocks; then offset, length and bytes of each
//! block; then the CRC-32 of all that.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

use super::checksum::crc32;
use super::head::{HEAD, Head, Identity};
use super::store::failure;

const MAGIC: &[u8; 8] = b"RIPRAPJ2";
/// Of journals that did not say whose they were.
const OLD_MAGIC: &[u8; 8] = b"RIPRAPJ1";

/// The journal of a results file.
pub fn path_of(file: &Path) -> PathBuf {
    let mut name = file.as_os_str().to_os_string();
    name.push(".journal");
    PathBuf::from(name)
}

/// Which file, at which commit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Owner {
    pub identity: Identity,
    pub commit: u64,
}

/// Copies what a flush may overwrite, the first `old_length` bytes except the head and `fixed` (sorted (offset, length)
/// that no flush touches), in the layout of a journal. `path` is for messages.
pub(super) fn snapshot(
    file: &File,
    path: &Path,
    owner: Owner,
    old_length: u64,
    fixed: &[(u64, u64)],
) -> Result<Vec<u8>> {
    let blocks = complement(old_length, fixed);
    let mut bytes = Vec::new();
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&owner.identity.0);
    for number in [owner.commit, old_length, blocks.len() as u64] {
        bytes.extend_from_slice(&number.to_le_bytes());
    }
    let mut source = file;
    for (offset, length) in blocks {
        bytes.extend_from_slice(&offset.to_le_bytes());
        bytes.extend_from_slice(&length.to_le_bytes());
        let copied = source
            .seek(SeekFrom::Start(offset))
            .and_then(|_| source.take(length).read_to_end(&mut bytes))
            .map_err(|e| Error::io("read", path, e))?;
        if copied as u64 != length {
            let message = format!("ends at byte {} instead of {old_length}", offset + copied as u64);
            return Err(failure(path, "/", message));
        }
    }
    let checksum = crc32(&bytes);
    bytes.extend_from_slice(&checksum.to_le_bytes());
    Ok(bytes)
}

/// Writes a snapshot beside its file and waits until it is on the disk. Nothing that is there already is overwritten, and no link
/// is followed.
pub(super) fn write(file: &Path, snapshot: &[u8]) -> Result<()> {
    let journal = path_of(file);
    let mut to =
        OpenOptions::new().write(true).create_new(true).open(&journal).map_err(|e| match e.kind() {
            io::ErrorKind::AlreadyExists => failure(&journal, "/", "was put there by another process"),
            _ => Error::io("write", &journal, e),
        })?;
    if let Err(e) = to.write_all(snapshot).and_then(|()| to.sync_all()) {
        // Half a journal is none.
        let _ = std::fs::remove_file(&journal);
        return Err(Error::io("write", &journal, e));
    }
    sync_name(file);
    Ok(())
}

/// Waits until the names in a file's folder are on the disk.
pub(super) fn sync_name(file: &Path) {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // Some systems cannot open a folder, or not sync one; they keep names in order by themselves.
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
}

/// What is to be undone.
#[derive(Debug)]
pub(super) struct Armed {
    pub file: File,
    /// The file's name, where it still has it: a journal is only written and discarded beside the file that it is of.
    pub path: Option<PathBuf>,
    pub snapshot: Vec<u8>,
}

/// Puts a file back when it is dropped, if it holds a snapshot. For a writer that is dropped with changes that it did not
/// commit: HDF5 flushes those as the file is closed, and on a full disk only some of them.
#[derive(Debug, Default)]
pub(super) struct Undo {
    pub armed: Option<Armed>,
}

impl Drop for Undo {
    fn drop(&mut self) {
        let Some(Armed { file, path, snapshot }) = self.armed.take() else { return };
        let restored = parse(&snapshot).map(|journal| restore(&file, &journal));
        let Some(path) = path else { return };
        // Where it could not be put back now, the journal stays for whoever opens the file next.
        if let Some(Ok(())) = restored {
            let _ = discard(&path);
        } else if !path_of(&path).exists() {
            let _ = write(&path, &snapshot);
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

/// Makes way for a writer's journals: what lies under their name is deleted where it was made by one of these runs, whose file
/// is whole or is replaced, and gets another name where it is anything else.
pub(super) fn set_aside(file: &Path, own: &[Identity]) -> Result<()> {
    let journal = path_of(file);
    let Ok(found) = std::fs::symlink_metadata(&journal) else { return Ok(()) };
    let bytes = if found.is_file() { std::fs::read(&journal).unwrap_or_default() } else { Vec::new() };
    // One of this run without its end was cut off before its flush began.
    let of = bytes.get(8..24).filter(|_| bytes.starts_with(MAGIC));
    if of.is_some_and(|of| own.iter().any(|own| of == own.0)) {
        return discard(file);
    }
    for number in 1..1000 {
        let mut name = journal.as_os_str().to_os_string();
        name.push(format!(".foreign{number}"));
        let name = PathBuf::from(name);
        if std::fs::symlink_metadata(&name).is_err() {
            return std::fs::rename(&journal, &name).map_err(|e| Error::io("move away", &journal, e));
        }
    }
    Err(failure(&journal, "/", "is not of this run; move it away"))
}

/// What a file needs before it can be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Needed {
    /// It is as its last commit left it.
    Nothing,
    /// This journal has to be rolled back.
    RollBack(PathBuf),
}

/// Looks what a file needs, and touches nothing. For one who has it locked; `path` is its own name, links resolved.
///
/// # Errors
/// No results file; a commit was under way and its journal is gone.
pub(super) fn needed(file: &File, path: &Path) -> Result<Needed> {
    let own = path_of(path);
    let Some(head) = Head::read(file, path)? else {
        // Nothing says whose an old journal is: whether it fits cannot be known.
        if std::fs::read(&own).is_ok_and(|bytes| bytes.starts_with(OLD_MAGIC)) {
            let message = format!(
                "is of an earlier version of riprap and has a journal: if its run was killed, that version's `riprap info` puts it                  back; if not, move {} away",
                own.display()
            );
            return Err(failure(path, "/", message));
        }
        return Ok(Needed::Nothing);
    };
    let owner = Owner { identity: head.identity, commit: head.commit };
    let fits = |journal: &Path| {
        std::fs::read(journal).is_ok_and(|bytes| parse(&bytes).is_some_and(|found| found.owner == owner))
    };
    if fits(&own) {
        return Ok(Needed::RollBack(own));
    }
    if head.under_way.is_none() {
        return Ok(Needed::Nothing);
    }
    // Moved, or known by another name as well.
    let there = path_of(&head.name);
    if !head.name.as_os_str().is_empty() && there != own && fits(&there) {
        return Ok(Needed::RollBack(there));
    }
    let message = format!(
        "its run was killed within a commit, and the journal that puts it back is not beside it: move {} to {}",
        if head.name.as_os_str().is_empty() { "it".into() } else { there.display().to_string() },
        own.display()
    );
    Err(failure(path, "/", message))
}

/// Puts a results file back to its last commit if a killed process left it within the next one; tells whether it had to.
/// For one who has the file locked for writing; `path` is its own name, links resolved.
pub(super) fn recover(file: &File, path: &Path) -> Result<bool> {
    // Looked at under the lock: its writer may have finished in the meantime.
    let Needed::RollBack(journal) = needed(file, path)? else { return Ok(false) };
    let bytes = std::fs::read(&journal).map_err(|e| Error::io("read", &journal, e))?;
    let Some(parsed) = parse(&bytes) else {
        return Err(failure(&journal, "/", "was changed by another process"));
    };
    restore(file, &parsed).map_err(|e| Error::io("repair", path, e))?;
    // This may be a copy, and the file beside the journal still in need of it; one that is of no more use harms nobody.
    if journal == path_of(path) || is_same_file(file, &journal) {
        std::fs::remove_file(&journal).map_err(|e| Error::io("remove", &journal, e))?;
    }
    Ok(true)
}

/// Whether the name beside a journal is one of this file.
fn is_same_file(file: &File, journal: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let named = std::fs::symlink_metadata(journal.with_extension(""));
        let place = |found: std::fs::Metadata| (found.dev(), found.ino());
        file.metadata().is_ok_and(|own| named.is_ok_and(|named| place(own) == place(named)))
    }
    #[cfg(not(unix))]
    {
        let _ = (file, journal);
        false
    }
}

fn restore(file: &File, journal: &Journal<'_>) -> io::Result<()> {
    let mut target = file;
    for (offset, bytes) in &journal.blocks {
        target.seek(SeekFrom::Start(*offset))?;
        target.write_all(bytes)?;
    }
    target.set_len(journal.old_length)?;
    target.sync_all()?;
    Head::take_back(file, journal.owner.identity, journal.owner.commit)?;
    target.sync_all()
}

/// A stretch of a file: offset and bytes.
type Block<'a> = (u64, &'a [u8]);

/// A whole journal.
struct Journal<'a> {
    owner: Owner,
    old_length: u64,
    blocks: Vec<Block<'a>>,
}

/// Reads a journal; `None` if it is incomplete, or no journal.
fn parse(bytes: &[u8]) -> Option<Journal<'_>> {
    let (body, checksum) = bytes.split_at_checked(bytes.len().checked_sub(4)?)?;
    if crc32(body).to_le_bytes() != *checksum {
        return None;
    }
    let mut rest = body.strip_prefix(MAGIC)?;
    let (identity, after) = rest.split_at_checked(16)?;
    rest = after;
    let owner = Owner { identity: Identity(identity.try_into().ok()?), commit: take_u64(&mut rest)? };
    let old_length = take_u64(&mut rest)?;
    let count = take_u64(&mut rest)?;
    let mut blocks = Vec::new();
    for _ in 0..count {
        let offset = take_u64(&mut rest)?;
        let length = usize::try_from(take_u64(&mut rest)?).ok()?;
        let (block, after) = rest.split_at_checked(length)?;
        if offset < HEAD || offset.checked_add(length as u64)? > old_length {
            return None;
        }
        blocks.push((offset, block));
        rest = after;
    }
    Some(Journal { owner, old_length, blocks })
}

fn take_u64(rest: &mut &[u8]) -> Option<u64> {
    let (number, after) = rest.split_at_checked(8)?;
    *rest = after;
    Some(u64::from_le_bytes(number.try_into().ok()?))
}

/// The parts of `HEAD..length` outside the sorted extents.
fn complement(length: u64, fixed: &[(u64, u64)]) -> Vec<(u64, u64)> {
    let mut blocks = Vec::new();
    let mut at = HEAD;
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of some kilobytes behind its head, at commit 5.
    struct Made {
        _dir: tempfile::TempDir,
        path: PathBuf,
        file: File,
        owner: Owner,
        old: Vec<u8>,
    }

    fn made(name: &str) -> Made {
        let dir = tempfile::tempdir().expect("temporary directory");
        let path = dir.path().canonicalize().expect("a folder").join(name);
        let file = File::options().read(true).write(true).create_new(true).open(&path).expect("a file");
        let owner = Owner { identity: Identity::draw(), commit: 5 };
        Head::begin(&file, owner.identity).expect("a head");
        Head::note_commit(&file, 5).expect("a head");
        Head::note_name(&file, &path).expect("a head");
        let mut old = std::fs::read(&path).expect("bytes");
        old.extend((0..=255).cycle().take(3000));
        std::fs::write(&path, &old).expect("bytes");
        Made { _dir: dir, path, file, owner, old }
    }

    impl Made {
        fn keep(&self) -> Vec<u8> {
            let length = self.old.len() as u64;
            snapshot(&self.file, &self.path, self.owner, length, &[(HEAD + 100, 200)]).expect("snapshot")
        }

        /// As a kill within a commit leaves it.
        fn tear(&self) -> Vec<u8> {
            write(&self.path, &self.keep()).expect("journal");
            Head::note_under_way(&self.file, 6).expect("a head");
            let mut torn = std::fs::read(&self.path).expect("bytes");
            torn[HEAD as usize + 50] = 0;
            torn[HEAD as usize + 400..HEAD as usize + 500].fill(7);
            torn.extend_from_slice(&[1; 77]);
            std::fs::write(&self.path, &torn).expect("file");
            torn
        }

        fn bytes(&self) -> Vec<u8> {
            std::fs::read(&self.path).expect("bytes")
        }
    }

    #[test]
    fn complement_covers_what_is_not_fixed() {
        let h = HEAD;
        assert_eq!(complement(h + 100, &[]), [(h, 100)]);
        let fixed = [(h, 10), (h + 10, 20), (h + 50, 25), (h + 90, 30)];
        assert_eq!(complement(h + 100, &fixed), [(h + 30, 20), (h + 75, 15)]);
        assert_eq!(complement(h + 100, &[(h + 120, 10)]), [(h, 100)]);
    }

    #[test]
    fn half_done_flush_is_rolled_back() {
        let made = made("a.h5");
        made.tear();
        assert!(recover(&made.file, &made.path).expect("recovery"));
        assert!(made.bytes() == made.old && !path_of(&made.path).exists());
        assert!(!recover(&made.file, &made.path).expect("nothing to do"));
    }

    #[test]
    fn incomplete_journal_means_an_untouched_file() {
        let made = made("a.h5");
        write(&made.path, &made.keep()).expect("journal");
        let journal = std::fs::read(path_of(&made.path)).expect("journal");
        for length in [0, 7, 500, journal.len() - 1] {
            std::fs::write(path_of(&made.path), &journal[..length]).expect("journal");
            assert!(!recover(&made.file, &made.path).expect("recovery"), "journal cut to {length} bytes");
            assert!(made.bytes() == made.old);
        }
    }

    /// The journal of a killed run meets a file that was copied, moved or finished under its name.
    #[test]
    fn a_journal_of_another_file_or_commit_is_left_alone() {
        let (killed, other) = (made("x.h5"), made("y.h5"));
        killed.tear();
        let journal = path_of(&killed.path);
        let kept = std::fs::read(&journal).expect("journal");
        std::fs::copy(&journal, path_of(&other.path)).expect("copied");
        assert!(!recover(&other.file, &other.path).expect("looked"));
        assert!(other.bytes() == other.old, "another identity");
        assert!(std::fs::read(path_of(&other.path)).expect("still there") == kept);
        // The same run, some commits later.
        let (file, path) = (&killed.file, &killed.path);
        assert!(recover(file, path).expect("its own"));
        Head::note_commit(file, 9).expect("a head");
        let later = killed.bytes();
        std::fs::write(&journal, &kept).expect("from a backup");
        assert!(!recover(file, path).expect("looked"));
        assert!(killed.bytes() == later && journal.exists(), "another commit");
        // A writer makes way: its own goes, another's stays under another name.
        set_aside(path, &[killed.owner.identity]).expect("discarded");
        assert!(!journal.exists());
        set_aside(&other.path, &[other.owner.identity]).expect("set aside");
        let mut aside = path_of(&other.path).into_os_string();
        aside.push(".foreign1");
        assert!(std::fs::read(aside).expect("set aside") == kept && !path_of(&other.path).exists());
    }

    #[test]
    fn a_moved_file_finds_its_journal_or_says_where_it_is() {
        let made = made("x.h5");
        made.tear();
        let moved = made.path.with_file_name("y.h5");
        std::fs::rename(&made.path, &moved).expect("moved");
        let hidden = made.path.with_file_name("hidden");
        std::fs::rename(path_of(&made.path), &hidden).expect("moved");
        let torn = std::fs::read(&moved).expect("bytes");
        let said = recover(&made.file, &moved).expect_err("no journal").to_string();
        assert!(said.contains("killed within a commit") && said.contains("x.h5.journal"), "{said}");
        assert!(said.contains("y.h5.journal") && std::fs::read(&moved).expect("bytes") == torn, "{said}");
        std::fs::rename(&hidden, path_of(&made.path)).expect("moved");
        assert!(recover(&made.file, &moved).expect("found by the name that the file remembers"));
        assert!(std::fs::read(&moved).expect("bytes") == made.old);
    }

    /// What `cp` makes of a torn file has its journal by name; the file itself still needs it.
    #[test]
    fn a_copy_does_not_take_the_journal_away() {
        let made = made("x.h5");
        let torn = made.tear();
        let copied = made.path.with_file_name("copy.h5");
        std::fs::copy(&made.path, &copied).expect("copied");
        let copy = File::options().read(true).write(true).open(&copied).expect("opens");
        assert!(recover(&copy, &copied).expect("found by the name that the file remembers"));
        assert!(std::fs::read(&copied).expect("bytes") == made.old && made.bytes() == torn);
        assert!(recover(&made.file, &made.path).expect("its own") && made.bytes() == made.old);
    }

    #[cfg(unix)]
    #[test]
    fn a_second_hard_name_takes_the_journal_away() {
        let made = made("x.h5");
        made.tear();
        let second = made.path.with_file_name("y.h5");
        std::fs::hard_link(&made.path, &second).expect("a link");
        assert!(recover(&made.file, &second).expect("found by the other name"));
        assert!(made.bytes() == made.old && !path_of(&made.path).exists());
    }

    #[cfg(unix)]
    #[test]
    fn a_planted_link_is_not_followed() {
        let made = made("x.h5");
        let victim = made.path.with_file_name("victim");
        std::fs::write(&victim, "dear").expect("a file");
        std::os::unix::fs::symlink(&victim, path_of(&made.path)).expect("a link");
        assert!(write(&made.path, &made.keep()).is_err());
        assert_eq!(std::fs::read_to_string(&victim).expect("still there"), "dear");
    }

    /// A journal from elsewhere may say anything.
    #[test]
    fn blocks_outside_the_file_make_no_journal() {
        let made = made("x.h5");
        for (offset, length, old_length) in
            [(0, 8, HEAD + 100), (HEAD + 96, 8, HEAD + 100), (u64::MAX, 8, HEAD)]
        {
            let mut bytes = MAGIC.to_vec();
            bytes.extend_from_slice(&made.owner.identity.0);
            for number in [made.owner.commit, old_length, 1, offset, length] {
                bytes.extend_from_slice(&u64::to_le_bytes(number));
            }
            bytes.extend_from_slice(&[3; 8]);
            bytes.extend_from_slice(&crc32(&bytes).to_le_bytes());
            assert!(parse(&bytes).is_none(), "{offset}");
        }
    }
}
