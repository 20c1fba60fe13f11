//! The energy ledger: work done from outside and where it went [J].

/// Energies since the start of the test [J].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ledger {
    /// Work of the ram and of the pressure.
    pub external: f64,
    /// Stored in contacts (and grains), less what was stored at the start.
    pub elastic: f64,
    pub friction: f64,
    /// Set free in increments that snapped to another equilibrium, where the stabilising term
    /// stands in for motion and its damping. Known by balance only: what these increments leave over.
    pub stabilisation: f64,
}

impl Ledger {
    /// External work that no row accounts for [J].
    pub fn error(&self) -> f64 {
        self.external - self.elastic - self.friction - self.stabilisation
    }
}

/// Rounding of the energies' sums, over their size.
const ROUNDING: f64 = 1e-10;

/// How well the energy of an increment has to close, and what a breach does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnergyGate {
    /// Energy that no row accounts for over the work that ram and pressure exchange; infinite: no gate.
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
    /// Whether the `gap` [J] of an increment is too large for its `turnover` [J]. What rounding
    /// of the sums in `ledger` can make is none.
    pub fn is_breached(&self, gap: f64, turnover: f64, ledger: &Ledger) -> bool {
        let size = ledger.external.abs() + ledger.elastic.abs() + ledger.friction;
        self.tolerance.is_finite() && gap.abs() > self.tolerance * turnover + ROUNDING * size
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gate_is_breached_by_gaps_beyond_its_share_of_the_turnover() {
        let ledger = Ledger { external: 2.0, elastic: 1.0, friction: 0.9, stabilisation: 0.05 };
        assert!((ledger.error() - 0.05).abs() < 1e-15);
        let gate = EnergyGate { tolerance: 1e-3, cuts: false };
        assert!(!gate.is_breached(0.9e-3, 1.0, &ledger));
        assert!(gate.is_breached(-1.1e-3, 1.0, &ledger));
        // Nothing moved: what is left is rounding.
        assert!(!gate.is_breached(1e-11, 0.0, &ledger));
        assert!(!EnergyGate::default().is_breached(1.0, 0.0, &ledger));
    }
}
