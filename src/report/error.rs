//! Errors of reading runs and of writing their reports.

use std::path::PathBuf;

use polars::error::PolarsError;

use super::skipped_folders::SkippedFolder;
use super::text::continue_command;
use crate::store::{Damage, StoreError};
use crate::tables::{TableError, TableName};

/// Error of reading runs, of joining their tables, or of writing a report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The folder is not a run, or the run cannot be read.
    #[error("{source}")]
    Run {
        /// Folder of the run.
        run: PathBuf,
        /// Error of the store.
        source: StoreError,
    },
    /// The run has no committed iteration that verifies.
    #[error(
        "{}: no iteration verifies; run `{}` to compute the first one",
        run.display(), continue_command(run)
    )]
    Empty {
        /// Folder of the run.
        run: PathBuf,
        /// Damage of the iterations that do not verify.
        damage: Vec<Damage>,
    },
    /// None of several folders is a readable run.
    #[error("no readable run among {} folders: {}", passed_over.len(), reasons(passed_over))]
    NoReadableRun {
        /// The skipped folders, each with the reason.
        passed_over: Vec<SkippedFolder>,
    },
    /// The tables of the runs do not join.
    #[error("the tables `{table}` of {runs} cannot be read together: {source}")]
    Scan {
        /// The table.
        table: TableName,
        /// Folders of the runs.
        runs: String,
        /// The error of the table library.
        source: PolarsError,
    },
    /// The file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The program cannot create a table of the report.
    #[error("cannot make {}: {source}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// Error of the table.
        source: Box<TableError>,
    },
}

impl ReportError {
    /// Returns true for a folder that is not a run, or a run without an iteration.
    pub fn is_no_run(&self) -> bool {
        match self {
            ReportError::Run { source, .. } => matches!(
                source,
                StoreError::NoRun { .. } | StoreError::FileInsteadOfFolder { .. }
            ),
            ReportError::Empty { damage, .. } => damage.is_empty(),
            ReportError::NoReadableRun { .. } => !self.is_damage_or_mismatch(),
            _ => false,
        }
    }

    /// Returns true if a run is damaged or has another format. Returns false if the run is absent or empty.
    pub fn is_damage_or_mismatch(&self) -> bool {
        match self {
            ReportError::Run { source, .. } => source.is_damage_or_mismatch(),
            ReportError::Empty { damage, .. } => !damage.is_empty(),
            ReportError::NoReadableRun { passed_over } => {
                passed_over.iter().any(SkippedFolder::is_damage_or_mismatch)
            }
            _ => false,
        }
    }
}

fn reasons(passed_over: &[SkippedFolder]) -> String {
    passed_over
        .iter()
        .map(|each| format!("{}: {}", each.path().display(), each.reason()))
        .collect::<Vec<_>>()
        .join("; ")
}
