//! Two equal condensed spheres, facets that do not match, pressed together by P (Hertz 1882) and then pushed across by Q, less than what friction holds
//! (Cattaneo 1938, Mindlin 1949). With `E' = E / (1 - nu^2)`, `G = E / 2 (1 + nu)`, radii R each:
//!
//! ```text
//! a^3 = 3 P R / 4 E'      d = 2 a^2 / R      p0 = 3 P / 2 pi a^2
//! c/a = (1 - Q / mu P)^(1/3)      t = 3 mu P (2 - nu) / (8 G a) (1 - (1 - Q / mu P)^(2/3))
//! ```
//!
//! c is the radius inside of which the surfaces stick, t the way across. R = 12 mm, E = 30 GPa, nu = 0.2, P = 51.03 N: d = 10 um, a = 0.2449 mm,
//! p0 = 406.1 MPa.
//!
//! Of the points that carry, a comes from the mean square of the distance from their centre (`2/5 a^2` for Hertz's pressure), p0 from P and a, c from the share of P that sticks,
//! `1 - (1 - c^2/a^2)^(3/2)`.
//!
//! The approach of whole spheres is [`hertz::approach`]'s, 0.9 % less.
//!
//! Tolerance, from what can be said beforehand about cells of h with nodes `s = h/2` apart and n points that carry:
//!
//! - d: facets between nodes lie up to `s^2 / 8 R` inside each sphere; where pressure ends is known to `s / 2`, and d is stationary in a: `(s / 2 a)^2`; the
//!   onset o takes half of it: `o / 2 d`.
//! - a: where pressure ends is known to half the nodes' distance, p0 to twice that share.
//! - c: where points stick is known to half the nodes' distance.
//! - t: as d where pressure ends; the spheres yield by `0.43 a / R` less than half-spaces, and the moment of Q about the centres shears them by another
//!   `a / R`.

use std::f64::consts::PI;
use std::time::{Duration, Instant};

use crate::contact::ContactLaw;
use crate::loading::StageEnd;
use crate::mesh::NearPoint;
use crate::scene::{BodyLoad, Scene, SceneBody, SceneParameters};
use crate::tensor::Vec3;
use crate::verification::bodies::{HELD, condensed_sphere, drive, fixed, load, scene};
use crate::verification::{Absolute, Findings, Relative, Tolerance, hertz};

pub const RADIUS: f64 = 12e-3;
const YOUNG: f64 = 30e9;
const POISSON: f64 = 0.2;
const ROUNDING: f64 = 5e-5;
const FRICTION: f64 = 0.5;
/// [N]
pub const FORCE: f64 = 51.03;
/// `Q / mu P`.
pub const SHARES: [f64; 3] = [0.25, 0.5, 0.75];
/// Cell sizes at the poles [m] that take seconds.
pub const CELLS: [f64; 2] = [0.4e-3, 0.28e-3];

/// A sphere with cells of this size [m] at the pole that `side` says (1: the upper one), which touches the origin.
pub fn sphere(name: &str, side: f64, cell: f64) -> SceneBody {
    let point = Vec3::new(0.0, 0.0, side * RADIUS);
    let near = NearPoint { point, radius: 0.35e-3, mesh_size: cell, growth: 0.6 };
    condensed_sphere(name, [RADIUS, ROUNDING], 6e-3, &near, [0.0, 0.0, -side * RADIUS])
}

/// Pressed until they touch, then by [`FORCE`], then pushed by each of [`SHARES`].
fn pushed(cell: f64) -> SceneParameters {
    let bodies = vec![fixed(sphere("lower", 1.0, cell)), sphere("upper", -1.0, cell)];
    let touch = drive([Some(0.0), Some(0.0), Some(-4e-6)], HELD);
    let press =
        BodyLoad { force: Some([None, None, Some(-FORCE)]), ..drive([Some(0.0), Some(0.0), None], HELD) };
    let push = |share: f64| BodyLoad {
        force: Some([Some(share * FRICTION * FORCE), None, Some(-FORCE)]),
        ..drive([None, Some(0.0), None], HELD)
    };
    let mut stages = vec![load(2, "upper", touch), load(2, "upper", press)];
    stages.extend(SHARES.map(|share| load(2, "upper", push(share))));
    scene(bodies, FRICTION, stages)
}

/// What is seen of a state.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    /// Of the upper sphere's frame [m].
    pub displacement: Vec3,
    /// Points that carry.
    pub points: usize,
    /// Radius of the contact [m].
    pub radius: f64,
    /// Share of the normal force on points that do not slide.
    pub sticking: f64,
}

