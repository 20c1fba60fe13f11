//! The specimen of a test: generated, meshed, told of, and taken down.

use std::time::Instant;

use crate::case::{Case, SpecimenCase};
use crate::error::Result;
use crate::mesh::Mesh;
use crate::recording::{Generated, GrainMeshes, Recorder};
use crate::setup::{grain_meshes, rock_samples};
use crate::specimen::{Phase, Specimen, generate};
use crate::triaxial::Rig;

use super::observer::{Observer, SpecimenReport};

/// The specimen and a mesh of each of its grains.
pub fn generated(
    case: &Case,
    wanted: &SpecimenCase,
    observer: &mut dyn Observer,
) -> Result<(Specimen, Vec<Mesh>)> {
    let clock = Instant::now();
    let parameters = wanted.parameters(case.seed, case.contact.rounding);
    let progress = &mut |phase: Phase, share: f64| observer.specimen_progress(phase, share);
    let specimen = generate(&parameters, progress)?;
    meshed(case, wanted, specimen, clock, observer)
}

/// A specimen, told of, and a mesh of each of its grains. It was begun when `clock` was.
pub fn meshed(
    case: &Case,
    wanted: &SpecimenCase,
    specimen: Specimen,
    clock: Instant,
    observer: &mut dyn Observer,
) -> Result<(Specimen, Vec<Mesh>)> {
    let meshes = grain_meshes(wanted, &specimen)?;
    observer.specimen_ready(&SpecimenReport::new(&specimen, wanted.void_ratio, &meshes, clock.elapsed()));
    observer.rock_drawn(&rock_samples::of_specimen(case, &meshes)?);
    Ok((specimen, meshes))
}

/// Writes the tables of a specimen.
pub fn write(recorder: &mut Recorder, case: &Case, specimen: &Specimen, meshes: &[Mesh]) -> Result<()> {
    let drawn = &rock_samples::of_specimen(case, meshes)?;
    let means = &rock_samples::grain_means(case, meshes)?;
    recorder.write_specimen(case, &Generated { specimen, meshes, drawn, means })
}

/// Writes the mesh and the first state: the specimen in its rig as generated, which is the reference
/// configuration. In a continued run the mesh is only compared.
pub fn begin(
    recorder: &mut Recorder,
    case: &Case,
    rig: &Rig,
    specimen: &Specimen,
    meshes: &[Mesh],
) -> Result<()> {
    let moduli = &rock_samples::moduli_of_specimen(case, meshes)?;
    recorder.begin(rig, specimen, &shown(case, meshes, moduli))
}

/// As [`begin`], with a first state to which `rig` has moved on from the configuration `reference`.
pub fn begin_moved(
    recorder: &mut Recorder,
    case: &Case,
    [rig, reference]: [&Rig; 2],
    specimen: &Specimen,
    meshes: &[Mesh],
) -> Result<()> {
    let moduli = &rock_samples::moduli_of_specimen(case, meshes)?;
    recorder.begin_moved(rig, reference, specimen, &shown(case, meshes, moduli))
}

fn shown<'a>(case: &Case, meshes: &'a [Mesh], moduli: &'a [Vec<f64>]) -> GrainMeshes<'a> {
    GrainMeshes { meshes, moduli, apart: case.rock.damage.is_some() }
}
