//! The summaries of several runs as one table.

use std::collections::BTreeSet;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use polars::io::parquet::write::KeyValueMetadata;
use polars::prelude::*;
use serde_json::json;

use super::CompareError;
use crate::store::{Damage, RealFileSystem, RunReader};
use crate::tables::{ColumnSchema, ColumnType, METADATA_KEY, TableName};

/// The columns of `summary` that a comparison shows, in this order, after `run` and `wear_iteration`.
const FIGURES: [&str; 13] = [
    "cycles",
    "wear_volume",
    "wear_rate",
    "dissipated_energy",
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

/// A cost rather than a state: the row of a whole run has the sum over its iterations.
const FFT_PAIRS: &str = "fft_pairs";

const RUN: &str = "run";
const WEAR_ITERATION: &str = "wear_iteration";

/// Columns that lead to the rows and are not shown.
const PATH: &str = "path";
const ORDER: &str = "order";

/// Which rows a comparison has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rows {
    /// One row a run: its last iteration, with the FFT pairs of all the iterations it still keeps.
    Last,
    /// One row for every iteration of every run.
    All,
}

/// A value of a [`Comparison`].
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

/// Runs side by side: rows in the order of the runs asked for, then of the iterations.
#[derive(Debug, Clone)]
pub struct Comparison {
    columns: Vec<ColumnSchema>,
    frame: DataFrame,
    damage: Vec<Damage>,
}

/// Puts the summaries of runs into one table. A run that lacks a column, as a static contact lacks wear, has it
/// [`Cell::Absent`].
///
/// Iterations count as far as their chain of commits verifies; what does not is listed by [`Comparison::damage`].
///
/// # Errors
/// [`CompareError::Run`] for a folder that is no readable run, [`CompareError::Empty`] for a run without an iteration,
/// [`CompareError::Name`], and [`CompareError::Scan`] if the table library fails.
pub fn compare(runs: &[PathBuf], rows: Rows) -> Result<Comparison, CompareError> {
    let mut keys = Keys::default();
    for (order, run) in runs.iter().enumerate() {
        keys.add(order, run)?;
    }
    let frame = scan(&keys, rows).map_err(|source| CompareError::Scan {
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
        damage: keys.damage,
    })
}

/// The summary files of the runs, and which run and iteration each belongs to.
///
/// The reader could take the iteration from the name of its folder, but would do so with every `name=value` on the way
/// there, and a run kept in `rq=1um/` would lose its own `rq`.
#[derive(Default)]
struct Keys {
    paths: Vec<PlRefPath>,
    order: Vec<i64>,
    run: Vec<String>,
    wear_iteration: Vec<i64>,
    damage: Vec<Damage>,
}

impl Keys {
    fn add(&mut self, order: usize, run: &Path) -> Result<(), CompareError> {
        let of_run = |source| CompareError::Run {
            run: run.to_owned(),
            source,
        };
        let reader = RunReader::open(Arc::new(RealFileSystem), run).map_err(of_run)?;
        let latest = reader.latest().ok_or_else(|| CompareError::Empty {
            run: run.to_owned(),
        })?;
        // A file of another schema version may mean something else by the same names; only the run's reader looks at that.
        reader.read(latest, TableName::Summary).map_err(of_run)?;
        for wear_iteration in reader.iterations() {
            let path = reader.table_path(wear_iteration, TableName::Summary);
            self.paths
                .push(
                    PlRefPath::try_from_path(&path).map_err(|source| CompareError::Name {
                        run: run.to_owned(),
                        source,
                    })?,
                );
            self.order.push(order as i64);
            self.run.push(run.display().to_string());
            self.wear_iteration.push(wear_iteration as i64);
        }
        self.damage.extend(
            reader
                .reports()
                .iter()
                .flat_map(|report| &report.damage)
                .cloned(),
        );
        Ok(())
    }

    fn frame(&self) -> PolarsResult<DataFrame> {
        let paths: Vec<&str> = self.paths.iter().map(|path| path.as_str()).collect();
        df!(
            PATH => paths,
            ORDER => &self.order,
            RUN => &self.run,
            WEAR_ITERATION => &self.wear_iteration,
        )
    }
}

