//! A pair of bodies: what it carries, and its contact points in one configuration.

use crate::assembly::faces::{self, Facing};
use crate::assembly::place::{ContactPlace, Multiplier, Side, SurfaceField};
use crate::assembly::point::ContactPoint;
use crate::assembly::sites::{facing_corners, site_points};
use crate::assembly::springs::Springs;
use crate::assembly::trial::Trial;
use crate::contact::asperity::{Asperity, AsperityState};
use crate::contact::force::{self, ElasticTangent, Kinematics, PointState, SitePoints, Situation, Tangent};
use crate::contact::law::{ContactLaw, Weakening};
use crate::contact::memory::{Crushable, PairKey, PairMemory, PointMemory};
use crate::contact::mortar::MortarNode;
use crate::contact::patch;
use crate::contact::search::PairFeatures;
use crate::contact::visit::{Clearances, Placed, visit_sites};
use crate::contact::{ContactShape, Crushed, FaceShare, Feature, Mortar, Site};
use crate::grain::SurfacePoint;
use crate::model::{Flexibility, Model};
use crate::tensor::{Pose, Vec3};
use serde::{Deserialize, Serialize};

/// The least that damage leaves of a brittle body's share of a contact's spring. Below it the overlap that a force takes would no longer fit
/// into the rounding; what is worth less than this fails.
const LEAST_STIFFNESS_LEFT: f64 = 0.1;
/// A contact further than this from the rock below it, over the rounding, is on rubble, where there is any.
const RUBBLE_DEPTH: f64 = 2.0;

/// A pair of bodies: what it carries, and its contact points now.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PairWork {
    features: PairFeatures,
    skin: f64,
    pub springs: Springs,
    /// Friction at the start of the increment; set anew for each, like all that is not stored below.
    #[serde(skip, default = "frictionless")]
    pub friction: Weakening,
    /// The memory that it brought into the increment, or has since friction began anew.
    #[serde(skip)]
    pub carried: PairMemory,
    /// What its contacts lost of the energy stored there as nodes of their patches were found anew [J].
    #[serde(skip)]
    pub(super) moved: f64,
    /// How far its contacts may be ahead of the geometry [m], and whether none of them carried.
    #[serde(skip)]
    initial_overlap: f64,
    #[serde(skip)]
    is_new: bool,
    /// Whether one of the bodies deforms, and whether one can break or is rubble.
    #[serde(skip)]
    is_elastic: bool,
    #[serde(skip)]
    pub(super) is_brittle: bool,
    /// What is known of listed features that came in reach, by number in the list.
    #[serde(skip)]
    met: Vec<(usize, Met)>,
    #[serde(skip)]
    clearances: Clearances,
    /// Forces of the last augmentation, by feature.
    #[serde(skip)]
    pub multipliers: Vec<Multiplier>,
    /// Places seen since the last augmentation; empty for two rigid bodies.
    #[serde(skip)]
    pub places: Vec<ContactPlace>,
    #[serde(skip)]
    pub points: Vec<ContactPoint>,
    /// What those that are active bear, in their order.
    #[serde(skip)]
    pub borne: Vec<Borne>,
    /// Of the patches that meshed faces share.
    #[serde(skip)]
    pub mortars: Vec<Mortar>,
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

/// What an active contact bears: most that reads this reads nothing else of it.
#[derive(Debug, Clone, Copy)]
pub struct Borne {
    /// Forces and moments on both bodies [N, N m].
    pub wrench: [f64; 12],
    /// Normal force [N].
    pub pressure: f64,
}

/// What a pair brings into an increment.
#[derive(Debug, Clone, Default)]
pub(super) struct Brought {
    pub memory: PairMemory,
    /// As [`PairWork::moved`].
    pub moved: f64,
}

impl From<PairMemory> for Brought {
    fn from(memory: PairMemory) -> Self {
        Brought { memory, moved: 0.0 }
    }
}

fn frictionless() -> Weakening {
    Weakening::constant(0.0)
}

