//! Accuracy settings at the start of a run. A resumed run keeps the accuracy settings that the scene does not set,
//! because default settings change between versions.

use serde_json::Value;

use super::Scene;
use super::keys::cycles::WEAR_STEP_TOLERANCE;
use super::keys::fidelity::{ASKED, PRESET, WEAR_TOLERANCE};
use crate::json::{as_read, differences};

impl Scene {
    /// Returns the accuracy keys whose values changed since the start of the run, as `key=value`. The function omits
    /// keys that the scene sets. The argument `begun` is the canonical scene at the start of the run. Returns nothing
    /// if the scene now requests another preset or tolerance, because another preset changes many keys on purpose.
    pub fn accuracy_changed_since(&self, begun: &Value) -> Vec<String> {
        let changes = differences(begun, &as_read(&self.canonical()));
        let keys_changing_others = [PRESET.name, ASKED.name];
        if changes
            .iter()
            .any(|change| keys_changing_others.contains(&&*change.key))
        {
            return Vec::new();
        }
        let is_given = |key: &str| {
            let is_wear = key == WEAR_STEP_TOLERANCE.name;
            let alternative = is_wear
                .then(|| self.given_value(WEAR_TOLERANCE.name))
                .flatten();
            self.given_value(key).or(alternative).is_some()
        };
        let numbers = changes.into_iter().filter_map(|change| {
            let key = &change.key;
            let is_of_accuracy = key.starts_with("fidelity.") || key == WEAR_STEP_TOLERANCE.name;
            let number = change.before.filter(Value::is_number)?;
            (is_of_accuracy && !is_given(key)).then(|| format!("{key}={number}"))
        });
        numbers.collect()
    }
}
