//! How well forces balance, and what a force out of balance is judged by.
//!
//! Grains of a specimen are alike and share one load: what is left on any of them is judged by the mean contact force of all. Bodies set by hand
//! may be of any size in one scene, a pebble on a loose slab: each is judged by what it carries itself, its own dead load or the largest
//! contact force on it, where that is less than the mean. Bodies that are held are judged by nothing, and give no measure.

use crate::assembly::{Contacts, Dofs};
use crate::model::{BodyKind, Loads, Model};
use crate::tensor::{Pose, Vec3, Vector6};

/// How well the forces balance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Balance {
    /// Largest force out of balance on a body over the force that it is judged by.
    pub out_of_balance: f64,
    /// The body with it.
    pub worst_body: usize,
    /// Mean contact force [N], or what stands in for it where nothing touches.
    pub reference_force: f64,
    /// Mean over the free bodies of the force out of balance, over the reference force.
    pub unrest: f64,
    /// The least force that any body is judged by [N]; at most the reference force.
    pub least_force: f64,
}

/// Where nothing touches, this share of the largest dead load stands in for the mean contact force.
const SHARE_OF_LOAD: f64 = 1e-3;

/// Roundings of a position that add up in the force of one contact, over the stiffness of its body: either body's corner is turned and
/// shifted, and the spring of a body that deforms is four times as stiff.
const ROUNDINGS: f64 = 16.0;

/// Of a load whose force is held the free components have less than this share, by rounding: the moment of a weight about a centroid is such.
const HELD: f64 = 1e-12;

/// What forces out of balance are judged by.
#[derive(Debug)]
pub(super) struct Yardsticks {
    /// [N]
    pub(super) mean: f64,
    /// Of each body, where that is less [N].
    own: Vec<f64>,
    /// Of each body that carries no dead load: what rounding of positions leaves of the forces on it [N]. Zero for others: a load that is below
    /// this cannot be balanced, and is not said to be.
    rounding: Vec<f64>,
}

impl Yardsticks {
    pub(super) fn new(
        model: &Model,
        dofs: &Dofs,
        contacts: &Contacts,
        loads: &Loads,
        poses: &[Pose],
    ) -> Self {
        let bodies = model.bodies.len();
        let (mut strongest, mut touching) = (vec![0.0_f64; bodies], vec![0_usize; bodies]);
        for pair in &contacts.pairs {
            let most = pair.borne.iter().map(|borne| borne.pressure).fold(0.0, f64::max);
            for body in [pair.a(), pair.b()] {
                strongest[body] = strongest[body].max(most);
                touching[body] += pair.borne.len();
            }
        }
        let dead: Vec<f64> =
            (0..bodies).map(|body| dead_load(model, dofs, loads, &poses[body], body)).collect();
        let reach = |body: usize| poses[body].position.norm() + model.shapes[body].bounding_radius;
        let farthest = (0..bodies).map(reach).fold(0.0, f64::max);
        let typical = model.typical_stiffness();
        let resolved = |body: usize| {
            let own = model.bodies[body].stiffness;
            let stiffness = if own.is_finite() { own } else { typical };
            ROUNDINGS * f64::EPSILON * farthest * stiffness * touching[body].max(1) as f64
        };
        let rounding: Vec<f64> =
            (0..bodies).map(|body| if dead[body] > 0.0 { 0.0 } else { resolved(body) }).collect();
        let largest = dead.iter().copied().fold(0.0, f64::max);
        let least = (0..bodies).map(resolved).fold(f64::MIN_POSITIVE, f64::max);
        // Without a load contact forces may be what rounding leaves, and are judged by no less.
        let floor = if largest > 0.0 { 0.0 } else { least };
        let mean = contacts.mean_force().max(SHARE_OF_LOAD * largest).max(floor);
        let own = |body: usize| {
            let carried = strongest[body].max(dead[body]);
            let apart = model.bodies[body].kind == BodyKind::Placed && dofs.is_free(body);
            if apart && carried > 0.0 { carried.max(floor) } else { f64::INFINITY }
        };
        Yardsticks {
            mean: if mean > 0.0 { mean } else { least },
            own: (0..bodies).map(own).collect(),
            rounding,
        }
    }

    /// What a force on these carriers is judged by [N].
    fn of(&self, carriers: &[usize]) -> f64 {
        carriers.iter().filter_map(|body| self.own.get(*body)).fold(self.mean, |least, own| least.min(*own))
    }

    /// The least force that any body is judged by [N].
    pub(super) fn least(&self) -> f64 {
        self.own.iter().copied().fold(self.mean, f64::min)
    }

    /// The largest of these forces on any body over what it is judged by, and that body.
    pub(super) fn worst_of(&self, forces: &[f64], dofs: &Dofs, contacts: &Contacts) -> (f64, usize) {
        let first_contact = dofs.contact_block(0);
        let pairs: Vec<[usize; 2]> = contacts.unknown_forces.pairs().collect();
        let mut worst = (0.0, 0);
        for block in 0..dofs.bodies() {
            let owner = [dofs.owner(block)];
            // The force of a contact is on both of its bodies.
            let pair = block.checked_sub(first_contact).and_then(|k| pairs.get(k));
            let carriers = pair.map_or(&owner[..], |pair| &pair[..]);
            let force = self.unexplained(dofs.force_on(forces, block), carriers);
            let over = force / self.of(carriers);
            if over.is_nan() {
                return (over, owner[0]);
            }
            if over > worst.0 {
                worst = (over, owner[0]);
            }
        }
        worst
    }

    /// What is left of a force of this size on these carriers that rounding does not explain [N].
    fn unexplained(&self, force: f64, carriers: &[usize]) -> f64 {
        let rounding = carriers.iter().map(|body| self.rounding.get(*body).copied().unwrap_or(0.0));
        if force <= rounding.fold(f64::INFINITY, f64::min) { 0.0 } else { force }
    }
}

/// The larger of applied force and weight on what is free of a body [N], moments over its rotation scale. Not their sum, which may be nothing
/// but rounding where they balance each other. Of a load its moment counts about the body's reference point or about its centre of mass,
/// where it is less: that of a far reference point is its arm, which no contact carries.
fn dead_load(model: &Model, dofs: &Dofs, loads: &Loads, pose: &Pose, body: usize) -> f64 {
    let weight = model.bodies[body].weight(&loads.gravity, pose);
    let arm = pose.rotation * model.bodies[body].centre_of_mass;
    let about_centre = |wrench: &Vector6<f64>| {
        let force: Vec3 = wrench.fixed_rows::<3>(0).into_owned();
        let moment = wrench.fixed_rows::<3>(3).into_owned() - arm.cross(&force);
        Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
    };
    let free = |wrench: &Vector6<f64>| {
        let force = dofs.free_norm(body, wrench);
        if force > HELD * wrench.fixed_rows::<3>(0).norm() { force } else { 0.0 }
    };
    let carried = |wrench: &Vector6<f64>| {
        let [here, there] = [free(wrench), free(&about_centre(wrench))];
        // A hinge carries the force, and its body the moment about it.
        if there > 0.0 { here.min(there) } else { here }
    };
    carried(&weight).max(carried(&loads.applied[body]))
}
