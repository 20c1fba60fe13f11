//! A scene's results file holds what the scene driver found. What each case of `cases/scenes/` has to come to
//! is judged in `verification`.

use std::path::{Path, PathBuf};

use riprap::case::{Case, RawCase};
use riprap::loading::StageEnd;
use riprap::results::{Existing, Reader};
use riprap::scene::Scene;
use riprap::setup::scene_parameters;
use riprap::simulation::{End, Observer, Options, run};
use serde_json::{Value, json};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/scenes")
}

#[test]
fn results_hold_every_body() {
    let file = folder().join("push.json");
    let case = riprap::case::read(&file).and_then(|raw| raw.check()).unwrap_or_else(|e| panic!("{e}"));
    let results = tempfile::tempdir().expect("a folder");
    let path = results.path().join("push.h5");
    let mut pushes = vec![];
    let end = built(&case, &folder()).run(|_, row| {
        pushes.push(row.bodies[1].reaction_force.x);
        true
    });
    assert_eq!(end, StageEnd::Finished);
    struct Nobody;
    impl Observer for Nobody {}
    let raw = riprap::case::read(&file).unwrap_or_else(|e| panic!("{e}"));
    let options =
        Options { out: path.clone(), existing: Existing::Refuse, threads: 1, profile: false, audit: false };
    let outcome = run(&case, &raw, &options, &mut Nobody).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(outcome.end, End::Finished);
    let reader = Reader::open(&path).unwrap_or_else(|e| panic!("{e}"));
    let read = reader.floats("bodies/block/reaction_force").unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(read.iter().step_by(3).copied().collect::<Vec<_>>(), pushes);
    assert_eq!(reader.increments().unwrap_or_default(), 105);
    assert_eq!(reader.members("bodies").unwrap_or_default(), ["plane", "block"]);
}

/// An elastic block, its faces on those of fixed walls as a user writes them, under a load. Walls that do not yield press the sides with `K0 = nu / (1 - nu)`
/// of it. What is left between them and the block's mesh is a layer as thick as its rounding t in simple compression (`Model::patch_stiffness`), on the half
/// width b: `K0 = nu / (1 - nu + (1 - nu^2) t / b)`, 4.6 and 5.1 % less. Uniform stress, which tet10 cells have exactly: 1e-6 by the solver's tolerances.
#[test]
fn fixed_walls_hold_a_block_at_its_sides() {
    for nu in [0.2, 0.35] {
        let wall = |name: &str, size: [f64; 3], at: [f64; 3]| {
            format!(
                r#"{{"name": "{name}", "shape": {{"box": {size:?}}}, "position": {at:?}, "fixed": true, "fidelity": "rigid"}}"#
            )
        };
        let walls = [
            wall("bottom", [0.04, 0.04, 0.02], [0.0, 0.0, -0.01]),
            wall("left", [0.02, 0.04, 0.04], [-0.03, 0.0, 0.02]),
            wall("right", [0.02, 0.04, 0.04], [0.03, 0.0, 0.02]),
            wall("front", [0.04, 0.02, 0.04], [0.0, -0.03, 0.02]),
            wall("back", [0.04, 0.02, 0.04], [0.0, 0.03, 0.02]),
        ];
        let text = format!(
            r#"{{"scene": {{"bodies": [{},
                {{"name": "block", "shape": {{"box": [0.04, 0.04, 0.04]}}, "position": [0, 0, 0.02],
                  "fidelity": "condensed", "mesh_size": 0.02}},
                {{"name": "lid", "shape": {{"box": [0.04, 0.04, 0.02]}}, "position": [0, 0, 0.05], "fidelity": "rigid"}}]}},
              "rock": {{"density": 2500, "youngs_modulus": 3e10, "poissons_ratio": {nu}}},
              "contact": {{"friction": 0, "faces": "area"}},
              "stages": [{{"kind": "load", "increments": 2, "bodies":
                {{"lid": {{"displacement": [0, 0, null], "force": [null, null, -20], "rotation": [0, 0, 0]}}}}}}],
              "solver": {{"gap_tolerance": 1e-11, "force_tolerance": 1e-6}}}}"#,
            walls.join(", ")
        );
        let raw = riprap::case::RawCase::parse(Path::new("k0.json"), &text).unwrap_or_else(|e| panic!("{e}"));
        let case = raw.check().unwrap_or_else(|e| panic!("{e}"));
        let mut sides = [0.0; 4];
        let end = built(&case, Path::new(".")).run(|_, row| {
            sides = [1, 2]
                .map(|i| row.bodies[i].contact_force.x.abs())
                .into_iter()
                .chain([3, 4].map(|i| row.bodies[i].contact_force.y.abs()))
                .collect::<Vec<f64>>()
                .try_into()
                .expect("four");
            true
        });
        assert_eq!(end, StageEnd::Finished);
        for side in sides {
            let (found, layer) = (side / 20.0, 0.02 * 0.04 / 0.02);
            let expected = nu / (1.0 - nu + (1.0 - nu * nu) * layer);
            assert!((found / expected - 1.0).abs() < 1e-6, "nu {nu}: K0 {found} of {expected}");
        }
    }
}

