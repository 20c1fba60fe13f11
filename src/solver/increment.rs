//! One increment: from the committed state to the next equilibrium, or a reason why not.

use std::collections::VecDeque;

use crate::assembly::{self, Contacts, Damages, Losses, SurfaceField, TooClose};
use crate::contact::Memory;
use crate::model::{Committed, Counters, Loads, Model};
use crate::solver::audit;
use crate::solver::balance::Balance;
use crate::solver::equilibrium::Equilibrium;
use crate::solver::newton::Newton;
use crate::solver::settings::Settings;
use crate::tensor::{Pose, Vector6};

/// An increment to attempt.
pub struct Increment<'a> {
    pub model: &'a Model,
    pub committed: &'a Committed,
    pub loads: &'a Loads,
    pub settings: &'a Settings,
}

/// How an attempt ended.
#[derive(Debug, Clone, PartialEq)]
pub enum StepStatus {
    Converged,
    /// Forces still out of balance when the solver gave up.
    OutOfBalance {
        body: usize,
        out_of_balance: f64,
    },
    /// Told to stop ([`Settings::stop`]).
    Abandoned,
    /// Damage left a body that cannot be factored.
    Unsolvable {
        problem: String,
    },
    /// The starting configuration already overlaps beyond what a contact can carry, or there is none: what is driven would pass through a body.
    TooClose(Option<TooClose>),
    /// Bodies reached into each other where no contact tells.
    Overlapping {
        problem: String,
    },
}

/// A steady increment balances within this many augmentations (docs/decisions/0172-stabilisation-by-balance.md).
const SNAP_AUGMENTATIONS: usize = 8;

/// The outcome of an attempt; nothing is committed yet.
#[derive(Debug, Clone)]
pub struct IncrementReport {
    pub status: StepStatus,
    pub poses: Vec<Pose>,
    pub memory: Memory,
    /// Displacement of the surface nodes of condensed bodies [m].
    pub fields: Vec<SurfaceField>,
    pub balance: Balance,
    pub energy: Energies,
    /// Energy that contacts lost on the way.
    pub lost: Losses,
    /// Change of the volume under the cover by elastic displacements [m^3].
    pub elastic_volume: f64,
    /// Forces and moments on each carrier at the end, but for those applied from outside [N, N m].
    pub forces: Vec<Vector6<f64>>,
    /// Force and moment that contacts, and a membrane glued to it, exert on each body [N, N m].
    pub contact_wrench: Vec<Vector6<f64>>,
    pub counters: Counters,
    /// Out-of-balance at each augmentation, for the dossier.
    pub history: Vec<f64>,
    pub augmentations: usize,
    pub measures: ContactMeasures,
    /// Damage of the bodies that can break.
    pub damage: Damages,
    /// The load factor that the loads' control was found to need; zero without one.
    pub factor: f64,
    /// Work of contacts, cover and weight on each component of each carrier along a stabilised increment [J].
    pub work: Vec<Vector6<f64>>,
    /// Work of the pressure on the volume under the cover along it, without what bodies bend [J].
    pub pressure_work: f64,
    /// Work of forces on displacements of bodies that follow them by steps, beyond what these store [J].
    pub bending_loss: f64,
    /// Whether more moves at the end than was asked for.
    pub restless: bool,
    /// Whether gaps or damage had not settled after as many steps as an increment takes.
    pub unsettled: bool,
}

impl IncrementReport {
    /// Makes where it ended the committed state.
    pub fn commit_to(&self, committed: &mut Committed) {
        committed.poses.clone_from(&self.poses);
        committed.memory.clone_from(&self.memory);
        committed.fields.clone_from(&self.fields);
        committed.forces.clone_from(&self.forces);
    }

    /// The state where it ended, without the forces of bodies that are held there.
    pub fn as_committed(&self) -> Committed {
        let (poses, memory, fields) = (self.poses.clone(), self.memory.clone(), self.fields.clone());
        Committed { memory, fields, ..Committed::new(poses) }
    }

    /// Energy that damage set free, and that crushing took [J].
    pub fn damage_work(&self) -> f64 {
        self.damage.dissipated + self.lost.softening + self.lost.crushing
    }

    pub fn converged(&self) -> bool {
        self.status == StepStatus::Converged
    }

    /// Whether the solver had to relax through an instability (a snap of the force chains): more
    /// augmentations than a steady increment takes.
    pub fn is_snap(&self) -> bool {
        self.augmentations > SNAP_AUGMENTATIONS
    }

