//! Forces of a contact on its two bodies.

use crate::contact::state::Frame;
use crate::tensor::dual::{Real, Vector};

/// Forces on both bodies [N] and their moments about the bodies' positions [N m].
pub(super) struct Wrench<T> {
    positions: [Vector<T>; 2],
    forces: [Vector<T>; 2],
    moments: [Vector<T>; 2],
}

impl<T: Real> Wrench<T> {
    /// A force on `b` at a point in space, and its opposite on `a`.
    #[inline]
    pub fn new(frames: [&Frame<T>; 2], point: Vector<T>, force_on_b: Vector<T>) -> Self {
        let positions = frames.map(|frame| frame.position);
        let forces = [-force_on_b, force_on_b];
        let moment = |side: usize| (point - positions[side]).cross(forces[side]);
        Wrench { positions, forces, moments: [moment(0), moment(1)] }
    }

    /// Adds a force on `a` at a point in space.
    #[inline]
    pub fn push_a(&mut self, point: Vector<T>, force: Vector<T>) {
        self.push(0, point, force);
    }

    /// Adds a force on `b` at a point in space.
    #[inline]
    pub fn push_b(&mut self, point: Vector<T>, force: Vector<T>) {
        self.push(1, point, force);
    }

    #[inline]
    fn push(&mut self, side: usize, point: Vector<T>, force: Vector<T>) {
        self.forces[side] = self.forces[side] + force;
        self.moments[side] = self.moments[side] + (point - self.positions[side]).cross(force);
    }

    /// Adds a moment on `a`.
    #[inline]
    pub fn turn_a(&mut self, moment: Vector<T>) {
        self.moments[0] = self.moments[0] + moment;
    }

    /// Adds a moment on `b`.
    #[inline]
    pub fn turn_b(&mut self, moment: Vector<T>) {
        self.moments[1] = self.moments[1] + moment;
    }

    /// Force and moment on `a`, then on `b`.
    #[inline]
    pub fn components(&self) -> [T; 12] {
        let mut all = [T::constant(0.0); 12];
        let parts = [self.forces[0], self.moments[0], self.forces[1], self.moments[1]];
        for (part, vector) in all.chunks_exact_mut(3).zip(parts) {
            part.copy_from_slice(&vector.0);
        }
        all
    }
}
