//! A block pressed down by N and pushed along a plane by a prescribed displacement.
//!
//! The push rises to `mu_p N`, then follows `N mu(s) = N [mu_r + (mu_p - mu_r) exp(-s/D_c)]` with the slip s to
//! `mu_r N`; its work over the slip is the area `N [mu_r s + (mu_p - mu_r) D_c (1 - exp(-s/D_c))]`.
//! The slip is the displacement less the tangential stretch, push over stiffness, which the first increments give.
//! Tolerances: the coefficient belongs to the slip at the end of the increment, so forces follow the law to the force tolerance, 1e-3 on each of two
//! contacts; the peak falls within an increment, so that the largest force may be short of it by `N (mu_p - mu_r) ds / D_c`. The
//! work is the area but for the force tolerance, 1e-3: the mean of the law over each slip is taken exactly.

use riprap::contact::law::Friction;
use riprap::verification::blocks::{NORMAL, TRAVEL, pushed, slip_and_push, weakening_work};

use crate::audited::{audited, last, tell};

#[test]
fn push_follows_the_weakening_law() {
    for friction in [
        Friction { peak: 0.65, residual: 0.2, weakening_distance: 50e-6 },
        Friction { peak: 0.8, residual: 0.4, weakening_distance: 100e-6 },
        Friction::constant(0.5),
    ] {
        let drop = friction.peak - friction.residual;
        for increments in [50, 100, 200] {
            let run = audited(&pushed(friction, increments));
            assert!(run.finished(), "{:?}", run.end);
            let curve = slip_and_push(&run);
            let step = TRAVEL / increments as f64;
            let allowed = 2e-3 * NORMAL * friction.peak;
            let mut worst = 0.0f64;
            for &[slip, force] in curve.iter() {
                // In the increment in which it starts to slip the stretch is not yet at its bound.
                if slip > step {
                    worst = worst.max((force - NORMAL * friction.coefficient(slip)).abs());
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
            let short = NORMAL * drop * step / friction.weakening_distance;
            assert!((peak - NORMAL * friction.peak).abs() < short + allowed, "peak {peak}");
            assert!(worst < allowed, "{worst} of {allowed}");
            assert!((ledger.friction / area - 1.0).abs() < 1e-3, "{} of {area} J", ledger.friction);
        }
    }
}

/// A distance that the springs cannot follow: the push drops from one increment to the next by at most what the law lets go, ends at
/// the residual, and friction is booked between `mu_r` and `mu_p` times the slip.
#[test]
fn weakening_at_once_drops_to_the_residual() {
    for distance in [1e-6, 1e-9, 1e-14] {
        let friction = Friction { peak: 0.65, residual: 0.2, weakening_distance: distance };
        let run = audited(&pushed(friction, 100));
        assert!(run.finished(), "{:?}", run.end);
        let curve = slip_and_push(&run);
        let end = curve.last().copied().unwrap_or_default();
        let slipping = curve.iter().filter(|point| point[0] > 0.0).count();
        let at_residual = curve.iter().filter(|point| (point[1] - 200.0).abs() < 2.0).count();
        println!("D_c {distance:e}: {slipping} increments slip, {at_residual} at the residual");
        assert!((end[1] / 200.0 - 1.0).abs() < 2e-3, "{}", end[1]);
        let work = last(&run).ledger.friction;
        assert!(work > 0.99 * 0.2 * NORMAL * end[0] && work < 0.65 * NORMAL * end[0], "{work} J");
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
