//! Rules of a scene: names, shapes, meshes, overlaps.

use std::path::Path;

use serde_json::Value;

use crate::error::Fault;
use crate::geometry::RoundedBody;
use crate::mesh::file::read_mesh;
use crate::mesh::formats;

use super::super::overlap::Placed;
use super::super::types::{BodyCase, ShapeCase};
use super::super::walk::{Walker, child, shown};
use super::material;

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
        // A body's own rock is complete only where the case's rock is; shapes do not need it.
        let mut bare = body.clone();
        if let Some(bare) = bare.as_object_mut() {
            bare.shift_remove("rock");
        }
        if walker.is_clean(&path)
            && let Ok(body) = serde_json::from_value::<BodyCase>(bare)
        {
            match Placed::new(&body) {
                Ok(Some(it)) => {
                    check_sizes(&body, &it, &case["contact"]["rounding"], &path, walker);
                    placed.push((i, name, it));
                }
                Ok(None) => {}
                Err(problem) => {
                    let given = bodies[i]["shape"].as_object().and_then(|shape| shape.iter().next());
                    let (kind, found) = given.map_or(("", "nothing".into()), |(k, v)| (k.as_str(), shown(v)));
                    let place = child(&format!("{path}.shape"), kind);
                    walker.fault(Fault::new(place, found, problem, "a shape that spans a volume"));
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
    } else if name.contains('/') || name.contains(char::is_control) || name == "." || name == ".." {
        "cannot name a group of the results file"
    } else {
        return;
    };
    let accepted = "a name of its own, without / and control characters";
    walker.fault(Fault::new(format!("{path}.name"), shown(&Value::from(name)), problem, accepted));
}

fn check_mesh(file: &str, folder: Option<&Path>, path: &str, walker: &mut Walker) {
    let accepted = "a .vtu or .msh file, its path relative to the case file";
    let ending = formats::ending(Path::new(file));
    if formats::OF_POINTS.contains(&ending.as_str()) {
        let problem = "is a surface, which has no cells";
        let accepted = format!(
            r#"a .vtu or .msh file; of a surface {{"hull": {{"file": "{file}", "unit": "mm"}}}} takes the convex hull"#
        );
        walker.fault(Fault::new(path, shown(&Value::from(file)), problem, accepted));
    } else if !formats::OF_CELLS.contains(&ending.as_str()) {
        walker.fault(Fault::new(path, shown(&Value::from(file)), "is not a .vtu or .msh file", accepted));
    } else if let Some(folder) = folder
        && !folder.join(file).is_file()
    {
        walker.fault(Fault::new(path, shown(&Value::from(file)), "is not there", accepted));
    } else if let Some(folder) = folder
        && let Err(error) = read_mesh(&folder.join(file))
    {
        let problem = format!("makes no body: {error}");
        let accepted = "a .vtu or .msh file of tetrahedra that fill one convex body";
        walker.fault(Fault::new(path, shown(&Value::from(file)), problem, accepted));
    }
}

fn check_sizes(body: &BodyCase, placed: &Placed, ratio: &Value, path: &str, walker: &mut Walker) {
    let Some(extent) = body.shape.smallest_extent() else { return };
    if let Some(mesh_size) = body.mesh_size
        && mesh_size < extent / 1000.0
    {
        let problem = format!("would make cells a thousand times smaller than the body ({extent} m)");
        let accepted = format!("above {} m", extent / 1000.0);
        walker.fault(Fault::new(format!("{path}.mesh_size"), mesh_size, problem, accepted));
    }
    if body.refine.is_some() && !matches!(body.shape, ShapeCase::Sphere(_)) {
        let problem = "refines the mesh of what is no sphere";
        walker.fault(Fault::new(format!("{path}.refine"), "an object", problem, "no refine"));
    }
    let Some(radius) = body.rounding.or(ratio.as_f64().map(|ratio| ratio * extent)) else { return };
    if matches!(body.shape, ShapeCase::Sphere(_)) {
        if body.rounding.is_some() {
            let problem = "rounds a sphere, which has no edges";
            walker.fault(Fault::new(format!("{path}.rounding"), radius, problem, "no rounding"));
        }
    } else if RoundedBody::inset(&placed.shape, radius).is_err() {
        let problem = format!("does not fit into the body, whose smallest extent is {extent} m");
        walker.fault(Fault::new(format!("{path}.rounding"), radius, problem, "a smaller radius"));
    }
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
            // Past the walker's one fault a place: a body may be in several overlaps.
            walker.faults.push(Fault::new(
                format!("$.scene.bodies[{i}]"),
                format!("\"{right}\""),
                format!("overlaps \"{left}\" by {depth:.3e} m"),
                "bodies that touch or keep apart",
            ));
        }
    }
}
