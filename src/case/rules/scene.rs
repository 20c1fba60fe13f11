//! Rules of a scene: names, shapes, meshes, overlaps.

use std::collections::{BTreeMap, HashSet};
use std::path::Path;

use serde_json::Value;

use crate::error::Faults;
use crate::geometry::{Polyhedron, RoundedBody};
use crate::mesh::file::read_mesh;
use crate::mesh::formats;
use crate::specimen::shape::lying_grain;

use super::super::overlap::Placed;
use super::super::path::child;
use super::super::types::{BodyCase, ShapeCase};
use super::super::walk::{Walker, shown};
use super::material;

/// How far from the point that it is placed by, over its size, a body may lie that stages move or load about that point.
const FARTHEST_REFERENCE: f64 = 1e3;
/// How far from the origin bodies may lie, over the size of the smallest that moves: beyond, rounding of positions is what contacts see.
const FARTHEST_ORIGIN: f64 = 5e6;
/// How far a tied end may stand out over its plate, over the size of the body: coordinates are written with few digits.
const DIGITS: f64 = 1e-6;
/// Vertices of a polyhedron at most: hull and rounding look at every vertex from every facet.
const MOST_VERTICES: usize = 1000;
/// Overlapping pairs that are listed one by one.
const LISTED: usize = 20;

/// Checks the scene; the cells of its mesh files.
pub fn check(case: &Value, folder: Option<&Path>, walker: &mut Walker) -> BTreeMap<String, usize> {
    let mut cells_of_files = BTreeMap::new();
    let Some(bodies) = case["scene"]["bodies"].as_array() else { return cells_of_files };
    let mut placed: Vec<(usize, &str, Placed)> = vec![];
    let mut names: HashSet<&str> = HashSet::new();
    let mut pressed: [Option<(usize, Placed)>; 3] = [const { None }; 3];
    for (i, body) in bodies.iter().enumerate() {
        let path = format!("$.scene.bodies[{i}]");
        let Some(name) = body["name"].as_str() else { continue };
        check_name(name, &names, &path, walker);
        names.insert(name);
        if let Some(count) = body["shape"]["polyhedron"].as_array().map(Vec::len)
            && count > MOST_VERTICES
        {
            let place = format!("{path}.shape.polyhedron");
            let accepted = format!("at most {MOST_VERTICES}; finer bodies are meshes");
            walker.fault(place, format!("{count} vertices"), "are too many", accepted);
        }
        if !body["rock"].is_null() && walker.is_clean("$.rock") {
            material::check(&body["rock"], &format!("{path}.rock"), walker);
        }
        let made = match body["shape"]["mesh"].as_str() {
            Some(file) => {
                let read = check_mesh(file, folder, &format!("{path}.shape.mesh"), walker);
                cells_of_files.extend(read.iter().map(|(_, cells)| (file.to_string(), *cells)));
                read.map(|(hull, _)| hull)
            }
            None => random_grain(case, i),
        };
        // A body's own rock is complete only where the case's rock is; shapes do not need it.
        let mut bare = body.clone();
        if let Some(bare) = bare.as_object_mut() {
            bare.shift_remove("rock");
        }
        if walker.is_clean(&path)
            && let Ok(body) = serde_json::from_value::<BodyCase>(bare)
        {
            // A press sets its body on the plate and the other plate on it.
            let is_pressed = case["scene"]["press"]["body"].as_str() == Some(name) && made.is_some();
            match Placed::new(&body, made) {
                Ok(Some(it)) => {
                    check_sizes(&body, &it, &case["contact"]["rounding"], &path, walker);
                    check_reference(case, &it, name, &path, walker);
                    let press = &case["scene"]["press"];
                    let role = |role: &&str| press[*role].as_str() == Some(name);
                    if let Some(role) = ["body", "bottom", "top"].iter().position(role) {
                        pressed[role] = Some((i, it.clone()));
                    }
                    if !is_pressed {
                        placed.push((i, name, it));
                    }
                }
                Ok(None) => {}
                Err(problem) => {
                    let given = bodies[i]["shape"].as_object().and_then(|shape| shape.iter().next());
                    let (kind, found) = given.map_or(("", "nothing".into()), |(k, v)| (k.as_str(), shown(v)));
                    let place = child(&format!("{path}.shape"), kind);
                    walker.fault(place, found, problem, "a shape that spans a volume");
                }
            }
        }
    }
    check_origin(bodies, &placed, walker);
    check_cover(&case["scene"]["press"]["grip"], &pressed, walker);
    check_overlaps(&placed, walker);
    cells_of_files
}

