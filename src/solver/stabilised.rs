//! Stabilised increments: implicit steps, each from where the one before ended, until what still moves is slow enough, or all is at rest.
//!
//! The first step carries what is prescribed; loads stay as they are in the others. What is out of balance after a step is the drag on what
//! still moves, and goes on moving in the next increment. Where much moves, rigid bodies go on by explicit steps
//! ([`crate::solver::dynamic_relaxation`]). In increments of many steps friction acts along the way.
//! The work of all forces is summed along the way ([`crate::solver::path`]).

use crate::solver::balance::Balance;
use crate::solver::damage::DamageWatch;
use crate::solver::dynamic_relaxation::Enough;
use crate::solver::equilibrium::{Equilibrium, Following};
use crate::solver::newton::Newton;
use crate::solver::path::{Cut, Path};
use crate::solver::settings::{Relaxation, Settings, Stabilisation};
use crate::solver::step::{Drag, Leave, Room, StepEnd};

/// Drag of a step over that of the one before.
const DRAG_LOWER: f64 = 0.3;
/// Steps of an increment that need not come to rest.
const MOST_STEPS: usize = 40;
/// Rigid bodies go on by explicit steps, so many at most at a time, where the second implicit step or a later one leaves more than this share of the unrest
/// that it began with: what is stable is left with about the drag's share of it, a collapse with most.
const SLOW: f64 = 0.33;
/// And where so much is out of balance: below, a few bodies slip, which implicit steps follow better.
const COLLAPSE: f64 = 0.02;
const EXPLICIT_STEPS: usize = 2000;
/// Goes of so many explicit steps that do not end, where all is to come to rest.
const MOST_ENDLESS: usize = 6;
/// Steps after which friction acts along the way from there on. Before, it is implicit in the whole way, so that what a step overshoots is not paid for.
const REBASE_EVERY: usize = 4;
/// The same where two bodies have come this share of the length that one may go in an iteration against each other: what slides and opens on a longer way
/// is not seen by its ends.
const REBASE_BEYOND: f64 = 0.25;
/// Newton's iterations leave this share of what may be out of balance in the mean, and so many times as much on one body: what is left there is
/// solved for in the next step.
const SHARE_OF_UNREST: f64 = 0.2;
const LOCALLY: f64 = 10.0;
/// Or these shares of what the drag holds up, on one body and in the mean.
const SHARES_OF_DRAG: [f64; 2] = [1.0, 0.1];
/// The same where a step begins with so many times the unrest that is asked for: the next ones go on from what it comes to.
const EARLY: f64 = 5.0;
const EARLY_SHARES_OF_DRAG: [f64; 2] = [1.0, 0.3];
/// The same where all is to come to rest: shares of what a step began with, and of what may be left on any body; explicit steps leave the latter in the mean.
const SHARE_OF_START: f64 = 0.05;
const SHARE_OF_TOLERANCE: f64 = 0.3;
/// A step to rest ends where a body has gone so many times what it may in an iteration: friction that it does on a longer way is not seen by its ends.
const FARTHEST: f64 = 1.0;
/// Lengths that a line search tries.
const USUAL_TRIALS: usize = 4;
/// Gaps of bodies that bend may miss their tolerance by this factor while something moves.
const LOOSE_GAPS: f64 = 10.0;

/// How the steps of an increment go.
struct Course {
    /// Drag of the first step over the typical contact stiffness, and the least.
    first_drag: f64,
    least_drag: f64,
    /// Steps after which an increment is accepted whatever moves, or given up.
    most_steps: usize,
    /// The same of fruitless ones in a row: not solved, or, where all is to come to rest, without any gain, so that the next would repeat them.
    most_fruitless: usize,
    cut: Cut,
}

impl Course {
    /// Where all is to come to rest collapses go far, and are looked at more closely.
    fn to(until: Stabilisation, settings: &Settings) -> Self {
        match until {
            Stabilisation::Unrest(_) => Course {
                first_drag: 0.1,
                least_drag: 1e-4,
                most_steps: MOST_STEPS.min(settings.max_augmentations),
                most_fruitless: 10,
                cut: Cut { least: 2, mean: 0.2 },
            },
            Stabilisation::Rest => Course {
                first_drag: settings.drag_to_rest[0],
                least_drag: settings.drag_to_rest[1],
                most_steps: settings.max_augmentations,
                most_fruitless: 4,
                cut: Cut { least: 2, mean: 0.05 },
            },
        }
    }
}

