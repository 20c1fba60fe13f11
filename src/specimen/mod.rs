//! Generated rockfill specimens: grading, shapes, placement, compaction, statistics.
//!
//! Source: Ma, Zhou, Chang & Zhou (2011), section 1, with a compaction of our own. Lengths in m. The
//! specimen stands on z = 0 with its axis on the z axis. The same parameters give the same bits on
//! any number of threads.

pub mod breakage;
pub mod compaction;
pub mod given;
pub mod grading;
pub mod opening;
pub mod placement;
pub mod random;
pub mod relaxation;
pub mod shape;
pub mod size;
pub mod statistics;

pub use compaction::VOID_RATIO_TOLERANCE;
pub use given::{GivenGrain, GivenPacking};
pub use grading::SievePoint;
pub use shape::{GrainShape, WithinClass};
pub use size::{Plan, SpecimenSize};
pub use statistics::Statistics;

use crate::error::{Error, Result};
use crate::tensor::{Pose, Vec3};
use compaction::{DialEnd, Packing};
use grading::SizeClass;
use placement::Placement;
use serde::{Deserialize, Serialize};
use shape::ShapeLaw;
use statistics::void_ratio;

/// What to do with a void ratio that the grading cannot reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
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
    /// How sieve sizes are drawn between neighbouring sieves.
    pub within_class: WithinClass,
    /// Corners of grains in any unit: every grain is one of these hulls, scaled; with none its corners are random.
    pub shapes: Vec<Vec<Vec3>>,
    /// Grains and where they are at first, in place of drawn and placed ones.
    pub packing: Option<GivenPacking>,
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
            within_class: WithinClass::Number,
            shapes: Vec::new(),
            packing: None,
            seed: 1,
        }
    }

    /// The shape law of these parameters.
    ///
    /// # Errors
    /// `Error::Specimen` naming a shape that makes no grain.
    pub fn shape_law(&self) -> Result<ShapeLaw> {
        Ok(ShapeLaw {
            vertices: self.vertices,
            vertex_separation: self.vertex_separation,
            rounding: self.rounding,
            within_class: self.within_class,
            library: given::library(&self.shapes, self.rounding)?,
        })
    }

    /// What these parameters would draw: numbers of grains per class, solid volume and size.
    ///
    /// # Errors
    /// `Error::Specimen` where the parameters are out of range.
    pub fn plan(&self) -> Result<Plan> {
        self.check()?;
        let classes = grading::size_classes(&self.grading)?;
        let volumes = grading::mean_volumes(&classes, &self.shape_law()?)?;
        let plan = size::plan(&classes, &volumes, &self.size, self.void_ratio);
        match self.size {
            SpecimenSize::Grains { count, .. } if plan.numbers.iter().sum::<usize>() != count => {
                Err(Error::Specimen(format!(
                    "{count} grains cannot fill the {} size classes of the grading",
                    classes.len()
                )))
            }
            SpecimenSize::Grains { .. } | SpecimenSize::Cylinder { .. } => Ok(plan),
        }
    }

    fn check(&self) -> Result<()> {
        let fail = |message: String| Err(Error::Specimen(message));
        if !(self.void_ratio > 0.0 && self.void_ratio <= 2.0) {
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    progress(Phase::Shapes, 0.0);
    parameters.check()?;
    let classes = grading::size_classes(&parameters.grading)?;
    let (grains, placement) = match &parameters.packing {
        Some(packing) => packing.standing(&classes, parameters.rounding)?,
        None => drawn(parameters, &classes, progress)?,
    };
    let left_alone = parameters.packing.as_ref().is_some_and(|packing| !packing.compact);

    progress(Phase::Compaction, 0.0);
    let explore = parameters.unreachable == Unreachable::Refuse;
    let packing = match left_alone {
        true => given::left_alone(placement, &grains),
        false => {
            let progress = &mut |share| progress(Phase::Compaction, share);
            compaction::compact(&grains, &placement, parameters.void_ratio, explore, progress)?
        }
    };

    progress(Phase::Relaxation, 0.0);
    let mut poses = packing.poses.clone();
    let polygon = compaction::equal_area_factor();
    let mut walls = relaxation::Walls { radius: 0.5 * packing.diameter / polygon, height: packing.height };
    let relaxation = relaxation::relax(&grains, &mut poses, &mut walls)?;
    let diameter = 2.0 * walls.radius * polygon;
    if !left_alone {
        check_void_ratio(parameters, &packing, void_ratio(&grains, diameter, walls.height))?;
    }

    let scale = match parameters.size {
        SpecimenSize::Cylinder { diameter: asked, .. } => asked / diameter,
        SpecimenSize::Grains { .. } => 1.0,
    };
    let grains: Vec<GrainShape> = grains.iter().map(|g| g.scaled(scale)).collect();
    poses.iter_mut().for_each(|p| p.position *= scale);

    progress(Phase::Statistics, 0.0);
    let size = [diameter * scale, walls.height * scale];
    let statistics = statistics::measure((&grains, &poses), size, &classes, &packing, &relaxation, scale);
    let [diameter, height] = size;
    let specimen = Specimen { grains, poses, diameter, height, statistics };
    progress(Phase::Statistics, 1.0);
    let [by_gjk, by_axes] = specimen.statistics.worst_overlap;
    if by_gjk.max(by_axes) > relaxation::OVERLAP_TOLERANCE {
        return Err(Error::Specimen(format!(
            "grains still overlap after the removal of overlaps: by {by_gjk:.1e} of their size by GJK, by \
             {by_axes:.1e} by separating axes"
        )));
    }
    Ok(specimen)
}

/// Grains of a grading, at random places and apart.
fn drawn(
    parameters: &SpecimenParameters,
    classes: &[SizeClass],
    progress: &mut dyn FnMut(Phase, f64),
) -> Result<(Vec<GrainShape>, Placement)> {
    let plan = parameters.plan()?;
    let law = parameters.shape_law()?;
    let grains = grading::draw(classes, &plan.numbers, plan.solid_volume, &law, parameters.seed)?;
    check_grading(classes, &grains)?;
    progress(Phase::Placement, 0.0);
    let placement =
        placement::place(&grains, plan.aspect * compaction::equal_area_factor(), parameters.seed)?;
    Ok((grains, placement))
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
            "$.specimen.void_ratio: {asked} cannot be reached with this grading, size and shape: compaction found \
             {reached:.3} (without friction) to {loosest:.3} (with a friction of {})",
            compaction::LARGEST_FRICTION
        ),
        DialEnd::Met => format!(
            "compaction stopped at the void ratio {asked}, but the packing came to rest at {reached:.3}"
        ),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters(size: SpecimenSize, void_ratio: f64) -> SpecimenParameters {
        let point = |size, passing| SievePoint { size, passing };
        let grading = vec![point(0.06, 1.0), point(0.04, 0.62), point(0.02, 0.0)];
        SpecimenParameters { seed: 5, ..SpecimenParameters::new(grading, size, void_ratio) }
    }

    fn on_threads(count: usize, parameters: &SpecimenParameters) -> Result<Specimen> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("a pool");
        pool.install(|| generate(parameters, &mut |_, _| ()))
    }

    #[test]
    fn small_specimen_is_sound_and_repeats_on_any_threads() {
        let size = SpecimenSize::Cylinder { diameter: 0.08, height: 0.12 };
        let parameters = parameters(size, 0.75);
        let specimen = on_threads(1, &parameters).expect("a specimen");
        let statistics = &specimen.statistics;
        assert!((30..60).contains(&specimen.grains.len()), "{}", specimen.grains.len());
        assert!((specimen.diameter - 0.08).abs() < 1e-12 && (specimen.height - 0.12).abs() < 1e-12);
        assert!((statistics.void_ratio - 0.75).abs() < VOID_RATIO_TOLERANCE, "{}", statistics.void_ratio);
        assert!((statistics.grain_scale - 1.0).abs() < 0.005);
        for class in &statistics.classes {
            assert!((class.mass_fraction[0] - class.mass_fraction[1]).abs() < GRADING_TOLERANCE);
        }
        // Both ways of measuring overlap agree that there is none.
        assert!(statistics.worst_overlap.iter().all(|o| *o <= relaxation::OVERLAP_TOLERANCE));
        assert!((statistics.worst_overlap[0] - statistics.worst_overlap[1]).abs() < 1e-7);
        assert!(statistics.coordination_number > 2.0, "{}", statistics.coordination_number);
        // 24 panels: their corners stand 0.57 % outside the circle of the same area.
        assert!(statistics.wall_protrusion < 0.006 * 0.04);
        assert!(statistics.plate_protrusion < 1e-4 * 0.02);

        let again = on_threads(2, &parameters).expect("a specimen");
        assert_eq!(specimen, again);
    }

    #[test]
    fn void_ratio_out_of_reach_is_refused_with_the_range() {
        let refused = parameters(SpecimenSize::Grains { count: 25, aspect: 1.5 }, 0.2);
        let message = on_threads(1, &refused).expect_err("out of reach").to_string();
        assert!(message.contains("without friction"), "{message}");
        assert!(message.contains("0.2 cannot be reached"), "{message}");
        let nearest = SpecimenParameters { unreachable: Unreachable::Nearest, ..refused };
        let specimen = on_threads(1, &nearest).expect("the densest specimen");
        assert_eq!(specimen.statistics.compaction_end, Some(DialEnd::Densest));
        assert_eq!(specimen.grains.len(), 25);
        assert_eq!(specimen.statistics.grain_scale, 1.0);
    }

    #[test]
    fn a_void_ratio_just_above_the_loosest_is_reached() {
        let size = SpecimenSize::Grains { count: 25, aspect: 1.5 };
        let loose = SpecimenParameters { unreachable: Unreachable::Nearest, ..parameters(size, 1.9) };
        let statistics = on_threads(1, &loose).expect("the loosest specimen").statistics;
        assert_eq!(statistics.compaction_end, Some(DialEnd::Loosest));
        let void_ratio = statistics.loosest_void_ratio + 0.8 * VOID_RATIO_TOLERANCE;
        let asked = SpecimenParameters { void_ratio, unreachable: Unreachable::Refuse, ..loose };
        let statistics = on_threads(1, &asked).expect("a specimen").statistics;
        assert_eq!(statistics.compaction_end, Some(DialEnd::Met));
        assert!((statistics.void_ratio - void_ratio).abs() <= VOID_RATIO_TOLERANCE);
    }

    #[test]
    fn parameters_out_of_range_are_refused() {
        let good = parameters(SpecimenSize::Grains { count: 25, aspect: 1.5 }, 0.6);
        // The loosest that a case may ask for.
        assert!(SpecimenParameters { void_ratio: 2.0, ..good.clone() }.plan().is_ok());
        let bad = [
            SpecimenParameters { size: SpecimenSize::Grains { count: 1, aspect: 1.0 }, ..good.clone() },
            SpecimenParameters { void_ratio: -0.1, ..good.clone() },
            SpecimenParameters { void_ratio: 2.1, ..good.clone() },
            SpecimenParameters { void_ratio: f64::NAN, ..good.clone() },
            SpecimenParameters { vertices: [3, 8], ..good.clone() },
            SpecimenParameters { vertices: [9, 8], ..good.clone() },
            SpecimenParameters { vertex_separation: 2.0, ..good.clone() },
            SpecimenParameters { rounding: 0.0, ..good.clone() },
            SpecimenParameters { size: SpecimenSize::Grains { count: 0, aspect: 1.0 }, ..good.clone() },
            SpecimenParameters { size: SpecimenSize::Cylinder { diameter: 0.1, height: -1.0 }, ..good },
        ];
        for parameters in bad {
            assert!(generate(&parameters, &mut |_, _| ()).is_err(), "{parameters:?}");
        }
    }
}
