//! A body of a scene from its case: its shape, its rock condensed, full or breakable, and where it stands.

use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

use crate::case::{BodyCase, Case, Fidelity, Geometry, RockCase, ShapeCase, StageCase};
use crate::contact::NormalLaw;
use crate::contact::law::Friction;
use crate::error::{Error, Result};
use crate::geometry::Polyhedron;
use crate::grain::{CondensedGrain, DamagedGrain, FullGrain};
use crate::mesh::Mesh;
use crate::mesh::file::read_mesh;
use crate::scene::{SceneBody, SceneParameters, SceneShape};
use crate::tensor::{Pose, Rotation, Vec3};

use super::rock;
use super::shapes::{body_mesh, polyhedron, shown_mesh};

/// Body number `index` of a scene. `folder` is where mesh files are relative to.
///
/// # Errors
/// `Error::Usage` for what a scene cannot do yet; `Error::Mesh` and `Error::Io` where a mesh file cannot be
/// used.
pub fn scene_body(case: &Case, index: usize, body: &BodyCase, folder: &Path) -> Result<SceneBody> {
    let mut rock: RockCase = case.rock_of(body).clone();
    let fidelity = case.fidelity_of(body);
    let mesh = match fidelity {
        Fidelity::Rigid => None,
        Fidelity::Auto | Fidelity::Condensed | Fidelity::Full => Some(body_mesh(case, index, body, folder)?),
    };
    // A rigid body from a file has its shape from there, too.
    let file_mesh = match &body.shape {
        ShapeCase::Mesh(file) if mesh.is_none() => Some(read_mesh(&folder.join(file))?),
        _ => None,
    };
    let solid = mesh.as_ref().or(file_mesh.as_ref());
    let mut density = rock.density;
    if let (ShapeCase::Mesh(_), Some(mesh)) = (&body.shape, solid) {
        // It weighs what its cells do, not what its hull would.
        density *= mesh.volume() / mesh.convex_hull()?.volume();
    }
    let shape = shape_of(case, index, body, solid)?;
    if let (ShapeCase::Sphere(radius), SceneShape::Rounded { nominal, .. }, Some(mesh)) =
        (&body.shape, &shape, &mesh)
    {
        // Hull and mesh lie within the ball: they are given its mass.
        let ball = 4.0 / 3.0 * PI * radius.powi(3);
        density *= ball / nominal.volume();
        rock.density *= ball / mesh.volume();
    }
    let (shape, mesh, offset) = about_own_middle(case, body, shape, mesh);
    let Inner { grain, full, damaged } = inner(case, &rock, index, body, mesh)?;
    let mut pose =
        Pose::new(Vec3::from(body.position), Rotation::from_scaled_axis(Vec3::from(body.rotation)));
    pose.position += pose.rotation * offset;
    Ok(SceneBody {
        name: body.name.clone(),
        shape,
        grain,
        full,
        damaged,
        rests: fidelity == Fidelity::Auto,
        pose,
        offset,
        density,
        youngs_modulus: rock.youngs_modulus.mean,
        poissons_ratio: rock.poissons_ratio.mean,
        limit_pressure: case.limit_pressure_of(&rock),
        friction: body.friction.map(|peak| friction(case, peak)),
        fixed: body.fixed,
        // What is fixed and rigid is so, unless its own rock says how it yields.
        unyielding: body.fixed && fidelity == Fidelity::Rigid && body.rock.is_none(),
    })
}

/// The surface by which body number `index` touches others.
fn shape_of(case: &Case, index: usize, body: &BodyCase, mesh: Option<&Mesh>) -> Result<SceneShape> {
    match &body.shape {
        ShapeCase::Box(_) | ShapeCase::Polyhedron(_) | ShapeCase::Cylinder { .. } | ShapeCase::Grain(_) => {
            let hull = polyhedron(case, index, body)?;
            let hull = hull.ok_or_else(|| Error::Usage(format!("{:?} has no shape", body.name)))?;
            Ok(rounded(case, body, hull))
        }
        ShapeCase::Sphere(radius) => match mesh {
            Some(mesh) => {
                let rounding = body.rounding.unwrap_or(case.contact.rounding * 2.0 * radius);
                SceneShape::meshed_ball(mesh, *radius, rounding)
            }
            None => Ok(SceneShape::Sphere(*radius)),
        },
        ShapeCase::Mesh(_) => {
            let mesh = mesh.ok_or_else(|| Error::Usage(format!("{:?} has no shape", body.name)))?;
            Ok(rounded(case, body, mesh.convex_hull()?))
        }
    }
}

