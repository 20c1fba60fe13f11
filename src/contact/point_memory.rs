//! What one contact point remembers between increments.

use crate::contact::features::Feature;
use crate::tensor::Vec3;
use serde::{Deserialize, Serialize};

/// Memory of one contact point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PointMemory {
    pub feature: Feature,
    /// Where its force acted [m], in space.
    #[serde(with = "crate::tensor::stored")]
    pub place: Vec3,
    /// Tangential stretch of the contact's own spring [m], in space.
    #[serde(with = "crate::tensor::stored")]
    pub stretch: Vec3,
    /// Normal force, weight included [N].
    pub pressure: f64,
    /// Normal force over the weight [N].
    pub load: f64,
    /// The part of it that keeps the cores apart [N].
    pub hardened: f64,
    /// Friction force on `b` over the weight [N], in space.
    #[serde(with = "crate::tensor::stored")]
    pub traction: Vec3,
    /// What friction could hold over the weight: the coefficient in force times the load [N].
    pub bound: f64,
    /// Energy stored in the stretch [J].
    pub tangential_energy: f64,
    /// By how much the bodies overlap more than geometry and elastic displacements say [m]: what keeps the force where the fidelity
    /// of a body changed (`assembly::fidelity`).
    pub initial_overlap: f64,
    /// What the bodies' fidelities omit here that a change of fidelity has kept, or made up for [m], in
    /// space.
    #[serde(with = "crate::tensor::stored")]
    pub omitted: Vec3,
    /// The contact's compliance in a solve over the first guess, as far as it adapted.
    pub scale: f64,
    /// What damage of the rock below has left of the contact's spring; it never gets stiffer again.
    pub stiffness_left: f64,
    /// How deep its asperity has been crushed [m].
    pub depth: f64,
    /// Radius of the largest patch that it has had since it touched, which friction holds on to [m].
    pub grip: f64,
}

impl PointMemory {
    /// Normal force of the contact's own spring over the weight [N].
    pub fn sprung(&self) -> f64 {
        self.load - self.hardened
    }

    /// The same of a contact with `share` times its spring.
    #[must_use]
    pub fn of_spring(&self, share: f64) -> Self {
        PointMemory {
            pressure: self.pressure * share,
            load: self.load * share,
            hardened: self.hardened * share,
            traction: self.traction * share,
            bound: self.bound * share,
            tangential_energy: self.tangential_energy * share,
            ..*self
        }
    }

    /// The same of a contact with `1 / share` times the tangential spring under the same friction.
    #[must_use]
    pub fn stretched(&self, share: f64) -> Self {
        let (stretch, tangential_energy) = (self.stretch * share, self.tangential_energy * share);
        PointMemory { stretch, tangential_energy, ..*self }
    }

    /// Of a contact without a force whose gap is more open than the geometry says by `-initial_overlap` [m].
    pub fn open(feature: Feature, initial_overlap: f64) -> Self {
        PointMemory {
            feature,
            place: Vec3::zeros(),
            stretch: Vec3::zeros(),
            pressure: 0.0,
            load: 0.0,
            hardened: 0.0,
            traction: Vec3::zeros(),
            bound: 0.0,
            tangential_energy: 0.0,
            initial_overlap,
            omitted: Vec3::zeros(),
            stiffness_left: 1.0,
            scale: 1.0,
            depth: 0.0,
            grip: 0.0,
        }
    }
}
