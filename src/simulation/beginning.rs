//! The three beginnings of a triaxial test: on a specimen as generated, on the consolidated one of another
//! file, and where a run of the same case left off.

use std::time::Instant;

use crate::case::{Case, RawCase, SpecimenCase};
use crate::error::Result;
use crate::mesh::Mesh;
use crate::recording::{Origin, Profile, Recorder, TestPoint, restart};
use crate::results::Reader;
use crate::setup::{self, give_rock, grain_meshes, largest_pressure, planned_stages};
use crate::specimen::Specimen;
use crate::triaxial::{Rig, Test};

use super::observer::Observer;
use super::options::Options;
use super::resume::{Found, reopen};
use super::specimen;
use super::start::{self, Consolidation, Start};

/// What a test needs to begin.
pub struct Beginning<'a> {
    pub case: &'a Case,
    pub wanted: &'a SpecimenCase,
    pub source: &'a RawCase,
    pub options: &'a Options,
    /// When the run was begun.
    pub clock: Instant,
}

/// A test that has a results file with a restart point, and can go on.
pub struct Begun {
    pub recorder: Recorder,
    pub rig: Rig,
    pub test: Test,
}

impl Beginning<'_> {
    /// Begins the test, from what was `found` in its results file, or from what its case names, or anew.
    ///
    /// # Errors
    /// What the specimen, the rig, the file to start from or the results file refuse.
    pub fn begin(
        &self,
        found: Option<&Found>,
        profile: &mut Profile,
        observer: &mut dyn Observer,
    ) -> Result<Begun> {
        if let Some(found) = found {
            return self.continued(found, observer);
        }
        let (specimen, meshes) = match start::look(self.case, self.source)? {
            Some(Start::Consolidated(start)) => return self.on_consolidated(*start, observer),
            Some(Start::Generated { specimen, how }) => {
                observer.resumed(&how);
                specimen::meshed(self.case, self.wanted, *specimen, self.clock, observer)?
            }
            None => specimen::generated(self.case, self.wanted, observer)?,
        };
        self.on_generated(specimen, &meshes, profile, observer)
    }

    fn on_generated(
        &self,
        specimen: Specimen,
        meshes: &[Mesh],
        profile: &mut Profile,
        observer: &mut dyn Observer,
    ) -> Result<Begun> {
        let case = self.case;
        profile.book_since("specimen", self.clock);
        let start = Instant::now();
        let mut recorder = Recorder::create(case, self.source, &self.options.target(), self.clock)?;
        specimen::write(&mut recorder, case, &specimen, meshes)?;
        let origin = Origin::new(specimen, largest_pressure(case));
        recorder.save_origin(&origin)?;
        profile.book_since("output", start);
        let start = Instant::now();
        let mut rig = self.rig_of(&origin, observer)?;
        profile.book_since("rig", start);
        let start = Instant::now();
        self.give_rock(&mut rig, meshes, observer)?;
        profile.book_since("condensation", start);
        let start = Instant::now();
        specimen::begin(&mut recorder, case, &rig, &origin.specimen, meshes)?;
        profile.book_since("output", start);
        let test = Test::new(&rig);
        recorder.hold(&test, &rig)?;
        recorder.keep()?;
        Ok(Begun { recorder, rig, test })
    }

    fn on_consolidated(&self, start: Consolidation, observer: &mut dyn Observer) -> Result<Begun> {
        let Consolidation { origin, state, how } = start;
        let (case, specimen) = (self.case, &origin.specimen);
        observer.resumed(&how);
        let meshes = grain_meshes(self.wanted, specimen)?;
        let reference = self.rig_of(&origin, observer)?;
        let mut rig = reference.clone();
        self.give_rock(&mut rig, &meshes, observer)?;
        if !rig.restore(state.rig)? {
            return Err(restart::fault(&self.options.out, "cannot start from the state of another specimen"));
        }
        let test = state.test.into_owned();
        let mut recorder = Recorder::create(case, self.source, &self.options.target(), self.clock)?;
        specimen::write(&mut recorder, case, specimen, &meshes)?;
        recorder.save_origin(&origin)?;
        specimen::begin_moved(&mut recorder, case, [&rig, &reference], specimen, &meshes)?;
        recorder.start_from(&test);
        recorder.at.seated = true;
        if planned_stages(case).first().is_none_or(|planned| !planned.consolidates()) {
            recorder.keep_consolidated(&test, &rig)?;
        }
        recorder.hold(&test, &rig)?;
        recorder.keep()?;
        Ok(Begun { recorder, rig, test })
    }

    /// As the results file has it at the last restart point.
    fn continued(&self, found: &Found, observer: &mut dyn Observer) -> Result<Begun> {
        let (case, out) = (self.case, &self.options.out);
        let reader = Reader::open(out)?;
        let origin =
            reader.origin()?.ok_or_else(|| restart::fault(out, "holds no specimen to go on with"))?;
        let kept = reader.restart()?.ok_or_else(|| restart::fault(out, "holds no restart point"))?;
        drop(reader);
        let (origin, _) = restart::decode::<Origin<'_>>(&origin, out)?;
        let specimen = &origin.specimen;
        let (point, version) = restart::decode::<TestPoint<'_>>(&kept.bytes, out)?;
        let meshes = grain_meshes(self.wanted, specimen)?;
        let reference = self.rig_of(&origin, observer)?;
        let mut rig = reference.clone();
        self.give_rock(&mut rig, &meshes, observer)?;
        if !rig.restore(point.rig)? {
            return Err(restart::fault(out, "belongs to another specimen"));
        }
        // The file drops what is behind its restart point only once that is known to be of use.
        let mut writer = reopen(out, &kept)?;
        writer.drop_summaries(point.at.stage)?;
        let mut recorder = Recorder::over(writer, case, self.clock);
        observer.resumed(&found.continuation(&kept, version));
        specimen::begin(&mut recorder, case, &reference, specimen, &meshes)?;
        let unsaved = point.unsaved.map(|state| state.into_owned());
        recorder.restore(point.at, point.sums, point.curve.into_owned(), kept.states, unsaved);
        Ok(Begun { recorder, rig, test: point.test.into_owned() })
    }

    fn give_rock(&self, rig: &mut Rig, meshes: &[Mesh], observer: &mut dyn Observer) -> Result<()> {
        observer.building(true);
        let given = give_rock(self.case, rig, meshes);
        observer.building(false);
        given
    }

    fn rig_of(&self, origin: &Origin<'_>, observer: &dyn Observer) -> Result<Rig> {
        setup::rig(self.case, &origin.specimen, origin.membrane_pressure, observer.stop_signal())
    }
}
