//! Numbering of the free components of motion.

use crate::model::{Loads, Model};
use crate::tensor::{Pose, Vec3, Vector6};

/// Which components of which body are unknowns, and at which number. Behind the carriers stand the contacts whose forces are unknowns (three each);
/// here these count as bodies too.
#[derive(Debug, Clone, PartialEq)]
pub struct Dofs {
    index: Vec<[Option<u32>; 6]>,
    carriers: usize,
    /// The body that each block behind the carriers is of.
    owner: Vec<u32>,
    /// Factor from a physical component to its unknown: 1 for translations, the body's rotation
    /// scale for rotations.
    scale: Vec<f64>,
    count: usize,
}

impl Dofs {
    pub fn new(model: &Model, loads: &Loads) -> Self {
        let mut count = 0;
        let mut number = |held: &[bool; 6]| {
            held.map(|held| {
                (!held).then(|| {
                    count += 1;
                    count as u32 - 1
                })
            })
        };
        let index: Vec<[Option<u32>; 6]> = loads.prescribed.iter().map(&mut number).collect();
        let mut scale: Vec<f64> = model.bodies.iter().map(|b| b.rotation_scale).collect();
        // Nodes of a membrane do not turn.
        scale.resize(index.len(), 1.0);
        Dofs { carriers: index.len(), index, owner: Vec::new(), scale, count }
    }

    /// Replaces the blocks of contacts by as many as there are `owners`, each of that body.
    pub fn renew_contacts(&mut self, owners: impl Iterator<Item = u32>) {
        let lost = self.index.drain(self.carriers..).map(|block| block.iter().flatten().count());
        self.count -= lost.sum::<usize>();
        self.owner.clear();
        for owner in owners {
            let next = self.count as u32;
            self.index.push([Some(next), Some(next + 1), Some(next + 2), None, None, None]);
            self.owner.push(owner);
            self.count += 3;
        }
        self.scale.resize(self.index.len(), 1.0);
    }

    /// The same of these carriers alone, in the same order; the others are held. There are no forces of contacts among them.
    pub fn only(&self, counts: impl Fn(usize) -> bool) -> Self {
        let mut count = 0;
        let mut number = |carrier: usize| {
            self.index[carrier].map(|index| {
                index.filter(|_| counts(carrier)).map(|_| {
                    count += 1;
                    count as u32 - 1
                })
            })
        };
        let index = (0..self.carriers).map(&mut number).collect();
        let scale = self.scale[..self.carriers].to_vec();
        Dofs { carriers: self.carriers, index, owner: Vec::new(), scale, count }
    }

    /// Copies the values of all unknowns that `to` has as well.
    pub fn copy_common(&self, values: &[f64], to: &Dofs, into: &mut [f64]) {
        for (own, others) in self.index.iter().zip(&to.index) {
            for (own, other) in own.iter().zip(others) {
                if let (Some(own), Some(other)) = (own, other) {
                    into[*other as usize] = values[*own as usize];
                }
            }
        }
    }

    /// The same without the forces of contacts, whose unknowns come last.
    pub fn without_contacts(&self) -> Self {
        let mut bodies = self.clone();
        bodies.renew_contacts(std::iter::empty());
        bodies
    }

    /// The block of the k-th contact whose force is an unknown.
    pub fn contact_block(&self, k: usize) -> usize {
        self.carriers + k
    }

    pub fn count(&self) -> usize {
        self.count
    }

    pub fn bodies(&self) -> usize {
        self.index.len()
    }

    /// How many of them have a pose.
    pub fn carriers(&self) -> usize {
        self.carriers
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

    /// Force and moment on every carrier [N, N m] that `forces` [N] on the unknowns stand for; zero where it is held.
    pub fn wrenches(&self, forces: &[f64]) -> Vec<Vector6<f64>> {
        let of = |carrier: usize| {
            let component = |k: usize| {
                let force = self.index[carrier][k].and_then(|i| forces.get(i as usize));
                force.map_or(0.0, |force| force * self.factor(carrier, k))
            };
            Vector6::from_fn(|k, _| component(k))
        };
        (0..self.carriers).map(of).collect()
    }

    /// Scale of entry (row component of `row_body`, column component of `column_body`).
    pub fn entry_scale(&self, row_body: usize, row: usize, column_body: usize, column: usize) -> f64 {
        if row < 3 && column < 3 {
            return 1.0;
        }
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

    /// The force on a body [N]: the norm over its free components, moments divided by the rotation scale.
    pub fn force_on(&self, forces: &[f64], body: usize) -> f64 {
        let components = self.index[body].iter().flatten();
        components.map(|i| forces[*i as usize].powi(2)).sum::<f64>().sqrt()
    }

    /// The size of a wrench [N, N m] on what is free of a body [N], moments divided by the rotation scale.
    pub fn free_norm(&self, body: usize, wrench: &Vector6<f64>) -> f64 {
        let free = self.index[body].iter().enumerate().filter(|(_, component)| component.is_some());
        free.map(|(k, _)| (wrench[k] / self.factor(body, k)).powi(2)).sum::<f64>().sqrt()
    }

    /// The carrier that a block is of: itself, or the body whose contact it is.
    pub fn owner(&self, block: usize) -> usize {
        let inner = block.checked_sub(self.carriers).and_then(|inner| self.owner.get(inner));
        inner.map_or(block, |owner| *owner as usize)
    }

    /// The largest force on a body [N], as [`Self::force_on`], or the first that is no number. Returns the body with it.
    pub fn largest_force(&self, forces: &[f64]) -> (f64, usize) {
        let mut largest = (0.0, 0);
        for body in 0..self.index.len() {
            let force = self.force_on(forces, body);
            if force.is_nan() {
                largest = (force, body);
                break;
            }
            if force > largest.0 {
                largest = (force, body);
            }
        }
        (largest.0, self.owner(largest.1))
    }
}
