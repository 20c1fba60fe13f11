//! From one accepted increment to the next: the one loop of a stage, whatever is loaded, and what all kinds share: the length of increments, the
//! ledger, how stages end.
//!
//! A specimen in its rig ([`crate::triaxial`]), a scene and a press ([`crate::scene`]) say what an increment is, what to try after a miss, and what
//! its commit does.

mod fidelity;
mod ledger;
mod pace;

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::model::Counters;
use crate::solver::Verdict;

pub use fidelity::FidelityCounts;
pub use ledger::{EnergyGate, Ledger, creates_energy, fell};
pub use pace::Pace;

/// Times that an increment is repeated since a body ought to have been condensed in it.
const MOST_REPEATS: usize = 3;

/// How a stage ended.
#[derive(Debug, Clone, PartialEq)]
pub enum StageEnd {
    Finished,
    /// The smallest increment did not converge, or what should end the stage did not come.
    Stopped {
        reason: String,
    },
    /// The observer asked to stop.
    Interrupted,
}

impl StageEnd {
    fn stopped(reason: impl ToString) -> Self {
        StageEnd::Stopped { reason: reason.to_string() }
    }
}

/// An increment as a part of its stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Portion {
    /// Its share of the stage; zero where bodies that broke look for a new balance.
    pub share: f64,
    /// Share of the stage that is done at its end.
    pub to: f64,
}

/// A stage after its last accepted increment; `S` is what is loaded adds to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageProgress<S> {
    pub pace: Pace,
    pub own: S,
    /// What attempts at the increment at hand took that were not accepted.
    pub spent: Counters,
    /// Times that the increment at hand has been repeated with more condensed bodies, and how many bodies that were.
    #[serde(skip)]
    repeats: usize,
    #[serde(skip)]
    condensed: usize,
}

impl<S> StageProgress<S> {
    pub fn new(pace: Pace, own: S) -> Self {
        StageProgress { pace, own, spent: Counters::default(), repeats: 0, condensed: 0 }
    }

    /// Whether an increment has to be repeated because of what its outcome tells of the fidelity of bodies; `condense` does what it asks for, and says
    /// how many bodies it made condensed.
    pub fn repeats(&mut self, verdict: &Verdict, condense: impl FnOnce() -> usize) -> bool {
        let again = verdict.urgent && self.repeats < MOST_REPEATS;
        if again {
            self.repeats += 1;
            self.condensed += condense();
        }
        again
    }

    /// Times that the increment was repeated, and bodies made condensed for it; counted anew from here on.
    pub fn take_repeats(&mut self) -> [usize; 2] {
        [std::mem::take(&mut self.repeats), std::mem::take(&mut self.condensed)]
    }

    /// What the accepted increment took, with all that was tried for it.
    pub fn take_spent(&mut self, last: &Counters) -> Counters {
        let mut all = *last;
        all.add(&std::mem::take(&mut self.spent));
        all
    }
}

/// What an attempt at an increment came to.
pub enum Attempt<B> {
    /// In balance, not committed.
    Balanced(B),
    /// Not accepted: the next attempt is shorter, or with other bodies condensed.
    Again(Counters),
    /// Nothing is left to try.
    Stopped(String),
    /// Told to stop; an interrupted attempt is made again.
    Interrupted,
}

impl<B> Attempt<B> {
    /// With what is in balance made into something else.
    pub fn map<C>(self, into: impl FnOnce(B) -> C) -> Attempt<C> {
        match self {
            Attempt::Balanced(balanced) => Attempt::Balanced(into(balanced)),
            Attempt::Again(counters) => Attempt::Again(counters),
            Attempt::Stopped(reason) => Attempt::Stopped(reason),
            Attempt::Interrupted => Attempt::Interrupted,
        }
    }
}

/// What is loaded in stages.
pub trait Loaded {
    /// What it adds to the progress of a stage.
    type Own;
    /// An increment in balance, not committed.
    type Balanced;
    /// What is known of an accepted increment.
    type Row;

    /// Takes what failed in the last increment out of the committed state.
    ///
    /// # Errors
    /// Where a body that broke cannot be made anew.
    fn break_up(&mut self, stage: &mut StageProgress<Self::Own>) -> Result<()>;

    /// The next increment; `None` where the stage is over.
    fn next(&self, stage: &StageProgress<Self::Own>) -> Option<Portion>;

    /// Tries an increment.
    fn attempt(&mut self, stage: &mut StageProgress<Self::Own>, next: Portion) -> Attempt<Self::Balanced>;

    /// Makes an increment the committed state.
    ///
    /// # Errors
    /// Where a body that broke cannot be made anew.
    fn commit(
        &mut self,
        stage: &mut StageProgress<Self::Own>,
        portion: Portion,
        balanced: Self::Balanced,
    ) -> Result<Self::Row>;

    /// Where the progress of the stage is kept while nothing runs.
    fn progress(&mut self) -> &mut Option<StageProgress<Self::Own>>;

    /// Whether a wish to stop behind this increment interrupts nothing.
    fn is_last(&self, stage: &StageProgress<Self::Own>) -> bool;

    /// How a stage ends that is over.
    fn end(&self, stage: &StageProgress<Self::Own>) -> StageEnd;
}

/// Takes what is loaded through a stage, or the rest of one; `observe` sees each accepted increment and says whether to go on.
pub fn run_stage<L: Loaded>(
    loaded: &mut L,
    mut stage: StageProgress<L::Own>,
    observe: &mut dyn FnMut(&L, &L::Row) -> bool,
) -> StageEnd {
    loop {
        if let Err(error) = loaded.break_up(&mut stage) {
            return StageEnd::stopped(error);
        }
        let Some(next) = loaded.next(&stage) else { return loaded.end(&stage) };
        let balanced = match loaded.attempt(&mut stage, next) {
            Attempt::Balanced(balanced) => balanced,
            Attempt::Again(counters) => {
                stage.spent.add(&counters);
                continue;
            }
            Attempt::Stopped(reason) => return StageEnd::Stopped { reason },
            Attempt::Interrupted => {
                *loaded.progress() = Some(stage);
                return StageEnd::Interrupted;
            }
        };
        let row = match loaded.commit(&mut stage, next, balanced) {
            Ok(row) => row,
            Err(error) => return StageEnd::stopped(error),
        };
        let is_last = loaded.is_last(&stage);
        *loaded.progress() = Some(stage);
        let goes_on = observe(loaded, &row) || is_last;
        match loaded.progress().take() {
            Some(left) if goes_on => stage = left,
            left => {
                *loaded.progress() = left;
                return StageEnd::Interrupted;
            }
        }
    }
}
