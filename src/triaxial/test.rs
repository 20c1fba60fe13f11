//! A triaxial test in progress: stages, and the books kept over them.

mod balance;
mod breaking;
mod increments;
mod progress;

use serde::{Deserialize, Serialize};

use crate::loading::{EnergyGate, FidelityCounts, Ledger, StageProgress};
use crate::model::{Counters, DamageCounts};
use crate::solver::{DamageSettings, Energies, Increment, IncrementReport, Settings, Stabilisation, advance};
use crate::tensor::Pose;
use crate::triaxial::deformation::LocalStrain;
use crate::triaxial::drive::{Drive, Origin};
use crate::triaxial::measures::{Measures, Picture, Zero};
use crate::triaxial::response::{Curve, Response};
use crate::triaxial::rig::Rig;
use crate::triaxial::stage::{Path, Stage};
use crate::triaxial::test::progress::{Progress, StageState};
use crate::triaxial::watch::Watch;

/// What is known after each accepted increment.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub measures: Measures,
    pub picture: Picture,
    pub response: Response,
    pub ledger: Ledger,
    pub damage: DamageCounts,
    pub fidelity: FidelityCounts,
    /// Energy of the increment that no row of the ledger accounts for, over the larger of the work that
    /// ram and pressure exchanged in it and what it lost.
    pub energy_gap: f64,
    /// Whether that is beyond the gate.
    pub poorly_closed: bool,
    /// Whether more was still moving at its end than was asked for, damage or gaps had not settled, or it took many steps.
    pub restless: bool,
    /// By how much what the stage prescribes is missed: stresses relative to the larger of their value and the
    /// pressure, the volume to what an increment sweeps, the top plate to its travel in it.
    pub control_error: f64,
    pub counters: Counters,
    pub out_of_balance: f64,
    /// Mean force out of balance on a body over the mean contact force.
    pub unrest: f64,
    pub sliding_fraction: f64,
    pub max_penetration: f64,
    pub mean_contact_force: f64,
    /// Progress of the stage, 0 to 1.
    pub progress: f64,
    /// Share of its path, which may be longer than the stage.
    pub path: f64,
}

/// What the observer sees of an accepted increment.
pub struct StepReport<'a> {
    pub row: &'a Row,
    /// What happened around each grain since strains count.
    pub local_strains: &'a [LocalStrain],
    /// The test as the increment left it.
    pub test: &'a Test,
}

/// Share of the consolidation pressure under which grains are seated. Under a small share the
/// forces are too weak to bring loose grains into touch within the solver's limits.
const SEATING_SHARE: f64 = 0.5;
/// References and running sums of a test.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Test {
    /// Where strains count from.
    pub zero: Zero,
    pub ledger: Ledger,
    /// Whether increments whose energy does not close are cut.
    pub energy_gate: EnergyGate,
    /// Elastic energy at the start of the ledger [J].
    start_elastic: f64,
    /// Energy of the membrane's sheet there [J].
    start_membrane: f64,
    /// Force of the ram on the top plate, upwards [N].
    ram: f64,
    /// Whether the top plate is under a load, not driven.
    loaded: bool,
    /// Height at which the last drive upwards began [m].
    turning: Option<f64>,
    /// Largest friction angle since strains count [rad].
    peak_friction_angle: f64,
    progress: Option<Progress>,
}

impl Test {
    pub fn new(rig: &Rig) -> Self {
        Test {
            zero: Zero::of(rig),
            ledger: Ledger::default(),
            energy_gate: EnergyGate::default(),
            start_elastic: 0.0,
            start_membrane: 0.0,
            ram: 0.0,
            loaded: true,
            turning: None,
            peak_friction_angle: f64::NEG_INFINITY,
            progress: None,
        }
    }

    /// Counts strains from the present state on.
    pub fn zero_strains(&mut self, rig: &Rig) {
        self.zero = Zero::of(rig);
        self.peak_friction_angle = f64::NEG_INFINITY;
    }

    /// Starts strains and the ledger anew from the present state.
    pub fn restart(&mut self, rig: &Rig, energy: &Energies) {
        self.zero_strains(rig);
        self.ledger = Ledger::default();
        self.start_elastic = energy.elastic;
        self.start_membrane = energy.membrane;
    }

