//! The keys of a case file as tables in Markdown, from its JSON Schema.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde_json::{Map, Value};

/// A table for each object that a case file may hold, the whole file first.
pub fn tables(schema: &Value) -> String {
    let mut writer = Writer::default();
    writer.object(schema, "The whole file", "");
    writer.text
}

#[derive(Default)]
struct Writer {
    text: String,
    /// Where a table already stands, by its keys.
    told: BTreeMap<String, String>,
}

impl Writer {
    /// The table of an object's keys, then those of the objects in it; `path` is its JSON path.
    fn object(&mut self, node: &Value, title: &str, path: &str) {
        let Some(keys) = node["properties"].as_object() else { return };
        let shown: Vec<_> = keys.iter().filter(|(_, key)| key.get("const").is_none()).collect();
        if shown.is_empty() {
            return;
        }
        let all = format!("{}{}", node["properties"], node["required"]);
        if let Some(place) = self.told.get(&all) {
            if place != title {
                let _ = write!(self.text, "\n### {title}\n\nAs {place}.\n");
            }
            return;
        }
        self.told.insert(all, title.to_string());
        let about = node["description"].as_str().unwrap_or_default();
        let _ = write!(self.text, "\n### {title}\n");
        if !about.is_empty() && !path.is_empty() {
            let _ = write!(self.text, "\n{about}\n");
        }
        self.text += "\n| key | takes | default | what |\n|---|---|---|---|\n";
        let required: Vec<&str> =
            node["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        for (name, key) in &shown {
            let default = match key.get("default") {
                _ if required.contains(&name.as_str()) => "required".to_string(),
                Some(value) => format!("`{value}`"),
                None => String::new(),
            };
            let what = key["description"].as_str().unwrap_or_default();
            let takes = takes(key);
            let _ = writeln!(self.text, "| `{name}` | {takes} | {default} | {what} |");
        }
        for (name, key) in shown {
            self.inside(key, &format!("{path}/{name}"));
        }
    }

    /// The objects among what a key takes.
    fn inside(&mut self, node: &Value, path: &str) {
        if node["properties"].is_object() {
            let kind = node["properties"]["kind"]["const"].as_str();
            let title = kind.map_or_else(|| format!("`{path}`"), |kind| format!("`{path}`, kind {kind}"));
            self.object(node, &title, path);
        }
        for several in ["anyOf", "oneOf"] {
            node[several].as_array().into_iter().flatten().for_each(|one| self.inside(one, path));
        }
        if node["items"].is_object() {
            self.inside(&node["items"], &format!("{path}/<k>"));
        }
        if node["additionalProperties"].is_object() {
            self.inside(&node["additionalProperties"], &format!("{path}/<name>"));
        }
    }
}

/// What a key takes, in a few words.
fn takes(node: &Value) -> String {
    let mut found = Vec::new();
    collect(node, &mut found);
    found.dedup();
    found.join(", ")
}

fn collect(node: &Value, found: &mut Vec<String>) {
    let Some(object) = node.as_object() else { return };
    if let Some(words) = object.get("enum").and_then(Value::as_array) {
        found.extend(words.iter().map(|word| format!("`{word}`")));
        return;
    }
    for several in ["anyOf", "oneOf"] {
        object
            .get(several)
            .and_then(Value::as_array)
            .into_iter()
            .flatten()
            .for_each(|one| collect(one, found));
    }
    match object.get("type").and_then(Value::as_str) {
        Some("null") => found.push("`null`".into()),
        Some("boolean") => found.push("`true`, `false`".into()),
        Some("integer") => found.push(format!("whole number{}", range(object))),
        Some("number") => found.push(format!("number{}", range(object))),
        // A number with its unit, which the description names.
        Some("string") if object.contains_key("pattern") => {
            let units =
                object.get("description").and_then(Value::as_str).and_then(|text| text.split_once("units "));
            found.extend(units.map(|(_, units)| format!("or with a unit ({})", units.trim_end_matches('.'))));
        }
        Some("string") => found.push("text".into()),
        Some("array") => {
            let length = object.get("prefixItems").and_then(Value::as_array).map(Vec::len);
            found.push(length.map_or_else(|| "list".into(), |length| format!("list of {length}")));
        }
        Some("object") if object.get("additionalProperties").is_some_and(Value::is_object) => {
            found.push("objects by name, below".into());
        }
        Some("object") => found.push("object, below".into()),
        _ => {}
    }
}

fn range(object: &Map<String, Value>) -> String {
    let bound = |key: &str| object.get(key).map(|value| value.to_string().trim_end_matches(".0").to_string());
    let low = bound("minimum").map(|low| format!(" from {low}"));
    let low = low.or_else(|| bound("exclusiveMinimum").map(|low| format!(" above {low}")));
    let high = bound("maximum").map(|high| format!(" to {high}"));
    let high = high.or_else(|| bound("exclusiveMaximum").map(|high| format!(" below {high}")));
    low.unwrap_or_default() + &high.unwrap_or_default()
}
