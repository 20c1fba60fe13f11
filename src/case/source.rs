//! The case file as it stands: JSON with comments and trailing commas, and `--set` overrides.

use std::path::{Path, PathBuf};

use jsonc_parser::common::Ranged;
use serde_json::Value;

use crate::error::{Error, Fault, Faults, Result};
use crate::input;

use super::mistaken::{FileKind, refuse_file};
use super::path::{child, fault_of_pointer, is_within, path_of, shortened};
use super::walk::shown;

/// A case file that is JSON, not yet checked.
#[derive(Debug, Clone, PartialEq)]
pub struct RawCase {
    pub file: PathBuf,
    /// The text as given, and overrides behind it as comments.
    pub text: String,
    /// The value with overrides applied. Tokens that JSON has no number for (`NaN`, `1e999`) are
    /// strings here, and faults.
    pub value: Value,
    /// Faults that only the text or the overrides show.
    pub faults: Vec<Fault>,
}

/// Reads a case file that a user names, which may be a pipe.
///
/// # Errors
/// `Error::Io` if it can't be read, `Error::Json` with line and column if it isn't JSON, `Error::Usage` for a results file or a table.
pub fn read(path: &Path) -> Result<RawCase> {
    refuse_file(path, FileKind::Case)?;
    from_bytes(path, input::read_at_most(path, input::LARGEST_CASE))
}

/// Refuses another kind of file where a results file or a table is wanted. What is of no kind is for its reader to tell of.
///
/// # Errors
/// `Error::Usage`.
pub fn refuse_input(path: &Path, wanted: FileKind) -> Result<()> {
    refuse_file(path, wanted)?;
    // A pipe can be read once only.
    if FileKind::of_file(path).is_some() || !path.is_file() {
        return Ok(());
    }
    let raw = from_bytes(path, input::read_at_most(path, input::LARGEST_CASE));
    match raw.ok().and_then(|raw| FileKind::of_keys(&raw.value)) {
        Some(kind) => Err(kind.in_place_of(wanted, path)),
        None => Ok(()),
    }
}

/// Reads a case file that a plan names.
///
/// # Errors
/// As [`read`], and `Error::Io` for what is no file.
pub fn read_named(path: &Path) -> Result<RawCase> {
    from_bytes(path, input::read_named(path))
}

fn from_bytes(path: &Path, bytes: std::io::Result<Vec<u8>>) -> Result<RawCase> {
    match String::from_utf8(bytes.map_err(|e| Error::io("read", path, e))?) {
        Ok(text) => RawCase::parse(path, &text),
        Err(e) => {
            let before = &e.as_bytes()[..e.utf8_error().valid_up_to()];
            let line = 1 + before.iter().filter(|b| **b == b'\n').count();
            let column = 1 + before.iter().rev().take_while(|b| **b != b'\n').count();
            Err(Error::Json { file: path.into(), line, column, message: "not UTF-8 text".into() })
        }
    }
}

impl RawCase {
    /// Reads the text of a case file; `file` is for messages and for finding mesh files.
    ///
    /// # Errors
    /// `Error::Json` with line and column.
    pub fn parse(file: &Path, text: &str) -> Result<RawCase> {
        let options = jsonc_parser::ParseOptions {
            allow_comments: true,
            allow_trailing_commas: true,
            allow_non_finite_numbers: true,
            allow_loose_object_property_names: false,
            allow_missing_commas: false,
            allow_single_quoted_strings: false,
            allow_hexadecimal_numbers: false,
            allow_unary_plus_numbers: false,
            allow_bare_decimal_point_numbers: false,
            allow_extended_string_escapes: false,
        };
        let json = |line, column, message| Error::Json { file: file.into(), line, column, message };
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let parsed = jsonc_parser::parse_to_ast(text, &Default::default(), &options)
            .map_err(|e| json(e.line_display(), e.column_display(), lower_first(&e.kind().to_string())))?;
        let Some(tree) = parsed.value else {
            return Err(json(1, 1, "the file is empty".into()));
        };
        let mut faults = vec![];
        let value = to_value(&tree, "$", text, &mut faults);
        Ok(RawCase { file: file.into(), text: text.into(), value, faults })
    }

    /// Applies `--set` overrides, in order. Objects on the way to the last key are made where they
    /// are missing; list items must be there already. What cannot be applied becomes a fault.
    pub fn set(&mut self, overrides: &[(String, Value)]) {
        for (pointer, value) in overrides {
            // One line each: a line break would end the comment.
            let line = format!("--set {pointer}={value}").replace(|c: char| c.is_control(), "\u{fffd}");
            self.text.push_str(&format!("\n// {line}"));
            if let Err((problem, accepted)) = set_at(&mut self.value, pointer, value.clone()) {
                let place = format!("--set {}", shortened(pointer));
                self.faults.fault(place, shown(value), problem, accepted);
            }
        }
        // An override heals the faults of the text that it replaces.
        let sound = overrides.iter().filter(|(pointer, _)| fault_of_pointer(pointer).is_none());
        let replaced: Vec<String> = sound.map(|(pointer, _)| path_of(pointer)).collect();
        self.faults.retain(|fault| !replaced.iter().any(|path| is_within(&fault.path, path)));
    }
}

