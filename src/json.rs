//! Canonical form of JSON, and differences between two values.

use serde_json::{Map, Value};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// A key whose value differs between two JSON objects.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyChange {
    /// The key with its parent keys, joined by dots, for example `wear.cycles`.
    pub key: String,
    /// Value before, or `None` if the key was absent.
    pub before: Option<Value>,
    /// Value now, or `None` if the key is absent.
    pub after: Option<Value>,
}

impl fmt::Display for KeyChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = |value: &Option<Value>| match value {
            None | Some(Value::Null) => "absent".to_owned(),
            Some(value) => value.to_string(),
        };
        write!(
            f,
            "`{}` was {}, is {}",
            self.key,
            text(&self.before),
            text(&self.after)
        )
    }
}

/// Returns the same value with the keys of every object sorted. The order of `serde_json::Map` depends on the
/// features that other crates enable.
pub fn sorted(value: Value) -> Value {
    match value {
        Value::Object(object) => {
            let by_key: BTreeMap<String, Value> = object
                .into_iter()
                .map(|(key, value)| (key, sorted(value)))
                .collect();
            Value::Object(by_key.into_iter().collect::<Map<_, _>>())
        }
        Value::Array(items) => Value::Array(items.into_iter().map(sorted).collect()),
        scalar => scalar,
    }
}

/// Returns the JSON text with the keys of every object sorted, so that equal values give equal texts.
pub fn canonical(value: &Value) -> String {
    sorted(value.clone()).to_string()
}

/// Returns the hash of the [canonical](canonical()) text, as 64 hexadecimal digits.
pub fn hash(value: &Value) -> String {
    blake3::hash(canonical(value).as_bytes())
        .to_hex()
        .to_string()
}

/// Returns every value of nested objects under its dotted key. Arrays count as values. Empty objects count as values,
/// because the presence of an empty object has a meaning.
pub fn flatten(value: &Value) -> BTreeMap<String, Value> {
    fn walk(prefix: &str, value: &Value, into: &mut BTreeMap<String, Value>) {
        match value {
            Value::Object(object) if !object.is_empty() => {
                for (key, value) in object {
                    let key = if prefix.is_empty() {
                        key.clone()
                    } else {
                        format!("{prefix}.{key}")
                    };
                    walk(&key, value, into);
                }
            }
            leaf => {
                into.insert(prefix.to_owned(), leaf.clone());
            }
        }
    }
    let mut into = BTreeMap::new();
    walk("", value, &mut into);
    into
}

/// Returns the keys whose values differ, in alphabetical order. Pass values that were not read from a file through
/// [`as_read`] first.
pub fn differences(before: &Value, after: &Value) -> Vec<KeyChange> {
    let (before, after) = (flatten(before), flatten(after));
    let keys: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
    // A resolved scene contains null for a key that is not given.
    let text = |value: Option<&Value>| value.filter(|value| !value.is_null()).map(canonical);
    keys.into_iter()
        .filter(|&key| text(before.get(key)) != text(after.get(key)))
        .map(|key| KeyChange {
            key: key.clone(),
            before: before.get(key).cloned(),
            after: after.get(key).cloned(),
        })
        .collect()
}

/// Writes `value` as JSON and returns the value that the reader reads from the JSON. The reader may change the last
/// digit of a float.
pub fn as_read(value: &Value) -> Value {
    serde_json::from_str(&canonical(value)).unwrap_or_else(|_| value.clone())
}

/// Returns the changes that the user made. Changes of keys that follow from other keys are omitted, unless nothing
/// else changed.
pub fn user_changes(mut changes: Vec<KeyChange>, following: &[String]) -> Vec<KeyChange> {
    let follows = |change: &KeyChange| matches(&change.key, following);
    if !changes.iter().all(follows) {
        changes.retain(|change| !follows(change));
    }
    changes
}

/// Returns true if one of the patterns matches the key: in full, or as a section `section.*`.
pub fn matches(key: &str, patterns: &[String]) -> bool {
    patterns
        .iter()
        .any(|pattern| match pattern.strip_suffix(".*") {
            Some(section) => key
                .strip_prefix(section)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with('.')),
            None => key == pattern,
        })
}
