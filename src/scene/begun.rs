//! The accuracy that a run began with, where its scene does not give it: defaults change between versions.

use serde_json::Value;

use super::Scene;
use super::keys::cycles::WEAR_STEP_TOLERANCE;
use super::keys::fidelity::{ASKED, PRESET, WEAR_TOLERANCE};
use crate::json::{as_read, differences};

impl Scene {
    /// Keys of accuracy that this scene does not give and that were others as a run began, as `key=value`; `begun` is what its scene led to then, in
    /// canonical form. None where another preset or error is asked for now, which change many at once, on purpose.
    pub fn accuracy_begun_with(&self, begun: &Value) -> Vec<String> {
        let changes = differences(begun, &as_read(&self.canonical()));
        let together = [PRESET.name, ASKED.name];
        if changes
            .iter()
            .any(|change| together.contains(&&*change.key))
        {
            return Vec::new();
        }
        let is_given = |key: &str| {
            let is_wear = key == WEAR_STEP_TOLERANCE.name;
            let also = is_wear.then(|| self.given(WEAR_TOLERANCE.name)).flatten();
            self.given(key).or(also).is_some()
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
