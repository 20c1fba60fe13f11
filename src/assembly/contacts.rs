//! All contacts of the model in one configuration, with buffers that are reused.

use crate::assembly::contact_forces::ContactForces;
use crate::assembly::following::Followed;
use crate::assembly::membrane::MembraneContacts;
use crate::assembly::pair::{Brought, PairWork, View};
use crate::assembly::place::{SurfaceField, SurfaceLoads, reach};
use crate::assembly::point::ContactPoint;
use crate::assembly::timings::{Kernel, Timings};
use crate::assembly::too_close::TooClose;
use crate::assembly::trial::Trial;
use crate::assembly::wall::touch_wall_into;
use crate::contact::Crushed;
use crate::contact::force::{Kinematics, Situation, Tangent};
use crate::contact::law::CORE_FLOOR;
use crate::contact::memory::PairKey;
use crate::contact::search::Neighbours;
use crate::model::wall::WallContact;
use crate::model::{BodyKind, Committed, Flexibility, Model};
use crate::tensor::{Pose, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::time::Instant;

/// Margin of the broad phase and of a pair's list of features, over the smallest rounding radius.
const BROAD_MARGIN: f64 = 4.0;
const SKIN: f64 = 0.6;
/// Least margin for elastic displacements, over the smallest rounding radius.
const ELASTIC_MARGIN: f64 = 0.1;

fn in_solves() -> bool {
    true
}

/// How far beyond its radii a pair's features are listed for the sake of elastic displacements
/// [m]: zero for two rigid bodies.
fn margin(model: &Model, (a, b): PairKey, needed: f64) -> f64 {
    let elastic = [a, b].iter().any(|&body| model.bodies[body as usize].is_elastic());
    if elastic || needed > 0.0 { (2.0 * needed).max(ELASTIC_MARGIN * model.smallest_rounding()) } else { 0.0 }
}

/// All pairs within reach. What is stored with a restart point is the search: which features are listed
/// decides how far a Newton step may go, so a continued run needs the lists of the run it continues.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Contacts {
    pub pairs: Vec<PairWork>,
    pub(super) neighbours: Neighbours,
    #[serde(skip)]
    pub(super) kinematics: Vec<Kinematics>,
    /// Core vertices of every body in space [m].
    #[serde(skip)]
    corners: Vec<Vec<Vec3>>,
    /// Surface displacement of every body in its own frame, from the forces of the last augmentation; of a full body its field.
    #[serde(skip)]
    pub fields: Vec<SurfaceField>,
    /// The largest displacement in each of `fields` [m].
    #[serde(skip)]
    reach: Vec<f64>,
    /// The flexibility of every body that bends in the present increment: with trial damage, where a body can break.
    #[serde(skip)]
    pub grains: Vec<Option<Flexibility>>,
    /// What bodies that follow the forces by steps were displaced by last, and the share of it that they took.
    #[serde(skip)]
    pub(super) followed: Vec<Followed>,
    /// Forces on the surfaces of condensed bodies that `fields` follows from.
    #[serde(skip)]
    pub surface_loads: Vec<SurfaceLoads>,
    /// Whether contacts of asperities yield in a solve by what their bodies do.
    #[serde(skip, default = "in_solves")]
    yields: bool,
    /// The same as they stress the bodies that can break.
    #[serde(skip)]
    pub stressing_loads: Vec<SurfaceLoads>,
    /// Trial damage of the present increment.
    #[serde(skip)]
    pub trial: Trial,
    /// A new contact's compliance in a solve over the first guess; only the pace depends on it.
    pub first_scale: f64,
    /// Displacement that finite strains cause besides that of the loads, of full bodies ([`crate::grain::FullGrain::surplus`]).
    #[serde(skip)]
    pub surplus: Vec<SurfaceField>,
    /// Contact forces on condensed bodies that are unknowns.
    #[serde(skip)]
    pub unknown_forces: ContactForces,
    /// Contacts of the membrane, where the model has one.
    #[serde(skip)]
    pub membrane: MembraneContacts,
    /// Contacts of the rigid wall, where the model has one.
    #[serde(skip)]
    pub wall: Vec<WallContact>,
    /// How deep features were crushed at the start of the increment.
    #[serde(skip)]
    pub(super) crushed: Crushed,
    /// Whether what contacts of new shapes began with is among that.
    #[serde(skip)]
    pub(super) knows_depths: bool,
    /// What pairs that are not listed brought into the increment.
    #[serde(skip)]
    pub(super) parted: BTreeMap<PairKey, Brought>,
    /// Searches so far.
    pub searches: usize,
    /// What the work with these contacts has taken so far.
    #[serde(skip)]
    pub timings: Timings,
}

