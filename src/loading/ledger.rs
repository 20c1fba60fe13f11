//! The energy ledger: work done from outside and where it went [J].

use serde::{Deserialize, Serialize};

use crate::solver::IncrementReport;

/// Energies since the start of the test [J].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// Work of the ram and of the pressure.
    pub external: f64,
    /// Stored in contacts (and grains), less what was stored at the start.
    pub elastic: f64,
    pub friction: f64,
    /// Set free by damage, deleted cells and parts that were given up, and what crushing took.
    pub damage: f64,
    /// Of the damage what contacts on failed rock had stored, and the work against their forces while these were taken away.
    pub crushing: f64,
    /// Of the damage what contacts crushed of the rock at their asperities.
    pub indentation: f64,
    /// Stored in a rubber membrane's sheet, less what was stored at the start.
    pub membrane: f64,
    /// Of the forces out of balance, summed along the way: of the drag on what moves, and of displacements behind the forces that they follow. In a scene,
    /// and where bodies bend behind springs, what snaps leave over.
    pub stabilisation: f64,
    /// What contacts gained where breaking changed the shapes of bodies: it came from nowhere, and is taken off `elastic` in the error.
    pub reshaped: f64,
}

impl Ledger {
    /// Enters what contacts and bodies lost in an increment.
    pub fn lose(&mut self, report: &IncrementReport) {
        self.friction += report.lost.friction;
        self.damage += report.damage_work();
        self.indentation += report.lost.crushing;
    }

    /// External work that no row accounts for [J].
    pub fn error(&self) -> f64 {
        let spent = self.friction + self.damage + self.membrane + self.stabilisation;
        self.external + self.reshaped - self.elastic - spent
    }
}

/// An increment whose rows hold this share more than it had to spend has jumped to a state that the bodies
/// cannot reach.
const CREATION_LIMIT: f64 = 0.5;
/// Less than this share of the energy stored in all contacts does not count as created.
const CREATION_FLOOR: f64 = 1e-2;

/// Whether an increment ends with more energy than it had: `gap` [J], negative where its rows hold more than
/// the external work; `spent` [J], external work and elastic energy released; `stored` [J] in all contacts.
/// What moves against a drag loses energy, whatever its way; a solver that leaps over a barrier can gain some.
pub fn creates_energy(gap: f64, spent: f64, stored: f64) -> bool {
    -gap > (CREATION_LIMIT * spent.max(0.0)).max(CREATION_FLOOR * stored)
}

/// Share of the work on bodies that nothing bore which contacts take up where these only meet them: all of it where a force grows with the
/// displacement, 0.8 where it grows as Hertz's (the work is that of the mean force), half where it grows with the cube.
const FALL_LIMIT: f64 = 0.5;

/// Whether bodies that nothing bore at the start of an increment fell in it: of the `work` [J] that their loads did, most is `left_over` [J], since
/// bodies fell freely before anything caught them.
pub fn fell(work: f64, left_over: f64) -> bool {
    work > 0.0 && left_over > (1.0 - FALL_LIMIT) * work
}

/// How well the energy of an increment has to close, and what a breach does.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EnergyGate {
    /// Energy that no row accounts for over the larger of the work that ram and pressure exchange and what is lost; infinite: no gate.
    pub tolerance: f64,
    /// Whether a breach cuts the increment, down to the smallest.
    pub cuts: bool,
}

impl Default for EnergyGate {
    fn default() -> Self {
        EnergyGate { tolerance: f64::INFINITY, cuts: false }
    }
}

impl EnergyGate {
    /// Whether the `gap` [J] of an increment is too large for its `turnover` [J]. Forces that are out
    /// of balance by the share `force_tolerance` store that share squared of the `stored` energy [J]
    /// of all contacts, about: where hardly any work is done, a gap below it says nothing.
    pub fn is_breached(&self, gap: f64, turnover: f64, stored: f64, force_tolerance: f64) -> bool {
        let floor = force_tolerance * force_tolerance * stored;
        self.tolerance.is_finite() && gap.abs() > (self.tolerance * turnover).max(floor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_energy_from_nowhere_counts_as_created() {
        // As met: 1.4 J of work, 8.4 J more stored, 6.6 J of friction.
        assert!(creates_energy(1.4 - 8.4 - 6.6, 1.4, 25.0));
        // A snap: 8 J released, some of it in no row.
        assert!(!creates_energy(1.0 + 8.0 - 7.0, 9.0, 20.0));
        // Nothing was spent, and what is missing is rounding.
        assert!(!creates_energy(-1e-3, -0.1, 20.0));
    }

    #[test]
    fn a_fall_leaves_most_of_its_work_over() {
        // A force F ~ u^n stores F u / (n + 1), of F u / 2 that the mean load did.
        let left_over = |n: f64| 0.5 - 1.0 / (n + 1.0);
        assert!([1.0, 1.5, 2.0].into_iter().all(|n| !fell(0.5, left_over(n))));
        // A millimetre of air, then 2 um of an elastic contact.
        assert!(fell(0.5 * 1.002, 0.5 * 1.002 - 0.5 * 0.002));
        // Nothing that was loose moved; or something that was borne fell.
        assert!(!fell(0.0, 0.0) && !fell(0.0, 1.0) && !fell(-1.0, 1.0));
    }

    #[test]
    fn gate_is_breached_by_gaps_beyond_its_share_of_the_turnover() {
        let ledger = Ledger {
            external: 2.0,
            elastic: 0.7,
            friction: 0.8,
            damage: 0.1,
            crushing: 0.05,
            indentation: 0.02,
            membrane: 0.3,
            stabilisation: 0.05,
            reshaped: 0.0,
        };
        assert!((ledger.error() - 0.05).abs() < 1e-15);
        let gate = EnergyGate { tolerance: 1e-3, cuts: false };
        assert!(!gate.is_breached(0.9e-3, 1.0, 5.0, 1e-3));
        assert!(gate.is_breached(-1.1e-3, 1.0, 5.0, 1e-3));
        // A hold: what is left comes from the tolerance of the forces.
        assert!(!gate.is_breached(4e-6, 0.0, 5.0, 1e-3));
        assert!(gate.is_breached(6e-6, 0.0, 5.0, 1e-3));
        assert!(!EnergyGate::default().is_breached(1.0, 0.0, 5.0, 1e-3));
    }
}
