//! Work of forces along the way that bodies take in an increment.
//!
//! Between states that friction counts from the way is a straight one (screw-like for rotations), cut into pieces: those of two bodies by how far they
//! have come against each other. On each piece forces are evaluated at two places: Gauss's rule, exact for forces that change with the cube of the way.
//! Contacts that open, close or begin to slide on it make an error, which the energy balance tells. (Points at the ends would weigh forces before a
//! contact slides too much, with one sign in all of them.)
//!
//! Displacements `u` of bodies that follow the forces by steps go straight along with them, and contacts know them by `u` alone, on the way and at its ends:
//! a solve has them yield by what it expects of `u` besides. A contact's force `f` works on frames and on `u`; what it stores, rubs off and crushes is the
//! sum of both. Of `f . du` bodies store the change of their energy. The rest is lost, since `u` is behind `f`, as against a drag. Contacts that damage has
//! softened since are soft on all of the way: what that freed at its start is booked apart (`assembly::damage`).
//!
//! Where displacements are solved for by augmentations, at the end of a step only, the mean of the forces at both ends of the increment stands in, and tells
//! nothing of what snaps in it.

use crate::assembly::place::SurfaceField;
use crate::assembly::{self, Contacts};
use crate::contact::memory::PairKey;
use crate::model::Loads;
use crate::solver::motion::{motion_between, motion_vector};
use crate::solver::newton::Newton;
use crate::tensor::{Pose, Vector6};
use std::collections::{BTreeMap, BTreeSet};

/// Where forces are evaluated on the way of a step, as shares of it.
const GAUSS_POINTS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// Pieces on a way at most.
const MOST_PIECES: f64 = 32.0;

/// How finely a way is cut into pieces.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    /// Pieces of any way.
    pub least: usize,
    /// The longest a piece may be in the mean, as a share of what a body may go in an iteration, as far as [`MOST_PIECES`] let it.
    pub mean: f64,
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
    /// Volume under the cover [m^3].
    volume: f64,
    /// Work on each component of each carrier [J].
    pub work: Vec<Vector6<f64>>,
    /// Work of the pressure on the volume under the cover, without what bodies bend [J].
    pub pressure_work: f64,
    /// Work of forces on displacements of bodies that follow them by steps, beyond what these store [J].
    pub bending_loss: f64,
    /// What these bodies store there, before what damage since then has left of their contacts [J].
    stored: f64,
}

/// What forces do on a way.
struct Along {
    /// Their mean on all carriers, but for those applied from outside [N, N m]; `None` where it is not known: where bodies are displaced by augmentations, or
    /// are too close there.
    mean: Option<Vec<Vector6<f64>>>,
    /// Work on displacements of bodies that follow them by steps [J], and what these store at its end.
    bending_work: f64,
    stored: f64,
}

impl Path {
    /// Begins in the committed state.
    pub fn from(newton: &mut Newton<'_>) -> Self {
        let poses = newton.committed.poses.clone();
        let forces = newton.committed.forces.clone();
        let known = forces.len() == poses.len();
        let forces = if known { forces } else { vec![Vector6::zeros(); poses.len()] };
        let pressure = newton.committed.pressure.unwrap_or(newton.loads.pressure);
        let fields = newton.committed.fields.clone();
        let volume = newton.model.enclosed_volume(&poses);
        let work = vec![Vector6::zeros(); poses.len()];
        let stored = newton.stored_as_committed(pressure);
        Path { work, pressure_work: 0.0, bending_loss: 0.0, stored, poses, fields, forces, pressure, volume }
    }

    /// Goes on from where `newton` is, whatever brought it there.
    pub fn restart(&mut self, newton: &mut Newton<'_>) {
        self.press(newton);
        let work = std::mem::take(&mut self.work);
        let Path { pressure_work, bending_loss, .. } = *self;
        *self = Path { work, pressure_work, bending_loss, ..Path::from(newton) };
    }

    /// Books the work of the pressure, and keeps where it stands.
    fn press(&mut self, newton: &Newton<'_>) {
        let (pressure, volume) = (newton.loads.pressure, newton.model.enclosed_volume(&newton.poses));
        self.pressure_work -= 0.5 * (self.pressure + pressure) * (volume - self.volume);
        (self.pressure, self.volume) = (pressure, volume);
    }

    /// How far any two bodies have come against each other since then, over the length that one may go in an iteration.
    pub fn reach(&self, newton: &Newton<'_>) -> f64 {
        ways(&self.poses, newton).map(|(_, way)| way).fold(0.0, f64::max)
    }

