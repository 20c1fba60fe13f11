//! Nodal contact of one grain between two rigid plates, its damage frozen.
//!
//! A node meets a plate with a patch of the surface around it (or alone): the force is spread over the patch, and what counts is the patch's mean
//! displacement. Find forces on the touching nodes and the rigid motion of the grain with
//! `C f + t + w x (x - c) = plate - x` on them and zero resultants, C the flexibility of the grain; touching nodes that pull leave, nodes behind a
//! plate join, until neither happens (the primal-dual active set of Hintermueller, Ito & Kunisch 2003; one node at a time where that goes round in circles). Modes that the plates leave free are
//! held by a suspension of [`SUSPENSION`] times E L. Forces and displacements are in space axes.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::grain::{DamagedGrain, SurfacePoint};
use crate::mesh::NodeId;
use crate::tensor::{Pose, Vec3};

/// How the plates hold the nodes that they touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Grip {
    /// Push only, free to slide.
    Frictionless,
    /// Push only; a touching node does not slide.
    Rough,
    /// The end faces are tied along z and free to contract: for tension.
    Tied,
}

/// The face of a plate, normal to z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plate {
    /// [m]
    pub height: f64,
    /// Middle of the face and half its extents along x and y [m]; nodes beside it do not meet it.
    pub centre: [f64; 2],
    pub half: [f64; 2],
}

impl Plate {
    /// Without an end.
    pub const fn wide(height: f64) -> Self {
        Plate { height, centre: [0.0; 2], half: [f64::INFINITY; 2] }
    }

    /// Whether a place lies over or under the face.
    pub fn covers(&self, x: &Vec3) -> bool {
        (0..2).all(|k| (x[k] - self.centre[k]).abs() <= self.half[k])
    }
}

/// Stiffness of the suspension over E L.
const SUSPENSION: f64 = 1e-9;
/// Compliance of a patch of its own times E and its radius: a tenth of the half-space's under a uniform pressure, `16 (1 - nu^2) / (3 pi^2)`. Patches
/// overlap, so that their mean displacements may depend on one another; this keeps the forces unique.
const PATCH_COMPLIANCE: f64 = 0.05;
/// Pull that a touching node may keep, over the largest force: at first, and where the set of touching nodes still goes round in circles.
const PULLS: [f64; 2] = [1e-9, 1e-3];
/// Changes of the set of touching nodes in one solution; from the second number on it changes by one node at a time, and nodes that join slide in
/// this solution (a tangential hold that comes and goes with the touch is what makes the set go round in circles), from the third on with
/// indulgence.
const MOST_CHANGES: usize = 200;
const ONE_BY_ONE: usize = 20;
const INDULGENT: usize = 80;
/// Times that a node joins in one solution; then, with indulgence, it stays behind the plate by what it is: patches overlap, and a node whose
/// neighbours carry it may pull where it touches and be behind where it does not.
const MOST_JOINS: u32 = 3;

/// How each surface node meets a plate: places on the surface with their shares of a force, which sum to one.
#[derive(Debug, Clone)]
pub struct Patches {
    places: Vec<Vec<(SurfacePoint, f64)>>,
    /// The same by surface node.
    weights: Vec<Vec<(u32, f64)>>,
}

impl Patches {
    /// Of `radius` [m] around every surface node of `grain`; of the node alone without one.
    pub fn of(grain: &DamagedGrain, radius: Option<f64>) -> Self {
        let surface = grain.condensed().surface();
        let patch = |point: &SurfacePoint| match radius {
            Some(radius) => surface.spread(point, radius),
            None => vec![(point.clone(), 1.0)],
        };
        let places: Vec<_> = surface.node_points().iter().map(patch).collect();
        let weights = places.iter().map(|patch| {
            let mut merged: BTreeMap<u32, f64> = BTreeMap::new();
            for (point, share) in patch {
                for (node, weight) in point.shares.iter().filter(|(_, weight)| *weight != 0.0) {
                    *merged.entry(*node).or_default() += share * weight;
                }
            }
            merged.into_iter().collect()
        });
        Patches { weights: weights.collect(), places }
    }
}

/// Mean displacement of every patch under unit forces on those of one node, for each axis [m/N].
type Responses = BTreeMap<u32, [Vec<Vec3>; 3]>;

/// Where a node touched, and which plate: the upper one or not.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Touch {
    upper: bool,
    /// Its displacement [m] when it began to touch.
    #[serde(with = "crate::tensor::stored")]
    anchor: Vec3,
    /// Whether it is held at its anchor, where the plates are rough. A node that joins late in a solution slides in that one.
    sticks: bool,
}

/// What the next solution starts from.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    touching: BTreeMap<u32, Touch>,
    /// Displacement of every surface node [m]; empty before the first state.
    #[serde(with = "crate::tensor::stored")]
    displacements: Vec<Vec3>,
}

