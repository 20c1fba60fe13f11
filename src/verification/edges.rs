//! Edges and corners: crossed edges, corner on corner and on an edge, a prism that rolls over its edges.
//!
//! - Two cubes standing on edge, the edges crossing at an angle, driven into each other by d: one contact, whatever the angle, with
//!   `F = k (d - d_0 / 2)`, d_0 the onset, k half a cube's local stiffness (two in series). Everything is prescribed: 1e-9.
//! - A cube's corner driven onto a corner and onto an edge: by symmetry the same force law, along the approach and without moment.
//! - A hexagonal prism rolled from one face over an edge onto the next, pressed down by P: rolling on the core's corner at distance c from
//!   the axis, the driver's moment is `P c sin(30 deg - angle)`. Tolerance 2e-3 P c away from the first and last degree,
//!   where the face's other corner still carries.

use std::f64::consts::{FRAC_PI_3, FRAC_PI_4};

use crate::scene::SceneParameters;
use crate::tensor::{Rotation, Vec3};
use crate::verification::bodies::{
    HELD, ROUNDING, body, cuboid, drive, fixed, ground, hull, load, push, scene,
};
use crate::verification::{Absolute, Findings, Relative, Run, worse};

/// How far edges and corners are driven into each other [m].
pub const DEPTH: f64 = 20e-6;

/// From the centre of a cube of 0.1 m to the crest of its rounded edge (2 dimensions) or corner (3) [m].
fn crest(dimensions: f64) -> f64 {
    let r = ROUNDING * 0.1;
    (0.05 - r) * dimensions.sqrt() + r
}

/// Two cubes on edge, their edges crossing at `angle` [rad], driven into each other by [`DEPTH`].
pub fn crossing(angle: f64) -> SceneParameters {
    let turn = Rotation::from_scaled_axis([0.0, 0.0, angle].into())
        * Rotation::from_scaled_axis([FRAC_PI_4, 0.0, 0.0].into());
    let lower = fixed(body("lower", cuboid([0.1; 3]), [0.0, 0.0, -crest(2.0)], [FRAC_PI_4, 0.0, 0.0]));
    let upper = body("upper", cuboid([0.1; 3]), [0.0, 0.0, crest(2.0)], turn.scaled_axis().into());
    let stages = vec![load(10, "upper", drive([Some(0.0), Some(0.0), Some(-DEPTH)], HELD))];
    scene(vec![lower, upper], 0.65, stages)
}

/// The force of a single contact of the scene's first two bodies that is overlapped by [`DEPTH`] [N].
pub fn single_contact(run: &Run) -> f64 {
    let model = &run.scene.model;
    model.contact_stiffness(0, 1) * (DEPTH - 0.5 * model.law.onset)
}

pub(super) fn crossed(findings: &mut Findings) {
    for degrees in [15.0f64, 30.0, 45.0, 90.0, 120.0] {
        let run = Run::of(&crossing(degrees.to_radians()));
        let (computed, reference) = (run.at_end(|row| row.bodies[1].contact_force.z), single_contact(&run));
        let what = format!("force [N], {degrees} deg");
        findings.of_run(what, &run, computed, reference, Relative(1e-9));
    }
}

/// What a cube's corner is driven onto.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Onto {
    Corner,
    Edge,
}

/// A cube's corner driven onto another's corner or edge by [`DEPTH`], then led along `way` [m], back past where it was, and back there.
pub fn corner_onto(onto: Onto, friction: f64, way: [f64; 3]) -> SceneParameters {
    let (rotation, lower_crest) = match onto {
        Onto::Corner => (on_corner(1.0).scaled_axis(), crest(3.0)),
        Onto::Edge => (Vec3::new(FRAC_PI_4, 0.0, 0.0), crest(2.0)),
    };
    let lower = fixed(body("lower", cuboid([0.1; 3]), [0.0, 0.0, -lower_crest], rotation.into()));
    let turn = on_corner(-1.0).scaled_axis();
    let upper = body("upper", cuboid([0.1; 3]), [0.0, 0.0, crest(3.0)], turn.into());
    let back = way.map(|x| Some(-2.0 * x));
    let stages = vec![
        load(20, "upper", drive([Some(0.0), Some(0.0), Some(-DEPTH)], HELD)),
        load(50, "upper", drive(way.map(Some), HELD)),
        load(100, "upper", drive(back, HELD)),
        load(50, "upper", drive(way.map(Some), HELD)),
    ];
    scene(vec![lower, upper], friction, stages)
}

