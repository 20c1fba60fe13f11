//! Forces between faces that tilt and slide, patches and corners together.

use crate::assembly::cubes::{contacts_at, pile};
use crate::assembly::springs::Springs;
use crate::contact::face::FaceContact;
use crate::contact::{Feature, NormalLaw};
use crate::model::{Committed, Deformation, Loads, Model};
use crate::tensor::{Pose, Rotation, Vec3};

/// Edge and rounding of the cubes [m]; see [`pile`].
const EDGE: f64 = 0.03;
const ROUNDING: f64 = 1e-3;
/// How deep the upper cube presses in where it does so most [m].
const DEPTH: f64 = 5e-5;

/// A cube on another one, and a third out of reach.
fn two_cubes() -> (Model, Committed) {
    let (model, mut committed, _) = pile(0.0, |_| Deformation::Rigid);
    committed.poses = poses([0.0; 2], [0.0; 3]).to_vec();
    (model.with_faces(FaceContact::Area), committed)
}

/// The upper cube shifted [m] and turned, its lowest corner as deep as [`DEPTH`].
fn poses([x, y]: [f64; 2], turn: [f64; 3]) -> [Pose; 3] {
    let turned = Rotation::from_scaled_axis(Vec3::from(turn));
    let half = 0.5 * EDGE;
    let corner = |k: usize| {
        let sign = |bit: usize| if k >> bit & 1 == 1 { half } else { -half };
        (turned * Vec3::new(sign(0), sign(1), sign(2))).z
    };
    let lowest = (0..8).map(corner).fold(f64::INFINITY, f64::min);
    [
        Pose::identity(),
        Pose::new(Vec3::new(x, y, half - lowest - DEPTH), turned),
        Pose::new(Vec3::new(1.0, 1.0, 1.0), Rotation::identity()),
    ]
}

/// Force and moment on the upper cube [N, N m], and how many contacts of faces and of other features it has.
fn on_upper(model: &Model, committed: &Committed, poses: &[Pose; 3]) -> ([f64; 6], [usize; 2]) {
    let contacts = contacts_at(model, committed, poses);
    let (mut wrench, mut counts) = ([0.0; 6], [0; 2]);
    for (_, point) in contacts.active() {
        (0..6).for_each(|k| wrench[k] += point.evaluation.wrench[6 + k]);
        counts[usize::from(!matches!(point.site.feature, Feature::Faces(..)))] += 1;
    }
    (wrench, counts)
}

#[test]
fn parallel_faces_carry_by_their_patch_and_tilted_ones_by_corners() {
    let (model, committed) = two_cubes();
    let (wrench, counts) = on_upper(&model, &committed, &poses([5e-3, 0.0], [0.0; 3]));
    assert_eq!(counts, [4, 0]);
    let expected = model.patch_stiffness(0, 1) * DEPTH * EDGE * (EDGE - 5e-3);
    assert!((wrench[2] / expected - 1.0).abs() < 1e-9, "{} {expected}", wrench[2]);
    let (_, counts) = on_upper(&model, &committed, &poses([5e-3, 0.0], [0.0, -5e-2, 0.0]));
    assert!(counts[0] == 4, "{counts:?}");
    // Turned further, the rounded edge has to come as deep as the sharp one did.
    let mut tilted = poses([5e-3, 0.0], [0.0, -0.12, 0.0]);
    tilted[1].position.z -= 0.12 * ROUNDING;
    let (_, counts) = on_upper(&model, &committed, &tilted);
    assert!(counts[0] == 0 && counts[1] > 0, "{counts:?}");
}

/// Layers in series: rock that keeps half of its stiffness yields twice as much, and what a body that deforms has less of a layer it spares.
#[test]
fn layers_of_patches_soften_and_are_spared_each_by_its_own() {
    let feature = Feature::Faces(0, 0, 0);
    let (model, _) = two_cubes();
    let left = model.softened_share([0, 1], feature, [1.0, 0.5]);
    assert!((left - 2.0 / 3.0).abs() < 1e-12, "{left}");
    let (mut deforming, _, _) = resting_cubes();
    let resting = deforming.clone();
    deforming.bodies.iter_mut().for_each(|body| {
        body.wake();
    });
    for feature in [feature, Feature::VertexOfA(0)] {
        let yields = |model: &Model| 1.0 / Springs::between(model, 1, 2).at(feature);
        let spared = [1, 2].map(|body| resting.spares(body, feature)).iter().sum::<f64>();
        assert!(
            (yields(&resting) - yields(&deforming) - spared).abs() < 1e-12 * yields(&resting),
            "{feature:?}"
        );
    }
}

