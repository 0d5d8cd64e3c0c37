//! Schemas: names and meanings of the columns of a table.

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
    /// 64-bit floating point, or no value in some rows.
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

/// Location of a table's file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TableLocation {
    /// In `once/` of a run.
    Once,
    /// In the folder of an iteration.
    Iteration,
    /// Outside of runs. A table outside of runs compares several runs.
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
    /// SI unit symbol, `"1"` for a dimensionless quantity.
    pub unit: String,
    /// The physical quantity, as `"length"`.
    pub dimension: String,
    /// The meaning of the column, with its sign convention.
    pub description: String,
    /// True if most values are zero. The column is then stored as PLAIN, because runs of zeros compress better than
    /// split bytes.
    #[serde(default)]
    pub sparse: bool,
    /// True if the column is absent in scenes without its physics.
    #[serde(default)]
    pub optional: bool,
    /// True if the values may be positive infinity, as a stiffness without compliance.
    #[serde(default)]
    pub infinite: bool,
}

impl ColumnSchema {
    /// Creates a column that belongs to no table of `schemas/`.
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

/// Columns of one table, as declared in one file of `schemas/`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Schema {
    /// Name of the table and stem of its file.
    pub name: String,
    /// The meaning of a row.
    pub description: String,
    /// The location of the file.
    pub place: TableLocation,
    /// When the table is written, and when it is absent.
    pub written: String,
    /// Number of rows of the table; `None` if the number of rows is not fixed.
    pub rows: Option<usize>,
    /// False if equal runs write different values. The hash chain of the commits then excludes the table.
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
    /// [`TableError::SchemaText`] for an invalid text, [`TableError::SchemaColumnTwice`] for a repeated column.
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

    /// Returns the schema of the column `name`, or `None` if the table has no such column.
    pub fn column(&self, name: &str) -> Option<&ColumnSchema> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// Returns the schema of the column `name`. The error for an unknown column lists the columns of the table.
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
    /// The schema of the table.
    pub fn schema(self) -> &'static Schema {
        &SCHEMAS[self as usize]
    }

    /// Returns the name of the table, which is also the stem of the name of the table's file.
    pub fn as_str(self) -> &'static str {
        &self.schema().name
    }

    /// Returns the table with the name `name`. Returns `None` if no table has the name `name`.
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
