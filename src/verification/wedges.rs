//! Wedges: pressed between walls, let go, pulled out, and a block pushed up a slope.
//!
//! - Between walls, friction fully mobilised: `P = 2 (N sin a + mu N cos a)`, so `N = P / [2 (sin a + mu cos a)]` on each wall. The
//!   walls draw back under the load, so that the wedge slides at every mu. Tolerance: the force tolerance, 1e-3 of a point's
//!   force, on each of some ten points: 2e-3.
//! - With the load gone it stays jammed iff `mu > tan a`.
//! - NAFEMS CGS-4 (Feng & Prinja 2001, "Benchmark tests for finite element modelling of contact, gapping and sliding",
//!   NAFEMS R0081): a body of weight G is pushed up a slope of tan a by a horizontal force `F = G (mu + tan a) / (1 - mu tan a)`.

use crate::scene::{Row, SceneBody, SceneParameters};
use crate::verification::bodies::{HELD, body, cuboid, drive, fixed, hull, load, push, scene};
use crate::verification::{Absolute, Findings, Relative, Run};

/// What the wedge is pressed with [N].
pub const PRESS: f64 = 1000.0;
/// Half the wedge's height, and half the width of its foot [m].
const HALF: f64 = 0.02;
const FOOT: f64 = 0.02;

/// A wedge of half-angle `angle` and its two walls, lengths times `s`.
fn wedge_and_walls(angle: f64, s: f64) -> [SceneBody; 3] {
    let top = FOOT + 2.0 * HALF * angle.tan();
    let mut corners = Vec::new();
    for y in [-0.02 * s, 0.02 * s] {
        for (z, half) in [(-HALF * s, FOOT * s), (HALF * s, top * s)] {
            corners.extend([[-half, y, z], [half, y, z]]);
        }
    }
    let wedge = body("wedge", hull(&corners, 0.4e-3 * s), [0.0; 3], [0.0; 3]);
    let middle = 0.5 * (FOOT + top);
    let (sin, cos) = angle.sin_cos();
    let size = [0.02 * s, 0.08 * s, (2.0 * HALF / cos + 0.01) * s];
    let wall = |name: &str, side: f64| {
        let position = [side * (middle + 0.01 * cos) * s, 0.0, -0.01 * sin * s];
        body(name, cuboid(size), position, [0.0, side * angle, 0.0])
    };
    [wedge, wall("left", -1.0), wall("right", 1.0)]
}

/// Pressed down by [`PRESS`] while the walls hold, which then draw back by 0.1 mm each.
pub fn pressed(angle: f64, friction: f64) -> SceneParameters {
    const DRAW: f64 = 0.1e-3;
    let mut hold = load(5, "wedge", push([0.0, 0.0, -PRESS]));
    let mut part = load(10, "left", drive([Some(-DRAW), Some(0.0), Some(0.0)], HELD));
    for name in ["left", "right"] {
        hold.bodies.push((name.into(), drive(HELD, HELD)));
    }
    part.bodies.push(("right".into(), drive([Some(DRAW), Some(0.0), Some(0.0)], HELD)));
    scene(wedge_and_walls(angle, 1.0).into(), friction, vec![hold, part])
}

/// The normal force on each wall [N] while the wedge slides down under [`PRESS`].
pub fn normal_force(angle: f64, friction: f64) -> f64 {
    PRESS / (2.0 * (angle.sin() + friction * angle.cos()))
}

/// Force on a wall of a scene of this module (1: left, 2: right) along its normal and up along its face [N].
pub fn on_wall(row: &Row, wall: usize, angle: f64) -> [f64; 2] {
    let side = if wall == 1 { -1.0 } else { 1.0 };
    let (force, (sin, cos)) = (row.bodies[wall].contact_force, angle.sin_cos());
    [side * force.x * cos - force.z * sin, side * force.x * sin + force.z * cos]
}

/// Pressed in between fixed walls, let go over the second stage, lifted by 0.1 mm over the third.
pub fn cycle(angle: f64, friction: f64) -> SceneParameters {
    let [wedge, left, right] = wedge_and_walls(angle, 1.0);
    let stages = vec![
        load(10, "wedge", push([0.0, 0.0, -PRESS])),
        load(20, "wedge", push([0.0; 3])),
        load(20, "wedge", drive([None, None, Some(1e-4)], HELD)),
    ];
    scene(vec![wedge, fixed(left), fixed(right)], friction, stages)
}

/// The normal force on the right wall at the end of each stage of a [`cycle`] [N]; zero where there is none.
pub fn force_by_stage(run: &Run, angle: f64) -> [f64; 3] {
    [0, 1, 2].map(|stage| {
        run.rows.iter().rfind(|row| row.stage == stage).map_or(0.0, |row| on_wall(row, 2, angle)[0])
    })
}