impl Memory {
    /// These displacements with the touching nodes of `other`.
    pub fn with_touches_of(&self, other: Memory) -> Self {
        Memory { touching: other.touching, displacements: self.displacements.clone() }
    }

    /// That of `old` in the numbers of the smaller grain `new`; nodes that were inside start without displacement. `origin` says which
    /// node of the old grain each of the new one was.
    pub fn carried_over(&self, old: &DamagedGrain, new: &DamagedGrain, origin: &[NodeId]) -> Self {
        let (before, after) = (old.condensed().surface().nodes(), new.condensed().surface().nodes());
        let found: Vec<Option<usize>> =
            after.iter().map(|node| before.binary_search(&origin[node.index()]).ok()).collect();
        let touch = |(number, k): (usize, &Option<usize>)| {
            k.and_then(|k| self.touching.get(&(k as u32))).map(|touch| (number as u32, *touch))
        };
        let displacement =
            |k: &Option<usize>| k.and_then(|k| self.displacements.get(k)).copied().unwrap_or_default();
        Memory {
            touching: found.iter().enumerate().filter_map(touch).collect(),
            displacements: found.iter().map(displacement).collect(),
        }
    }
}

/// A force of a plate on a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Push {
    pub upper: bool,
    /// Where the node is [m], and the force on it [N].
    pub at: Vec3,
    pub force: Vec3,
}

/// Contact forces under frozen damage.
#[derive(Debug, Clone)]
pub struct Contact {
    pub memory: Memory,
    /// On the surface, in body axes [N].
    pub loads: Vec<(SurfacePoint, Vec3)>,
    pub pushes: Vec<Push>,
    /// Mean translation [m] and rotation [rad] of the grain since the start, about its centroid, whose place at the start is the third.
    pub motion: [Vec3; 3],
    /// Stored in the patches' own compliance [J].
    pub patch_energy: f64,
    /// Nodes that stay behind a plate: they joined too often in this solution.
    pub left_behind: usize,
    /// Solutions that it took.
    pub solutions: usize,
}

impl Contact {
    /// Force on the upper plate along z [N].
    pub fn force(&self) -> f64 {
        -self.pushes.iter().filter(|push| push.upper).map(|push| push.force.z).sum::<f64>()
    }

    /// Resultant of all forces over the largest of them: what the suspension takes.
    pub fn out_of_balance(&self) -> f64 {
        let total: Vec3 = self.pushes.iter().map(|push| push.force).sum();
        let largest = self.pushes.iter().map(|push| push.force.norm()).fold(0.0, f64::max);
        if largest > 0.0 { total.norm() / largest } else { 0.0 }
    }
}

/// Two plates around a grain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bench {
    pub grip: Grip,
    /// Radius of the patch by which a node meets a plate [m]; without one it is the node alone.
    pub patch: Option<f64>,
    /// Of the grain's body coordinates before the test.
    pub frame: Pose,
    /// The lower one and the upper one.
    pub plates: [Plate; 2],
    /// Length [m] and modulus [Pa] that make the system dimensionless.
    pub length: f64,
    pub modulus: f64,
}

