//! A free body that touches nothing while its neighbour is loaded: it stays, without force, to the last bit.

use riprap::verification::bodies::{body, cuboid, ground, load, push, scene};

use crate::audited::{audited, last, tell};
use riprap::scene::SceneShape;

#[test]
fn stays_where_it_is() {
    for position in [[0.3, 0.0, 0.1], [0.0, 0.0, 0.121], [-0.08, 0.0, 0.03]] {
        let block = body("block", cuboid([0.1; 3]), [0.0, 0.0, 0.05], [0.0; 3]);
        let rattler = body("rattler", SceneShape::Sphere(0.02), position, [0.1, 0.2, 0.3]);
        let stages = vec![load(5, "block", push([0.0, 0.0, -1000.0]))];
        let run = audited(&scene(vec![ground(), block, rattler], 0.65, stages));
        assert!(run.finished(), "{:?}", run.end);
        let state = last(&run).bodies[2];
        tell(&run, "rattler, displacement", state.displacement.norm(), 0.0);
        assert_eq!(state.displacement.norm(), 0.0);
        assert_eq!(state.contact_force.norm(), 0.0);
        let force = last(&run).bodies[1].contact_force;
        assert!((force.z - 1000.0).abs() < 1.0, "{force}");
    }
}
