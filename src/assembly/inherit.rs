//! Contacts of bodies whose shape or mesh is new go on where those before left off.
//!
//! Contacts are known by the features that they join, and a body that has lost rock has others. Where it was not touched, it is where it was, so each contact
//! that is found there takes what was known of the nearest one of the same two bodies: how far friction has stretched it, by how much it is ahead of the
//! geometry, and how far the two have slipped. What it bears follows from that and the geometry.
//!
//! Bodies that bend as they damage have bent where their rock failed: what is sound beside and below it is behind the neighbour's surface, which the failed
//! rock kept off. Met now, it would spend energy that nobody put in. So all heirs of a contact together bear no more than it did, and
//! a contact that is nobody's heir begins without a force.

use std::collections::{BTreeMap, BTreeSet};

use crate::assembly::{ContactPoint, Contacts, PairWork, TooClose};
use crate::contact::memory::{PairKey, PairMemory, PointMemory};
use crate::contact::{Feature, Memory};
use crate::model::fracture::Fracture;
use crate::model::{BodyKind, Committed, Model};

/// What was known of two bodies before.
struct Former<'a> {
    memory: &'a PairMemory,
    turned: bool,
    /// Whether both have the shape that they had, so that features are the same, but for the nodes of patches.
    same: bool,
}

/// What is known of pairs of bodies that bend with their damage and lost rock, but not their shape: their surfaces are other meshes now.
fn on_new_meshes(model: &Model, memory: &Memory, fractures: &[Fracture]) -> Vec<(PairKey, PairMemory)> {
    let is_new = |body: u32| {
        let keeps_shape = |it: &Fracture| it.body == body as usize && it.parts == [it.body];
        model.bodies[body as usize].softens_with_damage() && fractures.iter().any(keeps_shape)
    };
    let on_new = memory.iter().filter(|(key, _)| is_new(key.0) || is_new(key.1));
    on_new.map(|(key, known)| (*key, known.clone())).collect()
}

/// What was known of the pairs that bodies which broke, or their parts, make now.
fn formers<'a>(model: &Model, fractures: &'a [Fracture]) -> BTreeMap<PairKey, Former<'a>> {
    let parts: BTreeMap<u32, &[usize]> =
        fractures.iter().map(|fracture| (fracture.body as u32, &fracture.parts[..])).collect();
    let is_there = |body: &usize| model.bodies[*body].kind != BodyKind::Gone;
    let now = |body: u32| -> Vec<usize> {
        let parts = parts.get(&body).map_or_else(|| vec![body as usize], |parts| parts.to_vec());
        parts.into_iter().filter(is_there).collect()
    };
    let mut formers = BTreeMap::new();
    for (key, memory) in fractures.iter().flat_map(|fracture| &fracture.former) {
        for a in now(key.0) {
            for b in now(key.1) {
                let new = (a.min(b) as u32, a.max(b) as u32);
                formers.insert(new, Former { memory, turned: a > b, same: false });
            }
        }
    }
    formers
}

impl Former<'_> {
    /// The contact that one at `point` goes on for: the nearest one that bore.
    fn before(&self, point: &ContactPoint) -> Option<&PointMemory> {
        let feature = point.site.feature;
        if self.same && !matches!(feature, Feature::Faces(..)) {
            return self.memory.point(feature).filter(|known| known.load > 0.0);
        }
        let distance = |known: &PointMemory| (known.place - point.evaluation.point).norm_squared();
        let bearing = self.memory.points.iter().filter(|known| known.load > 0.0);
        bearing.min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// What the contact at `point` goes on with, `known` being of the one before; `None` where it does not touch. `overlap` is that without what the
    /// contact is ahead of it [m].
    fn heir(&self, point: &ContactPoint, known: PointMemory, overlap: f64) -> Option<PointMemory> {
        let feature = point.site.feature;
        let bears = overlap + known.initial_overlap > 0.0;
        // What is ahead of the geometry where it bore would close what is open further off.
        let is_there = overlap > 0.0 || (known.place - point.evaluation.point).norm() < point.state.radii;
        let sign = if self.turned { -1.0 } else { 1.0 };
        let omitted = known.omitted * sign;
        if bears && is_there {
            let (stretch, traction) = (known.stretch * sign, known.traction * sign);
            Some(PointMemory { feature, stretch, traction, omitted, stiffness_left: 1.0, ..known })
        } else if overlap > 0.0 {
            Some(PointMemory { omitted, ..PointMemory::open(feature, known.initial_overlap) })
        } else {
            None
        }
    }

    fn heirs(&self, pair: &PairWork) -> Vec<PointMemory> {
        let weighted = pair.points.iter().filter(|point| point.evaluation.weight > 0.0);
        weighted
            .filter_map(|point| self.heir(point, *self.before(point)?, point.geometric_overlap()))
            .collect()
    }

    /// The same of bodies that bend with their damage.
    fn sharing_heirs(&self, model: &Model, pair: &PairWork) -> Vec<PointMemory> {
        // Without what the contact is ahead of it.
        let overlap = |point: &ContactPoint| -point.evaluation.gap - point.state.initial_overlap;
        let touches = |point: &&ContactPoint| {
            let ahead = self.before(point).map_or(0.0, |known| known.initial_overlap);
            point.evaluation.weight > 0.0 && overlap(point) + ahead.max(0.0) > 0.0
        };
        let touching: Vec<&ContactPoint> = pair.points.iter().filter(touches).collect();
        let mut springs: BTreeMap<Feature, f64> = BTreeMap::new();
        for point in &touching {
            if let Some(known) = self.before(point) {
                *springs.entry(known.feature).or_default() += point.evaluation.weight * point.state.spring;
            }
        }
        let heir = |point: &ContactPoint| {
            let (feature, spring) = (point.site.feature, point.state.spring);
            let Some(known) = self.before(point) else {
                return Some(PointMemory::open(feature, -overlap(point)));
            };
            let weight = known.pressure / known.load;
            let before = weight
                * match self.memory.node(known.feature) {
                    Some(node) => pair.springs.patch * node.area,
                    None if self.same && known.feature == feature => spring,
                    None => pair.springs.contact,
                };
            let all = springs.get(&known.feature).map_or(before, |all| all.max(before));
            let mut known = known.of_spring(weight * spring / all).stretched(before / all);
            let borne = match point.state.asperity {
                Some(asperity) => asperity.law.indentation_for(known.sprung() / asperity.share, known.depth),
                None => model.law_at(feature).overlap_for(known.sprung() / spring),
            };
            known.initial_overlap = known.initial_overlap.min(borne - overlap(point));
            self.heir(point, known, overlap(point))
        };
        touching.into_iter().filter_map(heir).collect()
    }
}

