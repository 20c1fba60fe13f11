//! Which contacts of condensed bodies have their forces for unknowns, and what the bodies yield to these.

use std::time::Instant;

use rayon::prelude::*;

use crate::assembly::contact_forces::answer::{pair_of, place_of};
use crate::assembly::contact_forces::{ContactForce, ContactForces, Patch, STILL};
use crate::assembly::elastic::for_each_cover_force;
use crate::assembly::place::{OVERESTIMATE, SurfaceField, SurfaceLoads, interpolate};
use crate::assembly::timings::Kernel;
use crate::assembly::{ContactPoint, Contacts, PairWork};
use crate::grain::SurfacePoint;
use crate::model::{Flexibility, Loads, Model};
use crate::tensor::{Mat3, Pose, Vec3};

/// An open contact's force is an unknown where the bodies would yield by its gap under this share of the mean contact force.
const NEAR: f64 = 1.0;

/// Whether forces between two bodies can be unknowns: one deforms, and no asperities yield far more than they
/// do.
fn has_unknown_forces(model: &Model, pair: &PairWork) -> bool {
    if model.follows_by_steps() {
        return false;
    }
    let [a, b] = [&model.bodies[pair.a()], &model.bodies[pair.b()]];
    a.is_elastic() || b.is_elastic()
}

