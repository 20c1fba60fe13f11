//! Bodies led along paths on which contact goes over vertices, edges, facets and nearly parallel edges: the force is a
//! continuous function of the way.
//!
//! Contact that flips between features jumps there, at any step. Here the largest change from one increment to the next must
//! shrink with the increment: at half of it to no more than 0.6 (a half for a Lipschitz function, with a reserve where the peak of its slope
//! falls between samples). The force is the derivative of an energy, so its work is what the contacts store; the trapezoidal
//! rule adds an error of second order, allowed 1e-3 of the largest energy stored. So behind springs, and behind
//! asperities that are elastic or crushed (what crushing takes is booked as damage).
//!
//! The tangent is not asked for: a normal turns at once at `1 / distance` where a vertex leaves a facet for its edge, so there it jumps.

use riprap::contact::NormalLaw;
use riprap::scene::{SceneBody, SceneParameters};
use riprap::tensor::{Rotation, Vec3};

use riprap::verification::Run;
use riprap::verification::bodies::{body, cuboid, drive, fixed, load, scene};

use crate::audited::{audited, last};

struct Way {
    name: &'static str,
    lower: SceneBody,
    upper: SceneBody,
    shift: [f64; 3],
    turn: [f64; 3],
}

/// What bears the normal force, and what crushes asperities [Pa].
type Law = (NormalLaw, f64);

fn led(way: &Way, (normal, limit_pressure): Law, increments: usize) -> Run {
    let stages = vec![load(increments, "upper", drive(way.shift.map(Some), way.turn.map(Some)))];
    let bodies = [&way.lower, &way.upper].map(|body| SceneBody { limit_pressure, ..body.clone() });
    let run = audited(&SceneParameters { normal, ..scene(bodies.to_vec(), 0.0, stages) });
    assert!(run.finished(), "{}: {:?}", way.name, run.end);
    run
}

fn largest_jump(run: &Run) -> (f64, f64) {
    let forces: Vec<_> = run.rows.iter().map(|row| row.bodies[1].contact_force).collect();
    let jump = forces.windows(2).map(|pair| (pair[1] - pair[0]).norm()).fold(0.0, f64::max);
    (jump, forces.iter().map(|f| f.norm()).fold(0.0, f64::max))
}

/// Ways over an edge, a parallel edge, a corner.
fn ways() -> [Way; 6] {
    let lower = || fixed(body("lower", cuboid([0.1; 3]), [0.0, 0.0, -0.05], [0.0; 3]));
    let depth = 20e-6;
    let upper = |position: [f64; 3], turn: [f64; 3]| {
        let [x, y, z] = position;
        body("upper", cuboid([0.06; 3]), [x, y, z - depth], turn)
    };
    let tilt = 0.3f64;
    // Lowest point of the tilted cube below its centre: its rounded edge or corner.
    let r = 1.2e-3;
    let crest = |tilt: f64| (0.03 - r) * (tilt.cos() + tilt.sin()) + r;
    let diagonal = (0.03 - r) * 3.0f64.sqrt() + r;
    let on_corner = |sign: f64| -> [f64; 3] {
        let from = Vec3::new(1.0, 1.0, sign).normalize();
        Rotation::rotation_between(&from, &(Vec3::z() * sign)).unwrap_or_default().scaled_axis().into()
    };
    let (upright, turned) = (on_corner(1.0), on_corner(-1.0));
    [
        Way {
            name: "face over an edge",
            lower: lower(),
            upper: upper([0.0, 0.0, 0.03], [0.0; 3]),
            shift: [0.1, 0.02, 0.0],
            turn: [0.0; 3],
        },
        Way {
            name: "turning on a face, edges parallel twice",
            lower: lower(),
            upper: upper([0.04, 0.01, 0.03], [0.0, 0.0, -0.3]),
            shift: [0.0; 3],
            turn: [0.0, 0.0, 2.2],
        },
        Way {
            name: "edge over a parallel edge",
            lower: lower(),
            upper: upper([0.0, 0.0, crest(tilt)], [0.0, tilt, 0.0]),
            shift: [0.1, 0.0, 0.0],
            turn: [0.0; 3],
        },
        Way {
            name: "edge over a nearly parallel edge",
            lower: lower(),
            upper: upper([0.012, 0.0, crest(tilt)], [0.0, tilt, 0.0]),
            shift: [0.03, 0.0, 0.0],
            turn: [0.0, 0.0, 0.15],
        },
        Way {
            name: "edge along a face and off its end",
            lower: lower(),
            upper: upper([0.0, 0.0, crest(tilt)], [0.0, tilt, 0.0]),
            shift: [0.01, 0.1, 0.0],
            turn: [0.0, 0.0, 0.05],
        },
        // Deep enough that the direction between the corners leaves both cones while they touch.
        Way {
            name: "corner over a corner",
            lower: fixed(body("lower", cuboid([0.06; 3]), [0.0, 0.0, -diagonal], upright)),
            upper: body("upper", cuboid([0.06; 3]), [-0.002, 0.0, diagonal - 4e-4], turned),
            shift: [0.004, 0.0003, 0.0],
            turn: [0.0; 3],
        },
    ]
}

#[test]
fn jumps_of_springs_vanish_with_the_increment() {
    assert_jumps_vanish((NormalLaw::Spring, f64::INFINITY));
}

#[test]
fn jumps_of_asperities_vanish_with_the_increment() {
    assert_jumps_vanish((NormalLaw::Asperity, f64::INFINITY));
}

#[test]
fn jumps_of_crushed_asperities_vanish_with_the_increment() {
    assert_jumps_vanish((NormalLaw::Asperity, 7e8));
}

fn assert_jumps_vanish(law: Law) {
    for way in ways() {
        let jumps = [4000, 8000, 16000].map(|increments| {
            let run = led(&way, law, increments);
            let stored = run.rows.iter().map(|row| row.ledger.elastic).fold(0.0, f64::max);
            // What was stored at the first row came with no work: the body starts in overlap.
            let error = last(&run).ledger.error() - run.rows[0].ledger.error();
            let (jump, force) = largest_jump(&run);
            println!(
                "{:<42} {law:?} {increments} increments: jump {:.3e} of the largest force, energy {:.2e} of the largest off, {:.3} s",
                way.name, jump / force, error / stored, run.time.as_secs_f64()
            );
            if increments == 16000 {
                assert!(error.abs() < 1e-3 * stored, "{}: {error} of {stored} J", way.name);
            }
            jump / force
        });
        assert!(jumps[1] < 0.6 * jumps[0] && jumps[2] < 0.6 * jumps[1], "{}: {jumps:?}", way.name);
    }
}
