//! Rules of a scene: names, shapes, meshes, overlaps.

use std::path::Path;

use serde_json::Value;

use crate::error::Fault;

use super::super::overlap::Placed;
use super::super::types::BodyCase;
use super::super::walk::{Walker, shown};
use super::{material, number, vector};

/// Overlapping pairs that are listed one by one.
const LISTED: usize = 20;

pub fn check(case: &Value, folder: Option<&Path>, walker: &mut Walker) {
    let Some(bodies) = case["scene"]["bodies"].as_array() else { return };
    let mut placed: Vec<(usize, &str, Placed)> = vec![];
    let mut names: Vec<&str> = vec![];
    for (i, body) in bodies.iter().enumerate() {
        let path = format!("$.scene.bodies[{i}]");
        let Some(name) = body["name"].as_str() else { continue };
        check_name(name, &names, &path, walker);
        names.push(name);
        if !body["rock"].is_null() && walker.is_clean("$.rock") {
            material::check(&body["rock"], &format!("{path}.rock"), walker);
        }
        if let Some(file) = body["shape"]["mesh"].as_str() {
            check_mesh(file, folder, &format!("{path}.shape.mesh"), walker);
        }
        check_sizes(body, &path, walker);
        // A body's own rock is complete only where the case's rock is; shapes do not need it.
        let mut bare = body.clone();
        if let Some(bare) = bare.as_object_mut() {
            bare.shift_remove("rock");
        }
        if walker.is_clean(&path)
            && let Ok(body) = serde_json::from_value::<BodyCase>(bare)
        {
            match Placed::new(&body) {
                Ok(Some(body)) => placed.push((i, name, body)),
                Ok(None) => {}
                Err(problem) => {
                    let found = shown(&bodies[i]["shape"]["polyhedron"]);
                    let accepted = "vertices that span a volume";
                    walker.fault(Fault::new(format!("{path}.shape.polyhedron"), found, problem, accepted));
                }
            }
        }
    }
    check_overlaps(&placed, walker);
}

fn check_name(name: &str, before: &[&str], path: &str, walker: &mut Walker) {
    let problem = if before.contains(&name) {
        "names a second body"
    } else if name.trim().is_empty() {
        "is empty"
    } else if name.contains(['/', '\0']) || name == "." || name == ".." {
        "cannot name a group of the results file"
    } else {
        return;
    };
    let accepted = "a name of its own, without /";
    walker.fault(Fault::new(format!("{path}.name"), shown(&Value::from(name)), problem, accepted));
}

fn check_mesh(file: &str, folder: Option<&Path>, path: &str, walker: &mut Walker) {
    let accepted = "a .vtu file, its path relative to the case file";
    if Path::new(file).extension().is_none_or(|e| !e.eq_ignore_ascii_case("vtu")) {
        walker.fault(Fault::new(path, shown(&Value::from(file)), "is not a .vtu file", accepted));
    } else if let Some(folder) = folder
        && !folder.join(file).is_file()
    {
        walker.fault(Fault::new(path, shown(&Value::from(file)), "is not there", accepted));
    }
}

fn check_sizes(body: &Value, path: &str, walker: &mut Walker) {
    let Some(extent) = smallest_extent(&body["shape"]) else { return };
    if let Some(rounding) = number(body, "rounding")
        && rounding >= extent / 2.0
        && body["shape"]["sphere"].is_null()
    {
        let problem = format!("is not below half the body's smallest extent {extent} m");
        walker.fault(Fault::new(
            format!("{path}.rounding"),
            rounding,
            problem,
            format!("below {} m", extent / 2.0),
        ));
    }
    if let Some(mesh_size) = number(body, "mesh_size")
        && mesh_size < extent / 1000.0
    {
        let problem = format!("would make cells a thousand times smaller than the body ({extent} m)");
        walker.fault(Fault::new(
            format!("{path}.mesh_size"),
            mesh_size,
            problem,
            format!("above {} m", extent / 1000.0),
        ));
    }
}

/// Of the box around the shape in its own axes [m].
fn smallest_extent(shape: &Value) -> Option<f64> {
    if let Some(size) = vector(&shape["box"]) {
        return Some(size.into_iter().fold(f64::INFINITY, f64::min));
    }
    if let Some(radius) = number(shape, "sphere") {
        return Some(2.0 * radius);
    }
    let points: Vec<[f64; 3]> = shape["polyhedron"].as_array()?.iter().map(vector).collect::<Option<_>>()?;
    let extent = |k: usize| {
        let of = |start: f64, pick: fn(f64, f64) -> f64| points.iter().map(|p| p[k]).fold(start, pick);
        of(f64::NEG_INFINITY, f64::max) - of(f64::INFINITY, f64::min)
    };
    (0..3).map(extent).reduce(f64::min)
}

fn check_overlaps(placed: &[(usize, &str, Placed)], walker: &mut Walker) {
    let mut found = 0;
    for (k, (_, left, a)) in placed.iter().enumerate() {
        for (i, right, b) in &placed[k + 1..] {
            let Some(depth) = a.overlap(b) else { continue };
            found += 1;
            if found > LISTED {
                let problem =
                    format!("more than {LISTED} pairs of bodies overlap; the others are not listed");
                walker.fault(Fault::new(
                    "$.scene.bodies",
                    "overlaps",
                    problem,
                    "bodies that touch or keep apart",
                ));
                return;
            }
            // The pair is in the path, so that a body in two overlaps is listed twice.
            walker.fault(Fault::new(
                format!("$.scene.bodies[{i}]"),
                format!("\"{right}\""),
                format!("overlaps \"{left}\" by {depth:.3e} m"),
                "bodies that touch or keep apart",
            ));
        }
    }
}
