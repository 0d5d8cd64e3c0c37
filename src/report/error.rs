//! Why runs cannot be read together, or what is made of them not written.

use std::path::PathBuf;

use polars::error::PolarsError;

use super::plot::PlotError;
use super::text::continuation;
use crate::scene::SceneError;
use crate::store::StoreError;
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
    },
    /// A folder whose name is not UTF-8, which the table reader requires.
    #[error("{}: the name must be UTF-8 for its tables to be scanned", run.display())]
    Name {
        /// Folder of the run.
        run: PathBuf,
        /// The error of the table library.
        source: PolarsError,
    },
    /// The scene that a run keeps.
    #[error("{}: the scene kept in the run cannot be read: {source}", run.display())]
    Scene {
        /// Folder of the run.
        run: PathBuf,
        /// What is wrong with it.
        source: Box<SceneError>,
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
    /// A figure that the drawing library refuses.
    #[error("cannot draw the figure {figure}: {source}")]
    Draw {
        /// Name of the figure.
        figure: &'static str,
        /// What the drawing library says.
        source: PlotError,
    },
    /// A file that cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// A Parquet file that cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Parquet {
        /// The file.
        path: PathBuf,
        /// The error of the table library.
        source: PolarsError,
    },
    /// A table of this program that cannot be made.
    #[error("cannot make {}: {source}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<TableError>,
    },
    /// A CSV file that cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Csv {
        /// The file.
        path: PathBuf,
        /// The error of the format library.
        source: csv::Error,
    },
}

impl ReportError {
    /// True for a folder that is no run, or a run without an iteration.
    pub fn is_nothing_to_read(&self) -> bool {
        matches!(
            self,
            ReportError::Empty { .. }
                | ReportError::Run {
                    source: StoreError::NoRun { .. },
                    ..
                }
        )
    }

    /// True for a run that is damaged or of another format, rather than absent or empty.
    pub fn is_damage_or_mismatch(&self) -> bool {
        match self {
            ReportError::Run { source, .. } => source.is_damage_or_mismatch(),
            ReportError::Scene { .. } => true,
            _ => false,
        }
    }
}
