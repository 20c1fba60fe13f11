//! How strongly bodies are held near where an augmentation began: relaxed after a good one, tightened after a stall.

use crate::solver::newton::NewtonEnd;
use crate::solver::settings::Settings;

/// In a dwell the weight stays above this share of the one that last stalled, which fades by [`FADE`] with
/// each solve.
const ABOVE: f64 = 1.5;
const FADE: f64 = 0.7;
/// In a dwell, solves in a row that stop short before the weight falls, and by how much.
const SHORT: usize = 2;
const SHORT_LOWER: f64 = 0.5;

/// The proximal weight over the typical contact stiffness.
#[derive(Debug, Clone, Copy)]
pub(super) struct ProximalWeight {
    pub weight: f64,
    /// The weight of the last stall, fading.
    stalled: f64,
    /// Solves in a row that stopped short.
    short: usize,
}

impl ProximalWeight {
    pub fn new(settings: &Settings) -> Self {
        ProximalWeight { weight: settings.proximal_start, stalled: 0.0, short: 0 }
    }

    fn least(&self, settings: &Settings) -> f64 {
        if settings.dwells { settings.proximal_min.max(ABOVE * self.stalled) } else { settings.proximal_min }
    }

    /// After a solve that ended so; `false` where it got nowhere and there is no larger weight. What `drives`
    /// bodies away, further out of balance than they were, is an instability, which the proximal term alone
    /// slows down: a weaker one would let Newton's iterations lead back to its top.
    pub fn after(&mut self, end: NewtonEnd, drives: bool, settings: &Settings) -> bool {
        match end {
            NewtonEnd::Solved if drives => self.short = 0,
            NewtonEnd::Solved => self.solved(settings),
            NewtonEnd::Reduced => self.reduced(settings),
            NewtonEnd::Stalled => return self.stalled(settings),
        }
        true
    }

    /// After a solve that reached its target.
    fn solved(&mut self, settings: &Settings) {
        self.stalled *= FADE;
        self.short = 0;
        self.weight = (self.weight * settings.proximal_lower).max(self.least(settings));
    }

    /// After one that got some of the way.
    fn reduced(&mut self, settings: &Settings) {
        self.short += 1;
        if settings.dwells && self.short >= SHORT {
            self.stalled *= FADE;
            self.weight = (self.weight * SHORT_LOWER).max(self.least(settings));
        }
    }

    /// After one that got nowhere; `false` where there is no larger weight.
    fn stalled(&mut self, settings: &Settings) -> bool {
        if self.weight >= settings.proximal_max {
            return false;
        }
        self.short = 0;
        self.stalled = self.weight;
        self.weight = (self.weight * settings.proximal_raise).min(settings.proximal_max);
        true
    }
}
