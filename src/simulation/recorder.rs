//! Joins the run to its results file: rows, saved states, tables, the end.

use std::borrow::Cow;
use std::path::Path;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::case::{Case, RawCase};
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::results::{
    BodyRow, CaseRecord, Existing, FieldMesh, FieldState, GrainRow, HistoryRow, Outcome as FileOutcome,
    Writer, check_unused,
};
use crate::specimen::Specimen;
use crate::tensor::{Mat3, Pose};
use crate::triaxial::{Rig, RigState, StageEnd, StepReport, Test};

use super::Options;
use super::contact_table::ContactTable;
use super::fields::{Points, field_mesh};
use super::grain_stress::mean_stresses;
use super::observer::StageReport;
use super::plan::PlannedStage;
use super::restart::{RestartKeeper, encode_into};
use super::specimen_table;

/// A state that the file may come to hold.
pub struct State {
    pub time: f64,
    pub increment: u64,
    pub poses: Vec<Pose>,
    /// Of every grain, or of every body of a scene.
    pub stress: Vec<Mat3>,
    pub contacts: ContactTable,
}

/// Running sums of the run.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Sums {
    increments: u64,
    /// External work and energy error of the last accepted increment [J].
    last: [f64; 2],
    stage: StageSums,
    /// Wall-clock time of the run up to here [s].
    seconds: f64,
}

/// Running sums of the present stage.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct StageSums {
    /// Wall-clock time of the run [s].
    begun: f64,
    increments: usize,
    factorisations: i64,
    poorly_closed: usize,
    /// Wall-clock time that the file took [s].
    writing: f64,
    /// External work and energy error at the start [J].
    start: [f64; 2],
    /// Saved states due so far.
    due: usize,
}

/// How far a triaxial test has come.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Position {
    /// Index of the stage at hand.
    pub stage: usize,
    /// Whether loose grains have been brought into touch.
    pub seated: bool,
    /// Whether strains count from the end of the consolidation already.
    pub strains_restarted: bool,
}

/// A restart point of a triaxial test.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct TestPoint<'a> {
    pub at: Position,
    pub test: Cow<'a, Test>,
    pub rig: RigState<'a>,
    pub sums: Sums,
}

/// Writes a run as it goes on.
pub struct Recorder {
    pub(super) writer: Writer,
    clock: Instant,
    /// Wall-clock time of the run before `clock` started [s].
    earlier: f64,
    points: Points,
    grains: usize,
    fields_every: f64,
    with_contacts: bool,
    energy_gate: f64,
    sums: Sums,
    /// The last accepted increment's state, until it is saved.
    unsaved: Option<State>,
    states: usize,
    restarts: RestartKeeper,
    /// Where the test is, for its restart points.
    pub at: Position,
}

/// Whether the results file can be written, before anything is computed.
///
/// # Errors
/// `Error::Usage` where it exists and is not to be replaced, `Error::Results` where another process has it,
/// `Error::Io` where it cannot be made.
pub fn check_target(out: &Path, existing: Existing) -> Result<()> {
    if existing == Existing::Refuse && out.exists() {
        return Err(Error::Usage(format!(
            "{} exists already: --resume continues its run, --force replaces it, --out writes elsewhere",
            out.display()
        )));
    }
    if out.is_dir() {
        return Err(Error::Usage(format!("{} is a directory; --out wants a file", out.display())));
    }
    check_unused(out)?;
    let folder = out.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(|e| Error::io("create", folder, e))?;
    let mut probe = out.as_os_str().to_os_string();
    probe.push(".probe");
    let probe = Path::new(&probe);
    std::fs::File::create(probe).map_err(|e| Error::io("write", out, e))?;
    std::fs::remove_file(probe).map_err(|e| Error::io("write", out, e))
}

/// A results file with its `/case`, complete but empty.
pub fn new_file(case: &Case, source: &RawCase, options: &Options) -> Result<Writer> {
    let record = CaseRecord {
        title: case.title.clone(),
        given: source.text.clone(),
        completed: format!("{:#}", case.completed()),
        seed: case.seed,
        threads: options.threads as u64,
        stages: case.stages.iter().map(|stage| stage.kind().to_string()).collect(),
    };
    Writer::create(&options.out, &record, options.existing)
}

impl Recorder {
    pub fn create(case: &Case, source: &RawCase, options: &Options, clock: Instant) -> Result<Self> {
        Ok(Self::over(new_file(case, source, options)?, case, clock))
    }

    /// Goes on with a file that is open at a restart point.
    pub fn over(writer: Writer, case: &Case, clock: Instant) -> Self {
        Recorder {
            writer,
            clock,
            earlier: 0.0,
            points: Points::default(),
            grains: 0,
            fields_every: case.output.fields_every,
            with_contacts: case.output.contacts,
            energy_gate: case.solver.energy_gate,
            sums: Sums::default(),
            unsaved: None,
            states: 0,
            restarts: RestartKeeper::new(case.output.restart_every),
            at: Position::default(),
        }
    }

