//! Faces of rounded bodies, and how a pair of them that is nearly parallel shares a contact with its corners and edges.
//!
//! A face is a facet plane of the core moved out by the rounding, and its polygon that of the body before its edges were rounded: a
//! patch that ended a rounding before the block does could not put a uniform stress into the block. Two faces carry by
//! the patch that they share with the weight `f g`. `f` depends on the angle between them: 1 below [`FULL`], 0 from [`NONE`] on. `g` is 0 where only
//! the rims of the two overlap, which are round, and 1 where their flat parts have a half of the patch in common: of two edges tip to tip
//! the faces behind would else carry before they touch. A corner or an edge with the normal n then counts
//! `1 - f g h_a h_b`; `h_a` says how deep n lies in the cone of directions about the face's normal: 1 within half its angle, 0
//! from the cone on. Cones of one body's faces do not meet, so a contact belongs to one pair of faces at most, and it leaves no
//! pair but where `h` is zero.
//!
//! Forces are the derivatives of the energy `f g E_patch + (1 - f g h) E_contact` by the angle; what `h` and `g` do is left out: they
//! change only while a corner turns by a quarter of a radian about an edge between two parallel faces, or a face slides over another's rim.

use crate::contact::features::fade;
use crate::geometry::rounded::{HalfSpace, RoundedBody, facet_polygon};
use crate::geometry::{Polyhedron, planar};
use crate::tensor::dual::{Real, Vector};
use crate::tensor::{Pose, Vec3};
use serde::{Deserialize, Serialize};

/// Angle between two faces below which they carry by their patch alone, and from which on by corners and edges alone [rad].
pub const FULL: f64 = 3e-2;
pub const NONE: f64 = 1e-1;
/// Share of a patch that is flat on both sides from which on it carries in full.
const FLAT_SHARE: f64 = 0.5;

/// Widest cone of a face, and narrowest of one that takes part [rad].
const WIDEST: f64 = 0.5;
const NARROWEST: f64 = 0.05;
/// Facets all corners of which lie as near to a plane, over the body's size, are one face: files give nodes to some six digits, so that the
/// triangles of a flat face are planes of their own, and those along its edges lean anyhow.
pub const FLAT: f64 = 1e-5;
/// Facets of one face that lie no nearer than this are what a file's digits make of it: its plane is their mean.
const EXACT: f64 = 1e-9;

/// What two parallel faces carry by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaceContact {
    /// Their corners and crossing edges, as all other contacts do.
    #[default]
    Corners,
    /// The patch that they share.
    Area,
}

/// A face of a rounded body, in body coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    /// Outwards.
    pub normal: Vec3,
    /// Corners before edges are rounded [m], counter-clockwise from outside.
    pub ring: Vec<Vec3>,
    /// The same of what rounding leaves flat.
    flat: Vec<Vec3>,
    /// In its plane, with the normal right-handed.
    pub axes: [Vec3; 2],
    /// [m^2]
    pub area: f64,
    /// Of half the angle of its cone.
    pub cosine: f64,
    /// A point inside the body [m].
    pub inside: Vec3,
}

impl Face {
    /// The faces of a body that can share a patch: those that do not blend into another one.
    pub fn of(body: &RoundedBody) -> Vec<Face> {
        Face::all(body).into_iter().flatten().collect()
    }

    /// How many faces a body has, and how many of these blend into others and so carry by corners and edges alone.
    pub fn count(body: &RoundedBody) -> [usize; 2] {
        let all = Face::all(body);
        [all.len(), all.iter().filter(|face| face.is_none()).count()]
    }

