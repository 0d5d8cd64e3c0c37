//! Comparison table: the summaries of several runs.

use std::io;
use std::path::{Path, PathBuf};

use polars::prelude::*;
use serde_json::json;

use super::ReportError;
use super::output;
use super::page::io_error;
use super::run_tables::{damage_of, open};
use super::scan::{RUN, RUN_INDEX, Scan, WEAR_ITERATION};
use super::skipped_folders::{SkippedFolder, open_each};
use crate::stages::{JointState, RunCost, RunEnds};
use crate::store::{Damage, RunReader, StoreError};
use crate::tables::{ColumnSchema, ColumnType, Nullable, TableName, nullable_to_parquet};

/// Columns of `summary` that a comparison shows after `run` and `wear_iteration`, in the order of the comparison.
const FIGURES: [&str; 15] = [
    "cycles",
    "wear_volume",
    "largest_depth",
    "wear_rate",
    "dissipated_energy",
    "normal_load",
    "contact_area_fraction",
    "loaded_area_fraction",
    "max_pressure",
    "kn",
    "kt",
    "rq",
    "sk",
    "ku",
    FFT_PAIRS,
];

/// Column of the FFT pairs, which are a cost and not a state. With [`Rows::Last`], the row of a run shows the sum of
/// the FFT pairs over all its iterations, including pruned iterations.
const FFT_PAIRS: &str = "fft_pairs";

/// First characters that make a spreadsheet read a CSV field as a formula.
const FORMULA: [char; 6] = ['=', '+', '-', '@', '\t', '\r'];

/// Name of the schema in the Parquet file of a comparison.
const COMPARISON: &str = "comparison";

/// Rows of a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rows {
    /// One row per run: the last iteration of the run, with the FFT pairs of all iterations of the run.
    Last,
    /// One row per iteration of each run.
    All,
}

/// Value of a cell of a [`Comparison`].
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// The run lacks the physics behind the column.
    Absent,
    /// A count.
    Integer(i64),
    /// A quantity in the unit of its column.
    Number(f64),
    /// A name.
    Text(String),
}

impl Cell {
    fn integer(self) -> Option<i64> {
        match self {
            Cell::Integer(value) => Some(value),
            _ => None,
        }
    }

    fn number(self) -> Option<f64> {
        match self {
            Cell::Number(value) => Some(value),
            _ => None,
        }
    }

    fn text(self) -> Option<String> {
        match self {
            Cell::Text(text) => Some(text),
            _ => None,
        }
    }
}

/// State of a row, with the error bars of its figures.
#[derive(Debug, Clone)]
pub struct ComparedRun {
    /// Path of the run, as the user gave it.
    pub run: String,
    /// State of the joint. With [`Rows::Last`], the state includes the last forced response, if the run has forced
    /// responses of the first and the last state.
    pub state: JointState,
    /// Number of FFT pairs of all stages. The number counts the iteration of the row, or with [`Rows::Last`] all
    /// iterations of the run.
    pub fft_pairs: f64,
}

/// Comparison of runs. The rows follow the order of the given runs, then of the iterations.
#[derive(Debug)]
pub struct Comparison {
    columns: Vec<ColumnSchema>,
    frame: DataFrame,
    states: Vec<ComparedRun>,
    damage: Vec<Damage>,
    passed_over: Vec<SkippedFolder>,
}

