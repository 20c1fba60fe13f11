//! Broken case files: each fault is named with its path, the value found and what to do; all faults
//! of a file are listed at once; nothing panics.

use std::path::Path;

use proptest::prelude::*;
use riprap::case::{Case, GateCase, RawCase, parse_override};
use riprap::contact::NormalLaw;
use riprap::contact::face::FaceContact;
use riprap::error::{Error, Fault};
use serde_json::{Value, json};

const SPECIMEN: &str = r#"{
  "title": "sound", "seed": 7,
  "specimen": {"diameter": "300 mm", "height": "650 mm", "void_ratio": 0.47, "vertices": [8, 16],
    "grading": [["60 mm", 1.0], ["40 mm", 0.62], ["20 mm", 0.0]]},
  "rock": {"density": 2180, "youngs_modulus": {"mean": "30 GPa", "weibull_shape": 20}, "poissons_ratio": 0.2,
    "compressive_strength": "250 MPa", "tensile_strength": "25 MPa", "damage": {"exponent": 3}},
  "contact": {"friction": 0.65, "residual_friction": 0.2},
  "membrane": {"kind": "rubber", "thickness": "2 mm"},
  "stages": [{"kind": "consolidate", "pressure": "0.8 MPa"},
             {"kind": "shear", "axial_strain": 0.15, "increment": 1e-4},
             {"kind": "unload"}, {"kind": "reload"}],
  "solver": {"fidelity": "auto"}, "output": {"contacts": true}
}"#;

const SCENE: &str = r#"{
  "scene": {"bodies": [
    {"name": "plane", "shape": {"box": [1, 1, 0.1]}, "position": [0, 0, -0.05], "fixed": true},
    {"name": "block", "shape": {"box": [0.1, 0.1, 0.1]}, "position": [0, 0, 0.05], "rock": {"density": 3000}},
    {"name": "ball", "shape": {"sphere": 0.02}, "position": [0.3, 0, 0.02], "mesh_size": "2 mm"},
    {"name": "roof", "shape": {"polyhedron": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]}, "position": [0, 0, 1]}]},
  "rock": {"density": 2180, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2},
  "contact": {"friction": 0.65},
  "stages": [{"kind": "load", "increments": 5,
    "bodies": {"block": {"displacement": [0, null, null], "force": [null, null, "-1 kN"]}}}]
}"#;

fn sound(text: &str, overrides: &[(&str, Value)]) -> Case {
    let mut raw = RawCase::parse(Path::new("sound.json"), text).unwrap_or_else(|e| panic!("{e}"));
    raw.set(&overrides.iter().map(|(at, to)| (at.to_string(), to.clone())).collect::<Vec<_>>());
    raw.check().unwrap_or_else(|e| panic!("{e}"))
}

fn faults_of(text: &str, overrides: &[(String, Value)]) -> Vec<Fault> {
    let mut raw = RawCase::parse(Path::new("broken.json"), text).unwrap_or_else(|e| panic!("{e}"));
    raw.set(overrides);
    match raw.check() {
        Ok(_) => vec![],
        Err(Error::Case { faults, .. }) => faults,
        Err(other) => panic!("{other}"),
    }
}

/// JSON text; an empty one takes the key out.
fn changed(base: &str, pointer: &str, value: &str) -> Vec<Fault> {
    if !value.is_empty() {
        let value = serde_json::from_str(value).unwrap_or_else(|e| panic!("{value}: {e}"));
        return faults_of(base, &[(pointer.into(), value)]);
    }
    let mut tree: Value = serde_json::from_str(base).expect("JSON");
    let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
    tree.pointer_mut(parent)
        .and_then(Value::as_object_mut)
        .and_then(|map| map.shift_remove(key))
        .expect("a key");
    faults_of(&tree.to_string(), &[])
}

/// After a stage in which the pressure follows from something else nobody knows it beforehand.
#[test]
fn a_pressure_that_follows_cannot_be_given() {
    let stages = |pressure: &str| {
        let text = format!(
            r#"[{{"kind": "consolidate", "pressure": 8e5}}, {{"kind": "constant_volume", "axial_strain": 0.01}},
                {{"kind": "shear", "axial_strain": 0.01{pressure}}}]"#
        );
        faults_of(SPECIMEN, &[("/stages".into(), serde_json::from_str(&text).expect("JSON"))])
    };
    assert_eq!(stages(""), []);
    let faults = stages(r#", "pressure": 8e5"#);
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert!(faults[0].path == "$.stages[2].pressure" && faults[0].problem.contains("cannot be given"));
}

/// Paths of what a sound case asks for and cannot be run yet.
fn not_yet(base: &str, overrides: &[(&str, Value)]) -> Vec<String> {
    let mut raw = RawCase::parse(Path::new("case.json"), base).expect("parses");
    let set: Vec<(String, Value)> = overrides.iter().map(|(at, to)| (at.to_string(), to.clone())).collect();
    raw.set(&set);
    let faults = riprap::case::unsupported(&raw.check().expect("a sound case"));
    faults.into_iter().map(|fault| fault.path).collect()
}

#[test]
fn faces_of_grains_share_no_patches_where_these_break_or_change_their_fidelity() {
    let refused = |base: &str, overrides: &[(&str, Value)]| {
        not_yet(base, overrides).iter().filter(|path| *path == "$.contact.faces").count()
    };
    let area = ("/contact/faces", json!("area"));
    let whole = ("/rock/damage", json!(null));
    assert_eq!(refused(SPECIMEN, std::slice::from_ref(&area)), 1);
    assert_eq!(refused(SPECIMEN, &[area.clone(), whole.clone()]), 0);
    assert_eq!(refused(SPECIMEN, &[("/contact/faces", json!("corners"))]), 0);
    let chosen = ("/solver/accuracy", json!(0.05));
    assert_eq!(refused(SPECIMEN, &[area, whole, chosen.clone()]), 1);
    let strengths = ["compressive", "tensile"].map(|of| (format!("/rock/{of}_strength"), json!("25 MPa")));
    let mut set = vec![chosen, ("/rock/damage", json!({}))];
    set.extend(strengths.iter().map(|(at, to)| (at.as_str(), to.clone())));
    assert_eq!((sound(SCENE, &set).contact.faces, refused(SCENE, &set)), (FaceContact::Area, 0));
    assert_eq!(sound(SPECIMEN, &[]).contact.faces, FaceContact::Corners);
}

