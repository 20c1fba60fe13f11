//! What an accepted configuration leaves to the next increment.

use crate::assembly::crushing::depth_of;
use crate::assembly::{ContactPoint, Contacts};
use crate::contact::memory::{Memory, PairMemory, PointMemory};
use crate::model::{Committed, Model};
use crate::tensor::Vec3;

impl Contacts {
    /// Goes on from the present configuration, `committed` but for its memory, as if it had been committed. Points have to be evaluated again.
    pub fn rebase(&mut self, model: &Model, committed: &mut Committed) {
        committed.memory = self.memory(model);
        self.crushed.clone_from(&committed.memory.crushed);
        for pair in &mut self.pairs {
            pair.reset(model, committed);
        }
    }

    /// What contacts will remember once the present configuration is accepted.
    pub fn memory(&self, model: &Model) -> Memory {
        let mut memory = Memory::with_crushed(self.crushed_now());
        for pair in &self.pairs {
            let mut points: Vec<PointMemory> = Vec::new();
            let (mut slip, mut force) = (0.0, 0.0);
            for point in pair.active() {
                let e = &point.evaluation;
                slip += e.slip() * e.pressure;
                force += e.pressure;
                let traction = e.friction / e.weight;
                let multiplier = pair.multiplier(point.site.feature);
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
                    omitted: pair.carried.omitted(point.site.feature),
                    scale: multiplier.map_or(self.first_scale, |multiplier| multiplier.scale),
                    stiffness_left: point.stiffness_left,
                    depth: depth_of(point),
                    grip: e.grip,
                });
            }
            let slip = if points.is_empty() { 0.0 } else { pair.carried.slip + slip / force };
            // Kept open by a change of fidelity: without its initial overlap it would touch.
            let held_open = |p: &&ContactPoint| {
                let initial_overlap = p.state.initial_overlap;
                !p.evaluation.is_active() && initial_overlap < 0.0 && p.opening() + initial_overlap < 0.0
            };
            let open = pair.points.iter().filter(held_open);
            points.extend(open.map(|p| PointMemory::open(p.site.feature, p.state.initial_overlap)));
            if !points.is_empty() {
                points.sort_by_key(|p| p.feature);
                let mortars = pair.mortars_of(&points);
                memory.insert(pair.key(), PairMemory { slip, points, mortars });
            }
        }
        memory
    }
}
