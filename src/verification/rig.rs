//! The triaxial rig on elastic specimens with closed forms.
//!
//! - Elastic prism between the plates, condensed, under the pressure cover: away from its ends it is in simple compression,
//!   `q = E e_a` and `e_r = -nu e_a`, so `e_v = (1 - 2 nu) e_a`, taken between two cross-sections as a local strain gauge does. Its ends
//!   rest on their corners; what that does to the stress fades as `exp(-2 pi z / b)` at the slowest, hardly felt at 1.5 widths b (Saint-Venant;
//!   Timoshenko & Goodier, art. 24). Tolerance 1 %: that, and edges that are drawn in by the rounding and not
//!   covered by the pressure. Four widths tall that is 0.4 % of E; six widths tall, and unloaded too, 1e-4 to 3e-4: tolerance 1e-3, eight
//!   gaps that may each be off by 1e-8 of the size at the end of each of four increments, 1e-4 of the shortening.
//! - Column of three cubes, 60, 50 and 60 mm: each joint is four corners of the smaller face on the larger one, each corner a
//!   spring k (two cubes in series; a plate gives none) beyond the onset: stiffness `1 / (2 / (4 k60) + 2 / (4 k))`. Tolerance 2e-3: the
//!   pressure on the slanted cover between the cubes adds about `p l`, 1.2e5 N/m to 1.4e8 N/m.

use std::sync::Arc;

use crate::contact::NormalLaw;
use crate::contact::face::FaceContact;
use crate::contact::law::Friction;
use crate::error::{Error, Result};
use crate::geometry::{Polyhedron, RoundedBody};
use crate::grain::CondensedGrain;
use crate::loading::StageEnd;
use crate::material::Elastic;
use crate::mesh::cuboid_mesh;
use crate::model::Deformation;
use crate::solver::Settings;
use crate::specimen::shape::GrainShape;
use crate::specimen::statistics::Statistics;
use crate::specimen::{SievePoint, Specimen, SpecimenParameters, SpecimenSize, Unreachable, generate};
use crate::tensor::{Pose, Rotation, Vec3};
use crate::triaxial::{Cover, Lateral, Path, Rig, RigParameters, Rims, Row, Stage, Steps, Test, Until};
use crate::verification::{Absolute, Findings, Relative, timed};

const E: f64 = 30e9;
const NU: f64 = 0.2;

pub(super) fn parameters(friction: f64) -> RigParameters {
    RigParameters {
        density: 2700.0,
        youngs_modulus: E,
        poissons_ratio: NU,
        friction: Friction::constant(friction),
        plate_friction: Friction::constant(friction),
        faces: FaceContact::Corners,
        normal: NormalLaw::Spring,
        limit_pressure: f64::INFINITY,
        tilting: false,
        cover: Cover::Pressure(Rims::Bonded),
    }
}

/// Sixteen grains of 40 to 60 mm, drawn and compacted.
pub fn sixteen_grains() -> Specimen {
    let sizes = vec![SievePoint { size: 0.06, passing: 1.0 }, SievePoint { size: 0.04, passing: 0.0 }];
    let parameters = SpecimenParameters {
        unreachable: Unreachable::Nearest,
        seed: 4,
        ..SpecimenParameters::new(sizes, SpecimenSize::Grains { count: 16, aspect: 1.5 }, 0.6)
    };
    generate(&parameters, &mut |_, _| {}).expect("a specimen")
}

/// Boxes one on the other, each given by its edge lengths [m].
fn stack(boxes: &[[f64; 3]], rounding: f64, diameter: f64) -> Result<Specimen> {
    let (mut grains, mut poses, mut base) = (Vec::new(), Vec::new(), 0.0);
    for &size in boxes {
        let nominal = Polyhedron::cuboid(size)?;
        let rounded = RoundedBody::inset(&nominal, rounding)?;
        let semi_axes = size.map(|edge| 0.5 * edge);
        grains.push(GrainShape { nominal, rounded, sieve_size: size[0], class: 0, semi_axes });
        poses.push(Pose::new(Vec3::new(0.0, 0.0, base + 0.5 * size[2]), Rotation::identity()));
        base += size[2];
    }
    Ok(Specimen { grains, poses, diameter, height: base, statistics: Statistics::default() })
}

