//! Stabilised increments: what the drag of implicit steps does, and that it fades.
//!
//! - A block pressed on a plate that is moved away under it by `d`: a spring pulled through a dashpot, in steps `x = K (d - x) / (K + c k)` with the
//!   stiffness `K` of the contacts and the drag `c k`. `K` is a secant of contacts that are not quite linear: 1e-4. The work of contacts is what
//!   they lose, whatever the drag took: 1e-9 of what they hold. Friction counts all steps as one straight way, on which the drag grows from nothing to
//!   its last force: half of that times the way; what is left to go has the stiffness in it four times, 1e-2.
//! - A block above a table falls in the first of `n` increments that bring its weight. What is set free is the mean of the load over
//!   that increment times the gap, whatever `n`: 1e-3.
//! - Sixteen grains sheared to 0.5 % in increments that leave less and less unrest, against strict balance: the mean of q. What is
//!   out of balance in the mean moves q by less than half its own share; 1e-4 is left for strict increments, which balance to 1e-3 on any grain.

use crate::assembly::Contacts;
use crate::contact::NormalLaw;
use crate::scene::SceneParameters;
use crate::solver::{Increment, Settings, Stabilisation, advance};
use crate::tensor::Vector6;
use crate::triaxial::{Lateral, Rig, Test};
use crate::verification::bodies::{DENSITY, body, cuboid, fixed, gravity, ground, load, push, scene};
use crate::verification::rig::{consolidation, drive, factorisations, parameters, run, sixteen_grains};
use crate::verification::{Findings, Run, Tolerance, timed};

/// Presses the block [N], and moves the plate [m].
const PRESS: f64 = 1e4;
const MOVED: f64 = -1e-6;
/// Drags of the first steps of an increment over the typical stiffness.
const DRAGS: [f64; 4] = [0.1, 3e-2, 9e-3, 2.7e-3];
/// On the sixteen grains [Pa].
const PRESSURE: f64 = 4e5;

pub(super) fn steps(findings: &mut Findings) {
    dashpot(findings);
    for increments in [1, 4, 16] {
        let gap = 2e-3;
        let run = Run::of(&falling(gap, increments));
        let expected = 0.5 * 9.81 * DENSITY * 1e-3 * gap / increments as f64;
        let set_free = run.at_end(|row| row.ledger.stabilisation);
        let what = format!("set free by a fall, {increments} increments [J]");
        findings.of_run(what, &run, set_free, expected, Tolerance::Relative(1e-3));
    }
    let ready = consolidated();
    let sheared = |until| ready.as_ref().map_or((f64::NAN, 0), |ready| sheared(ready, until));
    let (strict, _) = sheared(Stabilisation::Rest);
    for unrest in [1e-2, 3e-3, 1e-3, 1e-6] {
        let ((mean, steps), time) = timed(|| sheared(Stabilisation::Unrest(unrest)));
        let what = format!("mean q of 16 grains, unrest {unrest:e}, over strict");
        let tolerance = Tolerance::Relative((0.5 * unrest).max(1e-4));
        findings.compare(what, mean / strict, 1.0, tolerance, (steps, time));
    }
}

/// A block of 100 mm that hangs so far above a table [m], under gravity that comes in so many increments.
fn falling(gap: f64, increments: usize) -> SceneParameters {
    let table = fixed(body("table", cuboid([0.5, 0.5, 0.1]), [0.0, 0.0, -0.05], [0.0; 3]));
    let block = body("block", cuboid([0.1; 3]), [0.0, 0.0, 0.05 + gap], [0.0; 3]);
    scene(vec![table, block], 0.5, vec![gravity(increments, [0.0, 0.0, -9.81])])
}