    /// All faces; `None` for those that blend into another one.
    fn all(body: &RoundedBody) -> Vec<Option<Face>> {
        let core = &body.core;
        let size = core.bounding_radius();
        let inside = core.vertices.iter().sum::<Vec3>() / core.vertices.len() as f64;
        let (mut planes, face_of) = planes_of_faces(core);
        let half_angle = |(face, plane): (usize, &HalfSpace)| {
            let others = planes.iter().enumerate().filter(|(other, _)| *other != face);
            let nearest =
                others.map(|(_, other)| plane.normal.angle(&other.normal)).fold(f64::INFINITY, f64::min);
            let on_face = |v: usize| plane.normal.dot(&core.vertices[v]) - plane.offset > -FLAT * size;
            let mut depth: f64 = 1.0;
            // A diagonal of a neighbouring face is no edge of the body: along it the cone would be the flatter the wider the body is.
            let folds = core.edges.iter().filter(|edge| {
                let [f, g] = edge.facets;
                face_of[f] != face_of[g]
            });
            for [own, other] in folds.flat_map(|e| [e.vertices, [e.vertices[1], e.vertices[0]]]) {
                if on_face(own) && !on_face(other) {
                    let along = (core.vertices[other] - core.vertices[own]).normalize();
                    depth = depth.min(-plane.normal.dot(&along));
                }
            }
            depth.asin().min(0.5 * nearest).min(WIDEST)
        };
        let angles: Vec<f64> = planes.iter().enumerate().map(half_angle).collect();
        let flats: Vec<Vec<Vec3>> =
            (0..planes.len()).map(|index| facet_polygon(&planes, index, core.vertices[0], size)).collect();
        planes.iter_mut().for_each(|plane| plane.offset += body.radius);
        let face = |(index, angle): (usize, &f64)| {
            // Not wide enough, or not a number.
            if !(*angle >= NARROWEST) {
                return None;
            }
            let ring = facet_polygon(&planes, index, core.vertices[0], size + body.radius);
            let [first, second] = [ring.first()?, ring.get(1)?];
            let normal = planes[index].normal;
            let along = (second - first).normalize();
            let spans = |k: usize| (ring[k] - first).cross(&(ring[k + 1] - first)).dot(&normal);
            let area = 0.5 * (1..ring.len() - 1).map(spans).sum::<f64>();
            let axes = [along, normal.cross(&along)];
            let flat = flats[index].iter().map(|corner| corner + normal * body.radius).collect();
            (area > 0.0).then(|| Face { normal, axes, area, cosine: angle.cos(), inside, ring, flat })
        };
        angles.iter().enumerate().map(face).collect()
    }

    /// The point with these coordinates along the axes, from the first corner.
    pub fn point(&self, [x, y]: [f64; 2]) -> Vec3 {
        self.ring[0] + self.axes[0] * x + self.axes[1] * y
    }

    /// Coordinates along the axes of a point's projection, from the first corner.
    pub fn coordinates(&self, point: &Vec3) -> [f64; 2] {
        let arm = point - self.ring[0];
        [arm.dot(&self.axes[0]), arm.dot(&self.axes[1])]
    }
}

/// The planes of a core's faces, in the order of their first facets, and the face that each facet is a part of. A face gathers about its
/// largest facet what lies in its plane.
fn planes_of_faces(core: &Polyhedron) -> (Vec<HalfSpace>, Vec<usize>) {
    let size = core.bounding_radius();
    let corners = |facet: usize| core.facets[facet].map(|v| core.vertices[v]);
    let plane = |facet: usize| {
        let normal = core.normals[facet];
        HalfSpace { normal, offset: corners(facet).iter().map(|v| normal.dot(v)).sum::<f64>() / 3.0 }
    };
    let off = |plane: &HalfSpace, facet: usize| {
        corners(facet).iter().map(|v| (plane.normal.dot(v) - plane.offset).abs()).fold(0.0, f64::max) / size
    };
    let area = |facet: usize| {
        let [a, b, c] = corners(facet);
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    let mut order: Vec<usize> = (0..core.facets.len()).collect();
    order.sort_by(|a, b| area(*b).total_cmp(&area(*a)));
    let mut groups: Vec<(HalfSpace, Vec<usize>)> = Vec::new();
    for facet in order {
        let same = |(it, _): &(HalfSpace, Vec<usize>)| {
            it.normal.dot(&core.normals[facet]) > 0.0 && off(it, facet) < FLAT
        };
        match groups.iter_mut().find(|group| same(group)) {
            Some((_, facets)) => facets.push(facet),
            None => groups.push((plane(facet), vec![facet])),
        }
    }
    groups.iter_mut().for_each(|(_, facets)| facets.sort_unstable());
    groups.sort_by_key(|(_, facets)| facets[0]);
    let mut face_of = vec![0; core.facets.len()];
    for (face, (_, facets)) in groups.iter().enumerate() {
        facets.iter().for_each(|facet| face_of[*facet] = face);
    }
    let fitted = |(_, facets): (HalfSpace, Vec<usize>)| {
        let first = plane(facets[0]);
        if facets.iter().all(|facet| off(&first, *facet) < EXACT) {
            return first;
        }
        let normal = facets.iter().map(|facet| core.normals[*facet] * area(*facet)).sum::<Vec3>().normalize();
        let (mut moment, mut whole) = (0.0, 0.0);
        for facet in facets {
            let middle = corners(facet).iter().sum::<Vec3>() / 3.0;
            moment += area(facet) * normal.dot(&middle);
            whole += area(facet);
        }
        HalfSpace { normal, offset: moment / whole }
    };
    (groups.into_iter().map(fitted).collect(), face_of)
}

/// What a contact has to do with a pair of faces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FaceShare {
    /// It is part of their patch: weight `f g`.
    Patch { g: f64 },
    /// It is a corner or an edge; cosines of the two cones' half angles: weight `1 - f g h_a h_b`.
    Feature { g: f64, cosines: [f64; 2] },
}

