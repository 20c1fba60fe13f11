//! A beam on two posts, one of which fails under half its load.

use super::*;
use crate::contact::law::Friction;
use crate::contact::{ContactLaw, ContactShape};
use crate::geometry::RoundedBody;
use crate::model::{Body, Committed};
use crate::solver::{Increment, IncrementReport, Settings, advance};
use crate::tensor::Rotation;

const ROUNDING: f64 = 1e-3;
/// On the beam, downwards [N].
const LOAD: f64 = 1e3;
/// Sides of the posts [m]; the first is the one that fails.
const POST: f64 = 0.1;
const FAILING: usize = 0;
const BEAM: usize = 2;
const STEPS: usize = 5;

fn block(size: [f64; 3]) -> (Body, ContactShape) {
    Body::block("block", BodyKind::Placed, size, ROUNDING, 0.05)
}

/// The beam may only move up and down.
struct Frame {
    model: Model,
    committed: Committed,
    contacts: Contacts,
    loads: Loads,
}

impl Frame {
    fn new() -> Self {
        let blocks = [[POST; 3], [POST; 3], [6.0 * POST, POST, POST]].map(block);
        let (bodies, shapes) = blocks.into_iter().unzip();
        let law = ContactLaw { onset: 1e-9, ..ContactLaw::SAMPLE };
        let model = Model::new(bodies, shapes, law, Friction::constant(0.5));
        let at = |x: f64, z: f64| Pose::new(Vec3::new(x, 0.0, z), Rotation::identity());
        let poses = vec![at(-1.5 * POST, 0.0), at(1.5 * POST, 0.0), at(0.0, POST)];
        let mut loads = Loads::none(3);
        loads.prescribed = vec![[true; 6], [true; 6], [true, true, false, true, true, true]];
        loads.applied[BEAM].z = -LOAD;
        let mut frame =
            Frame { model, committed: Committed::new(poses), contacts: Contacts::default(), loads };
        frame.commit(&frame.loads.clone());
        frame
    }

    fn advance(&mut self, loads: &Loads, settings: &Settings) -> IncrementReport {
        let increment = Increment { model: &self.model, committed: &self.committed, loads, settings };
        advance(&increment, vec![self.committed.poses.clone()], &mut self.contacts)
    }

    fn commit(&mut self, loads: &Loads) -> IncrementReport {
        let report = self.advance(loads, &Settings { force_tolerance: 1e-9, ..Settings::default() });
        assert!(report.converged(), "{:?}", report.history);
        self.committed.poses.clone_from(&report.poses);
        self.committed.memory.clone_from(&report.memory);
        report
    }

    /// What acts and what is stored at the committed poses.
    fn as_it_is(&mut self, loads: &Loads) -> IncrementReport {
        self.advance(loads, &Settings { max_augmentations: 0, ..Settings::default() })
    }

    /// Has the post lose its upper half.
    fn fail(&mut self) -> Remnants {
        let loads = self.loads.clone();
        self.as_it_is(&loads);
        let before = Touching::of(&self.contacts, &self.committed.poses);
        let (_, half) = block([POST, POST, 0.5 * POST]);
        let core = half.rounded.core.translated(&Vec3::new(0.0, 0.0, -0.25 * POST));
        self.model.shapes[FAILING] = ContactShape::new(RoundedBody { core, radius: ROUNDING });
        self.committed.memory.retain(|(a, _), _| *a as usize != FAILING);
        self.contacts = Contacts::default();
        self.as_it_is(&loads);
        let after = Touching::of(&self.contacts, &self.committed.poses);
        let fracture = Fracture {
            body: FAILING,
            parts: vec![FAILING],
            deleted_cells: 4,
            crushed_volume: 4.0 * (0.25 * POST).powi(3),
            lost_parts: 0,
            lost_energy: 0.0,
            former: vec![],
        };
        Remnants::new(&self.model, &self.committed.poses, &[fracture], [&before, &after], STEPS)
    }

    fn moved(&self, lift: f64) -> Vec<Pose> {
        let mut poses = self.committed.poses.clone();
        poses[BEAM].position.z += lift;
        poses
    }
}

#[test]
fn remnants_hold_what_the_failed_rock_held_less_a_step() {
    let mut frame = Frame::new();
    let remnants = frame.fail();
    let held = remnants.on(BEAM);
    let share = 1.0 - 1.0 / STEPS as f64;
    assert!((held.z - share * 0.5 * LOAD).abs() < 1e-6 * LOAD, "{held}");
    // It acts where the post stood: the lever is the post's.
    assert!((held[4] - 1.5 * POST * held.z).abs() < 1e-6 * LOAD * POST, "{held}");
    assert!((remnants.on(FAILING).z + held.z).abs() < 1e-9 * LOAD);
    let mut loads = frame.loads.clone();
    remnants.add_to(&mut loads);
    let left = frame.as_it_is(&loads).left[BEAM];
    assert!((left.z + 0.5 * LOAD / STEPS as f64).abs() < 1e-6 * LOAD, "{left}");
}

/// The other post takes the load over without a fall. Of the work of the load what is not stored is what the failed rock took: with springs of
/// stiffness k, whose share F / 2 of the load F goes over, F^2 / 8 k. Without remnants that would be set free.
#[test]
fn a_load_taken_over_step_by_step_sets_nothing_free() {
    let mut frame = Frame::new();
    let mut remnants = frame.fail();
    let loads = frame.loads.clone();
    let stored = frame.as_it_is(&loads).energy.elastic;
    let (mut overcome, mut steps) = (0.0, 0);
    let top = frame.committed.poses[BEAM].position.z;
    let last = loop {
        let is_over = remnants.is_over();
        let mut loads = frame.loads.clone();
        remnants.add_to(&mut loads);
        let old = frame.committed.poses.clone();
        let report = frame.commit(&loads);
        overcome += remnants.overcome(&old, &report.poses);
        steps += 1;
        remnants.release();
        if is_over {
            break report.energy.elastic;
        }
    };
    assert_eq!(steps, STEPS);
    let sunk = top - frame.committed.poses[BEAM].position.z;
    let work = LOAD * sunk;
    assert!((work - (last - stored) - overcome).abs() < 1e-6 * work, "{work} {last} {stored} {overcome}");
    let stiffness = 0.5 * LOAD / sunk;
    let exact = LOAD * LOAD / (8.0 * stiffness);
    assert!((overcome - exact).abs() < 1e-2 * exact, "{overcome} {exact}");
}

#[test]
fn what_bodies_squeeze_resists_less_and_what_they_part_from_not_at_all() {
    let mut frame = Frame::new();
    let mut remnants = frame.fail();
    let (held, here) = (remnants.on(BEAM).z, frame.committed.poses.clone());
    // A failed cell is a quarter of a post high.
    remnants.squeeze(&here, &frame.moved(-0.1 * 0.25 * POST));
    assert!((remnants.on(BEAM).z - 0.9 * held).abs() < 1e-9 * held);
    assert!(!remnants.let_go(&frame.model, &here, &frame.moved(-ROUNDING)));
    assert!(!remnants.let_go(&frame.model, &here, &frame.moved(0.1 * PARTED * ROUNDING)));
    assert!(!remnants.is_over());
    assert!(remnants.let_go(&frame.model, &here, &frame.moved(ROUNDING)));
    assert!(remnants.is_over() && remnants.on(BEAM) == Vector6::zeros());
}
