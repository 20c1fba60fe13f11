//! Files that others made, read whole: what a case or a plan names is a file, and none is larger than this program has use for.
//!
//! A link to `/dev/zero` would take all of a machine's memory, and a pipe that nobody writes to would never end. Sizes are in bytes.

use std::fs::File;
use std::io::{Error, Read, Result};
use std::path::Path;

/// Of a mesh, a surface or a table. A mesh of two million cells as text has a third of it.
pub const LARGEST: u64 = 1 << 30;
/// Of a case or a plan. Ten thousand bodies of a hundred vertices have a third of it.
pub const LARGEST_CASE: u64 = 1 << 26;

/// All bytes of a file that a case or a plan names.
///
/// # Errors
/// Those of the system; what is no file, as a folder, a device or a pipe; more than 1 GiB.
pub fn read_named(path: &Path) -> Result<Vec<u8>> {
    if !path.metadata()?.is_file() {
        return Err(Error::other("it is no file"));
    }
    read_at_most(path, LARGEST)
}

/// All bytes of what a user names, which may be a pipe: `riprap check <(program)`.
///
/// # Errors
/// Those of the system; more than `most` bytes.
pub fn read_at_most(path: &Path, most: u64) -> Result<Vec<u8>> {
    let file = File::open(path)?;
    let too_large = || Error::other(format!("it has more than {} MiB", most >> 20));
    // A file says so beforehand.
    if file.metadata()?.len() > most {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    file.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most { Err(too_large()) } else { Ok(bytes) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_longer_is_not_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x");
        std::fs::write(&path, [1; 1000]).expect("written");
        assert_eq!(read_named(&path).expect("bytes").len(), 1000);
        assert_eq!(read_at_most(&path, 1000).expect("bytes").len(), 1000);
        assert!(read_at_most(&path, 999).is_err());
        // Its size takes no room on the disk.
        File::create(&path).and_then(|file| file.set_len(LARGEST + 1)).expect("a large file");
        assert!(read_named(&path).is_err_and(|e| e.to_string().contains("1024 MiB")));
        assert!(read_named(folder.path()).is_err_and(|e| e.to_string().contains("no file")));
    }

    #[cfg(unix)]
    #[test]
    fn devices_end() {
        let zero = Path::new("/dev/zero");
        assert!(read_named(zero).is_err_and(|e| e.to_string().contains("no file")));
        assert!(read_at_most(zero, 5000).is_err_and(|e| e.to_string().contains("more than")));
        assert!(read_at_most(Path::new("/dev/null"), 10).is_ok_and(|bytes| bytes.is_empty()));
    }
}
