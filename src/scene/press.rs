//! A press: one body of the scene between two plates, nodes against planes, instead of the contact of hulls.
//!
//! Where a flat or round face is pressed, contact of hulls is at corners and edges only, which crush first; here every surface node of the mesh carries
//! its share (`crushing`), so a block carries its strength over its whole face. The rest is a scene's: stages, increments that are cut, rows, restart
//! points. Parts of a body that came apart are bodies of their own and stand between the plates side by side.

use serde::{Deserialize, Serialize};

use crate::crushing::{Bench, Grip, Kept, Limits, Memory, Part, Plate, Push, Settled};
use crate::error::{Error, Result};
use crate::grain::DamagedGrain;
use crate::model::{Body, Counters, Deformation};
use crate::scene::parameters::LoadStage;
use crate::scene::row::{BodyState, Row};
use crate::scene::run::{Scene, StageProgress};
use crate::solver::{Balance, ContactMeasures, motion_between};
use crate::tensor::{Mat3, Pose, Rotation, Vec3, Vector6, symmetric};
use crate::triaxial::{FidelityCounts, Ledger, StageEnd};

/// Who is pressed by whom, by number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressParameters {
    pub body: usize,
    pub bottom: usize,
    pub top: usize,
    pub grip: Grip,
    /// Radius of the patch by which a node meets a plate [m]; `None`: the node alone.
    pub patch: Option<f64>,
}

/// Damage has settled when no point changes by more than this.
const SETTLED: f64 = 1e-3;
/// Rounds of contact and damage before an increment is cut.
const MOST_ROUNDS: usize = 400;
/// Energy that an increment may hold beyond what it had to spend, over its work or [`WORK_SHARE`] of all work so far, whichever is more:
/// else it is cut. The trapezoid of the work is second order in the increment.
const CREATED: f64 = 1e-3;
const WORK_SHARE: f64 = 0.2;
/// An increment that takes more rounds is a snap.
const SNAP_ROUNDS: usize = 8;
/// Where nothing is left to cut, damage moves by this share of its limit, with as many more rounds.
const CAREFUL: f64 = 0.2;

/// A press in progress.
#[derive(Debug, Clone)]
pub struct Pressing {
    parameters: PressParameters,
    bench: Bench,
    /// What is left of the body: the number of each part's body, and the part.
    parts: Vec<(usize, Part)>,
    /// Forces of the plates on the parts in the last accepted state; not stored.
    pushes: Vec<(usize, Push)>,
}

/// What of it is stored: the parts' bodies and memories.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct StoredPressing {
    parts: Vec<(u32, Memory)>,
}

/// The face of a plate: its highest or its lowest part, `pose` its place.
fn face(body: &Body, pose: &Pose, upper: bool) -> Plate {
    let extent = |k: usize| {
        let along = body.nominal.vertices.iter().map(|v| v[k]);
        [along.clone().fold(f64::INFINITY, f64::min), along.fold(f64::NEG_INFINITY, f64::max)]
    };
    let (x, y, z) = (extent(0), extent(1), extent(2));
    let middle = |along: [f64; 2], k: usize| pose.position[k] + 0.5 * (along[0] + along[1]);
    Plate {
        height: pose.position.z + if upper { z[0] } else { z[1] },
        centre: [middle(x, 0), middle(y, 1)],
        half: [0.5 * (x[1] - x[0]), 0.5 * (y[1] - y[0])],
    }
}

impl Pressing {
    /// Sets the body on the lower plate and the upper plate on the body.
    ///
    /// # Errors
    /// `Error::Usage` where the body cannot break, or a plate meets none of its nodes.
    pub(super) fn new(parameters: PressParameters, bodies: &mut [Body], poses: &mut [Pose]) -> Result<Self> {
        let PressParameters { body, bottom, top, grip, patch } = parameters;
        let Some(grain) = bodies[body].damaged() else {
            let name = &bodies[body].name;
            return Err(Error::Usage(format!("{name:?} is pressed, but its rock has no damage")));
        };
        let grain = (**grain).clone().failing_at_once();
        bodies[body].breakage = bodies[body].breakage.of(std::sync::Arc::new(grain.clone()));
        let mut plates =
            [face(&bodies[bottom], &poses[bottom], false), face(&bodies[top], &poses[top], true)];
        let heights = || grain.mesh().nodes.iter().map(|x| poses[body].to_space(x).z);
        let low = heights().fold(f64::INFINITY, f64::min);
        let high = heights().fold(f64::NEG_INFINITY, f64::max);
        let rise = plates[0].height - low;
        poses[body].position.z += rise;
        poses[top].position.z += high + rise - plates[1].height;
        plates[1].height = high + rise;
        for (plate, name) in plates.iter().zip([bottom, top].map(|plate| &bodies[plate].name)) {
            let mesh = grain.mesh();
            let nodes = mesh.surface_nodes().into_iter().map(|node| mesh.nodes[node.index()]);
            if grip != Grip::Tied && !nodes.map(|x| poses[body].to_space(&x)).any(|x| plate.covers(&x)) {
                return Err(Error::Usage(format!(
                    "the plate {name:?} meets no node of {:?}: it is beside the body, or smaller than its cells, which are then too large",
                    bodies[body].name
                )));
            }
        }
        let bench = Bench {
            grip,
            patch,
            frame: poses[body],
            plates,
            length: high - low,
            modulus: grain.law(crate::mesh::CellId(0)).elastic().youngs_modulus(),
        };
        Ok(Pressing { parameters, bench, parts: vec![(body, Part::new(grain))], pushes: Vec::new() })
    }

