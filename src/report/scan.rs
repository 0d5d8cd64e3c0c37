//! One lazy frame over a table of many iterations of many runs.

use std::collections::BTreeSet;

use polars::prelude::*;

use super::ReportError;
use crate::store::{History, RunReader, StoreError, is_in_history};
use crate::tables::{self, ColumnSchema, ColumnType, Nullable, Table, TableName};

/// The column with the name that a run was given.
pub const RUN: &str = "run";
/// The column with the number of the iteration.
pub const WEAR_ITERATION: &str = "wear_iteration";
/// The column with the place of the run among those scanned, from 0: tells two runs of one name apart.
pub const ORDER: &str = "order";

/// The rows of a table, with which run and iteration each belongs to.
///
/// Each file is read by the store, which verifies it, rather than by Polars: its own reader of Parquet would bring a client for
/// object stores, with HTTP and TLS, into the program.
pub struct Scan {
    table: TableName,
    /// Of each run that has the table.
    frames: Vec<DataFrame>,
}

impl Scan {
    /// Of no run yet.
    pub fn of(table: TableName) -> Scan {
        Scan {
            table,
            frames: Vec::new(),
        }
    }

    /// Adds the iterations of a run that have the table, under a name and a place among the runs: of a one-row table those that are
    /// pruned too. A damaged table outside the chain of commits, as `timing`, is passed over.
    ///
    /// # Errors
    /// [`ReportError::Run`] for a table that cannot be read, as one that was damaged since the run was opened,
    /// [`ReportError::Scan`].
    pub fn add(&mut self, order: usize, name: &str, reader: &RunReader) -> Result<(), ReportError> {
        let run = reader.path();
        let of_run = |source| ReportError::Run {
            run: run.to_owned(),
            source,
        };
        let failed = |source| ReportError::Scan {
            table: self.table,
            runs: run.display().to_string(),
            source,
        };
        if is_in_history(self.table) {
            let history = reader.history().map_err(of_run)?;
            let frame = self.of_history(order, name, &history).map_err(failed)?;
            self.frames.extend(frame);
            return Ok(());
        }
        // Opening a run lets damage pass in what no result depends on.
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
                Err(source) => return Err(of_run(source)),
            }
        }
        if tables.is_empty() {
            return Ok(());
        }
        let frame = self.keyed(order, name, &tables).map_err(failed)?;
        self.frames.push(frame);
        Ok(())
    }

    /// The rows of a history that the table has, with their keys; `None` where no iteration has it.
    fn of_history(
        &self,
        order: usize,
        name: &str,
        history: &History,
    ) -> PolarsResult<Option<DataFrame>> {
        let rows = history.len();
        let mut columns = vec![
            Column::new(ORDER.into(), vec![order as i64; rows]),
            Column::new(RUN.into(), vec![name; rows]),
            Column::new(WEAR_ITERATION.into(), (0..rows as i64).collect::<Vec<_>>()),
        ];
        let mut there = vec![false; rows];
        for described in &self.table.schema().columns {
            let name = described.name.as_str();
            let mut own = history.columns_of(self.table);
            let values = own.find(|(column, _)| column.name == name);
            columns.push(match values {
                Some((_, values)) => {
                    for (row, there) in there.iter_mut().enumerate() {
                        *there |= values.at(row).is_some();
                    }
                    nullable(name, values)
                }
                None => Column::full_null(name.into(), rows, &data_type(described.kind)),
            });
        }
        if !there.contains(&true) {
            return Ok(None);
        }
        let there = BooleanChunked::from_slice("there".into(), &there);
        DataFrame::new(columns)?.filter(&there).map(Some)
    }

    /// True if no run has the table.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// All rows as one lazy frame: [`ORDER`], [`RUN`], [`WEAR_ITERATION`] and the columns of the table's schema, by run, as they
    /// were added, and iteration; what a run lacks is null.
    ///
    /// # Errors
    /// Those of the table library.
    pub fn lazy(&self) -> PolarsResult<LazyFrame> {
        let mut frames: Vec<LazyFrame> = self.frames.iter().map(|f| f.clone().lazy()).collect();
        if frames.is_empty() {
            frames.push(self.keyed(0, "", &[])?.lazy());
        }
        concat(frames, UnionArgs::default())
    }

    /// The tables of one run below each other, with their keys.
    fn keyed(&self, order: usize, name: &str, tables: &[(u64, Table)]) -> PolarsResult<DataFrame> {
        let rows = tables.iter().map(|(_, table)| table.rows()).sum();
        let wear_iteration: Vec<i64> = tables
            .iter()
            .flat_map(|(k, table)| vec![*k as i64; table.rows()])
            .collect();
        let mut columns = vec![
            Column::new(ORDER.into(), vec![order as i64; rows]),
            Column::new(RUN.into(), vec![name; rows]),
            Column::new(WEAR_ITERATION.into(), wear_iteration),
        ];
        for described in &self.table.schema().columns {
            columns.push(below_each_other(described, tables)?);
        }
        DataFrame::new(columns)
    }
}

/// A column of all tables; null where one lacks it.
fn below_each_other(described: &ColumnSchema, tables: &[(u64, Table)]) -> PolarsResult<Column> {
    let name = described.name.as_str();
    let kind = data_type(described.kind);
    let mut whole = Column::new_empty(name.into(), &kind);
    for (_, table) in tables {
        let mut there = table.columns().filter(|(schema, _)| schema.name == name);
        let part = match there.next() {
            Some((_, values)) => column(name, values),
            None => Column::full_null(name.into(), table.rows(), &kind),
        };
        whole.append_owned(part)?;
    }
    Ok(whole.rechunk())
}

/// The values of a column of the store.
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
