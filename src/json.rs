//! JSON in one canonical form, and what differs between two values.

use serde_json::{Map, Value};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// A key whose value differs between two JSON objects.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyChange {
    /// The key, with the keys above it: `wear.cycles`.
    pub key: String,
    /// Value before, `None` if there was none.
    pub before: Option<Value>,
    /// Value now, `None` if there is none.
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

/// The same value with the keys of every object in order. The order of `serde_json::Map` depends on the features that other
/// crates ask for.
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

/// The JSON text with the keys of every object sorted, so that equal values give equal texts whatever order they came in.
pub fn canonical(value: &Value) -> String {
    sorted(value.clone()).to_string()
}

/// The hash of the [canonical](canonical()) text, 64 hexadecimal digits.
pub fn hash(value: &Value) -> String {
    blake3::hash(canonical(value).as_bytes())
        .to_hex()
        .to_string()
}

/// Every value of nested objects under its dotted key. Arrays are values; so is an empty object, whose presence means
/// something.
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

/// The keys whose values differ, in alphabetical order. What was not read from a file goes through [`as_read`] first.
pub fn differences(before: &Value, after: &Value) -> Vec<KeyChange> {
    let (before, after) = (flatten(before), flatten(after));
    let keys: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
    // Null is how a resolved scene writes a key that is not given.
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

/// The value as it is once it was written and read: reading a float back may change its last digit.
pub fn as_read(value: &Value) -> Value {
    serde_json::from_str(&canonical(value)).unwrap_or_else(|_| value.clone())
}

/// The changes that somebody made: without those of keys that follow from others, unless nothing else changed.
pub fn made(mut changes: Vec<KeyChange>, following: &[String]) -> Vec<KeyChange> {
    let follows = |change: &KeyChange| matches(&change.key, following);
    if !changes.iter().all(follows) {
        changes.retain(|change| !follows(change));
    }
    changes
}

/// True if one of the patterns names the key: in full, or as a section by `section.*`.
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