/// What dynamic relaxations may leave out of balance where steps get nowhere, over the mean contact force.
const LATE_RELAXATIONS: f64 = 1e-3;
/// Dynamic relaxations in the search for one equilibrium; each waits twice as long as the one before.
const MOST_RELAXATIONS: u32 = 6;

/// When bodies relax dynamically in an increment.
struct Relaxations {
    asked: Option<Relaxation>,
    /// Steps before the next.
    next: usize,
    done: u32,
    /// Whether steps get nowhere.
    stuck: bool,
}

impl Relaxations {
    fn new(asked: Option<Relaxation>) -> Self {
        Relaxations { asked, next: asked.map_or(0, |asked| asked.after), done: 0, stuck: false }
    }

    /// Where it is time for one, what it may leave out of balance and its most steps.
    fn due(&mut self, steps: usize, out_of_balance: f64) -> Option<(f64, usize)> {
        let Relaxation { after, bounds: [from, to], most_steps } =
            self.asked.filter(|_| self.done < MOST_RELAXATIONS)?;
        let stuck = std::mem::take(&mut self.stuck);
        let due = stuck || steps > self.next && out_of_balance > from;
        due.then(|| {
            self.done += 1;
            self.next = steps + (after.max(1) << self.done);
            (if stuck { LATE_RELAXATIONS } else { to }, most_steps)
        })
    }

    /// Has one begin in place of the next step, where steps get nowhere; whether that can be.
    fn hasten(&mut self) -> bool {
        self.stuck = self.asked.is_some() && self.done < MOST_RELAXATIONS;
        self.stuck
    }
}

/// What bodies that deform or break have come to after a step.
struct Settled {
    /// Whether forces agree with displacements and damage, and whether they nearly do.
    fully: bool,
    nearly: bool,
    energy: f64,
}

/// An increment on the way.
struct March {
    until: Stabilisation,
    course: Course,
    room: Room,
    damage: DamageWatch,
    path: Path,
    drag: Drag,
    relaxations: Relaxations,
    found: Equilibrium,
    /// Whether work is summed: scenes come to rest, and book what they lose on the way as a remainder.
    tells_work: bool,
    /// Whether friction acts along the way.
    rebases: bool,
    /// Steps whose work is summed.
    counted: usize,
    /// Fruitless steps in a row.
    fruitless: usize,
    /// Goes of explicit steps that did not end.
    endless: usize,
}

impl March {
    fn from(newton: &mut Newton<'_>) -> Self {
        let path = Path::from(newton);
        let (model, settings) = (newton.model, newton.settings);
        let until = settings.stabilisation;
        let course = Course::to(until, settings);
        let waits = model.waits_for_augmentations();
        March {
            until,
            room: if waits || model.wall.is_some() { Room::OfAll } else { Room::OfEach },
            damage: DamageWatch::new(model, settings),
            path,
            drag: newton.uniform_drag(course.first_drag),
            relaxations: Relaxations::new(settings.relaxation.filter(|_| newton.can_relax())),
            found: Equilibrium::begun(newton.balance()),
            tells_work: !model.is_of_a_scene() || until != Stabilisation::Rest,
            rebases: !waits,
            counted: 0,
            fruitless: 0,
            endless: 0,
            course,
        }
    }

    /// Where a dynamic relaxation takes the place of the next step, what it may leave out of balance and its most steps.
    fn relaxation_due(&mut self) -> Option<(f64, usize)> {
        self.relaxations.due(self.found.augmentations, self.found.balance.out_of_balance)
    }

    /// Whether explicit steps may follow an implicit one.
    fn may_go_on_explicitly(&self) -> bool {
        self.found.augmentations > 1 && (self.until != Stabilisation::Rest || self.endless < MOST_ENDLESS)
    }

    /// Whether friction is to act along the way from here on. Most of a driven body's way is prescribed, and what the first step leaves slides back: in a
    /// scene it is not because bodies have gone far.
    fn is_to_rebase(&self, newton: &Newton<'_>) -> bool {
        let many = self.found.augmentations - self.counted == REBASE_EVERY;
        self.rebases && (many || !newton.model.is_of_a_scene() && self.path.reach(newton) > REBASE_BEYOND)
    }
}

