//! Puts the pieces of a body that came apart in its place, without shapes of their own: in a press, plates meet their nodes.

use crate::grain::DamagedGrain;
use crate::model::{Committed, Deformation, Model};

impl Model {
    /// Makes body `index` the first of `grains`, which have its body coordinates, and the others bodies behind all; returns their
    /// numbers. Without grains nothing is left of the body. All of them keep its contact shape and its pose.
    pub fn put_pieces(
        &mut self,
        committed: &mut Committed,
        index: usize,
        grains: Vec<DamagedGrain>,
    ) -> Vec<usize> {
        if grains.is_empty() {
            self.remove(index);
        }
        let mut numbers = Vec::with_capacity(grains.len());
        for (number, grain) in grains.into_iter().enumerate() {
            let old = &self.bodies[index];
            let deformation = match old.is_elastic() {
                true => Deformation::condensed(grain.condensed().clone()),
                false => Deformation::Rigid,
            };
            let body = self.body_of(index, number, grain, old.nominal.clone(), deformation);
            if number == 0 {
                self.bodies[index] = body;
                numbers.push(index);
            } else {
                numbers.push(self.bodies.len());
                self.bodies.push(body);
                self.shapes.push(self.shapes[index].clone());
                committed.poses.push(committed.poses[index]);
            }
        }
        numbers
    }
}
