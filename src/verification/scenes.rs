//! The case files in `cases/scenes`, compiled in, and what each of them has to come to.
//!
//! Loads and forces are compared with closed forms to 2e-3: the force tolerance, 1e-3 of the mean contact force, on several
//! contacts. The head of each file has its formula.

use std::path::Path;
use std::time::Duration;

use crate::case::RawCase;
use crate::error::Result;
use crate::scene::{SceneParameters, other_equilibrium};
use crate::setup::scene_parameters;
use crate::tensor::Vec3;
use crate::verification::patch;
use crate::verification::wedges::force_by_stage;
use crate::verification::{Absolute, Findings, Relative, Run, Tolerance};

/// A case file.
#[derive(Debug, Clone, Copy)]
pub struct SceneCase {
    /// Of the file, without its ending.
    pub name: &'static str,
    pub text: &'static str,
}

macro_rules! scene_cases {
    ($($name:literal),* $(,)?) => {
        &[$(SceneCase {
            name: $name,
            text: include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/cases/scenes/", $name, ".json")),
        }),*]
    };
}

/// All of them.
pub const SCENE_CASES: &[SceneCase] = scene_cases![
    "arch_falls",
    "arch_stands",
    "card_tent_falls",
    "card_tent_stands",
    "column_of_five",
    "contact_patch",
    "corner_on_corner",
    "crossed_edges",
    "cube_on_cube",
    "erleben_cliff",
    "erleben_spike_in_crack",
    "erleben_spike_on_wedge",
    "erleben_spikes",
    "erleben_wedge_in_crack",
    "erleben_wedges",
    "face_centred_cubic",
    "hertz",
    "huge_increment",
    "incline_slides",
    "incline_stands",
    "klarbring",
    "nafems_wedge",
    "pile_of_twelve",
    "push",
    "rattler",
    "rolling",
    "simple_cubic",
    "three_cylinders_spread",
    "three_cylinders_stand",
    "tipping_falls",
    "tipping_stands",
    "unlike_bodies",
    "weakening_at_once",
    "wedge_20",
    "wedge_60",
    "wedge_let_go",
];

impl SceneCase {
    /// Takes minutes: left to a test of its own.
    pub fn is_slow(&self) -> bool {
        self.name == "hertz"
    }

    /// The scene that the file describes.
    ///
    /// # Errors
    /// What the case check and the set-up of the scene refuse.
    pub fn parameters(&self) -> Result<SceneParameters> {
        let file = format!("cases/scenes/{}.json", self.name);
        let case = RawCase::parse(Path::new(&file), self.text)?.check()?;
        scene_parameters(&case, Path::new("cases/scenes"))
    }
}

pub(super) fn all(findings: &mut Findings) {
    for case in SCENE_CASES.iter().filter(|case| !case.is_slow()) {
        match case.parameters() {
            Ok(parameters) => judge(findings, case.name, &Run::of(&parameters)),
            Err(error) => {
                let cost = (0, Duration::ZERO, error.to_string());
                findings.compare(case.name, f64::NAN, 0.0, Absolute(0.0), cost);
            }
        }
    }
}

/// Of a block of 10 cm edges [N].
const WEIGHT: f64 = 2180.0 * 1e-3 * 9.81;

