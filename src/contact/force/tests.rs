//! Forces against energies, tangents against forces.

use super::*;
use crate::contact::asperity::{Asperity, AsperityState};
use crate::contact::face::FaceShare;
use crate::contact::features::Feature;
use crate::contact::law::Weakening;
use crate::tensor::{Pose, Rotation};

const LAW: ContactLaw = ContactLaw { fade_length: 2e-3, parallel_limit: 0.5, ..ContactLaw::SAMPLE };

#[derive(Clone, Copy)]
struct Scene {
    site: Site,
    body_a: [Vec3; 3],
    body_b: [Vec3; 3],
    /// Outward normals of two faces, in the bodies' coordinates.
    faces: [Vec3; 2],
    committed: [Pose; 2],
    state: PointState,
}

impl Scene {
    /// Shifts `b` along the normal until the rounded bodies overlap by 20 um.
    fn pressed(mut self) -> Self {
        for _ in 0..5 {
            let (e, _) = self.evaluate_at(&self.committed);
            self.committed[1].position -= e.normal * (e.gap + 2e-5);
        }
        self
    }

    fn situation<R>(&self, poses: &[Pose; 2], ask: impl Fn(&Situation<'_>) -> R) -> R {
        let [a, b] = [0, 1].map(|i| Kinematics::between(&self.committed[i], &poses[i]));
        let points = SitePoints {
            a: self.body_a.map(|p| poses[0].to_space(&p)),
            b: self.body_b.map(|p| poses[1].to_space(&p)),
            normals: [poses[0].rotation * self.faces[0], poses[1].rotation * self.faces[1]],
        };
        let Scene { site, state, .. } = self;
        ask(&Situation { law: &LAW, site, points: &points, kinematics: [&a, &b], state })
    }

    fn elastic_tangent_at(&self, poses: &[Pose; 2]) -> ElasticTangent {
        self.situation(poses, |it| it.elastic_tangent())
    }

    fn evaluate_at(&self, poses: &[Pose; 2]) -> (Evaluation, Tangent) {
        self.situation(poses, |it| (it.evaluate(), it.tangent()))
    }
}

fn state(friction: f64) -> PointState {
    PointState {
        radii: 1e-3,
        radius_difference: 4e-4,
        stiffness: 6e7,
        offset: 4e-6,
        stretch: Vec3::new(2e-6, 1e-6, -1e-6),
        behind_stretch: Vec3::new(-1e-7, 4e-7, 2e-7),
        elastic: Vec3::new(1e-7, 2e-7, -3e-7),
        elastic_change: Vec3::new(1e-7, 0.0, 1e-7),
        ..PointState::of_spring([0.0; 2], 3e8, Weakening::constant(friction))
    }
}

fn edges(friction: f64) -> Scene {
    Scene {
        site: Site {
            feature: Feature::Edges(0, 0),
            on_a: [0, 1, 0],
            on_b: [0, 1, 0],
            count_a: 2,
            count_b: 2,
        },
        body_a: [Vec3::new(-8e-4, 1e-4, 0.0), Vec3::new(9e-3, -3e-4, 2e-4), Vec3::zeros()],
        body_b: [Vec3::new(1e-4, -7e-4, 2e-4), Vec3::new(2e-3, 9e-3, -3e-4), Vec3::zeros()],
        committed: [
            Pose::identity(),
            Pose::identity().moved(&Vec3::new(0.0, 0.0, 0.94e-3), &Vec3::new(0.01, 0.02, 0.03)),
        ],
        faces: [Vec3::zeros(); 2],
        state: state(friction),
    }
    .pressed()
}

fn vertex_on_facet(friction: f64) -> Scene {
    Scene {
        site: Site {
            feature: Feature::VertexOfB(0),
            on_a: [0, 1, 2],
            on_b: [0, 0, 0],
            count_a: 3,
            count_b: 1,
        },
        body_a: [Vec3::new(-5e-3, -4e-3, 1e-3), Vec3::new(6e-3, -3e-3, 0.0), Vec3::new(0.0, 7e-3, 5e-4)],
        body_b: [Vec3::new(3e-4, 1e-3, -1e-2), Vec3::zeros(), Vec3::zeros()],
        committed: [
            Pose::identity(),
            Pose::identity().moved(&Vec3::new(0.0, 0.0, 1.136e-2), &Vec3::new(0.01, 0.0, 0.02)),
        ],
        faces: [Vec3::zeros(); 2],
        state: state(friction),
    }
    .pressed()
}

/// Two corners, the direction between them in the fade of both.
fn vertex_on_vertex(friction: f64) -> Scene {
    let axis = |x: f64, z: f64| Vec3::new(x, 0.1, z).normalize();
    let (vertex_a, vertex_b) = (Vec3::new(2e-3, 1e-3, 5e-3), Vec3::new(-1e-3, 2e-3, -6e-3));
    Scene {
        site: Site { feature: Feature::VertexOfA(0), on_a: [0; 3], on_b: [0; 3], count_a: 1, count_b: 1 },
        body_a: [vertex_a, vertex_a + axis(0.55, 1.0), Vec3::zeros()],
        body_b: [vertex_b, vertex_b + axis(0.5, -1.0), Vec3::zeros()],
        committed: [Pose::identity(), Pose::new(Vec3::new(3e-3, -1e-3, 1.2e-2), Default::default())],
        faces: [Vec3::zeros(); 2],
        state: PointState { corners: Some([0.75, 0.8]), ..state(friction) },
    }
    .pressed()
}

/// A corner on a face whose own face is within the angle at which patches fade.
fn vertex_beside_patch(friction: f64) -> Scene {
    let mut scene = vertex_on_facet(friction);
    scene.state.faces = Some(FaceShare::Feature { g: 0.8, cosines: [0.9; 2] });
    nearly_parallel(scene)
}

/// A point of such a patch.
fn point_of_patch(friction: f64) -> Scene {
    let mut scene = vertex_on_facet(friction);
    scene.state.faces = Some(FaceShare::Patch { g: 0.8 });
    nearly_parallel(scene)
}

fn nearly_parallel(mut scene: Scene) -> Scene {
    let [p, q, r] = scene.body_a;
    let normal = (q - p).cross(&(r - p)).normalize();
    let tilted = Rotation::from_scaled_axis(Vec3::new(3e-2, -4e-2, 1e-2)) * normal;
    scene.faces = [normal, -(scene.committed[1].rotation.inverse() * tilted)];
    scene
}

/// Crossing edges whose normal is in the fade of a face's cone.
fn edges_beside_patch(friction: f64) -> Scene {
    let mut scene = edges(friction);
    let normal = scene.evaluate_at(&scene.committed).0.normal;
    let tilted = Rotation::from_scaled_axis(Vec3::new(0.25, 0.1, 0.0)) * normal;
    let other = Rotation::from_scaled_axis(Vec3::new(4e-2, -2e-2, 0.0)) * tilted;
    scene.faces = [tilted, -(scene.committed[1].rotation.inverse() * other)];
    scene.state.faces = Some(FaceShare::Feature { g: 0.8, cosines: [0.9; 2] });
    scene
}

fn motion(k: usize, step: f64) -> ([Vec3; 2], [Vec3; 2]) {
    let mut shift = [Vec3::zeros(); 2];
    let mut spin = [Vec3::zeros(); 2];
    match k {
        0..3 => shift[1][k] = step,
        3..6 => spin[1][k - 3] = step,
        _ => spin[0][k - 6] = step,
    }
    (shift, spin)
}

fn moved(scene: &Scene, poses: &[Pose; 2], k: usize, step: f64) -> (Evaluation, Tangent) {
    let (shift, spin) = motion(k, step);
    scene.evaluate_at(&[poses[0].moved(&shift[0], &spin[0]), poses[1].moved(&shift[1], &spin[1])])
}

/// Every kind of contact, overlapped.
fn contacts() -> [Scene; 6] {
    [
        edges(0.05),
        vertex_on_facet(0.05),
        vertex_on_vertex(0.05),
        vertex_beside_patch(0.05),
        point_of_patch(0.05),
        edges_beside_patch(0.05),
    ]
}

/// Both bodies a little way on.
fn moved_on(scene: &Scene) -> [Pose; 2] {
    [
        scene.committed[0].moved(&Vec3::new(1e-6, 0.0, 0.0), &Vec3::new(1e-4, 0.0, 2e-4)),
        scene.committed[1].moved(&Vec3::new(0.0, 2e-6, -1e-6), &Vec3::new(0.0, 1e-4, 0.0)),
    ]
}

/// Both as one body, about the origin.
fn turned_as_one(poses: &[Pose; 2], rotation: &Rotation) -> [Pose; 2] {
    poses.map(|pose| Pose::new(rotation * pose.position, rotation * pose.rotation))
}

fn assert_tangent_is_exact(scene: &Scene, poses: &[Pose; 2]) {
    let (evaluation, tangent) = scene.evaluate_at(poses);
    assert!(evaluation.is_active(), "gap {}", evaluation.gap);
    for k in 0..9 {
        let h = if k < 3 { 1e-10 } else { 1e-8 };
        let (plus, _) = moved(scene, poses, k, h);
        let (minus, _) = moved(scene, poses, k, -h);
        for i in 0..12 {
            let difference = (plus.wrench[i] - minus.wrench[i]) / (2.0 * h);
            let scale = 6e7 * if k < 3 { 1.0 } else { 1e-2 } * if i % 6 < 3 { 1.0 } else { 1e-2 };
            assert!(
                (difference - tangent[i][k]).abs() < 2e-4 * scale,
                "{:?} component {i} motion {k}: {difference} {}",
                scene.state.friction,
                tangent[i][k]
            );
        }
    }
}

#[test]
fn tangent_is_derivative_of_force() {
    let weakening = |excess: f64, distance: f64| Weakening { coefficient: 0.1, excess, distance };
    for friction in [
        Weakening::constant(0.0),
        Weakening::constant(0.05),
        Weakening::constant(0.65),
        weakening(0.08, 5e-6),
        weakening(0.08, 2e-8),
    ] {
        for mut scene in contacts() {
            scene.state.friction = friction;
            let poses = moved_on(&scene);
            assert_tangent_is_exact(&scene, &poses);
            // They come from apart, two thirds of the way before they touch.
            scene.state.is_new = true;
            let normal = scene.evaluate_at(&poses).0.normal;
            scene.committed[1].position += 6e-5 * normal + Vec3::new(2e-6, -1e-6, 0.0);
            assert_tangent_is_exact(&scene, &poses);
        }
    }
}

/// `scene` with roundings of which the undeformed bodies overlap by `share`, and cores that are kept apart.
fn hardened(mut scene: Scene, share: f64) -> Scene {
    let (e, state) = (scene.evaluate_at(&moved_on(&scene)).0, scene.state);
    let undeformed = e.normal.dot(&state.elastic) - e.gap - state.initial_overlap;
    scene.state.radii = (state.radii - undeformed) / (1.0 - share);
    scene.state.hardening = 4e7;
    scene
}

/// Alone, behind a penalty, and behind the compliance of a force that is unknown; also where an initial
/// overlap has taken the spring's own.
#[test]
fn tangent_is_derivative_of_a_hardened_force() {
    for scene in contacts() {
        for [share, initial_overlap, behind, compliance] in
            [[0.55, 0.0, 0.0, 0.0], [0.6, 0.0, 0.1, 0.0], [0.6, -0.5, 0.0, 0.1], [0.7, -0.9, 0.2, 0.2]]
        {
            let mut scene = hardened(scene, share);
            let (poses, PointState { spring, radii, .. }) = (moved_on(&scene), scene.state);
            (scene.state.initial_overlap, scene.state.stiffness) =
                (initial_overlap * radii, spring / (1.0 + behind));
            (scene.state.compliance, scene.state.offset) = (compliance / spring, 0.0);
            let (evaluation, _) = scene.evaluate_at(&poses);
            assert!(
                evaluation.hardened > 0.0 && evaluation.load >= evaluation.hardened,
                "{share} {initial_overlap}"
            );
            assert!((evaluation.sprung() == 0.0) == (initial_overlap < -share), "{share} {initial_overlap}");
            assert_tangent_is_exact(&scene, &poses);
            assert_bending_is_exact(&scene, &poses);
        }
    }
}

/// Asperities that are elastic, that crush, and that unload from what they crushed, free of friction, holding on and sliding.
#[test]
fn tangent_is_derivative_of_the_force_of_asperities() {
    let law = Asperity::tip(1.5e10, 7e8, 4e-4, 1.2);
    // 20 um are pressed: beyond its elastic limit, within that of a deeper imprint, and from a shallower one on.
    assert!(law.elastic_limit(0.0) < 1e-5 && law.elastic_limit(1.5e-5) > 2.2e-5);
    for (radius, depth, crushes) in
        [(4e-4, 0.0, true), (4e-4, 1.5e-5, false), (4e-4, 4e-6, true), (4e-3, 0.0, false)]
    {
        for coefficient in [0.0, 0.05, 5.0] {
            for mut scene in [edges(coefficient), vertex_on_facet(coefficient), vertex_on_vertex(coefficient)]
            {
                let law = Asperity { radius, ..law };
                // A patch held before that is smaller, and one that is larger than the present one.
                for grip in [1e-6, 1e-3] {
                    let state = &mut scene.state;
                    (state.offset, state.elastic, state.elastic_change) = (0.0, Vec3::zeros(), Vec3::zeros());
                    (state.stiffness, state.behind_stretch) = (state.spring, Vec3::zeros());
                    state.asperity = Some(AsperityState { law, depth, grip, share: 0.7 });
                    scene = scene.pressed();
                    let poses = moved_on(&scene);
                    let e = scene.evaluate_at(&poses).0;
                    assert_eq!(law.crushed(-e.gap, depth) > depth, crushes, "{radius} {depth}");
                    let expected = 0.7 * law.update(depth, -e.gap).force;
                    assert!((e.load / expected - 1.0).abs() < 1e-12 && e.grip == e.patch.max(grip));
                    assert_tangent_is_exact(&scene, &poses);
                }
            }
        }
    }
}

/// An asperity before a body that yields: at the force that its compliance has given back before, it is the asperity alone; elsewhere derivatives are exact.
#[test]
fn tangent_is_derivative_of_the_force_of_asperities_before_bodies_that_yield() {
    for (law, depth) in
        [(Asperity::tip(1.5e10, 7e8, 4e-4, 1.2), 0.0), (Asperity::tip(1.5e10, 7e8, 4e-4, 1.2), 1.5e-5)]
    {
        for coefficient in [0.0, 0.05, 5.0] {
            for mut scene in [edges(coefficient), vertex_on_facet(coefficient), vertex_on_vertex(coefficient)]
            {
                let state = &mut scene.state;
                (state.offset, state.elastic_change) = (0.0, Vec3::zeros());
                (state.stiffness, state.behind_stretch) = (state.spring, Vec3::zeros());
                state.asperity = Some(AsperityState { law, depth, grip: 1e-6, share: 0.7 });
                let mut scene = scene.pressed();
                let poses = moved_on(&scene);
                let alone = scene.evaluate_at(&poses).0;
                let compliance = 0.2 / (2.0 * law.modulus * alone.patch);
                scene.state.compliance = compliance;
                scene.state.returned = alone.bending_force() * compliance;
                let behind = scene.evaluate_at(&poses).0;
                assert!((behind.bending_force() - alone.bending_force()).norm() < 1e-9 * alone.pressure);
                assert!((behind.indentation / alone.indentation - 1.0).abs() < 1e-9);
                scene.state.returned *= 0.5;
                assert!(scene.evaluate_at(&poses).0.pressure < alone.pressure);
                assert_tangent_is_exact(&scene, &poses);
            }
        }
    }
}

/// The force that a smaller patch held stays as the patch grows, by less stretch.
#[test]
fn friction_of_a_patch_that_grows_stays() {
    let mut scene = vertex_on_facet(5.0);
    let law = Asperity::tip(1.5e10, 7e8, 4e-4, 1.2);
    let state = &mut scene.state;
    (state.offset, state.elastic, state.elastic_change) = (0.0, Vec3::zeros(), Vec3::zeros());
    (state.stiffness, state.behind_stretch) = (state.spring, Vec3::zeros());
    state.asperity = Some(AsperityState { law, depth: 0.0, grip: 2e-5, share: 1.0 });
    let scene = scene.pressed();
    let (e, _) = scene.evaluate_at(&scene.committed);
    let across = |v: Vec3| v - e.normal * v.dot(&e.normal);
    let before = scene.state.tangential_stiffness(&LAW, 2e-5) * across(scene.state.stretch).norm();
    let carried = scene.state.stretch.norm() / across(scene.state.stretch).norm();
    assert!(e.grip > 2e-5);
    // The stretch keeps its length where it is laid into the tangent plane. Slides of nothing are rounding of places, 1e-17 m, on half a micrometre.
    assert!((e.friction.norm() / (before * carried) - 1.0).abs() < 1e-9, "{} {before}", e.friction.norm());
    let held = scene.state.tangential_stiffness(&LAW, e.grip) * e.stretch.norm();
    assert!((e.friction.norm() / held - 1.0).abs() < 1e-12);
}

/// What bends the bodies by their motions and by elastic displacements.
fn assert_bending_is_exact(scene: &Scene, poses: &[Pose; 2]) {
    let h = 1e-10;
    let exact = scene.elastic_tangent_at(poses);
    for k in 0..12 {
        let at = |step: f64| {
            if k < 9 {
                return moved(scene, poses, k, if k < 3 { step } else { 100.0 * step }).0.bending_force();
            }
            let mut displaced = *scene;
            displaced.state.elastic[k - 9] += step;
            displaced.state.elastic_change[k - 9] += step;
            displaced.evaluate_at(poses).0.bending_force()
        };
        let slope = (at(h) - at(-h)) / (2.0 * h) * if (3..9).contains(&k) { 1e-2 } else { 1.0 };
        for i in 0..3 {
            let off = (slope[i] - exact[12 + i][k]).abs();
            assert!(off < 2e-4 * 6e7, "component {i} by {k}: {} {}", slope[i], exact[12 + i][k]);
        }
    }
}

/// A force that only turns, far below its bound.
#[test]
fn tangent_knows_how_stretches_turn() {
    for mut scene in contacts() {
        scene.state.friction = Weakening::constant(50.0);
        scene.state.stretch = Vec3::new(2e-4, 1e-4, -1e-4);
        let turn = Rotation::from_scaled_axis(Vec3::new(0.2, -0.1, 0.6));
        let poses = turned_as_one(&moved_on(&scene), &turn);
        assert_tangent_is_exact(&scene, &poses);
    }
}

#[test]
fn the_force_turns_with_bodies_that_turn_as_one() {
    for mut scene in contacts() {
        scene.state.friction = Weakening::constant(0.65);
        (scene.state.elastic, scene.state.elastic_change) = (Vec3::zeros(), Vec3::zeros());
        scene.state.behind_stretch = Vec3::zeros();
        let normal = scene.evaluate_at(&scene.committed).0.normal;
        // In the tangent plane, as accepted increments leave it.
        scene.state.stretch -= normal * scene.state.stretch.dot(&normal);
        let (before, _) = scene.evaluate_at(&scene.committed);
        assert!(before.friction.norm() > 0.01 * before.pressure);
        // About the normal exactly, elsewhere but for the square of the turn.
        for (axis, tolerance) in
            [(normal * 1.5, 1e-9), (normal * -2.8, 1e-9), (Vec3::new(2e-3, 1e-3, 3e-3), 1e-5)]
        {
            let turn = Rotation::from_scaled_axis(axis);
            let (after, _) = scene.evaluate_at(&turned_as_one(&scene.committed, &turn));
            let off = (after.friction - turn * before.friction).norm() / before.friction.norm();
            assert!(off < tolerance, "{axis:?}: {off}");
        }
    }
}

/// On a straight way of which the bodies overlap in the last third.
#[test]
fn only_the_way_in_touch_is_slide() {
    let mut scene = vertex_on_facet(50.0);
    scene.state = PointState { stretch: Vec3::zeros(), behind_stretch: Vec3::zeros(), ..scene.state };
    (scene.state.elastic, scene.state.elastic_change) = (Vec3::zeros(), Vec3::zeros());
    let poses = scene.committed;
    let (before, _) = scene.evaluate_at(&poses);
    let across = before.normal.cross(&Vec3::x()).normalize();
    let overlap = -before.gap;
    for (closer, slid) in [(3.0 * overlap, 1.0 / 3.0), (0.5 * overlap, 1.0), (-overlap, 1.0)] {
        // Where `b` was.
        scene.committed[1].position = poses[1].position + before.normal * closer - across * 3e-6;
        scene.state.is_new = false;
        let whole = scene.evaluate_at(&poses).0.trial_stretch;
        assert!((whole.norm() - 3e-6).abs() < 1e-15, "{whole:?}");
        scene.state.is_new = true;
        let part = scene.evaluate_at(&poses).0.trial_stretch;
        // But for what counts as touch before they do.
        assert!((part - whole * slid).norm() < 4e-3 * whole.norm(), "{closer}: {part:?} {whole:?}");
    }
}

#[test]
fn force_is_derivative_of_energy_without_friction() {
    let plain = [
        edges(0.0),
        vertex_on_facet(0.0),
        vertex_on_vertex(0.0),
        vertex_beside_patch(0.0),
        point_of_patch(0.0),
    ];
    for mut scene in plain.into_iter().chain(plain.map(|scene| hardened(scene, 0.6))) {
        // The elastic displacement is held while the normal turns, which is not an energy.
        scene.state.elastic = Vec3::zeros();
        scene.state.offset = 0.0;
        scene.state.spring = scene.state.stiffness;
        let poses = scene.committed;
        let (evaluation, _) = scene.evaluate_at(&poses);
        assert!(evaluation.is_active() && evaluation.weight < 1.0 + 1e-15);
        assert!(scene.state.faces.is_none() || (0.05..0.95).contains(&evaluation.weight));
        for k in 0..9 {
            let h = if k < 3 { 1e-9 } else { 1e-7 };
            let (plus, _) = moved(&scene, &poses, k, h);
            let (minus, _) = moved(&scene, &poses, k, -h);
            let slope = (plus.energy - minus.energy) / (2.0 * h);
            let work = match k {
                0..6 => evaluation.wrench[6 + k],
                _ => evaluation.wrench[3 + k - 6],
            };
            let scale = evaluation.pressure * if k < 3 { 1.0 } else { 1e-2 };
            assert!((slope + work).abs() < 1e-4 * scale, "motion {k}: {slope} {work}");
        }
    }
}

#[test]
fn repeated_augmentations_end_at_the_spring_law() {
    for mut scene in [edges(0.05), edges(0.65), vertex_on_facet(0.05), vertex_on_facet(0.65)] {
        let (soft, spring) = (scene.state.stiffness, scene.state.spring);
        scene.state.stiffness = spring;
        (scene.state.offset, scene.state.behind_stretch) = (0.0, Vec3::zeros());
        let (plain, _) = scene.evaluate_at(&scene.committed);
        scene.state.stiffness = soft;
        let shared = 1.0 / soft - 1.0 / spring;
        for _ in 0..200 {
            let (e, _) = scene.evaluate_at(&scene.committed);
            scene.state.offset = shared * e.load;
            scene.state.behind_stretch = e.friction * (shared / (e.weight * LAW.tangential_ratio));
        }
        let (augmented, _) = scene.evaluate_at(&scene.committed);
        let relative = |a: f64, b: f64| (a - b).abs() / plain.pressure;
        assert!(relative(augmented.pressure, plain.pressure) < 1e-9);
        for k in 0..12 {
            let arm = if k % 6 < 3 { 1.0 } else { 1e-2 };
            let off = relative(augmented.wrench[k], plain.wrench[k]);
            assert!(off < 1e-6 * arm, "component {k}: {off}");
        }
        let stored = |e: &Evaluation| e.energy + e.tangential_energy;
        assert!((stored(&augmented) - stored(&plain)).abs() < 1e-6 * stored(&plain));
        assert!((augmented.energy - plain.energy).abs() < 1e-9 * plain.energy);
    }
}

#[test]
fn forces_balance_and_obey_the_cone() {
    for scene in [edges(0.65), vertex_on_facet(0.2), vertex_on_vertex(0.4)] {
        let (e, _) = scene.evaluate_at(&scene.committed);
        let force = |first: usize| Vec3::new(e.wrench[first], e.wrench[first + 1], e.wrench[first + 2]);
        assert!((force(0) + force(6)).norm() < 1e-9 * e.pressure);
        let turn = |first: usize, body: usize| {
            scene.committed[body].position.cross(&force(first)) + force(first + 3)
        };
        assert!((turn(0, 0) + turn(6, 1)).norm() < 1e-9 * e.pressure);
        assert!(e.friction.norm() <= e.coefficient * e.pressure * (1.0 + 1e-12));
        assert!(e.friction.dot(&e.normal).abs() < 1e-9 * e.pressure);
    }
}
