//! The convex hull of the points of a surface or mesh file, as a polyhedron of few vertices.

use std::path::Path;

use serde_json::{Value, json};

use crate::error::Fault;
use crate::geometry::Polyhedron;
use crate::mesh::formats;
use crate::quantity::Dimension;
use crate::tensor::Vec3;

use super::super::form::Form;
use super::super::walk::shown;
use super::words::{HULL, Notes, walked};

const OF_FILE: &str = "a .stl, .obj, .ply, .msh or .vtu file, its path relative to the case file";
const OF_ONE: &str = "a file of one body, as riprap export --stl writes beside it";

/// The shape `{"polyhedron": …}` in place of `{"hull": …}` at `path`.
pub fn shape(given: &Value, path: &str, folder: &Path) -> Result<(Value, Notes), Fault> {
    let path = format!("{path}.hull");
    if given.as_object().is_some_and(|keys| keys.len() > 1) {
        return Err(Fault::new(path, shown(&given["hull"]), "stands beside another shape", "one shape"));
    }
    let hull = walked(&Form::Object(HULL), &given["hull"], &path)?;
    let file = hull["file"].as_str().unwrap_or_default();
    let metres = hull["unit"].as_str().and_then(|unit| Dimension::Length.si_of(unit)).unwrap_or(1.0);
    let most = hull["vertices"].as_u64().unwrap_or_default() as usize;
    let no_body = |e: crate::error::Error| {
        Fault::new(format!("{path}.file"), shown(&hull["file"]), format!("makes no body: {e}"), OF_FILE)
    };
    if formats::holds_all_bodies(&folder.join(file)) {
        let problem = "holds all bodies of an export together, of which one hull would be made";
        return Err(Fault::new(format!("{path}.file"), shown(&hull["file"]), problem, OF_ONE));
    }
    let Hull { kept, corners, points, share } = read(&folder.join(file), most, metres).map_err(no_body)?;
    let offset = if hull["centred"] == true { kept.centroid() } else { Vec3::zeros() };
    let vertices: Vec<[f64; 3]> = kept.vertices.iter().map(|v| (v - offset).into()).collect();
    let mut notes = Notes::new();
    if kept.vertices.len() < corners {
        notes.push(format!(
            "the hull of {file} keeps {} of the {corners} corners that its {points} points have, and {:.1} % of its volume",
            kept.vertices.len(),
            1e2 * share
        ));
    }
    Ok((json!({ "polyhedron": vertices }), notes))
}

/// A hull of few of a file's points.
pub struct Hull {
    pub kept: Polyhedron,
    /// Corners of the hull of all points, and number of points.
    pub corners: usize,
    pub points: usize,
    /// Volume of what is kept over that of the hull of all points.
    pub share: f64,
}

/// The hull of at most `most` points of a surface or mesh file, whose unit of length is `metres` [m].
pub fn read(file: &Path, most: usize, metres: f64) -> crate::error::Result<Hull> {
    let points: Vec<Vec3> = formats::read_points(file)?.iter().map(|p| p * metres).collect();
    let whole = Polyhedron::convex_hull(&points)?;
    let kept = coarsened(&whole, most)?;
    let share = kept.volume() / whole.volume();
    Ok(Hull { kept, corners: whole.vertices.len(), points: points.len(), share })
}

/// A hull of at most `most` of a hull's vertices: the two furthest apart, then one by one that which lies furthest outside of what the others span.
fn coarsened(hull: &Polyhedron, most: usize) -> crate::error::Result<Polyhedron> {
    if hull.vertices.len() <= most {
        return Ok(hull.clone());
    }
    let all = &hull.vertices;
    let furthest = |distance: &dyn Fn(&Vec3) -> f64| {
        // The first of equals, so that the order of the points decides.
        all.iter().enumerate().fold((0, f64::NEG_INFINITY), |best, (at, point)| {
            let there = distance(point);
            if there > best.1 { (at, there) } else { best }
        })
    };
    let centroid = hull.centroid();
    let (a, _) = furthest(&|p| (p - centroid).norm());
    let (b, _) = furthest(&|p| (p - all[a]).norm());
    let along = (all[b] - all[a]).normalize();
    let (c, _) = furthest(&|p| (p - all[a]).cross(&along).norm());
    let across = along.cross(&(all[c] - all[a])).normalize();
    let (d, _) = furthest(&|p| (p - all[a]).dot(&across).abs());
    let mut kept = vec![a, b, c, d];
    let mut shape = Polyhedron::convex_hull(&[all[a], all[b], all[c], all[d]])?;
    while kept.len() < most {
        let outside = |p: &Vec3| {
            let facets = shape.facets.iter().zip(&shape.normals);
            facets.map(|(f, n)| n.dot(&(p - shape.vertices[f[0]]))).fold(f64::NEG_INFINITY, f64::max)
        };
        let (next, distance) = furthest(&outside);
        if distance <= 0.0 || kept.contains(&next) {
            break;
        }
        kept.push(next);
        let points: Vec<Vec3> = kept.iter().map(|&at| all[at]).collect();
        shape = Polyhedron::convex_hull(&points)?;
    }
    Ok(shape)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a sphere, golden spiral: two dozen of them keep most of its volume, more keep more.
    #[test]
    fn few_vertices_keep_most_of_the_volume() {
        let count = 400;
        let point = |k: usize| {
            let z = 1.0 - 2.0 * (k as f64 + 0.5) / count as f64;
            let angle = k as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
            Vec3::new((1.0 - z * z).sqrt() * angle.cos(), (1.0 - z * z).sqrt() * angle.sin(), z)
        };
        let whole = Polyhedron::convex_hull(&(0..count).map(point).collect::<Vec<_>>()).expect("a hull");
        let share = |most: usize| {
            let kept = coarsened(&whole, most).expect("a hull");
            assert!(kept.vertices.len() <= most);
            assert!(kept.vertices.iter().all(|v| whole.vertices.contains(v)), "no point is made up");
            kept.volume() / whole.volume()
        };
        let shares = [8, 24, 100].map(share);
        // The best of 8 and of 24 points on a sphere span 0.43 and 0.75 of it (Berman & Hanes 1970; the snub cube).
        assert!(shares[0] > 0.3 && shares[1] > 0.65 && shares[2] > 0.88 && shares[2] < 1.0, "{shares:?}");
        assert!(shares[0] < shares[1] && shares[1] < shares[2]);
        assert_eq!(coarsened(&whole, count).expect("a hull"), whole);
    }
}
