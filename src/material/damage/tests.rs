//! Tests of the damage law at a point.

use nalgebra::SymmetricEigen;

use super::*;
use crate::material::secant::tensor_of;
use crate::tensor::draws;

const E: f64 = 30e9;
const NU: f64 = 0.2;
const F_T: f64 = 25e6;
const F_C: f64 = 250e6;

fn law(parameters: &DamageParameters) -> DamageLaw {
    let elastic = Elastic::new(E, NU).expect("allowed");
    DamageLaw::new(elastic, F_T, F_C, parameters, 5e-3).expect("a law")
}

fn with_exponent(n: f64) -> DamageParameters {
    let softening = Softening::Exponent(n);
    DamageParameters { tension: softening, compression: softening, ..Default::default() }
}

fn random_strains(count: usize, size: f64) -> Vec<Vector6<f64>> {
    let mut draw = draws(5);
    (0..count).map(|_| Vector6::from_fn(|_, _| 2.0 * draw()) * size).collect()
}

#[test]
fn equal_principal_strains_are_no_kink() {
    let law = law(&DamageParameters { recovery_in_compression: 0.6, ..with_exponent(3.0) });
    for strain in [
        Vector6::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0) * 1e-3,
        Vector6::new(1.0, 1.0, -2.0, 0.0, 0.0, 0.0) * 1e-3,
        Vector6::new(-0.3, 1.0, -0.3, 0.0, 0.0, 0.0) * 1e-3,
    ] {
        // The slope before and the slope behind, both of the second order in the step.
        for j in 0..6 {
            let at =
                |step: f64| law.respond(&(strain + Vector6::ith(j, step)), &DamageState::default()).stress;
            let slope = |step: f64| (at(step) * 4.0 - at(0.0) * 3.0 - at(2.0 * step)) / (2.0 * step);
            let error = (slope(1e-8) - slope(-1e-8)).norm();
            assert!(error < 1e-5 * E, "{strain:?} {j}: {error:e}");
        }
    }
}

#[test]
fn stress_is_continuous_across_kinks() {
    // Onset of damage, zero crossings of a principal stress, reloading: none lets the stress jump.
    let law = law(&DamageParameters { recovery_in_compression: 0.5, ..with_exponent(2.0) });
    let old = DamageState { tension: 2e-3, compression: 0.0, ..Default::default() };
    for direction in random_strains(20, 1.0) {
        let mut last = law.respond(&Vector6::zeros(), &old).stress;
        for k in 1..4000 {
            let strain = direction * (k as f64 * 1e-6);
            let response = law.respond(&strain, &old);
            if response.state.failed {
                break;
            }
            let jump = (response.stress - last).norm();
            assert!(jump < 3.0 * E * 1e-6 * direction.norm(), "{jump:e} at {k}");
            last = response.stress;
        }
    }
}

#[test]
fn failed_points_carry_nothing_and_stay_failed() {
    let law = law(&DamageParameters::default());
    let old = DamageState::default();
    // theta = e0 / 0.01^(1/3) = 4.6416 e0 is the end.
    for (factor, failed) in [(4.64, false), (4.643, true)] {
        let e = factor * F_T / E;
        let strain = Vector6::new(e, 0.0, 0.0, 0.0, 0.0, 0.0);
        let response = law.respond(&strain, &old);
        assert_eq!(response.state.failed, failed, "{factor}");
        assert_eq!(response.stress.norm() == 0.0, failed);
    }
    let failed = law.advance(&Vector6::new(0.1, 0.0, 0.0, 0.0, 0.0, 0.0), &old);
    let back = law.respond(&Vector6::zeros(), &failed);
    assert!(back.state.failed && back.damage == 1.0 && back.dissipated == 0.0);
    let pressed = law.respond(&Vector6::new(-1e-3, 0.0, 0.0, 0.0, 0.0, 0.0), &back.state);
    assert!(pressed.stress == Vector6::zeros());
}

