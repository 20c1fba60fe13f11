//! Reads a results file: finished, killed, or still being written.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;

use hdf5::file::FileAccess;
use hdf5::types::{FloatSize, IntSize, TypeDescriptor, VarLenUnicode};
use hdf5::{Dataset, File, Hyperslab, SliceOrIndex};
use ndarray::IxDyn;

use crate::error::{Error, Result};

use super::checksum::crc32;
use super::head::{FORMAT, Head};
use super::history::{HISTORY, Quantity};
use super::inspect::inspect;
use super::journal::{self, Needed};
use super::lock::{Access, Lock};
use super::record::{CONSOLIDATED, ORIGIN, Outcome, RESTART_SLOTS, Status};
use super::store::{explain, failure};

/// How often, and after what pause, a file in the middle of a live commit is looked at again.
const ATTEMPTS: usize = 100;
const PAUSE: Duration = Duration::from_millis(10);

/// A point from which a run can continue.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Restart {
    pub increment: u64,
    /// Rows of `/history` up to that point.
    pub rows: usize,
    /// Saved states up to that point.
    pub states: usize,
    /// Restart points written so far, this one included.
    pub written: usize,
    /// What [`super::Writer::save_restart`] was given.
    pub bytes: Vec<u8>,
    /// Slots that hold a restart point which is not whole, each with what is wrong: a newer one is lost
    /// where this is not empty.
    pub damaged: Vec<String>,
}

/// How the numbers of a dataset are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NumberKind {
    Float32,
    Float64,
    UInt8,
    Int32,
    Int64,
}

impl NumberKind {
    /// Bytes of one number.
    pub fn bytes(self) -> usize {
        match self {
            NumberKind::UInt8 => 1,
            NumberKind::Float32 | NumberKind::Int32 => 4,
            NumberKind::Float64 | NumberKind::Int64 => 8,
        }
    }

    /// VTK's word for it.
    pub fn vtk_name(self) -> &'static str {
        match self {
            NumberKind::Float32 => "Float32",
            NumberKind::Float64 => "Float64",
            NumberKind::UInt8 => "UInt8",
            NumberKind::Int32 => "Int32",
            NumberKind::Int64 => "Int64",
        }
    }
}

/// An open results file.
pub struct Reader {
    file: File,
    path: PathBuf,
    live: bool,
    _lock: Option<Lock>,
}

impl Reader {
    /// Opens a file. One that a killed process left in the middle of a commit is put back to its last
    /// commit first; one that is still being written is read as of its last commit. Errors: no results file, or one
    /// with anything in it that riprap never writes.
    pub fn open(path: &Path) -> Result<Self> {
        // The journal lies beside the file itself, not beside links to it.
        let Ok(real) = std::fs::canonicalize(path) else {
            return Err(failure(path, "/", "no such file"));
        };
        // A commit of a live writer takes milliseconds; try again between two.
        let mut last = failure(path, "/", "is being written to all the time; try again");
        for _ in 0..ATTEMPTS {
            let lock = Lock::acquire(&real, Access::Read)?;
            let unlocked = lock.as_ref().is_some_and(|lock| !lock.is_held());
            if let Some(lock) = lock.filter(Lock::is_held) {
                if journal::needed(&lock.file, &real)? == Needed::Nothing {
                    let (path, file) = (path.to_path_buf(), open(&real)?);
                    return Ok(Reader { file, path, live: false, _lock: Some(lock) });
                }
                drop(lock);
                if let Some(lock) = Lock::acquire(&real, Access::Write)? {
                    journal::recover(&lock.file, &real)?;
                }
                continue;
            }
            let head = || -> Result<Option<Head>> {
                let file = std::fs::File::open(&real).map_err(|e| Error::io("open", path, e))?;
                Head::read(&file, path)
            };
            let before = head()?;
            if unlocked && before.as_ref().is_some_and(|head| head.under_way.is_some()) {
                // Its writer may be within this commit, and would not survive that it is put back.
                let message = "is within a commit, and without riprap's file locks nothing says whether its run lives; if it was killed, \
                    `riprap run --resume` puts the file back";
                last = failure(path, "/", message);
            }
            if before.as_ref().is_none_or(|head| head.under_way.is_none()) {
                match open(&real) {
                    // Read between two commits.
                    Ok(file) if head()? == before => {
                        return Ok(Reader { file, path: path.to_path_buf(), live: !unlocked, _lock: None });
                    }
                    Ok(_) => {}
                    Err(error) => last = error,
                }
            }
            sleep(PAUSE);
        }
        Err(last)
    }

