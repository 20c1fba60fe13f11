//! Scenes in a few lines, for the tests; each run audits every accepted state for overlap.

#![allow(dead_code, reason = "shared by several test programs, none of which uses all of it")]

use riprap::contact::law::Friction;
use riprap::geometry::Polyhedron;
use riprap::scene::{
    BodyLoad, LoadStage, Row, Scene, SceneBody, SceneParameters, SceneShape, deepest_overlap,
};
use riprap::solver::Settings;
use riprap::tensor::{Pose, Rotation, Vec3};
use riprap::triaxial::StageEnd;

/// Edges are rounded by this share of a body's smallest extent, as in case files.
pub const ROUNDING: f64 = 0.02;
pub const DENSITY: f64 = 2700.0;
pub const FREE: [Option<f64>; 3] = [None; 3];
pub const HELD: [Option<f64>; 3] = [Some(0.0); 3];

/// A body of the rock that all rungs use: E = 30 GPa, nu = 0.2.
pub fn body(name: &str, shape: SceneShape, position: [f64; 3], rotation: [f64; 3]) -> SceneBody {
    SceneBody {
        name: name.into(),
        shape,
        pose: Pose::new(Vec3::from(position), Rotation::from_scaled_axis(Vec3::from(rotation))),
        density: DENSITY,
        youngs_modulus: 30e9,
        poissons_ratio: 0.2,
        friction: None,
        grain: None,
        damaged: None,
        fixed: false,
    }
}

pub fn cuboid(size: [f64; 3]) -> SceneShape {
    let rounding = ROUNDING * size.iter().copied().fold(f64::INFINITY, f64::min);
    SceneShape::Polyhedron { nominal: Polyhedron::cuboid(size).expect("a box"), rounding }
}

pub fn hull(points: &[[f64; 3]], rounding: f64) -> SceneShape {
    let points: Vec<Vec3> = points.iter().map(|p| Vec3::from(*p)).collect();
    SceneShape::Polyhedron { nominal: Polyhedron::convex_hull(&points).expect("a hull"), rounding }
}

pub fn fixed(body: SceneBody) -> SceneBody {
    SceneBody { fixed: true, ..body }
}

/// A 1 m plate whose upper face is z = 0.
pub fn ground() -> SceneBody {
    fixed(body("ground", cuboid([1.0, 1.0, 0.1]), [0.0, 0.0, -0.05], [0.0; 3]))
}

pub fn scene(bodies: Vec<SceneBody>, friction: f64, stages: Vec<LoadStage>) -> SceneParameters {
    SceneParameters {
        bodies,
        gravity: Vec3::zeros(),
        friction: Friction::constant(friction),
        settings: Settings::default(),
        increment_range: [1.0 / 64.0, 1.0],
        stages,
    }
}

/// Forces balance to 1e-5 of the mean contact force, where a limit is to be found sharply.
pub fn sharp(mut parameters: SceneParameters) -> SceneParameters {
    parameters.settings.force_tolerance = 1e-5;
    parameters
}

pub fn load(increments: usize, name: &str, load: BodyLoad) -> LoadStage {
    LoadStage { increments, bodies: vec![(name.into(), load)], gravity: None }
}

pub fn gravity(increments: usize, gravity: [f64; 3]) -> LoadStage {
    LoadStage { increments, bodies: vec![], gravity: Some(Vec3::from(gravity)) }
}

pub fn push(force: [f64; 3]) -> BodyLoad {
    BodyLoad { force: Some(force.map(Some)), ..BodyLoad::default() }
}

pub fn drive(displacement: [Option<f64>; 3], rotation: [Option<f64>; 3]) -> BodyLoad {
    BodyLoad { displacement: Some(displacement), rotation: Some(rotation), ..BodyLoad::default() }
}

/// A finished run.
pub struct Run {
    pub scene: Scene,
    pub rows: Vec<Row>,
    pub end: StageEnd,
    /// Deepest overlap of any accepted state [m], by the independent check.
    pub deepest: f64,
    pub seconds: f64,
}

impl Run {
    pub fn of(parameters: &SceneParameters) -> Run {
        let mut scene = Scene::new(parameters).expect("a sound scene");
        let mut rows = Vec::new();
        let mut deepest = f64::NEG_INFINITY;
        let start = std::time::Instant::now();
        let end = scene.run(|scene, row| {
            let overlap = deepest_overlap(&scene.model, &scene.committed.poses).map_or(0.0, |o| o.depth);
            // A contact of fidelity rigid yields by its force over its stiffness, and by no more: the
            // softest pair's stiffness and the whole onset bound it.
            let softest = scene.model.bodies.iter().map(|b| b.stiffness).fold(f64::INFINITY, f64::min);
            let force = row.bodies.iter().map(|b| b.contact_force.norm()).fold(0.0, f64::max);
            let largest = force.max(row.measures.mean_force * row.measures.points as f64);
            let allowed = largest / (0.5 * softest) + 0.5 * scene.model.law.onset + 1e-12;
            assert!(overlap <= allowed, "increment {}: overlap {overlap} of {allowed} m", row.increment);
            assert!(
                overlap <= row.measures.max_penetration + 1e-9 * scene.model.smallest_rounding() + 1e-12,
                "increment {}: contacts know of {} m overlap, the audit finds {overlap} m",
                row.increment,
                row.measures.max_penetration
            );
            deepest = deepest.max(overlap);
            rows.push(row.clone());
            true
        });
        Run { scene, rows, end, deepest, seconds: start.elapsed().as_secs_f64() }
    }

    pub fn finished(&self) -> bool {
        self.end == StageEnd::Finished
    }

    pub fn last(&self) -> &Row {
        self.rows.last().unwrap_or_else(|| panic!("no increment was accepted: {:?}", self.end))
    }

    pub fn index(&self, name: &str) -> usize {
        self.scene.body(name).expect("a body of that name")
    }

    pub fn factorisations(&self) -> usize {
        self.rows.iter().map(|r| r.counters.factorisations).sum()
    }

    pub fn cuts(&self) -> usize {
        self.rows.iter().map(|r| r.counters.cuts).sum()
    }

    /// Prints one line of the table of rungs.
    pub fn tell(&self, rung: &str, computed: f64, reference: f64) {
        println!(
            "{rung:<44} computed {computed:<13.6e} reference {reference:<13.6e} error {:<10.2e} rows {:<4} \
             factorisations {:<6} cuts {:<3} overlap {:.2e} m  {:.3} s",
            computed - reference,
            self.rows.len(),
            self.factorisations(),
            self.cuts(),
            self.deepest,
            self.seconds
        );
    }
}
