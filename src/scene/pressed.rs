//! The increments of a press: bodies and plates brought into balance by nodes, and committed.

use std::sync::Arc;

use crate::crushing::{Kept, Limits, Settled};
use crate::error::Result;
use crate::loading::{Attempt, FidelityCounts, Portion};
use crate::model::{Counters, Deformation};
use crate::scene::drive::Progress;
use crate::scene::press::{MOST_ROUNDS, Pressed, Pressing, SETTLED};
use crate::scene::row::{BodyState, Row};
use crate::scene::run::Scene;
use crate::solver::{Balance, ContactMeasures, motion_vector};
use crate::tensor::{Pose, Vec3, Vector6};

/// An increment that takes more rounds is a snap.
const SNAP_ROUNDS: usize = 8;
/// Where nothing is left to cut, damage moves by this share of its limit, with as many more rounds.
const CAREFUL: f64 = 0.2;

/// What damage and fracture did to the energies of all parts [J], and whether a part came apart.
struct Freed {
    elastic: f64,
    freed: f64,
    failed: usize,
    broke: bool,
}

impl Scene {
    /// Brings all parts into balance between the plates where an increment takes these.
    pub(super) fn press(
        &self,
        pressing: &mut Pressing,
        stage: &mut Progress,
        next: Portion,
    ) -> Attempt<Pressed> {
        let stop = &self.settings.stop;
        let now = &self.committed.poses;
        let poses = stage.own.drive.driven(now, now, next.share, next.to);
        let rebalances = stage.own.rebalances;
        pressing.move_plates(&self.model.bodies, &poses);
        let max_change = self.settings.damage.max_change;
        let mut limits = Limits { max_change, tolerance: SETTLED, most_rounds: MOST_ROUNDS };
        let mut settled = pressing.settle(&limits, &|| stop.is_raised());
        if settled.is_err() && !stop.is_raised() {
            if !rebalances && stage.pace.cut(next.share) {
                return Attempt::Again(Counters { augmentations: MOST_ROUNDS, ..Counters::default() });
            }
            limits.max_change *= CAREFUL;
            limits.most_rounds = (MOST_ROUNDS as f64 / CAREFUL) as usize;
            settled = pressing.settle(&limits, &|| stop.is_raised());
        }
        let settled = match settled {
            Ok(settled) => settled,
            Err(_) if stop.is_raised() => return Attempt::Interrupted,
            Err(reason) => {
                return Attempt::Stopped(format!("after {:.4} of the stage: {reason}", stage.pace.done()));
            }
        };
        let [_, top] = pressing.plates();
        let way = now[top].position.z - poses[top].position.z;
        let creates = !rebalances && pressing.creates(&settled, way, self.last_push, &self.ledger);
        if creates && stage.pace.cut(next.share) {
            pressing.reject();
            let augmentations = settled.iter().map(|settled| settled.rounds).sum();
            return Attempt::Again(Counters { augmentations, ..Counters::default() });
        }
        Attempt::Balanced(Pressed { settled, poses })
    }

    /// Makes a settled state the committed one: damage, energies, poses, what broke.
    pub(super) fn commit_pressed(
        &mut self,
        pressing: &mut Pressing,
        stage: &mut Progress,
        portion: Portion,
        Pressed { settled, mut poses }: Pressed,
    ) -> Result<Row> {
        let mut counters = Counters::default();
        for settled in &settled {
            counters.augmentations += settled.rounds;
            counters.newton_iterations += settled.contact.solutions;
            counters.factorisations += settled.factorisations;
        }
        let left_behind: usize = settled.iter().map(|settled| settled.contact.left_behind).sum();
        if left_behind > 0 {
            tracing::warn!(
                increment = self.increments + 1,
                nodes = left_behind,
                "nodes stay behind a plate, where their neighbours carry it"
            );
        }
        let mut counters = stage.take_spent(&counters);
        let rebalanced = stage.own.rebalances;
        if !rebalanced {
            let easy = settled.iter().all(|settled| settled.rounds <= SNAP_ROUNDS);
            counters.cuts = stage.pace.accept(portion.share, easy);
        }
        let error_before = self.ledger.error();
        let before = self.committed.poses.clone();
        let wrenches = pressing.wrenches(&settled, &mut poses);
        self.move_plates(pressing.plates(), &poses, &wrenches);
        self.committed.poses.clone_from(&poses);
        let kept = self.keep(pressing, &settled)?;
        self.ledger.elastic = kept.elastic;
        self.ledger.damage += kept.freed;
        let hesitated = settled.iter().any(|settled| settled.rounds > SNAP_ROUNDS);
        let [_, top] = pressing.plates();
        let force = -self.reaction[top][2];
        let way = before[top].position.z - poses[top].position.z;
        // A load that is taken back falls, too.
        let fell = force.abs() < self.last_push.abs() && force * way >= 0.0;
        self.last_push = force;
        if !rebalanced {
            self.stabilised = self.ledger.stabilisation;
        }
        let snapped = rebalanced || kept.failed > 0 || fell || hesitated;
        if snapped {
            // Softening outran the plates: what that leaves over is a snap's, and what rebalancing behind it spends comes out of that.
            let change = self.ledger.error() - error_before;
            self.ledger.stabilisation = (self.ledger.stabilisation + change).max(self.stabilised);
        }
        self.increments += 1;
        let bodies = self.pressed_bodies(pressing.plates(), &poses, &wrenches);
        self.loads.prescribed.clone_from(&stage.own.drive.held);
        if self.committed.poses.len() > before.len() {
            let now = self.committed.poses.clone();
            self.take_in_parts(&now, &mut stage.own.drive);
        }
        stage.own.rebalances = kept.broke;
        let (balance, measures) = pressing.balance(&settled);
        Ok(Row {
            stage: self.stages_done,
            increment: self.increments,
            progress: stage.pace.done(),
            bodies,
            ledger: self.ledger,
            damage: self.model.damage_counts(),
            fidelity: FidelityCounts::default(),
            gravity: Vec3::zeros(),
            balance,
            measures,
            counters,
            snapped,
        })
    }

