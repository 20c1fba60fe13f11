//! Work of forces along the way that bodies take in an increment.
//!
//! Between states that friction counts from the way is a straight one (screw-like for rotations), cut into pieces. On each piece forces are evaluated
//! at two places: Gauss's rule, exact for forces that change with the cube of the way. Contacts that open, close or begin to slide on it make an error,
//! which the energy balance tells. (Points at the ends would weigh forces before a contact slides too much, with one sign in all of them.)
//!
//! Displacements of bodies that follow the forces by steps go straight along with them. Where they are solved for by augmentations, at the end of a step
//! only, the mean of the forces at both ends of the increment stands in, and tells nothing of what snaps in it.

use crate::assembly::place::SurfaceField;
use crate::assembly::{self, PairWork};
use crate::solver::motion::{motion_between, motion_vector};
use crate::solver::newton::Newton;
use crate::tensor::{Pose, Vector6};
use std::collections::BTreeSet;

/// Where forces are evaluated on the way of a step, as shares of it.
const GAUSS_POINTS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// Pieces on a way at most, but for one a step.
const MOST_PIECES: f64 = 32.0;

/// How finely a way is cut into pieces.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    pub pieces_a_step: usize,
    /// The longest as a share of what a body may go in an iteration, as far as [`MOST_PIECES`] let it.
    pub longest: f64,
}

/// The way so far.
#[derive(Debug, Clone)]
pub(super) struct Path {
    poses: Vec<Pose>,
    /// Displacements of bodies that follow the forces by steps.
    fields: Vec<SurfaceField>,
    forces: Vec<Vector6<f64>>,
    /// Pressure there [Pa], which goes to the present one in a step.
    pressure: f64,
    /// Work on each component of each carrier [J].
    pub work: Vec<Vector6<f64>>,
}

impl Path {
    /// Begins in the committed state.
    pub fn from(newton: &Newton<'_>) -> Self {
        let poses = newton.committed.poses.clone();
        let forces = newton.committed.forces.clone();
        let known = forces.len() == poses.len();
        let forces = if known { forces } else { vec![Vector6::zeros(); poses.len()] };
        let pressure = newton.committed.pressure.unwrap_or(newton.loads.pressure);
        let fields = newton.committed.fields.clone();
        Path { work: vec![Vector6::zeros(); poses.len()], poses, fields, forces, pressure }
    }

    /// Goes on from where `newton` is, whatever brought it there.
    pub fn restart(&mut self, newton: &Newton<'_>) {
        *self = Path { work: std::mem::take(&mut self.work), ..Path::from(newton) };
    }

    /// How far any body has come since then, over the length that it may go in an iteration.
    pub fn reach(&self, newton: &Newton<'_>) -> f64 {
        ways(&self.poses, newton).fold(0.0, f64::max)
    }

    /// Goes on to where `newton` is after so many steps; its contacts are evaluated there before and after.
    pub fn go_on(&mut self, newton: &mut Newton<'_>, steps: usize, cut: Cut) {
        let end = newton.forces();
        let least = cut.pieces_a_step * steps.max(1);
        let pieces: Vec<usize> = ways(&self.poses, newton).map(|way| cut.pieces(least, way)).collect();
        let mean = newton
            .mean_forces_since(self, least, &pieces)
            .unwrap_or_else(|| self.forces.iter().zip(&end).map(|(from, to)| 0.5 * (from + to)).collect());
        let motions = self.poses.iter().zip(&newton.poses);
        for ((work, mean), (from, to)) in self.work.iter_mut().zip(&mean).zip(motions) {
            *work += mean.component_mul(&motion_vector(from, to));
        }
        self.poses.clone_from(&newton.poses);
        self.fields.clone_from(&newton.contacts.fields);
        self.forces = end;
        self.pressure = newton.loads.pressure;
    }
}

/// How far each body has come from there, over the length that it may go in an iteration.
fn ways<'a>(from: &'a [Pose], newton: &'a Newton<'_>) -> impl Iterator<Item = f64> + 'a {
    let lengths = newton.settings.step_length.lengths(newton.model);
    let ways = from.iter().zip(&newton.poses).zip(&newton.model.shapes).zip(lengths);
    ways.map(|(((from, to), shape), length)| {
        let (shift, turn) = motion_between(from, to);
        (shift.norm() + turn.norm() * shape.bounding_radius) / (newton.settings.motion_cap * length)
    })
}

