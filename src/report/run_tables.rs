//! Tables of a run as data frames.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use polars::prelude::*;

use super::ReportError;
use super::scan::{RUN, RUN_INDEX, Scan, column};
use super::skipped_folders::{SkippedFolder, open_each};
use crate::recipe::{Recipe, StoredPlan};
use crate::store::{Damage, History, RealFileSystem, RunReader, RunRecord, StoreError};
use crate::tables::{Table, TableName};

/// Reader of a run, which another process may still compute.
///
/// The reader includes the iterations up to the first iteration whose chain of commits does not verify.
/// [`RunTables::damage`] lists the damage.
pub struct RunTables {
    reader: RunReader,
    name: String,
    plan: StoredPlan,
    iterations: Vec<u64>,
    latest: u64,
}

impl RunTables {
    /// Opens the run in a folder.
    ///
    /// # Errors
    /// Returns [`ReportError::Run`] for a folder that is not a readable run, [`ReportError::Empty`] for a run without
    /// an iteration.
    pub fn open(root: &Path) -> Result<RunTables, ReportError> {
        let reader = open(root)?;
        let of_run = |source| ReportError::Run {
            run: root.to_owned(),
            source,
        };
        let plan = reader.plan(StoredPlan::of).map_err(of_run)?;
        let iterations: Vec<u64> = reader.iterations().collect();
        Ok(RunTables {
            name: name_of(root),
            latest: iterations[iterations.len() - 1],
            reader,
            plan,
            iterations,
        })
    }

    /// Opens the runs among several folders (as from `runs/*`), and returns the skipped folders.
    ///
    /// # Errors
    /// Returns [`ReportError::NoReadableRun`] if none of several folders is a run. Returns the errors of
    /// [`RunTables::open`] if the user names only one folder. Returns the same errors as [`RunTables::open`] if a path
    /// does not exist, or if the system denies access to a path.
    pub fn open_all(
        roots: &[PathBuf],
    ) -> Result<(Vec<RunTables>, Vec<SkippedFolder>), ReportError> {
        open_each(roots, RunTables::open)
    }

    /// Returns the name of the run's folder.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the folder of the run.
    pub fn root(&self) -> &Path {
        self.reader.path()
    }

    /// Returns the recipe of the run.
    pub fn recipe(&self) -> &Recipe {
        &self.plan.recipe
    }

    /// Returns the text of the run's scene.toml.
    pub fn scene_toml(&self) -> &str {
        &self.record().scene_toml
    }

    /// Returns the warnings about the scene.
    pub fn warnings(&self) -> impl Iterator<Item = &str> {
        self.plan.warnings.iter().map(String::as_str)
    }

    /// Returns the record of the run: the content of `run.json`.
    pub fn record(&self) -> &RunRecord {
        self.reader.record()
    }

    /// Returns the store's reader of the run.
    pub fn reader(&self) -> &RunReader {
        &self.reader
    }

    /// Returns the damage of the run. The damaged iteration and all later ones are omitted.
    pub fn damage(&self) -> Vec<Damage> {
        damage_of(&self.reader)
    }

    /// Returns the stored iterations that verify, ascending. Every run has at least one iteration that verifies.
    pub fn iterations(&self) -> &[u64] {
        &self.iterations
    }

    /// Returns the last of the iterations.
    pub fn latest(&self) -> u64 {
        self.latest
    }

    /// Reads a table of all iterations into one frame. Returns `None` if the run lacks the table.
    ///
    /// The frame has the column [`super::WEAR_ITERATION`], then the columns of the table. Rows are sorted by iteration.
    /// A table with one row per iteration includes pruned iterations.
    ///
    /// # Errors
    /// Returns [`ReportError::Run`] for a table that cannot be read. Returns [`ReportError::Scan`] if the table library
    /// fails.
    pub fn series(&self, table: TableName) -> Result<Option<DataFrame>, ReportError> {
        let mut scan = Scan::new(table);
        scan.add(0, &self.name, &self.reader)?;
        if scan.is_empty() {
            return Ok(None);
        }
        let failed = |source| self.scan_error(table, source);
        let frame = scan.lazy_frame().and_then(|rows| rows.collect());
        let mut frame = frame.map_err(failed)?;
        for name in [RUN_INDEX, RUN] {
            frame.drop_in_place(name).map_err(failed)?;
        }
        // The frame has all columns of the schema. The columns of absent physics are null.
        let absent: Vec<PlSmallStr> = frame
            .get_columns()
            .iter()
            .filter(|column| !column.is_empty() && column.null_count() == column.len())
            .map(|column| column.name().clone())
            .collect();
        Ok(Some(frame.drop_many(absent)))
    }

    /// Reads the history of the run: the rows and costs of all iterations.
    ///
    /// # Errors
    /// Returns [`ReportError::Run`] for a table that cannot be read.
    pub fn history(&self) -> Result<History, ReportError> {
        let history = self.reader.history();
        history.map_err(|source| self.run_error(source))
    }

