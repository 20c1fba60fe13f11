//! The grains of a specimen: a mesh of each, and in the rig the fidelity that the case asks for.

use rayon::prelude::*;

use crate::case::{Case, Fidelity, SpecimenCase};
use crate::error::Result;
use crate::mesh::{Mesh, grain_mesh};
use crate::specimen::{GrainShape, Specimen};
use crate::triaxial::Rig;

use super::rock;

/// A mesh of each grain of a specimen, in their order.
///
/// # Errors
/// `Error::Mesh` where a grain cannot be meshed.
pub fn grain_meshes(wanted: &SpecimenCase, specimen: &Specimen) -> Result<Vec<Mesh>> {
    let mesh = |grain: &GrainShape| grain_mesh(&grain.nominal, wanted.cells_per_grain);
    specimen.grains.par_iter().map(mesh).collect()
}

/// Makes the rigid grains of a rig deform and break as the case says.
///
/// # Errors
/// `Error::Mesh` naming the grain, where a law of its rock cannot give what is possible.
pub fn give_rock(case: &Case, rig: &mut Rig, meshes: &[Mesh]) -> Result<()> {
    let fidelity = case.fidelity_of_grains();
    if fidelity == Fidelity::Rigid && case.rock.damage.is_none() {
        return Ok(());
    }
    rig.make(rock::grains(&case.rock, meshes, fidelity, (case.seed, &case.contact))?);
    Ok(())
}