/// Least radius of a patch that friction holds on to, over the feature's own: where hardening presses what was crushed further before.
const LEAST_GRIP: f64 = 1e-3;

/// A listed feature that came in reach.
#[derive(Debug, Clone, Copy)]
struct Met {
    /// Its asperity, where it has one, and its share of the pair's spring.
    asperity: Option<Asperity>,
    weight: f64,
    /// What its contact brings into the increment, once that is known.
    start: Option<Start>,
}

/// What a contact of one feature brings into the increment.
#[derive(Debug, Clone, Copy)]
struct Start {
    stretch: Vec3,
    initial_overlap: f64,
    /// With its whole share.
    asperity: Option<AsperityState>,
    /// What damage of brittle bodies leaves of its spring, once that is known.
    stiffness_left: Option<f64>,
}

/// The configuration that contacts are evaluated in.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub kinematics: &'a [Kinematics],
    pub corners: &'a [Vec<Vec3>],
    pub poses: &'a [Pose],
    pub grains: &'a [Option<Flexibility>],
    pub trial: &'a Trial,
    /// Surface displacements, now and as committed.
    pub fields: &'a [SurfaceField],
    pub committed: &'a [SurfaceField],
    pub first_scale: f64,
    pub crushed: &'a Crushed,
    pub yields: bool,
}

impl PairWork {
    /// With the features that are within `skin` and `margin` [m] of each other.
    pub(super) fn list(
        model: &Model,
        corners: &[Vec<Vec3>],
        poses: &[Pose],
        key: PairKey,
        [skin, margin]: [f64; 2],
    ) -> Self {
        let (a, b) = (key.0 as usize, key.1 as usize);
        PairWork {
            features: PairFeatures::list(&model.shapes, corners, poses, key, [skin, margin]),
            skin,
            springs: Springs::between(model, a, b),
            friction: frictionless(),
            carried: PairMemory::default(),
            moved: 0.0,
            initial_overlap: 0.0,
            is_new: true,
            is_elastic: false,
            is_brittle: false,
            met: Vec::new(),
            clearances: Clearances::default(),
            multipliers: Vec::new(),
            places: Vec::new(),
            points: Vec::new(),
            borne: Vec::new(),
            mortars: Vec::new(),
            tangents: Vec::new(),
            elastic_tangents: Vec::new(),
            nearest: f64::INFINITY,
            offset: 0.0,
        }
    }

    /// Lists its features anew, `margin` [m] beyond its radii, where others may have come within reach or `needed` [m] is more than what they are listed for.
    pub(super) fn renew_list(
        &mut self,
        model: &Model,
        corners: &[Vec<Vec3>],
        poses: &[Pose],
        needed: f64,
        margin: impl FnOnce() -> f64,
    ) {
        if !self.features.is_valid(&model.shapes, poses) || self.features.margin() < needed {
            let margins = [self.skin, margin()];
            self.features = PairFeatures::list(&model.shapes, corners, poses, self.key(), margins);
            self.clearances.clear();
            self.met.clear();
        }
    }

    pub fn a(&self) -> usize {
        self.features.a as usize
    }
    pub fn b(&self) -> usize {
        self.features.b as usize
    }
    pub fn key(&self) -> PairKey {
        (self.features.a, self.features.b)
    }
    /// Whether one of the two is among these bodies, which are told by number.
    pub fn is_of(&self, bodies: &[bool]) -> bool {
        bodies[self.a()] || bodies[self.b()]
    }
    /// Whether its contacts keep their forces while they get softer, and not their place: behind springs, where bodies bend.
    pub fn keeps_force(&self, model: &Model) -> bool {
        let bends = [self.a(), self.b()].into_iter().any(|body| model.bodies[body].is_elastic());
        bends && model.waits_for_augmentations()
    }
    pub fn active(&self) -> impl Iterator<Item = &ContactPoint> {
        self.points.iter().filter(|p| p.evaluation.is_active())
    }

