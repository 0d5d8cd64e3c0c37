//! Content of `plan.json`.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::Recipe;

/// The recipe of a run and the warnings about its scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StoredPlan {
    /// All that the run is computed from.
    pub recipe: Recipe,
    /// Warnings about the scene, from before the run.
    pub warnings: Vec<String>,
}

impl StoredPlan {
    /// Parses a `plan.json` that this program wrote.
    ///
    /// # Errors
    /// The field that is missing, unknown, or written in another form.
    pub fn of(value: &Value) -> Result<StoredPlan, String> {
        let plan = StoredPlan::deserialize(value).map_err(|error| error.to_string())?;
        let written = serde_json::to_value(&plan).map_err(|error| error.to_string())?;
        match difference("", value, &written) {
            None => Ok(plan),
            Some(difference) => Err(difference),
        }
    }
}

/// The first field, in words, in which a value differs from what the program writes of it.
fn difference(at: &str, found: &Value, written: &Value) -> Option<String> {
    match (found, written) {
        (Value::Object(found), Value::Object(written)) => {
            let path = |key: &str| match at {
                "" => key.to_owned(),
                at => format!("{at}.{key}"),
            };
            let unknown = found.keys().find(|key| !written.contains_key(*key));
            if let Some(key) = unknown {
                return Some(format!("unknown field `{}`", path(key)));
            }
            written
                .iter()
                .find_map(|(key, written)| match found.get(key) {
                    None => Some(format!("missing field `{}`", path(key))),
                    Some(found) => difference(&path(key), found, written),
                })
        }
        (Value::Array(found), Value::Array(written)) if found.len() == written.len() => {
            let mut pairs = found.iter().zip(written).enumerate();
            pairs
                .find_map(|(k, (found, written))| difference(&format!("{at}[{k}]"), found, written))
        }
        _ if found == written => None,
        _ => Some(format!(
            "`{at}` is {found}; this program would write {written}"
        )),
    }
}
