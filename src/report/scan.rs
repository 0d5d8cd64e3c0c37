//! Lazy frame of one table over many iterations of many runs.

use std::collections::BTreeSet;

use polars::prelude::*;

use super::ReportError;
use crate::store::{History, RunReader, StoreError, is_in_history};
use crate::tables::{self, ColumnSchema, ColumnType, Nullable, Table, TableName};

/// Column with the name of the run, as the user gave it.
pub const RUN: &str = "run";
/// Column with the number of the iteration.
pub const WEAR_ITERATION: &str = "wear_iteration";
/// Column with the index of the run in the scan, from 0. The index distinguishes two runs with the same name.
pub const RUN_INDEX: &str = "order";

/// Rows of a table, each with its run and its iteration.
///
/// The store reads and verifies each file, not Polars. The Parquet reader of Polars would bring a client for object
/// stores, with HTTP and TLS, into the program.
pub struct Scan {
    table: TableName,
    /// One frame per run that has the table.
    frames: Vec<DataFrame>,
}

impl Scan {
    /// Creates a scan without runs.
    pub fn new(table: TableName) -> Scan {
        Scan {
            table,
            frames: Vec::new(),
        }
    }

    /// Adds the iterations of a run that have the table, under a name and an index of the run.
    ///
    /// A table with one row per iteration includes pruned iterations. The function skips a damaged table if no result
    /// depends on the table (such as `timing`).
    ///
    /// # Errors
    /// Returns [`ReportError::Run`] for a table that cannot be read. Returns [`ReportError::Scan`] if the table library
    /// fails.
    pub fn add(&mut self, order: usize, name: &str, reader: &RunReader) -> Result<(), ReportError> {
        let run = reader.path();
        let run_error = |source| ReportError::Run {
            run: run.to_owned(),
            source,
        };
        let scan_error = |source| ReportError::Scan {
            table: self.table,
            runs: run.display().to_string(),
            source,
        };
        if is_in_history(self.table) {
            let history = reader.history().map_err(run_error)?;
            let frame = self
                .history_frame(order, name, &history)
                .map_err(scan_error)?;
            self.frames.extend(frame);
            return Ok(());
        }
        // Opening a run does not reject damage in tables that no result depends on.
        let unchained = !self.table.schema().chained;
        let reports = reader.reports().iter();
        let damaged: BTreeSet<u64> = reports
            .filter(|report| unchained && !report.unchained_damage.is_empty())
            .map(|report| report.wear_iteration)
            .collect();
        let mut tables = Vec::new();
        for wear_iteration in reader.iterations() {
            if damaged.contains(&wear_iteration) {
                continue;
            }
            match reader.read(wear_iteration, self.table) {
                Ok(rows) => tables.push((wear_iteration, rows)),
                Err(StoreError::NoTable { .. }) => (),
                Err(source) => return Err(run_error(source)),
            }
        }
        if tables.is_empty() {
            return Ok(());
        }
        let frame = self.keyed_frame(order, name, &tables).map_err(scan_error)?;
        self.frames.push(frame);
        Ok(())
    }

    /// Converts the rows of a history to a frame, with their keys. Returns `None` if no iteration has the table.
    fn history_frame(
        &self,
        order: usize,
        name: &str,
        history: &History,
    ) -> PolarsResult<Option<DataFrame>> {
        let rows = history.len();
        let mut columns = vec![
            Column::new(RUN_INDEX.into(), vec![order as i64; rows]),
            Column::new(RUN.into(), vec![name; rows]),
            Column::new(WEAR_ITERATION.into(), (0..rows as i64).collect::<Vec<_>>()),
        ];
        let mut has_table = vec![false; rows];
        for schema in &self.table.schema().columns {
            let name = schema.name.as_str();
            let mut stored = history.columns_of(self.table);
            let values = stored.find(|(column, _)| column.name == name);
            columns.push(match values {
                Some((_, values)) => {
                    for (row, has_table) in has_table.iter_mut().enumerate() {
                        *has_table |= values.at(row).is_some();
                    }
                    nullable(name, values)
                }
                None => Column::full_null(name.into(), rows, &data_type(schema.kind)),
            });
        }
        if !has_table.contains(&true) {
            return Ok(None);
        }
        let has_table = BooleanChunked::from_slice("there".into(), &has_table);
        DataFrame::new(columns)?.filter(&has_table).map(Some)
    }

