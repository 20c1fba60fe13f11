//! The trial damage of an increment: bodies that can break get more of it between augmentations.
//!
//! Everything here is of the increment at hand. The committed grains are the model's and are only copied, so a
//! rejected increment leaves no trace.

use std::sync::Arc;
use std::time::Instant;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::assembly::elastic::displace;
use crate::assembly::place::SurfaceLoads;
use crate::assembly::timings::Kernel;
use crate::assembly::trial::{Alone, Trial};
use crate::assembly::{ContactPoint, Contacts, PairWork};
use crate::contact::ContactLaw;
use crate::contact::force::PointState;
use crate::contact::memory::PointMemory;
use crate::error::Result;
use crate::grain::{DamageChange, DamagedGrain};
use crate::model::{Body, Flexibility, Model};
use crate::tensor::Vec3;

/// What one move of the damage did, over all bodies.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DamageStep {
    /// Largest change of `1 - d` at a point.
    pub applied: f64,
    /// Largest change that the limit held back.
    pub held_back: f64,
    /// Points whose cracks open and close in turn.
    pub flipping: usize,
    pub newly_failed: usize,
    /// Cells of brittle bodies without a working point: they are to be deleted before anything else breaks.
    pub failed_cells: usize,
    /// Bodies whose damage moved.
    pub moved: usize,
}

/// What damage an accepted increment brings; nothing of it is in the model yet.
#[derive(Debug, Clone, Default)]
pub struct Damages {
    /// The committed grains, by body; `None` for those that cannot break.
    pub grains: Vec<Option<Arc<DamagedGrain>>>,
    /// Energy that damage set free in bodies that bend in the increment [J]; what it did at contacts is among their [`Losses`](crate::assembly::Losses).
    pub dissipated: f64,
    /// Elastic energy that left with points that failed [J]: part of `dissipated`.
    pub removed: f64,
    pub newly_failed: usize,
    /// Cells without a working point: to be deleted.
    pub failed_cells: usize,
}

/// What an increment leaves to be taken out: bodies with cells to be deleted, and how their nodes are displaced.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Failing {
    /// Whether any point failed, which carries nothing any more: forces have to find a new balance.
    any: bool,
    bodies: Vec<(u32, Displacements)>,
}

/// [m]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Displacements(#[serde(with = "crate::tensor::stored")] Vec<Vec3>);

impl Failing {
    pub fn is_empty(&self) -> bool {
        !self.any
    }

    /// Those with cells to be deleted.
    pub fn bodies(&self) -> impl Iterator<Item = usize> + '_ {
        self.bodies.iter().map(|(body, _)| *body as usize)
    }

    /// By body, for [`Model::break_up`].
    pub fn displacements(&self, bodies: usize) -> Vec<Vec<Vec3>> {
        let mut all = vec![Vec::new(); bodies];
        for (body, displacements) in &self.bodies {
            if let Some(of_body) = all.get_mut(*body as usize) {
                of_body.clone_from(&displacements.0);
            }
        }
        all
    }
}

impl Damages {
    /// What is to be broken up; nothing where no point has failed.
    pub fn failing(&self, model: &Model) -> Failing {
        let failed = self.grains.iter().enumerate().filter_map(|(body, grain)| {
            let grain = grain.as_ref().filter(|grain| grain.failed_cells() > 0)?;
            let displaced = match model.bodies[body].is_brittle() {
                true => vec![Vec3::zeros(); grain.mesh().nodes.len()],
                false => grain.displaced().to_vec(),
            };
            Some((body as u32, Displacements(displaced)))
        });
        match self.newly_failed {
            0 => Failing::default(),
            _ => Failing { any: true, bodies: failed.collect() },
        }
    }
}

/// The grain of a body as it can break now: one that softens with its damage is sound while it rests.
fn breakable(body: &Body) -> Option<&DamagedGrain> {
    body.damaged().map(|grain| &**grain).filter(|_| body.is_brittle() || !body.is_resting())
}

