//! Facts of equilibrium, derivatives against finite differences, and shapes with a known volume.

use std::f64::consts::{PI, TAU};

use super::*;
use crate::geometry::Polyhedron;
use crate::tensor::Rotation;

const PRESSURE: f64 = 3.0;

/// Numbers in [-1, 1] from a fixed linear congruential generator.
struct Scatter(u64);

impl Scatter {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

/// An upright prism over the part of a regular polygon between two angles, corners on the circle.
fn prism(steps: usize, radius: f64, height: f64, span: [f64; 2]) -> Polyhedron {
    let corner = |k: usize, z: f64| {
        let angle = span[0] + (span[1] - span[0]) * k as f64 / steps as f64;
        Vec3::new(radius * angle.cos(), radius * angle.sin(), z * height)
    };
    let whole = span[1] - span[0] > 0.999 * TAU;
    let count = if whole { steps } else { steps + 1 };
    let vertices = (0..count).flat_map(|k| [corner(k, -0.5), corner(k, 0.5)]).collect();
    let mut facets = vec![];
    for k in 0..count {
        let next = (k + 1) % count;
        facets.extend([[2 * k, 2 * next, 2 * k + 1], [2 * next, 2 * next + 1, 2 * k + 1]]);
    }
    for k in 1..count - 1 {
        facets.extend([[0, 2 * k + 2, 2 * k], [1, 2 * k + 1, 2 * k + 3]]);
    }
    Polyhedron::from_facets(vertices, facets).expect("a prism")
}

fn rims(first_body: usize, radius: f64, height: f64) -> [Rim; 2] {
    [-0.5, 0.5].map(|z| Rim {
        body: first_body + usize::from(z > 0.0),
        // A pose other than the circle's own, so that body coordinates matter.
        pose: Pose::new(
            Vec3::new(0.1, -0.2, 1.3 * z * height),
            Rotation::from_scaled_axis(Vec3::new(0.2, z, 0.4)),
        ),
        centre: Vec3::new(0.0, 0.0, z * height),
        radius,
    })
}

struct Scene {
    shapes: Vec<(Polyhedron, f64)>,
    poses: Vec<Pose>,
    rims: [Rim; 2],
}

impl Scene {
    fn new(shapes: Vec<(Polyhedron, f64)>, grain_poses: Vec<Pose>, radius: f64, height: f64) -> Self {
        let rims = rims(shapes.len(), radius, height);
        let poses = grain_poses.into_iter().chain(rims.map(|rim| rim.pose)).collect();
        Scene { shapes, poses, rims }
    }

