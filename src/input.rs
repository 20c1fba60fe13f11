//! Files that others made, read whole: what a case or a plan names is a file, and none is larger than this program has use for.
//!
//! Tables come in the encoding of whoever saved them: [`text_of`].
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

/// The text of a table as a spreadsheet saves it: UTF-8; UTF-16, which its first bytes say; else the code page of Chinese Windows (GB 18030) or that of western
/// Europe (Windows-1252), whichever the bytes look like.
pub fn text_of(bytes: &[u8]) -> String {
    let encoding = match encoding_rs::Encoding::for_bom(bytes) {
        Some((encoding, _)) => encoding,
        None if std::str::from_utf8(bytes).is_ok() => encoding_rs::UTF_8,
        None if is_chinese(bytes) => encoding_rs::GB18030,
        None => encoding_rs::WINDOWS_1252,
    };
    encoding.decode(bytes).0.into_owned()
}

/// The text of a table, as [`text_of`].
///
/// # Errors
/// What is no text, as a spreadsheet's own file, which is a ZIP archive or has zeros in it.
pub fn table_of(bytes: &[u8]) -> std::result::Result<String, &'static str> {
    let text = text_of(bytes);
    match text.starts_with("PK\u{3}\u{4}") || text.contains('\0') {
        true => Err("is no text; a spreadsheet has to be saved as CSV"),
        false => Ok(text),
    }
}

/// Whether bytes beyond ASCII stand in pairs, most of them punctuation or common characters (rows 1 to 9 and 16 to 55 of GB 2312): there Windows-1252
/// has signs and capital letters, its small ones behind.
fn is_chinese(bytes: &[u8]) -> bool {
    let (mut pairs, mut common) = (0, 0);
    for run in bytes.split(u8::is_ascii).filter(|run| !run.is_empty()) {
        if run.len() % 2 == 1 {
            return false;
        }
        pairs += run.len() / 2;
        common += run
            .chunks(2)
            .filter(|pair| matches!(pair[0], 0xa1..=0xa9 | 0xb0..=0xd7) && pair[1] >= 0xa1)
            .count();
    }
    2 * common > pairs
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

    #[test]
    fn tables_are_read_in_the_encoding_of_their_country() {
        let (german, chinese) =
            ("Siebgröße (mm);Durchgang (%)\nØ 60 µm³;100 °C", "粒径(mm),小于某粒径质量百分数(%)\n60,100");
        for text in [german, chinese] {
            assert_eq!(text_of(text.as_bytes()), text);
            assert_eq!(text_of(&[b"\xef\xbb\xbf", text.as_bytes()].concat()), text);
            let wide = |order: fn(u16) -> [u8; 2]| -> Vec<u8> {
                "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(order).collect()
            };
            assert_eq!(text_of(&wide(u16::to_le_bytes)), text);
            assert_eq!(text_of(&wide(u16::to_be_bytes)), text);
            assert_eq!(table_of(&wide(u16::to_le_bytes)).as_deref(), Ok(text));
        }
        for own in [&b"PK\x03\x04xlsx"[..], b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1\0\0xls"] {
            assert!(table_of(own).is_err_and(|problem| problem.contains("saved as CSV")));
        }
        assert_eq!(text_of(&encoding_rs::WINDOWS_1252.encode(german).0), german);
        assert_eq!(text_of(&encoding_rs::GB18030.encode(chinese).0), chinese);
        // A word of two such letters next to each other, and no other.
        assert_eq!(text_of(b"Gr\xf6\xdfe [mm]"), "Größe [mm]");
        assert_eq!(text_of(b"\xd6\xe1\xcf\xf2\xd3\xa6\xb1\xe4/%"), "轴向应变/%");
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
