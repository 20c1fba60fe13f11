//! Writes a results file as a run goes on.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use hdf5::File;
use hdf5::file::{CacheDecreaseMode, CacheIncreaseMode, FileAccess, FlashIncreaseMode};
use hdf5::types::VarLenUnicode;

use crate::error::{Error, Result};

use super::checksum::crc32;
use super::fields::{FieldMesh, FieldState};
use super::head::{self, FORMAT, HEAD, Head, Identity};
use super::history::{BODY_QUANTITIES, BodyRow, GRAIN_QUANTITIES, GrainRow, HISTORY, HistoryRow};
use super::journal::{self, Armed, Owner};
use super::lock::Lock;
use super::reader::Reader;
use super::record::{COMMIT, CONSOLIDATED, CaseRecord, ORIGIN, Outcome, RESTART_SLOTS, VERSION, host};
use super::store::{Growing, Layout, Store, explain, failure};
use super::table::{Column, ColumnData};
use super::vtkhdf::VtkHdf;

/// Rows of a chunk of `/history`: a column's chunk is 4 KiB.
pub(super) const HISTORY_ROWS: usize = 512;
/// Fewest and most bytes of a chunk of a restart slot.
const RESTART_CHUNK: [usize; 2] = [1 << 12, 1 << 20];
/// A commit that may wait does so until the time since the last one is so many times what that took.
const COMMIT_FACTOR: u32 = 50;
/// Chunks of rows that a column holds from one flush to the next, and their bytes at most.
const ROW_CACHE: [usize; 2] = [11, 1 << 16];
/// Rows of all bodies in chunks that are begun, at most: with more bodies their chunks are shorter.
const BODY_ROWS: usize = 1 << 14;
/// What to do where the results file exists already.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    Refuse,
    Replace,
    /// Continue its run; begin one where there is nothing to continue.
    Continue,
}