    /// Sum of the two roundings [m].
    pub fn roundings(&self, model: &Model) -> f64 {
        model.shapes[self.a()].rounded.radius + model.shapes[self.b()].rounded.radius
    }

    /// The share of its springs that a contact has: the weight of its edges, of a patch's node the area [m^2].
    pub fn share_of(&self, point: &ContactPoint) -> f64 {
        point.state.spring / self.springs.at(point.site.feature) / point.stiffness_left
    }

    /// The node of a meshed patch.
    pub fn node(&self, feature: Feature) -> Option<&MortarNode> {
        self.mortars.iter().find_map(|mortar| mortar.node(feature))
    }

    /// The patches that these points are of.
    pub fn mortars_of(&self, points: &[PointMemory]) -> Vec<Mortar> {
        let felt = |mortar: &&Mortar| points.iter().any(|point| mortar.node(point.feature).is_some());
        self.mortars.iter().filter(felt).cloned().collect()
    }

    pub fn place(&self, feature: Feature) -> Option<&ContactPlace> {
        self.places.iter().find(|place| place.feature == feature)
    }

    /// Forgets where its contacts lie on the bodies' surfaces, and what follows from it.
    pub(super) fn forget_places(&mut self) {
        self.places.clear();
        self.forget_starts();
    }

    fn forget_starts(&mut self) {
        self.met.iter_mut().for_each(|(_, met)| met.start = None);
    }

    pub fn multiplier(&self, feature: Feature) -> Option<&Multiplier> {
        self.multipliers.iter().find(|multiplier| multiplier.feature == feature)
    }

    /// How far elastic displacements and offsets may bring a contact forward [m], `reach` being the largest displacement of each body.
    pub(super) fn elastic_reach(&self, reach: &[f64]) -> f64 {
        reach[self.a()] + reach[self.b()] + self.offset + self.initial_overlap
    }

    /// What it brought into the increment.
    pub(super) fn brought(self) -> Brought {
        Brought { memory: self.carried, moved: self.moved }
    }

    /// Starts from what it brought, and these committed poses.
    pub(super) fn reset(&mut self, model: &Model, brought: Option<Brought>, poses: &[Pose]) {
        let Brought { memory, moved } = brought.unwrap_or_default();
        self.multipliers.clear();
        self.multipliers.extend(memory.points.iter().map(Multiplier::committed));
        self.places.clear();
        self.carry(model, memory, poses);
        self.moved += moved;
    }

    /// Goes on from the configuration last evaluated as if it had been committed at these poses: where contacts lie on bodies that do not bend stays known,
    /// and of those that bend what a solve found last, which is nearer to the next than what their displacements alone tell.
    pub(super) fn go_on(&mut self, model: &Model, first_scale: f64, poses: &[Pose]) {
        let memory = self.memory(model, first_scale).unwrap_or_default();
        if self.is_elastic {
            self.places.clear();
        } else {
            self.multipliers.clear();
            self.multipliers.extend(memory.points.iter().map(Multiplier::committed));
        }
        self.carry(model, memory, poses);
    }

    fn carry(&mut self, model: &Model, memory: PairMemory, poses: &[Pose]) {
        let stored = memory.tangential_energy();
        self.carried = memory;
        let key = self.key();
        faces::renew_mortars(&mut self.carried, model, key, poses);
        self.moved = stored - self.carried.tangential_energy();
        self.initial_overlap = self.carried.initial_overlap();
        self.is_new = self.carried.points.iter().all(|point| point.load <= 0.0);
        let bodies = [self.a(), self.b()].map(|body| &model.bodies[body]);
        self.is_elastic = bodies.iter().any(|body| body.is_elastic());
        self.is_brittle = bodies.iter().any(|body| body.softens());
        self.forget_starts();
        self.mortars.clone_from(&self.carried.mortars);
        self.friction = model.friction_between(self.a(), self.b()).after(self.carried.slip);
        self.points.clear();
        self.borne.clear();
        // It would count in the next search, and a continued run does not have it.
        self.offset = 0.0;
    }