fn steps(nominal: f64) -> Steps {
    Steps::Strain { nominal, largest: nominal, growth: 1.5 }
}

pub(super) fn consolidation(pressure: f64, increments: usize) -> Stage {
    Stage {
        path: Path::Stress { axial: pressure, radial: pressure },
        steps: Steps::Count(increments),
        until: Until::default(),
    }
}

pub(super) fn drive(axial_strain: f64, increment: f64, lateral: Lateral) -> Stage {
    Stage { path: Path::Strain { axial_strain, lateral }, steps: steps(increment), until: Until::default() }
}

/// The rows of a stage; nothing where it does not finish.
pub(super) fn run(rig: &mut Rig, test: &mut Test, stage: &Stage) -> Option<Vec<Row>> {
    let mut rows = Vec::new();
    let end = test.run(rig, stage, &mut |_, step| {
        rows.push(step.row.clone());
        true
    });
    (end == StageEnd::Finished && !rows.is_empty()).then_some(rows)
}

pub(super) fn factorisations(rows: &[Row]) -> usize {
    rows.iter().map(|row| row.counters.factorisations).sum()
}

/// Force of the ram [N] that a row's deviatoric stress stands for.
fn ram(rig: &Rig, row: &Row) -> f64 {
    let poses = &rig.committed.poses;
    row.measures.deviatoric_stress * rig.volume(poses) / rig.height(poses)
}

/// Width of the prism, its heights, and half the distance of the gauge's sections [m].
const WIDTH: f64 = 0.04;
pub const TALL: [f64; 2] = [0.16, 0.24];
const GAUGE: f64 = 0.02;

/// `q / E e_a` and `-e_r / e_a` of the prism `tall` [m], sheared by `strain` after consolidation (negative: unloaded), and the factorisations; nothing where a stage fails.
///
/// # Errors
/// As for specimens, meshes and rigs.
pub fn prism(strain: f64, tall: f64) -> Result<Option<([f64; 2], usize)>> {
    let size = [WIDTH, WIDTH, tall];
    let specimen = stack(&[size], 1e-3, 1.2 * WIDTH)?;
    let settings = Settings { force_tolerance: 1e-5, gap_tolerance: 1e-8, ..Settings::default() };
    let mut rig = Rig::new(&specimen, &parameters(0.65), settings)?;
    let mesh = cuboid_mesh(size, 0.5 * WIDTH)?;
    let rock = Elastic::new(E, NU).map_err(|error| Error::Specimen(error.to_string()))?;
    let rocks = vec![rock; mesh.cells.len()];
    let grain = Arc::new(CondensedGrain::new(mesh, &rocks, 2700.0)?);
    rig.make([(Deformation::condensed(grain.clone()), None)]);
    let mut test = Test::new(&rig);
    let pressure = 1e6;
    if !test.seat(&mut rig, pressure).converged() {
        return Ok(None);
    }
    let Some(pressed) = run(&mut rig, &mut test, &consolidation(pressure, 2)) else { return Ok(None) };
    let gauges = |rig: &Rig| rig.committed.fields.first().map(|field| gauge(&grain, field));
    let before = gauges(&rig);
    let Some(sheared) = run(&mut rig, &mut test, &drive(strain, 0.25 * strain.abs(), Lateral::Pressure))
    else {
        return Ok(None);
    };
    let (Some(before), Some(after)) = (before, gauges(&rig)) else { return Ok(None) };
    let axial = before[0] - after[0];
    let lateral = before[1] - after[1];
    let force = sheared.last().map_or(f64::NAN, |row| ram(&rig, row));
    let stress = force / (WIDTH * WIDTH);
    let steps = factorisations(&pressed) + factorisations(&sheared);
    Ok(Some(([stress / (E * axial), -lateral / axial], steps)))
}

