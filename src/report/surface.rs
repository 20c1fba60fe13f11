//! Triangles to be seen: the outside of saved cells, whole or cut by a plane, and bodies of scenes.

use serde_json::Value;

use crate::error::Result;
use crate::geometry::Polyhedron;
use crate::results::{Reader, SavedCells};
use crate::tensor::{Pose, Rotation, Vec3};

/// A triangle with what colours it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangle {
    /// [m]; counter-clockwise from outside.
    pub corners: [Vec3; 3],
    /// Of the quantity shown, at the corners.
    pub values: [f64; 3],
    /// Number of the grain or body; below zero for plates.
    pub owner: i64,
    /// Of a cut, which is shown without light and shade.
    pub cut: bool,
}

/// What is shown of each cell.
#[derive(Debug, Clone, Copy)]
pub enum Quantity<'a> {
    Nothing,
    OnPoints(&'a [f64]),
    OnCells(&'a [f64]),
}

impl Quantity<'_> {
    fn at(&self, cell: usize, node: usize) -> f64 {
        match self {
            Quantity::Nothing => 0.0,
            Quantity::OnPoints(values) => values.get(node).copied().unwrap_or(f64::NAN),
            Quantity::OnCells(values) => values.get(cell).copied().unwrap_or(f64::NAN),
        }
    }
}

/// What stands of saved cells in a state. Cells that failed are left out, and so is the membrane.
pub struct Standing<'a> {
    cells: &'a SavedCells,
    /// Where the nodes are [m].
    pub points: Vec<Vec3>,
    /// The body that each cell is on, if it stands.
    bodies: Vec<Option<i64>>,
    /// The facets that one cell of a body alone has, each with its cell.
    outside: Vec<([usize; 3], usize)>,
}

impl<'a> Standing<'a> {
    pub fn of(reader: &Reader, cells: &'a SavedCells, state: usize) -> Result<Self> {
        let failed = reader.saved_field("CellData", "failed", state)?;
        let body = reader.saved_field("CellData", "fragment", state)?;
        let standing = |(failed, body): (&f64, &f64)| (*failed < 0.5).then_some(*body as i64);
        let bodies = failed.iter().zip(&body).map(standing).collect();
        Ok(Self::new(cells, reader.saved_points(cells, state)?, bodies))
    }

    fn new(cells: &'a SavedCells, points: Vec<Vec3>, mut bodies: Vec<Option<i64>>) -> Self {
        bodies.resize(cells.cells(), None);
        for (body, part) in bodies.iter_mut().zip(&cells.part) {
            if cells.parts.get(*part).is_some_and(|name| name == "membrane") {
                *body = None;
            }
        }
        let outside = cells.outside(|cell| bodies[cell]);
        Standing { cells, points, bodies, outside }
    }

    /// Its triangles. With `plane`, what lies in front of it (y below) is cut away and the cut is closed.
    pub fn triangles(&self, quantity: Quantity<'_>, plane: Option<f64>) -> Vec<Triangle> {
        let (cells, mut triangles) = (self.cells, Vec::new());
        let owner = |cell: usize| match cells.grain[cell] {
            grain if grain >= 0 => grain,
            _ => -1 - cells.part[cell] as i64,
        };
        for &(nodes, cell) in &self.outside {
            let triangle = Triangle {
                corners: nodes.map(|node| self.points[node]),
                values: nodes.map(|node| quantity.at(cell, node)),
                owner: owner(cell),
                cut: false,
            };
            match plane {
                // Plates hide nothing and are hollow: they stay whole.
                Some(plane) if triangle.owner >= 0 => clip(&triangle, plane, &mut triangles),
                Some(_) | None => triangles.push(triangle),
            }
        }
        let Some(plane) = plane else { return triangles };
        for cell in (0..cells.cells()).filter(|&cell| self.bodies[cell].is_some() && cells.is_solid(cell)) {
            let corner = |k: usize| {
                let node = cells.nodes(cell)[k];
                (self.points[node], quantity.at(cell, node))
            };
            close(&[0, 1, 2, 3].map(corner), plane, owner(cell), &mut triangles);
        }
        triangles
    }
}

/// A point with the value there.
type Valued = (Vec3, f64);

/// Where an edge meets the plane.
fn crossing(a: Valued, b: Valued, plane: f64) -> Valued {
    let share = (plane - a.0.y) / (b.0.y - a.0.y);
    (a.0 + (b.0 - a.0) * share, a.1 + (b.1 - a.1) * share)
}

