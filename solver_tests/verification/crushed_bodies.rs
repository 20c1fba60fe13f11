//! Whole bodies in the press (`crushing`), nodal contact against rigid plates.
//!
//! - Block in uniaxial compression between frictionless plates: `F = E A delta / L` to 1e-6 before the peak, and the peak at `f_c A` to the size of an increment.
//! - Sphere and grain crushed to the peak and beyond: nothing comes from nowhere, to 1e-3 of the work (second order in the step).
//! - Damage energy of a grain against what work and storage leave over, up to the first snap: 1e-3 of the work (its trapezoid is the largest error).
//! - Sphere, elastic: Hertz at its refined pole, approach measured to the sphere's mean motion. Tolerance as in `verification::hertz`: nodes see
//!   point loads, too soft by 0.64 s/a, and the sphere is a half-space up to a/R.

use riprap::crushing::{Grip, Limits, Part};
use riprap::grain::{Ancestry, DamagedGrain, contact_shapes};
use riprap::material::{DamageLaw, DamageParameters, Elastic, Softening};
use riprap::mesh::{Mesh, NearPoint, cuboid_mesh, grain_mesh, sphere_mesh};
use riprap::tensor::Vec3;
use riprap::verification::crush::{Ending, Press, Record, bench, crush};

use riprap::verification::grains::sample_grain;
use riprap::verification::hertz;

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
                    Ok(shape) => {
                        let over_own = shape.nominal.volume() / mesh.volume();
                        format!("{} cells: body {over_own:.2}", mesh.cells.len())
                    }
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

#[test]
fn damage_takes_what_work_and_storage_leave_over() {
    let mesh = grain_mesh(&sample_grain([10.0, 9.0]), 38).expect("a mesh");
    let press = Press { travel: 1.2e-4, increments: 600, end_share: 1.0, ..Default::default() };
    // Softening slowly, so that damage takes a part before the first snap.
    let parameters = DamageParameters { tension: Softening::Exponent(1.3), ..Default::default() };
    let record = crush(grain(mesh, 25e6, 0.0, &parameters), &press).expect("solvable");
    let snaps = record.rows.windows(2).position(|pair| {
        let [last, row] = [&pair[0], &pair[1]];
        row.force < last.force || row.failed_points > 0
    });
    let last = record.rows[snaps.unwrap_or(record.rows.len() - 1)];
    assert!(last.damage > 0.01 * last.external, "{last:?}");
    assert!(last.stabilisation.abs() <= 1e-3 * last.external, "{last:?}");
}

/// Force of the upper plate over Hertz's at the approach that the sphere's mean motion gives, with cells of this size at the pole.
fn sphere_over_hertz(cell: f64) -> f64 {
    let radius = hertz::RADIUS;
    let near = NearPoint {
        point: Vec3::new(0.0, 0.0, radius),
        radius: hertz::CONTACT + 1e-4,
        mesh_size: cell,
        growth: 0.6,
    };
    let mesh = sphere_mesh(radius, 7e-3, Some(&near)).expect("a mesh");
    let sphere = grain(mesh, 1e11, 0.0, &DamageParameters::default());
    let mut bench = bench(&sphere, Grip::Frictionless);
    let high = bench.plates[1].height;
    let mut part = Part::new(sphere);
    let limits = Limits { max_change: 0.2, tolerance: 1e-3, most_rounds: 5 };
    // The coarse lower pole yields by more: twice nearer to the approach asked for; the force is compared at the one found.
    let (mut travel, mut found) = (2.0 * hertz::APPROACH, f64::NAN);
    for _ in 0..3 {
        bench.plates[1].height = high - travel;
        let settled = part.settle(&bench, &limits, &|| false).expect("solvable").expect("settled");
        let approach = travel + settled.contact.motion[0].z;
        found = settled.contact.force()
            / (hertz::force(hertz::CONTACT) * (approach / hertz::APPROACH).max(0.0).powf(1.5));
        travel *= (hertz::APPROACH / approach).clamp(0.2, 5.0);
    }
    found
}

/// Of F, with cells of h and nodes `s = h / 2` apart. A point's force P over its share of the area, not a pressure, yields by about `P / (E' s)` more, over
/// `pi a^2 / s^2` points `4 s / (3 pi a)` of the approach; F goes with its power of 1.5. The sphere's mean motion is no half-space's: at most as much with `a / R`.
#[test]
fn sphere_in_the_press_meets_hertz() {
    let cell = 0.8e-3;
    let found = sphere_over_hertz(cell);
    let bound = 0.64 * (0.5 * cell / hertz::CONTACT + hertz::CONTACT / hertz::RADIUS);
    println!("sphere: F over Hertz's {found:.4}, cells of {:.2} a", cell / hertz::CONTACT);
    assert!((found - 1.0).abs() <= bound, "{found}");
}
