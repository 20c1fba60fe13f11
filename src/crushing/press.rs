//! The crushing loop and its nodal contact.
//!
//! Contact: find forces on the touching nodes and the rigid motion of the grain with
//! `C f + t + w x (x - c) = plate - x` on them and zero resultants, C the flexibility of the grain; touching nodes that pull leave, nodes behind a plate
//! join, until neither happens (the primal-dual active set of Hintermueller, Ito & Kunisch 2003). Modes that the plates leave free are
//! held by a suspension of [`SUSPENSION`] times E L.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::error::Result;
use crate::grain::{BreakUp, DamageChange, DamagedGrain, SurfacePoint};
use crate::mesh::NodeId;
use crate::tensor::Vec3;

/// How the plates hold the nodes that they touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Grip {
    /// Push only, free to slide.
    Frictionless,
    /// Push only; a touching node does not slide.
    Rough,
    /// The end faces are tied along z and free to contract: for tension.
    Tied,
}

/// A crushing test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Press {
    pub grip: Grip,
    /// Nodes further than this [m] from the axis x = y = 0 do not meet the upper plate: a punch or a point load. Infinite for a plate.
    pub punch_radius: f64,
    /// Total way of the upper plate towards the lower one [m]; negative pulls.
    pub travel: f64,
    pub increments: usize,
    /// Largest change of damage between two factors.
    pub max_change: f64,
    /// An increment is accepted when no damage changes by more than this.
    pub tolerance: f64,
    /// Rounds of contact and damage before an increment is halved.
    pub most_rounds: usize,
    /// Parts with less than this share of the grain's volume are debris and leave the test.
    pub debris_share: f64,
    /// The test ends when the force has fallen to this share of the largest one.
    pub end_share: f64,
}

impl Default for Press {
    fn default() -> Self {
        Press {
            grip: Grip::Rough,
            punch_radius: f64::INFINITY,
            travel: 0.0,
            increments: 100,
            max_change: 0.2,
            tolerance: 1e-3,
            most_rounds: 400,
            debris_share: 0.02,
            end_share: 0.0,
        }
    }
}

/// One accepted state.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Row {
    /// Way of the upper plate [m], positive towards the lower one.
    pub travel: f64,
    /// Force on the upper plate [N], compression positive.
    pub force: f64,
    pub touching_nodes: usize,
    /// Energies [J]: work of the plate, stored, set free by damage (deleted cells included), and what is left over.
    pub external: f64,
    pub elastic: f64,
    pub damage: f64,
    pub stabilisation: f64,
    pub failed_points: usize,
    pub deleted_cells: usize,
    /// Rounds of contact and damage, and factors made.
    pub rounds: usize,
    pub factorisations: usize,
}

/// How a test ended.
#[derive(Debug, Clone)]
pub enum Ending {
    /// The whole way.
    Finished,
    /// The force fell to the share asked for.
    Softened,
    /// The grain came apart.
    Broken(Box<BreakUp>),
    /// Nothing of the grain is left.
    Gone,
    /// No convergence at the smallest increment.
    Stalled { reason: String },
}

/// What a test gave.
#[derive(Debug, Clone)]
pub struct Record {
    pub rows: Vec<Row>,
    pub ending: Ending,
    /// The grain as last committed.
    pub grain: DamagedGrain,
}

impl Record {
    /// Largest force [N]: of compression, or of tension where the test pulls.
    pub fn peak(&self) -> f64 {
        self.rows.iter().map(|row| row.force.abs()).fold(0.0, f64::max)
    }
}

/// Stiffness of the suspension over E L.
const SUSPENSION: f64 = 1e-9;
/// Halvings of an increment.
const MOST_CUTS: u32 = 6;
/// Changes of the set of touching nodes in one solution.
const MOST_CHANGES: usize = 60;

/// Where a node touched, and which plate: the upper one or not.
#[derive(Debug, Clone, Copy)]
struct Touch {
    upper: bool,
    /// Its displacement [m] when it began to touch.
    anchor: Vec3,
}

/// What the next solution starts from.
#[derive(Debug, Clone, Default)]
struct Memory {
    touching: BTreeMap<u32, Touch>,
    /// Displacement of every surface node [m]; empty before the first state.
    displacements: Vec<Vec3>,
}

