//! The weight of a vertex that is nearest to a vertex.
//!
//! Contacts are looked for from either body, so that two vertices which are each other's nearest point are found twice. Each of
//! the two then counts `w = 1 - g_a g_b / 2`. `g_a` says how deep the direction to the other vertex lies in the vertex's own
//! region, the cone of its facets' normals: 1 within half the angle of the largest circular cone about its axis, 0 from that cone on, so
//! that `w` is 1 where the nearest point moves on to an edge or a facet. On its boundary the force is thus what it was.

use crate::contact::features::fade;
use crate::geometry::Polyhedron;
use crate::tensor::Vec3;
use crate::tensor::dual::{Real, Vector};

/// Corners whose cone is narrower than this sine of its half angle count as part of a face.
const BLUNT: f64 = 0.1;

/// The most by which a section grows per depth: what is flatter counts as this flat.
const FLATTEST: f64 = 20.0;

/// The sum of the normals at each vertex, by the facets' angles there, so that the cut of a face into facets does not matter.
fn axes(core: &Polyhedron) -> Vec<Vec3> {
    let mut axes = vec![Vec3::zeros(); core.vertices.len()];
    for (facet, normal) in core.facets.iter().zip(&core.normals) {
        for k in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|i| core.vertices[facet[(k + i) % 3]]);
            axes[facet[k]] += normal * (b - a).angle(&(c - a));
        }
    }
    axes
}

/// Of each vertex of a convex polyhedron the radius of a circle with the area of the vertex's section, over its depth below the vertex; and of each edge the
/// tangent of half the angle between its facets. A core that is a point is a ball's: there the tangent plays no part.
pub fn section_spreads(core: &Polyhedron) -> (Vec<f64>, Vec<f64>) {
    let edges = core.edges.iter().map(|edge| {
        let [f, g] = edge.facets.map(|facet| core.normals[facet]);
        let (sine, cosine) = (f.cross(&g).norm(), f.dot(&g));
        ((1.0 + cosine) / sine.max(f64::MIN_POSITIVE)).min(FLATTEST)
    });
    let axes = axes(core);
    // Each facet at a vertex is a triangle of the section, whose corners are where its two edges come to the unit depth.
    let mut areas = vec![0.0; core.vertices.len()];
    for facet in &core.facets {
        for k in 0..3 {
            let [own, next, last] = [0, 1, 2].map(|i| facet[(k + i) % 3]);
            let inwards = -axes[own].normalize();
            let [p, q] = [next, last].map(|other| {
                let along = core.vertices[other] - core.vertices[own];
                let deep = along.dot(&inwards);
                (deep > along.norm() / (2.0 * FLATTEST)).then(|| along / deep - inwards)
            });
            areas[own] += match (p, q) {
                (Some(p), Some(q)) => 0.5 * p.cross(&q).dot(&-inwards),
                (None, _) | (_, None) => f64::INFINITY,
            };
        }
    }
    let spread = |area: &f64| {
        if core.facets.is_empty() { 1.0 } else { (area / std::f64::consts::PI).sqrt().min(FLATTEST) }
    };
    (areas.iter().map(spread).collect(), edges.collect())
}

/// The region of a vertex: a circular cone inside the cone of its facets' normals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// In body coordinates, outwards, of length 1.
    pub axis: Vec3,
    /// Of the half angle.
    pub cosine: f64,
}

impl Corner {
    /// The corner at each vertex of a convex polyhedron; `None` where it is blunt.
    pub fn of(core: &Polyhedron) -> Vec<Option<Corner>> {
        let axes = axes(core);
        let mut depth = vec![f64::INFINITY; core.vertices.len()];
        for edge in &core.edges {
            let [a, b] = edge.vertices;
            for (own, other) in [(a, b), (b, a)] {
                let along = (core.vertices[other] - core.vertices[own]).normalize();
                let axis = axes[own].normalize();
                depth[own] = depth[own].min(-axis.dot(&along));
            }
        }
        let corner = |(axis, depth): (&Vec3, &f64)| {
            let sine = depth.min(1.0);
            // A core that is a point has no edges.
            (depth.is_finite() && sine >= BLUNT)
                .then(|| Corner { axis: axis.normalize(), cosine: (1.0 - sine * sine).sqrt() })
        };
        axes.iter().zip(&depth).map(corner).collect()
    }
}

