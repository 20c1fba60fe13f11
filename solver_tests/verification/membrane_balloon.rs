//! Neo-Hookean spherical balloon under inner pressure: see `verification::balloon` for the problem, its
//! source and its tolerances.

use riprap::material::{Rubber, RubberLaw, Wrinkling};
use riprap::tensor::Vec3;
use riprap::verification::balloon::{MODULUS, limit_point, octant};

#[test]
fn limit_point_converges_to_the_closed_form() {
    let rubber = Rubber::new(MODULUS, RubberLaw::NeoHookean).expect("allowed");
    let exact = limit_point();
    let limits: Vec<[f64; 2]> = [3, 6, 12].map(|n| octant(n).limit(&rubber)).to_vec();
    println!("n  p R/(G t)  stretch");
    for (n, [p, l]) in [3, 6, 12].iter().zip(&limits) {
        println!("{n:2} {p:.6}   {l:.6}");
    }
    println!("   {:.6}   {:.6} exact", exact[0], exact[1]);
    let pressure_errors: Vec<f64> = limits.iter().map(|l| (l[0] - exact[0]).abs()).collect();
    let order = (pressure_errors[1] / pressure_errors[2]).log2();
    println!("observed order {order:.2}");
    assert!((order - 2.0).abs() < 0.3, "{pressure_errors:?}");
}

/// `p dV` along the way is what the membrane stores.
#[test]
fn work_of_the_pressure_is_the_energy_stored() {
    let rubber = Rubber::new(MODULUS, RubberLaw::Gent { limit: 8.0 }).expect("allowed");
    let balloon = octant(4);
    let energy = |x: &[Vec3]| -> f64 {
        balloon
            .facets
            .iter()
            .zip(&balloon.elements)
            .map(|(f, e)| e.forces(&f.map(|k| x[k]), &rubber, Wrinkling::Held).energy)
            .sum()
    };
    let start = balloon.volume(&balloon.nodes);
    let mut x = balloon.nodes.clone();
    let pressure = |x: &mut Vec<Vec3>, factor: f64| balloon.pressure_at(x, start * factor, &rubber);
    // Simpson's rule over the volume: what it misses falls with the fourth power of the interval.
    let errors = [8, 16].map(|intervals| {
        pressure(&mut x, 1.2);
        let before = energy(&x);
        let (mut work, width) = (0.0, 0.8 * start / f64::from(intervals));
        for k in 0..=intervals {
            let weight = if k == 0 || k == intervals { 1.0 } else { f64::from(2 + 2 * (k % 2)) };
            work += weight * width / 3.0 * pressure(&mut x, 1.2 + 0.8 * f64::from(k) / f64::from(intervals));
        }
        let stored = energy(&x) - before;
        (work / stored - 1.0).abs()
    });
    println!("p dV over the energy stored, less 1: {errors:?}");
    assert!(errors[0] < 1e-4 && errors[1] < errors[0] / 8.0, "{errors:?}");
}
