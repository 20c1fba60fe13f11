//! Mean stress of each grain from the forces on its surface.
//!
//! Source: Love (1927); for a body in balance the volume mean of the Cauchy stress is
//! `1/V sum (x - X) f^T` over its surface forces, whatever its material. Tension positive.

use crate::assembly::Contacts;
use crate::model::Model;
use crate::scene::{Scene, SceneParameters};
use crate::tensor::{Mat3, Pose, Vec3};

/// Mean Cauchy stress of all bodies [Pa], in the configuration that `contacts` was
/// last evaluated in, under `pressure` [Pa] on the cover.
pub fn mean_stresses(model: &Model, contacts: &Contacts, poses: &[Pose], pressure: f64) -> Vec<Mat3> {
    let mut moments = contact_moments(model, contacts, poses);
    if model.membrane.is_some() {
        for (body, point) in contacts.membrane.points() {
            let arm = point.on_surface() - poses[body].position;
            moments[body] += arm * point.on_body().transpose();
        }
    }
    for contact in &contacts.wall {
        let arm = contact.point - poses[contact.body].position;
        moments[contact.body] += arm * contact.on_body().transpose();
    }
    if let (Some(cover), None) = (&model.cover, &model.membrane) {
        let mut forces = vec![Vec3::zeros(); cover.nodes().len()];
        cover.node_forces_into(&mut forces, poses, pressure);
        for (node, force) in forces.iter().enumerate() {
            let body = cover.nodes()[node].body;
            moments[body] += (cover.position(poses, node) - poses[body].position) * force.transpose();
        }
    }
    let mean = |(moment, body): (&Mat3, &crate::model::Body)| {
        // Symmetric in balance; what is left of the moments' tolerance is averaged out.
        0.5 * (moment + moment.transpose()) / body.nominal.volume()
    };
    moments.iter().zip(&model.bodies).map(mean).collect()
}

/// Mean Cauchy stress of each body of a scene [Pa], its weight included: gravity acts in its volume. Not a
/// number for a body that is held, driven or pushed, since where on its surface that acts is not said.
pub fn body_stresses(scene: &Scene, parameters: &SceneParameters, gravity: Vec3) -> Vec<Mat3> {
    let poses = &scene.committed.poses;
    let mut moments = contact_moments(&scene.model, scene.contacts(), poses);
    for (i, (moment, body)) in moments.iter_mut().zip(&scene.model.bodies).enumerate() {
        let weight = gravity * body.mass;
        *moment += (poses[i].rotation * body.centre_of_mass) * weight.transpose();
        let origin = body.damaged.as_ref().map_or(i, |grain| grain.ancestry().origin as usize);
        let volume = body.mass / parameters.bodies[origin].density;
        *moment = match scene.is_free(i) {
            true => 0.5 * (*moment + moment.transpose()) / volume,
            false => Mat3::repeat(f64::NAN),
        };
    }
    moments
}

/// Sums of arm times force of the contacts on each body [N m].
fn contact_moments(model: &Model, contacts: &Contacts, poses: &[Pose]) -> Vec<Mat3> {
    let mut moments = vec![Mat3::zeros(); model.bodies.len()];
    for (pair, point) in contacts.active() {
        let e = &point.evaluation;
        let on_b = Vec3::new(e.wrench[6], e.wrench[7], e.wrench[8]);
        for (body, force) in [(pair.a(), -on_b), (pair.b(), on_b)] {
            moments[body] += (e.point - poses[body].position) * force.transpose();
        }
    }
    moments
}

/// A symmetric tensor as xx yy zz xy yz xz.
pub fn components(stress: &Mat3) -> [f64; 6] {
    [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(|(i, j)| stress[(i, j)])
}
