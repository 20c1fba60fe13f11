//! Generated rockfill specimens: grading, shapes, placement, compaction, statistics.
//!
//! Source: Ma, Zhou, Chang & Zhou (2011), section 1, with a compaction of our own. Lengths in m. The
//! specimen stands on z = 0 with its axis on the z axis. The same parameters give the same bits on
//! any number of threads.

pub mod compaction;
mod engine_contacts;
pub mod grading;
pub mod placement;
pub mod random;
pub mod relaxation;
pub mod shape;
pub mod size;
pub mod statistics;

pub use grading::SievePoint;
pub use shape::GrainShape;
pub use size::SpecimenSize;
pub use statistics::Statistics;

use crate::error::{Error, Result};
use crate::tensor::Pose;
use compaction::{DialEnd, Packing};
use grading::SizeClass;
use shape::ShapeLaw;

/// What to do with a void ratio that the grading cannot reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unreachable {
    /// An error that states the reachable range.
    Refuse,
    /// The densest or loosest packing instead; the statistics show the difference.
    Nearest,
}

/// Everything that a specimen follows from.
#[derive(Debug, Clone, PartialEq)]
pub struct SpecimenParameters {
    /// Grading curve: sieve sizes and the mass fraction passing each, in any order.
    pub grading: Vec<SievePoint>,
    /// Size of the specimen, or its number of grains.
    pub size: SpecimenSize,
    /// Volume of voids over volume of solids after compaction, met to [`VOID_RATIO_TOLERANCE`].
    pub void_ratio: f64,
    /// What to do where that cannot be reached.
    pub unreachable: Unreachable,
    /// Smallest and largest number of vertices of a grain.
    pub vertices: [usize; 2],
    /// Least distance of two vertices on the unit sphere; zero switches the rejection off.
    pub vertex_separation: f64,
    /// Rounding radius of a grain over its sieve size.
    pub rounding: f64,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl SpecimenParameters {
    /// The defaults for a grading, size and void ratio: 8 to 16 vertices no closer than 0.45, rounding
    /// 2 %, seed 1.
    pub fn new(grading: Vec<SievePoint>, size: SpecimenSize, void_ratio: f64) -> Self {
        SpecimenParameters {
            grading,
            size,
            void_ratio,
            unreachable: Unreachable::Refuse,
            vertices: [8, 16],
            vertex_separation: 0.45,
            rounding: 0.02,
            seed: 1,
        }
    }

    /// The shape law of these parameters.
    pub fn shape_law(&self) -> ShapeLaw {
        ShapeLaw {
            vertices: self.vertices,
            vertex_separation: self.vertex_separation,
            rounding: self.rounding,
        }
    }

    fn check(&self) -> Result<()> {
        let fail = |message: String| Err(Error::Specimen(message));
        if !(self.void_ratio > 0.0 && self.void_ratio < 2.0) {
            return fail(format!("a void ratio of {} is not between 0 and 2", self.void_ratio));
        }
        let [low, high] = self.vertices;
        if !(4..=64).contains(&low) || !(low..=64).contains(&high) {
            return fail(format!("{low} to {high} vertices are not between 4 and 64"));
        }
        if !(0.0..1.5).contains(&self.vertex_separation) {
            return fail(format!("a vertex separation of {} is not below 1.5", self.vertex_separation));
        }
        if !(0.001..=0.1).contains(&self.rounding) {
            return fail(format!("a rounding of {} is not between 0.001 and 0.1", self.rounding));
        }
        self.size.check()
    }
}

/// The void ratio reached may differ from the one asked by this.
pub const VOID_RATIO_TOLERANCE: f64 = 0.01;

/// A class's mass fraction may differ from its share in the grading by this.
pub const GRADING_TOLERANCE: f64 = 0.01;

/// The stages of a generation, for progress reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    Shapes,
    Placement,
    Compaction,
    Relaxation,
    Statistics,
}

/// A compacted specimen.
#[derive(Debug, Clone, PartialEq)]
pub struct Specimen {
    /// Shapes, coarsest class first.
    pub grains: Vec<GrainShape>,
    /// Where each grain's centroid is and how it is turned.
    pub poses: Vec<Pose>,
    /// Diameter [m] of the circle with the area of the compaction wall's polygon.
    pub diameter: f64,
    /// Height [m].
    pub height: f64,
    pub statistics: Statistics,
}

