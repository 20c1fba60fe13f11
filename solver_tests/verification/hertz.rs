//! Two condensed spheres pressed together.
//!
//! Hertz (1882): `F = 4/3 E* sqrt(R*) d^(3/2)`, here with E* = E / (2 (1 - nu^2)) = 15.625 GPa, R* = 6 mm:
//! 51.03 N at d = 10 um. The contact radius is 0.245 mm.
//!
//! Tolerance: the spheres are hulls of their surface nodes. Between facets of edge h each lies up to
//! h^2 / (8 R) inside its sphere, and contacts set in over an onset, so that up to
//! `g = 2 h^2 / (8 R) + onset / 2` of the approach closes a gap: F may be low by 1.5 g / d to first
//! order. Linear interpolation of the pressure over an area of few cells adds about half as much.

use riprap::loading::StageEnd;
use riprap::scene::Scene;
use riprap::verification::Tolerance;
use riprap::verification::bodies::{HELD, drive, fixed, load, scene};
use riprap::verification::spheres::{self, RADIUS, SHARES, compared, sphere};

const APPROACH: f64 = 10e-6;

/// Force at the full approach [N], external work and elastic energy [J], and the bound on the error.
fn pressed(cell: f64) -> [f64; 4] {
    let push = drive([Some(0.0), Some(0.0), Some(-APPROACH)], HELD);
    let bodies = vec![fixed(sphere("lower", 1.0, cell)), sphere("upper", -1.0, cell)];
    let mut scene = Scene::new(&scene(bodies, 0.0, vec![load(4, "upper", push)])).expect("a sound scene");
    let mut rows = Vec::new();
    let end = scene.run(|_, row| {
        rows.push(row.clone());
        true
    });
    assert_eq!(end, StageEnd::Finished);
    for row in &rows {
        // Forces of a hundred points coupled through both spheres: Newton finds them, nothing swings.
        assert!(row.counters.cuts == 0 && row.counters.factorisations <= 20, "{:?}", row.counters);
    }
    let last = rows.last().expect("increments");
    let gap = 2.0 * cell * cell / (8.0 * RADIUS) + 0.5 * scene.model.law.onset;
    [last.bodies[1].contact_force.z, last.ledger.external, last.ledger.elastic, 2.25 * gap / APPROACH]
}

#[test]
fn force_converges_to_hertz() {
    let reference = 4.0 / 3.0 * 30e9 / (2.0 * 0.96) * (0.5 * RADIUS).sqrt() * APPROACH.powf(1.5);
    let mut errors = Vec::new();
    for cell in spheres::CELLS {
        let [force, work, elastic, bound] = pressed(cell);
        let error = force / reference - 1.0;
        println!(
            "cell {cell:.1e} m: F {force:.3} N of {reference:.3} N, error {error:+.4} (bound {bound:.3})"
        );
        assert!(error.abs() < bound, "cell {cell}: error {error} beyond {bound}");
        // Trapezoidal work over four increments of a force that goes with d^1.5: 1.6 % high for exact
        // forces; the rest is the gap tolerance, 1e-5 of a sphere's size of 24 mm at 10 um approach.
        assert!((work / elastic - 1.0).abs() < 0.05, "work {work} J, energy {elastic} J");
        errors.push(error.abs());
    }
    // The facets' gap falls with the square of the cells, the onset's and the contact area's do not.
    assert!(errors[1] < errors[0], "no convergence: {errors:?}");
}

/// On a rigid plane, with cells of two thirds, a half and a third of the contact radius: see
/// `verification::hertz`.
#[test]
fn sphere_on_a_plane_converges() {
    use riprap::verification::hertz::{CELLS, bound, force, plane_force, pressed};
    let mut errors = Vec::new();
    for cell in CELLS.into_iter().chain([0.4e-3]) {
        let run = riprap::verification::Run::of(&pressed(cell));
        assert!(run.finished(), "{}", run.trouble());
        let error = plane_force(&run) / force() - 1.0;
        println!(
            "cell {cell:.1e} m: error {error:+.4} (bound {:.3}), {:.1} s",
            bound(cell),
            run.time.as_secs_f64()
        );
        assert!(error.abs() < bound(cell), "cell {cell}: {error}");
        errors.push(error.abs());
    }
    assert!(errors.is_sorted_by(|a, b| a >= b), "no convergence: {errors:?}");
}

/// Pressed by a force and pushed across, with cells of two sizes: see `verification::spheres`.
#[test]
fn pressed_spheres_slip_from_the_rim_inwards() {
    let mut errors = Vec::new();
    for cell in spheres::CELLS {
        let run = spheres::push(cell);
        println!(
            "cells of {cell:.2e} m: {:.1} s, {} factorisations",
            run.time.as_secs_f64(),
            run.factorisations
        );
        assert!(run.trouble.is_empty(), "{}", run.trouble);
        let all = compared(cell, &run.seen);
        assert_eq!(all.len(), 3 + 2 * SHARES.len());
        let mut own = Vec::new();
        for (what, found, reference, tolerance) in all {
            let (error, most) = match tolerance {
                Tolerance::Relative(most) => (found / reference - 1.0, most),
                Tolerance::Absolute(most) => (found - reference, most),
                Tolerance::Short(most) => ((found - reference).min(0.0), most),
            };
            println!("{what}: {found:.4e} of {reference:.4e}, error {error:+.4} (at most {most:.3})");
            assert!(error.abs() < most, "{what}: {error}");
            own.push(error.abs());
        }
        // Which points stick falls as Q grows.
        assert!(run.seen.windows(2).skip(1).all(|two| two[1].sticking < two[0].sticking));
        errors.push(own);
    }
    // The approach has all errors in it; others are sums over few points and need not fall one by one.
    assert!(errors[1][0] < errors[0][0], "no convergence: {errors:?}");
}