/// The dataset that says how the run stands.
const STATUS: &str = "status";
/// What `/status` has in every file; the rest is the dossier of a run that stopped.
const STATUS_ATTRIBUTES: [&str; 3] = ["reason", "last_good_increment", "crc32"];

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
    slots: [Option<Growing>; 2],
    pub(super) rows: usize,
    pub(super) restarts: usize,
    /// Where values lie that were written whole and do not change afterwards: (offset, length).
    pub(super) written: Vec<(u64, u64)>,
    /// Where raw data lie that no later flush changes: sorted, disjoint (offset, length).
    pub(super) fixed_extents: Vec<(u64, u64)>,
    fixed_changed: bool,
    pub(super) committed_length: u64,
    /// The run that the file is of, and commits made so far.
    owner: Owner,
    /// Whether the next commit may not wait.
    urgent: bool,
    /// When the last commit was done, and what it took.
    committed: Instant,
    cost: Duration,
    /// Behind all that keeps the file open, so that it acts on the closed file.
    undo: journal::Undo,
    /// Last, so that the file is closed before it is released.
    lock: Lock,
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
        make_way(&unfinished)?;
        let lock = Lock::create(&unfinished)?;
        let begun = Self::begin(&unfinished, path, lock, case);
        let mut writer = match begun {
            Ok(writer) => writer,
            Err(error) => {
                // Best effort: the error that matters is the one returned.
                let _ = std::fs::remove_file(&unfinished);
                return Err(error);
            }
        };
        writer.store.path = path.to_path_buf();
        journal::sync_name(path);
        Ok(writer)
    }

    /// Lays a new file out under a name of its own, and gives it its name.
    fn begin(unfinished: &Path, path: &Path, lock: Lock, case: &CaseRecord) -> Result<Self> {
        let owner = Owner { identity: Identity::draw(), commit: 0 };
        let made = access().and_then(|access| {
            let mut options = File::with_options();
            options.with_fcpl(|create| create.userblock(HEAD)).set_access_plist(&access)?.create(unfinished)
        });
        let file = made.map_err(|e| failure(unfinished, "/", explain(&e)))?;
        let store = Store { open: Some(file), path: unfinished.to_path_buf() };
        check_place(&lock, unfinished)?;
        Head::begin(&lock.file, owner.identity)
            .and_then(|()| Head::note_name(&lock.file, path))
            .map_err(|e| Error::io("write", unfinished, e))?;
        let mut writer = Self::lay_out(store, lock, owner, case)?;
        writer.commit()?;
        // What lies under the journal's name is of a file that is replaced, or of none.
        let replaced = std::fs::File::open(path).ok().and_then(|file| Head::read(&file, path).ok().flatten());
        let own: Vec<Identity> = replaced.map(|head| head.identity).into_iter().collect();
        journal::set_aside(path, &own)?;
        std::fs::rename(unfinished, path).map_err(|e| Error::io("create", path, e))?;
        Ok(writer)
    }

    fn lay_out(store: Store, lock: Lock, owner: Owner, case: &CaseRecord) -> Result<Self> {
        let root = store.file()?;
        store.number_attribute(root, "format_version", u64::from(FORMAT))?;
        store.text_attribute(root, "identity", &owner.identity.to_string())?;
        for (name, value) in [
            ("format", "riprap results"),
            ("title", case.title.as_str()),
            ("riprap_version", VERSION),
            ("riprap_commit", COMMIT),
            ("units", "SI; in /history compression positive, in /VTKHDF tension positive"),
        ] {
            store.text_attribute(root, name, value)?;
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
        let status = store.text(STATUS, Outcome::Running.as_str())?;
        store.text_attribute(&status, "reason", "")?;
        store.number_attribute(&status, "last_good_increment", 0_u64)?;
        store.group("history")?;
        let history = store.columns("history", HISTORY, None, Layout::Rows(HISTORY_ROWS))?;
        store.scale_history(&history)?;
        Ok(Self::over(store, lock, owner, history))
    }

    pub(super) fn over(store: Store, lock: Lock, owner: Owner, history: Vec<Growing>) -> Self {
        Writer {
            store,
            history,
            bodies: Vec::new(),
            mesh: None,
            fields: None,
            grains: Vec::new(),
            grain_states: None,
            slots: [None, None],
            rows: 0,
            restarts: 0,
            written: Vec::new(),
            fixed_extents: Vec::new(),
            fixed_changed: false,
            committed_length: 0,
            owner,
            urgent: true,
            committed: Instant::now(),
            cost: Duration::ZERO,
            undo: journal::Undo::default(),
            lock,
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
            self.store.raw_extents(&dataset, &mut self.written)?;
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
        self.fixed_changed = true;
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
        for name in names {
            if name.is_empty() || name.contains(|c: char| c == '/' || c.is_control()) || *name == "." {
                return Err(self.store.fail("bodies", format!("a body cannot be named {name:?}")));
            }
            let layout = Layout::Rows((BODY_ROWS / names.len()).clamp(8, HISTORY_ROWS / 2));
            self.bodies.push(self.store.columns(&format!("bodies/{name}"), BODY_QUANTITIES, None, layout)?);
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
        if bodies.len() != self.bodies.len() {
            let message = format!("{} rows for {} bodies", bodies.len(), self.bodies.len());
            return Err(self.store.fail("bodies", message));
        }
        self.store.put_values(&self.history, HISTORY, self.rows, &[row.values()])?;
        for (columns, body) in self.bodies.iter().zip(bodies) {
            self.store.put_values(columns, BODY_QUANTITIES, self.rows, &[body.values()])?;
        }
        self.rows += 1;
        let increment = u64::try_from(row.increment).unwrap_or(0);
        let status = self.store.open(STATUS)?;
        self.store.number_attribute(&status, "last_good_increment", increment)
    }

    /// Appends a state of the fields; returns its number, which also names `/contacts/<state>`.
    pub fn save_state(&mut self, state: &FieldState<'_>) -> Result<usize> {
        self.fixed_changed = true;
        if let Some(mesh) = self.mesh.take() {
            let (fields, fixed) = VtkHdf::create(&self.store, &mesh)?;
            self.fields = Some(fields);
            for dataset in &fixed {
                self.store.raw_extents(dataset, &mut self.written)?;
            }
        }
        let Some(fields) = &mut self.fields else {
            return Err(self.store.fail("VTKHDF", "no mesh has been set"));
        };
        fields.save(&self.store, state)
    }

    /// Appends a state of the grains, to go with the last [`Writer::save_state`].
    pub fn save_grains(&mut self, grains: &[GrainRow]) -> Result<()> {
        if self.grains.is_empty() {
            let layout = Layout::Blocks { rows: 1 };
            self.grains = self.store.columns("grains", GRAIN_QUANTITIES, Some(grains.len()), layout)?;
            self.scale_grains()?;
        }
        let start = self.grains.first().map_or(0, Growing::rows);
        if let Some(states) = &self.grain_states {
            states.put(&self.store, start, &[start as i64])?;
        }
        let values: Vec<_> = grains.iter().map(GrainRow::values).collect();
        self.store.put_values(&self.grains, GRAIN_QUANTITIES, start, &values)?;
        self.fixed_changed = true;
        Ok(())
    }

    /// Stores what all restart points have in common, once; [`super::Reader::origin`] returns the bytes as they are.
    pub fn save_origin(&mut self, bytes: &[u8]) -> Result<()> {
        self.save_checked(ORIGIN, bytes)
    }

    /// Stores the state at the end of the consolidation, which restart points do not touch; [`super::Reader::consolidated`]
    /// returns the bytes as they are. A continued run may come by a second time: what is there stays.
    pub fn save_consolidated(&mut self, bytes: &[u8]) -> Result<()> {
        if self.store.has("restart")? && self.store.has(CONSOLIDATED)? {
            return Ok(());
        }
        self.save_checked(CONSOLIDATED, bytes)
    }

    /// Writes bytes once, with a checksum beside them.
    fn save_checked(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        self.store.group("restart")?;
        let dataset = self.store.whole(name, bytes, &[])?;
        self.store.number_attribute(&dataset, "crc32", u64::from(crc32(bytes)))?;
        self.store.raw_extents(&dataset, &mut self.written)?;
        self.fixed_changed = true;
        Ok(())
    }

    /// Stores what a run needs to continue from here; [`Writer::resume`] returns the bytes as they are. The next commit does not
    /// wait: the one slot is not overwritten before the other is safe.
    pub fn save_restart(&mut self, increment: u64, bytes: &[u8]) -> Result<()> {
        let which = self.restarts % 2;
        let name = RESTART_SLOTS[which];
        let slot = match self.slots[which].take() {
            Some(slot) => slot,
            None if self.store.has("restart")? && self.store.has(name)? => self.store.grown(name)?,
            None => {
                self.store.group("restart")?;
                let [fewest, most] = RESTART_CHUNK;
                let chunk = bytes.len().next_power_of_two().clamp(fewest, most);
                self.store.growing::<u8>(name, &[], Layout::Slot(chunk))?
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
            ("crc32", u64::from(crc32(bytes))),
        ] {
            self.store.number_attribute(&slot.dataset, attribute, value)?;
        }
        // Held open, so that nothing of it is written but now or by a flush.
        self.slots[which] = Some(slot);
        self.fixed_changed = true;
        self.urgent = true;
        Ok(())
    }

    /// Makes all that was appended since the last commit part of the file, on the disk: it survives a loss of power. After a
    /// commit that failed no other is possible: the file goes back to the one before as the writer is dropped.
    pub fn commit(&mut self) -> Result<()> {
        let begun = Instant::now();
        self.begin_commit()?;
        self.store.hdf5("/", self.store.file()?.flush())?;
        if self.fixed_changed || self.committed_length == 0 {
            self.fixed_extents = self.gather_fixed()?;
            self.fixed_changed = false;
        }
        self.end_commit(None)?;
        self.committed = Instant::now();
        self.cost = self.committed - begun;
        Ok(())
    }

    /// As [`Writer::commit`], but where commits come so fast that they would take the run's time: then a later one has it too.
    pub fn commit_in_time(&mut self) -> Result<()> {
        match self.urgent || self.committed.elapsed() >= COMMIT_FACTOR * self.cost {
            true => self.commit(),
            false => Ok(()),
        }
    }

    /// Notes how the run ended, commits and closes the file. What is to be called finished is read back before. The writer can then
    /// only be dropped.
    pub fn finish(&mut self, outcome: Outcome, reason: &str, last_good_increment: u64) -> Result<()> {
        if outcome == Outcome::Finished {
            self.commit()?;
            Reader::read_back(&self.store.path)?.verify()?;
        }
        self.set_status(outcome, reason, last_good_increment)?;
        self.begin_commit()?;
        self.store.hdf5("/", self.store.file()?.flush())?;
        // All that keeps the file open.
        self.history.clear();
        self.bodies.clear();
        self.grains.clear();
        (self.fields, self.grain_states, self.slots) = (None, None, [None, None]);
        self.store.close()?;
        let checksum = head::checksum(&self.lock.file).map_err(|e| Error::io("read", &self.store.path, e))?;
        self.end_commit(Some(checksum))
    }

    /// Lays the journal down and says so in the head.
    fn begin_commit(&mut self) -> Result<()> {
        if self.undo.armed.is_some() {
            return Err(self.store.fail("/", "an earlier write failed, so nothing more is written"));
        }
        self.check_untouched()?;
        if self.committed_length == 0 {
            return Ok(());
        }
        let snapshot = self.snapshot()?;
        journal::write(&self.store.path, &snapshot)?;
        self.arm(snapshot, true)?;
        self.noted(Head::note_under_way(&self.lock.file, self.owner.commit + 1))
    }

    /// Waits until what was flushed is on the disk, says that it is, and lets go of the journal.
    fn end_commit(&mut self, checksum: Option<u32>) -> Result<()> {
        let (file, commit) = (&self.lock.file, self.owner.commit + 1);
        self.noted(file.sync_all())?;
        check_place(&self.lock, &self.store.path)?;
        if let Some(checksum) = checksum {
            self.noted(Head::note_checksum(file, commit, checksum))?;
        }
        self.noted(Head::note_commit(file, commit))?;
        self.noted(file.sync_all())?;
        let length = self.noted(file.metadata())?.len();
        self.owner.commit = commit;
        self.committed_length = length;
        // From here on the commit stands; the next one could not be begun with the journal there.
        self.undo.armed = None;
        self.urgent = false;
        journal::discard(&self.store.path)
    }

    /// Refuses to go on where the file is not as the last commit left it: replaced, removed, cut or written to by somebody else.
    fn check_untouched(&self) -> Result<()> {
        check_place(&self.lock, &self.store.path)?;
        match self.is_ours() {
            true => Ok(()),
            false => Err(self.store.fail("/", "was changed by another process while its run went on")),
        }
    }

    /// Whether the locked file, whatever its name, is at this writer's last commit.
    fn is_ours(&self) -> bool {
        let head = Head::read(&self.lock.file, &self.store.path).ok().flatten();
        let long_enough = self.lock.file.metadata().is_ok_and(|found| found.len() >= self.committed_length);
        long_enough
            && head.is_some_and(|head| {
                (head.identity, head.commit) == (self.owner.identity, self.owner.commit)
                    && head.under_way.is_none()
            })
    }

    fn arm(&mut self, snapshot: Vec<u8>, named: bool) -> Result<()> {
        let file = self.noted(self.lock.file.try_clone())?;
        let path = named.then(|| self.store.path.clone());
        self.undo.armed = Some(Armed { file, path, snapshot });
        Ok(())
    }

    fn noted<T>(&self, result: std::io::Result<T>) -> Result<T> {
        result.map_err(|e| Error::io("write", &self.store.path, e))
    }

    /// Puts what is known of the increment that stopped the run beside the reason, by name: attributes of `/status`.
    pub fn set_dossier(&mut self, texts: &[(&str, String)]) -> Result<()> {
        let status = self.store.open(STATUS)?;
        texts.iter().try_for_each(|(name, text)| self.store.text_attribute(&status, name, text))
    }

    /// Forgets what [`Writer::set_dossier`] put there.
    pub(super) fn drop_dossier(&mut self) -> Result<()> {
        let status = self.store.open(STATUS)?;
        for name in self.store.hdf5(STATUS, status.attr_names())? {
            if !STATUS_ATTRIBUTES.contains(&name.as_str()) {
                self.store.hdf5(STATUS, status.delete_attr(&name))?;
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
        let status = self.store.open(STATUS)?;
        self.store.rewrite(&status, STATUS, outcome.as_str())?;
        self.store.text_attribute(&status, "reason", reason)?;
        self.store.number_attribute(&status, "last_good_increment", increment)
    }

    fn snapshot(&self) -> Result<Vec<u8>> {
        let Store { path, .. } = &self.store;
        journal::snapshot(&self.lock.file, path, self.owner, self.committed_length, &self.fixed_extents)
    }

    pub(super) fn gather_fixed(&self) -> Result<Vec<(u64, u64)>> {
        let mut extents = self.written.clone();
        if let Some(fields) = &self.fields {
            for dataset in fields.block_datasets(&self.store)? {
                self.store.raw_extents(dataset, &mut extents)?;
            }
        }
        for column in &self.grains {
            self.store.raw_extents(&column.dataset, &mut extents)?;
        }
        for (name, slot) in RESTART_SLOTS.iter().zip(&self.slots) {
            if let Some(slot) = slot {
                self.store.raw_extents(&slot.dataset, &mut extents)?;
            } else if self.store.has("restart")? && self.store.has(name)? {
                self.store.raw_extents(&self.store.open(name)?, &mut extents)?;
            }
        }
        extents.sort_unstable();
        Ok(extents)
    }
}

impl Drop for Writer {
    /// Keeps HDF5 from writing out what was not committed: the file is put back once it is closed.
    fn drop(&mut self) {
        if self.store.open.is_none() || self.committed_length == 0 || self.undo.armed.is_some() {
            return;
        }
        let named = check_place(&self.lock, &self.store.path).is_ok();
        let (snapshot, ours) = match self.is_ours() {
            true => (self.snapshot(), true),
            false => {
                // Somebody wrote to it: what is there now stays, all of it, its head included.
                let nobody = Owner { identity: Identity([0; 16]), commit: 0 };
                let length = self.lock.file.metadata().map_or(0, |found| found.len());
                let path = &self.store.path;
                (journal::snapshot(&self.lock.file, path, nobody, length, &[]), false)
            }
        };
        // A file that cannot be read now cannot be put back either.
        let Ok(snapshot) = snapshot else { return };
        // On a full disk there is no room for the journal; then this process has to live until the file is closed.
        if named && ours && journal::write(&self.store.path, &snapshot).is_ok() {
            let _ = Head::note_under_way(&self.lock.file, self.owner.commit + 1);
        }
        let _ = self.arm(snapshot, named && ours);
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
    let [slots, bytes] = ROW_CACHE;
    FileAccess::build()
        .libver_v18()
        .file_locking(false)
        .mdc_config(&cache)
        .chunk_cache(slots, bytes, 0.75)
        // Contiguous values are written at once.
        .sieve_buf_size(0)
        .finish()
}

/// Whether a name still is that of the locked file.
fn check_place(lock: &Lock, path: &Path) -> Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let own = lock.file.metadata().map_err(|e| Error::io("read", path, e))?;
        let named = std::fs::metadata(path).map_err(|e| Error::io("find", path, e))?;
        if (own.dev(), own.ino()) != (named.dev(), named.ino()) {
            let message = "was replaced by another process while its run went on";
            return Err(failure(path, "/", message));
        }
    }
    #[cfg(not(unix))]
    let _ = (lock, path);
    Ok(())
}

/// Takes away what a killed run left under a name that is to be made anew; what a live one has is refused. A link is taken away
/// itself, not what it leads to.
fn make_way(path: &Path) -> Result<()> {
    match std::fs::symlink_metadata(path) {
        Err(_) => return Ok(()),
        Ok(found) if found.is_file() => {
            let lock = Lock::for_writing(path)?;
            if !head::is_unfinished(&lock.file) {
                return Err(failure(path, "/", "is in the way and is no results file; move it away"));
            }
        }
        Ok(_) => {}
    }
    std::fs::remove_file(path).map_err(|e| Error::io("remove", path, e))
}

fn unfinished_name(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_os_string();
    name.push(".new");
    PathBuf::from(name)
}
