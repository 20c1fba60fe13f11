//! What failed rock still exerts on the bodies that it held, while that dies down.
//!
//! Rock that fails is taken out of its grain. Were its contact forces gone at once, bodies would fall that a slower loss leaves in
//! balance on the way. So each force that went with it first acts on as if it were applied, between the same two bodies or what is left of them,
//! and is then taken away in steps with a balance in each, as finite element programs do it where elements are removed. Where bodies fall all the same
//! the force goes with the way on which they squeeze the rock, over the size of a failed cell. What they have to overcome meanwhile is the work of
//! crushing. Failed rock only resists: a force whose bodies part is over.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::assembly::{ContactPoint, Contacts, PairWork};
use crate::model::fracture::Fracture;
use crate::model::{BodyKind, Loads, Model};
use crate::solver::work_between;
use crate::tensor::{Pose, Vec3, Vector6};

/// How far bodies may part before a force between them is over, over the smallest rounding.
const PARTED: f64 = 1e-2;

/// The contact forces of a configuration.
#[derive(Debug, Clone)]
pub(super) struct Touching(Vec<Touch>);

#[derive(Debug, Clone)]
struct Touch {
    bodies: [usize; 2],
    /// [m]
    point: Vec3,
    /// On each body, moments about `origins` [N, N m].
    wrenches: [Vector6<f64>; 2],
    origins: [Vec3; 2],
}

impl Touching {
    /// Those of the configuration `poses`, in which `contacts` was last evaluated.
    pub(super) fn of(contacts: &Contacts, poses: &[Pose]) -> Self {
        let touch = |(pair, point): (&PairWork, &ContactPoint)| {
            let e = &point.evaluation;
            let bodies = [pair.a(), pair.b()];
            let on = |from: usize| Vector6::from_fn(|k, _| e.wrench[from + k]);
            let origins = bodies.map(|body| poses[body].position);
            Touch { bodies, point: e.point, wrenches: [on(0), on(6)], origins }
        };
        Touching(contacts.active().map(touch).collect())
    }
}

/// A force of failed rock between two bodies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Remnant {
    bodies: [usize; 2],
    /// On each of them [N, N m], in full; none on a body that is gone.
    #[serde(with = "crate::tensor::stored")]
    wrenches: [Vector6<f64>; 2],
    /// How far the bodies close in on each other until nothing between them resists [m].
    height: f64,
}

impl Remnant {
    /// Its larger side [N].
    fn force(&self) -> f64 {
        self.wrenches.iter().map(|wrench| wrench.fixed_rows::<3>(0).norm()).fold(0.0, f64::max)
    }

    /// Its work where bodies go from `old` to `new` poses [J]; negative where they close in on each other.
    fn work(&self, old: &[Pose], new: &[Pose]) -> f64 {
        let of = |(body, wrench): (&usize, &Vector6<f64>)| work_between(&old[*body], &new[*body], wrench);
        self.bodies.iter().zip(&self.wrenches).map(of).sum()
    }
}

/// The forces of failed rock between bodies.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Remnants {
    forces: Vec<Remnant>,
    /// Share of them that acts in the committed state.
    acting: f64,
    /// Steps in all, and those left.
    steps: usize,
    left: usize,
}

impl Remnants {
    /// The forces that were there `before` bodies broke and are not `after` it, to be taken away in `steps`.
    pub(super) fn new(
        model: &Model,
        poses: &[Pose],
        fractures: &[Fracture],
        [before, after]: [&Touching; 2],
        steps: usize,
    ) -> Self {
        let mut broken: BTreeMap<usize, &Fracture> = BTreeMap::new();
        for fracture in fractures {
            broken
                .extend(std::iter::once(&fracture.body).chain(&fracture.parts).map(|body| (*body, fracture)));
        }
        let mut sums: BTreeMap<[usize; 2], [Vector6<f64>; 2]> = BTreeMap::new();
        let mut add = |touch: &Touch, bodies: [usize; 2], sign: f64| {
            let order = if bodies[0] <= bodies[1] { [0, 1] } else { [1, 0] };
            for (sum, k) in sums.entry(order.map(|k| bodies[k])).or_default().iter_mut().zip(order) {
                if model.bodies[bodies[k]].kind != BodyKind::Gone {
                    *sum += about(&touch.wrenches[k], &(touch.origins[k] - poses[bodies[k]].position)) * sign;
                }
            }
        };
        let concerns = |touch: &&Touch| touch.bodies.iter().any(|body| broken.contains_key(body));
        for touch in before.0.iter().filter(concerns) {
            let part = |body: usize| nearest(model, poses, &broken.get(&body)?.parts, &touch.point);
            add(touch, touch.bodies.map(|body| part(body).unwrap_or(body)), 1.0);
        }
        for touch in after.0.iter().filter(concerns) {
            add(touch, touch.bodies, -1.0);
        }
        let height = |bodies: &[usize; 2]| {
            let of_cells = bodies
                .iter()
                .filter_map(|body| broken.get(body))
                .map(|fracture| (fracture.crushed_volume / fracture.deleted_cells.max(1) as f64).cbrt());
            of_cells.fold(model.smallest_rounding(), f64::max)
        };
        let remnant = |(bodies, wrenches)| Remnant { bodies, wrenches, height: height(&bodies) };
        let forces = sums.into_iter().map(remnant).collect();
        Remnants { forces, acting: 1.0, steps, left: steps.saturating_sub(1) }
    }