    fn drape(&self, spacing: f64, pore_depth: f64) -> Result<PressureCover> {
        let outlines: Vec<Outline> = self
            .shapes
            .iter()
            .enumerate()
            .map(|(body, (core, rounding))| Outline {
                body,
                core,
                rounding: *rounding,
                pose: self.poses[body],
            })
            .collect();
        PressureCover::drape(&outlines, &self.rims, spacing, pore_depth)
    }
}

/// Boxes and balls, turned at random, on the rim of a cylinder of radius 1 and height 2: pores of all depths.
fn heap() -> Scene {
    let mut scatter = Scatter(7);
    let (mut shapes, mut poses) = (vec![], vec![]);
    for layer in 0..5 {
        for step in 0..12 {
            let angle = TAU * (step as f64 + 0.5 * (layer % 2) as f64) / 12.0;
            let place = Vec3::new(0.75 * angle.cos(), 0.75 * angle.sin(), -0.8 + 0.4 * layer as f64);
            let pose = Pose::new(
                place + scatter.vector() * 0.02,
                Rotation::from_scaled_axis(scatter.vector() * 3.0),
            );
            shapes.push(if (layer + step) % 2 == 0 {
                (Polyhedron::point(), 0.22)
            } else {
                (Polyhedron::cuboid([0.3, 0.24, 0.28]).expect("a box"), 0.02)
            });
            poses.push(pose);
        }
    }
    Scene::new(shapes, poses, 1.0, 2.0)
}

/// Over the heap, with rims that are bonded and with rims that slide.
fn heap_covers() -> (Scene, [PressureCover; 2]) {
    let scene = heap();
    let bonded = scene.drape(0.12, 0.25).expect("a cover");
    let sliding = bonded.sliding(&scene.poses).expect("the same surface");
    (scene, [bonded, sliding])
}

fn loads(cover: &PressureCover, poses: &[Pose]) -> Vec<Vector6<f64>> {
    let mut loads = vec![Vector6::zeros(); poses.len()];
    cover.loads_into(&mut loads, poses, PRESSURE);
    loads
}

fn moved(poses: &[Pose], body: usize, component: usize, by: f64) -> Vec<Pose> {
    let mut step = [0.0; 6];
    step[component] = by;
    let mut poses = poses.to_vec();
    poses[body] =
        poses[body].moved(&Vec3::from_column_slice(&step[..3]), &Vec3::from_column_slice(&step[3..]));
    poses
}

#[test]
fn loads_have_no_resultant_and_no_moment() {
    let (scene, covers) = heap_covers();
    for cover in covers {
        let (mut force, mut moment, mut size) = (Vec3::zeros(), Vec3::zeros(), 0.0);
        for (load, pose) in loads(&cover, &scene.poses).iter().zip(&scene.poses) {
            let [on_body, about_body] = [0, 3].map(|k| Vec3::new(load[k], load[k + 1], load[k + 2]));
            force += on_body;
            moment += about_body + pose.position.cross(&on_body);
            size += on_body.norm();
        }
        assert!(size > 10.0);
        assert!(force.norm() < 1e-13 * size, "{force}");
        assert!(moment.norm() < 1e-13 * size, "{moment}");

        let mut forces = vec![Vec3::zeros(); cover.nodes().len()];
        cover.node_forces_into(&mut forces, &scene.poses, PRESSURE);
        let virial: f64 =
            forces.iter().enumerate().map(|(n, f)| f.dot(&cover.position(&scene.poses, n))).sum();
        // Euler: V is homogeneous of degree three.
        assert!((virial + 3.0 * PRESSURE * cover.volume(&scene.poses)).abs() < 1e-12 * size);
    }
}

#[test]
fn load_is_derivative_of_volume() {
    let (scene, covers) = heap_covers();
    for cover in covers {
        let step = 1e-4;
        for (body, load) in loads(&cover, &scene.poses).iter().enumerate() {
            for k in 0..6 {
                let [ahead, behind] = [step, -step].map(|by| cover.volume(&moved(&scene.poses, body, k, by)));
                let expected = -PRESSURE * (ahead - behind) / (2.0 * step);
                // The difference of a cubic is off by its third derivative, of the order of step^2.
                assert!((load[k] - expected).abs() < 1e-8, "body {body}, {k}: {} for {expected}", load[k]);
            }
        }
    }
}

#[test]
fn tangent_is_derivative_of_loads() {
    let (scene, covers) = heap_covers();
    for cover in covers {
        let bodies = scene.poses.len();
        let mut tangent = vec![Matrix6::<f64>::zeros(); bodies * bodies];
        let mut calls = 0;
        cover.for_each_tangent_block(
            &scene.poses,
            PRESSURE,
            |_, _| true,
            |i, j, block| {
                tangent[i * bodies + j] += block;
                calls += 1;
            },
        );
        let pairs = cover.coupled_bodies().map(|[i, j]| if i == j { 1 } else { 2 }).sum::<usize>();
        assert_eq!(calls, pairs);
        let step = 1e-4;
        for j in 0..bodies {
            for k in 0..6 {
                let [ahead, behind] = [step, -step].map(|by| loads(&cover, &moved(&scene.poses, j, k, by)));
                for i in 0..bodies {
                    let expected = (ahead[i] - behind[i]) / (2.0 * step);
                    let error = (tangent[i * bodies + j].column(k) - expected).norm();
                    assert!(error < 1e-7, "bodies {i} and {j}, {k}: off by {error}");
                }
            }
        }
    }
}

#[test]
fn tangent_is_symmetric_up_to_the_moment_of_the_load() {
    let (scene, covers) = heap_covers();
    for cover in covers {
        let loads = loads(&cover, &scene.poses);
        cover.for_each_tangent_block(
            &scene.poses,
            PRESSURE,
            |_, _| true,
            |i, j, block| {
                let mut skew = block - block.transpose();
                if i == j {
                    let moment = Vec3::new(loads[i][3], loads[i][4], loads[i][5]);
                    add_at(&mut skew, [3, 3], &moment.cross_matrix());
                    assert!(skew.norm() < 1e-13, "body {i}: {skew}");
                }
            },
        );
    }
}

#[test]
fn rims_that_slide_leave_nothing_sideways_to_the_plates() {
    let (scene, [bonded, sliding]) = heap_covers();
    let grains = scene.shapes.len();
    // Grains that have gone some way together, and each some of its own.
    let mut scatter = Scatter(11);
    let mut poses = scene.poses.clone();
    for pose in &mut poses[..grains] {
        *pose =
            pose.moved(&(Vec3::new(0.05, -0.03, 0.0) + scatter.vector() * 0.01), &(scatter.vector() * 0.05));
    }
    let sideways = |cover: &PressureCover| {
        let loads = loads(cover, &poses);
        let force: Vec3 = loads[..grains].iter().map(|w| Vec3::new(w[0], w[1], 0.0)).sum();
        let about =
            |(w, pose): (&Vector6<f64>, &Pose)| w[5] + pose.position.x * w[1] - pose.position.y * w[0];
        let torque: f64 = loads[..grains].iter().zip(&poses).map(about).sum();
        (force.norm(), torque.abs())
    };
    let (force, torque) = sideways(&sliding);
    assert!(force < 1e-12 && torque < 1e-12, "{force} N, {torque} N m");
    // On one that is bonded they have to be held.
    let (force, torque) = sideways(&bonded);
    assert!(force > 1e-3 && torque > 1e-5, "{force} N, {torque} N m");
    // Along the plates its rims went with the grains, across them they stayed.
    for rim in &sliding.rims {
        for node in rim.clone() {
            let way = sliding.position(&poses, node) - sliding.position(&scene.poses, node);
            assert!(way.xy().norm() > 0.02 && way.z == 0.0, "{way}");
        }
    }
}

#[test]
fn work_is_pressure_times_change_of_volume() {
    let scene = heap();
    let cover = scene.drape(0.12, 0.25).expect("a cover");
    let mut scatter = Scatter(11);
    let paths: Vec<[Vec3; 2]> =
        scene.poses.iter().map(|_| [scatter.vector() * 0.05, scatter.vector() * 0.3]).collect();
    let at = |share: f64| -> Vec<Pose> {
        scene
            .poses
            .iter()
            .zip(&paths)
            .map(|(pose, [u, turn])| pose.moved(&(u * share), &(turn * share)))
            .collect()
    };
    let work = |steps: usize| -> f64 {
        let wrenches: Vec<Vec<Vector6<f64>>> =
            (0..=steps).map(|k| loads(&cover, &at(k as f64 / steps as f64))).collect();
        let along = |pair: &[Vec<Vector6<f64>>]| -> f64 {
            let means = pair[0].iter().zip(&pair[1]).map(|(a, b)| 0.5 * (a + b));
            means
                .zip(&paths)
                .map(|(mean, [u, turn])| {
                    // Rotations about a fixed axis: the spatial increments add up.
                    let (force, moment) = (mean.fixed_rows::<3>(0), mean.fixed_rows::<3>(3));
                    (force.dot(u) + moment.dot(turn)) / steps as f64
                })
                .sum()
        };
        wrenches.windows(2).map(along).sum()
    };
    let exact = -PRESSURE * (cover.volume(&at(1.0)) - cover.volume(&at(0.0)));
    let [coarse, fine] = [20, 40].map(|steps| work(steps) - exact);
    assert!(exact.abs() > 0.1, "the path must do work, not {exact}");
    assert!(fine.abs() < 1e-4 * exact.abs());
    // The trapezoid rule is of second order.
    assert!((coarse / fine - 4.0).abs() < 0.1, "{coarse} and {fine}");
}

#[test]
fn volume_of_a_cylinder_converges_with_second_order() {
    let shape = prism(2048, 1.0, 2.0, [0.0, TAU]);
    let scene = Scene::new(vec![(shape, 0.0)], vec![Pose::identity()], 1.0, 2.0);
    let errors = [0.2, 0.1].map(|spacing| {
        let cover = scene.drape(spacing, 0.3).expect("a cover");
        assert_eq!(cover.statistics().bridged_nodes, 0);
        1.0 - cover.volume(&scene.poses) / (2.0 * PI)
    });
    // An inscribed n-gon lacks (2 pi / n)^2 / 6 of the area; facets between staggered rings lack as
    // much again at most.
    assert!(errors[0] > 0.0 && errors[0] < 0.2f64.powi(2) / 3.0, "{errors:?}");
    assert!((errors[0] / errors[1] - 4.0).abs() < 0.2, "{errors:?}");
}

#[test]
fn resultant_on_half_a_cylinder_is_pressure_times_projected_area() {
    let halves = [[-0.5 * PI, 0.5 * PI], [0.5 * PI, 1.5 * PI]].map(|span| (prism(512, 1.0, 2.0, span), 0.0));
    let scene = Scene::new(halves.to_vec(), vec![Pose::identity(); 2], 1.0, 2.0);
    for spacing in [0.1, 0.05] {
        let cover = scene.drape(spacing, 0.3).expect("a cover");
        let loads = loads(&cover, &scene.poses);
        // The strip beside each rim hands half of its load to the plate.
        let expected = PRESSURE * 2.0 * (2.0 - spacing);
        assert!(
            (loads[0][0] + expected).abs() < spacing * spacing * expected,
            "{} for {expected}",
            loads[0][0]
        );
        assert!(
            (loads[1][0] - expected).abs() < spacing * spacing * expected,
            "{} for {expected}",
            loads[1][0]
        );
        // Cap: pressure times the area of the rim polygon, towards the specimen.
        let corners = (TAU / spacing).ceil();
        let cap = PRESSURE * 0.5 * corners * (TAU / corners).sin();
        let top = loads[3];
        assert!((top[2] + cap).abs() < spacing * spacing * cap, "{} for {cap}", top[2]);
    }
}

#[test]
fn sections_add_up_to_the_volume() {
    let scene = heap();
    let cover = scene.drape(0.1, 0.25).expect("a cover");
    // Level rims, so that every slice is whole.
    let mut areas = vec![0.0; 2000];
    cover.section_areas_into(&mut areas, &scene.poses);
    assert!((cover.height(&scene.poses) - 2.0).abs() < 1e-12);
    let mean = areas.iter().sum::<f64>() / areas.len() as f64;
    let expected = cover.volume(&scene.poses) / cover.height(&scene.poses);
    // Midpoint rule on a piecewise quadratic with 20 rings.
    assert!((mean / expected - 1.0).abs() < 1e-5, "{mean} {expected} {:?}", cover.statistics());
    assert!(areas.iter().all(|&area| area > 2.0 && area < PI));
}

fn rim_nodes(cover: &PressureCover) -> usize {
    cover.rims.iter().map(|rim| rim.len()).sum()
}

#[test]
fn a_cover_over_a_heap_is_a_folding_free_envelope() {
    let scene = heap();
    let cover = scene.drape(0.08, 0.2).expect("a cover");
    assert_eq!(cover.inward_facets(&scene.poses), 0);
    assert!(cover.statistics().bridged_nodes > 0);
    let on_grains = || cover.nodes().iter().map(|node| node.body).filter(|body| *body < 60);
    assert_eq!(on_grains().collect::<std::collections::BTreeSet<_>>().len(), 60);
    assert_eq!(rim_nodes(&cover) + on_grains().count(), cover.nodes().len());
    // Euler: a closed surface without handles.
    assert_eq!(cover.facets.len(), 2 * cover.nodes().len() - 4);
    // Between the cylinder of the grains' centres and that of their outermost points.
    let area = cover.volume(&scene.poses) / cover.height(&scene.poses);
    assert!(area > PI * 0.75f64.powi(2) && area < PI, "{area}");
    // A cover that lines deeper pores instead of spanning them encloses less.
    let lined = scene.drape(0.08, 0.9).expect("a cover");
    assert!(lined.volume(&scene.poses) < cover.volume(&scene.poses));
}

#[test]
fn nodes_stick_to_the_surface_of_a_ball() {
    let pose = Pose::new(Vec3::new(0.05, 0.0, 0.0), Rotation::from_scaled_axis(Vec3::new(0.3, 0.2, 0.1)));
    let scene = Scene::new(vec![(Polyhedron::point(), 1.0)], vec![pose], 1.0, 1.0);
    let cover = scene.drape(0.1, 0.5).expect("a cover");
    let on_ball: Vec<_> = cover.nodes().iter().filter(|node| node.body == 0).collect();
    assert_eq!(on_ball.len(), cover.nodes().len() - rim_nodes(&cover));
    assert!(on_ball.iter().all(|node| (node.point.norm() - 1.0).abs() < 1e-12));
}

#[test]
fn a_core_with_rounding_has_the_faces_of_the_nominal_box() {
    let nominal = Polyhedron::cuboid([1.0, 1.0, 2.0]).expect("a box");
    let core = Polyhedron::cuboid([0.9, 0.9, 1.9]).expect("a box");
    let volumes = [(nominal, 0.0), (core, 0.05)].map(|shape| {
        let scene = Scene::new(vec![shape], vec![Pose::identity()], 0.6, 1.0);
        scene.drape(0.05, 0.3).expect("a cover").volume(&scene.poses)
    });
    assert!((volumes[0] - volumes[1]).abs() < 1e-12, "{volumes:?}");
}

#[test]
fn a_scene_far_from_the_origin_gets_the_same_loads() {
    let near = heap();
    let shift = Vec3::new(1000.0, -500.0, 300.0);
    let mut far = heap();
    far.poses.iter_mut().for_each(|pose| pose.position += shift);
    for rim in &mut far.rims {
        rim.pose.position += shift;
        rim.centre += shift;
    }
    let [a, b] = [&near, &far].map(|scene| loads(&scene.drape(0.12, 0.25).expect("a cover"), &scene.poses));
    for (x, y) in a.iter().zip(&b) {
        assert!((x - y).norm() < 1e-9, "{} {}", x.transpose(), y.transpose());
    }
}

#[test]
fn impossible_covers_are_refused_with_a_reason() {
    let reason = |result: Result<PressureCover>| match result {
        Err(Error::Specimen(reason)) => reason,
        other => panic!("expected a refusal, not {other:?}"),
    };
    let bare = Scene::new(vec![], vec![], 1.0, 2.0);
    assert!(reason(bare.drape(0.2, 0.3)).contains("no grain"));
    // A single ball on one side leaves the other bare.
    let at = Pose::new(Vec3::new(0.8, 0.0, 0.0), Rotation::identity());
    let lopsided = Scene::new(vec![(Polyhedron::point(), 0.2)], vec![at], 1.0, 2.0);
    assert!(reason(lopsided.drape(0.1, 0.3)).contains("no grain"));
    let scene = heap();
    for (spacing, depth) in [(0.0, 0.3), (f64::NAN, 0.3), (0.2, -1.0), (0.2, f64::INFINITY)] {
        assert!(reason(scene.drape(spacing, depth)).contains("positive length"));
    }
    assert!(reason(scene.drape(1e-7, 0.3)).contains("nodes"));
}