/// What of a triangle lies behind the plane.
fn clip(triangle: &Triangle, plane: f64, into: &mut Vec<Triangle>) {
    let corners: Vec<Valued> = triangle.corners.into_iter().zip(triangle.values).collect();
    let mut kept: Vec<Valued> = Vec::with_capacity(4);
    for at in 0..3 {
        let (a, b) = (corners[at], corners[(at + 1) % 3]);
        if a.0.y >= plane {
            kept.push(a);
        }
        if (a.0.y >= plane) != (b.0.y >= plane) {
            kept.push(crossing(a, b, plane));
        }
    }
    fan(&kept, triangle.owner, false, into);
}

/// The cut through a tetrahedron, seen from the front.
fn close(corners: &[Valued; 4], plane: f64, owner: i64, into: &mut Vec<Triangle>) {
    let mut ring: Vec<Valued> = Vec::with_capacity(4);
    for a in 0..4 {
        for b in a + 1..4 {
            if (corners[a].0.y >= plane) != (corners[b].0.y >= plane) {
                ring.push(crossing(corners[a], corners[b], plane));
            }
        }
    }
    if ring.len() < 3 {
        return;
    }
    let middle = ring.iter().map(|(p, _)| p).sum::<Vec3>() / ring.len() as f64;
    // Counter-clockwise for one who looks along +y: x to the right, z upwards.
    ring.sort_by(|a, b| {
        let angle = |p: &Vec3| (p.z - middle.z).atan2(p.x - middle.x);
        angle(&a.0).total_cmp(&angle(&b.0))
    });
    fan(&ring, owner, true, into);
}

fn fan(ring: &[Valued], owner: i64, cut: bool, into: &mut Vec<Triangle>) {
    for at in 1..ring.len().saturating_sub(1) {
        let corners = [ring[0], ring[at], ring[at + 1]];
        into.push(Triangle { corners: corners.map(|c| c.0), values: corners.map(|c| c.1), owner, cut });
    }
}

/// The bodies of a scene's completed case, each at the pose that `pose` gives for its number and name. What has a mesh
/// file for its shape is left out and counted.
pub fn of_bodies(case: &Value, pose: impl Fn(&str) -> Option<Pose>) -> Result<(Vec<Triangle>, usize)> {
    let mut triangles = Vec::new();
    let mut left_out = 0;
    let bodies = case.pointer("/scene/bodies").and_then(Value::as_array);
    for (number, body) in bodies.into_iter().flatten().enumerate() {
        let name = body.get("name").and_then(Value::as_str).unwrap_or_default();
        let (Some(shape), Some(pose)) = (body.get("shape"), pose(name)) else {
            left_out += 1;
            continue;
        };
        let mut add = |corners: [Vec3; 3]| {
            let corners = corners.map(|corner| pose.to_space(&corner));
            triangles.push(Triangle { corners, values: [0.0; 3], owner: number as i64, cut: false });
        };
        let solid = if let Some(size) = shape.get("box").and_then(numbers) {
            Some(Polyhedron::cuboid(size)?)
        } else if let Some(cylinder) = shape.get("cylinder") {
            let length = |key: &str| cylinder.get(key).and_then(Value::as_f64).unwrap_or(f64::NAN);
            let sides = cylinder.get("sides").and_then(Value::as_u64).unwrap_or(0);
            Some(Polyhedron::cylinder(length("radius"), length("length"), sides as usize)?)
        } else if let Some(points) = shape.get("polyhedron").and_then(Value::as_array) {
            let points: Vec<Vec3> = points.iter().filter_map(numbers).map(Vec3::from).collect();
            Some(Polyhedron::convex_hull(&points)?)
        } else {
            None
        };
        match (solid, shape.get("sphere").and_then(Value::as_f64)) {
            (Some(solid), _) => {
                for facet in &solid.facets {
                    add(facet.map(|vertex| solid.vertices[vertex]));
                }
            }
            (None, Some(radius)) => ball(radius, &mut add),
            (None, None) => left_out += 1,
        }
    }
    Ok((triangles, left_out))
}

/// Three numbers of a list.
pub fn numbers(value: &Value) -> Option<[f64; 3]> {
    let item = |k: usize| value.get(k).and_then(Value::as_f64);
    Some([item(0)?, item(1)?, item(2)?])
}

/// A pose from a position [m] and a rotation vector [rad].
pub fn pose_of(position: [f64; 3], rotation: [f64; 3]) -> Pose {
    Pose::new(Vec3::from(position), Rotation::from_scaled_axis(Vec3::from(rotation)))
}

