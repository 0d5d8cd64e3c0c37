//! Paths of the files in a run folder. Only the module `layout` contains the names of the files in a run folder.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use crate::tables::{TableLocation, TableName};

const ONCE: &str = "once";
const ITERATIONS: &str = "iterations";
const ITERATION_PREFIX: &str = "wear_iteration=";

/// The files and folders of a run. The store neither reads nor changes other entries of the folder.
pub(super) const FILES: [&str; 11] = [
    "scene.toml",
    "scene.original.toml",
    "log.txt",
    "failure.json",
    "plan.json",
    "run.json",
    "run.copy.json",
    "copying.json",
    "schemas.json",
    "history.parquet",
    "lock",
];
pub(super) const FOLDERS: [&str; 4] = [ONCE, ITERATIONS, "staging", "damaged"];
/// Entries that exist only after `run.json` was written.
pub(super) const ENTRIES_AFTER_RECORD: [&str; 2] = ["failure.json", "damaged"];

/// Paths of a run.
#[derive(Debug, Clone)]
pub struct Layout {
    pub(super) root: PathBuf,
}

impl Layout {
    /// Returns the file paths of a run in the folder `root`, even if the folder contains no run.
    pub fn at(root: &Path) -> Layout {
        Layout {
            root: root.to_owned(),
        }
    }
    /// The resolved scene.
    pub fn scene(&self) -> PathBuf {
        self.root.join("scene.toml")
    }
    /// Log of the run for the user. The program does not read the log.
    pub fn log(&self) -> PathBuf {
        self.root.join("log.txt")
    }
    /// The scene as the user wrote the scene. Reports show `scene.original.toml`, but no result depends on the file.
    pub(super) fn written_scene(&self) -> PathBuf {
        self.root.join("scene.original.toml")
    }
    pub(super) fn plan(&self) -> PathBuf {
        self.root.join("plan.json")
    }
    /// The record of the run. A folder without `run.json` is not a run yet.
    pub fn record(&self) -> PathBuf {
        self.root.join("run.json")
    }
    /// The meaning of the columns of all tables.
    pub(super) fn schemas(&self) -> PathBuf {
        self.root.join("schemas.json")
    }
    pub(super) fn history(&self) -> PathBuf {
        self.root.join("history.parquet")
    }
    /// The copy of `run.json`.
    pub(super) fn record_copy(&self) -> PathBuf {
        self.root.join("run.copy.json")
    }
    /// The reason why the last start failed. The next start removes `failure.json`.
    pub(super) fn failure(&self) -> PathBuf {
        self.root.join("failure.json")
    }
    /// Marker that exists while the start of a sibling is copied.
    pub(super) fn copying(&self) -> PathBuf {
        self.root.join("copying.json")
    }
    /// The lock file of the process that writes the run.
    pub fn lock(&self) -> PathBuf {
        self.root.join("lock")
    }
    pub(super) fn once(&self) -> PathBuf {
        self.root.join(ONCE)
    }
    /// A table of `once/`.
    pub fn once_table(&self, table: TableName) -> PathBuf {
        self.once().join(table.file_name())
    }
    pub(super) fn iterations(&self) -> PathBuf {
        self.root.join(ITERATIONS)
    }
    pub(super) fn iteration(&self, wear_iteration: u64) -> PathBuf {
        self.iterations().join(iteration_name(wear_iteration))
    }
    pub(super) fn commit(&self, wear_iteration: u64) -> PathBuf {
        self.iteration(wear_iteration).join(COMMIT_FILE)
    }
    pub(super) fn staging(&self) -> PathBuf {
        self.root.join("staging")
    }
    pub(super) fn draft(&self, wear_iteration: u64) -> PathBuf {
        self.staging().join(iteration_name(wear_iteration))
    }
    /// The keys of a draft's tables, outside the draft so that its folder can be renamed as it is.
    pub(super) fn draft_keys(&self, wear_iteration: u64) -> PathBuf {
        self.staging().join(format!("keys-{wear_iteration}"))
    }
    pub(super) fn staged_once(&self) -> PathBuf {
        self.staging().join(ONCE)
    }
    pub(super) fn discarded(&self) -> PathBuf {
        self.staging().join("discarded")
    }
    pub(super) fn damaged(&self) -> PathBuf {
        self.root.join("damaged")
    }
    /// True if the record of the run or its copy exists.
    pub fn has_record(&self) -> bool {
        self.record().exists() || self.record_copy().exists()
    }
    /// True if the folder contains a run. A run without a record counts as a run.
    pub fn is_of_run(&self) -> bool {
        self.has_record() || self.iterations().exists()
    }
}

/// Returns the file of a table, relative to the folder of its run. `*` for the iteration means all iterations. A table
/// outside of runs has only its file name.
pub fn table_file(table: TableName, wear_iteration: impl Display) -> String {
    let file = table.file_name();
    match table.schema().place {
        TableLocation::Once => format!("{ONCE}/{file}"),
        TableLocation::Iteration => {
            format!("{ITERATIONS}/{ITERATION_PREFIX}{wear_iteration}/{file}")
        }
        TableLocation::Beside => file,
    }
}

/// Name of the manifest in an iteration's folder.
pub(super) const COMMIT_FILE: &str = "commit.json";

/// Returns the folder name of an iteration: unpadded, as readers of partitioned tables expect it.
pub(super) fn iteration_name(wear_iteration: u64) -> String {
    format!("{ITERATION_PREFIX}{wear_iteration}")
}

/// Parses the iteration from a folder name.
pub(super) fn iteration_of(name: &str) -> Option<u64> {
    let number = name.strip_prefix(ITERATION_PREFIX)?.parse().ok()?;
    (iteration_name(number) == name).then_some(number)
}
