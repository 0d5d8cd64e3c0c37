//! Columns with optional values: the common form of several tables, or of the tables of several runs.

use super::{Column, ColumnSchema, ColumnType};

/// Values of a column in which rows may have no value.
#[derive(Debug, Clone, PartialEq)]
pub enum Nullable {
    /// 32-bit integers.
    I32(Vec<Option<i32>>),
    /// 64-bit integers.
    I64(Vec<Option<i64>>),
    /// Floating-point values.
    F64(Vec<Option<f64>>),
    /// Flags.
    Bool(Vec<Option<bool>>),
    /// Texts.
    Text(Vec<Option<String>>),
}

macro_rules! each {
    ($self:expr, $values:ident => $result:expr) => {
        match $self {
            Nullable::I32($values) => $result,
            Nullable::I64($values) => $result,
            Nullable::F64($values) => $result,
            Nullable::Bool($values) => $result,
            Nullable::Text($values) => $result,
        }
    };
}

impl Nullable {
    /// Creates a column of a type in which all values are absent.
    pub fn absent(kind: ColumnType, rows: usize) -> Nullable {
        match kind {
            ColumnType::F64 | ColumnType::MaybeF64 => Nullable::F64(vec![None; rows]),
            ColumnType::I32 => Nullable::I32(vec![None; rows]),
            ColumnType::I64 => Nullable::I64(vec![None; rows]),
            ColumnType::Bool => Nullable::Bool(vec![None; rows]),
            ColumnType::Text => Nullable::Text(vec![None; rows]),
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        each!(self, values => values.len())
    }

    /// True without rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Truncates the column, or appends rows without a value.
    pub fn resize(&mut self, rows: usize) {
        each!(self, values => values.resize(rows, None));
    }

    /// Appends the rows of a column. Rows of another type are appended without values.
    pub fn append(&mut self, other: &Nullable) {
        match (&mut *self, other) {
            (Nullable::F64(values), Nullable::F64(own)) => values.extend(own),
            (Nullable::I32(values), Nullable::I32(own)) => values.extend(own),
            (Nullable::I64(values), Nullable::I64(own)) => values.extend(own),
            (Nullable::Bool(values), Nullable::Bool(own)) => values.extend(own),
            (Nullable::Text(values), Nullable::Text(own)) => values.extend(own.iter().cloned()),
            _ => self.resize(self.len() + other.len()),
        }
    }

    /// Appends the first value of a column of the same type. An empty column, or a column of another type, adds
    /// nothing.
    pub fn push(&mut self, column: &Column) {
        match (self, column) {
            (Nullable::F64(values), Column::F64(own)) => {
                values.extend(own.first().map(|v| Some(*v)))
            }
            (Nullable::F64(values), Column::MaybeF64(own)) => values.extend(own.first()),
            (Nullable::I32(values), Column::I32(own)) => {
                values.extend(own.first().map(|v| Some(*v)))
            }
            (Nullable::I64(values), Column::I64(own)) => {
                values.extend(own.first().map(|v| Some(*v)))
            }
            (Nullable::Bool(values), Column::Bool(own)) => {
                values.extend(own.first().map(|v| Some(*v)));
            }
            (Nullable::Text(values), Column::Text(own)) => {
                values.extend(own.first().map(|v| Some(v.clone())));
            }
            _ => (),
        }
    }

    /// Returns the value of a row as a column of one row, `None` if the row has no value.
    pub fn at(&self, row: usize) -> Option<Column> {
        Some(match self {
            Nullable::F64(values) => vec![(*values.get(row)?)?].into(),
            Nullable::I32(values) => vec![(*values.get(row)?)?].into(),
            Nullable::I64(values) => vec![(*values.get(row)?)?].into(),
            Nullable::Bool(values) => vec![(*values.get(row)?)?].into(),
            Nullable::Text(values) => vec![values.get(row)?.clone()?].into(),
        })
    }
}

/// Column with its schema.
pub type DescribedColumn<'a> = (&'a ColumnSchema, &'a Nullable);
