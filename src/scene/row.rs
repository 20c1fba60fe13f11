//! What is known of a scene after an accepted increment.

use crate::loading::{FidelityCounts, Ledger};
use crate::model::{Counters, DamageCounts};
use crate::solver::{Balance, ContactMeasures};
use crate::tensor::Vec3;

/// An accepted increment.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Counted from 0.
    pub stage: usize,
    /// Accepted increments so far, this one included.
    pub increment: usize,
    /// Share of the stage that is done.
    pub progress: f64,
    /// In the order of the scene's bodies.
    pub bodies: Vec<BodyState>,
    /// Since the start of the scene. External work is that of prescriptions, applied forces and gravity.
    pub ledger: Ledger,
    pub damage: DamageCounts,
    pub fidelity: FidelityCounts,
    /// [m/s^2]
    pub gravity: Vec3,
    pub balance: Balance,
    pub measures: ContactMeasures,
    pub counters: Counters,
    /// Whether it snapped to another equilibrium: what it leaves over is then booked as set free.
    pub snapped: bool,
}

/// Where a body is and what acts on it. Moments are about its reference point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyState {
    /// Of the reference point [m].
    pub position: Vec3,
    /// Rotation vector from body to space axes [rad].
    pub rotation: Vec3,
    /// Since the start of the scene [m].
    pub displacement: Vec3,
    /// Of all contacts on the body [N].
    pub contact_force: Vec3,
    /// [N m]
    pub contact_moment: Vec3,
    /// What holds or drives its prescribed components [N].
    pub reaction_force: Vec3,
    /// [N m]
    pub reaction_moment: Vec3,
}
