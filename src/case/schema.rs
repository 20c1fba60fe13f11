//! The JSON Schema (draft 2020-12) of the case file, made from the table that also checks it.

use serde_json::{Map, Value, json};

use super::form::{Form, Key, Need, Range};
use super::table;
use crate::quantity::Dimension;

/// The schema, for editors: they complete keys, show descriptions and mark what doesn't fit.
pub fn schema() -> Value {
    let about = "A triaxial test on rockfill (specimen) or a scene of bodies. Quantities are SI numbers or strings with a unit.";
    let mut schema = schema_of("riprap case", about, &table::CASE);
    schema["oneOf"] = json!([{"required": ["specimen"]}, {"required": ["scene"]}]);
    // What may stand in place of keys that the table needs.
    let specimen = &mut schema["properties"]["specimen"];
    specimen["required"] = json!([]);
    specimen["anyOf"] = [&["grading", "void_ratio"][..], &["grading", "porosity"], &["packing"]]
        .map(|keys| json!({"required": keys}))
        .into();
    specimen["not"] = json!({"required": ["void_ratio", "porosity"]});
    let packing = &mut specimen["properties"]["packing"]["anyOf"][0];
    packing["required"] = json!([]);
    packing["oneOf"] = json!([{"required": ["file"]}, {"required": ["grains"]}]);
    schema
}

/// The schema of a whole file of this form.
pub fn schema_of(title: &str, about: &str, form: &Form) -> Value {
    let mut head = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        // Of the editors' own: files may have both.
        "allowComments": true,
        "allowTrailingCommas": true,
        "description": about,
    });
    if let (Value::Object(head), Value::Object(mut schema)) = (&mut head, of(form)) {
        head.append(&mut schema);
    }
    head
}

fn of(form: &Form) -> Value {
    match form {
        Form::Quantity(dimension, range) => quantity(*dimension, range),
        Form::Count(low, u64::MAX) => json!({"type": "integer", "minimum": low}),
        Form::Count(low, high) => json!({"type": "integer", "minimum": low, "maximum": high}),
        Form::Text => json!({"type": "string"}),
        Form::Line => json!({"type": "string", "pattern": r"^[^\r\n]+$"}),
        Form::Flag => json!({"type": "boolean"}),
        Form::Choice(words) => json!({"enum": words}),
        Form::Tuple(forms) => {
            let items: Vec<_> = forms.iter().map(of).collect();
            json!({"type": "array", "prefixItems": items, "items": false, "minItems": items.len()})
        }
        Form::List(item, least) => json!({"type": "array", "items": of(item), "minItems": least}),
        Form::Object(keys) => object(keys, true),
        Form::Overrides(keys) => object(keys, false),
        Form::OneOf(keys) => {
            let mut schema = object(keys, true);
            schema["minProperties"] = 1.into();
            schema["maxProperties"] = 1.into();
            schema
        }
        Form::Kinds(kinds) => {
            let words: Vec<_> = kinds.iter().filter(|kind| kind.is_word()).map(|kind| kind.name).collect();
            let kinds = kinds.iter().map(|kind| {
                let mut schema = object(kind.keys, true);
                schema["description"] = kind.about.into();
                schema["properties"]["kind"] = json!({"const": kind.name});
                if let Some(required) = schema["required"].as_array_mut() {
                    required.insert(0, "kind".into());
                }
                schema
            });
            let words = (!words.is_empty()).then(|| json!({"enum": words}));
            json!({"oneOf": kinds.chain(words).collect::<Vec<_>>()})
        }
        Form::ByPointer(form) => {
            let pointers = json!({"^/": of(form)});
            json!({"type": "object", "patternProperties": pointers, "additionalProperties": false})
        }
        Form::Any => json!({}),
        Form::Named(form) => json!({"type": "object", "additionalProperties": of(form)}),
        Form::Scattered(keys) => {
            let mean = keys.first().map(|mean| of(&mean.form));
            json!({"anyOf": mean.into_iter().chain([object(keys, true)]).collect::<Vec<_>>()})
        }
        Form::OrBrought(form, other) => json!({"anyOf": [of(form), of(other)]}),
        Form::Brought(form) => of(form),
        Form::Nullable(form) => json!({"anyOf": [{"type": "null"}, of(form)]}),
        Form::Either(forms) => json!({"anyOf": forms.iter().map(of).collect::<Vec<_>>()}),
    }
}

fn object(keys: &[Key], complete: bool) -> Value {
    let mut properties = Map::new();
    let mut required = vec![];
    for key in keys {
        let mut schema = of(&key.form);
        let mut about = key.about.to_string();
        match key.need {
            Need::Required if complete => required.push(key.name),
            Need::Required | Need::Optional => {}
            Need::Default(json) => {
                if let Ok(default) = serde_json::from_str::<Value>(json) {
                    schema["default"] = default;
                }
            }
            Need::Derived(from) => about.push_str(&format!(" Default: {from}.")),
        }
        if let Some(unit) = unit(&key.form) {
            about.push_str(&format!(" A plain number is in {unit}."));
        }
        schema["description"] = about.into();
        properties.insert(key.name.into(), schema);
    }
    json!({"type": "object", "properties": properties, "required": required, "additionalProperties": false})
}

fn unit(form: &Form) -> Option<&'static str> {
    match form {
        Form::Quantity(dimension, _) => Some(dimension.si_unit()).filter(|unit| !unit.is_empty()),
        Form::Nullable(form) | Form::List(form, _) | Form::OrBrought(form, _) | Form::Brought(form) => {
            unit(form)
        }
        Form::Tuple(forms) => unit(forms.first()?),
        Form::Scattered(keys) => unit(&keys.first()?.form),
        Form::Count(..)
        | Form::Text
        | Form::Line
        | Form::Any
        | Form::Flag
        | Form::Choice(_)
        | Form::Object(_)
        | Form::Overrides(_)
        | Form::OneOf(_)
        | Form::Kinds(_)
        | Form::Named(_)
        | Form::ByPointer(_)
        | Form::Either(_) => None,
    }
}

fn quantity(dimension: Dimension, range: &Range) -> Value {
    let mut number = Map::from_iter([("type".to_string(), Value::from("number"))]);
    let (low, high) = (
        if range.above { "exclusiveMinimum" } else { "minimum" },
        if range.below { "exclusiveMaximum" } else { "maximum" },
    );
    number.insert(low.into(), range.low.into());
    number.insert(high.into(), range.high.into());
    let units: Vec<_> = dimension.units().collect();
    // The spellings that the reader takes besides (spaces, `*`, superscripts) are rare: `.*` lets them pass.
    let pattern = match dimension {
        Dimension::None => r"^\s*[-+]?[0-9.]+([eE][-+]?[0-9]+)?\s*%?\s*$".to_string(),
        _ => r"^\s*[-+]?[0-9.]+([eE][-+]?[0-9]+)?\s*\S.*$".to_string(),
    };
    let text = match dimension {
        Dimension::None => json!({"type": "string", "pattern": pattern}),
        _ => json!({
            "type": "string",
            "pattern": pattern,
            "description": format!("A number with one of the units {}.", units.join(", ")),
            "examples": [dimension.example().trim_matches('"')],
        }),
    };
    json!({"anyOf": [number, text]})
}
