//! One implicit step: forces in balance with a drag on each body.
//!
//! A step solves `r(q) - c k (q - q_c) = 0` for the configuration `q` (forces [N]): `r` are the forces out of balance, `q_c` is where the step
//! begins, `k` a typical contact stiffness [N/m] and `c` the drag of each body over it. That is a backward Euler step of bodies in a viscous fluid.
//! The drag of a body rises where Newton's iterations get nowhere, there alone: one place of thousands does not hold up the others.

use crate::solver::balance::Yardsticks;
use crate::solver::newton::Newton;
use crate::tensor::Pose;

/// Times that the drag of some bodies rises in a step.
const MOST_RAISES: usize = 6;
/// Factor on a drag that rises, and the strongest.
const RAISE: f64 = 6.0;
const STRONGEST: f64 = 30.0;
/// Bodies whose held force is this share of the largest get more drag, and what touches them.
const STUCK_SHARE: f64 = 0.2;
/// Decrease of the merit that a step of full length has to bring; of its share, where a plate, or anything in a scene, goes a shorter way.
pub(super) const DECREASE: f64 = 0.1;
/// Drag of a body without a stiffness of its own, a plate: it moves with what it touches, and only just has a position where that is nothing.
const PLATE_DRAG: f64 = 1e-6;

/// What Newton's iterations may leave of forces and drag.
#[derive(Debug)]
pub(super) struct Leave {
    /// On any body, over what its forces are judged by.
    pub largest: f64,
    /// Mean over the free bodies [N].
    pub mean: f64,
    /// Or these shares of what the drag holds up.
    pub shares_of_drag: [f64; 2],
    /// Iterations that are made in any case.
    pub least_iterations: usize,
    /// Lengths that a line search tries, each half of the one before.
    pub most_trials: usize,
    /// How far any body may go, over the length that it may go in an iteration.
    pub farthest: f64,
    /// Whether a step that is refused to the end goes to the best that was tried all the same.
    pub goes_uphill: bool,
    /// What forces are judged by where the step begins.
    pub yardsticks: Yardsticks,
}

/// Whose room between neighbours limits how far a body goes in an iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Room {
    /// Its own: one that hardly anything holds does not hold up the others.
    OfEach,
    /// The least of all.
    OfAll,
}

/// How a step ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StepEnd {
    /// Forces and drag balance.
    Solved,
    /// Nearer to that than it began, or a body has gone as far as it may in a step.
    Reduced,
    /// It got nowhere.
    Stalled,
}

/// The drag of every carrier over the typical contact stiffness.
#[derive(Debug, Clone)]
pub(super) struct Drag {
    weights: Vec<f64>,
}

/// What a line search came to.
struct Search {
    /// Forces and drag at the length that was taken, if one was.
    accepted: Option<Vec<f64>>,
    /// The length that was tried last, or would be next.
    factor: f64,
    /// The least merit of a length that was refused, and that length.
    least: (f64, f64),
    /// Forces and drag at the longest that was refused and can be stood at.
    refused: Option<Vec<f64>>,
}

/// What a step makes less of: the sum of squares.
pub(super) fn merit(forces: &[f64]) -> f64 {
    forces.iter().map(|force| force * force).sum()
}

