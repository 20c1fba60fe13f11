//! Joins the run to its results file: rows, saved states, tables, the end.

use std::borrow::Cow;
use std::time::{Duration, Instant};

use crate::case::{Case, RawCase};
use crate::error::Result;
use crate::material::Drawn;
use crate::model::Model;
use crate::results::{BodyRow, FieldMesh, FieldState, GrainRow, HistoryRow, Outcome as FileOutcome, Writer};
use crate::solver::Dossier;
use crate::specimen::Specimen;
use crate::tensor::{Pose, components};
use crate::triaxial::{LocalStrain, Measures, Rig, StageCurve, StepReport, Test};

use super::breakage_meter::{self, BreakageMeter};
use super::breaking::{cell_states, grain_states};
use super::cell_fields::{self, CellFields};
use super::contact_table::ContactTable;
use super::fields::{GrainMeshes, Points, field_mesh};
use super::grain_stress::mean_stresses;
use super::history_row::row_of_test;
use super::profile::Profile;
use super::restart::{RestartKeeper, encode_into};
use super::restart_data::{Consolidated, Origin, Position, State, TestPoint};
use super::rock_table;
use super::specimen_table::{self, Generated};
use super::stage_table;
use super::sums::{StageWork, Sums};
use super::target::Target;

/// Writes a run as it goes on.
pub struct Recorder {
    pub(super) writer: Writer,
    clock: Instant,
    /// When the increment under way began.
    solving_since: Instant,
    /// Wall-clock time of the run before `clock` started [s].
    earlier: f64,
    points: Points,
    grains: usize,
    fields_every: f64,
    with_contacts: bool,
    sums: Sums,
    /// The last accepted increment's state, until it is saved.
    pub(super) unsaved: Option<State>,
    states: usize,
    pub(super) restarts: RestartKeeper,
    /// Where the test is, for its restart points.
    pub at: Position,
    /// Of the stage under way.
    curve: StageCurve,
    breakage: BreakageMeter,
}

impl Recorder {
    pub fn create(case: &Case, source: &RawCase, target: &Target<'_>, clock: Instant) -> Result<Self> {
        Ok(Self::over(target.create(case, source)?, case, clock))
    }

    /// Goes on with a file that is open at a restart point.
    pub fn over(writer: Writer, case: &Case, clock: Instant) -> Self {
        Recorder {
            writer,
            clock,
            solving_since: Instant::now(),
            earlier: 0.0,
            points: Points::default(),
            grains: 0,
            fields_every: case.output.fields_every,
            with_contacts: case.output.contacts,
            sums: Sums::default(),
            unsaved: None,
            states: 0,
            restarts: RestartKeeper::new(case.output.restart_every),
            at: Position::default(),
            curve: StageCurve::default(),
            breakage: BreakageMeter::new(case),
        }
    }

    /// Goes on from the sums of a restart point that holds so many states, and perhaps one that was not saved
    /// yet.
    pub fn restore(
        &mut self,
        at: Position,
        sums: Sums,
        curve: StageCurve,
        states: usize,
        unsaved: Option<State>,
    ) {
        self.at = at;
        self.unsaved = unsaved;
        self.curve = curve;
        self.earlier = sums.seconds;
        self.sums = sums;
        self.states = states;
    }

    /// Wall-clock time of the run [s], its earlier parts included.
    fn seconds(&self) -> f64 {
        self.earlier + self.clock.elapsed().as_secs_f64()
    }

    pub fn wall_time(&self) -> Duration {
        Duration::try_from_secs_f64(self.seconds()).unwrap_or_default()
    }

    /// The sums to store.
    pub(super) fn sums(&self) -> Sums {
        Sums { seconds: self.seconds(), ..self.sums }
    }

    pub fn increments(&self) -> u64 {
        self.sums.increments
    }

    /// Writes `/grains`, `/rock` and `/specimen`.
    pub fn write_specimen(&mut self, case: &Case, generated: &Generated<'_>) -> Result<()> {
        let Generated { specimen, meshes, drawn, .. } = *generated;
        self.grains = specimen.grains.len();
        self.writer.write_table("grains", &specimen_table::grains(case, generated))?;
        self.write_rock(drawn)?;
        for (group, columns) in specimen_table::specimen(specimen, meshes) {
            self.writer.write_table(&group, &columns)?;
        }
        self.writer.commit()
    }

