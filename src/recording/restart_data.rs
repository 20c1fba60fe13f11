//! What a results file keeps of a run: saved states for looking at, and what another run, or the same one
//! later, goes on from.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::scene::SceneState;
use crate::specimen::Specimen;
use crate::tensor::{Mat3, Pose};
use crate::triaxial::{LocalStrain, Rig, RigState, StageCurve, Test};

use super::breaking::{CellStates, GrainState, cell_states, grain_states};
use super::contact_table::ContactTable;
use super::grain_stress::mean_stresses;
use super::sums::Sums;

/// A state that the file may come to hold.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct State {
    pub time: f64,
    pub increment: u64,
    pub poses: Vec<Pose>,
    /// Of every grain, or of every body of a scene.
    #[serde(with = "crate::tensor::stored")]
    pub stress: Vec<Mat3>,
    pub local_strains: Vec<LocalStrain>,
    pub contacts: ContactTable,
    /// Of the grains that can break.
    pub cells: Vec<CellStates>,
    pub grains: Vec<GrainState>,
    /// How each body deforms: 0 rigid, 1 condensed, 2 full.
    pub levels: Vec<u8>,
}

impl State {
    /// The reference configuration, free of stress: where bodies are at first, and how each deforms.
    pub fn reference(poses: Vec<Pose>, stressed: usize, levels: Vec<u8>) -> Self {
        State {
            time: 0.0,
            increment: 0,
            poses,
            stress: vec![Mat3::zeros(); stressed],
            local_strains: Vec::new(),
            contacts: ContactTable::default(),
            cells: Vec::new(),
            grains: Vec::new(),
            levels,
        }
    }

    /// A rig before its first increment, as it is committed.
    pub fn of(rig: &Rig, grains: usize) -> Self {
        let (committed, mut contacts) = (&rig.committed, rig.contacts.clone());
        contacts.start(&rig.model, committed);
        let known = contacts.evaluate(&rig.model, committed, &committed.poses).is_ok();
        let stress = match known {
            true => mean_stresses(&rig.model, &contacts, &committed.poses, rig.pressure),
            false => vec![Mat3::zeros(); grains],
        };
        State {
            stress,
            contacts: ContactTable::of(&contacts, &committed.memory, grains),
            cells: cell_states(&rig.model),
            grains: grain_states(&rig.model),
            ..State::reference(rig.model.frames(&committed.poses), 0, rig.levels())
        }
    }
}

/// How far a triaxial test has come.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Position {
    /// Index of the stage at hand.
    pub stage: usize,
    /// Whether loose grains have been brought into touch.
    pub seated: bool,
    /// Whether strains count from the end of the consolidation already.
    pub strains_restarted: bool,
}

/// What a run and all that start from it have in common.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Origin<'a> {
    pub specimen: Cow<'a, Specimen>,
    /// The pressure that a rubber membrane's contacts are made for [Pa].
    pub membrane_pressure: f64,
}

impl Origin<'_> {
    /// Of a new specimen.
    pub fn new(specimen: Specimen, membrane_pressure: f64) -> Self {
        Origin { specimen: Cow::Owned(specimen), membrane_pressure }
    }
}

/// The state after the consolidation.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Consolidated<'a> {
    pub test: Cow<'a, Test>,
    pub rig: RigState<'a>,
}

/// A restart point of a triaxial test.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct TestPoint<'a> {
    pub at: Position,
    pub test: Cow<'a, Test>,
    pub rig: RigState<'a>,
    pub sums: Sums,
    pub curve: Cow<'a, StageCurve>,
    /// The state after its last increment, where the file does not have it.
    pub unsaved: Option<Cow<'a, State>>,
}

/// A restart point of a scene.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ScenePoint<'a> {
    pub at: Position,
    pub scene: SceneState<'a>,
    pub sums: Sums,
    /// As that of a test.
    pub unsaved: Option<Cow<'a, State>>,
}
