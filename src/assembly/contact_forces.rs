//! Contact forces on condensed bodies as unknowns: the flexibility form.
//!
//! A condensed body yields at each of its contacts to the forces of all of them, `W F`, with `W` exact and dense
//! between its contacts. So the force `F` of a contact (on `b`, in space) is an unknown of its own, and what it has to
//! meet is the contact's law at the displacements of all such forces: `f(q, W F) - F = 0`. Newton solves these together
//! with the motion of the bodies, and nothing is left to an augmentation but the places of the contacts on their meshes
//! and the rotations `turns`, which stay meanwhile.
//!
//! **Bodies' rows.** The law's force depends on the motion of all neighbours' neighbours. Rows that are combined with
//! those of the contacts do not: with `B` the wrench of a unit force, `r_body - B (f - F)` is the balance of the forces
//! `F` as long as `B` stays. Written so the matrix couples a contact's force with its two bodies and with the forces on
//! the same condensed bodies, and Newton's step is the same.
//!
//! **What the law sees.** The contact's own flexibility w is put behind its spring, and what it gives under the unknown
//! force is given back: with the displacement `W F - w F` in the gap the law has the stiffness `1/(c + w)` and still
//! agrees with `F` only where `c F` is all that is left. This is the augmented Lagrangian of Alart & Curnier (1991, Comput. Methods Appl.
//! Mech. Eng. 92:353-375) with the penalty 1/w. Without it, `f(q, W F)` by the stiff spring alone, steps are the same as long as all contacts
//! stick or are open, but contacts about to slip or to close overshoot and Newton swings.
//!
//! **Units.** Forces are unknowns as lengths, `F = k y`, with a stiffness k typical of the model.
//!
//! Which contacts: all that touch, did so in the last augmentation, or would under less than the mean contact force.
//! Others yield by a compliance of their own, as in `assembly::elastic`.

use rayon::prelude::*;

use crate::assembly::ContactPoint;
use crate::assembly::{BlockPattern, Dofs};
use crate::contact::Feature;
use crate::contact::force::{ElasticTangent, Tangent};
use crate::contact::memory::PairKey;
use crate::grain::SurfacePoint;
use crate::tensor::{Mat3, Vec3};

mod answer;
mod gather;
mod elimination;

pub use elimination::PairElimination;

/// A weight below which what its gradient does is left out of the tangent: the force is then next to nothing.
const LEAST_WEIGHT: f64 = 0.02;

/// Forces of contacts as unknowns, and what the bodies yield to them.
#[derive(Debug, Clone, Default)]
pub struct ContactForces {
    unknowns: Vec<ContactForce>,
    patches: Vec<Patch>,
    /// Force per unit of its unknown [N/m].
    stiffness: f64,
    /// Whether the unknowns' places are those of the contacts; else they are left out until gathered anew.
    placed: bool,
    /// Grows with each change of the unknowns, so that nothing made for others is used.
    pub generation: u64,
}

/// A contact whose force is an unknown.
#[derive(Debug, Clone)]
struct ContactForce {
    key: PairKey,
    feature: Feature,
    /// On `b`, weight included [N], in space.
    force: Vec3,
    /// The same where a Newton solve began.
    centre: Vec3,
    /// Displacement of `b`'s surface relative to `a`'s that the unknown forces do not cause [m]: by other
    /// loads, and per pressure on the cover.
    others: Vec3,
    by_pressure: Vec3,
    /// The same displacement in the committed state [m].
    before: Vec3,
    /// About its own flexibility [m/N]: what the law sees in its place, and gives back.
    compliance: f64,
    tangent: ForceTangent,
}

/// Derivatives at one contact.
#[derive(Debug, Clone)]
struct ForceTangent {
    /// Of the wrench on both bodies by the force.
    lift: [[f64; 3]; 12],
    /// Of the law's force by position and spin of `b` and spin of `a`, and by the elastic displacement [N/m].
    by_motion: [[f64; 9]; 3],
    by_displacement: Mat3,
    /// `lift` without what the weight's gradient does.
    plain: [[f64; 3]; 12],
    /// What the law's force has above the unknown [N].
    excess: Vec3,
}

const STILL: ForceTangent = ForceTangent {
    lift: [[0.0; 3]; 12],
    by_motion: [[0.0; 9]; 3],
    by_displacement: Mat3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    plain: [[0.0; 3]; 12],
    excess: Vec3::new(0.0, 0.0, 0.0),
};

/// The unknown forces on one condensed body.
#[derive(Debug, Clone)]
struct Patch {
    body: usize,
    /// Number of the unknown, sign of its force here, and place.
    places: Vec<(usize, f64, SurfacePoint)>,
    /// Displacement of the i-th place by a force at the j-th [m/N], in space.
    flexibility: Vec<Mat3>,
}

impl Patch {
    fn block(&self, i: usize, j: usize) -> &Mat3 {
        &self.flexibility[i * self.places.len() + j]
    }
}

impl ContactForces {
    /// How many contacts' forces are unknowns.
    pub fn count(&self) -> usize {
        self.unknowns.len()
    }

