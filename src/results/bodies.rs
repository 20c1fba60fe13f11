//! `/bodies/<name>`: where each scene body is and what acts on it, one row per accepted increment.

use crate::tensor::Vec3;

use super::history::Quantity;

/// One body after one accepted increment. Vectors are in space axes; moments are about the body's
/// reference point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyRow {
    /// Position of the reference point [m].
    pub position: Vec3,
    /// Rotation vector that takes body axes to space axes [rad], as `rotation` in the case file.
    pub rotation: Vec3,
    /// Displacement of the reference point since the start [m].
    pub displacement: Vec3,
    /// Resultant of the contact forces on the body [N].
    pub force: Vec3,
    /// Resultant moment of the contact forces on the body [N m].
    pub moment: Vec3,
    /// Force that the body's prescription exerts on it [N].
    pub reaction_force: Vec3,
    /// Moment that the body's prescription exerts on it [N m].
    pub reaction_moment: Vec3,
}

/// The datasets of `/bodies/<name>`, each of shape (increments, 3), in the order of [`BodyRow::vectors`].
pub const BODY_QUANTITIES: [Quantity; 7] = [
    Quantity::measured("position", "m", "position of the reference point", 3),
    Quantity::measured("rotation", "rad", "rotation vector from body axes to space axes", 3),
    Quantity::measured("displacement", "m", "displacement of the reference point since the start", 3),
    Quantity::measured("force", "N", "resultant of the contact forces on the body", 3),
    Quantity::measured(
        "moment",
        "N m",
        "moment of the contact forces on the body about its reference point",
        3,
    ),
    Quantity::measured("reaction_force", "N", "force that the body's prescription exerts on it", 3),
    Quantity::measured("reaction_moment", "N m", "moment that the body's prescription exerts on it", 3),
];

impl BodyRow {
    /// The row's vectors in the order of [`BODY_QUANTITIES`].
    pub fn vectors(&self) -> [Vec3; 7] {
        [
            self.position,
            self.rotation,
            self.displacement,
            self.force,
            self.moment,
            self.reaction_force,
            self.reaction_moment,
        ]
    }
}