    /// Writes `/rock`.
    pub fn write_rock(&mut self, drawn: &[Drawn]) -> Result<()> {
        rock_table::tables(drawn)
            .iter()
            .try_for_each(|(group, columns)| self.writer.write_table(group, columns))
    }

    /// Writes the mesh and the first state: the specimen as generated, which is the reference
    /// configuration. In a continued run the mesh is only compared.
    pub fn begin(&mut self, rig: &Rig, specimen: &Specimen, grains: &GrainMeshes<'_>) -> Result<()> {
        let poses = rig.committed.poses.clone();
        let first = State::reference(poses, specimen.grains.len(), rig.levels());
        self.begin_with((first, &[]), rig, specimen, grains)
    }

    /// As [`Recorder::begin`], with a `rig` that has moved on from its reference configuration `reference`.
    pub fn begin_moved(
        &mut self,
        rig: &Rig,
        reference: &Rig,
        specimen: &Specimen,
        grains: &GrainMeshes<'_>,
    ) -> Result<()> {
        let first = State::of(rig, specimen.grains.len());
        self.begin_with((first, &cell_fields::of_rig(rig)), reference, specimen, grains)
    }

    fn begin_with(
        &mut self,
        first: (State, &[CellFields]),
        reference: &Rig,
        specimen: &Specimen,
        grains: &GrainMeshes<'_>,
    ) -> Result<()> {
        self.grains = specimen.grains.len();
        let (mesh, points) = field_mesh(reference, specimen.diameter, grains)?;
        self.begin_fields(mesh, points, first)
    }

    /// Writes a mesh and the first state, or compares the mesh with that of a continued run.
    pub(super) fn begin_fields(
        &mut self,
        mesh: FieldMesh,
        points: Points,
        (first, cell_fields): (State, &[CellFields]),
    ) -> Result<()> {
        self.points = points;
        self.writer.set_mesh(mesh)?;
        if self.writer.states() == 0 {
            self.save(first, cell_fields)?;
            self.writer.commit()?;
        }
        Ok(())
    }

    /// Stores the specimen for all restart points.
    pub fn save_origin(&mut self, origin: &Origin<'_>) -> Result<()> {
        let mut bytes = Vec::new();
        encode_into(&mut bytes, origin, self.writer.path())?;
        self.writer.save_origin(&bytes)
    }

    /// Stores the state after the consolidation, for other runs to start from.
    pub fn keep_consolidated(&mut self, test: &Test, rig: &Rig) -> Result<()> {
        let mut bytes = Vec::new();
        let state = Consolidated { test: Cow::Borrowed(test), rig: rig.state() };
        encode_into(&mut bytes, &state, self.writer.path())?;
        self.writer.save_consolidated(&bytes)?;
        self.writer.commit()
    }

    /// Counts work and energies of stages from those of the test.
    pub fn start_from(&mut self, test: &Test) {
        self.sums.last = [test.ledger.external, test.ledger.error()];
    }

    /// Begins a stage; a test's with the measures it begins from.
    pub fn begin_stage(&mut self, stage: usize, from: Option<&Measures>) {
        self.at.stage = stage;
        self.sums.begin_stage(self.seconds());
        self.curve = from.map(StageCurve::starting_at).unwrap_or_default();
    }

    /// From here on increments are computed, until one is accepted.
    pub fn begin_solving(&mut self) {
        self.solving_since = Instant::now();
    }

    /// An increment was computed. Returns when that was.
    pub(super) fn end_solving(&mut self) -> Instant {
        let now = Instant::now();
        self.sums.solving += (now - self.solving_since).as_secs_f64();
        now
    }

    /// Wall-clock time of the run, and of its increments [s].
    pub(super) fn times(&self) -> [f64; 2] {
        [self.seconds(), self.sums.solving]
    }