fn ball(radius: f64, add: &mut impl FnMut([Vec3; 3])) {
    const RINGS: usize = 24;
    let point = |ring: usize, turn: usize| {
        let polar = std::f64::consts::PI * ring as f64 / RINGS as f64;
        let around = std::f64::consts::PI * turn as f64 / RINGS as f64;
        radius * Vec3::new(polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos())
    };
    for ring in 0..RINGS {
        for turn in 0..2 * RINGS {
            let [a, b] = [point(ring, turn), point(ring, turn + 1)];
            let [c, d] = [point(ring + 1, turn), point(ring + 1, turn + 1)];
            add([a, c, d]);
            add([a, d, b]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two tetrahedra that share a face, and a plate.
    fn cells() -> SavedCells {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]];
        SavedCells {
            points: points.map(Vec3::from).to_vec(),
            types: vec![10, 10, 5],
            connectivity: vec![0, 1, 2, 3, 1, 2, 3, 4, 0, 1, 2],
            offsets: vec![0, 4, 8, 11],
            grain: vec![0, 0, -1],
            part: vec![0, 0, 1],
            parts: vec!["grains".into(), "top plate".into()],
        }
    }

    fn area(triangles: &[Triangle], keep: impl Fn(&Triangle) -> bool) -> f64 {
        let one =
            |t: &Triangle| 0.5 * (t.corners[1] - t.corners[0]).cross(&(t.corners[2] - t.corners[0])).norm();
        triangles.iter().filter(|t| keep(t)).map(one).sum()
    }

    #[test]
    fn shared_faces_are_inside() {
        let cells = cells();
        let standing = |bodies: [Option<i64>; 3]| Standing::new(&cells, cells.points.clone(), bodies.into());
        let all = standing([Some(0), Some(0), Some(-1)]).triangles(Quantity::Nothing, None);
        assert_eq!(all.len(), 7);
        assert_eq!(all.iter().filter(|t| t.owner == -2).count(), 1);
        // With one cell gone, the shared face is seen.
        let rest = standing([Some(0), None, Some(-1)]).triangles(Quantity::Nothing, None);
        assert_eq!(rest.len(), 5);
        // Outward: the faces of a closed body add up to nothing.
        let sum: Vec3 = rest
            .iter()
            .filter(|t| t.owner == 0)
            .map(|t| (t.corners[1] - t.corners[0]).cross(&(t.corners[2] - t.corners[0])))
            .sum();
        assert!(sum.norm() < 1e-15);
    }

    #[test]
    fn a_cut_is_closed() {
        let mut cells = cells();
        cells.types.truncate(1); // one tetrahedron alone
        let values: Vec<f64> = cells.points.iter().map(|p| 3.0 * p.y + p.x).collect();
        let standing = Standing::new(&cells, cells.points.clone(), vec![Some(0)]);
        let cut = standing.triangles(Quantity::OnPoints(&values), Some(0.5));
        // The section of the corner tetrahedron at y = 1/2 is a right triangle with legs of 1/2.
        assert!((area(&cut, |t| t.cut) - 0.125).abs() < 1e-12);
        assert!(cut.iter().all(|t| t.corners.iter().all(|c| c.y >= 0.5 - 1e-12)), "{cut:?}");
        for triangle in &cut {
            for (corner, value) in triangle.corners.iter().zip(triangle.values) {
                assert!((value - 3.0 * corner.y - corner.x).abs() < 1e-12, "values are linear over a cell");
            }
        }
    }

    #[test]
    fn bodies_stand_at_their_poses() {
        let case = serde_json::json!({"scene": {"bodies": [
            {"name": "a", "shape": {"box": [2.0, 2.0, 2.0]}},
            {"name": "b", "shape": {"sphere": 0.5}},
            {"name": "c", "shape": {"mesh": "c.vtu"}}
        ]}});
        let turn = std::f64::consts::FRAC_PI_4;
        let pose =
            |name: &str| Some(pose_of([if name == "b" { 5.0 } else { 0.0 }, 0.0, 0.0], [0.0, 0.0, turn]));
        let (triangles, left_out) = of_bodies(&case, pose).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(left_out, 1);
        assert!((area(&triangles, |t| t.owner == 0) - 24.0).abs() < 1e-9);
        let farthest = |owner: i64| {
            let of = triangles.iter().filter(|t| t.owner == owner).flat_map(|t| t.corners);
            of.map(|c| c.x).fold(f64::NEG_INFINITY, f64::max)
        };
        assert!((farthest(0) - 2.0_f64.sqrt()).abs() < 1e-9 && (farthest(1) - 5.5).abs() < 1e-3);
    }
}
