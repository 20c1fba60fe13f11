//! Unstructured grids of VTK (`.vtu`), their numbers as text, binary in place, or appended, plain or zlib-compressed.
//!
//! Source: VTK file formats (Kitware), "XML file formats". An array in place is base64: its header and its bytes; appended ones lie behind `_` at the
//! `offset` of their tag, raw or base64. The header is the number of bytes; of compressed data the number of blocks, their size, that of the
//! last (0: whole), and the compressed size of each. It is UInt32 unless the file says UInt64.

use std::io::Read as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use crate::tensor::Vec3;

type Read<T> = std::result::Result<T, String>;

/// Points, and cells by VTK type and numbers of their points.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cells {
    pub points: Vec<Vec3>,
    pub cells: Vec<(u32, Vec<usize>)>,
}

/// What all arrays of a file have in common.
struct File<'a> {
    bytes: &'a [u8],
    big: bool,
    /// Bytes of a number in a header.
    header: usize,
    compressed: bool,
    /// Where appended data begin, and whether they are base64.
    appended: Option<(usize, bool)>,
}

/// An unstructured grid in any encoding.
pub fn vtu(bytes: &[u8]) -> Read<Cells> {
    let (file, head) = File::open(bytes)?;
    let section = |name: &str| -> Read<&str> {
        let missing = || format!("has no whole section {name}");
        let from = head.find(&format!("<{name}")).ok_or_else(missing)?;
        let to = head[from..].find(&format!("</{name}>")).ok_or_else(missing)?;
        Ok(&head[from..from + to])
    };
    let pieces = head.matches("<Piece").count();
    if pieces != 1 {
        return Err(format!("has {pieces} pieces; save it as one"));
    }
    let coordinates = file.array(section("Points")?, None)?;
    if !coordinates.len().is_multiple_of(3) {
        return Err(format!("Points holds {} numbers, not three a point", coordinates.len()));
    }
    let whole = |name: &str| -> Read<Vec<usize>> {
        // What is no number of a point becomes one that names none, and is refused as such.
        let number =
            |x: f64| if (0.0..1e15).contains(&x) && x.fract() == 0.0 { x as usize } else { usize::MAX };
        Ok(file.array(section("Cells")?, Some(name))?.into_iter().map(number).collect())
    };
    let (connectivity, offsets, types) = (whole("connectivity")?, whole("offsets")?, whole("types")?);
    if offsets.len() != types.len() {
        return Err(format!("{} offsets and {} types", offsets.len(), types.len()));
    }
    let mut cells = Vec::new();
    let mut first = 0;
    for (index, (last, kind)) in offsets.into_iter().zip(types).enumerate() {
        let nodes = connectivity.get(first..last).ok_or_else(|| {
            format!("cell {index}: its offsets {first}..{last} do not fit the connectivity")
        })?;
        cells.push((u32::try_from(kind).unwrap_or(u32::MAX), nodes.to_vec()));
        first = last;
    }
    let points = coordinates.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect();
    Ok(Cells { points, cells })
}

impl<'a> File<'a> {
    /// The file and its tags, those before any raw bytes.
    fn open(bytes: &'a [u8]) -> Read<(Self, String)> {
        let mark = b"<AppendedData";
        let tail = bytes.windows(mark.len()).position(|w| w == mark);
        let head = without_comments(&String::from_utf8_lossy(&bytes[..tail.unwrap_or(bytes.len())]));
        let opening = head.find("<VTKFile").ok_or("is not a VTK XML file (no VTKFile tag)")?;
        let tag = &head[opening..opening + head[opening..].find('>').ok_or("is cut off in its first tag")?];
        match attribute(tag, "type") {
            Some("UnstructuredGrid") => {}
            other => {
                return Err(format!("is a VTK file of type {:?}, not UnstructuredGrid", other.unwrap_or("")));
            }
        }
        let compressed = match attribute(tag, "compressor") {
            None => false,
            Some("vtkZLibDataCompressor") => true,
            Some(other) => {
                return Err(format!("is compressed by {other}; save it with zlib or uncompressed"));
            }
        };
        let header = if attribute(tag, "header_type") == Some("UInt64") { 8 } else { 4 };
        let big = attribute(tag, "byte_order") == Some("BigEndian");
        let appended = tail
            .map(|tail| {
                let behind =
                    |from: usize, mark: u8| bytes[from..].iter().position(|c| *c == mark).map(|at| from + at);
                let close = behind(tail, b'>').ok_or("is cut off in its appended data")?;
                let is_base64 =
                    attribute(&String::from_utf8_lossy(&bytes[tail..close]), "encoding") == Some("base64");
                Ok::<_, String>((
                    behind(close, b'_').ok_or("has no _ before its appended data")? + 1,
                    is_base64,
                ))
            })
            .transpose()?;
        Ok((File { bytes, big, header, compressed, appended }, head))
    }

