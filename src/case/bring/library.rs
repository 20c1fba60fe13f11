//! A library of grain shapes: a folder, or a list, of scanned grains, as hulls of few corners.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::error::Fault;
use crate::mesh::formats::{OF_CELLS, OF_POINTS, ending, holds_all_bodies};

use super::super::walk::shown;
use super::hull::{self, Hull};
use super::words::Notes;

const PATH: &str = "$.specimen.shapes";
const ACCEPTED: &str = "a folder of .stl, .obj, .ply, .msh or .vtu files, a list of such files, or a list of lists of vertices; paths relative to the case file";

/// Name of a shape, its file's or its number, and its vertices.
pub type Shape = (String, Value);

/// Lists of vertices in place of files, hulls of at most `most` corners; lists stay as they are.
pub fn shapes(given: &Value, folder: &Path, most: usize) -> Result<(Vec<Shape>, Notes), Fault> {
    let mut notes = Notes::new();
    let items = match given {
        Value::String(name) => {
            files_of(&folder.join(name), &mut notes).map_err(|problem| fault(PATH, given, problem))?
        }
        Value::Array(items) => items.clone(),
        other => return Err(fault(PATH, other, "is neither".into())),
    };
    let (mut shapes, mut shares) = (Vec::new(), Vec::new());
    for (index, item) in items.into_iter().enumerate() {
        let Value::String(name) = &item else {
            shapes.push((index.to_string(), item));
            continue;
        };
        // A unit is not needed: only proportions count.
        let Hull { kept, share, .. } = hull::read(&folder.join(name), most, 1.0)
            .map_err(|e| fault(&format!("{PATH}[{index}]"), &item, format!("makes no grain: {e}")))?;
        let size = kept.bounding_radius_about(&kept.centroid());
        let corners: Vec<[f64; 3]> =
            kept.vertices.iter().map(|v| ((v - kept.centroid()) / size).into()).collect();
        let name = Path::new(name).file_name().unwrap_or_default().to_string_lossy().into_owned();
        shapes.push((name, serde_json::json!(corners)));
        shares.push(share);
    }
    if let Some(least) = shares.iter().copied().reduce(f64::min) {
        notes.push(format!(
            "{} scanned grains stand as their convex hulls, hollows filled, of at most {most} corners (vertices has the number), which keep {:.0} % of a hull's volume or more",
            shares.len(),
            1e2 * least
        ));
    }
    Ok((shapes, notes))
}

/// The files of a folder that may be grains, by name. One in which `riprap export` put all bodies together is none, and noted.
fn files_of(folder: &Path, notes: &mut Notes) -> Result<Vec<Value>, String> {
    let no_folder = |e: std::io::Error| format!("cannot be read as a folder: {e}");
    // Absolute paths stay what they are where they are joined to the case's folder.
    let root = std::path::absolute(folder).map_err(no_folder)?;
    let entries = std::fs::read_dir(&root).map_err(no_folder)?;
    let is_grain = |path: &PathBuf| [&OF_POINTS[..], &OF_CELLS[..]].concat().contains(&ending(path).as_str());
    let all = entries.flatten().map(|entry| entry.path()).filter(is_grain);
    let (mut joined, mut files): (Vec<PathBuf>, Vec<PathBuf>) = all.partition(|path| holds_all_bodies(path));
    joined.sort();
    files.sort();
    notes.extend(joined.iter().map(|file| {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        format!("{name} holds all bodies of an export together: no grain of the library")
    }));
    match (files.is_empty(), joined.is_empty()) {
        (true, true) => Err("has no file of a grain in it".into()),
        (true, false) => Err("has only files of all bodies together in it".into()),
        (false, _) => Ok(files.iter().map(|file| Value::from(file.to_string_lossy())).collect()),
    }
}

fn fault(path: &str, value: &Value, problem: String) -> Fault {
    Fault::new(path, shown(value), problem, ACCEPTED)
}

#[cfg(test)]
mod tests {
    use crate::case::{Geometry, RawCase, checked};
    use crate::mesh::formats::{STL_OF_ALL, STL_OF_ONE};

