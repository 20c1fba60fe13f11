//! The cells of a patch of two faces of which at least one is meshed.
//!
//! Over each cell the traction is uniform, and what is felt there is the mean of the displacements over it (a mortar method with constant
//! multipliers): for node i of either mesh, `s_i = integral over the cell of N_i / its area`, with the shape functions `N_i` of the facets.
//! Those are smooth on the segments that both triangulations cut the patch into, so that the three-point rule of degree 2 on each segment's
//! triangles is exact. A uniform traction goes through without disturbance, however the meshes lie on each other.
//!
//! A patch has a quarter as many cells as the coarser mesh has facets there, of about one area: with twice or half as many the force on a pile
//! of twelve polyhedra is the same to 1e-3. Each costs three unknowns of a condensed body.
//!
//! Cells are fixed to the second body. They are found once and stay until the faces have slid by [`SLID`]; what they
//! remember then goes to the nearest of the new ones.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::contact::face::Face;
use crate::contact::features::Feature;
use crate::contact::point_memory::PointMemory;
use crate::geometry::planar::common_part;
use crate::grain::{Surface, SurfacePoint};
use crate::tensor::{Pose, Vec3};

/// How far a face may slide over another before the points are found anew, over the smaller rounding.
pub const SLID: f64 = 1e-2;

/// Facets within this (angle in rad, distance over the body's size) of a face lie on it.
const ON_FACE: f64 = 1e-4;
/// Segments below this share of the face's area are rounding.
const LEAST_SEGMENT: f64 = 1e-12;

/// Facets of the coarser mesh that a cell is as large as.
const FACETS: f64 = 4.0;
/// A patch has at least so many cells, as far as it has points: with fewer it would not resist tilting.
const LEAST_CELLS: usize = 4;

/// The cells of one patch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FaceCells {
    /// Of either body, by number.
    pub faces: (u32, u32),
    pub cells: Vec<PatchCell>,
    /// Corners of the first face in the second one's axes [m] when the cells were found.
    reference: Vec<[f64; 2]>,
}

/// A part of a patch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PatchCell {
    /// Its middle in the second face's axes [m].
    pub at: [f64; 2],
    /// [m^2]
    pub area: f64,
    /// How its force goes to the nodes of either body, where that is meshed.
    pub on: [Option<SurfacePoint>; 2],
}

/// A quadrature point in the second face's axes [m] and its weight [m^2].
#[derive(Debug, Clone, Copy)]
struct Point {
    at: [f64; 2],
    area: f64,
}

type Polygon = Vec<[f64; 2]>;

impl FaceCells {
    /// The cells of two faces whose bodies are at `poses`; `surfaces` are their meshes, where they have one.
    pub fn new(
        numbers: (u32, u32),
        faces: [&Face; 2],
        poses: [&Pose; 2],
        surfaces: [Option<&Surface>; 2],
    ) -> Self {
        let seen = |p: &Vec3| faces[1].coordinates(&poses[1].to_body(&poses[0].to_space(p)));
        let reference: Polygon = faces[0].ring.iter().map(seen).collect();
        let meshed = |side: usize| -> Vec<[Vec3; 3]> {
            let face = faces[side];
            let offset = face.normal.dot(&face.ring[0]);
            surfaces[side].map_or(vec![], |surface| surface.facets_in(&face.normal, offset, ON_FACE))
        };
        let backwards = |mut polygon: Polygon| {
            polygon.reverse();
            polygon
        };
        let of_facets = |facets: Vec<[Vec3; 3]>, side: usize, ring: Polygon| -> Vec<Polygon> {
            let flat = |facet: &[Vec3; 3]| -> Polygon {
                let place = |p: &Vec3| if side == 0 { seen(p) } else { faces[1].coordinates(p) };
                facet.iter().map(place).collect()
            };
            if facets.is_empty() { vec![ring] } else { facets.iter().map(flat).collect() }
        };
        let own_ring = faces[1].ring.iter().map(|p| faces[1].coordinates(p)).collect();
        // Seen from outside the second face, what is counter-clockwise on the first runs clockwise.
        let first: Vec<Polygon> =
            of_facets(meshed(0), 0, reference.clone()).into_iter().map(backwards).collect();
        let second = of_facets(meshed(1), 1, own_ring);
        let mut points = Vec::new();
        for a in &first {
            for b in &second {
                segment_into(&mut points, a, b, LEAST_SEGMENT * faces[1].area);
            }
        }
        // Facets per area of the coarser mesh.
        let meshes = [(0, &first), (1, &second)].into_iter().filter(|(side, _)| surfaces[*side].is_some());
        let density =
            meshes.map(|(side, facets)| facets.len() as f64 / faces[side].area).fold(f64::INFINITY, f64::min);
        let area: f64 = points.iter().map(|point| point.area).sum();
        let count = (area * density / FACETS).ceil() as usize;
        let mut parts = Vec::new();
        cut_into(&mut parts, &mut points, count.max(LEAST_CELLS));
        let spread = |part: &Vec<Point>| PatchCell::new(part, faces, poses, surfaces);
        FaceCells { faces: numbers, cells: parts.iter().map(spread).collect(), reference }
    }

