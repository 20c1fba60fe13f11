//! What a case brings in from files or says in other words, put into the plain words of the case before it is checked: a grading out of a sieve table,
//! cut to what can be tested; porosity for void ratio; the convex hull of a scanned grain for a polyhedron; a library of them; another code's packing.
//!
//! The completed case has the plain words alone, so a results file needs none of the files again. What was left out on the way is told: [`Notes`].

mod columns;
mod hull;
mod library;
mod packing;
mod sieve;
mod words;

use std::path::Path;

use serde_json::{Value, json};

use crate::error::Fault;

use super::walk::shown;
pub use words::{HULL, Notes, PACKED_GRAINS, POROSITY, POSITION, ROTATION, SHAPES, SIEVE};

/// The most corners of a shape where `specimen.vertices` does not say.
const CORNERS: u64 = 16;

/// Puts everything that `case` brings in into its place. Files are relative to `folder`.
pub fn bring_in(case: &mut Value, folder: &Path, faults: &mut Vec<Fault>) -> Notes {
    let mut notes = Notes::new();
    let mut put = |place: &mut Value, brought: Result<(Value, Notes), Fault>| match brought {
        Ok((value, told)) => {
            *place = value;
            notes.extend(told);
        }
        Err(fault) => faults.push(fault),
    };
    if let Some(grading) =
        case.pointer_mut("/specimen/grading").filter(|given| given.is_string() || given.is_object())
    {
        // What a table at fault would have said is not missed.
        let brought = sieve::grading(grading, folder);
        if brought.is_err() {
            *grading = json!([[0.02, 1], [0.01, 0]]);
        }
        put(grading, brought);
    }
    let mut lacks_void_ratio = false;
    if let Some(specimen) = case.get_mut("specimen").filter(|specimen| specimen.get("porosity").is_some()) {
        let brought = void_ratio(specimen);
        lacks_void_ratio = brought.is_err();
        put(specimen, brought);
    }
    let seed = case["seed"].as_u64().unwrap_or(0);
    if let Some(specimen) = case.get_mut("specimen").filter(|given| given.is_object()) {
        let brought = grains(specimen, folder, seed);
        if brought.is_err()
            && let Some(keys) = specimen.as_object_mut()
        {
            // Files that were not read are no lists of vertices.
            if keys.get("shapes").is_some_and(is_of_files) {
                keys.shift_remove("shapes");
            }
            // What a packing at fault would have said is not missed.
            let stand_in = [
                ("grading", json!([[0.02, 1], [0.01, 0]])),
                ("void_ratio", json!(0.5)),
                ("grains", json!(30)),
                ("aspect", json!(1)),
            ];
            if keys.shift_remove("packing").is_some() {
                for (key, value) in stand_in {
                    keys.entry(key).or_insert(value);
                }
            }
        }
        put(specimen, brought);
        if lacks_void_ratio && let Some(keys) = specimen.as_object_mut() {
            // What a porosity at fault would have said is not missed.
            keys.entry("void_ratio").or_insert(json!(0.5));
        }
    }
    let bodies = case.pointer_mut("/scene/bodies").and_then(Value::as_array_mut);
    for (index, body) in bodies.into_iter().flatten().enumerate() {
        let Some(shape) = body.get_mut("shape").filter(|shape| shape.get("hull").is_some()) else { continue };
        let path = format!("$.scene.bodies[{index}].shape");
        let brought = hull::shape(shape, &path, folder);
        put(shape, brought);
    }
    notes
}

/// Files that a case brings in, as it names them: nothing is written over them.
pub fn files(case: &Value) -> Vec<String> {
    let grading = case.pointer("/specimen/grading").and_then(|given| given.get("file").or(Some(given)));
    let packing = case.pointer("/specimen/packing").and_then(|given| given.get("file").or(Some(given)));
    let shapes = case.pointer("/specimen/shapes").into_iter();
    let shapes = shapes.flat_map(|given| given.as_array().map_or(std::slice::from_ref(given), Vec::as_slice));
    let bodies = case.pointer("/scene/bodies").and_then(Value::as_array);
    let hulls = bodies.into_iter().flatten().filter_map(|body| body.pointer("/shape/hull/file"));
    grading
        .into_iter()
        .chain(packing)
        .chain(shapes)
        .chain(hulls)
        .filter_map(Value::as_str)
        .map(str::to_string)
        .collect()
}

/// Whether shapes are given by files, or some of them.
fn is_of_files(shapes: &Value) -> bool {
    shapes.is_string() || shapes.as_array().is_some_and(|items| items.iter().any(Value::is_string))
}