impl Contacts {
    /// Moves the trial damage towards what the forces of the last augmentation ask for, by at most `max_change` at a point and by nothing
    /// below `least_change`, and displaces the surfaces of the bodies that got softer. Evaluate anew afterwards.
    ///
    /// # Errors
    /// Where a body cannot be factored any more: give the increment up.
    pub fn move_damage(&mut self, model: &Model, max_change: f64, least_change: f64) -> Result<DamageStep> {
        let start = Instant::now();
        let Trial { grains, alone, .. } = &mut self.trial;
        if grains.is_empty() {
            grains.extend(model.bodies.iter().map(|body| breakable(body).cloned()));
            alone.resize(grains.len(), Alone::default());
        }
        let (loads, bending, fields) = (&self.stressing_loads, &self.grains, &self.fields);
        let step = |(body, (grain, alone)): (usize, (&mut Option<DamagedGrain>, &mut Alone))| -> Result<_> {
            let (Some(grain), Some(loads)) = (grain, loads.get(body)) else { return Ok(None) };
            if model.bodies[body].is_brittle() {
                // The forces on it do not follow its mesh but where its contacts soften.
                return alone.settle(grain, loads, max_change, least_change).map(Some);
            }
            let change = match bending[body].as_ref().and_then(Flexibility::full) {
                Some(full) => full.propose(grain, &fields[body], [max_change, least_change])?,
                None => grain.propose_beyond(loads, max_change, least_change)?,
            };
            Ok(Some((change, grain.refresh()?)))
        };
        let changes: Vec<Option<(DamageChange, bool)>> =
            grains.par_iter_mut().zip(alone).enumerate().map(step).collect::<Result<_>>()?;
        let mut total = DamageStep::default();
        self.trial.moved = changes.iter().map(|change| change.is_some_and(|(_, moved)| moved)).collect();
        for (body, change) in changes.into_iter().enumerate() {
            let Some((change, moved)) = change else { continue };
            total.applied = total.applied.max(change.applied);
            total.held_back = total.held_back.max(change.held_back);
            total.flipping += change.flipping;
            total.newly_failed += change.newly_failed;
            if model.bodies[body].is_brittle() {
                total.failed_cells += change.failed_cells;
            }
            total.moved += usize::from(moved);
            let grain = self.trial.grains[body].as_ref().filter(|_| moved);
            let grain = grain.filter(|_| model.bodies[body].softens_with_damage());
            if let (Some(grain), Some(bends)) = (grain, &mut self.grains[body]) {
                *bends = bends.damaged(grain);
                let (field, loads) = (&mut self.fields[body], &self.surface_loads[body]);
                displace(bends, field, &mut self.surplus[body], loads);
            }
        }
        if total.moved > 0 {
            self.update_reach();
        }
        self.timings.book(Kernel::Damage, start);
        Ok(total)
    }

    /// The damage that goes with the accepted configuration; empty where nothing can break.
    ///
    /// # Errors
    /// As [`Contacts::move_damage`].
    pub fn damages(&self, model: &Model) -> Result<Damages> {
        if !model.can_break() || self.stressing_loads.is_empty() {
            return Ok(Damages::default());
        }
        let commit = |(body, loads): (usize, &SurfaceLoads)| -> Result<_> {
            let trial = self.trial.grains.get(body).and_then(Option::as_ref);
            let Some(mut grain) = trial.or(breakable(&model.bodies[body])).cloned() else { return Ok(None) };
            let full = self.grains[body].as_ref().and_then(Flexibility::full);
            let full = full.filter(|_| model.bodies[body].softens_with_damage());
            let mut kept = match full {
                Some(full) => full.commit(&mut grain, &self.fields[body])?,
                None => grain.commit(loads)?,
            };
            if kept.newly_failed > 0 {
                let lost = grain.crumble();
                kept.dissipated += lost;
                kept.removed += lost;
                kept.failed_cells = grain.failed_cells();
            }
            Ok(Some((kept, Arc::new(grain))))
        };
        let kept: Vec<_> =
            self.stressing_loads.par_iter().enumerate().map(commit).collect::<Result<Vec<_>>>()?;
        let mut damages = Damages::default();
        for (grain, body) in kept.into_iter().zip(&model.bodies) {
            damages.grains.push(grain.map(|(kept, grain)| {
                if !body.is_brittle() {
                    damages.dissipated += kept.dissipated;
                    damages.removed += kept.removed;
                }
                damages.newly_failed += kept.newly_failed;
                damages.failed_cells += kept.failed_cells;
                grain
            }));
        }
        Ok(damages)
    }
}