    /// Finds its contact points and their forces.
    pub(super) fn evaluate(&mut self, model: &Model, view: &View<'_>) {
        self.find_points(model, view);
        let PairWork { points, borne, .. } = self;
        let active = points.iter().map(|point| &point.evaluation).filter(|e| e.is_active());
        borne.clear();
        borne.extend(active.map(|e| Borne { wrench: e.wrench, pressure: e.pressure }));
    }

    fn find_points(&mut self, model: &Model, view: &View<'_>) {
        self.points.clear();
        (self.nearest, self.offset) = (f64::INFINITY, 0.0);
        if self.features.is_empty() {
            return;
        }
        let meeting = Meeting::new(self, model, view);
        let Meeting { bodies: [a, b], shapes, .. } = meeting;
        let (poses, corners) = ([&view.poses[a], &view.poses[b]], [&view.corners[a][..], &view.corners[b]]);
        let PairWork { features, carried, met, clearances, multipliers, places, points, mortars, .. } = self;
        let reach = if meeting.is_elastic || self.initial_overlap > 0.0 { features.margin() } else { 0.0 };
        let facings = faces::facings(model, features, poses);
        let crushing = Crushing { bodies: [a, b], carried, crushed: view.crushed };
        let mut known = Known { carried, multipliers, places, offset: 0.0 };
        let placed = Placed { shapes, corners, poses };
        let mut at = 0;
        self.nearest = visit_sites(&placed, features, clearances, reach, |site, number| {
            at += met[at..].iter().take_while(|(listed, _)| *listed < number).count();
            if met.get(at).is_none_or(|(listed, _)| *listed != number) {
                met.insert(at, (number, Met::new(model, [a, b], site.feature)));
            }
            let Met { asperity, weight, start } = &mut met[at].1;
            let start = start.get_or_insert_with(|| Start {
                asperity: asperity.map(|law| crushing.asperity(law, site.feature)),
                ..Start::of(carried, site.feature)
            });
            let mut sites = site_points(&site, shapes, corners, poses);
            let spring = meeting.springs.contact * *weight;
            let mut state = meeting.state(start, spring);
            let share = spring / meeting.springs.contact;
            state.asperity = start.asperity.map(|asperity| AsperityState { share, ..asperity });
            // Cores keep apart however much is crushed between them.
            state.hardening = state.asperity.map_or(0.0, |_| spring);
            state.corners = facing_corners(&site, shapes).map(|both| both.map(|corner| corner.cosine));
            if let Some(facing) = faces::of_contact(&facings, &site, &sites) {
                sites.normals = facing.normals;
                state.faces = Some(FaceShare::Feature { g: facing.g, cosines: facing.cosines });
            }
            points.push(meeting.point(&model.law, site, sites, state, None, (start, &mut known)));
        });
        self.offset = known.offset;
        if facings.is_empty() {
            return;
        }
        let per_area = meeting.springs.patch;
        let law = model.law.of_patches();
        if !has_mortars(model, [a, b]) {
            facings.iter().for_each(|facing| points.extend(meeting.patch(&law, facing, carried, per_area)));
            return;
        }
        let surfaces = [a, b].map(|body| model.bodies[body].meshed_surface());
        for facing in &facings {
            let same = mortars.iter().position(|mortar| mortar.faces == facing.numbers);
            let number = same.unwrap_or_else(|| {
                mortars.push(facing.mortar(poses, surfaces));
                mortars.len() - 1
            });
            for (k, node) in mortars[number].nodes.iter().enumerate() {
                let site = facing.site(k as u32);
                let sites = facing.sites(poses, node, shapes);
                let mut start = Start::of(carried, site.feature);
                let mut state = meeting.state(&start, per_area * node.area);
                state.faces = Some(FaceShare::Patch { g: facing.g });
                let on = Some(&node.on);
                points.push(meeting.point(&law, site, sites, state, on, (&mut start, &mut known)));
            }
        }
        self.offset = known.offset;
    }

