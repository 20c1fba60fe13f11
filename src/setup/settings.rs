//! Solver settings and the energy gate of a case.

use crate::case::{Case, GateCase, SolverCase};
use crate::loading::EnergyGate;
use crate::solver::{DamageSettings, Settings, Stabilisation};

/// What is done about an increment whose energy closes badly.
pub fn energy_gate(solver: &SolverCase) -> EnergyGate {
    match solver.energy_gate {
        None => EnergyGate::default(),
        Some(GateCase::Warn) => EnergyGate { tolerance: solver.energy_tolerance, cuts: false },
        Some(GateCase::Cut) => EnergyGate { tolerance: solver.energy_tolerance, cuts: true },
    }
}

/// Solver settings of a specimen in its rig; what the case does not mention is as usual.
pub fn rig_settings(case: &Case) -> Settings {
    let solver = &case.solver;
    Settings {
        stabilisation: solver.stabilisation.map_or(Stabilisation::Rest, Stabilisation::Unrest),
        // Halvings that stay above the smallest increment.
        max_cuts: (-solver.increment_min.log2() + 1e-9).floor().max(0.0) as usize,
        ..settings_of_all(case)
    }
}

/// Solver settings of a scene; what the case does not mention is as usual.
pub fn scene_settings(case: &Case) -> Settings {
    Settings { max_dwell: case.solver.max_dwell, ..settings_of_all(case) }
}

fn settings_of_all(case: &Case) -> Settings {
    let solver = &case.solver;
    Settings {
        force_tolerance: solver.force_tolerance,
        gap_tolerance: solver.gap_tolerance,
        max_augmentations: solver.max_augmentations,
        max_newton: solver.max_newton_iterations,
        first_penalty: solver.first_penalty,
        accuracy: solver.chosen_accuracy(),
        damage: DamageSettings { max_change: solver.damage_change, ..DamageSettings::default() },
        ..Settings::default()
    }
}