/// One lazy scan of all files: only the columns shown are read from them.
fn scan(keys: &Keys, rows: Rows) -> PolarsResult<DataFrame> {
    let summary = TableName::Summary.schema();
    let schema: Schema = summary
        .columns
        .iter()
        .map(|column| Field::new(column.name.as_str().into(), data_type(column.kind)))
        .collect();
    // A run that is asked for twice has its files read once; the join gives both their rows.
    let files: BTreeSet<&str> = keys.paths.iter().map(|path| path.as_str()).collect();
    let summaries = LazyFrame::scan_parquet_files(
        files.into_iter().map(PlRefPath::new).collect(),
        ScanArgsParquet {
            schema: Some(Arc::new(schema)),
            allow_missing_columns: true,
            include_file_paths: Some(PATH.into()),
            // The names of the files are exact: a `[` in the name of a run is no pattern.
            glob: false,
            hive_options: HiveOptions::new_disabled(),
            ..Default::default()
        },
    )?;
    let table = keys
        .frame()?
        .lazy()
        .join(
            summaries,
            [col(PATH)],
            [col(PATH)],
            JoinArgs::new(JoinType::Left),
        )
        .sort([ORDER, WEAR_ITERATION], SortMultipleOptions::default());
    let table = match rows {
        Rows::All => table,
        Rows::Last => {
            let last = FIGURES.map(|name| match name {
                FFT_PAIRS => col(name).sum(),
                _ => col(name).last(),
            });
            table.group_by_stable([col(ORDER), col(RUN)]).agg(
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

fn data_type(kind: ColumnType) -> DataType {
    match kind {
        ColumnType::F64 | ColumnType::MaybeF64 => DataType::Float64,
        ColumnType::I32 => DataType::Int32,
        ColumnType::I64 => DataType::Int64,
        ColumnType::Bool => DataType::Boolean,
        ColumnType::Text => DataType::String,
    }
}

/// What the columns of a comparison mean.
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
    /// What the columns mean, from left to right.
    pub fn columns(&self) -> &[ColumnSchema] {
        &self.columns
    }

    /// Number of rows.
    pub fn height(&self) -> usize {
        self.frame.height()
    }

    /// The values of row `row`, one a column.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row(&self, row: usize) -> Vec<Cell> {
        self.frame
            .columns()
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

    /// What did not verify in the runs; the iterations from there on are not in the table.
    pub fn damage(&self) -> &[Damage] {
        &self.damage
    }

    /// Writes the table as Parquet, with the meaning of its columns under [`METADATA_KEY`]. A file that is there is
    /// replaced.
    ///
    /// # Errors
    /// [`CompareError::Io`], [`CompareError::Parquet`].
    pub fn write_parquet(&self, path: &Path) -> Result<(), CompareError> {
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
            "schema": "comparison",
            "program_version": env!("CARGO_PKG_VERSION"),
            "columns": columns,
        });
        let file = File::create(path).map_err(|source| CompareError::Io {
            path: path.to_owned(),
            source,
        })?;
        ParquetWriter::new(file)
            .with_key_value_metadata(Some(KeyValueMetadata::from_static(vec![(
                METADATA_KEY.to_owned(),
                entry.to_string(),
            )])))
            .finish(&mut self.frame.clone())
            .map_err(|source| CompareError::Parquet {
                path: path.to_owned(),
                source,
            })?;
        Ok(())
    }

    /// Writes the table as CSV: names of the columns, then every number in full, SI units, nothing where a run has no such
    /// figure. A file that is there is replaced.
    ///
    /// # Errors
    /// [`CompareError::Csv`].
    pub fn write_csv(&self, path: &Path) -> Result<(), CompareError> {
        let failed = |source| CompareError::Csv {
            path: path.to_owned(),
            source,
        };
        let mut writer = csv::Writer::from_path(path).map_err(failed)?;
        writer
            .write_record(self.columns.iter().map(|column| column.name.as_str()))
            .map_err(failed)?;
        for row in 0..self.height() {
            let cells = self.row(row).into_iter().map(|cell| match cell {
                Cell::Absent => String::new(),
                Cell::Integer(value) => value.to_string(),
                Cell::Number(value) => format!("{value:?}"),
                Cell::Text(text) => text,
            });
            writer.write_record(cells).map_err(failed)?;
        }
        writer.flush().map_err(|source| failed(source.into()))
    }
}
