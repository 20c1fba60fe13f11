//! Numbering of the free components of motion.

use crate::model::{Loads, Model};
use crate::tensor::{Pose, Vec3};

/// Which components of which body are unknowns, and at which number.
#[derive(Debug, Clone, PartialEq)]
pub struct Dofs {
    index: Vec<[Option<u32>; 6]>,
    /// Factor from a physical component to its unknown: 1 for translations, the body's rotation
    /// scale for rotations.
    scale: Vec<f64>,
    count: usize,
}

impl Dofs {
    pub fn new(model: &Model, loads: &Loads) -> Self {
        let mut count = 0;
        let index = loads
            .prescribed
            .iter()
            .map(|prescribed| {
                prescribed.map(|held| {
                    (!held).then(|| {
                        count += 1;
                        count as u32 - 1
                    })
                })
            })
            .collect();
        let mut scale: Vec<f64> = model.bodies.iter().map(|b| b.rotation_scale).collect();
        // Nodes of a membrane do not turn.
        scale.resize(loads.prescribed.len(), 1.0);
        Dofs { index, scale, count }
    }

    pub fn count(&self) -> usize {
        self.count
    }

    pub fn bodies(&self) -> usize {
        self.index.len()
    }

    pub fn of(&self, body: usize) -> &[Option<u32>; 6] {
        &self.index[body]
    }

    pub fn is_free(&self, body: usize) -> bool {
        self.index[body].iter().any(Option::is_some)
    }

    fn factor(&self, body: usize, component: usize) -> f64 {
        if component < 3 { 1.0 } else { self.scale[body] }
    }

    /// Adds a wrench [N, N m] on `body` to the forces on the unknowns [N].
    pub fn scatter(&self, forces: &mut [f64], body: usize, wrench: &[f64]) {
        for (k, index) in self.index[body].iter().enumerate() {
            if let Some(i) = index {
                forces[*i as usize] += wrench[k] / self.factor(body, k);
            }
        }
    }

    /// Scale of entry (row component of `row_body`, column component of `column_body`).
    pub fn entry_scale(&self, row_body: usize, row: usize, column_body: usize, column: usize) -> f64 {
        1.0 / (self.factor(row_body, row) * self.factor(column_body, column))
    }

    /// Translation [m] and rotation vector [rad] of `body` in the step `factor * step`.
    pub fn motion(&self, step: &[f64], factor: f64, body: usize) -> (Vec3, Vec3) {
        let mut motion = [0.0; 6];
        for (k, index) in self.index[body].iter().enumerate() {
            if let Some(i) = index {
                motion[k] = factor * step[*i as usize] / self.factor(body, k);
            }
        }
        (Vec3::new(motion[0], motion[1], motion[2]), Vec3::new(motion[3], motion[4], motion[5]))
    }

    /// Moves `from` by `factor * step` into `poses`.
    pub fn move_into(&self, poses: &mut [Pose], from: &[Pose], step: &[f64], factor: f64) {
        for (i, pose) in poses.iter_mut().enumerate() {
            if self.is_free(i) {
                let (translation, rotation) = self.motion(step, factor, i);
                *pose = from[i].moved(&translation, &rotation);
            } else {
                *pose = from[i];
            }
        }
    }

    /// The largest force on a body [N]: the norm over its free components, moments divided by the
    /// rotation scale. Returns the body with it.
    pub fn largest_force(&self, forces: &[f64]) -> (f64, usize) {
        let mut largest = (0.0, 0);
        for (body, index) in self.index.iter().enumerate() {
            let square: f64 = index.iter().flatten().map(|i| forces[*i as usize].powi(2)).sum();
            if !(square.sqrt() <= largest.0) {
                largest = (square.sqrt(), body);
            }
        }
        largest
    }
}
