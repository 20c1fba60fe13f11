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
/// Velocities [unit/s] of what is at rest, and steps for which all is.
const AT_REST: f64 = 1e-3;
const REST_STEPS: usize = 60;
/// What still falls at the end is faster than this; what trembles is slower.
const FALLING: f64 = 0.4 / LAST_DAMPING;

/// Where bodies come to lie under `loads` that fall from `from` with a `share` of their friction, while what is held or driven goes to where it is in
/// `to`. `None` where nothing loads them, some never come to rest or `stop` is raised.
pub(super) fn fallen(
    model: &Model,
    loads: &Loads,
    [from, to]: [&[Pose]; 2],
    share: f64,
    stop: &StopSignal,
) -> Option<Vec<Pose>> {
    let mut fall = Fall::new(model, loads, from, share)?;
    let (mut calm, mut fastest) = (0, 0.0);
    for step in 1..=MOST_STEPS + LAST_STEPS {
        if step <= DRIVE_STEPS {
            fall.drive(from, to, step as f64 / DRIVE_STEPS as f64);
        }
        if step == MOST_STEPS {
            fall.damp(LAST_DAMPING);
        }
        fall.world.step();
        fastest = fall.fastest();
        calm = if fastest < AT_REST && step > DRIVE_STEPS { calm + 1 } else { 0 };
        if calm == REST_STEPS || stop.is_raised() {
            break;
        }
    }
    if !(fastest < FALLING) || stop.is_raised() {
        return None;
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

    /// The largest velocity and spin [unit/s]; not a number where one is not.
    fn fastest(&self) -> f64 {
        let speed = |handle: RigidBodyHandle| {
            let body = &self.world.bodies[handle];
            body.linvel().length().max(body.angvel().length())
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::law::Friction;
    use crate::contact::{ContactLaw, ContactShape};
    use crate::geometry::{Polyhedron, RoundedBody};
    use crate::model::Body;
    use crate::tensor::Rotation;

    const WEIGHT: Vec3 = Vec3::new(0.0, 0.0, -9.81);

    type Lying = (Body, ContactShape, Pose);

    /// A box that leans by `turn`, its centre half its height above the ground.
    fn box_at(x: f64, size: [f64; 3], turn: f64) -> Lying {
        let (body, shape) = Body::block("box", BodyKind::Placed, size, 1e-3 * size[0], 0.05);
        let pose = Pose::new(Vec3::new(x, 0.0, 0.5 * size[2]), Rotation::from_scaled_axis(Vec3::y() * turn));
        (Body { mass: 1.0, ..body }, shape, pose)
    }

    fn ball_at(x: f64, z: f64, radius: f64) -> Lying {
        let body = Body::rigid("ball", BodyKind::Placed, Polyhedron::point(), 1e8, radius);
        let shape = ContactShape::new(RoundedBody::sphere(radius));
        (Body { mass: 1.0, ..body }, shape, Pose::new(Vec3::new(x, 0.0, z), Rotation::identity()))
    }

    /// Where these bodies on the ground come to lie, with this friction; the last is driven along `way`.
    fn lie(bodies: Vec<Lying>, friction: f64, gravity: Vec3, way: Option<Vec3>) -> Option<Vec<Pose>> {
        let (ground, ground_shape) = Body::block("ground", BodyKind::Fixed, [1.0, 1.0, 0.1], 1e-3, 0.5);
        let place = Pose::new(Vec3::new(0.0, 0.0, -0.05), Rotation::identity());
        let mut all = (vec![ground], vec![ground_shape], vec![place]);
        for (body, shape, pose) in bodies {
            all.0.push(body);
            all.1.push(shape);
            all.2.push(pose);
        }
        let (bodies, shapes, from) = all;
        let last = bodies.len() - 1;
        let model = Model::new(bodies, shapes, ContactLaw::of_rock(1e-3, 0.2), Friction::constant(friction));
        let mut loads = Loads { gravity, ..Loads::none(last + 1) };
        let mut to = from.clone();
        if let Some(way) = way {
            loads.prescribed[last] = [true; 6];
            to[last].position += way;
        }
        fallen(&model, &loads, [&from, &to], 1.0, &StopSignal::default())
    }

    #[test]
    fn a_dropped_ball_lies_on_the_ground() {
        let poses = lie(vec![ball_at(0.0, 0.2, 0.01)], 0.5, WEIGHT, None).expect("it comes to rest");
        assert!((poses[1].position - Vec3::z() * 0.01).norm() < 2e-5, "{}", poses[1].position);
    }

    /// A slender box leans by 0.2, beyond atan(0.1 / 1): it comes to lie on its side. Leaning by 0.05 it stands up.
    #[test]
    fn a_box_topples_where_its_weight_is_beyond_its_edge() {
        for (lean, height) in [(0.2, 0.005), (0.05, 0.05)] {
            let poses = lie(vec![box_at(0.0, [0.01, 0.03, 0.1], lean)], 0.5, WEIGHT, None);
            let lies = poses.expect("it comes to rest")[1].position.z;
            assert!((lies - height).abs() < 2e-2 * height, "{lean}: {lies}");
        }
    }

    /// Gravity leans by 0.3. With a friction of 0.35 the box stays while a slender one beside it topples; with 0.25 it slides.
    #[test]
    fn friction_holds_what_it_holds() {
        let boxes = || vec![box_at(0.0, [0.05; 3], 0.0), box_at(-0.3, [0.01, 0.03, 0.1], 0.0)];
        let gravity = WEIGHT + Vec3::x() * (9.81 * 0.3);
        let poses = lie(boxes(), 0.35, gravity, None).expect("it comes to rest");
        assert!(poses[1].position.x.abs() < 1e-3 * 0.05, "{}", poses[1].position);
        assert!((poses[2].position.z - 0.005).abs() < 1e-4, "{}", poses[2].position);
        let slid = lie(boxes(), 0.25, gravity, None).map_or(f64::MAX, |poses| poses[1].position.x);
        assert!(slid > 0.05, "{slid}");
    }

    /// A ball beside the ground.
    #[test]
    fn what_never_comes_to_rest_has_no_place() {
        assert!(lie(vec![ball_at(0.6, 0.2, 0.01)], 0.5, WEIGHT, None).is_none());
    }

    /// It goes all its way and shoves the ball before it.
    #[test]
    fn what_is_driven_goes_its_way() {
        let way = Vec3::new(0.05, 0.0, 0.0);
        let bodies = vec![ball_at(0.06, 0.02, 0.02), box_at(0.0, [0.05; 3], 0.0)];
        let poses = lie(bodies, 0.5, WEIGHT, Some(way)).expect("at rest");
        assert_eq!(poses[2].position, way + Vec3::z() * 0.025);
        assert!(poses[1].position.x > 0.05 + 0.025 + 0.0199, "{}", poses[1].position);
    }

    #[test]
    fn nothing_falls_without_a_load() {
        assert!(lie(vec![box_at(0.0, [0.05; 3], 0.0)], 0.5, Vec3::zeros(), None).is_none());
    }
}
