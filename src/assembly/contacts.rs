//! All contacts of the model in one configuration, with buffers that are reused.

use crate::assembly::crushing::Crushing;
use crate::assembly::damage::Trial;
use crate::assembly::elastic::{Held, Side, Spot, SurfaceField, SurfaceLoads, reach};
use crate::assembly::faces;
use crate::assembly::following::Followed;
use crate::assembly::membrane::MembraneContacts;
use crate::assembly::network::Network;
use crate::assembly::point::ContactPoint;
use crate::assembly::sites::{facing_corners, site_points};
use crate::assembly::timings::{Kernel, Timings};
use crate::assembly::too_close::TooClose;
use crate::assembly::wall::touch_wall_into;
use crate::contact::force::{self, ElasticTangent, Kinematics, PointState, SitePoints, Tangent};
use crate::contact::law::{CORE_FLOOR, ContactLaw, Weakening};
use crate::contact::memory::{PairKey, PairMemory};
use crate::contact::patch;
use crate::contact::search::{Neighbours, PairFeatures, visit_sites};
use crate::contact::{Crushed, FaceRule, FaceShare, Feature, Site};
use crate::grain::{CondensedGrain, SurfacePoint};
use crate::model::wall::WallContact;
use crate::model::{BodyKind, Committed, Model, Travel};
use crate::tensor::{Pose, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

/// Margin of the broad phase and of a pair's list of features, over the smallest rounding radius.
const BROAD_MARGIN: f64 = 4.0;
const SKIN: f64 = 0.6;
/// Least margin for elastic displacements, over the smallest rounding radius.
const ELASTIC_MARGIN: f64 = 0.1;

/// The least that damage leaves of a brittle body's share of a contact's spring. Below it the overlap that a force takes would no longer fit
/// into the rounding; what is worth less than this fails.
const LEAST_FIRMNESS: f64 = 0.1;
/// A contact further than this from the rock below it, over the rounding, is on rubble, where there is any.
const RUBBLE_DEPTH: f64 = 2.0;

/// A pair of bodies: what it carries, and its contact points now.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PairWork {
    features: PairFeatures,
    skin: f64,
    stiffness: f64,
    /// Of patches, per area [N/m^3].
    patch_stiffness: f64,
    /// Friction at the start of the increment; set anew for each, like all that is not stored below.
    #[serde(skip, default = "frictionless")]
    pub friction: Weakening,
    /// The committed memory.
    #[serde(skip)]
    pub carried: PairMemory,
    /// Forces of the last augmentation, by feature.
    #[serde(skip)]
    pub held: Vec<Held>,
    /// Places seen since the last augmentation; empty for two rigid bodies.
    #[serde(skip)]
    pub spots: Vec<Spot>,
    #[serde(skip)]
    pub points: Vec<ContactPoint>,
    /// Where the points of patches are that meshed faces share.
    #[serde(skip)]
    pub rules: Vec<FaceRule>,
    /// Tangents of the active points, in their order.
    #[serde(skip)]
    pub tangents: Vec<Tangent>,
    /// The same where a body deforms, with what displacements of its surface change.
    #[serde(skip)]
    pub elastic_tangents: Vec<ElasticTangent>,
    /// Smallest distance between the cores' features [m].
    #[serde(skip)]
    pub nearest: f64,
    /// The largest offset of its points [m].
    #[serde(skip)]
    offset: f64,
}

fn in_solves() -> bool {
    true
}

fn unlimited() -> f64 {
    f64::INFINITY
}

fn frictionless() -> Weakening {
    Weakening::constant(0.0)
}

impl PairWork {
    pub fn a(&self) -> usize {
        self.features.a as usize
    }
    pub fn b(&self) -> usize {
        self.features.b as usize
    }
    pub fn key(&self) -> PairKey {
        (self.features.a, self.features.b)
    }
    pub fn active(&self) -> impl Iterator<Item = &ContactPoint> {
        self.points.iter().filter(|p| p.evaluation.is_active())
    }

    /// How near the two bodies may be to passing through each other [m]: the distance of their cores, as far as it is known.
    pub fn room(&self, model: &Model, poses: &[Pose]) -> f64 {
        if self.nearest.is_finite() {
            return self.nearest;
        }
        let radii = model.shapes[self.a()].rounded.radius + model.shapes[self.b()].rounded.radius;
        radii + self.features.room(&model.shapes, poses)
    }

