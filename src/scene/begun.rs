//! Settings that a run began with and that its scene does not give: the accuracy, whose defaults change between versions, and the wear
//! law, in scenes older than `wear.law`.

use std::path::Path;

use serde_json::Value;

use super::Scene;
use super::document::{Node, read_kept};
use super::keys::cycles::{COEFFICIENT, LAW, WEAR_STEP_TOLERANCE};
use super::keys::fidelity::{ASKED, PRESET, WEAR_TOLERANCE};
use crate::json::{as_read, differences};
use crate::units::has_force;

/// The wear law of stored scenes that do not give it and have to, as `key=value`: before `wear.law`, every coefficient was one per energy.
pub const LAW_BEGUN_WITH: &str = "wear.law=energy";

/// Whether a stored scene, with `sets`, has a wear coefficient whose unit is that of both laws, and gives no `wear.law`.
pub fn lacks_wear_law(text: &str, sets: &[String]) -> bool {
    read_kept(Path::new("scene.toml"), text, sets).is_ok_and(|tree| lacks_law(&tree))
}

/// As [`lacks_wear_law`], of the tree of a scene.
pub(super) fn lacks_law(tree: &Node) -> bool {
    tree.get(LAW.name).is_none() && tree.text(COEFFICIENT.name).is_some_and(has_force)
}

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
