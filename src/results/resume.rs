//! Opens a results file to continue its run: back to the last restart point, and on from there.

use std::path::Path;

use hdf5::File;

use crate::error::Result;

use super::bodies::BODY_QUANTITIES;
use super::grains::GRAIN_QUANTITIES;
use super::history::HISTORY;
use super::journal;
use super::lock::Lock;
use super::reader::{Reader, Restart};
use super::record::Outcome;
use super::store::{Store, explain, failure};
use super::vtkhdf::VtkHdf;
use super::writer::{Writer, access};

/// Where datasets lie that are written once.
const FIXED_GROUPS: [&str; 8] =
    ["VTKHDF", "grains", "specimen", "contacts", "breakage", "pieces", "rock", "restart"];

impl Writer {
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
        if self.store.file.link_exists("stages") {
            let stages = self.store.group("stages")?;
            for name in self.store.hdf5("stages", stages.member_names())? {
                if name.parse::<usize>().is_ok_and(|index| index >= stage) {
                    self.store.hdf5(&format!("stages/{name}"), stages.unlink(&name))?;
                }
            }
        }
        for name in ["profile", "breakage", "pieces"] {
            if self.store.file.link_exists(name) {
                self.store.hdf5(name, self.store.file.unlink(name))?;
            }
        }
        self.dirty = true;
        self.commit()
    }

    fn drop_after(&mut self, restart: &Restart) -> Result<()> {
        for column in &self.history {
            if column.rows() < restart.rows {
                return Err(self.store.fail(&column.name, "is shorter than the restart point says"));
            }
            column.resize(&self.store, restart.rows)?;
        }
        if self.store.file.link_exists("bodies") {
            for body in self.body_names()? {
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
            if restart.states == 0 {
                self.store.hdf5("VTKHDF", self.store.file.unlink("VTKHDF"))?;
            } else {
                self.fields = Some(VtkHdf::resume(&self.store, restart.states)?);
            }
        }
        if self.store.file.link_exists("grains/position") {
            for quantity in &GRAIN_QUANTITIES {
                let column = self.store.grown(&format!("grains/{}", quantity.name))?;
                column.resize(&self.store, restart.states)?;
                self.grains.push(column);
            }
            if self.store.file.link_exists("grains/state") {
                let states = self.store.grown("grains/state")?;
                states.resize(&self.store, restart.states)?;
                self.grain_states = Some(states);
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

    /// Notes the datasets in a group that were written whole, mesh and tables; those that grow note themselves.
    fn find_fixed(&mut self, group: &str) -> Result<()> {
        let mut waiting = vec![group.to_string()];
        let mut fixed = Vec::new();
        while let Some(name) = waiting.pop() {
            if !self.store.file.link_exists(&name) {
                continue;
            }
            let here = self.store.hdf5(&name, self.store.file.group(&name))?;
            fixed.extend(
                self.store.hdf5(&name, here.datasets())?.into_iter().filter(|found| !found.is_resizable()),
            );
            let groups = self.store.hdf5(&name, here.groups())?;
            waiting.extend(groups.iter().map(|group| group.name()));
        }
        self.fixed.extend(fixed);
        Ok(())
    }
}