    /// The numbers of the array of this name in a section, or of its first.
    fn array(&self, section: &str, name: Option<&str>) -> Read<Vec<f64>> {
        let what = name.map_or("Points".to_string(), |name| format!("Cells/{name}"));
        let mut tags = section.match_indices("<DataArray").map(|(at, _)| &section[at..]);
        let found = tags.find(|rest| {
            let tag = &rest[..rest.find('>').unwrap_or(rest.len())];
            name.is_none_or(|name| attribute(tag, "Name") == Some(name))
        });
        let rest = found.ok_or_else(|| format!("has no {what}"))?;
        let close = rest.find('>').ok_or_else(|| format!("{what}: its tag is not closed"))?;
        let (tag, inside) = (&rest[..close], &rest[close + 1..]);
        let text = &inside[..inside.find('<').unwrap_or(inside.len())];
        let kind = attribute(tag, "type").unwrap_or("");
        let bytes = match attribute(tag, "format") {
            Some("ascii") | None => {
                let number =
                    |word: &str| word.parse().map_err(|_| format!("{what}: {word:?} is not a number"));
                return text.split_ascii_whitespace().map(number).collect();
            }
            Some("binary") => self.decoded(text.trim().as_bytes(), true),
            Some("appended") => {
                let offset: Option<usize> = attribute(tag, "offset").and_then(|offset| offset.parse().ok());
                let (start, is_base64) =
                    self.appended.ok_or_else(|| format!("{what}: there are no appended data"))?;
                let from = offset.and_then(|offset| self.bytes.get(start.checked_add(offset)?..));
                self.decoded(
                    from.ok_or_else(|| format!("{what}: its offset is behind the end of the file"))?,
                    is_base64,
                )
            }
            Some(other) => Err(format!("has the format {other:?}")),
        };
        self.numbers(&bytes.map_err(|problem| format!("{what}: {problem}"))?, kind)
            .map_err(|problem| format!("{what}: {problem}"))
    }

    /// The bytes of an array from its header on.
    fn decoded(&self, data: &[u8], is_base64: bool) -> Read<Vec<u8>> {
        let few = "the data are cut off";
        // A header stands by itself in base64, padded: this many digits for so many bytes.
        let take = |from: usize, count: usize| -> Read<(Vec<u8>, usize)> {
            let length = if is_base64 { count.div_ceil(3) * 4 } else { count };
            let end = from.checked_add(length).ok_or(few)?;
            let piece = data.get(from..end).ok_or(few)?;
            let mut bytes = match is_base64 {
                true => STANDARD.decode(piece).map_err(|e| format!("is no base64: {e}"))?,
                false => piece.to_vec(),
            };
            bytes.truncate(count);
            if bytes.len() < count { Err(few.into()) } else { Ok((bytes, end)) }
        };
        let number = |bytes: &[u8], at: usize| -> usize {
            let field = &bytes[at * self.header..(at + 1) * self.header];
            let digit = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
            let value =
                if self.big { field.iter().fold(0, digit) } else { field.iter().rev().fold(0, digit) };
            usize::try_from(value).unwrap_or(usize::MAX)
        };
        let (first, behind) = take(0, self.header)?;
        if !self.compressed {
            let count = number(&first, 0);
            // In base64 an uncompressed array and its header are one text.
            let all = self.header.checked_add(count).ok_or(few)?;
            return match is_base64 {
                true => Ok(take(0, all)?.0.split_off(self.header)),
                false => Ok(take(behind, count)?.0),
            };
        }
        let blocks = number(&first, 0);
        if blocks > data.len() {
            return Err(few.into());
        }
        let (header, start) = take(0, (3 + blocks) * self.header)?;
        let sizes: Vec<usize> = (0..blocks).map(|block| number(&header, 3 + block)).collect();
        let total = sizes.iter().try_fold(0_usize, |sum, size| sum.checked_add(*size)).ok_or(few)?;
        let (packed, _) = take(start, total)?;
        let (mut bytes, mut from) = (Vec::new(), 0);
        for size in sizes {
            let block = &packed[from..from + size];
            flate2::read::ZlibDecoder::new(block)
                .read_to_end(&mut bytes)
                .map_err(|e| format!("cannot be unpacked: {e}"))?;
            from += size;
        }
        Ok(bytes)
    }

    fn numbers(&self, bytes: &[u8], kind: &str) -> Read<Vec<f64>> {
        let size = match kind {
            "Int8" | "UInt8" => 1,
            "Int16" | "UInt16" => 2,
            "Int32" | "UInt32" | "Float32" => 4,
            "Int64" | "UInt64" | "Float64" => 8,
            other => return Err(format!("has numbers of the kind {other:?}")),
        };
        let number = |field: &[u8]| {
            let mut least = [0_u8; 8];
            least[..size].copy_from_slice(field);
            if self.big {
                least[..size].reverse();
            }
            let word = u64::from_le_bytes(least);
            match kind {
                "Float32" => f64::from(f32::from_bits(word as u32)),
                "Float64" => f64::from_bits(word),
                "Int8" => f64::from(word as u8 as i8),
                "Int16" => f64::from(word as u16 as i16),
                "Int32" => f64::from(word as u32 as i32),
                "Int64" => word as i64 as f64,
                _ => word as f64,
            }
        };
        Ok(bytes.chunks_exact(size).map(number).collect())
    }
}

/// XML without its comments, which may hold tags.
fn without_comments(text: &str) -> String {
    let mut parts = text.split("<!--");
    let first = parts.next().unwrap_or_default().to_string();
    parts.fold(first, |kept, part| kept + part.split_once("-->").map_or("", |(_, behind)| behind))
}

/// The value of `name="value"` in a tag.
fn attribute<'t>(tag: &'t str, name: &str) -> Option<&'t str> {
    let mut rest = tag;
    while let Some(at) = rest.find(name) {
        let (before, behind) = (&rest[..at], rest[at + name.len()..].trim_start());
        rest = &rest[at + name.len()..];
        if !before.ends_with(char::is_whitespace) {
            continue;
        }
        let Some(value) = behind.strip_prefix('=').map(str::trim_start) else { continue };
        let quote = value.chars().next().filter(|c| *c == '"' || *c == '\'')?;
        return value[1..].find(quote).map(|end| &value[1..1 + end]);
    }
    None
}
