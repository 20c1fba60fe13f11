//! Few bodies that hold most of what is out of balance are solved for by themselves, before all are again.
//!
//! Where a contact begins to slip, parts or changes its features, Newton's linear model is wrong for a handful of bodies, and a line search over all would
//! shorten the step of thousands for their sake. Their unknowns are eliminated instead: they and what they touch are brought nearer to balance while
//! all others rest.
//!
//! Source: Lanzkron, Rose & Wilkes (1996), "An analysis of approximate nonlinear elimination", SIAM J. Sci. Comput. 17(2):538-559.

use crate::solver::newton::Newton;
use crate::solver::step::{DECREASE, Room, merit};

/// Bodies are few up to this share of all, and hold most from that share of the squared forces on.
const FEW: f64 = 0.03;
const MOST_OF_MERIT: f64 = 0.5;
/// Iterations on them, and lengths that a line search tries in one.
const ITERATIONS: usize = 6;
const TRIALS: usize = 4;
/// Their squared forces are brought down to this share.
const ENOUGH: f64 = 0.01;

impl Newton<'_> {
    /// Brings few bodies that leave most of `held`, the forces at the present configuration, nearer to balance, and goes there. Gives the forces then;
    /// `None`, and stays, where they are not few or where the forces on all bodies would not become less.
    pub(super) fn settle_few(&mut self, held: &[f64], room: Room) -> Option<Vec<f64>> {
        let few = self.few(held)?;
        let from = (self.poses.clone(), self.away.clone());
        self.solve_for(few, room);
        let left = self.held_residual();
        if merit(&left) < merit(held) {
            return Some(left);
        }
        self.go_to(from.0, from.1);
        None
    }

    /// The bodies to be solved for by themselves: few that leave most of `held`, and what they touch, but for plates. Bodies that bend, skins and a load's
    /// control couple all.
    fn few(&self, held: &[f64]) -> Option<Vec<bool>> {
        let model = self.model;
        if model.has_elastic() || model.membrane.is_some() || model.wall.is_some() || self.steering.is_some()
        {
            return None;
        }
        let carriers = self.dofs.carriers();
        let most = (FEW * carriers as f64) as usize;
        let mut forces: Vec<(f64, usize)> =
            (0..carriers).map(|body| (self.dofs.force_on(held, body).powi(2), body)).collect();
        let enough = MOST_OF_MERIT * forces.iter().map(|(square, _)| square).sum::<f64>();
        forces.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut sum = 0.0;
        let last = forces[..most].iter().position(|(square, _)| {
            sum += square;
            sum > enough
        })?;
        let mut worst = vec![false; carriers];
        forces[..=last].iter().for_each(|(_, body)| worst[*body] = true);
        let mut few = worst.clone();
        for (pair, _) in self.contacts.active().filter(|(pair, _)| pair.is_of(&worst)) {
            few[pair.a()] = true;
            few[pair.b()] = true;
        }
        few.iter_mut().zip(&model.bodies).for_each(|(few, body)| *few &= body.stiffness.is_finite());
        Some(few)
    }

    /// Solves for these bodies alone.
    fn solve_for(&mut self, few: Vec<bool>, room: Room) {
        let of_few = self.dofs.only(|carrier| few[carrier]);
        let mut away = vec![0.0; of_few.count()];
        self.dofs.copy_common(&self.away, &of_few, &mut away);
        let of_all = (std::mem::replace(&mut self.dofs, of_few), std::mem::replace(&mut self.away, away));
        let (system, factorisations) = (self.system.take(), self.counters.factorisations);
        self.few = Some(few);
        self.update_residual();
        self.iterate_on_few(room);
        self.few = None;
        // What is counted are factorisations of all unknowns.
        (self.system, self.counters.factorisations) = (system, factorisations);
        let of_few =
            (std::mem::replace(&mut self.dofs, of_all.0), std::mem::replace(&mut self.away, of_all.1));
        of_few.0.copy_common(&of_few.1, &self.dofs, &mut self.away);
        self.update_residual();
    }

    /// Newton's iterations on the present unknowns, until little of what is left is left, or no length of a step leaves less.
    fn iterate_on_few(&mut self, room: Room) {
        let mut held = self.held_residual();
        let mut now = merit(&held);
        let enough = ENOUGH * now;
        for _ in 0..ITERATIONS {
            if now <= enough {
                break;
            }
            let Some(mut step) = self.step(&held) else { break };
            self.clip(&mut step, room);
            let from = (self.poses.clone(), self.away.clone());
            let mut factor = self.largest_factor(&step);
            let nearer = (0..TRIALS).find_map(|_| {
                let trial = self.try_step(&from, &step, factor);
                let bound = now * (1.0 - DECREASE * factor);
                factor *= 0.5;
                trial.filter(|trial| merit(trial) < bound)
            });
            let Some(trial) = nearer else {
                self.go_to(from.0, from.1);
                break;
            };
            (now, held) = (merit(&trial), trial);
        }
    }
}
