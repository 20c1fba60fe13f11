//! The rock of each grain: its elastic constants cell by cell, and the grain condensed with them.

use std::sync::Arc;

use rayon::prelude::*;

use crate::case::{ContactCase, Fidelity, Law, RockCase, RubbleCase, Scatter};
use crate::contact::NormalLaw;
use crate::element::Strains;
use crate::error::{Error, Result};
use crate::grain::{Ancestry, CondensedGrain, DamagedGrain, FullGrain};
use crate::material::{
    self, DamageLaw, DamageParameters, Elastic, Property, Quantity, Softening, crack_band_size, sample_field,
};
use crate::mesh::{CellId, Mesh};
use crate::model::Deformation;

/// What the case says of a quantity, as the material draws it.
pub fn quantity(law: &Law) -> Quantity {
    Quantity { mean: law.mean, law: law.scatter }
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

/// Strength of a cell of so much `volume` [m^3] over that of the volume that the law's mean is meant for:
/// `(V0 / V)^(1/k)`, Weibull's (1939) weakest link. 1 where the law names no size.
fn size_factor(law: &Law, volume: f64) -> f64 {
    match (law.scatter, law.reference_size) {
        (Scatter::Weibull { shape }, Some(size)) => (size.powi(3) / volume).powf(1.0 / shape),
        _ => 1.0,
    }
}

/// A fault of a mesh under the name of its body.
fn named(name: &str) -> impl Fn(Error) -> Error {
    move |error| match error {
        Error::Mesh { message, .. } => Error::Mesh { name: name.into(), message },
        other => other,
    }
}

/// Body number `index` condensed; with contacts of asperities forces act on patches of it.
pub fn condensed(
    rock: &RockCase,
    name: &str,
    index: usize,
    mesh: Mesh,
    (seed, contact): (u64, &ContactCase),
) -> Result<Arc<CondensedGrain>> {
    tracing::debug!(name, cells = mesh.cells.len(), nodes = mesh.nodes.len(), "condensing");
    let elasticity = elasticity(rock, name, index, mesh.cells.len(), seed)?;
    let on_points = CondensedGrain::new(mesh, &elasticity, rock.density).map_err(named(name))?;
    Ok(Arc::new(loaded(on_points, contact.normal)))
}

/// A grain whose contact forces act as the law wants.
fn loaded(on_points: CondensedGrain, normal: NormalLaw) -> CondensedGrain {
    match normal {
        NormalLaw::Spring => on_points,
        NormalLaw::Asperity => on_points.on_patches(),
    }
}

/// Body number `index` with all its nodes.
pub fn full(
    rock: &RockCase,
    name: &str,
    index: usize,
    mesh: Mesh,
    seed_and_contact: (u64, &ContactCase),
) -> Result<Arc<FullGrain>> {
    let condensed = condensed(rock, name, index, mesh, seed_and_contact)?;
    FullGrain::new(condensed, rock.density, Strains::Finite).map(Arc::new).map_err(named(name))
}

/// How the grains of a specimen deform, and break if their rock does, in their order; those whose fidelity is chosen rest at first.
pub fn grains(
    rock: &RockCase,
    meshes: &[Mesh],
    fidelity: Fidelity,
    (seed, contact): (u64, &ContactCase),
) -> Result<Vec<(Deformation, Option<Arc<DamagedGrain>>)>> {
    let grain = |(index, mesh): (usize, &Mesh)| {
        let (name, mesh) = (format!("grain {index}"), mesh.clone());
        let (deformation, grain) = match fidelity {
            Fidelity::Rigid => {
                let elasticity = elasticity(rock, &name, index, mesh.cells.len(), seed)?;
                let on_points =
                    CondensedGrain::stressed(mesh, &elasticity, rock.density).map_err(named(&name))?;
                (Deformation::Rigid, Arc::new(loaded(on_points, contact.normal)))
            }
            Fidelity::Auto | Fidelity::Condensed => {
                let grain = condensed(rock, &name, index, mesh, (seed, contact))?;
                let deforms =
                    if fidelity == Fidelity::Auto { Deformation::resting } else { Deformation::condensed };
                (deforms(grain.clone()), grain)
            }
            Fidelity::Full => {
                let full = full(rock, &name, index, mesh, (seed, contact))?;
                (Deformation::full(full.clone()), full.condensed().clone())
            }
        };
        Ok((deformation, damaged(rock, &name, index, &grain, seed)?))
    };
    meshes.par_iter().enumerate().map(grain).collect()
}

/// Body number `index` with the strengths of its cells; `None` for elastic rock. With a fracture energy the
/// softening in tension follows from it and the size of the cell.
///
/// # Errors
/// `Error::Mesh` naming the body, where a law cannot give what is possible.
pub fn damaged(
    rock: &RockCase,
    name: &str,
    index: usize,
    grain: &Arc<CondensedGrain>,
    seed: u64,
) -> Result<Option<Arc<DamagedGrain>>> {
    let (Some(damage), Some(tensile), Some(compressive)) =
        (&rock.damage, &rock.tensile_strength, &rock.compressive_strength)
    else {
        return Ok(None);
    };
    let fail = |error: material::MaterialError| Error::Mesh { name: name.into(), message: error.to_string() };
    let parameters = DamageParameters {
        tension: damage
            .fracture_energy
            .map_or(Softening::Exponent(damage.exponent), Softening::FractureEnergy),
        compression: Softening::Exponent(damage.exponent),
        threshold: damage.threshold,
        recovery_in_compression: damage.recovery_in_compression,
        recovery_in_tension: damage.recovery_in_tension,
    };
    let mesh = grain.mesh();
    let cells = mesh.cells.len();
    let field = |law: &Law, property| sample_field(&quantity(law), property, seed, index as u64, cells);
    // The weakest link: a cell that is smaller than what the mean is meant for is stronger.
    let scaled = |law: &Law, property| {
        let values = field(law, property)?.values;
        let scale = |(cell, value): (CellId, f64)| value * size_factor(law, mesh.cell_volume(cell));
        Ok(mesh.cell_ids().zip(values).map(scale).collect::<Vec<f64>>())
    };
    let tensile = scaled(tensile, Property::TensileStrength).map_err(fail)?;
    let compressive = scaled(compressive, Property::CompressiveStrength).map_err(fail)?;
    let law = |cell: CellId| {
        let size = crack_band_size(mesh.cell_volume(cell));
        let (f_t, f_c) = (tensile[cell.index()], compressive[cell.index()]);
        DamageLaw::new(*grain.rock(cell), f_t, f_c, &parameters, size).map_err(fail)
    };
    let laws = mesh.cell_ids().map(law).collect::<Result<Vec<_>>>()?;
    let ancestry = Ancestry::of_grain(index as u32);
    let grain =
        DamagedGrain::over(grain.clone(), laws, rock.density, ancestry)?.losing_below(damage.least_fragment);
    let grain = match damage.rubble {
        RubbleCase::Removed => grain,
        RubbleCase::Kept => grain.keeping_rubble(),
    };
    Ok(Some(Arc::new(grain)))
}
