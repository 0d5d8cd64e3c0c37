//! Reading and writing of tables as Parquet files.

use super::foreign::{catching_panics, codecs, declared_rows, unread_codec};
use super::nullable::{DescribedColumn, Nullable};
use super::{
    Column, ColumnSchema, ColumnType, Schema, Table, TableBuilder, TableError, TableLocation,
};
use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int32Type, Int64Type};
use arrow_array::{
    Array, ArrayRef, BooleanArray, Float64Array, Int32Array, Int64Array, RecordBatch, StringArray,
};
use arrow_schema::{DataType, Field};
use bytes::Bytes;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::arrow::{ArrowWriter, ProjectionMask};
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties, WriterPropertiesBuilder};
use parquet::schema::types::ColumnPath;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Key of the file's metadata whose JSON text contains schema and provenance.
pub const METADATA_KEY: &str = "fretwear";

/// Higher levels reduce the size by a few per cent and take several times as long.
const ZSTD_LEVEL: i32 = 3;

/// Rows decoded at a time. A field of 256 x 256 cells fits in one batch, and a damaged footer cannot request a larger
/// allocation.
const BATCH_ROWS: usize = 1 << 16;

/// Most rows of a table: one per cell of the largest grid.
const MOST_ROWS: i64 = 1 << 28;

/// Provenance of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Provenance {
    /// Hash of the scene without the keys that cannot affect committed results.
    pub scene_hash: String,
    /// Version of the program that wrote the table.
    pub program_version: String,
}

/// JSON text under [`METADATA_KEY`].
#[derive(Debug, Serialize, Deserialize)]
struct FileEntry {
    schema: String,
    scene_hash: String,
    program_version: String,
    columns: BTreeMap<String, ColumnEntry>,
}

/// Description of a column in a Parquet file: the unit of the column. For a table outside a run, the description also
/// has the dimension and the meaning of the column.
#[derive(Debug, Serialize, Deserialize)]
struct ColumnEntry {
    unit: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    dimension: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    description: Option<String>,
}

impl ColumnEntry {
    fn of(column: &ColumnSchema, place: TableLocation) -> Self {
        let beside = |text: &String| (place == TableLocation::Beside).then(|| text.clone());
        ColumnEntry {
            unit: column.unit.clone(),
            dimension: beside(&column.dimension),
            description: beside(&column.description),
        }
    }
}

/// Encodes a table as a Parquet file. Equal tables with equal provenance give equal bytes.
///
/// The encoding is BYTE_STREAM_SPLIT for dense floats, PLAIN for sparse floats and DELTA_BINARY_PACKED for integers.
/// zstd compresses all columns. Columns of floats and integers have no dictionary.
///
/// # Errors
/// [`TableError::Arrow`] or [`TableError::Parquet`] if the format libraries reject the table.
pub fn to_parquet(table: &Table, provenance: &Provenance) -> Result<Vec<u8>, TableError> {
    let schema = table.schema();
    let columns = table
        .columns()
        .map(|(described, column)| (field(described), array(column)))
        .collect();
    let properties =
        properties(table, provenance).map_err(|source| parquet_error(&schema.name, source))?;
    write(&schema.name, columns, properties)
}

/// Encodes columns without a schema as a Parquet file, with `entry` under [`METADATA_KEY`].
///
/// # Errors
/// As for [`to_parquet`].
pub fn nullable_to_parquet(
    table: &str,
    columns: &[DescribedColumn],
    entry: String,
) -> Result<Vec<u8>, TableError> {
    let properties = begin_properties(env!("CARGO_PKG_VERSION"), entry)
        .map_err(|source| parquet_error(table, source))?;
    let mut properties = without_index(properties);
    let mut arrays = Vec::with_capacity(columns.len());
    for (described, values) in columns {
        let array: ArrayRef = match values {
            Nullable::I32(values) => Arc::new(Int32Array::from(values.clone())),
            Nullable::I64(values) => Arc::new(Int64Array::from(values.clone())),
            Nullable::F64(values) => Arc::new(Float64Array::from(values.clone())),
            Nullable::Bool(values) => Arc::new(BooleanArray::from(values.clone())),
            Nullable::Text(values) => Arc::new(StringArray::from(values.clone())),
        };
        let path = ColumnPath::from(described.name.as_str());
        properties = properties.set_column_dictionary_enabled(path, false);
        arrays.push((field(described).with_nullable(true), array));
    }
    write(table, arrays, properties.build())
}

