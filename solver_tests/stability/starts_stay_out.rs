//! An increment starts from the last motion, continued. What fell by millimetres in a snap goes on by as much, into its neighbours:
//! from within a body nothing leads out, contacts find the far sides of its edges, and the state balances with cores inside each other. 300 grains at 0.4 MPa
//! did so at 9.7 % of strain, unseen but by the audit. What would pass through others has to stay where it is.

use riprap::ladder::bodies::{body, cuboid, ground, scene};
use riprap::model::BodyKind;
use riprap::scene::Scene;
use riprap::solver::audit::deepest_overlap;
use riprap::solver::sweep::hold_back;
use riprap::tensor::{Pose, Rotation, Vec3};

/// A block on the ground, and small ones beside it, above it and far away.
fn model() -> Scene {
    let bodies = vec![
        ground(),
        body("block", cuboid([0.04; 3]), [0.0, 0.0, 0.0205], [0.0; 3]),
        body("beside", cuboid([0.01; 3]), [0.029, 0.0, 0.02], [0.2, 0.1, 0.3]),
        body("above", cuboid([0.01; 3]), [0.0, 0.0, 0.05], [0.1, 0.3, 0.2]),
        body("away", cuboid([0.01; 3]), [0.2, 0.0, 0.02], [0.0; 3]),
    ];
    Scene::new(&scene(bodies, 0.5, vec![])).expect("a sound scene")
}

/// No core reaches into another.
fn are_apart(scene: &Scene, poses: &[Pose]) -> bool {
    let radii = 2.0 * scene.model.smallest_rounding();
    deepest_overlap(&scene.model, poses).is_none_or(|overlap| overlap.depth < radii)
}

fn moved(from: &[Pose], ways: &[(usize, [f64; 3])]) -> Vec<Pose> {
    let mut to = from.to_vec();
    for (i, way) in ways {
        to[*i] = to[*i].moved(&Vec3::from(*way), &Vec3::zeros());
    }
    to
}

#[test]
fn what_would_enter_or_pass_others_stays_and_the_rest_goes_on() {
    let scene = model();
    let from = &scene.committed.poses;
    for way in [-8e-3, -60e-3] {
        // Into the block, or out of its far side.
        let mut to = moved(from, &[(2, [way, 0.0, 0.0]), (3, [1e-3, 0.0, 1e-3]), (4, [0.0, way, 0.0])]);
        assert!(way < -0.01 || !are_apart(&scene, &to));
        let others = [to[3], to[4]];
        hold_back(&scene.model, from, &mut to);
        assert_eq!(to[2], from[2], "way {way}");
        assert_eq!([to[3], to[4]], others, "way {way}");
        assert!(are_apart(&scene, &to), "way {way}");
    }
}

#[test]
fn what_stays_stops_what_follows_it() {
    let scene = model();
    let from = &scene.committed.poses;
    // Of two that meet one stays, and the other meets it there.
    let mut to = moved(from, &[(1, [9e-3, 0.0, 0.0]), (2, [-9e-3, 0.0, 0.0]), (3, [0.0, 0.0, -9e-3])]);
    assert!(!are_apart(&scene, &to));
    hold_back(&scene.model, from, &mut to);
    assert!(are_apart(&scene, &to));
}

/// A specimen loaded beyond its strength: the plate comes on, and what lies in its way and stays there is met again and again. A pose put back is a
/// motion of rounding only, not of nothing, where the body is turned: for want of that the search went on for ever.
#[test]
fn what_is_held_and_met_all_the_same_is_held_once() {
    let mut scene = model();
    let turn = Rotation::from_scaled_axis(Vec3::new(0.3, -0.2, 0.5));
    for body in [2, 3] {
        scene.committed.poses[body].rotation = turn * scene.committed.poses[body].rotation;
    }
    scene.model.bodies[1].kind = BodyKind::Plate;
    let from = scene.committed.poses.clone();
    let mut to = moved(&from, &[(1, [0.03, 0.0, 0.03]), (2, [1e-4, 0.0, 0.0]), (3, [0.0, 0.0, 1e-4])]);
    let plate = to[1];
    hold_back(&scene.model, &from, &mut to);
    assert_eq!([to[1], to[2], to[3]], [plate, from[2], from[3]]);
}

#[test]
fn small_motions_are_left_alone() {
    let scene = model();
    let from = &scene.committed.poses;
    let small = 1e-2 * scene.model.smallest_rounding();
    let asked = moved(from, &[(1, [small, 0.0, 0.0]), (2, [-small, 0.0, 0.0]), (3, [0.0, 0.0, -small])]);
    let mut to = asked.clone();
    hold_back(&scene.model, from, &mut to);
    assert_eq!(to, asked);
}
