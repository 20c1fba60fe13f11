//! The shape of a grain: a random convex polyhedron inscribed in a random ellipsoid.
//!
//! Source: Ma, Zhou, Chang & Zhou (2011), eqs. 1-3: semi-axes uniform in the size class, vertex count
//! uniform, vertices at a uniform polar and a uniform azimuthal angle. Added here: vertices closer
//! than a given distance on the unit sphere are drawn again (slender facets mesh badly), the convex
//! hull closes the surface, and a grain is placed in a random rotation (`placement`).
//!
//! **Sieve size.** A grain's sieve size is the intermediate diameter `2b`, `a >= b >= c`, of its
//! ellipsoid, the usual equivalent of a square sieve opening in shape studies; with the semi-axes
//! between half the class's limits it lies in the class by construction. The polyhedron itself is
//! smaller than its ellipsoid: [`square_opening`] measures the smallest square hole that it passes,
//! and the statistics report the mean ratio of the two.

use crate::error::{Error, Result};
use crate::geometry::{Polyhedron, RoundedBody};
use crate::specimen::opening::square_opening;
use crate::specimen::random::{Purpose, Stream};
use crate::tensor::{Rotation, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// How sieve sizes are drawn between two neighbouring sieves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WithinClass {
    /// Semi-axes uniform by number, as in the source: less of the mass lies below the middle of a wide class than above it.
    #[default]
    Number,
    /// So that the mass follows a straight line between the two points of the curve: sizes D with a number density as `D^-3`, ellipsoids of
    /// the source's proportions scaled to them.
    Mass,
}

impl WithinClass {
    /// Share of the mass of a class between the sieves `low` and `high` that is finer than `size`, on average.
    ///
    /// By number: three uniform semi-axes with the middle one at m have the mean product `(m^2 - l^2)(h^2 - m^2) m` over a density, a
    /// polynomial in `m^2`.
    pub fn passing(self, [low, high]: [f64; 2], size: f64) -> f64 {
        match self {
            WithinClass::Number => {
                let t = (size.powi(2) - low.powi(2)) / (high.powi(2) - low.powi(2));
                t * t * (3.0 - 2.0 * t)
            }
            WithinClass::Mass => (size - low) / (high - low),
        }
    }

    /// Mean of the product of the semi-axes of a grain between two sieves [m^3].
    fn mean_product(self, [low, high]: [f64; 2]) -> f64 {
        match self {
            WithinClass::Number => (0.25 * (low + high)).powi(3),
            // Of D^3, and of the outer two axes over the square of the middle one.
            WithinClass::Mass => 0.125 * mean_cube([low, high]) * mean_proportion(low, high),
        }
    }
}

/// Mean of `D^3` of sizes between two sieves [m^3] with a number density as `D^-3`.
fn mean_cube([low, high]: [f64; 2]) -> f64 {
    2.0 * (low * high).powi(2) / (low + high)
}

/// Steps of the integral in [`mean_proportion`], even.
const STEPS: usize = 200;

/// Mean of `a c / b^2` of three semi-axes `a >= b >= c` uniform between two limits: given b the others are uniform on either side of it. By
/// Simpson's rule over the density `6 (b - l)(h - b) / (h - l)^3` of b.
fn mean_proportion(low: f64, high: f64) -> f64 {
    let width = high - low;
    let at = |k: usize| {
        let b = low + width * k as f64 / STEPS as f64;
        let density = 6.0 * (b - low) * (high - b) / width.powi(3);
        let weight = if k == 0 || k == STEPS { 1.0 } else { [2.0, 4.0][k % 2] };
        weight * density * 0.25 * (low + b) * (b + high) / (b * b)
    };
    (0..=STEPS).map(at).sum::<f64>() * width / (3.0 * STEPS as f64)
}

/// The law of grain shapes.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeLaw {
    /// Smallest and largest number of vertices.
    pub vertices: [usize; 2],
    /// Least distance of two vertices on the unit sphere (chord); zero switches the rejection off.
    pub vertex_separation: f64,
    /// Rounding radius over sieve size.
    pub rounding: f64,
    pub within_class: WithinClass,
    /// Grains of sieve size 1, one of which a grain is, scaled; with none its corners are random.
    pub library: Vec<GrainShape>,
}

/// A grain's shape in body coordinates: origin at the centroid of the nominal polyhedron.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GrainShape {
    /// The polyhedron as generated.
    pub nominal: Polyhedron,
    /// The inset core with its rounding radius.
    pub rounded: RoundedBody,
    /// Intermediate diameter of the generating ellipsoid [m].
    pub sieve_size: f64,
    /// Index of its size class, the coarsest being 0.
    pub class: usize,
    /// Semi-axes of the generating ellipsoid [m], in body axes.
    pub semi_axes: [f64; 3],
}

