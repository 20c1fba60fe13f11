//! The increments of a scene: how each begins, what is tried after a miss, what its commit does.

use crate::assembly::TooClose;
use crate::error::Result;
use crate::loading::{Attempt, FidelityCounts, Loaded, Portion, StageEnd, fell};
use crate::model::{Counters, Loads};
use crate::scene::drive::{Drive, Last, Progress, StageState};
use crate::scene::fall::{self, fallen};
use crate::scene::press::{Pressed, Pressing};
use crate::scene::row::{BodyState, Row};
use crate::scene::run::Scene;
use crate::solver::fidelity::{change, judge};
use crate::solver::{
    Dossier, Increment, IncrementReport, StepStatus, Transition, Verdict, advance, continued_poses,
    motion_vector, sweep,
};
use crate::tensor::{Pose, Vec3, Vector6};

/// An increment of a scene in balance.
pub enum Balanced {
    Increment { report: Box<IncrementReport>, loads: Loads, verdict: Verdict },
    Pressed(Pressed),
}

impl Loaded for Scene {
    type Own = StageState;
    type Balanced = Balanced;
    type Row = Row;

    fn break_up(&mut self, stage: &mut Progress) -> Result<()> {
        if self.failing.is_empty() {
            return Ok(());
        }
        let failing = std::mem::take(&mut self.failing);
        let before = self.committed.poses.clone();
        let displacements = failing.displacements(before.len());
        // What stages say of a body is of its reference point.
        let named: Vec<usize> = self.named().collect();
        let fractures =
            self.model.break_up(&mut self.committed, &displacements, |body| named.contains(&body))?;
        let lost: f64 = fractures.iter().map(|fracture| fracture.lost_energy).sum();
        self.ledger.damage += lost;
        self.ledger.elastic -= lost;
        self.take_in_parts(&before, &mut stage.own.drive);
        for fracture in fractures.iter().filter(|fracture| fracture.parts.is_empty()) {
            stage.own.drive.held[fracture.body] = [true; 6];
        }
        if !fractures.is_empty() {
            self.contacts.forget_bodies();
        }
        self.contacts.inherit(&self.model, &mut self.committed, &fractures);
        (stage.own.rebalances, stage.own.last) = (true, None);
        Ok(())
    }

    /// Where bodies broke, first a new balance as it is.
    fn next(&self, stage: &Progress) -> Option<Portion> {
        let share = if stage.own.rebalances { Some(0.0) } else { stage.pace.next() };
        share.map(|share| Portion { share, to: stage.pace.after(share) })
    }

    fn attempt(&mut self, stage: &mut Progress, next: Portion) -> Attempt<Balanced> {
        match self.with_pressing(|scene, pressing| scene.press(pressing, stage, next)) {
            Some(attempt) => attempt.map(Balanced::Pressed),
            None => self.balance(stage, next),
        }
    }

    fn commit(&mut self, stage: &mut Progress, portion: Portion, balanced: Balanced) -> Result<Row> {
        match balanced {
            Balanced::Pressed(pressed) => {
                let commit = |scene: &mut Scene, pressing: &mut Pressing| {
                    scene.commit_pressed(pressing, stage, portion, pressed)
                };
                self.with_pressing(commit).unwrap_or_else(|| unreachable!("only a press is pressed"))
            }
            Balanced::Increment { report, loads, verdict } => {
                Ok(self.commit_balanced(stage, portion, *report, loads, &verdict))
            }
        }
    }

    fn progress(&mut self) -> &mut Option<Progress> {
        &mut self.progress
    }

    fn is_last(&self, stage: &Progress) -> bool {
        self.next(stage).is_none() && self.failing.is_empty() && self.stages_done + 1 == self.stages.len()
    }

    fn end(&self, _: &Progress) -> StageEnd {
        StageEnd::Finished
    }
}

impl Scene {
    /// Lets the press and the rest of the scene act on each other, where the scene is one; it is back in its place whatever comes of that.
    fn with_pressing<T>(&mut self, act: impl FnOnce(&mut Scene, &mut Pressing) -> T) -> Option<T> {
        let mut pressing = self.pressing.take()?;
        let done = act(self, &mut pressing);
        self.pressing = Some(pressing);
        Some(done)
    }

