//! Opens a results file to continue its run: back to the last restart point, and on from there.

use std::path::Path;

use hdf5::File;

use crate::error::{Error, Result};

use super::head::Head;
use super::history::{BODY_QUANTITIES, GRAIN_QUANTITIES, HISTORY};
use super::journal::{self, Owner};
use super::lock::{Access, Lock};
use super::reader::{Reader, Restart};
use super::record::Outcome;
use super::store::{Growing, Store, explain, failure};
use super::vtkhdf::VtkHdf;
use super::writer::{Writer, access};

/// Where datasets lie that are written once.
/// Not those that a continued run takes away: their place is used again.
const FIXED_GROUPS: [&str; 6] = ["VTKHDF", "grains", "specimen", "contacts", "rock", "restart"];

/// Puts a file back that a killed run left within a commit, for one who goes on with it where no lock says whether that run lives.
///
/// # Errors
/// [`Error::Results`] and [`Error::Io`] where that cannot be.
pub fn put_back(path: &Path) -> Result<()> {
    let Ok(real) = std::fs::canonicalize(path) else { return Ok(()) };
    let lock = Lock::acquire(&real, Access::Write)?;
    let Some(lock) = lock.filter(|lock| !lock.is_held()) else { return Ok(()) };
    journal::recover(&lock.file, &real).map(drop)
}

impl Writer {
    /// Opens a file to continue it after its last restart point: rows and states behind that point are
    /// dropped, the status is `running` again. Returns the restart point too; errors if there is none.
    pub fn resume(path: &Path) -> Result<(Self, Restart)> {
        // The journal lies beside the file itself, not beside links to it.
        let Ok(path) = &std::fs::canonicalize(path) else {
            return Err(failure(path, "/", "no such file"));
        };
        let lock = Lock::for_writing(path)?;
        let Some(head) = Head::read(&lock.file, path)? else {
            let message = "is of an earlier version of riprap, which alone can continue it";
            return Err(failure(path, "/", message));
        };
        journal::recover(&lock.file, path)?;
        journal::set_aside(path, &[head.identity])?;
        Head::note_name(&lock.file, path).map_err(|e| Error::io("write", path, e))?;
        let owner = Owner { identity: head.identity, commit: head.commit };
        let restart = Reader::of_owner(path)?
            .restart()?
            .ok_or_else(|| failure(path, "restart", "has no restart point to resume from"))?;
        let opened = access().and_then(|access| {
            let mut options = File::with_options();
            options.set_access_plist(&access)?.open_rw(path)
        });
        let file = opened.map_err(|e| failure(path, "/", explain(&e)))?;
        let store = Store { open: Some(file), path: path.to_path_buf() };
        let history = store.grown_columns("history", HISTORY)?;
        let length = lock.file.metadata().map_err(|e| Error::io("read", path, e))?.len();
        let mut writer = Self::over(store, lock, owner, history);
        writer.committed_length = length;
        writer.rows = restart.rows;
        writer.restarts = restart.written;
        writer.drop_after(&restart)?;
        for group in FIXED_GROUPS {
            writer.find_fixed(group)?;
        }
        writer.fixed_extents = writer.gather_fixed()?;
        writer.drop_dossier()?;
        writer.set_status(Outcome::Running, "", restart.increment)?;
        // By itself, so that space freed here is not written to before the file has forgotten it.
        writer.commit()?;
        Ok((writer, restart))
    }

    /// Forgets what a continued run writes again when it comes to the end of `stage` and of those behind
    /// it, the profile and the breakage. Right after [`Writer::resume`].
    pub fn drop_summaries(&mut self, stage: usize) -> Result<()> {
        self.drop_tables("stages", stage)?;
        for name in ["profile", "breakage", "pieces"] {
            if self.store.has(name)? {
                self.store.unlink(name)?;
            }
        }
        self.commit()
    }

    /// Takes away the tables of a group whose numbers are `first` and larger.
    fn drop_tables(&self, group: &str, first: usize) -> Result<()> {
        if !self.store.has(group)? {
            return Ok(());
        }
        let tables = self.store.group(group)?;
        for name in self.store.hdf5(group, tables.member_names())? {
            if name.parse::<usize>().is_ok_and(|number| number >= first) {
                self.store.hdf5(&format!("{group}/{name}"), tables.unlink(&name))?;
            }
        }
        Ok(())
    }

    fn cut(&self, columns: &[Growing], rows: usize) -> Result<()> {
        for column in columns {
            if column.rows() < rows {
                return Err(self.store.fail(&column.name, "is shorter than the restart point says"));
            }
            column.resize(&self.store, rows)?;
        }
        Ok(())
    }

    fn drop_after(&mut self, restart: &Restart) -> Result<()> {
        self.cut(&self.history, restart.rows)?;
        if self.store.has("bodies")? {
            for body in self.body_names()? {
                let columns = self.store.grown_columns(&format!("bodies/{body}"), BODY_QUANTITIES)?;
                self.cut(&columns, restart.rows)?;
                self.bodies.push(columns);
            }
        }
        if self.store.has("VTKHDF")? {
            if restart.states == 0 {
                self.store.unlink("VTKHDF")?;
            } else {
                self.fields = Some(VtkHdf::resume(&self.store, restart.states)?);
            }
        }
        if self.store.has("grains")? && self.store.has("grains/position")? {
            self.grains = self.store.grown_columns("grains", GRAIN_QUANTITIES)?;
            self.cut(&self.grains, restart.states)?;
            if self.store.has("grains/state")? {
                let states = self.store.grown("grains/state")?;
                states.resize(&self.store, restart.states)?;
                self.grain_states = Some(states);
            }
        }
        self.drop_tables("contacts", restart.states)
    }

    /// Notes where the datasets in a group lie that were written whole, mesh and tables; those that grow note themselves.
    fn find_fixed(&mut self, group: &str) -> Result<()> {
        let mut waiting = vec![group.to_string()];
        while let Some(name) = waiting.pop() {
            if !self.store.has(&name)? {
                continue;
            }
            let here = self.store.group(&name)?;
            for found in self.store.hdf5(&name, here.datasets())? {
                if !found.is_resizable() {
                    self.store.raw_extents(&found, &mut self.written)?;
                }
            }
            let groups = self.store.hdf5(&name, here.groups())?;
            waiting.extend(groups.iter().map(|group| group.name()));
        }
        Ok(())
    }
}
