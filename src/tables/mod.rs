//! The tables of a run: their schemas, their values in memory, and their Parquet files.
//!
//! `schemas/*.toml` is the one source of column names, types, units and encodings: the types of [`typed`] are generated from it. A
//! [`Table`] that breaks its schema cannot be built. A file says the unit of each column, in the column's field metadata and in a JSON
//! text under the key [`METADATA_KEY`] of the file, since some readers hide field metadata. What the columns mean stands once a run,
//! in its `schemas.json`, and in files that belong to no run.
//!
//! Arrow and Parquet are named in this folder only.

mod error;
mod foreign;
mod nullable;
mod parquet_file;
mod schema;
mod table;
pub mod typed;

pub use error::TableError;
pub use foreign::{codecs, declared_rows, decoded, unread_codec};
pub use nullable::{Described, Nullable};
pub use parquet_file::{
    METADATA_KEY, Provenance, columns_from_parquet, entry_of, from_parquet, nullable_from_parquet,
    nullable_to_parquet, provenance_of, to_parquet,
};
pub use schema::{ColumnSchema, ColumnType, Place, Schema};
pub use table::{Column, Table, TableBuilder};
pub use typed::{TableName, TypedTable};

/// Tables by name: those that a stage reads or writes.
pub type Tables = std::collections::BTreeMap<TableName, Table>;
