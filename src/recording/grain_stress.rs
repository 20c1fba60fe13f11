//! Mean stress of each grain from the forces on its surface.
//!
//! Source: Love (1927); for a body in balance the volume mean of the Cauchy stress is
//! `1/V sum (x - X) f^T` over its surface forces, whatever its material. Tension positive.

use crate::assembly::Contacts;
use crate::model::{Body, Model};
use crate::scene::{Scene, SceneParameters};
use crate::tensor::{Mat3, Pose, Vec3};
use crate::triaxial::chains::body_moments;
use crate::triaxial::network::{outside_forces, pair_forces};

/// Mean Cauchy stress of all bodies [Pa], in the configuration that `contacts` was
/// last evaluated in, under `pressure` [Pa] on the cover.
pub fn mean_stresses(model: &Model, contacts: &Contacts, poses: &[Pose], pressure: f64) -> Vec<Mat3> {
    let outside = outside_forces(model, contacts, poses, pressure);
    let moments = body_moments(&pair_forces(contacts), &outside, &positions(model, poses));
    let mean = |(moment, body): (&Mat3, &Body)| {
        // Symmetric in balance; what is left of the moments' tolerance is averaged out.
        0.5 * (moment + moment.transpose()) / left_of(body).unwrap_or_else(|| body.nominal.volume())
    };
    moments.iter().zip(&model.bodies).map(mean).collect()
}

/// Volume of what is left of a grain that lost cells [m^3], which is less than its contact shape.
fn left_of(body: &Body) -> Option<f64> {
    body.damaged().filter(|grain| grain.is_parted()).map(|grain| grain.room())
}

/// Mean Cauchy stress of each body of a scene [Pa], its weight included: gravity acts in its volume. Not a
/// number for a body that is held, driven or pushed, since where on its surface that acts is not said.
pub fn body_stresses(scene: &Scene, parameters: &SceneParameters, gravity: Vec3) -> Vec<Mat3> {
    let poses = &scene.committed.poses;
    let places = positions(&scene.model, poses);
    let mut moments = body_moments(&pair_forces(&scene.contacts), &[], &places);
    for (i, (moment, body)) in moments.iter_mut().zip(&scene.model.bodies).enumerate() {
        let weight = gravity * body.mass;
        *moment += (poses[i].rotation * body.centre_of_mass) * weight.transpose();
        let origin = body.damaged().map_or(i, |grain| grain.ancestry().origin as usize);
        let volume = left_of(body).unwrap_or(body.mass / parameters.bodies[origin].density);
        *moment = match scene.is_free(i) {
            true => 0.5 * (*moment + moment.transpose()) / volume,
            false => Mat3::repeat(f64::NAN),
        };
    }
    moments
}

fn positions(model: &Model, poses: &[Pose]) -> Vec<Vec3> {
    poses[..model.bodies.len()].iter().map(|pose| pose.position).collect()
}
