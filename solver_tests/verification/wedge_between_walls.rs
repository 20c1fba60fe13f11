//! A wedge of half-angle a pressed between two walls by P, friction fully mobilised.
//!
//! Vertical balance: `P = 2 (N sin a + mu N cos a)`, so `N = P / [2 (sin a + mu cos a)]` on each wall. Friction lagged on the
//! last normal force diverges where mu > tan a (its error grows by mu / tan a). The walls draw back under the
//! load, so that the wedge slides at every mu: without that it would stick where mu is above the ratio of tangential to
//! normal stiffness times cot a. Tolerance: the force tolerance, 1e-3 of a point's force, on each
//! of some ten points: 2e-3.

use riprap::verification::wedges::{normal_force, on_wall, pressed};

use crate::audited::{audited, last, tell};

#[test]
fn normal_force_is_the_closed_form() {
    for degrees in [15.0f64, 20.0, 30.0, 45.0, 60.0] {
        for friction in [0.0, 0.2, 0.4, 0.65, 0.8] {
            let angle = degrees.to_radians();
            let expected = normal_force(angle, friction);
            let run = audited(&pressed(angle, friction));
            assert!(run.finished(), "a {degrees} mu {friction}: {:?}", run.end);
            for (name, wall) in [("left", 1), ("right", 2)] {
                let [normal, along] = on_wall(last(&run), wall, angle);
                if wall == 2 {
                    tell(&run, &format!("wedge a {degrees} mu {friction}"), normal, expected);
                }
                assert!((normal / expected - 1.0).abs() < 2e-3, "a {degrees} mu {friction} {name}: {normal}");
                assert!((along.abs() - friction * normal).abs() < 2e-3 * expected, "friction {along}");
            }
            let worst = run.rows.iter().map(|r| r.counters.factorisations).max().unwrap_or(0);
            assert!(worst < 150, "{worst} factorisations in an increment");
        }
    }
}