    /// Goes on to where `newton` is; its contacts are evaluated there before and after.
    pub fn go_on(&mut self, newton: &mut Newton<'_>, cut: Cut) {
        let end = newton.forces();
        let pieces = ways(&self.poses, newton).map(|(pair, way)| (pair, cut.pieces(way))).collect();
        let Along { mean, bending_work, stored } = newton.along(self, cut.least, &pieces);
        let mean = mean
            .unwrap_or_else(|| self.forces.iter().zip(&end).map(|(from, to)| 0.5 * (from + to)).collect());
        self.bending_loss += bending_work - (stored - self.stored);
        self.stored = stored;
        let motions = self.poses.iter().zip(&newton.poses);
        for ((work, mean), (from, to)) in self.work.iter_mut().zip(&mean).zip(motions) {
            *work += mean.component_mul(&motion_vector(from, to));
        }
        self.poses.clone_from(&newton.poses);
        self.fields.clone_from(&newton.contacts.fields);
        self.forces = end;
        self.press(newton);
    }
}

/// How far the two bodies of each pair have come against each other from there where they touch, at most, over the length that they may go in an iteration.
/// Ways that they go side by side, and turns as one, are none.
fn ways<'a>(from: &'a [Pose], newton: &'a Newton<'_>) -> impl Iterator<Item = (PairKey, f64)> + 'a {
    let (model, to) = (newton.model, &newton.poses);
    let length = model.smallest_rounding();
    newton.contacts.pairs.iter().map(move |pair| {
        let radius = |body: usize| model.shapes[body].bounding_radius;
        let (a, b) = (pair.a(), pair.b());
        let (small, large) = if radius(a) <= radius(b) { (a, b) } else { (b, a) };
        // Where the large one's material that is at the small one's centre now was.
        let beside = from[large].to_space(&to[large].to_body(&to[small].position));
        let turn = |body: usize| to[body].rotation * from[body].rotation.inverse();
        let against = turn(small) * turn(large).inverse();
        let way = (from[small].position - beside).norm() + against.angle() * radius(small);
        (pair.key(), way / (newton.settings.motion_cap * length))
    })
}

/// Where forces are evaluated on a way in so many pieces, as shares of it, and their weights. Pieces are the shorter the nearer to its start, where friction
/// turns into the way.
fn places(pieces: usize) -> impl Iterator<Item = (f64, f64)> {
    let end = move |piece: usize| (piece as f64 / pieces as f64).powi(2);
    (0..pieces).flat_map(move |piece| {
        let (from, width) = (end(piece), end(piece + 1) - end(piece));
        GAUSS_POINTS.map(|at| (from + at * width, 0.5 * width))
    })
}

