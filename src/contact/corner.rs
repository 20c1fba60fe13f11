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
        let mut axes = vec![Vec3::zeros(); core.vertices.len()];
        for (facet, normal) in core.facets.iter().zip(&core.normals) {
            for k in 0..3 {
                let [a, b, c] = [0, 1, 2].map(|i| core.vertices[facet[(k + i) % 3]]);
                // By the facet's angle here, so that the cut of a face into facets does not matter.
                axes[facet[k]] += normal * (b - a).angle(&(c - a));
            }
        }
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
