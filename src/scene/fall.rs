//! Falls: where bodies have no equilibrium near, rigid-body dynamics takes them to where they come to rest.
//!
//! Time and masses are the engine's own. A body is as heavy as its load, so that all are accelerated alike, and damping brings them to rest. Only
//! where they lie then is kept: the solver has to find their balance there. What is held or driven goes its way meanwhile.

use rapier3d_f64::dynamics::{RigidBodyBuilder, RigidBodyHandle};
use rapier3d_f64::geometry::ColliderBuilder;
use rapier3d_f64::pipeline::PhysicsWorld;
use rapier3d_f64::prelude::CoefficientCombineRule;

use crate::engine;
use crate::model::{BodyKind, Loads, Model};
use crate::solver::StopSignal;
use crate::tensor::{self, Pose, Vec3};

/// Share of their friction with which bodies fall, one fall after the other: what the engine holds at the limit of friction, contacts may not.
pub(super) const FRICTION: [f64; 3] = [1.0, 0.8, 0.64];

/// [s], with an acceleration by a body's load of 1 unit/s^2; the unit is the median radius.
const TIME_STEP: f64 = 1.0 / 120.0;
/// Iterations in a step: a body may bear thousands of times its own load.
const ITERATIONS: usize = 8;
/// Damping [1/s], so that nothing falls faster than 2 unit/s; and at the end, where small bodies under large ones still tremble.
const DAMPING: f64 = 0.5;
const LAST_DAMPING: f64 = 20.0;
/// Least load over the largest that counts for the mass.
const LEAST_LOAD: f64 = 1e-9;
/// Steps in which what is driven goes its way, of a fall, and of its end.
const DRIVE_STEPS: usize = 240;
const MOST_STEPS: usize = 10_000;
const LAST_STEPS: usize = 500;
/// Velocities [unit/s] of what is at rest, and steps for which all is; a body that is faster than the other bound is lost.
const AT_REST: f64 = 1e-3;
const REST_STEPS: usize = 60;
const LOST: f64 = 1e3;

/// Where bodies come to lie under `loads` that fall from `from` with a `share` of their friction, while what is held or driven goes to where it is in
/// `to`. `None` where nothing loads them, some are lost or `stop` is raised.
pub(super) fn fallen(
    model: &Model,
    loads: &Loads,
    [from, to]: [&[Pose]; 2],
    share: f64,
    stop: &StopSignal,
) -> Option<Vec<Pose>> {
    let mut fall = Fall::new(model, loads, from, share)?;
    let mut calm = 0;
    for step in 1..=MOST_STEPS + LAST_STEPS {
        if step <= DRIVE_STEPS {
            fall.drive(from, to, step as f64 / DRIVE_STEPS as f64);
        }
        if step == MOST_STEPS {
            fall.damp(LAST_DAMPING);
        }
        fall.world.step();
        let fastest = fall.fastest();
        if !(fastest < LOST) || stop.is_raised() {
            return None;
        }
        calm = if fastest < AT_REST && step > DRIVE_STEPS { calm + 1 } else { 0 };
        if calm == REST_STEPS {
            break;
        }
    }
    fall.poses(to)
}

struct Fall {
    world: PhysicsWorld,
    unit: f64,
    /// Bodies that fall, and those that are held or driven.
    free: Vec<(usize, RigidBodyHandle)>,
    held: Vec<(usize, RigidBodyHandle)>,
}

impl Fall {
    fn new(model: &Model, loads: &Loads, from: &[Pose], share: f64) -> Option<Self> {
        let there = (0..model.bodies.len()).filter(|&i| model.bodies[i].kind != BodyKind::Gone);
        let is_free = |i: &usize| !model.bodies[*i].kind.is_support() && loads.prescribed[*i] == [false; 6];
        let (free, held): (Vec<usize>, Vec<usize>) = there.partition(is_free);
        let unit = tensor::median(free.iter().map(|&i| model.bodies[i].rotation_scale))?;
        let pull = |i: usize| pull(model, loads, from, i);
        let load = |i: usize| {
            let (force, moment) = pull(i);
            force.norm() + moment.norm() / model.bodies[i].rotation_scale
        };
        let most = free.iter().map(|&i| load(i)).fold(0.0, f64::max);
        if most == 0.0 {
            return None;
        }
        let mut world = engine::world(TIME_STEP);
        world.integration_parameters.num_solver_iterations = ITERATIONS;
        let mut add = |i: usize, body: RigidBodyBuilder| {
            let friction = model.bodies[i].friction.unwrap_or(model.friction).peak;
            let collider = ColliderBuilder::new(engine::shape_of(&model.shapes[i].rounded, unit)?)
                .mass((load(i) / most).max(LEAST_LOAD))
                .friction(share * friction)
                .friction_combine_rule(CoefficientCombineRule::Min)
                .restitution(0.0);
            let (handle, _) = world.insert(body.pose(engine::pose_in(&from[i], unit)), collider);
            let (force, moment) = pull(i);
            let own = &mut world.bodies[handle];
            own.add_force(engine::vector(&(force / most)), true);
            own.add_torque(engine::vector(&(moment / (most * unit))), true);
            Some((i, handle))
        };
        let falling = || RigidBodyBuilder::dynamic().can_sleep(false).ccd_enabled(true);
        let free = free.into_iter().map(|i| add(i, falling())).collect::<Option<_>>()?;
        let held = held.into_iter().map(|i| add(i, RigidBodyBuilder::kinematic_position_based()));
        let held = held.collect::<Option<_>>()?;
        let mut fall = Fall { world, unit, free, held };
        fall.damp(DAMPING);
        Some(fall)
    }

    /// Puts what is held or driven at this share of its way.
    fn drive(&mut self, from: &[Pose], to: &[Pose], share: f64) {
        for &(i, handle) in &self.held {
            let position = from[i].position.lerp(&to[i].position, share);
            let pose = Pose::new(position, from[i].rotation.slerp(&to[i].rotation, share));
            self.world.bodies[handle].set_next_kinematic_position(engine::pose_in(&pose, self.unit));
        }
    }

    fn damp(&mut self, damping: f64) {
        for (_, handle) in &self.free {
            let body = &mut self.world.bodies[*handle];
            body.set_linear_damping(damping);
            body.set_angular_damping(damping);
        }
    }

    /// The largest velocity or spin; not a number where one is not.
    fn fastest(&self) -> f64 {
        let speed = |handle: RigidBodyHandle| {
            let body = &self.world.bodies[handle];
            body.linvel().length() + body.angvel().length()
        };
        self.free
            .iter()
            .map(|&(_, handle)| speed(handle))
            .fold(0.0, |most, speed| if speed <= most { most } else { speed })
    }

    /// `to` with what fell where it is now.
    fn poses(&self, to: &[Pose]) -> Option<Vec<Pose>> {
        let mut poses = to.to_vec();
        for &(i, handle) in &self.free {
            poses[i] = engine::pose_from(self.world.bodies[handle].position(), self.unit)?;
        }
        Some(poses)
    }
}

/// Force on a body and moment about its centre of mass, of its weight and of what is applied [N, N m].
fn pull(model: &Model, loads: &Loads, poses: &[Pose], body: usize) -> (Vec3, Vec3) {
    let (own, applied) = (&model.bodies[body], &loads.applied[body]);
    let (force, moment) = (Vec3::from(applied.fixed_rows::<3>(0)), Vec3::from(applied.fixed_rows::<3>(3)));
    let arm = poses[body].rotation * own.centre_of_mass;
    (force + loads.gravity * own.mass, moment - arm.cross(&force))
}
