//! The rock of each grain: its elastic constants cell by cell, and the grain condensed with them.

use std::sync::Arc;

use rayon::prelude::*;

use crate::case::{Law, RockCase, Scatter};
use crate::error::{Error, Result};
use crate::grain::CondensedGrain;
use crate::material::{self, Elastic, Property, Quantity, sample_field};
use crate::mesh::Mesh;

/// What the case says of a quantity, as the material draws it.
pub fn quantity(law: &Law) -> Quantity {
    let scatter = match law.scatter {
        Scatter::Constant => material::Law::Constant,
        Scatter::Weibull { shape } => material::Law::Weibull { shape },
        Scatter::Normal { variation } => material::Law::Normal { variation },
        Scatter::Lognormal { variation } => material::Law::LogNormal { variation },
        Scatter::Gamma { shape } => material::Law::Gamma { shape },
        Scatter::Exponential => material::Law::Exponential,
    };
    Quantity { mean: law.mean, law: scatter }
}

/// Elastic constants of each cell of body number `index`.
///
/// # Errors
/// `Error::Mesh` naming the body, where a law cannot give what is possible.
pub fn elasticity(
    rock: &RockCase,
    name: &str,
    index: usize,
    cells: usize,
    seed: u64,
) -> Result<Vec<Elastic>> {
    let fail = |error: material::MaterialError| Error::Mesh { name: name.into(), message: error.to_string() };
    let field = |law: &Law, property| {
        sample_field(&quantity(law), property, seed, index as u64, cells).map(|field| field.values)
    };
    let moduli = field(&rock.youngs_modulus, Property::YoungsModulus).map_err(fail)?;
    let ratios = field(&rock.poissons_ratio, Property::PoissonsRatio).map_err(fail)?;
    moduli.into_iter().zip(ratios).map(|(e, nu)| Elastic::new(e, nu).map_err(fail)).collect()
}

/// Body number `index` condensed.
pub fn condensed(
    rock: &RockCase,
    name: &str,
    index: usize,
    mesh: Mesh,
    seed: u64,
) -> Result<Arc<CondensedGrain>> {
    tracing::debug!(name, cells = mesh.cells.len(), nodes = mesh.nodes.len(), "condensing");
    let elasticity = elasticity(rock, name, index, mesh.cells.len(), seed)?;
    let named = |error| match error {
        Error::Mesh { message, .. } => Error::Mesh { name: name.into(), message },
        other => other,
    };
    CondensedGrain::new(mesh, &elasticity, rock.density).map(Arc::new).map_err(named)
}

/// The grains of a specimen condensed, in their order.
pub fn condensed_grains(rock: &RockCase, meshes: &[Mesh], seed: u64) -> Result<Vec<Arc<CondensedGrain>>> {
    meshes
        .par_iter()
        .enumerate()
        .map(|(index, mesh)| condensed(rock, &format!("grain {index}"), index, mesh.clone(), seed))
        .collect()
}