/// The rotation that takes a corner of a cube to the top or the bottom.
fn on_corner(sign: f64) -> Rotation {
    let diagonal = Vec3::new(1.0, 1.0, sign).normalize();
    let upright = if sign > 0.0 { Vec3::z() } else { -Vec3::z() };
    Rotation::rotation_between(&diagonal, &upright).unwrap_or_default()
}

pub(super) fn corners(findings: &mut Findings) {
    for (onto, name) in [(Onto::Corner, "corner"), (Onto::Edge, "edge")] {
        let run = Run::of(&corner_onto(onto, 0.0, [5e-4, 4e-4, 0.0]));
        let top = run.rows.get(19).map_or(f64::NAN, |row| row.bodies[1].contact_force.z);
        let single = single_contact(&run);
        findings.of_run(format!("force [N], corner on {name}"), &run, top, single, Relative(1e-6));
        let back = run.at_end(|row| row.bodies[1].contact_force.z);
        let what = format!("force after leaving and coming back [N], {name}");
        findings.of_run(what, &run, back, single, Relative(1e-6));
    }
}

/// What presses the rolling prism down [N].
pub const ROLLING_LOAD: f64 = 1000.0;
/// Circumradius of the prism and rounding of its edges [m].
const RADIUS: f64 = 0.05;
const PRISM_ROUNDING: f64 = 1e-3;

/// Distance of the prism's faces and of its core's corners from the axis [m].
pub fn prism_size() -> [f64; 2] {
    let cos = (0.5 * FRAC_PI_3).cos();
    [RADIUS * cos, (RADIUS * cos - PRISM_ROUNDING) / cos]
}

/// A hexagonal prism rolled over this many faces.
pub fn rolled(increments: usize, faces: usize) -> SceneParameters {
    let corners: Vec<[f64; 3]> = (0..6)
        .flat_map(|k| {
            let angle = FRAC_PI_3 * (k as f64 + 0.5) + FRAC_PI_3 * 0.5;
            [-0.05, 0.05].map(|y| [RADIUS * angle.cos(), y, RADIUS * angle.sin()])
        })
        .collect();
    let [apothem, _] = prism_size();
    let prism = body("prism", hull(&corners, PRISM_ROUNDING), [0.0, 0.0, apothem], [0.0; 3]);
    let turn = FRAC_PI_3 * faces as f64;
    let mut stages = vec![
        load(5, "prism", push([0.0, 0.0, -ROLLING_LOAD])),
        load(increments, "prism", drive([None, Some(0.0), None], [Some(0.0), Some(turn), Some(0.0)])),
    ];
    stages[0].bodies[0].1.rotation = Some(HELD);
    scene(vec![ground(), prism], 0.8, stages)
}

/// The largest deviation of the driver's moment from its closed form over `P c`, away from the first and last
/// degree on each face.
pub fn worst_moment(run: &Run, faces: usize) -> f64 {
    let [_, core] = prism_size();
    let off = |row: &crate::scene::Row| {
        let on_face = row.progress * 60.0 * faces as f64 % 60.0;
        let expected = ROLLING_LOAD * core * (30.0 - on_face).to_radians().sin();
        let counts = row.stage == 1 && (1.0..=59.0).contains(&on_face);
        counts.then(|| (row.bodies[1].reaction_moment.y - expected).abs() / (ROLLING_LOAD * core))
    };
    run.rows.iter().filter_map(off).fold(0.0, worse)
}

pub(super) fn rolling(findings: &mut Findings) {
    for (increments, faces) in [(60, 1), (240, 2)] {
        let run = Run::of(&rolled(increments, faces));
        let what = format!("worst moment off over P c, {faces} faces, {increments} incr.");
        findings.of_run(what, &run, worst_moment(&run, faces), 0.0, Absolute(2e-3));
    }
}