impl Newton<'_> {
    /// Brings the model into balance, or near enough to go on from, beginning in its present configuration.
    pub fn equilibrate(&mut self) -> Equilibrium {
        self.gather();
        let mut march = March::from(self);
        if march.course.most_steps == 0 {
            return Equilibrium { surface_energy: self.surface_energy(), ..march.found };
        }
        loop {
            let end = self.go_on(&mut march);
            let settled = match self.settle(&mut march.damage, march.until) {
                Ok(settled) => settled,
                Err(problem) => return Equilibrium { broke: Some(problem.to_string()), ..march.found },
            };
            let ends = self.judge(&mut march, end, &settled);
            let rebases = march.is_to_rebase(self);
            if (ends || rebases) && march.tells_work {
                march.path.go_on(self, march.course.cut);
            }
            if ends {
                let Path { work, pressure_work, bending_loss, .. } = march.path;
                return Equilibrium { work, pressure_work, bending_loss, ..march.found };
            }
            if rebases {
                march.counted = march.found.augmentations;
                self.rebase();
            }
            if self.model.follows_by_steps() {
                self.contacts.yield_in_solves(true);
            }
            if rebases || self.model.follows_by_steps() {
                self.evaluate();
            }
            // Where nothing has to come to rest the next step is the next chance, solved or not.
            if end == StepEnd::Solved || march.until != Stabilisation::Rest {
                march.drag.lower(DRAG_LOWER, march.course.least_drag, self);
            }
        }
    }

    /// Takes the next step: an implicit one, with explicit ones behind it where much moves, or a dynamic relaxation in its place.
    fn go_on(&mut self, march: &mut March) -> StepEnd {
        self.counters.augmentations += 1;
        march.found.augmentations += 1;
        if let Some((enough, most_steps)) = march.relaxation_due() {
            let end = self.relax_dynamically(Enough::OnAny(enough), most_steps, None);
            self.count_from_here(march);
            return end;
        }
        let begun = self.balance().unrest;
        let leave = self.left_of_step(march.until);
        let end = self.implicit_step(&mut march.drag, &leave, march.room);
        let Some(most) =
            self.left_to_explicit_steps(march.until, begun).filter(|_| march.may_go_on_explicitly())
        else {
            return end;
        };
        march.path.go_on(self, march.course.cut);
        let end = self.relax_dynamically(most, EXPLICIT_STEPS, Some(&mut march.path.work));
        march.endless += usize::from(end != StepEnd::Solved);
        self.count_from_here(march);
        end
    }

    /// Has friction and work count from where explicit steps have ended, and the drag begin anew.
    fn count_from_here(&mut self, march: &mut March) {
        self.rebase();
        self.evaluate();
        march.path.restart(self);
        march.counted = march.found.augmentations;
        march.drag = self.uniform_drag(march.course.first_drag);
    }

    /// Notes what a step came to; whether the increment ends with it.
    fn judge(&self, march: &mut March, end: StepEnd, settled: &Settled) -> bool {
        let until = march.until;
        let found = &mut march.found;
        found.balance = self.balance();
        found.surface_energy = settled.energy;
        found.history.push(found.balance.out_of_balance);
        let Balance { unrest, out_of_balance, .. } = found.balance;
        tracing::trace!(?end, unrest, out_of_balance, "step");
        found.converged =
            until.is_met(&found.balance, self.tolerance) && settled.fully && self.control_is_met();
        let gained = match until {
            Stabilisation::Unrest(_) => end == StepEnd::Solved,
            Stabilisation::Rest => end != StepEnd::Stalled,
        };
        march.fruitless = if gained { 0 } else { march.fruitless + 1 };
        if march.fruitless >= march.course.most_fruitless && march.relaxations.hasten() {
            march.fruitless = 0;
        }
        let tired =
            march.fruitless >= march.course.most_fruitless || found.augmentations >= march.course.most_steps;
        if tired && matches!(until, Stabilisation::Unrest(_)) {
            let is_taken = end != StepEnd::Stalled && settled.nearly && self.control_is_met();
            found.unsettled = is_taken && !settled.fully;
            found.converged |= is_taken;
        }
        let stops = self.settings.stop.is_raised();
        // A step that was cut short is not what an uninterrupted run comes to.
        found.converged &= !stops;
        found.converged || tired || stops
    }

    /// Where an implicit step that began with this unrest has brought it not much nearer to what an increment is to come to, what explicit ones may leave.
    fn left_to_explicit_steps(&self, until: Stabilisation, begun: f64) -> Option<Enough> {
        let enough = match until {
            Stabilisation::Unrest(unrest) => unrest,
            Stabilisation::Rest if self.settings.explicitly_to_rest => SHARE_OF_TOLERANCE * self.tolerance,
            Stabilisation::Rest => return None,
        };
        let left = self.balance().unrest;
        (self.can_relax() && left >= enough.max(COLLAPSE) && left > SLOW * begun)
            .then_some(Enough::InTheMean(enough))
    }

    /// What Newton's iterations may leave of a step.
    fn left_of_step(&self, until: Stabilisation) -> Leave {
        let yardsticks = self.yardsticks();
        let ([largest, mean], shares_of_drag) = match until {
            Stabilisation::Unrest(unrest) => {
                let is_early = self.mean_imbalance() > EARLY * unrest * yardsticks.mean;
                let shares = match until.goes_on(self.model) {
                    true if is_early => EARLY_SHARES_OF_DRAG,
                    true => SHARES_OF_DRAG,
                    false => [0.0; 2],
                };
                ([LOCALLY * unrest, SHARE_OF_UNREST * unrest], shares)
            }
            Stabilisation::Rest => {
                let (begun, _) = yardsticks.worst_of(&self.residual, &self.dofs, &self.contacts);
                let least = SHARE_OF_TOLERANCE * self.tolerance;
                ([(SHARE_OF_START * begun).max(least), f64::INFINITY], [0.0; 2])
            }
        };
        let goes_uphill = until == Stabilisation::Rest && self.moves_what_no_drag_holds();
        let farthest = if until == Stabilisation::Rest && !self.model.is_of_a_scene() {
            FARTHEST
        } else {
            f64::INFINITY
        };
        // What bodies that deform still miss is told after a step, and mended by iterations alone.
        let least_iterations = usize::from(until == Stabilisation::Rest && self.model.has_elastic());
        let most_trials =
            if goes_uphill || self.model.is_of_a_scene() { 2 * USUAL_TRIALS } else { USUAL_TRIALS };
        Leave {
            largest,
            mean: mean * yardsticks.mean,
            shares_of_drag,
            least_iterations,
            most_trials,
            farthest,
            goes_uphill,
            yardsticks,
        }
    }

    /// Whether a load, a wall or a plate is free to move: none has a stiffness that a drag could be taken from, and where they first meet bodies no
    /// Newton step foresees what these do.
    fn moves_what_no_drag_holds(&self) -> bool {
        let mut bodies = self.model.bodies.iter().enumerate();
        let plate = bodies.any(|(body, of)| !of.stiffness.is_finite() && self.dofs.is_free(body));
        plate || self.model.wall.is_some() || self.steering.is_some()
    }

    /// Has displacements and damage of bodies follow the forces of a step.
    fn settle(&mut self, damage: &mut DamageWatch, until: Stabilisation) -> crate::error::Result<Settled> {
        let (settings, balance) = (self.settings, self.balance());
        let mut settled = Settled { fully: true, nearly: true, energy: 0.0 };
        let mut off = match until {
            Stabilisation::Unrest(unrest) => balance.unrest / unrest,
            Stabilisation::Rest => balance.out_of_balance / self.tolerance,
        };
        if self.model.has_elastic() {
            let Following { gap, node, energy } = self.follow(&balance, damage, self.tolerance);
            settled = Settled { fully: gap < 1.0 && node < 1.0, nearly: gap < LOOSE_GAPS, energy };
            if until != Stabilisation::Rest && self.model.follows_by_steps() {
                // What displacements and forces disagree by is out of balance with what still moves, and told with it.
                settled = Settled { fully: settled.nearly, nearly: true, energy };
            }
            if until == Stabilisation::Rest {
                off = off.max(gap).max(node);
            }
        } else if damage.is_due(off, settings) {
            self.contacts.note_loads(self.model, &self.loads, &self.poses);
        }
        let is_damaged = damage.step(&mut self.contacts, self.model, settings, off)?;
        settled.fully &= is_damaged;
        let follows = self.model.follows_by_steps();
        if follows {
            self.contacts.yield_in_solves(false);
        }
        if self.model.has_elastic() || !is_damaged {
            self.evaluate();
            self.gather();
        }
        if follows {
            settled.energy = self.surface_energy();
        }
        Ok(settled)
    }
}
