//! Errors of a run on disk.

use super::file_system::EntryKind;
use super::record::LAYOUT;
use crate::json::KeyChange;
use crate::tables::TableError;
use std::fmt::{self, Display};
use std::io;
use std::path::PathBuf;

/// Failure to open, read or write a run.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file system reported an error.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// The requested action, as `"read"`.
        action: &'static str,
        /// The path.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// Another process has the lock of the run and writes the run.
    #[error("{} is being written by {}; wait for it or stop it", path.display(), process(*pid))]
    Locked {
        /// The run.
        path: PathBuf,
        /// The process that has the lock, if known.
        pid: Option<u32>,
    },
    /// The scene differs from the scene of the run in keys that affect committed results.
    #[error(
        "{} was computed from another scene: {}; {}start a new run, or a sibling with --from",
        path.display(), list(keys), if *edited { EDITED } else { "" }
    )]
    SceneChanged {
        /// The run.
        path: PathBuf,
        /// The keys that differ.
        keys: Vec<KeyChange>,
        /// True if `scene.toml` in the run was edited.
        edited: bool,
    },
    /// The scene cannot continue from the state of another run.
    #[error(
        "a run that continues {} must keep its joint, but the scene changes it: {}; start a new run without --from",
        path.display(), list(keys)
    )]
    NotInherited {
        /// The run to continue from.
        path: PathBuf,
        /// The keys that differ.
        keys: Vec<KeyChange>,
    },
    /// A folder with other content than a run.
    #[error("{} is not a run: it has no run.json but contains `{found}`; choose another folder", path.display())]
    NotARun {
        /// The folder.
        path: PathBuf,
        /// An entry that an unfinished run cannot have.
        found: String,
    },
    /// A link, a pipe or a device where a run must have a file or a folder.
    #[error(
        "{} is {}, but must be {}: a run follows no link in its folder, so that it changes nothing outside; remove it, or replace it by a copy of its target (to keep a run on another disk, link its whole folder)",
        path.display(), kind(*found), kind(*expected)
    )]
    UnexpectedEntryKind {
        /// The path.
        path: PathBuf,
        /// The kind of entry at the path.
        found: EntryKind,
        /// The kind of entry that a run has there.
        expected: EntryKind,
    },
    /// The folder to be read does not exist or contains no run.
    #[error("there is no run at {}: run.json is missing", path.display())]
    NoRun {
        /// The folder.
        path: PathBuf,
    },
    /// A file where the folder of a run should be.
    #[error("{} is a file, but a run is a folder: `fretwear run NAME.toml` writes runs/NAME, and `fretwear status` lists the runs", path.display())]
    FileInsteadOfFolder {
        /// The file.
        path: PathBuf,
    },
    /// A file of the run does not verify.
    #[error("damaged run: {0}")]
    Damaged(Damage),
    /// The run has another layout.
    #[error(
        "the run {} has layout {found}{}; this program reads only layout {LAYOUT}: continue the run with the program that made it, or start a new run in another folder",
        path.display(), program.as_ref().map_or(String::new(), |program| format!(" of fretwear {program}"))
    )]
    OtherLayout {
        /// The run.
        path: PathBuf,
        /// The layout number of the run.
        found: u64,
        /// Version and commit of the program that created the run, if `run.json` states the version and the commit.
        program: Option<String>,
    },
    /// The program cannot read the `plan.json` of the run.
    #[error(
        "cannot read {}: {reason}; run `fretwear verify`: if it reports damage, `fretwear run` rewrites the file, else continue the run with fretwear {program_version}, which made it",
        path.display()
    )]
    Plan {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
        /// Version of the program at the last recorded start.
        program_version: String,
    },
    /// An iteration that does not exist, or no longer.
    #[error("{} has no iteration {wear_iteration}; it has {}", path.display(), ranges(remaining))]
    NoIteration {
        /// The run.
        path: PathBuf,
        /// The requested iteration.
        wear_iteration: u64,
        /// The existing iterations, ascending.
        remaining: Vec<u64>,
    },
    /// A table that an iteration, or the run, does not have.
    #[error("{} has no table `{table}`; it has {}", path.display(), known.join(", "))]
    NoTable {
        /// The folder that was searched.
        path: PathBuf,
        /// The requested table.
        table: String,
        /// The existing tables.
        known: Vec<String>,
    },
    /// A draft of another iteration than the next one.
    #[error("cannot write iteration {wear_iteration} now: the next iteration of {} is {next}", path.display())]
    OutOfOrder {
        /// The run.
        path: PathBuf,
        /// The requested iteration.
        wear_iteration: u64,
        /// The next iteration.
        next: u64,
    },
    /// A table whose columns differ from the columns in the previous iteration.
    #[error(
        "the table `{table}` of iteration {wear_iteration} would have the columns {}, but in the previous iteration it has {}",
        found.join(", "), expected.join(", ")
    )]
    ColumnsChanged {
        /// The table.
        table: String,
        /// The iteration to be committed.
        wear_iteration: u64,
        /// Its columns.
        found: Vec<String>,
        /// The columns in the previous iteration.
        expected: Vec<String>,
    },
    /// The disk has too little free space for a write.
    #[error("{} has {free} bytes of free space; {needed} are needed", path.display())]
    NoSpace {
        /// The path of the write.
        path: PathBuf,
        /// Free bytes.
        free: u64,
        /// Required bytes.
        needed: u64,
    },
    /// A sibling run whose copy was interrupted, opened without its source.
    #[error(
        "{} is an unfinished copy of {source_run}, iteration {wear_iteration}; start it again with --from {source_run}@{wear_iteration}",
        path.display()
    )]
    UnfinishedSibling {
        /// The run.
        path: PathBuf,
        /// Name of the source run.
        source_run: String,
        /// The iteration to continue from.
        wear_iteration: u64,
    },
    /// The existing run has another origin than `--from` says.
    #[error("{} exists and began {found}, not from {expected}; choose another folder", path.display())]
    OtherOrigin {
        /// The run.
        path: PathBuf,
        /// The origin of the run.
        found: String,
        /// The requested origin.
        expected: String,
    },
    /// A table violates the schema of the table, or a file contains another table.
    #[error("{}: {source}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// The error of the table.
        source: Box<TableError>,
    },
    /// A value that cannot be written as JSON.
    #[error("{} cannot be written as JSON: {source}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// The error of the serializer.
        source: serde_json::Error,
    },
}