    /// Body that each unknown is booked on.
    pub fn owners(&self) -> impl Iterator<Item = u32> {
        self.unknowns.iter().map(|unknown| unknown.key.1)
    }

    /// The two bodies of each unknown.
    pub fn pairs(&self) -> impl Iterator<Item = [usize; 2]> {
        self.unknowns.iter().map(|unknown| [unknown.key.0 as usize, unknown.key.1 as usize])
    }

    /// Forgets all forces.
    pub(super) fn clear(&mut self) {
        let generation = self.generation + 1;
        *self = ContactForces { generation, ..ContactForces::default() };
    }

    /// Leaves the unknowns out until they are gathered anew.
    pub(super) fn lift(&mut self) {
        self.placed = false;
    }

    /// Makes the present forces those from which [`Self::move_by`] counts.
    pub fn recentre(&mut self) {
        self.unknowns.iter_mut().for_each(|unknown| unknown.centre = unknown.force);
    }

    /// Sets the forces to `away` (unknowns) from the centre.
    pub fn move_by(&mut self, dofs: &Dofs, away: &[f64]) {
        for (k, unknown) in self.unknowns.iter_mut().enumerate() {
            unknown.force = unknown.centre + dofs.motion(away, 1.0, dofs.contact_block(k)).0 * self.stiffness;
        }
    }

    /// Displacements by all forces [m] where each unknown acts.
    fn displacements(&self, pressure: f64) -> Vec<Vec3> {
        let mut moved: Vec<Vec3> =
            self.unknowns.iter().map(|unknown| unknown.others + unknown.by_pressure * pressure).collect();
        let of_patch = |patch: &Patch| -> Vec<Vec3> {
            let own = |i: usize| {
                let by = |(j, (unknown, sign, _)): (usize, &(usize, f64, SurfacePoint))| {
                    patch.block(i, j) * (self.unknowns[*unknown].force * *sign)
                };
                patch.places.iter().enumerate().map(by).sum::<Vec3>()
            };
            (0..patch.places.len()).map(own).collect()
        };
        let all: Vec<Vec<Vec3>> = self.patches.par_iter().map(of_patch).collect();
        for (patch, own) in self.patches.iter().zip(&all) {
            for ((unknown, sign, _), u) in patch.places.iter().zip(own) {
                moved[*unknown] += u * *sign;
            }
        }
        moved
    }

    /// Which forces depend on which unknowns.
    pub fn couplings(&self, dofs: &Dofs) -> Vec<(usize, usize)> {
        let mut all = Vec::new();
        for (k, unknown) in self.unknowns.iter().enumerate() {
            let block = dofs.contact_block(k);
            all.extend([(block, unknown.key.0 as usize), (block, unknown.key.1 as usize)]);
        }
        for patch in &self.patches {
            for (i, (unknown, ..)) in patch.places.iter().enumerate() {
                let to = |(other, ..): &(usize, f64, SurfacePoint)| {
                    (dofs.contact_block(*unknown), dofs.contact_block(*other))
                };
                all.extend(patch.places[..i].iter().map(to));
            }
        }
        all
    }

    /// Turns the forces out of balance that the merit is made of, `B` without what weights do, into those of the tangent.
    pub fn complete(&self, forces: &mut [f64], dofs: &Dofs) {
        if !self.placed {
            return;
        }
        for unknown in &self.unknowns {
            let ForceTangent { lift, plain, excess, .. } = &unknown.tangent;
            let wrench: [f64; 12] =
                std::array::from_fn(|r| (0..3).map(|c| (plain[r][c] - lift[r][c]) * excess[c]).sum());
            dofs.scatter(forces, unknown.key.0 as usize, &wrench[..6]);
            dofs.scatter(forces, unknown.key.1 as usize, &wrench[6..]);
        }
    }

    /// Adds what `rate` [Pa] more pressure on the cover does to the rows of the forces to `forces` [N].
    pub fn pressure_into(&self, forces: &mut [f64], dofs: &Dofs, rate: f64) {
        if !self.placed {
            return;
        }
        for (k, unknown) in self.unknowns.iter().enumerate() {
            let force = unknown.tangent.by_displacement * unknown.by_pressure * rate;
            dofs.scatter(forces, dofs.contact_block(k), force.as_slice());
        }
    }

    /// Adds the derivatives of all rows by the forces, and of the forces' rows, to `values`.
    pub fn stiffness_into(&self, values: &mut [f64], pattern: &BlockPattern, dofs: &Dofs) {
        let entries = |block: Mat3| -> [[f64; 3]; 3] {
            std::array::from_fn(|r| std::array::from_fn(|c| block[(r, c)]))
        };
        for (k, unknown) in self.unknowns.iter().enumerate() {
            let (block, tangent) = (dofs.contact_block(k), self.tangent_of(unknown));
            pattern.add_block(values, dofs, block, block, &entries(self.own_block(unknown)));
            let by_motion = tangent.row_by_motion();
            for (body, first) in [(unknown.key.0 as usize, 0), (unknown.key.1 as usize, 6)] {
                let lift: [[f64; 3]; 6] = std::array::from_fn(|r| {
                    std::array::from_fn(|c| -tangent.lift[first + r][c] * self.stiffness)
                });
                pattern.add_block(values, dofs, body, block, &lift);
                let by: [[f64; 6]; 3] =
                    std::array::from_fn(|r| std::array::from_fn(|c| by_motion[r][first + c]));
                pattern.add_block(values, dofs, block, body, &by);
            }
        }
        self.for_each_flexibility(
            |_, _| true,
            |row, column, block| {
                let (row, column) = (dofs.contact_block(row), dofs.contact_block(column));
                pattern.add_block(values, dofs, row, column, &entries(block));
            },
        );
    }

