//! Bodies and stages of the problems in a few words.

use std::sync::Arc;

use crate::contact::NormalLaw;
use crate::contact::face::FaceContact;
use crate::contact::law::Friction;
use crate::geometry::Polyhedron;
use crate::grain::CondensedGrain;
use crate::material::Elastic;
use crate::mesh::{Mesh, NearPoint, polyhedron_mesh, sphere_mesh};
use crate::scene::{BodyLoad, LoadStage, SceneBody, SceneParameters, SceneShape};
use crate::solver::Settings;
use crate::tensor::{Pose, Rotation, Vec3};

/// Edges are rounded by this share of a body's smallest extent, as in case files.
pub const ROUNDING: f64 = 0.02;
/// [kg/m^3]
pub const DENSITY: f64 = 2700.0;
pub const HELD: [Option<f64>; 3] = [Some(0.0); 3];

/// A body of the rock that all problems use: E = 30 GPa, nu = 0.2.
pub fn body(name: &str, shape: SceneShape, position: [f64; 3], rotation: [f64; 3]) -> SceneBody {
    SceneBody {
        name: name.into(),
        shape,
        pose: Pose::new(Vec3::from(position), Rotation::from_scaled_axis(Vec3::from(rotation))),
        offset: Vec3::zeros(),
        density: DENSITY,
        youngs_modulus: 30e9,
        poissons_ratio: 0.2,
        limit_pressure: f64::INFINITY,
        friction: None,
        grain: None,
        full: None,
        damaged: None,
        rests: false,
        fixed: false,
        unyielding: false,
    }
}

/// A condensed sphere: cells of `far` [m], smaller ones as `near` says.
pub fn condensed_sphere(
    name: &str,
    [radius, rounding]: [f64; 2],
    far: f64,
    near: &NearPoint,
    position: [f64; 3],
) -> SceneBody {
    let mesh = sphere_mesh(radius, far, Some(near)).expect("a mesh");
    let shape = SceneShape::meshed_ball(&mesh, radius, rounding).expect("a hull");
    condensed(body(name, shape, position, [0.0; 3]), mesh)
}

/// The body with this mesh, condensed.
pub fn condensed(placed: SceneBody, mesh: Mesh) -> SceneBody {
    let rock = Elastic::new(placed.youngs_modulus, placed.poissons_ratio).expect("allowed");
    let rock = vec![rock; mesh.cells.len()];
    let grain = CondensedGrain::new(mesh, &rock, DENSITY).expect("a grain");
    SceneBody { grain: Some(Arc::new(grain)), ..placed }
}

/// The same scene with cells of this size [m] in all bodies that move, and faces that carry over their area.
pub fn meshed_by_area(mut parameters: SceneParameters, mesh_size: f64) -> SceneParameters {
    let with_cells = |placed: SceneBody| match &placed.shape {
        SceneShape::Polyhedron { nominal, .. } if !placed.fixed => {
            let mesh = polyhedron_mesh(nominal, mesh_size).expect("a mesh");
            condensed(placed, mesh)
        }
        _ => placed,
    };
    parameters.bodies = parameters.bodies.into_iter().map(with_cells).collect();
    SceneParameters { faces: FaceContact::Area, ..parameters }
}

/// A box of these edge lengths [m], which are positive.
pub fn cuboid(size: [f64; 3]) -> SceneShape {
    let rounding = ROUNDING * size.iter().copied().fold(f64::INFINITY, f64::min);
    SceneShape::Polyhedron { nominal: Polyhedron::cuboid(size).expect("positive edges"), rounding }
}

/// The convex hull of `points` [m], which span a volume.
pub fn hull(points: &[[f64; 3]], rounding: f64) -> SceneShape {
    let points: Vec<Vec3> = points.iter().map(|p| Vec3::from(*p)).collect();
    SceneShape::Polyhedron { nominal: Polyhedron::convex_hull(&points).expect("a volume"), rounding }
}

pub fn fixed(body: SceneBody) -> SceneBody {
    SceneBody { fixed: true, ..body }
}

/// A 1 m plate whose upper face is z = 0.
pub fn ground() -> SceneBody {
    fixed(body("ground", cuboid([1.0, 1.0, 0.1]), [0.0, 0.0, -0.05], [0.0; 3]))
}

/// Bodies of one coefficient of friction, without gravity; increments may be cut to 1/64.
pub fn scene(bodies: Vec<SceneBody>, friction: f64, stages: Vec<LoadStage>) -> SceneParameters {
    // What has no equilibrium is to be given up in good time.
    let settings = Settings { max_augmentations: 150, ..Settings::default() };
    SceneParameters {
        press: None,
        bodies,
        gravity: Vec3::zeros(),
        friction: Friction::constant(friction),
        faces: FaceContact::Corners,
        normal: NormalLaw::Spring,
        settings,
        increment_range: [1.0 / 64.0, 1.0],
        stages,
    }
}

/// Forces balance to 1e-5 of the mean contact force, where a limit is to be found sharply.
pub fn sharp(mut parameters: SceneParameters) -> SceneParameters {
    parameters.settings.force_tolerance = 1e-5;
    parameters
}

/// A stage that does something to one body.
pub fn load(increments: usize, name: &str, load: BodyLoad) -> LoadStage {
    LoadStage { increments, bodies: vec![(name.into(), load)], gravity: None }
}

/// A stage that brings gravity to this [m/s^2].
pub fn gravity(increments: usize, gravity: [f64; 3]) -> LoadStage {
    LoadStage { increments, bodies: vec![], gravity: Some(Vec3::from(gravity)) }
}

/// A force [N] at the end of the stage.
pub fn push(force: [f64; 3]) -> BodyLoad {
    BodyLoad { force: Some(force.map(Some)), ..BodyLoad::default() }
}

/// A displacement [m] and a rotation [rad] over the stage.
pub fn drive(displacement: [Option<f64>; 3], rotation: [Option<f64>; 3]) -> BodyLoad {
    BodyLoad { displacement: Some(displacement), rotation: Some(rotation), ..BodyLoad::default() }
}

/// Motion in the x-z plane only.
pub fn in_plane() -> BodyLoad {
    drive([None, Some(0.0), None], [Some(0.0), None, Some(0.0)])
}
