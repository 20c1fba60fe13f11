//! What a scene is made of: plain data in SI.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::contact::NormalLaw;
use crate::contact::face::FaceContact;
use crate::contact::law::Friction;
use crate::error::Result;
use crate::geometry::{Polyhedron, RoundedBody};
use crate::grain::{CondensedGrain, DamagedGrain, FullGrain};
use crate::mesh::{Mesh, sphere_hull};
use crate::scene::press::PressParameters;
use crate::solver::Settings;
use crate::tensor::{Pose, Vec3};

/// A whole scene and what is done to it.
#[derive(Debug, Clone)]
pub struct SceneParameters {
    pub bodies: Vec<SceneBody>,
    /// Gravity before the first stage [m/s^2].
    pub gravity: Vec3,
    /// Friction of bodies that have none of their own; of two bodies the lower one rules.
    pub friction: Friction,
    /// What two parallel faces carry by.
    pub faces: FaceContact,
    /// What bears the normal force between rigid bodies.
    pub normal: NormalLaw,
    pub settings: Settings,
    /// Smallest and largest increment over a stage's.
    pub increment_range: [f64; 2],
    pub stages: Vec<LoadStage>,
    /// A press in place of the contact of hulls.
    pub press: Option<PressParameters>,
}

/// A body set by hand. It is rigid, with a local compliance at each contact that its size, Young's
/// modulus and Poisson's ratio give, unless it is condensed or full.
#[derive(Debug, Clone)]
pub struct SceneBody {
    /// Unique in the scene.
    pub name: String,
    pub shape: SceneShape,
    pub pose: Pose,
    /// Where `pose` lies from the point that the body is placed by, in body coordinates [m].
    pub offset: Vec3,
    /// [kg/m^3]
    pub density: f64,
    /// [Pa]
    pub youngs_modulus: f64,
    pub poissons_ratio: f64,
    /// At which its rock is crushed where it is indented [Pa]; infinite: it never is.
    pub limit_pressure: f64,
    pub friction: Option<Friction>,
    /// Its own flexibility, where it is condensed.
    pub grain: Option<Arc<CondensedGrain>>,
    /// Its mesh, where all its nodes move with finite strains; with `grain` besides, by which they are eliminated, or as unknowns.
    pub full: Option<Arc<FullGrain>>,
    /// The same with its damage, where it can break.
    pub damaged: Option<Arc<DamagedGrain>>,
    /// Whether it is rigid until it needs its flexibility, as far as it has one.
    pub rests: bool,
    /// Never moves.
    pub fixed: bool,
    /// Does not yield at its contacts, whatever its modulus.
    pub unyielding: bool,
}

#[derive(Debug, Clone, PartialEq)]
pub enum SceneShape {
    /// A convex polyhedron in body coordinates [m] and the radius [m] of its edges and corners.
    Polyhedron { nominal: Polyhedron, rounding: f64 },
    /// Radius [m].
    Sphere(f64),
    /// A shape with its rounding already chosen.
    Rounded { nominal: Polyhedron, rounded: RoundedBody },
}

impl SceneShape {
    /// What a ball about the origin with this mesh touches others by: the hull of its surface nodes, all of them on the sphere, of edges and corners as
    /// round as `rounding` [m].
    pub fn meshed_ball(mesh: &Mesh, radius: f64, rounding: f64) -> Result<Self> {
        let nominal = sphere_hull(mesh, radius)?;
        let core = nominal.scaled(1.0 - rounding / radius);
        Ok(SceneShape::Rounded { nominal, rounded: RoundedBody { core, radius: rounding } })
    }
}

/// A stage: everything is linear over it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LoadStage {
    pub increments: usize,
    /// By name of the body.
    pub bodies: Vec<(String, BodyLoad)>,
    /// Gravity at the end [m/s^2]; `None`: as before.
    pub gravity: Option<Vec3>,
}

/// What a stage does to a body. A list that is `None` leaves things as they were (free and unloaded
/// at first; a component that was driven is held); a component that is `None` is free, or is not loaded
/// at the end. What held a component before it is set free fades over the stage.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyLoad {
    /// Of the reference point over the stage [m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacement: Option<[Option<f64>; 3]>,
    /// Rotation vector over the stage [rad]. Where only some components are given, they are the
    /// spin about these axes in each increment.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<[Option<f64>; 3]>,
    /// At the end of the stage [N].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<[Option<f64>; 3]>,
    /// About the reference point, at the end of the stage [N m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moment: Option<[Option<f64>; 3]>,
}
