//! What the elasticity of bodies comes to that a solve leaves out, and how contacts go on where a body's fidelity changes.
//!
//! A body that rests is rigid: each of its contacts yields by its own force times one local compliance. Its
//! flexibility `W` is known all the same, so that under given forces its displacements, and from them its
//! strains, are exact. What a contact would yield besides, were the body condensed, is `W f` at its place
//! with the shell's compliance, less the local compliance: the omitted displacement. The same number, the
//! other way round, is what a condensed body would omit if it rested.

use std::collections::BTreeSet;

use rayon::prelude::*;

use crate::assembly::Dofs;
use crate::assembly::elastic::{for_each_cover_force_on, force_on_b};
use crate::assembly::place::{SurfaceField, SurfaceLoads, interpolate};
use crate::assembly::springs::Springs;
use crate::assembly::{ContactPoint, Contacts, PairWork};
use crate::contact::{ContactKey, Memory, PointMemory};
use crate::grain::{CondensedGrain, SurfacePoint};
use crate::model::{BodyKind, Committed, Model};
use crate::tensor::{Pose, Vec3};

/// Elastic fields of all bodies whose flexibility is known, resting or not, under the forces of a configuration.
#[derive(Debug, Clone, Default)]
pub struct Recovery {
    /// Forces on each body's surface [N], in its own frame; none on a body without a flexibility.
    pub loads: Vec<SurfaceLoads>,
    /// Displacement of its surface nodes under them [m].
    pub fields: Vec<SurfaceField>,
    /// Of each active contact in order: the place on each side.
    places: Vec<[Option<SurfacePoint>; 2]>,
    /// Displacement of `b`'s surface relative to `a`'s that is omitted where `a` rests, and where `b` does
    /// [m], in space; zero for a body that is not free to change.
    omitted: Vec<[Vec3; 2]>,
    /// What changes of fidelity have kept, by contact [m].
    kept: Vec<Vec3>,
}

/// How the force between two bodies would change, by what is omitted in all contacts.
#[derive(Debug, Clone, Copy)]
pub struct ForceChange {
    pub bodies: [usize; 2],
    /// [N]
    pub change: f64,
    /// [N]
    pub force: f64,
}

impl Recovery {
    /// What is omitted in each active contact of `contacts` as the bodies are [m], in space:
    /// [`Self::omitted`] where they rest, with what changes of fidelity have kept or made up for.
    pub fn present(&self, contacts: &Contacts, model: &Model) -> Vec<Vec3> {
        let resting: Vec<bool> = model.bodies.iter().map(|body| body.is_resting()).collect();
        self.omitted(contacts, &resting).iter().zip(&self.kept).map(|(now, kept)| now + kept).collect()
    }

    /// What is omitted in each active contact of `contacts` [m], in space, where the bodies rest that `rests`
    /// says.
    pub fn omitted(&self, contacts: &Contacts, rests: &[bool]) -> Vec<Vec3> {
        let of = |((pair, _), sides): ((&PairWork, &ContactPoint), &[Vec3; 2])| {
            let [a, b] = [pair.a(), pair.b()].map(|body| f64::from(u8::from(rests[body])));
            sides[0] * a + sides[1] * b
        };
        contacts.active().zip(&self.omitted).map(of).collect()
    }
}

fn flexibility(model: &Model, body: usize) -> Option<&CondensedGrain> {
    model.bodies[body].flexibility().map(|grain| &**grain)
}

/// Where a contact is on the surfaces of its bodies, as far as these have one.
fn places_of(
    model: &Model,
    poses: &[Pose],
    pair: &PairWork,
    point: &ContactPoint,
) -> [Option<SurfacePoint>; 2] {
    if let Some(node) = pair.node(point.site.feature) {
        return node.on.clone();
    }
    let look = |body: usize, x: &Vec3, outward: &Vec3| {
        let back = poses[body].rotation.inverse();
        let surface = model.bodies[body].meshed_surface()?;
        Some(surface.locate_along(&(back * (x - poses[body].position)), &(back * outward)))
    };
    let e = &point.evaluation;
    [look(pair.a(), &e.point, &e.normal), look(pair.b(), &e.point, &-e.normal)]
}

