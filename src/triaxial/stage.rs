//! Stages: what is driven, and the increments that get there.

use crate::model::Counters;
use crate::solver::{Increment, IncrementReport, StepStatus, advance};
use crate::tensor::{Pose, Vec3};
use crate::triaxial::measures::{Ledger, Measures};
use crate::triaxial::rig::Rig;

/// A stage of a triaxial test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stage {
    /// Isotropic pressure [Pa], the top plate free to follow.
    Consolidate { pressure: f64 },
    /// Axial strain at the held pressure, in increments.
    Shear { axial_strain: f64, increment: f64 },
}

/// How a stage ended.
#[derive(Debug, Clone, PartialEq)]
pub enum StageEnd {
    Finished,
    /// The smallest increment did not converge.
    Stopped {
        reason: String,
    },
    /// The observer asked to stop.
    Interrupted,
}

/// What is known after each accepted increment.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub measures: Measures,
    pub ledger: Ledger,
    pub counters: Counters,
    pub out_of_balance: f64,
    pub sliding_fraction: f64,
    pub max_penetration: f64,
    pub mean_contact_force: f64,
    /// Progress of the stage, 0 to 1.
    pub progress: f64,
}

/// What the observer sees of an accepted increment.
pub struct StepReport<'a> {
    pub row: Row,
    pub increment: &'a IncrementReport,
}

/// Share of the consolidation pressure under which grains are seated. Under a small share the
/// forces are too weak to bring loose grains into touch within the solver's limits.
const SEATING_SHARE: f64 = 0.5;

/// Reference of strains and running sums of a test.
#[derive(Debug, Clone, PartialEq)]
pub struct Test {
    pub rig_height: f64,
    pub rig_volume: f64,
    pub ledger: Ledger,
    /// Elastic energy at the start of the ledger [J].
    start_elastic: f64,
    /// Force of the ram on the top plate, upwards [N].
    ram: f64,
    /// Whether increments that miss tolerance are accepted (experiments) or end the stage.
    pub accept_missed: bool,
    pub missed: usize,
}

impl Test {
    pub fn new(rig: &Rig) -> Self {
        Test {
            rig_height: rig.height(&rig.committed.poses),
            rig_volume: rig.volume(&rig.committed.poses),
            ledger: Ledger::default(),
            start_elastic: 0.0,
            ram: 0.0,
            accept_missed: false,
            missed: 0,
        }
    }

    /// Starts strains and the ledger anew from the present state.
    pub fn restart(&mut self, rig: &Rig, elastic: f64) {
        self.rig_height = rig.height(&rig.committed.poses);
        self.rig_volume = rig.volume(&rig.committed.poses);
        self.ledger = Ledger::default();
        self.start_elastic = elastic;
    }