impl Default for Contacts {
    fn default() -> Self {
        Contacts {
            pairs: Vec::new(),
            neighbours: Neighbours::default(),
            kinematics: Vec::new(),
            corners: Vec::new(),
            fields: Vec::new(),
            reach: Vec::new(),
            grains: Vec::new(),
            surface_loads: Vec::new(),
            followed: Vec::new(),
            yields: true,
            stressing_loads: Vec::new(),
            trial: Trial::default(),
            first_scale: 1.0,
            surplus: Vec::new(),
            unknown_forces: ContactForces::default(),
            crushed: Crushed::new(),
            knows_depths: false,
            parted: BTreeMap::new(),
            searches: 0,
            membrane: MembraneContacts::default(),
            wall: Vec::new(),
            timings: Timings::default(),
        }
    }
}

impl Contacts {
    /// Starts an increment from the committed memory.
    pub fn start(&mut self, model: &Model, committed: &Committed) {
        self.membrane.start();
        self.crushed.clone_from(&committed.memory.crushed);
        self.knows_depths = false;
        self.yields = true;
        self.unknown_forces.clear();
        self.fields.clone_from(&committed.fields);
        self.fields.resize(model.bodies.len(), SurfaceField::new());
        let full = self.fields.iter_mut().zip(&model.bodies).map(|(field, body)| {
            body.full().map_or_else(SurfaceField::new, |grain| {
                if grain.nodal(field).is_empty() {
                    *field = grain.undisplaced();
                }
                grain.surplus(field)
            })
        });
        self.surplus = full.collect();
        self.update_reach();
        self.grains.clear();
        self.grains.extend(model.bodies.iter().map(|body| body.deformation.bending().cloned()));
        self.surface_loads.clear();
        self.followed.clear();
        self.stressing_loads.clear();
        self.forget_trial();
        self.parted.clear();
        self.parted
            .extend(committed.memory.iter().map(|(key, memory)| (*key, Brought::from(memory.clone()))));
        for pair in &mut self.pairs {
            pair.reset(model, self.parted.remove(&pair.key()), &committed.poses);
        }
    }

    /// Forgets the damage of an increment that is over, whose grains hold factors of what they were before.
    pub fn forget_trial(&mut self) {
        self.trial = Trial::default();
    }

    pub(super) fn update_reach(&mut self) {
        self.reach.clear();
        self.reach.extend(self.fields.iter().map(|field| reach(field)));
    }

    /// Evaluates every contact at `poses`, searching anew where bodies have moved far enough.
    pub fn evaluate(&mut self, model: &Model, committed: &Committed, poses: &[Pose]) -> Result<(), TooClose> {
        self.look_around(model, committed, poses);
        self.place(model, committed, poses, |_| true);
        self.evaluate_pairs(model, committed, poses, |_, _| true)?;
        self.evaluate_skin(model, poses)
    }

    /// Searches anew where bodies have moved far enough at `poses`; whether they have: the list of pairs is another one then.
    pub(crate) fn look_around(&mut self, model: &Model, committed: &Committed, poses: &[Pose]) -> bool {
        if self.neighbours.is_valid(&model.shapes, poses) {
            return false;
        }
        let start = Instant::now();
        self.place(model, committed, poses, |_| true);
        self.search(model, committed, poses);
        self.timings.book(Kernel::Search, start);
        true
    }