impl GrainShape {
    /// A grain of given corners [m], about the centroid of their hull, of class 0. Its sieve size is the smallest square hole that it passes; its
    /// semi-axes are half its extents along its principal axes.
    ///
    /// # Errors
    /// As [`solid_hull`], and where `rounding`, over the sieve size, does not fit into it.
    pub fn of_corners(corners: &[Vec3], rounding: f64) -> Result<Self> {
        GrainShape::of_hull(&solid_hull(corners)?, rounding)
    }

    /// The same of a hull that is no plane.
    pub fn of_hull(hull: &Polyhedron, rounding: f64) -> Result<Self> {
        let nominal = hull.translated(&-hull.centroid());
        let sieve_size = square_opening(&nominal.vertices);
        let axes = nominal.second_moment().symmetric_eigen().eigenvectors;
        let mut semi_axes = [0, 1, 2].map(|k| {
            let along = || nominal.vertices.iter().map(|v| axes.column(k).dot(v));
            0.5 * (along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min))
        });
        semi_axes.sort_by(|a, b| b.total_cmp(a));
        let rounded = RoundedBody::inset(&nominal, rounding * sieve_size)?;
        Ok(GrainShape { nominal, rounded, sieve_size, class: 0, semi_axes })
    }

    /// The grain scaled about its centroid.
    pub fn scaled(&self, factor: f64) -> Self {
        GrainShape {
            nominal: self.nominal.scaled(factor),
            rounded: self.rounded.scaled(factor),
            sieve_size: self.sieve_size * factor,
            class: self.class,
            semi_axes: self.semi_axes.map(|a| a * factor),
        }
    }
}

/// Volume of a hull over the cube of its bounding radius, below which it counts as flat.
const FLAT: f64 = 1e-6;

/// The convex hull of corners [m] that do not lie in a plane.
///
/// # Errors
/// `Error::Specimen` where they do.
pub fn solid_hull(corners: &[Vec3]) -> Result<Polyhedron> {
    let hull = Polyhedron::convex_hull(corners)?;
    match hull.volume() > FLAT * hull.size().powi(3) {
        true => Ok(hull),
        false => Err(Error::Specimen("its corners lie in a plane".into())),
    }
}

/// Draws of one grain before giving up; each draw fails for a few laws in a thousand only.
const DRAWS: u64 = 200;

/// Tries of one vertex position before the whole grain is drawn again.
const VERTEX_TRIES: usize = 400;

/// The grain numbered `index` with a sieve size within `class_sizes` [m].
///
/// # Errors
/// `Error::Specimen` where the law leaves no room for its vertices or its rounding.
pub fn grain(
    law: &ShapeLaw,
    class_sizes: [f64; 2],
    class: usize,
    seed: u64,
    index: u64,
) -> Result<GrainShape> {
    let mut stream = Stream::new(seed, Purpose::Shape, index);
    if !law.library.is_empty() {
        let size = size_by_mass(&mut stream, class_sizes);
        let shape = &law.library[stream.integer(0, law.library.len() - 1)];
        return Ok(GrainShape { class, ..shape.scaled(size) });
    }
    let mut reason = String::new();
    for _ in 0..DRAWS {
        let mut semi_axes = [(); 3].map(|_| 0.5 * stream.between(class_sizes[0], class_sizes[1]));
        if law.within_class == WithinClass::Mass {
            let size = size_by_mass(&mut stream, class_sizes);
            let mut sorted = semi_axes;
            sorted.sort_by(f64::total_cmp);
            semi_axes = semi_axes.map(|axis| axis * 0.5 * size / sorted[1]);
        }
        let count = stream.integer(law.vertices[0], law.vertices[1]);
        let Some(directions) = directions(&mut stream, count, law.vertex_separation) else {
            reason = format!("{count} vertices {} apart do not fit on a sphere", law.vertex_separation);
            continue;
        };
        match inscribed(&directions, semi_axes, law.rounding, class) {
            Ok(shape) => return Ok(shape),
            Err(error) => reason = error.to_string(),
        }
    }
    Err(Error::Specimen(format!("no grain shape found in {DRAWS} draws; the last failed because {reason}")))
}

/// A sieve size with a number density as `D^-3`.
fn size_by_mass(stream: &mut Stream, class_sizes: [f64; 2]) -> f64 {
    let [fine, coarse] = class_sizes.map(|size| size.powi(-2));
    stream.between(fine, coarse).powf(-0.5)
}

/// Grains drawn to learn a law's mean volume; it is then known to about 0.5 %.
const VOLUME_SAMPLE: u64 = 2048;

