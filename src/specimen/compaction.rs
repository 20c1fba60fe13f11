//! Compaction of placed grains into a touching packing, by rigid-body dynamics (rapier3d, f64).
//!
//! The grains are the rounded bodies themselves (core and border radius), between 24 smooth wall
//! panels and two smooth plates that shrink along one strain. There is no gravity. Two dials act:
//!
//! 1. the strain rate follows a servo on the mean wall pressure;
//! 2. once the pressure is reached, friction falls from its largest value towards zero, and the
//!    packing creeps denser, until the asked void ratio is reached.
//!
//! So one run covers the loosest packing (jammed with the largest friction) to the densest (at rest
//! without friction), and a void ratio outside is answered with that range. A hold at 5 % of the
//! pressure takes out nearly all overlap. The same input gives the same bits on any number of threads.
//!
//! Inside this module lengths are in units of 0.7 times the median sieve size, densities are 1 and
//! times in s: only the packing matters, not the time that the engine took to reach it.

use crate::engine;
use crate::error::{Error, Result};
use crate::specimen::placement::Placement;
use crate::specimen::shape::GrainShape;
use crate::tensor::{self, Pose};
use rapier3d_f64::dynamics::{RigidBodyBuilder, RigidBodyHandle};
use rapier3d_f64::geometry::{ColliderBuilder, ColliderHandle};
use rapier3d_f64::math::{Pose as EnginePose, Rotation as EngineRotation, Vector};
use rapier3d_f64::pipeline::PhysicsWorld;
use rapier3d_f64::prelude::CoefficientCombineRule;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::f64::consts::{PI, TAU};

/// Panels of the wall: a regular polygon around the specimen.
pub const WALL_PANELS: usize = 24;

/// The void ratio reached may differ from the one asked by this.
pub const VOID_RATIO_TOLERANCE: f64 = 0.01;

/// Half the thickness of a panel or plate [unit].
const PANEL: f64 = 3.0;

const TIME_STEP: f64 = 1.0 / 120.0;

/// Wall pressure during compaction and in the final hold, in units of density times (unit per s)^2.
const PRESSURE: f64 = 20.0;
const HOLD_PRESSURE: f64 = 0.05 * PRESSURE;

/// Linear strain rate [1/s] of the walls at most: far from contact, and near jamming.
const APPROACH_RATE: f64 = 0.10;
const RATE: f64 = 0.05;

/// Solid fraction up to which the walls may approach fast.
const APPROACH_FRACTION: f64 = 0.45;

/// Grain friction at the loosest end of the dial.
pub const LARGEST_FRICTION: f64 = 1.0;

/// Time [s] in which the dial lets friction fall by e, and the friction taken as none.
const FRICTION_TIME: f64 = 0.8;
const LEAST_FRICTION: f64 = 5e-3;

/// At rest: the pressure near its goal, and the void ratio of the last `REST_TIME` s in this band.
const REST_TIME: f64 = 0.5;
const REST_BAND: f64 = 4e-3;

/// The same for the densest packing, where the pressure's servo creeps in slowly, and the time [s]
/// without friction after which it counts as densest anyway.
const DENSEST_BAND: f64 = 1.5e-3;
const DENSEST_TIME: f64 = 6.0;

/// A packing with the largest friction may creep for this long [s] before it counts as the loosest.
const CREEP_TIME: f64 = 1.5;

/// Time [s] of the hold with its linear strain rate, and the bound of the approach.
const HOLD_TIME: f64 = 2.0;
const HOLD_RATE: f64 = 0.1 * RATE;
const LONGEST: f64 = 30.0;

/// Damping [1/s] of the grains' velocities and spins: during compaction, and in the hold.
const DAMPING: f64 = 0.5;
const HOLD_DAMPING: f64 = 20.0;

/// The hold lets the void ratio rise again by about this, so the dial stops so much below the goal.
const REBOUND: f64 = 0.003;

/// Passes of dial and hold until the void ratio after the hold is within 0.4 of its tolerance.
const PASSES: usize = 4;

