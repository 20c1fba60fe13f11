//! Small hostile scenes by the dozen, 2 to 12 bodies each: heaps of slivers, balls, boxes and hulls of sizes 1:50 and stiffnesses 1:1e6; stacked
//! plates; grids of boxes whose faces and edges coincide; a wedge driven between blocks; loose grains between closing plates.
//! Friction 0 to 1.5, under gravity, forces and drives.
//!
//! Not all of them have an equilibrium. What has to come out of each: a status, finite numbers, no overlap beyond
//! what its contacts know of (audited in each run), forces that balance in each accepted increment. The share that finishes is printed, kind by
//! kind, and recorded in `benchmarks/runs/2026-12-01-hostile-scenes`; it may only rise.

use std::collections::BTreeMap;

use rand_mt::Mt64;
use riprap::contact::law::Friction;
use riprap::geometry::separation::{feature_distance, separating_axis};
use riprap::loading::StageEnd;
use riprap::scene::{LoadStage, Scene, SceneBody, SceneParameters, SceneShape};
use riprap::solver::audit::deepest_overlap;
use riprap::verification::bodies::{HELD, body, cuboid, drive, fixed, gravity, ground, hull, push, scene};

use crate::audited::audited;

struct Dice {
    random: Mt64,
    /// Decades by which bodies may be stiffer than rock.
    decades: f64,
}

impl Dice {
    fn new(seed: u64, decades: f64) -> Self {
        Dice { random: Mt64::new(seed), decades }
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn below(&mut self, count: usize) -> usize {
        (self.between(0.0, count as f64) as usize).min(count - 1)
    }

    /// As stiff as rock, or up to so many decades stiffer. (Softer bodies would yield under their neighbours' weight by more than
    /// their roundings, which no contact here can carry.)
    fn modulus(&mut self) -> f64 {
        30e9 * 10f64.powf(self.between(0.0, self.decades))
    }
}

/// A million times, where double precision no longer tells the gaps of light bodies.
const DECADES: f64 = 6.0;
const KINDS: [&str; 5] = ["heap", "stack", "grid", "wedge", "closing plates"];

fn shape(dice: &mut Dice, size: f64) -> SceneShape {
    match dice.below(4) {
        0 => SceneShape::Sphere(0.5 * size),
        1 => cuboid([0, 1, 2].map(|_| size * dice.between(0.3, 1.0))),
        // A sliver.
        2 => cuboid([size, size * dice.between(0.3, 1.0), 0.05 * size]),
        _ => {
            let points: Vec<[f64; 3]> = (0..12)
                .map(|_| {
                    let (z, turn) = (dice.between(-1.0, 1.0), dice.between(0.0, std::f64::consts::TAU));
                    let ring = (1.0f64 - z * z).sqrt();
                    [0.5 * size * ring * turn.cos(), 0.5 * size * ring * turn.sin(), 0.5 * size * z]
                })
                .collect();
            hull(&points, 0.01 * size)
        }
    }
}

/// Lowers the last body until it touches; returns the height of the highest point so far, or more.
fn lower_last_into_touch(bodies: &mut [SceneBody], top: f64) -> f64 {
    let model = Scene::new(&scene(bodies.to_vec(), 0.0, vec![])).expect("a sound scene");
    let mut poses = model.committed.poses;
    let last = poses.len() - 1;
    let (mut low, mut high) = (0.0, poses[last].position.z);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        poses[last].position.z = middle;
        let clear = deepest_overlap(&model.model, &poses).is_none_or(|o| o.depth <= 0.0);
        (low, high) = if clear { (low, middle) } else { (middle, high) };
    }
    bodies[last].pose.position.z = high;
    top.max(high + model.model.shapes[last].rounded.bounding_radius())
}