/// Contacts of specimens crush, those of scenes are springs, unless the case says otherwise; at every fidelity.
#[test]
fn asperities_are_the_contacts_of_specimens() {
    let [asperity, spring] = ["asperity", "spring"].map(|law| ("/contact/normal", json!(law)));
    let limit = ("/contact/limit_pressure", json!("600 MPa"));
    for fidelity in ["rigid", "condensed", "full"] {
        let fidelity = ("/solver/fidelity", json!(fidelity));
        assert_eq!(sound(SPECIMEN, std::slice::from_ref(&fidelity)).contact.normal, NormalLaw::Asperity);
        assert_eq!(sound(SPECIMEN, &[fidelity.clone(), spring.clone()]).contact.normal, NormalLaw::Spring);
    }
    assert_eq!(sound(SCENE, &[]).contact.normal, NormalLaw::Spring);
    let limit_of = |base: &str, set: &[(&str, Value)]| {
        let case = sound(base, set);
        case.limit_pressure_of(&case.rock)
    };
    // By the strength, or as given, or, where nothing is said of it, none.
    assert!((limit_of(SPECIMEN, &[]) / 7e8 - 1.0).abs() < 1e-12);
    assert_eq!(limit_of(SPECIMEN, std::slice::from_ref(&limit)), 6e8);
    assert_eq!(limit_of(SCENE, std::slice::from_ref(&asperity)), f64::INFINITY);
}

/// A random grain and a mesh file are bodies like others: what they overlap is refused, with the depth.
#[test]
fn bodies_of_any_shape_are_checked_for_overlap() {
    let folder = tempfile::tempdir().expect("a folder");
    // A tetrahedron of 0.2 m with its corner at its position and a facet in z = 0.
    let vtu = |scale: f64| {
        let points = [[0.0; 3], [0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.2]];
        let points: Vec<String> = points.iter().flatten().map(|x| format!("{}", x * scale)).collect();
        format!(
            "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece><Points><DataArray format=\"ascii\">{}</DataArray></Points>\
             <Cells><DataArray Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray><DataArray Name=\"offsets\" format=\"ascii\">4\
             </DataArray><DataArray Name=\"types\" format=\"ascii\">10</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>",
            points.join(" ")
        )
    };
    std::fs::write(folder.path().join("tip.vtu"), vtu(1.0)).expect("written");
    std::fs::write(folder.path().join("mm.vtu"), vtu(1000.0)).expect("written");
    let faults = |shape: Value, height: f64| {
        let mut raw = RawCase::parse(&folder.path().join("a.json"), SCENE).unwrap_or_else(|e| panic!("{e}"));
        raw.set(&[
            ("/scene/bodies/1/shape".into(), shape),
            ("/scene/bodies/1/position".into(), json!([-0.2, 0, height])),
        ]);
        match raw.check() {
            Err(Error::Case { faults, .. }) => faults,
            _ => vec![],
        }
    };
    assert_eq!(faults(json!({"mesh": "tip.vtu"}), 0.0), []);
    let found = faults(json!({"mesh": "tip.vtu"}), -3e-3);
    assert!(found.len() == 1 && found[0].problem.contains("overlaps \"plane\" by 3.000e-3 m"), "{found:?}");
    assert!(!faults(json!({"mesh": "mm.vtu"}), -1e-3).is_empty());
    let found = faults(json!({"grain": [0.05, 0.06]}), 2e-3);
    assert!(found.len() == 1 && found[0].problem.contains("overlaps \"plane\""), "{found:?}");
    assert_eq!(faults(json!({"grain": [0.05, 0.06]}), 0.05), []);
    // Millimetres taken for metres, where nothing is in the way.
    let text = SCENE.replace(
        "{\"box\": [0.1, 0.1, 0.1]}, \"position\": [0, 0, 0.05]",
        "{\"mesh\": \"mm.vtu\"}, \"position\": [3, 3, 9]",
    );
    let raw = RawCase::parse(&folder.path().join("a.json"), &text).unwrap_or_else(|e| panic!("{e}"));
    let remarks = raw.check().unwrap_or_else(|e| panic!("{e}")).remarks_on_meshes(folder.path());
    assert!(remarks.len() == 1 && remarks[0].contains("millimetres"), "{remarks:?}");
}

/// A prism of so many sides, each meshed as a cell, as a file: about z, of radius `radius` and length `length` [m].
fn prism_file(sides: usize, radius: f64, length: f64) -> String {
    let mesh = riprap::mesh::polyhedron_mesh(
        &riprap::geometry::Polyhedron::cylinder(radius, length, sides).expect("a prism"),
        radius,
    )
    .expect("a mesh");
    let list = |words: Vec<String>| words.join(" ");
    let points = list(mesh.nodes.iter().map(|p| format!("{:e} {:e} {:e}", p.x, p.y, p.z)).collect());
    let cells: Vec<String> =
        mesh.cells.iter().map(|c| list(c[..4].iter().map(|n| n.0.to_string()).collect())).collect();
    let ends = list((1..=cells.len()).map(|k| (4 * k).to_string()).collect());
    format!(
        r#"<VTKFile type="UnstructuredGrid"><UnstructuredGrid><Piece><Points><DataArray format="ascii">{points}</DataArray></Points><Cells>
        <DataArray Name="connectivity" format="ascii">{}</DataArray><DataArray Name="offsets" format="ascii">{ends}</DataArray>
        <DataArray Name="types" format="ascii">{}</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>"#,
        list(cells.clone()),
        list(vec!["10".to_string(); cells.len()])
    )
}