/// Reads the summaries of runs into one table. A column that a run lacks (a static contact has no wear) is
/// [`Cell::Absent`].
///
/// The table includes the iterations up to the first one whose chain of commits does not verify. [`Comparison::damage`]
/// lists the damage. [`Comparison::passed_over`] lists the skipped folders, which are not readable runs.
///
/// # Errors
/// Returns [`ReportError::NoReadableRun`] if none of several folders is a run. Returns [`ReportError::Run`] for a
/// folder that is not a readable run, and [`ReportError::Empty`] for a run without an iteration. Of several paths,
/// `compare` skips an unreadable folder and returns no error. `compare` returns an error if the path does not exist, or
/// if the system denies access to the path. Returns [`ReportError::Scan`] if the table library fails.
pub fn compare(runs: &[PathBuf], rows: Rows) -> Result<Comparison, ReportError> {
    let mut scan = Scan::new(TableName::Summary);
    let (mut states, mut damage) = (Vec::new(), Vec::new());
    let mut order = 0;
    let (_, passed_over) = open_each(runs, |run| {
        let reader = open(run)?;
        let name = run.display().to_string();
        scan.add(order, &name, &reader)?;
        let run_states = states_of(name, &reader, rows);
        states.extend(run_states.map_err(|source| ReportError::Run {
            run: run.to_owned(),
            source,
        })?);
        damage.extend(damage_of(&reader));
        order += 1;
        Ok(())
    })?;
    let frame = figures(&scan, rows).map_err(|source| ReportError::Scan {
        table: TableName::Summary,
        runs: runs
            .iter()
            .map(|run| run.display().to_string())
            .collect::<Vec<_>>()
            .join(", "),
        source,
    })?;
    Ok(Comparison {
        columns: columns(),
        frame,
        states,
        damage,
        passed_over,
    })
}

/// Returns the state of each row of a run.
fn states_of(run: String, reader: &RunReader, rows: Rows) -> Result<Vec<ComparedRun>, StoreError> {
    let compared = |state, fft_pairs| ComparedRun {
        run: run.clone(),
        state,
        fft_pairs,
    };
    Ok(match rows {
        Rows::All => {
            let history = reader.history()?;
            let states = JointState::all(reader)?.into_iter();
            let states = states.map(|state| {
                let pairs = history.fft_pairs(state.wear_iteration);
                compared(state, pairs)
            });
            states.collect()
        }
        Rows::Last => {
            let ends = RunEnds::of(reader)?.into_iter();
            let pairs = RunCost::of(reader)?.total_pairs();
            ends.map(|ends| compared(ends.now, pairs)).collect()
        }
    })
}

/// Selects the columns of a comparison, and aggregates each run with [`Rows::Last`].
fn figures(scan: &Scan, rows: Rows) -> PolarsResult<DataFrame> {
    let table = scan.lazy_frame()?;
    let table = match rows {
        Rows::All => table,
        Rows::Last => {
            let last = FIGURES.map(|name| match name {
                FFT_PAIRS => col(name).sum(),
                _ => col(name).last(),
            });
            table.group_by_stable([col(RUN_INDEX), col(RUN)]).agg(
                std::iter::once(col(WEAR_ITERATION).last())
                    .chain(last)
                    .collect::<Vec<_>>(),
            )
        }
    };
    table
        .select(
            [col(RUN), col(WEAR_ITERATION)]
                .into_iter()
                .chain(FIGURES.map(col))
                .collect::<Vec<_>>(),
        )
        .collect()
}

/// Schema of the columns of a comparison.
fn columns() -> Vec<ColumnSchema> {
    let key = |name: &str, kind, dimension: &str, description: &str| ColumnSchema {
        name: name.to_owned(),
        kind,
        unit: "1".to_owned(),
        dimension: dimension.to_owned(),
        description: description.to_owned(),
        sparse: false,
        optional: false,
        infinite: false,
    };
    let summary = TableName::Summary.schema();
    [
        key(RUN, ColumnType::Text, "name", "Folder of the run."),
        key(
            WEAR_ITERATION,
            ColumnType::I64,
            "count",
            "Wear steps behind this state.",
        ),
    ]
    .into_iter()
    .chain(FIGURES.iter().map(|name| {
        summary
            .column(name)
            .expect("the figures are columns of the summary")
            .clone()
    }))
    .collect()
}

impl Comparison {
    /// Schema of the columns, from left to right.
    pub fn columns(&self) -> &[ColumnSchema] {
        &self.columns
    }

    /// Number of rows.
    pub fn height(&self) -> usize {
        self.frame.height()
    }