    /// Brings an increment into balance; where nothing is left to cut, behind a fall.
    fn balance(&mut self, stage: &mut Progress, next: Portion) -> Attempt<Balanced> {
        let StageState { drive, last, rebalances } = &stage.own;
        let loads = drive.loads_at(next.to);
        let now = &self.committed.poses;
        let driven = |poses: &[Pose]| drive.driven(poses, now, next.share, next.to);
        let continued = last.iter().map(|last| continued_poses(&last.poses, now, next.share / last.share));
        let mut starts: Vec<Vec<Pose>> = continued.map(|poses| driven(&poses)).chain([driven(now)]).collect();
        starts.retain(|start| sweep::is_clear(&self.model, now, start));
        let slow_start = starts.last().cloned();
        let (model, committed, settings) = (&self.model, &self.committed, &self.settings);
        let increment = Increment { model, committed, loads: &loads, settings };
        let mut report = advance(&increment, starts, &mut self.contacts);
        if !report.converged() {
            if !settings.stop.is_raised() && !rebalances && stage.pace.cut(next.share) {
                return Attempt::Again(report.counters);
            }
            // Nothing is left to cut: perhaps the next equilibrium is far away.
            let mut dossier = Dossier::of(model, &self.contacts, &report, settings);
            let fell = slow_start.and_then(|start| self.fall(&loads, &start, &mut report.counters));
            if self.settings.stop.is_raised() {
                return Attempt::Interrupted;
            }
            let Some(fell) = fell else {
                dossier.factorisations = stage.spent.factorisations + report.counters.factorisations;
                self.dossier = Some(dossier);
                return Attempt::Stopped(self.describe(&report, stage.pace.done()));
            };
            let spent = std::mem::replace(&mut report, fell).counters;
            report.counters.add(&spent);
        }
        let (model, settings) = (&self.model, &self.settings);
        let verdict = judge(model, &report.as_committed(), &loads, settings, &self.contacts);
        if stage.repeats(&verdict, || self.change_fidelity([&verdict.wake, &[]]).woken) {
            return Attempt::Again(report.counters);
        }
        Attempt::Balanced(Balanced::Increment { report: Box::new(report), loads, verdict })
    }

    /// The balance of bodies that fall from the committed state, what is driven being where it is in `start`; adds what is tried in vain to `spent`.
    fn fall(&mut self, loads: &Loads, start: &[Pose], spent: &mut Counters) -> Option<IncrementReport> {
        let settings = self.settings.behind_a_fall()?;
        let Scene { model, committed, contacts, .. } = self;
        let increment = Increment { model, committed, loads, settings: &settings };
        let ways = [committed.poses.as_slice(), start];
        for share in fall::FRICTION {
            let fallen = fallen(model, loads, ways, share, &settings.stop)?;
            let report = advance(&increment, vec![fallen], contacts);
            if report.converged() {
                return Some(report);
            }
            spent.add(&report.counters);
        }
        None
    }

    /// Makes the increment the committed state, books its energies and tells what it did.
    fn commit_balanced(
        &mut self,
        stage: &mut Progress,
        portion: Portion,
        report: IncrementReport,
        loads: Loads,
        verdict: &Verdict,
    ) -> Row {
        let rebalanced = std::mem::take(&mut stage.own.rebalances);
        let mut counters = stage.take_spent(&report.counters);
        if !rebalanced {
            counters.cuts = stage.pace.accept(portion.share, report.is_easy());
            stage.own.last = Some(Last { poses: self.committed.poses.clone(), share: portion.share });
        }
        let (bodies, snapped) = self.book(&report, &loads, rebalanced);
        report.commit_to(&mut self.committed);
        self.model.take_damage(&report.damage.grains);
        self.contacts.forget_trial();
        self.failing = report.damage.failing(&self.model);
        self.increments += 1;
        let gravity = loads.gravity;
        self.loads = loads;
        let damage = self.model.damage_counts();
        let early = stage.take_repeats();
        let transition = self.change_fidelity([&verdict.wake, &verdict.rest]);
        Row {
            stage: self.stages_done,
            increment: self.increments,
            progress: stage.pace.done(),
            bodies,
            ledger: self.ledger,
            damage,
            fidelity: FidelityCounts::of(&self.model, verdict, &transition, early),
            gravity,
            balance: report.balance,
            measures: report.measures,
            counters,
            snapped,
        }
    }