#[test]
fn the_deepest_overlap_is_the_deepest_of_all_pairs() {
    let mut dice = Dice::new(7, DECADES);
    let mut overlapping = 0;
    for _ in 0..40 {
        let (bodies, _) = heap(&mut dice);
        let model = Scene::new(&scene(bodies, 0.0, vec![])).expect("a sound scene");
        let mut poses = model.committed.poses.clone();
        // From heaps that just touch to cores deep in each other, and apart.
        let squeeze = dice.between(0.3, 1.2);
        poses.iter_mut().for_each(|pose| pose.position.z *= squeeze);
        let shapes = &model.model.shapes;
        let depth = |a: usize, b: usize| {
            let (core_a, core_b) = (&shapes[a].rounded.core, &shapes[b].rounded.core);
            let axis = separating_axis(core_a, &poses[a], core_b, &poses[b]).gap;
            let points = core_a.facets.is_empty() && core_b.facets.is_empty();
            let distance = if axis > 0.0 || points {
                feature_distance(core_a, &poses[a], core_b, &poses[b])
            } else {
                axis
            };
            shapes[a].rounded.radius + shapes[b].rounded.radius - distance
        };
        let pairs = (1..poses.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
        let brute = pairs.map(|(a, b)| depth(a, b)).fold(f64::NEG_INFINITY, f64::max);
        let found = deepest_overlap(&model.model, &poses).expect("two bodies").depth;
        overlapping += usize::from(brute > 0.0);
        // Bodies that are apart may be said to be nearer than they are.
        if brute > 0.0 {
            assert_eq!(found, brute);
        } else {
            assert!(found <= 0.0 && found >= brute - 1e-12, "{found} {brute}");
        }
    }
    assert!(overlapping > 10, "{overlapping}");
}

/// One to eleven bodies dropped onto each other, of any shape and size.
fn heap(dice: &mut Dice) -> (Vec<SceneBody>, Vec<LoadStage>) {
    let mut bodies = vec![ground()];
    let mut top = 0.0;
    let count = 1 + dice.below(11);
    for k in 0..count {
        let size = 0.1 * 50f64.powf(-dice.between(0.0, 1.0));
        let place = [dice.between(-0.02, 0.02), dice.between(-0.02, 0.02), top + size];
        let turn = [0, 1, 2].map(|_| dice.between(-1.5, 1.5));
        let lies_flat = dice.below(2) == 0;
        let turn = if lies_flat { [0.0, 0.0, turn[2]] } else { turn };
        let made = body(&format!("body {k}"), shape(dice, size), place, turn);
        bodies.push(SceneBody { youngs_modulus: dice.modulus(), ..made });
        top = lower_last_into_touch(&mut bodies, top);
    }
    let stages = loaded(dice, &format!("body {}", count - 1), 0.5 * top);
    (bodies, stages)
}

/// Gravity, a force on `last`, or `last` driven down by `way`.
fn loaded(dice: &mut Dice, last: &str, way: f64) -> Vec<LoadStage> {
    let one =
        |increments, load, gravity| LoadStage { increments, bodies: vec![(last.into(), load)], gravity };
    match dice.below(3) {
        0 => vec![gravity(4, [0.0, 0.0, -9.81])],
        1 => {
            let force = [dice.between(-1.0, 1.0), 0.0, -dice.between(0.0, 10.0)];
            vec![gravity(2, [0.0, 0.0, -0.1]), one(4, push(force), None)]
        }
        _ => vec![one(10, drive([None, None, Some(-way)], HELD), Some([0.0, 0.0, -1.0].into()))],
    }
}

/// Thin plates on each other, their faces in one plane two by two, some turned, each supported beyond its centre.
fn stack(dice: &mut Dice) -> (Vec<SceneBody>, Vec<LoadStage>) {
    let mut bodies = vec![ground()];
    let count = 2 + dice.below(10);
    let mut top = 0.0;
    for k in 0..count {
        let thickness = 0.1 * 50f64.powf(-dice.between(0.2, 1.0));
        let size = [dice.between(0.06, 0.2), dice.between(0.06, 0.2), thickness];
        let place = [dice.between(-0.01, 0.01), dice.between(-0.01, 0.01), top + 0.5 * thickness];
        let turn = if dice.below(2) == 0 { 0.0 } else { dice.between(-1.5, 1.5) };
        let plate = body(&format!("plate {k}"), cuboid(size), place, [0.0, 0.0, turn]);
        bodies.push(SceneBody { youngs_modulus: dice.modulus(), ..plate });
        top += thickness;
    }
    // A fifth of the thinnest plate's rounding.
    let thinnest = 0.1 / 50.0;
    let stages = loaded(dice, &format!("plate {}", count - 1), 0.2 * 0.02 * thinnest);
    (bodies, stages)
}

/// Boxes in rows and layers whose faces and edges coincide, one of them pushed sideways.
fn grid(dice: &mut Dice) -> (Vec<SceneBody>, Vec<LoadStage>) {
    let [nx, ny, nz] = [1 + dice.below(3), 1 + dice.below(2), 1 + dice.below(2)];
    let size = 0.1 * 50f64.powf(-dice.between(0.0, 1.0));
    let mut bodies = vec![ground()];
    for k in 0..nx * ny * nz {
        let at = [k % nx, k / nx % ny, k / nx / ny].map(|i| i as f64 * size);
        let made = body(&format!("box {k}"), cuboid([size; 3]), [at[0], at[1], at[2] + 0.5 * size], [0.0; 3]);
        bodies.push(SceneBody { youngs_modulus: dice.modulus(), ..made });
    }
    let pushed = drive([Some(size * dice.between(-0.3, 0.3)), None, None], [None; 3]);
    let bodies_of = vec![(format!("box {}", dice.below(nx * ny * nz)), pushed)];
    let stages =
        vec![gravity(4, [0.0, 0.0, -9.81]), LoadStage { increments: 10, bodies: bodies_of, gravity: None }];
    (bodies, stages)
}

/// A wedge driven down between two blocks that lie on the ground, or are held.
fn wedge(dice: &mut Dice) -> (Vec<SceneBody>, Vec<LoadStage>) {
    let (angle, half): (f64, f64) = (dice.between(0.05, 0.7), 0.02);
    let top = 2.0 * half * angle.tan() + 1e-3;
    let mut corners = Vec::new();
    for y in [-0.02, 0.02] {
        for (z, width) in [(-half, 1e-3), (half, top)] {
            corners.extend([[-width, y, z], [width, y, z]]);
        }
    }
    let held = dice.below(2) == 0;
    let block = |name: &str, side: f64, modulus: f64| {
        let size = [0.04, 0.05, 0.05];
        let made = body(name, cuboid(size), [side * (0.02 + 0.25 * top), 0.0, 0.025], [0.0; 3]);
        SceneBody { youngs_modulus: modulus, fixed: held, ..made }
    };
    let moduli = [dice.modulus(), dice.modulus()];
    let mut bodies = vec![ground(), block("left", -1.0, moduli[0]), block("right", 1.0, moduli[1])];
    bodies.push(body("wedge", hull(&corners, 2e-4), [0.0, 0.0, 0.2], [0.0; 3]));
    lower_last_into_touch(&mut bodies, 0.0);
    let stages = match dice.below(2) {
        0 => {
            let driven = drive([Some(0.0), Some(0.0), Some(-2e-3)], HELD);
            vec![
                gravity(2, [0.0, 0.0, -9.81]),
                LoadStage { increments: 10, bodies: vec![("wedge".into(), driven)], gravity: None },
            ]
        }
        _ => {
            let force = push([dice.between(-1.0, 1.0), 0.0, -dice.between(1.0, 100.0)]);
            vec![
                gravity(2, [0.0, 0.0, -9.81]),
                LoadStage { increments: 5, bodies: vec![("wedge".into(), force)], gravity: None },
            ]
        }
    };
    (bodies, stages)
}

/// Loose hulls and balls in cells between two plates that close, four walls around them.
fn closing(dice: &mut Dice) -> (Vec<SceneBody>, Vec<LoadStage>) {
    let cell = 0.02;
    let [nx, nz] = [1 + dice.below(2), 1 + dice.below(3)];
    let (width, height) = (nx as f64 * cell, nz as f64 * cell);
    let wall = |name: &str, size, place| fixed(body(name, cuboid(size), place, [0.0; 3]));
    let (mx, mz) = (0.5 * width, 0.5 * height);
    let mut bodies = vec![
        wall("west", [0.01, 0.1, height + 0.05], [-0.005, 0.0, mz]),
        wall("east", [0.01, 0.1, height + 0.05], [width + 0.005, 0.0, mz]),
        body("floor", cuboid([width - 1e-3, 0.1, 0.01]), [mx, 0.0, -0.005], [0.0; 3]),
        body("lid", cuboid([width - 1e-3, 0.1, 0.01]), [mx, 0.0, height + 0.005], [0.0; 3]),
    ];
    for k in 0..nx * nz {
        let size = cell * dice.between(0.3, 0.98);
        let mut made = shape(dice, size);
        if let SceneShape::Polyhedron { nominal, .. } = &made {
            // Corners of boxes may stick out of a ball of their size.
            made =
                if nominal.bounding_radius() > 0.49 * cell { SceneShape::Sphere(0.5 * size) } else { made };
        }
        let place = [((k % nx) as f64 + 0.5) * cell, 0.0, ((k / nx) as f64 + 0.5) * cell];
        let turn = [0, 1, 2].map(|_| dice.between(-1.5, 1.5));
        let grain = body(&format!("grain {k}"), made, place, turn);
        bodies.push(SceneBody { youngs_modulus: dice.modulus(), ..grain });
    }
    let half = 0.5 * dice.between(0.01, 0.3) * height;
    let stages = vec![LoadStage {
        increments: 20,
        bodies: vec![
            ("floor".into(), drive([Some(0.0), Some(0.0), Some(half)], HELD)),
            ("lid".into(), drive([Some(0.0), Some(0.0), Some(-half)], HELD)),
        ],
        gravity: None,
    }];
    (bodies, stages)
}

fn random_scene(seed: u64, decades: f64) -> (usize, SceneParameters) {
    let dice = &mut Dice::new(seed, decades);
    let kind = dice.below(KINDS.len());
    let (bodies, stages) = match kind {
        0 => heap(dice),
        1 => stack(dice),
        2 => grid(dice),
        3 => wedge(dice),
        _ => closing(dice),
    };
    let friction = Friction::constant(dice.between(0.0, 1.5));
    let mut parameters =
        SceneParameters { friction, increment_range: [0.25, 1.0], ..scene(bodies, 0.0, stages) };
    // Scenes without an equilibrium are many: each is to be given up in good time.
    parameters.settings.max_augmentations = 100;
    parameters.settings.max_dwell = 200;
    (kind, parameters)
}

/// Runs the scenes of these seeds; the share that finished.
fn survive(seeds: std::ops::Range<u64>, decades: f64) -> f64 {
    let (mut rows, mut factorisations) = (0, 0);
    let mut by_kind: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
    let start = std::time::Instant::now();
    for seed in seeds {
        let (kind, parameters) = random_scene(seed, decades);
        let run = audited(&parameters);
        for row in &run.rows {
            assert!(row.balance.out_of_balance < 1e-3, "seed {seed}: {:?}", row.balance);
            let sound = row.bodies.iter().all(|b| {
                b.position
                    .iter()
                    .chain(b.contact_force.iter())
                    .chain(b.reaction_moment.iter())
                    .all(|x| x.is_finite())
            });
            assert!(sound && row.ledger.error().is_finite(), "seed {seed}: not finite");
        }
        let counts = by_kind.entry(KINDS[kind]).or_default();
        counts[1] += 1;
        match &run.end {
            StageEnd::Finished => counts[0] += 1,
            StageEnd::Stopped { reason } => {
                assert!(!reason.is_empty());
                assert!(run.scene.dossier.is_some(), "seed {seed}: stopped without a dossier");
            }
            StageEnd::Interrupted => panic!("nobody interrupted"),
        }
        let cause = run.scene.dossier.as_ref().and_then(|dossier| dossier.cause.as_ref());
        println!(
            "seed {seed}: {}, {} bodies, mu {:.2}, {} rows, {:.2} s, {:?}; cause {cause:?}",
            KINDS[kind],
            run.scene.model.bodies.len(),
            parameters.friction.peak,
            run.rows.len(),
            run.time.as_secs_f64(),
            run.end
        );
        rows += run.rows.len();
        factorisations += run.factorisations();
    }
    let [finished, total] = by_kind.values().fold([0, 0], |[f, t], [a, b]| [f + a, t + b]);
    println!(
        "random scenes: {finished} of {total} finished, {by_kind:?}; {rows} increments accepted with {factorisations} \
         factorisations, {:.1} s",
        start.elapsed().as_secs_f64()
    );
    finished as f64 / total as f64
}

#[test]
fn dozens_survive() {
    survive(1..41, DECADES);
}

#[test]
#[ignore = "takes minutes"]
fn hundreds_survive() {
    survive(1..401, DECADES);
}

/// From rock to the stiffest solids there are: double precision tells their gaps.
#[test]
#[ignore = "takes minutes"]
fn hundreds_of_solids_survive() {
    survive(1..401, 2.0);
}