    /// Goes on from the sums of a restart point that holds so many states.
    pub fn restore(&mut self, sums: Sums, states: usize) {
        self.earlier = sums.seconds;
        self.sums = sums;
        self.states = states;
    }

    /// Wall-clock time of the run [s], its earlier parts included.
    pub fn seconds(&self) -> f64 {
        self.earlier + self.clock.elapsed().as_secs_f64()
    }

    pub fn wall_time(&self) -> Duration {
        Duration::try_from_secs_f64(self.seconds()).unwrap_or_default()
    }

    /// The sums to store.
    pub fn sums(&self) -> Sums {
        Sums { seconds: self.seconds(), ..self.sums }
    }

    pub fn increments(&self) -> u64 {
        self.sums.increments
    }

    /// Writes `/grains` and `/specimen`.
    pub fn write_specimen(&mut self, case: &Case, specimen: &Specimen, meshes: &[Mesh]) -> Result<()> {
        self.grains = specimen.grains.len();
        self.writer.write_table("grains", &specimen_table::grains(case, specimen, meshes))?;
        for (group, columns) in specimen_table::specimen(specimen, meshes) {
            self.writer.write_table(&group, &columns)?;
        }
        self.writer.commit()
    }

    /// Writes the mesh and the first state: the specimen as generated, which is the reference
    /// configuration. In a continued run the mesh is only compared.
    pub fn begin(&mut self, case: &Case, rig: &Rig, specimen: &Specimen, meshes: &[Mesh]) -> Result<()> {
        self.grains = specimen.grains.len();
        let youngs_modulus = case.rock.youngs_modulus.mean;
        let (mesh, points) = field_mesh(rig, meshes, specimen.diameter, youngs_modulus)?;
        let first = State {
            time: 0.0,
            increment: 0,
            poses: rig.committed.poses.clone(),
            stress: vec![Mat3::zeros(); self.grains],
            contacts: ContactTable::default(),
        };
        self.begin_fields(mesh, points, first)
    }

    /// Writes a mesh and the first state, or compares the mesh with that of a continued run.
    pub fn begin_fields(&mut self, mesh: FieldMesh, points: Points, first: State) -> Result<()> {
        self.points = points;
        self.writer.set_mesh(mesh)?;
        if self.writer.states() == 0 {
            self.save(first)?;
            self.writer.commit()?;
        }
        Ok(())
    }

    /// Stores the specimen for all restart points.
    pub fn save_specimen(&mut self, specimen: &Specimen) -> Result<()> {
        let mut bytes = Vec::new();
        encode_into(&mut bytes, specimen, self.writer.path())?;
        self.writer.save_origin(&bytes)
    }

    pub fn begin_stage(&mut self, stage: &PlannedStage) {
        self.at.stage = stage.index;
        self.sums.stage = StageSums { begun: self.seconds(), start: self.sums.last, ..StageSums::default() };
    }

    /// Takes down an accepted increment; it is in the file when this returns.
    pub fn accept(&mut self, stage: &PlannedStage, rig: &Rig, report: &StepReport<'_>) -> Result<HistoryRow> {
        let begun = Instant::now();
        let row = self.row(stage, report);
        let poses = &rig.committed.poses;
        let state = State {
            time: row.time,
            increment: row.increment as u64,
            poses: poses.clone(),
            stress: mean_stresses(&rig.model, &rig.contacts, poses, rig.pressure, self.grains),
            contacts: ContactTable::of(&rig.contacts, &rig.committed.memory, self.grains),
        };
        let position = report.row.progress * stage.axial_strain().unwrap_or(1.0);
        self.append(&row, &[], state, position, report.row.progress)?;
        self.hold(report.test, rig)?;
        self.commit()?;
        self.took_since(begun);
        Ok(row)
    }

    /// Books time spent on the file.
    pub fn took_since(&mut self, begun: Instant) {
        self.sums.stage.writing += begun.elapsed().as_secs_f64();
    }

    /// Appends an increment, and its state where that is due: `position` is what `fields_every` counts.
    pub fn append(
        &mut self,
        row: &HistoryRow,
        bodies: &[BodyRow],
        state: State,
        position: f64,
        progress: f64,
    ) -> Result<()> {
        let sums = &mut self.sums;
        sums.increments += 1;
        let [work, error] = [row.energy_external - sums.last[0], row.energy_error - sums.last[1]];
        sums.last = [row.energy_external, row.energy_error];
        sums.stage.increments += 1;
        sums.stage.factorisations += row.factorisations;
        sums.stage.poorly_closed += usize::from(error.abs() > self.energy_gate * work.abs());
        let due = (position / self.fields_every + 1e-9).floor() as usize;
        let is_due = due > sums.stage.due || progress >= 1.0 - 1e-9;
        sums.stage.due = due;
        self.writer.append(row, bodies)?;
        match is_due {
            true => self.save(state)?,
            false => self.unsaved = Some(state),
        }
        Ok(())
    }

