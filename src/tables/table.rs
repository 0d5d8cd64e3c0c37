//! Tables in memory.

use super::{ColumnSchema, ColumnType, Schema, TableError, TableName};

/// The values of one column.
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Floating-point values.
    F64(Vec<f64>),
    /// Floating-point values, absent in some rows.
    MaybeF64(Vec<Option<f64>>),
    /// 32-bit integers.
    I32(Vec<i32>),
    /// 64-bit integers.
    I64(Vec<i64>),
    /// Flags.
    Bool(Vec<bool>),
    /// Texts.
    Text(Vec<String>),
}

impl Column {
    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Column::F64(values) => values.len(),
            Column::MaybeF64(values) => values.len(),
            Column::I32(values) => values.len(),
            Column::I64(values) => values.len(),
            Column::Bool(values) => values.len(),
            Column::Text(values) => values.len(),
        }
    }

    /// True without values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Type of the values.
    pub fn kind(&self) -> ColumnType {
        match self {
            Column::F64(_) => ColumnType::F64,
            Column::MaybeF64(_) => ColumnType::MaybeF64,
            Column::I32(_) => ColumnType::I32,
            Column::I64(_) => ColumnType::I64,
            Column::Bool(_) => ColumnType::Bool,
            Column::Text(_) => ColumnType::Text,
        }
    }
}

macro_rules! conversions {
    ($($variant:ident $value:ty),*) => {$(
        impl From<Vec<$value>> for Column {
            fn from(values: Vec<$value>) -> Self {
                Column::$variant(values)
            }
        }
    )*};
}
conversions!(F64 f64, MaybeF64 Option<f64>, I32 i32, I64 i64, Bool bool, Text String);

/// Table that matches a schema. The columns have the names, types and lengths that the schema requires. All required
/// columns exist, and no float is NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    schema: &'static Schema,
    /// One entry per column of the schema, in its order; `None` for an omitted optional column.
    columns: Vec<Option<Column>>,
    rows: usize,
}

impl Table {
    /// Returns a builder for the table `table`, with the schema in the running version of fretwear.
    pub fn builder(table: TableName) -> TableBuilder {
        TableBuilder::of(table.schema())
    }

    /// The schema of the table.
    pub fn schema(&self) -> &'static Schema {
        self.schema
    }

    /// Rejects a table with another name.
    pub(super) fn require(&self, table: TableName) -> Result<(), TableError> {
        if self.schema == table.schema() {
            return Ok(());
        }
        Err(TableError::OtherTable {
            found: self.schema.name.clone(),
            expected: table.as_str().to_owned(),
        })
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns each existing column with the schema of the column, in the order of the Parquet file.
    pub fn columns(&self) -> impl Iterator<Item = (&'static ColumnSchema, &Column)> {
        self.schema
            .columns
            .iter()
            .zip(&self.columns)
            .filter_map(|(schema, column)| column.as_ref().map(|column| (schema, column)))
    }

    /// True if the column exists.
    pub fn has(&self, name: &str) -> bool {
        self.columns().any(|(schema, _)| schema.name == name)
    }

    /// Returns the column `name` of the table.
    ///
    /// # Errors
    /// [`TableError::UnknownColumn`] for a name that the schema lacks, [`TableError::MissingColumn`] for an omitted
    /// optional column.
    pub fn column(&self, name: &str) -> Result<&Column, TableError> {
        self.schema.require(name)?;
        self.columns()
            .find(|(schema, _)| schema.name == name)
            .map(|(_, column)| column)
            .ok_or_else(|| TableError::MissingColumn {
                table: self.schema.name.clone(),
                column: name.to_owned(),
            })
    }

    /// The values of a column of floats.
    ///
    /// # Errors
    /// Errors of [`Table::column`], and [`TableError::ColumnType`] for a column of another type.
    pub fn f64(&self, name: &str) -> Result<&[f64], TableError> {
        match self.column(name)? {
            Column::F64(values) => Ok(values),
            other => Err(self.wrong_type(name, other, ColumnType::F64)),
        }
    }

    /// The values of a column of floats that may be absent in some rows. Errors as for [`Table::f64`].
    pub fn maybe_f64(&self, name: &str) -> Result<&[Option<f64>], TableError> {
        match self.column(name)? {
            Column::MaybeF64(values) => Ok(values),
            other => Err(self.wrong_type(name, other, ColumnType::MaybeF64)),
        }
    }

    /// The values of a column of 32-bit integers. Errors as for [`Table::f64`].
    pub fn i32(&self, name: &str) -> Result<&[i32], TableError> {
        match self.column(name)? {
            Column::I32(values) => Ok(values),
            other => Err(self.wrong_type(name, other, ColumnType::I32)),
        }
    }

    /// The values of a column of 64-bit integers. Errors as for [`Table::f64`].
    pub fn i64(&self, name: &str) -> Result<&[i64], TableError> {
        match self.column(name)? {
            Column::I64(values) => Ok(values),
            other => Err(self.wrong_type(name, other, ColumnType::I64)),
        }
    }

    /// The values of a column of flags. Errors as for [`Table::f64`].
    pub fn bool(&self, name: &str) -> Result<&[bool], TableError> {
        match self.column(name)? {
            Column::Bool(values) => Ok(values),
            other => Err(self.wrong_type(name, other, ColumnType::Bool)),
        }
    }

    /// The values of a column of texts. Errors as for [`Table::f64`].
    pub fn text(&self, name: &str) -> Result<&[String], TableError> {
        match self.column(name)? {
            Column::Text(values) => Ok(values),
            other => Err(self.wrong_type(name, other, ColumnType::Text)),
        }
    }

    fn wrong_type(&self, name: &str, found: &Column, asked: ColumnType) -> TableError {
        TableError::ColumnType {
            table: self.schema.name.clone(),
            column: name.to_owned(),
            found: format!("asked for as {asked}"),
            expected: found.kind().to_string(),
        }
    }
}