impl Newton<'_> {
    /// The same drag on all bodies, but for plates.
    pub(super) fn uniform_drag(&self, weight: f64) -> Drag {
        let mut drag = Drag { weights: vec![weight; self.dofs.bodies()] };
        drag.free_plates(self);
        drag
    }

    /// Takes an implicit step from the present configuration, to where forces balance the drag but for what may be left.
    pub(super) fn implicit_step(&mut self, drag: &mut Drag, leave: &Leave, room: Room) -> StepEnd {
        self.recentre();
        drag.weights.resize(self.dofs.bodies(), drag.weights.last().copied().unwrap_or(0.0));
        self.weights.clone_from(&drag.weights);
        let mut held = self.held_residual();
        let (mut raises, mut gained) = (0, false);
        for iteration in 0..self.settings.max_newton {
            let is_enough = |newton: &Self, held: &[f64]| {
                iteration >= leave.least_iterations && newton.leaves_little(held, leave)
            };
            if is_enough(self, &held) {
                return StepEnd::Solved;
            }
            if self.settings.stop.is_raised() {
                break;
            }
            if let Some(less) = self.settle_few(&held, room) {
                held = less;
                if is_enough(self, &held) {
                    return StepEnd::Solved;
                }
            }
            self.counters.newton_iterations += 1;
            let Some(mut step) = self.step(&held) else { break };
            let shortened = self.clip(&mut step, room);
            let from = (self.poses.clone(), self.away.clone());
            let now = merit(&held);
            let search = self.search_along(&from, &step, now, shortened, leave.most_trials, room);
            tracing::trace!(
                accepted = search.accepted.is_some(),
                factor = search.factor,
                merit = now,
                drag = drag.weights.iter().copied().fold(0.0, f64::max),
                "iteration"
            );
            if let Some(new) = search.accepted {
                (held, gained) = (new, true);
                if self.has_gone_far(leave.farthest) {
                    return StepEnd::Reduced;
                }
                continue;
            }
            raises += 1;
            if raises > MOST_RAISES {
                if leave.goes_uphill && search.least.0.is_finite() {
                    self.try_step(&from, &step, search.least.1);
                } else {
                    self.go_to(from.0, from.1);
                }
                break;
            }
            self.go_to(from.0, from.1);
            self.raise(drag, &held, search.refused.as_deref().unwrap_or(&held));
            self.weights.clone_from(&drag.weights);
            held = self.held_residual();
        }
        if self.leaves_little(&held, leave) {
            StepEnd::Solved
        } else if gained {
            StepEnd::Reduced
        } else {
            StepEnd::Stalled
        }
    }

    /// Tries `most_trials` lengths of a step, each half of the one before, for one that brings the merit low enough below the one where it begins, `now`.
    /// `shortened` is the share that clipping has left of what counts.
    fn search_along(
        &mut self,
        from: &(Vec<Pose>, Vec<f64>),
        step: &[f64],
        now: f64,
        shortened: f64,
        most_trials: usize,
        room: Room,
    ) -> Search {
        let mut search = Search {
            accepted: None,
            factor: self.largest_factor(step),
            least: (f64::INFINITY, 0.0),
            refused: None,
        };
        for number in 0..most_trials {
            let bound = now * (1.0 - DECREASE * search.factor * shortened);
            let trial = self.try_step(from, step, search.factor);
            let value = trial.as_deref().map_or(f64::INFINITY, merit);
            if value < bound {
                search.accepted = trial;
                break;
            }
            // The whole length may be wrong for few alone.
            let first = trial.as_deref().filter(|_| number == 0);
            let settled = first.and_then(|held| self.settle_few(held, room));
            if settled.as_deref().is_some_and(|held| merit(held) < bound) {
                search.accepted = settled;
                break;
            }
            if value < search.least.0 {
                search.least = (value, search.factor);
            }
            search.factor *= 0.5;
            search.refused = search.refused.or(trial);
        }
        search
    }

    /// Whether any body has come this far in a step, over the length that it may go in an iteration.
    fn has_gone_far(&self, farthest: f64) -> bool {
        if farthest.is_infinite() {
            return false;
        }
        let most = farthest * self.most_motion();
        (0..self.model.bodies.len()).any(|body| self.reach(&self.away, body) > most)
    }

    fn leaves_little(&self, held: &[f64], leave: &Leave) -> bool {
        let largest = |forces: &[f64]| leave.yardsticks.worst_of(forces, &self.dofs, &self.contacts).0;
        let [most, mean] = leave.shares_of_drag;
        let on_any =
            if most > 0.0 { leave.largest.max(most * largest(&self.residual)) } else { leave.largest };
        // What a load's control is off by is a force as well, the last.
        let control = held.last().filter(|_| self.steering.is_some()).map_or(0.0, |off| off.abs());
        largest(held) < on_any
            && control < on_any * leave.yardsticks.mean
            && self.mean_force(held) < leave.mean.max(mean * self.mean_force(&self.residual))
    }

    /// Raises the drag where the forces are largest, of where a step stands or of where it was refused, and of what touches there.
    pub(super) fn raise(&self, drag: &mut Drag, held: &[f64], refused: &[f64]) {
        let force = |body: usize| self.dofs.force_on(held, body).max(self.dofs.force_on(refused, body));
        let carriers = self.dofs.carriers();
        let most = (0..carriers).map(force).fold(0.0, f64::max);
        let stuck: Vec<bool> = (0..carriers).map(|body| !(force(body) <= STUCK_SHARE * most)).collect();
        let mut raised = stuck.clone();
        for (pair, _) in self.contacts.active() {
            let meets = pair.is_of(&stuck);
            raised[pair.a()] |= meets;
            raised[pair.b()] |= meets;
        }
        for (weight, _) in drag.weights.iter_mut().zip(raised).filter(|(_, raised)| *raised) {
            *weight = (RAISE * *weight).min(STRONGEST);
        }
        drag.free_plates(self);
    }

    /// Shortens the motion of each body to what it may go at once, and by the room that it has itself. Gives the least share that is left
    /// of any plate, which no drag holds back, in a scene of any body.
    pub(super) fn clip(&self, step: &mut [f64], room: Room) -> f64 {
        let most = self.most_motion();
        let bodies = self.model.bodies.len();
        let mut reach: Vec<f64> = (0..bodies).map(|body| self.reach(step, body)).collect();
        let mut shares = vec![1.0; bodies];
        for body in 0..bodies {
            shares[body] = (most / reach[body]).min(1.0);
            reach[body] *= shares[body];
        }
        let alone = shares.clone();
        for pair in self.contacts.pairs.iter().filter(|_| room == Room::OfEach) {
            let [a, b] = [pair.a(), pair.b()];
            let share = (0.5 * pair.nearest / (reach[a] + reach[b]).max(f64::MIN_POSITIVE)).min(1.0);
            for body in [a, b] {
                shares[body] = shares[body].min(share * alone[body]);
            }
        }
        for (body, share) in shares.iter().enumerate().filter(|(_, share)| **share < 1.0) {
            for unknown in self.dofs.of(body).iter().flatten() {
                step[*unknown as usize] *= share;
            }
        }
        let scene = self.model.is_of_a_scene();
        let counting =
            shares.iter().zip(&self.model.bodies).filter(|(_, body)| scene || !body.stiffness.is_finite());
        counting.fold(1.0, |least, (share, _)| least.min(*share))
    }
}

impl Drag {
    /// Lowers all drags by a factor, to no less than `least`.
    pub(super) fn lower(&mut self, factor: f64, least: f64, newton: &Newton<'_>) {
        self.weights.iter_mut().for_each(|weight| *weight = (*weight * factor).max(least));
        self.free_plates(newton);
    }

    /// Of one carrier.
    #[cfg(test)]
    pub(super) fn of(&self, carrier: usize) -> f64 {
        self.weights[carrier]
    }

    fn free_plates(&mut self, newton: &Newton<'_>) {
        for (weight, body) in self.weights.iter_mut().zip(&newton.model.bodies) {
            if !body.stiffness.is_finite() {
                *weight = PLATE_DRAG;
            }
        }
    }
}