    pub fn feature(&self, cell: usize) -> Feature {
        Feature::Faces(self.faces.0, self.faces.1, cell as u32)
    }

    /// How far the first face has slid over the second since the cells were found [m], with the bodies at `poses`.
    pub fn slid(&self, faces: [&Face; 2], poses: [&Pose; 2]) -> f64 {
        let moved = |(p, [x, y]): (&Vec3, &[f64; 2])| {
            let [to_x, to_y] = faces[1].coordinates(&poses[1].to_body(&poses[0].to_space(p)));
            (to_x - x).hypot(to_y - y)
        };
        faces[0].ring.iter().zip(&self.reference).map(moved).fold(0.0, f64::max)
    }

    /// What its cells remember from those of the `old` ones of the same faces.
    pub fn remember(&self, old: &FaceCells, memory: &[PointMemory]) -> Vec<PointMemory> {
        let taken = |(k, cell): (usize, &PatchCell)| {
            let away = |other: &PatchCell| (other.at[0] - cell.at[0]).hypot(other.at[1] - cell.at[1]);
            let nearest =
                (0..old.cells.len()).min_by(|&i, &j| away(&old.cells[i]).total_cmp(&away(&old.cells[j])))?;
            let kept = memory.iter().find(|kept| kept.feature == old.feature(nearest))?;
            let share = cell.area / old.cells[nearest].area;
            Some(PointMemory {
                feature: self.feature(k),
                pressure: kept.pressure * share,
                load: kept.load * share,
                hardened: kept.hardened * share,
                traction: kept.traction * share,
                bound: kept.bound * share,
                tangential_energy: kept.tangential_energy * share,
                ..*kept
            })
        };
        self.cells.iter().enumerate().filter_map(taken).collect()
    }
}

/// Adds the three points of each triangle of the common part of two convex polygons that run counter-clockwise.
fn segment_into(points: &mut Vec<Point>, a: &Polygon, b: &Polygon, least: f64) {
    let apart = |axis: usize| {
        let range = |polygon: &Polygon| {
            let along = polygon.iter().map(|p| p[axis]);
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        };
        let ((low_a, high_a), (low_b, high_b)) = (range(a), range(b));
        low_a >= high_b || low_b >= high_a
    };
    if apart(0) || apart(1) {
        return;
    }
    let common = common_part(a, b);
    for k in 1..common.len().saturating_sub(1) {
        let corners = [common[0], common[k], common[k + 1]];
        let side = |i: usize, axis: usize| corners[i][axis] - corners[0][axis];
        let area = 0.5 * (side(1, 0) * side(2, 1) - side(1, 1) * side(2, 0));
        if area > least {
            for i in 0..3 {
                let at = [0, 1].map(|axis| {
                    (corners[0][axis] + corners[1][axis] + corners[2][axis] + 3.0 * corners[i][axis]) / 6.0
                });
                points.push(Point { at, area: area / 3.0 });
            }
        }
    }
}

