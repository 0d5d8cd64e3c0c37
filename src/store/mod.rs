//! The run store: the files of a run, and how they survive a killed process.
//!
//! ```text
//! runs/<name>/
//!   scene.toml plan.json run.json lock     resolved scene, decisions, record of the run, lock of its writer
//!   run.copy.json                          a copy of `run.json`, because no other file could replace it
//!   schemas.json                           the meaning of the columns of all tables
//!   history.parquet                        one row per iteration with its one-row tables, pruned iterations included
//!   once/          surface.parquet surface.json …               tables written once per run, and their stage keys
//!   iterations/    wear_iteration=0/ …/ commit.json             one folder per committed state
//!   staging/       the draft, which readers ignore
//!   damaged/       files that did not verify and were set aside
//! ```
//!
//! The store ignores an iteration until the iteration is committed. A stage writes the tables of a draft to `staging/`.
//! A commit first syncs the tables of the draft. The commit then writes and syncs `commit.json`, and finally moves the
//! folder of the draft into `iterations/`. `commit.json` stores the hash of each file of the iteration and the hash of
//! the previous commit. The latest state is the highest commit whose chain verifies, even if other files are newer. The
//! store writes `run.json` of a new run last. A folder without `run.json` is not a run yet, and the next start
//! completes the folder.
//!
//! A run folder may come from anyone. The store follows no link in a run folder. The store takes file names from the
//! list of tables and not from the files. The store checks the length of a file before reading, and counts iterations
//! by the folders in `iterations/`. A hash protects all committed data. The commit contains the hashes of the tables. A
//! JSON file (`sealed.rs`) and `history.parquet` (`history.rs`) end with a hash. `run.json` contains the hashes of
//! `scene.toml`, `plan.json` and `schemas.json`. The store checks a draft in `staging/` before using the draft.
//!
//! All access goes through [`FileSystem`], so that tests can make any call fail.

mod cache;
mod chain;
mod commit;
pub mod date;
mod draft;
mod error;
mod file_system;
mod files;
mod history;
mod inspection;
mod key;
mod layout;
mod open;
mod parts;
mod reader;
mod record;
mod record_file;
mod remove;
mod run;
mod sealed;
mod sibling;
mod survey;
mod unsynced;

pub use cache::Cache;
pub use chain::{CommitReport, OnceReport, VerifyReport};
pub use commit::{Commit, TableEntry};
pub use draft::{Draft, Recompute, StoredResult};
pub use error::{Damage, DamageKind, StoreError};
pub use file_system::{
    Entry, EntryKind, FileSystem, LockAttempt, LockGuard, LockHolder, Metadata, RealFileSystem,
    is_read_failure,
};
pub use history::{History, StageCost, is_in_history};
pub use key::StageKey;
pub use layout::{Layout, table_file};
pub use open::{DamagedIteration, Opening};
pub use reader::RunReader;
pub use record::{Continuation, Failure, LAYOUT, Machine, Origin, RunIdentity, RunRecord};
pub use record_file::{SceneOfRun, check_plan};
pub use remove::remove_run;
pub use run::{Keep, RunStore};
pub use unsynced::{UnsyncedFileSystem, sync_all};
