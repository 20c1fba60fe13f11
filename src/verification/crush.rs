//! A whole crushing test without a file: increments, cuts, the ledger, the end.

use crate::crushing::{Bench, Grip, Kept, Limits, Part, Plate, Settled};
use crate::error::Result;
use crate::grain::{BreakUp, DamagedGrain};
use crate::mesh::CellId;
use crate::tensor::Pose;

/// A crushing test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Press {
    pub grip: Grip,
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

impl Row {
    /// The row after this one, its plate at `travel` [m].
    fn next(&self, travel: f64, settled: &Settled, kept: &Kept) -> Row {
        let force = settled.contact.force();
        let mut row = Row {
            travel,
            force,
            touching_nodes: settled.contact.pushes.len(),
            external: self.external + 0.5 * (self.force + force) * (travel - self.travel),
            elastic: kept.commit.elastic + settled.contact.patch_energy,
            damage: self.damage + kept.commit.dissipated,
            stabilisation: 0.0,
            failed_points: self.failed_points + kept.commit.newly_failed,
            deleted_cells: self.deleted_cells,
            rounds: settled.rounds,
            factorisations: settled.factorisations,
        };
        if let Some(broken) = &kept.broken {
            row.deleted_cells += broken.deleted.len();
            row.damage += broken.lost_energy;
            row.elastic -= broken.lost_energy;
        }
        row.stabilisation = row.external - row.elastic - row.damage;
        row
    }
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
}

impl Record {
    /// Largest force [N]: of compression, or of tension where the test pulls.
    pub fn peak(&self) -> f64 {
        self.rows.iter().map(|row| row.force.abs()).fold(0.0, f64::max)
    }
}

/// Halvings of an increment.
const MOST_CUTS: u32 = 6;

/// Plates without an end on a grain.
pub fn bench(grain: &DamagedGrain, grip: Grip) -> Bench {
    let heights = || grain.mesh().nodes.iter().map(|x| x.z);
    let [low, high] = [heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max)];
    let modulus = grain.law(CellId(0)).elastic().youngs_modulus();
    let plates = [Plate::wide(low), Plate::wide(high)];
    Bench { grip, patch: None, frame: Pose::identity(), plates, length: high - low, modulus }
}

/// Runs a test. Errors where the grain cannot be factored; what does not converge is an [`Ending`].
pub fn crush(grain: DamagedGrain, press: &Press) -> Result<Record> {
    let mut bench = bench(&grain, press.grip);
    let high = bench.plates[1].height;
    let limits =
        Limits { max_change: press.max_change, tolerance: press.tolerance, most_rounds: press.most_rounds };
    let least_volume = press.debris_share * grain.mesh().volume();
    let step = press.travel / press.increments.max(1) as f64;
    let mut part = Part::new(grain);
    let mut rows = vec![Row::default()];
    let (mut done, mut cuts, mut share) = (0.0, 0, 1.0);
    let mut ending = Ending::Finished;
    while done < press.increments as f64 {
        let advance = f64::min(share, press.increments as f64 - done);
        let last = rows[rows.len() - 1];
        let travel = (done + advance) * step;
        bench.plates[1].height = high - travel;
        let settled = match part.settle(&bench, &limits, &|| false)? {
            Ok(settled) => settled,
            Err(reason) if cuts == MOST_CUTS => {
                ending = Ending::Stalled { reason };
                break;
            }
            Err(_) => {
                (cuts, share) = (cuts + 1, 0.5 * share);
                continue;
            }
        };
        let kept = part.keep(&settled, press.grip, 0, least_volume)?;
        let force = settled.contact.force();
        rows.push(last.next(travel, &settled, &kept));
        done += advance;
        match kept.broken {
            Some(broken) if broken.fragments.len() > 1 => {
                ending = Ending::Broken(Box::new(broken));
                break;
            }
            Some(broken) => {
                // Rebalancing: a new equilibrium of what is left, at the same travel.
                match part.pieces(broken).pop() {
                    Some(rest) => part = rest,
                    None => {
                        ending = Ending::Gone;
                        break;
                    }
                }
                (share, cuts) = (0.0, 0);
            }
            None => {
                let peak = rows.iter().map(|row| row.force.abs()).fold(0.0, f64::max);
                if force.abs() < press.end_share * peak {
                    ending = Ending::Softened;
                    break;
                }
                share = if share == 0.0 { 1.0 } else { f64::min(1.0, 2.0 * share) };
                cuts = cuts.saturating_sub(1);
            }
        }
    }
    Ok(Record { rows, ending })
}