/// Splits the argument of `--set`, `/json/pointer=VALUE`. The value is JSON, or else taken as text:
/// `/stages/0/pressure=0.8 MPa` needs no inner quotes.
///
/// # Errors
/// The fault of an argument without `=`.
pub fn parse_override(argument: &str) -> Result<(String, Value), Fault> {
    match argument.split_once('=') {
        Some((pointer, value)) => {
            let value = serde_json::from_str(value).unwrap_or_else(|_| Value::String(value.into()));
            Ok((pointer.into(), value))
        }
        None => Err(Fault::new(
            "--set",
            argument,
            "has no =",
            "/json/pointer=VALUE, as /stages/0/pressure=\"0.4 MPa\"",
        )),
    }
}

#[cfg(test)]
impl RawCase {
    /// With these `--set` overrides: for tests.
    pub(crate) fn with(mut self, overrides: &[&str]) -> RawCase {
        let parsed = overrides.iter().map(|text| parse_override(text).unwrap_or_else(|e| panic!("{e}")));
        self.set(&parsed.collect::<Vec<_>>());
        self
    }
}

/// The case of a text with these `--set` overrides, checked: for tests.
#[cfg(test)]
pub(crate) fn checked(text: &str, overrides: &[&str]) -> Result<super::types::Case> {
    RawCase::parse("x.json".as_ref(), text)?.with(overrides).check()
}

fn set_at(root: &mut Value, pointer: &str, new: Value) -> Result<(), (String, String)> {
    if let Some(fault) = fault_of_pointer(pointer) {
        return Err(fault);
    }
    let keys = pointer.strip_prefix('/').unwrap_or(pointer);
    let mut at = root;
    for key in keys.split('/').map(|key| key.replace("~1", "/").replace("~0", "~")) {
        if at.is_null() {
            *at = Value::Object(Default::default());
        }
        at = match at {
            Value::Object(map) => map.entry(key).or_insert(Value::Null),
            Value::Array(items) => {
                let length = items.len();
                match key.parse::<usize>().ok().and_then(|index| items.get_mut(index)) {
                    Some(item) => item,
                    None => {
                        let accepted = match length {
                            0 => "nothing: the list is empty".into(),
                            _ => format!("an index from 0 to {}", length - 1),
                        };
                        return Err((format!("the list has no item \"{key}\""), accepted));
                    }
                }
            }
            other => {
                let problem = format!("\"{key}\" is looked for in {}, which has no keys", shown(other));
                return Err((problem, "a pointer through objects and lists".into()));
            }
        };
    }
    *at = new;
    Ok(())
}

fn to_value(tree: &jsonc_parser::ast::Value, path: &str, text: &str, faults: &mut Vec<Fault>) -> Value {
    use jsonc_parser::ast::Value as Tree;
    match tree {
        Tree::NullKeyword(_) => Value::Null,
        Tree::BooleanLit(lit) => Value::Bool(lit.value),
        Tree::StringLit(lit) => Value::String(lit.value.to_string()),
        Tree::NumberLit(lit) => match serde_json::from_str::<serde_json::Number>(lit.value) {
            Ok(number) if number.as_f64().is_some_and(f64::is_finite) => Value::Number(number),
            _ => {
                let accepted = "a finite number, or a text with a unit";
                faults.fault(path, lit.value, "is not a finite number", accepted);
                Value::String(lit.value.into())
            }
        },
        Tree::Array(list) => {
            let items = list.elements.iter().enumerate();
            Value::Array(
                items.map(|(i, item)| to_value(item, &format!("{path}[{i}]"), text, faults)).collect(),
            )
        }
        Tree::Object(object) => {
            let mut map = serde_json::Map::new();
            for property in &object.properties {
                let key = property.name.as_str();
                let path = child(path, key);
                let value = to_value(&property.value, &path, text, faults);
                if map.insert(key.to_string(), value.clone()).is_some() {
                    let line = 1 + text[..property.start().min(text.len())].matches('\n').count();
                    let problem = format!("is given a second time in line {line}");
                    faults.fault(path, shown(&value), problem, "each key once");
                }
            }
            Value::Object(map)
        }
    }
}

fn lower_first(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map(|first| first.to_lowercase().collect::<String>() + chars.as_str()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::super::path::MOST_KEYS;
    use super::*;

    #[test]
    fn a_pointer_that_nests_without_end_is_a_fault() {
        let deep = |keys: usize| "/a".repeat(keys);
        for (keys, sound) in [(1, true), (MOST_KEYS, true), (MOST_KEYS + 1, false), (200_000, false)] {
            let mut raw = RawCase::parse("x.json".as_ref(), "{}").unwrap_or_else(|e| panic!("{e}"));
            raw.set(&[(deep(keys), Value::from(1))]);
            assert_eq!(raw.faults.is_empty(), sound, "{keys}");
            if let Some(fault) = raw.faults.first() {
                let said = fault.to_string();
                assert!(
                    said.contains("too deep") && said.contains("at most 32") && said.len() < 400,
                    "{said}"
                );
            }
        }
    }

    #[test]
    fn an_override_stays_in_its_comment() {
        let mut raw = RawCase::parse("x.json".as_ref(), "{}").unwrap_or_else(|e| panic!("{e}"));
        raw.set(&[("/a\n}, \u{1b}[31m".into(), Value::from(1))]);
        assert_eq!(raw.text.lines().count(), 2, "{:?}", raw.text);
        assert!(!raw.text.contains('\u{1b}'));
    }
}
