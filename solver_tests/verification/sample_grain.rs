//! A grain for the rungs: ten corners, uneven, centred on its centroid.

use riprap::geometry::Polyhedron;
use riprap::tensor::Vec3;

/// Stretched along z to `top` and `-bottom` [mm].
pub fn sample_grain([top, bottom]: [f64; 2]) -> Polyhedron {
    let points = [
        [11.0, 1.0, 2.0],
        [-8.0, 3.0, -1.0],
        [1.0, 11.0, 3.0],
        [2.0, -10.0, 1.0],
        [0.0, 2.0, top],
        [-1.0, 1.0, -bottom],
        [7.0, 6.0, -6.0],
        [-6.0, -6.0, 7.0],
        [6.0, -5.0, -7.0],
        [-5.0, 7.0, 6.0],
    ]
    .map(|p| Vec3::from(p) * 1e-3);
    let hull = Polyhedron::convex_hull(&points).expect("a hull");
    hull.translated(&-hull.centroid())
}
