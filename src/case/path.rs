//! Where a value stands in a case or a plan: the JSON paths of messages, `$.rock.density`, and the JSON pointers of overrides, `/rock/density`.

use serde_json::Value;

/// Keys of a JSON pointer at most; no value of a case is as deep.
pub const MOST_KEYS: usize = 32;
/// Characters of a pointer that are told in a message.
const SHOWN: usize = 100;

/// Path of a key: `$.rock`, or `$["odd name"]` where a dot would be ambiguous.
pub fn child(path: &str, key: &str) -> String {
    let plain = !key.is_empty() && key.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-' | '$'));
    if plain { format!("{path}.{key}") } else { format!("{path}[{}]", Value::from(key)) }
}

/// Whether `path` is `ancestor` or below it.
pub fn is_within(path: &str, ancestor: &str) -> bool {
    path.strip_prefix(ancestor).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
}

/// The value at a path, if it is there.
pub fn at<'a>(root: &'a Value, path: &str) -> Option<&'a Value> {
    let mut found = root;
    let mut rest = path.strip_prefix('$')?;
    while !rest.is_empty() {
        if let Some(after) = rest.strip_prefix("[\"") {
            // A quoted key, JSON escapes and all: the paths that `child` makes.
            let Value::Object(map) = found else { return None };
            let quoted = |key: &str| format!("{}]", &Value::from(key).to_string()[1..]);
            let (key, value) = map.iter().find(|(key, _)| after.starts_with(&quoted(key)))?;
            found = value;
            rest = &after[quoted(key).len()..];
        } else if let Some(after) = rest.strip_prefix('[') {
            let (index, after) = after.split_once(']')?;
            found = found.get(index.parse::<usize>().ok()?)?;
            rest = after;
        } else {
            let after = rest.strip_prefix('.')?;
            let end = after.find(['.', '[']).unwrap_or(after.len());
            found = found.get(&after[..end])?;
            rest = &after[end..];
        }
    }
    Some(found)
}

/// What is wrong with a JSON pointer by itself, and what is accepted; `None` where nothing is.
pub fn fault_of_pointer(pointer: &str) -> Option<(String, String)> {
    let accepted = "a JSON pointer, as /stages/0/pressure";
    let Some(keys) = pointer.strip_prefix('/') else {
        return Some(("the pointer must begin with /".into(), accepted.into()));
    };
    // Every key nests a value in another, and some code that meets these calls itself for each.
    if keys.split('/').nth(MOST_KEYS).is_some() {
        return Some((
            "the pointer is too deep".into(),
            format!("{accepted}, with at most {MOST_KEYS} keys"),
        ));
    }
    None
}

/// A text for a message, cut where it is long.
pub fn shortened(text: &str) -> String {
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_string(),
    }
}

/// The path of what a pointer aims at.
pub fn path_of(pointer: &str) -> String {
    pointer.split('/').skip(1).fold("$".into(), |path, key| match key.parse::<usize>() {
        Ok(index) => format!("{path}[{index}]"),
        Err(_) => child(&path, &key.replace("~1", "/").replace("~0", "~")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_keys_are_quoted_in_paths() {
        assert_eq!(child("$.bodies", "left"), "$.bodies.left");
        assert_eq!(child("$.bodies", "a.b"), "$.bodies[\"a.b\"]");
        assert!(is_within("$.rock.density", "$.rock"));
        assert!(!is_within("$.rocks", "$.rock"));
    }
}
