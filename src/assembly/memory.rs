//! What an accepted configuration leaves to the next increment.

use rayon::prelude::*;

use crate::assembly::crushing::{depth_of, note};
use crate::assembly::{ContactPoint, Contacts, PairWork};
use crate::contact::memory::{Memory, PairMemory, PointMemory};
use crate::model::Model;
use crate::tensor::Vec3;

impl Contacts {
    /// What contacts will remember once the present configuration is accepted.
    pub fn memory(&self, model: &Model) -> Memory {
        let of_pair =
            |pair: &PairWork| (pair.memory(model, self.first_scale), pair.crushed(self.knows_depths));
        let all: Vec<_> = self.pairs.par_iter().map(of_pair).collect();
        let mut crushed = self.crushed.clone();
        let known = self.pairs.iter().zip(all).filter_map(|(pair, (memory, deeper))| {
            note(&mut crushed, deeper);
            Some((pair.key(), memory?))
        });
        let mut memory: Memory = known.collect();
        memory.crushed = crushed;
        memory
    }
}

impl PairWork {
    /// What its contacts will remember; `None` where there is nothing. One that was not known has the scale `first_scale`.
    pub(super) fn memory(&self, model: &Model, first_scale: f64) -> Option<PairMemory> {
        let mut points: Vec<PointMemory> = Vec::with_capacity(self.points.len());
        let (mut slip, mut force) = (0.0, 0.0);
        for point in self.active() {
            let e = &point.evaluation;
            slip += e.slip() * e.pressure;
            force += e.pressure;
            let traction = e.friction / e.weight;
            let multiplier = self.multiplier(point.site.feature);
            let slid = multiplier.map_or_else(Vec3::zeros, |multiplier| multiplier.slid);
            points.push(PointMemory {
                feature: point.site.feature,
                place: e.point,
                stretch: point.state.own_stretch(&model.law, e) - slid,
                pressure: e.pressure,
                load: e.load,
                hardened: e.hardened,
                traction,
                bound: e.coefficient * e.load,
                tangential_energy: e.tangential_energy,
                initial_overlap: point.state.initial_overlap,
                omitted: self.carried.omitted(point.site.feature),
                scale: multiplier.map_or(first_scale, |multiplier| multiplier.scale),
                stiffness_left: point.stiffness_left,
                depth: depth_of(point),
                grip: e.grip,
            });
        }
        let slip = if points.is_empty() { 0.0 } else { self.carried.slip + slip / force };
        // Kept open by a change of fidelity: without its initial overlap it would touch.
        let held_open = |p: &&ContactPoint| {
            let initial_overlap = p.state.initial_overlap;
            !p.evaluation.is_active() && initial_overlap < 0.0 && p.opening() + initial_overlap < 0.0
        };
        let open = self.points.iter().filter(held_open);
        points.extend(open.map(|p| PointMemory::open(p.site.feature, p.state.initial_overlap)));
        points.sort_by_key(|p| p.feature);
        let mortars = self.mortars_of(&points);
        (!points.is_empty()).then_some(PairMemory { slip, points, mortars })
    }
}
