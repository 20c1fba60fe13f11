//! The grains' own flexibility in the contacts' gaps.
//!
//! Where a body is a condensed grain, the gap of a contact holds the elastic displacement of its surface,
//! `W f` with `W` the grain's exact flexibility and `f` all forces on it. Where the force of a contact is an
//! unknown of the solve (`assembly::contact_forces`: all that carry or are about to), the displacement is
//! that of these forces. Of any other contact, one that closes within a solve or whose other body is full, a
//! solve sees it fixed at the forces of the last augmentation, and in its place a compliance `w` of the
//! contact's own, through a softer spring (the penalty) and an offset:
//! `f = (overlap(q) - n.W f_old + w f_old) / (c + w)`, `c` being the contact's own compliance. At rest
//! `f = f_old` and only `c f = overlap - n.W f` is left: the answer does not depend on `w`, the pace does.
//! This is the augmented Lagrangian with `c = 0`, multiplier `f_old` and penalty `1/w`. Tangentially alike.
//! All contacts of a body load all its surface.
//!
//! Contacts of asperities (`contact::asperity`) yield far more than their bodies do. There no force is an unknown: bodies are displaced by the forces of
//! the last step (`assembly::following`), and in a solve a contact yields by about what its bodies did under these, which it gives back.

use std::time::Instant;

use rayon::prelude::*;

use crate::assembly::following::Followed;
use crate::assembly::place::{ContactPlace, Multiplier, SurfaceField, SurfaceLoads, interpolate};
use crate::assembly::timings::Kernel;
use crate::assembly::{ContactPoint, Contacts, PairWork};
use crate::grain::{Surface, SurfacePoint};
use crate::model::{Body, Committed, Flexibility, Loads, Model};
use crate::tensor::{Pose, Vec3};

/// A force on a brittle body is spread over the facets within this share of the body's size, as wide as the patch whose compliance the contact
/// has: a force on the tip of a coarse cell would crush it whatever the rock.
const PATCH: f64 = 0.1;

/// A `force` on a brittle body over the facets around its `place`.
pub fn spread_over(
    surface: &Surface,
    body: &Body,
    place: &SurfacePoint,
    force: &Vec3,
) -> impl Iterator<Item = (SurfacePoint, Vec3)> {
    let force = *force;
    let shares = surface.spread(place, PATCH * 2.0 * body.rotation_scale);
    shares.into_iter().map(move |(place, share)| (place, force * share))
}

/// What taking over the forces of a configuration came to.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Relaxed {
    /// The largest change this makes to a gap or a stretch [m]: zero where forces and elastic
    /// displacements agree.
    pub mismatch: f64,
    /// The largest force out of balance on a node that is eliminated with finite strains [N].
    pub left: f64,
    /// Elastic energy of all elastic bodies under these forces [J].
    pub energy: f64,
}

/// Calls `visit(body, place, force)` for each node of a cover that is glued to bodies that deform or break, with its
/// share of `pressure` [N], in space. Under a membrane the cover's nodes are the membrane's: none.
pub(super) fn for_each_cover_force(
    model: &Model,
    poses: &[Pose],
    pressure: f64,
    visit: impl FnMut(usize, SurfacePoint, Vec3),
) {
    if model.has_elastic() || model.can_break() {
        let surface = |body: usize| model.bodies[body].stressed_surface();
        for_each_cover_force_on(model, poses, pressure, surface, visit);
    }
}

/// As [`for_each_cover_force`], for the bodies that `surface` gives one for.
pub(super) fn for_each_cover_force_on<'a>(
    model: &'a Model,
    poses: &[Pose],
    pressure: f64,
    surface: impl Fn(usize) -> Option<&'a Surface>,
    mut visit: impl FnMut(usize, SurfacePoint, Vec3),
) {
    if model.membrane.is_some() {
        return;
    }
    let Some(cover) = &model.cover else { return };
    let mut forces = vec![Vec3::zeros(); cover.nodes().len()];
    cover.node_forces_into(&mut forces, poses, pressure);
    for (node, force) in forces.iter().enumerate() {
        for hold in cover.holds_of(node) {
            if let Some(surface) = surface(hold.body) {
                visit(hold.body, surface.locate(&hold.point), hold.axes.of(force));
            }
        }
    }
}

