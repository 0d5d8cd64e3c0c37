//! A run open for reading, its tables as frames.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use polars::prelude::*;

use super::ReportError;
use super::scan::{ORDER, RUN, Scan, column};
use super::skipped_folders::{SkippedFolder, open_each};
use crate::recipe::{Recipe, StoredPlan};
use crate::store::{Damage, History, RealFileSystem, RunReader, RunRecord, StoreError};
use crate::tables::{Table, TableName};

/// A run open for reading, also one that another process computes.
///
/// Its iterations count as far as their chain of commits verifies; what does not is listed by [`RunTables::damage`].
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
    /// [`ReportError::Run`] for a folder that is no readable run, [`ReportError::Empty`] for a run without an iteration.
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

    /// Opens the runs among several folders, as `runs/*` names them, and says what it passes over.
    ///
    /// # Errors
    /// [`ReportError::NoneLeft`] if none is a run; those of [`RunTables::open`] for a path given alone, one that nothing has, and a
    /// run that the system does not let be read.
    pub fn open_all(
        roots: &[PathBuf],
    ) -> Result<(Vec<RunTables>, Vec<SkippedFolder>), ReportError> {
        open_each(roots, RunTables::open)
    }

    /// Name of the run's folder.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Folder of the run.
    pub fn root(&self) -> &Path {
        self.reader.path()
    }

    /// What the run was computed by.
    pub fn recipe(&self) -> &Recipe {
        &self.plan.recipe
    }

    /// The text of the scene as kept in the run.
    pub fn scene_toml(&self) -> &str {
        &self.record().scene_toml
    }

    /// What was doubtful of the scene before it ran.
    pub fn warnings(&self) -> impl Iterator<Item = &str> {
        self.plan.warnings.iter().map(String::as_str)
    }

    /// What the run is and how it came about, the content of `run.json`.
    pub fn record(&self) -> &RunRecord {
        self.reader.record()
    }

    /// The store's reader of the run.
    pub fn reader(&self) -> &RunReader {
        &self.reader
    }

    /// What did not verify; the iterations from there on do not count.
    pub fn damage(&self) -> Vec<Damage> {
        damage_of(&self.reader)
    }

    /// The iterations that count and are kept, ascending; there is one at least.
    pub fn iterations(&self) -> &[u64] {
        &self.iterations
    }

    /// The last of them.
    pub fn latest(&self) -> u64 {
        self.latest
    }

    /// A table of all iterations that have it, of a one-row table pruned ones too, as one frame: [`super::WEAR_ITERATION`] first, then the
    /// columns of the table, sorted by iteration; `None` where the run has no such table.
    ///
    /// # Errors
    /// [`ReportError::Run`] for a table that cannot be read, also one damaged since the run was opened, [`ReportError::Scan`].
    pub fn series(&self, table: TableName) -> Result<Option<DataFrame>, ReportError> {
        let mut scan = Scan::of(table);
        scan.add(0, &self.name, &self.reader)?;
        if scan.is_empty() {
            return Ok(None);
        }
        let failed = |source| self.scan_error(table, source);
        let frame = scan.lazy().and_then(|rows| rows.collect());
        let mut frame = frame.map_err(failed)?;
        for name in [ORDER, RUN] {
            frame.drop_in_place(name).map_err(failed)?;
        }
        // The schema's columns are all there, null where the run lacks the physics.
        let absent: Vec<PlSmallStr> = frame
            .get_columns()
            .iter()
            .filter(|column| !column.is_empty() && column.null_count() == column.len())
            .map(|column| column.name().clone())
            .collect();
        Ok(Some(frame.drop_many(absent)))
    }

    /// What all iterations say in one row each, and what they took.
    ///
    /// # Errors
    /// [`ReportError::Run`] for a table that cannot be read.
    pub fn history(&self) -> Result<History, ReportError> {
        let history = self.reader.history();
        history.map_err(|source| self.run_error(source))
    }

    /// A table of one iteration; `None` where that has none.
    ///
    /// # Errors
    /// [`ReportError::Run`] for an iteration that is not there and for a table that cannot be read.
    pub fn at(
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

    /// A table that is written once a run; `None` where the run has none.
    ///
    /// # Errors
    /// [`ReportError::Run`] for a table that cannot be read.
    pub fn once(&self, table: TableName) -> Result<Option<DataFrame>, ReportError> {
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

/// A table of all iterations of several runs as one lazy frame: [`ORDER`], [`RUN`] (the name), [`super::WEAR_ITERATION`], then the
/// columns of the table's schema, null where a run lacks them; sorted by run, in the order given, and iteration. `None` where no
/// run has the table.
///
/// # Errors
/// As for [`RunTables::series`].
pub fn scan_runs(runs: &[RunTables], table: TableName) -> Result<Option<LazyFrame>, ReportError> {
    let mut scan = Scan::of(table);
    for (order, run) in runs.iter().enumerate() {
        scan.add(order, &run.name, &run.reader)?;
    }
    if scan.is_empty() {
        return Ok(None);
    }
    let names: Vec<&str> = runs.iter().map(RunTables::name).collect();
    scan.lazy().map(Some).map_err(|source| ReportError::Scan {
        table,
        runs: names.join(", "),
        source,
    })
}

/// The values of a column of numbers or flags (1 for true); `None` where the frame has no such column. A row without a value is
/// NaN.
pub fn numbers(frame: &DataFrame, column: &str) -> Option<Vec<f64>> {
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

/// The values of a column of texts; `None` where the frame has no such column.
pub fn texts(frame: &DataFrame, column: &str) -> Option<Vec<String>> {
    let texts = frame.column(column).ok()?.str().ok()?;
    Some(
        texts
            .iter()
            .map(|text| text.unwrap_or_default().to_owned())
            .collect(),
    )
}

/// Opens a run that has an iteration.
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

/// What does not verify of the iterations.
pub(super) fn damage_of(reader: &RunReader) -> Vec<Damage> {
    let reports = reader.reports().iter();
    reports.flat_map(|report| report.damage.clone()).collect()
}

/// The last name of a path, also of `.` and `..`.
fn name_of(root: &Path) -> String {
    let named = |path: &Path| Some(path.file_name()?.to_string_lossy().into_owned());
    let absolute = || named(&std::fs::canonicalize(root).ok()?);
    named(root)
        .or_else(absolute)
        .unwrap_or_else(|| PathBuf::from(root).display().to_string())
}

/// A table of the store as a frame.
fn frame(table: &Table) -> PolarsResult<DataFrame> {
    let columns = table
        .columns()
        .map(|(schema, values)| column(&schema.name, values))
        .collect();
    DataFrame::new(columns)
}