/// A compacted packing, still as large as it came.
#[derive(Debug, Clone, PartialEq)]
pub struct Packing {
    /// One per grain.
    pub poses: Vec<Pose>,
    /// Diameter [m] of the circle with the wall polygon's area.
    pub diameter: f64,
    /// Height [m]; the bottom is z = 0.
    pub height: f64,
    /// Friction at which the dial stopped.
    pub friction: f64,
    /// Which end of the dial was reached, if any.
    pub end: DialEnd,
    /// Void ratio of the loosest packing, under the compaction pressure.
    pub loosest: f64,
    /// Time steps taken.
    pub steps: usize,
}

/// Whether the friction dial met the asked void ratio or came to an end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum DialEnd {
    /// The asked void ratio was met on the way, or at the loosest end within its tolerance.
    Met,
    /// The packing was already denser than asked with the largest friction.
    Loosest,
    /// The packing stayed looser than asked without friction.
    Densest,
}

/// Compacts to the void ratio `void_ratio`, or to the end of the dial that is nearest to it.
///
/// With `explore`, a packing that is too dense at the loosest end by more than
/// [`VOID_RATIO_TOLERANCE`] is driven on to the densest, so that its void ratio tells the whole range.
///
/// # Errors
/// `Error::Specimen` where the engine refuses a shape, loses a grain, or never jams.
pub fn compact(
    grains: &[GrainShape],
    placement: &Placement,
    void_ratio: f64,
    explore: bool,
    progress: &mut dyn FnMut(f64),
) -> Result<Packing> {
    let mut chamber = Chamber::build(grains, placement)?;
    let loosest = approach(&mut chamber, void_ratio, progress)?;
    let tolerated = if explore { VOID_RATIO_TOLERANCE } else { 0.0 };
    let too_dense = loosest + tolerated < void_ratio;
    let mut friction = LARGEST_FRICTION;
    let mut end = if too_dense { DialEnd::Loosest } else { DialEnd::Met };
    if too_dense && explore {
        turn_dial(&mut chamber, &mut friction, 0.0, progress);
    }
    // What the hold gives back is taken off the next pass's goal.
    let mut goal = void_ratio - REBOUND;
    for pass in 1..=PASSES {
        if end == DialEnd::Met && turn_dial(&mut chamber, &mut friction, goal, progress) {
            end = DialEnd::Densest;
        }
        hold(&mut chamber, progress);
        let excess = chamber.void_ratio() - void_ratio;
        if end != DialEnd::Met || excess < 0.4 * VOID_RATIO_TOLERANCE || pass == PASSES {
            break;
        }
        goal -= excess;
        chamber.damp(DAMPING);
        chamber.set_friction(friction);
    }
    Ok(Packing {
        poses: chamber.poses()?,
        diameter: 2.0 * chamber.radius * equal_area_factor() * chamber.unit,
        height: chamber.height * chamber.unit,
        friction,
        end,
        loosest,
        steps: chamber.steps,
    })
}

/// Lets friction fall until the void ratio is `goal`; true where the dial ends before that, with the
/// packing at rest without friction.
fn turn_dial(chamber: &mut Chamber, friction: &mut f64, goal: f64, progress: &mut dyn FnMut(f64)) -> bool {
    let mut smooth = 0.0;
    while chamber.void_ratio() > goal {
        *friction *= (-TIME_STEP / FRICTION_TIME).exp();
        if *friction < LEAST_FRICTION {
            *friction = 0.0;
        }
        chamber.set_friction(*friction);
        chamber.advance(PRESSURE, RATE);
        progress(0.6 + 0.3 * (1.0 - *friction / LARGEST_FRICTION));
        if *friction == 0.0 {
            smooth += TIME_STEP;
            if chamber.at_rest(DENSEST_BAND) || smooth > DENSEST_TIME {
                return true;
            }
        }
    }
    false
}

/// Lowers the pressure; full friction keeps the packing as dense as it is meanwhile.
fn hold(chamber: &mut Chamber, progress: &mut dyn FnMut(f64)) {
    chamber.damp(HOLD_DAMPING);
    chamber.set_friction(LARGEST_FRICTION);
    let start = chamber.time;
    while chamber.time < start + HOLD_TIME {
        chamber.advance(HOLD_PRESSURE, HOLD_RATE);
        progress(0.9 + 0.1 * (chamber.time - start) / HOLD_TIME);
    }
}