    pub(super) fn stored(&self) -> StoredPressing {
        let part = |(body, part): &(usize, Part)| (*body as u32, part.memory.clone());
        StoredPressing { parts: self.parts.iter().map(part).collect() }
    }

    /// Takes what was stored; `bodies` are those of that time. `false`, and nothing is changed, where they do not fit.
    pub(super) fn restore(&mut self, stored: StoredPressing, bodies: &[Body]) -> bool {
        let part = |(body, memory): (u32, Memory)| {
            let grain = DamagedGrain::clone(bodies.get(body as usize)?.damaged()?);
            Some((body as usize, Part::with_memory(grain, memory)))
        };
        let parts: Option<Vec<_>> = stored.parts.into_iter().map(part).collect();
        match parts {
            Some(parts) => self.parts = parts,
            None => return false,
        }
        true
    }

    /// Forces of the plates on the bodies in the last accepted state, by body; positions [m] and forces [N] in space.
    pub fn pushes(&self) -> &[(usize, Push)] {
        &self.pushes
    }

    /// Numbers of the plates, the lower one and the upper one.
    pub fn plates(&self) -> [usize; 2] {
        [self.parameters.bottom, self.parameters.top]
    }

    /// Mean stress of each of `count` bodies [Pa], from their cells; not a number for the plates.
    pub fn mean_stresses(&self, count: usize) -> Vec<Mat3> {
        let mut means = vec![Mat3::repeat(f64::NAN); count];
        for (body, part) in &self.parts {
            let mesh = part.grain.mesh();
            let mut mean = Vector6::zeros();
            for (cell, points) in mesh.cell_ids().zip(part.grain.stresses()) {
                let share = mesh.cell_volume(cell) / points.len() as f64;
                points.iter().for_each(|stress| mean += stress * share);
            }
            mean /= mesh.volume();
            let turn = self.bench.frame.rotation.to_rotation_matrix();
            means[*body] = turn.matrix() * symmetric(mean.into()) * turn.matrix().transpose();
        }
        means
    }

    /// All parts at rest between the plates where these are now, or why one is not.
    fn settle(
        &mut self,
        limits: &Limits,
        stopped: &dyn Fn() -> bool,
    ) -> std::result::Result<Vec<Settled>, String> {
        let mut all = Vec::with_capacity(self.parts.len());
        for (_, part) in &mut self.parts {
            let settled =
                part.settle(&self.bench, limits, stopped).unwrap_or_else(|error| Err(error.to_string()));
            match settled {
                Ok(settled) => all.push(settled),
                Err(reason) => {
                    self.parts.iter_mut().for_each(|(_, part)| part.grain.reject());
                    return Err(reason);
                }
            }
        }
        Ok(all)
    }

    /// Whether this increment would hold more energy than it had to spend: the way of the upper plate [m, closing positive], its force before [N],
    /// the ledger before.
    fn creates(&self, settled: &[Settled], way: f64, before: f64, ledger: &Ledger) -> bool {
        let after: f64 = settled.iter().map(|settled| settled.contact.force()).sum();
        let work = 0.5 * (before + after) * way;
        let (mut elastic, mut freed) = (0.0, 0.0);
        for ((_, part), settled) in self.parts.iter().zip(settled) {
            let Ok(kept) = part.would_keep(settled) else { return false };
            elastic += kept.elastic + settled.contact.patch_energy;
            freed += kept.dissipated;
        }
        let gap = work - (elastic - ledger.elastic) - freed;
        gap < -CREATED * work.abs().max(WORK_SHARE * ledger.external)
    }

    /// Where a body is whose part has moved like this.
    fn pose_of(&self, settled: &Settled) -> Pose {
        let [translation, turn, centre] = settled.contact.motion;
        let turn = Rotation::from_scaled_axis(turn);
        let frame = &self.bench.frame;
        Pose::new(centre + translation + turn * (frame.position - centre), turn * frame.rotation)
    }
}