impl PairWork {
    /// Energy that its contacts have set free since the committed state by getting softer [J].
    pub(super) fn softening(&self, model: &Model) -> f64 {
        if !self.is_brittle {
            return 0.0;
        }
        let softer = self.points.iter().filter_map(|point| {
            let memory = self.carried.point(point.site.feature)?;
            let carried = memory.load > 0.0 && memory.stiffness_left != point.stiffness_left;
            carried.then_some((point, memory))
        });
        if self.keeps_force(model) {
            let active = softer.filter(|(point, _)| point.evaluation.is_active());
            active.map(|(point, memory)| freed_on_the_way(&model.law, point, memory)).sum()
        } else {
            let law = |point: &ContactPoint| model.law_at(point.site.feature);
            softer.map(|(point, memory)| freed_in_place(&law(point), point, memory)).sum()
        }
    }
}

/// What a contact sets free by getting softer where its bodies stay [J]: its energy goes with its stiffness,
/// whatever it then does. The work of its forces along the way is that of the softer spring (`solver::path`).
fn freed_in_place(law: &ContactLaw, point: &ContactPoint, memory: &PointMemory) -> f64 {
    let PointState { spring, hardening, radii, .. } = point.state;
    let left = point.stiffness_left / memory.stiffness_left;
    let weight = memory.pressure / memory.load;
    let normal = match point.state.asperity {
        None => spring / left * law.energy_at(memory.sprung() * left / spring),
        Some(now) => {
            let before = now.share / left;
            let indentation = now.law.indentation_for(memory.sprung() / before, memory.depth);
            before * now.law.press(indentation, memory.depth).energy
        }
    };
    let hardened = law.hardening_energy([hardening / left, memory.hardened], radii);
    (1.0 - left) * (weight * (normal + hardened) + memory.tangential_energy)
}