    /// For one who has the file locked already.
    pub(super) fn of_owner(path: &Path) -> Result<Self> {
        Ok(Reader { file: open(path)?, path: path.to_path_buf(), live: false, _lock: None })
    }

    /// For the one who writes the file, to see what is there. By another driver of HDF5, which would show what it has in memory
    /// if it knew that both are one file.
    pub(super) fn read_back(path: &Path) -> Result<Self> {
        let access = FileAccess::build().stdio().file_locking(false).finish();
        let file = opened(path, access)?;
        Ok(Reader { file, path: path.to_path_buf(), live: false, _lock: None })
    }

    /// Whether another process was writing the file when it was opened.
    pub fn is_live(&self) -> bool {
        self.live
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the file has this group or dataset, e.g. `VTKHDF` or `history/axial_strain`.
    pub fn has(&self, name: &str) -> bool {
        // `link_exists` of a path fails where a group on the way is missing, which is a no too.
        let mut path = String::new();
        name.split('/').filter(|part| !part.is_empty()).all(|part| {
            path.push('/');
            path.push_str(part);
            self.file.link_exists(&path)
        })
    }

    pub(super) fn is_group(&self, name: &str) -> bool {
        self.file.group(name).is_ok()
    }

    /// All numbers of a dataset as floats, row after row.
    pub fn floats(&self, name: &str) -> Result<Vec<f64>> {
        let dataset = self.dataset(name)?;
        self.named(name, dataset.read_raw::<f64>())
    }

    /// So many rows of a dataset from row `start` on, as floats.
    pub fn floats_in(&self, name: &str, start: usize, rows: usize) -> Result<Vec<f64>> {
        let dataset = self.dataset(name)?;
        let shape = dataset.shape();
        if shape.first().is_none_or(|&all| start.checked_add(rows).is_none_or(|end| end > all)) {
            let message = format!("has no rows {start} to {start} + {rows}");
            return Err(failure(&self.path, name, message));
        }
        let mut selection = vec![SliceOrIndex::from(start..start + rows)];
        selection.extend(shape[1..].iter().map(|&n| SliceOrIndex::from(0..n)));
        let read = dataset.read_slice::<f64, _, IxDyn>(Hyperslab::from(selection));
        Ok(self.named(name, read)?.iter().copied().collect())
    }

    /// How a dataset's numbers are stored.
    pub fn number_kind(&self, name: &str) -> Result<NumberKind> {
        let kind = self.dataset(name)?.dtype().and_then(|kind| kind.to_descriptor());
        match self.named(name, kind)? {
            TypeDescriptor::Float(FloatSize::U4) => Ok(NumberKind::Float32),
            TypeDescriptor::Float(FloatSize::U8) => Ok(NumberKind::Float64),
            TypeDescriptor::Unsigned(IntSize::U1) => Ok(NumberKind::UInt8),
            TypeDescriptor::Integer(IntSize::U4) => Ok(NumberKind::Int32),
            TypeDescriptor::Integer(IntSize::U8) => Ok(NumberKind::Int64),
            other => Err(failure(&self.path, name, format!("is of a kind that is not exported: {other}"))),
        }
    }

    /// All numbers of a dataset as integers, row after row.
    pub fn integers(&self, name: &str) -> Result<Vec<i64>> {
        let dataset = self.dataset(name)?;
        self.named(name, dataset.read_raw::<i64>())
    }

    /// The case's seed, which may be larger than any signed integer.
    pub fn seed(&self) -> Result<u64> {
        let seed = self.dataset("case/seed")?;
        self.named("case/seed", seed.read_scalar::<u64>())
    }

    /// The axes of a dataset.
    pub fn shape(&self, name: &str) -> Result<Vec<usize>> {
        Ok(self.dataset(name)?.shape())
    }

    /// A scalar text.
    pub fn text(&self, name: &str) -> Result<String> {
        let dataset = self.dataset(name)?;
        let text = self.named(name, dataset.read_scalar::<VarLenUnicode>())?;
        // Earlier versions had none.
        let has_checksum = self.named(name, dataset.attr_names())?.iter().any(|name| name == "crc32");
        if has_checksum && self.count_attribute(name, "crc32")? != u64::from(crc32(text.as_bytes())) {
            return Err(failure(&self.path, name, "is damaged (its checksum is wrong)"));
        }
        Ok(readable(&text))
    }

    /// A text attribute.
    pub fn text_attribute(&self, name: &str, attribute: &str) -> Result<String> {
        let place = format!("{name}@{attribute}");
        let found = self.named(&place, self.dataset(name)?.attr(attribute))?;
        Ok(readable(&self.named(&place, found.read_scalar::<VarLenUnicode>())?))
    }

    /// Names in a group, in alphabetical order; none where there is no such group.
    pub fn members(&self, group: &str) -> Result<Vec<String>> {
        if !self.has(group) {
            return Ok(Vec::new());
        }
        let members = self.file.group(group).and_then(|group| group.member_names());
        self.named(group, members)
    }

    /// Names of a scene's bodies in the order of their numbers; none of a specimen.
    pub fn body_order(&self) -> Result<Vec<String>> {
        if !self.has("bodies") {
            return Ok(Vec::new());
        }
        let order = self.file.group("bodies").and_then(|group| group.attr("order"));
        let order = order.and_then(|order| order.read_scalar::<VarLenUnicode>());
        Ok(readable(&self.named("bodies@order", order)?).lines().map(str::to_string).collect())
    }

    /// The columns of `/history` that the file has: all but those that came after the version that wrote it.
    pub fn columns(&self) -> impl Iterator<Item = &'static Quantity> {
        HISTORY.iter().filter(|quantity| self.has(&column(quantity.name)))
    }

