//! Longest-edge bisection, to a number of cells or to a size that varies in space.
//!
//! Source: Rivara (1984), "Mesh refinement processes based on the generalized bisection of
//! simplices", SIAM J. Numer. Anal. 21(3):604-613; here always the globally longest edge, and all
//! cells around it at once, so that the mesh conforms after every cut.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::mesh::tetrahedra::Tetrahedra;
use crate::tensor::Vec3;

/// An edge waiting to be cut; larger measure first, then smaller point numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Candidate {
    measure: f64,
    ends: [u32; 2],
}

impl Eq for Candidate {}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.measure.total_cmp(&other.measure).then_with(|| other.ends.cmp(&self.ends))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Cuts the longest edges until the number of cells is as close to `goal` as single cuts allow. An
/// edge inside the body counts as `inner_edge` of its length.
pub(crate) fn refine_to_count(mesh: &mut Tetrahedra, goal: usize, inner_edge: f64) {
    let measure = |mesh: &Tetrahedra, a: u32, b: u32| {
        mesh.length(a, b) * if mesh.on_boundary(a, b) { 1.0 } else { inner_edge }
    };
    let mut heap = all_edges(mesh, &measure);
    while mesh.cells.len() < goal {
        let Some(longest) = heap.pop() else { break };
        let [a, b] = longest.ends;
        let gained = mesh.cells_at_edge(a, b);
        if gained == 0 {
            continue;
        }
        let after = mesh.cells.len() + gained;
        if after > goal && after - goal > goal - mesh.cells.len() {
            break;
        }
        cut(mesh, &mut heap, a, b, &measure);
    }
}

/// Cuts edges, around the relatively longest first, until none is longer than `size` at its middle or
/// there are `most` cells. Returns whether the sizes were reached.
pub(crate) fn refine_to_size(mesh: &mut Tetrahedra, size: impl Fn(&Vec3) -> f64, most: usize) -> bool {
    let measure = |mesh: &Tetrahedra, a: u32, b: u32| {
        let middle = (mesh.points[a as usize] + mesh.points[b as usize]) * 0.5;
        mesh.length(a, b) / size(&middle)
    };
    let mut heap = all_edges(mesh, &measure);
    while let Some(longest) = heap.pop() {
        if longest.measure <= 1.0 {
            return true;
        }
        let [a, b] = longest.ends;
        if mesh.cells_at_edge(a, b) == 0 {
            continue;
        }
        if mesh.cells.len() >= most {
            return false;
        }
        let [p, q] = end_of_propagation(mesh, [a, b]);
        cut(mesh, &mut heap, p, q, &measure);
        if [p, q] != [a, b] {
            heap.push(longest);
        }
    }
    true
}

/// From `edge` to the longest edge of the cells around it, and on until an edge is the longest of
/// all its cells (Rivara's longest-edge propagation path). Cutting only such edges keeps the shape
/// of the cells where the size changes quickly.
fn end_of_propagation(mesh: &Tetrahedra, edge: [u32; 2]) -> [u32; 2] {
    // Equal lengths are told apart by the point numbers, so that every step goes up.
    let rank = |ends: [u32; 2]| Candidate { measure: mesh.length(ends[0], ends[1]), ends };
    let mut best = rank(edge);
    loop {
        let here = best;
        for &cell in &mesh.around[here.ends[0] as usize] {
            let cell = &mesh.cells[cell as usize];
            if cell.contains(&here.ends[1]) {
                best = edges_of(cell).map(rank).fold(best, Ord::max);
            }
        }
        if best == here {
            return here.ends;
        }
    }
}

fn all_edges(mesh: &Tetrahedra, measure: &impl Fn(&Tetrahedra, u32, u32) -> f64) -> BinaryHeap<Candidate> {
    let mut ends: Vec<[u32; 2]> = mesh.cells.iter().flat_map(edges_of).collect();
    ends.sort_unstable();
    ends.dedup();
    ends.into_iter().map(|ends| Candidate { measure: measure(mesh, ends[0], ends[1]), ends }).collect()
}

fn edges_of(cell: &[u32; 4]) -> impl Iterator<Item = [u32; 2]> + use<> {
    let cell = *cell;
    (0..4).flat_map(move |i| (0..i).map(move |j| [cell[i].min(cell[j]), cell[i].max(cell[j])]))
}

fn cut(
    mesh: &mut Tetrahedra,
    heap: &mut BinaryHeap<Candidate>,
    a: u32,
    b: u32,
    measure: &impl Fn(&Tetrahedra, u32, u32) -> f64,
) {
    let middle = mesh.split_edge(a, b);
    let mut others: Vec<u32> = mesh.around[middle as usize]
        .iter()
        .flat_map(|&cell| mesh.cells[cell as usize])
        .filter(|&point| point != middle)
        .collect();
    others.sort_unstable();
    others.dedup();
    heap.extend(
        others
            .into_iter()
            .map(|point| Candidate { measure: measure(mesh, point, middle), ends: [point, middle] }),
    );
}