impl Contacts {
    /// Forces on the surfaces of all bodies that deform or break in the configuration last evaluated [N], the
    /// cover's included.
    pub(super) fn surface_loads(&self, model: &Model, loads: &Loads, poses: &[Pose]) -> Vec<SurfaceLoads> {
        self.loads_of(model, loads, poses, false)
    }

    /// The same as they stress the bodies: on brittle ones over patches.
    fn stressing_loads(&self, model: &Model, loads: &Loads, poses: &[Pose]) -> Vec<SurfaceLoads> {
        self.loads_of(model, loads, poses, true)
    }

    fn loads_of(&self, model: &Model, loads: &Loads, poses: &[Pose], spread: bool) -> Vec<SurfaceLoads> {
        let mut all = vec![SurfaceLoads::new(); model.bodies.len()];
        let mut put = |body: usize, place: Option<SurfacePoint>, force: Vec3| {
            let Some(place) = place else { return };
            let force = poses[body].rotation.inverse() * force;
            let owner = &model.bodies[body];
            match owner.stressed_surface().filter(|_| spread && owner.spreads_forces()) {
                Some(surface) => all[body].extend(spread_over(surface, owner, &place, &force)),
                None => all[body].push((place, force)),
            }
        };
        for (pair, point) in self.active() {
            let Some(place) = pair.place(point.site.feature) else { continue };
            let e = &point.evaluation;
            let on_b = if spread { force_on_b(point) } else { e.bending_force() };
            for (body, on, force) in [(pair.a(), &place.on_a, -on_b), (pair.b(), &place.on_b, on_b)] {
                put(body, on.clone(), force);
            }
        }
        let surface = |body: usize| model.bodies[body].stressed_surface();
        self.membrane.for_each_force_on(poses, surface, |body, place, force| put(body, Some(place), force));
        // A cover's forces are many and small, spread as they are.
        for_each_cover_force(model, poses, loads.pressure, |body, place, force| {
            all[body].push((place, poses[body].rotation.inverse() * force));
        });
        all
    }

    /// Notes the forces of the configuration last evaluated, for damage to follow, where nothing deforms.
    pub fn note_loads(&mut self, model: &Model, loads: &Loads, poses: &[Pose]) {
        self.stressing_loads = self.stressing_loads(model, loads, poses);
        if model.has_elastic() {
            self.surface_loads = self.surface_loads(model, loads, poses);
        }
    }

    /// Takes the forces of the configuration last evaluated as those of a new augmentation. Evaluate
    /// anew afterwards.
    pub fn relax(&mut self, model: &Model, loads: &Loads, poses: &[Pose], tolerance: f64) -> Relaxed {
        if !model.has_elastic() {
            return Relaxed::default();
        }
        let start = Instant::now();
        let were = if model.follows_by_steps() { self.fields.clone() } else { Vec::new() };
        let surface_loads = self.surface_loads(model, loads, poses);
        let displaced =
            self.fields.par_iter_mut().zip(&mut self.surplus).zip(&self.grains).zip(&surface_loads);
        let left = displaced.map(|(((field, surplus), bends), loads)| {
            bends.as_ref().map_or(0.0, |bends| displace(bends, field, surplus, loads))
        });
        let left: Vec<f64> = left.collect();
        self.update_reach();
        let energy = self.surface_energy(&surface_loads);
        self.surface_loads = surface_loads;
        if model.can_break() {
            self.stressing_loads = self.stressing_loads(model, loads, poses);
        }
        self.timings.book(Kernel::Flexibility, start);
        let augmentation = Augmentation {
            fields: &self.fields,
            poses,
            ratio: model.law.tangential_ratio,
            first_scale: self.first_scale,
            tolerance,
        };
        let gaps: Vec<f64> = self.pairs.par_iter_mut().map(|pair| augmentation.take_over(pair)).collect();
        if !were.is_empty() {
            self.followed.resize_with(were.len(), Followed::default);
            let bodies = self.fields.par_iter_mut().zip(&were).zip(&mut self.followed);
            bodies.for_each(|((field, was), followed)| followed.follow(field, was));
            self.update_reach();
        }
        self.unknown_forces.lift();
        let largest = |values: Vec<f64>| values.into_iter().fold(0.0, f64::max);
        Relaxed { mismatch: largest(gaps), left: largest(left), energy }
    }