    /// Whether a stage was interrupted; the next [`Test::run`] goes on with it.
    pub fn is_under_way(&self) -> bool {
        self.progress.is_some()
    }

    /// The measures of the committed state.
    pub fn measures(&self, rig: &Rig) -> Measures {
        Measures::of(rig, &self.state(rig, &rig.committed.poses, rig.pressure, self.ram), &self.zero)
    }

    /// Resolves a stage against the present state; `None` where there is nothing to do.
    fn begin(&mut self, rig: &Rig, stage: &Stage) -> Option<Progress> {
        let origin = self.state(rig, &rig.committed.poses, rig.pressure, self.ram);
        let drive = Drive::new(stage, origin, self.zero.height, self.turning);
        let watch = Watch::new(&stage.until, origin.deviatoric_stress, origin.pressure);
        if drive.axial_strain() < 0.0 && !watch.done {
            self.turning = Some(origin.height);
        }
        if matches!(stage.path, Path::Return { .. }) && drive.axial_strain() <= 0.0 {
            return None;
        }
        let mut curve = Curve::new(self.peak_friction_angle);
        let start = Measures::of(rig, &origin, &self.zero);
        curve.push(start.axial_strain, start.volumetric_strain, origin.deviatoric_stress, origin.pressure);
        let pace = drive.pace(&stage.steps, 0.5f64.powi(rig.settings.max_cuts as i32));
        Some(StageProgress::new(pace, StageState::new(drive, watch, curve)))
    }

    /// Lays a rubber membrane against the grains under the pressure that they are then seated under.
    ///
    /// # Errors
    /// The reason, with numbers, where it does not come to lie.
    pub fn lay_membrane(&mut self, rig: &mut Rig, pressure: f64) -> std::result::Result<(), String> {
        if rig.model.membrane.is_none() {
            return Ok(());
        }
        let pressure = SEATING_SHARE * pressure;
        match rig.lay_membrane(pressure) {
            Some(laid) if laid.converged => Ok(()),
            Some(laid) => Err(format!(
                "the membrane did not come to lie against the grains under {:.3} MPa: a node is out of balance by \
                 {:.2e} of its load after {} steps; {}",
                1e-6 * pressure,
                laid.out_of_balance,
                laid.counters.newton_iterations,
                rig.membrane_trouble(pressure)
            )),
            None => Err("the membrane overlaps a grain before it is laid against them".into()),
        }
    }

    /// Brings the loose grains of a compacted specimen into touch under half the
    /// consolidation pressure, before the first row of the history: first to a rough balance, then,
    /// where that is reached, to the tolerance of an increment. Strains and the ledger start from
    /// there. Returns the last report; where it did not converge, the first increment has to.
    pub fn seat(&mut self, rig: &mut Rig, pressure: f64) -> IncrementReport {
        let loads = rig.loads(true, SEATING_SHARE * pressure);
        let mut counters = Counters::default();
        // Grains do not break by being put into touch.
        let fine = Settings {
            stabilisation: Stabilisation::Rest,
            damage: DamageSettings { moves: false, ..rig.settings.damage },
            ..rig.settings.clone()
        };
        let mut settings = fine.for_seating();
        let fine = fine.relaxed_together();
        loop {
            let increment = Increment {
                model: &rig.model,
                committed: &rig.committed,
                loads: &loads,
                settings: &settings,
            };
            let mut report = advance(&increment, vec![rig.committed.poses.clone()], &mut rig.contacts);
            counters.add(&report.counters);
            report.commit_to(&mut rig.committed);
            // What slipped before the test began weakens nothing.
            rig.committed.memory.values_mut().for_each(|pair| pair.slip = 0.0);
            rig.pressure = SEATING_SHARE * pressure;
            rig.committed.pressure = Some(rig.pressure);
            self.restart(rig, &report.energy);
            let rough = settings != fine;
            if report.converged() && rough {
                settings = fine.clone();
            } else {
                report.counters = counters;
                return report;
            }
        }
    }

    /// What a stage can depend on, in the configuration `poses`.
    fn state(&self, rig: &Rig, poses: &[Pose], pressure: f64, ram: f64) -> Origin {
        let (height, volume) = (rig.height(poses), rig.volume(poses));
        Origin {
            height,
            volume,
            pressure,
            deviatoric_stress: -ram * height / volume,
            top: poses[rig.top].position.z,
            loaded: self.loaded,
        }
    }
}