/// Mean axial strain between the sections, and mean lateral strain there, extension positive, from the displacements of the
/// surface nodes.
fn gauge(grain: &CondensedGrain, field: &[Vec3]) -> [f64; 2] {
    let nodes = grain.mesh().nodes.as_slice();
    let mean = |of: &dyn Fn(&Vec3, &Vec3) -> Option<f64>| {
        let values: Vec<f64> = (grain.surface().nodes().iter().zip(field))
            .filter_map(|(node, u)| nodes.get(node.index()).and_then(|x| of(x, u)))
            .collect();
        values.iter().sum::<f64>() / values.len() as f64
    };
    let at = |a: f64, b: f64| (a - b).abs() < 1e-9;
    let rise = |z: f64| mean(&|x, u| at(x.z, z).then_some(u.z));
    let axial = (rise(GAUGE) - rise(-GAUGE)) / (2.0 * GAUGE);
    let side = 0.5 * WIDTH;
    let lateral = mean(&|x, u| {
        let near = x.z.abs() < GAUGE + 1e-9;
        match (at(x.x.abs(), side), at(x.y.abs(), side)) {
            (true, false) if near => Some(u.x / x.x),
            (false, true) if near => Some(u.y / x.y),
            (true | false, true | false) => None,
        }
    });
    [axial, lateral]
}

/// Stiffness of the column of cubes when loaded, over its closed form, and the force left after as much unloading over that
/// loading; nothing where a stage fails.
///
/// # Errors
/// As for specimens and rigs.
fn column() -> Result<Option<([f64; 2], usize)>> {
    let specimen = stack(&[[0.06; 3], [0.05; 3], [0.06; 3]], 1e-3, 0.09)?;
    let settings = Settings { force_tolerance: 1e-6, ..Settings::default() };
    let mut rig = Rig::new(&specimen, &parameters(0.65), settings)?;
    let mut test = Test::new(&rig);
    // Every corner carries more than the 460 N at which the onset (4 um) ends.
    let pressure = 2e6;
    if !test.seat(&mut rig, pressure).converged() {
        return Ok(None);
    }
    let Some(pressed) = run(&mut rig, &mut test, &consolidation(pressure, 2)) else { return Ok(None) };
    test.zero_strains(&rig);
    let spring = |size: f64| 0.1 * E / (1.0 - NU * NU) * size * (6.0 / std::f64::consts::PI).cbrt();
    let joint = 1.0 / (1.0 / spring(0.06) + 1.0 / spring(0.05));
    let stiffness = 1.0 / (2.0 / (4.0 * spring(0.06)) + 2.0 / (4.0 * joint));
    let expected = stiffness * 1e-5 * rig.height(&rig.committed.poses);
    let mut forces = [f64::NAN; 2];
    let mut steps = factorisations(&pressed);
    for (force, strain) in forces.iter_mut().zip([1e-5, -1e-5]) {
        let Some(rows) = run(&mut rig, &mut test, &drive(strain, 2e-6, Lateral::Pressure)) else {
            return Ok(None);
        };
        steps += factorisations(&rows);
        *force = rows.last().map_or(f64::NAN, |row| ram(&rig, row) / expected);
    }
    Ok(Some((forces, steps)))
}

pub(super) fn elastic(findings: &mut Findings) {
    let whatever = |found: Result<Option<([f64; 2], usize)>>| match found {
        Ok(Some((values, steps))) => (values, steps, String::new()),
        Ok(None) => ([f64::NAN; 2], 0, "a stage did not finish".into()),
        Err(error) => ([f64::NAN; 2], 0, error.to_string()),
    };
    for (strain, tall, tolerance) in [(1e-4, TALL[0], 0.01), (1e-4, TALL[1], 1e-3), (-3e-5, TALL[1], 1e-3)] {
        let (found, time) = timed(|| prism(strain, tall));
        let ([modulus, poisson], steps, note) = whatever(found);
        let cost = (steps, time, note);
        let which = format!("elastic prism {} widths tall, strained by {strain}", (tall / WIDTH).round());
        findings.compare(format!("{which}: q / E e_a"), modulus, 1.0, Relative(tolerance), cost.clone());
        let [computed, expected] = [poisson, NU].map(|nu| 1.0 - 2.0 * nu);
        findings.compare(format!("{which}: e_v / e_a"), computed, expected, Relative(tolerance), cost);
    }
    let (found, time) = timed(column);
    let ([loaded, unloaded], steps, note) = whatever(found);
    let cost = (steps, time, note);
    let what = "column of cubes, stiffness over its joints'";
    findings.compare(what, loaded, 1.0, Relative(2e-3), cost.clone());
    let what = "column of cubes, force left behind a loop";
    findings.compare(what, unloaded, 0.0, Absolute(2e-3), cost);
}