/// The scene of a case, its files relative to `folder`.
fn built(case: &Case, folder: &Path) -> Scene {
    let parameters = scene_parameters(case, folder).unwrap_or_else(|e| panic!("{e}"));
    Scene::new(&parameters).unwrap_or_else(|e| panic!("{e}"))
}

/// The scene of a case in text, its files relative to `folder`.
fn scene_of(text: &Value, folder: &Path) -> Scene {
    let raw = RawCase::parse(Path::new("a.json"), &text.to_string()).unwrap_or_else(|e| panic!("{e}"));
    let case = raw.check().unwrap_or_else(|e| panic!("{e}"));
    built(&case, folder)
}

fn case_of(bodies: Value, stages: Value) -> Value {
    json!({"title": "a scene", "scene": {"bodies": bodies}, "stages": stages,
        "rock": {"density": 2600, "youngs_modulus": "20 GPa", "poissons_ratio": 0.25}, "contact": {"friction": 0.5}})
}

/// Whatever it is meshed with. Tolerance: rounding over some thousand cells.
#[test]
fn balls_weigh_what_balls_weigh() {
    let radius: f64 = 0.013;
    let weight = 2600.0 * 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    for (fidelity, size) in [("rigid", 0.01), ("condensed", 0.01), ("condensed", 4e-3), ("full", 0.01)] {
        let ball =
            json!([{"name": "ball", "shape": {"sphere": radius}, "fidelity": fidelity, "mesh_size": size}]);
        let scene = scene_of(&case_of(ball, json!([{"kind": "load"}])), Path::new(""));
        let mass = scene.model.bodies[0].mass;
        assert!((mass / weight - 1.0).abs() < 1e-12, "{fidelity} {size}: {mass} of {weight}");
        if let Some(grain) = scene.model.bodies[0].grain() {
            let own = grain.mass_properties().mass;
            assert!((own / weight - 1.0).abs() < 1e-12, "{fidelity} {size}: its cells {own} of {weight}");
        }
    }
}

/// Vertices of a box about `centre`, which the case gives in site coordinates, its position at their origin.
fn site_box(centre: [f64; 3], half: [f64; 3]) -> Value {
    let corner = |k: usize| -> Vec<f64> {
        (0..3).map(|i| centre[i] + if k >> i & 1 == 1 { half[i] } else { -half[i] }).collect()
    };
    json!((0..8).map(corner).collect::<Vec<_>>())
}

/// Rows of a block of 0.08 x 0.04 x 0.06 m on a floor, both given `x`, `y` [m] from where the case places them.
fn rows_of_far_block(
    [x, y]: [f64; 2],
    block: &Value,
    stages: Value,
    change: impl Fn(&mut Value),
) -> Vec<riprap::scene::Row> {
    let floor = site_box([x, y, -0.05], [0.3, 0.3, 0.05]);
    let mut made =
        json!({"name": "block", "shape": {"polyhedron": site_box([x, y, 0.03], [0.04, 0.02, 0.03])}});
    for (key, value) in block.as_object().into_iter().flatten() {
        made[key.as_str()] = value.clone();
    }
    let bodies = json!([
        {"name": "floor", "shape": {"polyhedron": floor}, "fixed": true, "fidelity": "rigid"}, made]);
    let mut case = case_of(bodies, stages);
    change(&mut case);
    let mut rows = vec![];
    let end = scene_of(&case, Path::new("")).run(|_, row| {
        rows.push(row.clone());
        true
    });
    assert_eq!(end, StageEnd::Finished, "{block}");
    rows
}

const BLOCK_WEIGHT: f64 = 2600.0 * 0.08 * 0.04 * 0.06 * 9.81;

/// Statics: a block on a floor carries its weight, wherever the two lie and however it deforms. Motion and place are told about the point that
/// the case names.
#[test]
fn bodies_far_from_their_reference_points_rest() {
    let [x, y] = [2400.0, -1700.0];
    let breakable = json!({"damage": {}, "tensile_strength": "8 MPa", "compressive_strength": "90 MPa"});
    for (block, rock) in [
        (json!({"fidelity": "rigid"}), json!({})),
        (json!({"fidelity": "condensed", "mesh_size": 0.03}), json!({})),
        (json!({"fidelity": "condensed", "mesh_size": 0.04}), breakable),
        (json!({"fidelity": "full", "mesh_size": 0.04}), json!({})),
    ] {
        let stages = json!([{"kind": "load", "increments": 3, "gravity": [0, 0, -9.81]}]);
        let rows = rows_of_far_block([x, y], &block, stages, |case| {
            for (key, value) in rock.as_object().into_iter().flatten() {
                case["rock"][key.as_str()] = value.clone();
            }
        });
        assert_eq!(rows.len(), 3, "{block}");
        let found = &rows[2].bodies[1];
        // The force tolerance.
        let force = found.contact_force.z;
        assert!((force / BLOCK_WEIGHT - 1.0).abs() < 1e-3, "{block} {rock}: {force} of {BLOCK_WEIGHT}");
        // Placed at the origin, moved by the overlap of a contact; the moment of its weight about there.
        assert!(found.position.norm() < 1e-3 && found.displacement.norm() < 1e-3, "{}", found.position);
        let moment = [y * force, -x * force];
        for (found, expected) in [found.contact_moment.x, found.contact_moment.y].iter().zip(moment) {
            assert!((found / expected - 1.0).abs() < 1e-6, "{block}: {found} {expected}");
        }
    }
}