/// What is expected of each case; a case that nothing is expected of fails.
pub fn judge(findings: &mut Findings, name: &str, run: &Run) {
    let said = |what: &str| format!("{name}: {what}");
    if let Some((what, (body, axis), reference, tolerance)) = expected_force(name) {
        findings.of_run(said(what), run, force(run, body, axis), reference, tolerance);
        return;
    }
    match name {
        "incline_slides" | "tipping_falls" => judge_stop(findings, name, run),
        "push" | "weakening_at_once" | "nafems_wedge" => judge_push(findings, name, run),
        "cube_on_cube" => {
            findings.of_run(said("force [N]"), run, force(run, "upper", 2), 1000.0, Relative(2e-3));
            let moment = run.at_end(|row| row.bodies[1].contact_moment.y);
            findings.of_run(said("moment [N m]"), run, moment, -10.0, Absolute(0.1));
        }
        "contact_patch" => {
            let (angle, tolerance) = (20f64.to_radians(), Absolute(patch::TOLERANCE));
            findings.of_run(said("stress off"), run, patch::stress_miss(run), 0.0, tolerance);
            findings.of_run(said("pressure off"), run, patch::pressure_miss(run, angle), 0.0, tolerance);
        }
        "klarbring" => klarbring(findings, run),
        "pile_of_twelve" => pile(findings, run),
        "wedge_let_go" => {
            let angle = 20f64.to_radians();
            let [full, left, _] = force_by_stage(run, angle);
            findings.stands(said("jammed once let go"), run, run.finished() && left > 0.05 * full, true);
            let free = run.at_end(|row| row.measures.points as f64);
            findings.of_run(said("contacts at the end"), run, free, 0.0, Absolute(0.0));
        }
        "rattler" => {
            let body = run.index("rattler");
            let moved = run.at_end(|row| row.bodies[body].displacement.norm());
            findings.of_run(said("displacement [m]"), run, moved, 0.0, Absolute(0.0));
        }
        "wedge_20" | "wedge_60" => {
            let (angle, friction): (f64, f64) = if name == "wedge_20" { (20.0, 0.65) } else { (60.0, 0.8) };
            let (sin, cos) = angle.to_radians().sin_cos();
            let normal = force(run, "right", 0) * cos - force(run, "right", 2) * sin;
            let reference = 1000.0 / (2.0 * (sin + friction * cos));
            findings.of_run(said("N [N]"), run, normal, reference, Relative(2e-3));
        }
        "rolling" | "card_tent_stands" | "arch_stands" | "column_of_five" => {
            findings.stands(said("finishes"), run, run.finished(), true)
        }
        "three_cylinders_stand" => {
            let ball = 4.0 / 3.0 * std::f64::consts::PI * 0.05f64.powi(3) * 2180.0 * 9.81;
            let on_ground = -force(run, "ground", 2);
            findings.of_run(said("on the ground [N]"), run, on_ground, 3.0 * ball, Relative(1e-3));
        }
        "arch_falls" | "card_tent_falls" | "three_cylinders_spread" => {
            findings.stands(name, run, !run.stopped(), false);
        }
        "huge_increment" => {
            let above = run.at_end(|row| f64::from(row.bodies[1].position.z > 0.001));
            let stopped_above = run.stopped() && above == 1.0;
            findings.stands(said("stopped above the plate"), run, stopped_above, true);
        }
        _ => findings.stands(said("nothing is expected of it"), run, false, true),
    }
}

/// The contact force on a body at the end, where that alone is compared: its name, body and axis, value [N] and tolerance.
fn expected_force(name: &str) -> Option<(&'static str, (&'static str, usize), f64, Tolerance)> {
    let usual = Relative(2e-3);
    Some(match name {
        "crossed_edges" | "corner_on_corner" => ("force [N]", ("upper", 2), 6203.5, usual),
        "simple_cubic" => ("force on a plate [N]", ("x high", 0), 2559.15, usual),
        "face_centred_cubic" => ("force on the top ball [N]", ("top", 2), 18.857, usual),
        "unlike_bodies" => ("force on the block [N]", ("block", 2), 1e-3 * WEIGHT, usual),
        "erleben_cliff" => ("force on the box [N]", ("box", 2), WEIGHT, usual),
        "erleben_spikes"
        | "erleben_spike_on_wedge"
        | "erleben_wedges"
        | "erleben_spike_in_crack"
        | "erleben_wedge_in_crack" => ("force [N]", ("upper", 2), 100.0, usual),
        "incline_stands" => ("friction [N]", ("block", 0), -0.5 * WEIGHT, Absolute(2e-3 * WEIGHT)),
        "tipping_stands" => {
            let reference = 0.3 * WEIGHT * 15f64.to_radians().cos();
            ("normal force [N]", ("block", 2), reference, Relative(2.1e-3))
        }
        _ => return None,
    })
}

/// A coordinate of the contact force on a body at the end.
fn force(run: &Run, body: &str, axis: usize) -> f64 {
    let body = run.scene.body(body);
    run.at_end(|row| body.map_or(f64::NAN, |body| row.bodies[body].contact_force[axis]))
}

