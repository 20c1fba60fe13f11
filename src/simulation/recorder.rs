//! Joins the run to its results file: rows, saved states, tables, the end.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::case::{Case, RawCase};
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::model::Model;
use crate::results::{
    BodyRow, CaseRecord, Column, Existing, FieldMesh, FieldState, GrainRow, HistoryRow,
    Outcome as FileOutcome, Writer, check_unused,
};
use crate::scene::Scene;
use crate::solver::Dossier;
use crate::specimen::Specimen;
use crate::tensor::{Mat3, Pose, components};
use crate::triaxial::{LocalStrain, Measures, Rig, StageCurve, StageEnd, StepReport, Test};

use super::Options;
use super::breaking::{cell_states, grain_states};
use super::contact_table::ContactTable;
use super::draws::{self, Drawn};
use super::fields::{Points, field_mesh};
use super::grain_stress::mean_stresses;
use super::inside::{self, Inside};
use super::kept::{Consolidated, Origin, Position, ScenePoint, State, TestPoint};
use super::meter::{self, Meter};
use super::observer::StageReport;
use super::plan::PlannedStage;
use super::profile::Profile;
use super::restart::{RestartKeeper, encode_into};
use super::specimen_table;

/// A stage of less work than this share of all so far closes its energy against that share.
const LITTLE_WORK: f64 = 1e-3;

/// Running sums of the run.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Sums {
    increments: u64,
    /// External work and energy error of the last accepted increment [J].
    last: [f64; 2],
    stage: StageSums,
    /// Time of the last saved state.
    saved: f64,
    /// Wall-clock time of the run up to here, and of its increments without the file [s].
    seconds: f64,
    solving: f64,
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
    unsaved: Option<State>,
    states: usize,
    restarts: RestartKeeper,
    /// Where the test is, for its restart points.
    pub at: Position,
    /// Of the stage under way.
    curve: StageCurve,
    meter: Meter,
}

/// Links that are followed, one after another.
const MOST_LINKS: usize = 40;

/// The file that `path` leads to over links, there or not.
pub fn followed(path: &Path) -> PathBuf {
    let mut path = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        let Ok(to) = std::fs::read_link(&path) else { break };
        path = path.parent().unwrap_or(Path::new("")).join(to);
    }
    path
}