    /// Has loads, supports and the drive of a stage know parts that bodies came apart into; `before` are the poses before that.
    pub(super) fn take_in_parts(&mut self, before: &[Pose], drive: &mut Drive) {
        let poses = &self.committed.poses;
        self.loads.applied.resize(poses.len(), Vector6::zeros());
        self.loads.prescribed.resize(poses.len(), [false; 6]);
        self.reaction.resize(poses.len(), Vector6::zeros());
        drive.grow(before, poses);
    }

    /// Makes bodies condensed and rigid in the committed state; elastic energy counts on from what it was.
    fn change_fidelity(&mut self, changes: [&[usize]; 2]) -> Transition {
        let transition = change(&mut self.model, &mut self.committed, &mut self.contacts, 0.0, changes);
        self.elastic_shift += transition.energy;
        transition
    }

    /// Enters an increment into the ledger, forces counted by the mean of before and after; reactions become those of its end. What became of the bodies
    /// of the case, and whether the increment snapped: what it leaves over is then taken as set free.
    fn book(&mut self, report: &IncrementReport, loads: &Loads, rebalanced: bool) -> (Vec<BodyState>, bool) {
        let (error_before, mut unborne) = (self.ledger.error(), 0.0);
        for (i, (old, new)) in self.committed.poses.iter().zip(&report.poses).enumerate() {
            let dead = self.dead_load(i, loads, new);
            let borne = report.contact_wrench[i] + dead;
            let held = &loads.prescribed[i];
            let reaction = Vector6::from_fn(|k, _| if held[k] { -borne[k] } else { 0.0 });
            let before = self.dead_load(i, &self.loads, old) + self.reaction[i];
            let work = 0.5 * (before + dead + reaction).dot(&motion_vector(old, new));
            self.ledger.external += work;
            if before == Vector6::zeros() && *held == [false; 6] {
                unborne += work;
            }
            self.reaction[i] = reaction;
        }
        self.ledger.elastic = report.energy.elastic - self.elastic_shift;
        self.ledger.lose(report);
        let left_over = self.ledger.error() - error_before;
        let snapped = rebalanced || report.is_snap() || fell(unborne, left_over);
        if snapped {
            self.ledger.stabilisation += left_over.max(0.0);
        }
        (self.body_states(report), snapped)
    }

    /// Applied force and moment on a body and its weight, about its reference point.
    fn dead_load(&self, body: usize, loads: &Loads, pose: &Pose) -> Vector6<f64> {
        loads.applied[body] + self.model.bodies[body].weight(&loads.gravity, pose)
    }

    /// What became of the bodies of the case, reactions being those of the end of the increment.
    fn body_states(&self, report: &IncrementReport) -> Vec<BodyState> {
        let vector = |w: &Vector6<f64>, first: usize| Vec3::new(w[first], w[first + 1], w[first + 2]);
        let state = |(i, start): (usize, &Pose)| {
            let (body, new) = (&self.model.bodies[i], &report.poses[i]);
            let (of_contacts, reaction) = (&report.contact_wrench[i], &self.reaction[i]);
            // Of the largest part of a body that broke, about the reference point that it was placed by.
            let arm = new.rotation * body.frame_offset();
            let placed = start.position - start.rotation * body.offset;
            let about = |w: &Vector6<f64>| vector(w, 3) + arm.cross(&vector(w, 0));
            BodyState {
                position: new.position - arm,
                rotation: new.rotation.scaled_axis(),
                displacement: new.position - arm - placed,
                contact_force: vector(of_contacts, 0),
                contact_moment: about(of_contacts),
                reaction_force: vector(reaction, 0),
                reaction_moment: about(reaction),
            }
        };
        self.start.iter().enumerate().map(state).collect()
    }

    fn describe(&self, report: &IncrementReport, done: f64) -> String {
        let at = format!("after {:.4} of the stage: ", done);
        at + &match &report.status {
            StepStatus::Converged => "converged".into(),
            StepStatus::Abandoned => "the increment was given up as asked".into(),
            StepStatus::Unsolvable { problem } => format!("a body gave way: {problem}"),
            StepStatus::Overlapping { problem } => problem.clone(),
            StepStatus::TooClose(pair) => TooClose::described(*pair, &self.model),
            StepStatus::OutOfBalance { body, out_of_balance } => format!(
                "{} is out of balance by {out_of_balance:.2e} of the mean contact force after {} augmentations; \
                 it may have no equilibrium here",
                self.model.bodies[*body].name,
                report.history.len()
            ),
        }
    }
}