    /// Evaluates the contacts between bodies of those pairs that `counts` holds for, by number in the list, whose bodies were placed at `poses`. What
    /// other pairs have is of where they were evaluated last.
    pub(crate) fn evaluate_pairs(
        &mut self,
        model: &Model,
        committed: &Committed,
        poses: &[Pose],
        counts: impl Fn(usize, &PairWork) -> bool + Sync,
    ) -> Result<(), TooClose> {
        let start = Instant::now();
        let (corners, reach) = (&self.corners, &self.reach);
        let view = View {
            kinematics: &self.kinematics,
            corners,
            poses,
            grains: &self.grains,
            trial: &self.trial,
            fields: &self.fields,
            committed: &committed.fields,
            first_scale: self.first_scale,
            crushed: &self.crushed,
            yields: self.yields,
        };
        let counted = self.pairs.par_iter_mut().enumerate().filter(|(number, pair)| counts(*number, pair));
        let too_close = |pair: &PairWork| {
            let (a, b) = (pair.a(), pair.b());
            let floor = CORE_FLOOR * pair.roundings(model);
            (pair.nearest < floor).then_some(TooClose { a, b, distance: pair.nearest })
        };
        let met: Vec<TooClose> = counted
            .filter_map(|(_, pair)| {
                let needed = pair.elastic_reach(reach);
                let key = pair.key();
                pair.renew_list(model, corners, poses, needed, || margin(model, key, needed));
                pair.evaluate(model, &view);
                too_close(pair)
            })
            .collect();
        self.timings.book(Kernel::Contacts, start);
        met.into_iter().next().map_or(Ok(()), Err)
    }

    /// Evaluates the contacts of the wall and the membrane with all bodies, which were placed at `poses`.
    pub(crate) fn evaluate_skin(&mut self, model: &Model, poses: &[Pose]) -> Result<(), TooClose> {
        if let Some(wall) = &model.wall {
            touch_wall_into(&mut self.wall, model, wall, &self.corners, poses);
        }
        let Some(membrane) = &model.membrane else { return Ok(()) };
        let start = Instant::now();
        let met = self.membrane.evaluate(model, membrane, &self.corners, poses);
        self.timings.book(Kernel::Membrane, start);
        met
    }

    /// Moves the frames and corners of those bodies that `moves` holds for; of all where none was placed before.
    pub(crate) fn place(
        &mut self,
        model: &Model,
        committed: &Committed,
        poses: &[Pose],
        moves: impl Fn(usize) -> bool + Sync,
    ) {
        let frames = committed.poses.iter().zip(poses);
        let is_first = self.kinematics.len() != frames.len() || self.corners.len() != model.shapes.len();
        if is_first {
            self.kinematics.clear();
            self.kinematics.extend(frames.map(|(old, now)| Kinematics::between(old, now)));
            self.corners.resize(model.shapes.len(), Vec::new());
        }
        let moved = |body: &usize| is_first || moves(*body);
        let kinematics = self.kinematics.par_iter_mut().zip(&committed.poses).zip(poses).enumerate();
        kinematics
            .filter(|(body, _)| moved(body))
            .for_each(|(_, ((kinematics, old), now))| *kinematics = Kinematics::between(old, now));
        let corners = self.corners.par_iter_mut().zip(&model.shapes).zip(poses).enumerate();
        corners.filter(|(body, _)| moved(body)).for_each(|(_, ((corners, shape), now))| {
            let turn = now.rotation.to_rotation_matrix();
            corners.clear();
            corners.extend(shape.rounded.core.vertices.iter().map(|v| now.position + turn * v));
        });
    }

    /// Tangents of all active points in the configuration last evaluated, of those pairs that `counts` holds for.
    pub fn update_tangents(
        &mut self,
        model: &Model,
        poses: &[Pose],
        counts: impl Fn(&PairWork) -> bool + Sync,
    ) {
        let start = Instant::now();
        if let Some(membrane) = &model.membrane {
            self.membrane.update_tangents(membrane, &self.corners, poses);
        }
        let kinematics = &self.kinematics;
        self.pairs.par_iter_mut().filter(|pair| counts(pair)).for_each(|pair| {
            pair.update_tangents(model, kinematics, poses);
        });
        self.combine_tangents(poses);
        self.timings.book(Kernel::Tangents, start);
    }