/// Whether the results file can be written, before anything is computed.
///
/// # Errors
/// `Error::Usage` where it exists and is not to be replaced, is no file or one of the `inputs`, `Error::Results` where another
/// process has it, `Error::Io` where it cannot be made.
pub fn check_target(out: &Path, existing: Existing, inputs: &[PathBuf]) -> Result<()> {
    if existing == Existing::Refuse && out.exists() {
        return Err(Error::Usage(format!(
            "{} exists already: --force replaces it, --out writes elsewhere, riprap run --resume continues a run",
            out.display()
        )));
    }
    if out.is_dir() {
        return Err(Error::Usage(format!("{} is a directory; --out wants a file", out.display())));
    }
    if out.exists() && !out.is_file() {
        return Err(Error::Usage(format!("{} is a device or pipe; --out wants a file", out.display())));
    }
    let place = |path: &Path| std::fs::canonicalize(path).ok();
    for ending in ["", ".new", ".journal"] {
        // Names that the run writes to as well.
        let mut name = out.as_os_str().to_os_string();
        name.push(ending);
        let name = PathBuf::from(name);
        if place(&name).is_some_and(|to| inputs.iter().any(|input| place(input).as_ref() == Some(&to))) {
            let message = format!("{} is what the run reads; --out wants another file", name.display());
            return Err(Error::Usage(message));
        }
    }
    check_unused(out)?;
    let folder = out.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(|e| Error::io("create", folder, e))?;
    // A name that nobody can have put there, and no link is followed.
    let number = std::hash::BuildHasher::hash_one(&std::hash::RandomState::new(), std::process::id());
    let probe = folder.join(format!(".riprap-{number:016x}"));
    let made = std::fs::OpenOptions::new().write(true).create_new(true).open(&probe);
    made.map_err(|e| Error::io("write", out, e))?;
    std::fs::remove_file(&probe).map_err(|e| Error::io("write", out, e))
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
            meter: Meter::new(case),
        }
    }

    /// Goes on from the sums of a restart point that holds so many states, and perhaps one that was not saved yet.
    pub fn restore(&mut self, sums: Sums, curve: StageCurve, states: usize, unsaved: Option<State>) {
        self.unsaved = unsaved;
        self.curve = curve;
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
        self.writer.write_table("grains", &specimen_table::grains(case, specimen, meshes)?)?;
        self.write_rock(&draws::of_specimen(case, meshes)?)?;
        for (group, columns) in specimen_table::specimen(specimen, meshes) {
            self.writer.write_table(&group, &columns)?;
        }
        self.writer.commit()
    }

    /// Writes `/rock`.
    pub fn write_rock(&mut self, drawn: &[Drawn]) -> Result<()> {
        draws::tables(drawn).iter().try_for_each(|(group, columns)| self.writer.write_table(group, columns))
    }

    /// Writes the mesh and the first state: the specimen as generated, which is the reference
    /// configuration. In a continued run the mesh is only compared.
    pub fn begin(&mut self, case: &Case, rig: &Rig, specimen: &Specimen, meshes: &[Mesh]) -> Result<()> {
        let first = State {
            time: 0.0,
            increment: 0,
            poses: rig.committed.poses.clone(),
            stress: vec![Mat3::zeros(); specimen.grains.len()],
            local_strains: Vec::new(),
            contacts: ContactTable::default(),
            cells: Vec::new(),
            grains: Vec::new(),
            levels: rig.levels(),
        };
        self.begin_with((first, &[]), case, rig, specimen, meshes)
    }

    /// As [`Recorder::begin`], with another first state than the reference configuration `rig`.
    pub fn begin_with(
        &mut self,
        first: (State, &[Inside]),
        case: &Case,
        rig: &Rig,
        specimen: &Specimen,
        meshes: &[Mesh],
    ) -> Result<()> {
        self.grains = specimen.grains.len();
        let moduli = draws::moduli_of_specimen(case, meshes)?;
        let apart = case.rock.damage.is_some();
        let (mesh, points) = field_mesh(rig, meshes, specimen.diameter, &moduli, apart)?;
        self.begin_fields(mesh, points, first)
    }

    /// Writes a mesh and the first state, or compares the mesh with that of a continued run.
    pub fn begin_fields(
        &mut self,
        mesh: FieldMesh,
        points: Points,
        (first, insides): (State, &[Inside]),
    ) -> Result<()> {
        self.points = points;
        self.writer.set_mesh(mesh)?;
        if self.writer.states() == 0 {
            self.save(first, insides)?;
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
    pub fn begin_stage(&mut self, stage: &PlannedStage, from: Option<&Measures>) {
        self.at.stage = stage.index;
        self.sums.stage = StageSums { begun: self.seconds(), start: self.sums.last, ..StageSums::default() };
        self.curve = from.map(StageCurve::starting_at).unwrap_or_default();
    }

    /// From here on increments are computed, until one is accepted.
    pub fn begin_solving(&mut self) {
        self.solving_since = Instant::now();
    }

    /// An increment was computed. Returns when that was.
    pub fn end_solving(&mut self) -> Instant {
        let now = Instant::now();
        self.sums.solving += (now - self.solving_since).as_secs_f64();
        now
    }

    /// Wall-clock time of the run, and of its increments [s].
    pub fn times(&self) -> [f64; 2] {
        [self.seconds(), self.sums.solving]
    }

    /// Takes down an accepted increment; it is in the file when this returns.
    pub fn accept(&mut self, stage: &PlannedStage, rig: &Rig, report: &StepReport<'_>) -> Result<HistoryRow> {
        let begun = self.end_solving();
        let mut row = self.row(stage, report);
        meter::note(&mut row, &rig.model, &mut self.meter);
        self.curve.push(&report.row);
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
        let position = report.row.path * stage.axial_strain().unwrap_or(1.0);
        let insides = || inside::of_rig(rig);
        self.append(&row, &[], state, [position, report.row.progress], insides)?;
        self.sums.stage.poorly_closed += usize::from(report.row.poorly_closed);
        self.hold(report.test, rig)?;
        self.commit()?;
        self.took_since(begun);
        Ok(row)
    }

    /// Books time spent on the file.
    pub fn took_since(&mut self, begun: Instant) {
        self.sums.stage.writing += begun.elapsed().as_secs_f64();
    }

    /// Appends an increment and, where that is due, its state with the `insides` of bodies: `position` is what `fields_every` counts.
    pub fn append(
        &mut self,
        row: &HistoryRow,
        bodies: &[BodyRow],
        state: State,
        [position, progress]: [f64; 2],
        insides: impl FnOnce() -> Vec<Inside>,
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
            true => self.save(state, &insides())?,
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

    /// As [`Recorder::hold`], of a scene.
    pub fn hold_scene(&mut self, scene: &Scene) -> Result<()> {
        let point = ScenePoint {
            at: self.at,
            scene: scene.state(),
            sums: self.sums(),
            unsaved: self.unsaved.as_ref().map(Cow::Borrowed),
        };
        self.restarts.hold(self.sums.increments, &point, self.writer.path())
    }

    /// Commits, with a restart point where one is due.
    pub fn commit(&mut self) -> Result<()> {
        match self.restarts.is_due() {
            true => self.restarts.write(&mut self.writer),
            false => self.writer.commit_in_time(),
        }
    }

    /// Writes the restart point that is held, due or not.
    pub fn keep(&mut self) -> Result<()> {
        self.restarts.write(&mut self.writer)
    }

    /// Ends a stage that is done, or the run in the midst of one: then there is a restart point after the last
    /// accepted increment, and its state is saved behind that. A continued run forgets that state; it has it
    /// from the restart point, should it end before another increment. `insides` are those of the bodies of `model` at
    /// `poses`, as committed; where these have moved on from that state without a row, nothing is known of it.
    pub fn end_stage(
        &mut self,
        model: &Model,
        poses: &[Pose],
        insides: impl FnOnce() -> Vec<Inside>,
    ) -> Result<()> {
        self.keep()?;
        if let Some(state) = self.unsaved.take() {
            let is_there = state.poses == model.frames(poses) && state.cells == cell_states(model);
            let insides = if is_there { insides() } else { Vec::new() };
            self.save(state, &insides)?;
            self.writer.commit()?;
        }
        Ok(())
    }

    /// Sums a stage of a test up in `/stages`.
    pub fn sum_up(&mut self, stage: &PlannedStage) -> Result<()> {
        let s = self.curve.summary();
        // A consolidation's confinement changes: its rows have no moduli.
        let [initial, half_way] =
            if stage.consolidates() { [f64::NAN; 2] } else { [s.initial_modulus, s.half_modulus] };
        let number = |name: &str, units: &str, long_name: &str, value: f64| {
            Column::floats(name, units, long_name, vec![value])
        };
        let half = "secant modulus from the start of the stage to half the rise of the deviatoric stress to its peak (E50); none of a consolidation";
        let residual = "mean mobilised friction angle over the last tenth of the stage's axial strain, where q has lost 2 % of its peak by then";
        self.writer.write_table(
            &format!("stages/{}", stage.index),
            &[
                number("peak_deviatoric_stress", "Pa", "largest deviatoric stress of the stage", s.peak[0]),
                number("peak_axial_strain", "1", "axial strain at the largest deviatoric stress", s.peak[1]),
                number(
                    "peak_friction_angle",
                    "rad",
                    "largest mobilised friction angle",
                    s.peak_friction_angle,
                ),
                number("residual_friction_angle", "rad", residual, s.residual_friction_angle),
                number(
                    "initial_modulus",
                    "Pa",
                    "first tangent modulus of the stage; none of a consolidation",
                    initial,
                ),
                number("half_modulus", "Pa", half, half_way),
                number(
                    "largest_dilatancy_angle",
                    "rad",
                    "largest dilatancy angle",
                    s.largest_dilatancy_angle,
                ),
            ],
        )?;
        self.writer.commit()
    }

    pub fn stage_report<'a>(&self, stage: &'a PlannedStage, end: &'a StageEnd) -> StageReport<'a> {
        let (sums, last) = (&self.sums.stage, self.sums.last);
        let work = (last[0] - sums.start[0]).abs().max(LITTLE_WORK * last[0].abs());
        StageReport {
            stage,
            end,
            increments: sums.increments,
            factorisations: sums.factorisations,
            poorly_closed: sums.poorly_closed,
            energy_error: if work == 0.0 { 0.0 } else { (last[1] - sums.start[1]) / work },
            wall_time: Duration::try_from_secs_f64(self.seconds() - sums.begun).unwrap_or_default(),
            writing_time: Duration::try_from_secs_f64(sums.writing).unwrap_or_default(),
            states: self.states,
        }
    }

    /// Writes `/profile`.
    pub fn write_profile(&mut self, profile: &Profile) -> Result<()> {
        self.writer.write_table("profile", &profile.columns())
    }

    /// Writes `/breakage` of a specimen whose grains can break; once, at the end of the run.
    pub fn write_breakage(&mut self, rig: &Rig) -> Result<()> {
        if rig.model.can_break() {
            let breakage = self.meter.final_measure(&rig.model)?;
            self.writer.write_breakage(&breakage)?;
        }
        Ok(())
    }

    /// Writes `/pieces` where bodies can break; once, at the end of the run.
    pub fn write_pieces(&mut self, model: &Model) -> Result<()> {
        match model.can_break() {
            true => self.writer.write_table("pieces", &meter::pieces(model)),
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

    fn save(&mut self, state: State, insides: &[Inside]) -> Result<()> {
        self.unsaved = None;
        // A dwell has the time of the increment before it; times of saved states grow.
        let time = if self.states > 0 { state.time.max(self.sums.saved.next_up()) } else { state.time };
        self.sums.saved = time;
        let (damage, failed, carriers) = self.points.cells_of(&state.cells);
        let level = |body: usize| state.levels.get(body).copied().unwrap_or(0);
        let fidelity: Vec<u8> = carriers.iter().map(|body| body.map_or(0, level)).collect();
        let saved = self.writer.save_state(&FieldState {
            fidelity: &fidelity,
            time,
            increment: state.increment,
            displacement: &self.points.displacements(&state.poses, &carriers, insides),
            damage: &damage,
            failed: &failed,
            fragment: &carriers.iter().map(|body| body.map_or(-1, |body| body as i32)).collect::<Vec<_>>(),
            stress: &self.points.cell_stresses(&state.stress, &carriers, insides),
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

    fn row(&self, stage: &PlannedStage, report: &StepReport<'_>) -> HistoryRow {
        let [wall_time, solving_time] = self.times();
        let row = &report.row;
        let (m, ledger, counters) = (&row.measures, &row.ledger, &row.counters);
        let (picture, network) = (&row.picture, &row.picture.network);
        let fabric = components(&network.fabric);
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
            stress_ratio: m.deviatoric_stress / m.mean_stress,
            void_ratio: m.void_ratio,
            void_ratio_nominal: m.void_ratio_nominal,
            cover_volume_ratio: m.cover_volume_ratio,
            axial_stress_contacts: picture.contact_stress.axial,
            radial_stress_contacts: picture.contact_stress.radial,
            end_friction: picture.contact_stress.end_friction,
            membrane_stress: picture.contact_stress.membrane,
            membrane_axial_stress: picture.contact_stress.membrane_axial,
            stress_disagreement: picture.contact_stress.disagreement,
            control_error: row.control_error,
            tangent_modulus: row.response.tangent_modulus,
            secant_modulus: row.response.secant_modulus,
            dilatancy_angle: row.response.dilatancy_angle,
            friction_angle: row.response.friction_angle,
            peak_friction_angle: row.response.peak_friction_angle,
            coordination_number: network.coordination_number,
            mechanical_coordination_number: network.mechanical_coordination_number,
            rattlers: network.rattlers as i64,
            sliding_fraction: row.sliding_fraction,
            fabric_xx: fabric[0],
            fabric_yy: fabric[1],
            fabric_zz: fabric[2],
            fabric_xy: fabric[3],
            fabric_yz: fabric[4],
            fabric_xz: fabric[5],
            fabric_anisotropy: network.fabric_anisotropy(),
            contact_force_mean: network.force_mean,
            contact_force_max: network.force_max,
            contact_force_variation: network.force_variation,
            strong_fraction: network.strong_fraction,
            chained_fraction: picture.chained_fraction,
            radial_strain_1: picture.slices[0],
            radial_strain_2: picture.slices[1],
            radial_strain_3: picture.slices[2],
            radial_strain_4: picture.slices[3],
            radial_strain_5: picture.slices[4],
            mean_rotation: picture.unevenness.mean_rotation,
            strain_localisation: picture.unevenness.localisation,
            dead_fraction: picture.unevenness.dead_fraction,
            cone_shear: picture.zones.cone_shear,
            band_flatness: picture.zones.band_flatness,
            band_inclination: picture.zones.band_inclination,
            plate_tilt: picture.tilt,
            failed_points: row.damage.failed_points as i64,
            deleted_cells: row.damage.deleted_cells as i64,
            fragments: row.damage.fragments as i64,
            broken_grains: 0,
            breakage_marsal: f64::NAN,
            breakage_hardin: f64::NAN,
            breakage_einav: f64::NAN,
            damaged_share: f64::NAN,
            crushed_share: f64::NAN,
            condensed_bodies: row.fidelity.condensed as i64,
            promoted: row.fidelity.promoted as i64,
            demoted: row.fidelity.demoted as i64,
            repeats: row.fidelity.repeats as i64,
            fidelity_error: row.fidelity.error.unwrap_or(f64::NAN),
            resting_utilisation: row.fidelity.utilisation,
            transition_jump: row.fidelity.jump,
            augmentations: counters.augmentations as i64,
            newton_iterations: counters.newton_iterations as i64,
            factorisations: counters.factorisations as i64,
            snapped: row.restless.into(),
            unrest: row.unrest,
            cuts: counters.cuts as i64,
            wall_time,
            solving_time,
            out_of_balance: row.out_of_balance,
            max_penetration: row.max_penetration,
            energy_external: ledger.external,
            energy_elastic: ledger.elastic,
            energy_friction: ledger.friction,
            energy_damage: ledger.damage,
            energy_crushing: ledger.crushing,
            energy_crushing_contacts: ledger.indentation,
            energy_stabilisation: ledger.stabilisation,
            energy_reshaped: ledger.reshaped,
            energy_membrane: ledger.membrane,
            energy_error: ledger.error(),
            energy_gap: row.energy_gap,
        }
    }
}
