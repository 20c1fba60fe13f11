//! Who may open a results file: one writer alone, or any number of readers.
//!
//! An advisory lock (`flock` on Linux, the kind that HDF5 itself takes, so h5py respects it and is respected)
//! on a handle of riprap's own. HDF5's own handle would pass the lock on to every process that is started while
//! the file is open, and they would keep it.

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
    file: Option<File>,
}

impl Drop for Lock {
    /// Given up by name: a process that is being started at this moment has a copy of the handle until it runs, and closing ours alone
    /// would leave the file locked as long.
    fn drop(&mut self) {
        if let Some(file) = &self.file {
            let _ = file.unlock(); // closing the handle does the rest
        }
    }
}

impl Lock {
    /// Locks a file, made empty if it does not exist and is to be written. `None` if another process is in the way.
    pub fn acquire(path: &Path, access: Access) -> Result<Option<Self>> {
        let mut options = OpenOptions::new();
        match access {
            Access::Read => options.read(true),
            Access::Write => options.read(true).write(true).create(true).truncate(false),
        };
        let file = options.open(path).map_err(|e| Error::io("open", path, e))?;
        if hdf5_locks_by_itself() {
            // The environment forces HDF5's own locks, which ours would block.
            return Ok(Some(Lock { file: None }));
        }
        let locked = match access {
            Access::Read => file.try_lock_shared(),
            Access::Write => file.try_lock(),
        };
        match locked {
            Ok(()) => Ok(Some(Lock { file: Some(file) })),
            Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(e)) if e.kind() == ErrorKind::Unsupported => {
                Ok(Some(Lock { file: None }))
            }
            Err(TryLockError::Error(e)) => Err(Error::io("lock", path, e)),
        }
    }

    /// As [`Lock::acquire`] for writing, with an error where another process is in the way.
    pub fn for_writing(path: &Path) -> Result<Self> {
        Self::acquire(path, Access::Write)?.ok_or_else(|| {
            failure(path, "/", "in use by another process (it is locked); wait for that run to end")
        })
    }
}

/// Refuses a file that another process has open.
pub fn check_unused(path: &Path) -> Result<()> {
    match path.exists() {
        true => Lock::for_writing(path).map(drop),
        false => Ok(()),
    }
}

fn hdf5_locks_by_itself() -> bool {
    std::env::var("HDF5_USE_FILE_LOCKING")
        .is_ok_and(|value| ["TRUE", "1", "BEST_EFFORT"].contains(&value.to_uppercase().as_str()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As in a process that is forked from this one: a copy of the handle lives on.
    #[test]
    fn lock_ends_with_its_holder_whoever_has_a_copy() {
        let dir = tempfile::tempdir().expect("temporary directory");
        let path = dir.path().join("locked.h5");
        let lock = Lock::for_writing(&path).expect("locked");
        let copy = lock.file.as_ref().map(|file| file.try_clone().expect("copy"));
        assert!(Lock::acquire(&path, Access::Read).expect("asked").is_none());
        drop(lock);
        assert!(Lock::acquire(&path, Access::Read).expect("asked").is_some());
        drop(copy);
    }
}