    /// Returns the values of row `row`, one per column.
    ///
    /// # Panics
    /// Panics if the comparison has no row `row`.
    pub fn row(&self, row: usize) -> Vec<Cell> {
        self.frame
            .get_columns()
            .iter()
            .map(|column| {
                match column
                    .get(row)
                    .expect("the row is below the table's height")
                {
                    AnyValue::Int64(value) => Cell::Integer(value),
                    AnyValue::Float64(value) => Cell::Number(value),
                    AnyValue::String(value) => Cell::Text(value.to_owned()),
                    AnyValue::StringOwned(value) => Cell::Text(value.to_string()),
                    AnyValue::Null => Cell::Absent,
                    other => unreachable!("no column of a comparison holds {other:?}"),
                }
            })
            .collect()
    }

    /// The states of the rows, in their order.
    pub fn states(&self) -> &[ComparedRun] {
        &self.states
    }

    /// Damage of the runs. The table omits the damaged iteration of a run and all later ones.
    pub fn damage(&self) -> &[Damage] {
        &self.damage
    }

    /// Skipped folders, which have no row.
    pub fn passed_over(&self) -> &[SkippedFolder] {
        &self.passed_over
    }

    /// Writes the table as Parquet, with the description of its columns under [`crate::tables::METADATA_KEY`]. Replaces
    /// an existing file.
    ///
    /// # Errors
    /// Returns [`ReportError::Table`], [`ReportError::Io`].
    pub fn write_parquet(&self, path: &Path) -> Result<(), ReportError> {
        let columns: serde_json::Map<_, _> = self
            .columns
            .iter()
            .map(|column| {
                (
                    column.name.clone(),
                    json!({
                        "unit": column.unit,
                        "dimension": column.dimension,
                        "description": column.description,
                    }),
                )
            })
            .collect();
        let entry = json!({
            "schema": COMPARISON,
            "program_version": env!("CARGO_PKG_VERSION"),
            "columns": columns,
        });
        let mut cells = vec![Vec::new(); self.columns.len()];
        for row in 0..self.height() {
            for (column, cell) in cells.iter_mut().zip(self.row(row)) {
                column.push(cell);
            }
        }
        let columns: Vec<_> = self
            .columns
            .iter()
            .zip(cells)
            .map(|(column, cells)| {
                let cells = cells.into_iter();
                let values = match column.kind {
                    ColumnType::I32 | ColumnType::I64 => {
                        Nullable::I64(cells.map(Cell::integer).collect())
                    }
                    ColumnType::Text => Nullable::Text(cells.map(Cell::text).collect()),
                    _ => Nullable::F64(cells.map(Cell::number).collect()),
                };
                (column, values)
            })
            .collect();
        let columns: Vec<_> = columns.iter().map(|(c, values)| (*c, values)).collect();
        let bytes =
            nullable_to_parquet(COMPARISON, &columns, entry.to_string()).map_err(|source| {
                ReportError::Table {
                    path: path.to_owned(),
                    source: Box::new(source),
                }
            })?;
        let written = output::write(path, &bytes);
        written.map(drop).map_err(io_error(path))
    }

    /// Writes the table as CSV: a header, then all numbers in full precision and SI units. An absent figure is an empty
    /// field. A name of a run that a spreadsheet would read as a formula gets the prefix `./`. Replaces an existing
    /// file.
    ///
    /// # Errors
    /// Returns [`ReportError::Io`].
    pub fn write_csv(&self, path: &Path) -> Result<(), ReportError> {
        let written = self.csv().and_then(|bytes| output::write(path, &bytes));
        written.map(drop).map_err(io_error(path))
    }

    fn csv(&self) -> io::Result<Vec<u8>> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(self.columns.iter().map(|column| column.name.as_str()))?;
        for row in 0..self.height() {
            let cells = self.row(row).into_iter().map(|cell| match cell {
                Cell::Absent => String::new(),
                Cell::Integer(value) => value.to_string(),
                Cell::Number(value) => format!("{value:?}"),
                Cell::Text(run) if run.starts_with(FORMULA) => format!("./{run}"),
                Cell::Text(run) => run,
            });
            writer.write_record(cells)?;
        }
        writer.into_inner().map_err(|error| error.into_error())
    }
}
