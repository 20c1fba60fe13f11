//! What an accepted configuration leaves to the next increment.

use rayon::prelude::*;

use crate::assembly::crushing::{deepen, depth_of};
use crate::assembly::{ContactPoint, Contacts, PairWork};
use crate::contact::memory::{Memory, PairMemory, PointMemory};
use crate::model::Model;
use crate::tensor::{Pose, Vec3};

impl Contacts {
    /// Goes on from the configuration last evaluated as if it had been committed at these poses. Points have to be evaluated again.
    pub fn rebase(&mut self, model: &Model, poses: &[Pose]) {
        // What is crushed is kept here within an increment.
        deepen(&mut self.crushed, &self.pairs, self.knows_depths);
        self.knows_depths = true;
        self.parted.clear();
        let first_scale = self.first_scale;
        self.pairs.par_iter_mut().for_each(|pair| pair.go_on(model, first_scale, poses));
    }

    /// What contacts will remember once the present configuration is accepted.
    pub fn memory(&self, model: &Model) -> Memory {
        let of_pair = |pair: &PairWork| Some((pair.key(), pair.memory(model, self.first_scale)?));
        let all: Vec<_> = self.pairs.par_iter().filter_map(of_pair).collect();
        let mut memory: Memory = all.into_iter().collect();
        memory.crushed.clone_from(&self.crushed);
        deepen(&mut memory.crushed, &self.pairs, self.knows_depths);
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
