//! Convex contact bodies for the parts of a broken grain.
//!
//! Contact works on convex bodies, parts of a grain are not convex. What stands for a part is the convex hull of its mesh, cut by
//! one plane for each other part whose hull it overlaps, so that no two bodies share volume when the grain has just come apart:
//! the two sides of a plane have nothing in common. Since the old grain was convex, no body reaches out of it either.
//!
//! **What this approximates.** A hull fills the part's notches; a cut takes material away that lies behind the plane. The plane between two parts is
//! the one of those tried that has least of their material on the wrong side; material counts at cell corners, a quarter of the cell each.

use crate::error::Result;
use crate::geometry::Polyhedron;
use crate::geometry::RoundedBody;
use crate::geometry::rounded::{HalfSpace, MOST_PLAIN, facet_planes, intersection, plain_hull};
use crate::geometry::separation::separating_axis;
use crate::mesh::Mesh;
use crate::tensor::{Mat3, Pose, Vec3};

/// A part's body for contact, in the body coordinates of the grain that broke.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactShape {
    /// The cut hull.
    pub nominal: Polyhedron,
    /// The planes between it and the other parts, those that cut it among them; outward.
    pub planes: Vec<HalfSpace>,
}

/// Deepest rounding as a share of the depth of the body below its centroid.
const MOST_OF_DEPTH: f64 = 0.5;
/// First and last turn of the search for a plane [rad].
const TURNS: [f64; 2] = [0.3, 0.01];

/// The rounded body, `radius` [m] reduced to half the least depth of the facets below the centroid where the part is thin.
pub fn rounded(nominal: &Polyhedron, radius: f64) -> Result<RoundedBody> {
    let centre = nominal.centroid();
    let depth = facet_planes(nominal)
        .iter()
        .map(|plane| plane.offset - plane.normal.dot(&centre))
        .fold(f64::INFINITY, f64::min);
    RoundedBody::inset(nominal, radius.min(MOST_OF_DEPTH * depth))
}

/// Contact shapes of the parts of one grain, in their order. A part that the planes leave nothing of (one that lies wrapped in another) has an error.
pub fn contact_shapes(parts: &[&Mesh]) -> Vec<Result<ContactShape>> {
    let hulls: Vec<Result<Polyhedron>> = parts
        .iter()
        .map(|mesh| {
            let corners = mesh.cell_ids().flat_map(|cell| mesh.cells[cell.index()][..4].to_vec());
            let corners: std::collections::BTreeSet<_> = corners.collect();
            if corners.len() > MOST_PLAIN {
                return mesh.convex_hull();
            }
            plain_hull(&corners.iter().map(|node| mesh.nodes[node.index()]).collect::<Vec<_>>())
        })
        .collect();
    let clouds: Vec<Vec<(Vec3, f64)>> = parts.iter().map(|mesh| cloud(mesh)).collect();
    let mut planes: Vec<Vec<HalfSpace>> = vec![vec![]; parts.len()];
    let mut cuts = planes.clone();
    for i in 0..parts.len() {
        for j in i + 1..parts.len() {
            let (Ok(a), Ok(b)) = (&hulls[i], &hulls[j]) else { continue };
            let axis = separating_axis(a, &Pose::identity(), b, &Pose::identity());
            let plane = if axis.gap < 0.0 {
                dividing_plane(&clouds[i], &clouds[j], &axis.direction)
            } else {
                let along = |v: &Vec3| axis.direction.dot(v);
                let end = a.vertices.iter().map(along).fold(f64::NEG_INFINITY, f64::max);
                HalfSpace { normal: axis.direction, offset: end + 0.5 * axis.gap }
            };
            let back = HalfSpace { normal: -plane.normal, offset: -plane.offset };
            for (part, plane) in [(i, plane), (j, back)] {
                planes[part].push(plane);
                if axis.gap < 0.0 {
                    cuts[part].push(plane);
                }
            }
        }
    }
    hulls
        .into_iter()
        .zip(planes.into_iter().zip(cuts))
        .map(|(hull, (planes, cuts))| {
            let hull = hull?;
            let nominal = if cuts.is_empty() { hull } else { intersection(&hull, &cuts)? };
            Ok(ContactShape { nominal, planes })
        })
        .collect()
}

