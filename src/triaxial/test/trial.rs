//! An increment weighed: what it measures and what it leaves in the books, before anything is committed.

use crate::assembly::pressure_loads_into;
use crate::solver::{IncrementReport, work_between};
use crate::tensor::{Pose, Vector6};
use crate::triaxial::ledger::{Ledger, creates_energy};
use crate::triaxial::measures::Measures;
use crate::triaxial::rig::Rig;
use crate::triaxial::test::{Test, UnderWay};

/// An increment tried, not committed.
pub(super) struct Trial {
    pub(super) measures: Measures,
    pub(super) ledger: Ledger,
    pub(super) energy_gap: f64,
    pub(super) poorly_closed: bool,
    /// Whether friction had to give way by more than the gate allows, since it would have spent more than a snap had.
    pub(super) overdraws: bool,
    /// Whether what is left over of it counts as set free in a snap.
    pub(super) snapped: bool,
    pub(super) creates_energy: bool,
    pub(super) control_error: f64,
    pub(super) ram: f64,
    pub(super) pressure: f64,
}

impl Test {
    /// Measures an increment and enters it into a copy of the ledger.
    pub(super) fn weigh(
        &self,
        rig: &Rig,
        way: &UnderWay,
        report: &IncrementReport,
        share: f64,
        to: f64,
    ) -> Trial {
        self.weigh_as(rig, way, report, [share, to], way.dwells || report.is_snap(&rig.settings))
    }

    /// The same for the increment of a share to a share of the stage that is known to have `snapped`, or not.
    pub(super) fn weigh_as(
        &self,
        rig: &Rig,
        way: &UnderWay,
        report: &IncrementReport,
        [share, to]: [f64; 2],
        snapped: bool,
    ) -> Trial {
        let drive = &way.drive;
        let pressure = drive.pressure(to, report.factor);
        let (old, new) = (&rig.committed.poses, &report.poses);
        let mut loads = vec![Vector6::zeros(); rig.model.carriers()];
        pressure_loads_into(&mut loads, &rig.model, new, pressure);
        let held_up = way.remnants.on(rig.top)[2];
        let balancing = -(report.contact_wrench[rig.top][2] + loads[rig.top][2] + held_up);
        // Where bodies still fall, a loaded plate is not in balance with its ram, whose force is known.
        let ram = if report.fell && drive.is_loaded() { self.ram } else { balancing };
        let state = self.state(rig, new, pressure, ram);
        let lift = new[rig.top].position.z - old[rig.top].position.z;
        let ram_work = 0.5 * (self.ram + ram) * lift;
        let swelling = state.volume - rig.volume(old) + report.elastic_volume;
        let pressure_work = -0.5 * (rig.pressure + pressure) * swelling;
        let mut ledger = self.ledger;
        ledger.external += ram_work + pressure_work;
        ledger.elastic = report.energy.elastic - self.start_elastic;
        ledger.friction += report.energy.friction;
        let crushing = way.remnants.overcome(old, new);
        ledger.damage += report.damage.dissipated + crushing;
        ledger.crushing += crushing;
        ledger.membrane = report.energy.membrane - self.start_membrane;
        let (created, mut overdrawn) = (ledger.error() - self.ledger.error(), 0.0);
        if snapped {
            ledger.stabilisation += created.max(0.0);
            // Slip times the mean of the forces at both ends is an estimate here: nothing is known of the way between.
            overdrawn = (-created).clamp(0.0, report.energy.friction.max(0.0));
            ledger.friction -= overdrawn;
            ledger.overdrawn += overdrawn;
        } else {
            ledger.stabilisation += self.work_of_imbalance(old, &report.left, new, rig.top);
        }
        let gap = ledger.error() - self.ledger.error();
        let turnover = ram_work.abs() + pressure_work.abs();
        let released = (self.ledger.elastic - ledger.elastic).max(0.0);
        let (stored, tolerance) = (report.energy.elastic, rig.settings.force_tolerance);
        let breaches = |gap: f64| self.energy_gate.is_breached(gap, turnover, stored, tolerance);
        Trial {
            measures: Measures::of(rig, &state, &self.zero),
            ledger,
            energy_gap: if turnover > 0.0 { gap / turnover } else { 0.0 },
            poorly_closed: breaches(gap),
            overdraws: breaches(overdrawn),
            snapped,
            creates_energy: creates_energy(
                created,
                ram_work + pressure_work + released,
                report.energy.elastic,
            ),
            control_error: drive.miss(share, to, &state),
            ram,
            pressure,
        }
    }

    /// Work of the forces that the tolerance leaves out of balance, at both ends of a step from `old` to `new` [J]: of what the stabilising
    /// term would have to hold. `left` [N, N m] is that at the end; what the `top` plate lacks along the axis is the ram's.
    fn work_of_imbalance(&self, old: &[Pose], left: &[Vector6<f64>], new: &[Pose], top: usize) -> f64 {
        let work = |(carrier, (from, to)): (usize, (&Pose, &Pose))| {
            let force = |left: &[Vector6<f64>]| left.get(carrier).copied().unwrap_or_else(Vector6::zeros);
            let mut mean = 0.5 * (force(&self.left) + force(left));
            if carrier == top {
                mean[2] = 0.0;
            }
            work_between(from, to, &mean)
        };
        old.iter().zip(new).enumerate().map(work).sum()
    }
}
