//! The energy balance of an increment: what it measures and what it enters into the ledger, before anything is committed.

use crate::assembly::pressure_loads_into;
use crate::loading::{Ledger, Portion, creates_energy};
use crate::solver::IncrementReport;
use crate::tensor::Vector6;
use crate::triaxial::drive::Drive;
use crate::triaxial::measures::Measures;
use crate::triaxial::rig::Rig;
use crate::triaxial::test::Test;

/// An increment measured, not committed.
pub(super) struct IncrementBalance {
    pub(super) measures: Measures,
    /// With the increment in it.
    pub(super) ledger: Ledger,
    pub(super) energy_gap: f64,
    pub(super) poorly_closed: bool,
    /// Whether the solver has leapt to a state that bodies could not have reached.
    pub(super) creates_energy: bool,
    pub(super) control_error: f64,
    pub(super) ram: f64,
    pub(super) pressure: f64,
}

impl Test {
    /// Measures an increment of a stage, and enters it into a copy of the ledger.
    pub(super) fn balance_energy(
        &self,
        rig: &Rig,
        drive: &Drive,
        report: &IncrementReport,
        portion: Portion,
    ) -> IncrementBalance {
        let pressure = drive.pressure(portion.to, report.factor);
        let new = &report.poses;
        let mut loads = vec![Vector6::zeros(); rig.model.carriers()];
        pressure_loads_into(&mut loads, &rig.model, new, pressure);
        let ram = -(report.contact_wrench[rig.top][2] + loads[rig.top][2]);
        let state = self.state(rig, new, pressure, ram);
        // The ram moves the top plate against all that acts on it there; on all else what acts does work against the drag.
        let ram_work = -report.work[rig.top][2];
        let drag_work = report.work.iter().map(Vector6::sum).sum::<f64>() + ram_work + report.bending_loss;
        let pressure_work = report.pressure_work - 0.5 * (rig.pressure + pressure) * report.elastic_volume;
        let mut ledger = self.ledger;
        ledger.external += ram_work + pressure_work;
        ledger.elastic = report.energy.elastic - self.start_elastic;
        ledger.lose(report);
        ledger.membrane = report.energy.membrane - self.start_membrane;
        let created = ledger.error() - self.ledger.error();
        let released = (self.ledger.elastic - ledger.elastic).max(0.0);
        // Behind springs, the forces between the ends of an increment are not known where bodies bend, nor what snaps in it loses.
        let snaps = report.restless || report.is_snap();
        let known = !(rig.model.waits_for_augmentations() && snaps);
        ledger.stabilisation += if known { drag_work } else { created.max(0.0) };
        let gap = ledger.error() - self.ledger.error();
        let worked = ram_work.abs() + pressure_work.abs();
        let lost = report.lost.friction + report.damage_work() + drag_work.abs();
        let turnover = worked.max(lost);
        let (stored, tolerance) = (report.energy.elastic, rig.settings.force_tolerance);
        IncrementBalance {
            measures: Measures::of(rig, &state, &self.zero),
            ledger,
            energy_gap: if turnover > 0.0 { gap / turnover } else { 0.0 },
            poorly_closed: self.energy_gate.is_breached(gap, turnover, stored, tolerance),
            creates_energy: creates_energy(
                created,
                ram_work + pressure_work + released,
                report.energy.elastic,
            ),
            control_error: drive.miss(portion, &state),
            ram,
            pressure,
        }
    }
}