/// Half-angle 20 deg, mu 0.3, all lengths times `s` and forces times `s^2`: pressed, then driven on.
pub fn scaled(s: f64) -> SceneParameters {
    let [wedge, left, right] = wedge_and_walls(20.0f64.to_radians(), s);
    let stages = vec![
        load(5, "wedge", push([0.0, 0.0, -PRESS * s * s])),
        load(5, "wedge", drive([None, None, Some(-2e-6 * s)], HELD)),
    ];
    scene(vec![wedge, fixed(left), fixed(right)], 0.3, stages)
}

/// A block of weight [`PRESS`] on a slope of this tangent, driven up it horizontally by 0.2 mm.
pub fn pushed_up(tangent: f64, friction: f64) -> SceneParameters {
    let angle: f64 = tangent.atan();
    // Turned about y, so that the upper face rises along x.
    let turn = [0.0, -angle, 0.0];
    let along_normal = |distance: f64| [-distance * angle.sin(), 0.0, distance * angle.cos()];
    let slope = fixed(body("slope", cuboid([1.0, 1.0, 0.1]), along_normal(-0.05), turn));
    let block = body("block", cuboid([0.1; 3]), along_normal(0.05), turn);
    let mut down = load(5, "block", push([0.0, 0.0, -PRESS]));
    down.bodies[0].1.rotation = Some(HELD);
    down.bodies[0].1.displacement = Some([Some(0.0), Some(0.0), None]);
    let up = load(10, "block", drive([Some(0.2e-3), Some(0.0), None], HELD));
    scene(vec![slope, block], friction, vec![down, up])
}

/// The horizontal force over the weight on that slope.
pub fn push_over_weight(tangent: f64, friction: f64) -> f64 {
    (friction + tangent) / (1.0 - friction * tangent)
}

pub(super) fn up_a_slope(findings: &mut Findings) {
    for (tangent, friction) in [(0.1, 0.3), (0.1, 0.65), (0.5, 0.3), (-0.1, 0.3)] {
        let run = Run::of(&pushed_up(tangent, friction));
        let computed = run.at_end(|row| row.bodies[1].reaction_force.x / PRESS);
        let quantity = format!("F/G, tan a {tangent}, mu {friction}");
        let reference = push_over_weight(tangent, friction);
        findings.of_run(quantity, &run, computed, reference, Relative(2e-3));
    }
}

pub(super) fn between_walls(findings: &mut Findings) {
    for degrees in [15.0f64, 20.0, 30.0, 45.0, 60.0] {
        for friction in [0.0, 0.2, 0.4, 0.65, 0.8] {
            let angle = degrees.to_radians();
            let run = Run::of(&pressed(angle, friction));
            let computed = run.at_end(|row| on_wall(row, 2, angle)[0]);
            let reference = normal_force(angle, friction);
            let quantity = format!("N [N], a {degrees} deg, mu {friction}");
            findings.of_run(quantity, &run, computed, reference, Relative(2e-3));
        }
    }
}

pub(super) fn let_go(findings: &mut Findings) {
    for (degrees, friction) in [(20.0f64, 0.65), (20.0, 0.2), (10.0, 0.4), (10.0, 0.1), (30.0, 0.8)] {
        let angle = degrees.to_radians();
        let run = Run::of(&cycle(angle, friction));
        let [full, left, _] = force_by_stage(&run, angle);
        // A twentieth of the force tells jammed from loose: what jams keeps several times that.
        let jams = run.finished() && left > 0.05 * full;
        let what = format!("let go, a {degrees} deg, mu {friction}");
        findings.stands(what, &run, jams, friction > angle.tan());
        let free = run.at_end(|row| row.measures.points as f64);
        let what = format!("contacts once lifted, a {degrees} deg, mu {friction}");
        findings.of_run(what, &run, free, 0.0, Absolute(0.0));
    }
}

pub(super) fn scale(findings: &mut Findings) {
    let usual = Run::of(&scaled(1.0));
    let reference = usual.at_end(|row| row.bodies[2].contact_force.x);
    for s in [1e-3, 1e3, 1e6] {
        let run = Run::of(&scaled(s));
        let computed = run.at_end(|row| row.bodies[2].contact_force.x / (s * s));
        // What rounding may do to the last of some ten Newton steps.
        let tolerance = Relative(1e-6);
        findings.of_run(
            format!("force on a wall [N], lengths x {s:e}"),
            &run,
            computed,
            reference,
            tolerance,
        );
    }
}