/// Mean volume [m^3] of a law's grains in each of the classes between two sieves.
///
/// The hull of directions stretched by the semi-axes has the volume `a b c` times that of the hull
/// on the unit sphere, and the hull is independent of the axes, so the mean is that of their product (of independent axes `(E a)^3`) times
/// `mean_unit_volume`.
pub fn mean_volumes(classes: impl Iterator<Item = [f64; 2]>, law: &ShapeLaw) -> Result<Vec<f64>> {
    if law.library.is_empty() {
        let unit = mean_unit_volume(law)?;
        return Ok(classes.map(|sizes| unit * law.within_class.mean_product(sizes)).collect());
    }
    let volumes: f64 = law.library.iter().map(|grain| grain.nominal.volume()).sum();
    Ok(classes.map(|sizes| volumes / law.library.len() as f64 * mean_cube(sizes)).collect())
}

/// Mean volume of the hull of a law's vertices on the unit sphere.
fn mean_unit_volume(law: &ShapeLaw) -> Result<f64> {
    let volumes: Vec<f64> = (0..VOLUME_SAMPLE)
        .into_par_iter()
        .map(|k| {
            let mut stream = Stream::new(0, Purpose::Sample, k);
            for _ in 0..DRAWS {
                let count = stream.integer(law.vertices[0], law.vertices[1]);
                if let Some(directions) = directions(&mut stream, count, law.vertex_separation)
                    && let Ok(hull) = Polyhedron::convex_hull(&directions)
                {
                    return Ok(hull.volume());
                }
            }
            Err(Error::Specimen(format!(
                "vertices {} apart do not fit {} times on a sphere",
                law.vertex_separation, law.vertices[1]
            )))
        })
        .collect::<Result<_>>()?;
    Ok(volumes.iter().sum::<f64>() / volumes.len() as f64)
}

/// `count` directions no closer than `separation`, polar angle uniform (eq. 3).
fn directions(stream: &mut Stream, count: usize, separation: f64) -> Option<Vec<Vec3>> {
    let mut chosen: Vec<Vec3> = Vec::with_capacity(count);
    while chosen.len() < count {
        let free = (0..VERTEX_TRIES).find_map(|_| {
            let (polar, azimuth) = (stream.between(0.0, PI), stream.between(0.0, TAU));
            let direction = Vec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos());
            chosen.iter().all(|other| (other - direction).norm() >= separation).then_some(direction)
        })?;
        chosen.push(free);
    }
    Some(chosen)
}

/// The hull of the directions stretched to the ellipsoid, about its centroid.
fn inscribed(directions: &[Vec3], semi_axes: [f64; 3], rounding: f64, class: usize) -> Result<GrainShape> {
    let points: Vec<Vec3> = directions.iter().map(|d| d.component_mul(&Vec3::from(semi_axes))).collect();
    let hull = Polyhedron::convex_hull(&points)?;
    let nominal = hull.translated(&-hull.centroid());
    let mut sorted = semi_axes;
    sorted.sort_by(f64::total_cmp);
    let sieve_size = 2.0 * sorted[1];
    let rounded = RoundedBody::inset(&nominal, rounding * sieve_size)?;
    Ok(GrainShape { nominal, rounded, sieve_size, class, semi_axes })
}

/// Vertices of a single grain and their least distance: the defaults of specimens.
const SINGLE_VERTICES: [usize; 2] = [8, 16];
const SINGLE_SEPARATION: f64 = 0.45;

/// The nominal shape of grain number `index` of the size class between `sizes` [m], as it lies on a plate: on its lowest facet, its centroid
/// at the origin. `rounding` is over the sieve size.
///
/// # Errors
/// As [`grain`].
pub fn lying_grain(sizes: [f64; 2], rounding: f64, seed: u64, index: u64) -> Result<Polyhedron> {
    let law = ShapeLaw {
        vertices: SINGLE_VERTICES,
        vertex_separation: SINGLE_SEPARATION,
        rounding,
        within_class: WithinClass::Number,
        library: Vec::new(),
    };
    laid(&grain(&law, sizes, 0, seed, index)?.nominal)
}

/// A polyhedron turned to lie on the facet nearest to its centroid, as it would on a plate: none is more stable.
fn laid(shape: &Polyhedron) -> Result<Polyhedron> {
    let centroid = shape.centroid();
    let height = |(facet, normal): (&[usize; 3], &Vec3)| normal.dot(&(shape.vertices[facet[0]] - centroid));
    let lowest = shape.facets.iter().zip(&shape.normals).min_by(|a, b| height(*a).total_cmp(&height(*b)));
    let Some((_, normal)) = lowest else { return Ok(shape.clone()) };
    let down = -Vec3::z();
    let turn = Rotation::rotation_between(normal, &down)
        .unwrap_or_else(|| Rotation::from_scaled_axis(Vec3::new(std::f64::consts::PI, 0.0, 0.0)));
    let turned: Vec<Vec3> = shape.vertices.iter().map(|v| turn * (v - centroid)).collect();
    Polyhedron::convex_hull(&turned)
}