/// Cuts points into `count` parts of about one area: across the longer side of their bounding box, again and again.
fn cut_into(parts: &mut Vec<Vec<Point>>, points: &mut [Point], count: usize) {
    if count < 2 || points.len() < 2 {
        if !points.is_empty() {
            parts.push(points.to_vec());
        }
        return;
    }
    let extent = |axis: usize| {
        let along = points.iter().map(|point| point.at[axis]);
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
    };
    let axis = usize::from(extent(1) > extent(0));
    points.sort_by(|p, q| p.at[axis].total_cmp(&q.at[axis]).then(p.at[1 - axis].total_cmp(&q.at[1 - axis])));
    let below = count / 2;
    let wanted = points.iter().map(|point| point.area).sum::<f64>() * below as f64 / count as f64;
    let mut sum = 0.0;
    let reached = points.iter().position(|point| {
        sum += point.area;
        sum >= wanted
    });
    let at = (reached.map_or(points.len(), |k| k + 1)).clamp(1, points.len() - 1);
    let (low, high) = points.split_at_mut(at);
    cut_into(parts, low, below);
    cut_into(parts, high, count - below);
}

impl PatchCell {
    /// Of these quadrature points.
    fn new(
        points: &[Point],
        faces: [&Face; 2],
        poses: [&Pose; 2],
        surfaces: [Option<&Surface>; 2],
    ) -> PatchCell {
        let area: f64 = points.iter().map(|point| point.area).sum();
        let at = [0, 1].map(|k| points.iter().map(|point| point.area * point.at[k]).sum::<f64>() / area);
        let seen = |side: usize, at: [f64; 2]| {
            let here = faces[1].point(at);
            if side == 1 { here } else { poses[0].to_body(&poses[1].to_space(&here)) }
        };
        let on = [0, 1].map(|side| {
            let surface = surfaces[side]?;
            let mut shares: BTreeMap<u32, f64> = BTreeMap::new();
            for point in points {
                for (node, share) in surface.locate(&seen(side, point.at)).shares {
                    *shares.entry(node).or_default() += share * point.area / area;
                }
            }
            Some(SurfacePoint { shares: shares.into_iter().collect(), ..surface.locate(&seen(side, at)) })
        });
        PatchCell { at, area, on }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Polyhedron, RoundedBody};
    use crate::mesh::{Mesh, cuboid_mesh};
    use crate::tensor::Rotation;

    const LOWER: [f64; 3] = [0.4, 0.3, 0.2];
    const UPPER: [f64; 3] = [0.2, 0.2, 0.2];
    /// Of the upper box over the lower one [m]; its rim stands over by 5 cm.
    const SHIFT: [f64; 2] = [0.15, 0.02];

    fn faces_of(size: [f64; 3]) -> Vec<Face> {
        let shape = Polyhedron::cuboid(size).expect("a box");
        Face::of(&RoundedBody::inset(&shape, 1e-3).expect("fits"))
    }

    fn looking(faces: &[Face], z: f64) -> &Face {
        faces.iter().find(|face| face.normal.z * z > 0.9).expect("a face that looks there")
    }

    fn meshed(size: [f64; 3], cell: f64) -> (Mesh, Surface) {
        let mesh = cuboid_mesh(size, cell).expect("a mesh");
        let surface = Surface::new(&mesh);
        (mesh, surface)
    }

    /// The upper box, turned about the vertical, on the lower one.
    fn poses(turn: f64) -> [Pose; 2] {
        let height = 0.5 * (LOWER[2] + UPPER[2]);
        let upper = Rotation::from_scaled_axis(Vec3::new(0.0, 0.0, turn));
        [Pose::identity(), Pose::new(Vec3::new(SHIFT[0], SHIFT[1], height), upper)]
    }

