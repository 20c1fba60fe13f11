//! Convex polyhedra with triangular facets, in body coordinates [m].

use crate::error::{Error, Result};
use crate::tensor::{Mat3, Vec3};
use serde::{Deserialize, Serialize};

/// An edge with its two end vertices and the two facets beside it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Edge {
    pub vertices: [usize; 2],
    pub facets: [usize; 2],
}

/// A middle further from the origin than so many radii about it is far.
const FAR: f64 = 10.0;

/// A closed surface of triangles, counter-clockwise seen from outside. A single vertex without
/// facets is a point: the core of a sphere.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Polyhedron {
    #[serde(with = "crate::tensor::stored")]
    pub vertices: Vec<Vec3>,
    pub facets: Vec<[usize; 3]>,
    /// Outward unit normal of each facet.
    #[serde(with = "crate::tensor::stored")]
    pub normals: Vec<Vec3>,
    /// Sorted by vertices, the smaller vertex first.
    pub edges: Vec<Edge>,
}

impl Polyhedron {
    /// Largest distance of a vertex from `point` [m].
    pub fn bounding_radius_about(&self, point: &Vec3) -> f64 {
        self.vertices.iter().map(|v| (v - point).norm()).fold(0.0, f64::max)
    }

    /// Its size: the largest distance of a vertex from the first one [m].
    pub fn size(&self) -> f64 {
        self.vertices.first().map_or(0.0, |first| self.bounding_radius_about(first))
    }

    /// A point at the origin.
    pub fn point() -> Self {
        Polyhedron { vertices: vec![Vec3::zeros()], facets: vec![], normals: vec![], edges: vec![] }
    }

    /// A box centred on the origin with full edge lengths `size` [m].
    pub fn cuboid(size: [f64; 3]) -> Result<Self> {
        let corners: Vec<Vec3> = (0..8)
            .map(|k| {
                let sign = |bit: usize| if k >> bit & 1 == 1 { 0.5 } else { -0.5 };
                Vec3::new(sign(0) * size[0], sign(1) * size[1], sign(2) * size[2])
            })
            .collect();
        let facets = vec![
            [0, 2, 1],
            [1, 2, 3],
            [4, 5, 6],
            [5, 7, 6],
            [0, 1, 4],
            [1, 5, 4],
            [2, 6, 3],
            [3, 6, 7],
            [0, 4, 2],
            [2, 4, 6],
            [1, 3, 5],
            [3, 7, 5],
        ];
        Polyhedron::from_facets(corners, facets)
    }

    /// A cylinder of `radius` and `length` [m] about the z axis through the origin, as a prism: `sides` corners on the circle, flats at its
    /// poles where their number is a multiple of four.
    pub fn cylinder(radius: f64, length: f64, sides: usize) -> Result<Self> {
        let corner = |k: usize| {
            let angle = std::f64::consts::TAU * (k as f64 + 0.5) / sides as f64;
            [-0.5, 0.5].map(|z| Vec3::new(radius * angle.cos(), radius * angle.sin(), z * length))
        };
        Polyhedron::convex_hull(&(0..sides).flat_map(corner).collect::<Vec<_>>())
    }