#[cfg(test)]
impl ShapeLaw {
    /// For tests.
    pub const SAMPLE: ShapeLaw = ShapeLaw {
        vertices: [8, 16],
        vertex_separation: 0.45,
        rounding: 0.02,
        within_class: WithinClass::Number,
        library: Vec::new(),
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grains_keep_their_law() {
        for index in 0..200 {
            let shape = grain(&ShapeLaw::SAMPLE, [0.02, 0.04], 3, 11, index).expect("a grain");
            assert!((8..=16).contains(&shape.nominal.vertices.len()));
            assert!(shape.semi_axes.iter().all(|a| (0.01..0.02).contains(a)));
            assert!((0.02..0.04).contains(&shape.sieve_size));
            assert!(shape.nominal.centroid().norm() < 1e-12);
            assert_eq!(shape.rounded.radius, 0.02 * shape.sieve_size);
            assert_eq!(shape.class, 3);
            // Vertices lie on the ellipsoid, far enough apart on the unit sphere.
            let centre = ellipsoid_centre(&shape);
            let unit: Vec<Vec3> = shape
                .nominal
                .vertices
                .iter()
                .map(|v| (v - centre).component_div(&Vec3::from(shape.semi_axes)))
                .collect();
            for (k, v) in unit.iter().enumerate() {
                assert!((v.norm() - 1.0).abs() < 1e-6);
                assert!(unit[..k].iter().all(|w| (v - w).norm() > 0.45 - 1e-6));
            }
        }
    }

    /// Least-squares centre of the axis-parallel ellipsoid through the vertices.
    fn ellipsoid_centre(shape: &GrainShape) -> Vec3 {
        let scale = Vec3::from(shape.semi_axes);
        let points: Vec<Vec3> = shape.nominal.vertices.iter().map(|v| v.component_div(&scale)).collect();
        // |p - c|^2 = 1, differences from the first are linear in c.
        let rows = points.len() - 1;
        let a = nalgebra::DMatrix::from_fn(rows, 3, |i, k| 2.0 * (points[i + 1][k] - points[0][k]));
        let b =
            nalgebra::DVector::from_fn(rows, |i, _| points[i + 1].norm_squared() - points[0].norm_squared());
        let c = a.svd(true, true).solve(&b, 1e-12).expect("a centre");
        Vec3::new(c[0], c[1], c[2]).component_mul(&scale)
    }

    #[test]
    fn mean_volume_is_that_of_many_grains() {
        let unit = mean_unit_volume(&ShapeLaw::SAMPLE).expect("a volume");
        let count = 1000;
        let sum: f64 = (0..count)
            .map(|k| grain(&ShapeLaw::SAMPLE, [2.0, 4.0], 0, 5, k).expect("a grain").nominal.volume())
            .sum();
        // The mean semi-axis is 1.5; five standard errors of both samples.
        assert!((sum / count as f64 / (unit * 1.5f64.powi(3)) - 1.0).abs() < 0.09);
    }

    #[test]
    fn law_without_room_is_refused() {
        let law = ShapeLaw { vertex_separation: 1.4, ..ShapeLaw::SAMPLE };
        assert!(grain(&law, [1.0, 2.0], 0, 1, 1).is_err());
        assert!(mean_unit_volume(&law).is_err());
    }

    #[test]
    fn laid_polyhedron_stands_on_its_lowest_facet() {
        let points = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.5], [0.0, 2.0, 0.2], [0.3, 0.4, 1.0]].map(Vec3::from);
        let shape = Polyhedron::convex_hull(&points).expect("a hull");
        let lying = laid(&shape).expect("a hull");
        assert!(lying.centroid().norm() < 1e-12 && (lying.volume() / shape.volume() - 1.0).abs() < 1e-12);
        let low = lying.vertices.iter().map(|v| v.z).fold(f64::INFINITY, f64::min);
        assert_eq!(lying.vertices.iter().filter(|v| v.z < low + 1e-12).count(), 3);
        let nearest = |shape: &Polyhedron| {
            let centroid = shape.centroid();
            let heights = shape.facets.iter().zip(&shape.normals);
            heights.map(|(f, n)| n.dot(&(shape.vertices[f[0]] - centroid))).fold(f64::INFINITY, f64::min)
        };
        assert!((nearest(&shape) + low).abs() < 1e-12);
    }
}
