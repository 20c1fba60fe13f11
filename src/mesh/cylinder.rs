//! A cylindrical membrane mesh: rings of nodes around an upright axis, every other ring turned by half a
//! step, so that the triangles are nearly equilateral.
//!
//! Units m. The axis is z, the facets are counter-clockwise seen from outside.

use crate::error::{Error, Result};
use crate::tensor::Vec3;

/// Far above any sensible membrane; keeps a wrong unit from filling the memory.
const MOST_NODES: f64 = 1e6;
/// Fewer nodes around do not make a cylinder.
const FEWEST_AROUND: f64 = 8.0;

/// Triangles on a cylinder's side, from the bottom rim to the top rim.
#[derive(Debug, Clone, PartialEq)]
pub struct CylinderMesh {
    /// Ring by ring from the bottom, the first and the last are the rims.
    pub nodes: Vec<Vec3>,
    pub facets: Vec<[usize; 3]>,
    /// Nodes in a ring.
    pub around: usize,
    pub rings: usize,
}

impl CylinderMesh {
    /// A cylinder about the z axis of `radius` [m] from `bottom` to `top` [m], with edges of about `size` [m].
    ///
    /// # Errors
    /// [`Error::Mesh`] where a length is not positive and finite, or there would be over a million nodes.
    pub fn new(radius: f64, bottom: f64, top: f64, size: f64) -> Result<Self> {
        let fail = |message: String| Error::Mesh { name: "membrane".into(), message };
        let height = top - bottom;
        for (name, length) in [("radius", radius), ("height", height), ("mesh size", size)] {
            if !(length > 0.0 && length.is_finite()) {
                return Err(fail(format!("its {name} must be a positive length, not {length} m")));
            }
        }
        let around = (std::f64::consts::TAU * radius / size).ceil().max(FEWEST_AROUND);
        // Rings of equilateral triangles are sqrt(3)/2 of an edge apart.
        let intervals = (height / (0.5 * 3f64.sqrt() * size)).ceil().max(2.0);
        let count = around * (intervals + 1.0);
        if count.is_nan() || count > MOST_NODES {
            return Err(fail(format!(
                "a mesh size of {size} m makes {count:.1e} nodes, more than {MOST_NODES:.0e}"
            )));
        }
        let (around, rings) = (around as usize, intervals as usize + 1);
        let nodes = (0..rings * around)
            .map(|node| {
                let (ring, step) = (node / around, node % around);
                let angle = std::f64::consts::TAU * (step as f64 + 0.5 * (ring % 2) as f64) / around as f64;
                let z = bottom + height * ring as f64 / intervals;
                Vec3::new(radius * angle.cos(), radius * angle.sin(), z)
            })
            .collect();
        let mut facets = Vec::with_capacity(2 * (rings - 1) * around);
        for ring in 0..rings - 1 {
            let node = |up: usize, step: usize| (ring + up) * around + step % around;
            for step in 0..around {
                let [low, low_next] = [node(0, step), node(0, step + 1)];
                let [high, high_next] = [node(1, step), node(1, step + 1)];
                if ring % 2 == 0 {
                    facets.extend([[low, low_next, high], [low_next, high_next, high]]);
                } else {
                    facets.extend([[low, low_next, high_next], [low, high_next, high]]);
                }
            }
        }
        Ok(CylinderMesh { nodes, facets, around, rings })
    }

    /// Nodes of the bottom and of the top rim, each around the axis.
    pub fn rims(&self) -> [std::ops::Range<usize>; 2] {
        [0..self.around, (self.rings - 1) * self.around..self.rings * self.around]
    }

    pub fn is_rim(&self, node: usize) -> bool {
        self.rims().iter().any(|rim| rim.contains(&node))
    }

    /// Every edge once, the smaller node first, sorted.
    pub fn edges(&self) -> Vec<[usize; 2]> {
        let mut edges: Vec<[usize; 2]> = self
            .facets
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    #[test]
    fn area_and_volume_converge_to_the_cylinders() {
        let (radius, bottom, top) = (0.1, 0.02, 0.45);
        let mut errors = vec![];
        for size in [0.02, 0.01] {
            let mesh = CylinderMesh::new(radius, bottom, top, size).expect("a mesh");
            let area: f64 = mesh
                .facets
                .iter()
                .map(|f| {
                    let [a, b, c] = f.map(|n| mesh.nodes[n]);
                    0.5 * (b - a).cross(&(c - a)).norm()
                })
                .sum();
            // Outward everywhere.
            for f in &mesh.facets {
                let [a, b, c] = f.map(|n| mesh.nodes[n]);
                let normal = (b - a).cross(&(c - a));
                assert!(normal.x * a.x + normal.y * a.y > 0.0);
            }
            errors.push(1.0 - area / (TAU * radius * (top - bottom)));
        }
        // Chords: the error falls with the square of the size; halving gives about a quarter.
        assert!(errors[0] > 0.0 && errors[0] < (PI / 31.0).powi(2), "{errors:?}");
        assert!((3.5..4.5).contains(&(errors[0] / errors[1])), "{errors:?}");
    }

    #[test]
    fn every_inner_edge_has_two_facets_and_every_rim_edge_one() {
        let mesh = CylinderMesh::new(0.1, 0.0, 0.2, 0.02).expect("a mesh");
        let mut count = std::collections::BTreeMap::<[usize; 2], usize>::new();
        for &[a, b, c] in &mesh.facets {
            for [i, j] in [[a, b], [b, c], [c, a]] {
                *count.entry([i.min(j), i.max(j)]).or_default() += 1;
            }
        }
        assert_eq!(count.keys().copied().collect::<Vec<_>>(), mesh.edges());
        for ([i, j], n) in count {
            let rim = mesh.rims().iter().any(|rim| rim.contains(&i) && rim.contains(&j));
            assert_eq!(n, if rim { 1 } else { 2 }, "{i} {j}");
        }
        // Euler: a cylinder's side has characteristic 0.
        assert_eq!(mesh.nodes.len() + mesh.facets.len(), mesh.edges().len());
    }

    #[test]
    fn edges_are_about_as_long_as_asked() {
        let size = 0.011;
        let mesh = CylinderMesh::new(0.093, 0.0, 0.41, size).expect("a mesh");
        for [a, b] in mesh.edges() {
            let length = (mesh.nodes[a] - mesh.nodes[b]).norm();
            assert!((0.8 * size..1.05 * size).contains(&length), "{length}");
        }
    }

    #[test]
    fn nonsense_is_refused() {
        for (radius, top, size) in [
            (0.0, 1.0, 0.1),
            (0.1, 0.0, 0.1),
            (0.1, 1.0, f64::NAN),
            (0.1, 1.0, -0.1),
            (f64::INFINITY, 1.0, 0.1),
            (0.1, 1.0, 1e-6),
        ] {
            assert!(CylinderMesh::new(radius, 0.0, top, size).is_err());
        }
    }
}
