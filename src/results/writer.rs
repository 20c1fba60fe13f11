//! Writes a results file as a run goes on.

use std::path::{Path, PathBuf};

use hdf5::file::{CacheDecreaseMode, CacheIncreaseMode, FileAccess, FlashIncreaseMode};
use hdf5::{Dataset, File};

use crate::error::{Error, Result};

use super::bodies::{BODY_QUANTITIES, BodyRow};
use super::fields::{FieldMesh, FieldState};
use super::grains::{GRAIN_QUANTITIES, GrainRow};
use super::history::{HISTORY, HistoryRow, Value};
use super::journal;
use super::lock::Lock;
use super::reader::{Reader, Restart};
use super::record::{COMMIT, CaseRecord, Outcome, VERSION, host};
use super::store::{Growing, Layout, Store, explain, failure};
use super::table::{Column, ColumnData};
use super::vtkhdf::VtkHdf;

/// Rows of a chunk of `/history`: a column's chunk is 4 KiB.
const HISTORY_ROWS: usize = 512;
/// Bytes of a chunk of a restart slot.
const RESTART_CHUNK: usize = 1 << 20;
/// The two restart slots, written in turn, so that one of them is always whole.
pub(super) const RESTART_SLOTS: [&str; 2] = ["restart/a", "restart/b"];

/// What to do where the results file exists already.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    Refuse,
    Replace,
}

/// A results file being written. What is appended becomes part of the file at the next [`Writer::commit`],
/// all of it or nothing. Dropping a writer does not commit.
pub struct Writer {
    store: Store,
    history: Vec<Growing>,
    bodies: Vec<Vec<Growing>>,
    fields: Option<VtkHdf>,
    grains: Vec<Growing>,
    status: Dataset,
    rows: usize,
    restarts: usize,
    /// Datasets that are written whole and not changed afterwards.
    fixed: Vec<Dataset>,
    /// Where raw data lie that no later flush changes: sorted, disjoint (offset, length).
    fixed_extents: Vec<(u64, u64)>,
    fixed_changed: bool,
    committed_length: u64,
    /// Last, so that the file is closed before it is released.
    _lock: Lock,
}

impl Writer {
    /// Makes a new file, complete but empty. It appears under its name only when it is valid, and an
    /// existing one is replaced only then. Errors: it exists (and is not to be replaced), is in use, or
    /// cannot be written.
    pub fn create(path: &Path, case: &CaseRecord, existing: Existing) -> Result<Self> {
        if path.exists() {
            if existing == Existing::Refuse {
                return Err(failure(path, "/", "exists already; give --force to replace it"));
            }
            Lock::for_writing(path)?;
        }
        if let Some(parent) = path.parent().filter(|parent| !parent.as_os_str().is_empty()) {
            std::fs::create_dir_all(parent).map_err(|e| Error::io("create", parent, e))?;
        }
        let unfinished = unfinished_name(path);
        let lock = Lock::for_writing(&unfinished)?;
        let made = access().and_then(|access| {
            let mut options = File::with_options();
            options.set_access_plist(&access)?.create(&unfinished)
        });
        let file = made.map_err(|e| failure(path, "/", explain(&e)))?;
        let store = Store { file, path: unfinished.clone() };
        let mut writer = Self::lay_out(store, lock, case)?;
        writer.commit()?;
        std::fs::rename(&unfinished, path).map_err(|e| Error::io("create", path, e))?;
        writer.store.path = path.to_path_buf();
        // Of a file that was replaced.
        journal::discard(path)?;
        Ok(writer)
    }

    fn lay_out(store: Store, lock: Lock, case: &CaseRecord) -> Result<Self> {
        store.group("case")?;
        for (name, value) in [
            ("title", case.title.as_str()),
            ("given", &case.given),
            ("completed", &case.completed),
            ("version", VERSION),
            ("commit", COMMIT),
            ("host", &host()),
            ("stages", &case.stages.join("\n")),
        ] {
            store.text(&format!("case/{name}"), value)?;
        }
        store.scalar("case/seed", case.seed)?;
        store.scalar("case/threads", case.threads)?;
        let status = store.text("status", Outcome::Running.as_str())?;
        store.text_attribute(&status, "reason", "")?;
        store.number_attribute(&status, "last_good_increment", 0_u64)?;
        store.group("history")?;
        let mut history = Vec::new();
        for quantity in HISTORY {
            let name = format!("history/{}", quantity.name);
            let layout = Layout::Rows(HISTORY_ROWS);
            let column = match quantity.integer {
                true => store.growing::<i64>(&name, &[], layout)?,
                false => store.growing::<f64>(&name, &[], layout)?,
            };
            store.describe(&column.dataset, quantity.units, quantity.long_name)?;
            history.push(column);
        }
        Ok(Self::over(store, lock, history, status))
    }