    /// Whether a longer increment would probably do as well.
    pub fn is_easy(&self) -> bool {
        !self.restless && !self.is_snap()
    }
}

/// Energies of an accepted configuration [J].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energies {
    /// Stored in the contacts and in condensed bodies.
    pub elastic: f64,
    /// Stored in the membrane's sheet.
    pub membrane: f64,
}

/// Numbers about the contact network.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactMeasures {
    pub points: usize,
    pub pairs: usize,
    /// Share of contact points at the friction bound.
    pub sliding_fraction: f64,
    /// Largest overlap of the rounded bodies [m].
    pub max_penetration: f64,
    pub mean_force: f64,
}

/// Tries to bring the model into balance under `loads`: a specimen from that of `starts` with the least force out of balance, a scene, or bodies that
/// wait for augmentations, from the first that does not overlap. `contacts` lends its buffers and gets them back.
pub fn advance(
    increment: &Increment<'_>,
    starts: Vec<Vec<Pose>>,
    contacts: &mut Contacts,
) -> IncrementReport {
    let searches = contacts.searches;
    let mut newton = match increment.begin(starts, contacts) {
        Ok(newton) => newton,
        Err(report) => return *report,
    };
    let found = newton.equilibrate();
    let damage = increment.damage(&mut newton, found.converged);
    let report = increment.report(&mut newton, found, damage, searches);
    *contacts = newton.contacts;
    report
}

