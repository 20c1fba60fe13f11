//! A condensed sphere pressed onto a rigid plane (Hertz 1882): `a^2 = R d`, `F = 4/3 E' sqrt(R) d^(3/2)`, `E' = E / (1 - nu^2)`. By symmetry that is two
//! equal spheres at twice the approach, with the contacts at the nodes of one of them: nothing is lost to gaps between facets.
//!
//! Cells of h at the pole have contact points `s = h/2` apart (their middle nodes touch too). Tolerance, as a share of F, from two things that can be said
//! beforehand:
//!
//! - A point's force P over its share of the area, not a pressure, yields by about `P / (E' s)` more, over `n = pi a^2 / s^2` points
//!   `4 s / (3 pi a)` of the approach, and `F` goes with its power of 1.5: `0.64 s / a`.
//! - The sphere is held by its mean motion, not at infinity: the half-space beyond R yields by `F / (pi E' R)`, which is
//!   `0.64 a / R` of F. The sphere is the stiffer one: finer cells than these pass Hertz's force, by 2.7 and 3.5 % at h = 0.33 and 0.28 a.
//!
//! The error must also fall with the cells. The approach is chosen for `a = 0.1 R`, so that meshes of affordable size have some points
//! across the contact: 62 with h = a/2.

use crate::mesh::NearPoint;
use crate::scene::{SceneBody, SceneParameters};
use crate::tensor::Vec3;
use crate::verification::bodies::{HELD, body, condensed_sphere, cuboid, drive, fixed, load, scene};
use crate::verification::{Findings, Relative, Run};

/// Of the sphere [m].
pub const RADIUS: f64 = 12e-3;
const YOUNG: f64 = 30e9;
const POISSON: f64 = 0.2;
/// More than the approach, which the cores must not eat up.
const ROUNDING: f64 = 4e-4;
/// Contact radius [m].
pub const CONTACT: f64 = 0.1 * RADIUS;
/// The approach that gives it [m].
pub const APPROACH: f64 = CONTACT * CONTACT / RADIUS;
/// Cell sizes at the pole [m] that take seconds.
pub const CELLS: [f64; 2] = [0.8e-3, 0.6e-3];

/// The sphere with cells of this size [m] at its lower pole, driven onto the plane.
pub fn pressed(cell: f64) -> SceneParameters {
    let point = Vec3::new(0.0, 0.0, -RADIUS);
    let near = NearPoint { point, radius: CONTACT + 1e-4, mesh_size: cell, growth: 0.6 };
    let ball = condensed_sphere("ball", [RADIUS, ROUNDING], 7e-3, &near, [0.0, 0.0, RADIUS]);
    let plane = body("plane", cuboid([0.02, 0.02, 0.01]), [0.0, 0.0, -5e-3], [0.0; 3]);
    let plane = fixed(SceneBody { youngs_modulus: 1e13, ..plane });
    let push = drive([Some(0.0), Some(0.0), Some(-APPROACH)], HELD);
    scene(vec![plane, ball], 0.0, vec![load(2, "ball", push)])
}

/// Hertz's force [N].
pub fn force() -> f64 {
    4.0 / 3.0 * YOUNG / (1.0 - POISSON * POISSON) * RADIUS.sqrt() * APPROACH.powf(1.5)
}

/// How far the force may be off with cells of this size.
pub fn bound(cell: f64) -> f64 {
    0.64 * (0.5 * cell / CONTACT + CONTACT / RADIUS)
}

/// What the plane presses back with [N].
pub fn plane_force(run: &Run) -> f64 {
    run.at_end(|row| row.bodies[1].contact_force.z)
}

pub(super) fn normal(findings: &mut Findings) {
    for cell in CELLS {
        let run = Run::of(&pressed(cell));
        let what = format!("F [N], cells of {:.2} a", cell / CONTACT);
        findings.of_run(what, &run, plane_force(&run), force(), Relative(bound(cell)));
    }
}