    /// Reads a table of one iteration. Returns `None` if the iteration does not have it.
    ///
    /// # Errors
    /// Returns [`ReportError::Run`] if the iteration does not exist, or if the table cannot be read.
    pub fn iteration_table(
        &self,
        wear_iteration: u64,
        table: TableName,
    ) -> Result<Option<DataFrame>, ReportError> {
        match self.reader.read(wear_iteration, table) {
            Ok(rows) => self.frame(table, &rows).map(Some),
            Err(StoreError::NoTable { .. }) => Ok(None),
            Err(source) => Err(self.run_error(source)),
        }
    }

    /// Reads a table that a run stores once. Returns `None` if the run does not have it.
    ///
    /// # Errors
    /// Returns [`ReportError::Run`] for a table that cannot be read.
    pub fn run_table(&self, table: TableName) -> Result<Option<DataFrame>, ReportError> {
        match self.reader.read_once(table) {
            Ok(rows) => rows.map(|rows| self.frame(table, &rows)).transpose(),
            Err(source) => Err(self.run_error(source)),
        }
    }

    fn frame(&self, name: TableName, table: &Table) -> Result<DataFrame, ReportError> {
        frame(table).map_err(|source| self.scan_error(name, source))
    }

    fn run_error(&self, source: StoreError) -> ReportError {
        ReportError::Run {
            run: self.root().to_owned(),
            source,
        }
    }

    fn scan_error(&self, table: TableName, source: PolarsError) -> ReportError {
        ReportError::Scan {
            table,
            runs: self.root().display().to_string(),
            source,
        }
    }
}

/// Scans a table of all iterations of several runs into one lazy frame. Returns `None` if no run has the table.
///
/// The frame has the columns [`RUN_INDEX`], [`RUN`] (the name) and [`super::WEAR_ITERATION`], then the columns of the
/// table's schema. A column is null where a run lacks the column. Rows are sorted by run, in the given order, then by
/// iteration.
///
/// # Errors
/// As for [`RunTables::series`].
pub fn scan_runs(runs: &[RunTables], table: TableName) -> Result<Option<LazyFrame>, ReportError> {
    let mut scan = Scan::new(table);
    for (order, run) in runs.iter().enumerate() {
        scan.add(order, &run.name, &run.reader)?;
    }
    if scan.is_empty() {
        return Ok(None);
    }
    let names: Vec<&str> = runs.iter().map(RunTables::name).collect();
    scan.lazy_frame()
        .map(Some)
        .map_err(|source| ReportError::Scan {
            table,
            runs: names.join(", "),
            source,
        })
}

/// Returns the values of a column of numbers or flags (1 for true). Returns `None` if the frame lacks the column. A
/// null is NaN.
pub fn numeric_column(frame: &DataFrame, column: &str) -> Option<Vec<f64>> {
    let column = frame.column(column).ok()?;
    let floats = column.cast(&DataType::Float64).ok()?;
    let floats = floats.f64().ok()?;
    Some(
        floats
            .iter()
            .map(|value| value.unwrap_or(f64::NAN))
            .collect(),
    )
}

/// Returns the values of a column of texts. Returns `None` if the frame lacks the column.
pub fn text_column(frame: &DataFrame, column: &str) -> Option<Vec<String>> {
    let texts = frame.column(column).ok()?.str().ok()?;
    Some(
        texts
            .iter()
            .map(|text| text.unwrap_or_default().to_owned())
            .collect(),
    )
}

/// Opens a run, which must have at least one iteration.
pub(super) fn open(run: &Path) -> Result<RunReader, ReportError> {
    let reader =
        RunReader::open(Arc::new(RealFileSystem), run).map_err(|source| ReportError::Run {
            run: run.to_owned(),
            source,
        })?;
    match reader.latest() {
        Some(_) => Ok(reader),
        None => Err(ReportError::Empty {
            run: run.to_owned(),
            damage: damage_of(&reader),
        }),
    }
}

/// Returns the damage of the iterations.
pub(super) fn damage_of(reader: &RunReader) -> Vec<Damage> {
    let reports = reader.reports().iter();
    reports.flat_map(|report| report.damage.clone()).collect()
}

/// Returns the last component of a path. For `.` and `..`, returns the name of the folder.
fn name_of(root: &Path) -> String {
    let last_component = |path: &Path| Some(path.file_name()?.to_string_lossy().into_owned());
    let absolute = || last_component(&std::fs::canonicalize(root).ok()?);
    last_component(root)
        .or_else(absolute)
        .unwrap_or_else(|| PathBuf::from(root).display().to_string())
}

/// Converts a table of the store to a frame.
fn frame(table: &Table) -> PolarsResult<DataFrame> {
    let columns = table
        .columns()
        .map(|(schema, values)| column(&schema.name, values))
        .collect();
    DataFrame::new(columns)
}