    fn over(store: Store, lock: Lock, history: Vec<Growing>, status: Dataset) -> Self {
        Writer {
            store,
            history,
            bodies: Vec::new(),
            fields: None,
            grains: Vec::new(),
            status,
            rows: 0,
            restarts: 0,
            fixed: Vec::new(),
            fixed_extents: Vec::new(),
            fixed_changed: false,
            committed_length: 0,
            _lock: lock,
        }
    }

    /// Opens a file to continue it after its last restart point: rows and states behind that point are
    /// dropped, the status is `running` again. Returns the restart point too; errors if there is none.
    pub fn resume(path: &Path) -> Result<(Self, Restart)> {
        if !path.exists() {
            return Err(failure(path, "/", "no such file"));
        }
        let lock = Lock::for_writing(path)?;
        journal::recover_locked(path, &lock)?;
        let restart = Reader::of_owner(path)?
            .restart()?
            .ok_or_else(|| failure(path, "restart", "has no restart point to resume from"))?;
        let opened = access().and_then(|access| {
            let mut options = File::with_options();
            options.set_access_plist(&access)?.open_rw(path)
        });
        let file = opened.map_err(|e| failure(path, "/", explain(&e)))?;
        let store = Store { file, path: path.to_path_buf() };
        let status = store.open("status")?;
        let mut history = Vec::new();
        for quantity in HISTORY {
            history.push(store.grown(&format!("history/{}", quantity.name))?);
        }
        let mut writer = Self::over(store, lock, history, status);
        writer.committed_length = writer.length_on_disk()?;
        writer.rows = restart.rows;
        writer.restarts = restart.written;
        writer.drop_after(&restart)?;
        writer.set_status(Outcome::Running, "", restart.increment)?;
        // By itself, so that space freed here is not written to before the file has forgotten it.
        writer.commit()?;
        Ok((writer, restart))
    }

    fn drop_after(&mut self, restart: &Restart) -> Result<()> {
        for column in &self.history {
            if column.rows() < restart.rows {
                return Err(self.store.fail(&column.name, "is shorter than the restart point says"));
            }
            column.resize(&self.store, restart.rows)?;
        }
        if self.store.file.link_exists("bodies") {
            let names = self.store.hdf5("bodies", self.store.group("bodies")?.member_names())?;
            for body in names {
                let mut columns = Vec::new();
                for quantity in &BODY_QUANTITIES {
                    let column = self.store.grown(&format!("bodies/{body}/{}", quantity.name))?;
                    column.resize(&self.store, restart.rows)?;
                    columns.push(column);
                }
                self.bodies.push(columns);
            }
        }
        if self.store.file.link_exists("VTKHDF") {
            self.fields = Some(VtkHdf::resume(&self.store, restart.states)?);
        }
        if self.store.file.link_exists("grains/position") {
            for quantity in &GRAIN_QUANTITIES {
                let column = self.store.grown(&format!("grains/{}", quantity.name))?;
                column.resize(&self.store, restart.states)?;
                self.grains.push(column);
            }
        }
        if self.store.file.link_exists("contacts") {
            let contacts = self.store.group("contacts")?;
            for name in self.store.hdf5("contacts", contacts.member_names())? {
                if name.parse::<usize>().is_ok_and(|state| state >= restart.states) {
                    self.store.hdf5(&format!("contacts/{name}"), contacts.unlink(&name))?;
                }
            }
        }
        Ok(())
    }

    /// Writes the mesh of the saved states; once, before the first of them.
    pub fn write_mesh(&mut self, mesh: &FieldMesh) -> Result<()> {
        if self.fields.is_some() {
            return Err(self.store.fail("VTKHDF", "the mesh has been written already"));
        }
        let (fields, fixed) = VtkHdf::create(&self.store, mesh)?;
        self.fields = Some(fields);
        self.fixed.extend(fixed);
        self.fixed_changed = true;
        Ok(())
    }