    /// Stiffness of its contacts' own springs [N/m].
    pub fn spring(&self) -> f64 {
        self.stiffness
    }

    pub fn spot(&self, feature: Feature) -> Option<&Spot> {
        self.spots.iter().find(|s| s.feature == feature)
    }

    pub fn held(&self, feature: Feature) -> Option<&Held> {
        self.held.iter().find(|h| h.feature == feature)
    }

    /// Starts from what was committed.
    pub(super) fn reset(&mut self, model: &Model, committed: &Committed) {
        self.carried = committed.memory.get(&self.key()).cloned().unwrap_or_default();
        let key = self.key();
        faces::renew_rules(&mut self.carried, model, key, &committed.poses);
        self.rules.clone_from(&self.carried.rules);
        self.friction = model.friction_between(self.a(), self.b()).after(self.carried.slip);
        self.held.clear();
        self.held.extend(self.carried.points.iter().map(Held::committed));
        self.spots.clear();
        self.points.clear();
        // It would count in the next search, and a continued run does not have it.
        self.offset = 0.0;
    }

    fn evaluate(&mut self, model: &Model, view: &View<'_>) {
        let View { kinematics, corners, poses, grains, trial, fields, committed, .. } = *view;
        let View { first_scale, strength, crushed, yields, .. } = *view;
        let PairWork {
            features,
            stiffness,
            patch_stiffness,
            friction,
            carried,
            held,
            spots,
            points,
            rules,
            nearest,
            offset,
            ..
        } = self;
        points.clear();
        (*nearest, *offset) = (f64::INFINITY, 0.0);
        if features.is_empty() {
            return;
        }
        let (a, b) = (features.a as usize, features.b as usize);
        let shapes = [&model.shapes[a], &model.shapes[b]];
        let side = |body: usize| Side {
            surface: model.bodies[body].stressed_surface(),
            grain: grains[body].as_deref(),
            pose: &poses[body],
            now: &fields[body],
            committed: committed.get(body).map_or(&[], |field| &field[..]),
        };
        let brittle = model.bodies[a].softens() || model.bodies[b].softens();
        let on_rubble = |body: usize, place: &SurfacePoint, point: &Vec3| {
            let grain = model.bodies[body].damaged.as_ref();
            let depth = RUBBLE_DEPTH * model.shapes[body].rounded.radius;
            grain.is_some_and(|grain| !grain.rubble().is_empty())
                && (place.position - poses[body].to_body(point)).norm() > depth
        };
        let firm = |body: usize, place: &Option<SurfacePoint>, point: &Vec3| match place {
            _ if model.bodies[body].is_rubble => LEAST_FIRMNESS,
            Some(place) if on_rubble(body, place, point) => LEAST_FIRMNESS,
            Some(place) if model.bodies[body].is_brittle() => {
                trial.firmness(model, body, place.facet).max(LEAST_FIRMNESS)
            }
            Some(_) | None => 1.0,
        };
        let elastic = model.bodies[a].is_elastic() || model.bodies[b].is_elastic();
        let deforming = [a, b].into_iter().filter(|body| model.bodies[*body].is_elastic());
        let spared: f64 = deforming.map(|body| model.shell_spares(body)).sum();
        let reach = if elastic || carried.lead() > 0.0 { features.margin() } else { 0.0 };
        let radii = shapes[0].rounded.radius + shapes[1].rounded.radius;
        let yielding = shapes[0].yielding() + shapes[1].yielding();
        let softened = (strength / yielding / *stiffness).min(1.0);
        let per_area = *patch_stiffness * softened;
        let is_new = carried.points.iter().all(|point| point.load <= 0.0);
        let facings = faces::facings(model, features, [&poses[a], &poses[b]]);
        let plain = |site: &Site, spring: f64| {
            let memory = carried.point(site.feature);
            PointState {
                radii,
                radius_difference: shapes[0].rounded.radius - shapes[1].rounded.radius,
                stiffness: spring,
                spring,
                friction: *friction,
                offset: 0.0,
                stretch: memory.map_or_else(Vec3::zeros, |m| m.stretch),
                behind_stretch: Vec3::zeros(),
                is_new,
                corners: None,
                faces: None,
                elastic: Vec3::zeros(),
                elastic_change: Vec3::zeros(),
                lead: memory.map_or(0.0, |m| m.lead),
                compliance: 0.0,
                given: Vec3::zeros(),
                hardening: 0.0,
                asperity: None,
            }
        };
        let crushing = Crushing { model, bodies: [a, b], carried, crushed };
        let mut put = |law: &ContactLaw, site: Site, sites: SitePoints, mut state: PointState| {
            let spring = state.spring;
            let mut firmness = 1.0;
            if elastic || brittle {
                let last = held.iter().find(|h| h.feature == site.feature);
                let known = spots.iter().position(|s| s.feature == site.feature);
                let place = known.unwrap_or_else(|| {
                    let (point, normal) = force::place(&site, &sites, state.radius_difference);
                    // Behind an asperity it follows from the last force.
                    let scale = state.asperity.is_none().then(|| last.map_or(first_scale, |h| h.scale));
                    let mut spot = Spot::new(site.feature, [side(a), side(b)], &point, &normal, scale);
                    if elastic && yields && scale.is_none() {
                        spot.yield_at_once([side(a), side(b)], &normal, last);
                    }
                    if brittle {
                        let firmness = [firm(a, &spot.on_a, &point), firm(b, &spot.on_b, &point)];
                        let left = model.softened_share([a, b], firmness);
                        let memory = carried.point(site.feature);
                        spot.firmness = memory.map_or(left, |memory| memory.firmness.min(left));
                    }
                    spots.push(spot);
                    spots.len() - 1
                });
                firmness = spots[place].firmness;
                if firmness != 1.0 {
                    (state.spring, state.stiffness) = (spring * firmness, spring * firmness);
                    state.asperity.iter_mut().for_each(|asperity| asperity.share *= firmness);
                }
                if brittle {
                    let sharpness = spring / *stiffness;
                    state.hardening = state.spring / (1.0 + state.spring * spared / sharpness);
                }
            }
            if elastic {
                let last = held.iter().find(|h| h.feature == site.feature);
                let Some(spot) = spots.iter().find(|s| s.feature == site.feature) else { return };
                state.elastic = spot.elastic;
                state.elastic_change = spot.change;
                if let Some(given) = spot.given {
                    (state.compliance, state.given) = (spot.compliance, given);
                } else {
                    state.stiffness = 1.0 / (1.0 / state.spring + spot.compliance);
                    if let Some(held) = last {
                        state.offset = spot.compliance * held.load;
                        *offset = offset.max(state.offset);
                        state.behind_stretch = held.traction * (spot.compliance / model.law.tangential_ratio);
                    }
                }
            }
            let evaluation = force::evaluate(law, &site, &sites, &kinematics[a], &kinematics[b], &state);
            points.push(ContactPoint { site, sites, state, evaluation, firmness });
        };
        *nearest = visit_sites(shapes, [&corners[a], &corners[b]], features, reach, |site, _| {
            let sharpness = match site.feature {
                Feature::Edges(i, j) => shapes[0].edge_weight[i as usize] * shapes[1].edge_weight[j as usize],
                Feature::VertexOfA(_) | Feature::VertexOfB(_) | Feature::Faces(..) => 1.0,
            };
            let mut sites = site_points(&site, shapes, [&corners[a], &corners[b]], [&poses[a], &poses[b]]);
            let spring = stiffness.min(strength / yielding) * sharpness;
            let mut state = plain(&site, spring);
            state.asperity = crushing.asperity(site.feature, spring / *stiffness);
            // Cores keep apart however much is crushed between them.
            state.hardening = state.asperity.map_or(0.0, |_| spring);
            state.corners = facing_corners(&site, shapes).map(|both| both.map(|corner| corner.cosine));
            if let Some(facing) = faces::of_contact(&facings, &site, &sites) {
                sites.normals = facing.normals;
                state.faces = Some(FaceShare::Feature(facing.cosines));
            }
            put(&model.law, site, sites, state);
        });
        let law = ContactLaw { onset: 0.0, ..model.law };
        if elastic {
            let surfaces = [a, b].map(|body| model.bodies[body].surface());
            for facing in &facings {
                let known = rules.iter().position(|rule| rule.faces == facing.numbers);
                let rule = known.unwrap_or_else(|| {
                    rules.push(facing.rule([&poses[a], &poses[b]], surfaces));
                    rules.len() - 1
                });
                for (k, point) in rules[rule].points.iter().enumerate() {
                    let site = facing.site(k as u32);
                    let sites = facing.sites([&poses[a], &poses[b]], point, shapes);
                    let mut state = plain(&site, per_area * point.area);
                    state.faces = Some(FaceShare::Patch);
                    put(&law, site, sites, state);
                }
            }
            return;
        }
        for facing in &facings {
            let faces = facing.in_space([&poses[a], &poses[b]]);
            let spring = per_area * faces.reference_area() / patch::POINTS as f64;
            let states = std::array::from_fn(|k| plain(&facing.site(k as u32), spring));
            let met = patch::evaluate(&law, &faces, [&kinematics[a], &kinematics[b]], &states);
            for (k, (state, evaluation)) in states.into_iter().zip(met.into_iter().flatten()).enumerate() {
                let sites =
                    SitePoints { a: [Vec3::zeros(); 3], b: [Vec3::zeros(); 3], normals: facing.normals };
                points.push(ContactPoint {
                    site: facing.site(k as u32),
                    sites,
                    state,
                    evaluation,
                    firmness: 1.0,
                });
            }
        }
    }
}