    /// By how much the elastic displacements gained since the last accepted increment change the
    /// volume under the cover [m^3], which moves with the grains' frames.
    pub fn elastic_volume(&self, model: &Model, committed: &Committed, poses: &[Pose]) -> f64 {
        let mut volume = 0.0;
        for_each_cover_force(model, poses, 1.0, |body, place, force| {
            let before = committed.fields.get(body).map_or(Vec3::zeros(), |f| interpolate(&place, f));
            let moved = interpolate(&place, &self.fields[body]) - before;
            volume -= force.dot(&(poses[body].rotation * moved));
        });
        volume
    }

    /// Work [J] of the contacts evaluated last on bodies that are displaced by `change` [m], of those pairs that `counts` holds for, by number in the list.
    pub fn bending_work(
        &self,
        poses: &[Pose],
        change: &[SurfaceField],
        counts: impl Fn(usize) -> bool,
    ) -> f64 {
        let moved = |body: usize, on: &Option<SurfacePoint>| {
            on.as_ref().map_or(Vec3::zeros(), |on| poses[body].rotation * interpolate(on, &change[body]))
        };
        let mut work = 0.0;
        for (_, pair) in self.pairs.iter().enumerate().filter(|(number, _)| counts(*number)) {
            for (point, place) in pair.active().filter_map(|p| Some((p, pair.place(p.site.feature)?))) {
                let apart = moved(pair.b(), &place.on_b) - moved(pair.a(), &place.on_a);
                work += point.evaluation.bending_force().dot(&apart);
            }
        }
        work
    }

    /// The same of the `pressure` [Pa] of a cover, or of the membrane.
    pub fn bending_work_of_others(
        &self,
        model: &Model,
        poses: &[Pose],
        pressure: f64,
        change: &[SurfaceField],
    ) -> f64 {
        let mut work = 0.0;
        let mut add = |body: usize, place: SurfacePoint, force: Vec3| {
            work += force.dot(&(poses[body].rotation * interpolate(&place, &change[body])));
        };
        let surface = |body: usize| model.bodies[body].stressed_surface();
        self.membrane.for_each_force_on(poses, surface, &mut add);
        for_each_cover_force(model, poses, pressure, &mut add);
        work
    }

    /// Elastic energy [J] of all elastic bodies as they are displaced, under the forces of the configuration last evaluated. Out of
    /// balance the two do not belong together: half their work stands for the energy of condensed bodies.
    pub fn elastic_energy(&self, model: &Model, loads: &Loads, poses: &[Pose]) -> f64 {
        if !model.has_elastic() {
            return 0.0;
        }
        self.surface_energy(&self.surface_loads(model, loads, poses))
    }

    /// Elastic energy [J] of all elastic bodies, the condensed ones displaced by `surface_loads` to what `fields`
    /// holds.
    fn surface_energy(&self, surface_loads: &[SurfaceLoads]) -> f64 {
        let work =
            |(place, force): &(SurfacePoint, Vec3), field: &[Vec3]| force.dot(&interpolate(place, field));
        surface_loads
            .iter()
            .zip(&self.fields)
            .zip(&self.grains)
            .map(|((loads, field), bends)| match bends.as_ref().and_then(Flexibility::full) {
                Some(grain) => grain.energy(grain.nodal(field)),
                None => 0.5 * loads.iter().map(|load| work(load, field)).sum::<f64>(),
            })
            .sum()
    }
}

/// Displaces a body by these `loads`; the largest force out of balance on a node [N].
pub(super) fn displace(
    bends: &Flexibility,
    field: &mut SurfaceField,
    surplus: &mut SurfaceField,
    loads: &SurfaceLoads,
) -> f64 {
    match bends {
        Flexibility::Full(full) => full.settle(field, surplus, loads),
        Flexibility::Condensed(grain) => {
            grain.surface_field_into(field, loads);
            0.0
        }
    }
}

/// What contacts take over of a configuration as a new augmentation.
struct Augmentation<'a> {
    fields: &'a [SurfaceField],
    poses: &'a [Pose],
    /// Tangential over normal stiffness.
    ratio: f64,
    /// Of compliances over the first guess, where a contact is new.
    first_scale: f64,
    /// What gaps may be off by [m].
    tolerance: f64,
}