/// The weight and its derivatives, by what they are multiplied with: the direction's change, and the change of each axis.
pub struct CornerWeight<T> {
    pub value: T,
    pub by_normal: Vector<T>,
    pub by_axes: [Vector<T>; 2],
}

impl<T: Real> CornerWeight<T> {
    /// Of two vertices with these axes (in space) and cosines; `normal` points from `a` to `b`.
    pub fn new(normal: Vector<T>, axes: [Vector<T>; 2], cosines: [f64; 2]) -> Self {
        let depth = |along: T, cosine: f64| {
            // Cosine of half the angle less that of the angle.
            let span = (0.5 * (1.0 + cosine)).sqrt() - cosine;
            let (g, slope) = fade((along - T::constant(cosine)).scaled(1.0 / span));
            (g, slope.scaled(1.0 / span))
        };
        let (g_a, slope_a) = depth(normal.dot(axes[0]), cosines[0]);
        let (g_b, slope_b) = depth(-normal.dot(axes[1]), cosines[1]);
        let by_a = -(slope_a * g_b).scaled(0.5);
        let by_b = (slope_b * g_a).scaled(0.5);
        CornerWeight {
            value: T::constant(1.0) - (g_a * g_b).scaled(0.5),
            by_normal: axes[0].times(by_a) + axes[1].times(by_b),
            by_axes: [normal.times(by_a), normal.times(by_b)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corner_of_a_box_is_its_diagonal() {
        let core = Polyhedron::cuboid([1.0, 2.0, 3.0]).expect("a box");
        for (vertex, corner) in core.vertices.iter().zip(Corner::of(&core)) {
            let corner = corner.expect("sharp");
            let diagonal = vertex.map(f64::signum) / 3.0f64.sqrt();
            assert!((corner.axis - diagonal).norm() < 1e-12);
            // The cone touches the three planes between the edges: its sine is the axis's height over them.
            assert!((corner.cosine.powi(2) - 2.0 / 3.0).abs() < 1e-12);
        }
    }

    /// A cube's corner is cut in equilateral triangles of area `3 sqrt(3)/2` times the depth squared, its edges are right-angled; a ball has no corner.
    #[test]
    fn sections_of_a_box_are_known() {
        let (corners, edges) = section_spreads(&Polyhedron::cuboid([1.0, 1.0, 1.0]).expect("a box"));
        let expected = (1.5 * 3.0f64.sqrt() / std::f64::consts::PI).sqrt();
        assert!(corners.iter().all(|t| (t - expected).abs() < 1e-12), "{corners:?}");
        // Six diagonals lie within faces.
        let [sharp, flat] = [1.0, FLATTEST].map(|t| edges.iter().filter(|e| (*e - t).abs() < 1e-12).count());
        assert_eq!((sharp, flat), (12, 6));
        assert_eq!(section_spreads(&Polyhedron::point()).0, [1.0]);
    }

    #[test]
    fn weight_is_half_on_the_axis_and_one_off_the_cone() {
        let (x, y) = (Vec3::x(), Vec3::y());
        let weight = |angle: f64| {
            let normal = x * angle.cos() + y * angle.sin();
            let v = |u: &Vec3| Vector::<f64>::constant(u);
            CornerWeight::new(v(&normal), [v(&x), v(&-x)], [0.8; 2]).value
        };
        let cone = 0.8f64.acos();
        assert_eq!(weight(0.0), 0.5);
        assert_eq!(weight(0.49 * cone), 0.5);
        assert!(weight(0.7 * cone) > 0.5 && weight(0.7 * cone) < 1.0);
        assert_eq!(weight(cone), 1.0);
        assert_eq!(weight(1.5 * cone), 1.0);
    }
}
