//! Walks a value along its form: collects every fault, converts units, fills in defaults.

use serde_json::{Map, Value};

use crate::error::{Fault, Faults};

use super::form::{Form, Key, Kind, Need, Range};
use super::path::{child, fault_of_pointer, is_within, shortened};
use crate::quantity::{self, Dimension};

/// What to do about keys that are not there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Gaps {
    /// Fill in defaults; a required key is a fault.
    Fill,
    Leave,
}

/// Collects faults while values are walked.
pub struct Walker {
    pub faults: Vec<Fault>,
}

impl Faults for Walker {
    /// Where none is noted at its path.
    fn note(&mut self, fault: Fault) {
        if !self.faults.iter().any(|known| known.path == fault.path) {
            self.faults.push(fault);
        }
    }
}

impl Walker {
    /// `known` are faults found before; further ones at the same places are not listed again.
    pub fn new(known: Vec<Fault>) -> Self {
        Walker { faults: known }
    }

    /// Whether nothing is wrong at `path` and below it.
    pub fn is_clean(&self, path: &str) -> bool {
        !self.faults.iter().any(|fault| is_within(&fault.path, path))
    }

    /// The value in SI with defaults filled in. Where a part is at fault, a fault is noted, a key is
    /// left out and a list item is null.
    pub fn walk(&mut self, form: &Form, value: &Value, path: &str) -> Option<Value> {
        match (form, value) {
            (Form::Any, value) | (Form::Brought(_), value) => Some(value.clone()),
            (Form::Quantity(dimension, range), value) => {
                self.or_refuse(in_si(value, *dimension, range), form, value, path)
            }
            (Form::Count(low, high), value) => self.or_refuse(counted(value, *low, *high), form, value, path),
            (Form::Line, Value::String(text)) if text.is_empty() || text.contains(['\n', '\r']) => {
                self.refuse(form, value, path, "is no line of text".into())
            }
            (Form::Text | Form::Line, Value::String(_)) | (Form::Flag, Value::Bool(_)) => Some(value.clone()),
            (Form::Choice(words), Value::String(word)) => {
                let is_known = words.contains(&word.as_str());
                let problem = || meant("is not one of the choices", nearest(word, words.iter().copied()));
                self.or_refuse(if is_known { Ok(value.clone()) } else { Err(problem()) }, form, value, path)
            }
            (Form::Tuple(forms), Value::Array(items)) if items.len() != forms.len() => {
                let problem = format!("has {} items where {} are needed", items.len(), forms.len());
                self.refuse(form, value, path, problem)
            }
            (Form::Tuple(forms), Value::Array(items)) => {
                self.items(forms.iter().zip(items), path).into_iter().collect::<Option<_>>()
            }
            (Form::List(_, least), Value::Array(items)) if items.len() < *least => {
                let problem = match items.len() {
                    0 => "is empty".into(),
                    n => format!("has {n} items where at least {least} are needed"),
                };
                self.refuse(form, value, path, problem)
            }
            (Form::List(form, _), Value::Array(items)) => {
                let walked = self.items(items.iter().map(|item| (*form, item)), path);
                Some(walked.into_iter().map(Option::unwrap_or_default).collect())
            }
            (Form::Object(keys), Value::Object(map)) => {
                Some(Value::Object(self.object(keys, &[], map, path, Gaps::Fill)))
            }
            (Form::Overrides(keys), Value::Object(map)) => {
                Some(Value::Object(self.object(keys, &[], map, path, Gaps::Leave)))
            }
            (Form::OneOf(keys), Value::Object(map)) => self.one_of(form, keys, map, path),
            (Form::Kinds(kinds), Value::Object(map)) => self.kinds(kinds, map, path),
            (Form::Kinds(kinds), Value::String(word)) if kinds.iter().any(|kind| kind.name == word) => {
                let map = Map::from_iter([("kind".to_string(), value.clone())]);
                self.kinds(kinds, &map, path)
            }
            (Form::Named(form), Value::Object(map)) => Some(self.named(form, map, path)),
            (Form::ByPointer(form), Value::Object(map)) => Some(self.by_pointer(form, map, path)),
            (Form::Scattered(keys), value) => self.scattered(keys, value, path),
            (Form::Nullable(_), Value::Null) => Some(Value::Null),
            (Form::Nullable(form), value) => self.nullable(form, value, path),
            (Form::Either(forms), value) => self.either(form, forms, value, path),
            (Form::OrBrought(form, _), value) => self.walk(form, value, path),
            (
                Form::Text
                | Form::Line
                | Form::Flag
                | Form::Choice(_)
                | Form::Tuple(_)
                | Form::List(..)
                | Form::Object(_)
                | Form::Overrides(_)
                | Form::OneOf(_)
                | Form::Kinds(_)
                | Form::Named(_)
                | Form::ByPointer(_),
                value,
            ) => {
                self.refuse(form, value, path, format!("is {} where {} is needed", sort(value), wanted(form)))
            }
        }
    }