    /// Rows of `/history`: those that every column has.
    pub fn increments(&self) -> Result<usize> {
        let mut rows = self.dataset(&column(HISTORY[0].name))?.size();
        for quantity in self.columns() {
            rows = rows.min(self.dataset(&column(quantity.name))?.size());
        }
        Ok(rows)
    }

    /// A column of `/history`. One that an older version did not write is not a number in every row.
    pub fn history(&self, name: &str) -> Result<Vec<f64>> {
        let known = HISTORY.iter().any(|quantity| quantity.name == name);
        if known && !self.has(&column(name)) {
            return Ok(vec![f64::NAN; self.increments()?]);
        }
        self.floats(&column(name))
    }

    pub fn status(&self) -> Result<Status> {
        let text = self.text("status")?;
        let outcome = Outcome::parse(&text)
            .ok_or_else(|| failure(&self.path, "status", format!("says {text:?}, which is no status")))?;
        Ok(Status {
            outcome,
            reason: self.text_attribute("status", "reason")?,
            last_good_increment: self.count_attribute("status", "last_good_increment")?,
        })
    }

    /// The last whole restart point; `None` where none was ever written. Errors where there are some and none is whole.
    pub fn restart(&self) -> Result<Option<Restart>> {
        let mut newest: Option<Restart> = None;
        let mut damaged = Vec::new();
        for name in RESTART_SLOTS {
            if !self.has(name) {
                continue;
            }
            match self.restart_in(name) {
                Ok(found) => {
                    if newest.as_ref().is_none_or(|newest| newest.written < found.written) {
                        newest = Some(found);
                    }
                }
                Err(Error::Results { message, .. }) => damaged.push(format!("{name} {message}")),
                Err(error) => return Err(error),
            }
        }
        match newest {
            Some(restart) => Ok(Some(Restart { damaged, ..restart })),
            None if damaged.is_empty() => Ok(None),
            None => {
                let message = format!("no restart point is whole ({})", damaged.join("; "));
                Err(failure(&self.path, "restart", message))
            }
        }
    }

    fn restart_in(&self, name: &str) -> Result<Restart> {
        let count = |attribute| self.count_attribute(name, attribute);
        Ok(Restart {
            bytes: self.checked_bytes(name)?,
            increment: count("increment")?,
            rows: count("rows")? as usize,
            states: count("states")? as usize,
            written: count("written")? as usize,
            damaged: Vec::new(),
        })
    }

    /// What [`super::Writer::save_origin`] was given; `None` where there is none.
    pub fn origin(&self) -> Result<Option<Vec<u8>>> {
        self.has(ORIGIN).then(|| self.checked_bytes(ORIGIN)).transpose()
    }

