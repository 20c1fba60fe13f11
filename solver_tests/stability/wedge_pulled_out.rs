//! A wedge pressed in, let go, and pulled out.
//!
//! Naive methods diverge or let it pop out. Statics: with the load gone it stays jammed iff mu > tan a (its friction turns round, and holds
//! any normal force up to `N (mu cos a - sin a) >= 0`); otherwise no force is left. Then it is lifted by a
//! prescribed displacement: it comes free, without force.

use riprap::verification::wedges::{cycle, force_by_stage};

use crate::audited::{audited, last, tell};

#[test]
fn jams_or_lets_go() {
    for (degrees, friction) in
        [(20.0f64, 0.65), (20.0, 0.2), (10.0, 0.4), (10.0, 0.1), (30.0, 0.3), (30.0, 0.8)]
    {
        let angle = degrees.to_radians();
        let run = audited(&cycle(angle, friction));
        assert!(run.finished(), "a {degrees} mu {friction}: {:?}", run.end);
        let force = force_by_stage(&run, angle);
        tell(
            &run,
            &format!("wedge a {degrees} mu {friction} let go, N left"),
            force[1] / force[0],
            f64::from(friction > angle.tan()),
        );
        let jams = friction > angle.tan();
        // Jammed it keeps a good part of its force; else none but what the force tolerance leaves.
        assert!(
            if jams { force[1] > 0.05 * force[0] } else { force[1] < 0.01 * force[0] },
            "a {degrees} mu {friction}"
        );
        assert_eq!(force[2], 0.0);
        assert_eq!(last(&run).measures.points, 0);
    }
}