    /// All items of a list, whatever is wrong with the first.
    fn items<'a>(
        &mut self,
        items: impl Iterator<Item = (&'a Form, &'a Value)>,
        path: &str,
    ) -> Vec<Option<Value>> {
        items.enumerate().map(|(i, (form, item))| self.walk(form, item, &format!("{path}[{i}]"))).collect()
    }

    fn one_of(&mut self, form: &Form, keys: &[Key], map: &Map<String, Value>, path: &str) -> Option<Value> {
        let walked = Value::Object(self.object(keys, &[], map, path, Gaps::Leave));
        let named = keys.iter().map(|key| key.name);
        let given: Vec<_> = named.filter(|name| map.contains_key(*name)).collect();
        let problem = match given[..] {
            [_] => return Some(walked),
            [] if !self.is_clean(path) => return None,
            [] => "has none of the keys of which one is needed".into(),
            _ => format!("has {} where one is needed", given.join(" and ")),
        };
        self.refuse(form, &Value::Object(map.clone()), path, problem)
    }

    fn named(&mut self, form: &Form, map: &Map<String, Value>, path: &str) -> Value {
        let walked = map
            .iter()
            .filter_map(|(name, value)| Some((name.clone(), self.walk(form, value, &child(path, name))?)));
        Value::Object(walked.collect())
    }

    fn by_pointer(&mut self, form: &Form, map: &Map<String, Value>, path: &str) -> Value {
        let mut walked = Map::new();
        for (pointer, value) in map {
            let place = child(path, &shortened(pointer));
            if let Some((problem, accepted)) = fault_of_pointer(pointer) {
                self.fault(place, shown(value), problem, accepted);
            } else if let Some(value) = self.walk(form, value, &place) {
                walked.insert(pointer.clone(), value);
            }
        }
        Value::Object(walked)
    }

    fn nullable(&mut self, form: &Form, value: &Value, path: &str) -> Option<Value> {
        let known = self.faults.len();
        let walked = self.walk(form, value, path);
        for fault in self.faults[known..].iter_mut().filter(|fault| fault.path == path) {
            fault.accepted.insert_str(0, "null, or ");
        }
        walked
    }

    /// The first form that fits; where none does, a list or an object is told what it has wrong as such.
    fn either(&mut self, form: &Form, forms: &[Form], value: &Value, path: &str) -> Option<Value> {
        let fits = |form: &&Form| Walker::new(vec![]).walk(form, value, path).is_some();
        let is_meant = |form: &&Form| (value.is_array() || value.is_object()) && wanted(form) == sort(value);
        match forms.iter().find(fits).or_else(|| forms.iter().find(is_meant)) {
            Some(form) => self.walk(form, value, path),
            None => self.refuse(form, value, path, "is none of what is accepted".into()),
        }
    }

    /// What was read, or the fault of it.
    fn or_refuse(
        &mut self,
        read: Result<Value, String>,
        form: &Form,
        value: &Value,
        path: &str,
    ) -> Option<Value> {
        read.map_err(|problem| self.refuse(form, value, path, problem)).ok()
    }

    fn refuse(&mut self, form: &Form, value: &Value, path: &str, problem: String) -> Option<Value> {
        self.fault(path, shown(value), problem, form.accepted());
        None
    }

    /// Walks the known keys of an object; `also` are keys that the caller looks after.
    fn object(
        &mut self,
        keys: &[Key],
        also: &[&'static str],
        map: &Map<String, Value>,
        path: &str,
        gaps: Gaps,
    ) -> Map<String, Value> {
        let known = || also.iter().copied().chain(keys.iter().map(|key| key.name));
        let mut slips = vec![];
        for (name, value) in map.iter().filter(|(name, _)| !known().any(|k| k == name.as_str())) {
            // A key that is there already is meant by the slip of an override.
            let near = nearest(name, known());
            slips.extend(near);
            let problem = meant("is an unknown key", near);
            let accepted = match known().collect::<Vec<_>>().join(", ") {
                keys if keys.is_empty() => "no key here".into(),
                keys => format!("the keys {keys}"),
            };
            self.fault(child(path, name), shown(value), problem, accepted);
        }
        let mut walked = Map::new();
        for key in keys {
            let path = child(path, key.name);
            let value = match (map.get(key.name), key.need) {
                (Some(value), _) => self.walk(&key.form, value, &path),
                (None, _) if gaps == Gaps::Leave => None,
                (None, Need::Optional | Need::Derived(_)) => None,
                (None, Need::Default(json)) => {
                    serde_json::from_str(json).ok().and_then(|value| self.walk(&key.form, &value, &path))
                }
                (None, Need::Required) => {
                    // A misspelt key is named once, as unknown.
                    if !slips.contains(&key.name) {
                        self.fault(path, "nothing", "is missing", key.form.accepted());
                    }
                    None
                }
            };
            if let Some(value) = value {
                walked.insert(key.name.into(), value);
            }
        }
        walked
    }

    fn kinds(&mut self, kinds: &[Kind], map: &Map<String, Value>, path: &str) -> Option<Value> {
        let place = child(path, "kind");
        let choices = kinds.iter().map(|k| format!("\"{}\"", k.name)).collect::<Vec<_>>().join(", ");
        let problem = match map.get("kind") {
            None => "is missing".to_string(),
            Some(Value::String(name)) => match kinds.iter().find(|kind| kind.name == name) {
                Some(kind) => {
                    let mut walked = Map::from_iter([("kind".to_string(), Value::from(kind.name))]);
                    walked.extend(self.object(kind.keys, &["kind"], map, path, Gaps::Fill));
                    return Some(Value::Object(walked));
                }
                None => meant("is an unknown kind", nearest(name, kinds.iter().map(|kind| kind.name))),
            },
            Some(other) => format!("is {} where a text is needed", sort(other)),
        };
        let value = map.get("kind").map(shown).unwrap_or("nothing".into());
        self.fault(place, value, problem, choices);
        None
    }

    fn scattered(&mut self, keys: &[Key], value: &Value, path: &str) -> Option<Value> {
        let Value::Object(map) = value else {
            let mean = self.walk(&keys.first()?.form, value, path)?;
            return Some(serde_json::json!({ "mean": mean, "law": "constant" }));
        };
        let mut walked = self.object(keys, &[], map, path, Gaps::Fill);
        if self.is_clean(path) {
            self.scatter(&mut walked, path);
        }
        Some(Value::Object(walked))
    }

    /// Settles the law of a scattered quantity and refuses parameters of another law.
    fn scatter(&mut self, map: &mut Map<String, Value>, path: &str) {
        const OWNERS: [(&str, &[&str]); 3] = [
            ("weibull_shape", &["weibull"]),
            ("gamma_shape", &["gamma"]),
            ("variation", &["lognormal", "normal"]),
        ];
        let given = OWNERS.iter().filter(|(key, _)| map.contains_key(*key));
        let implied = given.map(|(_, laws)| laws[0]).next().unwrap_or("constant");
        let law = map.get("law").and_then(Value::as_str).unwrap_or(implied).to_string();
        let foreign: Vec<_> = OWNERS
            .iter()
            .filter(|(key, laws)| map.contains_key(*key) && !laws.contains(&law.as_str()))
            .collect();
        for (key, laws) in &foreign {
            let problem = format!("does not belong to the law \"{law}\"");
            let accepted = format!("the law {}, or no {key}", laws.join(" or "));
            let value = map.get(*key).map(shown).unwrap_or_default();
            self.fault(child(path, key), value, problem, accepted);
        }
        for (key, _) in OWNERS.iter().filter(|(_, laws)| laws.contains(&law.as_str())) {
            if foreign.is_empty() && !map.contains_key(*key) {
                let problem = format!("is missing for the law \"{law}\"");
                self.fault(child(path, key), "nothing", problem, "a number");
            }
        }
        if law != "weibull"
            && let Some(value) = map.get("reference_size")
        {
            let problem = format!("does not belong to the law \"{law}\"");
            self.fault(child(path, "reference_size"), shown(value), problem, "the law weibull");
        }
        map.insert("law".into(), law.into());
    }
}

