//! The table of a campaign (`campaign.parquet`): one row per run.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::definition::MOST_ROWS;
use crate::tables::{
    ColumnSchema, ColumnType, Nullable, TableError, nullable_from_parquet, nullable_to_parquet,
};

/// Name of the table in errors.
const NAME: &str = "campaign";
const INDEX: &str = "index";
const CONTENT_KEY: &str = "content_key";
const SETTINGS: &str = "settings";
const GROUP: &str = "group";
const SECONDS: &str = "expected_seconds";
const MEMORY: &str = "memory";

/// Resolved value of a key, in SI units.
#[derive(Debug, Clone, PartialEq)]
pub enum ResolvedValue {
    /// The scene has no value for the key.
    Absent,
    /// A whole number.
    Whole(i64),
    /// A number.
    Number(f64),
    /// A word, a list, or any other value.
    Text(String),
}

impl ResolvedValue {
    /// Converts a value of a resolved scene. A list of equal numbers becomes one number, for example a length along
    /// both axes.
    pub fn of(value: &Value) -> ResolvedValue {
        match value {
            Value::Null => ResolvedValue::Absent,
            Value::Number(number) => match (number.as_i64(), number.as_f64()) {
                (Some(whole), _) => ResolvedValue::Whole(whole),
                (None, Some(number)) => ResolvedValue::Number(number),
                (None, None) => ResolvedValue::Text(number.to_string()),
            },
            Value::String(text) => ResolvedValue::Text(text.clone()),
            Value::Array(items) => match &items[..] {
                [first, others @ ..] if first.is_number() && others.iter().all(|o| o == first) => {
                    ResolvedValue::of(first)
                }
                // Resolve a motion along the first axis, with 0 in the other components, to the number of the first
                // component.
                [first, others @ ..]
                    if first.is_number() && others.iter().all(|o| o.as_f64() == Some(0.0)) =>
                {
                    ResolvedValue::of(first)
                }
                _ => ResolvedValue::Text(value.to_string()),
            },
            other => ResolvedValue::Text(other.to_string()),
        }
    }

    /// Returns the number, if the value is a number.
    pub fn number(&self) -> Option<f64> {
        match self {
            ResolvedValue::Whole(whole) => Some(*whole as f64),
            ResolvedValue::Number(number) => Some(*number),
            ResolvedValue::Absent | ResolvedValue::Text(_) => None,
        }
    }

    /// Returns the value as a text, which is empty for an absent value.
    pub fn text(&self) -> String {
        match self {
            ResolvedValue::Absent => String::new(),
            ResolvedValue::Whole(whole) => whole.to_string(),
            ResolvedValue::Number(number) => number.to_string(),
            ResolvedValue::Text(text) => text.clone(),
        }
    }
}

/// A planned run: one row of the campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedRun {
    /// Settings `key=value`, as arguments of `--set`.
    pub settings: Vec<String>,
    /// Values of the varying keys, in the order of [`Campaign::keys`].
    pub values: Vec<ResolvedValue>,
    /// Hash of the resolved scene and of the content of its files. Rows with the same hash are the same run.
    pub content_key: String,
    /// Group of rows with about the same cost.
    pub group: i64,
    /// Expected time on the planning machine with one thread, without the structure \[s\]. `seconds` is `None` if no
    /// rehearsal has estimated the time.
    pub seconds: Option<f64>,
    /// Estimated peak memory, with the structure in the cache \[B\].
    pub memory: i64,
}

/// A key that varies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyColumn {
    /// Name of the key and of its column.
    pub name: String,
}

/// Rows of a campaign, in the order of their indices.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Campaign {
    /// Keys that vary.
    pub keys: Vec<KeyColumn>,
    /// The rows.
    pub rows: Vec<PlannedRun>,
}

impl Campaign {
    /// Returns the columns of the keys for some rows, each with its schema.
    pub(super) fn key_columns(&self, rows: &[usize]) -> Vec<(ColumnSchema, Nullable)> {
        let keys = self.keys.iter().enumerate();
        keys.map(|(k, key)| {
            let values = || rows.iter().map(|row| &self.rows[*row].values[k]);
            let values_of_all = || self.rows.iter().map(|row| &row.values[k]);
            // The type follows from all rows, so that every file of a campaign has the same types.
            let is_text = values_of_all().any(|value| matches!(value, ResolvedValue::Text(_)));
            let is_whole = !values_of_all().any(|value| matches!(value, ResolvedValue::Number(_)));
            let whole = |value: &ResolvedValue| match value {
                ResolvedValue::Whole(whole) => Some(*whole),
                _ => None,
            };
            let (kind, values) = if is_text {
                let text =
                    |value: &ResolvedValue| Some(value.text()).filter(|text| !text.is_empty());
                (
                    ColumnType::Text,
                    Nullable::Text(values().map(text).collect()),
                )
            } else if is_whole {
                (
                    ColumnType::I64,
                    Nullable::I64(values().map(whole).collect()),
                )
            } else {
                let numbers = values().map(ResolvedValue::number).collect();
                (ColumnType::F64, Nullable::F64(numbers))
            };
            (ColumnSchema::plain(&key.name, kind, "SI"), values)
        })
        .collect()
    }