/// Material at the cell corners, a quarter of the cell each [m, m^3].
fn cloud(mesh: &Mesh) -> Vec<(Vec3, f64)> {
    mesh.cell_ids()
        .flat_map(|cell| {
            let volume = 0.25 * mesh.cell_volume(cell);
            mesh.corners(cell).map(|x| (x, volume))
        })
        .collect()
}

fn mean(cloud: &[(Vec3, f64)]) -> Vec3 {
    cloud.iter().map(|(x, v)| x * *v).sum::<Vec3>() / cloud.iter().map(|(_, v)| v).sum::<f64>()
}

fn scatter(cloud: &[(Vec3, f64)]) -> Mat3 {
    let centre = mean(cloud);
    cloud.iter().map(|(x, v)| (x - centre) * (x - centre).transpose() * *v).sum()
}

/// The plane with least material on the wrong side, its normal from `a` to `b`. Tried: across the line between the
/// centroids, Fisher's (1936) discriminant, the axis of least overlap; the best is turned in shrinking steps.
fn dividing_plane(a: &[(Vec3, f64)], b: &[(Vec3, f64)], axis: &Vec3) -> HalfSpace {
    let between = mean(b) - mean(a);
    let fisher = (scatter(a) + scatter(b)).try_inverse().map_or(between, |inverse| inverse * between);
    let mut best: Option<(f64, HalfSpace)> = None;
    let consider = |normal: Vec3, best: &mut Option<(f64, HalfSpace)>| {
        let Some(normal) = normal.try_normalize(0.0) else { return false };
        let (wrong, offset) = best_offset(a, b, &normal);
        let better = best.is_none_or(|(least, _)| wrong < least);
        if better {
            *best = Some((wrong, HalfSpace { normal, offset }));
        }
        better
    };
    for normal in [*axis, between, fisher] {
        consider(normal, &mut best);
    }
    let mut turn = TURNS[0];
    while turn > TURNS[1] {
        let Some((_, HalfSpace { normal, .. })) = best else { break };
        let u = normal.cross(&Vec3::ith(normal.iamin(), 1.0)).normalize();
        let v = normal.cross(&u);
        let mut turned = false;
        for side in [u, -u, v, -v, u + v, u - v, v - u, -u - v] {
            turned |= consider(normal + side * turn, &mut best);
        }
        if !turned {
            turn *= 0.5;
        }
    }
    // Only a zero axis between coinciding centroids leaves nothing; then any plane through them is as good.
    best.map_or(HalfSpace { normal: Vec3::z(), offset: mean(a).z }, |(_, plane)| plane)
}