/// The value as written, shortened for a message.
pub fn shown(value: &Value) -> String {
    const LONGEST: usize = 60;
    let text = value.to_string();
    if text.chars().count() <= LONGEST {
        return text;
    }
    text.chars().take(LONGEST - 3).chain("...".chars()).collect()
}

/// A problem with what was meant, where that is known.
pub fn meant(problem: &str, near: Option<&str>) -> String {
    near.map_or(problem.into(), |near| format!("{problem}: did you mean \"{near}\"?"))
}

/// The word meant by `word`, if one is near enough to be a slip.
pub fn nearest<'a>(word: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let slip = |candidate: &str| {
        let (word, candidate) = (word.to_lowercase(), candidate.to_lowercase());
        if word == candidate {
            return 1.0;
        }
        if word.len() >= 4 && (candidate.contains(&word) || word.contains(&candidate)) {
            return 0.9;
        }
        strsim::jaro_winkler(&word, &candidate).max(strsim::normalized_damerau_levenshtein(&word, &candidate))
    };
    known
        .map(|candidate| (slip(candidate), candidate))
        .filter(|(score, _)| *score > 0.78)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// Up to here every whole number is one of floating point: 2^53.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// A quantity in SI, or what is wrong with it.
fn in_si(value: &Value, dimension: Dimension, range: &Range) -> Result<Value, String> {
    let x = quantity::read(value, dimension)?;
    match (range.problem(x, dimension), dimension.si_unit()) {
        (None, _) => Ok(Value::from(x)),
        (Some(problem), "") => Err(meant(&problem, in_per_cent(x, range).as_deref())),
        (Some(problem), unit) if value.is_number() && !unit.is_empty() && x != 0.0 => {
            Err(format!("{problem} (a plain number is in {unit})"))
        }
        (Some(problem), _) => Err(problem),
    }
}