    /// Books the work of the plates on their way to `poses`, with the mean of their forces before and after.
    fn move_plates(&mut self, plates: [usize; 2], poses: &[Pose], wrenches: &[Vector6<f64>]) {
        for plate in plates {
            let motion = motion_vector(&self.committed.poses[plate], &poses[plate]);
            let reaction = -wrenches[plate];
            self.ledger.external += 0.5 * (self.reaction[plate] + reaction).dot(&motion);
            self.reaction[plate] = reaction;
        }
    }

    /// Keeps the damage of all parts; those that came apart are bodies of their own from here on.
    fn keep(&mut self, pressing: &mut Pressing, settled: &[Settled]) -> Result<Freed> {
        let mut all = Freed { elastic: 0.0, freed: 0.0, failed: 0, broke: false };
        let mut parts = Vec::with_capacity(pressing.parts.len());
        for ((number, mut part), settled) in std::mem::take(&mut pressing.parts).into_iter().zip(settled) {
            let least = part.grain.least_volume();
            let Kept { commit, broken } = part.keep(settled, pressing.bench.grip, number as u32, least)?;
            all.elastic += commit.elastic + settled.contact.patch_energy;
            all.freed += commit.dissipated;
            all.failed += commit.newly_failed;
            match broken {
                None => {
                    let body = &mut self.model.bodies[number];
                    body.deformation = Deformation::condensed(part.grain.condensed().clone());
                    body.breakage = body.breakage.of(Arc::new(part.grain.clone()));
                    parts.push((number, part));
                }
                Some(broken) => {
                    all.broke = true;
                    all.elastic -= broken.lost_energy;
                    all.freed += broken.lost_energy;
                    let pieces = part.pieces(broken);
                    let grains = pieces.iter().map(|piece| piece.grain.clone()).collect();
                    let numbers = self.model.put_pieces(&mut self.committed, number, grains);
                    parts.extend(numbers.into_iter().zip(pieces));
                }
            }
        }
        pressing.parts = parts;
        Ok(all)
    }

    /// What became of the bodies of the case.
    fn pressed_bodies(
        &self,
        plates: [usize; 2],
        poses: &[Pose],
        wrenches: &[Vector6<f64>],
    ) -> Vec<BodyState> {
        let vector = |w: &Vector6<f64>, first: usize| Vec3::new(w[first], w[first + 1], w[first + 2]);
        let state = |(number, start): (usize, &Pose)| {
            let pose = &poses[number];
            let reaction = if plates.contains(&number) { self.reaction[number] } else { Vector6::zeros() };
            BodyState {
                position: pose.position,
                rotation: pose.rotation.scaled_axis(),
                displacement: pose.position - start.position,
                contact_force: vector(&wrenches[number], 0),
                contact_moment: vector(&wrenches[number], 3),
                reaction_force: vector(&reaction, 0),
                reaction_moment: vector(&reaction, 3),
            }
        };
        self.start.iter().enumerate().map(state).collect()
    }
}

impl Pressing {
    /// Has the parts move to where they settled, in `poses`, and keeps the forces of the plates on them. Force and moment on each body of `poses`.
    fn wrenches(&mut self, settled: &[Settled], poses: &mut [Pose]) -> Vec<Vector6<f64>> {
        let [bottom, top] = self.plates();
        let mut wrenches = vec![Vector6::zeros(); poses.len()];
        self.pushes.clear();
        for ((number, _), settled) in self.parts.iter().zip(settled) {
            poses[*number] = self.pose_of(settled);
            self.pushes.extend(settled.contact.pushes.iter().map(|push| (*number, *push)));
        }
        for (number, push) in &self.pushes {
            for (on, sign) in [(*number, 1.0), (if push.upper { top } else { bottom }, -1.0)] {
                let force = push.force * sign;
                let moment = (push.at - poses[on].position).cross(&force);
                wrenches[on] += Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z);
            }
        }
        wrenches
    }

    /// How well the parts are in balance, and numbers about the forces of the plates.
    fn balance(&self, settled: &[Settled]) -> (Balance, ContactMeasures) {
        let (count, total) =
            (self.pushes.len(), self.pushes.iter().map(|(_, push)| push.force.norm()).sum::<f64>());
        let mean_force = if count > 0 { total / count as f64 } else { 0.0 };
        let touched = |upper: bool| self.pushes.iter().any(|(_, push)| push.upper == upper);
        let balance = Balance {
            out_of_balance: settled
                .iter()
                .map(|settled| settled.contact.out_of_balance())
                .fold(0.0, f64::max),
            worst_body: self.parameters.body,
            reference_force: mean_force,
            least_force: mean_force,
            unrest: 0.0,
        };
        let measures = ContactMeasures {
            points: count,
            pairs: usize::from(touched(false)) + usize::from(touched(true)),
            mean_force,
            ..ContactMeasures::default()
        };
        (balance, measures)
    }
}
