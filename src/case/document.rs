//! From the completed JSON value to the checked types and back.

use serde_json::Value;

use super::size::MeanGrains;
use super::types::*;

/// The case of a completed value, a specimen with its mean grains; otherwise why the table and the
/// types disagree.
pub fn to_case(value: Value, grains: Option<&MeanGrains>) -> Result<Case, String> {
    let mut case: Case = serde_json::from_value(value).map_err(|e| e.to_string())?;
    if let Geometry::Specimen(specimen) = &mut case.geometry {
        let plan = grains.ok_or("no grains")?.plan(specimen.size, specimen.void_ratio);
        (specimen.diameter, specimen.height) = (plan.diameter, plan.height);
        specimen.grains = plan.numbers.iter().sum();
    }
    Ok(case)
}

impl Case {
    /// Every value in force, in SI, as a case file that reads back as an equal case.
    pub fn completed(&self) -> Value {
        // Maps with text keys and finite numbers: serialisation has nothing to fail on.
        let mut value = serde_json::to_value(self).unwrap_or_default();
        if let (Geometry::Scene(_), Some(keys)) = (&self.geometry, value.as_object_mut()) {
            keys.shift_remove("plates");
            keys.shift_remove("membrane");
        }
        value
    }
}