/// What a number beyond the range of shares and strains was most likely meant as: 15 for 15 %.
fn in_per_cent(x: f64, range: &Range) -> Option<String> {
    let is_share = range.low >= 0.0 && range.high <= 1.0;
    let fits = range.problem(0.01 * x, Dimension::None).is_none();
    (is_share && x >= 1.0 && fits).then(|| format!("{x} %"))
}

/// A whole number between two, or what is wrong with it.
fn counted(value: &Value, low: u64, high: u64) -> Result<Value, String> {
    let is = |problem: &str| Err(problem.to_string());
    match (whole(value), value.as_f64()) {
        (Some(n), _) if (low..=high).contains(&n) => Ok(Value::from(n)),
        (Some(n), _) if n < low => Err(format!("must be at least {low}")),
        (Some(_), _) => Err(format!("must be at most {high}")),
        (None, Some(x)) if x < 0.0 => is("must not be negative"),
        (None, Some(x)) if x > EXACT && x >= high as f64 => {
            Err(format!("is too large: must be at most {high}"))
        }
        (None, Some(x)) if x > EXACT => is("is too large to be exact so: write all of its digits"),
        (None, _) => is("is not a whole number"),
    }
}

fn whole(value: &Value) -> Option<u64> {
    match value.as_u64() {
        Some(n) => Some(n),
        None => value.as_f64().filter(|x| (0.0..=EXACT).contains(x) && x.fract() == 0.0).map(|x| x as u64),
    }
}

fn sort(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "a true/false",
        Value::Number(_) => "a number",
        Value::String(_) => "a text",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}

fn wanted(form: &Form) -> &'static str {
    match form {
        Form::Quantity(dimension, _) => dimension.name(),
        Form::Count(..) => "a whole number",
        Form::Text | Form::Choice(_) => "a text",
        Form::Line => "a line of text",
        Form::Flag => "true or false",
        Form::Tuple(_) | Form::List(..) => "a list",
        Form::Object(_)
        | Form::Overrides(_)
        | Form::OneOf(_)
        | Form::Kinds(_)
        | Form::Named(_)
        | Form::ByPointer(_) => "an object",
        Form::Any => "a value",
        Form::Scattered(_) => "a quantity or an object",
        Form::Nullable(form) | Form::OrBrought(form, _) | Form::Brought(form) => wanted(form),
        Form::Either(forms) => forms.first().map_or("a value", wanted),
    }
}

/// The number at a key of an object, where there is one.
pub fn number(object: &Value, key: &str) -> Option<f64> {
    object[key].as_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_per_cent_are_told_how_to_say_so() {
        let said = |value: Value, range: Range| in_si(&value, Dimension::None, &range).expect_err("a fault");
        let strain = Range { low: 0.0, above: true, high: 0.5, below: false };
        let share = Range { low: 0.0, above: false, high: 1.0, below: false };
        assert_eq!(said(15.into(), strain), "must be at most 0.5: did you mean \"15 %\"?");
        assert_eq!(said("62.5".into(), share), "must be at most 1: did you mean \"62.5 %\"?");
        assert_eq!(said(100.into(), share), "must be at most 1: did you mean \"100 %\"?");
        // No share or strain, or none that would be sound.
        for (value, range) in
            [(120.0, share), (0.8, strain), (-3.0, strain), (15.0, Range { high: 10.0, ..share })]
        {
            assert!(!said(value.into(), range).contains("did you mean"), "{value}");
        }
    }

    #[test]
    fn long_values_are_shortened_between_characters() {
        let text = shown(&Value::from("é".repeat(100)));
        assert_eq!(text.chars().count(), 60);
    }
}
