//! How large the next increment of a stage is: cut after a miss, grown back after an easy one.

use serde::{Deserialize, Serialize};

const GROWTH: f64 = 1.5;

/// Progress of a stage, 0 to 1, and the size of its next increment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pace {
    done: f64,
    size: f64,
    smallest: f64,
    largest: f64,
    growth: f64,
    cuts: usize,
}

impl Pace {
    /// `nominal`, `smallest` and `largest` are increments as shares of the stage.
    pub fn new(nominal: f64, smallest: f64, largest: f64) -> Self {
        Pace {
            done: 0.0,
            size: nominal,
            smallest: smallest.min(nominal),
            largest: largest.max(nominal),
            growth: GROWTH,
            cuts: 0,
        }
    }

    /// Grows by this factor after an easy increment.
    pub fn growing_by(mut self, growth: f64) -> Self {
        self.growth = growth.max(1.0);
        self
    }

    /// Share of the stage that is done.
    pub fn done(&self) -> f64 {
        self.done
    }

    /// The next increment as a share of the stage; `None` once all is done. A remainder that
    /// rounding left joins the increment before it.
    pub fn next(&self) -> Option<f64> {
        let rest = 1.0 - self.done;
        let share = if rest < self.size * (1.0 + 1e-9) { rest } else { self.size };
        (rest > 1e-12).then_some(share)
    }

    /// Share of the stage that is done after an increment of `share`.
    pub fn after(&self, share: f64) -> f64 {
        if share >= 1.0 - self.done { 1.0 } else { self.done + share }
    }

    /// Takes note of an accepted increment, after an `easy` one of which the next may be longer; returns how often it was cut.
    pub fn accept(&mut self, share: f64, easy: bool) -> usize {
        self.done = self.after(share);
        if easy {
            self.size = (self.growth * self.size).min(self.largest);
        }
        std::mem::take(&mut self.cuts)
    }

    /// Cuts the increment; `false` where it was the smallest already.
    pub fn cut(&mut self, share: f64) -> bool {
        if share <= self.smallest * (1.0 + 1e-9) {
            return false;
        }
        self.size = (0.5 * share).max(self.smallest);
        self.cuts += 1;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reaches_the_end_in_the_asked_number_of_increments() {
        for count in [1, 3, 7, 10, 100] {
            let mut pace = Pace::new(1.0 / count as f64, 1e-3, 1.0 / count as f64);
            let mut taken = 0;
            while let Some(share) = pace.next() {
                assert_eq!(pace.accept(share, true), 0);
                taken += 1;
            }
            assert_eq!((taken, pace.done()), (count, 1.0));
        }
    }

    #[test]
    fn cuts_to_the_smallest_and_grows_back() {
        let mut pace = Pace::new(0.25, 0.05, 0.25);
        let mut cuts = 0;
        while let Some(share) = pace.next() {
            if !pace.cut(share) {
                assert!((share - 0.05).abs() < 1e-12);
                break;
            }
            cuts += 1;
        }
        assert_eq!(cuts, 3);
        let share = pace.next().expect("more to do");
        assert_eq!(pace.accept(share, true), 3);
        for _ in 0..5 {
            let share = pace.next().expect("more to do");
            pace.accept(share, true);
        }
        assert!(pace.next().is_none_or(|share| share > 0.05));
    }
}