/// Elastic displacement of `b`'s surface relative to `a`'s at a contact in the committed state [m], in space.
fn committed_gap(
    model: &Model,
    committed: &Committed,
    pair: &PairWork,
    places: &[Option<SurfacePoint>; 2],
) -> Vec3 {
    let displaced = |body: usize, place: &Option<SurfacePoint>| match (place, committed.fields.get(body)) {
        (Some(place), Some(field)) if model.bodies[body].is_elastic() => {
            committed.poses[body].rotation * interpolate(place, field)
        }
        (Some(_) | None, _) => Vec3::zeros(),
    };
    displaced(pair.b(), &places[1]) - displaced(pair.a(), &places[0])
}

impl Contacts {
    /// The elastic fields under the forces of the configuration last evaluated, at `poses`, and `pressure` [Pa] on the cover.
    pub fn recover(&self, model: &Model, poses: &[Pose], pressure: f64) -> Recovery {
        let mut loads = vec![SurfaceLoads::new(); model.bodies.len()];
        let active: Vec<(&PairWork, &ContactPoint)> = self.active().collect();
        let places: Vec<[Option<SurfacePoint>; 2]> =
            active.par_iter().map(|(pair, point)| places_of(model, poses, pair, point)).collect();
        let mut put = |body: usize, place: SurfacePoint, force: Vec3| {
            loads[body].push((place, poses[body].rotation.inverse() * force));
        };
        for ((pair, point), [on_a, on_b]) in active.iter().zip(&places) {
            let force = point.evaluation.bending_force();
            on_a.iter().for_each(|place| put(pair.a(), place.clone(), -force));
            on_b.iter().for_each(|place| put(pair.b(), place.clone(), force));
        }
        let surface = |body: usize| Some(flexibility(model, body)?.surface());
        self.membrane.for_each_force_on(poses, surface, &mut put);
        for_each_cover_force_on(model, poses, pressure, surface, put);
        let field = |(body, loads): (usize, &SurfaceLoads)| {
            let mut field = SurfaceField::new();
            if let Some(grain) = flexibility(model, body) {
                grain.surface_field_into(&mut field, loads);
            }
            field
        };
        let fields: Vec<SurfaceField> = loads.par_iter().enumerate().map(field).collect();
        let omitted = active
            .iter()
            .zip(&places)
            .map(|((pair, point), places)| {
                let e = &point.evaluation;
                let share = pair.share_of(point);
                let own = e.normal * e.sprung() + e.friction / (e.weight * model.law.tangential_ratio);
                let side = |body: usize, place: &Option<SurfacePoint>, sign: f64| match place {
                    Some(place) if model.bodies[body].may_rest() => {
                        let displaced = poses[body].rotation * interpolate(place, &fields[body]);
                        displaced * sign - own * (model.spares(body, point.site.feature) / share)
                    }
                    Some(_) | None => Vec3::zeros(),
                };
                [side(pair.a(), &places[0], -1.0), side(pair.b(), &places[1], 1.0)]
            })
            .collect();
        let kept = active.iter().map(|(pair, point)| pair.carried.omitted(point.site.feature)).collect();
        Recovery { loads, fields, places, omitted, kept }
    }

    /// Forces on the unknowns that the `omitted` displacements of the active contacts would cause [N],
    /// nothing else moving. (A displacement of the surface acts as one of the whole body: what it changes of
    /// normals and weights is of second order.) Call [`Contacts::update_tangents`] first.
    pub fn forces_of_omitted(&self, dofs: &Dofs, omitted: &[Vec3]) -> Vec<f64> {
        let mut forces = vec![0.0; dofs.count()];
        let tangents = self.pairs.iter().flat_map(|pair| pair.tangents.iter().map(move |t| (pair, t)));
        for ((pair, tangent), moved) in tangents.zip(omitted) {
            let wrench: [f64; 12] =
                std::array::from_fn(|row| (0..3).map(|c| tangent[row][c] * moved[c]).sum());
            dofs.scatter(&mut forces, pair.a(), &wrench[..6]);
            dofs.scatter(&mut forces, pair.b(), &wrench[6..]);
        }
        forces
    }

