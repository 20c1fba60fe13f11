//! Local solves: the bodies that are furthest out of balance settle, with those around them, while all others stay where they are.
//!
//! A snap is the matter of some dozen bodies, however many there are, and takes as many factorisations as it takes; of the dozen
//! they cost next to nothing. What is solved is a part of the same equations with the other unknowns held: nonlinear elimination (Lanzkron, Rose &
//! Wilkes 1996, "An analysis of approximate nonlinear elimination", SIAM J. Sci. Comput. 17(2):538-559). Between two local solves there is
//! always one of all bodies, and that alone says when there is balance.

use crate::solver::hold::Hold;
use crate::solver::newton::Newton;

/// Bodies that begin the part are out of balance by more than this share of the worst, and by more than the tolerance.
const LEAST: f64 = 0.03;
/// Where that makes the part too large, the least is doubled, up to this share of the worst.
const MOST: f64 = 0.7;
/// To them come those that touch them, and those that touch these.
const RINGS: usize = 2;
/// The largest part of all bodies that is solved for by itself.
const LARGEST_PART: f64 = 0.4;
/// Augmentations of a part at most.
const AUGMENTATIONS: usize = 20;
/// A part is solved to this share of the tolerance.
const CLOSER: f64 = 0.5;
/// What a part gives way to others have to bear, so these may be set back: to so many times the sum of squares of what was out of balance on all,
/// and so often in the search for one balance. Beyond that parts and whole can set each other back for ever.
const SETBACK: f64 = 30.0;
const MOST_SETBACKS: u32 = 5;

/// When parts are solved for in the search for one balance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parts {
    /// Augmentations before the next; `None`: no more.
    next: Option<usize>,
    /// Augmentations of parts so far.
    pub augmentations: usize,
    /// How often all bodies were set back, and how often a part was not worth its while.
    set_back: u32,
    in_vain: u32,
}

/// What came of solving for a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    /// It rests, and all bodies are nearer to balance.
    Helped,
    /// It rests, and others bear what it gave way to.
    SetBack,
    /// There is none, or it was taken back, or does not rest.
    InVain,
}

impl Parts {
    pub fn new(newton: &Newton<'_>) -> Self {
        let next = newton.settings.local_after.filter(|_| newton.can_solve_locally());
        Parts { next, augmentations: 0, set_back: 0, in_vain: 0 }
    }

    /// Solves for a part, where one is due; whether it came to rest.
    pub fn solve(&mut self, newton: &mut Newton<'_>, tolerance: f64, history: &mut Vec<f64>) -> bool {
        if self.next.is_none_or(|next| history.len() <= next) {
            return false;
        }
        let before = history.len();
        let part = newton.solve_locally(tolerance, history);
        self.augmentations += history.len() - before;
        match part {
            Part::Helped => {}
            Part::SetBack => self.set_back += 1,
            Part::InVain => {
                self.in_vain += 1;
                self.next = Some(history.len() + (1 << self.in_vain.min(16)));
            }
        }
        if self.set_back >= MOST_SETBACKS {
            self.next = None;
        }
        part != Part::InVain
    }
}

impl Newton<'_> {
    /// Whether a part of the bodies can be solved for: what couples them otherwise than by touch does not move.
    fn can_solve_locally(&self) -> bool {
        self.can_fall() && !self.settings.dwells
    }

    /// Solves for a part of the bodies; what was out of balance on it is added to `history`.
    fn solve_locally(&mut self, tolerance: f64, history: &mut Vec<f64>) -> Part {
        let Some(part) = self.part_out_of_balance(tolerance) else { return Part::InVain };
        let bodies = part.iter().filter(|inside| **inside).count();
        let square = |forces: &[f64]| forces.iter().map(|r| r * r).sum::<f64>();
        let (before, poses) = (square(&self.residual), self.poses.clone());
        let (first, done) = (history.len(), self.counters.factorisations);
        let of_part = self.dofs.restricted(|carrier| part[carrier]);
        let all = std::mem::replace(&mut self.dofs, of_part);
        let system = self.system.take();
        self.contacts.moving = part;
        self.away = vec![0.0; self.dofs.count()];
        self.update_residual();
        let enough = CLOSER * tolerance;
        let mut hold = Hold::new(self.settings);
        for _ in 0..AUGMENTATIONS {
            let balance = self.balance();
            if balance.out_of_balance < enough || self.settings.stop.is_raised() {
                break;
            }
            history.push(balance.out_of_balance);
            self.counters.augmentations += 1;
            let target = balance.target(self.settings, tolerance);
            let end = self.solve(hold.weight, target, |n| n.balance().out_of_balance < enough);
            if !hold.after(end, false, self.settings) {
                break;
            }
        }
        let rests = self.balance().out_of_balance < enough;
        self.contacts.moving.clear();
        (self.dofs, self.system) = (all, system);
        self.away = vec![0.0; self.dofs.count()];
        self.counters.local_factorisations += self.counters.factorisations - done;
        let evaluated = self.evaluate();
        let after = square(&self.residual) / before;
        let kept = evaluated && after < SETBACK;
        tracing::trace!(bodies, augmentations = history.len() - first, after, rests, kept, "part");
        if !kept {
            self.poses = poses;
            self.evaluate();
        }
        match (kept && rests, after < 1.0) {
            (true, true) => Part::Helped,
            (true, false) => Part::SetBack,
            (false, _) => Part::InVain,
        }
    }

    /// The bodies that are far out of balance and those around them; `None` where that would be nearly all.
    fn part_out_of_balance(&self, tolerance: f64) -> Option<Vec<bool>> {
        let force = |carrier: usize| self.dofs.force_on(&self.residual, carrier);
        let forces: Vec<f64> = (0..self.dofs.carriers()).map(force).collect();
        let worst = forces.iter().copied().fold(0.0, f64::max);
        let mut least = (LEAST * worst).max(tolerance * self.balance().reference_force);
        while least < MOST * worst {
            let mut part: Vec<bool> = forces.iter().map(|force| *force > least).collect();
            for _ in 0..RINGS {
                let inner = part.clone();
                for (pair, _) in self.contacts.active().filter(|(pair, _)| inner[pair.a()] || inner[pair.b()])
                {
                    for body in [pair.a(), pair.b()] {
                        // A part does not go on through a plate to all that touches it.
                        part[body] = self.dofs.is_free(body);
                    }
                }
            }
            let bodies = part.iter().filter(|inside| **inside).count();
            if bodies as f64 <= LARGEST_PART * part.len() as f64 {
                return (bodies > 0).then_some(part);
            }
            least *= 2.0;
        }
        None
    }
}
