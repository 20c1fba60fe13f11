//! Reads a results file whole and checks it: `riprap info --verify`, and every run before it calls its file finished.
//!
//! Large values carry a Fletcher32 checksum each chunk, headers HDF5's own, texts and restart points a CRC-32. A file that
//! its run has closed has one more over all its bytes, in the [head](super::head).

use hdf5::types::TypeDescriptor;
use hdf5::{Dataset, Hyperslab, SliceOrIndex};
use ndarray::IxDyn;
use serde::Serialize;

use crate::error::{Error, Result};

use super::head::{Head, checksum};
use super::reader::Reader;
use super::store::failure;

/// Values that are read at a time.
const PIECE: usize = 1 << 20;

/// What was read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Verified {
    pub datasets: usize,
    /// Of the values, as read.
    pub bytes: u64,
    /// Whether the whole file had a checksum, which its run wrote when it closed it.
    pub whole: bool,
}

impl Reader {
    /// Reads everything in the file.
    ///
    /// # Errors
    /// The first dataset that is damaged or does not belong there; a file that differs from what its run closed.
    pub fn verify(&self) -> Result<Verified> {
        let mut verified = Verified::default();
        let mut waiting = self.members("/")?;
        while let Some(name) = waiting.pop() {
            if self.is_group(&name) {
                waiting.extend(self.members(&name)?.into_iter().map(|member| format!("{name}/{member}")));
                continue;
            }
            let dataset = self.dataset(&name)?;
            verified.datasets += 1;
            verified.bytes += self.read_all(&name, &dataset)?;
            for attribute in self.named(&name, dataset.attr_names())? {
                self.named(&name, dataset.attr(&attribute))?;
            }
        }
        self.verify_rows()?;
        self.status()?;
        // One of the slots is whole; the other is overwritten in place, and a kill may leave it half written.
        self.restart()?;
        self.origin()?;
        self.consolidated()?;
        if let Some(expected) = self.closed_with()? {
            let found = self.on_file(checksum)?;
            if found != expected {
                let message = "is not as its run closed it: some bytes were changed since";
                return Err(failure(self.path(), "/", message));
            }
            verified.whole = true;
        }
        Ok(verified)
    }

    /// All columns of the history, and of the bodies, have as many rows as increments were committed.
    fn verify_rows(&self) -> Result<()> {
        let rows = self.increments()?;
        let mut columns: Vec<String> =
            self.members("history")?.into_iter().map(|name| format!("history/{name}")).collect();
        for body in self.members("bodies")? {
            let body = format!("bodies/{body}");
            columns.extend(self.members(&body)?.into_iter().map(|name| format!("{body}/{name}")));
        }
        for name in columns {
            let found = self.shape(&name)?.first().copied().unwrap_or(0);
            if found != rows {
                return Err(failure(self.path(), &name, format!("has {found} rows, others have {rows}")));
            }
        }
        Ok(())
    }

    /// Reads a dataset, some rows at a time; tells how many bytes that were.
    fn read_all(&self, name: &str, dataset: &Dataset) -> Result<u64> {
        let shape = dataset.shape();
        if shape.is_empty() {
            let kind = self.named(name, dataset.dtype().and_then(|kind| kind.to_descriptor()))?;
            if kind == TypeDescriptor::VarLenUnicode {
                return Ok(self.text(name)?.len() as u64);
            }
            self.named(name, dataset.read_raw::<f64>())?;
            return Ok(8);
        }
        let row: usize = shape[1..].iter().product::<usize>().max(1);
        let piece = (PIECE / row).max(1);
        for start in (0..shape[0]).step_by(piece) {
            let mut selection = vec![SliceOrIndex::from(start..shape[0].min(start + piece))];
            selection.extend(shape[1..].iter().map(|&n| SliceOrIndex::from(0..n)));
            self.named(name, dataset.read_slice::<f64, _, IxDyn>(Hyperslab::from(selection)))?;
        }
        Ok(8 * dataset.size() as u64)
    }

    /// The checksum over the whole file, where its run closed it and nobody has gone on from there.
    fn closed_with(&self) -> Result<Option<u32>> {
        let file = std::fs::File::open(self.path()).map_err(|e| Error::io("open", self.path(), e))?;
        Ok(Head::read(&file, self.path())?.filter(|_| !self.is_live()).and_then(|head| head.checksum))
    }

    fn on_file<T>(&self, read: impl FnOnce(&std::fs::File) -> std::io::Result<T>) -> Result<T> {
        let file = std::fs::File::open(self.path());
        file.and_then(|file| read(&file)).map_err(|e| Error::io("read", self.path(), e))
    }
}
