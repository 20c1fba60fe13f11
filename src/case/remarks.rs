//! What a sound case holds that its author may not expect.

use super::types::*;

/// Largest sieve size over the diameter that laboratories keep to.
const COARSEST: f64 = 0.2;

/// Moduli and sizes of bodies that differ by more make systems badly conditioned.
const UNLIKE: [f64; 2] = [1e5, 20.0];

impl Case {
    /// Remarks on a sound case, each a sentence.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = self.notes.clone();
        if let Geometry::Specimen(specimen) = &self.geometry {
            let largest = specimen.grading.first().map_or(0.0, |point| point[0]);
            let ratio = largest / specimen.diameter;
            if ratio > COARSEST {
                remarks.push(format!(
                    "the largest grain is {ratio:.2} of the diameter; laboratories keep to {COARSEST}"
                ));
            }
        }
        let [moduli, sizes] = self.ratios();
        if moduli >= UNLIKE[0] {
            remarks.push(format!(
                "the moduli of bodies differ by a factor of {moduli:.0e}: the systems to be solved are badly conditioned; every increment \
                 balances to solver.force_tolerance all the same, or is cut"
            ));
        }
        if sizes > UNLIKE[1] {
            remarks.push(format!(
                "the sizes of bodies differ by a factor of {sizes:.0}: the systems to be solved are badly conditioned, and the force \
                 tolerance is over the mean contact force, not over that of the smallest"
            ));
        }
        if let (Some(accuracy), None) = (self.solver.accuracy, self.solver.chosen_accuracy()) {
            remarks.push(format!(
                "solver.accuracy {accuracy} decides nothing: the fidelity is given; \"auto\" is chosen by accuracy"
            ));
        }
        remarks.extend(self.implausible());
        remarks.extend(self.too_wide_pores());
        remarks
    }

    /// Largest over smallest mean modulus, and size of what is not held.
    fn ratios(&self) -> [f64; 2] {
        let ratio = |values: &mut dyn Iterator<Item = f64>| {
            let (low, high) =
                values.fold((f64::INFINITY, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
            if low <= high { high / low } else { 1.0 }
        };
        match &self.geometry {
            Geometry::Specimen(specimen) => [1.0, ratio(&mut specimen.grading.iter().map(|point| point[0]))],
            Geometry::Scene(scene) => {
                let modulus = |body: &BodyCase| body.rock.as_ref().unwrap_or(&self.rock).youngs_modulus.mean;
                let free = scene.bodies.iter().filter(|body| !body.fixed);
                let mut sizes = free.filter_map(|body| body.shape.smallest_extent());
                [ratio(&mut scene.bodies.iter().map(modulus)), ratio(&mut sizes)]
            }
        }
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
        assert!(remarks(&["/specimen/grading=[[0.06, 1], [0.002, 0]]"]).contains("a factor of 30"));
    }

    /// Scene 17 of the ladder.
    #[test]
    fn bodies_unlike_each_other_are_remarked_on() {
        let text = r#"{"scene": {"bodies": [{"name": "base", "shape": {"box": [1, 1, 0.1]}, "position": [0, 0, -0.05], "fixed": true},
                {"name": "ball", "shape": {"sphere": 0.02}, "position": [0, 0, 0.02], "rock": {"youngs_modulus": "30 kPa"}},
                {"name": "block", "shape": {"box": [1, 1, 1]}, "position": [0, 0, 0.54]}]},
            "rock": {"density": 2180, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2},
            "contact": {"friction": 0.65}, "stages": [{"kind": "load"}]}"#;
        let raw = RawCase::parse("x.json".as_ref(), text).unwrap_or_else(|e| panic!("{e}"));
        let remarks = raw.check().unwrap_or_else(|e| panic!("{e}")).remarks();
        assert!(remarks.len() == 2 && remarks[0].contains("a factor of 1e6"), "{remarks:?}");
        assert!(remarks[1].contains("a factor of 25"), "{remarks:?}");
    }
}