    /// Takes down an accepted increment of the stage at hand, which adds so much `axial_strain`, if it says
    /// so. The increment is in the file when this returns.
    pub fn accept(
        &mut self,
        axial_strain: Option<f64>,
        rig: &Rig,
        report: &StepReport<'_>,
    ) -> Result<HistoryRow> {
        let begun = self.end_solving();
        let mut row = row_of_test(self.at.stage, self.sums.increments + 1, report, self.times());
        breakage_meter::note(&mut row, &rig.model, &mut self.breakage);
        self.curve.push(report.row);
        let poses = &rig.committed.poses;
        let state = State {
            time: row.time,
            increment: row.increment as u64,
            poses: rig.model.frames(poses),
            stress: mean_stresses(&rig.model, &rig.contacts, poses, rig.pressure),
            local_strains: report.local_strains.to_vec(),
            contacts: ContactTable::of(&rig.contacts, &rig.committed.memory, self.grains),
            cells: cell_states(&rig.model),
            grains: grain_states(&rig.model),
            levels: rig.levels(),
        };
        let position = report.row.path * axial_strain.unwrap_or(1.0);
        let cell_fields = || cell_fields::of_rig(rig);
        self.append(&row, &[], state, [position, report.row.progress], cell_fields)?;
        self.sums.stage.poorly_closed += usize::from(report.row.poorly_closed);
        self.hold(report.test, rig)?;
        self.commit()?;
        self.took_since(begun);
        Ok(row)
    }

    /// Books time spent on the file.
    pub(super) fn took_since(&mut self, begun: Instant) {
        self.sums.stage.writing += begun.elapsed().as_secs_f64();
    }

    /// Appends an increment and, where that is due, its state with the `cell_fields` of bodies: `position` is
    /// what `fields_every` counts.
    pub(super) fn append(
        &mut self,
        row: &HistoryRow,
        bodies: &[BodyRow],
        state: State,
        [position, progress]: [f64; 2],
        cell_fields: impl FnOnce() -> Vec<CellFields>,
    ) -> Result<()> {
        let sums = &mut self.sums;
        sums.increments += 1;
        sums.last = [row.energy_external, row.energy_error];
        sums.stage.increments += 1;
        sums.stage.factorisations += row.factorisations;
        let due = (position / self.fields_every + 1e-9).floor() as usize;
        let is_due = due > sums.stage.due || progress >= 1.0 - 1e-9;
        sums.stage.due = due;
        self.writer.append(row, bodies)?;
        match is_due {
            true => self.save(state, &cell_fields())?,
            false => self.unsaved = Some(state),
        }
        Ok(())
    }

    /// Holds the state of a triaxial test for the next restart point.
    pub fn hold(&mut self, test: &Test, rig: &Rig) -> Result<()> {
        let point = TestPoint {
            at: self.at,
            test: Cow::Borrowed(test),
            rig: rig.state(),
            sums: self.sums(),
            curve: Cow::Borrowed(&self.curve),
            unsaved: self.unsaved.as_ref().map(Cow::Borrowed),
        };
        self.restarts.hold(self.sums.increments, &point, self.writer.path())
    }

    /// Commits, with a restart point where one is due.
    pub(super) fn commit(&mut self) -> Result<()> {
        match self.restarts.is_due() {
            true => self.restarts.write(&mut self.writer),
            false => self.writer.commit_in_time(),
        }
    }

    /// Writes the restart point that is held, due or not.
    pub fn keep(&mut self) -> Result<()> {
        self.restarts.write(&mut self.writer)
    }

    /// Ends a stage that is done, or the run in the midst of one: then there is a restart point after the
    /// last accepted increment, and its state is saved behind that. A continued run forgets that state; it
    /// has it from the restart point, should it end before another increment.
    pub fn end_stage(&mut self, rig: &Rig) -> Result<()> {
        self.end_with(&rig.model, &rig.committed.poses, || cell_fields::of_rig(rig))
    }

    /// `cell_fields` are those of the bodies of `model` at `poses`, as committed; where these have moved on
    /// from the unsaved state without a row, nothing is known of it.
    pub(super) fn end_with(
        &mut self,
        model: &Model,
        poses: &[Pose],
        cell_fields: impl FnOnce() -> Vec<CellFields>,
    ) -> Result<()> {
        self.keep()?;
        if let Some(state) = self.unsaved.take() {
            let is_there = state.poses == model.frames(poses) && state.cells == cell_states(model);
            let cell_fields = if is_there { cell_fields() } else { Vec::new() };
            self.save(state, &cell_fields)?;
            self.writer.commit()?;
        }
        Ok(())
    }

