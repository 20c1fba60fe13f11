//! What the cells of all bodies draw from the rock's laws: values cell by cell, means of grains, and what was
//! thrown away. Moduli in Pa. The same draws as those of the grains in `rock`, made again.

use crate::case::{BodyCase, Case, Geometry, Law as LawCase, RockCase, Scatter};
use crate::error::{Error, Result};
use crate::material::{Drawn, Field, Property, sample_field};
use crate::mesh::Mesh;
use crate::scene::{SceneBody, SceneParameters};

use super::rock::quantity;

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
        let sampled = |&(rock, index, cells): &Sampled<'_>| {
            let law = law_of(rock, property)?;
            Some(field(law, property, seed, index, cells).map(|field| (law.mean, field)))
        };
        let fields: Vec<_> = bodies.iter().filter_map(sampled).collect::<Result<_>>()?;
        all.extend(Drawn::over(property, &fields));
    }
    Ok(all)
}

/// The law of a property; elastic rock has no strengths.
fn law_of(rock: &RockCase, property: Property) -> Option<&LawCase> {
    let breaks = rock.damage.is_some();
    match property {
        Property::YoungsModulus => Some(&rock.youngs_modulus),
        Property::PoissonsRatio => Some(&rock.poissons_ratio),
        Property::CompressiveStrength => rock.compressive_strength.as_ref().filter(|_| breaks),
        Property::TensileStrength => rock.tensile_strength.as_ref().filter(|_| breaks),
    }
}

/// Of the grains of a specimen; nothing where all are rigid and none can break, since then no cell has values
/// of its own.
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
    let cells = |built: &SceneBody| built.grain.as_ref().map(|grain| grain.mesh().cells.len());
    let bodies: Vec<Sampled<'_>> = scene
        .bodies
        .iter()
        .zip(&parameters.bodies)
        .enumerate()
        .filter_map(|(index, (body, built))| Some((case.rock_of(body), index, cells(built)?)))
        .collect();
    drawn(&bodies, case.seed)
}

/// Cells of the sample by which the check judges a case's laws.
const SAMPLE: usize = 100_000;

/// The quantities of the case's rock that are drawn beyond what is possible, each with the share of a hundred
/// thousand draws, and what throwing them away makes of the mean.
///
/// # Errors
/// `Error::Usage` where a law cannot give what is possible.
pub fn expected(case: &Case) -> Result<Vec<Drawn>> {
    let mut found = drawn(&[(&case.rock, 0, SAMPLE)], case.seed)?;
    found.retain(|drawn| drawn.rejected > 0);
    Ok(found)
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

/// Young's modulus of every cell of a scene's bodies [Pa]; the law's mean in bodies that do not deform, none
/// in those without a mesh.
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
        let law = &case.rock_of(body).youngs_modulus;
        let cells = mesh.as_ref().map_or(0, |mesh| mesh.cells.len());
        match built.grain.is_some() {
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
