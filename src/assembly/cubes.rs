//! A pile of cubes and what the tests of assembled tangents need besides.

use std::sync::Arc;

use crate::assembly::{BlockPattern, Contacts};
use crate::contact::law::Friction;
use crate::contact::{ContactLaw, ContactShape};
use crate::grain::CondensedGrain;
use crate::material::Elastic;
use crate::mesh::cuboid_mesh;
use crate::model::{Body, BodyKind, Committed, Deformation, Loads, Model};
use crate::tensor::{Pose, Rotation, Vec3};

const EDGE: f64 = 0.03;
const ROUNDING: f64 = 1e-3;

/// Three cubes in a pile, askew, overlapping by about 10 um, each `shift` [m] along x from the one below it: two that deform so, on a
/// rigid one.
pub fn pile(
    shift: f64,
    deformation: impl Fn(Arc<CondensedGrain>) -> Deformation,
) -> (Model, Committed, Loads) {
    let mesh = cuboid_mesh([EDGE; 3], EDGE).expect("a mesh");
    let rock = vec![Elastic::new(30e9, 0.2).expect("allowed"); mesh.cells.len()];
    let grain = Arc::new(CondensedGrain::new(mesh, &rock, 2700.0).expect("a grain"));
    let block = |index: usize| {
        let (mut body, shape) = Body::block("cube", BodyKind::Placed, [EDGE; 3], ROUNDING, 0.02);
        body.mass = 0.07;
        if index > 0 {
            body.deformation = deformation(grain.clone());
        }
        (body, shape)
    };
    let (bodies, shapes): (Vec<Body>, Vec<ContactShape>) = (0..3).map(block).unzip();
    let law = ContactLaw { onset: 4e-6, fade_length: 1e-3, ..ContactLaw::SAMPLE };
    let place = |index: usize| {
        let height = index as f64 * (EDGE - 20e-6);
        let turn = Vec3::new(2e-4, -3e-4, 0.35 * index as f64);
        Pose::new(Vec3::new(shift * index as f64, -2e-3, height), Rotation::from_scaled_axis(turn))
    };
    let model = Model::new(bodies, shapes, law, Friction::constant(0.4));
    (model, Committed::new((0..3).map(place).collect()), Loads::none(3))
}

/// The contacts of these poses.
pub fn contacts_at(model: &Model, committed: &Committed, poses: &[Pose]) -> Contacts {
    let mut contacts = Contacts::default();
    contacts.start(model, committed);
    contacts.evaluate(model, committed, poses).expect("far enough apart");
    contacts
}

/// A vector without pattern, the same on every machine.
pub fn unpatterned(count: usize, seed: usize) -> Vec<f64> {
    (0..count).map(|k| ((k * 7919 + seed * 104_729 + 13) % 1009) as f64 / 1009.0 - 0.5).collect()
}

/// The matrix of these `values` times `direction`.
pub fn product(pattern: &BlockPattern, values: &[f64], direction: &[f64]) -> Vec<f64> {
    let mut product = vec![0.0; direction.len()];
    for (column, d) in direction.iter().enumerate() {
        for k in pattern.pattern.column_starts[column]..pattern.pattern.column_starts[column + 1] {
            product[pattern.pattern.rows[k]] += values[k] * d;
        }
    }
    product
}
