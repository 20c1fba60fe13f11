//! Contacts of bodies whose shape is new go on where those of the shape before left off.
//!
//! Contacts are known by the features that they join, and a body that has lost rock has others. Where it was not touched, it is where it was, so each contact
//! that is found there takes what was known of the nearest one of the same two bodies: how far friction has stretched it, by how much it is ahead of the
//! geometry, and how far the two have slipped. What it bears follows from that and the geometry.

use std::collections::BTreeMap;

use crate::assembly::{ContactPoint, Contacts, TooClose};
use crate::contact::Memory;
use crate::contact::memory::{PairKey, PairMemory, PointMemory};
use crate::model::fracture::Fracture;
use crate::model::{BodyKind, Committed, Model};

/// What was known of two bodies before.
struct Former<'a> {
    memory: &'a PairMemory,
    turned: bool,
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
                formers.insert(new, Former { memory, turned: a > b });
            }
        }
    }
    formers
}

impl Former<'_> {
    /// Its contact that is nearest to `point` and bore.
    fn nearest(&self, point: &ContactPoint) -> Option<&PointMemory> {
        let distance = |known: &PointMemory| (known.place - point.evaluation.point).norm_squared();
        let bearing = self.memory.points.iter().filter(|known| known.load > 0.0);
        bearing.min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// What the contact at `point` goes on with; `None` where it does not touch.
    fn heir(&self, point: &ContactPoint) -> Option<PointMemory> {
        let known = self.nearest(point).filter(|_| point.evaluation.weight > 0.0)?;
        let (feature, geometric) = (point.site.feature, point.geometric_overlap());
        let bears = geometric + known.initial_overlap > 0.0;
        // What is ahead of the geometry where it bore would close what is open further off.
        let is_there = geometric > 0.0 || (known.place - point.evaluation.point).norm() < point.state.radii;
        let sign = if self.turned { -1.0 } else { 1.0 };
        let omitted = known.omitted * sign;
        if bears && is_there {
            let (stretch, traction) = (known.stretch * sign, known.traction * sign);
            Some(PointMemory { feature, stretch, traction, omitted, stiffness_left: 1.0, ..*known })
        } else if geometric > 0.0 {
            Some(PointMemory { omitted, ..PointMemory::open(feature, known.initial_overlap) })
        } else {
            None
        }
    }
}

impl Contacts {
    /// Puts what contacts of the bodies that broke remembered into the committed memory of those that their new shapes have.
    /// Nothing where cores are so near that contacts cannot be evaluated.
    pub fn inherit(&mut self, model: &Model, committed: &mut Committed, fractures: &[Fracture]) {
        let formers = formers(model, fractures);
        if formers.is_empty() {
            return;
        }
        let forget = |memory: &mut Memory| memory.retain(|key, _| !formers.contains_key(key));
        // For where new contacts are: they are listed as far off as what is ahead of the geometry may close them.
        let listed = formers.iter().map(|(key, former)| (*key, former.memory.clone()));
        committed.memory.extend(listed);
        let found = self.evaluate_committed(model, committed).map(|()| self.heirs(&formers));
        forget(&mut committed.memory);
        let Ok(known) = found else { return };
        committed.memory.extend(known);
        // What they bear, and what friction can hold of it.
        if self.evaluate_committed(model, committed).is_ok() {
            let mut memory = self.memory(model);
            memory.retain(|key, _| formers.contains_key(key));
            forget(&mut committed.memory);
            committed.memory.extend(memory);
        }
    }

    /// Evaluates the contacts as committed.
    fn evaluate_committed(&mut self, model: &Model, committed: &Committed) -> Result<(), TooClose> {
        self.start(model, committed);
        self.evaluate(model, committed, &committed.poses)
    }

    fn heirs(&self, formers: &BTreeMap<PairKey, Former<'_>>) -> Memory {
        let mut memory = Memory::new();
        for pair in &self.pairs {
            let Some(former) = formers.get(&pair.key()) else { continue };
            let mut of_pair = PairMemory { slip: former.memory.slip, ..PairMemory::default() };
            for point in &pair.points {
                if let Some(heir) = former.heir(point) {
                    of_pair.put(heir);
                }
            }
            if !of_pair.points.is_empty() {
                memory.insert(pair.key(), of_pair);
            }
        }
        memory
    }
}
