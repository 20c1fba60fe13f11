//! Rigid-body dynamics (rapier3d, f64): packings are compacted by it, and bodies of a scene that have no equilibrium where they are fall by it.
//!
//! Lengths are in units that the caller chooses. The same input gives the same bits on any number of threads.

mod contacts;

use rapier3d_f64::geometry::{NarrowPhase, SharedShape};
use rapier3d_f64::math::{Pose as EnginePose, Rotation as EngineRotation, Vector};
use rapier3d_f64::pipeline::PhysicsWorld;

use crate::geometry::RoundedBody;
use crate::tensor::{Pose, Rotation, Vec3};
use contacts::FreshContacts;

/// A world without gravity whose contacts are found afresh in each step of `time_step` [s].
pub fn world(time_step: f64) -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    world.narrow_phase = NarrowPhase::with_query_dispatcher(FreshContacts);
    let p = &mut world.integration_parameters;
    p.dt = time_step;
    p.num_solver_iterations = 4;
    p.normalized_allowed_linear_error = 2e-4;
    p.normalized_prediction_distance = 0.02;
    p.contact_softness.natural_frequency = 60.0;
    p.contact_softness.damping_ratio = 2.0;
    p.static_contact_softness.natural_frequency = 120.0;
    p.static_contact_softness.damping_ratio = 2.0;
    p.contact_recycling = false;
    world
}

/// A rounded body for the engine; `None` where it refuses the core.
pub fn shape_of(body: &RoundedBody, unit: f64) -> Option<SharedShape> {
    let core = &body.core;
    if core.facets.is_empty() {
        return Some(SharedShape::ball(body.radius / unit));
    }
    let vertices = core.vertices.iter().map(|v| vector(&(v / unit))).collect();
    let facets: Vec<[u32; 3]> = core.facets.iter().map(|f| f.map(|v| v as u32)).collect();
    SharedShape::round_convex_mesh(vertices, &facets, body.radius / unit)
}

pub fn vector(v: &Vec3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

pub fn pose_in(pose: &Pose, unit: f64) -> EnginePose {
    let q = pose.rotation;
    EnginePose::from_parts(vector(&(pose.position / unit)), EngineRotation::from_xyzw(q.i, q.j, q.k, q.w))
}

/// `None` where the engine lost the body.
pub fn pose_from(pose: &EnginePose, unit: f64) -> Option<Pose> {
    let (t, q) = (pose.translation, pose.rotation);
    let position = Vec3::new(t.x, t.y, t.z);
    let sound = q.is_finite() && position.iter().all(|x| x.is_finite());
    let rotation = || Rotation::new_normalize(nalgebra::Quaternion::new(q.w, q.x, q.y, q.z));
    sound.then(|| Pose::new(position * unit, rotation()))
}