impl StoreError {
    /// True for a damaged or mismatched run; false for a failure of the system or the program.
    pub fn is_damage_or_mismatch(&self) -> bool {
        match self {
            StoreError::SceneChanged { .. }
            | StoreError::NotInherited { .. }
            | StoreError::NotARun { .. }
            | StoreError::UnexpectedEntryKind { .. }
            | StoreError::Damaged(_)
            | StoreError::OtherLayout { .. }
            | StoreError::Plan { .. }
            | StoreError::UnfinishedSibling { .. }
            | StoreError::OtherOrigin { .. } => true,
            StoreError::Table { source, .. } => matches!(
                **source,
                TableError::OtherTable { .. }
                    | TableError::NotOurs { .. }
                    | TableError::Parquet { .. }
            ),
            _ => false,
        }
    }
}

/// A damaged file of a run.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: {kind}", path.display())]
pub struct Damage {
    /// The file or folder.
    pub path: PathBuf,
    /// The kind of damage.
    pub kind: DamageKind,
}

/// Kind of damage of a file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DamageKind {
    /// The file is missing.
    #[error("missing")]
    Missing,
    /// The length differs from the length in the commit.
    #[error("{found} bytes long, but {expected} were committed")]
    Size {
        /// Committed length.
        expected: u64,
        /// Actual length.
        found: u64,
    },
    /// The content differs from the committed content.
    #[error("content has hash {found}, but {expected} was committed")]
    Hash {
        /// Committed hash.
        expected: String,
        /// Actual hash.
        found: String,
    },
    /// The content cannot be parsed.
    #[error("not readable ({reason})")]
    Unreadable {
        /// The error of the parser.
        reason: String,
    },
    /// A commit in the folder of another iteration.
    #[error("is the commit of iteration {found}, not {expected}")]
    Iteration {
        /// Number of the folder.
        expected: u64,
        /// Number in the commit.
        found: u64,
    },
    /// A commit whose parent is not the previous commit.
    #[error(
        "follows {}, but the iteration before it is {}",
        hash(found),
        hash(expected)
    )]
    Parent {
        /// Hash of the previous commit.
        expected: Option<String>,
        /// Hash of the previous commit, as stored in the damaged commit.
        found: Option<String>,
    },
    /// The commit is sound but follows a damaged commit.
    #[error("follows the damaged iteration {0}")]
    After(u64),
}

const EDITED: &str = "its scene.toml was edited after the run wrote it: remove that file and continue with `--run` alone, which uses the scene in run.json, or ";

fn kind(kind: EntryKind) -> &'static str {
    match kind {
        EntryKind::File => "a file",
        EntryKind::Folder => "a folder",
        EntryKind::Link => "a link",
        EntryKind::Other => "a pipe, a socket or a device",
    }
}

fn process(pid: Option<u32>) -> String {
    pid.map_or("another process".to_owned(), |pid| format!("process {pid}"))
}

fn hash(hash: &Option<String>) -> &str {
    hash.as_deref().unwrap_or("nothing")
}

/// Joins items by `; `.
pub(super) fn list<T: Display>(items: &[T]) -> String {
    items
        .iter()
        .map(ToString::to_string)
        .collect::<Vec<_>>()
        .join("; ")
}

/// Formats ascending numbers. A range replaces consecutive numbers: `0, 50, 98-100`.
pub(super) fn ranges(numbers: &[u64]) -> String {
    struct Range(u64, u64);
    impl Display for Range {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            if self.0 == self.1 {
                write!(f, "{}", self.0)
            } else {
                write!(f, "{}-{}", self.0, self.1)
            }
        }
    }
    let mut stretches: Vec<Range> = Vec::new();
    for &number in numbers {
        match stretches.last_mut() {
            Some(last) if last.1 + 1 == number => last.1 = number,
            _ => stretches.push(Range(number, number)),
        }
    }
    if stretches.is_empty() {
        return "none".to_owned();
    }
    stretches
        .iter()
        .map(ToString::to_string)
        .collect::<Vec<_>>()
        .join(", ")
}
