//! Tables of a run: schemas of the tables, values in memory, and Parquet files.
//!
//! `schemas/*.toml` is the only source of column names, types, units and encodings. The build generates the types of
//! [`typed`] from the files `schemas/*.toml`. [`TableBuilder`] rejects columns that violate the schema of the table. A
//! file states the unit of each column in the metadata of the column's field. Because some readers hide field metadata,
//! a JSON text under [`METADATA_KEY`] states the units again. fretwear stores the meaning of the columns once per run,
//! in the file `schemas.json`. A file outside of runs contains the meaning of its columns.
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

/// Map from the names of tables to the tables, such as all tables that a stage reads or writes.
pub type Tables = std::collections::BTreeMap<TableName, Table>;
