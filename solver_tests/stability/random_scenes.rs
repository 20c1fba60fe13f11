//! Small hostile scenes by the dozen: slivers, balls and boxes of sizes 1:50 and stiffnesses 1:1e6 over a floor, friction 0 to 1.5, under
//! gravity, forces and drives.
//!
//! Not all of them have an equilibrium. What has to come out of each: a status, finite numbers, no overlap beyond
//! what its contacts know of (audited in each run), forces that balance in each accepted increment. The share that finishes is printed.

use rand_mt::Mt64;
use riprap::contact::law::Friction;
use riprap::scene::{LoadStage, Scene, SceneBody, SceneParameters, SceneShape, deepest_overlap};
use riprap::triaxial::StageEnd;

use riprap::ladder::bodies::{HELD, body, cuboid, drive, gravity, ground, hull, push, scene};

use crate::audited::audited;

struct Dice(Mt64);

impl Dice {
    fn new(seed: u64) -> Self {
        Dice(Mt64::new(seed))
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn below(&mut self, count: usize) -> usize {
        (self.between(0.0, count as f64) as usize).min(count - 1)
    }
}

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

fn random_scene(seed: u64) -> SceneParameters {
    let dice = &mut Dice::new(seed);
    let mut bodies = vec![ground()];
    let mut top = 0.0;
    let count = 1 + dice.below(6);
    for k in 0..count {
        let size = 0.1 * 50f64.powf(-dice.between(0.0, 1.0));
        let place = [dice.between(-0.02, 0.02), dice.between(-0.02, 0.02), top + size];
        let turn = [0, 1, 2].map(|_| dice.between(-1.5, 1.5));
        let lies_flat = dice.below(2) == 0;
        let turn = if lies_flat { [0.0, 0.0, turn[2]] } else { turn };
        let made = body(&format!("body {k}"), shape(dice, size), place, turn);
        bodies.push(SceneBody { youngs_modulus: 30e9 * 10f64.powf(dice.between(-6.0, 0.0)), ..made });
        top = lower_last_into_touch(&mut bodies, top);
    }
    let mut stages: Vec<LoadStage> = vec![];
    let last = format!("body {}", count - 1);
    match dice.below(3) {
        0 => stages.push(gravity(4, [0.0, 0.0, -9.81])),
        1 => {
            let force = [dice.between(-1.0, 1.0), 0.0, -dice.between(0.0, 10.0)];
            stages.push(gravity(2, [0.0, 0.0, -0.1]));
            stages.push(LoadStage { increments: 4, bodies: vec![(last, push(force))], gravity: None });
        }
        _ => {
            let down = drive([None, None, Some(-0.5 * top)], HELD);
            stages.push(LoadStage {
                increments: 10,
                bodies: vec![(last, down)],
                gravity: Some([0.0, 0.0, -1.0].into()),
            });
        }
    }
    let friction = Friction::constant(dice.between(0.0, 1.5));
    SceneParameters { friction, increment_range: [0.25, 1.0], ..scene(bodies, 0.0, stages) }
}

fn survive(seeds: std::ops::Range<u64>) {
    let (total, mut finished, mut rows, mut factorisations) = (seeds.end - seeds.start, 0, 0, 0);
    let start = std::time::Instant::now();
    for seed in seeds {
        let run = audited(&random_scene(seed));
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
        match &run.end {
            StageEnd::Finished => finished += 1,
            StageEnd::Stopped { reason } => assert!(!reason.is_empty()),
            StageEnd::Interrupted => panic!("nobody interrupted"),
        }
        println!(
            "seed {seed}: {} bodies, {:.2} s, {:?}",
            run.scene.model.bodies.len(),
            run.time.as_secs_f64(),
            run.end
        );
        rows += run.rows.len();
        factorisations += run.factorisations();
    }
    println!(
        "random scenes: {finished} of {total} finished; {rows} increments accepted with {factorisations} factorisations, {:.1} s",
        start.elapsed().as_secs_f64()
    );
}

#[test]
fn dozens_survive() {
    survive(1..25);
}

#[test]
#[ignore = "takes minutes"]
fn hundreds_survive() {
    survive(1..401);
}
