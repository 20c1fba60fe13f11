//! Joins the run to its results file: rows, saved states, tables, the end.

use std::path::Path;
use std::time::Instant;

use crate::case::{Case, RawCase};
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::results::{
    CaseRecord, Existing, FieldState, GrainRow, HistoryRow, Outcome as FileOutcome, Writer,
};
use crate::specimen::Specimen;
use crate::tensor::{Mat3, Pose};
use crate::triaxial::{Rig, StageEnd, StepReport};

use super::Options;
use super::contact_table::ContactTable;
use super::fields::{Points, field_mesh};
use super::grain_stress::mean_stresses;
use super::observer::StageReport;
use super::plan::PlannedStage;
use super::profile::Profile;
use super::specimen_table;

/// A state that the file may come to hold.
struct State {
    time: f64,
    increment: u64,
    poses: Vec<Pose>,
    stress: Vec<Mat3>,
    contacts: ContactTable,
}

/// Running sums of the present stage.
#[derive(Debug, Clone, Copy)]
struct StageSums {
    begun: Instant,
    increments: usize,
    factorisations: i64,
    poorly_closed: usize,
    /// External work and energy error at the start [J].
    start: [f64; 2],
    /// Saved states due so far.
    due: usize,
}

/// Writes a run as it goes on.
pub struct Recorder {
    writer: Writer,
    clock: Instant,
    points: Points,
    grains: usize,
    fields_every: f64,
    with_contacts: bool,
    energy_gate: f64,
    increments: u64,
    /// External work and energy error of the last accepted increment [J].
    last: [f64; 2],
    /// The last accepted increment's state, until it is saved.
    unsaved: Option<State>,
    states: usize,
    stage: StageSums,
}

/// Whether the results file can be written, before anything is computed.
///
/// # Errors
/// `Error::Usage` where it exists and is not to be replaced, `Error::Io` where it cannot be made.
pub fn check_target(out: &Path, existing: Existing) -> Result<()> {
    if existing == Existing::Refuse && out.exists() {
        return Err(Error::Usage(format!(
            "{} exists already: --force replaces it, --out writes elsewhere",
            out.display()
        )));
    }
    if out.is_dir() {
        return Err(Error::Usage(format!("{} is a directory; --out wants a file", out.display())));
    }
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
        Ok(Recorder {
            writer: new_file(case, source, options)?,
            clock,
            points: Points::default(),
            grains: 0,
            fields_every: case.output.fields_every,
            with_contacts: case.output.contacts,
            energy_gate: case.solver.energy_gate,
            increments: 0,
            last: [0.0; 2],
            unsaved: None,
            states: 0,
            stage: StageSums {
                begun: clock,
                increments: 0,
                factorisations: 0,
                poorly_closed: 0,
                start: [0.0; 2],
                due: 0,
            },
        })
    }

    pub fn increments(&self) -> u64 {
        self.increments
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
    /// configuration.
    pub fn begin(&mut self, case: &Case, rig: &Rig, specimen: &Specimen, meshes: &[Mesh]) -> Result<()> {
        let youngs_modulus = case.rock.youngs_modulus.mean;
        let (mesh, points) = field_mesh(rig, meshes, specimen.diameter, youngs_modulus)?;
        self.points = points;
        self.writer.set_mesh(mesh)?;
        self.save(State {
            time: 0.0,
            increment: 0,
            poses: rig.committed.poses.clone(),
            stress: vec![Mat3::zeros(); self.grains],
            contacts: ContactTable::default(),
        })?;
        self.writer.commit()
    }

    pub fn begin_stage(&mut self, _stage: &PlannedStage) {
        self.stage = StageSums {
            begun: Instant::now(),
            increments: 0,
            factorisations: 0,
            poorly_closed: 0,
            start: self.last,
            due: 0,
        };
    }

    /// Takes down an accepted increment; it is in the file when this returns.
    pub fn accept(&mut self, stage: &PlannedStage, rig: &Rig, report: &StepReport<'_>) -> Result<HistoryRow> {
        self.increments += 1;
        let row = self.row(stage, report);
        let [work, error] = [row.energy_external - self.last[0], row.energy_error - self.last[1]];
        self.last = [row.energy_external, row.energy_error];
        self.stage.increments += 1;
        self.stage.factorisations += row.factorisations;
        self.stage.poorly_closed += usize::from(error.abs() > self.energy_gate * work.abs());
        self.writer.append(&row, &[])?;
        let poses = &rig.committed.poses;
        let state = State {
            time: row.time,
            increment: self.increments,
            poses: poses.clone(),
            stress: mean_stresses(&rig.model, &rig.contacts, poses, rig.pressure, self.grains),
            contacts: ContactTable::of(&rig.contacts, &rig.committed.memory, self.grains),
        };
        let position = report.row.progress * stage.axial_strain().unwrap_or(1.0);
        let due = (position / self.fields_every + 1e-9).floor() as usize;
        if due > self.stage.due {
            self.stage.due = due;
            self.save(state)?;
        } else {
            self.unsaved = Some(state);
        }
        self.writer.commit()?;
        Ok(row)
    }

    /// Saves the last accepted state if it isn't saved.
    pub fn end_stage(&mut self) -> Result<()> {
        if let Some(state) = self.unsaved.take() {
            self.save(state)?;
            self.writer.commit()?;
        }
        Ok(())
    }

    pub fn stage_report<'a>(&self, stage: &'a PlannedStage, end: &'a StageEnd) -> StageReport<'a> {
        let work = self.last[0] - self.stage.start[0];
        StageReport {
            stage,
            end,
            increments: self.stage.increments,
            factorisations: self.stage.factorisations,
            poorly_closed: self.stage.poorly_closed,
            energy_error: (self.last[1] - self.stage.start[1]) / work,
            wall_time: self.stage.begun.elapsed(),
            states: self.states,
        }
    }

    /// Writes `/profile`.
    pub fn write_profile(&mut self, profile: &Profile) -> Result<()> {
        self.writer.write_table("profile", &profile.columns())
    }

    pub fn finish(&mut self, outcome: FileOutcome, reason: &str) -> Result<()> {
        self.writer.finish(outcome, reason, self.increments)
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
        let grains: Vec<GrainRow> = state.poses.iter().take(self.grains).map(grain).collect();
        self.writer.save_grains(&grains)?;
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
            increment: self.increments as i64,
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
            wall_time: self.clock.elapsed().as_secs_f64(),
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