    /// Writes a table whose columns are equally long, e.g. `grains`, `contacts/0` or `breakage`.
    pub fn write_table(&mut self, group: &str, columns: &[Column]) -> Result<()> {
        self.store.group(group)?;
        let rows = columns.first().map_or(0, Column::rows);
        for column in columns {
            let name = format!("{group}/{}", column.name);
            if column.rows() != rows {
                return Err(self.store.fail(&name, format!("has {} rows, not {rows}", column.rows())));
            }
            let dataset = match &column.data {
                ColumnData::Floats(values) => self.store.whole(&name, values, &[])?,
                ColumnData::Integers(values) => self.store.whole(&name, values, &[])?,
                ColumnData::Vectors(values) => self.store.whole(&name, values.as_flattened(), &[3])?,
            };
            self.store.describe(&dataset, &column.units, &column.long_name)?;
            self.fixed.push(dataset);
        }
        self.fixed_changed = true;
        Ok(())
    }

    /// Makes `/bodies/<name>` for the bodies of a scene; rows then come with [`Writer::append`].
    pub fn add_bodies(&mut self, names: &[&str]) -> Result<()> {
        for name in names {
            if name.is_empty() || name.contains('/') || *name == "." {
                return Err(self.store.fail("bodies", format!("a body cannot be named {name:?}")));
            }
            let mut columns = Vec::new();
            for quantity in &BODY_QUANTITIES {
                let path = format!("bodies/{name}/{}", quantity.name);
                let column = self.store.growing::<f64>(&path, &[3], Layout::Rows(HISTORY_ROWS / 2))?;
                self.store.describe(&column.dataset, quantity.units, quantity.long_name)?;
                columns.push(column);
            }
            self.bodies.push(columns);
        }
        Ok(())
    }

    /// Appends an accepted increment; `bodies` in the order of [`Writer::add_bodies`], empty for a specimen.
    pub fn append(&mut self, row: &HistoryRow, bodies: &[BodyRow]) -> Result<()> {
        if bodies.len() != self.bodies.len() {
            let message = format!("{} rows for {} bodies", bodies.len(), self.bodies.len());
            return Err(self.store.fail("bodies", message));
        }
        for (column, value) in self.history.iter().zip(row.values()) {
            match value {
                Value::Float(value) => column.put(&self.store, self.rows, &[value])?,
                Value::Integer(value) => column.put(&self.store, self.rows, &[value])?,
            }
        }
        for (columns, body) in self.bodies.iter().zip(bodies) {
            for (column, vector) in columns.iter().zip(body.vectors()) {
                column.put(&self.store, self.rows, vector.as_slice())?;
            }
        }
        self.rows += 1;
        let increment = u64::try_from(row.increment).unwrap_or(0);
        self.store.number_attribute(&self.status, "last_good_increment", increment)
    }

    /// Appends a state of the fields; returns its number, which also names `/contacts/<state>`.
    pub fn save_state(&mut self, state: &FieldState<'_>) -> Result<usize> {
        let Some(fields) = &mut self.fields else {
            return Err(self.store.fail("VTKHDF", "the mesh has not been written yet"));
        };
        self.fixed_changed = true;
        fields.save(&self.store, state)
    }

    /// Appends a state of the grains, to go with the last [`Writer::save_state`].
    pub fn save_grains(&mut self, grains: &[GrainRow]) -> Result<()> {
        if self.grains.is_empty() {
            for quantity in &GRAIN_QUANTITIES {
                let name = format!("grains/{}", quantity.name);
                let layout = Layout::Blocks { rows: 1 };
                let column = match (quantity.name, quantity.integer) {
                    ("position" | "rotation", _) => {
                        self.store.growing::<f64>(&name, &[grains.len(), 3], layout)?
                    }
                    (_, true) => self.store.growing::<i64>(&name, &[grains.len()], layout)?,
                    (_, false) => self.store.growing::<f64>(&name, &[grains.len()], layout)?,
                };
                self.store.describe(&column.dataset, quantity.units, quantity.long_name)?;
                self.grains.push(column);
            }
        }
        let [position, rotation, damage_mean, damage_max, failed_fraction, fragments] = &self.grains[..]
        else {
            return Err(self.store.fail("grains", "is incomplete"));
        };
        let vectors = |of: fn(&GrainRow) -> [f64; 3]| -> Vec<f64> { grains.iter().flat_map(of).collect() };
        let numbers = |of: fn(&GrainRow) -> f64| -> Vec<f64> { grains.iter().map(of).collect() };
        position.append(&self.store, &vectors(|g| g.position.into()))?;
        rotation.append(&self.store, &vectors(|g| g.rotation.into()))?;
        damage_mean.append(&self.store, &numbers(|g| g.damage_mean))?;
        damage_max.append(&self.store, &numbers(|g| g.damage_max))?;
        failed_fraction.append(&self.store, &numbers(|g| g.failed_fraction))?;
        let counts: Vec<i64> = grains.iter().map(|g| g.fragments).collect();
        fragments.append(&self.store, &counts)?;
        self.fixed_changed = true;
        Ok(())
    }

