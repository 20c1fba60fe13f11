//! Which contacts of condensed bodies have their forces for unknowns, and what the bodies yield to these.

use std::time::Instant;

use rayon::prelude::*;

use crate::assembly::elastic::for_each_cover_force;
use crate::assembly::network::answer::{pair_of, spot_of};
use crate::assembly::network::{Knot, Network, Patch, STILL};
use crate::assembly::spot::{OVERESTIMATE, SurfaceField, SurfaceLoads, interpolate};
use crate::assembly::timings::Kernel;
use crate::assembly::{ContactPoint, Contacts, PairWork};
use crate::grain::SurfacePoint;
use crate::model::{Loads, Model};
use crate::tensor::{Mat3, Pose, Vec3};

/// An open contact's force is an unknown where the bodies would yield by its gap under this share of the mean contact force.
const NEAR: f64 = 1.0;

/// Whether contacts of two bodies can be knots: one deforms, and no asperities yield far more than they do.
fn is_networked(model: &Model, pair: &PairWork) -> bool {
    if model.follows_by_steps() {
        return false;
    }
    let [a, b] = [&model.bodies[pair.a()], &model.bodies[pair.b()]];
    a.is_elastic() || b.is_elastic()
}

impl Contacts {
    /// Takes the contacts of condensed bodies in the configuration last evaluated for knots, at the places found there. `true` where
    /// they are not those of before. Evaluate anew afterwards.
    pub fn gather(&mut self, model: &Model, loads: &Loads, poses: &[Pose]) -> bool {
        if self.network.placed || !model.has_elastic() {
            return false;
        }
        let start = Instant::now();
        let mean = self.mean_force();
        let mut old = std::mem::take(&mut self.network.knots).into_iter().peekable();
        let mut knots: Vec<Knot> = Vec::new();
        let mut fresh = false;
        for pair in self.pairs.iter().filter(|pair| is_networked(model, pair)) {
            let key = pair.key();
            let mut points: Vec<&ContactPoint> = pair.points.iter().collect();
            points.sort_by_key(|point| point.site.feature);
            for point in points {
                let (feature, e) = (point.site.feature, &point.evaluation);
                while old.next_if(|knot| (knot.key, knot.feature) < (key, feature)).is_some() {
                    fresh = true;
                }
                let known = old.next_if(|knot| (knot.key, knot.feature) == (key, feature));
                let Some(spot) = pair.spot(feature) else { continue };
                let held = pair.held(feature);
                let scale = held.map_or(self.first_scale, |held| held.scale);
                let own = spot.compliance / (scale * OVERESTIMATE);
                let near = e.weight > 0.0 && e.gap < NEAR * own * mean;
                let pressed = held.is_some_and(|held| held.load > 0.0);
                if known.is_none() && !near && !pressed && !e.is_active() {
                    continue;
                }
                fresh |= known.is_none();
                let force = known.map_or_else(
                    || if e.is_active() { e.bending_force() } else { Vec3::zeros() },
                    |knot| knot.force,
                );
                let (others, by_pressure, before) =
                    (Vec3::zeros(), Vec3::zeros(), spot.elastic - spot.change);
                let (centre, compliance, tangent) = (force, own, STILL);
                knots.push(Knot {
                    key,
                    feature,
                    force,
                    centre,
                    others,
                    by_pressure,
                    before,
                    compliance,
                    tangent,
                });
            }
        }
        fresh |= old.next().is_some();
        self.network.knots = knots;
        self.network.stiffness = model.typical_stiffness();
        self.place_patches(model, poses);
        self.load_patches(model, poses);
        for knot in &self.network.knots {
            if let Some(spot) = spot_of(&mut self.pairs, knot) {
                spot.compliance = knot.compliance;
            }
        }
        self.network.placed = true;
        if fresh {
            self.network.generation += 1;
        }
        self.yield_to_forces(loads.pressure);
        self.timings.book(Kernel::Flexibility, start);
        fresh
    }

