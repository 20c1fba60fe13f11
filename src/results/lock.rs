//! Who may open a results file: one writer alone, or any number of readers.
//!
//! An advisory lock (`flock` on Linux, the kind that HDF5 itself takes, so h5py respects it and is respected)
//! on a handle of riprap's own. HDF5's own handle would pass the lock on to every process that is started while
//! the file is open, and they would keep it. `HDF5_USE_FILE_LOCKING=FALSE` does without locks, as in HDF5: the way out
//! on file systems that cannot lock.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::ErrorKind;
use std::path::Path;

use crate::error::{Error, Result};

use super::store::failure;

/// What the holder of the lock wants to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Access {
    Read,
    Write,
}

/// A lock on a file, held until it is dropped. On file systems without locks it holds nothing.
#[derive(Debug)]
pub(super) struct Lock {
    /// The file itself, whatever its name has come to mean.
    pub file: File,
    locked: bool,
}

impl Drop for Lock {
    /// Given up by name: a process that is being started at this moment has a copy of the handle until it runs, and closing ours alone
    /// would leave the file locked as long.
    fn drop(&mut self) {
        if self.locked {
            let _ = self.file.unlock(); // closing the handle does the rest
        }
    }
}

impl Lock {
    /// Whether it keeps others out.
    pub fn is_held(&self) -> bool {
        self.locked
    }

    /// Locks a file that is there. `None` if another process is in the way.
    pub fn acquire(path: &Path, access: Access) -> Result<Option<Self>> {
        let file = OpenOptions::new().read(true).write(access == Access::Write).open(path);
        Self::on(file.map_err(|e| Error::io("open", path, e))?, path, access)
    }

    /// Makes a new, empty file and locks it for writing. Nothing that is there already is touched, and no link is followed.
    pub fn create(path: &Path) -> Result<Self> {
        let file = OpenOptions::new().read(true).write(true).create_new(true).open(path);
        let file = file.map_err(|e| Error::io("create", path, e))?;
        Self::on(file, path, Access::Write)?.ok_or_else(|| in_use(path))
    }

    fn on(file: File, path: &Path, access: Access) -> Result<Option<Self>> {
        if locks_are_not_ours() {
            return Ok(Some(Lock { file, locked: false }));
        }
        let locked = match access {
            Access::Read => file.try_lock_shared(),
            Access::Write => file.try_lock(),
        };
        match locked {
            Ok(()) => Ok(Some(Lock { file, locked: true })),
            Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(e)) if e.kind() == ErrorKind::Unsupported => {
                Ok(Some(Lock { file, locked: false }))
            }
            Err(TryLockError::Error(e)) => {
                let way_out = "where the file system has no locks, HDF5_USE_FILE_LOCKING=FALSE does without";
                Err(failure(path, "/", format!("cannot be locked: {e}; {way_out}")))
            }
        }
    }

    /// As [`Lock::acquire`] for writing, with an error where another process is in the way.
    pub fn for_writing(path: &Path) -> Result<Self> {
        Self::acquire(path, Access::Write)?.ok_or_else(|| in_use(path))
    }
}

fn in_use(path: &Path) -> Error {
    failure(path, "/", "in use by another process (it is locked); wait for that run to end")
}

/// Refuses a file that another process has open.
pub fn check_unused(path: &Path) -> Result<()> {
    match path.exists() {
        true => Lock::for_writing(path).map(drop),
        false => Ok(()),
    }
}

/// Whether the environment says that HDF5 takes its own locks, which ours would block, or that there are to be none.
fn locks_are_not_ours() -> bool {
    std::env::var("HDF5_USE_FILE_LOCKING").is_ok_and(|value| {
        ["TRUE", "1", "BEST_EFFORT", "FALSE", "0"].contains(&value.to_uppercase().as_str())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As in a process that is forked from this one: a copy of the handle lives on.
    #[test]
    fn lock_ends_with_its_holder_whoever_has_a_copy() {
        let dir = tempfile::tempdir().expect("temporary directory");
        let path = dir.path().join("locked.h5");
        let lock = Lock::create(&path).expect("locked");
        let copy = lock.file.try_clone().expect("copy");
        assert!(Lock::acquire(&path, Access::Read).expect("asked").is_none());
        drop(lock);
        assert!(Lock::acquire(&path, Access::Read).expect("asked").is_some());
        drop(copy);
    }

    #[cfg(unix)]
    #[test]
    fn a_new_file_is_made_through_no_link_and_over_nothing() {
        let dir = tempfile::tempdir().expect("temporary directory");
        let (victim, planted) = (dir.path().join("victim"), dir.path().join("a.h5.new"));
        std::fs::write(&victim, "dear").expect("a file");
        std::os::unix::fs::symlink(&victim, &planted).expect("a link");
        assert!(Lock::create(&planted).is_err() && Lock::create(&victim).is_err());
        std::os::unix::fs::symlink(dir.path().join("nowhere"), dir.path().join("dangling")).expect("a link");
        assert!(Lock::create(&dir.path().join("dangling")).is_err());
        assert!(!dir.path().join("nowhere").exists());
        assert_eq!(std::fs::read_to_string(&victim).expect("still there"), "dear");
    }
}