    /// Stores what a run needs to continue from here; [`Writer::resume`] returns the bytes as they are.
    pub fn save_restart(&mut self, increment: u64, bytes: &[u8]) -> Result<()> {
        let name = RESTART_SLOTS[self.restarts % 2];
        let slot = match self.store.file.link_exists(name) {
            true => self.store.grown(name)?,
            false => self.store.growing::<u8>(name, &[], Layout::Rows(RESTART_CHUNK))?,
        };
        slot.put(&self.store, 0, bytes)?;
        let states = self.fields.as_ref().map_or(0, VtkHdf::states);
        self.restarts += 1;
        for (attribute, value) in [
            ("increment", increment),
            ("rows", self.rows as u64),
            ("states", states as u64),
            ("written", self.restarts as u64),
            ("crc32", u64::from(journal::crc32(bytes))),
        ] {
            self.store.number_attribute(&slot.dataset, attribute, value)?;
        }
        self.fixed_changed = true;
        Ok(())
    }

    /// Makes all that was appended since the last commit part of the file.
    pub fn commit(&mut self) -> Result<()> {
        if self.committed_length > 0 {
            journal::write(&self.store.path, self.committed_length, &self.fixed_extents)?;
        }
        self.store.hdf5("/", self.store.file.flush())?;
        if self.fixed_changed || self.committed_length == 0 {
            self.fixed_extents = self.gather_fixed()?;
            self.fixed_changed = false;
        }
        self.committed_length = self.length_on_disk()?;
        journal::discard(&self.store.path)
    }

    /// Notes how the run ended, and commits. The writer can then be dropped.
    pub fn finish(&mut self, outcome: Outcome, reason: &str, last_good_increment: u64) -> Result<()> {
        self.set_status(outcome, reason, last_good_increment)?;
        self.commit()
    }

    pub fn path(&self) -> &Path {
        &self.store.path
    }

    fn set_status(&self, outcome: Outcome, reason: &str, increment: u64) -> Result<()> {
        let text = self.store.unicode("status", outcome.as_str())?;
        self.store.hdf5("status", self.status.write_scalar(&text))?;
        self.store.text_attribute(&self.status, "reason", reason)?;
        self.store.number_attribute(&self.status, "last_good_increment", increment)
    }

    fn gather_fixed(&self) -> Result<Vec<(u64, u64)>> {
        let mut extents = Vec::new();
        for dataset in &self.fixed {
            self.store.raw_extents(dataset, &mut extents)?;
        }
        if let Some(fields) = &self.fields {
            for dataset in fields.block_datasets(&self.store)? {
                self.store.raw_extents(&dataset, &mut extents)?;
            }
        }
        for column in &self.grains {
            self.store.raw_extents(&column.dataset, &mut extents)?;
        }
        for name in RESTART_SLOTS {
            if self.store.file.link_exists(name) {
                self.store.raw_extents(&self.store.open(name)?, &mut extents)?;
            }
        }
        extents.sort_unstable();
        Ok(extents)
    }

    fn length_on_disk(&self) -> Result<u64> {
        let found =
            std::fs::metadata(&self.store.path).map_err(|e| Error::io("read", &self.store.path, e))?;
        Ok(found.len())
    }
}

/// How the file is opened: without HDF5's own lock (see `lock`), and with its metadata held in memory from one flush to the next, so
/// that the file on disk changes only where the journal expects it.
fn access() -> hdf5::Result<FileAccess> {
    let mut cache = FileAccess::try_new()?.get_mdc_config()?;
    cache.evictions_enabled = false;
    cache.incr_mode = CacheIncreaseMode::Off;
    cache.flash_incr_mode = FlashIncreaseMode::Off;
    cache.decr_mode = CacheDecreaseMode::Off;
    FileAccess::build().libver_v18().file_locking(false).mdc_config(&cache).finish()
}

fn unfinished_name(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_os_string();
    name.push(".new");
    PathBuf::from(name)
}
