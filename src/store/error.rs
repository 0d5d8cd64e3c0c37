//! What can go wrong with a run on disk.

use super::file_system::EntryKind;
use super::record::LAYOUT;
use crate::json::KeyChange;
use crate::tables::TableError;
use std::fmt::{self, Display};
use std::io;
use std::path::PathBuf;

/// A run that cannot be opened, read or written as asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// What was asked of the system, as `"read"`.
        action: &'static str,
        /// Where.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// Another process writes this run.
    #[error("{} is being written by {}; wait for it or stop it", path.display(), process(*pid))]
    Locked {
        /// The run.
        path: PathBuf,
        /// The process that holds the lock, if known.
        pid: Option<u32>,
    },
    /// The scene differs from the one of the run in keys that alter what is already computed.
    #[error(
        "{} was computed from another scene: {}; {}begin another run, or a sibling with --from",
        path.display(), list(keys), if *edited { EDITED } else { "" }
    )]
    SceneChanged {
        /// The run.
        path: PathBuf,
        /// What differs.
        keys: Vec<KeyChange>,
        /// True if `scene.toml` in the run is not as the run wrote it.
        edited: bool,
    },
    /// A scene that cannot go on from the state of another run.
    #[error(
        "a run from {} cannot have another joint: {}; begin a run of its own",
        path.display(), list(keys)
    )]
    NotInherited {
        /// The run to begin from.
        path: PathBuf,
        /// What differs.
        keys: Vec<KeyChange>,
    },
    /// A folder that holds something else than a run.
    #[error("{} is not a run: it has no run.json but holds `{found}`; give another folder", path.display())]
    NotARun {
        /// The folder.
        path: PathBuf,
        /// An entry that no run has there.
        found: String,
    },
    /// A link, a pipe or a device where a run has a file or a folder.
    #[error(
        "{} is {}; a run has {} there and follows no link, so that nothing outside of it is touched: remove it, or copy there what belongs there (to keep a run on another disk, link its whole folder)",
        path.display(), kind(*found), kind(*expected)
    )]
    NotPlain {
        /// Where.
        path: PathBuf,
        /// What stands there.
        found: EntryKind,
        /// What a run has there.
        expected: EntryKind,
    },
    /// A folder to be read that holds no run, or does not exist.
    #[error("there is no run at {}: run.json is missing", path.display())]
    NoRun {
        /// The folder.
        path: PathBuf,
    },
    /// A file in place of the folder of a run.
    #[error("{} is a file, but a run is a folder: `fretwear run NAME.toml` writes runs/NAME, and `fretwear status` lists the runs", path.display())]
    NoFolder {
        /// The file.
        path: PathBuf,
    },
    /// A file of the run does not verify.
    #[error("damaged run: {0}")]
    Damaged(Damage),
    /// A run of another layout.
    #[error(
        "the run {} has layout {found}{}; this program reads only layout {LAYOUT}: continue the run with the program that made it, or start a new run in another folder",
        path.display(), program.as_ref().map_or(String::new(), |program| format!(" of fretwear {program}"))
    )]
    OtherLayout {
        /// The run.
        path: PathBuf,
        /// Number of its layout.
        found: u64,
        /// Version and commit of the program that began it, if `run.json` says.
        program: Option<String>,
    },
    /// A `plan.json` that this program cannot read.
    #[error(
        "cannot read {}: {reason}; run `fretwear verify`: if it reports damage, `fretwear run` rewrites the file, else continue the run with fretwear {program_version}, which made it",
        path.display()
    )]
    Plan {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
        /// Version of the program of the last start on record.
        program_version: String,
    },
    /// An iteration that is not, or no longer, there.
    #[error("{} has no iteration {wear_iteration}; it has {}", path.display(), ranges(remaining))]
    NoIteration {
        /// The run.
        path: PathBuf,
        /// The iteration asked for.
        wear_iteration: u64,
        /// The iterations it has, ascending.
        remaining: Vec<u64>,
    },
    /// A table that an iteration, or the run, does not have.
    #[error("{} has no table `{table}`; it has {}", path.display(), known.join(", "))]
    NoTable {
        /// The folder asked.
        path: PathBuf,
        /// The table asked for.
        table: String,
        /// The tables there are.
        known: Vec<String>,
    },
    /// A draft of another iteration than the next.
    #[error("iteration {wear_iteration} cannot be written now; the next of {} is {next}", path.display())]
    OutOfOrder {
        /// The run.
        path: PathBuf,
        /// The iteration asked for.
        wear_iteration: u64,
        /// The one that may be written.
        next: u64,
    },
    /// A table with other columns than in the iteration before.
    #[error(
        "the table `{table}` of iteration {wear_iteration} would have the columns {}; in the iteration before it has {}",
        found.join(", "), expected.join(", ")
    )]
    ColumnsChanged {
        /// The table.
        table: String,
        /// The iteration to be committed.
        wear_iteration: u64,
        /// Its columns.
        found: Vec<String>,
        /// Those before.
        expected: Vec<String>,
    },
    /// Too little room on the disk.
    #[error("{} has {free} bytes of free space; {needed} are needed", path.display())]
    NoSpace {
        /// Where the bytes were to go.
        path: PathBuf,
        /// Bytes that are free.
        free: u64,
        /// Bytes that are needed.
        needed: u64,
    },
    /// A sibling run that was killed while its beginning was copied, opened without its source.
    #[error(
        "{} is an unfinished copy of {source_run}, iteration {wear_iteration}; start it again with --from {source_run}@{wear_iteration}",
        path.display()
    )]
    UnfinishedSibling {
        /// The run.
        path: PathBuf,
        /// Name of the run it was copied from.
        source_run: String,
        /// The iteration it was to begin from.
        wear_iteration: u64,
    },
    /// A run that exists and did not begin where `--from` says.
    #[error("{} exists and began {found}, not from {expected}; give another folder", path.display())]
    OtherOrigin {
        /// The run.
        path: PathBuf,
        /// Where it began.
        found: String,
        /// Where it should have begun.
        expected: String,
    },
    /// A table that breaks its schema, or a file that holds another.
    #[error("{}: {source}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: Box<TableError>,
    },
    /// A value that has no JSON form.
    #[error("{} cannot be written as JSON: {source}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: serde_json::Error,
    },
}

