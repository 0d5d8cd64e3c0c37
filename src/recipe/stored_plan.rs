//! Content of `plan.json`.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::Recipe;

/// The recipe of a run and the warnings about its scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StoredPlan {
    /// Recipe from which the run is computed.
    pub recipe: Recipe,
    /// Warnings about the scene, issued before the run.
    pub warnings: Vec<String>,
}

impl StoredPlan {
    /// Parses the contents of a `plan.json` that `fretwear` wrote.
    ///
    /// # Errors
    /// Returns a text that names the wrong field. The field is missing, unknown, or has another form.
    pub fn of(value: &Value) -> Result<StoredPlan, String> {
        let plan = StoredPlan::deserialize(value).map_err(|error| error.to_string())?;
        let expected = serde_json::to_value(&plan).map_err(|error| error.to_string())?;
        match difference("", value, &expected) {
            None => Ok(plan),
            Some(difference) => Err(difference),
        }
    }
}

/// Returns a text about the first field with a difference between the `stored` and the `expected` value. The expected
/// value is the value that the program writes.
fn difference(at: &str, stored: &Value, expected: &Value) -> Option<String> {
    match (stored, expected) {
        (Value::Object(stored), Value::Object(expected)) => {
            let path = |key: &str| match at {
                "" => key.to_owned(),
                at => format!("{at}.{key}"),
            };
            let unknown = stored.keys().find(|key| !expected.contains_key(*key));
            if let Some(key) = unknown {
                return Some(format!("unknown field `{}`", path(key)));
            }
            expected
                .iter()
                .find_map(|(key, expected)| match stored.get(key) {
                    None => Some(format!("missing field `{}`", path(key))),
                    Some(stored) => difference(&path(key), stored, expected),
                })
        }
        (Value::Array(stored), Value::Array(expected)) if stored.len() == expected.len() => {
            let mut pairs = stored.iter().zip(expected).enumerate();
            pairs.find_map(|(k, (stored, expected))| {
                difference(&format!("{at}[{k}]"), stored, expected)
            })
        }
        _ if stored == expected => None,
        _ => Some(format!(
            "`{at}` is {stored}; this program would write {expected}"
        )),
    }
}
