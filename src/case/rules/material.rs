//! Rules of the rock.

use serde_json::Value;
use statrs::function::gamma::ln_gamma;

use crate::error::Faults;

use super::super::form::written;
use super::super::walk::{Walker, number, shown};

/// Displacement elements lock towards 0.5; `material` rejects draws from here on.
const POISSON_LIMIT: f64 = 0.495;

/// The share of cells that may lie beyond what a distribution must keep to.
const RARE: f64 = 1e-6;

/// A body's own rock is the case's with the given keys replaced; damage is replaced as a whole.
pub fn derive(own: &mut Value, rock: &Value) {
    if let (Some(own), Some(rock)) = (own.as_object_mut(), rock.as_object()) {
        for (key, value) in rock {
            own.entry(key.clone()).or_insert(value.clone());
        }
    }
}

pub fn check(rock: &Value, path: &str, walker: &mut Walker) {
    if !rock["damage"].is_null() {
        for strength in ["compressive_strength", "tensile_strength"] {
            let place = format!("{path}.{strength}");
            if rock[strength].is_null() && walker.is_clean(&place) {
                let accepted = "a strength such as \"25 MPa\", or \"damage\": null";
                walker.fault(place, "nothing", "is missing: damage needs it", accepted);
            }
        }
    }
    let mean = |key: &str| number(&rock[key], "mean");
    if let (Some(tension), Some(compression)) = (mean("tensile_strength"), mean("compressive_strength"))
        && tension > compression
    {
        walker.fault(
            format!("{path}.tensile_strength"),
            tension,
            format!("exceeds the compressive strength {} Pa", written(compression)),
            "at most the compressive strength",
        );
    }
    for (key, law) in rock.as_object().into_iter().flatten() {
        // Only a constant or a normal one may have no mean to speak of: the others are scaled by it.
        let scaled = law["law"].as_str().is_some_and(|law| !["constant", "normal"].contains(&law));
        if scaled && number(law, "mean") == Some(0.0) {
            let place = format!("{path}.{key}.mean");
            let accepted = "a mean above 0, or a plain quantity, which has no scatter";
            walker.fault(place, 0, "is the mean of a law that is scaled by it", accepted);
        }
    }
    let poisson = &rock["poissons_ratio"];
    if let Some(high) = rare_value(poisson)
        && high >= POISSON_LIMIT
    {
        let accepted = "a mean and a scatter that stay below 0.495";
        let problem = format!("scatters so widely that one cell in a million reaches {high:.3}");
        walker.fault(format!("{path}.poissons_ratio"), shown(poisson), problem, accepted);
    }
}

/// The value that a share [`RARE`] of the cells exceeds.
fn rare_value(law: &Value) -> Option<f64> {
    const QUANTILE: f64 = 4.753_424; // standard normal, exceeded by RARE
    let mean = number(law, "mean")?;
    match law["law"].as_str()? {
        "weibull" => {
            // Scale from the mean: E = scale * Gamma(1 + 1/k) (Ma et al. 2011, eq. 5).
            let k = number(law, "weibull_shape")?;
            Some(mean / ln_gamma(1.0 + 1.0 / k).exp() * (-RARE.ln()).powf(1.0 / k))
        }
        "lognormal" => {
            let variance = number(law, "variation")?.powi(2).ln_1p();
            Some(mean * (QUANTILE * variance.sqrt() - variance / 2.0).exp())
        }
        "normal" => Some(mean * (1.0 + QUANTILE * number(law, "variation")?)),
        "gamma" => {
            // Wilson & Hilferty (1931): the cube root is nearly normal; up to 10 % high where k < 10.
            let shape = number(law, "gamma_shape")?;
            Some(mean * (1.0 - 1.0 / (9.0 * shape) + QUANTILE / (3.0 * shape.sqrt())).powi(3))
        }
        "exponential" => Some(-mean * RARE.ln()),
        _ => Some(mean),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn one_in_a_million_is_the_quantile() {
        // Weibull with k = 1 is exponential: the quantile is -mean ln(1e-6).
        let law = json!({"mean": 2.0, "law": "weibull", "weibull_shape": 1.0});
        let found = rare_value(&law).expect("a law");
        assert!((found - 2.0 * 1e6_f64.ln()).abs() < 1e-10);
        // Gamma with shape 1 is exponential too; the approximation errs to the safe side.
        let law = json!({"mean": 2.0, "law": "gamma", "gamma_shape": 1.0});
        let found = rare_value(&law).expect("a law");
        assert!((1.0..1.1).contains(&(found / (2.0 * 1e6_f64.ln()))), "{found}");
        // With shape 10: half the upper 1e-6 quantile of chi-square with 20 degrees of freedom, 65.42.
        let law = json!({"mean": 10.0, "law": "gamma", "gamma_shape": 10.0});
        let found = rare_value(&law).expect("a law");
        assert!((found / 32.71 - 1.0).abs() < 0.015, "{found}");
    }
}