/// What is remarked on of other bodies is of mesh files too: faces that blend, sizes out of all proportion.
#[test]
fn mesh_files_are_remarked_on_as_other_bodies_are() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("round.vtu"), prism_file(72, 0.06, 0.1)).expect("written");
    std::fs::write(folder.path().join("cm.vtu"), prism_file(6, 3.0, 5.0)).expect("written");
    let remarks = |shape: Value, faces: &str, position: Value| {
        let mut raw = RawCase::parse(&folder.path().join("a.json"), SCENE).unwrap_or_else(|e| panic!("{e}"));
        raw.set(&[
            ("/scene/bodies/1/shape".into(), shape),
            ("/scene/bodies/1/position".into(), position),
            ("/contact/faces".into(), json!(faces)),
            ("/scene/bodies/3/fixed".into(), json!(true)),
        ]);
        let case = raw.check().unwrap_or_else(|e| panic!("{e}"));
        [case.remarks(), case.remarks_on_meshes(folder.path())].map(|found| found.join("; "))
    };
    let round = remarks(json!({"mesh": "round.vtu"}), "area", json!([0, 0, 0.05]));
    assert!(round[1].contains("72 of the 74 faces of \"block\""), "{round:?}");
    assert_eq!(remarks(json!({"mesh": "round.vtu"}), "corners", json!([0, 0, 0.05]))[1], "");
    // 6 m on a plane of 1 m, and a ball of 4 cm beside it.
    let large = remarks(json!({"mesh": "cm.vtu"}), "corners", json!([0, 5, 2.5]));
    assert!(large[1].contains("6 times what any other body does"), "{large:?}");
    assert!(large[1].contains("differ by a factor of 125"), "{large:?}");
}

/// Where double precision does not resolve what is asked for, the message says what to give instead.
#[test]
fn bodies_far_from_origin_or_reference_point_are_refused() {
    let corners = |x: f64| json!([[x, 0, 0], [x + 0.1, 0, 0], [x, 0.1, 0], [x, 0, 0.1]]);
    let moved = |x: f64, position: f64| {
        let set = [
            ("/scene/bodies/1/shape".to_string(), json!({"polyhedron": corners(x)})),
            ("/scene/bodies/1/position".to_string(), json!([position, 0, 0])),
        ];
        faults_of(SCENE, &set)
    };
    assert_eq!(moved(50.0, -50.0), []);
    let far = moved(400.0, -400.0);
    assert!(far.len() == 1 && far[0].path == "$.scene.bodies[1].position", "{far:?}");
    assert!(far[0].problem.contains("reference point") && far[0].accepted.contains("4.000e2"), "{far:?}");
    let far = moved(0.0, 9.5e5);
    assert!(far.len() == 1 && far[0].problem.contains("from the origin"), "{far:?}");
    assert!(far[0].accepted.contains("9.500e5"), "{far:?}");
}

/// Pressure that uses up the roundings of contacts is remarked on: p / E over a tenth of the rounding.
#[test]
fn rock_too_soft_for_its_pressure_is_remarked_on() {
    let squeeze = |modulus: &str| sound(SPECIMEN, &[("/rock/youngs_modulus", json!(modulus))]).squeeze();
    assert_eq!(squeeze("30 GPa"), None);
    assert_eq!(squeeze("0.45 GPa"), None);
    let soft = squeeze("40 MPa").expect("soft");
    assert!((soft.over_modulus - 0.02).abs() < 1e-12 && (soft.over_roundings - 10.0).abs() < 1e-9, "{soft}");
    // A deviatoric stress that a stage names comes on top: 0.8 and 7.2 MPa.
    let sheared = json!([{"kind": "consolidate", "pressure": "0.8 MPa"}, {"kind": "stress_shear", "deviatoric_stress": "7.2 MPa"}]);
    let set = [("/rock/youngs_modulus", json!("1.6 GPa")), ("/stages", sheared)];
    let sheared = sound(SPECIMEN, &set).squeeze().expect("soft");
    assert!((sheared.over_modulus - 0.005).abs() < 1e-12, "{sheared}");
    // A load of a body over its size: the ball of its volume is 0.124 m wide.
    assert_eq!(sound(SCENE, &[]).squeeze(), None);
    let soft = sound(SCENE, &[("/rock/youngs_modulus", json!("2 MPa"))]).squeeze().expect("soft");
    let size = 0.1 * (6.0 / std::f64::consts::PI).cbrt();
    assert!((soft.pressure * size * size - 1000.0).abs() < 1e-9, "{soft}");
    assert!(soft.to_string().starts_with("the load of \"block\" over its size"), "{soft}");
}

/// A press has its body between its plates: over its end where the plates are tied to it, at least with some of it elsewhere.
#[test]
fn bodies_beside_the_plates_of_a_press_are_refused() {
    let text = r#"{"rock": {"density": 2600, "youngs_modulus": "20 GPa", "poissons_ratio": 0.2, "damage": {"exponent": 3},
            "compressive_strength": "60 MPa", "tensile_strength": "6 MPa"}, "contact": {"friction": 0.4},
        "scene": {"press": {"body": "core", "bottom": "low", "top": "high", "grip": "rough"}, "bodies": [
            {"name": "low", "shape": {"box": [0.06, 0.04, 0.01]}, "position": [0, 0, -0.005], "fixed": true, "fidelity": "rigid"},
            {"name": "core", "shape": {"box": [0.05, 0.03, 0.08]}, "position": [0, 0, 0.04], "fidelity": "condensed"},
            {"name": "high", "shape": {"box": [0.06, 0.04, 0.01]}, "position": [0, 0, 0.085], "fidelity": "rigid"}]},
        "stages": [{"kind": "load", "bodies": {"high": {"displacement": [0, 0, -1e-5]}}}]}"#;
    let faults = |grip: &str, x: f64| {
        let set = [
            ("/scene/press/grip".to_string(), json!(grip)),
            ("/scene/bodies/1/position".to_string(), json!([x, 0, 0.04])),
        ];
        faults_of(text, &set)
    };
    for grip in ["rough", "frictionless", "tied"] {
        assert_eq!(faults(grip, 0.004), [], "{grip}");
        let aside = faults(grip, -0.07);
        assert!(aside.len() == 1 && aside[0].path == "$.scene.bodies[1].position", "{grip}: {aside:?}");
        assert!(aside[0].problem.contains("beside the plate below (x -0.0300 to 0.0300"), "{aside:?}");
    }
    // Half over the plate: held by nodes that the plate does not cover, or by those that it does.
    assert_eq!(faults("rough", 0.03), []);
    assert!(faults("tied", 0.03)[0].problem.contains("does not cover"));
    // A ball stands on a point.
    let ball = json!({"name": "core", "shape": {"sphere": 0.03}, "position": [0.02, 0.021, 0.03], "fidelity": "condensed"});
    let off = faults_of(text, &[("/scene/bodies/1".into(), ball)]);
    assert!(off.len() == 1 && off[0].value.contains("y 0.0210 to 0.0210"), "{off:?}");
}