    /// What [`super::Writer::save_consolidated`] was given; `None` where there is none.
    pub fn consolidated(&self) -> Result<Option<Vec<u8>>> {
        self.has(CONSOLIDATED).then(|| self.checked_bytes(CONSOLIDATED)).transpose()
    }

    /// Bytes with a checksum beside them.
    fn checked_bytes(&self, name: &str) -> Result<Vec<u8>> {
        let bytes = self.named(name, self.dataset(name)?.read_raw::<u8>())?;
        match self.count_attribute(name, "crc32")? == u64::from(crc32(&bytes)) {
            true => Ok(bytes),
            false => Err(failure(&self.path, name, "is damaged (its checksum is wrong)")),
        }
    }

    /// Bytes that a dataset takes in the file.
    pub(super) fn stored_bytes(&self, name: &str) -> Result<u64> {
        Ok(self.dataset(name)?.storage_size())
    }

    fn count_attribute(&self, name: &str, attribute: &str) -> Result<u64> {
        let place = format!("{name}@{attribute}");
        let found = self.named(&place, self.dataset(name)?.attr(attribute))?;
        self.named(&place, found.read_scalar::<u64>())
    }

    pub(super) fn dataset(&self, name: &str) -> Result<Dataset> {
        if !self.has(name) {
            return Err(failure(&self.path, name, "is missing; is this a results file of riprap?"));
        }
        let dataset = self.named(name, self.file.dataset(name))?;
        if self.named(name, has_all_chunks(&dataset))? {
            return Ok(dataset);
        }
        Err(failure(&self.path, name, "has lost values: its index is damaged"))
    }

    pub(super) fn named<T>(&self, name: &str, result: hdf5::Result<T>) -> Result<T> {
        result.map_err(|e| failure(&self.path, name, explain(&e)))
    }
}

/// Whether a dataset's index has every chunk in its place. The index has no checksum, and values of a chunk that it does not name are read as zeros.
fn has_all_chunks(dataset: &Dataset) -> hdf5::Result<bool> {
    let (shape, Some(chunk)) = (dataset.shape(), dataset.chunk()) else { return Ok(true) };
    let all: usize = shape.iter().zip(&chunk).map(|(rows, chunk)| rows.div_ceil(*chunk)).product();
    let mut places = BTreeSet::new();
    dataset.chunks_visit(|found| {
        let mut along = found.offset.iter().zip(&chunk).zip(&shape);
        let is_place = along.all(|((at, chunk), rows)| at % *chunk as u64 == 0 && *at < *rows as u64);
        if is_place {
            places.insert(found.offset.to_vec());
        }
        0
    })?;
    Ok(places.len() == all)
}

/// The dataset of a column of `/history`.
fn column(name: &str) -> String {
    format!("history/{name}")
}

/// A text of the file, which may be damaged or a stranger's: what is no UTF-8, or no character of XML (and so of SVG, HTML and .vtu),
/// is shown as U+FFFD.
fn readable(text: &VarLenUnicode) -> String {
    let text = String::from_utf8_lossy(text.as_bytes());
    let forbidden = |c: char| {
        (c < ' ' && !['\n', '\t', '\r'].contains(&c))
            || matches!(c, '\u{7f}'..='\u{9f}' | '\u{fffe}' | '\u{ffff}')
    };
    text.replace(forbidden, "\u{fffd}")
}

fn open(path: &Path) -> Result<File> {
    opened(path, FileAccess::build().file_locking(false).finish())
}

fn opened(path: &Path, access: hdf5::Result<FileAccess>) -> Result<File> {
    let opened = access.and_then(|access| {
        let mut options = File::with_options();
        options.set_access_plist(&access)?.open(path)
    });
    let file = opened.map_err(|e| failure(path, "/", explain(&e)))?;
    inspect(&file, path)?;
    check_format(path, &file)?;
    Ok(file)
}

/// Refuses files of a later layout. Those of the first versions have no number.
fn check_format(path: &Path, file: &File) -> Result<()> {
    let Ok(attribute) = file.attr("format_version") else { return Ok(()) };
    let found = attribute.read_scalar::<u64>();
    match found.map_err(|e| failure(path, "/@format_version", explain(&e)))? {
        found if found > u64::from(FORMAT) => {
            let problem = format!("is {found}, written by a later riprap; this one reads up to {FORMAT}");
            Err(failure(path, "/@format_version", problem))
        }
        _ => Ok(()),
    }
}