impl<'a> Increment<'a> {
    /// The start to go on from, its contacts evaluated; a report where bodies are too close in all.
    fn begin(
        &self,
        starts: Vec<Vec<Pose>>,
        contacts: &mut Contacts,
    ) -> Result<Newton<'a>, Box<IncrementReport>> {
        let Increment { model, committed, loads, settings } = *self;
        let mut lent = std::mem::take(contacts);
        lent.first_scale = settings.first_penalty.recip();
        let mut last_start = committed.poses.clone();
        let mut too_close = None;
        let chooses = !model.is_of_a_scene() && !model.waits_for_augmentations();
        let mut best: Option<(f64, Vec<Pose>)> = None;
        let mut starts = VecDeque::from(starts);
        while let Some(start) = starts.pop_front() {
            match Newton::new(model, committed, loads, settings, lent, start.clone()) {
                Ok(mut ready) => {
                    let off = ready.mean_imbalance();
                    let improves = best.as_ref().is_none_or(|(least, _)| off < *least);
                    if !chooses || (starts.is_empty() && improves) {
                        return Ok(ready);
                    }
                    lent = std::mem::take(&mut ready.contacts);
                    if improves {
                        best = Some((off, start));
                    }
                }
                Err(back) => {
                    (lent, too_close) = (back.0, Some(back.1));
                    last_start = start;
                }
            }
            // Tried again, now the last.
            if starts.is_empty() {
                starts.extend(best.take().map(|(_, start)| start));
            }
        }
        *contacts = lent;
        Err(Box::new(self.without_start(last_start, too_close)))
    }

    /// What is said where bodies are too close in all configurations to start from, `poses` being the last.
    fn without_start(&self, poses: Vec<Pose>, too_close: Option<TooClose>) -> IncrementReport {
        IncrementReport {
            status: StepStatus::TooClose(too_close),
            poses,
            memory: self.committed.memory.clone(),
            fields: self.committed.fields.clone(),
            balance: Balance {
                out_of_balance: f64::INFINITY,
                worst_body: 0,
                reference_force: 0.0,
                least_force: 0.0,
                unrest: f64::INFINITY,
            },
            energy: Energies::default(),
            lost: Losses::default(),
            elastic_volume: 0.0,
            forces: Vec::new(),
            contact_wrench: vec![Vector6::zeros(); self.model.bodies.len()],
            counters: Counters::default(),
            history: Vec::new(),
            augmentations: 0,
            measures: ContactMeasures::default(),
            damage: Damages::default(),
            factor: 0.0,
            work: Vec::new(),
            pressure_work: 0.0,
            bending_loss: 0.0,
            restless: false,
            unsettled: false,
        }
    }

    /// Damage of the increment.
    fn damage(&self, newton: &mut Newton<'_>, converged: bool) -> crate::error::Result<Damages> {
        let takes_damage = converged && self.settings.damage.moves;
        if takes_damage && self.model.can_break() && !self.model.has_elastic() {
            // Behind the first failed cell nobody asked for them any more.
            newton.contacts.note_loads(self.model, &newton.loads, &newton.poses);
        }
        // What is not taken goes on being followed, but contacts stay as soft as they became.
        if takes_damage { newton.contacts.damages(self.model) } else { Ok(Damages::default()) }
    }

    /// What the search for an equilibrium came to; `searches` of contacts had been made before it.
    fn report(
        &self,
        newton: &mut Newton<'_>,
        found: Equilibrium,
        damage: crate::error::Result<Damages>,
        searches: usize,
    ) -> IncrementReport {
        let Increment { model, committed, settings, .. } = *self;
        let status = self.status(newton, &found, damage.as_ref().err());
        let damage = damage.unwrap_or_default();
        let mut energy = Energies::default();
        let contact_wrench = self.contact_wrenches(newton);
        if let Some(membrane) = &model.membrane {
            energy.elastic += newton.contacts.membrane.energy();
            energy.membrane = membrane.energy(&newton.contacts.membrane.positions);
        }
        energy.elastic += newton.contacts.wall.iter().map(|contact| contact.energy).sum::<f64>();
        for (_, point) in newton.contacts.active() {
            energy.elastic += point.evaluation.energy + point.evaluation.tangential_energy;
        }
        energy.elastic += found.surface_energy - damage.removed;
        let mut counters = newton.counters;
        counters.searches = newton.contacts.searches - searches;
        IncrementReport {
            status,
            poses: newton.poses.clone(),
            memory: newton.contacts.memory(model),
            fields: newton.contacts.fields.clone(),
            balance: found.balance,
            energy,
            lost: newton.losses(),
            elastic_volume: newton.contacts.elastic_volume(model, committed, &newton.poses),
            forces: newton.forces(),
            contact_wrench,
            counters,
            history: found.history,
            augmentations: found.augmentations,
            measures: ContactMeasures::of(&newton.contacts),
            damage,
            factor: newton.steering.as_ref().map_or(0.0, |steering| steering.factor),
            restless: !settings.stabilisation.is_met(&found.balance, settings.force_tolerance),
            unsettled: found.unsettled,
            work: found.work,
            pressure_work: found.pressure_work,
            bending_loss: found.bending_loss,
        }
    }

    fn status(
        &self,
        newton: &Newton<'_>,
        found: &Equilibrium,
        unsolvable: Option<&crate::error::Error>,
    ) -> StepStatus {
        let state = found.converged.then_some(&newton.poses);
        let overlap = state.and_then(|poses| audit::fault(self.model, &newton.contacts, poses));
        if let Some(problem) = overlap {
            StepStatus::Overlapping { problem }
        } else if found.converged && unsolvable.is_none() {
            StepStatus::Converged
        } else if self.settings.stop.is_raised() {
            StepStatus::Abandoned
        } else if let Some(problem) = unsolvable.map(ToString::to_string).or_else(|| found.broke.clone()) {
            StepStatus::Unsolvable { problem }
        } else {
            StepStatus::OutOfBalance {
                body: found.balance.worst_body,
                out_of_balance: found.balance.out_of_balance,
            }
        }
    }

    /// Force and moment that contacts, and a membrane glued to it, exert on each body [N, N m].
    fn contact_wrenches(&self, newton: &Newton<'_>) -> Vec<Vector6<f64>> {
        let mut wrenches = vec![Vector6::zeros(); self.model.carriers()];
        if let Some(membrane) = &self.model.membrane {
            assembly::membrane_forces_into(&mut wrenches, membrane, &newton.contacts, &newton.poses);
        }
        wrenches.truncate(self.model.bodies.len());
        assembly::add_contact_forces(&mut wrenches, &newton.contacts, |_| true);
        wrenches
    }
}

impl ContactMeasures {
    fn of(contacts: &Contacts) -> Self {
        let overlaps = contacts.active().map(|(_, point)| -point.evaluation.gap);
        let of_wall = contacts.wall.iter().map(|contact| contact.overlap);
        let points = contacts.active().count();
        let sliding = contacts.active().filter(|(_, point)| point.evaluation.slides()).count();
        ContactMeasures {
            points,
            pairs: contacts.pairs.iter().filter(|pair| pair.active().next().is_some()).count(),
            sliding_fraction: if points == 0 { 0.0 } else { sliding as f64 / points as f64 },
            max_penetration: of_wall.chain(overlaps).fold(0.0, f64::max),
            mean_force: contacts.mean_force(),
        }
    }
}
