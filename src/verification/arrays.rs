//! Regular arrays of equal balls.
//!
//! - Simple cubic, squeezed by e along all axes between six plates: each contact closes by `2 R e` and carries
//!   `k (2 R e - d_0 / 2)`, d_0 the onset, k half a ball's local stiffness; the plates close twice as stiffly and half as far.
//!   Without friction, which would hold the outer balls against the plates beside them. Everything follows from the plates' motion. (With Hertz's law in place of the local spring that is `p = 2/3 E* e^1.5`; the
//!   law itself is judged on two condensed spheres, `verification/hertz`.) Tolerance: the force tolerance on two contacts, 2e-3.
//! - Face-centred cubic along a cube axis, friction mobilised (Rowe 1962; Thornton 1979, Geotechnique 29(4)):
//!   `sigma_1 / sigma_3 = 2 (1 + mu) / (1 - mu)`. The cell is a ball on four that touch, which are drawn inwards by S each; mirror planes hold the four
//!   at their height, and no ball turns. With V and H the vertical and horizontal force of a contact, `sigma_1 / sigma_3 = 2 V / H`.
//!   Tolerance 2e-3: the force tolerance on the two contacts that H and V come from; the way to full slip is 4e-4 of a radius,
//!   which turns the normals by half as much.

use crate::scene::{BodyLoad, SceneParameters, SceneShape};
use crate::verification::bodies::{HELD, body, cuboid, drive, load, scene};
use crate::verification::{Findings, Relative, Run};

/// [m]
const RADIUS: f64 = 0.012;

/// `n` balls along each axis, touching each other and six plates, which close by the strain `squeeze`.
pub fn cubic(n: usize, squeeze: f64) -> SceneParameters {
    let size = 2.0 * RADIUS * n as f64;
    let thickness = 0.01;
    let mut bodies = Vec::new();
    let mut stage = load(5, "x low", BodyLoad::default());
    stage.bodies.clear();
    for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
        for (side, end) in [(-1.0, "low"), (1.0, "high")] {
            let name = format!("{letter} {end}");
            // A little smaller than the array, so that plates do not meet at its edges.
            let mut extents = [size - 0.5 * RADIUS; 3];
            extents[axis] = thickness;
            let mut position = [0.0; 3];
            position[axis] = side * 0.5 * (size + thickness);
            bodies.push(body(&name, cuboid(extents), position, [0.0; 3]));
            let mut motion = HELD;
            motion[axis] = Some(-side * 0.5 * squeeze * size);
            stage.bodies.push((name, drive(motion, HELD)));
        }
    }
    for k in 0..n.pow(3) {
        let place = [k % n, k / n % n, k / n / n].map(|i| (2 * i + 1) as f64 * RADIUS - 0.5 * size);
        bodies.push(body(&format!("ball {k}"), SceneShape::Sphere(RADIUS), place, [0.0; 3]));
    }
    scene(bodies, 0.0, vec![stage])
}

/// Force on a plate of [`cubic`] [N]: all springs of a row in series, `n - 1` between balls and two at plates.
pub fn plate_force(run: &Run, n: usize, squeeze: f64) -> f64 {
    let model = &run.scene.model;
    let (ball, plate) = (model.contact_stiffness(6, 7), model.contact_stiffness(0, 6));
    let compliance = (n - 1) as f64 / ball + 2.0 / plate;
    let onsets = 0.5 * model.law.onset * (n + 1) as f64;
    (n * n) as f64 * (2.0 * RADIUS * n as f64 * squeeze - onsets) / compliance
}

pub(super) fn simple_cubic(findings: &mut Findings) {
    for (n, squeeze) in [(2, 1e-3), (3, 1.807e-3), (4, 1e-2)] {
        let run = Run::of(&cubic(n, squeeze));
        let reference = plate_force(&run, n, squeeze);
        for (plate, name) in [(1, "x"), (5, "z")] {
            let force = run.at_end(|row| row.bodies[plate].contact_force.norm());
            let what = format!("force on the {name} plate [N], {n} x {n} x {n}, e {squeeze}");
            findings.of_run(what, &run, force, reference, Relative(2e-3));
        }
    }
}

/// What draws each of the four balls inwards [N].
const DRAWN: f64 = 1.0;

/// A ball on four that touch, driven down by 4e-4 of its radius while 1 N on each holds the four together.
pub fn cell(friction: f64) -> SceneParameters {
    let reach = 2.0f64.sqrt() * RADIUS;
    let ball = |name: &str, place| body(name, SceneShape::Sphere(RADIUS), place, [0.0; 3]);
    let mut bodies = vec![ball("top", [0.0, 0.0, reach])];
    let mut hold = load(4, "top", drive(HELD, HELD));
    let mut sink = load(40, "top", drive([Some(0.0), Some(0.0), Some(-4e-4 * RADIUS)], HELD));
    for (name, axis, side) in [("east", 0, 1.0), ("west", 0, -1.0), ("north", 1, 1.0), ("south", 1, -1.0)] {
        let (mut place, mut motion, mut force) = ([0.0; 3], HELD, [None; 3]);
        place[axis] = side * reach;
        motion[axis] = None;
        force[axis] = Some(-side * DRAWN);
        bodies.push(ball(name, place));
        let kept = BodyLoad { force: Some(force), ..drive(motion, HELD) };
        hold.bodies.push((name.into(), kept));
    }
    sink.bodies.truncate(1);
    let mut parameters = scene(bodies, friction, vec![hold, sink]);
    // A force out of balance changes the ratio by the factor that the ratio is.
    parameters.settings.force_tolerance = 1e-4;
    parameters
}

/// `2 (1 + mu) / (1 - mu)`.
pub fn stress_ratio(friction: f64) -> f64 {
    2.0 * (1.0 + friction) / (1.0 - friction)
}

pub(super) fn face_centred(findings: &mut Findings) {
    for friction in [0.0, 0.2, 0.4, 0.65] {
        let run = Run::of(&cell(friction));
        let computed = run.at_end(|row| 2.0 * (row.bodies[0].contact_force.z / 4.0) / DRAWN);
        let what = format!("sigma_1 / sigma_3, mu {friction}");
        findings.of_run(what, &run, computed, stress_ratio(friction), Relative(2e-3));
    }
}
