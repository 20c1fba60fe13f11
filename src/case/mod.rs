//! The case file: read, checked, completed.
//!
//! [`read`] gives the file as JSON ([`RawCase`]); [`RawCase::check`] lists every fault at once or
//! gives the checked [`Case`], plain data in SI; [`Case::completed`] prints every value in force,
//! defaults included; [`schema`] is the JSON Schema for editors. What a file may contain stands in
//! one place, `table`, from which checks, defaults, messages and schema all follow; rules between
//! several values stand in `rules`. A sound case may still ask for what riprap cannot run yet:
//! [`unsupported`] lists that.

mod bring;
mod document;
mod estimate;
mod form;
mod idle;
mod increment;
mod mistaken;
mod overlap;
mod packed;
mod path;
mod plausible;
mod remarks;
mod rules;
mod schema;
mod size;
mod source;
mod stage;
mod support;
mod table;
mod types;
mod walk;

pub use estimate::Estimate;
pub(crate) use form::{Form, Key};
pub use mistaken::FileKind;
pub(crate) use mistaken::refuse_file;
pub use path::child as path_of_key;
pub(crate) use path::{fault_of_pointer, shortened};
pub use remarks::Squeeze;
pub use schema::schema;
pub(crate) use schema::schema_of;
#[cfg(test)]
pub(crate) use source::checked;
pub use source::{RawCase, parse_override, read, read_named, refuse_input};
pub use support::unsupported;
pub use types::*;
pub(crate) use walk::Walker;
pub use walk::shown;

use std::path::Path;

use crate::error::{Error, Faults, Result};

impl RawCase {
    /// Checks the case.
    ///
    /// # Errors
    /// `Error::Case` with every fault found.
    pub fn check(&self) -> Result<Case> {
        let (mut given, mut faults) = (self.value.clone(), self.faults.clone());
        let brought = bring::files(&given);
        let notes = bring::bring_in(&mut given, self.file.parent().unwrap_or(Path::new("")), &mut faults);
        let mut walker = walk::Walker::new(faults);
        let mut found = rules::Found::default();
        let walked = walker.walk(&table::CASE, &given, "$").map(|mut value| {
            rules::derive(&mut value);
            found = rules::check(&value, &given, self.file.parent(), &mut walker);
            value
        });
        let mut faults = walker.faults;
        if faults.is_empty() {
            match document::to_case(walked.unwrap_or_default(), found.grains.as_ref()) {
                Ok(case) => {
                    return Ok(Case { notes, brought, cells_of_files: found.cells_of_files, ..case });
                }
                // The table accepts what the types do not: an error of this program, said as one.
                Err(problem) => faults.fault(
                    "$",
                    "this case",
                    format!(
                        "passes the checks of riprap and cannot be built ({problem}): please report this"
                    ),
                    "a case as riprap schema describes it",
                ),
            }
        }
        Err(Error::Case { file: self.file.clone(), faults })
    }
}

#[cfg(test)]
mod tests {
    use super::form::{Form, Key};
    use super::*;
    use serde_json::{Map, Value, json};

    /// Sound values of a form that between them use each of its keys and choices.
    fn examples(form: &Form) -> Vec<Value> {
        match form {
            Form::Quantity(_, range) => vec![match (range.low, range.high) {
                (low, high) if low < 0.0 && high > 0.0 => json!(0.0),
                (low, high) if low > 0.0 => json!((low * high).sqrt()),
                (low, high) => json!(low + (high - low).min(0.1) / 2.0),
            }],
            Form::Count(low, high) => vec![json!(20.clamp(*low, *high))],
            Form::Text | Form::Line => vec![json!("a text")],
            Form::Any => vec![json!(1)],
            Form::ByPointer(form) => vec![json!({"/a": examples(form).remove(0)})],
            Form::Flag => vec![json!(true), json!(false)],
            Form::Choice(words) => words.iter().map(|word| json!(word)).collect(),
            Form::Tuple(forms) => {
                let items = forms.iter().map(examples).collect::<Vec<_>>();
                let most = items.iter().map(Vec::len).max().unwrap_or(1);
                (0..most).map(|i| items.iter().map(|item| item[i % item.len()].clone()).collect()).collect()
            }
            Form::List(item, least) => {
                let items = examples(item);
                vec![items.iter().cycle().take(items.len().max(*least)).cloned().collect()]
            }
            Form::Object(keys) | Form::Overrides(keys) => objects(keys),
            Form::OneOf(keys) => keys
                .iter()
                .flat_map(|key| examples(&key.form).into_iter().map(|value| json!({ key.name: value })))
                .collect(),
            Form::Kinds(kinds) => kinds
                .iter()
                .flat_map(|kind| {
                    objects(kind.keys).into_iter().map(|mut object| {
                        object["kind"] = json!(kind.name);
                        object
                    })
                })
                .collect(),
            Form::Named(form) => {
                vec![examples(form).into_iter().enumerate().map(|(i, v)| (format!("name {i}"), v)).collect()]
            }
            Form::Either(forms) => forms.iter().flat_map(examples).collect(),
            Form::Scattered(keys) => {
                let mean = examples(&keys[0].form).remove(0);
                let laws = [
                    json!({"law": "constant"}),
                    json!({"weibull_shape": 20.0}),
                    json!({"gamma_shape": 20.0}),
                    json!({"variation": 0.1}),
                    json!({"law": "normal", "variation": 0.1}),
                    json!({"law": "exponential"}),
                ];
                let with_mean = |mut law: Value| {
                    law["mean"] = mean.clone();
                    law
                };
                [mean.clone()].into_iter().chain(laws.map(with_mean)).collect()
            }
            Form::OrBrought(form, _) => examples(form),
            Form::Brought(_) => Vec::new(),
            Form::Nullable(form) => [Value::Null].into_iter().chain(examples(form)).collect(),
        }
    }