    /// Runs a stage; `observe` is called after each accepted increment and says whether to go on.
    pub fn run(
        &mut self,
        rig: &mut Rig,
        stage: &Stage,
        observe: &mut dyn FnMut(&Rig, &StepReport<'_>) -> bool,
    ) -> StageEnd {
        let start_pressure = rig.pressure;
        let start_height = rig.height(&rig.committed.poses);
        let (nominal, goal_pressure, top_free) = match *stage {
            Stage::Consolidate { pressure } => (0.1, pressure, true),
            Stage::Shear { axial_strain, increment } => (increment / axial_strain, start_pressure, false),
        };
        let smallest = nominal * 0.5f64.powi(rig.settings.max_cuts as i32);
        let (mut done, mut size) = (0.0f64, nominal);
        let mut last: Option<(Vec<Pose>, f64)> = None;
        let mut cuts = 0;
        while done < 1.0 - 1e-9 {
            let share = size.min(1.0 - done);
            let to = done + share;
            let pressure = start_pressure + to * (goal_pressure - start_pressure);
            let lift = match *stage {
                Stage::Consolidate { .. } => 0.0,
                Stage::Shear { axial_strain, .. } => -share * axial_strain * start_height,
            };
            let loads = rig.loads(top_free, pressure);
            let starts = self.starts(rig, last.as_ref().map(|(p, s)| (p, share / s)), lift, start_height);
            let increment = Increment {
                model: &rig.model,
                committed: &rig.committed,
                loads: &loads,
                settings: &rig.settings,
            };
            let mut report = advance(&increment, starts.clone(), &mut rig.contacts);
            if !report.converged() {
                // Once more with care, from the plainest start, before the increment is cut.
                let settings = rig.settings.cautious();
                let careful = Increment { settings: &settings, ..increment };
                let first = report.counters;
                report = advance(&careful, starts.into_iter().rev().collect(), &mut rig.contacts);
                report.counters.add(&first);
            }
            if !report.converged() {
                let at_floor = share <= smallest * (1.0 + 1e-9);
                if !at_floor && !self.accept_missed {
                    size = 0.5 * share;
                    cuts += 1;
                    continue;
                }
                if !self.accept_missed || report.status == StepStatus::TooClose {
                    return StageEnd::Stopped { reason: describe(rig, &report) };
                }
                self.missed += 1;
            }
            report.counters.cuts = cuts;
            cuts = 0;
            let row = self.book(rig, &report, pressure, to);
            let previous = std::mem::replace(&mut rig.committed.poses, report.poses.clone());
            rig.committed.memory = report.memory.clone();
            rig.committed.fields.clone_from(&report.fields);
            rig.pressure = pressure;
            done = to;
            last = Some((previous, share));
            // Grow back towards the nominal increment after an easy one.
            if report.history.len() <= 8 {
                size = (1.5 * size).min(nominal);
            }
            if !observe(rig, &StepReport { row, increment: &report }) {
                return StageEnd::Interrupted;
            }
        }
        StageEnd::Finished
    }

    /// Brings the loose grains of a compacted specimen into touch under half the
    /// consolidation pressure, before the first row of the history: first to a rough balance, then,
    /// where that is reached, to the tolerance of an increment. Strains and the ledger start from
    /// there. Returns the last report; where it did not converge, the first increment has to.
    pub fn seat(&mut self, rig: &mut Rig, pressure: f64) -> IncrementReport {
        let loads = rig.loads(true, SEATING_SHARE * pressure);
        let mut counters = Counters::default();
        let mut settings = rig.settings.for_seating();
        loop {
            let increment = Increment {
                model: &rig.model,
                committed: &rig.committed,
                loads: &loads,
                settings: &settings,
            };
            let mut report = advance(&increment, vec![rig.committed.poses.clone()], &mut rig.contacts);
            counters.add(&report.counters);
            rig.committed.poses.clone_from(&report.poses);
            rig.committed.memory.clone_from(&report.memory);
            rig.committed.fields.clone_from(&report.fields);
            // What slipped before the test began weakens nothing.
            rig.committed.memory.values_mut().for_each(|pair| pair.slip = 0.0);
            rig.pressure = SEATING_SHARE * pressure;
            self.restart(rig, report.energy.elastic);
            let rough = settings != rig.settings;
            if report.converged() && rough {
                settings = rig.settings.clone();
            } else {
                report.counters = counters;
                return report;
            }
        }
    }

    /// Starting configurations in order of preference: the last motion continued, an affine
    /// squeeze, the driven plate alone.
    fn starts(&self, rig: &Rig, last: Option<(&Vec<Pose>, f64)>, lift: f64, height: f64) -> Vec<Vec<Pose>> {
        let now = &rig.committed.poses;
        let mut plain = now.clone();
        plain[rig.top].position.z += lift;
        let mut starts = Vec::new();
        if let Some((previous, ratio)) = last {
            let mut predicted: Vec<Pose> = now
                .iter()
                .zip(previous)
                .map(|(now, old)| {
                    let turn = (now.rotation * old.rotation.inverse()).scaled_axis();
                    now.moved(&((now.position - old.position) * ratio), &(turn * ratio))
                })
                .collect();
            if lift != 0.0 {
                predicted[rig.top] = plain[rig.top];
            }
            predicted[rig.bottom] = plain[rig.bottom];
            starts.push(predicted);
        }
        if lift != 0.0 {
            let mut squeezed = plain.clone();
            let base = now[rig.bottom].position.z;
            for (i, pose) in squeezed.iter_mut().enumerate() {
                if i != rig.top && i != rig.bottom {
                    pose.position += Vec3::new(0.0, 0.0, lift * (pose.position.z - base) / height);
                }
            }
            starts.push(squeezed);
        }
        starts.push(plain);
        starts
    }

    /// Enters the accepted increment into the ledger and measures it.
    fn book(&mut self, rig: &Rig, report: &IncrementReport, pressure: f64, progress: f64) -> Row {
        let (old, new) = (&rig.committed.poses, &report.poses);
        let (old_volume, volume) = (rig.volume(old), rig.volume(new));
        let height = rig.height(new);
        let mut loads = vec![nalgebra::Vector6::zeros(); rig.model.bodies.len()];
        if let Some(cover) = &rig.model.cover {
            cover.loads_into(&mut loads, new, pressure);
        }
        let ram = -(report.contact_wrench[rig.top][2] + loads[rig.top][2]);
        let lift = new[rig.top].position.z - old[rig.top].position.z;
        let area = volume / height;
        let before = self.ledger;
        let swelling = volume - old_volume + report.elastic_volume;
        self.ledger.external += 0.5 * (self.ram + ram) * lift - 0.5 * (rig.pressure + pressure) * swelling;
        self.ram = ram;
        self.ledger.elastic = report.energy.elastic - self.start_elastic;
        self.ledger.friction += report.energy.friction;
        if report.is_snap() {
            self.ledger.stabilisation += (self.ledger.error() - before.error()).max(0.0);
        }
        let axial_strain = 1.0 - height / self.rig_height;
        let volumetric_strain = 1.0 - volume / self.rig_volume;
        let deviatoric_stress = -ram / area;
        let grains = rig.model.bodies.len() - 2;
        let mut ends = 0;
        for (a, b) in report.memory.keys() {
            ends += usize::from((*a as usize) < grains) + usize::from((*b as usize) < grains);
        }
        let measures = Measures {
            axial_strain,
            radial_strain: 0.5 * (volumetric_strain - axial_strain),
            volumetric_strain,
            axial_stress: pressure + deviatoric_stress,
            confining_pressure: pressure,
            deviatoric_stress,
            mean_stress: pressure + deviatoric_stress / 3.0,
            void_ratio: volume / rig.solid_volume - 1.0,
            coordination_number: ends as f64 / grains as f64,
        };
        Row {
            measures,
            ledger: self.ledger,
            counters: report.counters,
            out_of_balance: report.balance.out_of_balance,
            sliding_fraction: report.measures.sliding_fraction,
            max_penetration: report.measures.max_penetration,
            mean_contact_force: report.measures.mean_force,
            progress,
        }
    }
}

fn describe(rig: &Rig, report: &IncrementReport) -> String {
    match &report.status {
        StepStatus::Converged => "converged".into(),
        StepStatus::TooClose => "bodies overlap at the start of the increment".into(),
        StepStatus::OutOfBalance { body, out_of_balance } => format!(
            "{} is out of balance by {out_of_balance:.2e} of the mean contact force after {} augmentations",
            rig.model.bodies[*body].name,
            report.history.len()
        ),
    }
}
