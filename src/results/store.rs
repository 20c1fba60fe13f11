//! The thin layer over HDF5: datasets that grow by rows, texts and attributes, each failure named by
//! its dataset. The only user of the hdf5 crate's builders.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use hdf5::dataset::Layout as Storage;
use hdf5::types::VarLenUnicode;
use hdf5::{
    Dataset, Extent, Extents, File, Group, H5Type, Hyperslab, Location, MinorErrorCode, SliceOrIndex,
};
use ndarray::{ArrayViewD, IxDyn};

use crate::error::{Error, Result};

use super::checksum::crc32;
use super::history::{Quantity, Value};

/// Uncompressed bytes of a chunk of the large arrays: big enough to compress well, small enough to read alone.
const CHUNK_BYTES: usize = 1 << 20;
const DEFLATE_LEVEL: u8 = 4;
/// Up to so many bytes stand in the header of their dataset, with its checksum.
const COMPACT_BYTES: usize = 1024;

/// An HDF5 file and its name.
///
/// HDF5 keeps what it is given, and writes some of it when a handle is dropped, where nobody hears of an error. So here nothing is left to
/// such a moment: large values are written at once ([`Store::whole`]); small ones are metadata, and rows wait in the cache of
/// a [`Growing`] that stays open, until the file is flushed.
pub(super) struct Store {
    /// `None` once it is closed.
    pub open: Option<File>,
    pub path: PathBuf,
}

/// How a dataset is laid out on disk.
#[derive(Debug, Clone, Copy)]
pub(super) enum Layout {
    /// Rows come one by one: chunks of so many rows, not compressed, with a checksum that every row changes: written at a flush.
    Rows(usize),
    /// Overwritten as a whole, in chunks of so many rows, in place; has a checksum of its own beside it.
    Slot(usize),
    /// Blocks of `rows` rows come whole: every block starts on a chunk of its own, so that no chunk is
    /// ever written twice; shuffled and deflated, with a checksum.
    Blocks { rows: usize },
}

/// A dataset that grows along its first axis.
#[derive(Debug)]
pub(super) struct Growing {
    pub dataset: Dataset,
    pub name: String,
    /// The other axes.
    width: Vec<usize>,
}

impl Store {
    pub fn fail(&self, dataset: &str, message: impl Display) -> Error {
        failure(&self.path, dataset, message)
    }

    pub fn hdf5<T>(&self, dataset: &str, result: hdf5::Result<T>) -> Result<T> {
        result.map_err(|e| self.fail(dataset, explain(&e)))
    }

    pub fn file(&self) -> Result<&File> {
        self.open.as_ref().ok_or_else(|| self.fail("/", "is closed: its run has ended"))
    }

    /// Whether there is such a group or dataset, in a group that is there.
    pub fn has(&self, name: &str) -> Result<bool> {
        Ok(self.file()?.link_exists(name))
    }

    pub fn group(&self, name: &str) -> Result<Group> {
        let group = match self.has(name)? {
            true => self.file()?.group(name),
            false => self.file()?.create_group(name),
        };
        self.hdf5(name, group)
    }

    pub fn unlink(&self, name: &str) -> Result<()> {
        self.hdf5(name, self.file()?.unlink(name))
    }

    pub fn open(&self, name: &str) -> Result<Dataset> {
        self.hdf5(name, self.file()?.dataset(name))
    }

    /// Closes the file, all of whose datasets must be dropped. Errors where HDF5 had something left to write and could not.
    pub fn close(&mut self) -> Result<()> {
        match self.open.take() {
            Some(file) => self.hdf5("/", file.close()),
            None => Ok(()),
        }
    }

    /// Writes a text as a new scalar dataset.
    pub fn text(&self, name: &str, value: &str) -> Result<Dataset> {
        let made =
            self.file()?.new_dataset::<VarLenUnicode>().layout(Storage::Compact).shape(()).create(name);
        let dataset = self.hdf5(name, made)?;
        self.rewrite(&dataset, name, value)?;
        Ok(dataset)
    }

