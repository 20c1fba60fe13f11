//! A hexagonal prism rolled from one face over an edge onto the next, pressed down by P.
//!
//! Contact moves from a face's corners to one edge and to the next face's corners; codes that key histories to other
//! places lose multipliers and slip there. Rolling on the core's corner at distance c from the axis, the driver's moment
//! is `P c sin(30 deg - angle)`: the corner is that far ahead of the axis. Tolerances: 2e-3 P c on the
//! moment, away from the first and last degree, where the face's other corner still carries; the ledger
//! closes to 1e-3 of the largest work, P times the rise of the axis. Where the moment jumps from nothing to `P c / 2` as a face
//! lifts, the trapezoidal rule of the ledger cannot follow: those increments are counted apart.

use crate::scene_builder::{Run, body, drive, ground, hull, load, push, scene};

const LOAD: f64 = 1000.0;

fn rolled(increments: usize, faces: usize) -> (Run, f64, f64) {
    let (radius, rounding) = (0.05, 1e-3);
    let corners: Vec<[f64; 3]> = (0..6)
        .flat_map(|k| {
            let angle = std::f64::consts::FRAC_PI_3 * (k as f64 + 0.5) + std::f64::consts::FRAC_PI_3 * 0.5;
            [-0.05, 0.05].map(|y| [radius * angle.cos(), y, radius * angle.sin()])
        })
        .collect();
    let apothem = radius * (30.0f64).to_radians().cos();
    let core = (apothem - rounding) / (30.0f64).to_radians().cos();
    let prism = body("prism", hull(&corners, rounding), [0.0, 0.0, apothem], [0.0; 3]);
    let turn = 60.0f64.to_radians() * faces as f64;
    let mut stages = vec![
        load(5, "prism", push([0.0, 0.0, -LOAD])),
        load(increments, "prism", drive([None, Some(0.0), None], [Some(0.0), Some(turn), Some(0.0)])),
    ];
    stages[0].bodies[0].1.rotation = Some([Some(0.0); 3]);
    let run = Run::of(&scene(vec![ground(), prism], 0.8, stages));
    (run, core, apothem)
}

#[test]
fn moment_and_work_are_continuous() {
    for (increments, faces) in [(60, 1), (240, 1), (240, 2)] {
        let (run, core, apothem) = rolled(increments, faces);
        assert!(run.finished(), "{:?}", run.end);
        let mut worst = 0.0f64;
        let mut error = 0.0;
        let mut before = None;
        for row in run.rows.iter().filter(|row| row.stage == 1) {
            let angle = row.progress * 60.0 * faces as f64;
            let on_face = angle % 60.0;
            let smooth = (0.99..=59.01).contains(&on_face);
            if let Some(before) = before.filter(|_| smooth) {
                error += row.ledger.error() - before;
            }
            before = smooth.then(|| row.ledger.error());
            if !(1.0..=59.0).contains(&on_face) {
                continue;
            }
            let expected = LOAD * core * (30.0 - on_face).to_radians().sin();
            worst = worst.max((row.bodies[1].reaction_moment.y - expected).abs() / (LOAD * core));
        }
        let rise = LOAD * (core - core * (30.0f64).to_radians().cos());
        let ledger = run.last().ledger;
        run.tell(&format!("rolling, {increments} increments, moment"), worst, 0.0);
        println!(
            "    error of the ledger {:.2e} of the work over a crest, with the jumps {:.2e}; friction {:.2e}, stabilisation {:.2e} of it; \
             height {:.3e} m off",
            error / rise,
            ledger.error() / rise,
            ledger.friction / rise,
            ledger.stabilisation / rise,
            run.last().bodies[1].position.z - apothem
        );
        assert!(worst < 2e-3, "{worst}");
        assert!(error.abs() < 1e-3 * rise * faces as f64, "{error} of {rise}");
    }
}
