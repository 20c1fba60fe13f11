//! Writes a results file as a run goes on.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use hdf5::file::{CacheDecreaseMode, CacheIncreaseMode, FileAccess, FlashIncreaseMode};
use hdf5::types::VarLenUnicode;
use hdf5::{Dataset, File};

use crate::error::{Error, Result};

use super::bodies::{BODY_QUANTITIES, BodyRow};
use super::fields::{FieldMesh, FieldState};
use super::grains::{GRAIN_QUANTITIES, GrainRow};
use super::history::{HISTORY, HistoryRow, Value};
use super::journal;
use super::lock::Lock;
use super::record::{COMMIT, CaseRecord, FORMAT_VERSION, Outcome, VERSION, host};
use super::store::{Growing, Layout, Store, explain, failure};
use super::table::{Column, ColumnData};
use super::vtkhdf::VtkHdf;

/// Rows of a chunk of `/history`: a column's chunk is 4 KiB.
const HISTORY_ROWS: usize = 512;
/// Fewest and most bytes of a chunk of a restart slot.
const RESTART_CHUNK: [usize; 2] = [1 << 12, 1 << 20];
/// A commit waits for the disk where the time since the last one is so many times what waiting took last.
const SYNC_FACTOR: u32 = 50;
/// The two restart slots, written in turn, so that one of them is always whole.
pub(super) const RESTART_SLOTS: [&str; 2] = ["restart/a", "restart/b"];
/// What all restart points have in common.
pub(super) const ORIGIN: &str = "restart/origin";
/// The state that other runs can start from.
pub(super) const CONSOLIDATED: &str = "restart/consolidated";

/// What to do where the results file exists already.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    Refuse,
    Replace,
    /// Continue its run; begin one where there is nothing to continue.
    Continue,
}

/// What `/status` has in every file; the rest is the dossier of a run that stopped.
const STATUS_ATTRIBUTES: [&str; 2] = ["reason", "last_good_increment"];

/// A results file being written. What is appended becomes part of the file at the next [`Writer::commit`],
/// all of it or nothing. Dropping a writer does not commit.
pub struct Writer {
    pub(super) store: Store,
    pub(super) history: Vec<Growing>,
    pub(super) bodies: Vec<Vec<Growing>>,
    /// Not written yet.
    mesh: Option<FieldMesh>,
    pub(super) fields: Option<VtkHdf>,
    pub(super) grains: Vec<Growing>,
    /// Numbers of the saved states: the scale of the first axis of `grains`.
    pub(super) grain_states: Option<Growing>,
    status: Dataset,
    pub(super) rows: usize,
    pub(super) restarts: usize,
    /// Datasets that are written whole and not changed afterwards.
    pub(super) fixed: Vec<Dataset>,
    /// Where raw data lie that no later flush changes: sorted, disjoint (offset, length).
    pub(super) fixed_extents: Vec<(u64, u64)>,
    fixed_changed: bool,
    pub(super) committed_length: u64,
    /// Whether anything was changed since the last commit.
    pub(super) dirty: bool,
    /// Whether the next commit has to survive a loss of power.
    durable: bool,
    /// When the last commit was done, and what the last one that waited for the disk took longer for it.
    committed: Instant,
    sync_cost: Duration,
    /// Behind all that keeps the file open, so that it acts on the closed file.
    undo: journal::Undo,
    /// Last, so that the file is closed before it is released.
    _lock: Lock,
}

impl Writer {
    /// Makes a new file, complete but empty. It appears under its name only when it is valid, and an
    /// existing one is replaced only then. Errors: it exists (and is not to be replaced), is in use, or
    /// cannot be written.
    pub fn create(path: &Path, case: &CaseRecord, existing: Existing) -> Result<Self> {
        if path.exists() {
            if existing != Existing::Replace {
                return Err(failure(path, "/", "exists already; give --force to replace it"));
            }
            Lock::for_writing(path)?;
        }
        if let Some(parent) = path.parent().filter(|parent| !parent.as_os_str().is_empty()) {
            std::fs::create_dir_all(parent).map_err(|e| Error::io("create", parent, e))?;
        }
        let unfinished = unfinished_name(path);
        let lock = Lock::for_writing(&unfinished)?;
        let begun = begin(&unfinished)
            .and_then(|file| {
                let store = Store { file, path: unfinished.clone() };
                let mut writer = Self::lay_out(store, lock, case)?;
                writer.commit()?;
                Ok(writer)
            })
            .and_then(|writer| match std::fs::rename(&unfinished, path) {
                Ok(()) => Ok(writer),
                Err(e) => Err(Error::io("create", path, e)),
            });
        let mut writer = match begun {
            Ok(writer) => writer,
            Err(error) => {
                // Best effort: the error that matters is the one returned.
                let _ = std::fs::remove_file(&unfinished);
                return Err(error);
            }
        };
        writer.store.path = path.to_path_buf();
        // Of a file that was replaced.
        journal::discard(path)?;
        Ok(writer)
    }