    /// Changes a text, and the checksum beside it: HDF5 has none for texts.
    pub fn rewrite(&self, dataset: &Dataset, name: &str, value: &str) -> Result<()> {
        let text = self.unicode(name, value)?;
        self.hdf5(name, dataset.write_scalar(&text))?;
        self.number_attribute(dataset, "crc32", u64::from(crc32(text.as_bytes())))
    }

    pub fn unicode(&self, name: &str, value: &str) -> Result<VarLenUnicode> {
        // HDF5 texts end at the first NUL.
        value.replace('\0', "\u{fffd}").parse().map_err(|e| self.fail(name, format!("not a text: {e:?}")))
    }

    pub fn scalar<T: H5Type>(&self, name: &str, value: T) -> Result<Dataset> {
        let made = self.file()?.new_dataset::<T>().layout(Storage::Compact).shape(()).create(name);
        let dataset = self.hdf5(name, made)?;
        self.hdf5(name, dataset.write_scalar(&value))?;
        Ok(dataset)
    }

    /// Sets a number attribute, in place where it is there already.
    pub fn number_attribute<T: H5Type>(&self, on: &Location, name: &str, value: T) -> Result<()> {
        let place = format!("{}@{name}", on.name());
        let attribute = match has_attribute(on, name) {
            true => on.attr(name),
            false => on.new_attr::<T>().shape(()).create(name),
        };
        let attribute = self.hdf5(&place, attribute)?;
        self.hdf5(&place, attribute.write_scalar(&value))
    }

    /// Sets a text attribute; readers see a variable-length UTF-8 string.
    pub fn text_attribute(&self, on: &Location, name: &str, value: &str) -> Result<()> {
        let place = format!("{}@{name}", on.name());
        let text = self.unicode(&place, value)?;
        if has_attribute(on, name) {
            self.hdf5(&place, on.delete_attr(name))?;
        }
        let attribute = self.hdf5(&place, on.new_attr::<VarLenUnicode>().shape(()).create(name))?;
        self.hdf5(&place, attribute.write_scalar(&text))
    }

    pub fn describe(&self, on: &Location, units: &str, long_name: &str) -> Result<()> {
        self.text_attribute(on, "units", units)?;
        self.text_attribute(on, "long_name", long_name)
    }

    /// Writes a new dataset whole. `width` gives the axes after the first.
    pub fn whole<T: H5Type>(&self, name: &str, values: &[T], width: &[usize]) -> Result<Dataset> {
        let per_row = row_length(width);
        let rows = values.len() / per_row;
        let mut shape = vec![rows];
        shape.extend_from_slice(width);
        let mut builder = self.file()?.new_dataset_builder();
        let bytes = std::mem::size_of_val(values);
        if bytes > COMPACT_BYTES {
            let mut chunk = shape.clone();
            chunk[0] = chunk_rows(rows, per_row * std::mem::size_of::<T>());
            // Without a cache, so that it is written now, and an error is heard of.
            builder = builder.chunk(chunk).chunk_cache(0, 0, 0.0);
            // Compression of a few values costs more than it saves.
            if bytes > 4096 {
                builder = builder.shuffle().deflate(DEFLATE_LEVEL);
            }
            builder = builder.fletcher32();
        } else if bytes > 0 {
            builder = builder.layout(Storage::Compact);
        }
        let dataset = self.hdf5(name, builder.empty::<T>().shape(shape.as_slice()).create(name))?;
        if rows > 0 {
            let view = view(values, &shape).ok_or_else(|| self.fail(name, "values do not fill its rows"))?;
            self.hdf5(name, dataset.write(view))?;
        }
        Ok(dataset)
    }