impl Scene {
    /// Takes a stage of a press through its increments.
    pub(super) fn run_press(
        &mut self,
        mut pressing: Pressing,
        index: usize,
        stage: &LoadStage,
        observe: &mut impl FnMut(&Scene, &Row) -> bool,
    ) -> StageEnd {
        let StageProgress { mut drive, mut pace, mut dwells, mut lost, .. } =
            self.progress.take().unwrap_or_else(|| self.begin(stage));
        let stop = self.settings.stop.clone();
        let gentle = self.settings.damage.max_change;
        let end = loop {
            let Some(share) = (if dwells { Some(0.0) } else { pace.next() }) else {
                break StageEnd::Finished;
            };
            let to = if share < 1.0 - pace.done() { pace.done() + share } else { 1.0 };
            let poses = drive.driven(&self.committed.poses, &self.committed.poses, share, to);
            let PressParameters { bottom, top, .. } = pressing.parameters;
            pressing.bench.plates = [
                face(&self.model.bodies[bottom], &poses[bottom], false),
                face(&self.model.bodies[top], &poses[top], true),
            ];
            let mut limits = Limits { max_change: gentle, tolerance: SETTLED, most_rounds: MOST_ROUNDS };
            let mut settled = pressing.settle(&limits, &|| stop.is_raised());
            if settled.is_err() && !stop.is_raised() {
                if !dwells && pace.cut(share) {
                    lost.add(&Counters { augmentations: MOST_ROUNDS, ..Counters::default() });
                    continue;
                }
                limits.max_change *= CAREFUL;
                limits.most_rounds = (MOST_ROUNDS as f64 / CAREFUL) as usize;
                settled = pressing.settle(&limits, &|| stop.is_raised());
            }
            let settled = match settled {
                Ok(settled) => settled,
                Err(_) if stop.is_raised() => {
                    self.progress = Some(StageProgress { drive, pace, last: None, dwells, lost });
                    break StageEnd::Interrupted;
                }
                Err(reason) => {
                    let at = format!("after {:.4} of the stage: ", pace.done());
                    break StageEnd::Stopped { reason: at + &reason };
                }
            };
            let way = self.committed.poses[top].position.z - poses[top].position.z;
            if !dwells && pressing.creates(&settled, way, self.last_push, &self.ledger) && pace.cut(share) {
                pressing.parts.iter_mut().for_each(|(_, part)| part.grain.reject());
                lost.add(&Counters {
                    augmentations: settled.iter().map(|s| s.rounds).sum(),
                    ..Counters::default()
                });
                continue;
            }
            let mut counters = std::mem::take(&mut lost);
            for settled in &settled {
                counters.augmentations += settled.rounds;
                counters.newton_iterations += settled.contact.solutions;
                counters.factorisations += settled.factorisations;
            }
            if !dwells {
                counters.cuts = pace.accept(share, counters.augmentations <= 8);
            }
            let before = self.committed.poses.clone();
            let (row, broke) = match self.commit_press(
                &mut pressing,
                (index, pace.done(), dwells),
                &settled,
                poses,
                counters,
            ) {
                Ok(committed) => committed,
                Err(error) => break StageEnd::Stopped { reason: error.to_string() },
            };
            self.loads.prescribed.clone_from(&drive.held);
            let poses = &self.committed.poses;
            if poses.len() > before.len() {
                self.loads.applied.resize(poses.len(), Vector6::zeros());
                self.loads.prescribed.resize(poses.len(), [false; 6]);
                self.reaction.resize(poses.len(), Vector6::zeros());
                drive.grow(poses, poses);
            }
            dwells = broke;
            let last = None;
            self.progress =
                Some(StageProgress { drive: drive.clone(), pace: pace.clone(), last, dwells, lost });
            self.pressing = Some(pressing);
            let all_done = pace.next().is_none() && !dwells && index + 1 == self.stages.len();
            let goes_on = observe(self, &row) || all_done;
            match self.pressing.take() {
                Some(back) => pressing = back,
                None => return StageEnd::Interrupted,
            }
            if !goes_on {
                break StageEnd::Interrupted;
            }
        };
        self.pressing = Some(pressing);
        end
    }

