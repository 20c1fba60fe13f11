//! What contacts lose between two states, and how they go on from the second of them: each pair is looked at once.

use std::ops::Add;

use rayon::prelude::*;

use crate::assembly::crushing::note;
use crate::assembly::{Contacts, PairWork};
use crate::contact::force::Kinematics;
use crate::model::Model;
use crate::tensor::Pose;

/// Energy that contacts have lost since the committed state [J].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Losses {
    pub friction: f64,
    /// Set free where brittle bodies' rock got softer below them.
    pub softening: f64,
    /// Taken by the crushing of asperities.
    pub crushing: f64,
}

impl Add for Losses {
    type Output = Losses;

    fn add(self, other: Losses) -> Losses {
        Losses {
            friction: self.friction + other.friction,
            softening: self.softening + other.softening,
            crushing: self.crushing + other.crushing,
        }
    }
}

impl PairWork {
    fn losses(&self, model: &Model, kinematics: &[Kinematics]) -> Losses {
        Losses {
            friction: self.dissipation(model, kinematics),
            softening: self.softening(model),
            crushing: self.work_of_crushing(),
        }
    }
}

impl Contacts {
    /// What is lost in the configuration last evaluated.
    pub fn losses(&self, model: &Model) -> Losses {
        let of_pair = |pair: &PairWork| pair.losses(model, &self.kinematics);
        let all: Vec<Losses> = self.pairs.par_iter().map(of_pair).collect();
        self.with_parted(all.into_iter())
    }

    /// Goes on from the configuration last evaluated as if it had been committed at these poses, and says what was lost until there. Points have to be
    /// evaluated again.
    pub fn rebase(&mut self, model: &Model, poses: &[Pose]) -> Losses {
        let Contacts { pairs, kinematics, first_scale, knows_depths, .. } = self;
        let of_pair = |pair: &mut PairWork| {
            let found = (pair.losses(model, kinematics), pair.crushed(*knows_depths));
            pair.go_on(model, *first_scale, poses);
            found
        };
        let all: Vec<_> = pairs.par_iter_mut().map(of_pair).collect();
        let losses = self.with_parted(all.iter().map(|(losses, _)| *losses));
        // What is crushed is kept here within an increment.
        note(&mut self.crushed, all.into_iter().flat_map(|(_, crushed)| crushed));
        self.knows_depths = true;
        self.parted.clear();
        losses
    }

    /// The sum of these with what pairs that are not listed any more had stored.
    fn with_parted(&self, listed: impl Iterator<Item = Losses>) -> Losses {
        let mut sum = listed.fold(Losses::default(), Add::add);
        let given_up = self.parted.values().map(|brought| brought.memory.tangential_energy() + brought.moved);
        sum.friction = given_up.fold(sum.friction, |sum, energy| sum + energy);
        sum
    }
}
