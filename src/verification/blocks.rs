//! Blocks on planes: sliding, tipping, pushed along under weakening friction, pressed at many points.
//!
//! - A block of width b and height h on a plane that tilts slides at `tan(angle) = mu`, or tips first, at `(b - 2 r) / h` where
//!   that is less: its edges are rounded with r, so that its foot ends r before the block does; a meshed one that carries by its area
//!   tips at `b / h`, and so do cubes on each other. The angle found is the last
//!   with an equilibrium. Tolerance on its tangent: the smallest increment turns gravity by 1/64 of a twentieth of the way, which is
//!   1.2 times the limit: 1e-3; and forces balance to 1e-5.
//! - Pushed along a plane by a displacement under N, the push rises to `mu_p N`, then follows `N mu(s)`,
//!   `mu(s) = mu_r + (mu_p - mu_r) exp(-s/D_c)`, with the slip s; its work over the slip is the area under that. The slip is
//!   the displacement less the tangential stretch, push over stiffness.
//! - A prism of n corners on a cube, pressed by a force and a moment: how the load spreads depends on n, the resultant does not.
//! - A cube slid without friction over a plane cut into thin coplanar triangles: no tangential force.

use crate::contact::law::Friction;
use crate::scene::{BodyLoad, SceneParameters, SceneShape};
use crate::tensor::Vec3;
use crate::verification::bodies::{
    HELD, ROUNDING, body, cuboid, drive, fixed, gravity, ground, hull, load, meshed_by_area, push, scene,
    sharp,
};
use crate::verification::{Absolute, Findings, Relative, Run, worse};

/// On the tangent at which a block slides or tips.
const STEEPEST: f64 = 1.2e-3;

/// A block of this width and height on a plane, tilted to 1.2 times the tangent `limit`.
fn tilted(width: f64, height: f64, friction: f64, limit: f64) -> SceneParameters {
    let block = body("block", cuboid([width, 0.1, height]), [0.0, 0.0, 0.5 * height], [0.0; 3]);
    let end = 1.2 * limit;
    let stages = vec![gravity(4, [0.0, 0.0, -9.81]), gravity(20, [9.81 * end, 0.0, -9.81])];
    sharp(scene(vec![ground(), block], friction, stages))
}

/// Three cubes on each other on a plane, tilted to 1.2 times the tangent `limit`.
fn stack(limit: f64) -> SceneParameters {
    let single = tilted(0.1, 0.1, 0.65, limit);
    let mut bodies = vec![ground()];
    bodies.extend((0..3).map(|k| {
        let height = 0.05 + 0.1 * f64::from(k);
        body(&format!("cube {k}"), cuboid([0.1; 3]), [0.0, 0.0, height], [0.0; 3])
    }));
    SceneParameters { bodies, ..single }
}

/// Tangent of the steepest tilt with an equilibrium; not a number where there was none at all or where it
/// stands at the end.
fn steepest(run: &Run) -> f64 {
    if run.stopped() { run.at_end(|row| row.gravity.x / -row.gravity.z) } else { f64::NAN }
}

/// The tangent at which a block of this width and height tips.
fn tipping(width: f64, height: f64) -> f64 {
    (width - 2.0 * ROUNDING * width.min(0.1).min(height)) / height
}