    /// Makes a settled state the committed one: damage, energies, poses, what broke. Says whether anything did.
    fn commit_press(
        &mut self,
        pressing: &mut Pressing,
        (stage, progress, dwelt): (usize, f64, bool),
        settled: &[Settled],
        mut poses: Vec<Pose>,
        counters: Counters,
    ) -> Result<(Row, bool)> {
        let PressParameters { bottom, top, body, .. } = pressing.parameters;
        let error_before = self.ledger.error();
        let least = self.settings.damage.least_share
            * self.model.bodies[body].damaged().map_or(0.0, |g| g.origin_volume());
        let (mut elastic, mut freed, mut failed, mut broke) = (0.0, 0.0, 0, false);
        let mut wrenches = vec![Vector6::zeros(); poses.len()];
        pressing.pushes.clear();
        for ((number, _), settled) in pressing.parts.iter().zip(settled) {
            poses[*number] = pressing.pose_of(settled);
            pressing.pushes.extend(settled.contact.pushes.iter().map(|push| (*number, *push)));
        }
        for (number, push) in &pressing.pushes {
            for (on, sign) in [(*number, 1.0), (if push.upper { top } else { bottom }, -1.0)] {
                let force = push.force * sign;
                let moment = (push.at - poses[on].position).cross(&force);
                wrenches[on] += Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z);
            }
        }
        for plate in [bottom, top] {
            let (shift, turn) = motion_between(&self.committed.poses[plate], &poses[plate]);
            let motion = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
            let reaction = -wrenches[plate];
            self.ledger.external += 0.5 * (self.reaction[plate] + reaction).dot(&motion);
            self.reaction[plate] = reaction;
        }
        self.committed.poses.clone_from(&poses);
        let mut parts = Vec::with_capacity(pressing.parts.len());
        for ((number, mut part), settled) in std::mem::take(&mut pressing.parts).into_iter().zip(settled) {
            let Kept { commit, broken } = part.keep(settled, pressing.bench.grip, number as u32, least)?;
            elastic += commit.elastic + settled.contact.patch_energy;
            freed += commit.dissipated;
            failed += commit.newly_failed;
            match broken {
                None => {
                    let body = &mut self.model.bodies[number];
                    body.deformation = Deformation::Condensed(part.grain.condensed().clone());
                    body.breakage = body.breakage.of(std::sync::Arc::new(part.grain.clone()));
                    parts.push((number, part));
                }
                Some(broken) => {
                    broke = true;
                    elastic -= broken.lost_energy;
                    freed += broken.lost_energy;
                    let pieces = part.pieces(broken);
                    let grains = pieces.iter().map(|piece| piece.grain.clone()).collect();
                    let numbers = self.model.put_pieces(&mut self.committed, number, grains);
                    parts.extend(numbers.into_iter().zip(pieces));
                }
            }
        }
        pressing.parts = parts;
        self.ledger.elastic = elastic;
        self.ledger.damage += freed;
        let force = -self.reaction[top][2];
        let fell = force.abs() < self.last_push.abs();
        self.last_push = force;
        if !dwelt {
            self.stabilised = self.ledger.stabilisation;
        }
        let hesitated = settled.iter().any(|settled| settled.rounds > SNAP_ROUNDS);
        let snapped = dwelt || failed > 0 || fell || hesitated;
        if snapped {
            // Softening outran the plates: what that leaves over is a snap's, and what the dwells behind it spend comes out of that.
            let change = self.ledger.error() - error_before;
            self.ledger.stabilisation = (self.ledger.stabilisation + change).max(self.stabilised);
        }
        self.increments += 1;
        let vector = |w: &Vector6<f64>, first: usize| Vec3::new(w[first], w[first + 1], w[first + 2]);
        let state = |(number, start): (usize, &Pose)| {
            let pose = &poses[number];
            let reaction =
                if number == top || number == bottom { self.reaction[number] } else { Vector6::zeros() };
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
        let bodies = self.start.iter().enumerate().map(state).collect();
        let (count, total) =
            (pressing.pushes.len(), pressing.pushes.iter().map(|(_, push)| push.force.norm()).sum::<f64>());
        let mean_force = if count > 0 { total / count as f64 } else { 0.0 };
        let touched = |upper: bool| pressing.pushes.iter().any(|(_, push)| push.upper == upper);
        let row = Row {
            stage,
            increment: self.increments,
            progress,
            bodies,
            ledger: self.ledger,
            damage: self.model.damage_counts(),
            fidelity: FidelityCounts::default(),
            gravity: Vec3::zeros(),
            balance: Balance {
                out_of_balance: settled
                    .iter()
                    .map(|settled| settled.contact.out_of_balance())
                    .fold(0.0, f64::max),
                worst_body: body,
                reference_force: mean_force,
                least_force: mean_force,
                unrest: 0.0,
            },
            measures: ContactMeasures {
                points: count,
                pairs: usize::from(touched(false)) + usize::from(touched(true)),
                mean_force,
                ..ContactMeasures::default()
            },
            counters,
            snapped,
        };
        Ok((row, broke))
    }
}
