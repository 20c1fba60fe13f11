//! What contacts remember between increments: forces, tangential stretch, slip.
//!
//! Kept per pair of bodies and feature, so that nothing has to be transported when a contact
//! slides: its identity is the feature. A pair forgets its friction once it separates (healing); what is crushed stays crushed.

use crate::contact::features::Feature;
use crate::contact::mortar::{Mortar, MortarNode};
pub use crate::contact::point_memory::PointMemory;
use crate::tensor::Vec3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};

/// Two bodies in contact, the smaller index first.
pub type PairKey = (u32, u32);

/// One contact of the model.
pub type ContactKey = (PairKey, Feature);

/// A feature that its contacts crush: a body's corner, whichever body it meets, or where two edges cross.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Crushable {
    Corner { body: u32, vertex: u32 },
    Edges { bodies: PairKey, edges: (u32, u32) },
}

impl Crushable {
    /// What a contact crushes; `None` where faces carry.
    pub fn of((bodies, feature): ContactKey) -> Option<Self> {
        match feature {
            Feature::VertexOfA(vertex) => Some(Crushable::Corner { body: bodies.0, vertex }),
            Feature::VertexOfB(vertex) => Some(Crushable::Corner { body: bodies.1, vertex }),
            Feature::Edges(i, j) => Some(Crushable::Edges { bodies, edges: (i, j) }),
            Feature::Faces(..) => None,
        }
    }

    fn is_on(&self, index: u32) -> bool {
        match self {
            Crushable::Corner { body, .. } => *body == index,
            Crushable::Edges { bodies, .. } => bodies.0 == index || bodies.1 == index,
        }
    }
}

/// How deep features have been crushed [m], whatever they touch now.
pub type Crushed = BTreeMap<Crushable, f64>;

/// Memory of a pair of bodies.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct PairMemory {
    /// Slip of the pair since it touched [m].
    pub slip: f64,
    /// Sorted by feature.
    pub points: Vec<PointMemory>,
    /// Of the patches that its meshed faces share.
    pub mortars: Vec<Mortar>,
}

impl PairMemory {
    /// How far contacts may be ahead of the geometry [m].
    pub fn initial_overlap(&self) -> f64 {
        self.points.iter().map(|p| p.initial_overlap).fold(0.0, f64::max)
    }

    /// What its contacts' tangential springs have stored [J].
    pub fn tangential_energy(&self) -> f64 {
        self.points.iter().map(|point| point.tangential_energy).sum()
    }

    /// Keeps `point` in place of what was known of its feature.
    pub fn put(&mut self, point: PointMemory) {
        match self.points.binary_search_by(|kept| kept.feature.cmp(&point.feature)) {
            Ok(known) => self.points[known] = point,
            Err(place) => self.points.insert(place, point),
        }
    }

    pub fn point(&self, feature: Feature) -> Option<&PointMemory> {
        self.points.binary_search_by(|p| p.feature.cmp(&feature)).ok().map(|i| &self.points[i])
    }

    /// The node of a meshed patch.
    pub fn node(&self, feature: Feature) -> Option<&MortarNode> {
        self.mortars.iter().find_map(|mortar| mortar.node(feature))
    }

    /// [`PointMemory::omitted`] of a feature [m]; nothing where it is not known.
    pub fn omitted(&self, feature: Feature) -> Vec3 {
        self.point(feature).map_or_else(Vec3::zeros, |point| point.omitted)
    }
}

/// Memory of all pairs, in a fixed order, as which it can be used, and of what their contacts crushed, which stays when they part.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    pairs: BTreeMap<PairKey, PairMemory>,
    pub crushed: Crushed,
}

impl Memory {
    pub fn new() -> Self {
        Memory::default()
    }

    /// Forgets what was crushed on a body: its features are others now.
    pub fn renew_features_of(&mut self, body: usize) {
        self.crushed.retain(|feature, _| !feature.is_on(body as u32));
    }
}

impl Deref for Memory {
    type Target = BTreeMap<PairKey, PairMemory>;
    fn deref(&self) -> &Self::Target {
        &self.pairs
    }
}

impl DerefMut for Memory {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.pairs
    }
}

impl FromIterator<(PairKey, PairMemory)> for Memory {
    fn from_iter<T: IntoIterator<Item = (PairKey, PairMemory)>>(pairs: T) -> Self {
        Memory { pairs: pairs.into_iter().collect(), crushed: Crushed::new() }
    }
}

impl<'a> IntoIterator for &'a Memory {
    type Item = (&'a PairKey, &'a PairMemory);
    type IntoIter = std::collections::btree_map::Iter<'a, PairKey, PairMemory>;
    fn into_iter(self) -> Self::IntoIter {
        self.pairs.iter()
    }
}

impl IntoIterator for Memory {
    type Item = (PairKey, PairMemory);
    type IntoIter = std::collections::btree_map::IntoIter<PairKey, PairMemory>;
    fn into_iter(self) -> Self::IntoIter {
        self.pairs.into_iter()
    }
}