#[test]
fn growth_in_parts_reaches_the_same_state() {
    let law = law(&DamageParameters::default());
    let strain = Vector6::new(2.5e-3, -1e-3, 3e-4, 1e-3, 0.0, 2e-4);
    let whole = law.advance(&strain, &DamageState::default());
    assert!(!whole.failed);
    let mut state = DamageState::default();
    let mut rounds = 0;
    loop {
        let before = law.parts(&state);
        let asked = law.growth(&strain, &state);
        let share = (0.1 / asked).min(1.0);
        state = law.advance_partly(&strain, &state, share);
        let after = law.parts(&state);
        let grown = (after[0] - before[0]).max(after[1] - before[1]);
        assert!((grown - share * asked).abs() < 1e-12, "{grown} {asked}");
        rounds += 1;
        if share == 1.0 {
            break;
        }
    }
    assert_eq!(state, whole);
    let d = law.parts(&whole)[0].max(law.parts(&whole)[1]);
    assert_eq!(rounds, (d / 0.1).ceil() as usize);
}

#[test]
fn work_is_stored_or_dissipated() {
    // Over a closed path of small steps: the work of the stress (trapezoidal) less the stored energy is the
    // sum of the steps' dissipations. Steps of 1/400 of the path: trapezoidal error below 1e-4.
    let law = law(&DamageParameters { threshold: 1.0, ..with_exponent(2.5) });
    let mut damaging = 0;
    for pair in random_strains(20, 2e-3).chunks_exact(2) {
        let mut highest = 0.0_f64;
        let corners = [Vector6::zeros(), pair[0], pair[1], Vector6::zeros()];
        let (mut work, mut dissipated) = (0.0, 0.0);
        let mut state = DamageState::default();
        let mut stress = Vector6::zeros();
        for leg in corners.windows(2) {
            for k in 1..=400 {
                let strain = leg[0] + (leg[1] - leg[0]) * (f64::from(k) / 400.0);
                let step = strain - state.strain;
                let response = law.respond(&strain, &state);
                work += 0.5 * (stress + response.stress).dot(&step);
                dissipated += response.dissipated;
                (stress, state) = (response.stress, response.state);
                highest = highest.max(law.stored_energy(&state));
            }
        }
        assert!(law.stored_energy(&state) == 0.0);
        assert!((dissipated - work).abs() < 1e-3 * highest, "{dissipated} {work} {highest}");
        damaging += usize::from(work > 0.1 * highest);
    }
    assert!(damaging >= 5, "{damaging}");
}

#[test]
fn dissipation_does_not_need_small_steps() {
    // Uniaxial tension to e = 3 e0 in one step: work less stored energy in closed form, N = 3:
    // E e0^2 [1/2 + (1 - 1/3)] - 1/2 E e0^2 9 / 27.
    let law = law(&DamageParameters::default());
    let e0 = F_T / E;
    let e = 3.0 * e0;
    let state = law.advance(&Vector6::new(e, -NU * e, -NU * e, 0.0, 0.0, 0.0), &DamageState::default());
    // Without the share nu^2 / (1 - nu) 2 of the energy that is in the sides, which stay closed.
    let expected = E * e0 * e0 * (0.5 + 2.0 / 3.0 - 1.0 / 6.0) * (1.0 - 2.0 * NU * NU / (1.0 - NU));
    let found = law.dissipation(&DamageState::default(), &state);
    assert!((found / expected - 1.0).abs() < 2e-3, "{found} {expected}");
}