    #[test]
    fn scans_in_a_folder_are_a_library() {
        let folder = tempfile::tempdir().expect("a folder");
        let scans = folder.path().join("scans");
        let write = |name: &str, points: &[[f64; 3]]| {
            std::fs::create_dir_all(&scans).expect("a folder");
            let lines: String = points.iter().map(|p| format!("v {} {} {}\n", p[0], p[1], p[2])).collect();
            std::fs::write(scans.join(name), lines).expect("a scan");
        };
        let cuboid = |edges: [f64; 3]| -> Vec<[f64; 3]> {
            (0..8).map(|k| [0, 1, 2].map(|i| 9.0 + edges[i] * f64::from(k >> i & 1))).collect()
        };
        let check = |shapes: &str| {
            let text = format!(
                r#"{{"specimen": {{"grains": 30, "aspect": 2, "void_ratio": 0.7, "grading": [["60 mm", 1], ["40 mm", 0]], {shapes}}},
                "rock": {{"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}}, "contact": {{"friction": 0.65}},
                "stages": [{{"kind": "consolidate", "pressure": "0.8 MPa"}}]}}"#
            );
            RawCase::parse(&folder.path().join("x.json"), &text).and_then(|raw| raw.check())
        };
        let refused = |shapes: &str| check(shapes).expect_err("refused").to_string();
        assert!(refused(r#""shapes": "scans""#).contains("$.specimen.shapes: cannot be read as a folder"));
        write("notes.txt", &[]);
        assert!(refused(r#""shapes": "scans""#).contains("has no file of a grain"));
        write("b.obj", &cuboid([30.0, 20.0, 15.0]));
        write(
            "a.obj",
            &[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0], [0.3, 0.3, 0.3]],
        );
        let case = check(r#""shapes": "scans""#).unwrap_or_else(|e| panic!("{e}"));
        let Geometry::Specimen(specimen) = &case.geometry else { panic!("no specimen") };
        assert_eq!(specimen.shapes.iter().map(Vec::len).collect::<Vec<_>>(), [4, 8]);
        assert!(
            case.remarks()
                .iter()
                .any(|remark| remark.contains("2 scanned grains stand as their convex hulls"))
        );
        assert!(case.files().contains(&"scans"));
        let again = checked(&case.completed().to_string(), &[]);
        assert_eq!(again.unwrap_or_else(|e| panic!("{e}")).completed(), case.completed());
        // What an export put together is no grain.
        let facet = [0.0_f32, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let stl = |head: &[u8]| {
            let mut bytes = vec![b' '; 80];
            bytes[..head.len()].copy_from_slice(head);
            bytes.extend(1_u32.to_le_bytes());
            bytes.extend(facet.iter().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0; 2]);
            bytes
        };
        std::fs::write(scans.join("all.stl"), stl(STL_OF_ALL)).expect("an export");
        let joined = check(r#""shapes": "scans""#).unwrap_or_else(|e| panic!("{e}"));
        let remarks = joined.remarks();
        assert!(remarks.iter().any(|remark| remark.contains("all.stl holds all bodies")), "{remarks:?}");
        assert!(remarks.iter().any(|remark| remark.contains("2 scanned grains stand")), "{remarks:?}");
        // That of one is a grain, here one without volume.
        std::fs::remove_file(scans.join("all.stl")).expect("removed");
        std::fs::write(scans.join("one.stl"), stl(STL_OF_ONE)).expect("an export");
        assert!(refused(r#""shapes": "scans""#).contains("makes no grain"));
        std::fs::remove_file(scans.join("one.stl")).expect("removed");
        // Few corners.
        let few = r#""vertices": [4, 6], "shapes": ["scans/b.obj"]"#;
        let case = check(few).unwrap_or_else(|e| panic!("{e}"));
        let Geometry::Specimen(specimen) = &case.geometry else { panic!("no specimen") };
        assert_eq!(specimen.shapes.iter().map(Vec::len).collect::<Vec<_>>(), [6]);
        // A list has the corners that it has.
        let list = "[[[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2], [2, 2, 2]]]";
        let listed = format!(r#""vertices": [4, 4], "shapes": {list}"#);
        let case = check(&listed).unwrap_or_else(|e| panic!("{e}"));
        let Geometry::Specimen(specimen) = &case.geometry else { panic!("no specimen") };
        assert_eq!(specimen.shapes.iter().map(Vec::len).collect::<Vec<_>>(), [5]);
        // One fault each: not that files are no lists besides.
        for (shapes, says) in [
            (r#""shapes": ["scans/c.obj", "scans/b.obj"]"#, "$.specimen.shapes[0]: makes no grain"),
            (r#""shapes": "scans", "within_class": "number""#, "$.specimen.within_class"),
            (r#""shapes": "scans", "packing": "none.csv""#, "$.specimen.packing"),
        ] {
            let said = refused(shapes);
            assert!(said.contains("1 fault") && said.contains(says), "{said}");
        }
        write("c.obj", &cuboid([30.0, 20.0, 0.1]));
        assert!(refused(r#""shapes": "scans""#).contains("shape 2 of the library"));
    }
}