/// Refuses a body that stages move or load about a point far from it.
fn check_reference(case: &Value, body: &Placed, name: &str, path: &str, walker: &mut Walker) {
    let stages = case["stages"].as_array().map_or(&[][..], Vec::as_slice);
    let is_mentioned = stages.iter().any(|stage| !stage["bodies"][name].is_null());
    let Some(middle) = body.shape.far_middle().filter(|_| is_mentioned) else { return };
    let ratio = middle.norm() / body.size();
    if ratio > FARTHEST_REFERENCE {
        let [x, y, z] = middle.into();
        walker.fault(
            format!("{path}.position"),
            format!("\"{name}\""),
            format!(
                "is the reference point of its motion and loads, but lies {:.3e} m from the body, {ratio:.0} times its size",
                middle.norm()
            ),
            format!("a position at the body, ({x:.3e}, {y:.3e}, {z:.3e}) further, and its vertices or nodes relative to that"),
        );
    }
}

/// Refuses a body that stands beside the plates of its press: it is set on the one below, and the one above on it. Plates tied to its ends cover
/// these.
fn check_cover(grip: &Value, pressed: &[Option<(usize, Placed)>; 3], walker: &mut Walker) {
    let [Some((index, body)), plates @ ..] = pressed else { return };
    let is_tied = grip.as_str() == Some("tied");
    for (which, plate) in ["below", "above"].into_iter().zip(plates) {
        let Some((_, plate)) = plate else { continue };
        let upper = which == "above";
        let (end, cover) = (body.end_face(upper), plate.end_face(!upper));
        let slack = DIGITS * body.size();
        let is_met = |k: usize| match is_tied {
            true => cover[k][0] <= end[k][0] + slack && end[k][1] <= cover[k][1] + slack,
            false => cover[k][0] <= end[k][1] && end[k][0] <= cover[k][1],
        };
        if !(0..2).all(is_met) {
            let span = |[x, y]: [[f64; 2]; 2]| {
                format!("x {:.4} to {:.4} and y {:.4} to {:.4} m", x[0], x[1], y[0], y[1])
            };
            let part = if upper { "highest" } else { "lowest" };
            let how = if is_tied { "which is tied to it and does not cover it" } else { "which misses it" };
            walker.fault(
                format!("$.scene.bodies[{index}].position"),
                span(end),
                format!(
                    "is where the {part} part of the body lies, beside the plate {which} ({}), {how}",
                    span(cover)
                ),
                "a body between the plates of its press",
            );
        }
    }
}

/// Refuses bodies so far from the origin that double precision does not tell their gaps.
fn check_origin(bodies: &[Value], placed: &[(usize, &str, Placed)], walker: &mut Walker) {
    let moving = placed.iter().filter(|(i, ..)| bodies[*i]["fixed"].as_bool() != Some(true));
    let smallest = moving.map(|(_, _, body)| body.size()).fold(f64::INFINITY, f64::min);
    for (i, name, body) in placed {
        let (middle, far) = (body.middle(), body.middle().norm() / smallest);
        if far > FARTHEST_ORIGIN {
            let [x, y, z] = middle.into();
            walker.fault(
                format!("$.scene.bodies[{i}].position"),
                format!("\"{name}\""),
                format!(
                    "lies {:.3e} m from the origin, {far:.1e} times the size of the smallest body that moves: rounding hides gaps there",
                    middle.norm()
                ),
                format!("positions from a point near the bodies: ({x:.3e}, {y:.3e}, {z:.3e}) less for all"),
            );
        }
    }
}

fn check_name(name: &str, before: &HashSet<&str>, path: &str, walker: &mut Walker) {
    let problem = if before.contains(name) {
        "names a second body"
    } else if name.trim().is_empty() {
        "is empty"
    } else if name.contains('/') || name.contains(char::is_control) || name == "." || name == ".." {
        "cannot name a group of the results file"
    } else {
        return;
    };
    let accepted = "a name of its own, without / and control characters";
    walker.fault(format!("{path}.name"), shown(&Value::from(name)), problem, accepted);
}

/// The random grain that body number `index` is, as it lies; `None` where it is none, or the case is not sound so far.
fn random_grain(case: &Value, index: usize) -> Option<Polyhedron> {
    let sizes = case["scene"]["bodies"][index]["shape"]["grain"].as_array()?;
    let sizes = [sizes.first()?.as_f64()?, sizes.get(1)?.as_f64()?];
    let (seed, rounding) = (case["seed"].as_u64()?, case["contact"]["rounding"].as_f64()?);
    lying_grain(sizes, rounding, seed, index as u64).ok()
}

/// Checks a mesh file; its hull and number of cells where it makes a body.
fn check_mesh(
    file: &str,
    folder: Option<&Path>,
    path: &str,
    walker: &mut Walker,
) -> Option<(Polyhedron, usize)> {
    let accepted = "a .vtu or .msh file, its path relative to the case file";
    let ending = formats::ending(Path::new(file));
    if formats::OF_POINTS.contains(&ending.as_str()) {
        let problem = "is a surface, which has no cells";
        let accepted = format!(
            r#"a .vtu or .msh file; of a surface {{"hull": {{"file": "{file}", "unit": "mm"}}}} takes the convex hull"#
        );
        walker.fault(path, shown(&Value::from(file)), problem, accepted);
    } else if !formats::OF_CELLS.contains(&ending.as_str()) {
        walker.fault(path, shown(&Value::from(file)), "is not a .vtu or .msh file", accepted);
    } else if let Some(folder) = folder
        && !folder.join(file).is_file()
    {
        walker.fault(path, shown(&Value::from(file)), "is not there", accepted);
    } else if let Some(folder) = folder {
        match read_mesh(&folder.join(file)).and_then(|mesh| Ok((mesh.convex_hull()?, mesh.cells.len()))) {
            Ok(read) => return Some(read),
            Err(error) => {
                let problem = format!("makes no body: {error}");
                let accepted = "a .vtu or .msh file of tetrahedra that fill one convex body";
                walker.fault(path, shown(&Value::from(file)), problem, accepted);
            }
        }
    }
    None
}

