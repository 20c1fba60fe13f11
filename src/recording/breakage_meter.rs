//! Breakage of a specimen as its test goes on: the size of a grain or a piece is measured once, the rest only
//! where damage moved.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::case::{Case, Geometry};
use crate::error::Result;
use crate::model::{DamageCounts, Model};
use crate::results::{Column, HistoryRow};
use crate::specimen::breakage::{Breakage, GrainFate, Piece, measure};
use crate::specimen::opening::square_opening;

/// What damage had come to when it was last measured: counts, and the damaged volume's bits.
type Mark = (DamageCounts, u64);

/// Measures breakage.
#[derive(Debug, Clone, Default)]
pub struct BreakageMeter {
    /// Of the specimen's grading [m].
    sieves: Vec<f64>,
    /// Sizes of the grains as generated [m]; empty before the first damage.
    before: Vec<f64>,
    /// Sizes of pieces [m] by their body and number of cells, which only falls.
    pieces: BTreeMap<(usize, usize), f64>,
    last: Option<(Mark, Breakage)>,
}

impl BreakageMeter {
    pub fn new(case: &Case) -> Self {
        let sieves = match &case.geometry {
            Geometry::Specimen(specimen) => specimen.grading.iter().map(|point| point[0]).collect(),
            Geometry::Scene(_) => Vec::new(),
        };
        BreakageMeter { sieves, ..BreakageMeter::default() }
    }

    /// Breakage of the grains as they are; `None` where none can break or nothing is damaged.
    ///
    /// # Errors
    /// As [`measure`].
    pub fn measure(&mut self, model: &Model) -> Result<Option<&Breakage>> {
        let damaged: f64 =
            model.bodies.iter().filter_map(|body| Some(body.damaged()?.summary().damaged_volume)).sum();
        let mark = (model.damage_counts(), damaged.to_bits());
        if !model.can_break() || mark == Mark::default() {
            return Ok(None);
        }
        if self.last.as_ref().is_none_or(|(last, _)| *last != mark) {
            let breakage = measure(&self.fates(model), &self.sieves)?;
            self.last = Some((mark, breakage));
        }
        Ok(self.last.as_ref().map(|(_, breakage)| breakage))
    }

    /// Breakage at the end, damaged or not.
    ///
    /// # Errors
    /// As [`measure`].
    pub fn final_measure(&mut self, model: &Model) -> Result<Breakage> {
        measure(&self.fates(model), &self.sieves)
    }

    fn fates(&mut self, model: &Model) -> Vec<GrainFate> {
        let first = model.generated.iter().flatten();
        if self.before.is_empty() {
            let meshes: Vec<_> = first.clone().collect();
            self.before = meshes.par_iter().map(|mesh| square_opening(&mesh.surface_corners())).collect();
        }
        let parts = model.parts();
        let parts =
            model.generated.iter().zip(&parts).filter_map(|(first, parts)| first.as_ref().map(|_| parts));
        let grains = first.zip(parts).zip(&self.before);
        let smaller = grains.clone().flat_map(|((first, parts), _)| {
            let meshes = parts.iter().filter_map(|body| Some((*body, model.bodies[*body].damaged()?.mesh())));
            meshes.filter(|(_, mesh)| mesh.cells.len() != first.cells.len())
        });
        let named = smaller.map(|(body, mesh)| ((body, mesh.cells.len()), mesh));
        let unknown: Vec<_> = named.filter(|(name, _)| !self.pieces.contains_key(name)).collect();
        let measured =
            unknown.par_iter().map(|(name, mesh)| (*name, square_opening(&mesh.surface_corners())));
        self.pieces.extend(measured.collect::<Vec<_>>());
        let mut fates = Vec::with_capacity(self.before.len());
        for ((first, parts), size) in grains {
            let volume = first.volume();
            let mut fate = GrainFate {
                before: Piece { size: *size, volume },
                pieces: vec![],
                came_apart: model.came_apart(parts),
                crushed_volume: 0.0,
                damaged_volume: 0.0,
            };
            for body in parts {
                let Some(grain) = model.bodies[*body].damaged() else { continue };
                let (cells, volume) = (grain.mesh().cells.len(), grain.mesh().volume());
                let size = match cells == first.cells.len() {
                    true => *size,
                    false => self.pieces[&(*body, cells)],
                };
                fate.pieces.push(Piece { size, volume });
                fate.damaged_volume += grain.summary().damaged_volume;
            }
            let left: f64 = fate.pieces.iter().map(|piece| piece.volume).sum();
            fate.crushed_volume = (volume - left).max(0.0);
            fates.push(fate);
        }
        fates
    }
}

/// Puts the measures into a row of the history: zero before the first damage, not a number where they cannot
/// be measured.
pub fn note(row: &mut HistoryRow, model: &Model, breakage_meter: &mut BreakageMeter) {
    if !model.can_break() {
        return;
    }
    let numbers = match breakage_meter.measure(model) {
        Ok(Some(found)) => {
            row.broken_grains = found.classes.iter().map(|class| class.broken as i64).sum();
            [found.marsal, found.hardin, found.einav, found.damaged_share, found.crushed_share]
        }
        Ok(None) => [0.0; 5],
        Err(_) => [f64::NAN; 5],
    };
    [row.breakage_marsal, row.breakage_hardin, row.breakage_einav, row.damaged_share, row.crushed_share] =
        numbers;
}

/// `/pieces`: what every body that can break is now, a row a piece.
pub fn pieces(model: &Model) -> Vec<Column> {
    let found: Vec<_> = model
        .bodies
        .iter()
        .enumerate()
        .filter_map(|(body, it)| Some((body, it.mass, it.damaged()?)))
        .collect();
    let integers = |name: &str, long_name: &str, of: &dyn Fn(usize) -> i64| {
        Column::integers(name, long_name, (0..found.len()).map(of))
    };
    let floats = |name: &str, units: &str, long_name: &str, of: &dyn Fn(usize) -> f64| {
        Column::floats(name, units, long_name, (0..found.len()).map(of))
    };
    let ancestry = |k: usize| found[k].2.ancestry();
    let parent = "number of the body that it broke from; -1 for a grain that did not come apart";
    vec![
        integers("body", "number of the body, as fragment in /VTKHDF", &|k| found[k].0 as i64),
        integers("grain", "number of the grain as generated that it was part of", &|k| {
            i64::from(ancestry(k).origin)
        }),
        integers("parent", parent, &|k| ancestry(k).parent.map_or(-1, i64::from)),
        integers("generation", "0 a grain as generated, 1 a part of it, 2 a part of a part", &|k| {
            i64::from(ancestry(k).generation)
        }),
        integers("cells", "cells that are left", &|k| found[k].2.mesh().cells.len() as i64),
        integers("failed_points", "of these, integration points that have failed", &|k| {
            found[k].2.summary().failed_points as i64
        }),
        floats("mass", "kg", "mass", &|k| found[k].1),
        floats("volume", "m3", "volume of its cells", &|k| found[k].2.mesh().volume()),
        floats("damage_mean", "1", "volume-weighted mean of the damage variable", &|k| {
            found[k].2.summary().mean
        }),
        floats("energy_damage", "J", "energy that damage has set free in this body since it exists", &|k| {
            found[k].2.dissipated()
        }),
    ]
}
