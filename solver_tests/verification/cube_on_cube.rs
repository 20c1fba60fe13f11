//! A prism with n corners on a cube of the same width, pressed by a force and a moment: many redundant points.
//!
//! How the load spreads over the points depends on n; its resultant does not: force and moment of the contacts on the
//! prism are minus what is applied. Tolerance: the force tolerance, 1e-3 of a point's force; moments likewise
//! times the half width.

use riprap::verification::blocks::{pressing, prism_on_cube};

use crate::audited::{audited, last, tell};

#[test]
fn resultant_is_unique() {
    for corners in [4, 6, 24, 96] {
        let run = audited(&prism_on_cube(corners));
        assert!(run.finished(), "{corners}: {:?}", run.end);
        let state = last(&run).bodies[run.index("upper")];
        tell(
            &run,
            &format!("prism of {corners} on cube, {} points", last(&run).measures.points),
            state.contact_force.z,
            1000.0,
        );
        let (force, moment) = pressing();
        let tolerance = 1e-3 * last(&run).balance.reference_force;
        assert!((state.contact_force + force).norm() < tolerance, "{}", state.contact_force);
        assert!((state.contact_moment + moment).norm() < 0.07 * tolerance, "{}", state.contact_moment);
    }
}