/// Material on the wrong side of the best plane across `normal`, and that plane's offset: half-way between neighbouring points.
fn best_offset(a: &[(Vec3, f64)], b: &[(Vec3, f64)], normal: &Vec3) -> (f64, f64) {
    let mut places: Vec<(f64, f64)> = a
        .iter()
        .map(|(x, v)| (normal.dot(x), -v))
        .chain(b.iter().map(|(x, v)| (normal.dot(x), *v)))
        .collect();
    places.sort_by(|p, q| p.0.total_cmp(&q.0));
    // With the plane below everything all of `a` is on the wrong side.
    let mut wrong: f64 = a.iter().map(|(_, v)| v).sum();
    let first = places.first().map_or(0.0, |place| place.0);
    let mut best = (wrong, first);
    for (k, place) in places.iter().enumerate() {
        wrong += place.1;
        let next = places.get(k + 1).map_or(place.0, |next| next.0);
        if next > place.0 && wrong < best.0 {
            best = (wrong, 0.5 * (place.0 + next));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{CellId, cuboid_mesh, grain_mesh};
    use crate::tensor::draws;

    fn overlap(a: &ContactShape, b: &ContactShape) -> f64 {
        separating_axis(&a.nominal, &Pose::identity(), &b.nominal, &Pose::identity()).gap
    }

    /// Volume of the hull of a part, which no other cuts.
    fn hull_volume(part: &Mesh) -> f64 {
        contact_shapes(&[part]).remove(0).expect("a shape").nominal.volume()
    }

    /// Share of a part's material behind a plane of its shape.
    fn cut_off(shape: &ContactShape, part: &Mesh) -> f64 {
        let behind = |x: &Vec3| shape.planes.iter().any(|plane| plane.normal.dot(x) > plane.offset + 1e-12);
        cloud(part).iter().filter(|(x, _)| behind(x)).map(|(_, v)| v).sum::<f64>() / part.volume()
    }

    /// The parts of a mesh by a rule.
    fn split(mesh: &Mesh, part: impl Fn(&Vec3) -> usize, count: usize) -> Vec<Mesh> {
        (0..count)
            .map(|k| {
                let cells: Vec<CellId> = mesh
                    .cell_ids()
                    .filter(|cell| part(&(mesh.corners(*cell).iter().sum::<Vec3>() * 0.25)) == k)
                    .collect();
                mesh.part(&cells).expect("a part").0
            })
            .collect()
    }

    #[test]
    fn halves_of_a_box_are_themselves() {
        let mesh = cuboid_mesh([2.0, 1.0, 1.0], 0.5).expect("a mesh");
        let parts = split(&mesh, |x| usize::from(x.x > 0.0), 2);
        let shapes = contact_shapes(&[&parts[0], &parts[1]]);
        for (shape, part) in shapes.iter().zip(&parts) {
            let shape = shape.as_ref().expect("a shape");
            assert!((shape.nominal.volume() - 1.0).abs() < 1e-9);
            assert!(cut_off(shape, part) == 0.0);
            let body = rounded(&shape.nominal, 0.05).expect("fits");
            assert!((body.core.volume() - 0.9_f64.powi(3)).abs() < 1e-9);
            // A radius that does not fit is reduced to half the depth.
            assert!((rounded(&shape.nominal, 10.0).expect("fits").radius - 0.25).abs() < 1e-9);
        }
    }

    #[test]
    fn an_angle_and_its_filling_do_not_overlap() {
        // An L and the block in its notch: the L's hull overlaps the block, the plane takes a part of each.
        let mesh = cuboid_mesh([2.0, 1.0, 2.0], 0.5).expect("a mesh");
        let parts = split(&mesh, |x| usize::from(x.x > 0.0 && x.z > 0.0), 2);
        let shapes: Vec<ContactShape> = contact_shapes(&[&parts[0], &parts[1]])
            .into_iter()
            .map(|shape| shape.expect("a shape"))
            .collect();
        // By hand: L of area 3, hull 3.5 (the notch's triangle of 1/2).
        assert!((hull_volume(&parts[0]) - 3.5).abs() < 1e-9);
        assert!((hull_volume(&parts[1]) - 1.0).abs() < 1e-9);
        assert!(overlap(&shapes[0], &shapes[1]) > -1e-9);
        let taken = shapes[0].nominal.volume() + shapes[1].nominal.volume();
        assert!(taken <= 4.0 + 1e-9 && taken > 3.0, "{taken}");
        assert!(cut_off(&shapes[0], &parts[0]) < 0.5 && cut_off(&shapes[1], &parts[1]) < 0.5);
    }

    /// A hull out of slivers, whose normals are noise, once gave rounded bodies that reached through their neighbours and had their
    /// centroid outside.
    #[test]
    fn hulls_of_crumbled_grains_hold_their_corners_and_their_cores() {
        let mut draw = draws(5);
        for _ in 0..10 {
            let points: Vec<Vec3> =
                (0..14).map(|_| Vec3::new(draw(), draw(), draw()).normalize() * 0.02).collect();
            let mesh = grain_mesh(&Polyhedron::convex_hull(&points).expect("a hull"), 38).expect("a mesh");
            // Cells go one after the other, from one side.
            let from = Vec3::new(draw(), draw(), draw());
            let mut cells: Vec<CellId> = mesh.cell_ids().collect();
            let height = |cell: &CellId| mesh.corners(*cell).iter().map(|x| from.dot(x)).sum::<f64>();
            cells.sort_by(|a, b| height(a).total_cmp(&height(b)));
            for left in (8..cells.len()).rev().step_by(3) {
                let Ok((part, _)) = mesh.part(&cells[..left]) else { continue };
                let shape = contact_shapes(&[&part]).remove(0).expect("a shape");
                let planes = facet_planes(&shape.nominal);
                let highest = |plane: &HalfSpace, points: &[Vec3]| {
                    points
                        .iter()
                        .map(|x| plane.normal.dot(x) - plane.offset)
                        .fold(f64::NEG_INFINITY, f64::max)
                };
                let corners: Vec<Vec3> = part.cell_ids().flat_map(|cell| part.corners(cell)).collect();
                let body = rounded(&shape.nominal, 4e-4).expect("a rounded body");
                for plane in &planes {
                    assert!(highest(plane, &corners).abs() < 1e-7, "{left}: {}", highest(plane, &corners));
                    assert!(highest(plane, &body.core.vertices) < 1e-6 - body.radius);
                }
            }
        }
    }

    #[test]
    fn random_parts_never_overlap_nor_leave_the_grain() {
        let mut draw = draws(11);
        let mut shapes_made = 0;
        for _ in 0..12 {
            let points: Vec<Vec3> =
                (0..14).map(|_| Vec3::new(draw(), draw(), draw()).normalize() * 0.01).collect();
            let hull = Polyhedron::convex_hull(&points).expect("a hull");
            let mesh = grain_mesh(&hull, 60).expect("a mesh");
            // Three seeds, each cell to the nearest in a wobbly metric, so that parts are ragged.
            let seeds: Vec<Vec3> = (0..3).map(|_| Vec3::new(draw(), draw(), draw()) * 0.015).collect();
            let part = |x: &Vec3| {
                let distance =
                    |s: &Vec3| (x - s).norm() * (1.0 + 0.4 * (x.x * 700.0).sin() * (x.y * 500.0).cos());
                (0..3).min_by(|i, j| distance(&seeds[*i]).total_cmp(&distance(&seeds[*j]))).unwrap_or(0)
            };
            let parts: Vec<Mesh> = (0..3)
                .filter_map(|k| {
                    let inside =
                        |cell: &CellId| part(&(mesh.corners(*cell).iter().sum::<Vec3>() * 0.25)) == k;
                    let cells: Vec<CellId> = mesh.cell_ids().filter(inside).collect();
                    if cells.is_empty() { None } else { mesh.part(&cells).ok().map(|(part, _)| part) }
                })
                .collect();
            let references: Vec<&Mesh> = parts.iter().collect();
            let made = contact_shapes(&references);
            for (shape, part) in made.iter().zip(&parts) {
                let Ok(shape) = shape else { continue };
                let (hull, own) = (hull_volume(part), part.volume());
                assert!(hull > own * (1.0 - 1e-9) && shape.nominal.volume() <= hull + 1e-9 * own);
            }
            let shapes: Vec<ContactShape> = made.into_iter().flatten().collect();
            shapes_made += shapes.len();
            for (i, a) in shapes.iter().enumerate() {
                for plane in facet_planes(&hull) {
                    assert!(a.nominal.vertices.iter().all(|v| plane.normal.dot(v) < plane.offset + 1e-9));
                }
                for b in &shapes[..i] {
                    assert!(overlap(a, b) > -1e-8, "{}", overlap(a, b));
                }
                rounded(&a.nominal, 2e-4).expect("a rounded body");
            }
        }
        assert!(shapes_made >= 24, "{shapes_made}");
    }
}
