//! The tables of a run: their schemas, their values in memory, and their Parquet files.
//!
//! `schemas/*.toml` is the only source of column names, types, units and encodings. The types of [`typed`] are
//! generated from it. A [`Table`] that violates its schema cannot be built. A file states the unit of each column
//! twice: in the metadata of the column's field, and in a JSON text under [`METADATA_KEY`], because some readers hide
//! field metadata. The meaning of the columns is stored once per run, in its `schemas.json`, and in each file that
//! belongs to no run.
//!
//! Only the module `tables` uses Arrow and Parquet.

mod error;
mod foreign;
mod nullable;
mod parquet_file;
mod schema;
mod table;
pub mod typed;

pub use error::TableError;
pub use foreign::{catching_panics, codecs, declared_rows, unread_codec};
pub use nullable::{DescribedColumn, Nullable};
pub use parquet_file::{
    METADATA_KEY, Provenance, columns_from_parquet, from_parquet, metadata_entry,
    nullable_from_parquet, nullable_to_parquet, provenance_of, to_parquet,
};
pub use schema::{ColumnSchema, ColumnType, Schema, TableLocation};
pub use table::{Column, Table, TableBuilder};
pub use typed::{TableName, TypedTable};

/// Tables by name, such as the tables that a stage reads or writes.
pub type Tables = std::collections::BTreeMap<TableName, Table>;