/// Collects the columns of a [`Table`]. [`TableBuilder::build`] checks the columns against the schema of the table.
#[derive(Debug)]
pub struct TableBuilder {
    schema: &'static Schema,
    given: Vec<(String, Column)>,
}

impl TableBuilder {
    /// Begins a table with any schema.
    pub fn of(schema: &'static Schema) -> Self {
        TableBuilder {
            schema,
            given: Vec::new(),
        }
    }

    /// Adds a column, in any order.
    pub fn column(mut self, name: &str, values: impl Into<Column>) -> Self {
        self.given.push((name.to_owned(), values.into()));
        self
    }

    /// Adds an optional column if `values` is given.
    pub fn optional_column(self, name: &str, values: Option<impl Into<Column>>) -> Self {
        match values {
            Some(values) => self.column(name, values),
            None => self,
        }
    }

    /// Checks the columns and builds the table.
    ///
    /// # Errors
    /// Returns a [`TableError`] for a column that is unknown, duplicate or missing, or that has a wrong type or length.
    /// Returns a [`TableError`] for NaN, and for an infinite float unless the schema allows infinite floats. A
    /// [`TableError`] names the table, the column, the row and the value.
    pub fn build(self) -> Result<Table, TableError> {
        let TableBuilder { schema, given } = self;
        let table = || schema.name.clone();
        let mut columns: Vec<Option<Column>> = vec![None; schema.columns.len()];
        let rows = given.first().map_or(0, |(_, column)| column.len());
        for (name, column) in given {
            let described = schema.require(&name)?;
            if column.kind() != described.kind {
                return Err(TableError::ColumnType {
                    table: table(),
                    column: name,
                    found: column.kind().to_string(),
                    expected: described.kind.to_string(),
                });
            }
            if column.len() != rows {
                return Err(TableError::Length {
                    table: table(),
                    column: name,
                    found: column.len(),
                    expected: rows,
                });
            }
            match &column {
                Column::F64(values) => {
                    numbers_only(&schema.name, described, values.iter().copied().map(Some))?;
                }
                Column::MaybeF64(values) => {
                    numbers_only(&schema.name, described, values.iter().copied())?;
                }
                _ => {}
            }
            let place = schema
                .columns
                .iter()
                .zip(&mut columns)
                .find_map(|(other, place)| (other.name == name).then_some(place));
            if let Some(place) = place
                && place.replace(column).is_some()
            {
                return Err(TableError::ColumnTwice {
                    table: table(),
                    column: name,
                });
            }
        }
        for (described, column) in schema.columns.iter().zip(&columns) {
            if column.is_none() && !described.optional {
                return Err(TableError::MissingColumn {
                    table: table(),
                    column: described.name.clone(),
                });
            }
        }
        if let Some(expected) = schema.rows
            && rows != expected
        {
            return Err(TableError::Rows {
                table: table(),
                found: rows,
                expected,
            });
        }
        Ok(Table {
            schema,
            columns,
            rows,
        })
    }
}

fn numbers_only(
    table: &str,
    column: &ColumnSchema,
    mut values: impl Iterator<Item = Option<f64>>,
) -> Result<(), TableError> {
    let allowed = |value: f64| value.is_finite() || (column.infinite && value == f64::INFINITY);
    let mut row = 0;
    let wrong = values.find_map(|value| {
        row += 1;
        value.filter(|value| !allowed(*value))
    });
    match wrong {
        None => Ok(()),
        Some(value) => Err(TableError::NotFinite {
            table: table.to_owned(),
            column: column.name.clone(),
            row: row - 1,
            value,
            expected: if column.infinite {
                "a finite number or positive infinity"
            } else {
                "a finite number"
            },
        }),
    }
}
