//! The damage law against closed forms.
//!
//! Source: Ma, Zhou, Chang & Zhou (2011), eqs. 6-10, with the potential of `material::damage`. Everything here is algebra on the principal
//! values, so the tolerance is rounding through two eigenvalue problems: 1e-8 relative.
//!
//! - Tension, unloading, compression beyond the peak, and back, with free sides and recoveries 0 to 1. With the histories `d = 1 - (e0/e)^N`:
//!   `g+ = (1 - (1-w_t) d_c)(1 - d_t)` is left in tension, `g- = (1 - d_c)(1 - (1-w_c) d_t)` in compression.
//! - Proportional paths in turned axes, from principal values; the rest of the strain as what an opening leaves least energy in, found by descent.
//! - Turned strains give turned stresses.

use nalgebra::Vector6;

use riprap::material::DamageState;
use riprap::tensor::{Mat3, Rotation, Vec3};
use riprap::verification::damage::{E, F_C, F_T, NU, law, pulled, uniaxial};
use riprap::verification::finding::worse;

fn tensor(v: &Vector6<f64>, shear: f64) -> Mat3 {
    let s = v.map(|x| shear * x);
    Mat3::new(v[0], s[3], s[5], s[3], v[1], s[4], s[5], s[4], v[2])
}

fn strain_vector(t: &Mat3) -> Vector6<f64> {
    Vector6::new(t[(0, 0)], t[(1, 1)], t[(2, 2)], 2.0 * t[(0, 1)], 2.0 * t[(1, 2)], 2.0 * t[(2, 0)])
}

#[test]
fn a_cell_of_exponent_three_keeps_a_quarter_at_twice_the_peak_strain() {
    let stress = law(3.0, 1.0, 0.0).respond(&uniaxial(2.0 * F_T / E), &DamageState::default()).stress[0];
    assert!((stress / F_T - 0.25).abs() < 1e-8);
}

/// The largest error of the stress over the tensile strength along the cycle, for these recoveries.
fn cycle(w_c: f64, w_t: f64) -> f64 {
    let (t0, c0, n) = (F_T / E, F_C / E, 3.0);
    let law = law(n, w_c, w_t);
    let mut state = DamageState::default();
    let (mut error, mut most) = (0.0, [0.0_f64; 2]);
    // To a strain in fifty steps, the stress compared in each. Says whether the cell is left.
    let mut close = |to: f64| {
        let from = state.strain[0];
        for k in 1..=50 {
            let e = from + (to - from) * f64::from(k) / 50.0;
            // The lateral extension nu e leads the tension history in compression.
            let theta = if e > 0.0 { [e, 0.0] } else { [NU * 2.0_f64.sqrt() * -e, -e] };
            most = std::array::from_fn(|part| most[part].max(theta[part]));
            let softened = |theta: f64, e0: f64| if theta > e0 { 1.0 - (e0 / theta).powf(n) } else { 0.0 };
            let (d_t, d_c) = (softened(most[0], t0), softened(most[1], c0));
            let left = [(1.0 - (1.0 - w_t) * d_c) * (1.0 - d_t), (1.0 - d_c) * (1.0 - (1.0 - w_c) * d_t)];
            let (strain, stress) = match e > 0.0 {
                true => pulled(e, left),
                false => (uniaxial(e), left[1] * E * e),
            };
            let response = law.respond(&strain, &state);
            state = response.state;
            assert_eq!(state.failed, left[usize::from(e <= 0.0)] < 0.01, "{e} {left:?}");
            if state.failed {
                assert_eq!(response.stress, Vector6::zeros());
                return false;
            }
            let wanted = Vector6::ith(0, stress);
            error = worse(error, (response.stress - wanted).norm() / F_T);
        }
        true
    };
    // Tension to 2.5 peak strains, half way back, zero; compression below its peak, where w_c = 1 gives E back, w_c = 0 nothing.
    assert!([2.5 * t0, 1.2 * t0, 0.0, -0.5 * c0].into_iter().all(&mut close));
    // Beyond the peak, back, and tension again: w_t = 1 forgets the compression damage.
    let _ = [-1.5 * c0, -0.4 * c0, 0.8 * t0].into_iter().all(&mut close);
    error
}

