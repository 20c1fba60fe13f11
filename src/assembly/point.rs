//! A contact point of a pair in the configuration last evaluated.

use crate::contact::Site;
use crate::contact::force::{Evaluation, PointState, SitePoints};

/// One contact point in the present configuration.
#[derive(Debug, Clone, Copy)]
pub struct ContactPoint {
    pub site: Site,
    pub sites: SitePoints,
    pub state: PointState,
    pub evaluation: Evaluation,
    /// What damage of the rock below has left of the contact's spring.
    pub stiffness_left: f64,
}

impl ContactPoint {
    /// By how much it is open [m]: what is crushed of its asperity takes up no room any more.
    pub fn opening(&self) -> f64 {
        self.evaluation.gap + self.state.asperity.map_or(0.0, |asperity| asperity.depth)
    }

    /// How deep the undeformed bodies overlap here [m]: without elastic displacements, and without the
    /// initial overlap of a change of fidelity.
    pub fn geometric_overlap(&self) -> f64 {
        self.evaluation.normal.dot(&self.state.elastic) - self.evaluation.gap - self.state.initial_overlap
    }
}
