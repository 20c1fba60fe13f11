//! What contacts have of the forces that are unknowns: displacements, residuals and tangents.

use crate::assembly::network::{Knot, KnotTangent, STILL, lifted, plain_lift};
use crate::assembly::spot::Spot;
use crate::assembly::{ContactPoint, Contacts, Dofs, PairWork};
use crate::contact::memory::PairKey;
use crate::tensor::Pose;

pub(super) fn pair_of(pairs: &[PairWork], key: PairKey) -> Option<usize> {
    pairs.binary_search_by_key(&key, PairWork::key).ok()
}

pub(super) fn spot_of<'a>(pairs: &'a mut [PairWork], knot: &Knot) -> Option<&'a mut Spot> {
    let pair = pair_of(pairs, knot.key)?;
    pairs[pair].spots.iter_mut().find(|spot| spot.feature == knot.feature)
}

impl Contacts {
    /// Sets the elastic displacements of the knots to those under the present forces and `pressure` [Pa].
    pub fn yield_to_forces(&mut self, pressure: f64) {
        if !self.network.placed || self.network.knots.is_empty() {
            return;
        }
        let moved = self.network.displacements(pressure);
        for (knot, elastic) in self.network.knots.iter().zip(moved) {
            if let Some(spot) = spot_of(&mut self.pairs, knot) {
                (spot.elastic, spot.change) = (elastic, elastic - knot.before);
                spot.given = Some(knot.force * knot.compliance);
            }
        }
    }

    pub(super) fn point_of(&self, knot: &Knot) -> Option<&ContactPoint> {
        let pair = &self.pairs[pair_of(&self.pairs, knot.key)?];
        pair.points.iter().find(|point| point.site.feature == knot.feature)
    }

    /// Adds to `residual` [N] what the knots' forces lack, and to the bodies' what makes theirs a balance of these forces.
    pub(in crate::assembly) fn network_forces_into(&self, residual: &mut [f64], dofs: &Dofs, poses: &[Pose]) {
        if !self.network.placed {
            return;
        }
        for (k, knot) in self.network.knots.iter().enumerate() {
            let (mut excess, [a, b]) = (-knot.force, [knot.key.0 as usize, knot.key.1 as usize]);
            if let Some(point) = self.point_of(knot) {
                excess += point.evaluation.bending_force();
                let plain = plain_lift(&point.evaluation.point, [&poses[a].position, &poses[b].position]);
                let wrench = lifted(&plain, &-excess);
                dofs.scatter(residual, a, &wrench[..6]);
                dofs.scatter(residual, b, &wrench[6..]);
            }
            dofs.scatter(residual, dofs.contact_block(k), excess.as_slice());
        }
    }

    /// Combines the tangents of the contacts that are knots with the rows of their forces.
    pub(in crate::assembly) fn combine_tangents(&mut self, poses: &[Pose]) {
        if !self.network.placed {
            return;
        }
        let mut knots = std::mem::take(&mut self.network.knots);
        for knot in &mut knots {
            knot.tangent = STILL;
            let Some(pair) = pair_of(&self.pairs, knot.key) else { continue };
            let pair = &mut self.pairs[pair];
            let Some(at) = pair.points.iter().position(|point| point.site.feature == knot.feature) else {
                continue;
            };
            let (point, bodies) = (&pair.points[at], [pair.a(), pair.b()]);
            let e = &point.evaluation;
            let plain = plain_lift(&e.point, bodies.map(|body| &poses[body].position));
            let excess = e.bending_force() - knot.force;
            if !e.is_active() {
                knot.tangent = KnotTangent { lift: plain, plain, excess: -knot.force, ..STILL };
                continue;
            }
            let number = pair.points[..at].iter().filter(|point| point.evaluation.is_active()).count();
            let elastic = &pair.elastic_tangents[number];
            knot.tangent = KnotTangent::combine(elastic, plain, point, excess);
            pair.tangents[number] = knot.tangent.at_given_force(elastic);
        }
        self.network.knots = knots;
    }
}
