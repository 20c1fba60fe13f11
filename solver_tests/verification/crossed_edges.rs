//! Two cubes standing on edge, the edges crossing at an angle, driven into each other by d.
//!
//! Node-to-surface contact lets them pass. One edge-edge contact carries `F = k (d - d_0 / 2)`, d_0 the onset, k
//! half a cube's local stiffness (two in series), normal to both edges, at any crossing angle that is not nearly parallel.
//! Tolerance 1e-9: everything is prescribed, so this is the force law alone.

use riprap::verification::edges::{crossing, single_contact};

use crate::audited::{audited, last, tell};

#[test]
fn edges_carry_the_load() {
    for degrees in [15.0f64, 30.0, 45.0, 90.0, 120.0] {
        let run = audited(&crossing(degrees.to_radians()));
        assert!(run.finished(), "{:?}", run.end);
        let expected = single_contact(&run);
        let state = last(&run).bodies[1];
        tell(&run, &format!("edges crossing at {degrees} deg"), state.contact_force.z, expected);
        assert_eq!(last(&run).measures.points, 1);
        assert!((state.contact_force.z / expected - 1.0).abs() < 1e-9);
        assert!(state.contact_force.xy().norm() < 1e-9 * expected);
        assert!(state.contact_moment.norm() < 1e-9 * expected);
        assert!((state.reaction_force + state.contact_force).norm() < 1e-9 * expected);
    }
}