    /// Holds the state of a triaxial test for the next restart point.
    pub fn hold(&mut self, test: &Test, rig: &Rig) -> Result<()> {
        let point = TestPoint { at: self.at, test: Cow::Borrowed(test), rig: rig.state(), sums: self.sums() };
        self.restarts.hold(self.sums.increments, &point, self.writer.path())
    }

    /// As [`Recorder::hold`], for what else can be continued.
    pub fn hold_other(&mut self, point: &impl Serialize) -> Result<()> {
        self.restarts.hold(self.sums.increments, point, self.writer.path())
    }

    /// Commits, with a restart point where one is due.
    pub fn commit(&mut self) -> Result<()> {
        match self.restarts.is_due() {
            true => self.restarts.write(&mut self.writer),
            false => self.writer.commit(),
        }
    }

    /// Writes the restart point that is held, due or not.
    pub fn keep(&mut self) -> Result<()> {
        self.restarts.write(&mut self.writer)
    }

    /// Ends a stage that is done, or the run in the midst of one: then there is a restart point after the last
    /// accepted increment, and its state is saved behind that.
    pub fn end_stage(&mut self) -> Result<()> {
        self.keep()?;
        if let Some(state) = self.unsaved.take() {
            self.save(state)?;
            self.writer.commit()?;
        }
        Ok(())
    }

    pub fn stage_report<'a>(&self, stage: &'a PlannedStage, end: &'a StageEnd) -> StageReport<'a> {
        let (sums, last) = (&self.sums.stage, self.sums.last);
        StageReport {
            stage,
            end,
            increments: sums.increments,
            factorisations: sums.factorisations,
            poorly_closed: sums.poorly_closed,
            energy_error: (last[1] - sums.start[1]) / (last[0] - sums.start[0]),
            wall_time: Duration::try_from_secs_f64(self.seconds() - sums.begun).unwrap_or_default(),
            writing_time: Duration::try_from_secs_f64(sums.writing).unwrap_or_default(),
            states: self.states,
        }
    }

    pub fn finish(&mut self, outcome: FileOutcome, reason: &str) -> Result<()> {
        self.writer.finish(outcome, reason, self.sums.increments)
    }

    fn save(&mut self, state: State) -> Result<()> {
        self.unsaved = None;
        let cells = self.points.cells();
        let saved = self.writer.save_state(&FieldState {
            time: state.time,
            increment: state.increment,
            displacement: &self.points.displacements(&state.poses),
            damage: &vec![0.0; cells],
            failed: &vec![false; cells],
            stress: &self.points.cell_stresses(&state.stress),
        })?;
        let grain = |pose: &Pose| GrainRow {
            position: pose.position,
            rotation: pose.rotation.scaled_axis(),
            damage_mean: 0.0,
            damage_max: 0.0,
            failed_fraction: 0.0,
            fragments: 1,
        };
        if self.grains > 0 {
            let grains: Vec<GrainRow> = state.poses.iter().take(self.grains).map(grain).collect();
            self.writer.save_grains(&grains)?;
        }
        if self.with_contacts {
            self.writer.write_table(&format!("contacts/{saved}"), &state.contacts.columns())?;
        }
        self.states = saved + 1;
        Ok(())
    }

    fn row(&self, stage: &PlannedStage, report: &StepReport<'_>) -> HistoryRow {
        let row = &report.row;
        let (m, ledger, counters) = (&row.measures, &row.ledger, &row.counters);
        HistoryRow {
            stage: stage.index as i64,
            increment: self.sums.increments as i64 + 1,
            time: stage.index as f64 + row.progress,
            axial_strain: m.axial_strain,
            radial_strain: m.radial_strain,
            volumetric_strain: m.volumetric_strain,
            axial_stress: m.axial_stress,
            confining_pressure: m.confining_pressure,
            deviatoric_stress: m.deviatoric_stress,
            mean_stress: m.mean_stress,
            void_ratio: m.void_ratio,
            coordination_number: m.coordination_number,
            sliding_fraction: row.sliding_fraction,
            failed_points: 0,
            deleted_cells: 0,
            fragments: 0,
            augmentations: counters.augmentations as i64,
            newton_iterations: counters.newton_iterations as i64,
            factorisations: counters.factorisations as i64,
            cuts: counters.cuts as i64,
            wall_time: self.seconds(),
            out_of_balance: row.out_of_balance,
            max_penetration: row.max_penetration,
            energy_external: ledger.external,
            energy_elastic: ledger.elastic,
            energy_friction: ledger.friction,
            energy_damage: 0.0,
            energy_stabilisation: ledger.stabilisation,
            energy_membrane: 0.0,
            energy_error: ledger.error(),
        }
    }
}