impl Cut {
    /// Pieces of a way of this length: the least number, doubled until they are short enough.
    fn pieces(&self, way: f64) -> usize {
        let needed = (way / self.mean).min(MOST_PIECES) as usize;
        let doublings = (0..).find(|doublings| self.least << doublings >= needed);
        self.least << doublings.unwrap_or(0)
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

    /// What forces do on the straight way since `start`. The way of each pair is cut into its `pieces`, of one that is met on it into the `least`.
    fn along(&mut self, start: &Path, least: usize, pieces: &BTreeMap<PairKey, usize>) -> Along {
        if self.model.waits_for_augmentations() {
            return Along { mean: None, bending_work: 0.0, stored: 0.0 };
        }
        let fields = if self.model.has_elastic() { self.contacts.fields.clone() } else { Vec::new() };
        let mut along = self.sum_along(start, least, pieces, &fields);
        if self.model.has_elastic() {
            let poses = self.poses.clone();
            along.stored = self.stored_at(&poses, fields, self.loads.pressure);
        }
        self.evaluate();
        along
    }

    /// What bodies that follow forces by steps store as committed, under that `pressure` [Pa], by their displacements alone [J].
    fn stored_as_committed(&mut self, pressure: f64) -> f64 {
        if !self.model.follows_by_steps() {
            return 0.0;
        }
        // An increment begins with the committed displacements.
        let (poses, fields) = (self.committed.poses.clone(), self.contacts.fields.clone());
        self.contacts.yield_in_solves(false);
        let stored = self.stored_at(&poses, fields, pressure);
        self.contacts.yield_in_solves(true);
        self.evaluate();
        stored
    }

    /// What bodies that bend store, displaced by `fields` under a `pressure` [Pa] and what their contacts bear so [J].
    fn stored_at(&mut self, poses: &[Pose], fields: Vec<SurfaceField>, pressure: f64) -> f64 {
        self.contacts.displace(fields);
        let is_known = self.contacts.evaluate(self.model, &self.committed, poses).is_ok();
        let loads = Loads { pressure, ..self.loads.clone() };
        if is_known { self.contacts.elastic_energy(self.model, &loads, poses) } else { 0.0 }
    }

    /// Sums over a way what forces do, bodies that bend being displaced to `fields` at its end; empty where none does. Leaves the contacts somewhere on it.
    fn sum_along(
        &mut self,
        start: &Path,
        least: usize,
        pieces: &BTreeMap<PairKey, usize>,
        fields: &[SurfaceField],
    ) -> Along {
        let model = self.model;
        let change = change_of(&start.fields, fields);
        let bends = !change.is_empty();
        let mut bending_work = 0.0;
        let mut mean = vec![Vector6::zeros(); start.poses.len()];
        let mut known = true;
        let of_pairs = |contacts: &Contacts| -> Vec<usize> {
            contacts.pairs.iter().map(|pair| pieces.get(&pair.key()).copied().unwrap_or(least)).collect()
        };
        let mut of_pair = of_pairs(&self.contacts);
        let most = pieces.values().copied().max().unwrap_or(least);
        // Contacts of a skin are looked at as often as any.
        let of_others = if model.wall.is_some() || model.membrane.is_some() { most } else { least };
        let counts: BTreeSet<usize> = pieces.values().copied().chain([least, of_others]).collect();
        for count in counts {
            for (share, weight) in places(count) {
                let there = |(from, to): (&Pose, &Pose)| {
                    let (shift, turn) = motion_between(from, to);
                    from.moved(&(share * shift), &(share * turn))
                };
                let poses: Vec<Pose> = start.poses.iter().zip(&self.poses).map(there).collect();
                if bends {
                    self.contacts.displace(at(share, fields, &change));
                }
                if self.contacts.look_around(model, &self.committed, &poses) {
                    of_pair = of_pairs(&self.contacts);
                }
                let mut meets = vec![count == of_others; model.bodies.len()];
                for (pair, _) in self.contacts.pairs.iter().zip(&of_pair).filter(|(_, of)| **of == count) {
                    meets[pair.a()] = true;
                    meets[pair.b()] = true;
                }
                self.contacts
                    .place(model, &self.committed, &poses, |body| meets.get(body).is_none_or(|meets| *meets));
                let counted = |number: usize| of_pair[number] == count;
                known &= self
                    .contacts
                    .evaluate_pairs(model, &self.committed, &poses, |number, _| counted(number))
                    .is_ok();
                let mut forces = vec![Vector6::zeros(); start.poses.len()];
                assembly::add_contact_forces(&mut forces, &self.contacts, counted);
                if bends {
                    bending_work += weight * self.contacts.bending_work(&poses, &change, counted);
                }
                if count == of_others {
                    known &= self.contacts.evaluate_skin(model, &poses).is_ok();
                    let pressure = start.pressure + share * (self.loads.pressure - start.pressure);
                    let weighing = (pressure, self.loads.gravity);
                    assembly::add_other_forces(&mut forces, model, &self.contacts, weighing, &poses);
                    if bends {
                        bending_work +=
                            weight * self.contacts.bending_work_of_others(model, &poses, pressure, &change);
                    }
                }
                mean.iter_mut().zip(forces).for_each(|(mean, force)| *mean += weight * force);
            }
        }
        Along { mean: known.then_some(mean), bending_work, stored: 0.0 }
    }
}

/// By how much fields have changed; of a body without one at the start, all of it.
fn change_of(from: &[SurfaceField], to: &[SurfaceField]) -> Vec<SurfaceField> {
    let of = |(body, to): (usize, &SurfaceField)| match from.get(body) {
        Some(from) if from.len() == to.len() => to.iter().zip(from).map(|(to, from)| to - from).collect(),
        Some(_) | None => to.clone(),
    };
    to.iter().enumerate().map(of).collect()
}

/// Fields at a share of the way to `to`, on which they change by `change`.
fn at(share: f64, to: &[SurfaceField], change: &[SurfaceField]) -> Vec<SurfaceField> {
    let of = |(to, change): (&SurfaceField, &SurfaceField)| {
        to.iter().zip(change).map(|(to, change)| to - change * (1.0 - share)).collect()
    };
    to.iter().zip(change).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exact for cubics, whatever the pieces; finer for a force that turns into the way within a hundredth of it.
    #[test]
    fn forces_are_weighed_by_where_they_are_looked_at() {
        let mean = |pieces: usize, of: fn(f64) -> f64| places(pieces).map(|(x, w)| w * of(x)).sum::<f64>();
        for pieces in [1, 2, 5] {
            let off = mean(pieces, |x| 1.0 - 3.0 * x + 5.0 * x * x - 4.0 * x.powi(3))
                - (1.0 - 1.5 + 5.0 / 3.0 - 1.0);
            assert!(off.abs() < 1e-12, "{pieces}: {off}");
        }
        let turning = |x: f64| 1.0 - (-100.0 * x).exp();
        let off = [1, 2, 4].map(|pieces| mean(pieces, turning) - 0.99);
        assert!(off[0] > 9e-3 && off[1] < off[0] && off[2].abs() < 0.2 * off[0], "{off:?}");
    }

    #[test]
    fn a_way_is_cut_by_its_own_length() {
        let pieces = |least: usize, way: f64| Cut { least, mean: 0.2 }.pieces(way);
        assert_eq!([0.0, 0.2, 0.7, 1.0, 100.0].map(|way| pieces(1, way)), [1, 1, 4, 8, 32]);
        assert_eq!([0.0, 0.7, 1.0].map(|way| pieces(3, way)), [3, 3, 6]);
    }
}