    /// From a closed, outward-oriented triangulation.
    pub fn from_facets(vertices: Vec<Vec3>, facets: Vec<[usize; 3]>) -> Result<Self> {
        let fail = |message: String| Error::Mesh { name: "polyhedron".into(), message };
        let mut beside = std::collections::BTreeMap::<[usize; 2], Vec<usize>>::new();
        let mut normals = Vec::with_capacity(facets.len());
        for (index, facet) in facets.iter().enumerate() {
            let [a, b, c] = facet.map(|v| vertices[v]);
            let normal = (b - a).cross(&(c - a));
            let length = normal.norm();
            if length.is_nan() || length <= 0.0 {
                return Err(fail(format!("facet {index} has no area")));
            }
            normals.push(normal / length);
            for k in 0..3 {
                let (i, j) = (facet[k], facet[(k + 1) % 3]);
                beside.entry([i.min(j), i.max(j)]).or_default().push(index);
            }
        }
        let edges = beside
            .into_iter()
            .map(|(vertices, facets)| match facets[..] {
                [f, g] => Ok(Edge { vertices, facets: [f, g] }),
                _ => Err(fail(format!("edge {vertices:?} has {} facets beside it, not two", facets.len()))),
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(Polyhedron { vertices, facets, normals, edges })
    }

    /// Enclosed volume [m^3].
    pub fn volume(&self) -> f64 {
        match self.far_middle() {
            Some(middle) => self.translated(&-middle).volume(),
            None => self.facets.iter().map(|f| self.signed_tetrahedron(f)).sum(),
        }
    }

    /// The middle of the vertices, where it is so far from the origin that tetrahedra over it would lose the volume in rounding.
    pub fn far_middle(&self) -> Option<Vec3> {
        let middle = self.vertices.iter().sum::<Vec3>() / self.vertices.len() as f64;
        let radius = self.bounding_radius_about(&middle);
        (radius > 0.0 && middle.norm() > FAR * radius).then_some(middle)
    }

    fn signed_tetrahedron(&self, facet: &[usize; 3]) -> f64 {
        let [a, b, c] = facet.map(|v| self.vertices[v]);
        a.dot(&b.cross(&c)) / 6.0
    }

    /// Surface area [m^2].
    pub fn area(&self) -> f64 {
        let area = |f: &[usize; 3]| {
            let [a, b, c] = f.map(|v| self.vertices[v]);
            0.5 * (b - a).cross(&(c - a)).norm()
        };
        self.facets.iter().map(area).sum()
    }

    /// Centre of volume [m]; the vertex itself for a point.
    pub fn centroid(&self) -> Vec3 {
        if self.facets.is_empty() {
            return self.vertices[0];
        }
        if let Some(middle) = self.far_middle() {
            return middle + self.translated(&-middle).centroid();
        }
        let mut moment = Vec3::zeros();
        for facet in &self.facets {
            let [a, b, c] = facet.map(|v| self.vertices[v]);
            moment += (a + b + c) * (0.25 * self.signed_tetrahedron(facet));
        }
        moment / self.volume()
    }

    /// Second moment of volume about the origin, `integral of x x^T dV` [m^5].
    pub fn second_moment(&self) -> Mat3 {
        let mut moment = Mat3::zeros();
        for facet in &self.facets {
            let corners = facet.map(|v| self.vertices[v]);
            let sum: Vec3 = corners.iter().sum();
            let squares: Mat3 = corners.iter().map(|p| p * p.transpose()).sum();
            moment += (squares + sum * sum.transpose()) * (self.signed_tetrahedron(facet) / 20.0);
        }
        moment
    }

    /// Largest distance of a vertex from the origin [m].
    pub fn bounding_radius(&self) -> f64 {
        self.vertices.iter().map(|v| v.norm()).fold(0.0, f64::max)
    }

    /// The polyhedron moved by `by` [m].
    pub fn translated(&self, by: &Vec3) -> Self {
        Polyhedron { vertices: self.vertices.iter().map(|v| v + by).collect(), ..self.clone() }
    }

    /// The polyhedron scaled about the origin.
    pub fn scaled(&self, factor: f64) -> Self {
        Polyhedron { vertices: self.vertices.iter().map(|v| v * factor).collect(), ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::Rotation;

    /// Tetrahedra over an origin 3 km away cancel to a thousandth of the volume. Tolerance: coordinates there are rounded to 2e-13 m of 5 cm.
    #[test]
    fn volume_and_centroid_do_not_depend_on_where_the_origin_is() {
        let points =
            [[0.0, 0.0, 0.0], [0.07, 0.01, 0.0], [0.0, 0.05, 0.01], [0.02, 0.01, 0.06], [0.05, 0.06, 0.04]];
        let near = Polyhedron::convex_hull(&points.map(Vec3::from)).expect("a hull");
        let way = Vec3::new(2137.3, -1911.7, 633.9);
        let far = near.translated(&way);
        assert!(near.far_middle().is_none() && far.far_middle().is_some());
        assert!((far.volume() / near.volume() - 1.0).abs() < 1e-9, "{} {}", far.volume(), near.volume());
        assert!((far.centroid() - way - near.centroid()).norm() < 1e-11);
    }

    #[test]
    fn cuboid_has_the_moments_of_a_box() {
        let shape = Polyhedron::cuboid([2.0, 3.0, 4.0]).expect("a box");
        assert!((shape.volume() - 24.0).abs() < 1e-12);
        assert!((shape.area() - 52.0).abs() < 1e-12);
        assert!(shape.centroid().norm() < 1e-12);
        let expected =
            Mat3::from_diagonal(&Vec3::new(24.0 * 4.0 / 12.0, 24.0 * 9.0 / 12.0, 24.0 * 16.0 / 12.0));
        assert!((shape.second_moment() - expected).norm() < 1e-10);
        assert_eq!(shape.edges.len(), 18);
    }

    #[test]
    fn cylinder_is_a_prism() {
        let shape = Polyhedron::cylinder(2.0, 3.0, 32).expect("a prism");
        let area = 16.0 * 4.0 * (std::f64::consts::TAU / 32.0).sin();
        assert!((shape.volume() / (3.0 * area) - 1.0).abs() < 1e-12);
        assert_eq!(shape.vertices.len(), 64);
        let top = shape.vertices.iter().map(|v| v.y).fold(0.0, f64::max);
        assert_eq!(
            shape.vertices.iter().filter(|v| (v.y - top).abs() < 1e-9).count(),
            4,
            "a flat at the pole"
        );
    }

    #[test]
    fn hull_drops_inner_points() {
        let mut points = Polyhedron::cuboid([1.0, 1.0, 1.0]).expect("a box").vertices;
        points.push(Vec3::new(0.1, 0.0, 0.0));
        let hull = Polyhedron::convex_hull(&points).expect("a hull");
        assert_eq!(hull.vertices.len(), 8);
        assert!((hull.volume() - 1.0).abs() < 1e-12);
    }

    /// As meshes of flat bodies have them: points within facets and on edges, turned so that none is exactly there.
    #[test]
    fn hull_of_flat_facets_full_of_points_is_the_body() {
        for turn in 0..40 {
            let turned = Rotation::from_scaled_axis(Vec3::new(0.3, 0.7, -0.2) * (0.1 * f64::from(turn)));
            let lattice =
                (0..64).map(|k| Vec3::new((k % 4) as f64, (k / 4 % 4) as f64, (k / 16) as f64) / 30.0);
            let points: Vec<Vec3> = lattice.map(|p| turned * p).collect();
            let hull = Polyhedron::convex_hull(&points).expect("a hull");
            assert!((hull.volume() / 1e-3 - 1.0).abs() < 1e-6, "turn {turn}: {}", hull.volume());
        }
    }
}