    /// Tangents of its active points in the configuration last evaluated.
    pub(super) fn update_tangents(&mut self, model: &Model, kinematics: &[Kinematics], poses: &[Pose]) {
        let PairWork { features, points, tangents, elastic_tangents, .. } = self;
        let (a, b) = (features.a as usize, features.b as usize);
        let of_patch = |point: &ContactPoint| matches!(point.site.feature, Feature::Faces(..));
        let has_rigid_patch = points.iter().any(of_patch) && !has_mortars(model, [a, b]);
        tangents.clear();
        elastic_tangents.clear();
        let between = [&kinematics[a], &kinematics[b]];
        for point in points.iter().filter(|p| p.evaluation.is_active()) {
            let ContactPoint { site, sites, state, .. } = point;
            let law = &model.law_at(site.feature);
            let situation = Situation { law, site, points: sites, kinematics: between, state };
            if self.is_elastic && state.asperity.is_none() {
                let elastic = situation.elastic_tangent();
                tangents.push(std::array::from_fn(|r| std::array::from_fn(|c| elastic[r][c])));
                elastic_tangents.push(elastic);
            } else if !has_rigid_patch || !of_patch(point) {
                tangents.push(situation.tangent());
            }
        }
        if has_rigid_patch {
            let poses = [&poses[a], &poses[b]];
            faces::patch_tangents_into(tangents, model, features, points, poses, between);
        }
    }
}

impl Met {
    fn new(model: &Model, bodies: [usize; 2], feature: Feature) -> Self {
        let [a, b] = bodies.map(|body| &model.shapes[body]);
        let weight = match feature {
            Feature::Edges(i, j) => a.edge_weight[i as usize] * b.edge_weight[j as usize],
            Feature::VertexOfA(_) | Feature::VertexOfB(_) | Feature::Faces(..) => 1.0,
        };
        Met { asperity: model.asperity(bodies, feature), weight, start: None }
    }
}

impl Start {
    /// Without an asperity.
    fn of(carried: &PairMemory, feature: Feature) -> Self {
        let memory = carried.point(feature);
        let stretch = memory.map_or_else(Vec3::zeros, |memory| memory.stretch);
        Start {
            stretch,
            initial_overlap: memory.map_or(0.0, |memory| memory.initial_overlap),
            asperity: None,
            stiffness_left: None,
        }
    }
}

/// What is known of the asperities of a pair of bodies.
///
/// A contact that goes on knows how deep it has crushed. One that begins finds its corner as deep as any contact of that corner, with whatever body, has
/// crushed it; crossing edges know what these two have crushed of each other.
#[derive(Clone, Copy)]
struct Crushing<'a> {
    bodies: [usize; 2],
    carried: &'a PairMemory,
    crushed: &'a Crushed,
}

impl Crushing<'_> {
    /// The asperity of a feature at the start of the increment.
    fn asperity(&self, law: Asperity, feature: Feature) -> AsperityState {
        let known = self.carried.point(feature).filter(|memory| memory.load > 0.0);
        let key = (self.bodies[0] as u32, self.bodies[1] as u32);
        let before = || Crushable::of((key, feature)).and_then(|place| self.crushed.get(&place).copied());
        let depth = known.map(|memory| memory.depth).or_else(before).unwrap_or(0.0);
        let grip = known.map_or(0.0, |memory| memory.grip).max(LEAST_GRIP * law.radius);
        AsperityState { law, depth, grip, share: 1.0 }
    }
}

/// What is known of contacts where bodies deform or break.
struct Known<'a> {
    carried: &'a PairMemory,
    multipliers: &'a [Multiplier],
    places: &'a mut Vec<ContactPlace>,
    offset: f64,
}

/// What all contacts of a pair have in common in one configuration.
struct Meeting<'a> {
    model: &'a Model,
    view: &'a View<'a>,
    bodies: [usize; 2],
    shapes: [&'a ContactShape; 2],
    springs: Springs,
    friction: Weakening,
    is_new: bool,
    is_elastic: bool,
    is_brittle: bool,
}