    fn lay_out(store: Store, lock: Lock, case: &CaseRecord) -> Result<Self> {
        let root = store.group("/")?;
        store.number_attribute(&root, "format_version", FORMAT_VERSION)?;
        for (name, value) in [
            ("format", "riprap results"),
            ("title", case.title.as_str()),
            ("riprap_version", VERSION),
            ("riprap_commit", COMMIT),
            ("units", "SI; in /history compression positive, in /VTKHDF tension positive"),
        ] {
            store.text_attribute(&root, name, value)?;
        }
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
            history.push(store.column("history", quantity, None, Layout::Rows(HISTORY_ROWS))?);
        }
        let increment = store.open("history/increment")?;
        store.make_scale(&increment, "increment")?;
        let others = history.iter().zip(HISTORY).filter(|(_, quantity)| quantity.name != "increment");
        store.measure_by(&[&increment], &others.map(|(column, _)| &column.dataset).collect::<Vec<_>>())?;
        Ok(Self::over(store, lock, history, status))
    }

    pub(super) fn over(store: Store, lock: Lock, history: Vec<Growing>, status: Dataset) -> Self {
        Writer {
            store,
            history,
            bodies: Vec::new(),
            mesh: None,
            fields: None,
            grains: Vec::new(),
            grain_states: None,
            status,
            rows: 0,
            restarts: 0,
            fixed: Vec::new(),
            fixed_extents: Vec::new(),
            fixed_changed: false,
            committed_length: 0,
            dirty: true,
            durable: true,
            committed: Instant::now(),
            sync_cost: Duration::ZERO,
            undo: journal::Undo::default(),
            _lock: lock,
        }
    }

    /// Gives the mesh of the saved states; before the first of them, and again after a resume. It is written with the
    /// first state, since VTK cannot read a temporal file of no steps.
    pub fn set_mesh(&mut self, mesh: FieldMesh) -> Result<()> {
        if let Some(fields) = &self.fields {
            return fields.check_mesh(&self.store, &mesh);
        }
        self.mesh = Some(mesh);
        Ok(())
    }

    /// Writes a table whose columns are equally long, e.g. `grains`, `contacts/0` or `breakage`.
    pub fn write_table(&mut self, group: &str, columns: &[Column]) -> Result<()> {
        self.dirty = true;
        self.store.group(group)?;
        let rows = columns.first().map_or(0, Column::rows);
        let mut written = Vec::new();
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
            written.push(dataset);
        }
        let item = match group {
            "grains" => Some("grain"),
            group if group.starts_with("contacts/") => Some("contact"),
            _ => None,
        };
        if let Some(item) = item.filter(|_| rows > 0) {
            self.scale_table(group, item, rows, &written)?;
        }
        self.fixed.extend(written);
        self.fixed_changed = true;
        Ok(())
    }

    /// Scales for the axes of a table that was just written: its rows, which are `item`s, and space.
    fn scale_table(&mut self, group: &str, item: &str, rows: usize, columns: &[Dataset]) -> Result<()> {
        let count = |name: &str, count: usize, what: &str| {
            self.store.count_scale(&format!("{group}/{name}"), count, what)
        };
        let items = count(item, rows, &format!("number of the {item}, counted from 0"))?;
        let axes = count("axis", 3, "axes of space: 0 x, 1 y, 2 z")?;
        self.store.measure_by(&[&items, &axes], &columns.iter().collect::<Vec<_>>())?;
        self.fixed.extend([items, axes]);
        Ok(())
    }

    /// Makes `/bodies/<name>` for the bodies of a scene; rows then come with [`Writer::append`], in the same order.
    /// Once, before the first row, and again (with the same names) after a resume.
    pub fn set_bodies(&mut self, names: &[&str]) -> Result<()> {
        if !self.bodies.is_empty() {
            return match self.body_names()? == names {
                true => Ok(()),
                false => Err(self.store.fail("bodies", "are not those of the run to continue")),
            };
        }
        self.dirty = true;
        for name in names {
            if name.is_empty() || name.contains(|c: char| c == '/' || c.is_control()) || *name == "." {
                return Err(self.store.fail("bodies", format!("a body cannot be named {name:?}")));
            }
            let mut columns = Vec::new();
            for quantity in &BODY_QUANTITIES {
                let (group, layout) = (format!("bodies/{name}"), Layout::Rows(HISTORY_ROWS / 2));
                columns.push(self.store.column(&group, quantity, None, layout)?);
            }
            self.bodies.push(columns);
        }
        if !names.is_empty() {
            self.store.text_attribute(&*self.store.group("bodies")?, "order", &names.join("\n"))?;
        }
        Ok(())
    }

    /// Names of the bodies in the order in which their rows come.
    pub(super) fn body_names(&self) -> Result<Vec<String>> {
        let group = self.store.group("bodies")?;
        let order = group.attr("order").and_then(|order| order.read_scalar::<VarLenUnicode>());
        let order = self.store.hdf5("bodies@order", order)?;
        Ok(String::from_utf8_lossy(order.as_bytes()).lines().map(str::to_string).collect())
    }

    /// Appends an accepted increment; `bodies` in the order of [`Writer::set_bodies`], empty for a specimen.
    pub fn append(&mut self, row: &HistoryRow, bodies: &[BodyRow]) -> Result<()> {
        self.dirty = true;
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
        self.dirty = true;
        self.fixed_changed = true;
        if let Some(mesh) = self.mesh.take() {
            let (fields, fixed) = VtkHdf::create(&self.store, &mesh)?;
            self.fields = Some(fields);
            self.fixed.extend(fixed);
        }
        let Some(fields) = &mut self.fields else {
            return Err(self.store.fail("VTKHDF", "no mesh has been set"));
        };
        fields.save(&self.store, state)
    }

    /// Appends a state of the grains, to go with the last [`Writer::save_state`].
    pub fn save_grains(&mut self, grains: &[GrainRow]) -> Result<()> {
        self.dirty = true;
        if self.grains.is_empty() {
            for quantity in &GRAIN_QUANTITIES {
                let layout = Layout::Blocks { rows: 1 };
                self.grains.push(self.store.column("grains", quantity, Some(grains.len()), layout)?);
            }
            self.scale_grains()?;
        }
        if let Some(states) = &self.grain_states {
            states.append(&self.store, &[states.rows() as i64])?;
        }
        let [
            position,
            rotation,
            stress,
            damage_mean,
            damage_max,
            failed_fraction,
            fragments,
            local_shear_strain,
            local_volumetric_strain,
            turn,
            level,
        ] = &self.grains[..]
        else {
            return Err(self.store.fail("grains", "is incomplete"));
        };
        let vectors = |of: fn(&GrainRow) -> [f64; 3]| -> Vec<f64> { grains.iter().flat_map(of).collect() };
        let numbers = |of: fn(&GrainRow) -> f64| -> Vec<f64> { grains.iter().map(of).collect() };
        position.append(&self.store, &vectors(|g| g.position.into()))?;
        rotation.append(&self.store, &vectors(|g| g.rotation.into()))?;
        stress.append(&self.store, &grains.iter().flat_map(|g| g.stress).collect::<Vec<f64>>())?;
        damage_mean.append(&self.store, &numbers(|g| g.damage_mean))?;
        damage_max.append(&self.store, &numbers(|g| g.damage_max))?;
        failed_fraction.append(&self.store, &numbers(|g| g.failed_fraction))?;
        let counts: Vec<i64> = grains.iter().map(|g| g.fragments).collect();
        fragments.append(&self.store, &counts)?;
        local_shear_strain.append(&self.store, &numbers(|g| g.local_shear_strain))?;
        local_volumetric_strain.append(&self.store, &numbers(|g| g.local_volumetric_strain))?;
        turn.append(&self.store, &numbers(|g| g.turn))?;
        level.append(&self.store, &grains.iter().map(|g| g.level).collect::<Vec<i64>>())?;
        self.fixed_changed = true;
        Ok(())
    }

    /// Scales for the axes of the datasets of `/grains` that grow with the saved states, where the table of grains has brought its own.
    fn scale_grains(&mut self) -> Result<()> {
        if !self.store.file.link_exists("grains/grain") {
            return Ok(());
        }
        let states = self.store.growing::<i64>("grains/state", &[], Layout::Rows(HISTORY_ROWS))?;
        self.store.describe(
            &states.dataset,
            "1",
            "number of the saved state, as in /VTKHDF and /contacts",
        )?;
        self.store.make_scale(&states.dataset, "state")?;
        let [grain, axis] = [self.store.open("grains/grain")?, self.store.open("grains/axis")?];
        let what = "components of a symmetric tensor: 0 xx, 1 yy, 2 zz, 3 xy, 4 yz, 5 xz";
        let component = self.store.count_scale("grains/component", 6, what)?;
        for (column, quantity) in self.grains.iter().zip(&GRAIN_QUANTITIES) {
            let last = if quantity.width == 6 { &component } else { &axis };
            self.store.measure_by(&[&states.dataset, &grain, last], &[&column.dataset])?;
        }
        self.fixed.push(component);
        self.grain_states = Some(states);
        Ok(())
    }

    /// Stores what all restart points have in common, once; [`super::Reader::origin`] returns the bytes as they are.
    pub fn save_origin(&mut self, bytes: &[u8]) -> Result<()> {
        self.save_checked(ORIGIN, bytes)
    }

    /// Stores the state at the end of the consolidation, which restart points do not touch; [`super::Reader::consolidated`]
    /// returns the bytes as they are. A continued run may come by a second time: what is there stays.
    pub fn save_consolidated(&mut self, bytes: &[u8]) -> Result<()> {
        if self.store.file.link_exists("restart") && self.store.file.link_exists(CONSOLIDATED) {
            return Ok(());
        }
        self.durable = true;
        self.save_checked(CONSOLIDATED, bytes)
    }

    /// Writes bytes once, with a checksum beside them.
    fn save_checked(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        self.dirty = true;
        self.store.group("restart")?;
        let dataset = self.store.whole(name, bytes, &[])?;
        self.store.number_attribute(&dataset, "crc32", u64::from(journal::crc32(bytes)))?;
        self.fixed.push(dataset);
        self.fixed_changed = true;
        Ok(())
    }

    /// Stores what a run needs to continue from here; [`Writer::resume`] returns the bytes as they are. The commit
    /// that follows survives a loss of power too.
    pub fn save_restart(&mut self, increment: u64, bytes: &[u8]) -> Result<()> {
        self.dirty = true;
        let name = RESTART_SLOTS[self.restarts % 2];
        let slot = match self.store.file.link_exists(name) {
            true => self.store.grown(name)?,
            false => {
                let [fewest, most] = RESTART_CHUNK;
                let chunk = bytes.len().next_power_of_two().clamp(fewest, most);
                self.store.growing::<u8>(name, &[], Layout::Rows(chunk))?
            }
        };
        slot.put(&self.store, 0, bytes)?;
        let states = self.states();
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
        self.durable = true;
        Ok(())
    }

    /// Makes all that was appended since the last commit part of the file. After a commit that failed no other is
    /// possible: the file goes back to the one before as the writer is dropped.
    pub fn commit(&mut self) -> Result<()> {
        if self.undo.armed.is_some() {
            return Err(self.store.fail("/", "an earlier write failed, so nothing more is written"));
        }
        let durable = self.durable || self.committed.elapsed() >= SYNC_FACTOR * self.sync_cost;
        let mut waited = Duration::ZERO;
        if self.committed_length > 0 {
            let snapshot = self.snapshot()?;
            let begun = Instant::now();
            journal::write(&self.store.path, &snapshot, durable)?;
            waited += begun.elapsed();
            self.undo.armed = Some((self.store.path.clone(), snapshot));
        }
        self.store.hdf5("/", self.store.file.flush())?;
        if durable {
            let begun = Instant::now();
            journal::sync(&self.store.path)?;
            self.sync_cost = waited + begun.elapsed();
        }
        if self.fixed_changed || self.committed_length == 0 {
            self.fixed_extents = self.gather_fixed()?;
            self.fixed_changed = false;
        }
        self.committed_length = self.length_on_disk()?;
        journal::discard(&self.store.path)?;
        self.undo.armed = None;
        self.dirty = false;
        self.durable = false;
        self.committed = Instant::now();
        Ok(())
    }

    /// Notes how the run ended, and commits. The writer can then be dropped.
    pub fn finish(&mut self, outcome: Outcome, reason: &str, last_good_increment: u64) -> Result<()> {
        self.set_status(outcome, reason, last_good_increment)?;
        self.durable = true;
        self.commit()
    }

    /// Puts what is known of the increment that stopped the run beside the reason, by name: attributes of `/status`.
    pub fn set_dossier(&mut self, texts: &[(&str, String)]) -> Result<()> {
        self.dirty = true;
        for (name, text) in texts {
            self.store.text_attribute(&self.status, name, text)?;
        }
        Ok(())
    }

    /// Forgets what [`Writer::set_dossier`] put there.
    pub(super) fn drop_dossier(&mut self) -> Result<()> {
        for name in self.store.hdf5("status", self.status.attr_names())? {
            if !STATUS_ATTRIBUTES.contains(&name.as_str()) {
                self.store.hdf5("status", self.status.delete_attr(&name))?;
            }
        }
        Ok(())
    }

    /// States saved so far.
    pub fn states(&self) -> usize {
        self.fields.as_ref().map_or(0, VtkHdf::states)
    }

    pub fn path(&self) -> &Path {
        &self.store.path
    }

    pub(super) fn set_status(&mut self, outcome: Outcome, reason: &str, increment: u64) -> Result<()> {
        self.dirty = true;
        let text = self.store.unicode("status", outcome.as_str())?;
        self.store.hdf5("status", self.status.write_scalar(&text))?;
        self.store.text_attribute(&self.status, "reason", reason)?;
        self.store.number_attribute(&self.status, "last_good_increment", increment)
    }

    fn snapshot(&self) -> Result<Vec<u8>> {
        journal::snapshot(&self.store.path, self.committed_length, &self.fixed_extents)
    }

    pub(super) fn gather_fixed(&self) -> Result<Vec<(u64, u64)>> {
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

    pub(super) fn length_on_disk(&self) -> Result<u64> {
        let found =
            std::fs::metadata(&self.store.path).map_err(|e| Error::io("read", &self.store.path, e))?;
        Ok(found.len())
    }
}

