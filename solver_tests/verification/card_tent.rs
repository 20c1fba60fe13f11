//! Two cards leaning on each other, theta from the vertical, each of length L and thickness t.
//!
//! Thin cards stand iff `mu >= tan(theta) / 2`. With thickness and rounded edges (core half length l, half thickness d, rounding r)
//! the moment of a card about its foot gives the push at the top, `H = W (l sin(theta) - d cos(theta)) / (2 l cos(theta) + r)`,
//! and the foot holds iff `mu >= H / W`. Tolerance 2e-3: forces balance to 1e-5 of the mean
//! contact force, and contacts yield by less than a micron over 0.2 m.

use crate::scene_builder::{ROUNDING, Run, body, cuboid, gravity, ground, scene, sharp};

fn stands(theta: f64, share: f64) -> (bool, Run) {
    let (length, thickness, width) = (0.2, 0.01, 0.1);
    let r = ROUNDING * thickness;
    let (l, d) = (0.5 * length - r, 0.5 * thickness - r);
    let (sin, cos) = theta.sin_cos();
    let critical = (l * sin - d * cos) / (2.0 * l * cos + r);
    let height = l * cos + d * sin + r;
    let reach = l * sin + d * cos + r;
    let card = |name: &str, side: f64| {
        body(name, cuboid([thickness, width, length]), [side * reach, 0.0, height], [0.0, -side * theta, 0.0])
    };
    let stages = vec![gravity(5, [0.0, 0.0, -9.81])];
    let bodies = vec![ground(), card("left", -1.0), card("right", 1.0)];
    let run = Run::of(&sharp(scene(bodies, share * critical, stages)));
    let moved = run
        .rows
        .last()
        .map_or(0.0, |row| row.bodies.iter().map(|b| b.displacement.norm()).fold(0.0, f64::max));
    (run.finished() && moved < 1e-3, run)
}

#[test]
fn stands_or_falls_by_friction() {
    for degrees in [15.0f64, 25.0, 35.0, 45.0] {
        for (share, expected) in [(1.002, true), (0.998, false)] {
            let (stands, run) = stands(degrees.to_radians(), share);
            run.tell(
                &format!("card tent {degrees} deg, mu {share} of limit"),
                f64::from(stands),
                f64::from(expected),
            );
            assert_eq!(stands, expected, "{degrees} deg, {share} of the limit: {:?}", run.end);
        }
    }
}