/// What would be left unused without a word.
#[test]
fn scenes_refuse_what_they_have_no_use_for() {
    let set = [
        ("/rock/compressive_strength", json!(2e8)),
        ("/rock/tensile_strength", json!(2e7)),
        ("/rock/damage", json!({"exponent": 3})),
        ("/scene/bodies/1/rock", json!({"damage": {"exponent": 2}})),
        ("/scene/bodies/2/fidelity", json!("full")),
        ("/solver/energy_gate", json!("cut")),
    ];
    assert_eq!(not_yet(SCENE, &set), ["$.scene.bodies[1].rock.damage", "$.solver.energy_gate"]);
    // A block that would fill the memory.
    let fine =
        [("/scene/bodies/1/fidelity", json!("condensed")), ("/scene/bodies/1/mesh_size", json!(1.1e-4))];
    assert_eq!(not_yet(SCENE, &fine), ["$.scene.bodies[1].mesh_size"]);
}

#[test]
fn rubble_is_kept_by_grains_that_are_rigid_in_their_contacts() {
    let refused = |base: &str, overrides: &[(&str, Value)]| {
        let mut paths = not_yet(base, overrides);
        paths.retain(|path| path.ends_with("rubble"));
        paths
    };
    let kept = ("/rock/damage/rubble", json!("kept"));
    let [path, none]: [&[&str]; 2] = [&["$.rock.damage.rubble"], &[]];
    assert_eq!(refused(SPECIMEN, std::slice::from_ref(&kept)), none);
    assert_eq!(refused(SPECIMEN, &[kept.clone(), ("/solver/fidelity", json!("condensed"))]), path);
    assert_eq!(refused(SPECIMEN, &[kept.clone(), ("/solver/accuracy", json!(0.05))]), path);
    let removed = ("/rock/damage/rubble", json!("removed"));
    assert_eq!(refused(SPECIMEN, &[removed, ("/solver/fidelity", json!("condensed"))]), none);
    let strong = [("/rock/compressive_strength", json!(2e8)), ("/rock/tensile_strength", json!(2e7))];
    let damage = |rubble: &str| json!({"exponent": 3, "rubble": rubble});
    let scene = |rubble: &str| [("/rock/damage", damage(rubble)), strong[0].clone(), strong[1].clone()];
    assert_eq!(refused(SCENE, &scene("removed")), none);
    assert_eq!(refused(SCENE, &scene("kept")), path);
    let [_, compressive, tensile] = scene("removed");
    let own = ("/scene/bodies/1/rock/damage", damage("kept"));
    assert_eq!(refused(SCENE, &[own, compressive, tensile]), ["$.scene.bodies[1].rock.damage.rubble"]);
}

/// The older form of the energy gate, a number, is a tolerance that is warned at.
#[test]
fn an_energy_gate_may_be_a_tolerance() {
    let mut raw = RawCase::parse(Path::new("x.json"), SPECIMEN).expect("JSON");
    raw.set(&[("/solver/energy_gate".into(), json!(0.02))]);
    let solver = raw.check().expect("sound").solver;
    assert_eq!((solver.energy_gate, solver.energy_tolerance), (Some(GateCase::Warn), 0.02));
}

#[test]
fn sound_cases_have_no_faults() {
    assert_eq!(faults_of(SPECIMEN, &[]), []);
    assert_eq!(faults_of(SCENE, &[]), []);
}

