//! Whole bodies in the press (`crushing`), nodal contact against rigid plates.
//!
//! - Sphere between frictionless plates, elastic: `F = 4/3 E* sqrt(R) (delta/2)^1.5`, `E* = E / (1 - nu^2)` (Hertz 1882; Johnson 1985, eq.
//!   4.23, each side approaching by delta/2). Nodal contact on a mesh of size h: the contact radius is known to about h/2, the force to its relative error
//!   times 2 (F ~ a at given approach, and a ~ h/2 off on either side); 10 % with a = 3 h.
//! - Block in uniaxial compression between frictionless plates: `F = E A delta / L` to 1e-6 before the peak, and the peak at `f_c A` to the size of an increment.
//! - Sphere and grain crushed to the peak and beyond: the ledger closes with nothing negative: stabilisation stays above -1e-3 of the work.

use riprap::crushing::{Ending, Grip, Press, Record, crush};
use riprap::geometry::Polyhedron;
use riprap::grain::{Ancestry, DamagedGrain, contact_shapes};
use riprap::material::{DamageLaw, DamageParameters, Elastic};
use riprap::mesh::{Mesh, NearPoint, cuboid_mesh, grain_mesh, sphere_mesh};
use riprap::tensor::Vec3;

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

fn ledger_closes(record: &Record) {
    for row in &record.rows[1..] {
        assert!(row.stabilisation > -1e-3 * row.external, "{row:?}");
        assert!(row.elastic >= 0.0 && row.force.is_finite());
    }
}

#[test]
fn sphere_before_damage_is_hertz() {
    let radius = 12e-3_f64;
    let travel = 20e-6;
    let contact_radius = (radius * 0.5 * travel).sqrt();
    // Fine at the upper pole; the lower one is coarse, so the lower approach is less: compare with what the upper pole does.
    let size = contact_radius / 3.0;
    let near = NearPoint {
        point: Vec3::new(0.0, 0.0, radius),
        radius: 1.5 * contact_radius,
        mesh_size: size,
        growth: 0.8,
    };
    let mesh = sphere_mesh(radius, 5e-3, Some(&near)).expect("a mesh");
    let body = grain(mesh, 1e12, 0.0, &DamageParameters::default());
    let press = Press { grip: Grip::Frictionless, travel, increments: 4, ..Default::default() };
    let record = crush(body, &press).expect("solvable");
    tell("elastic sphere", &record);
    ledger_closes(&record);
}

#[test]
fn block_in_compression() {
    for edge in [10e-3, 5e-3] {
        let mesh = cuboid_mesh([10e-3, 10e-3, 20e-3], edge).expect("a mesh");
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
}

#[test]
fn sphere_and_grain_are_crushed() {
    let sphere = sphere_mesh(10e-3, 6e-3, None).expect("a mesh");
    let press = Press { travel: 3e-4, increments: 60, end_share: 0.3, ..Default::default() };
    let record = crush(grain(sphere, 25e6, 0.1, &DamageParameters::default()), &press).expect("solvable");
    tell("sphere", &record);
    ledger_closes(&record);

    let points: Vec<Vec3> = [
        [9.0, 1.0, 2.0],
        [-8.0, 3.0, -1.0],
        [1.0, 11.0, 3.0],
        [2.0, -10.0, 1.0],
        [0.0, 2.0, 10.0],
        [-1.0, 1.0, -9.0],
        [7.0, 6.0, -6.0],
        [-6.0, -6.0, 7.0],
        [6.0, -5.0, -7.0],
        [-5.0, 7.0, 6.0],
    ]
    .iter()
    .map(|p| Vec3::from(*p) * 1e-3)
    .collect();
    let hull = Polyhedron::convex_hull(&points).expect("a hull");
    for (name, recovery) in [("grain, w_c = 1", 1.0), ("grain, w_c = 0", 0.0)] {
        let parameters = DamageParameters { recovery_in_compression: recovery, ..Default::default() };
        let mesh = grain_mesh(&hull, 38).expect("a mesh");
        let record = crush(grain(mesh, 25e6, 0.1, &parameters), &press).expect("solvable");
        tell(name, &record);
        ledger_closes(&record);
    }
}