/// Decodes the columns of a file of [`nullable_to_parquet`] with at most `most_rows` rows, each with its name.
///
/// # Errors
/// [`TableError::Parquet`] for bytes that are not Parquet, [`TableError::TooManyRows`], [`TableError::ColumnType`] for
/// a column of an unsupported type.
pub fn nullable_from_parquet(
    bytes: &[u8],
    table: &str,
    most_rows: i64,
) -> Result<Vec<(String, Nullable)>, TableError> {
    catching_panics(|| decode_nullable(bytes, table, most_rows, &|_| true))
        .map_err(|source| parquet_error(table, source))?
}

/// As [`nullable_from_parquet`], but only decodes the wanted columns.
///
/// # Errors
/// As for [`nullable_from_parquet`].
pub fn columns_from_parquet(
    bytes: &[u8],
    table: &str,
    most_rows: i64,
    wanted: &dyn Fn(&str) -> bool,
) -> Result<Vec<(String, Nullable)>, TableError> {
    catching_panics(|| decode_nullable(bytes, table, most_rows, wanted))
        .map_err(|source| parquet_error(table, source))?
}

/// Returns the text under [`METADATA_KEY`] in a Parquet file, if there is one.
///
/// # Errors
/// [`TableError::Parquet`] for bytes that are not Parquet.
pub fn metadata_entry(bytes: &[u8], table: &str) -> Result<Option<String>, TableError> {
    let reader =
        catching_panics(|| ParquetRecordBatchReaderBuilder::try_new(Bytes::copy_from_slice(bytes)))
            .flatten()
            .map_err(|source| parquet_error(table, source))?;
    let entries = reader.metadata().file_metadata().key_value_metadata();
    let mut entries = entries.into_iter().flatten();
    let own = entries.find(|entry| entry.key == METADATA_KEY);
    Ok(own.and_then(|entry| entry.value.clone()))
}

fn decode_nullable(
    bytes: &[u8],
    table: &str,
    most_rows: i64,
    wanted: &dyn Fn(&str) -> bool,
) -> Result<Vec<(String, Nullable)>, TableError> {
    let failed = |source| parquet_error(table, source);
    let reader =
        ParquetRecordBatchReaderBuilder::try_new(Bytes::copy_from_slice(bytes)).map_err(failed)?;
    check_row_count(table, declared_rows(reader.metadata()), most_rows)?;
    let mut columns = Vec::new();
    let mut roots = Vec::new();
    for (root, field) in reader.schema().fields().iter().enumerate() {
        if !wanted(field.name()) {
            continue;
        }
        roots.push(root);
        let empty = match field.data_type() {
            DataType::Float64 => Nullable::F64(Vec::new()),
            DataType::Int32 => Nullable::I32(Vec::new()),
            DataType::Int64 => Nullable::I64(Vec::new()),
            DataType::Boolean => Nullable::Bool(Vec::new()),
            DataType::Utf8 => Nullable::Text(Vec::new()),
            found => {
                return Err(TableError::ColumnType {
                    table: table.to_owned(),
                    column: field.name().clone(),
                    found: found.to_string(),
                    expected: "a number, a flag or a text".to_owned(),
                });
            }
        };
        columns.push((field.name().clone(), empty));
    }
    let mask = ProjectionMask::roots(reader.parquet_schema(), roots);
    let reader = reader.with_projection(mask).with_batch_size(BATCH_ROWS);
    let batches = reader.build().map_err(failed)?;
    let mut rows = 0;
    for batch in batches {
        let batch = batch.map_err(|source| TableError::Arrow {
            table: table.to_owned(),
            source,
        })?;
        // The file may contain more rows than it declares.
        rows += batch.num_rows() as i64;
        check_row_count(table, rows, most_rows)?;
        for ((_, column), array) in columns.iter_mut().zip(batch.columns()) {
            match column {
                Nullable::F64(values) => values.extend(array.as_primitive::<Float64Type>()),
                Nullable::I32(values) => values.extend(array.as_primitive::<Int32Type>()),
                Nullable::I64(values) => values.extend(array.as_primitive::<Int64Type>()),
                Nullable::Bool(values) => values.extend(array.as_boolean()),
                Nullable::Text(values) => {
                    let texts = array.as_string::<i32>().iter();
                    values.extend(texts.map(|text| text.map(str::to_owned)));
                }
            }
        }
    }
    Ok(columns)
}

