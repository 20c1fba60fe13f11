//! What a run has taken so far, as restart points keep it, and what its stages took.

use std::time::Duration;

use serde::{Deserialize, Serialize};

/// A stage of less work than this share of all so far closes its energy against that share.
const LITTLE_WORK: f64 = 1e-3;

/// Running sums of the run.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Sums {
    pub(super) increments: u64,
    /// External work and energy error of the last accepted increment [J].
    pub(super) last: [f64; 2],
    pub(super) stage: StageSums,
    /// Time of the last saved state.
    pub(super) saved: f64,
    /// Wall-clock time of the run up to here, and of its increments without the file [s].
    pub(super) seconds: f64,
    pub(super) solving: f64,
}

/// Running sums of the present stage.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct StageSums {
    /// Wall-clock time of the run [s].
    pub(super) begun: f64,
    pub(super) increments: usize,
    pub(super) factorisations: i64,
    pub(super) poorly_closed: usize,
    /// Wall-clock time that the file took [s].
    pub(super) writing: f64,
    /// External work and energy error at the start [J].
    pub(super) start: [f64; 2],
    /// Saved states due so far.
    pub(super) due: usize,
}

/// What a stage took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageWork {
    /// Accepted increments of this stage.
    pub increments: usize,
    pub factorisations: i64,
    /// Increments whose energy closed worse than the case's `energy_tolerance`.
    pub poorly_closed: usize,
    /// Energy that no row of the ledger accounts for, over the external work of the stage, or a thousandth of
    /// that of the whole run so far where a stage does less.
    pub energy_error: f64,
    pub wall_time: Duration,
    /// The share of it that went into stresses, contact tables, restart points and the file.
    pub writing_time: Duration,
    /// Saved states in the file so far.
    pub states: usize,
}

impl Sums {
    /// Begins a stage, so many `seconds` into the run.
    pub(super) fn begin_stage(&mut self, seconds: f64) {
        self.stage = StageSums { begun: seconds, start: self.last, ..StageSums::default() };
    }

    /// What the stage at hand took, so many `seconds` into the run and with so many saved `states`.
    pub(super) fn stage_work(&self, seconds: f64, states: usize) -> StageWork {
        let (sums, last) = (&self.stage, self.last);
        let work = (last[0] - sums.start[0]).abs().max(LITTLE_WORK * last[0].abs());
        StageWork {
            increments: sums.increments,
            factorisations: sums.factorisations,
            poorly_closed: sums.poorly_closed,
            energy_error: if work == 0.0 { 0.0 } else { (last[1] - sums.start[1]) / work },
            wall_time: Duration::try_from_secs_f64(seconds - sums.begun).unwrap_or_default(),
            writing_time: Duration::try_from_secs_f64(sums.writing).unwrap_or_default(),
            states,
        }
    }
}
