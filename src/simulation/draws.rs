//! What the cells of all bodies have drawn from the rock's laws: how many values, how many thrown away, their spread.
//!
//! A law may reach where no rock is (a normal one below zero, say); such draws are thrown away and made again, which shifts the mean.

use crate::case::{BodyCase, Case, Geometry, Law as LawCase, RockCase, Scatter};
use crate::error::{Error, Result};
use crate::material::{Field, Property, sample_field};
use crate::mesh::Mesh;
use crate::results::Column;
use crate::scene::{SceneBody, SceneParameters};

use super::rock::quantity;

/// Draws of one quantity over the cells of all bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drawn {
    pub property: Property,
    /// Values in use, and draws thrown away.
    pub values: u64,
    pub rejected: u64,
    /// The mean that the laws were asked for (over the cells), that of the values, their standard deviation and range [Pa, or 1 for
    /// Poisson's ratio].
    pub asked: f64,
    pub mean: f64,
    pub deviation: f64,
    pub range: [f64; 2],
}

/// A body's rock, its number and that of its cells.
type Sampled<'a> = (&'a RockCase, usize, usize);

/// What the cells of body number `index` draw of a quantity.
fn field(law: &LawCase, property: Property, seed: u64, index: usize, cells: usize) -> Result<Field> {
    sample_field(&quantity(law), property, seed, index as u64, cells)
        .map_err(|error| Error::Usage(error.to_string()))
}

fn drawn(bodies: &[Sampled<'_>], seed: u64) -> Result<Vec<Drawn>> {
    let mut all = Vec::new();
    for property in [
        Property::YoungsModulus,
        Property::PoissonsRatio,
        Property::CompressiveStrength,
        Property::TensileStrength,
    ] {
        let mut found: Option<Drawn> = None;
        let (mut asked, mut sum, mut squares) = (0.0, 0.0, 0.0);
        // Away from which squares are summed, so that little is lost.
        let mut middle = 0.0;
        for &(rock, index, cells) in bodies {
            let breaks = rock.damage.is_some();
            let law = match property {
                Property::YoungsModulus => Some(&rock.youngs_modulus),
                Property::PoissonsRatio => Some(&rock.poissons_ratio),
                Property::CompressiveStrength => rock.compressive_strength.as_ref().filter(|_| breaks),
                Property::TensileStrength => rock.tensile_strength.as_ref().filter(|_| breaks),
            };
            let Some(law) = law else { continue };
            let field = field(law, property, seed, index, cells)?;
            if found.is_none() {
                middle = law.mean;
            }
            let total = found.get_or_insert(Drawn {
                property,
                values: 0,
                rejected: 0,
                asked: 0.0,
                mean: 0.0,
                deviation: 0.0,
                range: [f64::INFINITY, f64::NEG_INFINITY],
            });
            total.values += field.values.len() as u64;
            total.rejected += field.rejected;
            asked += law.mean * field.values.len() as f64;
            for value in field.values {
                sum += value - middle;
                squares += (value - middle).powi(2);
                total.range = [total.range[0].min(value), total.range[1].max(value)];
            }
        }
        if let Some(mut total) = found.filter(|total| total.values > 0) {
            let (count, mean) = (total.values as f64, sum / total.values as f64);
            total.asked = asked / count;
            total.mean = middle + mean;
            total.deviation = (squares / count - mean * mean).max(0.0).sqrt();
            all.push(total);
        }
    }
    Ok(all)
}

/// Of the grains of a specimen; nothing where all are rigid and none can break, since then no cell has values of its own.
///
/// # Errors
/// `Error::Usage` where a law cannot give what is possible.
pub fn of_specimen(case: &Case, meshes: &[Mesh]) -> Result<Vec<Drawn>> {
    if !case.meshes_act() {
        return Ok(Vec::new());
    }
    let bodies: Vec<Sampled<'_>> =
        meshes.iter().enumerate().map(|(index, mesh)| (&case.rock, index, mesh.cells.len())).collect();
    drawn(&bodies, case.seed)
}

/// Of the bodies of a scene that deform.
///
/// # Errors
/// As [`of_specimen`].
pub fn of_scene(case: &Case, parameters: &SceneParameters) -> Result<Vec<Drawn>> {
    let Geometry::Scene(scene) = &case.geometry else { return Ok(Vec::new()) };
    let cells = |built: &crate::scene::SceneBody| {
        let condensed = built.grain.as_ref().map(|grain| grain.mesh().cells.len());
        condensed.or(built.full.as_ref().map(|grain| grain.mesh().cells.len()))
    };
    let bodies: Vec<Sampled<'_>> = scene
        .bodies
        .iter()
        .zip(&parameters.bodies)
        .enumerate()
        .filter_map(|(index, (body, built))| {
            Some((body.rock.as_ref().unwrap_or(&case.rock), index, cells(built)?))
        })
        .collect();
    drawn(&bodies, case.seed)
}

/// Cells of the sample by which the check judges a case's laws.
const SAMPLE: usize = 100_000;

/// The quantities of the case's rock that are drawn beyond what is possible, each with the share of a hundred thousand draws, and what
/// throwing them away makes of the mean.
///
/// # Errors
/// `Error::Usage` where a law cannot give what is possible.
pub fn expected(case: &Case) -> Result<Vec<Drawn>> {
    let mut found = drawn(&[(&case.rock, 0, SAMPLE)], case.seed)?;
    found.retain(|drawn| drawn.rejected > 0);
    Ok(found)
}

impl std::fmt::Display for Drawn {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let draws = self.values + self.rejected;
        write!(
            f,
            "{}: {} of {draws} draws are impossible and made again, which changes the mean by {:+.2} %",
            self.property.name(),
            self.rejected,
            100.0 * (self.mean / self.asked - 1.0)
        )
    }
}

