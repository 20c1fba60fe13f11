//! The same scene in numbers of the order of millimetres and of kilometres: the same scaled answer.
//!
//! Codes with absolute tolerances converge on the one and not on the other. Lengths times s at the same stresses: forces times
//! s^2. Tolerance 1e-6: what rounding may do to the last of some ten Newton steps.

use riprap::verification::wedges::scaled;

use crate::audited::{audited, last, tell};

#[test]
fn millimetres_and_kilometres_agree() {
    let usual = audited(&scaled(1.0));
    assert!(usual.finished(), "{:?}", usual.end);
    for s in [1e-3, 1e-2, 1e3, 1e6] {
        let run = audited(&scaled(s));
        assert!(run.finished(), "{s}: {:?}", run.end);
        tell(
            &run,
            &format!("wedge at scale {s:e}, force"),
            last(&run).bodies[2].contact_force.x / (s * s),
            last(&usual).bodies[2].contact_force.x,
        );
        assert_eq!(run.rows.len(), usual.rows.len());
        for (a, b) in run.rows.iter().zip(&usual.rows) {
            for (x, y) in a.bodies.iter().zip(&b.bodies) {
                assert!((x.contact_force / (s * s) - y.contact_force).norm() < 1e-6 * 1000.0, "scale {s}");
                assert!((x.displacement / s - y.displacement).norm() < 1e-6 * 1e-5, "scale {s}");
            }
        }
    }
}
