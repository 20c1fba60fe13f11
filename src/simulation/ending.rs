//! How a run ends: what the caller hears, and what the results file says of it.

use std::time::Duration;

use crate::case::Case;
use crate::error::Result;
use crate::loading::StageEnd;
use crate::recording::{Profile, Recorder};
use crate::results::{Existing, Outcome as FileOutcome};
use crate::solver::Dossier;

use super::options::Options;

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum End {
    /// The case's last stage is done.
    Finished,
    /// The observer asked to stop.
    Interrupted,
    /// The run could not go on.
    Stopped { reason: String },
}

/// What a run came to. The results file holds everything up to there.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    pub end: End,
    /// Accepted increments over all stages.
    pub increments: u64,
    pub wall_time: Duration,
    pub profile: Profile,
    /// What is known of the increment that stopped it, where one did.
    pub dossier: Option<Box<Dossier>>,
}

impl Outcome {
    /// Finished after so many increments, none of them made now.
    pub(super) fn finished(increments: u64) -> Self {
        Outcome {
            end: End::Finished,
            increments,
            wall_time: Duration::ZERO,
            profile: Profile::default(),
            dossier: None,
        }
    }
}

/// Writes how the last stage ended, and why, and closes the file.
pub fn close(
    mut recorder: Recorder,
    case: &Case,
    options: &Options,
    end: StageEnd,
    dossier: Option<Dossier>,
    profile: Profile,
) -> Result<Outcome> {
    let (end, outcome, reason) = told(explained(end, case, dossier.as_ref()));
    let dossier = dossier.filter(|_| matches!(end, End::Stopped { .. })).map(Box::new);
    // A continued run would have to add to what it finds: it is told, not kept.
    if options.profile && options.existing != Existing::Continue {
        recorder.write_profile(&profile)?;
    }
    if let Some(dossier) = &dossier {
        recorder.write_dossier(dossier)?;
    }
    recorder.finish(outcome, &reason)?;
    Ok(Outcome { end, increments: recorder.increments(), wall_time: recorder.wall_time(), profile, dossier })
}

/// A stop told with its cause first, where that is known: what the solver saw, or a pressure that uses up the
/// roundings.
fn explained(end: StageEnd, case: &Case, dossier: Option<&Dossier>) -> StageEnd {
    let StageEnd::Stopped { reason } = end else { return end };
    let seen = dossier.and_then(|dossier| dossier.cause.clone());
    let causes = case.squeeze().map(|squeeze| squeeze.to_string()).into_iter().chain(seen);
    StageEnd::Stopped { reason: causes.chain([reason]).collect::<Vec<_>>().join("; ") }
}

/// How a run ended, for the caller and for the file.
fn told(end: StageEnd) -> (End, FileOutcome, String) {
    match end {
        StageEnd::Finished => (End::Finished, FileOutcome::Finished, String::new()),
        StageEnd::Interrupted => {
            (End::Interrupted, FileOutcome::Interrupted, "interrupted by the user".into())
        }
        StageEnd::Stopped { reason } => {
            (End::Stopped { reason: reason.clone() }, FileOutcome::Stopped, reason)
        }
    }
}
