//! A cube pressed onto the face of a many-sided prism, cut into thin coplanar triangles, and slid across without friction.
//!
//! Contact that sees internal edges kicks there. Reference: no tangential force, no moment about the vertical, and the
//! normal force. Tolerance 1e-9 of the load: normals of a plane differ by rounding only.

use riprap::verification::blocks::{largest_side_force, slid_over_facets};

use crate::audited::{audited, tell};

#[test]
fn no_tangential_force() {
    for (corners, heading) in [(8usize, 0.3f64), (32, 0.0), (64, 0.7)] {
        let run = audited(&slid_over_facets(corners, heading));
        assert!(run.finished(), "{:?}", run.end);
        let worst = largest_side_force(&run);
        tell(&run, &format!("slide over {} facets, tangential force", corners - 2), worst, 0.0);
        assert!(worst < 1e-6, "{worst} N");
        for row in run.rows.iter().filter(|row| row.stage == 1) {
            assert!((row.bodies[1].contact_force.z - 1000.0).abs() < 1.0);
        }
    }
}