impl Bench {
    /// Contact under the grain's damage as it is, or why there is none.
    pub fn contact(
        &self,
        grain: &DamagedGrain,
        patches: &Patches,
        memory: &Memory,
    ) -> Result<Contact, String> {
        let condensed = grain.condensed();
        let points = condensed.surface().node_points();
        let places: Vec<Vec3> = points.iter().map(|point| self.frame.to_space(&point.position)).collect();
        let centre = self.frame.to_space(&condensed.mass_properties().centroid);
        let mut touching = memory.touching.clone();
        // What has lost both its end faces is tied to nothing any more.
        if touching.is_empty() && (self.grip != Grip::Tied || memory.displacements.is_empty()) {
            self.first_touches(&mut touching, &places, memory);
        }
        let anchor = |k: usize| memory.displacements.get(k).copied().unwrap_or_default();
        let back = self.frame.rotation.inverse();
        let mut responses = Responses::new();
        let mut joins = BTreeMap::new();
        for solution in 1..=MOST_CHANGES {
            for k in touching.keys() {
                responses.entry(*k).or_insert_with(|| self.responses(grain, patches, *k));
            }
            let (forces, rigid) = self.forces(&responses, &places, &touching, &centre)?;
            let mut displacements: Vec<Vec3> =
                places.iter().map(|x| rigid[0] + rigid[1].cross(&(x - centre))).collect();
            for (k, force) in touching.keys().zip(&forces) {
                for (axis, response) in
                    responses[k].iter().enumerate().filter(|(axis, _)| force[*axis] != 0.0)
                {
                    displacements.iter_mut().zip(response).for_each(|(u, unit)| *u += unit * force[axis]);
                }
            }
            if !displacements.iter().all(|u| u.iter().all(|c| c.is_finite())) {
                return Err("the displacements are not finite".into());
            }
            let at = (&anchor, solution);
            if let Some(left_behind) =
                self.change(&mut touching, &forces, &places, &displacements, at, &mut joins)
            {
                let push = |((k, touch), force): ((&u32, &Touch), &Vec3)| Push {
                    upper: touch.upper,
                    at: places[*k as usize] + displacements[*k as usize],
                    force: *force,
                };
                let spread = |(k, force): (&u32, &Vec3)| {
                    let own = back * force;
                    let shares = patches.places[*k as usize].iter();
                    shares.map(|(point, share)| (point.clone(), own * *share)).collect::<Vec<_>>()
                };
                // What slid to its place sticks there from now on.
                for (k, touch) in touching.iter_mut().filter(|(_, touch)| !touch.sticks) {
                    *touch = Touch { anchor: displacements[*k as usize], sticks: true, ..*touch };
                }
                return Ok(Contact {
                    pushes: touching.iter().zip(&forces).map(push).collect(),
                    loads: touching.keys().zip(&forces).flat_map(spread).collect(),
                    memory: Memory { touching, displacements },
                    motion: [rigid[0], rigid[1], centre],
                    patch_energy: 0.5
                        * self.compliance()
                        * forces.iter().map(Vec3::norm_squared).sum::<f64>(),
                    left_behind,
                    solutions: solution,
                });
            }
        }
        Err(format!("the set of touching nodes still changes after {MOST_CHANGES} solutions"))
    }

    /// Of a patch's own [m/N].
    fn compliance(&self) -> f64 {
        self.patch.map_or(0.0, |radius| PATCH_COMPLIANCE / (self.modulus * radius))
    }

    /// Of the node `k`, in space.
    fn responses(&self, grain: &DamagedGrain, patches: &Patches, k: u32) -> [Vec<Vec3>; 3] {
        let turn = self.frame.rotation;
        let nodes = grain.condensed().surface().nodes();
        std::array::from_fn(|axis| {
            if axis < 2 && self.grip != Grip::Rough {
                return Vec::new();
            }
            let own = turn.inverse() * Vec3::ith(axis, 1.0);
            let loads: Vec<(SurfacePoint, Vec3)> = patches.places[k as usize]
                .iter()
                .map(|(point, share)| (point.clone(), own * *share))
                .collect();
            let u = grain.condensed().nodal_displacements(&loads);
            let mean = |weights: &Vec<(u32, f64)>| -> Vec3 {
                turn * weights.iter().map(|(n, w)| u[nodes[*n as usize].index()] * *w).sum::<Vec3>()
            };
            patches.weights.iter().map(mean).collect()
        })
    }

    /// Something to begin with: the lowest and the highest node that a plate can meet; tied, both end faces.
    fn first_touches(&self, touching: &mut BTreeMap<u32, Touch>, places: &[Vec3], memory: &Memory) {
        let anchor = |k: usize| memory.displacements.get(k).copied().unwrap_or_default();
        let [lower, upper] = &self.plates;
        if self.grip == Grip::Tied {
            let ends = |f: fn(f64, f64) -> f64, start: f64| places.iter().map(|x| x.z).fold(start, f);
            let (low, high) = (ends(f64::min, f64::INFINITY), ends(f64::max, f64::NEG_INFINITY));
            for (k, x) in places.iter().enumerate() {
                let upper = (x.z - high).abs() < 1e-6 * self.length;
                if upper || (x.z - low).abs() < 1e-6 * self.length {
                    touching.insert(k as u32, Touch { upper, anchor: Vec3::zeros(), sticks: true });
                }
            }
            return;
        }
        let height = |k: &usize| places[*k].z + anchor(*k).z;
        let met_by = |plate: &Plate| {
            let plate = *plate;
            (0..places.len()).filter(move |k| plate.covers(&places[*k]))
        };
        let lowest = met_by(lower).min_by(|a, b| height(a).total_cmp(&height(b)));
        let highest = met_by(upper).max_by(|a, b| height(a).total_cmp(&height(b)));
        for (k, upper) in [(lowest, false), (highest, true)] {
            if let Some(k) = k {
                touching.insert(k as u32, Touch { upper, anchor: anchor(k), sticks: true });
            }
        }
    }

