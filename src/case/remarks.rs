//! What a sound case holds that its author may not expect.

use super::types::*;

/// Largest sieve size over the diameter that laboratories keep to.
const COARSEST: f64 = 0.2;

impl Case {
    /// Remarks on a sound case, each a sentence.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        if let Geometry::Specimen(specimen) = &self.geometry {
            let largest = specimen.grading.first().map_or(0.0, |point| point[0]);
            let ratio = largest / specimen.diameter;
            if ratio > COARSEST {
                remarks.push(format!(
                    "the largest grain is {ratio:.2} of the diameter; laboratories keep to {COARSEST}"
                ));
            }
        }
        if let (Some(accuracy), None) = (self.solver.accuracy, self.solver.chosen_accuracy()) {
            remarks.push(format!(
                "solver.accuracy {accuracy} decides nothing: the fidelity is given; \"auto\" is chosen by accuracy"
            ));
        }
        remarks
    }
}

#[cfg(test)]
mod tests {
    use crate::case::{RawCase, parse_override};

    #[test]
    fn what_decides_nothing_and_what_is_too_coarse_is_said() {
        let text = r#"{"specimen": {"diameter": "0.3 m", "height": "0.6 m", "void_ratio": 0.5, "grading": [[0.06, 1], [0.04, 0]]},
            "rock": {"density": 2180, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2},
            "contact": {"friction": 0.65}, "stages": [{"kind": "consolidate", "pressure": "0.8 MPa"}]}"#;
        let remarks = |overrides: &[&str]| {
            let mut raw = RawCase::parse("x.json".as_ref(), text).unwrap_or_else(|e| panic!("{e}"));
            let parsed: Vec<_> = overrides.iter().filter_map(|text| parse_override(text).ok()).collect();
            assert_eq!(parsed.len(), overrides.len());
            raw.set(&parsed);
            raw.check().unwrap_or_else(|e| panic!("{e}")).remarks().join("; ")
        };
        // A fifth exactly is kept to.
        assert_eq!(remarks(&[]), "");
        assert_eq!(remarks(&["/solver/fidelity=auto", "/solver/accuracy=0.05"]), "");
        assert!(
            remarks(&["/solver/fidelity=rigid", "/solver/accuracy=0.05"]).contains("0.05 decides nothing")
        );
        assert!(remarks(&["/specimen/diameter=0.15"]).contains("0.40 of the diameter"));
    }
}
