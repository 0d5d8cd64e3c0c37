//! The key of a stage: what its result depends on.

use super::commit::Commit;
use super::error::list;
use super::record::LAYOUT;
use crate::json::{as_read, differences, hash};
use crate::tables::TableName;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

/// The hash of all that a stage's tables depend on, and what went into it, so that a change can be explained.
///
/// No file times and no paths go in: equal inputs give equal keys on every machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageKey {
    hash: String,
    inputs: Value,
}

impl StageKey {
    /// The key of a stage from its name, the tables it writes, the parameters it reads and the keys of the stages whose results it
    /// reads. What another layout has is found under no key of this one.
    pub fn new(
        stage: &str,
        tables: &[TableName],
        parameters: &Value,
        upstream: &[&StageKey],
    ) -> StageKey {
        let tables: Vec<&str> = tables.iter().map(|table| table.as_str()).collect();
        let mut above = Map::new();
        for key in upstream {
            let stage = key.stage();
            let mut name = stage.to_owned();
            let mut count = 1;
            while above.contains_key(&name) {
                count += 1;
                name = format!("{stage} {count}");
            }
            above.insert(name, json!(key.hash));
        }
        let inputs = json!({
            "stage": stage,
            "layout": LAYOUT,
            "tables": tables,
            "parameters": parameters,
            "upstream": above,
        });
        StageKey {
            hash: hash(&inputs),
            inputs,
        }
    }

    /// The key of a committed state, for the stages that continue from it.
    pub fn of_commit(commit: &Commit) -> StageKey {
        StageKey {
            hash: commit.hash.clone(),
            inputs: json!({
                "stage": "commit",
                "wear_iteration": commit.wear_iteration,
            }),
        }
    }

    /// The hash, 64 hexadecimal digits.
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// The name of the stage.
    pub fn stage(&self) -> &str {
        self.inputs["stage"].as_str().unwrap_or_default()
    }

    /// What differs from the key of an earlier result, in words.
    pub(super) fn changes_from(&self, earlier: &StageKey) -> String {
        list(&differences(&earlier.inputs, &as_read(&self.inputs)))
    }
}
