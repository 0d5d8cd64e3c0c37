//! Tables as types: a field a column, generated from `schemas/*.toml` when the program is built (`schemas/build.rs`).
//!
//! A table of one row is a type of plain values, as [`StaticContact`]; another one has a vector a column, as [`ContactField`]. What
//! stands behind a name is in its schema.

use super::{Table, TableError};

/// A table whose columns are the fields of a type.
pub trait TypedTable: Sized {
    /// The table.
    const TABLE: TableName;

    /// The columns as a table.
    ///
    /// # Errors
    /// A [`TableError`] for columns of different lengths and for a float that is no number.
    fn to_table(&self) -> Result<Table, TableError>;

    /// The columns of a table.
    ///
    /// # Errors
    /// [`TableError::OtherTable`] for another table.
    fn of(table: &Table) -> Result<Self, TableError>;
}

include!(concat!(env!("OUT_DIR"), "/typed.rs"));
