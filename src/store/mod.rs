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
//! Nothing counts before it is committed. The tables of a draft are written to `staging/`. A commit syncs them, writes
//! and syncs `commit.json`, and then renames the folder into `iterations/`. A commit stores the hash of each of its
//! files and of its parent. The latest state is therefore the highest commit whose chain verifies, never the newest
//! file. A new run gets its `run.json` last: a folder without it is not a run yet, and the next start completes it.
//!
//! A run folder may come from anyone. The store follows no link in it, takes file names from the list of tables and not
//! from the files, checks lengths before it reads, and counts iterations by their folders. A hash protects all
//! committed data: the hash in the commit for tables, the hash at the end of a JSON file (`sealed.rs`) and of
//! `history.parquet` (`history.rs`), and the hashes in `run.json` for `scene.toml`, `plan.json` and `schemas.json`. A
//! draft in `staging/` is checked before it is used.
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
