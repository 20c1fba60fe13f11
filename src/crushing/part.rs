//! One part of the grain in the press: the grain itself, or a piece of it.

use std::sync::Arc;

use crate::crushing::bench::{Bench, Contact, Grip, Memory, Patches};
use crate::error::Result;
use crate::grain::{BreakUp, DamageChange, DamageCommit, DamagedGrain};

/// When damage has settled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Largest change of damage between two factors.
    pub max_change: f64,
    /// Damage has settled when none changes by more than this.
    pub tolerance: f64,
    /// Rounds of contact and damage before an increment is cut.
    pub most_rounds: usize,
}

/// A part of the grain and what its contact starts from.
#[derive(Debug, Clone)]
pub struct Part {
    pub grain: DamagedGrain,
    pub memory: Memory,
    /// Made when they are needed: they follow from the grain.
    patches: Option<Arc<Patches>>,
}

/// A state in which nothing moves any more; the damage is the part's trial damage.
#[derive(Debug, Clone)]
pub struct Settled {
    pub contact: Contact,
    pub rounds: usize,
    pub factorisations: usize,
}

/// What a part has become.
#[derive(Debug)]
pub struct Kept {
    pub commit: DamageCommit,
    /// What it came apart into; `None` where it lost no cell.
    pub broken: Option<BreakUp>,
}

impl Part {
    pub fn new(grain: DamagedGrain) -> Self {
        Self::with_memory(grain, Memory::default())
    }

    pub fn with_memory(grain: DamagedGrain, memory: Memory) -> Self {
        Part { grain, memory, patches: None }
    }

    /// Contact and damage in turn until nothing moves, or why they do not come to rest: then the trial damage is forgotten. `stopped` is
    /// asked between rounds.
    pub fn settle(
        &mut self,
        bench: &Bench,
        limits: &Limits,
        stopped: &dyn Fn() -> bool,
    ) -> Result<std::result::Result<Settled, String>> {
        let mut memory = self.memory.clone();
        let grain = &self.grain;
        let patches = self.patches.get_or_insert_with(|| Arc::new(Patches::of(grain, bench.patch))).clone();
        let (mut factorisations, mut last) = (0, DamageChange::default());
        for round in 1..=limits.most_rounds {
            let contact = match bench.contact(&self.grain, &patches, &memory) {
                Ok(contact) => contact,
                Err(reason) => {
                    self.grain.reject();
                    return Ok(Err(reason));
                }
            };
            let change = self.grain.propose(&contact.loads, limits.max_change)?;
            if change.applied <= limits.tolerance && change.held_back <= limits.tolerance {
                return Ok(Ok(Settled { contact, rounds: round, factorisations }));
            }
            factorisations += usize::from(self.grain.refresh()?);
            last = change;
            // Places of touching nodes are those of the last accepted state all along.
            memory = self.memory.with_touches_of(contact.memory);
            if stopped() {
                self.grain.reject();
                return Ok(Err("stopped as asked".into()));
            }
        }
        self.grain.reject();
        Ok(Err(format!(
            "after {} rounds damage still moves by {:.1e} and wants to by {:.1e} more",
            limits.most_rounds,
            last.applied,
            last.held_back.max(0.0)
        )))
    }

    /// What keeping the settled state would book, without keeping it.
    pub fn would_keep(&self, settled: &Settled) -> Result<DamageCommit> {
        self.grain.clone().commit(&settled.contact.loads)
    }

    /// Keeps the settled damage and deletes failed cells; `number` is this body's, parts below `least_volume` [m^3] are given up.
    pub fn keep(&mut self, settled: &Settled, grip: Grip, number: u32, least_volume: f64) -> Result<Kept> {
        let mut commit = self.grain.commit(&settled.contact.loads)?;
        if commit.newly_failed > 0 && grip != Grip::Tied {
            // Nodes that hang on next to nothing only keep the plates from what lies behind them.
            let lost = self.grain.crumble();
            commit.dissipated += lost;
            commit.elastic -= lost;
            commit.failed_cells = self.grain.failed_cells();
        }
        let broken = self.grain.break_up(&settled.contact.loads, number, least_volume)?;
        self.memory = settled.contact.memory.clone();
        Ok(Kept { commit, broken })
    }

    /// The parts that it came apart into, each with its share of the memory, largest first.
    pub fn pieces(&self, broken: BreakUp) -> Vec<Part> {
        let piece = |fragment: crate::grain::Fragment| {
            let memory = self.memory.carried_over(&self.grain, &fragment.grain, &fragment.nodes);
            Part::with_memory(fragment.grain, memory)
        };
        broken.fragments.into_iter().map(piece).collect()
    }
}