impl StoreError {
    /// True for a damaged or mismatched run, as against a failure of the system or of the program.
    pub fn is_damage_or_mismatch(&self) -> bool {
        match self {
            StoreError::SceneChanged { .. }
            | StoreError::NotInherited { .. }
            | StoreError::NotARun { .. }
            | StoreError::NotPlain { .. }
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

/// One file of a run, and what is wrong with it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: {kind}", path.display())]
pub struct Damage {
    /// The file or folder.
    pub path: PathBuf,
    /// What is wrong.
    pub kind: DamageKind,
}

/// What is wrong with a file of a run.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DamageKind {
    /// It is not there.
    #[error("missing")]
    Missing,
    /// It has another length than its commit says.
    #[error("{found} bytes long, {expected} were committed")]
    Size {
        /// Length committed.
        expected: u64,
        /// Length found.
        found: u64,
    },
    /// It has another content than its commit says.
    #[error("content has hash {found}, {expected} was committed")]
    Hash {
        /// Hash committed.
        expected: String,
        /// Hash of what is there.
        found: String,
    },
    /// It is not the JSON it should be.
    #[error("not readable ({reason})")]
    Unreadable {
        /// The reader's complaint.
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
    /// A commit whose parent is not the one before it.
    #[error(
        "follows {}, but the iteration before it is {}",
        hash(found),
        hash(expected)
    )]
    Parent {
        /// Hash of the iteration before.
        expected: Option<String>,
        /// Hash that the commit names.
        found: Option<String>,
    },
    /// Sound in itself, but after one that is not.
    #[error("follows the damaged iteration {0}")]
    After(u64),
}

const EDITED: &str = "the scene.toml in it is not as the run wrote it: remove it, and `--run` alone continues with the scene stored in run.json; or ";

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

/// The items one after the other.
pub(super) fn list<T: Display>(items: &[T]) -> String {
    items
        .iter()
        .map(ToString::to_string)
        .collect::<Vec<_>>()
        .join("; ")
}

/// Ascending numbers, with unbroken stretches drawn together: `0, 50, 98-100`.
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