/// The weight and its derivative by the spin of `a`; that by the spin of `b` is the opposite.
pub struct FaceWeight<T> {
    pub value: T,
    pub by_turn: Vector<T>,
}

impl<T: Real> FaceWeight<T> {
    /// Of a contact with this `normal` from `a` to `b` between faces with these outward normals, all in space.
    pub fn new(share: FaceShare, normals: [Vector<T>; 2], normal: Vector<T>) -> Self {
        let (f, by_turn) = facing(normals);
        match share {
            FaceShare::Patch { g } => {
                FaceWeight { value: f.scaled(g), by_turn: by_turn.times(T::constant(g)) }
            }
            FaceShare::Feature { g, cosines } => {
                let depth = |along: T, cosine: f64| {
                    // Cosine of half the angle less that of the angle.
                    let span = (0.5 * (1.0 + cosine)).sqrt() - cosine;
                    fade((along - T::constant(cosine)).scaled(1.0 / span)).0
                };
                let h =
                    depth(normal.dot(normals[0]), cosines[0]) * depth(-normal.dot(normals[1]), cosines[1]);
                let h = h.scaled(g);
                FaceWeight { value: T::constant(1.0) - f * h, by_turn: -by_turn.times(h) }
            }
        }
    }
}

/// The weight `f` of a patch between faces with these outward normals, and its derivative by the spin of the first.
fn facing<T: Real>(normals: [Vector<T>; 2]) -> (T, Vector<T>) {
    let [a, b] = normals;
    let (along, across) = (a.dot(b), a.cross(b));
    if along.value() >= 0.0 {
        return (T::constant(0.0), Vector::zero());
    }
    let [full, none] = [FULL, NONE].map(|angle: f64| angle.sin().powi(2));
    let (gone, slope) = fade((across.dot(across) - T::constant(full)).scaled(1.0 / (none - full)));
    // Squared sine |a x b|^2 by the spin of a: -2 (a.b) a x b.
    let by_turn = across.times((slope * along).scaled(2.0 / (none - full)));
    (T::constant(1.0) - gone, by_turn)
}

/// The share `g` of a patch that comes of how much of it is flat on both sides.
pub fn flat_share(faces: [&Face; 2], poses: [&Pose; 2]) -> f64 {
    let seen = |p: &Vec3| faces[1].coordinates(&poses[1].to_body(&poses[0].to_space(p)));
    let common = |rings: [&[Vec3]; 2]| {
        // Seen from outside the second face, what is counter-clockwise on the first runs clockwise.
        let first: Vec<[f64; 2]> = rings[0].iter().rev().map(seen).collect();
        let second: Vec<[f64; 2]> = rings[1].iter().map(|p| faces[1].coordinates(p)).collect();
        planar::area(&planar::common_part(&first, &second))
    };
    let whole = common(faces.map(|face| &face.ring[..]));
    if whole > 0.0 { fade(common(faces.map(|face| &face.flat[..])) / whole / FLAT_SHARE).0 } else { 0.0 }
}