/// Encodes columns as a Parquet file.
fn write(
    table: &str,
    columns: Vec<(Field, ArrayRef)>,
    properties: WriterProperties,
) -> Result<Vec<u8>, TableError> {
    let failed = |source| parquet_error(table, source);
    let (fields, arrays): (Vec<_>, Vec<_>) = columns.into_iter().unzip();
    let schema = Arc::new(arrow_schema::Schema::new(fields));
    let batch =
        RecordBatch::try_new(schema.clone(), arrays).map_err(|source| TableError::Arrow {
            table: table.to_owned(),
            source,
        })?;
    let mut writer = ArrowWriter::try_new(Vec::new(), schema, Some(properties)).map_err(failed)?;
    writer.write(&batch).map_err(failed)?;
    writer.into_inner().map_err(failed)
}

fn parquet_error(table: &str, source: ParquetError) -> TableError {
    TableError::Parquet {
        table: table.to_owned(),
        source,
    }
}

/// Decodes a table from the bytes of a Parquet file.
///
/// # Errors
/// Returns a [`TableError`] if the bytes are not a Parquet file, or if another program wrote the file. Returns a
/// [`TableError`] if the file contains another table, or if the table violates the schema `expected`.
pub fn from_parquet(bytes: &[u8], expected: &'static Schema) -> Result<Table, TableError> {
    catching_panics(|| decode(bytes, expected)).map_err(|source| TableError::Parquet {
        table: expected.name.clone(),
        source,
    })?
}

fn decode(bytes: &[u8], expected: &'static Schema) -> Result<Table, TableError> {
    let parquet_error = |source| TableError::Parquet {
        table: expected.name.clone(),
        source,
    };
    let reader = ParquetRecordBatchReaderBuilder::try_new(Bytes::copy_from_slice(bytes))
        .map_err(parquet_error)?;
    let file_metadata = reader.metadata().file_metadata();
    let entry = file_entry(file_metadata.key_value_metadata(), &expected.name)?;
    if entry.schema != expected.name {
        return Err(TableError::OtherTable {
            found: entry.schema,
            expected: expected.name.clone(),
        });
    }
    // Check before decompression: a few bytes may declare any number of rows.
    check_row_count(&expected.name, declared_rows(reader.metadata()), MOST_ROWS)?;
    if let Some(codec) = unread_codec(reader.metadata()) {
        return Err(TableError::Codec {
            table: expected.name.clone(),
            found: codec,
            read: codecs(),
        });
    }
    let arrow_schema = reader.schema().clone();
    let mut columns: Vec<(&ColumnSchema, Column)> = Vec::new();
    for field in arrow_schema.fields() {
        let described = expected.require(field.name())?;
        check_unit(&expected.name, described, &entry)?;
        if columns
            .iter()
            .any(|(other, _)| other.name == described.name)
        {
            return Err(TableError::ColumnTwice {
                table: expected.name.clone(),
                column: described.name.clone(),
            });
        }
        columns.push((described, empty_column(described.kind)));
    }
    let batches = reader
        .with_batch_size(BATCH_ROWS)
        .build()
        .map_err(parquet_error)?;
    let mut rows = 0;
    for batch in batches {
        let batch = batch.map_err(|source| TableError::Arrow {
            table: expected.name.clone(),
            source,
        })?;
        // The file may contain more rows than it declares.
        rows += batch.num_rows() as i64;
        check_row_count(&expected.name, rows, MOST_ROWS)?;
        for ((described, column), array) in columns.iter_mut().zip(batch.columns()) {
            append(&expected.name, described, column, array)?;
        }
    }
    columns
        .into_iter()
        .fold(TableBuilder::of(expected), |table, (described, column)| {
            table.column(&described.name, column)
        })
        .build()
}

