//! Errors of a table and of the Parquet file of a table.

/// Error of a table that violates its schema, or of a file without the expected table.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// A schema text that cannot be parsed.
    #[error("the schema text is not valid: {0}")]
    SchemaText(#[from] toml::de::Error),
    /// A schema that gives one column twice.
    #[error("the schema `{table}` gives the column `{column}` twice")]
    SchemaColumnTwice {
        /// Name of the table.
        table: String,
        /// Name of the column.
        column: String,
    },
    /// A column that the schema does not have.
    #[error("the table `{table}` has no column `{column}`; it may have {known}")]
    UnknownColumn {
        /// Name of the table.
        table: String,
        /// The given name.
        column: String,
        /// The columns of the schema.
        known: String,
    },
    /// A column that this table omits or lacks.
    #[error("the table `{table}` lacks the column `{column}`")]
    MissingColumn {
        /// Name of the table.
        table: String,
        /// Name of the column.
        column: String,
    },
    /// A column that was given twice.
    #[error("the column `{column}` of the table `{table}` was given twice")]
    ColumnTwice {
        /// Name of the table.
        table: String,
        /// Name of the column.
        column: String,
    },
    /// A column whose type differs from the schema.
    #[error("the column `{column}` of the table `{table}` is {found}; its schema says {expected}")]
    ColumnType {
        /// Name of the table.
        table: String,
        /// Name of the column.
        column: String,
        /// Actual type.
        found: String,
        /// Type in the schema.
        expected: String,
    },
    /// Columns of different lengths.
    #[error(
        "the column `{column}` of the table `{table}` has {found} rows; the others have {expected}"
    )]
    Length {
        /// Name of the table.
        table: String,
        /// Name of the column.
        column: String,
        /// Rows of this column.
        found: usize,
        /// Rows of the first column.
        expected: usize,
    },
    /// A number of rows that differs from the schema.
    #[error("the table `{table}` has {found} rows; it must have {expected}")]
    Rows {
        /// Name of the table.
        table: String,
        /// Actual number of rows.
        found: usize,
        /// Number of rows in the schema.
        expected: usize,
    },
    /// A Parquet file with more rows than a table may have.
    #[error("the file of the table `{table}` has {found} rows; it may have at most {limit}")]
    TooManyRows {
        /// Name of the table.
        table: String,
        /// Rows that the file declares or contains.
        found: i64,
        /// Most rows.
        limit: i64,
    },
    /// A file with an unsupported compression.
    #[error("the file of the table `{table}` is compressed as {found}; read are {read}")]
    Codec {
        /// Name of the table.
        table: String,
        /// The compression.
        found: String,
        /// The supported compressions.
        read: String,
    },
    /// A value that is not a finite number.
    #[error(
        "row {row} of the column `{column}` of the table `{table}` is {value}; it must be {expected}"
    )]
    NotFinite {
        /// Name of the table.
        table: String,
        /// Name of the column.
        column: String,
        /// The row, counted from 0.
        row: usize,
        /// The value found.
        value: f64,
        /// The values that the schema allows.
        expected: &'static str,
    },
    /// A Parquet column with null values, although the schema of the column allows no null values.
    #[error(
        "the column `{column}` of the table `{table}` has {nulls} absent values; it may have none"
    )]
    Nulls {
        /// Name of the table.
        table: String,
        /// Name of the column.
        column: String,
        /// Number of null values.
        nulls: usize,
    },
    /// A column whose unit in the file differs from the schema.
    #[error(
        "the column `{column}` of the file of `{table}` is in `{found}`; its schema says `{expected}`"
    )]
    Unit {
        /// Name of the table.
        table: String,
        /// Name of the column.
        column: String,
        /// Unit in the file, empty if not given.
        found: String,
        /// Unit of the schema.
        expected: String,
    },
    /// A Parquet file that fretwear did not write: the file has no valid `fretwear` entry.
    #[error(
        "the file has no valid `fretwear` entry in its metadata ({reason}); it should hold the table `{expected}`"
    )]
    NotOurs {
        /// Name of the expected table.
        expected: String,
        /// The error in the entry.
        reason: String,
    },
    /// A file with another table.
    #[error("the file holds the table `{found}`, not `{expected}`")]
    OtherTable {
        /// Table in the file.
        found: String,
        /// Expected table.
        expected: String,
    },
    /// Parquet cannot read the bytes of a file, or Parquet cannot store a table.
    #[error("the Parquet of the table `{table}` failed: {source}")]
    Parquet {
        /// Name of the table.
        table: String,
        /// The error of the format library.
        source: parquet::errors::ParquetError,
    },
    /// Columns that Arrow cannot combine.
    #[error("the columns of the table `{table}` do not join: {source}")]
    Arrow {
        /// Name of the table.
        table: String,
        /// The error of the format library.
        source: arrow_schema::ArrowError,
    },
}
