//! A triaxial test from its beginning to the end of its last stage.

use std::time::{Duration, Instant};

use crate::case::{Case, RawCase, SpecimenCase};
use crate::error::Result;
use crate::loading::StageEnd;
use crate::recording::Profile;
use crate::setup::{PlannedStage, energy_gate, planned_stages};
use crate::solver::audit;
use crate::triaxial::{Path, Stage};

use super::beginning::{Beginning, Begun};
use super::ending::{Outcome, close};
use super::observer::{Observer, StageReport, Step};
use super::options::Options;
use super::resume::Found;
use super::seating::seat;

/// Runs a test, from what was `found` in its results file or from its start.
///
/// # Errors
/// As [`super::run`].
pub fn run(
    case: &Case,
    wanted: &SpecimenCase,
    source: &RawCase,
    options: &Options,
    found: Option<Found>,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let stages = &planned_stages(case);
    let mut profile = Profile::default();
    let beginning = Beginning { case, wanted, source, options, clock: Instant::now() };
    let mut begun = beginning.begin(found.as_ref(), &mut profile, observer)?;
    begun.test.energy_gate = energy_gate(&case.solver);
    let mut run = TestRun { begun, profile, audit: options.audit, stages, observer };
    let mut end = match run.observer.stop_requested() {
        true => StageEnd::Interrupted,
        false => StageEnd::Finished,
    };
    if end == StageEnd::Finished && !run.begun.recorder.at.seated {
        end = run.seat_grains()?;
    }
    let reached = run.begun.recorder.at.stage;
    for planned in stages.iter().filter(|planned| planned.index >= reached) {
        let Some(stage) = &planned.stage else { continue };
        if end != StageEnd::Finished {
            break;
        }
        end = run.run_stage(planned, stage)?;
    }
    let TestRun { begun: Begun { mut recorder, mut rig, .. }, mut profile, .. } = run;
    if end != StageEnd::Interrupted {
        recorder.write_breakage(&rig)?;
        recorder.write_pieces(&rig.model)?;
    }
    profile.finish(rig.contacts.timings);
    close(recorder, case, options, end, rig.dossier.take(), profile)
}

/// A test under way.
struct TestRun<'a> {
    begun: Begun,
    profile: Profile,
    audit: bool,
    stages: &'a [PlannedStage],
    observer: &'a mut dyn Observer,
}

impl TestRun<'_> {
    /// Lays the membrane on and brings loose grains into touch, under the pressure of the first
    /// consolidation.
    fn seat_grains(&mut self) -> Result<StageEnd> {
        let TestRun { begun: Begun { recorder, rig, test }, profile, stages, observer, .. } = self;
        let path = stages.first().and_then(|planned| planned.stage).map(|stage| stage.path);
        if let Some(Path::Stress { axial, radial }) = path {
            let pressure = axial.min(radial);
            let start = Instant::now();
            match test.lay_membrane(rig, pressure) {
                Ok(()) => {}
                // It was broken off.
                Err(_) if observer.stop_requested() => return Ok(StageEnd::Interrupted),
                Err(reason) => return Ok(StageEnd::Stopped { reason }),
            }
            let seating = seat(test, rig, pressure, &|| observer.stop_requested());
            profile.book_since("seating", start);
            observer.seated(&seating);
            if let Some(reason) = seating.fault().filter(|_| !observer.stop_requested()) {
                return Ok(StageEnd::Stopped { reason });
            }
        }
        if observer.stop_requested() {
            // The seating may have been cut short: a continued run seats anew.
            return Ok(StageEnd::Interrupted);
        }
        recorder.at.seated = true;
        recorder.hold(test, rig)?;
        recorder.keep()?;
        Ok(StageEnd::Finished)
    }

    /// Runs a stage, or the rest of one that is under way, and sums it up.
    fn run_stage(&mut self, planned: &PlannedStage, stage: &Stage) -> Result<StageEnd> {
        let Begun { recorder, rig, test } = &mut self.begun;
        if !recorder.at.strains_restarted && !planned.consolidates() {
            // Strains count from the end of the consolidation; the energies go on.
            test.zero_strains(rig);
            recorder.at.strains_restarted = true;
        }
        self.observer.stage_begun(planned);
        if !test.is_under_way() {
            recorder.begin_stage(planned.index, Some(&test.measures(rig)));
        }
        let end = self.run_increments(planned, stage)?;
        let Begun { recorder, rig, test } = &mut self.begun;
        recorder.end_stage(rig)?;
        recorder.sum_up(planned.consolidates())?;
        let next = self.stages.get(planned.index + 1);
        let shears_next = next.is_none_or(|next| !next.consolidates());
        if end == StageEnd::Finished && !recorder.at.strains_restarted && shears_next {
            recorder.keep_consolidated(test, rig)?;
        }
        self.observer.stage_ended(&StageReport { stage: planned, end: &end, work: recorder.stage_work() });
        match end == StageEnd::Finished && next.is_some() && self.observer.stop_requested() {
            true => Ok(StageEnd::Interrupted),
            false => Ok(end),
        }
    }

    /// The increments of a stage, each in the file and told of before the next one begins.
    fn run_increments(&mut self, planned: &PlannedStage, stage: &Stage) -> Result<StageEnd> {
        let TestRun { begun: Begun { recorder, rig, test }, profile, audit, stages, observer } = self;
        let (mut trouble, mut fault) = (None, None);
        let (start, mut output) = (Instant::now(), Duration::ZERO);
        recorder.begin_solving();
        let end = test.run(rig, stage, &mut |rig, report| {
            let begun = Instant::now();
            let recorded = recorder.accept(planned.axial_strain(), rig, report);
            output += begun.elapsed();
            profile.book("output", begun.elapsed());
            match recorded {
                Ok(row) => observer.step_accepted(&Step::new(planned, stages, report.row.progress, &row)),
                Err(error) => trouble = Some(error),
            }
            if *audit {
                fault = audit::fault(&rig.model, &rig.contacts, &rig.committed.poses);
            }
            recorder.begin_solving();
            trouble.is_none() && fault.is_none() && !observer.stop_requested()
        });
        profile.book(planned.kind, start.elapsed().saturating_sub(output));
        match (trouble, fault) {
            (Some(error), _) => Err(error),
            (None, Some(fault)) => {
                rig.dossier = None;
                Ok(StageEnd::Stopped { reason: format!("the audit failed: {fault}") })
            }
            (None, None) => Ok(end),
        }
    }
}
