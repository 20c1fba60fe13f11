//! The contact patch test: a column of two blocks whose meshes do not match, cut across by a flat or an inclined interface.
//!
//! Two smooth plates press the column with F over its cross-section A. Whatever the interface's inclination, as long as it sticks
//! (`tan(angle) < mu`), the column is in simple compression: `sigma_zz = -F/A`, no other stress, and the interface carries the pressure
//! `F/A cos^2(angle)` everywhere (Taylor & Papadopoulos 1991, "On a patch test for contact problems in two dimensions"). Non-matching
//! meshes pass it only if nodal forces on both sides are those of a uniform traction. The blocks have slack springs between them, which
//! change nothing: they shorten by the same everywhere.
//!
//! Tolerance 1e-6 on every stress component at every integration point, and on the pressure at every point of the interface, over
//! `F/A`. The load strains the column by 1e-7, so that what it does to its own shape, of the order of the strain, lies below that.

use std::sync::Arc;

use crate::contact::Feature;
use crate::contact::face::FaceContact;
use crate::contact::law::Friction;
use crate::element::Strains;
use crate::geometry::Polyhedron;
use crate::grain::{CondensedGrain, FullGrain};
use crate::mesh::polyhedron_mesh;
use crate::scene::{BodyLoad, SceneBody, SceneParameters, SceneShape};
use crate::tensor::Vec3;
use crate::verification::bodies::{DENSITY, HELD, body, condensed, cuboid, drive, fixed, load, scene};
use crate::verification::{Absolute, Findings, Run, worse};

/// Edge of the cross-section, and height of either block's axis [m].
pub const EDGE: f64 = 0.1;
/// [Pa]
pub const PRESSURE: f64 = 3e3;
pub const TOLERANCE: f64 = 1e-6;
/// Of the interface; 33 degrees is the steepest that sticks.
pub const FRICTION: f64 = 0.65;
const ROUNDING: f64 = 5e-3;

/// How the blocks deform.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Blocks {
    Condensed,
    Full,
}

/// The column with its interface inclined by `angle`, the steepest way at `heading` from the x axis [rad], and cells of these sizes [m] in
/// the lower and the upper block.
pub fn column(blocks: Blocks, angle: f64, heading: f64, cells: [f64; 2]) -> SceneParameters {
    let half = 0.5 * EDGE;
    let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
    let interface = |[x, y]: [f64; 2]| EDGE + angle.tan() * (x * heading.cos() + y * heading.sin());
    let points = |end: f64| -> Vec<Vec3> {
        corners
            .iter()
            .flat_map(|&[x, y]| [Vec3::new(x, y, end), Vec3::new(x, y, interface([x, y]))])
            .collect()
    };
    let block = |name, end: f64, cell: f64| {
        let shape = Polyhedron::convex_hull(&points(end)).expect("a volume");
        let centre = shape.centroid();
        let shape = shape.translated(&-centre);
        let mesh = polyhedron_mesh(&shape, cell).expect("a mesh");
        let placed = body(
            name,
            SceneShape::Polyhedron { nominal: shape, rounding: ROUNDING },
            centre.into(),
            [0.0; 3],
        );
        let placed = condensed(placed, mesh);
        let full = |grain: &Arc<CondensedGrain>| {
            Arc::new(FullGrain::new(grain.clone(), DENSITY, Strains::Finite).expect("a grain"))
        };
        match blocks {
            Blocks::Condensed => placed,
            Blocks::Full => SceneBody { full: placed.grain.as_ref().map(full), ..placed },
        }
    };
    let plate = |name, z: f64| SceneBody {
        friction: Some(Friction::constant(0.0)),
        ..body(name, cuboid([2.0 * EDGE, 2.0 * EDGE, 0.5 * EDGE]), [0.0, 0.0, z], [0.0; 3])
    };
    let bodies = vec![
        fixed(plate("bottom", -0.25 * EDGE)),
        block("lower", 0.0, cells[0]),
        block("upper", 2.0 * EDGE, cells[1]),
        plate("top", 2.25 * EDGE),
    ];
    // Nothing else keeps the column on smooth plates; what holds it has no force to bear.
    let stays = drive([Some(0.0), Some(0.0), None], [None, None, Some(0.0)]);
    let press = BodyLoad {
        force: Some([None, None, Some(-PRESSURE * EDGE * EDGE)]),
        ..drive([Some(0.0), Some(0.0), None], HELD)
    };
    let mut stage = load(1, "top", press);
    stage.bodies.push(("lower".into(), stays));
    let mut parameters = scene(bodies, FRICTION, vec![stage]);
    parameters.faces = FaceContact::Area;
    parameters.settings.force_tolerance = 3e-7;
    parameters.settings.gap_tolerance = 1e-12;
    parameters
}