/// Contact forces under frozen damage.
struct Contact {
    memory: Memory,
    loads: Vec<(SurfacePoint, Vec3)>,
    force: f64,
}

struct Bench<'a> {
    press: &'a Press,
    /// Planes of the lower and upper plate before the test [m].
    planes: [f64; 2],
    /// Length and modulus that make the system dimensionless.
    length: f64,
    modulus: f64,
}

/// Runs a test. Errors where the grain cannot be factored; what does not converge is an [`Ending`].
pub fn crush(grain: DamagedGrain, press: &Press) -> Result<Record> {
    let heights = || grain.mesh().nodes.iter().map(|x| x.z);
    let planes = [heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max)];
    let bench = Bench {
        press,
        planes,
        length: planes[1] - planes[0],
        modulus: grain.law(crate::mesh::CellId(0)).elastic().youngs_modulus(),
    };
    let least_volume = press.debris_share * grain.mesh().volume();
    let step = press.travel / press.increments.max(1) as f64;
    let mut record = Record { rows: vec![Row::default()], ending: Ending::Finished, grain };
    let mut memory = Memory::default();
    let (mut done, mut cuts, mut share) = (0.0, 0, 1.0);
    while done < press.increments as f64 {
        let advance = f64::min(share, press.increments as f64 - done);
        let last = record.rows[record.rows.len() - 1];
        let travel = (done + advance) * step;
        let (contact, rounds, factorisations) = match bench.equilibrium(&mut record.grain, &memory, travel)? {
            Ok(found) => found,
            Err(reason) => {
                record.grain.reject();
                if cuts == MOST_CUTS {
                    record.ending = Ending::Stalled { reason };
                    return Ok(record);
                }
                (cuts, share) = (cuts + 1, 0.5 * share);
                continue;
            }
        };
        let kept = record.grain.commit(&contact.loads)?;
        let external = last.external + 0.5 * (last.force + contact.force) * (travel - last.travel);
        let mut row = Row {
            travel,
            force: contact.force,
            touching_nodes: contact.memory.touching.len(),
            external,
            elastic: kept.elastic,
            damage: last.damage + kept.dissipated,
            stabilisation: 0.0,
            failed_points: last.failed_points + kept.newly_failed,
            deleted_cells: last.deleted_cells,
            rounds,
            factorisations,
        };
        let broken = record.grain.break_up(&contact.loads, 0, least_volume)?;
        if let Some(broken) = &broken {
            row.deleted_cells += broken.deleted.len();
            row.damage += broken.lost_energy;
            row.elastic -= broken.lost_energy;
        }
        row.stabilisation = row.external - row.elastic - row.damage;
        record.rows.push(row);
        if let Some(mut broken) = broken {
            match broken.fragments.len() {
                0 => {
                    record.ending = Ending::Gone;
                    return Ok(record);
                }
                1 => {
                    let rest = broken.fragments.remove(0);
                    memory = carried_over(&record.grain, &rest.grain, &rest.nodes, &contact.memory);
                    record.grain = rest.grain;
                    // Dwell: a new equilibrium of what is left, at the same travel.
                    done += advance;
                    (share, cuts) = (0.0, 0);
                    continue;
                }
                _ => {
                    record.ending = Ending::Broken(Box::new(broken));
                    return Ok(record);
                }
            }
        }
        done += advance;
        memory = contact.memory;
        if contact.force.abs() < press.end_share * record.peak() {
            record.ending = Ending::Softened;
            return Ok(record);
        }
        share = if share == 0.0 { 1.0 } else { f64::min(1.0, 2.0 * share) };
        cuts = cuts.saturating_sub(1);
    }
    Ok(record)
}