    /// Whether nothing of it acts in the next state.
    pub(super) fn is_over(&self) -> bool {
        self.forces.is_empty() || self.left == 0
    }

    /// Share of them that acts in the next state.
    fn share(&self) -> f64 {
        self.left as f64 / self.steps.max(1) as f64
    }

    /// Adds what acts in the next state to the loads.
    pub(super) fn add_to(&self, loads: &mut Loads) {
        for remnant in &self.forces {
            for (body, wrench) in remnant.bodies.iter().zip(&remnant.wrenches) {
                loads.applied[*body] += wrench * self.share();
            }
        }
    }

    /// What acts on a body in the next state [N, N m].
    pub(super) fn on(&self, body: usize) -> Vector6<f64> {
        let all = self.forces.iter().flat_map(|remnant| remnant.bodies.iter().zip(&remnant.wrenches));
        all.filter(|(on, _)| **on == body).map(|(_, wrench)| wrench * self.share()).sum()
    }

    /// Work against it on the way from the committed poses `old` to `new` [J].
    pub(super) fn overcome(&self, old: &[Pose], new: &[Pose]) -> f64 {
        let mean = 0.5 * (self.acting + self.share());
        -mean * self.forces.iter().map(|remnant| remnant.work(old, new)).sum::<f64>()
    }

    /// Ends the forces whose bodies part on the way from `old` to `new`; whether there were any in what goes on.
    pub(super) fn let_go(&mut self, model: &Model, old: &[Pose], new: &[Pose]) -> bool {
        let (slack, before) = (PARTED * model.smallest_rounding(), self.forces.len());
        self.forces.retain(|remnant| remnant.work(old, new) <= slack * remnant.force());
        self.left > 0 && self.forces.len() < before
    }

    /// Takes from each force what bodies that fell from `old` to `new` have squeezed of its rock.
    pub(super) fn squeeze(&mut self, old: &[Pose], new: &[Pose]) {
        for remnant in self.forces.iter_mut().filter(|remnant| remnant.force() > 0.0) {
            let closed = (-remnant.work(old, new) / remnant.force()).max(0.0);
            let left = (1.0 - closed / remnant.height).max(0.0);
            remnant.wrenches.iter_mut().for_each(|wrench| *wrench *= left);
        }
        self.acting = self.share();
    }

    /// Goes on to the next step, now that one has been committed.
    pub(super) fn release(&mut self) {
        self.acting = self.share();
        self.left = self.left.saturating_sub(1);
    }
}

/// A wrench about another origin, `arm` [m] from there to its own.
fn about(wrench: &Vector6<f64>, arm: &Vec3) -> Vector6<f64> {
    let force = Vec3::from(wrench.fixed_rows::<3>(0));
    let moment = Vec3::from(wrench.fixed_rows::<3>(3)) + arm.cross(&force);
    Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
}

/// The part whose core is nearest to a point, by the planes of its facets; `None` without parts.
fn nearest(model: &Model, poses: &[Pose], parts: &[usize], point: &Vec3) -> Option<usize> {
    let outside = |part: usize| {
        let core = &model.shapes[part].rounded.core;
        let at = poses[part].to_body(point);
        let beyond = |(facet, normal): (&[usize; 3], &Vec3)| normal.dot(&(at - core.vertices[facet[0]]));
        core.facets.iter().zip(&core.normals).map(beyond).fold(f64::NEG_INFINITY, f64::max)
    };
    parts.iter().copied().min_by(|a, b| outside(*a).total_cmp(&outside(*b)))
}

#[cfg(test)]
mod tests;
