//! The tables of a run: their schemas, their values in memory, and their Parquet files.
//!
//! `schemas/*.toml` is the one source of column names, types, units and encodings: the types of [`typed`] are generated from it. A
//! [`Table`] that breaks its schema cannot be built, and a file carries the schema with it, in each column's field metadata and as one JSON text under the key
//! [`METADATA_KEY`] of the file, since some readers hide field metadata.
//!
//! Arrow and Parquet are named in this folder only.

mod error;
mod foreign;
mod parquet_file;
mod schema;
mod table;
pub mod typed;

pub use error::TableError;
pub use foreign::{announced_rows, codecs, decoded, unread_codec};
pub use parquet_file::{
    METADATA_KEY, Nullable, Provenance, from_parquet, nullable_to_parquet, provenance_of,
    to_parquet,
};
pub use schema::{ColumnSchema, ColumnType, Place, Schema};
pub use table::{Column, Table, TableBuilder};
pub use typed::{TableName, TypedTable};
