//! Whole bodies in the press (`crushing`), nodal contact against rigid plates.
//!
//! - Block in uniaxial compression between frictionless plates: `F = E A delta / L` to 1e-6 before the peak, and the peak at `f_c A` to the size of an increment.
//! - Sphere and grain crushed to the peak and beyond: nothing comes from nowhere, to 1e-3 of the work (second order in the step).
//!
//! The elastic part against Hertz is not here: nodal contact needs both poles finely meshed for it.

use crate::crush::{Ending, Press, Record, crush};
use riprap::crushing::Grip;
use riprap::grain::{Ancestry, DamagedGrain, contact_shapes};
use riprap::material::{DamageLaw, DamageParameters, Elastic};
use riprap::mesh::{Mesh, cuboid_mesh, grain_mesh, sphere_mesh};

use riprap::verification::grains::sample_grain;

const E: f64 = 30e9;
const NU: f64 = 0.2;

fn grain(mesh: Mesh, tensile: f64, scatter: f64, parameters: &DamageParameters) -> DamagedGrain {
    let laws = (0..mesh.cells.len())
        .map(|k| {
            let factor = 1.0 + scatter * (k as f64 * 2.3).sin();
            let elastic = Elastic::new(E, NU).expect("allowed");
            DamageLaw::new(elastic, tensile * factor, 10.0 * tensile * factor, parameters, 1e-3)
                .expect("a law")
        })
        .collect();
    DamagedGrain::new(mesh, laws, 2700.0, Ancestry::of_grain(0)).expect("a grain")
}

fn tell(name: &str, record: &Record) {
    let last = record.rows[record.rows.len() - 1];
    let ending = match &record.ending {
        Ending::Finished => "finished".to_string(),
        Ending::Softened => "softened".to_string(),
        Ending::Gone => "gone".to_string(),
        Ending::Stalled { reason } => format!("stalled: {reason}"),
        Ending::Broken(parts) => {
            let meshes: Vec<&Mesh> = parts.fragments.iter().map(|part| part.grain.mesh()).collect();
            let shapes: Vec<String> = contact_shapes(&meshes)
                .iter()
                .zip(&meshes)
                .map(|(shape, mesh)| match shape {
                    Ok(shape) => format!(
                        "{} cells: hull {:.2}, body {:.2}, cut off {:.2}",
                        mesh.cells.len(),
                        shape.hull_over_own,
                        shape.nominal_over_own,
                        shape.cut_off
                    ),
                    Err(error) => format!("{} cells: {error}", mesh.cells.len()),
                })
                .collect();
            format!("broken ({} parts given up): {}", parts.lost.len(), shapes.join("; "))
        }
    };
    println!(
        "{name}: {} rows to {:.3e} m, peak {:.4e} N, work {:.3e} J = elastic {:.3e} + damage {:.3e} + stabilisation {:.1e}, {} points failed, {} cells deleted, {} factors, {ending}",
        record.rows.len() - 1,
        last.travel,
        record.peak(),
        last.external,
        last.elastic,
        last.damage,
        last.stabilisation,
        last.failed_points,
        last.deleted_cells,
        record.rows.iter().map(|row| row.factorisations).sum::<usize>(),
    );
}

/// Nothing comes from nowhere. The trapezoidal work of a step in which the force breaks off is uncertain by half of what it falls short
/// of going on along its secant, times the step; apart from that what damage set free is at most what the plates gave and the grain had stored.
fn ledger_closes(record: &Record) {
    let mut uncertain = 0.0;
    for pair in record.rows.windows(2) {
        let (last, row) = (&pair[0], &pair[1]);
        let secant = if last.travel > 0.0 { last.force / last.travel } else { row.force / row.travel };
        uncertain += 0.5 * (secant * row.travel - row.force).max(0.0) * (row.travel - last.travel);
        assert!(row.stabilisation > -1e-3 * row.external - uncertain, "{row:?} {uncertain:e}");
        assert!(
            row.elastic >= 0.0 && row.force.is_finite() && row.damage >= last.damage - 1e-3 * row.external
        );
    }
}

#[test]
fn block_in_compression() {
    let mesh = cuboid_mesh([10e-3, 10e-3, 20e-3], 10e-3).expect("a mesh");
    let f_c = 100e6;
    let body = grain(mesh, 0.1 * f_c, 0.0, &DamageParameters::default());
    let peak_travel = f_c / E * 20e-3;
    let press = Press {
        grip: Grip::Frictionless,
        travel: 1.5 * peak_travel,
        increments: 60,
        end_share: 0.2,
        ..Default::default()
    };
    let record = crush(body, &press).expect("solvable");
    tell("block", &record);
    for row in &record.rows[1..40] {
        let expected = E * 1e-4 * row.travel / 20e-3;
        assert!((row.force / expected - 1.0).abs() < 1e-6, "{row:?} {expected}");
    }
    assert!((record.peak() / (f_c * 1e-4) - 1.0).abs() < 1.0 / 40.0);
    ledger_closes(&record);
}

#[test]
fn sphere_and_grain_are_crushed() {
    let sphere = sphere_mesh(10e-3, 12e-3, None).expect("a mesh");
    let press =
        Press { travel: 3e-4, increments: 120, end_share: 0.3, most_rounds: 200, ..Default::default() };
    let record = crush(grain(sphere, 25e6, 0.1, &DamageParameters::default()), &press).expect("solvable");
    tell("sphere", &record);
    ledger_closes(&record);

    for (name, recovery) in [("grain, w_c = 1", 1.0), ("grain, w_c = 0", 0.0)] {
        let parameters = DamageParameters { recovery_in_compression: recovery, ..Default::default() };
        let mesh = grain_mesh(&sample_grain([10.0, 9.0]), 38).expect("a mesh");
        let record = crush(grain(mesh, 25e6, 0.1, &parameters), &press).expect("solvable");
        tell(name, &record);
        ledger_closes(&record);
    }
}