impl Drop for Writer {
    /// Keeps HDF5 from writing out what was not committed: the file is put back once it is closed.
    fn drop(&mut self) {
        if self.dirty && self.committed_length > 0 && self.undo.armed.is_none() {
            // A file that cannot be read now cannot be put back either.
            if let Ok(snapshot) = self.snapshot() {
                self.undo.armed = Some((self.store.path.clone(), snapshot));
            }
        }
    }
}

/// How the file is opened: without HDF5's own lock (see `lock`), and with its metadata held in memory from one flush to the next, so
/// that the file on disk changes only where the journal expects it.
pub(super) fn access() -> hdf5::Result<FileAccess> {
    let mut cache = FileAccess::try_new()?.get_mdc_config()?;
    cache.evictions_enabled = false;
    cache.incr_mode = CacheIncreaseMode::Off;
    cache.flash_incr_mode = FlashIncreaseMode::Off;
    cache.decr_mode = CacheDecreaseMode::Off;
    FileAccess::build().libver_v18().file_locking(false).mdc_config(&cache).finish()
}

fn begin(path: &Path) -> Result<File> {
    let made = access().and_then(|access| {
        let mut options = File::with_options();
        options.set_access_plist(&access)?.create(path)
    });
    made.map_err(|e| failure(path, "/", explain(&e)))
}

fn unfinished_name(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_os_string();
    name.push(".new");
    PathBuf::from(name)
}
