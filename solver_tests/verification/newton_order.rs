//! What Newton's method does alone, without drag, cap or line search: its order with the exact tangent.
//!
//! A wedge that slides between two walls, started from five places 0.2 to 4 um off its equilibrium: the forces out of balance fall with
//! order 2. (With the symmetric part of the tangent they need not: docs/decisions/0108-one-tangent.md.)
//!
//! Tolerance: an order comes from the last three forces above rounding, among which contacts still change over; of five the median is
//! judged, to 0.3.

use riprap::solver::{Increment, plain_newton};
use riprap::tensor::{self, Vec3};
use riprap::verification::Run;
use riprap::verification::wedges::pressed;

use crate::audited::audited;

/// How far off the descents start [m].
const OFF: [f64; 5] = [2e-7, 5e-7, 1e-6, 2e-6, 4e-6];

/// What full steps do to the forces out of balance [N] from a start that is off by `off` [m].
fn descent(run: &Run, off: f64) -> Vec<f64> {
    let scene = &run.scene;
    let (committed, loads) = (&scene.committed, scene.loads());
    let increment = Increment { model: &scene.model, committed, loads, settings: &scene.settings };
    let mut start = scene.committed.poses.clone();
    start[0].position += Vec3::new(0.0, 0.3 * off, -off);
    plain_newton(&increment, start, (60, 1e-9))
}

/// The order of the last contraction above 1e-8 N, which rounding leaves of a kilonewton; not a number with less than three forces.
fn order(forces: &[f64]) -> f64 {
    let sound: Vec<f64> = forces.iter().copied().take_while(|force| *force > 1e-8).collect();
    let [.., a, b, c] = sound[..] else { return f64::NAN };
    (c / b).ln() / (b / a).ln()
}

#[test]
fn tangent_is_of_second_order() {
    for degrees in [20f64, 30.0, 45.0] {
        for friction in [0.2, 0.4, 0.65] {
            let run = audited(&pressed(degrees.to_radians(), friction));
            assert!(run.finished(), "a {degrees}, mu {friction}: {:?}", run.end);
            let descents = OFF.map(|off| descent(&run, off));
            let order = tensor::median(descents.iter().map(|forces| order(forces))).unwrap_or(f64::NAN);
            // From the middle start, until a millionth of a newton is left.
            let steps = descents[2].iter().position(|force| *force < 1e-6).unwrap_or(descents[2].len());
            println!("a {degrees}, mu {friction}: order {order:.2}, {steps} steps");
            assert!((order.min(2.0) - 2.0).abs() < 0.3, "a {degrees}, mu {friction}: {order}");
            assert!(steps < 15, "{steps}");
        }
    }
}