/// Drives the walls in until they carry the pressure with the largest friction, at rest but for slow
/// creep; returns the void ratio there.
fn approach(chamber: &mut Chamber, void_ratio: f64, progress: &mut dyn FnMut(f64)) -> Result<f64> {
    let start = chamber.solid_fraction();
    let asked = 1.0 / (1.0 + void_ratio);
    let mut jammed_at = None;
    while chamber.time < LONGEST {
        let rate = if chamber.solid_fraction() < APPROACH_FRACTION { APPROACH_RATE } else { RATE };
        chamber.advance(PRESSURE, rate);
        progress(0.6 * ((chamber.solid_fraction() - start) / (asked - start)).clamp(0.0, 1.0));
        if jammed_at.is_none() && chamber.pressure > 0.9 * PRESSURE {
            jammed_at = Some(chamber.time);
        }
        if chamber.at_rest(REST_BAND) || jammed_at.is_some_and(|time| chamber.time > time + CREEP_TIME) {
            return Ok(chamber.void_ratio());
        }
    }
    Err(Error::Specimen(format!(
        "compaction met no resistance in {LONGEST} s: solid fraction {:.3}, pressure {:.2} of {PRESSURE}",
        chamber.solid_fraction(),
        chamber.pressure
    )))
}

/// Radius of the circle with the polygon's area over the polygon's inner radius.
pub fn equal_area_factor() -> f64 {
    let count = WALL_PANELS as f64;
    (count * (PI / count).tan() / PI).sqrt()
}

/// The engine's world with grains, panels and plates; lengths in units.
struct Chamber {
    world: PhysicsWorld,
    grains: Vec<(RigidBodyHandle, ColliderHandle)>,
    panels: Vec<(RigidBodyHandle, ColliderHandle)>,
    plates: Vec<(RigidBodyHandle, ColliderHandle)>,
    unit: f64,
    solid: f64,
    /// Inner radius of the wall polygon, and height.
    radius: f64,
    height: f64,
    /// Mean pressure on walls and plates, smoothed over about ten steps.
    pressure: f64,
    time: f64,
    steps: usize,
    friction_set: f64,
    /// Void ratios of the last steps, newest last.
    recent: VecDeque<f64>,
}

impl Chamber {
    fn build(grains: &[GrainShape], placement: &Placement) -> Result<Self> {
        let unit = 0.7 * tensor::median(grains.iter().map(|g| g.sieve_size)).unwrap_or(1.0);

        let mut world = engine::world(TIME_STEP);
        let mut bodies = Vec::with_capacity(grains.len());
        for (index, (grain, pose)) in grains.iter().zip(&placement.poses).enumerate() {
            let shape = engine::shape_of(&grain.rounded, unit).ok_or_else(|| {
                Error::Specimen(format!("grain {index} has a core that the compaction engine refuses"))
            })?;
            let collider =
                ColliderBuilder::new(shape).density(1.0).friction(LARGEST_FRICTION).restitution(0.0);
            let body = RigidBodyBuilder::dynamic()
                .pose(engine::pose_in(pose, unit))
                .can_sleep(false)
                .linear_damping(DAMPING)
                .angular_damping(DAMPING);
            bodies.push(world.insert(body, collider));
        }
        let (radius, height) = (placement.radius / unit, placement.height / unit);
        let smooth = |builder: ColliderBuilder| {
            builder.friction(0.0).friction_combine_rule(CoefficientCombineRule::Min)
        };
        let panels = (0..WALL_PANELS)
            .map(|k| {
                let half_width = (radius + PANEL) * (PI / WALL_PANELS as f64).tan() * 1.1;
                let shape = ColliderBuilder::cuboid(PANEL, half_width, 0.5 * height + 4.0 * PANEL);
                let body = RigidBodyBuilder::kinematic_position_based().pose(panel_pose(k, radius, height));
                world.insert(body, smooth(shape))
            })
            .collect();
        let plates = [false, true]
            .map(|top| {
                let shape = ColliderBuilder::cuboid(1.6 * radius, 1.6 * radius, PANEL);
                let body = RigidBodyBuilder::kinematic_position_based().pose(plate_pose(top, height));
                world.insert(body, smooth(shape))
            })
            .to_vec();
        let solid = grains.iter().map(|g| g.nominal.volume()).sum::<f64>() / unit.powi(3);
        Ok(Chamber {
            world,
            grains: bodies,
            panels,
            plates,
            unit,
            solid,
            radius,
            height,
            pressure: 0.0,
            time: 0.0,
            steps: 0,
            friction_set: LARGEST_FRICTION,
            recent: VecDeque::new(),
        })
    }