    /// Makes an empty dataset that grows by rows.
    pub fn growing<T: H5Type>(&self, name: &str, width: &[usize], layout: Layout) -> Result<Growing> {
        let mut extents = vec![Extent::resizable(0)];
        extents.extend(width.iter().map(|&n| Extent::fixed(n)));
        let rows = match layout {
            Layout::Rows(rows) | Layout::Slot(rows) => rows,
            Layout::Blocks { rows } => chunk_rows(rows, row_length(width) * std::mem::size_of::<T>()),
        };
        let mut chunk = vec![rows];
        chunk.extend_from_slice(width);
        let mut builder = self.file()?.new_dataset_builder().chunk(chunk);
        builder = match layout {
            Layout::Blocks { .. } => builder.shuffle().deflate(DEFLATE_LEVEL).fletcher32(),
            Layout::Rows(_) => builder.fletcher32(),
            Layout::Slot(_) => builder,
        };
        let made = builder.empty::<T>().shape(Extents::from(extents)).create(name);
        Ok(Growing { dataset: self.hdf5(name, made)?, name: name.to_string(), width: width.to_vec() })
    }

    /// As [`Store::growing`], of the values of each quantity in `group`, in each row those of so many `items`, with what they are.
    pub fn columns(
        &self,
        group: &str,
        quantities: &[Quantity],
        items: Option<usize>,
        layout: Layout,
    ) -> Result<Vec<Growing>> {
        let column = |quantity: &Quantity| -> Result<Growing> {
            let name = format!("{group}/{}", quantity.name);
            let width = (quantity.width > 1).then_some(quantity.width);
            let width: Vec<usize> = items.into_iter().chain(width).collect();
            let column = match quantity.integer {
                true => self.growing::<i64>(&name, &width, layout)?,
                false => self.growing::<f64>(&name, &width, layout)?,
            };
            self.describe(&column.dataset, quantity.units, quantity.long_name)?;
            Ok(column)
        };
        quantities.iter().map(column).collect()
    }

    /// Opens what [`Store::columns`] made.
    pub fn grown_columns(&self, group: &str, quantities: &[Quantity]) -> Result<Vec<Growing>> {
        quantities.iter().map(|quantity| self.grown(&format!("{group}/{}", quantity.name))).collect()
    }

    /// Writes the numbers of `items` into columns of theirs, at row `start`.
    pub fn put_values(
        &self,
        columns: &[Growing],
        quantities: &[Quantity],
        start: usize,
        items: &[Vec<Value>],
    ) -> Result<()> {
        let mut at = 0;
        for (column, quantity) in columns.iter().zip(quantities) {
            let (mut floats, mut integers) = (Vec::new(), Vec::new());
            for value in items.iter().flat_map(|values| &values[at..at + quantity.width]) {
                match *value {
                    Value::Float(value) => floats.push(value),
                    Value::Integer(value) => integers.push(value),
                }
            }
            match quantity.integer {
                true => column.put(self, start, &integers)?,
                false => column.put(self, start, &floats)?,
            }
            at += quantity.width;
        }
        Ok(())
    }

    /// Opens a dataset that [`Store::growing`] made.
    pub fn grown(&self, name: &str) -> Result<Growing> {
        let dataset = self.open(name)?;
        let shape = dataset.shape();
        let width = shape.get(1..).ok_or_else(|| self.fail(name, "is not a table"))?.to_vec();
        Ok(Growing { dataset, name: name.to_string(), width })
    }

    /// Where the raw values of a dataset lie in the file: (offset, length) [bytes].
    pub fn raw_extents(&self, dataset: &Dataset, extents: &mut Vec<(u64, u64)>) -> Result<()> {
        if dataset.is_chunked() {
            let seen = dataset.chunks_visit(|chunk| {
                extents.push((chunk.addr, chunk.size));
                0
            });
            return self.hdf5(&dataset.name(), seen);
        }
        if let Some(offset) = dataset.offset() {
            extents.push((offset, dataset.storage_size()));
        }
        Ok(())
    }
}

