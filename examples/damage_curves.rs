//! Prints stress over strain of the damage law as CSV: softening for several exponents, and a cycle for several
//! recoveries. `scripts/plot_damage.py` draws docs/damage_softening.svg and docs/damage_cycle.svg from it.
//!
//!     cargo run --release --example damage_curves

use riprap::material::{DamageLaw, DamageParameters, DamageState, Elastic, Softening};
use riprap::tensor::Vector6;

const YOUNGS_MODULUS: f64 = 30e9;
const POISSONS_RATIO: f64 = 0.2;
const TENSILE: f64 = 25e6;
const COMPRESSIVE: f64 = 250e6;

/// Follows a path of uniaxial stress, the strain in units of the tensile peak strain, printing stress in units of the strength.
fn follow(
    curve: &str,
    parameters: &DamageParameters,
    corners: &[f64],
) -> Result<(), Box<dyn std::error::Error>> {
    let elastic = Elastic::new(YOUNGS_MODULUS, POISSONS_RATIO)?;
    let law = DamageLaw::new(elastic, TENSILE, COMPRESSIVE, parameters, 1e-3)?;
    let peak = law.onsets()[0];
    let mut state = DamageState::default();
    for leg in corners.windows(2) {
        for k in 0..=400 {
            let e = peak * (leg[0] + (leg[1] - leg[0]) * f64::from(k) / 400.0);
            // The sides are free: their strain, by bisection.
            let at = |x: f64| law.respond(&Vector6::new(e, x, x, 0.0, 0.0, 0.0), &state);
            let mut sides = [-POISSONS_RATIO * e.abs(), POISSONS_RATIO * e.abs()];
            for _ in 0..60 {
                let middle = 0.5 * (sides[0] + sides[1]);
                sides[usize::from(at(middle).stress[1] > 0.0)] = middle;
            }
            let response = at(sides[1]);
            state = response.state;
            println!("{curve},{},{},{}", e / peak, response.stress[0] / TENSILE, response.damage);
        }
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("curve,strain,stress,damage");
    for exponent in [1.5, 2.0, 3.0, 5.0] {
        let tension = Softening::Exponent(exponent);
        let parameters = DamageParameters { tension, ..Default::default() };
        follow(&format!("N = {exponent}"), &parameters, &[0.0, 10.0])?;
    }
    for recovery_in_compression in [0.0, 0.5, 1.0] {
        let parameters = DamageParameters { recovery_in_compression, ..Default::default() };
        let path = [0.0, 1.8, 0.0, -2.5, 0.0, 2.6, 0.0];
        follow(&format!("w_c = {recovery_in_compression}"), &parameters, &path)?;
    }
    Ok(())
}
