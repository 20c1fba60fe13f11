//! A stage of a test between two increments.

use serde::{Deserialize, Serialize};

use crate::loading::{Portion, StageProgress};
use crate::triaxial::drive::Drive;
use crate::triaxial::response::Curve;
use crate::triaxial::starts::Last;
use crate::triaxial::watch::Watch;

/// What a test adds to the progress of a stage: with the rig's state all that it takes to go on with it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct StageState {
    pub(super) drive: Drive,
    pub(super) watch: Watch,
    pub(super) curve: Curve,
    pub(super) last: Option<Last>,
    /// Increments since the path ended, under constant loads.
    pub(super) aftermaths: usize,
    /// Whether the last increment was to come to rest.
    pub(super) rested: bool,
    /// Whether grains have broken since the last increment.
    #[serde(skip)]
    pub(super) broke: bool,
}

impl StageState {
    pub(super) fn new(drive: Drive, watch: Watch, curve: Curve) -> Self {
        // One that is where it is to end already has nothing to bring to rest.
        let rested = watch.done;
        StageState { drive, watch, curve, last: None, aftermaths: 0, rested, broke: false }
    }
}

pub(super) type Progress = StageProgress<StageState>;

/// The next increment on the path of a stage; `None` behind its end.
pub(super) fn next_on_path(stage: &Progress) -> Option<Portion> {
    let next = stage.pace.next().filter(|_| !stage.own.watch.done)?;
    let share = stage.own.watch.limit.map_or(next, |limit| limit.min(next));
    Some(Portion { share, to: stage.pace.after(share) })
}