    fn search(&mut self, model: &Model, committed: &Committed, poses: &[Pose]) {
        let rounding = model.smallest_rounding();
        let held =
            |i: usize| !model.bodies[i].stiffness.is_finite() || model.bodies[i].kind == BodyKind::Fixed;
        let gone = |i: usize| model.bodies[i].kind == BodyKind::Gone;
        let ignores = |a, b| (held(a) && held(b)) || gone(a) || gone(b);
        self.neighbours = Neighbours::find(&model.shapes, poses, BROAD_MARGIN * rounding, ignores);
        self.searches += 1;
        let mut old: BTreeMap<PairKey, PairWork> =
            std::mem::take(&mut self.pairs).into_iter().map(|p| (p.key(), p)).collect();
        let keys = self.neighbours.pairs.iter();
        let known: Vec<_> = keys.map(|key| (old.remove(key), self.parted.remove(key))).collect();
        self.parted.extend(old.into_iter().map(|(key, pair)| (key, pair.brought())));
        let listed = self.neighbours.pairs.par_iter().zip(known);
        self.pairs = listed
            .map(|(key, (kept, brought))| {
                if let Some(pair) = kept {
                    return pair;
                }
                let margins = [SKIN * rounding, margin(model, *key, 0.0)];
                let mut pair = PairWork::list(model, &self.corners, poses, *key, margins);
                pair.reset(model, brought, &committed.poses);
                pair
            })
            .collect();
    }

    /// Forgets all lists, as bodies have changed; what was counted and timed stays.
    pub fn forget_bodies(&mut self) {
        let old = std::mem::take(self);
        *self = Contacts {
            membrane: old.membrane,
            searches: old.searches,
            timings: old.timings,
            first_scale: old.first_scale,
            ..Contacts::default()
        };
    }

    /// Whether all pairs are of the first `bodies` bodies.
    pub fn fit(&self, bodies: usize) -> bool {
        self.pairs.iter().all(|pair| pair.a().max(pair.b()) < bodies)
    }

    /// Forgets where contacts lie on the bodies' surfaces, and so how stiff they are there. Evaluate anew
    /// afterwards.
    pub fn forget_places(&mut self) {
        self.forget_places_on(|_| true);
    }

    /// The same of the contacts of bodies that damage moved on last; of all where bodies bend, whose surfaces it displaced.
    pub fn forget_damaged_places(&mut self, model: &Model) {
        let moved = std::mem::take(&mut self.trial.moved);
        self.forget_places_on(|body| model.has_elastic() || moved.get(body).is_some_and(|moved| *moved));
    }

    fn forget_places_on(&mut self, is_meant: impl Fn(usize) -> bool) {
        let meant = self.pairs.iter_mut().filter(|pair| is_meant(pair.a()) || is_meant(pair.b()));
        meant.for_each(PairWork::forget_places);
        self.unknown_forces.lift();
    }

    /// Displaces the surfaces of bodies. Evaluate anew afterwards.
    pub fn displace(&mut self, fields: Vec<SurfaceField>) {
        self.fields = fields;
        self.update_reach();
        self.forget_places();
    }

    /// Has contacts of asperities yield by what their bodies do under the forces that a solve is about to find, or know the bodies' displacements alone.
    /// Evaluate anew afterwards.
    pub fn yield_in_solves(&mut self, yields: bool) {
        self.yields = yields;
        self.forget_places();
    }

    /// Every active contact point with its pair.
    pub fn active(&self) -> impl Iterator<Item = (&PairWork, &ContactPoint)> {
        self.pairs.iter().flat_map(|pair| pair.active().map(move |point| (pair, point)))
    }

    /// Tangent of one active point in the configuration last evaluated.
    pub fn tangent_of(&self, model: &Model, pair: &PairWork, point: &ContactPoint) -> Tangent {
        let ContactPoint { site, sites, state, .. } = point;
        let kinematics = [pair.a(), pair.b()].map(|body| &self.kinematics[body]);
        let law = &model.law_at(site.feature);
        Situation { law, site, points: sites, kinematics, state }.tangent()
    }

    /// Mean normal force over active contact points [N]; zero without any.
    pub fn mean_force(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        for borne in self.pairs.iter().flat_map(|pair| &pair.borne) {
            sum += borne.pressure;
            count += 1;
        }
        if count == 0 { 0.0 } else { sum / count as f64 }
    }
}