    /// Meshes that do not match: over all cells the shares reproduce area, centre and second moments of the common part, on either body, which
    /// quadratic shape functions can.
    #[test]
    fn shares_of_cells_are_the_integrals_of_shape_functions() {
        let (lower_faces, upper_faces) = (faces_of(LOWER), faces_of(UPPER));
        let faces = [looking(&lower_faces, 1.0), looking(&upper_faces, -1.0)];
        let (lower, upper) = (meshed(LOWER, 0.07), meshed(UPPER, 0.055));
        let poses = poses(0.0);
        let cells = FaceCells::new((0, 0), faces, [&poses[0], &poses[1]], [Some(&lower.1), Some(&upper.1)]);
        assert!(cells.cells.len() >= LEAST_CELLS);
        // The common part in the lower box's frame: up to its edge along x.
        let x = [SHIFT[0] - 0.5 * UPPER[0], 0.5 * LOWER[0]];
        let y = [SHIFT[1] - 0.5 * UPPER[1], SHIFT[1] + 0.5 * UPPER[1]];
        let power = |[low, high]: [f64; 2], n: i32| (high.powi(n + 1) - low.powi(n + 1)) / f64::from(n + 1);
        for (side, (mesh, surface)) in [&lower, &upper].into_iter().enumerate() {
            let mut sums = [0.0; 5];
            for cell in &cells.cells {
                let on = cell.on[side].as_ref().expect("meshed");
                let whole: f64 = on.shares.iter().map(|(_, share)| share).sum();
                assert!((whole - 1.0).abs() < 1e-12, "{whole}");
                for (node, share) in &on.shares {
                    let p = poses[side].to_space(&mesh.nodes[surface.nodes()[*node as usize].index()]);
                    for (sum, value) in sums.iter_mut().zip([1.0, p.x, p.y, p.x * p.x, p.x * p.y]) {
                        *sum += cell.area * share * value;
                    }
                }
            }
            let of = |m: i32, n: i32| power(x, m) * power(y, n);
            for (sum, exact) in sums.iter().zip([of(0, 0), of(1, 0), of(0, 1), of(2, 0), of(1, 1)]) {
                assert!((sum - exact).abs() < 1e-12, "side {side}: {sums:?}");
            }
        }
    }

    #[test]
    fn finer_meshes_have_more_cells_of_about_one_area() {
        let (lower_faces, upper_faces) = (faces_of(LOWER), faces_of(UPPER));
        let faces = [looking(&lower_faces, 1.0), looking(&upper_faces, -1.0)];
        let poses = poses(0.3);
        let mut last = 0;
        for cell in [0.1, 0.05, 0.025] {
            let (_, surface) = meshed(UPPER, cell);
            let found = FaceCells::new((0, 0), faces, [&poses[0], &poses[1]], [None, Some(&surface)]).cells;
            assert!(found.len() > last, "{} cells of {cell}", found.len());
            assert!(found.iter().all(|cell| cell.on[0].is_none() && cell.on[1].is_some()));
            let areas = || found.iter().map(|cell| cell.area);
            let mean = areas().sum::<f64>() / found.len() as f64;
            assert!(
                areas().all(|area| area > 0.5 * mean && area < 2.0 * mean),
                "{:?}",
                areas().collect::<Vec<_>>()
            );
            last = found.len();
        }
    }

    #[test]
    fn cells_remember_by_area_what_lay_nearest() {
        let (lower_faces, upper_faces) = (faces_of(LOWER), faces_of(UPPER));
        let faces = [looking(&lower_faces, 1.0), looking(&upper_faces, -1.0)];
        let poses = poses(0.0);
        let of = |cell: f64| {
            let (_, surface) = meshed(UPPER, cell);
            FaceCells::new((0, 0), faces, [&poses[0], &poses[1]], [None, Some(&surface)])
        };
        let (coarse, fine) = (of(0.1), of(0.04));
        let memory = |cells: &FaceCells| -> Vec<PointMemory> {
            let of_cell = |(k, cell): (usize, &PatchCell)| PointMemory {
                pressure: 3.0 * cell.area,
                load: 3.0 * cell.area,
                ..PointMemory::open(cells.feature(k), 0.0)
            };
            cells.cells.iter().enumerate().map(of_cell).collect()
        };
        let kept = fine.remember(&coarse, &memory(&coarse));
        assert_eq!(kept.len(), fine.cells.len());
        for (point, cell) in kept.iter().zip(&fine.cells) {
            assert!((point.pressure / (3.0 * cell.area) - 1.0).abs() < 1e-12);
        }
    }
}