#[test]
fn cycles_recover_as_asked() {
    for w_c in [0.0, 0.25, 0.5, 0.75, 1.0] {
        for w_t in [0.0, 0.5, 1.0] {
            let error = cycle(w_c, w_t);
            assert!(error < 1e-8, "w {w_c} {w_t}: {error:e}");
        }
    }
}

#[test]
fn proportional_paths_in_turned_axes() {
    let (t0, c0) = (F_T / E, F_C / E);
    let turn = Rotation::from_scaled_axis(Vec3::new(0.7, -1.1, 0.4)).to_rotation_matrix();
    let lame = E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU));
    let mu = E / (2.0 * (1.0 + NU));
    let mut checked = 0;
    for (w_c, w_t) in [(1.0, 0.0), (0.5, 0.5), (0.0, 1.0)] {
        for exponent in [1.5, 3.0] {
            let law = law(exponent, w_c, w_t);
            for direction in
                [[1.0, 0.3, -0.5], [1.0, 1.0, 1.0], [0.2, -1.0, -2.0], [-1.0, -1.0, -0.2], [1.0, -1.0, 0.0]]
            {
                let mut state = DamageState::default();
                for k in 1..=60 {
                    let e = Vec3::from(direction) * (k as f64 * 4e-4);
                    let theta = |sign: f64| e.iter().map(|v| (sign * v).max(0.0).powi(2)).sum::<f64>().sqrt();
                    let softened = |theta: f64, e0: f64| {
                        if theta > e0 { 1.0 - (e0 / theta).powf(exponent) } else { 0.0 }
                    };
                    let (d_t, d_c) = (softened(theta(1.0), t0), softened(theta(-1.0), c0));
                    let s = e.map(|v| lame * e.sum() + 2.0 * mu * v);
                    let open = (1.0 - (1.0 - w_t) * d_c) * (1.0 - d_t);
                    let kept = (1.0 - d_c) * (1.0 - (1.0 - w_c) * d_t);
                    let mut opening = Vec3::zeros();
                    let stress_of = |e: Vec3| e.map(|v| lame * e.sum() + 2.0 * mu * v);
                    for _ in 0..400 {
                        opening =
                            (opening + stress_of(e - opening) / (3.0 * lame + 2.0 * mu)).map(|a| a.max(0.0));
                    }
                    let closed = stress_of(e - opening);
                    let expected = (s - closed) * open + closed * kept;
                    let left = expected.dot(&e) / s.dot(&e);
                    let turned = turn.matrix() * Mat3::from_diagonal(&e) * turn.matrix().transpose();
                    let response = law.respond(&strain_vector(&turned), &state);
                    state = response.state;
                    assert_eq!(state.failed, left < 0.01, "{direction:?} {k}: {left}");
                    if state.failed {
                        assert_eq!(response.stress, Vector6::zeros());
                        break;
                    }
                    let expected = turn.matrix() * Mat3::from_diagonal(&expected) * turn.matrix().transpose();
                    let error = (tensor(&response.stress, 1.0) - expected).norm();
                    assert!(error < 1e-8 * s.norm(), "{direction:?} {k}: {error:e}");
                    assert!((1.0 - response.damage - left).abs() < 1e-8);
                    checked += usize::from(left < 0.9);
                }
            }
        }
    }
    assert!(checked > 200, "most of the path is damaged: {checked}");
}

#[test]
fn turned_strain_gives_turned_stress() {
    let law = law(2.0, 0.5, 0.3);
    let strain = Mat3::new(2e-3, 5e-4, -3e-4, 5e-4, -1e-3, 8e-4, -3e-4, 8e-4, 4e-4);
    let still = law.respond(&strain_vector(&strain), &DamageState::default());
    assert!(still.damage > 0.3);
    for degrees in 0..=360 {
        let turn = Rotation::from_scaled_axis(
            Vec3::new(0.3, 0.5, -0.8).normalize() * f64::from(degrees).to_radians(),
        );
        let turn = *turn.to_rotation_matrix().matrix();
        let found = law.respond(&strain_vector(&(turn * strain * turn.transpose())), &DamageState::default());
        let expected = turn * tensor(&still.stress, 1.0) * turn.transpose();
        assert!((tensor(&found.stress, 1.0) - expected).norm() < 1e-9 * expected.norm());
        assert!((found.dissipated / still.dissipated - 1.0).abs() < 1e-9);
    }
}