/// The same behind springs where bodies bend, so that a force, not a place, is kept while a contact gets softer: work of the trapezoidal rule less the energy gained,
/// `(1/k2 - 1/k1) f1.f2 / 2` of a spring whose stiffness goes from k1 to k2 and its force from f1 to f2, and that of the hardening beside it
/// ([`freed_by_hardening`](ContactLaw::freed_by_hardening)).
fn freed_on_the_way(law: &ContactLaw, point: &ContactPoint, memory: &PointMemory) -> f64 {
    let e = &point.evaluation;
    let gained = (1.0 - point.stiffness_left / memory.stiffness_left) / point.state.spring;
    let weight = 0.5 * (e.weight + memory.pressure / memory.load);
    let tangential = memory.traction.dot(&e.friction) / e.weight / law.tangential_ratio;
    let sprung = memory.sprung() * e.sprung();
    let softer = point.state.hardening;
    let harder = 1.0 / (1.0 / softer - gained);
    let before = [harder, memory.hardened];
    let hardening = law.freed_by_hardening(before, [softer, e.hardened], point.state.radii);
    weight * (0.5 * gained * (sprung + tangential) + hardening)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::trial::UNCHANGED;
    use crate::geometry::Polyhedron;
    use crate::grain::{Ancestry, SurfacePoint};
    use crate::material::{DamageLaw, DamageParameters, Elastic, Softening};
    use crate::mesh::grain_mesh;

    const LEAST: f64 = 5e-4;

    /// A bar of 20 x 10 x 10 mm, 1 MPa strong in tension and hardly softer behind its peak, and the middles of its ends.
    fn bar() -> (DamagedGrain, [SurfacePoint; 2]) {
        let mesh = grain_mesh(&Polyhedron::cuboid([0.02, 0.01, 0.01]).expect("a box"), 60).expect("a mesh");
        let elastic = Elastic::new(3e10, 0.2).expect("allowed");
        let parameters =
            DamageParameters { tension: Softening::Exponent(1.05), ..DamageParameters::default() };
        let law = DamageLaw::new(elastic, 1e6, 1e7, &parameters, 0.01).expect("a law");
        let laws = vec![law; mesh.cells.len()];
        let grain = DamagedGrain::new(mesh, laws, 2700.0, Ancestry::of_grain(0)).expect("a grain");
        let ends = [1.0, -1.0].map(|side| grain.condensed().locate(&Vec3::new(0.01 * side, 0.0, 0.0)));
        (grain, ends)
    }

    fn pull(ends: &[SurfacePoint; 2], force: f64) -> SurfaceLoads {
        ends.iter().map(|end| (end.clone(), Vec3::x() * (force * end.position.x.signum()))).collect()
    }

    /// Pulls harder and harder until the rock below an end has softened; with which force [N].
    fn softened(grain: &mut DamagedGrain, alone: &mut Alone, ends: &[SurfacePoint; 2]) -> f64 {
        let facet = ends[0].facet as usize;
        let mut force = 0.0;
        while alone.stiffness_left.get(facet).is_none_or(|left| *left > 0.95) {
            force += 1.0;
            assert!(force < 200.0, "too strong");
            for round in 0.. {
                let (change, _) = alone.settle(grain, &pull(ends, force), 0.2, LEAST).expect("solvable");
                assert!(change.newly_failed == 0 && round < 20, "{change:?} under {force} N");
                if alone.settled.is_some() {
                    break;
                }
            }
        }
        force
    }

    #[test]
    fn a_grain_settles_by_itself_and_rests_until_forces_change() {
        let (mut grain, ends) = bar();
        let mut alone = Alone::default();
        let force = softened(&mut grain, &mut alone, &ends);
        // Nothing is left to do for a grain that has settled.
        let left = grain.clone().propose_beyond(&pull(&ends, force), 0.2, LEAST).expect("solvable");
        assert!(left.applied <= 2.0 * LEAST && left.held_back <= 2.0 * LEAST, "{left:?}");
        let before = alone.settled.clone().expect("settled");
        for (factor, moves) in [(1.0 + 0.5 * UNCHANGED, false), (1.0 + 20.0 * UNCHANGED, true)] {
            let loads = pull(&ends, factor * force);
            alone.settle(&mut grain, &loads, 0.2, LEAST).expect("solvable");
            assert_eq!(alone.settled.as_ref().expect("settled") != &before, moves, "{factor}");
        }
    }

    /// Under pressure the cracks close and carry again (recovery 1), but the contact's spring stays as soft as it was.
    #[test]
    fn cracks_that_close_make_no_contact_firmer() {
        let (mut grain, ends) = bar();
        let mut alone = Alone::default();
        let force = softened(&mut grain, &mut alone, &ends);
        let facet = ends[0].facet;
        let least = alone.stiffness_left[facet as usize];
        for k in 1..=10 {
            alone
                .settle(&mut grain, &pull(&ends, -0.1 * f64::from(k) * force), 0.2, LEAST)
                .expect("solvable");
        }
        assert!(grain.stiffness_left(facet) > least + 0.02, "{} {least}", grain.stiffness_left(facet));
        assert!(alone.stiffness_left[facet as usize] <= least);
    }
}