/// Whether the patches that two bodies' faces share have nodes: one of them has a mesh, whether or not it deforms now.
fn has_mortars(model: &Model, bodies: [usize; 2]) -> bool {
    bodies.iter().any(|body| model.bodies[*body].meshed_surface().is_some())
}

impl<'a> Meeting<'a> {
    fn new(pair: &PairWork, model: &'a Model, view: &'a View<'a>) -> Self {
        let bodies = [pair.a(), pair.b()];
        let shapes = bodies.map(|body| &model.shapes[body]);
        Meeting {
            model,
            view,
            bodies,
            shapes,
            springs: pair.springs,
            friction: pair.friction,
            is_new: pair.is_new,
            is_elastic: pair.is_elastic,
            is_brittle: pair.is_brittle,
        }
    }

    /// Of a contact of this spring [N/m], before what its bodies' displacements, faces and damage change.
    fn state(&self, start: &Start, spring: f64) -> PointState {
        let roundings = self.shapes.map(|shape| shape.rounded.radius);
        PointState {
            stretch: start.stretch,
            is_new: self.is_new,
            initial_overlap: start.initial_overlap,
            ..PointState::of_spring(roundings, spring, self.friction)
        }
    }

    fn side(&self, body: usize) -> Side<'a> {
        let View { grains, poses, fields, committed, .. } = *self.view;
        Side {
            surface: self.model.bodies[body].stressed_surface(),
            grain: grains[body].as_ref().map(|bends| &**bends.grain()),
            pose: &poses[body],
            now: &fields[body],
            committed: committed.get(body).map_or(&[], |field| &field[..]),
        }
    }

    /// What damage of a body leaves of the stiffness of a contact at a `place` of its surface, which is at `point` in space.
    fn stiffness_left_of(&self, body: usize, place: &Option<SurfacePoint>, point: &Vec3) -> f64 {
        let (own, shape) = (&self.model.bodies[body], &self.model.shapes[body]);
        let on_rubble = |place: &SurfacePoint| {
            let depth = RUBBLE_DEPTH * shape.rounded.radius;
            own.damaged().is_some_and(|grain| !grain.rubble().is_empty())
                && (place.position - self.view.poses[body].to_body(point)).norm() > depth
        };
        match place {
            _ if own.is_rubble() => LEAST_STIFFNESS_LEFT,
            Some(place) if on_rubble(place) => LEAST_STIFFNESS_LEFT,
            Some(place) if own.is_brittle() => {
                self.view.trial.stiffness_left(self.model, body, place.facet).max(LEAST_STIFFNESS_LEFT)
            }
            Some(_) | None => 1.0,
        }
    }

    /// By how much less its bodies yield by the spring of a contact there, or a patch, than rigid ones [m/N, m^3/N].
    fn spared(&self, feature: Feature) -> f64 {
        if !self.is_elastic {
            return 0.0;
        }
        let deforming = self.bodies.into_iter().filter(|body| self.model.bodies[*body].is_elastic());
        deforming.map(|body| self.model.spares(body, feature)).sum()
    }

    /// The number of a contact's place among `known`, found where it is not there yet, `on` its surfaces where that is given.
    fn place(
        &self,
        site: &Site,
        sites: &SitePoints,
        state: &PointState,
        on: Option<&[Option<SurfacePoint>; 2]>,
        known: &mut Known<'_>,
        last: Option<&Multiplier>,
    ) -> usize {
        if let Some(number) = known.places.iter().position(|place| place.feature == site.feature) {
            return number;
        }
        let [a, b] = self.bodies;
        let sides = [self.side(a), self.side(b)];
        let (point, normal) = force::place(site, sites, state.radius_difference);
        // Behind an asperity it follows from the last force.
        let first_scale = || last.map_or(self.view.first_scale, |multiplier| multiplier.scale);
        let scale = state.asperity.is_none().then(first_scale);
        let on =
            on.cloned().unwrap_or_else(|| [sides[0].look(&point, &normal), sides[1].look(&point, &-normal)]);
        let mut place = ContactPlace::new(site.feature, sides, on, &normal, scale);
        if self.is_elastic && self.view.yields && scale.is_none() {
            place.yield_at_once(sides, &normal, last);
        }
        if self.is_brittle {
            let stiffness_left = [
                self.stiffness_left_of(a, &place.on_a, &point),
                self.stiffness_left_of(b, &place.on_b, &point),
            ];
            let left = self.model.softened_share(self.bodies, site.feature, stiffness_left);
            let memory = known.carried.point(site.feature);
            place.stiffness_left = memory.map_or(left, |memory| memory.stiffness_left.min(left));
        }
        known.places.push(place);
        known.places.len() - 1
    }

    /// The points of the patch that two rigid faces share, of a stiffness per area [N/m^3].
    fn patch(
        &self,
        law: &ContactLaw,
        facing: &Facing<'_>,
        carried: &PairMemory,
        per_area: f64,
    ) -> impl Iterator<Item = ContactPoint> {
        let faces = facing.in_space(self.bodies.map(|body| &self.view.poses[body]));
        let spring = per_area * faces.reference_area() / patch::POINTS as f64;
        let sites = std::array::from_fn(|k| facing.site(k as u32));
        let states = sites.map(|site: Site| self.state(&Start::of(carried, site.feature), spring));
        let met = patch::evaluate(law, &faces, self.bodies.map(|body| &self.view.kinematics[body]), &states);
        let spanned = SitePoints { a: [Vec3::zeros(); 3], b: [Vec3::zeros(); 3], normals: facing.normals };
        let all = sites.into_iter().zip(states).zip(met.into_iter().flatten());
        all.map(move |((site, state), evaluation)| ContactPoint {
            site,
            sites: spanned,
            state,
            evaluation,
            stiffness_left: 1.0,
        })
    }

    fn point(
        &self,
        law: &ContactLaw,
        site: Site,
        sites: SitePoints,
        mut state: PointState,
        on: Option<&[Option<SurfacePoint>; 2]>,
        (start, known): (&mut Start, &mut Known<'_>),
    ) -> ContactPoint {
        let seeks = self.is_elastic || self.is_brittle && start.stiffness_left.is_none();
        let of_feature = |multiplier: &&Multiplier| multiplier.feature == site.feature;
        let last = seeks.then(|| known.multipliers.iter().find(of_feature)).flatten();
        let place = seeks.then(|| self.place(&site, &sites, &state, on, known, last));
        let place = place.map(|number| &known.places[number]);
        start.stiffness_left = place.map_or(start.stiffness_left, |place| Some(place.stiffness_left));
        let spring = state.spring;
        let stiffness_left = start.stiffness_left.unwrap_or(1.0);
        if stiffness_left != 1.0 {
            (state.spring, state.stiffness) = (spring * stiffness_left, spring * stiffness_left);
            state.asperity.iter_mut().for_each(|asperity| asperity.share *= stiffness_left);
        }
        if self.is_brittle {
            let share = spring / self.springs.at(site.feature);
            state.hardening = state.spring / (1.0 + state.spring * self.spared(site.feature) / share);
        }
        if let Some(place) = place.filter(|_| self.is_elastic) {
            state.elastic = place.elastic;
            state.elastic_change = place.change;
            if let Some(returned) = place.returned {
                (state.compliance, state.returned) = (place.compliance, returned);
            } else {
                state.stiffness = 1.0 / (1.0 / state.spring + place.compliance);
                if let Some(multiplier) = last {
                    state.offset = place.compliance * multiplier.load;
                    known.offset = known.offset.max(state.offset);
                    let tangential = place.compliance / self.model.law.tangential_ratio;
                    state.behind_stretch = multiplier.traction * tangential;
                }
            }
        }
        let kinematics = self.bodies.map(|body| &self.view.kinematics[body]);
        let evaluation = Situation { law, site: &site, points: &sites, kinematics, state: &state }.evaluate();
        ContactPoint { site, sites, state, evaluation, stiffness_left }
    }
}