/// Whether two faces look at each other, not their bodies' backs: whether either body lies in front of the other one's face.
pub fn look_at_each_other(faces: [&Face; 2], poses: [&Pose; 2]) -> bool {
    let in_front = |own: usize, other: usize| {
        let seen = poses[own].to_body(&poses[other].to_space(&faces[other].inside));
        faces[own].normal.dot(&(seen - faces[own].ring[0])) > 0.0
    };
    in_front(0, 1) && in_front(1, 0)
}

/// Whether faces with these outward normals may be parallel enough to share a patch once their bodies have turned by `turn` [rad].
pub fn may_face(a: &Vec3, b: &Vec3, turn: f64) -> bool {
    a.dot(b) < 0.0 && a.cross(b).norm() < NONE + turn
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::Rotation;

    fn count(shape: &Polyhedron, rounding: f64) -> [usize; 2] {
        Face::count(&RoundedBody::inset(shape, rounding).expect("fits"))
    }

    /// Edges between the triangles of one face are none of the body's, however flat they lie to a neighbouring face.
    #[test]
    fn boxes_of_any_proportions_have_six_faces_that_carry() {
        for size in [[0.4, 0.4, 0.3], [1.3, 1.1, 0.05], [2.0, 0.9, 6e-3], [0.01, 3.0, 0.01]] {
            let shape = Polyhedron::cuboid(size).expect("a box");
            let thinnest = size.iter().copied().fold(f64::INFINITY, f64::min);
            assert_eq!(count(&shape, 0.02 * thinnest), [6, 0], "{size:?}");
            let faces = Face::of(&RoundedBody::inset(&shape, 0.02 * thinnest).expect("fits"));
            let area: f64 = faces.iter().map(|face| face.area).sum();
            let [x, y, z] = size;
            assert!((area / (2.0 * (x * y + y * z + z * x)) - 1.0).abs() < 1e-9, "{size:?}: {area}");
        }
    }

    /// Sides that meet at less than twice the narrowest cone blend into each other.
    #[test]
    fn faces_that_blend_are_counted() {
        let prism = |sides| Polyhedron::cylinder(0.1, 0.3, sides).expect("a prism");
        assert_eq!(count(&prism(48), 1e-3), [50, 0]);
        assert_eq!(count(&prism(80), 1e-3), [82, 80]);
    }

    /// A cuboid that is turned and written with few digits, with nodes all over its faces, has six faces that carry.
    #[test]
    fn faces_are_flat_to_the_digits_of_a_file() {
        let size = [0.31, 0.23, 0.07];
        let turn = Rotation::from_scaled_axis(Vec3::new(0.4, -0.7, 0.25));
        let whole = 2.0 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0]);
        for digit in [1e-6, 1e-7] {
            let mut points = Vec::new();
            for k in 0..5 * 4 * 3 {
                let share = [(k % 5) as f64 / 4.0, (k / 5 % 4) as f64 / 3.0, (k / 20) as f64 / 2.0];
                if share.iter().any(|s| *s == 0.0 || *s == 1.0) {
                    let place = turn * Vec3::from_fn(|i, _| (share[i] - 0.5) * size[i]);
                    points.push(place.map(|x| (x / digit).round() * digit));
                }
            }
            let shape = Polyhedron::convex_hull(&points).expect("a hull");
            assert!(shape.facets.len() > 12, "{digit:e}: {} facets", shape.facets.len());
            assert_eq!(count(&shape, 2e-3), [6, 0], "{digit:e}");
            let faces = Face::of(&RoundedBody::inset(&shape, 2e-3).expect("fits"));
            let area: f64 = faces.iter().map(|face| face.area).sum();
            assert!((area / whole - 1.0).abs() < 1e3 * digit, "{digit:e}: {area} of {whole}");
            for face in &faces {
                let own = turn.inverse() * face.normal;
                // Of a face of the least width, 7 cm.
                assert!((own.amax() - 1.0).abs() < (20.0 * digit).powi(2), "{digit:e}: {own}");
            }
        }
    }
}