/// Generates a specimen; `progress` hears the phase and its share done.
///
/// # Errors
/// `Error::Specimen` where the parameters are out of range, the grading cannot be met with so few
/// grains, the void ratio is out of reach (with the range), or compaction fails.
pub fn generate(parameters: &SpecimenParameters, progress: &mut dyn FnMut(Phase, f64)) -> Result<Specimen> {
    parameters.check()?;
    let law = parameters.shape_law();
    let classes = grading::size_classes(&parameters.grading)?;

    progress(Phase::Shapes, 0.0);
    let volumes = grading::mean_volumes(&classes, &law)?;
    let plan = size::plan(&classes, &volumes, &parameters.size, parameters.void_ratio);
    let grains = grading::draw(&classes, &plan.numbers, plan.solid_volume, &law, parameters.seed)?;
    check_grading(&classes, &grains)?;

    progress(Phase::Placement, 0.0);
    let aspect = plan.aspect * compaction::equal_area_factor();
    let placement = placement::place(&grains, aspect, parameters.seed)?;

    progress(Phase::Compaction, 0.0);
    let explore = parameters.unreachable == Unreachable::Refuse;
    let packing = compaction::compact(&grains, &placement, parameters.void_ratio, explore, &mut |share| {
        progress(Phase::Compaction, share)
    })?;

    progress(Phase::Relaxation, 0.0);
    let mut poses = packing.poses.clone();
    let polygon = compaction::equal_area_factor();
    let mut walls = relaxation::Walls { radius: 0.5 * packing.diameter / polygon, height: packing.height };
    let relaxation = relaxation::relax(&grains, &mut poses, &mut walls)?;
    let diameter = 2.0 * walls.radius * polygon;
    check_void_ratio(parameters, &packing, void_ratio(&grains, diameter, walls.height))?;

    let scale = match parameters.size {
        SpecimenSize::Cylinder { diameter: asked, .. } => asked / diameter,
        SpecimenSize::Grains { .. } => 1.0,
    };
    let grains: Vec<GrainShape> = grains.iter().map(|g| g.scaled(scale)).collect();
    poses.iter_mut().for_each(|p| p.position *= scale);

    progress(Phase::Statistics, 0.0);
    let mut specimen = Specimen {
        grains,
        poses,
        diameter: diameter * scale,
        height: walls.height * scale,
        statistics: Statistics::default(),
    };
    specimen.statistics = statistics::measure(&specimen, &classes, &packing, &relaxation, scale);
    progress(Phase::Statistics, 1.0);
    Ok(specimen)
}

/// Volume of voids over volume of the nominal grains in a cylinder [m].
fn void_ratio(grains: &[GrainShape], diameter: f64, height: f64) -> f64 {
    let solid: f64 = grains.iter().map(|g| g.nominal.volume()).sum();
    placement::cylinder_volume(diameter, height) / solid - 1.0
}

fn check_grading(classes: &[SizeClass], grains: &[GrainShape]) -> Result<()> {
    let achieved = grading::mass_fractions(classes.len(), grains);
    for (class, achieved) in classes.iter().zip(achieved) {
        if (achieved - class.mass_fraction).abs() > GRADING_TOLERANCE {
            return Err(Error::Specimen(format!(
                "{} grains are too few for the grading: grains of {} to {} m make up {:.1} % of the mass \
                 instead of {:.1} %",
                grains.len(),
                class.sizes[0],
                class.sizes[1],
                100.0 * achieved,
                100.0 * class.mass_fraction
            )));
        }
    }
    Ok(())
}

fn check_void_ratio(parameters: &SpecimenParameters, packing: &Packing, reached: f64) -> Result<()> {
    let asked = parameters.void_ratio;
    if parameters.unreachable == Unreachable::Nearest || (reached - asked).abs() <= VOID_RATIO_TOLERANCE {
        return Ok(());
    }
    let loosest = packing.loosest;
    Err(Error::Specimen(match packing.end {
        DialEnd::Loosest | DialEnd::Densest => format!(
            "a void ratio of {asked} cannot be reached with this grading, size and shape: compaction found \
             {reached:.3} (without friction) to {loosest:.3} (with a friction of {})",
            compaction::LARGEST_FRICTION
        ),
        DialEnd::Met => format!(
            "compaction stopped at the void ratio {asked}, but the packing came to rest at {reached:.3}"
        ),
    }))
}