impl Cut {
    /// Pieces of a way of this length: `least` doubled until they are short enough.
    fn pieces(&self, least: usize, way: f64) -> usize {
        let needed = (way / self.longest).min(MOST_PIECES) as usize;
        let doublings = (0..).find(|doublings| least << doublings >= needed);
        least << doublings.unwrap_or(0)
    }
}

impl Newton<'_> {
    /// Forces on all carriers where contacts were evaluated last, but for those applied from outside [N, N m].
    pub(super) fn forces(&self) -> Vec<Vector6<f64>> {
        let mut forces = Vec::new();
        let weighing = (self.loads.pressure, self.loads.gravity);
        assembly::carrier_forces_into(&mut forces, self.model, &self.contacts, weighing, &self.poses);
        forces
    }

    /// The mean of the same over the straight way since `start`; `None` where that is not known: where bodies are displaced by augmentations, or are too
    /// close there. The way is cut into `least` pieces, for contacts of bodies that need more into those of `pieces`: each pair's are its own.
    fn mean_forces_since(
        &mut self,
        start: &Path,
        least: usize,
        pieces: &[usize],
    ) -> Option<Vec<Vector6<f64>>> {
        let model = self.model;
        if model.waits_for_augmentations() {
            return None;
        }
        let follows = model.follows_by_steps();
        let fields = self.contacts.fields.clone();
        let mut mean = vec![Vector6::zeros(); start.poses.len()];
        let mut known = true;
        let of_pair = |pair: &PairWork| pieces[pair.a()].max(pieces[pair.b()]);
        let most = pieces.iter().copied().max().unwrap_or(least);
        // Contacts of a skin are looked at as often as any.
        let of_others = if model.wall.is_some() || model.membrane.is_some() { most } else { least };
        let counts: BTreeSet<usize> = pieces.iter().copied().chain([of_others]).collect();
        for count in counts {
            let counted = |pair: &PairWork| of_pair(pair) == count;
            let mut forces = vec![Vector6::zeros(); start.poses.len()];
            for share in
                (0..count).flat_map(|piece| GAUSS_POINTS.map(|at| (piece as f64 + at) / count as f64))
            {
                let there = |(from, to): (&Pose, &Pose)| {
                    let (shift, turn) = motion_between(from, to);
                    from.moved(&(share * shift), &(share * turn))
                };
                let poses: Vec<Pose> = start.poses.iter().zip(&self.poses).map(there).collect();
                if follows {
                    self.contacts.displace(between(&start.fields, &fields, share), false);
                }
                known &= self.contacts.evaluate_pairs(model, &self.committed, &poses, counted).is_ok();
                assembly::add_contact_forces(&mut forces, &self.contacts, counted);
                if count == of_others {
                    known &= self.contacts.evaluate_skin(model, &poses).is_ok();
                    let pressure = start.pressure + share * (self.loads.pressure - start.pressure);
                    let weighing = (pressure, self.loads.gravity);
                    assembly::add_other_forces(&mut forces, model, &self.contacts, weighing, &poses);
                }
            }
            let weight = 0.5 / count as f64;
            mean.iter_mut().zip(forces).for_each(|(mean, force)| *mean += weight * force);
        }
        if follows {
            self.contacts.displace(fields, true);
        }
        self.evaluate();
        known.then_some(mean)
    }
}

/// Fields at a share of the way from one to the other; a body without one at an end has none moved there.
fn between(from: &[SurfaceField], to: &[SurfaceField], share: f64) -> Vec<SurfaceField> {
    let of = |(body, to): (usize, &SurfaceField)| match from.get(body) {
        Some(from) if from.len() == to.len() => {
            from.iter().zip(to).map(|(from, to)| from + (to - from) * share).collect()
        }
        Some(_) | None => to.iter().map(|to| to * share).collect(),
    };
    to.iter().enumerate().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_is_cut_by_its_own_length() {
        let cut = Cut { pieces_a_step: 1, longest: 0.2 };
        assert_eq!([0.0, 0.2, 0.7, 1.0, 100.0].map(|way| cut.pieces(1, way)), [1, 1, 4, 8, 32]);
        assert_eq!([0.0, 0.7, 1.0].map(|way| cut.pieces(3, way)), [3, 3, 6]);
    }
}