    /// Returns true if no run has the table.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Returns all rows as one lazy frame: [`RUN_INDEX`], [`RUN`], [`WEAR_ITERATION`] and the columns of the table's
    /// schema.
    ///
    /// Rows are sorted by run, in the order of [`Scan::add`], then by iteration. Columns that a run lacks are null.
    ///
    /// # Errors
    /// Returns errors of the table library.
    pub fn lazy_frame(&self) -> PolarsResult<LazyFrame> {
        let mut frames: Vec<LazyFrame> = self.frames.iter().map(|f| f.clone().lazy()).collect();
        if frames.is_empty() {
            frames.push(self.keyed_frame(0, "", &[])?.lazy());
        }
        concat(frames, UnionArgs::default())
    }

    /// Concatenates the tables of one run, with their keys.
    fn keyed_frame(
        &self,
        order: usize,
        name: &str,
        tables: &[(u64, Table)],
    ) -> PolarsResult<DataFrame> {
        let rows = tables.iter().map(|(_, table)| table.rows()).sum();
        let wear_iteration: Vec<i64> = tables
            .iter()
            .flat_map(|(k, table)| vec![*k as i64; table.rows()])
            .collect();
        let mut columns = vec![
            Column::new(RUN_INDEX.into(), vec![order as i64; rows]),
            Column::new(RUN.into(), vec![name; rows]),
            Column::new(WEAR_ITERATION.into(), wear_iteration),
        ];
        for schema in &self.table.schema().columns {
            columns.push(concatenated_column(schema, tables)?);
        }
        DataFrame::new(columns)
    }
}

/// Concatenates a column of all tables. The rows of a table without the column are null.
fn concatenated_column(schema: &ColumnSchema, tables: &[(u64, Table)]) -> PolarsResult<Column> {
    let name = schema.name.as_str();
    let kind = data_type(schema.kind);
    let mut all = Column::new_empty(name.into(), &kind);
    for (_, table) in tables {
        let mut matching = table.columns().filter(|(own, _)| own.name == name);
        let part = match matching.next() {
            Some((_, values)) => column(name, values),
            None => Column::full_null(name.into(), table.rows(), &kind),
        };
        all.append_owned(part)?;
    }
    Ok(all.rechunk())
}

/// Converts a column of the store to one of Polars.
pub fn column(name: &str, values: &tables::Column) -> Column {
    let name = name.into();
    match values {
        tables::Column::F64(values) => Column::new(name, values),
        tables::Column::MaybeF64(values) => Column::new(name, values),
        tables::Column::I32(values) => Column::new(name, values),
        tables::Column::I64(values) => Column::new(name, values),
        tables::Column::Bool(values) => Column::new(name, values),
        tables::Column::Text(values) => Column::new(name, values),
    }
}

fn nullable(name: &str, values: &Nullable) -> Column {
    let name = name.into();
    match values {
        Nullable::F64(values) => Column::new(name, values),
        Nullable::I32(values) => Column::new(name, values),
        Nullable::I64(values) => Column::new(name, values),
        Nullable::Bool(values) => Column::new(name, values),
        Nullable::Text(values) => Column::new(name, values),
    }
}

fn data_type(kind: ColumnType) -> DataType {
    match kind {
        ColumnType::F64 | ColumnType::MaybeF64 => DataType::Float64,
        ColumnType::I32 => DataType::Int32,
        ColumnType::I64 => DataType::Int64,
        ColumnType::Bool => DataType::Boolean,
        ColumnType::Text => DataType::String,
    }
}
