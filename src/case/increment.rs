//! Increments of strain as they are taken: those that stages name, cut down to what the accuracy asked for allows.

use super::types::*;

/// Largest axial strain of a driven increment over the accuracy asked for. Condensed grains were off by 0.8 %
/// of q at 1e-4 and 2.2 % at 2e-4, whatever else was set (docs/decisions/0118-default-fidelity-rigid.md).
const INCREMENT_OF_ACCURACY: f64 = 5e-3;
/// Increments that differ by less than this share are the same.
const ROUNDING: f64 = 1e-9;

impl Case {
    /// Axial strain that no increment exceeds; `None` where no accuracy is asked for.
    pub fn largest_increment(&self) -> Option<f64> {
        self.solver.chosen_accuracy().map(|accuracy| INCREMENT_OF_ACCURACY * accuracy)
    }

    /// How a stage strains the specimen, its increments as they are taken.
    pub fn strained(&self, stage: &StageCase) -> Option<StrainedCase> {
        let given = stage.strained()?;
        let most = self.largest_increment().unwrap_or(f64::INFINITY);
        let [increment, increment_max] = [given.increment, given.increment_max].map(|it| it.min(most));
        Some(StrainedCase { increment, increment_max, ..given })
    }

    /// Remarks on increments that are taken shorter than the stages name them.
    pub(super) fn shortened_increments(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        for (at, stage) in self.stages.iter().enumerate() {
            let (Some(given), Some(taken)) = (stage.strained(), self.strained(stage)) else { continue };
            let mut remark = |key: &str, given: f64, taken: f64| {
                let accuracy = self.solver.accuracy.unwrap_or(f64::NAN);
                if taken < given * (1.0 - ROUNDING) {
                    remarks.push(format!(
                        "stages[{at}].{key} {given:e} is taken as {taken:.2e}, since solver.accuracy is {accuracy}"
                    ));
                }
            };
            remark("increment", given.increment, taken.increment);
            // By default it is the same number.
            if given.increment_max > given.increment {
                remark("increment_max", given.increment_max, taken.increment_max);
            }
        }
        remarks
    }
}

#[cfg(test)]
mod tests {
    use crate::case::{Case, checked};

    fn shear(overrides: &[&str]) -> Case {
        let text = include_str!("../../cases/stages/shear.json");
        checked(text, overrides).unwrap_or_else(|e| panic!("{e}"))
    }

    const ACCURATE: &str = "/solver/accuracy=0.05";

    #[test]
    fn increments_that_an_accuracy_shortens_are_told_and_counted() {
        let long = shear(&["/stages/1/increment=4e-4", "/stages/1/increment_max=4e-4", ACCURATE]);
        let short = shear(&["/stages/1/increment=2.5e-4", "/stages/1/increment_max=2.5e-4", ACCURATE]);
        let remarks = long.remarks().join("; ");
        assert!(
            remarks.contains("stages[1].increment 4e-4 is taken as 2.50e-4, since solver.accuracy is 0.05"),
            "{remarks}"
        );
        assert!(!remarks.contains("increment_max") && short.shortened_increments().is_empty());
        assert_eq!(long.strained(&long.stages[1]), short.strained(&short.stages[1]));
        assert_eq!(long.estimate().increments, short.estimate().increments);
    }

    #[test]
    fn growth_beyond_what_an_accuracy_allows_is_told() {
        let case = shear(&["/stages/1/increment=1e-4", "/stages/1/increment_max=4e-4", ACCURATE]);
        let remarks = case.shortened_increments();
        assert!(
            remarks.len() == 1 && remarks[0].contains("increment_max 4e-4 is taken as 2.50e-4"),
            "{remarks:?}"
        );
    }

    /// Where the fidelity is given an accuracy decides nothing.
    #[test]
    fn increments_of_a_given_fidelity_are_as_long_as_named() {
        let case = shear(&[
            "/stages/1/increment=4e-4",
            "/stages/1/increment_max=4e-4",
            "/solver/fidelity=condensed",
            ACCURATE,
        ]);
        assert_eq!(case.strained(&case.stages[1]), case.stages[1].strained());
        assert_eq!(case.shortened_increments(), Vec::<String>::new());
    }
}