impl Growing {
    pub fn rows(&self) -> usize {
        self.dataset.shape().first().copied().unwrap_or(0)
    }

    /// Writes rows from row `start` on, which must not be before the end.
    pub fn put<T: H5Type>(&self, store: &Store, start: usize, values: &[T]) -> Result<()> {
        let rows = values.len() / row_length(&self.width);
        let mut shape = vec![rows];
        shape.extend_from_slice(&self.width);
        let view =
            view(values, &shape).ok_or_else(|| store.fail(&self.name, "values do not fill its rows"))?;
        self.resize(store, start + rows)?;
        if rows == 0 {
            return Ok(());
        }
        let mut selection = vec![SliceOrIndex::from(start..start + rows)];
        selection.extend(self.width.iter().map(|&n| SliceOrIndex::from(0..n)));
        store.hdf5(&self.name, self.dataset.write_slice(view, Hyperslab::from(selection)))
    }

    pub fn resize(&self, store: &Store, rows: usize) -> Result<()> {
        let mut shape = vec![rows];
        shape.extend_from_slice(&self.width);
        store.hdf5(&self.name, self.dataset.resize(shape))
    }
}

/// Rows from the start of one block to the start of the next: a whole number of chunks.
pub(super) fn block_stride(rows: usize, row_bytes: usize) -> usize {
    let chunk = chunk_rows(rows, row_bytes);
    rows.max(1).div_ceil(chunk) * chunk
}

/// Rows of a chunk, so that whole chunks just cover `rows`.
fn chunk_rows(rows: usize, row_bytes: usize) -> usize {
    let rows = rows.max(1);
    let chunks = (rows * row_bytes).div_ceil(CHUNK_BYTES).clamp(1, rows);
    rows.div_ceil(chunks)
}

fn row_length(width: &[usize]) -> usize {
    width.iter().product::<usize>().max(1)
}

fn view<'a, T>(values: &'a [T], shape: &[usize]) -> Option<ArrayViewD<'a, T>> {
    ArrayViewD::from_shape(IxDyn(shape), values).ok()
}

fn has_attribute(on: &Location, name: &str) -> bool {
    on.attr_names().is_ok_and(|names| names.iter().any(|n| n == name))
}

pub(super) fn failure(path: &Path, dataset: &str, message: impl Display) -> Error {
    Error::Results { file: path.to_path_buf(), dataset: dataset.to_string(), message: message.to_string() }
}

/// HDF5's reason, in the user's words where it is a common one.
pub(super) fn explain(error: &hdf5::Error) -> String {
    let frames: Vec<String> = match error.stack() {
        Some(stack) => stack.iter().map(|frame| frame.desc().to_string()).collect(),
        None => vec![error.to_string()],
    };
    let innermost = frames.last().cloned().unwrap_or_else(|| error.to_string());
    let all = frames.join("; ");
    for (mark, meaning) in [
        ("No space left", "no space left on the device"),
        ("File too large", "the file may not grow further (file size limit)"),
        ("quota", "disk quota exceeded"),
        ("Permission denied", "permission denied"),
        ("No such file", "no such file or directory"),
    ] {
        if all.contains(mark) {
            return meaning.to_string();
        }
    }
    if is_locked(error) {
        return "in use by another process (it is locked); wait for that run to end".to_string();
    }
    if error.contains_minor(MinorErrorCode::NotHdf5) {
        return "not an HDF5 file, or damaged at its start".to_string();
    }
    if all.contains("checksum") || all.contains("Fletcher32") {
        return "is damaged (its checksum is wrong)".to_string();
    }
    if all.contains("truncated file") {
        return "damaged: shorter than it should be".to_string();
    }
    innermost
}

/// Whether another process holds the file's lock.
fn is_locked(error: &hdf5::Error) -> bool {
    error.contains_minor(MinorErrorCode::CantLockFile)
        || error
            .stack()
            .is_some_and(|stack| stack.iter().any(|frame| frame.desc().contains("unable to lock file")))
}
