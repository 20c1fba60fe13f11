//! What contacts crush of the rock at their asperities, which stays so when bodies part, slide on or meet others.

use rayon::prelude::*;

use crate::assembly::{ContactPoint, Contacts, PairWork};
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
}

/// Notes in `crushed` what contacts have crushed in the configuration last evaluated; where what they began with `is_known` there, only what is deeper.
pub(super) fn deepen(crushed: &mut Crushed, pairs: &[PairWork], is_known: bool) {
    for (pair, point) in pairs.iter().flat_map(|pair| pair.active().map(move |point| (pair, point))) {
        let depth = depth_of(point);
        let noted = point.state.asperity.filter(|_| is_known).map_or(0.0, |began| began.depth);
        if let Some(place) = Crushable::of((pair.key(), point.site.feature)).filter(|_| depth > noted) {
            let deepest = crushed.entry(place).or_insert(0.0);
            *deepest = deepest.max(depth);
        }
    }
}

impl Contacts {
    /// Work that crushing has taken since the committed state [J].
    pub fn work_of_crushing(&self) -> f64 {
        let work = |pair: &PairWork, point: &ContactPoint| {
            let Some(asperity) = point.state.asperity else { return 0.0 };
            let depth = depth_of(point);
            if depth <= asperity.depth {
                return 0.0;
            }
            let now = point.evaluation.weight;
            let known = pair.carried.point(point.site.feature).filter(|memory| memory.load > 0.0);
            let weight = 0.5 * (now + known.map_or(now, |memory| memory.pressure / memory.load));
            let law = asperity.law;
            weight * asperity.share * (law.work_of_crushing(depth) - law.work_of_crushing(asperity.depth))
        };
        let all =
            self.pairs.par_iter().flat_map_iter(|pair| pair.active().map(move |point| work(pair, point)));
        all.collect::<Vec<f64>>().into_iter().sum()
    }
}