    /// How the forces between bodies change by the `omitted` displacements and the motion `step` of the
    /// unknowns. Of two bodies the sum over their contact points: how these share it is of no consequence
    /// beyond the two.
    pub fn force_changes(&self, dofs: &Dofs, step: &[f64], omitted: &[Vec3]) -> Vec<ForceChange> {
        let mut omitted = omitted.iter();
        let pairs = self.pairs.iter().filter(|pair| !pair.tangents.is_empty());
        let changed = |pair: &PairWork| {
            let [a, b] = [pair.a(), pair.b()].map(|body| dofs.motion(step, 1.0, body));
            let (mut change, mut force) = (Vec3::zeros(), Vec3::zeros());
            for ((tangent, point), moved) in pair.tangents.iter().zip(pair.active()).zip(&mut omitted) {
                let shift = b.0 - a.0 + moved;
                let motion = [shift.x, shift.y, shift.z, b.1.x, b.1.y, b.1.z, a.1.x, a.1.y, a.1.z];
                let row = |row: usize| tangent[row].iter().zip(&motion).map(|(t, m)| t * m).sum::<f64>();
                change += Vec3::new(row(6), row(7), row(8));
                force += force_on_b(point);
            }
            ForceChange { bodies: [pair.a(), pair.b()], change: change.norm(), force: force.norm() }
        };
        pairs.map(changed).collect()
    }

    /// Elastic energy of the configuration last evaluated, which `recovery` is of: in the contacts and in condensed bodies [J].
    pub fn stored_energy(&self, model: &Model, recovery: &Recovery) -> f64 {
        let contacts = self.active().map(|(_, p)| p.evaluation.energy + p.evaluation.tangential_energy);
        let bodies = model.bodies.iter().zip(&recovery.loads).zip(&recovery.fields);
        let of_body = bodies.filter(|((body, _), _)| body.is_elastic()).map(|((_, loads), field)| {
            0.5 * loads.iter().map(|(place, force)| force.dot(&interpolate(place, field))).sum::<f64>()
        });
        contacts.sum::<f64>() + of_body.sum::<f64>()
    }

    /// Forces of the active contacts in the configuration last evaluated [N], on `b`, with their pair and feature.
    pub fn forces(&self) -> Vec<(crate::contact::ContactKey, Vec3)> {
        self.active().map(|(pair, point)| ((pair.key(), point.site.feature), force_on_b(point))).collect()
    }

