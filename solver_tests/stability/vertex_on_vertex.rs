//! A cube's corner driven onto a corner, and onto an edge.
//!
//! Normals that come from one facet or another flip there, and cycle. By symmetry the force is along the approach and
//! without moment; it is the derivative of an energy, so it grows continuously. Tolerance 1e-9 of it: everything is
//! prescribed. Then the lower body's corner is passed sideways at a constant height: the force stays bounded by
//! its value at the top, and comes back to it on the way back (no history without friction).

use riprap::verification::edges::{DEPTH, Onto, corner_onto, single_contact};

use crate::audited::{audited, last, tell};

#[test]
fn corner_meets_corner_and_edge() {
    for (name, onto) in [("corner on corner", Onto::Corner), ("corner on edge", Onto::Edge)] {
        for way in [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [5e-4, 4e-4, 0.0]] {
            let run = audited(&corner_onto(onto, 0.0, way));
            assert!(run.finished(), "{name}: {:?}", run.end);
            let single = single_contact(&run);
            let top = run.rows[19].bodies[1];
            tell(&run, &format!("{name}, force over one contact's"), top.contact_force.z / single, 1.0);
            assert!(top.contact_force.xy().norm() < 1e-9 * single, "{}", top.contact_force);
            assert!(top.contact_moment.norm() < 1e-10 * single, "{}", top.contact_moment);
            let mut before = 0.0;
            for row in &run.rows[..20] {
                assert!(row.bodies[1].contact_force.z >= before);
                before = row.bodies[1].contact_force.z;
            }
            let end = last(&run).bodies[1].contact_force;
            assert!((end - top.contact_force).norm() < 1e-6 * single, "{end} {}", top.contact_force);
            for row in &run.rows[20..] {
                assert!(row.bodies[1].contact_force.norm() < 1.05 * top.contact_force.norm());
            }
            let error = last(&run).ledger.error().abs();
            assert!(error < 1e-3 * single * DEPTH, "{error}");
        }
    }
}

/// A pair's stiffness is not to depend on which features meet.
#[test]
fn corner_on_corner_counts_once() {
    let run = audited(&corner_onto(Onto::Corner, 0.0, [0.0; 3]));
    let single = single_contact(&run);
    let ratio = last(&run).bodies[1].contact_force.z / single;
    assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
}