/// A specimen with its library of shapes and its packing as lists.
fn grains(specimen: &Value, folder: &Path, seed: u64) -> Result<(Value, Notes), Fault> {
    let mut keys = specimen.as_object().cloned().unwrap_or_default();
    let mut notes = Notes::new();
    let mut library = Vec::new();
    if let Some(given) = specimen.get("shapes") {
        let (place, law) = ("$.specimen.within_class", &specimen["within_class"]);
        if law == "number" {
            let problem = "does not go with shapes, whose sizes follow the mass";
            return Err(Fault::new(place, shown(law), problem, "\"mass\", or no within_class"));
        }
        keys.insert("within_class".into(), "mass".into());
        let most = specimen.pointer("/vertices/1").and_then(Value::as_u64).unwrap_or(CORNERS);
        let (shapes, told) = library::shapes(given, folder, most as usize)?;
        notes.extend(told);
        keys.insert("shapes".into(), shapes.iter().map(|(_, corners)| corners.clone()).collect());
        library = shapes;
    }
    if specimen.get("packing").is_some() {
        let (specimen, told) = packing::specimen(&keys, &library, folder, seed)?;
        notes.extend(told);
        return Ok((specimen, notes));
    }
    Ok((Value::Object(keys), notes))
}

/// A specimen with `void_ratio` in place of `porosity`.
fn void_ratio(specimen: &Value) -> Result<(Value, Notes), Fault> {
    let (path, given) = ("$.specimen.porosity", &specimen["porosity"]);
    if specimen.get("void_ratio").is_some() {
        return Err(Fault::new(path, shown(given), "says again what void_ratio says", "one of the two"));
    }
    let porosity = words::walked(&POROSITY, given, path)?.as_f64().unwrap_or_default();
    let mut specimen = specimen.clone();
    if let Some(keys) = specimen.as_object_mut() {
        keys.shift_remove("porosity");
        keys.insert("void_ratio".into(), json!(porosity / (1.0 - porosity)));
    }
    Ok((specimen, Notes::new()))
}

#[cfg(test)]
mod tests {
    use crate::case::{Geometry, RawCase, ShapeCase, checked};

