//! Bodies that bend are rigid while a specimen collapses; behind it they wake.
//!
//! They come to rest and wake with the forces that they have: their contacts make up for what the bodies bend less, or more. What is made up for
//! at the end and was not before the collapse is a displacement that nothing did work for. So it is claimed back: the contacts lose it, and the bodies,
//! awake, find a balance without it under the loads as they are. Where they find none, they keep it.

use serde::{Deserialize, Serialize};

use crate::assembly::MadeUp;
use crate::contact::Memory;
use crate::triaxial::ledger::Ledger;
use crate::triaxial::rig::Rig;
use crate::triaxial::test::{Test, UnderWay};

/// Bodies that rest in a collapse.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Sleep {
    pub(super) bodies: Vec<usize>,
    /// By how much the description stores more elastic energy since they rest [J].
    energy: f64,
    /// The ledger before.
    before: Ledger,
    /// What contacts had made up for before.
    pub(super) made_up: MadeUp,
}

impl Sleep {
    pub(super) fn is_over(&self) -> bool {
        self.bodies.is_empty()
    }
}

/// What contacts made up for in a collapse and have lost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Claim {
    /// The contacts with it.
    memory: Memory,
    /// The ledger before the collapse.
    before: Ledger,
}

impl Test {
    /// Has all bodies rest that bend and may: what follows is found among rigid ones.
    pub(super) fn lull(&mut self, rig: &mut Rig, way: &mut UnderWay) {
        let bodies = &rig.model.bodies;
        let awake: Vec<usize> = (0..bodies.len()).filter(|body| bodies[*body].can_rest()).collect();
        if awake.is_empty() {
            return;
        }
        if way.sleep.is_over() {
            let made_up = MadeUp::of(&rig.committed.memory);
            way.sleep = Sleep { before: self.ledger, made_up, ..Sleep::default() };
        }
        let transition = rig.change_fidelity([&[], &awake]);
        self.start_elastic += transition.energy;
        way.sleep.energy += transition.energy;
        way.sleep.bodies.extend(awake);
    }

    /// Wakes them again where nothing more is to be broken up, with the forces that they have, and has them find a balance by what they bend.
    pub(super) fn wake(&mut self, rig: &mut Rig, way: &mut UnderWay) {
        if way.sleep.is_over() || !rig.failing.is_empty() {
            return;
        }
        let Sleep { bodies, energy, before, made_up } = std::mem::take(&mut way.sleep);
        let transition = rig.change_fidelity([&bodies, &[]]);
        // Elastic energy that their bending has less than before was set free in the collapse; what it has more of came out of that.
        let gained = energy + transition.energy;
        self.start_elastic += transition.energy - gained;
        self.ledger.elastic += gained;
        self.ledger.stabilisation -= gained;
        let without = rig.contacts.without(&rig.committed.memory, &made_up);
        let memory = std::mem::replace(&mut rig.committed.memory, without);
        way.claim = Some(Claim { memory, before });
        way.dwells = true;
    }

    /// Closes the books of a collapse whose bodies have found a balance awake.
    pub(super) fn settle_claim(&mut self, way: &mut UnderWay) {
        if let Some(claim) = way.claim.take() {
            let unpaid = self.ledger.close_collapse(&claim.before);
            tracing::info!(unpaid, "woken");
        }
    }

    /// Gives contacts back what was claimed where there is no balance without it; `false` where nothing was.
    pub(super) fn waive(&mut self, rig: &mut Rig, way: &mut UnderWay) -> bool {
        let Some(claim) = way.claim.take() else { return false };
        rig.committed.memory = claim.memory;
        way.dwells = false;
        let unpaid = self.ledger.close_collapse(&claim.before);
        tracing::info!(unpaid, "woken with what was claimed");
        true
    }
}