/// Returns the provenance of the table in the bytes of a Parquet file.
///
/// # Errors
/// [`TableError::Parquet`] for bytes that are not Parquet, [`TableError::NotOurs`] for a file of another program.
pub fn provenance_of(bytes: &[u8], expected: &Schema) -> Result<Provenance, TableError> {
    let reader =
        catching_panics(|| ParquetRecordBatchReaderBuilder::try_new(Bytes::copy_from_slice(bytes)))
            .flatten()
            .map_err(|source| TableError::Parquet {
                table: expected.name.clone(),
                source,
            })?;
    let entry = file_entry(
        reader.metadata().file_metadata().key_value_metadata(),
        &expected.name,
    )?;
    Ok(Provenance {
        scene_hash: entry.scene_hash,
        program_version: entry.program_version,
    })
}

fn check_row_count(table: &str, rows: i64, most: i64) -> Result<(), TableError> {
    if rows <= most {
        return Ok(());
    }
    Err(TableError::TooManyRows {
        table: table.to_owned(),
        found: rows,
        limit: most,
    })
}

fn field(column: &ColumnSchema) -> Field {
    let kind = match column.kind {
        ColumnType::F64 | ColumnType::MaybeF64 => DataType::Float64,
        ColumnType::I32 => DataType::Int32,
        ColumnType::I64 => DataType::Int64,
        ColumnType::Bool => DataType::Boolean,
        ColumnType::Text => DataType::Utf8,
    };
    let nullable = column.kind == ColumnType::MaybeF64;
    let unit = BTreeMap::from([("unit".to_owned(), column.unit.clone())]);
    Field::new(&column.name, kind, nullable).with_metadata(unit)
}

fn array(column: &Column) -> ArrayRef {
    match column {
        Column::F64(values) => Arc::new(Float64Array::from(values.clone())),
        Column::MaybeF64(values) => Arc::new(Float64Array::from(values.clone())),
        Column::I32(values) => Arc::new(Int32Array::from(values.clone())),
        Column::I64(values) => Arc::new(Int64Array::from(values.clone())),
        Column::Bool(values) => Arc::new(BooleanArray::from(values.clone())),
        Column::Text(values) => Arc::new(StringArray::from_iter_values(values)),
    }
}

fn properties(table: &Table, provenance: &Provenance) -> Result<WriterProperties, ParquetError> {
    let schema = table.schema();
    let entry = FileEntry {
        schema: schema.name.clone(),
        scene_hash: provenance.scene_hash.clone(),
        program_version: provenance.program_version.clone(),
        columns: table
            .columns()
            .map(|(column, _)| (column.name.clone(), ColumnEntry::of(column, schema.place)))
            .collect(),
    };
    let text =
        serde_json::to_string(&entry).map_err(|error| ParquetError::External(Box::new(error)))?;
    let mut properties = begin_properties(&provenance.program_version, text)?;
    if schema.rows == Some(1) {
        // For a single value per column, compression costs more time and space than it saves.
        properties = without_index(properties).set_compression(Compression::UNCOMPRESSED);
    }
    for (column, _) in table.columns() {
        let path = ColumnPath::from(column.name.as_str());
        let encoding = match column.kind {
            ColumnType::F64 if column.sparse => Encoding::PLAIN,
            ColumnType::F64 => Encoding::BYTE_STREAM_SPLIT,
            ColumnType::I32 | ColumnType::I64 => Encoding::DELTA_BINARY_PACKED,
            ColumnType::MaybeF64 | ColumnType::Bool | ColumnType::Text => Encoding::PLAIN,
        };
        properties = properties
            .set_column_dictionary_enabled(path.clone(), false)
            .set_column_encoding(path, encoding);
    }
    Ok(properties.build())
}

