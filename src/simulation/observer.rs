//! What a run tells while it goes on, and the one thing it asks.

use std::path::PathBuf;
use std::time::Duration;

use crate::loading::StageEnd;
use crate::material::Drawn;
use crate::mesh::{Mesh, QualityReport};
use crate::recording::StageWork;
use crate::results::HistoryRow;
use crate::setup::PlannedStage;
use crate::solver::StopSignal;
use crate::specimen::statistics::ClassStatistics;
use crate::specimen::{Phase, Specimen, VOID_RATIO_TOLERANCE};

use super::seating::Seating;

/// Hears of a run as it goes on. Every call is optional.
pub trait Observer {
    /// A phase of the specimen's generation and its share done.
    fn specimen_progress(&mut self, _phase: Phase, _share: f64) {}
    /// The specimen stands and its grains are meshed.
    fn specimen_ready(&mut self, _report: &SpecimenReport) {}
    /// Bodies are meshed, condensed or factored from now on, or have been: no stop is heard meanwhile, and nothing is written.
    fn building(&mut self, _now: bool) {}
    /// What the cells have drawn from the rock's laws.
    fn rock_drawn(&mut self, _drawn: &[Drawn]) {}
    /// Loose grains have been brought into touch.
    fn seated(&mut self, _seating: &Seating) {}
    fn stage_begun(&mut self, _stage: &PlannedStage) {}
    /// An increment is accepted and in the file.
    fn step_accepted(&mut self, _step: &Step<'_>) {}
    fn stage_ended(&mut self, _report: &StageReport<'_>) {}
    /// A run is continued, or starts from another; before anything else of it.
    fn resumed(&mut self, _how: &Resumption) {}
    /// Whether to stop after the present increment.
    fn stop_requested(&self) -> bool {
        false
    }
    /// Raised to have the increment at hand given up; asked for once, at the start.
    fn stop_signal(&self) -> StopSignal {
        StopSignal::default()
    }
}

/// What became of the wish to continue a run.
#[derive(Debug, Clone, PartialEq)]
pub enum Resumption {
    /// There is nothing to go on from, so the run begins.
    Anew { reason: &'static str },
    /// The run is finished: nothing is left to do.
    Finished { increments: u64 },
    /// The run starts from the specimen in another results file.
    Started {
        file: PathBuf,
        /// As it was consolidated there, or as it was generated.
        consolidated: bool,
        /// Where that run was begun, if not on this computer.
        host: Option<String>,
        /// The riprap that wrote it, if not this one.
        version: Option<String>,
    },
    /// The run goes on after its last restart point.
    After {
        increment: u64,
        /// Rows of the history behind that point, which are computed again.
        dropped: usize,
        /// Newer restart points that cannot be used, each with what is wrong.
        damaged: Vec<String>,
        /// Where the run was begun, if not on this computer.
        host: Option<String>,
        /// The riprap that wrote the restart point, if not this one.
        version: Option<String>,
    },
}

/// A generated specimen in short.
#[derive(Debug, Clone, PartialEq)]
pub struct SpecimenReport {
    pub grains: usize,
    pub cells: usize,
    pub nodes: usize,
    /// [m]
    pub diameter: f64,
    /// [m]
    pub height: f64,
    pub void_ratio: f64,
    pub void_ratio_asked: f64,
    pub coordination_number: f64,
    pub rattlers: usize,
    /// The grading asked and achieved, the coarsest class first.
    pub classes: Vec<ClassStatistics>,
    /// Means over the grains: intermediate over long and short over intermediate semi-axis, surface of the
    /// ball of equal volume over the grain's, number of vertices.
    pub elongation: f64,
    pub flatness: f64,
    pub sphericity: f64,
    pub vertices: f64,
    /// Largest overlap over the smaller grain's size: by GJK, and by separating axis.
    pub worst_overlap: [f64; 2],
    /// Worst `3 r / R` of all cells.
    pub worst_radius_ratio: f64,
    /// Wall-clock time of generation and meshing.
    pub wall_time: Duration,
}

impl SpecimenReport {
    pub fn new(specimen: &Specimen, void_ratio_asked: f64, meshes: &[Mesh], wall_time: Duration) -> Self {
        let statistics = &specimen.statistics;
        SpecimenReport {
            grains: specimen.grains.len(),
            cells: meshes.iter().map(|mesh| mesh.cells.len()).sum(),
            nodes: meshes.iter().map(|mesh| mesh.nodes.len()).sum(),
            diameter: specimen.diameter,
            height: specimen.height,
            void_ratio: statistics.void_ratio,
            void_ratio_asked,
            coordination_number: statistics.coordination_number,
            rattlers: statistics.rattlers,
            classes: statistics.classes.clone(),
            elongation: statistics.elongation.mean,
            flatness: statistics.flatness.mean,
            sphericity: statistics.sphericity.mean,
            vertices: statistics.vertices.mean,
            worst_overlap: statistics.worst_overlap,
            worst_radius_ratio: meshes
                .iter()
                .map(|mesh| QualityReport::of(mesh).worst_radius_ratio)
                .fold(f64::INFINITY, f64::min),
            wall_time,
        }
    }

    /// Whether the packing nearest to the void ratio asked for was taken in its place.
    pub fn void_ratio_is_missed(&self) -> bool {
        (self.void_ratio - self.void_ratio_asked).abs() > VOID_RATIO_TOLERANCE
    }
}

/// An accepted increment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step<'a> {
    pub stage: &'a PlannedStage,
    /// Share of the stage done.
    pub progress: f64,
    /// Nominal increments done, over all stages.
    pub done: f64,
    /// Nominal increments of all stages.
    pub total: f64,
    /// What `/history` says of it.
    pub row: &'a HistoryRow,
}

impl<'a> Step<'a> {
    pub(super) fn new(
        stage: &'a PlannedStage,
        stages: &[PlannedStage],
        progress: f64,
        row: &'a HistoryRow,
    ) -> Self {
        let nominal = |stage: &PlannedStage| stage.increments;
        Step {
            stage,
            progress,
            done: stages[..stage.index].iter().map(nominal).sum::<f64>() + progress * stage.increments,
            total: stages.iter().map(nominal).sum(),
            row,
        }
    }
}

/// A stage that ended.
#[derive(Debug, Clone, PartialEq)]
pub struct StageReport<'a> {
    pub stage: &'a PlannedStage,
    pub end: &'a StageEnd,
    pub work: StageWork,
}
