//! The rows of `/history` and `/bodies`: what an accepted increment came to.
//!
//! SI units; of a triaxial test compression is positive. Times are wall-clock times of the run and of its
//! increments alone [s].

use crate::loading::{FidelityCounts, Ledger};
use crate::model::{Counters, DamageCounts};
use crate::results::{BodyRow, HistoryRow};
use crate::scene::Row;
use crate::tensor::components;
use crate::triaxial::StepReport;

/// The row of a triaxial test: an accepted increment of a `stage`, the run's `increment`-th. Breakage is
/// measured apart.
pub fn row_of_test(stage: usize, increment: u64, report: &StepReport<'_>, times: [f64; 2]) -> HistoryRow {
    let row = &report.row;
    let (m, ledger) = (&row.measures, &row.ledger);
    let (picture, network) = (&row.picture, &row.picture.network);
    let fabric = components(&network.fabric);
    HistoryRow {
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
        snapped: row.restless.into(),
        unrest: row.unrest,
        out_of_balance: row.out_of_balance,
        max_penetration: row.max_penetration,
        energy_crushing: ledger.crushing,
        energy_reshaped: ledger.reshaped,
        energy_gap: row.energy_gap,
        ..of_both(
            (stage, increment, row.progress),
            (&row.damage, &row.fidelity, &row.counters),
            ledger,
            times,
        )
    }
}

/// The row of a scene, which has no strains and stresses, so those are NaN.
pub fn row_of_scene(row: &Row, times: [f64; 2]) -> HistoryRow {
    let place = (row.stage, row.increment as u64, row.progress);
    HistoryRow {
        coordination_number: 2.0 * row.measures.pairs as f64 / row.bodies.len().max(1) as f64,
        sliding_fraction: row.measures.sliding_fraction,
        out_of_balance: row.balance.out_of_balance,
        max_penetration: row.measures.max_penetration,
        snapped: row.snapped.into(),
        unrest: row.balance.unrest,
        ..of_both(place, (&row.damage, &row.fidelity, &row.counters), &row.ledger, times)
    }
}

/// What rows of tests and of scenes have alike, at the place that a stage, an increment and the stage's progress say.
fn of_both(
    (stage, increment, progress): (usize, u64, f64),
    (damage, fidelity, counters): (&DamageCounts, &FidelityCounts, &Counters),
    ledger: &Ledger,
    [wall_time, solving_time]: [f64; 2],
) -> HistoryRow {
    let count = |n: usize| n as i64;
    HistoryRow {
        stage: count(stage),
        increment: increment as i64,
        time: stage as f64 + progress,
        failed_points: count(damage.failed_points),
        deleted_cells: count(damage.deleted_cells),
        fragments: count(damage.fragments),
        condensed_bodies: count(fidelity.condensed),
        promoted: count(fidelity.promoted),
        demoted: count(fidelity.demoted),
        repeats: count(fidelity.repeats),
        fidelity_error: fidelity.error.unwrap_or(f64::NAN),
        resting_utilisation: fidelity.utilisation,
        transition_jump: fidelity.jump,
        augmentations: count(counters.augmentations),
        newton_iterations: count(counters.newton_iterations),
        factorisations: count(counters.factorisations),
        cuts: count(counters.cuts),
        wall_time,
        solving_time,
        energy_external: ledger.external,
        energy_elastic: ledger.elastic,
        energy_friction: ledger.friction,
        energy_damage: ledger.damage,
        energy_crushing_contacts: ledger.indentation,
        energy_stabilisation: ledger.stabilisation,
        energy_membrane: ledger.membrane,
        energy_error: ledger.error(),
        ..HistoryRow::UNKNOWN
    }
}

/// The rows of `/bodies`, in the order of the scene's bodies.
pub fn body_rows(row: &Row) -> Vec<BodyRow> {
    row.bodies
        .iter()
        .map(|body| BodyRow {
            position: body.position,
            rotation: body.rotation,
            displacement: body.displacement,
            force: body.contact_force,
            moment: body.contact_moment,
            reaction_force: body.reaction_force,
            reaction_moment: body.reaction_moment,
        })
        .collect()
}
