//! A cylindrical membrane mesh: rings of nodes around an upright axis, every other ring turned by half a
//! step, so that the triangles are nearly equilateral. Parts of it can be refined; the rims stay as they are.
//!
//! Units m. The axis is z, the facets are counter-clockwise seen from outside.

use std::collections::BTreeMap;

use crate::error::{Error, Result};
use crate::tensor::Vec3;

/// Far above any sensible membrane; keeps a wrong unit from filling the memory.
const MOST_NODES: f64 = 1e6;
/// Fewer nodes around do not make a cylinder.
const FEWEST_AROUND: f64 = 8.0;

/// Triangles on a cylinder's side, from the bottom rim to the top rim.
#[derive(Debug, Clone, PartialEq)]
pub struct CylinderMesh {
    /// Ring by ring from the bottom, the first and the last are the rims; then those of refinements.
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

    /// The mesh with the `marked` facets cut into four, those beside them into two, so that no node hangs on an edge. A facet of
    /// which two edges are cut is cut into four as well, so that triangles get slimmer by one halving a time at most; at
    /// the rims, whose edges are never cut, into three. New nodes lie in the middle of edges: the unstrained sheet stays where it was.
    pub fn refined(&self, marked: impl Fn(&[usize; 3]) -> bool) -> Self {
        let edges =
            |f: &[usize; 3]| [[f[0], f[1]], [f[1], f[2]], [f[2], f[0]]].map(|[i, j]| [i.min(j), i.max(j)]);
        let on_rim =
            |&[i, j]: &[usize; 2]| self.rims().iter().any(|rim| rim.contains(&i) && rim.contains(&j));
        let mut cut = BTreeMap::<[usize; 2], usize>::new();
        let all = |cut: &mut BTreeMap<[usize; 2], usize>, facet: &[usize; 3]| {
            for edge in edges(facet).into_iter().filter(|edge| !on_rim(edge)) {
                cut.entry(edge).or_insert(0);
            }
        };
        self.facets.iter().filter(|facet| marked(facet)).for_each(|facet| all(&mut cut, facet));
        loop {
            let before = cut.len();
            for facet in &self.facets {
                if edges(facet).iter().filter(|edge| cut.contains_key(*edge)).count() == 2 {
                    all(&mut cut, facet);
                }
            }
            if cut.len() == before {
                break;
            }
        }
        let mut nodes = self.nodes.clone();
        for (&[i, j], middle) in &mut cut {
            *middle = nodes.len();
            nodes.push(0.5 * (self.nodes[i] + self.nodes[j]));
        }
        let mut facets = Vec::with_capacity(self.facets.len() + 2 * cut.len());
        for facet in &self.facets {
            let middles = edges(facet).map(|edge| cut.get(&edge).copied());
            // Turned so that the edge between the first two is cut where one is, and the last is not where two are.
            let turn = match middles {
                [Some(_), _, None] | [Some(_), Some(_), Some(_)] | [None, None, None] => 0,
                [None, Some(_), _] => 1,
                [_, None, Some(_)] => 2,
            };
            let at = |k: usize| (k + turn) % 3;
            let ([a, b, c], middles) =
                ([facet[at(0)], facet[at(1)], facet[at(2)]], [0, 1, 2].map(|k| middles[at(k)]));
            match middles {
                [Some(p), Some(q), Some(r)] => facets.extend([[a, p, r], [p, b, q], [q, c, r], [p, q, r]]),
                [Some(p), Some(q), None] => {
                    facets.push([p, b, q]);
                    let length = |i: usize, j: usize| (nodes[i] - nodes[j]).norm();
                    if length(a, q) < length(p, c) {
                        facets.extend([[a, p, q], [a, q, c]]);
                    } else {
                        facets.extend([[a, p, c], [p, q, c]]);
                    }
                }
                [Some(p), None, None] => facets.extend([[a, p, c], [p, b, c]]),
                [None, ..] | [Some(_), None, Some(_)] => facets.push([a, b, c]),
            }
        }
        CylinderMesh { nodes, facets, ..*self }
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

    /// Whatever is marked: no node hangs, the area and the rims stay, and no triangle has less than a quarter of the one that it was
    /// cut from under no longer an edge.
    #[test]
    fn refined_parts_conform() {
        let base = CylinderMesh::new(0.1, 0.0, 0.2, 0.02).expect("a mesh");
        let area = |mesh: &CylinderMesh| -> f64 {
            let corners = |f: &[usize; 3]| f.map(|n| mesh.nodes[n]);
            mesh.facets.iter().map(corners).map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm()).sum()
        };
        // Height over the longest edge, as of a quality.
        let slimmest = |mesh: &CylinderMesh| {
            let of = |f: &[usize; 3]| {
                let [a, b, c] = f.map(|n| mesh.nodes[n]);
                let longest =
                    [(b - a).norm(), (c - b).norm(), (a - c).norm()].into_iter().fold(0.0, f64::max);
                (b - a).cross(&(c - a)).norm() / (longest * longest)
            };
            mesh.facets.iter().map(of).fold(f64::INFINITY, f64::min)
        };
        for seed in 0..6usize {
            let mut mesh = base.clone();
            for level in 1..=2 {
                let marked = |f: &[usize; 3]| (f[0] + 3 * f[1] + 7 * f[2] + seed).is_multiple_of(4 + seed);
                let finer = mesh.refined(marked);
                assert!(finer.nodes.len() > mesh.nodes.len());
                assert_eq!(finer.rims(), base.rims());
                assert!((area(&finer) / area(&base) - 1.0).abs() < 1e-12);
                let edges = finer.edges();
                assert_eq!(finer.nodes.len() + finer.facets.len(), edges.len());
                let mut along = std::collections::BTreeSet::new();
                for &[a, b, c] in &finer.facets {
                    for edge in [[a, b], [b, c], [c, a]] {
                        assert!(along.insert(edge), "{edge:?} is run along twice");
                    }
                }
                for [i, j] in edges {
                    let both = along.contains(&[i, j]) && along.contains(&[j, i]);
                    let rim = finer.rims().iter().any(|rim| rim.contains(&i) && rim.contains(&j));
                    assert_eq!(both, !rim, "{i} {j}");
                }
                assert!(slimmest(&finer) > 0.249 * slimmest(&mesh), "level {level}");
                mesh = finer;
            }
        }
        assert_eq!(base.refined(|_| false), base);
        // All but the rims' edges: four times as many, but for three at the rims.
        let all = base.refined(|_| true);
        assert_eq!(all.facets.len(), 4 * base.facets.len() - 2 * base.around);
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
