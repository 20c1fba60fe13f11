//! The contact patch test (`verification::patch`), and what parallel faces carry otherwise once they carry by
//! their area.
//!
//! Problem, source and the tolerance of the patch test are in the problem's module. Forces: the force
//! tolerance, 1e-3 of a point's force.

use riprap::contact::face::FaceContact;
use riprap::contact::law::Friction;
use riprap::element::Strains;
use riprap::grain::{CondensedGrain, FullGrain};
use riprap::material::Elastic;
use riprap::mesh::cuboid_mesh;
use riprap::scene::{Scene, SceneBody, SceneParameters, SceneState};
use riprap::verification::Run;
use riprap::verification::blocks::{
    NORMAL, TRAVEL, largest_side_force, pressing, prism_on_cube, pushed, slid_over_facets, weakening_work,
};
use riprap::verification::bodies::{DENSITY, HELD, body, cuboid, drive, fixed, load, push, scene};
use riprap::verification::patch::{Blocks, EDGE, TOLERANCE, column, pressure_miss, stress_miss};
use std::sync::Arc;

use crate::audited::{audited, last};

fn with_patches(parameters: SceneParameters) -> SceneParameters {
    SceneParameters { faces: FaceContact::Area, ..parameters }
}

#[test]
fn traction_passes_between_meshes_that_do_not_match() {
    for (blocks, [angle, heading], cells) in [
        (Blocks::Full, [0.0, 0.0], [0.5, 0.8]),
        (Blocks::Full, [5.0, 60.0], [0.9, 0.45]),
        (Blocks::Condensed, [15.0, 90.0], [0.4, 0.9]),
        (Blocks::Condensed, [32.0, 20.0], [0.7, 0.6]),
    ] {
        let tilt = f64::to_radians(angle);
        let run = audited(&column(blocks, tilt, f64::to_radians(heading), cells.map(|share| share * EDGE)));
        assert!(run.finished(), "{blocks:?} {angle}: {:?}", run.end);
        let (stress, pressure) = (stress_miss(&run), pressure_miss(&run, tilt));
        assert!(stress < TOLERANCE && pressure < TOLERANCE, "{blocks:?} {angle}: {stress:e} {pressure:e}");
    }
}

/// What the patch is for: corners press many times harder than the column.
#[test]
fn corners_do_not_pass_a_uniform_traction() {
    let parameters = column(Blocks::Condensed, 0.0, 0.0, [0.8 * EDGE, 0.5 * EDGE]);
    let run = Run::of(&SceneParameters { faces: FaceContact::Corners, ..parameters });
    assert!(run.finished() && stress_miss(&run) > 1.0, "{:e}", stress_miss(&run));
}

#[test]
fn a_patch_has_the_resultant_of_what_presses_it() {
    for corners in [4, 24] {
        let run = audited(&with_patches(prism_on_cube(corners)));
        assert!(run.finished(), "{corners}: {:?}", run.end);
        assert_eq!(last(&run).measures.points, 4);
        let state = last(&run).bodies[run.index("upper")];
        let (force, moment) = pressing();
        let tolerance = 1e-3 * last(&run).balance.reference_force;
        assert!((state.contact_force + force).norm() < tolerance, "{}", state.contact_force);
        assert!((state.contact_moment + moment).norm() < 0.07 * tolerance, "{}", state.contact_moment);
    }
}

#[test]
fn a_patch_slides_over_coplanar_facets_without_a_kick() {
    let run = audited(&with_patches(slid_over_facets(64, 0.7)));
    assert!(run.finished(), "{:?}", run.end);
    let side = largest_side_force(&run);
    assert!(side < 1e-6, "{side:e}");
}

#[test]
fn a_pushed_patch_rubs_by_its_coefficient_and_books_it() {
    let friction = Friction { peak: 0.65, residual: 0.2, weakening_distance: 50e-6 };
    let run = audited(&with_patches(pushed(friction, 100)));
    assert!(run.finished(), "{:?}", run.end);
    let end = last(&run).bodies[1].reaction_force.x;
    assert!((end / (0.2 * NORMAL) - 1.0).abs() < 2e-3, "{end}");
    let model = &run.scene.model;
    let stretch = end / (model.patch_stiffness(0, 1) * 0.01 * model.law.tangential_ratio);
    let area = weakening_work(&friction, TRAVEL - stretch);
    let work = last(&run).ledger.friction;
    // Second order in the increment of 4 um over 50 um, and the increment in which it begins to slip
    // (`verification::blocks`).
    assert!((work / area - 1.0).abs() < 0.08 * 0.08 / 6.0 + 2e-3, "{work} {area}");
}

/// A meshed block, pressed down and pushed by 0.2 mm.
fn pushed_block() -> SceneParameters {
    let block = body("block", cuboid([0.05; 3]), [0.0, 0.0, 0.025], [0.0, 0.0, 0.3]);
    let mesh = cuboid_mesh([0.05; 3], 0.03).expect("a mesh");
    let rock = vec![Elastic::new(30e9, 0.2).expect("allowed"); mesh.cells.len()];
    let grain = Arc::new(CondensedGrain::new(mesh, &rock, DENSITY).expect("a grain"));
    let full = FullGrain::new(grain.clone(), DENSITY, Strains::Finite).expect("a grain");
    let block = SceneBody { grain: Some(grain), full: Some(Arc::new(full)), ..block };
    let plane = fixed(body("plane", cuboid([0.2, 0.2, 0.05]), [0.0, 0.0, -0.025], [0.0; 3]));
    let way = drive([Some(2e-4), Some(0.0), None], HELD);
    let stages = vec![load(2, "block", push([0.0, 0.0, -1000.0])), load(12, "block", way)];
    with_patches(scene(vec![plane, block], 0.5, stages))
}

/// The points of a meshed patch are found anew as the block slides; what they remember goes with them.
#[test]
fn a_meshed_patch_keeps_rubbing_while_it_slides() {
    let run = audited(&pushed_block());
    assert!(run.finished(), "{:?}", run.end);
    // Full slip from a few micrometres on.
    for row in run.rows.iter().filter(|row| row.stage == 1 && row.progress > 0.3) {
        let force = row.bodies[1].reaction_force.x;
        assert!((force / 500.0 - 1.0).abs() < 2e-3, "{}: {force}", row.progress);
    }
}

/// The points of a patch are part of the stored state.
#[test]
fn a_patch_goes_on_from_a_stored_state_with_the_same_bits() {
    let parameters = pushed_block();
    let mut whole = Scene::new(&parameters).expect("a scene");
    let mut stored = Vec::new();
    whole.run(|scene, row| {
        if row.stage == 1 && row.increment == 5 {
            stored = postcard::to_allocvec(&scene.state()).expect("bytes");
        }
        true
    });
    let mut continued = Scene::new(&parameters).expect("a scene");
    let state: SceneState<'_> = postcard::from_bytes(&stored).expect("a state");
    assert!(continued.restore(state).expect("no grains that break"), "another scene");
    continued.run(|_, _| true);
    assert_eq!(continued.committed.poses, whole.committed.poses);
    assert_eq!(continued.committed.memory, whole.committed.memory);
}
