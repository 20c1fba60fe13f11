//! What Newton's method does alone: its order with the whole tangent and with the symmetric part only, and the answers of both.
//!
//! A wedge that slides between two walls, started from five places 0.2 to 4 um off its equilibrium. With the whole tangent the forces out of balance fall
//! with order 2; with its symmetric part as fast at mu = 0.2, in proportion at 0.4, and at 0.65 they swing at 1e-4 N, which
//! is why riprap has no symmetric path, and no monitor that would have to leave it. Both end in the same place.
//!
//! Tolerance: an order comes from the last three forces above rounding, among which contacts still change over; of five the median is judged, to 0.3.

use crate::model::Loads;
use crate::solver::{Increment, TangentPart, plain_newton};
use crate::tensor::{self, Pose, Vec3};
use crate::verification::wedges::pressed;
use crate::verification::{Absolute, Findings, Run, timed};

/// How far off the descents start [m].
pub const OFF: [f64; 5] = [2e-7, 5e-7, 1e-6, 2e-6, 4e-6];

/// What full steps do to the forces out of balance [N] from a start that is off by `off` [m], and where they end.
pub fn descent(run: &Run, part: TangentPart, off: f64) -> (Vec<f64>, Vec<Pose>) {
    let loads: &Loads = run.scene.loads();
    let Run { scene, .. } = run;
    let increment =
        Increment { model: &scene.model, committed: &scene.committed, loads, settings: &scene.settings };
    let mut start = scene.committed.poses.clone();
    start[0].position += Vec3::new(0.0, 0.3 * off, -off);
    plain_newton(&increment, start, part, (60, 1e-9))
}

/// The order of the last contraction above 1e-8 N, which rounding leaves of a kilonewton; not a number with less than three forces.
pub fn order(forces: &[f64]) -> f64 {
    let sound: Vec<f64> = forces.iter().copied().take_while(|force| *force > 1e-8).collect();
    let [.., a, b, c] = sound[..] else { return f64::NAN };
    (c / b).ln() / (b / a).ln()
}

/// The median of the orders of five descents, and the steps that they took together.
pub fn typical_order(run: &Run) -> (f64, usize) {
    let descents = OFF.map(|off| descent(run, TangentPart::Whole, off).0);
    let steps = descents.iter().map(|forces| steps_to(forces, 1e-6)).sum();
    (tensor::median(descents.iter().map(|forces| order(forces))).unwrap_or(f64::NAN), steps)
}

/// Steps until the forces are below `least` [N].
pub fn steps_to(forces: &[f64], least: f64) -> usize {
    forces.iter().position(|force| *force < least).unwrap_or(forces.len())
}

pub(super) fn orders(findings: &mut Findings) {
    for friction in [0.2, 0.4, 0.65] {
        let run = Run::of(&pressed(30f64.to_radians(), friction));
        let ((observed, steps), time) = timed(|| typical_order(&run));
        let what = format!("order of Newton, at most 2, mu {friction}");
        let cost = (steps, time, run.trouble());
        findings.compare(what, observed.min(2.0), 2.0, Absolute(0.3), cost);
        let (_, end) = descent(&run, TangentPart::Whole, OFF[2]);
        let ((symmetric, other), time) = timed(|| descent(&run, TangentPart::Symmetric, OFF[2]));
        let apart = end.iter().zip(&other).map(|(a, b)| (a.position - b.position).norm()).fold(0.0, f64::max);
        let cost = (steps_to(&symmetric, 1e-6), time);
        // What it leaves out of balance, a millinewton at most, over the stiffness of a wall, 1e8 N/m.
        let what = format!("symmetric part only: ends apart [m], mu {friction}");
        findings.compare(what, apart, 0.0, Absolute(1e-11), cost);
    }
}
