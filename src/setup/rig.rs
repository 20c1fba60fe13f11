//! The rig that a case describes: plates, friction, cover.

use crate::case::{Case, MembraneCase, RubberLawCase, StageCase, Tilting};
use crate::contact::law::Friction;
use crate::error::{Error, Result};
use crate::material::{Rubber, RubberLaw};
use crate::solver::StopSignal;
use crate::specimen::Specimen;
use crate::triaxial::{Cover, Rig, RigParameters, Rims, RubberSheet};

use super::settings::rig_settings;

/// A specimen in the rig of its case, grains rigid. A rubber membrane's contacts are made for
/// `membrane_pressure` [Pa]. Its solver gives up where `stop` is raised.
///
/// # Errors
/// `Error::Usage` for a rubber that the case's table lets through and the material does not allow; what
/// [`Rig::new`] refuses.
pub fn rig(case: &Case, specimen: &Specimen, membrane_pressure: f64, stop: StopSignal) -> Result<Rig> {
    let mut settings = rig_settings(case);
    settings.stop = stop;
    Rig::new(specimen, &rig_parameters(case, membrane_pressure)?, settings)
}

/// The largest confining pressure that the case names [Pa]; a stage without one of its own keeps one that it
/// names.
pub fn largest_pressure(case: &Case) -> f64 {
    case.stages.iter().filter_map(StageCase::pressure).fold(0.0, f64::max)
}

fn rig_parameters(case: &Case, membrane_pressure: f64) -> Result<RigParameters> {
    let contact = case.contact;
    Ok(RigParameters {
        density: case.rock.density,
        youngs_modulus: case.rock.youngs_modulus.mean,
        poissons_ratio: case.rock.poissons_ratio.mean,
        friction: Friction {
            peak: contact.friction,
            residual: contact.residual_friction,
            weakening_distance: contact.weakening_distance,
        },
        plate_friction: Friction::constant(case.plates.friction),
        faces: contact.faces,
        normal: contact.normal,
        limit_pressure: case.limit_pressure_of(&case.rock),
        tilting: match case.plates.tilting {
            Tilting::Free => true,
            Tilting::Locked => false,
        },
        cover: cover(case, membrane_pressure)?,
    })
}

fn cover(case: &Case, pressure: f64) -> Result<Cover> {
    let (thickness, shear_modulus, law, mesh_size) = match case.membrane {
        MembraneCase::Pressure { rims } => {
            let by_friction = if case.plates.friction == 0.0 { Rims::Sliding } else { Rims::Bonded };
            return Ok(Cover::Pressure(rims.unwrap_or(by_friction)));
        }
        MembraneCase::RigidWall => return Ok(Cover::RigidWall),
        MembraneCase::Rubber { thickness, shear_modulus, law, mooney_share, gent_limit, mesh_size } => {
            let law = match law {
                RubberLawCase::NeoHookean => RubberLaw::NeoHookean,
                RubberLawCase::MooneyRivlin => RubberLaw::MooneyRivlin { share: mooney_share },
                RubberLawCase::Gent => RubberLaw::Gent { limit: gent_limit },
            };
            (thickness, shear_modulus, law, mesh_size)
        }
    };
    let rubber =
        Rubber::new(shear_modulus, law).map_err(|problem| Error::Usage(format!("$.membrane: {problem}")))?;
    Ok(Cover::Rubber(RubberSheet { rubber, thickness, mesh_size, pressure }))
}
