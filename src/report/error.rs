//! Why runs cannot be read together, or what is made of them not written.

use std::path::PathBuf;

use polars::error::PolarsError;

use super::skipped_folders::SkippedFolder;
use super::text::continuation;
use crate::store::{Damage, StoreError};
use crate::tables::{TableError, TableName};

/// Runs that cannot be read, or do not go into one table, or a file that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A folder that is no run, or a run that cannot be read.
    #[error("{source}")]
    Run {
        /// Folder of the run.
        run: PathBuf,
        /// What is wrong with it.
        source: StoreError,
    },
    /// A run without a committed iteration that verifies.
    #[error(
        "{}: no iteration that verifies; `{}` computes the first",
        run.display(), continuation(run)
    )]
    Empty {
        /// Folder of the run.
        run: PathBuf,
        /// Why those that are there do not verify.
        damage: Vec<Damage>,
    },
    /// Several folders, none of which is a run that can be read.
    #[error("no run to read among {} folders: {}", passed_over.len(), reasons(passed_over))]
    NoneLeft {
        /// The folders, each with the reason.
        passed_over: Vec<SkippedFolder>,
    },
    /// Tables that do not join.
    #[error("the tables `{table}` of {runs} cannot be read together: {source}")]
    Scan {
        /// The table.
        table: TableName,
        /// Folders of the runs.
        runs: String,
        /// The error of the table library.
        source: PolarsError,
    },
    /// A file that cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// A table of this program that cannot be made.
    #[error("cannot make {}: {source}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<TableError>,
    },
}

impl ReportError {
    /// True for a folder that is no run, or a run without an iteration.
    pub fn is_no_run(&self) -> bool {
        match self {
            ReportError::Run { source, .. } => matches!(
                source,
                StoreError::NoRun { .. } | StoreError::NoFolder { .. }
            ),
            ReportError::Empty { damage, .. } => damage.is_empty(),
            ReportError::NoneLeft { .. } => !self.is_damage_or_mismatch(),
            _ => false,
        }
    }

    /// True for a run that is damaged or of another format, rather than absent or empty.
    pub fn is_damage_or_mismatch(&self) -> bool {
        match self {
            ReportError::Run { source, .. } => source.is_damage_or_mismatch(),
            ReportError::Empty { damage, .. } => !damage.is_empty(),
            ReportError::NoneLeft { passed_over } => {
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
