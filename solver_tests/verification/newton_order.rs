//! The order of Newton's method: see `verification::newton` for the problem and its tolerances.

use riprap::solver::TangentPart;
use riprap::verification::newton::{OFF, descent, steps_to, typical_order};
use riprap::verification::wedges::pressed;

use crate::audited::audited;

#[test]
fn whole_tangent_is_of_second_order_and_its_symmetric_part_is_not() {
    let mut swings = false;
    for degrees in [20f64, 30.0, 45.0] {
        for friction in [0.2, 0.4, 0.65] {
            let run = audited(&pressed(degrees.to_radians(), friction));
            let (order, _) = typical_order(&run);
            let steps = [TangentPart::Whole, TangentPart::Symmetric]
                .map(|part| steps_to(&descent(&run, part, OFF[2]).0, 1e-6));
            println!("a {degrees}, mu {friction}: order {order:.2}, steps {steps:?}");
            assert!((order.min(2.0) - 2.0).abs() < 0.3, "a {degrees}, mu {friction}: {order}");
            assert!(steps[0] < 15, "{steps:?}");
            // Not everywhere: where contacts stick on the way the tangent is symmetric.
            swings |= OFF.iter().any(|off| {
                let [whole, symmetric] = [TangentPart::Whole, TangentPart::Symmetric]
                    .map(|part| steps_to(&descent(&run, part, *off).0, 1e-6));
                println!("    from {off:e} m: {whole}, symmetric {symmetric}");
                symmetric > 2 * whole
            });
        }
    }
    assert!(swings, "the symmetric part contracts everywhere");
}
