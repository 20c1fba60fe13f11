//! A block pressed down by N and pushed along a plane by a prescribed displacement.
//!
//! The push rises to `mu_p N`, then follows `N mu(s) = N [mu_r + (mu_p - mu_r) exp(-s/D_c)]` with the slip s to
//! `mu_r N`; its work over the slip is the area `N [mu_r s + (mu_p - mu_r) D_c (1 - exp(-s/D_c))]`.
//! The slip is the displacement less the tangential stretch, push over stiffness, which the first increments give.
//! Tolerances: the coefficient may belong to any slip within the increment, so forces may be off by
//! `N (mu_p - mu_r) ds / D_c` and the work by as much times D_c; they must halve with the increment.

use riprap::contact::law::Friction;
use riprap::ladder::blocks::{NORMAL, TRAVEL, pushed, slip_and_push, weakening_work};

use crate::audited::{audited, last, tell};

#[test]
fn push_follows_the_weakening_law() {
    for friction in [
        Friction { peak: 0.65, residual: 0.2, weakening_distance: 50e-6 },
        Friction { peak: 0.8, residual: 0.4, weakening_distance: 100e-6 },
        Friction::constant(0.5),
    ] {
        let drop = friction.peak - friction.residual;
        let mut errors = Vec::new();
        for increments in [50, 100, 200] {
            let run = audited(&pushed(friction, increments));
            assert!(run.finished(), "{:?}", run.end);
            let curve = slip_and_push(&run);
            let step = TRAVEL / increments as f64;
            let allowed = NORMAL * drop * step / friction.weakening_distance + 2e-3 * NORMAL * friction.peak;
            let mut worst = 0.0f64;
            for &[slip, force] in curve.iter().filter(|point| point[0] > 0.0) {
                let expected = NORMAL * friction.coefficient(slip);
                // In the increment in which it starts to slip the stretch is not yet at its bound.
                if slip > step {
                    worst = worst.max((force - expected).abs());
                }
                assert!(force <= NORMAL * friction.peak * (1.0 + 1e-3), "{force} above the peak");
            }
            let peak = curve.iter().map(|point| point[1]).fold(0.0, f64::max);
            let end = curve.last().copied().unwrap_or_default();
            let area = weakening_work(&friction, end[0]);
            let ledger = last(&run).ledger;
            let label = format!("push, peak, mu_p {} ds {:.1} um", friction.peak, step * 1e6);
            tell(&run, &label, peak, NORMAL * friction.peak);
            println!(
                "    worst force error {worst:.3} N of {allowed:.3}; friction {:.6e} J, area {area:.6e} J \
                 ({:.2e} off); end {:.3} N, expected {:.3} N; ledger error {:.2e} of external",
                ledger.friction,
                ledger.friction / area - 1.0,
                end[1],
                NORMAL * friction.coefficient(end[0]),
                ledger.error() / ledger.external
            );
            assert!((peak - NORMAL * friction.peak).abs() < allowed, "peak {peak}");
            assert!(worst < allowed, "{worst} of {allowed}");
            assert!(
                (ledger.friction - area).abs()
                    < (allowed / NORMAL) * NORMAL * friction.weakening_distance + 2e-3 * area
            );
            errors.push(((ledger.friction - area).abs(), worst, ledger.error().abs() / ledger.external));
        }
        if drop > 0.0 {
            let orders: Vec<f64> = errors.windows(2).map(|e| (e[0].0 / e[1].0).log2()).collect();
            println!("    observed orders of the work {orders:.2?}");
            assert!(orders.iter().all(|order| *order > 0.8), "{errors:?}");
        }
    }
}

/// The ledger's external work is trapezoidal, so that the increment in which slip sets in, in which the push rises and then
/// stays, is short of at most `mu N ds / 2`, once; the rest is to close to 1e-3 of the work.
#[test]
fn ledger_closes_but_for_the_onset_of_slip() {
    let mut errors = Vec::new();
    for increments in [100, 200, 400, 800] {
        let step = TRAVEL / increments as f64;
        let run = audited(&pushed(Friction::constant(0.65), increments));
        assert!(run.finished(), "{:?}", run.end);
        let ledger = last(&run).ledger;
        println!(
            "ds {:.2} um: ledger error {:.3e} of external",
            step * 1e6,
            ledger.error() / ledger.external
        );
        assert!(ledger.error().abs() < 0.5 * 650.0 * step + 1e-3 * ledger.external, "{ledger:?}");
        errors.push(ledger.error().abs() / ledger.external);
    }
    assert!(errors[3] < 1e-3, "{errors:?}");
}