fn seen(scene: &Scene, displacement: Vec3) -> Seen {
    let points: Vec<_> = scene.contacts.active().map(|(_, point)| point.evaluation).collect();
    let force: f64 = points.iter().map(|e| e.pressure).sum();
    let centre = points.iter().map(|e| e.point * e.pressure).sum::<Vec3>() / force;
    let square = |x: Vec3| (x - centre).fixed_rows::<2>(0).norm_squared();
    let spread = points.iter().map(|e| e.pressure * square(e.point)).sum::<f64>() / force;
    let sticking = points.iter().filter(|e| !e.slides()).map(|e| e.pressure).sum::<f64>() / force;
    Seen { displacement, points: points.len(), radius: (2.5 * spread).sqrt(), sticking }
}

/// A run with cells of one size.
#[derive(Debug, Clone)]
pub struct Pushed {
    /// At the end of each stage from the pressing on.
    pub seen: Vec<Seen>,
    pub factorisations: usize,
    pub time: Duration,
    /// Why it stopped short; empty where it did not.
    pub trouble: String,
}

pub fn push(cell: f64) -> Pushed {
    let start = Instant::now();
    let mut scene = Scene::new(&pushed(cell)).expect("a sound scene");
    let (mut states, mut factorisations) = (Vec::new(), 0);
    let end = scene.run(|scene, row| {
        factorisations += row.counters.factorisations;
        if row.stage > 0 && row.progress > 1.0 - 1e-9 {
            states.push(seen(scene, row.bodies[1].displacement));
        }
        true
    });
    let trouble = match end {
        StageEnd::Finished => String::new(),
        StageEnd::Stopped { reason } => format!("stopped {reason}"),
        StageEnd::Interrupted => "interrupted".into(),
    };
    Pushed { seen: states, factorisations, time: start.elapsed(), trouble }
}

/// Hertz's contact radius [m].
pub fn radius() -> f64 {
    (0.75 * FORCE * RADIUS * (1.0 - POISSON * POISSON) / YOUNG).cbrt()
}

/// How far the approach by [`FORCE`] may be off with cells of this size, as a share of Hertz's.
pub fn of_approach(cell: f64) -> f64 {
    let (a, node) = (radius(), 0.5 * cell);
    let inside = 2.0 * node * node / (8.0 * RADIUS) + 0.5 * ContactLaw::of_rock(ROUNDING, POISSON).onset;
    inside / (2.0 * a * a / RADIUS) + (0.5 * node / a).powi(2)
}

/// A quantity's name, what was found, what it should be, and how far it may be off.
pub type Compared = (String, f64, f64, Tolerance);

/// All that is compared, in the order of the head.
pub fn compared(cell: f64, states: &[Seen]) -> Vec<Compared> {
    let (a, node) = (radius(), 0.5 * cell);
    let approach = 2.0 * hertz::approach(a);
    let ended = 0.5 * node / a;
    let [pressed, pushed @ ..] = states else { return Vec::new() };
    let peak = |radius: f64| 1.5 * FORCE / (PI * radius * radius);
    let mut all = vec![
        ("approach [m]".into(), -pressed.displacement.z, approach, Relative(of_approach(cell))),
        ("contact radius [m]".into(), pressed.radius, a, Relative(ended)),
        ("peak pressure [Pa]".into(), peak(pressed.radius), peak(a), Relative(2.0 * ended)),
    ];
    for (share, state) in SHARES.iter().zip(pushed) {
        let stick = (1.0 - share).cbrt();
        let found = (1.0 - (1.0 - state.sticking).powf(2.0 / 3.0)).sqrt();
        all.push((format!("stick radius c/a at Q = {share} mu P"), found, stick, Absolute(ended)));
        let shear = YOUNG / (2.0 * (1.0 + POISSON));
        let across = 3.0 * FRICTION * FORCE * (2.0 - POISSON) / (8.0 * shear * a)
            * (1.0 - (1.0 - share).powf(2.0 / 3.0));
        let moved = state.displacement.x - pressed.displacement.x;
        let tolerance = Relative(ended * ended + 1.43 * a / RADIUS);
        all.push((format!("way across [m] at Q = {share} mu P"), moved, across, tolerance));
    }
    all
}

pub(super) fn pressed_and_pushed(findings: &mut Findings) {
    for cell in CELLS {
        let run = push(cell);
        let cost = (run.factorisations, run.time, run.trouble.clone());
        let all = compared(cell, &run.seen);
        if all.len() != 3 + 2 * SHARES.len() {
            findings.compare("all stages", f64::NAN, 1.0, Absolute(0.0), cost.clone());
        }
        for (what, found, reference, tolerance) in all {
            let what = format!("{what}, cells of {:.1} a", cell / radius());
            findings.compare(what, found, reference, tolerance, cost.clone());
        }
    }
}