/// Disables statistics and page offsets. In a file with a few rows, the statistics and offsets need more space than the
/// rows. No reader uses the statistics and offsets.
fn without_index(properties: WriterPropertiesBuilder) -> WriterPropertiesBuilder {
    properties
        .set_statistics_enabled(EnabledStatistics::None)
        .set_offset_index_disabled(true)
}

/// Returns the properties that all files share.
fn begin_properties(
    program_version: &str,
    entry: String,
) -> Result<WriterPropertiesBuilder, ParquetError> {
    Ok(WriterProperties::builder()
        .set_created_by(format!("fretwear version {program_version}"))
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(ZSTD_LEVEL)?))
        .set_key_value_metadata(Some(vec![KeyValue::new(METADATA_KEY.to_owned(), entry)])))
}

fn file_entry(metadata: Option<&Vec<KeyValue>>, expected: &str) -> Result<FileEntry, TableError> {
    let not_ours = |reason: String| TableError::NotOurs {
        expected: expected.to_owned(),
        reason,
    };
    let text = metadata
        .into_iter()
        .flatten()
        .find(|entry| entry.key == METADATA_KEY)
        .and_then(|entry| entry.value.as_deref())
        .ok_or_else(|| not_ours("there is none".to_owned()))?;
    serde_json::from_str(text).map_err(|error| not_ours(error.to_string()))
}

fn check_unit(table: &str, column: &ColumnSchema, entry: &FileEntry) -> Result<(), TableError> {
    let found = entry
        .columns
        .get(&column.name)
        .map_or("", |found| found.unit.as_str());
    if found == column.unit {
        return Ok(());
    }
    Err(TableError::Unit {
        table: table.to_owned(),
        column: column.name.clone(),
        found: found.to_owned(),
        expected: column.unit.clone(),
    })
}

fn empty_column(kind: ColumnType) -> Column {
    match kind {
        ColumnType::F64 => Column::F64(Vec::new()),
        ColumnType::MaybeF64 => Column::MaybeF64(Vec::new()),
        ColumnType::I32 => Column::I32(Vec::new()),
        ColumnType::I64 => Column::I64(Vec::new()),
        ColumnType::Bool => Column::Bool(Vec::new()),
        ColumnType::Text => Column::Text(Vec::new()),
    }
}

/// Appends the values of an Arrow array to a column.
fn append(
    table: &str,
    described: &ColumnSchema,
    column: &mut Column,
    array: &ArrayRef,
) -> Result<(), TableError> {
    if array.null_count() > 0 && described.kind != ColumnType::MaybeF64 {
        return Err(TableError::Nulls {
            table: table.to_owned(),
            column: described.name.clone(),
            nulls: array.null_count(),
        });
    }
    match (column, array.data_type()) {
        (Column::F64(values), DataType::Float64) => {
            values.extend_from_slice(array.as_primitive::<Float64Type>().values());
        }
        (Column::MaybeF64(values), DataType::Float64) => {
            values.extend(array.as_primitive::<Float64Type>().iter());
        }
        (Column::I32(values), DataType::Int32) => {
            values.extend_from_slice(array.as_primitive::<Int32Type>().values());
        }
        (Column::I64(values), DataType::Int64) => {
            values.extend_from_slice(array.as_primitive::<Int64Type>().values());
        }
        (Column::Bool(values), DataType::Boolean) => {
            values.extend(array.as_boolean().iter().flatten());
        }
        (Column::Text(values), DataType::Utf8) => {
            values.extend(array.as_string::<i32>().iter().flatten().map(str::to_owned));
        }
        (_, found) => {
            return Err(TableError::ColumnType {
                table: table.to_owned(),
                column: described.name.clone(),
                found: found.to_string(),
                expected: described.kind.to_string(),
            });
        }
    }
    Ok(())
}