fn check_sizes(body: &BodyCase, placed: &Placed, ratio: &Value, path: &str, walker: &mut Walker) {
    let extent = match body.shape {
        ShapeCase::Mesh(_) | ShapeCase::Grain(_) => placed.smallest_extent(),
        ShapeCase::Box(_) | ShapeCase::Sphere(_) | ShapeCase::Cylinder { .. } | ShapeCase::Polyhedron(_) => {
            body.shape.smallest_extent().unwrap_or(0.0)
        }
    };
    if let (Some(mesh_size), ShapeCase::Mesh(_)) = (body.mesh_size, &body.shape) {
        let problem = "sizes the cells of a mesh file, which has its own";
        walker.fault(format!("{path}.mesh_size"), mesh_size, problem, "no mesh_size");
    } else if let Some(mesh_size) = body.mesh_size
        && mesh_size < extent / 1000.0
    {
        let problem = format!("would make cells a thousand times smaller than the body ({extent} m)");
        let accepted = format!("above {} m", extent / 1000.0);
        walker.fault(format!("{path}.mesh_size"), mesh_size, problem, accepted);
    }
    if body.refine.is_some() && !matches!(body.shape, ShapeCase::Sphere(_)) {
        let problem = "refines the mesh of what is no sphere";
        walker.fault(format!("{path}.refine"), "an object", problem, "no refine");
    }
    let Some(radius) = body.rounding.or(ratio.as_f64().map(|ratio| ratio * extent)) else { return };
    if matches!(body.shape, ShapeCase::Sphere(_)) {
        if body.rounding.is_some() {
            let problem = "rounds a sphere, which has no edges";
            walker.fault(format!("{path}.rounding"), radius, problem, "no rounding");
        }
    } else if RoundedBody::inset(&placed.shape, radius).is_err() {
        let problem = format!("does not fit into the body, whose smallest extent is {extent} m");
        walker.fault(format!("{path}.rounding"), radius, problem, "a smaller radius");
    }
}

fn check_overlaps(placed: &[(usize, &str, Placed)], walker: &mut Walker) {
    let pairs = overlapping(placed);
    for &(left, right, depth) in pairs.iter().take(LISTED) {
        let ((_, left, _), (i, right, _)) = (&placed[left], &placed[right]);
        // Past the walker's one fault a place: a body may be in several overlaps.
        walker.faults.fault(
            format!("$.scene.bodies[{i}]"),
            format!("\"{right}\""),
            format!("overlaps \"{left}\" by {depth:.3e} m"),
            "bodies that touch or keep apart",
        );
    }
    if pairs.len() > LISTED {
        let problem = format!("more than {LISTED} pairs of bodies overlap; the others are not listed");
        walker.fault("$.scene.bodies", "overlaps", problem, "bodies that touch or keep apart");
    }
}

/// Pairs that overlap and by how much [m], in order; no more than one behind those that are listed. Along the axis on which the bodies
/// are spread most, only those are compared whose spans meet.
fn overlapping(placed: &[(usize, &str, Placed)]) -> Vec<(usize, usize, f64)> {
    let spans = |axis: usize| -> Vec<[f64; 2]> { placed.iter().map(|(_, _, it)| it.span(axis)).collect() };
    let spread = |axis: usize| {
        let ends = spans(axis);
        let low = ends.iter().map(|span| span[0]).fold(f64::INFINITY, f64::min);
        ends.iter().map(|span| span[0] - low).fold(0.0, f64::max)
    };
    let axis = (0..3).max_by(|&a, &b| spread(a).total_cmp(&spread(b))).unwrap_or(0);
    let spans = spans(axis);
    let mut order: Vec<usize> = (0..placed.len()).collect();
    order.sort_by(|&a, &b| spans[a][0].total_cmp(&spans[b][0]));
    let mut pairs = Vec::new();
    'bodies: for (at, &body) in order.iter().enumerate() {
        for &other in order[at + 1..].iter().take_while(|&&other| spans[other][0] <= spans[body][1]) {
            let (left, right) = (body.min(other), body.max(other));
            if let Some(depth) = placed[left].2.overlap(&placed[right].2) {
                pairs.push((left, right, depth));
                if pairs.len() > LISTED {
                    break 'bodies;
                }
            }
        }
    }
    pairs.sort_by_key(|&(left, right, _)| (left, right));
    pairs
}
