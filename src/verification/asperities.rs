//! Corners and edges of rock that are pressed in, let go, and meet others.
//!
//! A cube on its corner (rounding R, cone of the area of a corner's section), or on an edge across another's,
//! is driven straight down by a prescribed motion. Its force is the law's at that indentation:
//! `contact::asperity` has the closed forms, their sources and what tests them. Lifted and set down elsewhere
//! it is as it was left. Tolerances: 1e-6 for forces, of which rounding takes 1e-9; the books are those of
//! the trapezoidal rule, second order in the increment.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::contact::{Asperity, NormalLaw};
use crate::grain::CondensedGrain;
use crate::material::Elastic;
use crate::mesh::cuboid_mesh;
use crate::scene::SceneParameters;
use crate::tensor::{Rotation, Vec3};
use crate::verification::bodies::{DENSITY, HELD, body, cuboid, drive, fixed, load, scene};
use crate::verification::{Absolute, Findings, Relative, Run};

const SIDE: f64 = 0.04;
const ROUNDING: f64 = 0.8e-3;
/// [Pa]
const LIMIT: f64 = 7e8;
const E_STAR: f64 = 3e10 / (1.0 - 0.2 * 0.2);
/// From the first floor to the second [m].
pub const STEP: f64 = 0.2;

/// What is driven by these ways [m] in so many increments each.
pub type Ways<'a> = &'a [(usize, [f64; 3])];

/// A cube just above the first of two floors that do not yield, a corner down.
pub fn corner(friction: f64, ways: Ways<'_>) -> SceneParameters {
    let down = Vec3::new(1.0, 1.0, 1.0).normalize();
    let turn = Rotation::rotation_between(&down, &-Vec3::z()).unwrap_or_default();
    // The core's corner is a rounding inside of three faces.
    let height = 3.0f64.sqrt() * (0.5 * SIDE - ROUNDING) + ROUNDING;
    let mut cube = body("cube", cuboid([SIDE; 3]), [0.0, 0.0, height], turn.scaled_axis().into());
    cube.limit_pressure = LIMIT;
    let floor = |name: &str, x: f64| {
        let mut floor = fixed(body(name, cuboid([0.15, 0.15, 0.1]), [x, 0.0, -0.05], [0.0; 3]));
        floor.unyielding = true;
        floor
    };
    let stages = ways.iter().map(|(n, way)| load(*n, "cube", drive(way.map(Some), HELD))).collect();
    let parameters = scene(vec![cube, floor("one", 0.0), floor("other", STEP)], friction, stages);
    SceneParameters { normal: NormalLaw::Asperity, ..parameters }
}

/// [`corner`] with a cube that yields, of cells of this size [m].
pub fn corner_of_cells(cell: f64, friction: f64, ways: Ways<'_>) -> SceneParameters {
    let mut parameters = corner(friction, ways);
    let mesh = cuboid_mesh([SIDE; 3], cell).expect("a mesh");
    let rock = Elastic::new(3e10, 0.2).expect("allowed");
    let rock = vec![rock; mesh.cells.len()];
    let grain = CondensedGrain::new(mesh, &rock, DENSITY).expect("a grain");
    parameters.bodies[0].grain = Some(Arc::new(grain.on_patches()));
    parameters
}

/// The force of a corner pressed in by a tenth of a millimetre: what its body yields depends little on its mesh, and a rigid body is the limit.
pub(super) fn meshes(findings: &mut Findings) {
    let ways = [(5, [0.0, 0.0, -0.1e-3])];
    let finest = Run::of(&corner_of_cells(0.004, 0.0, &ways));
    let of_cells =
        |size: f64| (format!("cells of {:.0} mm", 1e3 * size), Run::of(&corner_of_cells(size, 0.0, &ways)));
    let runs = [0.02, 0.01, 0.005].map(of_cells);
    for (name, run) in runs.into_iter().chain([("rigid".into(), Run::of(&corner(0.0, &ways)))]) {
        let (computed, expected) = (force(&run, 0), force(&finest, 0));
        findings.of_run(
            format!("force [N], {name}, over cells of 4 mm"),
            &run,
            computed,
            expected,
            Relative(0.03),
        );
    }
}

/// The law of [`corner`]: a cube's corner is cut in equilateral triangles of area `3 sqrt(3)/2` times the depth squared.
pub fn law_of_corner() -> Asperity {
    Asperity::tip(E_STAR, LIMIT, ROUNDING, (1.5 * 3.0f64.sqrt() / PI).sqrt())
}

/// A cube on an edge just above another's edge, across it, both of one rock.
pub fn edges(ways: Ways<'_>) -> SceneParameters {
    let height = 2.0f64.sqrt() * (0.5 * SIDE - ROUNDING) + ROUNDING;
    let mut lower = fixed(body("lower", cuboid([SIDE; 3]), [0.0, 0.0, -height], [PI / 4.0, 0.0, 0.0]));
    let mut upper = body("upper", cuboid([SIDE; 3]), [0.0, 0.0, height], [0.0, PI / 4.0, 0.0]);
    (lower.limit_pressure, upper.limit_pressure) = (LIMIT, 2.0 * LIMIT);
    let stages = ways.iter().map(|(n, way)| load(*n, "upper", drive(way.map(Some), HELD))).collect();
    SceneParameters { normal: NormalLaw::Asperity, ..scene(vec![upper, lower], 0.0, stages) }
}

/// The law of [`edges`], right-angled ones: the weaker rock crushes.
pub fn law_of_edges() -> Asperity {
    Asperity::crossed_edges(0.5 * E_STAR, LIMIT, [ROUNDING; 2], [1.0; 2])
}

/// Upward force on the first body [N] at the end of a stage.
pub fn force(run: &Run, stage: usize) -> f64 {
    run.rows.iter().rfind(|row| row.stage == stage).map_or(f64::NAN, |row| row.bodies[0].contact_force.z)
}

/// Within the rounding, behind it, unloaded and loaded again.
pub(super) fn indents(findings: &mut Findings) {
    let tolerance = Relative(1e-6);
    let stages = |deep: [f64; 2], back: f64| {
        [(20, -deep[0]), (20, deep[0] - deep[1]), (10, back), (10, -0.5 * back)]
            .map(|(n, z)| (n, [0.0, 0.0, z]))
    };
    let ([rounded, sharp], back) = ([0.15e-3, 0.78e-3], 0.02e-3);
    let ways = stages([rounded, sharp], back);
    for (name, run, law) in [
        ("corner", Run::of(&corner(0.0, &ways)), law_of_corner()),
        ("edges", Run::of(&edges(&ways)), law_of_edges()),
    ] {
        let [first, last] = [rounded, sharp].map(|h| law.update(0.0, h));
        let elastic = |h: f64| law.update(last.depth, h).force;
        let forces = [first.force, last.force, elastic(sharp - back), elastic(sharp - 0.5 * back)];
        let told = ["in the rounding", "behind it", "unloaded", "reloaded"];
        for (stage, (expected, what)) in forces.into_iter().zip(told).enumerate() {
            findings.of_run(
                format!("force [N], {name} {what}"),
                &run,
                force(&run, stage),
                expected,
                tolerance,
            );
        }
        let crushed = run.at_end(|row| row.ledger.indentation);
        let expected = law.work_of_crushing(last.depth);
        findings.of_run(format!("work of crushing [J], {name}"), &run, crushed, expected, tolerance);
        let error = run.at_end(|row| row.ledger.error() / row.ledger.external);
        let what = format!("error of the books over the work, {name}");
        findings.of_run(what, &run, error, 0.0, Absolute(1e-3));
    }
}
