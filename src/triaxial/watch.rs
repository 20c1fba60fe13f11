//! What ends a stage before its path does: a stress to land on, a drop behind a peak.

use serde::{Deserialize, Serialize};

use crate::loading::StageEnd;
use crate::triaxial::measures::Measures;
use crate::triaxial::stage::{Stage, Until};

/// Trials of an increment that is to land.
const LANDING_TRIALS: usize = 8;
/// A landing may miss its deviatoric stress by this share of the distance covered by the stage. A stage that is off by no more than this
/// share of the confining pressure, about what the balance of forces says, has nowhere to go.
const LANDING_TOLERANCE: f64 = 1e-3;
/// Distances are not taken for less than this share of the confining pressure.
const LEAST_DISTANCE: f64 = 0.1;

/// Share of a stage that is not over, at most.
const NEARLY: f64 = 0.999;

/// Watches for what ends a stage before its path does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Watch {
    until: Until,
    start: f64,
    before: f64,
    peak: f64,
    /// Confining pressure at the start [Pa].
    pressure: f64,
    /// The largest share that the next increment may have, to land.
    pub(super) limit: Option<f64>,
    trials: usize,
    pub(super) done: bool,
}

impl Watch {
    pub(super) fn new(until: &Until, deviatoric_stress: f64, pressure: f64) -> Self {
        let mut watch = Watch {
            until: *until,
            start: deviatoric_stress,
            before: deviatoric_stress,
            peak: deviatoric_stress,
            pressure: pressure.max(0.0),
            limit: None,
            trials: 0,
            done: false,
        };
        watch.done = until.deviatoric_stress.is_some_and(|to| {
            (deviatoric_stress - to).abs() <= LANDING_TOLERANCE * watch.pressure.max(to.abs())
        });
        watch
    }

    /// Why a path of that axial strain cannot lead to the deviatoric stress that it has to.
    pub(super) fn contradicts(&self, axial_strain: f64) -> Option<String> {
        let to = self.until.deviatoric_stress.filter(|_| self.until.must && !self.done)?;
        (axial_strain < 0.0 && to > self.start).then(|| {
            format!(
                "the stage unloads to a deviatoric stress of {to:.4e} Pa, which is above the {:.4e} Pa that there are",
                self.start
            )
        })
    }

    fn is_near(&self, deviatoric_stress: f64) -> bool {
        self.until.deviatoric_stress.is_some_and(|to| {
            let scale = (to - self.start).abs().max(LEAST_DISTANCE * self.pressure);
            // Where it lands the next stage has to count as there.
            let scale = scale.min(self.pressure).max(to.abs());
            (deviatoric_stress - to).abs() <= LANDING_TOLERANCE * scale
        })
    }

    fn is_past(&self, deviatoric_stress: f64) -> bool {
        self.until
            .deviatoric_stress
            .is_some_and(|to| (to - self.start).signum() * (deviatoric_stress - to) >= 0.0)
    }

    /// Whether a trial of `share` went too far past the stress to land on, or is there and not at rest; then sets the limit of the
    /// next one. After enough trials (a snap may leap over any stress) it may go past.
    pub(super) fn overshoots(&mut self, share: f64, measures: &Measures, rests: bool) -> bool {
        let q = measures.deviatoric_stress;
        let Some(to) = self.until.deviatoric_stress else { return false };
        let lands = self.is_near(q);
        if lands && rests || !lands && !self.is_past(q) || self.trials >= LANDING_TRIALS {
            return false;
        }
        self.trials += 1;
        if lands {
            self.limit = Some(share);
            return true;
        }
        let fraction = (to - self.before) / (q - self.before);
        self.limit = Some(share * fraction.clamp(0.05, 0.98));
        true
    }

    /// After a failed increment that was short in order to land: goes on as if there were nothing to
    /// land on, and past it.
    pub(super) fn gives_up_landing(&mut self) -> bool {
        let landing = self.limit.take().is_some();
        if landing {
            self.trials = LANDING_TRIALS;
        }
        landing
    }

    pub(super) fn accept(&mut self, measures: &Measures) {
        let q = measures.deviatoric_stress;
        self.peak = self.peak.max(q);
        self.done = self.is_near(q)
            || self.is_past(q)
            || self.until.drop_after_peak.is_some_and(|drop| self.peak > 0.0 && q < (1.0 - drop) * self.peak);
        self.before = q;
        self.limit = None;
    }

    /// Share of the stage behind an accepted increment, `path` of whose path are done.
    pub(super) fn progress(&self, path: f64) -> f64 {
        match self.until.deviatoric_stress {
            _ if self.done => 1.0,
            // The path is only long enough.
            Some(to) if self.until.must => {
                ((self.before - self.start) / (to - self.start)).clamp(0.0, NEARLY)
            }
            _ => path,
        }
    }

    pub(super) fn end(&self, stage: &Stage) -> StageEnd {
        if self.done || !stage.until.must {
            return StageEnd::Finished;
        }
        let wanted = self.until.deviatoric_stress.unwrap_or(f64::NAN);
        StageEnd::Stopped {
            reason: format!(
                "the deviatoric stress is {:.4e} Pa at the end of the path and has not reached {wanted:.4e} Pa",
                self.before
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_is_over_where_it_lands() {
        let until = |must| Until { deviatoric_stress: Some(0.0), must, ..Until::default() };
        for (must, shares) in [(true, [0.25, 0.99895, 1.0]), (false, [0.1, 0.1, 1.0])] {
            let mut watch = Watch::new(&until(must), 2e6, 8e5);
            for (deviatoric_stress, share) in [1.5e6, 2.1e3, 7e2].into_iter().zip(shares) {
                watch.accept(&Measures { deviatoric_stress, ..Measures::default() });
                let found = watch.progress(0.1);
                assert!((found - share).abs() < 1e-12, "{must} {deviatoric_stress}: {found}");
            }
        }
    }

    /// Stresses of increments in turn; whether the stage is over behind the last.
    fn is_over(drop_after_peak: f64, stresses: &[f64]) -> bool {
        let until = Until { drop_after_peak: Some(drop_after_peak), ..Until::default() };
        let mut watch = Watch::new(&until, stresses[0], 0.0);
        for &deviatoric_stress in &stresses[1..] {
            watch.accept(&Measures { deviatoric_stress, ..Measures::default() });
        }
        watch.done
    }

    #[test]
    fn nothing_unloads_upwards() {
        let until = Until { deviatoric_stress: Some(5e6), must: true, ..Until::default() };
        assert!(Watch::new(&until, 2e6, 8e5).contradicts(-0.1).is_some());
        for (start, strain) in [(2e6, 0.1), (6e6, -0.1), (5e6, -0.1)] {
            assert_eq!(Watch::new(&until, start, 8e5).contradicts(strain), None, "{start} {strain}");
        }
    }

    /// As a second unloading behind one that landed a little beside its target.
    #[test]
    fn who_is_there_already_goes_nowhere() {
        let until = Until { deviatoric_stress: Some(0.0), must: true, ..Until::default() };
        for (start, done) in [(100.0, true), (-700.0, true), (900.0, false), (2e6, false)] {
            assert_eq!(Watch::new(&until, start, 8e5).done, done, "{start}");
        }
    }

    #[test]
    fn a_drop_counts_from_a_peak_in_compression() {
        assert!(is_over(0.1, &[0.0, 2e6, 1.7e6]));
        assert!(!is_over(0.1, &[0.0, 2e6, 1.9e6]));
        // An unloading has ended a little below zero.
        assert!(!is_over(0.1, &[-1e3, -0.9e3, 1e6]));
    }
}
