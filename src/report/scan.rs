//! One lazy scan over a table of many iterations of many runs.

use std::collections::BTreeSet;
use std::sync::Arc;

use polars::prelude::*;

use super::ReportError;
use crate::store::RunReader;
use crate::tables::{ColumnType, TableName};

/// The column with the name that a run was given.
pub const RUN: &str = "run";
/// The column with the number of the iteration.
pub const WEAR_ITERATION: &str = "wear_iteration";
/// The column with the place of the run among those scanned, from 0: tells two runs of one name apart.
pub const ORDER: &str = "order";

/// Leads to the rows and is not handed on.
const PATH: &str = "path";

/// The files of a table, and which run and iteration each belongs to.
///
/// The reader could take the iteration from the name of its folder, but would do so with every `name=value` on the way
/// there, and a run kept in `rq=1um/` would lose its own `rq`.
pub struct Scan {
    table: TableName,
    paths: Vec<PlRefPath>,
    order: Vec<i64>,
    run: Vec<String>,
    wear_iteration: Vec<i64>,
}

impl Scan {
    /// Of no run yet.
    pub fn of(table: TableName) -> Scan {
        Scan {
            table,
            paths: Vec::new(),
            order: Vec::new(),
            run: Vec::new(),
            wear_iteration: Vec::new(),
        }
    }

    /// Adds the iterations of a run that have the table, under a name and a place among the runs. A damaged table outside the
    /// chain of commits, as `timing`, is passed over.
    ///
    /// # Errors
    /// [`ReportError::Run`] for a table of another version, [`ReportError::Name`].
    pub fn add(&mut self, order: usize, name: &str, reader: &RunReader) -> Result<(), ReportError> {
        let run = reader.path();
        let of_run = |source| ReportError::Run {
            run: run.to_owned(),
            source,
        };
        // Opening a run lets damage pass in what no result depends on.
        let unchained = !self.table.schema().chained;
        let reports = reader.reports().iter();
        let damaged: BTreeSet<u64> = reports
            .filter(|report| unchained && !report.unchained_damage.is_empty())
            .map(|report| report.wear_iteration)
            .collect();
        let mut last = None;
        for wear_iteration in reader.iterations() {
            let commit = reader.commit_of(wear_iteration).map_err(of_run)?;
            if commit.table(self.table.as_str()).is_none() || damaged.contains(&wear_iteration) {
                continue;
            }
            let path = reader.table_path(wear_iteration, self.table);
            let path = PlRefPath::try_from_path(&path).map_err(|source| ReportError::Name {
                run: run.to_owned(),
                source,
            })?;
            self.paths.push(path);
            self.order.push(order as i64);
            self.run.push(name.to_owned());
            self.wear_iteration.push(wear_iteration as i64);
            last = Some(wear_iteration);
        }
        // A file of another schema version may mean something else by the same names; only the run's reader looks at that.
        if let Some(last) = last {
            reader.read(last, self.table).map_err(of_run)?;
        }
        Ok(())
    }

    /// True if no run has the table.
    pub fn is_empty(&self) -> bool {
        self.paths.is_empty()
    }

    /// One lazy scan of all files: [`ORDER`], [`RUN`], [`WEAR_ITERATION`] and the columns of the table's schema, sorted by run
    /// and iteration; what a run lacks is null. Only the columns that are asked of it are read.
    ///
    /// # Errors
    /// Those of the table library.
    pub fn lazy(&self) -> PolarsResult<LazyFrame> {
        let schema: Schema = self
            .table
            .schema()
            .columns
            .iter()
            .map(|column| Field::new(column.name.as_str().into(), data_type(column.kind)))
            .collect();
        // A run that is asked for twice has its files read once; the join gives both their rows.
        let files: BTreeSet<&str> = self.paths.iter().map(|path| path.as_str()).collect();
        let rows = LazyFrame::scan_parquet_files(
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
        let paths: Vec<&str> = self.paths.iter().map(|path| path.as_str()).collect();
        let keys = df!(
            PATH => paths,
            ORDER => &self.order,
            RUN => &self.run,
            WEAR_ITERATION => &self.wear_iteration,
        )?;
        // Rows of one file stay in their order.
        let in_order = SortMultipleOptions::default().with_maintain_order(true);
        Ok(keys
            .lazy()
            .join(
                rows,
                [col(PATH)],
                [col(PATH)],
                JoinArgs {
                    maintain_order: MaintainOrderJoin::LeftRight,
                    ..JoinArgs::new(JoinType::Left)
                },
            )
            .sort([ORDER, WEAR_ITERATION], in_order)
            .drop(cols([PATH])))
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