    /// Sums the stage at hand up in `/stages`.
    pub fn sum_up(&mut self, consolidates: bool) -> Result<()> {
        let columns = stage_table::columns(&self.curve.summary(), consolidates);
        self.writer.write_table(&format!("stages/{}", self.at.stage), &columns)?;
        self.writer.commit()
    }

    /// What the stage at hand took.
    pub fn stage_work(&self) -> StageWork {
        self.sums.stage_work(self.seconds(), self.states)
    }

    /// Writes `/profile`.
    pub fn write_profile(&mut self, profile: &Profile) -> Result<()> {
        self.writer.write_table("profile", &profile.columns())
    }

    /// Writes `/breakage` of a specimen whose grains can break; once, at the end of the run.
    pub fn write_breakage(&mut self, rig: &Rig) -> Result<()> {
        if rig.model.can_break() {
            let breakage = self.breakage.final_measure(&rig.model)?;
            self.writer.write_breakage(&breakage)?;
        }
        Ok(())
    }

    /// Writes `/pieces` where bodies can break; once, at the end of the run.
    pub fn write_pieces(&mut self, model: &Model) -> Result<()> {
        match model.can_break() {
            true => self.writer.write_table("pieces", &breakage_meter::pieces(model)),
            false => Ok(()),
        }
    }

    /// Keeps what is known of the increment that stopped the run in `/status`.
    pub fn write_dossier(&mut self, dossier: &Dossier) -> Result<()> {
        let contact = dossier.worst_contact.as_ref().map_or(String::new(), ToString::to_string);
        let mut entries = vec![
            ("worst_contact", contact),
            ("contacts", format!("{} stick, {} slide", dossier.sticking, dossier.sliding)),
            ("residual_history", dossier.history_line()),
            ("advice", dossier.advice.join("\n")),
        ];
        if let Some(worst) = &dossier.worst_body {
            entries.push(("worst_body", worst.name.clone()));
            entries.push(("out_of_balance", format!("{:e}", worst.out_of_balance)));
        }
        self.writer.set_dossier(&entries)
    }

    pub fn finish(&mut self, outcome: FileOutcome, reason: &str) -> Result<()> {
        self.writer.finish(outcome, reason, self.sums.increments)
    }

    fn save(&mut self, state: State, cell_fields: &[CellFields]) -> Result<()> {
        self.unsaved = None;
        // An increment that rebalances has the time of the one before it; times of saved states grow.
        let time = if self.states > 0 { state.time.max(self.sums.saved.next_up()) } else { state.time };
        self.sums.saved = time;
        let (damage, failed, carriers) = self.points.cells_of(&state.cells);
        let level = |body: usize| state.levels.get(body).copied().unwrap_or(0);
        let fidelity: Vec<u8> = carriers.iter().map(|body| body.map_or(0, level)).collect();
        let saved = self.writer.save_state(&FieldState {
            fidelity: &fidelity,
            time,
            increment: state.increment,
            displacement: &self.points.displacements(&state.poses, &carriers, cell_fields),
            damage: &damage,
            failed: &failed,
            fragment: &carriers.iter().map(|body| body.map_or(-1, |body| body as i32)).collect::<Vec<_>>(),
            stress: &self.points.cell_stresses(&state.stress, &carriers, cell_fields),
        })?;
        let grain = |(index, pose): (usize, &Pose)| {
            let local = state.local_strains.get(index).unwrap_or(&LocalStrain::UNKNOWN);
            let breaking = state.grains.get(index).copied().unwrap_or_default();
            GrainRow {
                position: pose.position,
                rotation: pose.rotation.scaled_axis(),
                stress: state.stress.get(index).map_or([f64::NAN; 6], components),
                damage_mean: breaking.damage_mean,
                damage_max: breaking.damage_max,
                failed_fraction: breaking.failed_fraction,
                fragments: breaking.parts as i64,
                local_shear_strain: local.shear,
                local_volumetric_strain: local.volumetric,
                turn: local.rotation,
                level: level(index).into(),
            }
        };
        if self.grains > 0 {
            let grains: Vec<GrainRow> = state.poses.iter().take(self.grains).enumerate().map(grain).collect();
            self.writer.save_grains(&grains)?;
        }
        if self.with_contacts {
            self.writer.write_table(&format!("contacts/{saved}"), &state.contacts.columns())?;
        }
        self.states = saved + 1;
        Ok(())
    }
}