    /// Derivatives at an unknown force; where unknowns are left out, those of one that nothing asks for.
    fn tangent_of<'a>(&self, unknown: &'a ContactForce) -> &'a ForceTangent {
        if self.placed { &unknown.tangent } else { &STILL }
    }

    /// What an unknown force does to its own row but for the flexibility of the bodies.
    fn own_block(&self, unknown: &ContactForce) -> Mat3 {
        (Mat3::identity() + self.tangent_of(unknown).by_displacement * unknown.compliance) * self.stiffness
    }

    /// Calls `visit(row, column, block)` for what each unknown force does through the flexibility of a body
    /// to the row of each on the same body, its own among them, where it is `wanted(row, column)`. Two
    /// between the same two bodies meet on both.
    fn for_each_flexibility(
        &self,
        wanted: impl Fn(usize, usize) -> bool,
        mut visit: impl FnMut(usize, usize, Mat3),
    ) {
        for patch in self.patches.iter().filter(|_| self.placed) {
            for (i, (row, row_sign, _)) in patch.places.iter().enumerate() {
                let by_displacement = &self.unknowns[*row].tangent.by_displacement;
                if *by_displacement == Mat3::zeros() {
                    continue;
                }
                let by = by_displacement * (-self.stiffness * row_sign);
                for (j, (column, sign, _)) in patch.places.iter().enumerate() {
                    if wanted(*row, *column) {
                        visit(*row, *column, by * patch.block(i, j) * *sign);
                    }
                }
            }
        }
    }
}

/// The wrench on both bodies of a unit force on `b` at `point`.
fn plain_lift(point: &Vec3, [a, b]: [&Vec3; 2]) -> [[f64; 3]; 12] {
    let (on_a, on_b) = ((point - a).cross_matrix(), (point - b).cross_matrix());
    std::array::from_fn(|r| {
        std::array::from_fn(|c| match r {
            0..3 => -f64::from(u8::from(r == c)),
            3..6 => -on_a[(r - 3, c)],
            6..9 => f64::from(u8::from(r - 6 == c)),
            _ => on_b[(r - 9, c)],
        })
    })
}

/// The wrench on both bodies of `force`, `lift` being that of a unit force.
fn lifted(lift: &[[f64; 3]; 12], force: &Vec3) -> [f64; 12] {
    std::array::from_fn(|r| (0..3).map(|c| lift[r][c] * force[c]).sum())
}

impl ForceTangent {
    /// The row of the force by translation and rotation of `a`, then of `b` [N/m, N].
    fn row_by_motion(&self) -> [[f64; 12]; 3] {
        std::array::from_fn(|r| {
            let row = &self.by_motion[r];
            std::array::from_fn(|c| match c {
                0..3 => row[c],
                3..6 => -row[c + 3],
                _ => -row[c - 6],
            })
        })
    }

    /// From the law's derivatives at a contact that touches, which it combines with its own rows.
    fn combine(elastic: &ElasticTangent, plain: [[f64; 3]; 12], point: &ContactPoint, excess: Vec3) -> Self {
        let by_motion = std::array::from_fn(|r| std::array::from_fn(|c| elastic[12 + r][c]));
        let by_displacement = Mat3::from_fn(|r, c| elastic[12 + r][9 + c]);
        let mut lift = plain;
        let n = point.evaluation.normal;
        let along = n.dot(&(by_displacement * n));
        if point.evaluation.weight < 1.0 && point.evaluation.weight > LEAST_WEIGHT && along < 0.0 {
            // What is stored per weight pushes along the weight's gradient; it follows the normal force alone.
            for r in 0..12 {
                let whole: f64 = (0..3).map(|c| elastic[r][9 + c] * n[c]).sum();
                let lifted: f64 = (0..3)
                    .map(|k| plain[r][k] * (0..3).map(|c| by_displacement[(k, c)] * n[c]).sum::<f64>())
                    .sum();
                for c in 0..3 {
                    lift[r][c] += (whole - lifted) / along * n[c];
                }
            }
        }
        ForceTangent { lift, by_motion, by_displacement, plain, excess }
    }

    /// The derivative of the wrench by the motion at a given force.
    fn at_given_force(&self, elastic: &ElasticTangent) -> Tangent {
        std::array::from_fn(|r| {
            std::array::from_fn(|c| {
                elastic[r][c] - (0..3).map(|k| self.lift[r][k] * self.by_motion[k][c]).sum::<f64>()
            })
        })
    }
}

#[cfg(test)]
mod tests;