pub(super) fn incline(findings: &mut Findings) {
    let mut found = |what: String, run: &Run, reference: f64| {
        let cost = run.cost(run.fault.clone().unwrap_or_default());
        findings.compare(what, steepest(run), reference, Relative(STEEPEST), cost);
    };
    for friction in [0.1, 0.2, 0.4, 0.65, 0.8] {
        let run = Run::of(&tilted(0.1, 0.1, friction, friction));
        found(format!("tan where it slides, mu {friction}"), &run, friction);
    }
    for slenderness in [0.1, 0.2, 0.3, 0.5] {
        let expected = tipping(slenderness * 0.1, 0.1);
        let run = Run::of(&tilted(slenderness * 0.1, 0.1, 0.8, expected));
        found(format!("tan where it tips, b/h {slenderness}"), &run, expected);
    }
    for cells in [0.1, 0.04] {
        let run = Run::of(&meshed_by_area(tilted(0.03, 0.1, 0.8, 0.3), cells));
        found(format!("tan where it tips, meshed by {cells} m, area"), &run, 0.3);
    }
    let run = Run::of(&meshed_by_area(stack(1.0 / 3.0), 0.1));
    found("tan where three cubes tip, meshed, area".into(), &run, 1.0 / 3.0);
}

/// What presses the pushed block down [N], and how far it is pushed [m].
pub const NORMAL: f64 = 1000.0;
pub const TRAVEL: f64 = 0.4e-3;

/// A block pressed down by [`NORMAL`] and pushed along by [`TRAVEL`].
pub fn pushed(friction: Friction, increments: usize) -> SceneParameters {
    let block = body("block", cuboid([0.1; 3]), [0.0, 0.0, 0.05], [0.0; 3]);
    let stages = vec![
        load(5, "block", push([0.0, 0.0, -NORMAL])),
        load(increments, "block", drive([Some(TRAVEL), None, None], HELD)),
    ];
    SceneParameters { friction, ..scene(vec![ground(), block], 0.0, stages) }
}

/// Slip [m] and push [N] of every increment in which the block of [`pushed`] is pushed.
pub fn slip_and_push(run: &Run) -> Vec<[f64; 2]> {
    let law = &run.scene.model.law;
    let tangential = run.scene.model.contact_stiffness(0, 1) * law.tangential_ratio;
    run.rows
        .iter()
        .filter(|row| row.stage == 1)
        .map(|row| {
            let (state, points) = (&row.bodies[1], row.measures.points as f64);
            let force = state.reaction_force.x;
            [state.displacement.x - force / (points * tangential), force]
        })
        .collect()
}

/// Work of the push over a slip [J].
pub fn weakening_work(friction: &Friction, slip: f64) -> f64 {
    let drop = friction.peak - friction.residual;
    let faded = 1.0 - (-slip / friction.weakening_distance).exp();
    NORMAL * (friction.residual * slip + drop * friction.weakening_distance * faded)
}

pub(super) fn weakening(findings: &mut Findings) {
    for (friction, increments) in [
        (Friction { peak: 0.65, residual: 0.2, weakening_distance: 50e-6 }, 100),
        (Friction { peak: 0.8, residual: 0.4, weakening_distance: 100e-6 }, 100),
        (Friction { peak: 0.65, residual: 0.2, weakening_distance: 1e-9 }, 100),
        (Friction::constant(0.5), 50),
    ] {
        let run = Run::of(&pushed(friction, increments));
        let curve = slip_and_push(&run);
        let [slip, end] = curve.last().copied().unwrap_or([f64::NAN; 2]);
        let law =
            format!("mu {}-{}, D_c {:e} m", friction.peak, friction.residual, friction.weakening_distance);
        let residual = NORMAL * friction.coefficient(slip);
        findings.of_run(format!("push at the end [N], {law}"), &run, end, residual, Relative(2e-3));
        let step = TRAVEL / increments as f64;
        let share = step / friction.weakening_distance;
        if share < 1.0 {
            // Second order in the increment over D_c, and the increment in which it begins to slip.
            let area = weakening_work(&friction, slip);
            let tolerance = Relative(share * share / 6.0 + 2e-3);
            let work = run.at_end(|row| row.ledger.friction);
            findings.of_run(format!("work of friction [J], {law}"), &run, work, area, tolerance);
        }
    }
}