impl Contacts {
    /// Makes the contact forces of condensed bodies unknowns, those of the configuration last evaluated at
    /// the places found there. `true` where they are not those of before. Evaluate anew afterwards.
    pub fn gather(&mut self, model: &Model, loads: &Loads, poses: &[Pose]) -> bool {
        if self.unknown_forces.placed || !model.has_elastic() {
            return false;
        }
        let start = Instant::now();
        let mean = self.mean_force();
        let mut old = std::mem::take(&mut self.unknown_forces.unknowns).into_iter().peekable();
        let mut unknowns: Vec<ContactForce> = Vec::new();
        let mut fresh = false;
        for pair in self.pairs.iter().filter(|pair| has_unknown_forces(model, pair)) {
            let key = pair.key();
            let mut points: Vec<&ContactPoint> = pair.points.iter().collect();
            points.sort_by_key(|point| point.site.feature);
            for point in points {
                let (feature, e) = (point.site.feature, &point.evaluation);
                while old.next_if(|unknown| (unknown.key, unknown.feature) < (key, feature)).is_some() {
                    fresh = true;
                }
                let known = old.next_if(|unknown| (unknown.key, unknown.feature) == (key, feature));
                let Some(place) = pair.place(feature) else { continue };
                let multiplier = pair.multiplier(feature);
                let scale = multiplier.map_or(self.first_scale, |multiplier| multiplier.scale);
                let own = place.compliance / (scale * OVERESTIMATE);
                let near = e.weight > 0.0 && e.gap < NEAR * own * mean;
                let pressed = multiplier.is_some_and(|multiplier| multiplier.load > 0.0);
                if known.is_none() && !near && !pressed && !e.is_active() {
                    continue;
                }
                fresh |= known.is_none();
                let force = known.map_or_else(
                    || if e.is_active() { e.bending_force() } else { Vec3::zeros() },
                    |unknown| unknown.force,
                );
                let (others, by_pressure, before) =
                    (Vec3::zeros(), Vec3::zeros(), place.elastic - place.change);
                let (centre, compliance, tangent) = (force, own, STILL);
                unknowns.push(ContactForce {
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
        self.unknown_forces.unknowns = unknowns;
        self.unknown_forces.stiffness = model.typical_stiffness();
        self.place_patches(model, poses);
        self.load_patches(model, poses);
        for unknown in &self.unknown_forces.unknowns {
            if let Some(place) = place_of(&mut self.pairs, unknown) {
                place.compliance = unknown.compliance;
            }
        }
        self.unknown_forces.placed = true;
        if fresh {
            self.unknown_forces.generation += 1;
        }
        self.yield_to_forces(loads.pressure);
        self.timings.book(Kernel::Flexibility, start);
        fresh
    }

    fn place_patches(&mut self, model: &Model, poses: &[Pose]) {
        let mut places: Vec<Vec<(usize, f64, SurfacePoint)>> = vec![Vec::new(); model.bodies.len()];
        for (k, unknown) in self.unknown_forces.unknowns.iter().enumerate() {
            let found =
                pair_of(&self.pairs, unknown.key).and_then(|pair| self.pairs[pair].place(unknown.feature));
            let Some(place) = found else { continue };
            for (body, on, sign) in
                [(unknown.key.0 as usize, &place.on_a, -1.0), (unknown.key.1 as usize, &place.on_b, 1.0)]
            {
                if let (Some(on), true) = (on, self.grains[body].is_some()) {
                    places[body].push((k, sign, on.clone()));
                }
            }
        }
        let grains = &self.grains;
        let patch = |(body, places): (usize, Vec<(usize, f64, SurfacePoint)>)| {
            let grain = grains[body].as_ref().filter(|_| !places.is_empty())?.grain();
            let turn = poses[body].rotation.to_rotation_matrix().into_inner();
            let own = grain.flexibilities(&places.iter().map(|(.., place)| place).collect::<Vec<_>>());
            let n = places.len();
            let mut flexibility = vec![Mat3::zeros(); n * n];
            for i in 0..n {
                for j in 0..=i {
                    let block = turn * own[i * n + j] * turn.transpose();
                    flexibility[i * n + j] = block;
                    flexibility[j * n + i] = block.transpose();
                }
            }
            Some(Patch { body, places, flexibility })
        };
        self.unknown_forces.patches = places.into_par_iter().enumerate().filter_map(patch).collect();
    }

    /// Displacements where each unknown acts by what presses on the bodies besides.
    fn load_patches(&mut self, model: &Model, poses: &[Pose]) {
        let mut others = vec![SurfaceLoads::new(); model.bodies.len()];
        let mut covers = vec![SurfaceLoads::new(); model.bodies.len()];
        let surface = |body: usize| model.bodies[body].surface();
        self.membrane.for_each_force_on(poses, surface, |body, place, force| {
            others[body].push((place, poses[body].rotation.inverse() * force));
        });
        for pair in self.pairs.iter().filter(|pair| !has_unknown_forces(model, pair)) {
            for point in pair.active() {
                let Some(place) = pair.place(point.site.feature) else { continue };
                let on_b = point.evaluation.bending_force();
                for (body, on, force) in [(pair.a(), &place.on_a, -on_b), (pair.b(), &place.on_b, on_b)] {
                    let on = on.clone().filter(|_| self.grains[body].is_some());
                    others[body].extend(on.map(|on| (on, poses[body].rotation.inverse() * force)));
                }
            }
        }
        for_each_cover_force(model, poses, 1.0, |body, place, force| {
            covers[body].push((place, poses[body].rotation.inverse() * force));
        });
        let (grains, unknown_forces, surplus) = (&self.grains, &self.unknown_forces, &self.surplus);
        let of_patch = |patch: &Patch| {
            let moved = |loads: &SurfaceLoads| -> Vec<Vec3> {
                let mut field = SurfaceField::new();
                if let Some(bends) = grains[patch.body].as_ref().filter(|_| !loads.is_empty()) {
                    bends.grain().surface_field_into(&mut field, loads);
                }
                let turn = &poses[patch.body].rotation;
                patch
                    .places
                    .iter()
                    .map(|(_, sign, place)| turn * interpolate(place, &field) * *sign)
                    .collect()
            };
            let mut by_others = moved(&others[patch.body]);
            if let Some(full) = grains[patch.body].as_ref().and_then(Flexibility::full) {
                let turn = &poses[patch.body].rotation;
                let felt = full.condensed().felt(&surplus[patch.body]);
                for ((_, sign, place), u) in patch.places.iter().zip(&mut by_others) {
                    *u += turn * interpolate(place, &felt) * *sign;
                }
            }
            [by_others, moved(&covers[patch.body])]
        };
        let all: Vec<[Vec<Vec3>; 2]> = unknown_forces.patches.par_iter().map(of_patch).collect();
        let ContactForces { unknowns, patches, .. } = &mut self.unknown_forces;
        for (patch, [others, covers]) in patches.iter().zip(&all) {
            for (((unknown, ..), other), cover) in patch.places.iter().zip(others).zip(covers) {
                unknowns[*unknown].others += other;
                unknowns[*unknown].by_pressure += cover;
            }
        }
    }
}
