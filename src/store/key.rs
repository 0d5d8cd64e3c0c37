//! Key of a stage: all inputs that determine its result.

use super::commit::Commit;
use super::error::list;
use super::record::LAYOUT;
use crate::json::{as_read, differences, hash};
use crate::tables::TableName;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

/// Hash of all inputs of the tables of a stage. The key stores the inputs next to the hash, so that the program can
/// explain a changed hash.
///
/// The inputs contain no file times and no paths: equal inputs give equal keys on every machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageKey {
    hash: String,
    inputs: Value,
}

impl StageKey {
    /// Builds the key of a stage from the name, the written tables and the parameters of the stage. The keys of the
    /// stages whose results the stage reads are also inputs. The layout number is an input of every key, so the program
    /// never finds results of another layout.
    pub fn new(
        stage: &str,
        tables: &[TableName],
        parameters: &Value,
        upstream: &[&StageKey],
    ) -> StageKey {
        let tables: Vec<&str> = tables.iter().map(|table| table.as_str()).collect();
        let mut upstream_hashes = Map::new();
        for key in upstream {
            let stage = key.stage();
            let mut name = stage.to_owned();
            let mut count = 1;
            while upstream_hashes.contains_key(&name) {
                count += 1;
                name = format!("{stage} {count}");
            }
            upstream_hashes.insert(name, json!(key.hash));
        }
        let inputs = json!({
            "stage": stage,
            "layout": LAYOUT,
            "tables": tables,
            "parameters": parameters,
            "upstream": upstream_hashes,
        });
        StageKey {
            hash: hash(&inputs),
            inputs,
        }
    }

    /// Returns the key of a committed state, for the stages that continue from it.
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

    /// Describes the differences from the key of an earlier result.
    pub(super) fn changes_from(&self, earlier: &StageKey) -> String {
        list(&differences(&earlier.inputs, &as_read(&self.inputs)))
    }
}
