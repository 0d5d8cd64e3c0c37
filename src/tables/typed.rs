//! Tables as types with one field per column, generated from `schemas/*.toml` when the program is built
//! (`schemas/build.rs`).
//!
//! A table of one row is a type of plain values, as [`StaticContact`]. Any other table has one vector per column, as
//! [`ContactField`]. The schema gives the meaning of each name.

use super::{Table, TableError};

/// Table whose columns are the fields of a type.
pub trait TypedTable: Sized {
    /// The name of the table.
    const TABLE: TableName;

    /// Converts the fields of the type to the columns of a table.
    ///
    /// # Errors
    /// A [`TableError`] for columns of different lengths and for a float that is not a number.
    fn to_table(&self) -> Result<Table, TableError>;

    /// Converts a table to a value of the type, whose fields are the columns of the table.
    ///
    /// # Errors
    /// [`TableError::OtherTable`] for another table.
    fn of(table: &Table) -> Result<Self, TableError>;
}

include!(concat!(env!("OUT_DIR"), "/typed.rs"));