#[test]
fn fracture_energy_sets_the_exponent() {
    let elastic = Elastic::new(E, NU).expect("allowed");
    for (energy, size) in [(200.0, 5e-3), (100.0, 5e-3), (60.0, 4e-3), (300.0, 1e-3)] {
        let parameters =
            DamageParameters { tension: Softening::FractureEnergy(energy), ..Default::default() };
        let law = DamageLaw::new(elastic, F_T, F_C, &parameters, size).expect("a law");
        // Area under the curve by midpoints, with the strain at failure as the end.
        let [e0, _] = law.onsets();
        let [n, _] = law.exponents();
        let last = e0 * 0.01_f64.powf(-1.0 / n);
        let steps = 200_000;
        let area: f64 = (0..steps)
            .map(|k| {
                let e = e0 + (last - e0) * (f64::from(k) + 0.5) / f64::from(steps);
                E * e * (e0 / e).powf(n) * (last - e0) / f64::from(steps)
            })
            .sum::<f64>()
            + 0.5 * E * e0 * e0;
        assert!((area * size / energy - 1.0).abs() < 1e-7, "N = {n}: {area} {}", area * size);
    }
    // The limits: half of E e0^2 h is stored at the peak.
    let parameters = DamageParameters { tension: Softening::FractureEnergy(100.0), ..Default::default() };
    let largest = 2.0 * E * 100.0 / (F_T * F_T);
    match DamageLaw::new(elastic, F_T, F_C, &parameters, 1.01 * largest) {
        Err(MaterialError::CellTooLarge { largest: found, .. }) => {
            assert!(found < largest && found > 0.97 * largest);
        }
        other => panic!("{other:?}"),
    }
    assert!(matches!(
        DamageLaw::new(elastic, F_T, F_C, &parameters, 1e-5),
        Err(MaterialError::CellTooSmall { .. })
    ));
}

#[test]
fn impossible_parameters_are_refused() {
    let elastic = Elastic::new(E, NU).expect("allowed");
    let refused = |f_t: f64, f_c: f64, parameters: DamageParameters| {
        DamageLaw::new(elastic, f_t, f_c, &parameters, 1e-3).is_err()
    };
    assert!(!refused(F_T, F_C, DamageParameters::default()));
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(refused(bad, F_C, DamageParameters::default()));
        assert!(refused(F_T, bad, DamageParameters::default()));
    }
    for n in [1.0, 0.5, f64::NAN] {
        assert!(refused(F_T, F_C, with_exponent(n)));
    }
    for w in [-0.1, 1.1, f64::NAN] {
        assert!(refused(F_T, F_C, DamageParameters { recovery_in_tension: w, ..Default::default() }));
        assert!(refused(F_T, F_C, DamageParameters { threshold: w, ..Default::default() }));
    }
    let negative = DamageParameters { tension: Softening::FractureEnergy(-1.0), ..Default::default() };
    assert!(refused(F_T, F_C, negative));
}

/// Closed form against an iteration: to rounding, but for equal values, which may come apart by the root of it; the sums of squares that
/// the law is made of, to rounding there too.
#[test]
fn principal_values_are_eigenvalues() {
    let mut strains = random_strains(200, 1e-3);
    strains.extend([
        Vector6::new(1e-3, -2e-4, -2e-4, 0.0, 0.0, 0.0),
        Vector6::new(-1e-3, 2e-4, 2e-4, 0.0, 0.0, 0.0),
        Vector6::new(2e-4, 2e-4, 2e-4, 0.0, 0.0, 0.0),
        Vector6::new(0.0, 0.0, 0.0, 1e-3, 0.0, 0.0),
        Vector6::zeros(),
    ]);
    let squares = |values: &Vec3, sign: f64| values.iter().map(|v| (sign * v).max(0.0).powi(2)).sum::<f64>();
    for (k, strain) in strains.iter().enumerate() {
        let mut values: Vec<f64> = principal_values(strain).iter().copied().collect();
        let mut expected: Vec<f64> =
            SymmetricEigen::new(tensor_of(strain)).eigenvalues.iter().copied().collect();
        values.sort_by(f64::total_cmp);
        expected.sort_by(f64::total_cmp);
        let tolerance = if k < 200 { 1e-12 } else { 1e-7 } * strain.norm();
        for (value, expected) in values.iter().zip(&expected) {
            assert!((value - expected).abs() <= tolerance, "{strain}: {values:?} {expected}");
        }
        for sign in [1.0, -1.0] {
            let [found, wanted] = [&values, &expected].map(|v| squares(&Vec3::new(v[0], v[1], v[2]), sign));
            assert!((found - wanted).abs() <= 1e-13 * strain.norm_squared(), "{strain}: {found} {wanted}");
        }
    }
}
