//! What contacts crush of the rock at their asperities, which stays so when bodies part, slide on or meet others.

use crate::assembly::{ContactPoint, PairWork};
use crate::contact::memory::{Crushable, Crushed};
use crate::contact::{Asperity, Feature};
use crate::model::Model;

/// How deep a contact has crushed its asperity now [m].
pub(super) fn depth_of(point: &ContactPoint) -> f64 {
    point.state.asperity.map_or(0.0, |a| a.law.crushed(point.evaluation.indentation, a.depth))
}

impl PairWork {
    /// The asperity of one of its features, where it has one, and the indentation [m] at which its force over share and weight is `force` [N], crushed to `depth` [m].
    pub(super) fn indentation_for(
        &self,
        model: &Model,
        feature: Feature,
        force: f64,
        depth: f64,
    ) -> Option<f64> {
        let asperity: Asperity = model.asperity([self.a(), self.b()], feature)?;
        Some(asperity.indentation_for(force, depth))
    }

    /// How deep its contacts have crushed their asperities in the configuration last evaluated [m]; where what they began with `is_known`, only of those
    /// that are deeper now.
    pub(super) fn crushed(&self, is_known: bool) -> Vec<(Crushable, f64)> {
        let deeper = |point: &ContactPoint| {
            let depth = depth_of(point);
            let noted = point.state.asperity.filter(|_| is_known).map_or(0.0, |began| began.depth);
            let place = Crushable::of((self.key(), point.site.feature)).filter(|_| depth > noted);
            Some((place?, depth))
        };
        self.active().filter_map(deeper).collect()
    }

    /// Work that crushing has taken since the committed state [J].
    pub(super) fn work_of_crushing(&self) -> f64 {
        let work = |point: &ContactPoint| {
            let Some(asperity) = point.state.asperity else { return 0.0 };
            let depth = depth_of(point);
            if depth <= asperity.depth {
                return 0.0;
            }
            let now = point.evaluation.weight;
            let known = self.carried.point(point.site.feature).filter(|memory| memory.load > 0.0);
            let weight = 0.5 * (now + known.map_or(now, |memory| memory.pressure / memory.load));
            let law = asperity.law;
            weight * asperity.share * (law.work_of_crushing(depth) - law.work_of_crushing(asperity.depth))
        };
        self.active().map(work).sum()
    }
}

/// Notes what is crushed in `crushed`.
pub(super) fn note(crushed: &mut Crushed, places: impl IntoIterator<Item = (Crushable, f64)>) {
    for (place, depth) in places {
        let deepest = crushed.entry(place).or_insert(0.0);
        *deepest = deepest.max(depth);
    }
}
