//! The same increments twice, once with rejected trials in between: the committed state is the same.
//!
//! Naive codes let histories of rejected trials leak into the next one. Here a trial with twenty times the step is made and
//! thrown away before each increment. Tolerance: 1e-12 of lengths (the search may list candidates in other places).

use riprap::assembly::Contacts;
use riprap::contact::law::Friction;
use riprap::model::{Committed, Loads};
use riprap::scene::{Scene, SceneParameters};
use riprap::solver::{Increment, Settings, advance};

use riprap::ladder::bodies::{body, cuboid, ground, scene};

fn pushed(with_rejected_trials: bool) -> Committed {
    let block = body("block", cuboid([0.1; 3]), [0.0, 0.0, 0.05], [0.0; 3]);
    let friction = Friction { peak: 0.65, residual: 0.2, weakening_distance: 50e-6 };
    let parameters = SceneParameters { friction, ..scene(vec![ground(), block], 0.0, vec![]) };
    let scene = Scene::new(&parameters).expect("a sound scene");
    let mut committed = scene.committed.clone();
    let settings = Settings::default();
    let mut contacts = Contacts::default();
    let mut loads = Loads::none(2);
    loads.prescribed[0] = [true; 6];
    loads.applied[1][2] = -1000.0;
    for step in 0..20 {
        loads.prescribed[1] = [step > 0, false, false, false, false, false];
        let mut attempt = |committed: &Committed, distance: f64| {
            let mut start = committed.poses.clone();
            start[1].position.x += distance;
            let increment = Increment { model: &scene.model, committed, loads: &loads, settings: &settings };
            advance(&increment, vec![start], &mut contacts)
        };
        let distance = if step > 0 { 5e-6 } else { 0.0 };
        if with_rejected_trials {
            attempt(&committed, 20.0 * distance);
        }
        let report = attempt(&committed, distance);
        assert!(report.converged(), "step {step}: {:?}", report.status);
        committed = Committed { poses: report.poses, memory: report.memory, fields: report.fields };
    }
    committed
}

#[test]
fn rejected_trials_leave_the_committed_state_alone() {
    let (plain, tried) = (pushed(false), pushed(true));
    for (a, b) in plain.poses.iter().zip(&tried.poses) {
        assert!((a.position - b.position).norm() < 1e-12, "{} {}", a.position, b.position);
        assert!((a.rotation * b.rotation.inverse()).angle() < 1e-12);
    }
    assert_eq!(plain.memory.len(), tried.memory.len());
    for ((key, a), (other, b)) in plain.memory.iter().zip(&tried.memory) {
        assert_eq!((key, a.points.len()), (other, b.points.len()));
        assert!((a.slip - b.slip).abs() < 1e-12 && a.slip > 50e-6, "{} {}", a.slip, b.slip);
        for (p, q) in a.points.iter().zip(&b.points) {
            assert_eq!(p.feature, q.feature);
            assert!((p.stretch - q.stretch).norm() < 1e-12);
        }
    }
}
