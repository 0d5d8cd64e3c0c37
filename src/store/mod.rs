//! The run store: what a run leaves on disk, and how it survives being killed.
//!
//! ```text
//! runs/<name>/
//!   scene.toml plan.json run.json lock     the scene as resolved, what was decided, who computes; one writer
//!   run.copy.json                          `run.json` again: nothing else could stand in for it
//!   schemas.json                           what the columns of all tables mean
//!   history.parquet                        a row an iteration with its one-row tables, pruned ones too
//!   once/          surface.parquet surface.json …               written once a run, each with the key of its stage
//!   iterations/    wear_iteration=0/ …/ commit.json             one folder a committed state
//!   staging/       the draft; never scanned by readers
//!   damaged/       what did not verify and was set aside
//! ```
//!
//! Nothing exists until it is committed. A draft's tables are written in `staging/`. To commit them they are synced,
//! `commit.json` is written and synced last, and the folder is renamed into `iterations/`. A commit names the hash of every file
//! and of its parent, so the latest state is the highest commit whose chain verifies, never the newest file. `run.json` is
//! written last when a run is created: a folder without it is no run yet and is completed by the next start.
//!
//! A run folder may come from anywhere. No link in it is followed, names of files come from the list of tables and not from what
//! a file says, lengths are looked at before anything is read, and iterations are counted by the folders that are there. Whatever
//! is committed is under a hash: tables under that of their commit, a JSON file under the one at its own end (`sealed.rs`), `history.parquet` likewise
//! (`history.rs`), `scene.toml`, `plan.json` and `schemas.json` under what `run.json` says of them. A draft in staging is checked before it is used.
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
pub use draft::{Draft, DraftEntry, Recompute};
pub use error::{Damage, DamageKind, StoreError};
pub use file_system::{
    Entry, EntryKind, FileSystem, LockAttempt, LockGuard, LockHolder, Metadata, RealFileSystem,
    is_unread,
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