impl Contacts {
    /// Puts what contacts of the bodies that broke remembered into the committed memory of those that their new shapes have.
    /// Nothing where cores are so near that contacts cannot be evaluated.
    pub fn inherit(&mut self, model: &Model, committed: &mut Committed, fractures: &[Fracture]) {
        let on_new_meshes = on_new_meshes(model, &committed.memory, fractures);
        let mut formers = formers(model, fractures);
        let same = |memory| Former { memory, turned: false, same: true };
        formers.extend(on_new_meshes.iter().map(|(key, memory)| (*key, same(memory))));
        if formers.is_empty() {
            return;
        }
        // For where new contacts are: they are listed as far off as what is ahead of the geometry may close them. Nodes of patches are found anew.
        let without_nodes = |memory: &PairMemory| PairMemory { mortars: Vec::new(), ..memory.clone() };
        let listed = formers.iter().map(|(key, former)| (*key, without_nodes(former.memory)));
        committed.memory.extend(listed);
        let broken: BTreeSet<usize> = fractures.iter().flat_map(|it| it.parts.iter().copied()).collect();
        let found = self.evaluate_committed(model, committed).map(|()| self.heirs(model, &formers, &broken));
        committed.memory.retain(|key, _| !formers.contains_key(key));
        let Ok(known) = found else {
            tracing::warn!(
                "bodies too near to each other: contacts of new shapes begin without what was known"
            );
            // Bodies that kept their shapes keep what is known of their contacts but for the nodes of patches.
            for (key, mut kept) in on_new_meshes {
                kept.mortars.clear();
                kept.points.retain(|point| !matches!(point.feature, Feature::Faces(..)));
                committed.memory.insert(key, kept);
            }
            return;
        };
        let renewed: BTreeSet<PairKey> = known.keys().chain(formers.keys()).copied().collect();
        committed.memory.extend(known);
        // What they bear, and what friction can hold of it.
        if self.evaluate_committed(model, committed).is_ok() {
            let mut memory = self.memory(model);
            memory.retain(|key, _| renewed.contains(key));
            committed.memory.retain(|key, _| !renewed.contains(key));
            committed.memory.extend(memory);
        }
    }

    /// Evaluates the contacts as committed.
    fn evaluate_committed(&mut self, model: &Model, committed: &Committed) -> Result<(), TooClose> {
        self.start(model, committed);
        self.evaluate(model, committed, &committed.poses)
    }

    fn heirs(
        &self,
        model: &Model,
        formers: &BTreeMap<PairKey, Former<'_>>,
        broken: &BTreeSet<usize>,
    ) -> Memory {
        let mut memory = Memory::new();
        let nothing = PairMemory::default();
        let strangers = Former { memory: &nothing, turned: false, same: true };
        for pair in &self.pairs {
            let bodies = [pair.a(), pair.b()];
            let bends = bodies.iter().any(|body| model.bodies[*body].softens_with_damage());
            let is_new = bends && bodies.iter().any(|body| broken.contains(body));
            let Some(former) = formers.get(&pair.key()).or(is_new.then_some(&strangers)) else { continue };
            let heirs = if bends { former.sharing_heirs(model, pair) } else { former.heirs(pair) };
            let mut of_pair = PairMemory { slip: former.memory.slip, ..PairMemory::default() };
            heirs.into_iter().for_each(|heir| of_pair.put(heir));
            if !of_pair.points.is_empty() {
                memory.insert(pair.key(), of_pair);
            }
        }
        memory
    }
}