/// Of a run that has to stop short, whose last state is judged: the slope of gravity there.
fn judge_stop(findings: &mut Findings, name: &str, run: &Run) {
    let (reference, tolerance) = match name {
        "incline_slides" => (0.65, 4e-3),
        // b / h of a hard block, less what the rim that it stands on yields (cases/scenes/README.md).
        _ => {
            let [width, depth, height]: [f64; 3] = [0.03, 0.1, 0.1];
            let block = 2180.0 * width * depth * height * 9.81;
            let rim = 2.0 * block / (9.0 * run.scene.model.patch_stiffness(0, 1) * depth * height.powi(2));
            (width / height - 3.0 * rim.cbrt(), 1e-2)
        }
    };
    let tangent = run.at_end(|row| row.gravity.x / -row.gravity.z);
    let (computed, note) = if run.stopped() { (tangent, String::new()) } else { (f64::NAN, run.trouble()) };
    let what = format!("{name}: tan where it stops");
    findings.compare(what, computed, reference, Relative(tolerance), run.cost(note));
}

/// Of a body that is driven sideways: the force that this takes.
fn judge_push(findings: &mut Findings, name: &str, run: &Run) {
    let said = |what: &str| format!("{name}: {what}");
    let end = run.at_end(|row| row.bodies[1].reaction_force.x);
    match name {
        "push" => {
            let pushes = run.rows.iter().map(|row| row.bodies[1].reaction_force.x);
            // The peak falls within an increment of 5 um: 0.45 N times 5/50 at most.
            findings.of_run(said("peak [N]"), run, pushes.fold(0.0, f64::max), 650.0, Relative(0.07));
            findings.of_run(said("push at the end [N]"), run, end, 200.0, Absolute(2.0));
        }
        "weakening_at_once" => {
            findings.of_run(said("push at the end [N]"), run, end, 200.0, Relative(2e-3));
        }
        _ => findings.of_run(said("push [N]"), run, end, 412.371, Relative(2e-3)),
    }
}

/// The plate's force on the jammed ball: springs of the plate, and of the ground along and across, under a plate that has come down by
/// 10 um after 50 N of preload.
fn klarbring(findings: &mut Findings, run: &Run) {
    let model = &run.scene.model;
    let (sin, cos) = 20f64.to_radians().sin_cos();
    let (ground, plate) = (model.contact_stiffness(0, 1), model.contact_stiffness(1, 2));
    let sideways = ground * model.law.tangential_ratio;
    let onset = 0.5 * model.law.onset;
    let closed = cos * (10e-6 - 50.0 / ground - onset) - onset;
    let reference = closed / (1.0 / plate + sin * sin / sideways + cos * cos / ground);
    let computed = run.at_end(|row| row.bodies[2].contact_force.norm());
    // The contacts yield by ten micrometres on a ball of 20 mm, which turns the normals by 1e-3 at most.
    findings.of_run("klarbring: force of the plate [N]", run, computed, reference, Relative(4e-3));
    let flagged = other_equilibrium(&run.scene).is_some();
    findings.stands("klarbring: flagged as not unique", run, flagged, true);
}

/// Every grain touches its neighbours and plates on all six sides, and what the plates exert is in balance.
fn pile(findings: &mut Findings, run: &Run) {
    let bodies = run.scene.model.bodies.len();
    let mut neighbours = vec![0; bodies];
    for pair in run.scene.contacts.pairs.iter().filter(|pair| pair.active().next().is_some()) {
        neighbours[pair.a()] += 1;
        neighbours[pair.b()] += 1;
    }
    let least = neighbours.iter().skip(6).copied().min().unwrap_or(0);
    let touches = run.finished() && least == 6;
    findings.stands(format!("pile_of_twelve: {least} of 6 neighbours touched"), run, touches, true);
    let sum = run.at_end(|row| row.bodies[..6].iter().map(|b| b.contact_force).sum::<Vec3>().norm());
    // Each grain may be out of balance by the force tolerance.
    let tolerance = run.at_end(|row| 12.0 * 1e-3 * row.balance.reference_force);
    let what = "pile_of_twelve: sum of the plates' forces [N]";
    findings.of_run(what, run, sum, 0.0, Absolute(tolerance));
}