/// `/rock/<quantity>`: one row each.
pub fn tables(drawn: &[Drawn]) -> Vec<(String, Vec<Column>)> {
    let table = |drawn: &Drawn| {
        let (name, units) = match drawn.property {
            Property::YoungsModulus => ("youngs_modulus", "Pa"),
            Property::PoissonsRatio => ("poissons_ratio", "1"),
            Property::CompressiveStrength => ("compressive_strength", "Pa"),
            Property::TensileStrength => ("tensile_strength", "Pa"),
        };
        let number =
            |column: &str, long_name: &str, value| Column::floats(column, units, long_name, vec![value]);
        let columns = vec![
            Column::integers("values", "cells with a value of their own", vec![drawn.values as i64]),
            Column::integers(
                "rejected",
                "draws thrown away and made again, since no rock has such a value",
                vec![drawn.rejected as i64],
            ),
            number(
                "mean_asked",
                "mean that the law was asked for, over the cells where bodies have laws of their own",
                drawn.asked,
            ),
            number("mean", "mean of the values, before a reference size scales strengths", drawn.mean),
            number("deviation", "standard deviation of the values", drawn.deviation),
            number("smallest", "smallest value", drawn.range[0]),
            number("largest", "largest value", drawn.range[1]),
        ];
        (format!("rock/{name}"), columns)
    };
    drawn.iter().map(table).collect()
}

/// A value of every cell of the grains; the law's mean where no cell has values of its own.
fn values_of_grains(
    case: &Case,
    law: &LawCase,
    property: Property,
    meshes: &[Mesh],
) -> Result<Vec<Vec<f64>>> {
    let values = |(index, mesh): (usize, &Mesh)| match case.meshes_act() {
        true => Ok(field(law, property, case.seed, index, mesh.cells.len())?.values),
        false => Ok(vec![law.mean; mesh.cells.len()]),
    };
    meshes.iter().enumerate().map(values).collect()
}

/// Young's modulus of every cell of a specimen's grains [Pa].
///
/// # Errors
/// As [`of_specimen`].
pub fn moduli_of_specimen(case: &Case, meshes: &[Mesh]) -> Result<Vec<Vec<f64>>> {
    values_of_grains(case, &case.rock.youngs_modulus, Property::YoungsModulus, meshes)
}

/// Young's modulus of every cell of a scene's bodies [Pa]; the law's mean in bodies that do not deform, none in those without a mesh.
///
/// # Errors
/// As [`of_specimen`].
pub fn moduli_of_scene(
    case: &Case,
    parameters: &SceneParameters,
    meshes: &[Option<Mesh>],
) -> Result<Vec<Vec<f64>>> {
    let Geometry::Scene(scene) = &case.geometry else { return Ok(Vec::new()) };
    let values = |(index, (mesh, (body, built))): (usize, (&Option<Mesh>, (&BodyCase, &SceneBody)))| {
        let law = &body.rock.as_ref().unwrap_or(&case.rock).youngs_modulus;
        let cells = mesh.as_ref().map_or(0, |mesh| mesh.cells.len());
        match built.grain.is_some() || built.full.is_some() {
            true => Ok(field(law, Property::YoungsModulus, case.seed, index, cells)?.values),
            false => Ok(vec![law.mean; cells]),
        }
    };
    let bodies = scene.bodies.iter().zip(&parameters.bodies);
    meshes.iter().zip(bodies).enumerate().map(values).collect()
}

/// Mean Young's modulus [Pa] and Poisson's ratio over the cells of each grain.
///
/// # Errors
/// As [`of_specimen`].
pub fn grain_means(case: &Case, meshes: &[Mesh]) -> Result<[Vec<f64>; 2]> {
    let means = |law: &LawCase, property| -> Result<Vec<f64>> {
        if matches!(law.scatter, Scatter::Constant) {
            // To the last bit, which a sum over cells need not be.
            return Ok(vec![law.mean; meshes.len()]);
        }
        let of_cells = values_of_grains(case, law, property, meshes)?;
        let mean = |values: &Vec<f64>| values.iter().sum::<f64>() / values.len().max(1) as f64;
        Ok(of_cells.iter().map(mean).collect())
    };
    Ok([
        means(&case.rock.youngs_modulus, Property::YoungsModulus)?,
        means(&case.rock.poissons_ratio, Property::PoissonsRatio)?,
    ])
}