/// As [`two_cubes`], of which the upper one may deform, and does not for now.
fn resting_cubes() -> (Model, Committed, Loads) {
    let (model, committed, loads) = pile(0.0, Deformation::resting);
    (model.with_faces(FaceContact::Area), committed, loads)
}

/// A body that may deform has the nodes of its mesh's patches while it rests; pressed evenly these carry what rigid faces do.
#[test]
fn resting_faces_carry_by_nodes_what_rigid_ones_do() {
    let (rigid, _) = two_cubes();
    let (model, _, _) = resting_cubes();
    let at = poses([5e-3, -2e-3], [0.0, 0.0, 0.3]);
    // Nothing slides.
    let committed = Committed::new(at.to_vec());
    let (expected, _) = on_upper(&rigid, &committed, &at);
    let (wrench, counts) = on_upper(&model, &committed, &at);
    assert!(counts[0] > 4 && counts[1] == 0, "{counts:?}");
    for k in 0..6 {
        let arm = if k < 3 { 1.0 } else { EDGE };
        assert!((wrench[k] - expected[k]).abs() < 1e-9 * arm * expected[2], "{k}: {wrench:?} {expected:?}");
    }
}

/// The largest change of a component in a step falls with the step: no jump where a face turns away from parallel, slides off, or
/// turns while it does; whatever bears corners and edges beside the patches.
#[test]
fn forces_are_continuous_as_faces_tilt_and_slide_over_rims() {
    for normal in [NormalLaw::Spring, NormalLaw::Asperity] {
        assert_continuous(normal);
    }
}

fn assert_continuous(normal: NormalLaw) {
    let (model, committed) = two_cubes();
    let model = model.with_normal(normal);
    let ways: [&dyn Fn(f64) -> [Pose; 3]; 4] = [
        &|t| poses([4e-3, 1e-3], [0.0, -0.14 * t, 0.0]),
        &|t| poses([4e-3, 1e-3], [0.08 * t, -0.11 * t, 0.3]),
        &|t| poses([EDGE * (2.2 * t - 1.1), 2e-3], [0.0, 0.0, 0.2]),
        &|t| poses([EDGE * (2.2 * t - 1.1), 2e-3], [3e-2, 4e-2 * t, 0.2]),
    ];
    for (number, way) in ways.iter().enumerate() {
        let largest = |steps: usize| {
            let at = |i: usize| on_upper(&model, &committed, &way(i as f64 / steps as f64)).0;
            let all: Vec<[f64; 6]> = (0..=steps).map(at).collect();
            let jump = |w: &[[f64; 6]]| {
                let arm = |k: usize| if k < 3 { 1.0 } else { 0.5 * EDGE };
                (0..6).map(|k| (w[1][k] - w[0][k]).abs() / arm(k)).fold(0.0, f64::max)
            };
            all.windows(2).map(jump).fold(0.0, f64::max)
        };
        let (coarse, fine) = (largest(600), largest(4800));
        assert!(coarse > 0.0 && fine < 0.25 * coarse, "{normal:?}, way {number}: {coarse} {fine}");
    }
}

/// Rims that overlap are round: a patch carries as far as it is flat on both sides, and by then corners and edges have let go.
#[test]
fn rims_carry_by_their_edges() {
    let (model, committed) = two_cubes();
    let overlap = |x: f64| on_upper(&model, &committed, &poses([EDGE - x, 0.0], [0.0; 3])).1;
    assert_eq!(overlap(1.9 * ROUNDING)[0], 0);
    assert_eq!(overlap(2.1 * ROUNDING)[0], 4);
    let whole = on_upper(&model, &committed, &poses([0.5 * EDGE, 0.0], [0.0; 3])).0[2];
    let expected = model.patch_stiffness(0, 1) * DEPTH * EDGE * 0.5 * EDGE;
    assert!((whole / expected - 1.0).abs() < 1e-9, "{whole} {expected}");
}