    fn place_patches(&mut self, model: &Model, poses: &[Pose]) {
        let mut spots: Vec<Vec<(usize, f64, SurfacePoint)>> = vec![Vec::new(); model.bodies.len()];
        for (k, knot) in self.network.knots.iter().enumerate() {
            let place = pair_of(&self.pairs, knot.key).and_then(|pair| self.pairs[pair].spot(knot.feature));
            let Some(spot) = place else { continue };
            for (body, place, sign) in
                [(knot.key.0 as usize, spot.on_a, -1.0), (knot.key.1 as usize, spot.on_b, 1.0)]
            {
                if let (Some(place), true) = (place, self.grains[body].is_some()) {
                    spots[body].push((k, sign, place));
                }
            }
        }
        let grains = &self.grains;
        let patch = |(body, spots): (usize, Vec<(usize, f64, SurfacePoint)>)| {
            let grain = grains[body].as_ref().filter(|_| !spots.is_empty())?;
            let turn = poses[body].rotation.to_rotation_matrix().into_inner();
            let n = spots.len();
            let mut flexibility = vec![Mat3::zeros(); n * n];
            for i in 0..n {
                for j in 0..=i {
                    let block = turn * grain.flexibility(&spots[i].2, &spots[j].2) * turn.transpose();
                    flexibility[i * n + j] = block;
                    flexibility[j * n + i] = block.transpose();
                }
            }
            Some(Patch { body, spots, flexibility })
        };
        self.network.patches = spots.into_par_iter().enumerate().filter_map(patch).collect();
    }

    /// Displacements of the knots by what presses on the bodies besides.
    fn load_patches(&mut self, model: &Model, poses: &[Pose]) {
        let mut others = vec![SurfaceLoads::new(); model.bodies.len()];
        let mut covers = vec![SurfaceLoads::new(); model.bodies.len()];
        for list in &self.membrane.bodies {
            let (pose, body) = (&poses[list.body], &model.bodies[list.body]);
            let Some(surface) = body.surface() else { continue };
            for point in &list.points {
                let force = pose.rotation.inverse() * Vec3::from_column_slice(&point.force.on_body[..3]);
                others[list.body].push((surface.locate(&pose.to_body(&point.force.point)), force));
            }
        }
        for pair in self.pairs.iter().filter(|pair| !is_networked(model, pair)) {
            for point in pair.active() {
                let Some(spot) = pair.spot(point.site.feature) else { continue };
                let on_b = point.evaluation.bending_force();
                for (body, place, force) in [(pair.a(), spot.on_a, -on_b), (pair.b(), spot.on_b, on_b)] {
                    let place = place.filter(|_| self.grains[body].is_some());
                    others[body].extend(place.map(|place| (place, poses[body].rotation.inverse() * force)));
                }
            }
        }
        for_each_cover_force(model, poses, 1.0, |body, place, force| {
            covers[body].push((place, poses[body].rotation.inverse() * force));
        });
        let (grains, network, surplus) = (&self.grains, &self.network, &self.surplus);
        let of_patch = |patch: &Patch| {
            let moved = |loads: &SurfaceLoads| -> Vec<Vec3> {
                let mut field = SurfaceField::new();
                if let Some(grain) = grains[patch.body].as_ref().filter(|_| !loads.is_empty()) {
                    grain.surface_field_into(&mut field, loads);
                }
                let turn = &poses[patch.body].rotation;
                patch.spots.iter().map(|(_, sign, place)| turn * interpolate(place, &field) * *sign).collect()
            };
            let mut by_others = moved(&others[patch.body]);
            if let Some(full) = model.bodies[patch.body].full() {
                let turn = &poses[patch.body].rotation;
                let felt = full.condensed().felt(&surplus[patch.body]);
                for ((_, sign, place), u) in patch.spots.iter().zip(&mut by_others) {
                    *u += turn * interpolate(place, &felt) * *sign;
                }
            }
            [by_others, moved(&covers[patch.body])]
        };
        let all: Vec<[Vec<Vec3>; 2]> = network.patches.par_iter().map(of_patch).collect();
        let Network { knots, patches, .. } = &mut self.network;
        for (patch, [others, covers]) in patches.iter().zip(&all) {
            for (((knot, ..), other), cover) in patch.spots.iter().zip(others).zip(covers) {
                knots[*knot].others += other;
                knots[*knot].by_pressure += cover;
            }
        }
    }
}