/// The largest miss of any stress component at any integration point of a block, over the pressure.
pub fn stress_miss(run: &Run) -> f64 {
    let contacts = &run.scene.contacts;
    let mut worst = 0.0;
    for (index, body) in run.scene.model.bodies.iter().enumerate() {
        let stresses = match (body.grain(), body.full()) {
            (_, Some(grain)) => grain.condensed().cell_stresses(grain.nodal(&contacts.fields[index])),
            (Some(grain), None) => {
                grain.cell_stresses(&grain.nodal_displacements(&contacts.surface_loads[index]))
            }
            (None, None) => continue,
        };
        for stress in stresses.iter().flatten() {
            for (k, component) in stress.iter().enumerate() {
                let expected = if k == 2 { -PRESSURE } else { 0.0 };
                worst = worse(worst, (component - expected).abs() / PRESSURE);
            }
        }
    }
    worst
}

/// The largest miss of the pressure at any point of the interface, over the column's.
pub fn pressure_miss(run: &Run, angle: f64) -> f64 {
    let model = &run.scene.model;
    let expected = PRESSURE * angle.cos().powi(2);
    let stiffness = model.patch_stiffness(1, 2);
    let (mut worst, mut points) = (0.0, 0);
    for (pair, point) in run.scene.contacts.active().filter(|(pair, _)| pair.key() == (1, 2)) {
        let found = match point.site.feature {
            Feature::Faces(..) => point.evaluation.load / (point.state.spring / stiffness),
            Feature::VertexOfA(_) | Feature::VertexOfB(_) | Feature::Edges(..) => f64::NAN,
        };
        worst = worse(worst, (found - expected).abs() / PRESSURE);
        points += usize::from(pair.key() == (1, 2));
    }
    if points > 0 { worst } else { f64::NAN }
}

/// Inclination and heading [degrees], sizes of cells over the edge.
const COLUMNS: [([f64; 2], [f64; 2]); 4] = [
    ([0.0, 0.0], [0.8, 0.5]),
    ([10.0, 0.0], [0.8, 0.5]),
    ([20.0, 30.0], [0.5, 0.7]),
    ([30.0, 45.0], [0.8, 0.4]),
];

pub(super) fn columns(findings: &mut Findings) {
    for blocks in [Blocks::Full, Blocks::Condensed] {
        for ([angle, heading], cells) in COLUMNS {
            let [tilt, turn] = [angle, heading].map(f64::to_radians);
            let run = Run::of(&column(blocks, tilt, turn, cells.map(|share| share * EDGE)));
            let name = match blocks {
                Blocks::Condensed => "condensed",
                Blocks::Full => "full",
            };
            let [lower, upper] = cells;
            let what = format!("{angle} deg, {name}, cells {lower} on {upper}");
            let tolerance = Absolute(TOLERANCE);
            findings.of_run(format!("stress off, {what}"), &run, stress_miss(&run), 0.0, tolerance);
            findings.of_run(format!("pressure off, {what}"), &run, pressure_miss(&run, tilt), 0.0, tolerance);
        }
    }
}