/// The configuration that contacts are evaluated in.
#[derive(Clone, Copy)]
struct View<'a> {
    kinematics: &'a [Kinematics],
    corners: &'a [Vec<Vec3>],
    poses: &'a [Pose],
    grains: &'a [Option<Arc<CondensedGrain>>],
    trial: &'a Trial,
    /// Surface displacements, now and as committed.
    fields: &'a [SurfaceField],
    committed: &'a [SurfaceField],
    first_scale: f64,
    strength: f64,
    crushed: &'a Crushed,
    yields: bool,
}

/// How far beyond its radii a pair's features are listed for the sake of elastic displacements
/// [m]: zero for two rigid bodies.
fn margin(model: &Model, (a, b): PairKey, needed: f64) -> f64 {
    let elastic = [a, b].iter().any(|&body| model.bodies[body as usize].is_elastic());
    if elastic || needed > 0.0 { (2.0 * needed).max(ELASTIC_MARGIN * model.smallest_rounding()) } else { 0.0 }
}

/// How far elastic displacements and offsets may bring a contact forward [m].
fn elastic_reach(pair: &PairWork, reach: &[f64]) -> f64 {
    reach[pair.a()] + reach[pair.b()] + pair.offset + pair.carried.lead()
}

/// All pairs within reach. What is stored with a restart point is the search: which features are listed
/// decides how far a Newton step may go, so a continued run needs the lists of the run it continues.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Contacts {
    pub pairs: Vec<PairWork>,
    neighbours: Neighbours,
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
    /// The flexibility of every condensed body in the present increment: with trial damage, where a body can break.
    #[serde(skip)]
    pub grains: Vec<Option<Arc<CondensedGrain>>>,
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
    /// How far around bodies the search looks.
    #[serde(skip)]
    pub travel: Travel,
    /// What presses a contact by all that its two bodies may yield ([`ContactShape::yielding`]), unless it is softer itself [N]. Infinite but in a dwell.
    #[serde(skip, default = "unlimited")]
    pub strength: f64,
    /// Displacement that finite strains cause besides that of the loads, of full bodies ([`crate::grain::FullGrain::surplus`]).
    #[serde(skip)]
    pub surplus: Vec<SurfaceField>,
    /// Contact forces on condensed bodies that are unknowns.
    #[serde(skip)]
    pub network: Network,
    /// Contacts of the membrane, where the model has one.
    #[serde(skip)]
    pub membrane: MembraneContacts,
    /// Contacts of the rigid wall, where the model has one.
    #[serde(skip)]
    pub wall: Vec<WallContact>,
    /// How deep features were crushed at the start of the increment.
    #[serde(skip)]
    pub(super) crushed: Crushed,
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
            travel: Travel::default(),
            strength: unlimited(),
            surplus: Vec::new(),
            network: Network::default(),
            crushed: Crushed::new(),
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
        self.network.clear();
        self.fields.clone_from(&committed.fields);
        self.fields.resize(model.bodies.len(), SurfaceField::new());
        let full = self.fields.iter_mut().zip(&model.bodies).map(|(field, body)| {
            body.full.as_ref().map_or_else(SurfaceField::new, |grain| {
                if grain.nodal(field).is_empty() {
                    *field = grain.undisplaced();
                }
                grain.surplus(field)
            })
        });
        self.surplus = full.collect();
        self.update_reach();
        self.grains.clear();
        self.grains.extend(model.bodies.iter().map(|body| body.grain.clone()));
        self.surface_loads.clear();
        self.followed.clear();
        self.stressing_loads.clear();
        self.trial = Trial::default();
        for pair in &mut self.pairs {
            pair.reset(model, committed);
        }
    }

    pub(super) fn update_reach(&mut self) {
        self.reach.clear();
        self.reach.extend(self.fields.iter().map(|field| reach(field)));
    }

    /// Evaluates every contact at `poses`, searching anew where bodies have moved far enough.
    pub fn evaluate(&mut self, model: &Model, committed: &Committed, poses: &[Pose]) -> Result<(), TooClose> {
        let mut start = Instant::now();
        self.kinematics.clear();
        self.kinematics
            .extend(committed.poses.iter().zip(poses).map(|(old, now)| Kinematics::between(old, now)));
        self.corners.resize(model.shapes.len(), Vec::new());
        for ((corners, pose), shape) in self.corners.iter_mut().zip(poses).zip(&model.shapes) {
            let turn = pose.rotation.to_rotation_matrix();
            corners.clear();
            corners.extend(shape.rounded.core.vertices.iter().map(|v| pose.position + turn * v));
        }
        if !self.neighbours.is_valid(&model.shapes, poses) {
            let begun = Instant::now();
            self.search(model, committed, poses);
            self.timings.book(Kernel::Search, begun);
            start += begun.elapsed();
        }
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
            strength: self.strength,
            crushed: &self.crushed,
            yields: self.yields,
        };
        self.pairs.par_iter_mut().for_each(|pair| {
            let needed = elastic_reach(pair, reach);
            if !pair.features.is_valid(&model.shapes, poses) || pair.features.margin() < needed {
                let margin = margin(model, pair.key(), needed);
                pair.features =
                    PairFeatures::list(&model.shapes, corners, poses, pair.key(), [pair.skin, margin]);
            }
            pair.evaluate(model, &view);
        });
        self.timings.book(Kernel::Contacts, start);
        for pair in &self.pairs {
            let (a, b) = (pair.a(), pair.b());
            let floor = CORE_FLOOR * (model.shapes[a].rounded.radius + model.shapes[b].rounded.radius);
            if pair.nearest < floor {
                return Err(TooClose { a, b, distance: pair.nearest });
            }
        }
        if let Some(wall) = &model.wall {
            touch_wall_into(&mut self.wall, model, wall, &self.corners, poses);
        }
        let Some(membrane) = &model.membrane else { return Ok(()) };
        let start = Instant::now();
        let met = self.membrane.evaluate(model, membrane, &self.corners, poses);
        self.timings.book(Kernel::Membrane, start);
        met
    }

    /// Tangents of all active points in the configuration last evaluated.
    pub fn update_tangents(&mut self, model: &Model, poses: &[Pose]) {
        let start = Instant::now();
        if let Some(membrane) = &model.membrane {
            self.membrane.update_tangents(membrane, &self.corners, poses);
        }
        let kinematics = &self.kinematics;
        self.pairs.par_iter_mut().for_each(|pair| {
            let PairWork { features, points, tangents, elastic_tangents, .. } = &mut *pair;
            let (a, b) = (features.a as usize, features.b as usize);
            let deforms = model.bodies[a].is_elastic() || model.bodies[b].is_elastic();
            tangents.clear();
            elastic_tangents.clear();
            let [at_a, at_b] = [&kinematics[a], &kinematics[b]];
            for ContactPoint { site, sites, state, .. } in points.iter().filter(|p| p.evaluation.is_active())
            {
                let is_patch = matches!(site.feature, Feature::Faces(..));
                if deforms && state.asperity.is_none() {
                    let law = ContactLaw { onset: if is_patch { 0.0 } else { model.law.onset }, ..model.law };
                    let elastic = force::elastic_tangent(&law, site, sites, at_a, at_b, state);
                    tangents.push(std::array::from_fn(|r| std::array::from_fn(|c| elastic[r][c])));
                    elastic_tangents.push(elastic);
                } else if deforms || !is_patch {
                    tangents.push(force::tangent(&model.law, site, sites, at_a, at_b, state));
                }
            }
            if !deforms {
                faces::patch_tangents_into(
                    tangents,
                    model,
                    features,
                    points,
                    [&poses[a], &poses[b]],
                    [at_a, at_b],
                );
            }
        });
        self.combine_tangents(poses);
        self.timings.book(Kernel::Tangents, start);
    }

    fn search(&mut self, model: &Model, committed: &Committed, poses: &[Pose]) {
        let travel = self.travel.lengths(model);
        let margins = travel.iter().map(|length| BROAD_MARGIN * length).collect();
        let held =
            |i: usize| !model.bodies[i].stiffness.is_finite() || model.bodies[i].kind == BodyKind::Fixed;
        let gone = |i: usize| model.bodies[i].kind == BodyKind::Gone;
        let ignores = |a, b| (held(a) && held(b)) || gone(a) || gone(b);
        self.neighbours = Neighbours::find(&model.shapes, poses, margins, ignores);
        self.searches += 1;
        let mut old: BTreeMap<PairKey, PairWork> =
            std::mem::take(&mut self.pairs).into_iter().map(|p| (p.key(), p)).collect();
        self.pairs = self
            .neighbours
            .pairs
            .par_iter()
            .map(|key| {
                if let Some(pair) = old.get(key) {
                    return pair.clone();
                }
                let (a, b) = (key.0 as usize, key.1 as usize);
                let skin = SKIN * (0.5 * (travel[a] + travel[b]));
                let margins = [skin, margin(model, *key, 0.0)];
                let mut pair = PairWork {
                    features: PairFeatures::list(&model.shapes, &self.corners, poses, *key, margins),
                    skin,
                    stiffness: model.contact_spring(a, b),
                    patch_stiffness: model.patch_stiffness(a, b),
                    friction: frictionless(),
                    carried: PairMemory::default(),
                    held: Vec::new(),
                    spots: Vec::new(),
                    points: Vec::new(),
                    rules: Vec::new(),
                    tangents: Vec::new(),
                    elastic_tangents: Vec::new(),
                    nearest: f64::INFINITY,
                    offset: 0.0,
                };
                pair.reset(model, committed);
                pair
            })
            .collect();
        old.clear();
    }

    /// Forgets all lists, as bodies have changed; what was counted and timed stays.
    pub fn forget_bodies(&mut self) {
        let old = std::mem::take(self);
        *self = Contacts {
            membrane: old.membrane,
            searches: old.searches,
            timings: old.timings,
            first_scale: old.first_scale,
            travel: old.travel,
            strength: old.strength,
            ..Contacts::default()
        };
    }

    /// Whether all pairs are of the first `bodies` bodies.
    pub fn fit(&self, bodies: usize) -> bool {
        self.pairs.iter().all(|pair| pair.a().max(pair.b()) < bodies)
    }

    /// Forgets where contacts lie on the bodies' surfaces, and so how firm they are there. Evaluate anew afterwards.
    pub fn forget_places(&mut self) {
        self.pairs.iter_mut().for_each(|pair| pair.spots.clear());
        self.network.lift();
    }

    /// Displaces the surfaces of bodies, whose contacts then know these displacements alone, until they are to yield in a solve again. Evaluate anew
    /// afterwards.
    pub fn displace(&mut self, fields: Vec<SurfaceField>, yields: bool) {
        self.fields = fields;
        self.yields = yields;
        self.update_reach();
        self.forget_places();
    }

    /// Every active contact point with its pair.
    pub fn active(&self) -> impl Iterator<Item = (&PairWork, &ContactPoint)> {
        self.pairs.iter().flat_map(|pair| pair.active().map(move |point| (pair, point)))
    }

    /// Mean normal force over active contact points [N]; zero without any.
    pub fn mean_force(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        for (_, point) in self.active() {
            sum += point.evaluation.pressure;
            count += 1;
        }
        if count == 0 { 0.0 } else { sum / count as f64 }
    }
}