    fn solid_fraction(&self) -> f64 {
        self.solid / (PI * (self.radius * equal_area_factor()).powi(2) * self.height)
    }

    fn void_ratio(&self) -> f64 {
        1.0 / self.solid_fraction() - 1.0
    }

    /// One time step of walls that seek `pressure` at no more than `rate`.
    fn advance(&mut self, pressure: f64, rate: f64) {
        let force: f64 = self
            .panels
            .iter()
            .chain(&self.plates)
            .flat_map(|(_, collider)| self.world.contact_pairs_with(*collider))
            .map(|pair| pair.total_impulse_magnitude() / TIME_STEP)
            .sum();
        let area = TAU * self.radius * (self.radius + self.height);
        self.pressure = 0.9 * self.pressure + 0.1 * force / area;
        let strain_rate = (1.0 - self.pressure / pressure).clamp(-0.5, 1.0) * rate;
        self.radius *= 1.0 - strain_rate * TIME_STEP;
        self.height *= 1.0 - strain_rate * TIME_STEP;
        for (k, (body, _)) in self.panels.iter().enumerate() {
            self.world.bodies[*body].set_next_kinematic_position(panel_pose(k, self.radius, self.height));
        }
        for (k, (body, _)) in self.plates.iter().enumerate() {
            self.world.bodies[*body].set_next_kinematic_position(plate_pose(k == 1, self.height));
        }
        self.world.step();
        self.time += TIME_STEP;
        self.steps += 1;
        if self.recent.len() >= (REST_TIME / TIME_STEP) as usize {
            self.recent.pop_front();
        }
        self.recent.push_back(self.void_ratio());
    }

    /// Whether the walls carry the compaction pressure and the void ratio has stayed within `band`.
    fn at_rest(&self, band: f64) -> bool {
        let (low, high) =
            self.recent.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), e| (l.min(*e), h.max(*e)));
        self.recent.len() >= (REST_TIME / TIME_STEP) as usize
            && high - low < band
            && (self.pressure / PRESSURE - 1.0).abs() < 0.2
    }

    /// Sets the grains' friction, in steps of 5 % so that the engine is not told at every time step.
    fn set_friction(&mut self, friction: f64) {
        let changed = (friction - self.friction_set).abs() > 0.05 * self.friction_set;
        if changed || (friction == 0.0 && self.friction_set > 0.0) {
            for (_, collider) in &self.grains {
                self.world.colliders[*collider].set_friction(friction);
            }
            self.friction_set = friction;
        }
    }

    fn damp(&mut self, damping: f64) {
        for (body, _) in &self.grains {
            let body = &mut self.world.bodies[*body];
            body.set_linear_damping(damping);
            body.set_angular_damping(damping);
        }
    }

    fn poses(&self) -> Result<Vec<Pose>> {
        let mut poses = Vec::with_capacity(self.grains.len());
        for (index, (body, _)) in self.grains.iter().enumerate() {
            let (radius, height) = (self.radius * self.unit, self.height * self.unit);
            let inside = |pose: &Pose| {
                let at = pose.position;
                at.xy().norm() < radius * 1.01 && at.z > 0.0 && at.z < height
            };
            let pose = engine::pose_from(self.world.bodies[*body].position(), self.unit).filter(inside);
            let lost = || Error::Specimen(format!("compaction lost grain {index} through a wall"));
            poses.push(pose.ok_or_else(lost)?);
        }
        Ok(poses)
    }
}

fn panel_pose(index: usize, radius: f64, height: f64) -> EnginePose {
    let angle = TAU * index as f64 / WALL_PANELS as f64;
    let distance = radius + PANEL;
    EnginePose::from_parts(
        Vector::new(distance * angle.cos(), distance * angle.sin(), 0.5 * height),
        EngineRotation::from_rotation_z(angle),
    )
}

fn plate_pose(top: bool, height: f64) -> EnginePose {
    let z = if top { height + PANEL } else { -PANEL };
    EnginePose::from_parts(Vector::new(0.0, 0.0, z), EngineRotation::IDENTITY)
}