/// A load about a point some hundred sizes off is its force: its moment about there is an arm, not what any contact carries.
#[test]
fn forces_are_not_judged_by_the_arm_of_a_reference_point() {
    let stages = json!([{"kind": "load", "increments": 3, "gravity": [0, 0, -9.81],
        "bodies": {"block": {"moment": [0, 0, 0]}}}]);
    for fidelity in ["rigid", "condensed"] {
        let block = json!({"fidelity": fidelity, "mesh_size": 0.03});
        let rows = rows_of_far_block([-33.0, 21.0], &block, stages.clone(), |_| {});
        let row = rows.last().expect("a row");
        let force = row.bodies[1].contact_force.z;
        assert!((force / BLOCK_WEIGHT - 1.0).abs() < 1e-3, "{fidelity}: {force} of {BLOCK_WEIGHT}");
        // Four corners carry it, or more.
        let judged = row.balance.reference_force;
        assert!(judged < 0.5 * BLOCK_WEIGHT, "{fidelity}: by {judged} N");
    }
}

/// Why a run of this case stopped.
fn reason_of(case: &Value) -> String {
    struct Nobody;
    impl Observer for Nobody {}
    let results = tempfile::tempdir().expect("a folder");
    let out = results.path().join("a.vtkhdf");
    let raw = RawCase::parse(Path::new("a.json"), &case.to_string()).unwrap_or_else(|e| panic!("{e}"));
    let case = raw.check().unwrap_or_else(|e| panic!("{e}"));
    let options = Options { out, existing: Existing::Refuse, threads: 1, profile: false, audit: false };
    match run(&case, &raw, &options, &mut Nobody).unwrap_or_else(|e| panic!("{e}")).end {
        End::Stopped { reason } => reason,
        End::Finished | End::Interrupted => panic!("did not stop"),
    }
}

/// The cause is the headline, where it is known, and not that there may be no equilibrium.
#[test]
fn runs_that_stop_say_why_first() {
    let bodies = json!([
        {"name": "slab", "shape": {"box": [0.3, 0.5, 0.08]}, "position": [0, 0, -0.04], "fixed": true},
        {"name": "brick", "shape": {"box": [0.06, 0.04, 0.05]}, "position": [0.01, 0, 0.025]}]);
    let falling = |gravity: f64, modulus: &str| {
        let stages = json!([{"kind": "load", "increments": 3, "gravity": [0, 0, -gravity]}]);
        let mut case = case_of(bodies.clone(), stages);
        case["rock"]["youngs_modulus"] = json!(modulus);
        reason_of(&case)
    };
    let soft = falling(9.81, "8 kPa");
    assert!(soft.starts_with("the load of \"brick\" over its size: a pressure of"), "{soft}");
    assert!(soft.contains("rock is too soft") && soft.contains("of its roundings; after"), "{soft}");
    let tiny = falling(2e-11, "20 GPa");
    assert!(tiny.starts_with("double precision does not resolve these forces"), "{tiny}");
}

/// Two soft blocks on each other, shortened by a fiftieth: more than small roundings leave room for, and large ones do.
#[test]
fn bodies_that_bend_past_their_roundings_are_told_of() {
    let squeezed = |rounding: f64| {
        let block = |name: &str, z: f64, size: f64| {
            json!({"name": name, "shape": {"box": [0.1, 0.1, 0.1]}, "position": [0, 0, z],
                "fidelity": "condensed", "mesh_size": size, "rounding": rounding})
        };
        let plate = |name: &str, z: f64| {
            json!({"name": name, "shape": {"box": [0.2, 0.2, 0.05]}, "position": [0, 0, z], "friction": 0,
                "fidelity": "rigid"})
        };
        let bodies = json!([
            plate("bottom", -0.025),
            block("lower", 0.05, 0.08),
            block("upper", 0.15, 0.05),
            plate("top", 0.225)
        ]);
        let still = json!([0, 0, 0]);
        let stages = json!([{"kind": "load", "increments": 8, "bodies": {
            "bottom": {"displacement": still, "rotation": still},
            "lower": {"displacement": [0, 0, null], "rotation": [null, null, 0]},
            "top": {"displacement": [0, 0, -0.004], "rotation": still}}}]);
        let mut case = case_of(bodies, stages);
        case["rock"]["youngs_modulus"] = json!(1e7);
        case
    };
    let reason = reason_of(&squeezed(5e-4));
    assert!(reason.starts_with("contact.rounding is too small for bodies that deform so much"), "{reason}");
    assert_eq!(scene_of(&squeezed(2e-3), Path::new("")).run(|_, _| true), StageEnd::Finished);
}