/// Base, pointer, new JSON value (empty: key removed), path of the fault, its value, words of the message.
type Row = (&'static str, &'static str, &'static str, &'static str, &'static str, &'static [&'static str]);

#[rustfmt::skip]
const BROKEN: &[Row] = &[
    // Missing, unknown, wrong types.
    (SPECIMEN, "/rock", "", "$.rock", "nothing", &["is missing", "density"]),
    (SPECIMEN, "/rock/density", "", "$.rock.density", "nothing", &["is missing", "kg/m3"]),
    (SPECIMEN, "/stages", "", "$.stages", "nothing", &["is missing"]),
    (SPECIMEN, "/stages/1/axial_strain", "", "$.stages[1].axial_strain", "nothing", &["is missing"]),
    (SPECIMEN, "/stages/1/kind", "", "$.stages[1].kind", "nothing", &["is missing", "\"shear\""]),
    (SPECIMEN, "/rock/youngs_modulus/mean", "", "$.rock.youngs_modulus.mean", "nothing", &["is missing", "0.8 MPa", "1e13 Pa"]),
    (SPECIMEN, "/rock/yongs_modulus", "1", "$.rock.yongs_modulus", "1", &["unknown key", "poissons_ratio"]),
    (SPECIMEN, "/colour", "\"red\"", "$.colour", "\"red\"", &["unknown key", "specimen, scene, rock"]),
    (SPECIMEN, "/solver/force_tolerence", "1e-3", "$.solver.force_tolerence", "0.001", &["did you mean \"force_tolerance\"?"]),
    (SPECIMEN, "/stages/1/axial_strains", "0.1", "$.stages[1].axial_strains", "0.1", &["unknown key"]),
    (SPECIMEN, "/rock", "5", "$.rock", "5", &["is a number where an object is needed"]),
    (SPECIMEN, "/rock/density", "[2180]", "$.rock.density", "[2180]", &["is a list where a density is needed"]),
    (SPECIMEN, "/title", "5", "$.title", "5", &["is a number where a text is needed"]),
    (SPECIMEN, "/output/contacts", "\"yes\"", "$.output.contacts", "\"yes\"", &["true or false"]),
    (SPECIMEN, "/seed", "1.5", "$.seed", "1.5", &["whole number"]),
    (SPECIMEN, "/seed", "99999999999999999999", "$.seed", "1e", &["is too large: must be at most 18446744073709551615"]),
    (SPECIMEN, "/seed", "1e17", "$.seed", "1e", &["is too large to be exact so"]),
    (SPECIMEN, "/specimen/cells_per_grain", "1e17", "$.specimen.cells_per_grain", "1e", &["must be at most 100000"]),
    (SPECIMEN, "/seed", "-1", "$.seed", "-1", &["must not be negative"]),
    (SPECIMEN, "/specimen/vertices", "[8]", "$.specimen.vertices", "[8]", &["has 1 items where 2 are needed"]),
    (SPECIMEN, "/specimen/vertices", "[16, 8]", "$.specimen.vertices", "[16, 8]", &["larger number first"]),
    (SPECIMEN, "/stages", "[]", "$.stages", "[]", &["is empty", "consolidate"]),
    // Overrides go astray beside keys that the case does give.
    (SPECIMEN, "/contact/fricton", "0.3", "$.contact.fricton", "0.3", &["did you mean \"friction\"?"]),
    (SPECIMEN, "/stages/1/incremnt", "1e-4", "$.stages[1].incremnt", "0.0001", &["did you mean \"increment\"?"]),
    (SPECIMEN, "/stages/1/kind", "\"sheer\"", "$.stages[1].kind", "\"sheer\"", &["did you mean \"shear\"?"]),
    (SPECIMEN, "/stages/1", "7", "$.stages[1]", "7", &["is a number where an object is needed"]),
    (SPECIMEN, "/solver/fidelity", "\"rigit\"", "$.solver.fidelity", "\"rigit\"", &["did you mean \"rigid\"?", "\"condensed\""]),
    (SPECIMEN, "/membrane/kind", "\"latex\"", "$.membrane.kind", "\"latex\"", &["unknown kind", "\"rubber\""]),
    // Units and ranges.
    (SPECIMEN, "/stages/0/pressure", "\"300 mm\"", "$.stages[0].pressure", "\"300 mm\"", &["is a length where a pressure is needed"]),
    (SPECIMEN, "/stages/0/pressure", "\"0.8 Mpa\"", "$.stages[0].pressure", "\"0.8 Mpa\"", &["did you mean \"MPa\"?"]),
    (SPECIMEN, "/stages/0/pressure", "\"0.8\"", "$.stages[0].pressure", "\"0.8\"", &["has no unit", "MPa"]),
    (SPECIMEN, "/stages/0/pressure", "\"0,8 MPa\"", "$.stages[0].pressure", "\"0,8 MPa\"", &["comma"]),
    (SPECIMEN, "/stages/0/pressure", "\"-0.8 MPa\"", "$.stages[0].pressure", "\"-0.8 MPa\"", &["must be positive"]),
    (SPECIMEN, "/stages/0/pressure", "0", "$.stages[0].pressure", "0", &["must be positive"]),
    (SPECIMEN, "/rock/density", "\"NaN\"", "$.rock.density", "\"NaN\"", &["not a finite number"]),
    (SPECIMEN, "/rock/density", "-2180", "$.rock.density", "-2180", &["must be positive"]),
    (SPECIMEN, "/rock/youngs_modulus/mean", "30", "$.rock.youngs_modulus.mean", "30", &["must be at least 1000 Pa", "a plain number is in Pa"]),
    (SPECIMEN, "/rock/poissons_ratio", "0.5", "$.rock.poissons_ratio", "0.5", &["must be below 0.495"]),
    (SPECIMEN, "/rock/poissons_ratio", "{\"mean\": 0.2, \"weibull_shape\": 2}", "$.rock.poissons_ratio", "weibull", &["one cell in a million", "below 0.495"]),
    (SPECIMEN, "/rock/youngs_modulus/law", "\"lognormal\"", "$.rock.youngs_modulus.weibull_shape", "20.0", &["does not belong to the law \"lognormal\""]),
    (SPECIMEN, "/rock/youngs_modulus/weibull_shape", "-3", "$.rock.youngs_modulus.weibull_shape", "-3", &["must be at least 0.5"]),
    (SPECIMEN, "/rock/damage", "false", "$.rock.damage", "false", &["is a true/false", "null, or an object with the keys exponent"]),
    (SPECIMEN, "/stages/0/kind", "\"Shear\"", "$.stages[0].kind", "\"Shear\"", &["did you mean \"shear\"?"]),
    (SPECIMEN, "/rock/damage/exponent", "1", "$.rock.damage.exponent", "1", &["must be above 1"]),
    (SPECIMEN, "/rock/tensile_strength", "\"300 MPa\"", "$.rock.tensile_strength", "300 MPa", &["exceeds the compressive strength 250000000"]),
    (SPECIMEN, "/rock/tensile_strength", "", "$.rock.tensile_strength", "nothing", &["damage needs it"]),
    (SPECIMEN, "/contact/friction", "-0.1", "$.contact.friction", "-0.1", &["must not be negative"]),
    (SPECIMEN, "/contact/residual_friction", "0.7", "$.contact.residual_friction", "0.7", &["exceeds the peak friction 0.65"]),
    (SPECIMEN, "/contact/faces", "\"edges\"", "$.contact.faces", "\"edges\"", &["is not one of the choices"]),
    (SPECIMEN, "/contact/normal", "\"hertz\"", "$.contact.normal", "\"hertz\"", &["is not one of the choices"]),
    (SPECIMEN, "/contact/limit_pressure", "0", "$.contact.limit_pressure", "0", &["must be positive"]),
    (SPECIMEN, "/solver/first_penalty", "1e4", "$.solver.first_penalty", "10000.0", &["must be at most 1000"]),
    (SPECIMEN, "/contact/rounding", "0.5", "$.contact.rounding", "0.5", &["must be at most 0.1"]),
    (SPECIMEN, "/stages/1/axial_strain", "15", "$.stages[1].axial_strain", "15", &["must be at most 0.5: did you mean \"15 %\"?"]),
    (SPECIMEN, "/stages/1/axial_strain", "5e-5", "$.stages[1].increment", "0.0001", &["exceeds the stage's axial_strain"]),
    (SPECIMEN, "/stages/1/increment", "0.2", "$.stages[1].increment", "0.2", &["exceeds the stage's axial_strain 0.15"]),
    (SPECIMEN, "/stages/1/increment", "1e-9", "$.stages[1].increment", "1e-9", &["makes more than 1e7 increments", "at least 1.5e-8"]),
    // Specimen.
    (SPECIMEN, "/specimen", "", "$", "neither", &["has neither a specimen nor a scene"]),
    (SPECIMEN, "/scene", "{\"bodies\": [{\"name\": \"a\", \"shape\": {\"sphere\": 1}}]}", "$.scene", "both", &["stands beside a specimen"]),
    (SPECIMEN, "/specimen/grading", "[[\"60 mm\", 1]]", "$.specimen.grading", "[[\"60 mm\",1]]", &["has 1 items where at least 2"]),
    (SPECIMEN, "/specimen/grading/1/1", "1.2", "$.specimen.grading[1][1]", "1.2", &["must be at most 1"]),
    (SPECIMEN, "/specimen/grading/1/0", "\"70 mm\"", "$.specimen.grading", "[0.07 m, 0.62]", &["is not monotone", "[0.06 m, 1]"]),
    (SPECIMEN, "/specimen/grading", "[[0.06, 1], [0.05, 0.3], [0.04, 0.5], [0.02, 0]]", "$.specimen.grading", "[0.04 m, 0.5]", &["is not monotone", "passing share"]),
    (SPECIMEN, "/specimen/grading/0/1", "0.9", "$.specimen.grading", "[0.06 m, 0.9]", &["must begin with 1 passing"]),
    (SPECIMEN, "/specimen/grading/2/1", "0.1", "$.specimen.grading", "[0.02 m, 0.1]", &["must end with 0 passing"]),
    (SPECIMEN, "/specimen/grading/0/0", "\"250 mm\"", "$.specimen.grading", "0.25 m", &["too large for a specimen 0.3000 m wide"]),
    (SPECIMEN, "/specimen/diameter", "300", "$.specimen", "300 m x 0.65 m", &["grains of this grading", "a plain number is in m"]),
    (SPECIMEN, "/specimen/height", "", "$.specimen", "diameter", &["is not sized", "grains and aspect"]),
    (SPECIMEN, "/specimen/grains", "80", "$.specimen.grains", "80", &["disagrees with diameter, height", "within 5 %"]),
    (SPECIMEN, "/specimen/aspect", "2", "$.specimen.aspect", "2", &["disagrees with height over diameter", "2.1667"]),
    (SPECIMEN, "/specimen/void_ratio", "-0.4", "$.specimen.void_ratio", "-0.4", &["must be at least 0.05"]),
    (SPECIMEN, "/specimen/vertices", "[64, 64]", "$.specimen.vertices", "[64, 64]", &["makes no grains", "smaller vertex_separation"]),
    // Stages.
    (SPECIMEN, "/stages/0", "{\"kind\": \"hold\"}", "$.stages[0].kind", "\"hold\"", &["has no consolidate stage before it"]),
    (SPECIMEN, "/stages/1/increment_max", "1e-5", "$.stages[1].increment_max", "0.00001", &["is below the stage's increment 0.0001"]),
    (SPECIMEN, "/stages/1/until", "{\"drop_after_peak\": 1}", "$.stages[1].until.drop_after_peak", "1", &["must be below 1"]),
    (SPECIMEN, "/solver/energy_gate", "\"loud\"", "$.solver.energy_gate", "\"loud\"", &["is none of what is accepted", "\"warn\", \"cut\""]),
    (SPECIMEN, "/plates/tilting", "\"some\"", "$.plates.tilting", "\"some\"", &["is not one of the choices"]),
    (SPECIMEN, "/stages/0/pressure", "", "$.stages[0]", "nothing", &["gives no pressure", "axial_pressure"]),
    (SPECIMEN, "/stages/0/axial_pressure", "1e6", "$.stages[0]", "pressure and more", &["isotropic pressure and an axial"]),
    (SPECIMEN, "/stages/1/pressure", "\"0.4 MPa\"", "$.stages[1].pressure", "0.4 MPa", &["is not the pressure 800000 Pa"]),
    (SPECIMEN, "/stages/2", "{\"kind\": \"hold\"}", "$.stages[3].kind", "\"reload\"", &["has no unload stage before it"]),
    (SPECIMEN, "/stages/3", "{\"kind\": \"load\"}", "$.stages[3].kind", "\"load\"", &["this case has a specimen"]),
    // Scenes.
    (SCENE, "/stages/0", "{\"kind\": \"shear\", \"axial_strain\": 0.1}", "$.stages[0].kind", "\"shear\"", &["this case has a scene"]),
    (SCENE, "/plates", "{}", "$.plates", "{}", &["belongs to a specimen"]),
    (SCENE, "/scene/bodies", "[]", "$.scene.bodies", "[]", &["is empty"]),
    (SCENE, "/scene/bodies/1/name", "\"plane\"", "$.scene.bodies[1].name", "\"plane\"", &["names a second body"]),
    (SCENE, "/scene/bodies/2/name", "\"a/b\"", "$.scene.bodies[2].name", "\"a/b\"", &["without /"]),
    (SCENE, "/scene/bodies/2/name", "\"a\\tb\"", "$.scene.bodies[2].name", "\"a\\tb\"", &["cannot name a group", "control characters"]),
    (SCENE, "/scene/bodies/2/shape", "{\"sphere\": 0.02, \"box\": [1, 1, 1]}", "$.scene.bodies[2].shape", "sphere", &["box and sphere where one is needed"]),
    (SCENE, "/scene/bodies/2/shape", "{}", "$.scene.bodies[2].shape", "{}", &["has none of the keys", "polyhedron"]),
    (SCENE, "/scene/bodies/2/shape", "{\"shpere\": 0.02}", "$.scene.bodies[2].shape.shpere", "0.02", &["did you mean \"sphere\"?"]),
    (SCENE, "/scene/bodies/2/shape", "{\"mesh\": \"nowhere.vtu\"}", "$.scene.bodies[2].shape.mesh", "\"nowhere.vtu\"", &["is not there", "relative to the case file"]),
    (SCENE, "/scene/bodies/2/shape", "{\"mesh\": \"ball.stl\"}", "$.scene.bodies[2].shape.mesh", "\"ball.stl\"", &["is a surface, which has no cells", "\"hull\""]),
    (SCENE, "/scene/bodies/3/shape/polyhedron", "[[0,0,0],[1,0,0],[0,1,0],[1,1,0]]", "$.scene.bodies[3].shape.polyhedron", "[[0.0,0.0", &["has no volume"]),
    (SCENE, "/scene/bodies/3/shape/polyhedron", "[[0,0,0],[1,0,0],[0,1,0]]", "$.scene.bodies[3].shape.polyhedron", "[[0,0,0]", &["has 3 items where at least 4"]),
    (SCENE, "/scene/bodies/1/position", "[0, 0, 0.049]", "$.scene.bodies[1]", "\"block\"", &["overlaps \"plane\" by 1.000e-3 m"]),
    (SCENE, "/scene/bodies/2/position", "[0.05, 0, 0.05]", "$.scene.bodies[2]", "\"ball\"", &["overlaps \"block\""]),
    (SCENE, "/scene/bodies/1/rounding", "\"60 mm\"", "$.scene.bodies[1].rounding", "60 mm", &["does not fit into the body"]),
    (SCENE, "/scene/bodies/1/fidelity", "\"auto\"", "$.scene.bodies[1].fidelity", "\"auto\"", &["not one of the choices", "\"condensed\""]),
    (SCENE, "/scene/bodies/1/rock/densty", "5", "$.scene.bodies[1].rock.densty", "5", &["unknown key"]),
    (SCENE, "/scene/bodies/1/rock", "{\"damage\": {}, \"compressive_strength\": 1e8}", "$.scene.bodies[1].rock.tensile_strength", "nothing", &["damage needs it"]),
    (SCENE, "/stages/0/bodies/blok", "{}", "$.stages[0].bodies.blok", "\"blok\"", &["unknown body", "did you mean \"block\"?", "plane, block, ball, roof"]),
    (SCENE, "/stages/0/bodies/plane", "{\"force\": [0, 0, 1]}", "$.stages[0].bodies.plane", "force", &["which is fixed"]),
    (SCENE, "/stages/0/bodies/block/force", "[1, null, null]", "$.stages[0].bodies.block.force[0]", "1", &["displacement prescribes"]),
    (SCENE, "/stages/0/bodies/block/force", "[\"1 mm\", 0, 0]", "$.stages[0].bodies.block.force[0]", "\"1 mm\"", &["is a length where a force is needed"]),
    (SCENE, "/stages", "[{\"kind\": \"load\", \"bodies\": {\"block\": {\"displacement\": [1e-3, null, null]}}}, {\"kind\": \"load\", \"bodies\": {\"block\": {\"force\": [5, 5, 0]}}}]", "$.stages[1].bodies.block.force[0]", "5", &["stage 0 prescribed", "stays held", "frees it"]),
    (SCENE, "/stages/0/increments", "0", "$.stages[0].increments", "0", &["must be at least 1"]),
    (SCENE, "/scene/gravity", "9.81", "$.scene.gravity", "9.81", &["is a number where a list is needed"]),
];

#[test]
fn each_fault_is_named() {
    let wrong: Vec<_> = BROKEN.iter().filter_map(|row| misnamed(row).err()).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

fn misnamed((base, pointer, value, path, found, words): &Row) -> Result<(), String> {
    let faults = changed(base, pointer, value);
    let all: Vec<_> = faults.iter().map(Fault::to_string).collect();
    let wrong = |what: String| Err(format!("{pointer} = {value}: {what} in {all:#?}"));
    let Some(fault) = faults.iter().find(|fault| fault.path == *path) else {
        return wrong(format!("no fault at {path}"));
    };
    if !fault.value.contains(found) {
        return wrong(format!("found {} and not {found}", fault.value));
    }
    if let Some(word) = words.iter().find(|word| !fault.to_string().contains(**word)) {
        return wrong(format!("no \"{word}\""));
    }
    // One slip, one fault.
    if faults.len() == 1 { Ok(()) } else { wrong("more than one fault".into()) }
}

#[test]
fn all_faults_are_listed_at_once() {
    let text = r#"{
      "specimen": {"diameter": "300 mm", "height": "0.8 MPa", "void_ratio": 0.47, "grading": [[0.06, 1], [0.02, 0.1]]},
      "rock": {"density": NaN, "youngs_modulus": 1e999, "poissons_ratio": 0.6, "colour": "grey"},
      "contact": {"frictoin": 0.65},
      "stages": [{"kind": "shear", "axial_strain": -0.1}, {"kind": "twist"}],
    }"#;
    let faults = faults_of(text, &[]);
    let paths: std::collections::BTreeSet<_> = faults.iter().map(|fault| fault.path.as_str()).collect();
    let expected = [
        "$.contact.frictoin",
        "$.rock.colour",
        "$.rock.density",
        "$.rock.poissons_ratio",
        "$.rock.youngs_modulus",
        "$.specimen.grading",
        "$.specimen.height",
        "$.stages[0].axial_strain",
        "$.stages[0].kind",
        "$.stages[1].kind",
    ];
    assert_eq!(paths.into_iter().collect::<Vec<_>>(), expected);
    assert_eq!(faults.len(), expected.len());
    let density = faults.iter().find(|fault| fault.path == "$.rock.density").expect("a fault");
    assert_eq!((density.value.as_str(), density.problem.as_str()), ("NaN", "is not a finite number"));
}

#[test]
fn a_key_given_twice_is_a_fault() {
    let faults = faults_of(&SPECIMEN.replacen("\"seed\": 7", "\"seed\": 7,\n\"seed\": 8", 1), &[]);
    assert_eq!(faults.len(), 1);
    assert_eq!(faults[0].path, "$.seed");
    assert!(faults[0].problem.contains("second time in line 3"), "{}", faults[0]);
}

#[test]
fn a_misspelt_required_key_is_one_fault() {
    let faults = faults_of(&SPECIMEN.replace("\"density\"", "\"densty\""), &[]);
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert!(faults[0].problem.contains("did you mean \"density\"?"));
}

#[test]
fn what_is_not_json_is_located() {
    let texts: &[(&str, usize, &str)] = &[
        ("", 1, "empty"),
        ("// only a comment", 1, "empty"),
        ("{\n  \"title\": \"x\",\n  \"seed\" 5\n}", 3, "colon"),
        ("{\n  \"title\": \"x\"\n  \"seed\": 5\n}", 2, "comma"),
        ("{\"title\": 'x'}", 1, "single-quoted"),
        ("{\"title\": \"x", 1, "string"),
        ("{seed: 5}", 1, "string"),
        ("{\"seed\": 0x10}", 1, "hexadecimal"),
        ("{} {}", 1, "more than one"),
        ("[[[", 1, "unterminated"),
    ];
    for (text, at, word) in texts {
        match RawCase::parse(Path::new("x.json"), text) {
            Err(Error::Json { line, message, .. }) => {
                assert_eq!(line, *at, "{text}: {message}");
                assert!(message.to_lowercase().contains(word), "{text}: {message}");
            }
            other => panic!("{text}: {other:?}"),
        }
    }
}

#[test]
fn deep_nesting_and_odd_roots_do_not_panic() {
    let deep = "[".repeat(100_000);
    assert!(matches!(RawCase::parse(Path::new("x"), &deep), Err(Error::Json { .. })));
    for text in ["null", "5", "\"x\"", "[]", "true", "{}", "NaN", "\u{feff}{}"] {
        assert!(!faults_of(text, &[]).is_empty(), "{text}");
    }
}

#[test]
fn comments_trailing_commas_and_schema_are_fine() {
    let text = SPECIMEN.replacen('{', "{ // a comment\n \"$schema\": \"x\", /* another */", 1);
    let text = text.replace("\"contacts\": true}", "\"contacts\": true,},");
    assert_eq!(faults_of(&text, &[]), []);
}

#[test]
fn overrides_are_applied_before_the_check() {
    let set = |argument: &str| faults_of(SPECIMEN, &[parse_override(argument).expect("an override")]);
    assert_eq!(set("/stages/0/pressure=0.4 MPa"), []);
    assert_eq!(set("/stages/1/increment=2e-4"), []);
    assert_eq!(set("/solver/force_tolerance=1e-4"), []);
    let mut raw = RawCase::parse(Path::new("x"), SPECIMEN).expect("JSON");
    raw.set(&[parse_override("/solver/force_tolerance=1e-4").expect("an override")]);
    assert_eq!(raw.check().expect("a case").solver.force_tolerance, 1e-4);

    let named = |argument: &str, path: &str, word: &str| {
        let faults = set(argument);
        assert_eq!(faults.len(), 1, "{argument}: {faults:?}");
        assert_eq!(faults[0].path, path);
        assert!(faults[0].to_string().contains(word), "{}", faults[0]);
    };
    named("stages=1", "--set stages", "must begin with /");
    named("/stages/9/increment=1", "--set /stages/9/increment", "an index from 0 to 3");
    named("/seed/x=1", "--set /seed/x", "has no keys");
    named("/solver/tolerance=1", "$.solver.tolerance", "unknown key");
    assert!(parse_override("/seed").is_err());
    // An override heals the fault that it replaces.
    assert_eq!(
        faults_of(&SPECIMEN.replace("\"seed\": 7", "\"seed\": NaN"), &[("/seed".into(), json!(1))]),
        []
    );
}

/// Puts `new` at the `at`-th place of the tree, counted depth first.
fn replace_nth(tree: &mut Value, at: &mut usize, new: &Value) {
    if *at == 0 {
        *tree = new.clone();
    }
    *at = at.wrapping_sub(1);
    match tree {
        Value::Array(items) => items.iter_mut().for_each(|item| replace_nth(item, at, new)),
        Value::Object(map) => map.values_mut().for_each(|item| replace_nth(item, at, new)),
        _ => {}
    }
}

fn odd_value() -> impl Strategy<Value = Value> {
    prop_oneof![
        Just(Value::Null),
        any::<bool>().prop_map(Value::from),
        any::<f64>().prop_map(|x| json!(x)),
        any::<i64>().prop_map(Value::from),
        (-3.0..3.0_f64).prop_map(|x| json!(x)),
        ".{0,12}".prop_map(Value::from),
        "-?[0-9]{1,3}(\\.[0-9])? ?(mm|MPa|deg|N m|%|kN)".prop_map(Value::from),
        Just(json!([])),
        Just(json!({})),
        Just(json!([0, 0, 0])),
        Just(json!({"kind": "load", "bodies": {"ball": {"moment": [1, null, 2]}}})),
        Just(json!({"sphere": 1e-9})),
        Just(json!({"polyhedron": [[0, 0, 0], [1e-9, 0, 0], [0, 1e9, 0], [0, 0, 1]]})),
    ]
}

/// What a mutated case does instead of panicking: it has faults, or it reads back from its completion.
fn faulty_or_completed(base: &str, mutations: Vec<(usize, Value)>) -> Result<(), TestCaseError> {
    let mut tree: Value = serde_json::from_str(base).expect("JSON");
    for (mut at, new) in mutations {
        replace_nth(&mut tree, &mut at, &new);
    }
    let raw = RawCase::parse(Path::new("x"), &tree.to_string()).expect("JSON");
    match raw.check() {
        Ok(case) => {
            let text = case.completed().to_string();
            let again = RawCase::parse(Path::new("x"), &text).and_then(|raw| raw.check());
            prop_assert_eq!(again.map_err(|e| e.to_string()), Ok(case));
        }
        Err(Error::Case { faults, .. }) => {
            prop_assert!(!faults.is_empty());
            prop_assert!(faults.iter().all(|fault| !fault.problem.contains("please report")), "{:?}", faults);
        }
        Err(other) => prop_assert!(false, "{}", other),
    }
    Ok(())
}

fn mutations() -> impl Strategy<Value = Vec<(usize, Value)>> {
    prop::collection::vec((0..90_usize, odd_value()), 1..4)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn mutated_scenes_never_panic(mutations in mutations()) {
        faulty_or_completed(SCENE, mutations)?;
    }

    #[test]
    fn mutated_text_never_panics(at in 0..1000_usize, length in 0..10_usize, new in ".{0,4}") {
        let chars: Vec<char> = SCENE.chars().collect();
        let at = at.min(chars.len());
        let text: String = chars[..at].iter().chain(&new.chars().collect::<Vec<_>>())
            .chain(&chars[(at + length).min(chars.len())..]).collect();
        if let Ok(raw) = RawCase::parse(Path::new("x"), &text) {
            let _ = raw.check();
        }
    }
}

proptest! {
    // Few: each sound one draws 2048 grains to learn their mean volume.
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn mutated_specimens_never_panic(mutations in mutations()) {
        faulty_or_completed(SPECIMEN, mutations)?;
    }
}