/// The memory in the numbers of the smaller grain; nodes that were inside start without displacement.
fn carried_over(old: &DamagedGrain, new: &DamagedGrain, origin: &[NodeId], memory: &Memory) -> Memory {
    let (before, after) = (old.condensed().surface().nodes(), new.condensed().surface().nodes());
    let found: Vec<Option<usize>> =
        after.iter().map(|node| before.binary_search(&origin[node.index()]).ok()).collect();
    let touch = |(number, k): (usize, &Option<usize>)| {
        k.and_then(|k| memory.touching.get(&(k as u32))).map(|touch| (number as u32, *touch))
    };
    let displacement =
        |k: &Option<usize>| k.and_then(|k| memory.displacements.get(k)).copied().unwrap_or_default();
    Memory {
        touching: found.iter().enumerate().filter_map(touch).collect(),
        displacements: found.iter().map(displacement).collect(),
    }
}

impl Bench<'_> {
    /// Contact and damage in turn until nothing moves: the contact, rounds and factors; or why not.
    #[allow(clippy::type_complexity)]
    fn equilibrium(
        &self,
        grain: &mut DamagedGrain,
        memory: &Memory,
        travel: f64,
    ) -> Result<std::result::Result<(Contact, usize, usize), String>> {
        let mut touching = memory.touching.clone();
        let mut factorisations = 0;
        let mut last = DamageChange::default();
        for round in 1..=self.press.most_rounds {
            let contact = match self.contact(grain, touching, &memory.displacements, travel) {
                Ok(contact) => contact,
                Err(reason) => return Ok(Err(reason)),
            };
            let change = grain.propose(&contact.loads, self.press.max_change)?;
            if change.applied <= self.press.tolerance && change.held_back <= self.press.tolerance {
                return Ok(Ok((contact, round, factorisations)));
            }
            factorisations += usize::from(grain.refresh()?);
            last = change;
            touching = contact.memory.touching;
        }
        Ok(Err(format!(
            "after {} rounds damage still moves by {:.1e} and wants to by {:.1e} more",
            self.press.most_rounds,
            last.applied,
            last.held_back.max(0.0)
        )))
    }

    fn contact(
        &self,
        grain: &DamagedGrain,
        mut touching: BTreeMap<u32, Touch>,
        before: &[Vec3],
        travel: f64,
    ) -> std::result::Result<Contact, String> {
        let condensed = grain.condensed();
        let points = condensed.surface().node_points();
        let planes = [self.planes[0], self.planes[1] - travel];
        let centre = condensed.mass_properties().centroid;
        let slack = 1e-10 * self.length;
        let anchor = |k: usize| before.get(k).copied().unwrap_or_default();
        if touching.is_empty() && self.press.grip != Grip::Tied {
            // Something to begin with: the lowest and the highest node.
            let height = |k: &usize| points[*k].position.z + anchor(*k).z;
            let nodes = || 0..points.len();
            let lowest = nodes().min_by(|a, b| height(a).total_cmp(&height(b)));
            let in_reach = |k: &usize| points[*k].position.xy().norm() <= self.press.punch_radius;
            let highest = nodes().filter(in_reach).max_by(|a, b| height(a).total_cmp(&height(b)));
            for (k, upper) in [(lowest, false), (highest, true)] {
                if let Some(k) = k {
                    touching.insert(k as u32, Touch { upper, anchor: anchor(k) });
                }
            }
        }
        if self.press.grip == Grip::Tied && touching.is_empty() {
            for (k, point) in points.iter().enumerate() {
                let upper = (point.position.z - self.planes[1]).abs() < 1e-6 * self.length;
                if upper || (point.position.z - self.planes[0]).abs() < 1e-6 * self.length {
                    touching.insert(k as u32, Touch { upper, anchor: Vec3::zeros() });
                }
            }
        }
        for _ in 0..MOST_CHANGES {
            let (forces, rigid) = self.forces(grain, &points, &touching, &planes, &centre)?;
            let loads: Vec<(SurfacePoint, Vec3)> =
                touching.keys().zip(&forces).map(|(k, f)| (points[*k as usize], *f)).collect();
            let u = condensed.nodal_displacements(&loads);
            let displacements: Vec<Vec3> = points
                .iter()
                .zip(condensed.surface().nodes())
                .map(|(point, node)| u[node.index()] + rigid[0] + rigid[1].cross(&(point.position - centre)))
                .collect();
            if !displacements.iter().all(|u| u.iter().all(|c| c.is_finite())) {
                return Err("the displacements are not finite".into());
            }
            let largest = forces.iter().map(|f| f.norm()).fold(0.0, f64::max);
            let mut changed = false;
            if self.press.grip != Grip::Tied {
                let pulling: Vec<u32> = touching
                    .iter()
                    .zip(&forces)
                    .filter(
                        |((_, touch), f)| {
                            if touch.upper { f.z > 1e-9 * largest } else { f.z < -1e-9 * largest }
                        },
                    )
                    .map(|((k, _), _)| *k)
                    .collect();
                for k in pulling {
                    touching.remove(&k);
                    changed = true;
                }
                for (k, (point, u)) in points.iter().zip(&displacements).enumerate() {
                    let z = point.position.z + u.z;
                    let below = z < planes[0] - slack;
                    let above =
                        z > planes[1] + slack && point.position.xy().norm() <= self.press.punch_radius;
                    if (below || above) && !touching.contains_key(&(k as u32)) {
                        touching.insert(k as u32, Touch { upper: above, anchor: anchor(k) });
                        changed = true;
                    }
                }
            }
            if !changed {
                let upper = touching.values().zip(&forces).filter(|(touch, _)| touch.upper);
                let force = -upper.map(|(_, f)| f.z).sum::<f64>();
                return Ok(Contact { memory: Memory { touching, displacements }, loads, force });
            }
        }
        Err(format!("the set of touching nodes still changes after {MOST_CHANGES} solutions"))
    }

    /// Forces on the touching nodes, and the rigid motion (translation, rotation).
    #[allow(clippy::type_complexity)]
    fn forces(
        &self,
        grain: &DamagedGrain,
        points: &[SurfacePoint],
        touching: &BTreeMap<u32, Touch>,
        planes: &[f64; 2],
        centre: &Vec3,
    ) -> std::result::Result<(Vec<Vec3>, [Vec3; 2]), String> {
        let (scale, length) = (self.modulus * self.length, self.length);
        let axes: &[usize] = match self.press.grip {
            Grip::Rough => &[0, 1, 2],
            Grip::Frictionless | Grip::Tied => &[2],
        };
        let held: Vec<(u32, usize)> =
            touching.keys().flat_map(|k| axes.iter().map(move |axis| (*k, *axis))).collect();
        let count = held.len();
        let mut system = DMatrix::zeros(count + 6, count + 6);
        let mut right = DVector::zeros(count + 6);
        let nodes: Vec<u32> = touching.keys().copied().collect();
        let per = axes.len();
        for (i, a) in nodes.iter().enumerate() {
            for (j, b) in nodes.iter().enumerate().skip(i) {
                let block = grain.condensed().flexibility(&points[*a as usize], &points[*b as usize]) * scale;
                for (p, axis) in axes.iter().enumerate() {
                    for (q, other) in axes.iter().enumerate() {
                        system[(per * i + p, per * j + q)] = block[(*axis, *other)];
                        system[(per * j + q, per * i + p)] = block[(*axis, *other)];
                    }
                }
            }
        }
        for (row, (k, axis)) in held.iter().enumerate() {
            let (point, touch) = (&points[*k as usize], &touching[k]);
            let arm = (point.position - centre) / length;
            system[(row, count + axis)] = 1.0;
            system[(count + axis, row)] = 1.0;
            for turn in 0..3 {
                let lever = Vec3::ith(turn, 1.0).cross(&arm)[*axis];
                system[(row, count + 3 + turn)] = lever;
                system[(count + 3 + turn, row)] = lever;
            }
            right[row] = if *axis == 2 {
                (planes[usize::from(touch.upper)] - point.position.z) / length
            } else {
                touch.anchor[*axis] / length
            };
        }
        for k in 0..6 {
            system[(count + k, count + k)] = -SUSPENSION;
        }
        let x = system.lu().solve(&right).ok_or("the contact system is singular")?;
        let mut forces = vec![Vec3::zeros(); nodes.len()];
        for (row, (_, axis)) in held.iter().enumerate() {
            forces[row / per][*axis] = x[row] * scale * length;
        }
        let translation = Vec3::new(x[count], x[count + 1], x[count + 2]) * length;
        Ok((forces, [translation, Vec3::new(x[count + 3], x[count + 4], x[count + 5])]))
    }
}