    /// Lets go of nodes that pull and takes those behind a plate: all of them, or the worst one. Where there were none: how many nodes are left
    /// behind a plate.
    fn change(
        &self,
        touching: &mut BTreeMap<u32, Touch>,
        forces: &[Vec3],
        places: &[Vec3],
        displacements: &[Vec3],
        (anchor, solution): (&impl Fn(usize) -> Vec3, usize),
        joins: &mut BTreeMap<u32, u32>,
    ) -> Option<usize> {
        if self.grip == Grip::Tied {
            return Some(0);
        }
        let largest = forces.iter().map(|f| f.norm()).fold(0.0, f64::max);
        let one_by_one = solution >= ONE_BY_ONE;
        let pull = PULLS[usize::from(solution >= INDULGENT)];
        let pulls = |((k, touch), f): ((&u32, &Touch), &Vec3)| {
            let outward = if touch.upper { f.z } else { -f.z };
            (outward > pull * largest).then_some((outward, *k))
        };
        let mut pulling: Vec<(f64, u32)> = touching.iter().zip(forces).filter_map(pulls).collect();
        let slack = 1e-10 * self.length;
        let [lower, upper] = &self.plates;
        let mut behind: Vec<(f64, u32, bool)> = Vec::new();
        let mut left_behind = 0;
        for (k, (x, u)) in places.iter().zip(displacements).enumerate() {
            let (k, z) = (k as u32, x.z + u.z);
            if touching.contains_key(&k) {
                continue;
            }
            let found = if z < lower.height - slack && lower.covers(x) {
                (lower.height - z, k, false)
            } else if z > upper.height + slack && upper.covers(x) {
                (z - upper.height, k, true)
            } else {
                continue;
            };
            if solution >= INDULGENT && joins.get(&k).is_some_and(|joins| *joins >= MOST_JOINS) {
                left_behind += 1;
            } else {
                behind.push(found);
            }
        }
        if one_by_one {
            pulling.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            pulling.truncate(1);
            behind.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            behind.truncate(usize::from(pulling.is_empty()));
        }
        for (_, k) in &pulling {
            touching.remove(k);
        }
        for (_, k, upper) in &behind {
            *joins.entry(*k).or_default() += 1;
            touching.insert(*k, Touch { upper: *upper, anchor: anchor(*k as usize), sticks: !one_by_one });
        }
        (pulling.is_empty() && behind.is_empty()).then_some(left_behind)
    }

    /// Forces on the touching nodes, and the rigid motion (translation, rotation).
    #[allow(clippy::type_complexity)]
    fn forces(
        &self,
        responses: &Responses,
        places: &[Vec3],
        touching: &BTreeMap<u32, Touch>,
        centre: &Vec3,
    ) -> Result<(Vec<Vec3>, [Vec3; 2]), String> {
        let (scale, length) = (self.modulus * self.length, self.length);
        let axes = |touch: &Touch| match self.grip {
            Grip::Rough if touch.sticks => 0..3,
            Grip::Rough | Grip::Frictionless | Grip::Tied => 2..3,
        };
        let held: Vec<(u32, usize)> =
            touching.iter().flat_map(|(k, touch)| axes(touch).map(move |axis| (*k, axis))).collect();
        let count = held.len();
        let mut system = DMatrix::zeros(count + 6, count + 6);
        let mut right = DVector::zeros(count + 6);
        for (i, (a, axis)) in held.iter().enumerate() {
            for (j, (b, other)) in held.iter().enumerate().skip(i) {
                let block = responses[b][*other][*a as usize][*axis] * scale;
                system[(i, j)] = block;
                system[(j, i)] = block;
            }
        }
        for (row, (k, axis)) in held.iter().enumerate() {
            system[(row, row)] += self.compliance() * scale;
            let (place, touch) = (&places[*k as usize], &touching[k]);
            let arm = (place - centre) / length;
            system[(row, count + axis)] = 1.0;
            system[(count + axis, row)] = 1.0;
            for turn in 0..3 {
                let lever = Vec3::ith(turn, 1.0).cross(&arm)[*axis];
                system[(row, count + 3 + turn)] = lever;
                system[(count + 3 + turn, row)] = lever;
            }
            right[row] = if *axis == 2 {
                (self.plates[usize::from(touch.upper)].height - place.z) / length
            } else {
                touch.anchor[*axis] / length
            };
        }
        for k in 0..6 {
            system[(count + k, count + k)] = -SUSPENSION;
        }
        let x = system.lu().solve(&right).ok_or("the contact system is singular")?;
        let mut forces = BTreeMap::from_iter(touching.keys().map(|k| (*k, Vec3::zeros())));
        for (row, (k, axis)) in held.iter().enumerate() {
            if let Some(force) = forces.get_mut(k) {
                force[*axis] = x[row] * scale * length;
            }
        }
        let translation = Vec3::new(x[count], x[count + 1], x[count + 2]) * length;
        Ok((
            forces.into_values().collect(),
            [translation, Vec3::new(x[count + 3], x[count + 4], x[count + 5])],
        ))
    }
}