impl Augmentation<'_> {
    /// Takes over the forces of a pair as its multipliers, and forgets its places; the largest change of a gap or a stretch [m].
    fn take_over(&self, pair: &mut PairWork) -> f64 {
        let mut multipliers = Vec::with_capacity(pair.multipliers.len());
        let mut largest: f64 = 0.0;
        for point in &pair.points {
            let old = pair.multiplier(point.site.feature).copied();
            let Some(place) = pair.place(point.site.feature) else { continue };
            let moved = self.displacement([pair.a(), pair.b()], place) - place.elastic;
            let (multiplier, off) = self.follow(point, place, &moved, old);
            multipliers.extend(multiplier);
            largest = largest.max(off);
        }
        pair.multipliers = multipliers;
        pair.forget_places();
        largest
    }

    /// Elastic displacement of the surface of `b` relative to that of `a` [m], in space.
    fn displacement(&self, [a, b]: [usize; 2], place: &ContactPlace) -> Vec3 {
        let at = |body: usize, on: &Option<SurfacePoint>| {
            let turned = |p: &SurfacePoint| self.poses[body].rotation * interpolate(p, &self.fields[body]);
            on.as_ref().map_or(Vec3::zeros(), turned)
        };
        at(b, &place.on_b) - at(a, &place.on_a)
    }

    /// What a contact whose surfaces have `moved` [m] keeps of its force, `old` being that of the augmentation before, and by how much its gap or its
    /// stretch is off [m].
    fn follow(
        &self,
        point: &ContactPoint,
        place: &ContactPlace,
        moved: &Vec3,
        old: Option<Multiplier>,
    ) -> (Option<Multiplier>, f64) {
        let e = &point.evaluation;
        let along = moved.dot(&e.normal);
        if !e.is_active() && old.is_none_or(|multiplier| multiplier.load == 0.0) {
            // Open now, and closed by what has moved since. Edges that end here carry nothing at any gap.
            let off = if e.weight > 0.0 { (-(point.opening() + along)).max(0.0) } else { 0.0 };
            return (old, off);
        }
        let traction = if e.is_active() { e.friction / e.weight } else { Vec3::zeros() };
        let before = old.map_or((0.0, Vec3::zeros()), |h| (h.load, h.traction));
        // What stands in for the flexibility gives more by this than it did.
        let gives = match place.returned {
            Some(returned) => e.bending_force() * place.compliance - returned,
            None => {
                let sliding = (traction - before.1) * (place.compliance / self.ratio);
                e.normal * (place.compliance * (e.sprung() - before.0)) + sliding
            }
        };
        let across = gives.dot(&e.normal);
        let left = along - across;
        let slid = moved - e.normal * along - (gives - e.normal * across);
        // A slipping contact's stretch follows its normal force, whatever it does.
        let slid = if e.slip() == 0.0 { slid } else { Vec3::zeros() };
        let off = left.abs().max(slid.norm());
        let adapts = place.returned.is_none() && place.compliance > 0.0;
        // An asperity's stretch is remembered where displacements alone are known: there is nothing to make up for.
        let slid = if point.state.asperity.is_none() { slid } else { Vec3::zeros() };
        if e.is_active() {
            let adapted = |multiplier: &Multiplier| {
                if adapts { multiplier.adapted(left, &slid, self.tolerance) } else { multiplier.scale }
            };
            let scale = old.as_ref().map_or(self.first_scale, adapted);
            let (feature, weight) = (point.site.feature, e.weight);
            return (
                Some(Multiplier { feature, weight, load: e.sprung(), traction, scale, left, slid }),
                off,
            );
        }
        // Its own push was too much for it. Without this a patch of contacts that close at once opens at once, each of
        // them forgets that it swings, and all close again just as before.
        let swung = |old: Multiplier| {
            let scale = if adapts { 2.0 * old.scale } else { old.scale };
            Multiplier { load: 0.0, traction, scale, left: 0.0, slid, ..old }
        };
        (old.map(swung), off)
    }
}

pub(super) fn force_on_b(point: &ContactPoint) -> Vec3 {
    point.evaluation.normal * point.evaluation.pressure + point.evaluation.friction
}
