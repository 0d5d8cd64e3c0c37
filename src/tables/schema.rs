//! Schemas: what a table's columns are called and mean.

use super::{TableError, TableName};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::sync::LazyLock;

/// Type of a column's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ColumnType {
    /// 64-bit floating point.
    F64,
    /// 64-bit floating point, or nothing in a row that has no such value.
    #[serde(rename = "f64?")]
    MaybeF64,
    /// 32-bit signed integer.
    I32,
    /// 64-bit signed integer.
    I64,
    /// True or false.
    Bool,
    /// UTF-8 text.
    Text,
}

impl fmt::Display for ColumnType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ColumnType::F64 => "f64",
            ColumnType::MaybeF64 => "f64?",
            ColumnType::I32 => "i32",
            ColumnType::I64 => "i64",
            ColumnType::Bool => "bool",
            ColumnType::Text => "text",
        })
    }
}

/// Where the file of a table is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Place {
    /// In `once/` of a run.
    Once,
    /// In the folder of an iteration.
    Iteration,
    /// Beside runs, of which it compares several.
    Beside,
}

/// One column of a [`Schema`].
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ColumnSchema {
    /// Name.
    pub name: String,
    /// Type of the values.
    #[serde(rename = "type")]
    pub kind: ColumnType,
    /// SI symbol, `"1"` where there is none.
    pub unit: String,
    /// The quantity, as `"length"`.
    pub dimension: String,
    /// What the column means, with its sign convention.
    pub description: String,
    /// Mostly zero: stored plainly, since runs of zeros compress better than split bytes.
    #[serde(default)]
    pub sparse: bool,
    /// No column where the scene lacks the physics.
    #[serde(default)]
    pub optional: bool,
    /// May be positive infinity, as a stiffness without compliance.
    #[serde(default)]
    pub infinite: bool,
}

impl ColumnSchema {
    /// A column of no table of `schemas/`.
    pub fn plain(name: &str, kind: ColumnType, unit: &str) -> ColumnSchema {
        ColumnSchema {
            name: name.to_owned(),
            kind,
            unit: unit.to_owned(),
            dimension: String::new(),
            description: String::new(),
            sparse: false,
            optional: false,
            infinite: false,
        }
    }
}

/// The columns of one table, as one file of `schemas/` gives them.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Schema {
    /// Name of the table and stem of its file.
    pub name: String,
    /// What a row is.
    pub description: String,
    /// Where its file is.
    pub place: Place,
    /// When it is written, and when there is none.
    pub written: String,
    /// Number of rows, where it is always the same.
    pub rows: Option<usize>,
    /// False where equal runs write different values: the table then stays out of the hash chain of the commits.
    #[serde(default = "yes")]
    pub chained: bool,
    /// The columns, in the order of the file.
    #[serde(rename(deserialize = "column"))]
    pub columns: Vec<ColumnSchema>,
}

fn yes() -> bool {
    true
}

impl Schema {
    /// Reads a schema from the text of its TOML file.
    ///
    /// # Errors
    /// [`TableError::SchemaText`] for a text of another form, [`TableError::SchemaColumnTwice`] for a repeated column.
    pub fn parse(text: &str) -> Result<Schema, TableError> {
        let schema: Schema = toml::from_str(text)?;
        for (position, column) in schema.columns.iter().enumerate() {
            if schema.columns[..position]
                .iter()
                .any(|earlier| earlier.name == column.name)
            {
                return Err(TableError::SchemaColumnTwice {
                    table: schema.name.clone(),
                    column: column.name.clone(),
                });
            }
        }
        Ok(schema)
    }

    /// The column of a name.
    pub fn column(&self, name: &str) -> Option<&ColumnSchema> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// The column of a name, or the error that lists what there is.
    pub(super) fn require(&self, name: &str) -> Result<&ColumnSchema, TableError> {
        self.column(name).ok_or_else(|| TableError::UnknownColumn {
            table: self.name.clone(),
            column: name.to_owned(),
            known: self
                .columns
                .iter()
                .map(|column| column.name.as_str())
                .collect::<Vec<_>>()
                .join(", "),
        })
    }
}

/// The embedded schema files, parsed once, in the order of [`TableName::ALL`].
static SCHEMAS: LazyLock<Vec<Schema>> = LazyLock::new(|| {
    TableName::ALL
        .iter()
        .map(|table| Schema::parse(table.source()).expect("the schemas built in are valid"))
        .collect()
});

impl TableName {
    /// The schema.
    pub fn schema(self) -> &'static Schema {
        &SCHEMAS[self as usize]
    }

    /// The name, which is also the stem of the file.
    pub fn as_str(self) -> &'static str {
        &self.schema().name
    }

    /// The table of a name.
    pub fn from_name(name: &str) -> Option<TableName> {
        TableName::ALL
            .into_iter()
            .find(|table| table.as_str() == name)
    }

    /// Name of the table's file.
    pub fn file_name(self) -> String {
        format!("{}.parquet", self.as_str())
    }
}

impl fmt::Display for TableName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