    fn objects(keys: &[Key]) -> Vec<Value> {
        let values = keys.iter().map(|key| (key.name, examples(&key.form)));
        let values: Vec<_> = values.filter(|(_, options)| !options.is_empty()).collect();
        let most = values.iter().map(|(_, options)| options.len()).max().unwrap_or(1);
        (0..most)
            .map(|i| {
                let pick = |(name, options): &(&str, Vec<Value>)| {
                    (name.to_string(), options[i % options.len()].clone())
                };
                values.iter().map(pick).collect::<Map<_, _>>().into()
            })
            .collect()
    }

    /// The table and the types name the same keys: whatever the table lets through fits the types.
    #[test]
    fn every_key_of_the_table_is_in_the_types() {
        let grains = size::MeanGrains::new(
            &[[0.06, 1.0], [0.04, 0.0]],
            Default::default(),
            [8, 16],
            0.45,
            (&[], 0.02),
        )
        .expect("grains");
        let examples = examples(&table::CASE);
        assert!(examples.len() > 1);
        for example in examples {
            for geometry in ["specimen", "scene"] {
                let mut value = example.clone();
                value.as_object_mut().expect("an object").shift_remove(geometry);
                let mut walker = walk::Walker::new(vec![]);
                let mut walked = walker.walk(&table::CASE, &value, "$").expect("a value");
                assert_eq!(walker.faults, []);
                // Both ways of giving the pressure are in the example; the rules allow one.
                for stage in walked["stages"].as_array_mut().expect("stages") {
                    if stage["kind"] == "consolidate" {
                        stage.as_object_mut().expect("a stage").shift_remove("pressure");
                    }
                }
                rules::derive(&mut walked);
                let given = walked.clone();
                let case = document::to_case(walked, Some(&grains)).unwrap_or_else(|e| panic!("{e}"));
                // Of the case and its specimen the types pass over what they have not; elsewhere they refuse it.
                let completed = case.completed();
                for place in ["", "/specimen"] {
                    let keys =
                        given.pointer(place).and_then(Value::as_object).into_iter().flat_map(Map::keys);
                    let twice = ["grains", "aspect", "plates", "membrane"];
                    for key in keys.filter(|key| !twice.contains(&key.as_str())) {
                        assert!(completed.pointer(&format!("{place}/{key}")).is_some(), "{place}/{key}");
                    }
                }
                let estimate = case.estimate();
                assert!(estimate.memory.is_finite() && estimate.time.is_finite(), "{estimate}");
            }
        }
    }

    #[test]
    fn every_default_is_sound() {
        let text = r#"{"specimen": {"grains": 80, "aspect": 2, "void_ratio": 0.5, "grading": [[0.06, 1], [0.04, 0]]},
            "rock": {"density": 2180, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2, "damage": {},
                     "tensile_strength": "25 MPa", "compressive_strength": "250 MPa"},
            "contact": {"friction": 0.65}, "membrane": {"kind": "rubber"},
            "stages": [{"kind": "consolidate", "pressure": "0.8 MPa"}, {"kind": "shear", "axial_strain": 0.1},
                       {"kind": "unload"}, {"kind": "reload"}, {"kind": "hold"}]}"#;
        let case = checked(text, &[]).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(case.contact.residual_friction, 0.65);
        assert!((case.contact.weakening_distance - 0.0125).abs() < 1e-12);
        assert_eq!(case.plates.friction, 0.65);
        assert_eq!(case.rock.damage.map(|damage| damage.exponent), Some(3.0));
        assert_eq!(case.solver.force_tolerance, 1e-3);
        assert!(matches!(case.stages[1], StageCase::Shear { pressure: Some(8e5), .. }));
        assert_eq!(unsupported(&case), []);
    }
}
