//! A cube's corner driven onto a corner, and onto an edge.
//!
//! Normals that come from one facet or another flip there, and cycle. By symmetry the force is along the approach and
//! without moment; it is the derivative of an energy, so it grows continuously. Tolerance 1e-9 of it: everything is
//! prescribed. Then the lower body's corner is passed sideways at a constant height: the force stays bounded by
//! its value at the top, and comes back to it on the way back (no history without friction).

use riprap::tensor::{Rotation, Vec3};

use crate::scene_builder::{HELD, ROUNDING, Run, body, cuboid, drive, fixed, load, scene};

/// The rotation that takes a corner of a cube to the top or the bottom.
fn on_corner(sign: f64) -> Rotation {
    let diagonal = Vec3::new(1.0, 1.0, sign).normalize();
    let upright = if sign > 0.0 { Vec3::z() } else { -Vec3::z() };
    Rotation::rotation_between(&diagonal, &upright).unwrap_or_default()
}

fn crest(dimensions: f64) -> f64 {
    let r = ROUNDING * 0.1;
    (0.05 - r) * dimensions.sqrt() + r
}

fn run(lower_rotation: Vec3, lower_crest: f64, friction: f64, way: [f64; 3], depth: f64) -> Run {
    let lower = fixed(body("lower", cuboid([0.1; 3]), [0.0, 0.0, -lower_crest], lower_rotation.into()));
    let turn = on_corner(-1.0).scaled_axis();
    let upper = body("upper", cuboid([0.1; 3]), [0.0, 0.0, crest(3.0)], turn.into());
    let back = way.map(|x| Some(-2.0 * x));
    let stages = vec![
        load(20, "upper", drive([Some(0.0), Some(0.0), Some(-depth)], HELD)),
        load(50, "upper", drive(way.map(Some), HELD)),
        load(100, "upper", drive(back, HELD)),
        load(50, "upper", drive(way.map(Some), HELD)),
    ];
    Run::of(&scene(vec![lower, upper], friction, stages))
}

#[test]
fn corner_meets_corner_and_edge() {
    let edge_up = Vec3::new(std::f64::consts::FRAC_PI_4, 0.0, 0.0);
    for (name, rotation, lower_crest) in [
        ("corner on corner", on_corner(1.0).scaled_axis(), crest(3.0)),
        ("corner on edge", edge_up, crest(2.0)),
    ] {
        for way in [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [5e-4, 4e-4, 0.0]] {
            let run = run(rotation, lower_crest, 0.0, way, 20e-6);
            assert!(run.finished(), "{name}: {:?}", run.end);
            let model = &run.scene.model;
            let single = model.contact_stiffness(0, 1) * (20e-6 - 0.5 * model.law.onset);
            let top = run.rows[19].bodies[1];
            run.tell(&format!("{name}, force over one contact's"), top.contact_force.z / single, 1.0);
            assert!(top.contact_force.xy().norm() < 1e-9 * single, "{}", top.contact_force);
            assert!(top.contact_moment.norm() < 1e-10 * single, "{}", top.contact_moment);
            let mut before = 0.0;
            for row in &run.rows[..20] {
                assert!(row.bodies[1].contact_force.z >= before);
                before = row.bodies[1].contact_force.z;
            }
            let end = run.last().bodies[1].contact_force;
            assert!((end - top.contact_force).norm() < 1e-6 * single, "{end} {}", top.contact_force);
            for row in &run.rows[20..] {
                assert!(row.bodies[1].contact_force.norm() < 1.05 * top.contact_force.norm());
            }
            let error = run.last().ledger.error().abs();
            assert!(error < 1e-3 * single * 20e-6, "{error}");
        }
    }
}

/// A pair's stiffness is not to depend on which features meet.
#[test]
#[ignore = "corner on corner is counted once from either side: 2.0 times the force of one contact"]
fn corner_on_corner_counts_once() {
    let run = run(on_corner(1.0).scaled_axis(), crest(3.0), 0.0, [0.0; 3], 20e-6);
    let model = &run.scene.model;
    let single = model.contact_stiffness(0, 1) * (20e-6 - 0.5 * model.law.onset);
    let ratio = run.last().bodies[1].contact_force.z / single;
    assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
}