    /// The memory with which the contacts go on with the same forces in `model`, where the fidelity of the `changed` bodies is new. The
    /// configuration last evaluated is the committed one, in the model as it was, and `recovery` is of it; `committed` has the new
    /// surface displacements already.
    pub fn carried_over(
        &self,
        model: &Model,
        committed: &Committed,
        changed: &[bool],
        recovery: &Recovery,
    ) -> Memory {
        let mut memory = committed.memory.clone();
        let of_contacts = recovery.places.iter().zip(&recovery.omitted).zip(&recovery.kept);
        for ((pair, point), ((places, omitted), before)) in self.active().zip(of_contacts) {
            let (a, b) = (pair.a(), pair.b());
            let Some(pair_memory) = memory.get_mut(&pair.key()).filter(|_| changed[a] || changed[b]) else {
                continue;
            };
            let Some(kept) = pair_memory.points.iter_mut().find(|kept| kept.feature == point.site.feature)
            else {
                continue;
            };
            let (e, state, feature) = (&point.evaluation, &point.state, point.site.feature);
            let (sound, before_change) =
                (Springs::between(model, a, b).at(feature), pair.springs.at(feature));
            // What softened rock yields more stays.
            kept.stiffness_left = 1.0 / (1.0 + sound / before_change * (1.0 / point.stiffness_left - 1.0));
            let spring = sound * kept.stiffness_left * pair.share_of(point);
            let elastic = committed_gap(model, committed, pair, places);
            let geometric = point.geometric_overlap();
            (kept.load, kept.hardened) = (e.load, e.hardened);
            kept.pressure = e.pressure;
            kept.traction = e.friction / e.weight;
            // The stretch of the contact's own spring, as `Contacts::memory` has it.
            kept.stretch = state.own_stretch(&model.law, e);
            kept.tangential_energy = e.tangential_energy;
            let overlap = match state.asperity {
                Some(_) => e.indentation,
                None => model.law_at(feature).overlap_for(e.sprung() / spring),
            };
            kept.initial_overlap = overlap - geometric + e.normal.dot(&elastic);
            let softer = state.spring / spring;
            kept.stretch *= softer;
            kept.tangential_energy *= softer;
            kept.scale = 1.0;
            kept.omitted = *before;
            for (body, omitted) in [a, b].into_iter().zip(omitted).filter(|(body, _)| changed[*body]) {
                // What was omitted stays, what is omitted from now on is made up for.
                kept.omitted += if model.bodies[body].is_elastic() { *omitted } else { -omitted };
            }
        }
        self.hold_open(&mut memory, model, committed, changed);
        for pair in self.pairs.iter().filter(|pair| changed[pair.a()] || changed[pair.b()]) {
            let Some(pair_memory) = memory.get_mut(&pair.key()) else { continue };
            pair_memory.mortars = pair.mortars_of(&pair_memory.points);
        }
        memory
    }

    /// Has contacts of the `changed` bodies that nothing was known of, that did not bear (`bore`) and that touch by elastic displacements in the
    /// configuration last evaluated, which is the committed one, just not do so; whether there were any.
    pub fn hold_new(
        &self,
        model: &Model,
        committed: &mut Committed,
        changed: &[bool],
        bore: &BTreeSet<ContactKey>,
    ) -> bool {
        let mut any = false;
        let deforms = |body: usize| model.bodies[body].is_elastic();
        let of_changed = |pair: &&PairWork| {
            let bodies = [pair.a(), pair.b()];
            bodies.iter().any(|body| changed[*body]) && bodies.into_iter().any(deforms)
        };
        for pair in self.pairs.iter().filter(of_changed) {
            let is_new = |point: &&ContactPoint| {
                let feature = point.site.feature;
                pair.carried.point(feature).is_none() && !bore.contains(&(pair.key(), feature))
            };
            for point in pair.active().filter(is_new) {
                let open = PointMemory::open(point.site.feature, point.opening());
                let kept = committed.memory.entry(pair.key()).or_default();
                kept.put(open);
                kept.mortars = pair.mortars_of(&kept.points);
                any = true;
            }
        }
        any
    }

    /// Contacts that are open, and that the new elastic displacements would close, stay as open as they are.
    fn hold_open(&self, memory: &mut Memory, model: &Model, committed: &Committed, changed: &[bool]) {
        for pair in self.pairs.iter().filter(|pair| changed[pair.a()] || changed[pair.b()]) {
            for point in pair.points.iter().filter(|point| !point.evaluation.is_active()) {
                let e = &point.evaluation;
                let places = places_of(model, &committed.poses, pair, point);
                let elastic = committed_gap(model, committed, pair, &places);
                let geometric = point.geometric_overlap();
                let initial_overlap = -e.gap - (geometric - e.normal.dot(&elastic));
                let opening = point.opening();
                if e.weight > 0.0 && opening >= 0.0 && opening < -initial_overlap {
                    memory
                        .entry(pair.key())
                        .or_default()
                        .put(PointMemory::open(point.site.feature, initial_overlap));
                }
            }
        }
    }
}

/// Whether a body may change its fidelity.
pub fn is_free_to_change(model: &Model, body: usize) -> bool {
    let body = &model.bodies[body];
    body.kind != BodyKind::Gone && body.flexibility().is_some() && body.may_rest()
}