/// A polyhedron with the body's rounding, or the case's share of its smallest extent along an axis.
fn rounded(case: &Case, body: &BodyCase, nominal: Polyhedron) -> SceneShape {
    let extent = |k: usize| {
        let along = nominal.vertices.iter().map(|v| v[k]);
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
    };
    let smallest = (0..3).map(extent).fold(f64::INFINITY, f64::min);
    let rounding = body.rounding.unwrap_or(case.contact.rounding * smallest);
    SceneShape::Polyhedron { nominal, rounding }
}

/// A body far from the point that it is placed by, in a frame of its own about its centroid; with that
/// frame's offset [m].
fn about_own_middle(
    case: &Case,
    body: &BodyCase,
    shape: SceneShape,
    mesh: Option<Mesh>,
) -> (SceneShape, Option<Mesh>, Vec3) {
    match shape {
        SceneShape::Polyhedron { nominal, rounding }
            if nominal.far_middle().is_some() && is_left_alone(case, body) =>
        {
            let offset = nominal.centroid();
            let shape = SceneShape::Polyhedron { nominal: nominal.translated(&-offset), rounding };
            (shape, mesh.map(|mesh| mesh.moved(&-offset)), offset)
        }
        shape @ (SceneShape::Polyhedron { .. } | SceneShape::Rounded { .. } | SceneShape::Sphere(_)) => {
            (shape, mesh, Vec3::zeros())
        }
    }
}

/// Whether nothing but gravity and contacts moves a body, so that it is all one about which point its motion
/// counts.
fn is_left_alone(case: &Case, body: &BodyCase) -> bool {
    let Geometry::Scene(scene) = &case.geometry else { return false };
    let named = |stage: &StageCase| match stage {
        StageCase::Load { bodies, .. } => bodies.contains_key(&body.name),
        _ => false,
    };
    scene.press.is_none() && (body.fixed || !case.stages.iter().any(named))
}

/// Whether it is the body in the press of its scene.
fn is_pressed(case: &Case, body: &BodyCase) -> bool {
    let Geometry::Scene(scene) = &case.geometry else { return false };
    scene.press.as_ref().is_some_and(|press| press.body == body.name)
}

/// What a body is like within; nothing of a rigid one.
#[derive(Default)]
struct Inner {
    grain: Option<Arc<CondensedGrain>>,
    full: Option<Arc<FullGrain>>,
    damaged: Option<Arc<DamagedGrain>>,
}

/// Of body number `index`, made of `rock` on its mesh.
fn inner(case: &Case, rock: &RockCase, index: usize, body: &BodyCase, mesh: Option<Mesh>) -> Result<Inner> {
    let (name, seed) = (&body.name, case.seed);
    let mut contact = case.contact;
    if is_pressed(case, body) {
        // Plates meet its nodes, and the forces of nodes are no contacts of asperities.
        contact.normal = NormalLaw::Spring;
    }
    match (case.fidelity_of(body), mesh) {
        (Fidelity::Auto | Fidelity::Condensed, Some(mesh)) => {
            let grain = rock::condensed(rock, name, index, mesh, (seed, &contact))?;
            let damaged = rock::damaged(rock, name, index, &grain, seed)?;
            Ok(Inner { grain: Some(grain), full: None, damaged })
        }
        (Fidelity::Full, Some(mesh)) => {
            let full = rock::full(rock, name, index, mesh, (seed, &contact))?;
            let grain = full.condensed().clone();
            let damaged = rock::damaged(rock, name, index, &grain, seed)?;
            Ok(Inner { grain: Some(grain), full: Some(full), damaged })
        }
        (Fidelity::Auto | Fidelity::Rigid | Fidelity::Condensed | Fidelity::Full, _) => Ok(Inner::default()),
    }
}

/// The law of a body with this peak coefficient: the residual one is the case's, or the peak where
/// that is lower.
pub fn friction(case: &Case, peak: f64) -> Friction {
    Friction {
        peak,
        residual: case.contact.residual_friction.min(peak),
        weakening_distance: case.contact.weakening_distance,
    }
}

/// A mesh of each body to show it by: the one that it is condensed with, or, of a rigid one, a coarse one;
/// `None` where the generator cannot mesh that.
pub fn body_meshes(case: &Case, parameters: &SceneParameters, folder: &Path) -> Result<Vec<Option<Mesh>>> {
    let Geometry::Scene(scene) = &case.geometry else { return Ok(Vec::new()) };
    let mesh = |(index, (body, built)): (usize, (&BodyCase, &SceneBody))| {
        let meshed = built.grain.is_some() || body.mesh_size.is_some();
        match meshed {
            true => body_mesh(case, index, body, folder).map(Some),
            false => shown_mesh(case, index, body, folder),
        }
    };
    scene.bodies.iter().zip(&parameters.bodies).enumerate().map(mesh).collect()
}