    /// Returns the bytes of the file.
    pub(super) fn to_bytes(&self) -> Result<Vec<u8>, TableError> {
        let all: Vec<usize> = (0..self.rows.len()).collect();
        let plain = |name, kind, unit| ColumnSchema::plain(name, kind, unit);
        let rows = || self.rows.iter();
        let settings = |row: &PlannedRun| Some(json!(row.settings).to_string());
        let mut columns = vec![
            (
                plain(INDEX, ColumnType::I64, "1"),
                Nullable::I64(all.iter().map(|k| Some(*k as i64)).collect()),
            ),
            (
                plain(CONTENT_KEY, ColumnType::Text, "1"),
                Nullable::Text(rows().map(|row| Some(row.content_key.clone())).collect()),
            ),
            (
                plain(SETTINGS, ColumnType::Text, "1"),
                Nullable::Text(rows().map(settings).collect()),
            ),
            (
                plain(GROUP, ColumnType::I64, "1"),
                Nullable::I64(rows().map(|row| Some(row.group)).collect()),
            ),
            (
                plain(SECONDS, ColumnType::F64, "s"),
                Nullable::F64(rows().map(|row| row.seconds).collect()),
            ),
            (
                plain(MEMORY, ColumnType::I64, "B"),
                Nullable::I64(rows().map(|row| Some(row.memory)).collect()),
            ),
        ];
        columns.extend(self.key_columns(&all));
        let described: Vec<_> = columns
            .iter()
            .map(|(column, values)| (column, values))
            .collect();
        let units: BTreeMap<&str, Value> = described
            .iter()
            .map(|(column, _)| (column.name.as_str(), json!({ "unit": column.unit })))
            .collect();
        let entry = json!({
            "schema": NAME,
            "program_version": env!("CARGO_PKG_VERSION"),
            "columns": units,
        });
        nullable_to_parquet(NAME, &described, entry.to_string())
    }

    /// Returns the hash of the content keys of some rows.
    pub(super) fn content_hash(&self, rows: impl Iterator<Item = usize>) -> String {
        let mut hasher = blake3::Hasher::new();
        for row in rows {
            hasher.update(self.rows[row].content_key.as_bytes());
            hasher.update(b"\n");
        }
        hasher.finalize().to_hex().to_string()
    }

    /// Reads the rows from the bytes of the file.
    ///
    /// # Errors
    /// A sentence that says what is wrong with the file.
    pub(super) fn of_bytes(bytes: &[u8]) -> Result<Campaign, String> {
        let most = MOST_ROWS as i64;
        let file_columns = nullable_from_parquet(bytes, NAME, most).map_err(|e| e.to_string())?;
        let names: Vec<String> = file_columns.iter().map(|(name, _)| name.clone()).collect();
        let mut columns: BTreeMap<String, Nullable> = file_columns.into_iter().collect();
        let row_index = [INDEX, CONTENT_KEY, SETTINGS, GROUP, SECONDS, MEMORY];
        let fixed_columns = row_index.map(|name| columns.remove(name));
        let [
            Some(Nullable::I64(index)),
            Some(Nullable::Text(content_keys)),
            Some(Nullable::Text(settings)),
            Some(Nullable::I64(groups)),
            Some(Nullable::F64(seconds)),
            Some(Nullable::I64(memory)),
        ] = fixed_columns
        else {
            return Err("it is not the table of a campaign".to_owned());
        };
        let keys: Vec<String> = names
            .into_iter()
            .filter(|n| columns.contains_key(n))
            .collect();
        if index.is_empty() {
            return Err("it has no row".to_owned());
        }
        let mut rows = Vec::with_capacity(index.len());
        for k in 0..index.len() {
            let sets = settings[k].as_deref().map(serde_json::from_str);
            let (Some(row_index), Some(content_key), Some(Ok(settings)), Some(group), Some(memory)) = (
                index[k],
                content_keys[k].clone(),
                sets,
                groups[k],
                memory[k],
            ) else {
                return Err(format!("row {k} is incomplete"));
            };
            if row_index != k as i64 {
                return Err(format!("row {k} has another index"));
            }
            let value = |key: &String| match &columns[key] {
                Nullable::I64(values) => values[k].map(ResolvedValue::Whole),
                Nullable::F64(values) => values[k].map(ResolvedValue::Number),
                Nullable::Text(values) => values[k].clone().map(ResolvedValue::Text),
                Nullable::I32(_) | Nullable::Bool(_) => None,
            };
            let values: Vec<ResolvedValue> = keys
                .iter()
                .map(|key| value(key).unwrap_or(ResolvedValue::Absent))
                .collect();
            let numbers = keys.iter().zip(values.iter().map(ResolvedValue::number));
            for (key, number) in numbers {
                if let Some(number) = number.filter(|number| !number.is_finite()) {
                    return Err(format!(
                        "{key} of row {k} is {number}; values must be finite"
                    ));
                }
            }
            rows.push(PlannedRun {
                settings,
                values,
                content_key,
                group,
                seconds: seconds[k],
                memory,
            });
        }
        let keys = keys.into_iter().map(|name| KeyColumn { name }).collect();
        Ok(Campaign { keys, rows })
    }
}
