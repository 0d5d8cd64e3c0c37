//! Record of the values of a scene's keys as they were read, in SI.

use std::cell::RefCell;

use serde_json::{Map, Value, json};

use super::keys;
use crate::json;

/// Optional sections of a scene. The record contains null for an optional section if the program read no key of the
/// section.
const OPTIONAL: [&str; 9] = [
    "contact",
    "dynamics",
    "joint",
    "material",
    "motion",
    "structure",
    "surface",
    "update",
    "wear",
];

/// Keys of the resonator that follow from other sections. The record contains the keys in `FOLLOWING_KEYS` so that the
/// section `structure` is complete. A comparison of scenes does not count the keys in `FOLLOWING_KEYS` as separate
/// differences.
pub const FOLLOWING_KEYS: [&str; 5] = [
    "structure.lap_length",
    "structure.arm_height",
    "structure.lap_cells",
    "structure.material.*",
    "structure.tied",
];

/// True if a key of a canonical scene can affect results. Some keys have a default even if the sections that they apply
/// to are absent.
pub fn is_relevant(canonical: &Value, key: &str) -> bool {
    let is_there = |section: &&str| canonical.get(section).is_some_and(|s| !s.is_null());
    keys::find(key).is_none_or(|key| key.with.iter().all(is_there))
}

/// Recorded values of a scene by key, as a tree of nested sections.
#[derive(Debug, Default)]
pub struct Record(RefCell<Map<String, Value>>);

impl Record {
    /// Records the value of a key, replacing an earlier one.
    pub fn note(&self, key: &str, value: Value) {
        let mut sections = self.0.borrow_mut();
        let mut at = &mut *sections;
        let mut parts = key.split('.');
        let last = parts.next_back().unwrap_or_default();
        for section in parts {
            let below = at.entry(section).or_insert(Value::Null);
            if !below.is_object() {
                *below = json!({});
            }
            at = below.as_object_mut().expect("an object by now");
        }
        at.insert(last.to_owned(), value);
    }

    /// Returns the recorded value of a part of a section.
    pub fn part(&self, section: &str, name: &str) -> Value {
        let sections = self.0.borrow();
        let part = sections.get(section).and_then(|section| section.get(name));
        part.cloned().unwrap_or_default()
    }

    /// Returns all recorded values with sorted keys. The hash of a scene is a hash of the returned value.
    pub fn canonical(&self) -> Value {
        let mut sections = self.0.borrow().clone();
        for name in OPTIONAL {
            sections.entry(name).or_insert(Value::Null);
        }
        json::sorted(Value::Object(sections))
    }
}
