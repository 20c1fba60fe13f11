//! What contacts have of the forces that are unknowns: displacements, residuals and tangents.

use crate::assembly::contact_forces::{ContactForce, ForceTangent, STILL, lifted, plain_lift};
use crate::assembly::place::ContactPlace;
use crate::assembly::{ContactPoint, Contacts, Dofs, PairWork};
use crate::contact::memory::PairKey;
use crate::tensor::Pose;

pub(super) fn pair_of(pairs: &[PairWork], key: PairKey) -> Option<usize> {
    pairs.binary_search_by_key(&key, PairWork::key).ok()
}

pub(super) fn place_of<'a>(
    pairs: &'a mut [PairWork],
    unknown: &ContactForce,
) -> Option<&'a mut ContactPlace> {
    let pair = pair_of(pairs, unknown.key)?;
    pairs[pair].places.iter_mut().find(|place| place.feature == unknown.feature)
}

impl Contacts {
    /// Sets the elastic displacements of the contacts whose forces are unknowns to those under the present
    /// forces and `pressure` [Pa].
    pub fn yield_to_forces(&mut self, pressure: f64) {
        if !self.unknown_forces.placed || self.unknown_forces.unknowns.is_empty() {
            return;
        }
        let moved = self.unknown_forces.displacements(pressure);
        for (unknown, elastic) in self.unknown_forces.unknowns.iter().zip(moved) {
            if let Some(place) = place_of(&mut self.pairs, unknown) {
                (place.elastic, place.change) = (elastic, elastic - unknown.before);
                place.returned = Some(unknown.force * unknown.compliance);
            }
        }
    }

    pub(super) fn point_of(&self, unknown: &ContactForce) -> Option<&ContactPoint> {
        let pair = &self.pairs[pair_of(&self.pairs, unknown.key)?];
        pair.points.iter().find(|point| point.site.feature == unknown.feature)
    }

    /// Adds to `residual` [N] what the unknown forces lack, and to the bodies' what makes theirs a balance of
    /// these forces.
    pub(in crate::assembly) fn unknown_forces_into(&self, residual: &mut [f64], dofs: &Dofs, poses: &[Pose]) {
        if !self.unknown_forces.placed {
            return;
        }
        for (k, unknown) in self.unknown_forces.unknowns.iter().enumerate() {
            let (mut excess, [a, b]) = (-unknown.force, [unknown.key.0 as usize, unknown.key.1 as usize]);
            if let Some(point) = self.point_of(unknown) {
                excess += point.evaluation.bending_force();
                let plain = plain_lift(&point.evaluation.point, [&poses[a].position, &poses[b].position]);
                let wrench = lifted(&plain, &-excess);
                dofs.scatter(residual, a, &wrench[..6]);
                dofs.scatter(residual, b, &wrench[6..]);
            }
            dofs.scatter(residual, dofs.contact_block(k), excess.as_slice());
        }
    }

    /// Combines the tangents of the contacts whose forces are unknowns with the rows of these.
    pub(in crate::assembly) fn combine_tangents(&mut self, poses: &[Pose]) {
        if !self.unknown_forces.placed {
            return;
        }
        let mut unknowns = std::mem::take(&mut self.unknown_forces.unknowns);
        for unknown in &mut unknowns {
            unknown.tangent = STILL;
            let Some(pair) = pair_of(&self.pairs, unknown.key) else { continue };
            let pair = &mut self.pairs[pair];
            let Some(at) = pair.points.iter().position(|point| point.site.feature == unknown.feature) else {
                continue;
            };
            let (point, bodies) = (&pair.points[at], [pair.a(), pair.b()]);
            let e = &point.evaluation;
            let plain = plain_lift(&e.point, bodies.map(|body| &poses[body].position));
            let excess = e.bending_force() - unknown.force;
            if !e.is_active() {
                unknown.tangent = ForceTangent { lift: plain, plain, excess: -unknown.force, ..STILL };
                continue;
            }
            let number = pair.points[..at].iter().filter(|point| point.evaluation.is_active()).count();
            let elastic = &pair.elastic_tangents[number];
            unknown.tangent = ForceTangent::combine(elastic, plain, point, excess);
            pair.tangents[number] = unknown.tangent.at_given_force(elastic);
        }
        self.unknown_forces.unknowns = unknowns;
    }
}