/// A prism of this many corners on a cube of the same width, pressed by [`pressing`].
pub fn prism_on_cube(corners: usize) -> SceneParameters {
    let lower = fixed(body("lower", cuboid([0.1; 3]), [0.0, 0.0, -0.05], [0.0; 3]));
    let upper = body("upper", prism(corners), [0.0, 0.0, 0.05], [0.0; 3]);
    let (force, moment) = pressing();
    let moment = BodyLoad { moment: Some([moment.x, moment.y, moment.z].map(Some)), ..BodyLoad::default() };
    let stages = vec![load(5, "upper", push(force.into())), load(5, "upper", moment)];
    scene(vec![lower, upper], 0.65, stages)
}

/// Force [N] and moment [N m] on the prism.
pub fn pressing() -> (Vec3, Vec3) {
    (Vec3::new(100.0, 0.0, -1000.0), Vec3::new(4.0, 10.0, 0.0))
}

fn prism(corners: usize) -> SceneShape {
    if corners == 4 {
        return cuboid([0.1; 3]);
    }
    let around = (0..corners).map(|k| std::f64::consts::TAU * (k as f64 + 0.5) / corners as f64);
    let points: Vec<[f64; 3]> =
        around.flat_map(|a| [-0.05, 0.05].map(|z| [0.05 * a.cos(), 0.05 * a.sin(), z])).collect();
    hull(&points, 2e-3)
}

pub(super) fn cube_on_cube(findings: &mut Findings) {
    let (force, moment) = pressing();
    for corners in [4, 6, 24, 96] {
        let run = Run::of(&prism_on_cube(corners));
        // The force tolerance, 1e-3 of a point's force; moments likewise times the half diagonal.
        let tolerance = run.at_end(|row| 1e-3 * row.balance.reference_force);
        let off = run.at_end(|row| (row.bodies[1].contact_force + force).norm());
        findings.of_run(format!("force off [N], {corners} corners"), &run, off, 0.0, Absolute(tolerance));
        let off = run.at_end(|row| (row.bodies[1].contact_moment + moment).norm());
        let what = format!("moment off [N m], {corners} corners");
        findings.of_run(what, &run, off, 0.0, Absolute(0.07 * tolerance));
    }
}

/// A cube pressed by 1 kN onto the face of a prism of this many corners and slid across it, `heading` from the x axis [rad].
pub fn slid_over_facets(corners: usize, heading: f64) -> SceneParameters {
    let around = (0..corners).map(|k| std::f64::consts::TAU * k as f64 / corners as f64);
    let points: Vec<[f64; 3]> =
        around.flat_map(|a| [-0.1, 0.0].map(|z| [0.5 * a.cos(), 0.5 * a.sin(), z])).collect();
    let ground = fixed(body("ground", hull(&points, 2e-3), [0.0; 3], [0.0; 3]));
    let place = [-0.2 * heading.cos(), -0.2 * heading.sin(), 0.025];
    let cube = body("cube", cuboid([0.05; 3]), place, [0.0, 0.0, 0.2]);
    let way = [Some(0.4 * heading.cos()), Some(0.4 * heading.sin()), None];
    let mut stages = vec![load(3, "cube", push([0.0, 0.0, -1000.0])), load(200, "cube", drive(way, HELD))];
    stages[0].bodies[0].1.rotation = Some(HELD);
    scene(vec![ground, cube], 0.0, stages)
}

/// The largest tangential force on the cube on its way [N].
pub fn largest_side_force(run: &Run) -> f64 {
    run.rows.iter().map(|row| row.bodies[1].contact_force.xy().norm()).fold(0.0, worse)
}

pub(super) fn over_facets(findings: &mut Findings) {
    for (corners, heading) in [(8, 0.3), (64, 0.7)] {
        let run = Run::of(&slid_over_facets(corners, heading));
        let what = format!("tangential force [N] over {} facets", corners - 2);
        // Normals of a plane differ by rounding only: 1e-9 of the load.
        findings.of_run(what, &run, largest_side_force(&run), 0.0, Absolute(1e-6));
    }
}
