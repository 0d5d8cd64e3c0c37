//! The accuracy that a run began with, where its scene does not say: defaults may differ from one version to the next.

use serde_json::Value;
use toml::Table;

use super::Scene;
use super::keys::fidelity::{ASKED, PRESET};
use crate::json::{as_read, differences};

impl Scene {
    /// Keys of accuracy that this scene does not give and that were others as a run began, as `key=value`; `text` is the document of the run, and `begun`
    /// what that led to, in canonical form. None where another preset or error is asked for now, which change many at once, on purpose.
    pub fn accuracy_begun_with(&self, text: &str, begun: &Value) -> Vec<String> {
        let Ok(before) = text.parse::<Table>() else {
            return Vec::new();
        };
        let given = |document: &Table, key: &str| {
            let (section, name) = key.split_once('.')?;
            document.get(section)?.get(name).cloned()
        };
        let now = self.document();
        let together = [PRESET.name, ASKED.name];
        if together.map(|key| given(&before, key)) != together.map(|key| given(now, key)) {
            return Vec::new();
        }
        let changes = differences(begun, &as_read(&self.canonical()));
        let numbers = changes.into_iter().filter_map(|change| {
            let is_of_accuracy =
                change.key.starts_with("fidelity.") || change.key == "wear.tolerance";
            let is_given = given(now, &change.key).is_some();
            let number = change.before.filter(Value::is_number)?;
            (is_of_accuracy && !is_given).then(|| format!("{}={number}", change.key))
        });
        numbers.collect()
    }
}