fn dashpot(findings: &mut Findings) {
    let block = body("block", cuboid([0.1; 3]), [0.0, 0.0, 0.05], [0.0; 3]);
    let mut parameters = scene(vec![ground(), block], 0.65, vec![load(4, "block", push([0.0, 0.0, -PRESS]))]);
    parameters.settings.force_tolerance = 1e-9;
    let run = Run::of(&parameters);
    let (Pulled { ways, drag, unbooked, steps }, time) = timed(|| pulled(&run));
    let mut found = |what: &str, [computed, reference]: [f64; 2], share: f64| {
        findings.compare(what, computed, reference, Tolerance::Relative(share), (steps, time, run.trouble()));
    };
    found("way through a dashpot in four steps [m]", ways, 1e-4);
    found("work of the drag on it [J]", drag, 1e-2);
    let what = "work of the contacts less what they lose, over what they hold";
    findings.compare(what, unbooked, 0.0, Tolerance::Absolute(1e-9), (steps, time, run.trouble()));
}

/// What came of the block on the plate that moves away, and what it should be.
struct Pulled {
    ways: [f64; 2],
    drag: [f64; 2],
    unbooked: f64,
    steps: usize,
}

fn pulled(run: &Run) -> Pulled {
    let scene = &run.scene;
    let model = &scene.model;
    // From where the block stands pressed by `press` [N], the plate moved by `down` [m].
    let solve = |settings: &Settings, down: f64, press: f64| {
        let mut loads = scene.loads().clone();
        loads.applied[1].z = -press;
        let mut start = scene.committed.poses.clone();
        start[0].position.z += down;
        let increment = Increment { model, committed: &scene.committed, loads: &loads, settings };
        advance(&increment, vec![start], &mut Contacts::default())
    };
    let before = solve(&scene.settings, 0.0, PRESS);
    let heavier = solve(&scene.settings, 0.0, 1.01 * PRESS);
    let stiffness = 0.01 * PRESS / (before.poses[1].position.z - heavier.poses[1].position.z);
    // So little may move that four steps are taken, and each is solved well.
    let settings = Settings { stabilisation: Stabilisation::Unrest(1e-7), ..scene.settings.clone() };
    let after = solve(&settings, MOVED, PRESS);
    let (mut way, mut force) = (0.0, 0.0);
    for share in DRAGS.iter().take(after.augmentations) {
        let drag = share * model.typical_stiffness();
        let step = stiffness * (MOVED - way) / (stiffness + drag);
        (way, force) = (way + step, drag * step);
    }
    let moved = after.poses[1].position.z - scene.committed.poses[1].position.z;
    let worked: f64 = after.work.iter().map(Vector6::sum).sum();
    let (held, left) = (before.energy.elastic, after.energy.elastic);
    let dragged = after.work[1].sum() - PRESS * moved;
    Pulled {
        ways: [moved, way],
        drag: [dragged, 0.5 * force * way],
        unbooked: (worked - (held - left)) / held,
        steps: after.counters.factorisations,
    }
}

/// Sixteen grains of rock that crushes at contacts, seated and consolidated, where that finished.
fn consolidated() -> Option<(Rig, Test)> {
    let mut rig = Rig::new(&sixteen_grains(), &parameters(0.65), Settings::default()).expect("a rig");
    rig.model.normal = NormalLaw::Asperity;
    rig.model.bodies.iter_mut().for_each(|body| body.limit_pressure = 2.8 * 250e6);
    let mut test = Test::new(&rig);
    (0..8).find(|_| test.seat(&mut rig, PRESSURE).converged())?;
    run(&mut rig, &mut test, &consolidation(PRESSURE, 6))?;
    Some((rig, test))
}

/// The mean of q [Pa] of these grains sheared to 0.5 %, and the factorisations; not a number where that did not finish.
fn sheared((rig, test): &(Rig, Test), until: Stabilisation) -> (f64, usize) {
    let (mut rig, mut test) = (rig.clone(), test.clone());
    rig.settings.stabilisation = until;
    let Some(rows) = run(&mut rig, &mut test, &drive(5e-3, 2e-4, Lateral::Pressure)) else {
        return (f64::NAN, 0);
    };
    let mean = rows.iter().map(|row| row.measures.deviatoric_stress).sum::<f64>() / rows.len() as f64;
    (mean, factorisations(&rows))
}
