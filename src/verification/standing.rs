//! What stands and what falls: card tent, three cylinders, a block on three unlike balls, a column of balls.
//!
//! - Two cards of length L and thickness t lean on each other, theta from the vertical. Thin cards stand iff `mu >= tan(theta) / 2`. With
//!   thickness and rounded edges (core half length l, half thickness d, rounding r) the moment of a card about its foot gives the
//!   push at the top, `H = W (l sin(theta) - d cos(theta)) / (2 l cos(theta) + r)`, and the foot holds iff `mu >= H / W`. Contacts
//!   yield by less than a micron over 0.2 m and forces balance to 1e-5: tried at 2e-3 on either side.
//! - A cylinder on two equal ones side by side: stands iff the mutual friction is at least `tan 15 deg = 0.2679` and the ground's at
//!   least a third of that (each lower cylinder turns freely, so both its tangential forces are equal, `W / 2 tan 15 deg`, and the
//!   ground carries 3 W / 2). The cylinders are balls that move in the plane only. Tried at 2e-3 on either side.
//! - A block on three balls, whatever their stiffness: each carries a third. Tolerance 2e-3: the force tolerance on two contacts of a ball.

use crate::contact::law::Friction;
use crate::scene::{SceneBody, SceneParameters, SceneShape};
use crate::verification::bodies::{
    HELD, ROUNDING, body, cuboid, drive, gravity, ground, in_plane, load, scene, sharp,
};
use crate::verification::{Findings, Relative, Run, worse};

/// Cards of 200 x 10 mm at `theta` from the vertical [rad], with `share` of the friction that they need.
fn tent(theta: f64, share: f64) -> SceneParameters {
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
    let bodies = vec![ground(), card("left", -1.0), card("right", 1.0)];
    sharp(scene(bodies, share * critical, vec![gravity(5, [0.0, 0.0, -9.81])]))
}

/// Whether a run finished with every body within a millimetre of where it began.
pub(super) fn stands(run: &Run) -> bool {
    let moved = |b: &crate::scene::BodyState| b.displacement.norm();
    run.finished() && run.at_end(|row| row.bodies.iter().map(moved).fold(0.0, worse)) < 1e-3
}

pub(super) fn card_tent(findings: &mut Findings) {
    for degrees in [15.0f64, 25.0, 35.0, 45.0] {
        for (share, expected) in [(1.002, true), (0.998, false)] {
            let run = Run::of(&tent(degrees.to_radians(), share));
            findings.stands(format!("{degrees} deg, mu {share} of limit"), &run, stands(&run), expected);
        }
    }
}

/// Mutual and ground friction that the three cylinders need.
fn cylinders_need() -> [f64; 2] {
    let mutual = 15.0f64.to_radians().tan();
    [mutual, mutual / 3.0]
}

/// Three cylinders with this mutual friction, and this one on the ground.
fn cylinders(mutual: f64, floor: f64) -> SceneParameters {
    let radius = 0.05;
    let ball = |name: &str, x: f64, z: f64| SceneBody {
        friction: Some(Friction::constant(mutual)),
        ..body(name, SceneShape::Sphere(radius), [x, 0.0, z], [0.0; 3])
    };
    let ground = SceneBody { friction: Some(Friction::constant(floor)), ..ground() };
    let top = radius * (1.0 + 3.0f64.sqrt());
    let bodies =
        vec![ground, ball("left", -radius, radius), ball("right", radius, radius), ball("top", 0.0, top)];
    let mut stage = gravity(8, [0.0, 0.0, -9.81]);
    for name in ["left", "right", "top"] {
        stage.bodies.push((name.into(), in_plane()));
    }
    sharp(scene(bodies, 1.0, vec![stage]))
}

/// Shares of the needed mutual and ground friction, and whether the cylinders stand with them; 2 is ample.
const CYLINDERS: [([f64; 2], bool); 4] =
    [([1.002, 1.002], true), ([2.0, 6.0], true), ([0.998, 6.0], false), ([2.0, 0.998], false)];

pub(super) fn three_cylinders(findings: &mut Findings) {
    let need = cylinders_need();
    for (share, expected) in CYLINDERS {
        let run = Run::of(&cylinders(share[0] * need[0], share[1] * need[1]));
        let what = format!("mu {} mutual, {} ground of limit", share[0], share[1]);
        findings.stands(what, &run, stands(&run), expected);
    }
}

/// A block on three balls of `size` times its width, `ratio` times as stiff as it; weight of the block [N].
pub fn block_on_balls(ratio: f64, size: f64) -> (SceneParameters, f64) {
    let radius = 0.5 * size * 0.1;
    let height = 2.0 * radius + 0.05;
    let block = body("block", cuboid([0.1; 3]), [0.0, 0.0, height], [0.0; 3]);
    // So little of gravity that the softest ball yields by a thousandth of its radius only.
    let pull = if ratio < 1e-4 { 9.81e-3 } else { 9.81 };
    let weight = block.density * 1e-3 * pull;
    let mut bodies = vec![ground(), block];
    for k in 0..3 {
        let angle = std::f64::consts::TAU * k as f64 / 3.0;
        let place = [0.03 * angle.cos(), 0.03 * angle.sin(), radius];
        let ball = body(&format!("ball {k}"), SceneShape::Sphere(radius), place, [0.0; 3]);
        bodies.push(SceneBody { youngs_modulus: 30e9 * ratio, ..ball });
    }
    (scene(bodies, 0.5, vec![gravity(5, [0.0, 0.0, -pull])]), weight)
}

/// Ratios of stiffness and of size that are tried.
pub const UNLIKE: [(f64, f64); 5] = [(1.0, 0.05), (1e-3, 0.02), (1e-6, 0.05), (1e3, 0.02), (1e6, 0.05)];

pub(super) fn unlike_bodies(findings: &mut Findings) {
    for (ratio, size) in UNLIKE {
        let (parameters, weight) = block_on_balls(ratio, size);
        let run = Run::of(&parameters);
        let carried = run.at_end(|row| row.bodies[1].contact_force.z);
        let what = format!("force on the block [N], E x {ratio:e}, size x {size}");
        findings.of_run(what, &run, carried, weight, Relative(2e-3));
    }
}

/// Five balls in a column, off line by a thousandth of their radius, squeezed between plates that grip.
pub fn column(friction: f64) -> SceneParameters {
    let radius = 0.01;
    let mut bodies = vec![ground()];
    let mut stage = load(20, "ram", drive([Some(0.0), Some(0.0), Some(-4e-4)], HELD));
    for k in 0..5 {
        let off = 1e-3 * radius * if k % 2 == 0 { 1.0 } else { -1.0 };
        let place = [off, 0.0, radius * (2.0 * k as f64 + 1.0)];
        bodies.push(body(&format!("ball {k}"), SceneShape::Sphere(radius), place, [0.0; 3]));
        stage.bodies.push((format!("ball {k}"), in_plane()));
    }
    bodies.push(body("ram", cuboid([0.1, 0.1, 0.02]), [0.0, 0.0, 10.0 * radius + 0.01], [0.0; 3]));
    scene(bodies, friction, vec![stage])
}