    const SPECIMEN: &str = r#"{"specimen": {"grains": 80, "aspect": 2, "void_ratio": 0.5, "grading": [["60 mm", 1], ["40 mm", 0]]},
        "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}, "contact": {"friction": 0.65},
        "stages": [{"kind": "consolidate", "pressure": "0.8 MPa"}]}"#;

    #[test]
    fn porosity_is_void_ratio_in_other_words() {
        let check = |given: &str| checked(&SPECIMEN.replace(r#""void_ratio": 0.5"#, given), &[]);
        let case = check(r#""porosity": "36 %""#).unwrap_or_else(|e| panic!("{e}"));
        let Geometry::Specimen(specimen) = &case.geometry else { panic!("no specimen") };
        assert!((specimen.void_ratio - 0.5625).abs() < 1e-12);
        let twice = check(r#""void_ratio": 0.5, "porosity": 0.3"#);
        assert!(twice.is_err_and(|e| e.to_string().contains("$.specimen.porosity: says again")));
        let refused =
            |porosity: &str| check(&format!(r#""porosity": {porosity}"#)).expect_err(porosity).to_string();
        // One fault, of what was written.
        for porosity in ["36", "0.669"] {
            let said = refused(porosity);
            assert!(said.contains("1 fault"), "{said}");
            assert!(said.contains("$.specimen.porosity: must be at most 0.666"), "{said}");
        }
        assert!(check(r#""porosity": 0.666"#).is_ok());
    }

    #[test]
    fn a_grading_comes_from_a_table_beside_the_case() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(
            folder.path().join("sieve.csv"),
            "sieve [mm];passing [%]\n60;100\n40;62,5\n20;25\n5;10\n",
        )
        .expect("a table");
        let text = SPECIMEN
            .replace(r#"[["60 mm", 1], ["40 mm", 0]]"#, r#"{"file": "sieve.csv", "finest": "20 mm"}"#);
        let file = folder.path().join("x.json");
        let case = RawCase::parse(&file, &text).and_then(|raw| raw.check()).unwrap_or_else(|e| panic!("{e}"));
        let Geometry::Specimen(specimen) = &case.geometry else { panic!("no specimen") };
        assert_eq!(specimen.grading, [[0.06, 1.0], [0.04, 0.5], [0.02, 0.0]]);
        assert!(
            case.remarks().iter().any(|remark| remark.contains("25.0 % of the mass")),
            "{:?}",
            case.remarks()
        );
        // What is completed needs the table no more.
        std::fs::remove_file(folder.path().join("sieve.csv")).expect("a file to lose");
        let again = checked(&case.completed().to_string(), &[]);
        assert_eq!(again.unwrap_or_else(|e| panic!("{e}")).completed(), case.completed());
        let gone = RawCase::parse(&file, &text).and_then(|raw| raw.check());
        // One fault, which is the table's: not that a grading is a list besides.
        let gone = gone.expect_err("no table").to_string();
        assert!(gone.contains("1 fault") && gone.contains("$.specimen.grading.file"), "{gone}");
    }

    /// Sieves of a laboratory go on beyond its rock: the largest size is that of grains.
    #[test]
    fn sieves_beyond_the_grains_are_none_of_a_grading() {
        let folder = tempfile::tempdir().expect("a folder");
        let rows = "sieve [mm],passing [%]\n100,100\n80,100\n60,100\n40,50\n20,0\n10,0\n";
        std::fs::write(folder.path().join("sieve.csv"), rows).expect("a table");
        let list = r#"[["80 mm", 1], ["60 mm", 1], ["40 mm", 0.5], ["20 mm", 0], ["10 mm", 0]]"#;
        let scalped = r#"{"file": "sieve.csv", "coarsest": "70 mm"}"#;
        for grading in [r#""sieve.csv""#, list, scalped] {
            let text = SPECIMEN.replace(r#"[["60 mm", 1], ["40 mm", 0]]"#, grading);
            let case = RawCase::parse(&folder.path().join("x.json"), &text).and_then(|raw| raw.check());
            let case = case.unwrap_or_else(|e| panic!("{grading}: {e}"));
            let Geometry::Specimen(specimen) = &case.geometry else { panic!("no specimen") };
            assert_eq!(specimen.grading, [[0.06, 1.0], [0.04, 0.5], [0.02, 0.0]], "{grading}");
        }
    }

    #[test]
    fn a_scanned_grain_comes_as_its_hull() {
        let folder = tempfile::tempdir().expect("a folder");
        // Corners of a box of 30 x 20 x 10 mm, one of them cut, and a point inside.
        let mut points: Vec<[f64; 3]> = (0..7)
            .map(|k| [k & 1, k >> 1 & 1, k >> 2 & 1].map(f64::from))
            .map(|[x, y, z]| [30.0 * x, 20.0 * y, 10.0 * z])
            .collect();
        points.push([3.0, 3.0, 3.0]);
        let lines: String = points.iter().map(|p| format!("v {} {} {}\n", p[0], p[1], p[2])).collect();
        std::fs::write(folder.path().join("grain.obj"), lines).expect("a scan");
        let text = r#"{"scene": {"bodies": [{"name": "a", "shape": {"hull": HULL}}]},
            "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2}, "contact": {"friction": 0.65},
            "stages": [{"kind": "load"}]}"#;
        let check =
            |hull: &str| RawCase::parse(&folder.path().join("x.json"), &text.replace("HULL", hull))?.check();
        let polyhedron = |hull: &str| {
            let case = check(hull).unwrap_or_else(|e| panic!("{e}"));
            let Geometry::Scene(scene) = &case.geometry else { panic!("no scene") };
            let ShapeCase::Polyhedron(points) = &scene.bodies[0].shape else { panic!("no polyhedron") };
            (points.clone(), case.remarks().join("; "))
        };
        let (points, remarks) = polyhedron(r#"{"file": "grain.obj", "unit": "mm"}"#);
        assert_eq!(points.len(), 7);
        assert!(points.contains(&[0.03, 0.02, 0.0]) && remarks.is_empty(), "{points:?} {remarks}");
        let (points, remarks) =
            polyhedron(r#"{"file": "grain.obj", "unit": "mm", "vertices": 6, "centred": true}"#);
        assert_eq!(points.len(), 6);
        assert!(remarks.contains("6 of the 7 corners") && remarks.contains("% of its volume"), "{remarks}");
        let refused = |hull: &str| check(hull).expect_err("refused").to_string();
        assert!(
            refused(r#"{"file": "grain.obj"}"#).contains("$.scene.bodies[0].shape.hull.unit: is missing")
        );
        assert!(refused(r#"{"file": "grain.obj", "unit": "feet"}"#).contains("shape.hull.unit"));
        assert!(refused(r#"{"file": "none.obj", "unit": "m"}"#).contains("shape.hull.file"));
        assert!(refused(r#"{"file": "grain.obj", "unit": "m", "corners": 3}"#).contains("unknown key"));
    }
}
